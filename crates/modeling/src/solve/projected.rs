//! Conjugate gradients projected onto the constraints (Gould, Hribar and Nocedal 2001), with an inverse of H as
//! constraint preconditioner.
//!
//! The residual is updated by the multipliers in every step (r <- r - A^T v); without that the iteration drifts. An
//! exact inverse needs no iteration: the first projection is the solution.

use super::border::Border;
use super::cholesky::{dot, start};
use super::correct::Correct;
use super::gradients::Lanczos;
use super::green::{Green, Inverse};
use crate::energy::{Hessian, Scratch};
use crate::system::Structure;
use std::sync::Arc;

/// The solver of one structure. Vectors hold the unknowns and, behind them, the misses u of the soft rows: unknowns of
/// their own with the energy w u^2 and the rows `A x - u = b`.
pub(crate) struct Projected {
    h: Arc<dyn Hessian>,
    structure: Arc<Structure>,
    green: Box<dyn Green>,
    border: Border,
    /// Null space of H, one coordinate.
    null: Arc<Vec<Vec<f64>>>,
    soft: Vec<usize>,
    /// What costs nothing and no row sees, orthonormal: it stays where it is.
    free: Vec<Vec<f64>>,
    /// Trace of H.
    trace: f64,
    tolerance: f64,
    most: usize,
    x: Vec<f64>,
    multipliers: Vec<f64>,
    r: Vec<f64>,
    g: Vec<f64>,
    p: Vec<f64>,
    hp: Vec<f64>,
    v: Vec<f64>,
    q: Vec<f64>,
    c: Vec<f64>,
    held: Vec<f64>,
    rg: f64,
    goal: f64,
    /// The steps of the current correction, and the least eigenvalue that those of all have met: the energy left is
    /// that many times less than r g at worst.
    steps: Lanczos,
    least: f64,
    /// True where the goal is an energy; then what is recent: r g, oldest first, and what the last step brought.
    aimed: bool,
    recent: Vec<f64>,
    gain: f64,
    /// The smallest r g, halved at least, and when it was reached.
    best: f64,
    best_at: usize,
    /// Iterations of the current correction.
    iterations: usize,
    pending: Pending,
    scratch: Scratch,
}

/// Iterations without a halved residual after which rounding has the word.
const PATIENCE: usize = 2000;

/// A step is no longer than one over the least eigenvalue of preconditioner times matrix; one that would be has
/// nothing but rounding for a curvature.
const LONGEST: f64 = 1e14;

/// Steps by which it is judged how many are to come.
const RECENT: usize = 8;

/// Where r g falls slower than this, rounding is what keeps it up.
const SLOWEST: f64 = 0.999;

/// The energy left may be this many times the goal, which is far below what is promised.
const SLACK: f64 = 10.0;

/// What the next step does.
enum Pending {
    Start { r2: Vec<f64> },
    Iterate,
    Nothing,
}

/// Takes the parts along orthonormal vectors out of `x`.
fn remove(along: &[Vec<f64>], x: &mut [f64]) {
    for z in along {
        let by = dot(z, x);
        x.iter_mut().zip(z).for_each(|(x, z)| *x -= by * z);
    }
}

/// S = A P A^T + G of a structure, packed.
pub(crate) fn schur(structure: &Structure, green: &mut dyn Green) -> Vec<f64> {
    let table = green.between(&structure.functionals);
    let at = |a: usize, b: usize| if a >= b { table[start(a) + b] } else { table[start(b) + a] };
    let m = structure.rows();
    let mut out = Vec::with_capacity(start(m));
    for i in 0..m {
        for j in 0..=i {
            let mut sum = 0.0;
            for &(c, f, u) in &structure.terms[i] {
                for &(d, g, v) in &structure.terms[j] {
                    if c == d {
                        sum += u * v * at(f, g);
                    }
                }
            }
            out.push(if i == j { sum + structure.give[i] } else { sum });
        }
    }
    out
}

impl Projected {
    /// An error names the row without a pivot.
    pub(crate) fn new(
        h: Arc<dyn Hessian>,
        structure: Arc<Structure>,
        mut green: Box<dyn Green>,
        null: Arc<Vec<Vec<f64>>>,
        tolerance: f64,
        most: usize,
    ) -> Result<Projected, usize> {
        let m = structure.rows();
        let s = schur(&structure, &mut *green);
        let mut y = Vec::new();
        for c in 0..structure.k {
            y.extend(null.iter().map(|z| structure.sight(c, z)));
        }
        let border = Border::new(s, m, y)?;
        Ok(Projected::bordered(h, structure, green, null, border, tolerance, most))
    }

