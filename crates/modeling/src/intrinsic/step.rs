//! One damped Newton step under linear constraints.

use super::pose::Equation;
use crate::solve::cholesky::{Cholesky, start};
use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};
use faer::{MatMut, Side};

/// A step, and by how much the quadratic model falls along it.
pub(crate) struct Newton {
    pub(crate) step: Vec<f64>,
    pub(crate) expected: f64,
    /// One an equation: the gradient plus their sum of rows vanishes at the minimum.
    pub(crate) multipliers: Vec<f64>,
}

/// The minimum of the model x^T gradient + x^T (entries + damping) x / 2 on the exact equations; `None` where the
/// matrix is not positive definite: damp more.
///
/// Entries are of the lower triangle and may repeat. Soft equations are in the gradient and the entries already.
pub(crate) fn newton(
    gradient: &[f64],
    entries: &[(usize, usize, f64)],
    damping: &[(usize, usize, f64)],
    by: f64,
    exact: &[Equation],
    misses: &[f64],
) -> Option<Newton> {
    let n = gradient.len();
    let mut all: Vec<Triplet<usize, usize, f64>> = Vec::with_capacity(entries.len() + damping.len() + 64 * exact.len());
    all.extend(entries.iter().map(|e| Triplet::new(e.0, e.1, e.2)));
    all.extend(damping.iter().map(|e| Triplet::new(e.0, e.1, by * e.2)));
    let mut diagonal = vec![0.0_f64; n];
    all.iter().filter(|t| t.row == t.col).for_each(|t| diagonal[t.row] += t.val);
    let rho = diagonal.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
    for row in exact {
        for (i, v) in &row.entries {
            let pairs = row.entries.iter().filter(|e| e.0 <= *i);
            all.extend(pairs.map(|(j, w)| Triplet::new(*i, *j, rho * v * w)));
        }
    }
    let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &all).ok()?;
    let factor = matrix.sp_cholesky(Side::Lower).ok()?;
    // One right-hand side for the gradient, one a constraint.
    let m = exact.len();
    let mut columns = vec![0.0; n * (m + 1)];
    let (step, responses) = columns.split_at_mut(n);
    step.iter_mut().zip(gradient).for_each(|(s, g)| *s = -g);
    for (row, miss) in exact.iter().zip(misses) {
        row.entries.iter().for_each(|(i, v)| step[*i] -= rho * v * miss);
    }
    for (row, column) in exact.iter().zip(responses.chunks_exact_mut(n)) {
        row.entries.iter().for_each(|(i, v)| column[*i] += v);
    }
    factor.solve_in_place(MatMut::from_column_major_slice_mut(&mut columns, n, m + 1));
    let (step, responses) = columns.split_at_mut(n);
    let along = |row: &Equation, x: &[f64]| row.entries.iter().map(|(i, v)| v * x[*i]).sum::<f64>();
    let mut packed = vec![0.0; start(m)];
    for i in 0..m {
        for j in 0..=i {
            packed[start(i) + j] = along(&exact[i], &responses[j * n..][..n]);
        }
    }
    let multipliers = Cholesky::new(&packed, m).ok()?;
    let mut mu: Vec<f64> = exact.iter().zip(misses).map(|(row, miss)| along(row, step) + miss).collect();
    multipliers.forward(&mut mu);
    multipliers.backward(&mut mu);
    for (mu, column) in mu.iter().zip(responses.chunks_exact(n)) {
        step.iter_mut().zip(column).for_each(|(s, c)| *s -= mu * c);
    }
    let step = step.to_vec();
    if !step.iter().all(|v| v.is_finite()) {
        return None;
    }
    let twice =
        |&(r, c, v): &(usize, usize, f64)| if r == c { v * step[r] * step[r] } else { 2.0 * v * step[r] * step[c] };
    let curved: f64 = entries.iter().map(twice).sum();
    let slope: f64 = gradient.iter().zip(&step).map(|(g, s)| g * s).sum();
    Some(Newton { expected: -(slope + 0.5 * curved), step, multipliers: mu })
}
