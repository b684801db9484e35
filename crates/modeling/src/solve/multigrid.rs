//! Multigrid with multipliers: H plus rho times the squares of the rows, on every level, as a V-cycle inside conjugate
//! gradients. Nothing is dense but the coarsest level: any number of rows, hard or soft, and any stiffness.

use super::bpx::dense_factor;
use super::cholesky::{Cholesky, dot, start};
use super::correct::Correct;
use super::green::{Green, Inverse};
use super::transfer::Transfer;
use crate::constraint::Functional;
use crate::energy::{Energy, Operator, Scratch, Stiffness};
use crate::fit::Normal;
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
    r2: Vec<f64>,
    fresh: bool,
}

/// How much stiffer than H the hard rows are made.
const RHO: f64 = 100.0;

/// The levels of H + sum of weighted squares of rows, finest first.
pub(crate) struct Cycle {
    levels: Vec<Level>,
    transfers: Vec<Transfer>,
    coarse: Cholesky,
    k: usize,
    work: Vec<f64>,
}

struct Level {
    h: Operator,
    n: usize,
    rows: Arc<SparseRows>,
    weights: Arc<Vec<f64>>,
    /// Sums over scattered data.
    data: Option<Arc<Normal>>,
    inverse: Vec<f64>,
    /// Largest eigenvalue of D^-1 H.
    largest: f64,
    b: Vec<f64>,
    x: Vec<f64>,
    d: Vec<f64>,
    t: Vec<f64>,
    scratch: Scratch,
}

/// Rows of entries over all unknowns of a level.
#[derive(Debug, Default)]
pub(crate) struct SparseRows {
    starts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl SparseRows {
    fn push(&mut self, entries: impl Iterator<Item = (usize, f64)>) {
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        for (c, v) in entries.filter(|e| e.1 != 0.0) {
            self.columns.push(c as u32);
            self.values.push(v);
        }
        self.starts.push(self.columns.len());
    }

    fn row(&self, r: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[r]..self.starts[r + 1];
        self.columns[range.clone()].iter().zip(&self.values[range]).map(|(c, v)| (*c as usize, *v))
    }

    fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }
}

impl Level {
    /// `y = (H + A^T W A) x`.
    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        for (x, y) in x.chunks_exact(self.n).zip(y.chunks_exact_mut(self.n)) {
            self.h.apply(x, y, &mut self.scratch);
        }
        for (r, w) in self.weights.iter().enumerate() {
            let value: f64 = self.rows.row(r).map(|(c, v)| v * x[c]).sum();
            let by = w * value;
            self.rows.row(r).for_each(|(c, v)| y[c] += by * v);
        }
        if let Some(data) = &self.data {
            data.add(x, y);
        }
    }

    /// Chebyshev smoothing of (H + A^T W A) x = b; `zero` when x is zero on entry.
    fn smooth(&mut self, zero: bool) {
        let (upper, lower) = (1.05 * self.largest, self.largest / 8.0);
        let (theta, delta) = (0.5 * (upper + lower), 0.5 * (upper - lower));
        let sigma = theta / delta;
        let mut rho = 1.0 / sigma;
        let mut x = std::mem::take(&mut self.x);
        let mut t = std::mem::take(&mut self.t);
        for step in 0..DEGREE {
            if zero && step == 0 {
                t.copy_from_slice(&self.b);
            } else {
                self.apply(&x, &mut t);
                t.iter_mut().zip(&self.b).for_each(|(t, b)| *t = b - *t);
            }
            if step == 0 {
                for ((d, t), i) in self.d.iter_mut().zip(&t).zip(&self.inverse) {
                    *d = t * i / theta;
                }
            } else {
                let next = 1.0 / (2.0 * sigma - rho);
                let (a, b) = (next * rho, 2.0 * next / delta);
                for ((d, t), i) in self.d.iter_mut().zip(&t).zip(&self.inverse) {
                    *d = a * *d + b * t * i;
                }
                rho = next;
            }
            x.iter_mut().zip(&self.d).for_each(|(x, d)| *x += d);
        }
        self.x = x;
        self.t = t;
    }
}

const DEGREE: usize = 2;

impl Cycle {
    /// `None` where no coarse level is small enough.
    pub(crate) fn new(
        space: &Space,
        energy: &Energy,
        stiffness: Option<&Stiffness>,
        h: &Operator,
        structure: Option<&Structure>,
        weights: &[f64],
    ) -> Option<Cycle> {
        Cycle::build(space, energy, stiffness, h, structure, weights, &[])
    }

    /// H plus sums over scattered data, given for every level down to 60 coefficients or odd spans.
    pub(crate) fn with_data(space: &Space, energy: &Energy, h: &Operator, data: &[Arc<Normal>]) -> Option<Cycle> {
        Cycle::build(space, energy, None, h, None, &[], data)
    }

