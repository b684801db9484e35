//! The V-cycle: levels of H plus weighted squares of rows or sums over data, smoothed by Chebyshev polynomials.

use super::bpx::dense_factor;
use super::cholesky::{Cholesky, dot, start};
use super::strip::Strip;
use super::transfer::Transfer;
use crate::axis::Axis;
use crate::energy::{Energy, Operator, Scratch, Stiffness};
use crate::fit::Normal;
use crate::system::{Space, Structure};
use std::sync::Arc;

/// The levels of H + sum of weighted squares of rows, finest first.
pub(crate) struct Cycle {
    levels: Vec<Level>,
    /// What the factor is of, where there is nothing else.
    only: Option<Box<Level>>,
    transfers: Vec<Transfer>,
    coarse: Coarsest,
    k: usize,
    work: Vec<f64>,
}

/// The factor of the coarsest level.
enum Coarsest {
    Dense(Cholesky),
    /// Of a grid that is narrow along its second axis.
    Rows(Strip),
    /// Of a grid of so many columns that is narrow along its first axis: numbered the other way round.
    Columns(Strip, usize),
}

impl Coarsest {
    fn len(&self) -> usize {
        match self {
            Coarsest::Dense(factor) => factor.len(),
            Coarsest::Rows(strip) | Coarsest::Columns(strip, _) => strip.len(),
        }
    }

    fn solve(&self, x: &mut [f64]) {
        match self {
            Coarsest::Dense(factor) => {
                factor.forward(x);
                factor.backward(x);
            }
            Coarsest::Rows(strip) => strip.solve(x),
            Coarsest::Columns(strip, columns) => {
                let rows = x.len() / columns;
                let mut turned: Vec<f64> = (0..x.len()).map(|i| x[i % rows * columns + i / rows]).collect();
                strip.solve(&mut turned);
                (0..x.len()).for_each(|i| x[i] = turned[i % columns * rows + i / columns]);
            }
        }
    }
}

/// The next coarser space of a fit, down to 60 coefficients or a strip of one span: half the spans of both axes,
/// or of the one whose spans are at most half as long as the other's. So the energy is about as steep along both where
/// both are halved, and smoothing point by point works whatever the aspect.
pub(crate) fn coarser(space: &Space) -> Option<Space> {
    let &[s, t] = space.axes() else { return space.coarser() };
    let half = |a: &Axis| {
        let even = a.spans().is_multiple_of(2);
        even.then(|| Axis::new(a.boundary(), a.spans() / 2, a.domain()).ok()).flatten()
    };
    let ratio = s.density() / t.density();
    let next = if ratio > 0.5 && ratio < 2.0 {
        (half(&s)?, half(&t)?)
    } else if ratio >= 2.0 {
        (half(&s)?, t)
    } else {
        (s, half(&t)?)
    };
    Some(Space::surface(next.0, next.1))
}

