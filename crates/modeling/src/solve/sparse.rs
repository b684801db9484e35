//! The direct solver by a library: a sparse Cholesky factor (faer, AMD ordering) of H with rho times the squares of the
//! rows added. Constraints follow in a few multiplier steps, which the refinement makes.
//!
//! The raw saddle matrix is never handed to the library: indefinite sparse factors fail silently on it.

use super::cholesky::dot;
use super::correct::Correct;
use crate::energy::Operator;
use crate::system::Structure;
use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::Llt;
use faer::sparse::{SparseColMat, Triplet};
use faer::{MatMut, Side};
use std::sync::Arc;

/// The factor of one structure.
pub(crate) struct SparseSolver {
    structure: Arc<Structure>,
    factor: Llt<usize, f64>,
    /// Force per miss of every row.
    stiffness: Vec<f64>,
    /// Shapes of no energy that the rows hardly hold, or not at all.
    loose: Vec<Loose>,
    x: Vec<f64>,
    l: Vec<f64>,
}

/// How much stiffer than H the hard rows are made.
const RHO: f64 = 1e3;

/// Rows stiffer than H by this leave nothing of it in the factor.
const HEAVIEST: f64 = 1e15;

/// A shape of no energy, what the rows make of it times the roots of their stiffness, and the square of that.
struct Loose {
    shape: Vec<f64>,
    rows: Vec<f64>,
    square: f64,
}

/// A shape of no energy is loose if rows hold it with this share of the largest entry of H, or less.
const LOOSE: f64 = 1e-13;

/// Takes the parts along others, orthogonal in the rows' squares, out of one; twice.
fn clear<'a>(of: &mut Loose, others: impl Iterator<Item = &'a Loose> + Clone) {
    for other in others.clone().chain(others).filter(|o| o.square > 0.0) {
        let by = dot(&of.rows, &other.rows) / other.square;
        of.rows.iter_mut().zip(&other.rows).for_each(|(a, b)| *a -= by * b);
        of.shape.iter_mut().zip(&other.shape).for_each(|(a, b)| *a -= by * b);
    }
    of.square = dot(&of.rows, &of.rows);
}

/// The loose shapes of a structure: no factor can tell them from rounding.
fn loose(null: &[Vec<f64>], structure: &Structure, stiffness: &[f64], size: f64) -> Vec<Loose> {
    let (mut firm, mut loose): (Vec<Loose>, Vec<Loose>) = (Vec::new(), Vec::new());
    for c in 0..structure.k {
        for z in null {
            let mut shape = vec![0.0; structure.unknowns()];
            shape[c * structure.n..][..structure.n].copy_from_slice(z);
            let rows = stiffness.iter().zip(structure.sight(c, z)).map(|(s, seen)| s.sqrt() * seen).collect();
            let mut one = Loose { shape, rows, square: 0.0 };
            clear(&mut one, firm.iter());
            if one.square > LOOSE * size * dot(&one.shape, &one.shape) {
                firm.push(one);
                continue;
            }
            let before = one.square;
            clear(&mut one, loose.iter());
            // Nothing but rounding is nothing.
            if one.square <= 1e-20 * before || one.square <= 1e-28 * size * dot(&one.shape, &one.shape) {
                one.square = 0.0;
            }
            loose.push(one);
        }
    }
    loose
}

/// A coefficient for each loose shape: held, they hold the shapes.
fn holds(loose: &[Loose]) -> Vec<usize> {
    let mut shapes: Vec<Vec<f64>> = loose.iter().map(|l| l.shape.clone()).collect();
    let mut out = Vec::new();
    for i in 0..shapes.len() {
        let (done, rest) = shapes.split_at_mut(i + 1);
        let own = &done[i];
        let at = (0..own.len()).max_by(|a, b| own[*a].abs().total_cmp(&own[*b].abs())).unwrap_or(0);
        out.push(at);
        for other in rest {
            let by = other[at] / own[at];
            other.iter_mut().zip(own).for_each(|(o, v)| *o -= by * v);
        }
    }
    out
}

