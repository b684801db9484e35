//! Multigrid with multipliers: H plus rho times the squares of the rows, on every level, as a V-cycle inside conjugate
//! gradients. Nothing is dense but the coarsest level: any number of rows, hard or soft, and any stiffness.

use super::cholesky::{dot, start};
use super::correct::Correct;
use super::cycle::{Added, Cycle};
use super::green::{Green, Inverse};
use crate::constraint::Functional;
use crate::energy::{Energy, Operator, Stiffness};
use crate::system::{Space, Structure};
use std::sync::Arc;

/// The solver of one structure.
pub(crate) struct Multigrid {
    structure: Arc<Structure>,
    cycle: Cycle,
    stiffness: Vec<f64>,
    tolerance: f64,
    most: usize,
    x: Vec<f64>,
    l: Vec<f64>,
    r: Vec<f64>,
    z: Vec<f64>,
    p: Vec<f64>,
    hp: Vec<f64>,
    rz: f64,
    goal: f64,
    iterations: usize,
    /// Iterations of all corrections of a right-hand side.
    spent: usize,
    r2: Vec<f64>,
    fresh: bool,
}

/// How much stiffer than H the hard rows are made.
const RHO: f64 = 100.0;

/// Iterations after which a right-hand side is given up.
const WORK: usize = 5000;

/// A V-cycle of H alone as the inverse inside projected conjugate gradients: few iterations, but a cycle a row to
/// prepare.
pub(crate) struct CycleGreen {
    cycle: Cycle,
}

impl CycleGreen {
    /// `None` where the spans do not halve often enough.
    pub(crate) fn new(space: &Space, energy: &Energy, map: Option<&Stiffness>, h: &Operator) -> Option<CycleGreen> {
        Cycle::new(space, energy, map, h, Added::Nothing).map(|cycle| CycleGreen { cycle })
    }
}

impl Green for CycleGreen {
    fn apply(&mut self, r: &[f64], g: &mut [f64]) {
        self.cycle.cycle(r, g);
    }

    fn between(&mut self, functionals: &[Functional]) -> Vec<f64> {
        let n = self.cycle.len();
        let mut out = Vec::with_capacity(start(functionals.len()));
        let (mut row, mut column) = (vec![0.0; n], vec![0.0; n]);
        for (i, f) in functionals.iter().enumerate() {
            f.entries().for_each(|(i, v)| row[i] += v);
            self.cycle.cycle(&row, &mut column);
            f.entries().for_each(|(i, _)| row[i] = 0.0);
            out.extend(functionals[..=i].iter().map(|g| g.apply(&column)));
        }
        out
    }

    fn inverse(&self) -> Inverse {
        if self.cycle.is_direct() { Inverse::Exact } else { Inverse::Approximate }
    }
}

impl Multigrid {
    /// `None` where the spans do not halve often enough.
    pub(crate) fn new(
        space: &Space,
        energy: &Energy,
        map: Option<&Stiffness>,
        h: &Operator,
        structure: Arc<Structure>,
        tolerance: f64,
        most: usize,
    ) -> Option<Multigrid> {
        let size = h.diagonal().into_iter().fold(0.0, f64::max);
        let stiffness: Vec<f64> = structure.give.iter().map(|g| if *g > 0.0 { 1.0 / g } else { RHO * size }).collect();
        let cycle = Cycle::new(space, energy, map, h, Added::Rows(&structure, &stiffness))?;
        let zeros = vec![0.0; structure.unknowns()];
        Some(Multigrid {
            l: vec![0.0; structure.rows()],
            structure,
            cycle,
            stiffness,
            tolerance,
            most,
            x: zeros.clone(),
            r: zeros.clone(),
            z: zeros.clone(),
            p: zeros.clone(),
            hp: zeros,
            rz: 0.0,
            goal: 0.0,
            iterations: 0,
            spent: 0,
            r2: Vec::new(),
            fresh: true,
        })
    }

    fn finish(&mut self) -> bool {
        let done = !(self.rz > self.goal && self.rz.is_finite()) || self.iterations >= self.most.min(WORK);
        if done {
            for (r, l) in self.l.iter_mut().enumerate() {
                *l = self.stiffness[r] * (self.structure.apply_row(r, &self.x) - self.r2[r]);
            }
        }
        done
    }
}

impl Correct for Multigrid {
    fn begin(&mut self, r1: &[f64], r2: &[f64]) {
        self.r.copy_from_slice(r1);
        self.r2 = r2.to_vec();
        let forces: Vec<f64> = r2.iter().zip(&self.stiffness).map(|(r, s)| r * s).collect();
        self.structure.add_transposed(&forces, 1.0, &mut self.r);
        self.x.fill(0.0);
        self.iterations = 0;
        self.fresh = true;
    }

    fn step(&mut self) -> bool {
        if self.fresh {
            self.fresh = false;
            self.cycle.cycle(&self.r, &mut self.z);
            if self.cycle.is_direct() {
                self.x.copy_from_slice(&self.z);
                self.rz = 0.0;
                return self.finish();
            }
            self.rz = dot(&self.r, &self.z);
            self.goal = self.rz * self.tolerance * self.tolerance;
            self.p.copy_from_slice(&self.z);
            return self.finish();
        }
        self.cycle.apply(&self.p, &mut self.hp);
        let curvature = dot(&self.p, &self.hp);
        if !(curvature > 0.0 && curvature.is_finite()) {
            self.rz = 0.0;
            return self.finish();
        }
        let alpha = self.rz / curvature;
        self.x.iter_mut().zip(&self.p).for_each(|(x, p)| *x += alpha * p);
        self.r.iter_mut().zip(&self.hp).for_each(|(r, h)| *r -= alpha * h);
        self.cycle.cycle(&self.r, &mut self.z);
        let old = self.rz;
        self.rz = dot(&self.r, &self.z);
        let beta = self.rz / old;
        self.p.iter_mut().zip(&self.z).for_each(|(p, z)| *p = z + beta * *p);
        self.iterations += 1;
        self.spent += 1;
        self.finish()
    }

    fn correction(&self) -> (&[f64], &[f64]) {
        (&self.x, &self.l)
    }

    fn iterations(&self) -> usize {
        self.iterations
    }

    fn restart(&mut self) {
        self.spent = 0;
    }

    fn patience(&self, _met: bool) -> (usize, f64) {
        // Multipliers come slowly; but where cycles hardly help there is no end to it.
        if self.spent > WORK { (1, 0.98) } else { (400, 0.98) }
    }
}
