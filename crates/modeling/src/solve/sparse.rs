//! The direct solver by a library: a sparse Cholesky factor (faer, AMD ordering) of H with rho times the squares of the
//! rows added. Constraints follow in a few multiplier steps, which the refinement makes.
//!
//! The raw saddle matrix is never handed to the library: indefinite sparse factors fail silently on it.

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
    x: Vec<f64>,
    l: Vec<f64>,
}

/// How much stiffer than H the hard rows are made.
const RHO: f64 = 1e3;

impl SparseSolver {
    /// `None` where the library finds no factor.
    pub(crate) fn new(h: &Operator, structure: Arc<Structure>) -> Option<SparseSolver> {
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
        for (r, by) in stiffness.iter().enumerate() {
            let (columns, values) = structure.row(r);
            for (c, v) in columns.iter().zip(values) {
                for (d, w) in columns.iter().zip(values).filter(|e| e.0 <= c) {
                    all.push(Triplet::new(*c as usize, *d as usize, by * v * w));
                }
            }
        }
        let unknowns = structure.unknowns();
        let factor = |all: &[Triplet<usize, usize, f64>]| {
            let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(unknowns, unknowns, all).ok()?;
            matrix.sp_cholesky(Side::Lower).ok()
        };
        let factor = factor(&all).or_else(|| {
            // What no row sees is held where it is.
            all.extend((0..unknowns).map(|i| Triplet::new(i, i, 1e-10 * size)));
            factor(&all)
        })?;
        Some(SparseSolver { l: vec![0.0; structure.rows()], structure, factor, stiffness, x: Vec::new() })
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