impl SparseSolver {
    /// `None` where the library finds no factor, and where rows weigh so much that it would lose H; polynomials of a
    /// degree below `free` cost nothing.
    pub(crate) fn new(h: &Operator, structure: Arc<Structure>, free: usize) -> Option<SparseSolver> {
        let n = structure.n;
        let mut entries = Vec::new();
        let mut size = 0.0_f64;
        h.entries(|r, c, v| {
            if r == c {
                size = size.max(v.abs());
            }
            entries.push((r, c, v));
        });
        let mut all: Vec<Triplet<usize, usize, f64>> = Vec::with_capacity(entries.len() * structure.k);
        for k in 0..structure.k {
            all.extend(entries.iter().map(|&(r, c, v)| Triplet::new(k * n + r, k * n + c, v)));
        }
        let rho = RHO * size;
        let stiffness: Vec<f64> = structure.give.iter().map(|g| if *g > 0.0 { 1.0 / g } else { rho }).collect();
        if stiffness.iter().any(|s| *s > HEAVIEST * size) {
            return None;
        }
        for (r, by) in stiffness.iter().enumerate() {
            let (columns, values) = structure.row(r);
            for (c, v) in columns.iter().zip(values) {
                for (d, w) in columns.iter().zip(values).filter(|e| e.0 <= c) {
                    all.push(Triplet::new(*c as usize, *d as usize, by * v * w));
                }
            }
        }
        let unknowns = structure.unknowns();
        let loose = loose(&h.null_space(free), &structure, &stiffness, size);
        all.extend(holds(&loose).into_iter().map(|i| Triplet::new(i, i, size)));
        let factor = |all: &[Triplet<usize, usize, f64>]| {
            let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(unknowns, unknowns, all).ok()?;
            matrix.sp_cholesky(Side::Lower).ok()
        };
        let factor = factor(&all).or_else(|| {
            // What no row sees is held where it is.
            all.extend((0..unknowns).map(|i| Triplet::new(i, i, 1e-10 * size)));
            factor(&all)
        })?;
        Some(SparseSolver { l: vec![0.0; structure.rows()], structure, factor, stiffness, loose, x: Vec::new() })
    }
}

impl Correct for SparseSolver {
    fn begin(&mut self, r1: &[f64], r2: &[f64]) {
        self.x.clear();
        self.x.extend_from_slice(r1);
        let forces: Vec<f64> = r2.iter().zip(&self.stiffness).map(|(r, s)| r * s).collect();
        self.structure.add_transposed(&forces, 1.0, &mut self.x);
        let n = self.x.len();
        self.factor.solve_in_place(MatMut::from_column_major_slice_mut(&mut self.x, n, 1));
        // What was held for the factor's sake goes where the rows want it.
        for one in self.loose.iter().filter(|l| l.square > 0.0) {
            let pull =
                |(r, v): (usize, &f64)| v * self.stiffness[r].sqrt() * (r2[r] - self.structure.apply_row(r, &self.x));
            let by = (dot(&one.shape, r1) + one.rows.iter().enumerate().map(pull).sum::<f64>()) / one.square;
            self.x.iter_mut().zip(&one.shape).for_each(|(x, z)| *x += by * z);
        }
        for (r, l) in self.l.iter_mut().enumerate() {
            *l = self.stiffness[r] * (self.structure.apply_row(r, &self.x) - r2[r]);
        }
    }

    fn step(&mut self) -> bool {
        true
    }

    fn patience(&self, met: bool) -> (usize, f64) {
        // Multipliers of crowded rows come slowly, but they come.
        if met { (30, 0.3) } else { (300, 0.98) }
    }

    fn correction(&self) -> (&[f64], &[f64]) {
        (&self.x, &self.l)
    }
}