    /// The same with the matrix of the multipliers already factored.
    pub(crate) fn bordered(
        h: Arc<dyn Hessian>,
        structure: Arc<Structure>,
        green: Box<dyn Green>,
        null: Arc<Vec<Vec<f64>>>,
        border: Border,
        tolerance: f64,
        most: usize,
    ) -> Projected {
        let m = structure.rows();
        let soft: Vec<usize> = (0..m).filter(|r| structure.give[*r] > 0.0).collect();
        let mut free: Vec<Vec<f64>> = Vec::new();
        for w in &border.free {
            let mut z = vec![0.0; structure.unknowns() + soft.len()];
            for (i, by) in w.iter().enumerate() {
                let at = i / null.len() * structure.n;
                z[at..at + structure.n].iter_mut().zip(&null[i % null.len()]).for_each(|(z, n)| *z += by * n);
            }
            remove(&free, &mut z);
            let size = dot(&z, &z).sqrt();
            z.iter_mut().for_each(|z| *z /= size);
            free.push(z);
        }
        Projected {
            trace: h.trace() * structure.k as f64,
            h,
            structure,
            green,
            border,
            null,
            soft,
            free,
            tolerance,
            most,
            x: Vec::new(),
            multipliers: vec![0.0; m],
            r: Vec::new(),
            g: Vec::new(),
            p: Vec::new(),
            hp: Vec::new(),
            v: vec![0.0; m],
            q: Vec::new(),
            c: Vec::new(),
            held: Vec::new(),
            rg: 0.0,
            goal: 0.0,
            steps: Lanczos::default(),
            least: 1.0,
            aimed: false,
            recent: Vec::new(),
            gain: 0.0,
            best: f64::INFINITY,
            best_at: 0,
            iterations: 0,
            pending: Pending::Nothing,
            scratch: Scratch::default(),
        }
    }

    /// Iterates until the squared residual, in the preconditioner's norm, is below `goal`.
    ///
    /// That norm is the energy to be gained only if the preconditioner is good; where steps bring little, more of them
    /// are to come, and the goal is held against all of these.
    pub(crate) fn aim(&mut self, goal: f64) {
        self.goal = goal;
        self.aimed = true;
    }

    /// About the energy that is left to be gained: what the last step brought, times the steps to come.
    pub(crate) fn left(&self) -> f64 {
        let steps = self.recent.len().saturating_sub(1);
        if self.rg <= self.noise() || steps == 0 {
            return self.rg;
        }
        let share = (self.rg / self.recent[0]).powf(1.0 / steps as f64);
        self.rg.max(self.gain) / (1.0 - share.min(SLOWEST))
    }

    /// The energy that the rounding of the coefficients alone has, about.
    fn noise(&self) -> f64 {
        let size = self.x.iter().fold(0.0, |m: f64, v| m.max(v.abs())) * 1e-16;
        size * size * self.trace
    }

    fn len(&self) -> usize {
        self.structure.unknowns() + self.soft.len()
    }

    /// `held -= A^T v`, misses included.
    fn take_multipliers(structure: &Structure, soft: &[usize], v: &[f64], held: &mut [f64]) {
        structure.add_transposed(v, -1.0, held);
        let from = structure.unknowns();
        soft.iter().enumerate().for_each(|(i, r)| held[from + i] += v[*r]);
    }

    /// Writes g and v: `g = P (r - A^T v) + Z c`, `A g = d`, `Z^T (r - A^T v) = 0`; without `with_r`, r counts as zero.
    fn project(&mut self, d: Option<&[f64]>, with_r: bool) {
        let (n, k, nz) = (self.structure.n, self.structure.k, self.null.len());
        let all = self.structure.unknowns();
        self.v.fill(0.0);
        self.q.clear();
        self.q.resize(k * nz, 0.0);
        self.c.clear();
        self.c.resize(k * nz, 0.0);
        self.held.resize(self.len(), 0.0);
        self.g.resize(self.len(), 0.0);
        if with_r {
            for c in 0..k {
                self.green.apply(&self.r[c * n..][..n], &mut self.held[c * n..][..n]);
                for (i, z) in self.null.iter().enumerate() {
                    self.q[c * nz + i] = dot(z, &self.r[c * n..][..n]);
                }
            }
            self.structure.apply(&self.held, &mut self.v);
            for (i, row) in self.soft.iter().enumerate() {
                self.v[*row] -= self.structure.give[*row] * self.r[all + i];
            }
        }
        if let Some(d) = d {
            self.v.iter_mut().zip(d).for_each(|(v, d)| *v -= d);
        }
        self.border.solve(&mut self.v, &self.q, &mut self.c);
        if with_r {
            self.held.copy_from_slice(&self.r);
        } else {
            self.held.fill(0.0);
        }
        Self::take_multipliers(&self.structure, &self.soft, &self.v, &mut self.held);
        for c in 0..k {
            let g = &mut self.g[c * n..][..n];
            self.green.apply(&self.held[c * n..][..n], g);
            for (i, z) in self.null.iter().enumerate() {
                let by = self.c[c * nz + i];
                g.iter_mut().zip(z).for_each(|(g, z)| *g += by * z);
            }
        }
        for (i, row) in self.soft.iter().enumerate() {
            self.g[all + i] = self.structure.give[*row] * self.held[all + i];
        }
    }

