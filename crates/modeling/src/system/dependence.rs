//! Which rows are linear combinations of earlier ones.
//!
//! Only rows that share coefficients can depend on each other: the Gram matrix A A^T falls into small pieces, each
//! factored row by row. A row (of length 1) whose distance from the span of its predecessors is below 3e-7 is taken as
//! dependent: solvers, which work with squares of distances, could not tell it apart.

use super::block::merged;
use crate::constraint::Row;
use crate::solve::cholesky::{Cholesky, dot};

/// A row (of length 1) that is the sum of factors times other rows; most factors are nothing but rounding.
pub(crate) struct Dependence {
    pub(crate) row: usize,
    pub(crate) parts: Vec<(usize, f64)>,
    /// What the sum leaves, as a length.
    pub(crate) distance: f64,
}

/// Distance from the span below which a row counts as dependent.
const DEPENDENT: f64 = 3e-7;

/// Squared distance above which its rounding errors do not matter.
const SURE: f64 = 1e-6;

/// Projections of a row at most.
const CORRECTIONS: usize = 4;

/// Operations beyond which rows are not made orthogonal.
const OPERATIONS: usize = 1 << 28;

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
    let mut factor = Cholesky::default();
    let mut orthogonal: Option<Orthogonal> = None;
    for (k, a) in sparse.iter().enumerate() {
        if orthogonal.is_none() {
            let mut row: Vec<f64> = kept.iter().map(|j| sparse_dot(a, &sparse[*j])).collect();
            factor.forward(&mut row);
            let square = sparse_dot(a, a) - dot(&row, &row);
            if square > SURE {
                factor.push(&row, square.sqrt());
                kept.push(k);
                continue;
            }
            orthogonal = Orthogonal::new(&sparse);
            if let Some(orthogonal) = &mut orthogonal {
                factor.truncate(0);
                for j in &kept {
                    let (row, rest, distance) = orthogonal.project(&sparse[*j]);
                    factor.push(&row, distance);
                    orthogonal.push(rest, distance);
                }
            }
        }
        let (c, distance) = match &mut orthogonal {
            Some(orthogonal) => {
                let (mut row, rest, distance) = orthogonal.project(a);
                if distance > DEPENDENT {
                    factor.push(&row, distance);
                    orthogonal.push(rest, distance);
                } else {
                    factor.backward(&mut row);
                }
                (row, distance)
            }
            None => {
                let (c, distance) = combination(a, &kept, &sparse, &factor);
                if distance > DEPENDENT {
                    let mut row: Vec<f64> = kept.iter().map(|j| sparse_dot(a, &sparse[*j])).collect();
                    factor.forward(&mut row);
                    factor.push(&row, distance);
                }
                (c, distance)
            }
        };
        if distance > DEPENDENT {
            kept.push(k);
        } else {
            let parts = kept.iter().zip(c).map(|(j, c)| (piece[*j], c)).collect();
            out.push(Dependence { row: piece[k], parts, distance });
        }
    }
}

/// Rows made orthogonal to those before them, twice: as exact as the rows are, at the cost of a dense matrix.
struct Orthogonal {
    columns: Vec<usize>,
    rows: Vec<Vec<f64>>,
}

impl Orthogonal {
    /// None of the rows yet; `None` where they are too many.
    fn new(sparse: &[Vec<(usize, f64)>]) -> Option<Orthogonal> {
        let mut columns: Vec<usize> = sparse.iter().flatten().map(|e| e.0).collect();
        columns.sort_unstable();
        columns.dedup();
        let many = sparse.len().checked_mul(sparse.len())?.checked_mul(columns.len())?;
        (many <= OPERATIONS).then_some(Orthogonal { columns, rows: Vec::new() })
    }

    /// Products with the rows so far, the rest, and its length.
    fn project(&self, a: &[(usize, f64)]) -> (Vec<f64>, Vec<f64>, f64) {
        let mut rest = vec![0.0; self.columns.len()];
        for (i, v) in a {
            if let Ok(at) = self.columns.binary_search(i) {
                rest[at] = *v;
            }
        }
        let mut products = vec![0.0; self.rows.len()];
        for _ in 0..2 {
            for (p, q) in products.iter_mut().zip(&self.rows) {
                let by = dot(q, &rest);
                *p += by;
                rest.iter_mut().zip(q).for_each(|(r, q)| *r -= by * q);
            }
        }
        let distance = dot(&rest, &rest).sqrt();
        (products, rest, distance)
    }

    /// One more row: what a projection left, of the length that it had.
    fn push(&mut self, mut rest: Vec<f64>, length: f64) {
        rest.iter_mut().for_each(|r| *r /= length);
        self.rows.push(rest);
    }
}

/// The factors with which the kept rows come nearest to `a`, and how near. Products of rows square what these have of
/// ill condition, so that the rest is computed from the rows themselves and projected again.
fn combination(a: &[(usize, f64)], kept: &[usize], sparse: &[Vec<(usize, f64)>], factor: &Cholesky) -> (Vec<f64>, f64) {
    let mut c = vec![0.0; kept.len()];
    let mut rest = a.to_vec();
    let mut distance = f64::INFINITY;
    for _ in 0..CORRECTIONS {
        let mut d: Vec<f64> = kept.iter().map(|j| sparse_dot(&rest, &sparse[*j])).collect();
        factor.forward(&mut d);
        factor.backward(&mut d);
        let next: Vec<f64> = c.iter().zip(d).map(|(c, d)| c + d).collect();
        let parts = kept.iter().zip(&next).flat_map(|(j, c)| sparse[*j].iter().map(move |(i, v)| (*i, -c * v)));
        let left = merged(a.iter().copied().chain(parts).collect());
        let length = sparse_dot(&left, &left).sqrt();
        if length >= distance {
            break;
        }
        (c, rest, distance) = (next, left, length);
    }
    (c, distance)
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
