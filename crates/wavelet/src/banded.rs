//! LU factors of a banded matrix, with solves for it and for its transpose.

use crate::coefficient::Scalar;

/// `P A = L U` of a banded matrix with partial pivoting. Factor and solve in linear time.
#[derive(Clone, Debug)]
pub(crate) struct BandedLu {
    n: usize,
    lower: usize,
    /// Upper bandwidth of U (the band of A plus fill by pivoting).
    upper: usize,
    /// Row `i` holds columns `i - lower ..= i + upper`.
    band: Vec<f64>,
    pivot: Vec<usize>,
    /// Multipliers of column `i` for rows `i + 1 ..= i + lower`.
    multipliers: Vec<f64>,
}

impl BandedLu {
    /// Factors the matrix with the given rows of `(column, value)`; `None` if it is singular to rounding.
    pub(crate) fn new(rows: &[Vec<(usize, f64)>]) -> Option<BandedLu> {
        let n = rows.len();
        let (mut lower, mut upper) = (0, 0);
        for (i, row) in rows.iter().enumerate() {
            for &(j, _) in row {
                lower = lower.max(i.saturating_sub(j));
                upper = upper.max(j.saturating_sub(i));
            }
        }
        upper += lower;
        let width = lower + upper + 1;
        let mut band = vec![0.0; n * width];
        for (i, row) in rows.iter().enumerate() {
            for &(j, v) in row {
                band[i * width + j + lower - i] = v;
            }
        }
        let at = |i: usize, j: usize| i * width + j + lower - i;
        let mut pivot = vec![0; n];
        let mut multipliers = vec![0.0; n * lower];
        for c in 0..n {
            let last = (c + lower).min(n - 1);
            let p = (c..=last).max_by(|&a, &b| band[at(a, c)].abs().total_cmp(&band[at(b, c)].abs()))?;
            pivot[c] = p;
            let end = (c + upper).min(n - 1);
            if p != c {
                for j in c..=end {
                    band.swap(at(c, j), at(p, j));
                }
            }
            let d = band[at(c, c)];
            if d.abs() < 1e-300 {
                return None;
            }
            for r in c + 1..=last {
                let f = band[at(r, c)] / d;
                multipliers[c * lower + r - c - 1] = f;
                if f != 0.0 {
                    for j in c..=end {
                        band[at(r, j)] -= f * band[at(c, j)];
                    }
                }
            }
        }
        Some(BandedLu { n, lower, upper, band, pivot, multipliers })
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.band[i * (self.lower + self.upper + 1) + j + self.lower - i]
    }

    /// Solves `A x = b` in place for `channels` interleaved right-hand sides.
    pub(crate) fn solve<S: Scalar>(&self, x: &mut [S], channels: usize) {
        for c in 0..self.n {
            swap(x, c, self.pivot[c], channels);
            for r in c + 1..=(c + self.lower).min(self.n - 1) {
                axpy(x, r, -self.multipliers[c * self.lower + r - c - 1], c, channels);
            }
        }
        for c in (0..self.n).rev() {
            for j in c + 1..=(c + self.upper).min(self.n - 1) {
                axpy(x, c, -self.at(c, j), j, channels);
            }
            scale(x, c, 1.0 / self.at(c, c), channels);
        }
    }

    /// Solves `A^T x = b` in place.
    pub(crate) fn solve_transposed<S: Scalar>(&self, x: &mut [S], channels: usize) {
        for c in 0..self.n {
            scale(x, c, 1.0 / self.at(c, c), channels);
            for j in c + 1..=(c + self.upper).min(self.n - 1) {
                axpy(x, j, -self.at(c, j), c, channels);
            }
        }
        for c in (0..self.n).rev() {
            for r in c + 1..=(c + self.lower).min(self.n - 1) {
                axpy(x, c, -self.multipliers[c * self.lower + r - c - 1], r, channels);
            }
            swap(x, c, self.pivot[c], channels);
        }
    }
}

fn swap<S: Scalar>(x: &mut [S], a: usize, b: usize, channels: usize) {
    if a != b {
        for k in 0..channels {
            x.swap(a * channels + k, b * channels + k);
        }
    }
}

fn axpy<S: Scalar>(x: &mut [S], to: usize, by: f64, from: usize, channels: usize) {
    let by = S::from_f64(by);
    for k in 0..channels {
        let v = x[from * channels + k];
        x[to * channels + k] += by * v;
    }
}

fn scale<S: Scalar>(x: &mut [S], at: usize, by: f64, channels: usize) {
    let by = S::from_f64(by);
    x[at * channels..][..channels].iter_mut().for_each(|v| *v *= by);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_need_pivots() {
        // Zero on the diagonal: fails without row exchanges.
        let rows = vec![vec![(0, 0.0), (1, 2.0)], vec![(0, 3.0), (1, 1.0), (2, 4.0)], vec![(1, 5.0), (2, 1.0)]];
        let lu = BandedLu::new(&rows).expect("regular");
        let x = [1.0, -2.0, 3.0];
        let mut b: Vec<f64> = rows.iter().map(|r| r.iter().map(|&(j, v)| v * x[j]).sum()).collect();
        lu.solve(&mut b, 1);
        let mut c = vec![0.0; 3];
        rows.iter().enumerate().for_each(|(i, r)| r.iter().for_each(|&(j, v)| c[j] += v * x[i]));
        lu.solve_transposed(&mut c, 1);
        for i in 0..3 {
            assert!((b[i] - x[i]).abs() < 1e-14 && (c[i] - x[i]).abs() < 1e-14, "{b:?} {c:?}");
        }
        assert!(BandedLu::new(&[vec![(0, 0.0)]]).is_none());
    }
}