    fn build(
        space: &Space,
        energy: &Energy,
        stiffness: Option<&Stiffness>,
        h: &Operator,
        structure: Option<&Structure>,
        weights: &[f64],
        data: &[Arc<Normal>],
    ) -> Option<Cycle> {
        let k = structure.map_or(1, |s| s.k);
        let weights = Arc::new(weights.to_vec());
        let mut levels = Vec::new();
        let mut transfers = Vec::new();
        let (mut now, mut map, mut operator) = (space.clone(), stiffness.cloned(), h.clone());
        loop {
            let n = now.len();
            let mut rows = SparseRows::default();
            if let Some(structure) = structure {
                let on: Vec<_> = structure.functionals.iter().map(|f| f.on(&now)).collect();
                for terms in &structure.terms {
                    let of = |&(c, f, by): &(usize, usize, f64)| {
                        on[f].entries().map(move |(i, v)| (c * n + i, by * v)).collect::<Vec<_>>()
                    };
                    rows.push(terms.iter().flat_map(of));
                }
            }
            let coarser = now.coarser().filter(|_| n > 60);
            let Some(coarser) = coarser else {
                if n * k > 3000 {
                    return None;
                }
                let data = data.get(levels.len());
                let coarse = match structure {
                    None if data.is_none() => dense_factor(&operator, energy)?,
                    _ => coarsest(&operator, &rows, &weights, k, data.map(|d| &**d))?,
                };
                return Some(Cycle { levels, transfers, coarse, k, work: Vec::new() });
            };
            let mut diagonal: Vec<f64> = operator.diagonal().repeat(k);
            for (r, w) in weights.iter().enumerate() {
                // repeated columns of short axes add before they are squared; this bound is on the safe side
                rows.row(r).for_each(|(c, v)| diagonal[c] += w * v * v);
            }
            let data = data.get(levels.len()).cloned();
            if let Some(data) = &data {
                diagonal.iter_mut().zip(data.diagonal()).for_each(|(d, v)| *d += v);
            }
            let zeros = vec![0.0; n * k];
            let mut level = Level {
                h: operator,
                n,
                rows: Arc::new(rows),
                weights: weights.clone(),
                data,
                inverse: diagonal.into_iter().map(|d| 1.0 / d).collect(),
                largest: 1.0,
                b: zeros.clone(),
                x: zeros.clone(),
                d: zeros.clone(),
                t: zeros,
                scratch: Scratch::default(),
            };
            level.largest = largest(&mut level);
            levels.push(level);
            transfers.push(Transfer::new(&coarser));
            let cells: Vec<usize> = coarser.axes().iter().map(crate::axis::Axis::spans).collect();
            map = map.map(|m| m.coarser(if cells.len() == 2 { [cells[0], cells[1]] } else { [1, cells[0]] }));
            operator = Operator::new(&coarser, energy, map.as_ref());
            now = coarser;
        }
    }

    /// `y = (H + A^T W A) x` on the finest level.
    pub(crate) fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        if let Some(level) = self.levels.first_mut() {
            level.apply(x, y);
        }
    }

    /// True where there is nothing but the coarsest level.
    pub(crate) fn is_direct(&self) -> bool {
        self.levels.is_empty()
    }

    /// Conjugate gradients on (H + data) x = b from the given x, to a relative residual (in the cycle's norm).
    pub(crate) fn conjugate_gradients(&mut self, b: &[f64], x: &mut [f64], tolerance: f64, most: usize) {
        if self.is_direct() {
            self.cycle(b, x);
            return;
        }
        let n = b.len();
        let (mut r, mut z, mut p, mut hp) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        self.cycle(b, &mut z);
        let goal = dot(b, &z) * tolerance * tolerance;
        self.apply(x, &mut hp);
        r.iter_mut().zip(b).zip(&hp).for_each(|((r, b), h)| *r = b - h);
        self.cycle(&r, &mut z);
        let mut rz = dot(&r, &z);
        p.copy_from_slice(&z);
        for _ in 0..most {
            if rz <= goal || rz.is_nan() {
                break;
            }
            self.apply(&p, &mut hp);
            let curvature = dot(&p, &hp);
            if curvature <= 0.0 || !curvature.is_finite() {
                break;
            }
            let alpha = rz / curvature;
            x.iter_mut().zip(&p).for_each(|(x, p)| *x += alpha * p);
            r.iter_mut().zip(&hp).for_each(|(r, h)| *r -= alpha * h);
            self.cycle(&r, &mut z);
            let old = rz;
            rz = dot(&r, &z);
            let beta = rz / old;
            p.iter_mut().zip(&z).for_each(|(p, z)| *p = z + beta * *p);
        }
    }

    /// One V-cycle from zero: an approximate inverse, symmetric.
    pub(crate) fn cycle(&mut self, r: &[f64], z: &mut [f64]) {
        if self.levels.is_empty() {
            z.copy_from_slice(r);
            self.coarse.forward(z);
            self.coarse.backward(z);
            return;
        }
        self.levels[0].b.copy_from_slice(r);
        self.descend(0);
        z.copy_from_slice(&self.levels[0].x);
    }

    fn descend(&mut self, i: usize) {
        let k = self.k;
        let level = &mut self.levels[i];
        level.x.fill(0.0);
        level.smooth(true);
        let x = std::mem::take(&mut level.x);
        let mut t = std::mem::take(&mut level.t);
        level.apply(&x, &mut t);
        t.iter_mut().zip(&level.b).for_each(|(t, b)| *t = b - *t);
        let n = level.n;
        let last = i + 1 == self.levels.len();
        let coarse = if last { self.coarse.len() / k } else { self.levels[i + 1].n };
        let mut b = if last { vec![0.0; coarse * k] } else { std::mem::take(&mut self.levels[i + 1].b) };
        for (t, b) in t.chunks_exact(n).zip(b.chunks_exact_mut(coarse)) {
            self.transfers[i].restrict(t, b, &mut self.work);
        }
        let solution = if last {
            self.coarse.forward(&mut b);
            self.coarse.backward(&mut b);
            b
        } else {
            self.levels[i + 1].b = b;
            self.descend(i + 1);
            std::mem::take(&mut self.levels[i + 1].x)
        };
        for (s, t) in solution.chunks_exact(coarse).zip(t.chunks_exact_mut(n)) {
            self.transfers[i].refine(s, t, &mut self.work);
        }
        if !last {
            self.levels[i + 1].x = solution;
        }
        let level = &mut self.levels[i];
        level.x = x;
        level.x.iter_mut().zip(&t).for_each(|(x, t)| *x += t);
        level.t = t;
        level.smooth(false);
    }
}