/// What is added to H.
pub(crate) enum Added<'a> {
    /// Nothing.
    Nothing,
    /// Squares of rows, each with a weight.
    Rows(&'a Structure, &'a [f64]),
    /// Sums over scattered data, finest first.
    Data(&'a [Arc<Normal>]),
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
    fn new(h: Operator, rows: SparseRows, weights: Arc<Vec<f64>>, data: Option<Arc<Normal>>, k: usize) -> Level {
        let n = h.len();
        let mut diagonal: Vec<f64> = h.diagonal().repeat(k);
        for (r, w) in weights.iter().enumerate() {
            // repeated columns of short axes add before they are squared; this bound is on the safe side
            rows.row(r).for_each(|(c, v)| diagonal[c] += w * v * v);
        }
        if let Some(data) = &data {
            diagonal.iter_mut().zip(data.diagonal()).for_each(|(d, v)| *d += v);
        }
        let zeros = vec![0.0; n * k];
        Level {
            h,
            n,
            rows: Arc::new(rows),
            weights,
            data,
            inverse: diagonal.into_iter().map(|d| 1.0 / d).collect(),
            largest: 1.0,
            b: zeros.clone(),
            x: zeros.clone(),
            d: zeros.clone(),
            t: zeros,
            scratch: Scratch::default(),
        }
    }

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
/// Power steps for the largest eigenvalue.
const POWER: usize = 16;

impl Cycle {
    /// H plus sums over scattered data, given for every level that [`coarser`] makes.
    pub(crate) fn with_data(space: &Space, energy: &Energy, h: &Operator, data: &[Arc<Normal>]) -> Option<Cycle> {
        Cycle::new(space, energy, None, h, Added::Data(data))
    }

    /// `None` where no coarse level is small enough.
    pub(crate) fn new(
        space: &Space,
        energy: &Energy,
        stiffness: Option<&Stiffness>,
        h: &Operator,
        added: Added<'_>,
    ) -> Option<Cycle> {
        let (structure, weights, data): (Option<&Structure>, &[f64], &[Arc<Normal>]) = match added {
            Added::Nothing => (None, &[], &[]),
            Added::Rows(structure, weights) => (Some(structure), weights, &[]),
            Added::Data(data) => (None, &[], data),
        };
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
            let coarser = if data.is_empty() { now.coarser() } else { coarser(&now) }.filter(|_| n > 60);
            let Some(coarser) = coarser else {
                let data = data.get(levels.len()).cloned();
                let coarse = match (structure, &data) {
                    (None, Some(data)) if n > 60 => strip(&operator, data)?,
                    _ if n * k > 3000 => return None,
                    (None, None) => Coarsest::Dense(dense_factor(&operator, energy)?),
                    _ => Coarsest::Dense(coarsest(&operator, &rows, &weights, k, data.as_deref())?),
                };
                let only = levels.is_empty().then(|| Box::new(Level::new(operator, rows, weights, data, k)));
                return Some(Cycle { levels, only, transfers, coarse, k, work: Vec::new() });
            };
            let data = data.get(levels.len()).cloned();
            let mut level = Level::new(operator, rows, weights.clone(), data, k);
            level.largest = largest(&mut level);
            levels.push(level);
            transfers.push(Transfer::between(&coarser, &now));
            let cells: Vec<usize> = coarser.axes().iter().map(crate::axis::Axis::spans).collect();
            map = map.map(|m| m.coarser(if cells.len() == 2 { [cells[0], cells[1]] } else { [1, cells[0]] }));
            operator = Operator::new(&coarser, energy, map.as_ref());
            now = coarser;
        }
    }

    /// `y = (H + A^T W A) x` on the finest level.
    pub(crate) fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        if let Some(level) = self.levels.first_mut().or(self.only.as_deref_mut()) {
            level.apply(x, y);
        }
    }

    /// True where there is nothing but the coarsest level.
    pub(crate) fn is_direct(&self) -> bool {
        self.levels.is_empty()
    }

    /// Coefficients of the finest level, one coordinate.
    pub(crate) fn len(&self) -> usize {
        self.levels.first().map_or(self.coarse.len() / self.k, |l| l.n)
    }

    /// One V-cycle from zero: an approximate inverse, symmetric.
    pub(crate) fn cycle(&mut self, r: &[f64], z: &mut [f64]) {
        if self.levels.is_empty() {
            z.copy_from_slice(r);
            self.coarse.solve(z);
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
            self.coarse.solve(&mut b);
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

/// The factor of H + data on a grid that is narrow one way.
fn strip(h: &Operator, data: &Normal) -> Option<Coarsest> {
    let [rows, columns] = h.shape;
    let turn = rows < columns;
    let (band, number): (usize, &dyn Fn(usize) -> usize) =
        if turn { (3 * rows + 3, &|i| i % columns * rows + i / columns) } else { (3 * columns + 3, &|i| i) };
    let mut entries = Vec::new();
    let mut put = |r: usize, c: usize, v: f64| {
        let (r, c) = (number(r), number(c));
        entries.push((r.max(c), r.min(c), v));
    };
    h.entries(&mut put);
    data.entries(&mut put);
    let strip = Strip::new(h.len(), band, &entries)?;
    Some(if turn { Coarsest::Columns(strip, columns) } else { Coarsest::Rows(strip) })
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

/// The largest eigenvalue of D^-1 (H + A^T W A), by power steps from a rough start that is high along the ends: the
/// largest is that of functions next to an open end, which a long axis would hide.
fn largest(level: &mut Level) -> f64 {
    let n = level.inverse.len();
    let [rows, columns] = level.h.shape;
    let near = |i: usize, of: usize| of > 1 && (i < 4 || i + 4 >= of);
    let start = |i: usize| {
        let (row, column) = (i % level.n / columns, i % columns);
        let height = if near(row, rows) || near(column, columns) { 8.0 } else { 1.0 };
        height * (ondelette_numerics::seed::unit(i as u64) - 0.5)
    };
    let mut x: Vec<f64> = (0..n).map(start).collect();
    let mut y = vec![0.0; n];
    let mut value = 1.0;
    for _ in 0..POWER {
        let norm = dot(&x, &x).sqrt();
        x.iter_mut().for_each(|x| *x /= norm);
        level.apply(&x, &mut y);
        y.iter_mut().zip(&level.inverse).for_each(|(y, d)| *y *= d);
        value = dot(&y, &y).sqrt();
        std::mem::swap(&mut x, &mut y);
    }
    value
}
