//! Which rows are linear combinations of earlier ones.
//!
//! Only rows that share coefficients can depend on each other: the Gram matrix A A^T falls into small pieces, each
//! factored row by row. A row (of length 1) whose distance from the span of its predecessors is below 1e-6 is
//! taken as dependent.

use super::block::merged;
use crate::constraint::Row;
use crate::solve::cholesky::{Cholesky, start};

/// A row that is the sum of `factor` times other rows.
pub(crate) struct Dependence {
    pub(crate) row: usize,
    pub(crate) parts: Vec<(usize, f64)>,
}

/// Squared distance from the span below which a row counts as dependent.
const SQUARE: f64 = 1e-13;

/// Pieces above this many rows are left to the solver.
const LARGE: usize = 6000;

/// Finds the hard rows that depend on earlier hard rows.
pub(crate) fn dependent(rows: &[Row], n: usize, local: &dyn Fn(usize) -> usize) -> Vec<Dependence> {
    let mut pairs: Vec<(u32, u32)> = Vec::new();
    for (r, row) in rows.iter().enumerate().filter(|(_, r)| r.give == 0.0) {
        pairs.extend(row.entries().filter(|e| e.2 != 0.0).map(|(c, i, _)| ((local(c) * n + i) as u32, r as u32)));
    }
    pairs.sort_unstable();
    // Rows joined by a shared column.
    let mut parent: Vec<u32> = (0..rows.len() as u32).collect();
    fn root(parent: &mut [u32], mut i: u32) -> u32 {
        while parent[i as usize] != i {
            parent[i as usize] = parent[parent[i as usize] as usize];
            i = parent[i as usize];
        }
        i
    }
    for w in pairs.windows(2).filter(|w| w[0].0 == w[1].0) {
        let (a, b) = (root(&mut parent, w[0].1), root(&mut parent, w[1].1));
        parent[a.max(b) as usize] = a.min(b);
    }
    let mut pieces: Vec<Vec<usize>> = vec![Vec::new(); rows.len()];
    for r in 0..rows.len() {
        if rows[r].give == 0.0 {
            let at = root(&mut parent, r as u32) as usize;
            pieces[at].push(r);
        }
    }
    let mut out = Vec::new();
    for piece in pieces.iter().filter(|p| p.len() > 1 && p.len() <= LARGE) {
        within(piece, rows, n, local, &mut out);
    }
    out.sort_by_key(|d| d.row);
    out
}

fn within(piece: &[usize], rows: &[Row], n: usize, local: &dyn Fn(usize) -> usize, out: &mut Vec<Dependence>) {
    let sparse: Vec<Vec<(usize, f64)>> =
        piece.iter().map(|r| merged(rows[*r].entries().map(|(c, i, v)| (local(c) * n + i, v)).collect())).collect();
    let mut kept: Vec<usize> = Vec::new();
    let mut gram: Vec<f64> = Vec::new();
    let mut factor = Cholesky::default();
    // The smallest pivot so far: rounding errors grow by its inverse.
    let mut least = 1.0_f64;
    for (k, a) in sparse.iter().enumerate() {
        let products: Vec<f64> = kept.iter().map(|j| sparse_dot(a, &sparse[*j])).collect();
        let at = start(kept.len());
        gram.truncate(at);
        gram.extend_from_slice(&products);
        gram.push(sparse_dot(a, a));
        let grown = factor.extend(&gram, kept.len() + 1).is_ok();
        if grown && factor.pivot(kept.len()).powi(2) > SQUARE.max(4e-15 / least) {
            least = least.min(factor.pivot(kept.len()));
            kept.push(k);
            continue;
        }
        factor.truncate(kept.len());
        let mut c = products;
        factor.forward(&mut c);
        factor.backward(&mut c);
        let parts = kept.iter().zip(c).filter(|(_, c)| c.abs() > 1e-7);
        out.push(Dependence { row: piece[k], parts: parts.map(|(j, c)| (piece[*j], c)).collect() });
    }
}

/// Scalar product of two sparse vectors, sorted by index.
pub(crate) fn sparse_dot(a: &[(usize, f64)], b: &[(usize, f64)]) -> f64 {
    let (mut i, mut j, mut sum) = (0, 0, 0.0);
    while i < a.len() && j < b.len() {
        match a[i].0.cmp(&b[j].0) {
            std::cmp::Ordering::Less => i += 1,
            std::cmp::Ordering::Greater => j += 1,
            std::cmp::Ordering::Equal => {
                sum += a[i].1 * b[j].1;
                i += 1;
                j += 1;
            }
        }
    }
    sum
}