fn coarsest(h: &Operator, rows: &SparseRows, weights: &[f64], k: usize, data: Option<&Normal>) -> Option<Cholesky> {
    let n = h.len();
    let mut packed = vec![0.0; start(n * k)];
    let mut size = 0.0_f64;
    h.entries(|r, c, v| {
        for i in 0..k {
            packed[start(i * n + r) + i * n + c] += v;
        }
        if r == c {
            size = size.max(v);
        }
    });
    for (r, w) in weights.iter().enumerate().take(rows.len()) {
        for (c, v) in rows.row(r) {
            for (d, u) in rows.row(r).filter(|e| e.0 <= c) {
                packed[start(c) + d] += w * v * u;
            }
        }
    }
    if let Some(data) = data {
        data.entries(|r, c, v| packed[start(r) + c] += v);
    }
    Cholesky::new(&packed, n * k).ok().or_else(|| {
        (0..n * k).for_each(|i| packed[start(i) + i] += 1e-10 * size);
        Cholesky::new(&packed, n * k).ok()
    })
}

/// The largest eigenvalue of D^-1 (H + A^T W A), by a dozen power steps from a rough start.
fn largest(level: &mut Level) -> f64 {
    let n = level.inverse.len();
    let mut x: Vec<f64> = (0..n).map(|i| ondelette_numerics::seed::unit(i as u64) - 0.5).collect();
    let mut y = vec![0.0; n];
    let mut value = 1.0;
    for _ in 0..12 {
        let norm = dot(&x, &x).sqrt();
        x.iter_mut().for_each(|x| *x /= norm);
        level.apply(&x, &mut y);
        y.iter_mut().zip(&level.inverse).for_each(|(y, d)| *y *= d);
        value = dot(&y, &y).sqrt();
        std::mem::swap(&mut x, &mut y);
    }
    value
}

/// A V-cycle of H alone as the inverse inside projected conjugate gradients: few iterations, but a cycle a row to
/// prepare.
pub(crate) struct CycleGreen {
    cycle: Cycle,
}

impl CycleGreen {
    /// `None` where the spans do not halve often enough.
    pub(crate) fn new(space: &Space, energy: &Energy, map: Option<&Stiffness>, h: &Operator) -> Option<CycleGreen> {
        Cycle::new(space, energy, map, h, None, &[]).map(|cycle| CycleGreen { cycle })
    }
}

impl Green for CycleGreen {
    fn apply(&mut self, r: &[f64], g: &mut [f64]) {
        self.cycle.cycle(r, g);
    }

    fn between(&mut self, functionals: &[Functional]) -> Vec<f64> {
        let n = self.cycle.levels.first().map_or(self.cycle.coarse.len(), |l| l.n);
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
        let cycle = Cycle::new(space, energy, map, h, Some(&structure), &stiffness)?;
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
            r2: Vec::new(),
            fresh: true,
        })
    }

    fn finish(&mut self) -> bool {
        let done = !(self.rz > self.goal && self.rz.is_finite()) || self.iterations >= self.most;
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
        self.finish()
    }

    fn correction(&self) -> (&[f64], &[f64]) {
        (&self.x, &self.l)
    }

    fn iterations(&self) -> usize {
        self.iterations
    }

    fn patience(&self) -> (usize, f64) {
        (400, 0.98)
    }
}