    /// `hp = H p`, misses included.
    fn times(&mut self) {
        let (n, all) = (self.structure.n, self.structure.unknowns());
        self.hp.resize(self.p.len(), 0.0);
        for (x, y) in self.p[..all].chunks_exact(n).zip(self.hp[..all].chunks_exact_mut(n)) {
            self.h.times(x, y, &mut self.scratch);
        }
        for (i, row) in self.soft.iter().enumerate() {
            self.hp[all + i] = self.p[all + i] / self.structure.give[*row];
        }
    }

    fn start(&mut self, r2: &[f64]) -> bool {
        let zero = self.r.iter().all(|r| *r == 0.0);
        if self.green.inverse() == Inverse::Exact {
            self.project(Some(r2), !zero);
            std::mem::swap(&mut self.x, &mut self.g);
            self.multipliers.clone_from(&self.v);
            return true;
        }
        // A point on the constraints, then the residual there.
        self.project(Some(r2), false);
        self.x.clone_from(&self.g);
        self.p.clone_from(&self.g);
        self.times();
        let energy = dot(&self.p, &self.hp).abs();
        self.r.iter_mut().zip(&self.hp).for_each(|(r, h)| *r -= h);
        self.multipliers.fill(0.0);
        self.advance_residual();
        self.p.clone_from(&self.g);
        self.recent.push(self.rg);
        if self.goal == 0.0 {
            // Curves are refined further than rounding, by residuals of twice the precision.
            let noise = if self.h.is_surface() { self.noise() } else { 0.0 };
            self.goal = (energy.max(self.rg) * self.tolerance * self.tolerance).max(noise);
        }
        self.finished()
    }

    /// Projects the residual and takes its multipliers out of it.
    fn advance_residual(&mut self) {
        self.project(None, true);
        Self::take_multipliers(&self.structure, &self.soft, &self.v, &mut self.r);
        self.multipliers.iter_mut().zip(&self.v).for_each(|(m, v)| *m += v);
        remove(&self.free, &mut self.r);
        remove(&self.free, &mut self.g);
        self.rg = dot(&self.r, &self.g);
        if self.rg < 0.5 * self.best {
            self.best = self.rg;
            self.best_at = self.iterations;
        }
    }

    fn finished(&mut self) -> bool {
        let lost = self.iterations > self.best_at + PATIENCE;
        if self.aimed && self.rg <= self.goal && self.left() > SLACK * self.goal {
            return lost || self.iterations >= self.most;
        }
        if lost || self.iterations >= self.most || !self.rg.is_finite() {
            return true;
        }
        if self.rg > self.goal {
            return false;
        }
        if self.aimed || !self.h.is_surface() {
            return true;
        }
        // Known only now, when it matters.
        self.least = self.least.min(self.steps.least());
        self.rg <= (self.goal * self.least).max(self.noise())
    }

    fn iterate(&mut self) -> bool {
        self.times();
        let curvature = dot(&self.p, &self.hp);
        if !(curvature > 0.0 && curvature.is_finite()) {
            return true;
        }
        let alpha = self.rg / curvature;
        if alpha > LONGEST {
            return true;
        }
        self.x.iter_mut().zip(&self.p).for_each(|(x, p)| *x += alpha * p);
        self.r.iter_mut().zip(&self.hp).for_each(|(r, h)| *r -= alpha * h);
        let old = self.rg;
        self.advance_residual();
        if self.aimed {
            self.gain = alpha * old;
            if self.recent.len() > RECENT {
                self.recent.remove(0);
            }
            self.recent.push(self.rg);
        }
        let beta = self.rg / old;
        if !self.aimed {
            self.steps.push(alpha, beta);
        }
        self.p.iter_mut().zip(&self.g).for_each(|(p, g)| *p = g + beta * *p);
        self.iterations += 1;
        self.finished()
    }
}

impl Correct for Projected {
    fn begin(&mut self, r1: &[f64], r2: &[f64]) {
        self.r.clear();
        self.r.extend_from_slice(r1);
        self.r.resize(self.len(), 0.0);
        self.iterations = 0;
        self.best = f64::INFINITY;
        self.best_at = 0;
        self.recent.clear();
        self.steps = Lanczos::default();
        self.pending = Pending::Start { r2: r2.to_vec() };
    }

    fn step(&mut self) -> bool {
        let done = match std::mem::replace(&mut self.pending, Pending::Nothing) {
            Pending::Start { r2 } => self.start(&r2),
            Pending::Iterate => self.iterate(),
            Pending::Nothing => true,
        };
        if !done {
            self.pending = Pending::Iterate;
        }
        done
    }

    fn correction(&self) -> (&[f64], &[f64]) {
        (&self.x[..self.structure.unknowns()], &self.multipliers)
    }

    fn restart(&mut self) {
        self.goal = 0.0;
    }

    fn iterations(&self) -> usize {
        self.iterations
    }

    fn follows_multipliers(&self) -> bool {
        self.green.inverse() == Inverse::Exact && self.h.is_surface()
    }
}
