//! The bordered system of the multipliers: exact constraints and a null space, with a dense factor.
//!
//! For an operator P that stands for the inverse of H off its null space Z, the correction g and multipliers v of
//! `g = P (r - A^T v) + Z c`, `A g = d`, `Z^T (r - A^T v) = 0` follow from the matrix S = A P A^T (plus 1 / w on soft
//! rows) and Y = A Z:
//!
//! ```text
//! [ S   -Y ] [ v ]   [ A P r - d ]
//! [ Y^T  0 ] [ c ] = [ Z^T r     ]
//! ```
//!
//! Rows of light weights, whose 1 / w is all that is to be seen in S, would hide the others: they are scaled by a
//! power of two, which costs no digits. S is factored with `tau Y Y^T` added, which changes no solution and makes it
//! positive definite.

use super::cholesky::{Cholesky, dot, start};

/// The factored bordered matrix.
#[derive(Clone, Debug)]
pub(crate) struct Border {
    k: usize,
    tau: f64,
    /// What each row is multiplied by.
    scales: Vec<f64>,
    /// Y, scaled, one column after the other.
    y: Vec<Vec<f64>>,
    /// L^-1 Y.
    u: Vec<Vec<f64>>,
    factor: Cholesky,
    /// Cholesky factor of U^T U; pivots of directions that the rows do not see are infinite.
    small: Vec<f64>,
    /// Combinations of the null space that no row sees.
    pub(crate) free: Vec<Vec<f64>>,
}

/// Rows whose diagonal is this many times the least would hide those that it is of.
const LIGHT: f64 = 1e6;

/// Powers of two that scale the diagonal of S, where a weight has made it large, to about the least of all.
fn scales(s: &[f64], m: usize) -> Vec<f64> {
    let own = |i: usize| s[start(i) + i];
    let least = (0..m).map(own).filter(|v| *v > 0.0).fold(f64::INFINITY, f64::min);
    let of = |own: f64| if own > LIGHT * least { (0.5 * (least / own).log2()).round().exp2() } else { 1.0 };
    (0..m).map(|i| of(own(i))).collect()
}

impl Border {
    /// Factors S (packed) with the columns of Y. An error names the first row without a pivot.
    pub(crate) fn new(mut s: Vec<f64>, m: usize, mut y: Vec<Vec<f64>>) -> Result<Border, usize> {
        let k = y.len();
        let scales = scales(&s, m);
        for i in 0..m {
            s[start(i)..start(i + 1)].iter_mut().zip(&scales).for_each(|(s, by)| *s *= scales[i] * by);
        }
        y.iter_mut().for_each(|y| y.iter_mut().zip(&scales).for_each(|(y, by)| *y *= by));
        let trace: f64 = (0..m).map(|i| s[start(i) + i]).sum();
        let norm: f64 = y.iter().map(|y| dot(y, y)).sum();
        let tau = if norm > 0.0 { k as f64 * trace / norm } else { 0.0 };
        if tau > 0.0 {
            for i in 0..m {
                let row = &mut s[start(i)..start(i + 1)];
                for y in &y {
                    let by = tau * y[i];
                    row.iter_mut().zip(y).for_each(|(s, y)| *s += by * y);
                }
            }
        }
        let factor = Cholesky::new(&s, m)?;
        let mut border = Border { k, tau, scales, y, u: Vec::new(), factor, small: Vec::new(), free: Vec::new() };
        border.finish();
        Ok(border)
    }

    /// The rows of S (packed, with the columns of Y) whose squared distance from the rows kept before them is above
    /// `least[row]`, in the norm that the factor works in, and above rounding.
    pub(crate) fn independent(s: &[f64], y: &[Vec<f64>], least: &[f64]) -> Vec<usize> {
        let m = least.len();
        let by = scales(s, m);
        let trace: f64 = (0..m).map(|i| by[i] * by[i] * s[start(i) + i]).sum();
        let norm: f64 = y.iter().flat_map(|y| y.iter().zip(&by)).map(|(y, by)| (y * by).powi(2)).sum();
        let tau = if norm > 0.0 { y.len() as f64 * trace / norm } else { 0.0 };
        let mut kept: Vec<usize> = Vec::new();
        let mut matrix: Vec<f64> = Vec::new();
        let mut factor = Cholesky::default();
        for i in 0..m {
            let of = |j: usize| by[i] * by[j] * (s[start(i) + j] + tau * y.iter().map(|y| y[i] * y[j]).sum::<f64>());
            matrix.truncate(start(kept.len()));
            matrix.extend(kept.iter().map(|j| of(*j)));
            let own = of(i);
            matrix.push(own);
            let grown = factor.extend(&matrix, kept.len() + 1).is_ok();
            if grown && factor.pivot(kept.len()).powi(2) > (by[i] * by[i] * least[i]).max(2e-16 * own) {
                kept.push(i);
            } else {
                factor.truncate(kept.len());
            }
        }
        kept
    }

    fn finish(&mut self) {
        let k = self.k;
        self.u = self.y.clone();
        for u in &mut self.u {
            self.factor.forward(u);
        }
        let mut small = vec![0.0; k * k];
        let sizes: Vec<f64> = self.u.iter().map(|u| dot(u, u)).collect();
        let most = sizes.iter().fold(0.0, |m: f64, s| m.max(*s));
        for i in 0..k {
            for j in 0..=i {
                let sum: f64 = (0..j).map(|l| small[i * k + l] * small[j * k + l]).sum();
                let value = dot(&self.u[i], &self.u[j]) - sum;
                if i != j {
                    small[i * k + j] = value / small[j * k + j];
                } else if value > 1e-12 * most.max(f64::MIN_POSITIVE) && value > 1e-10 * sizes[i] {
                    small[i * k + i] = value.sqrt();
                } else {
                    small[i * k + i] = f64::INFINITY;
                }
            }
        }
        // w = e_i less what the seen directions before it can undo.
        for i in (0..k).filter(|i| small[i * k + i].is_infinite()) {
            let mut w = vec![0.0; k];
            w[i] = 1.0;
            for j in (0..i).rev().filter(|j| small[j * k + j].is_finite()) {
                let sum: f64 = (j + 1..=i).map(|l| small[l * k + j] * w[l]).sum();
                w[j] = -sum / small[j * k + j];
            }
            self.free.push(w);
        }
        self.small = small;
    }

    /// Solves for v (over `h`, which holds A P r - d) and c, given `q` = Z^T r.
    pub(crate) fn solve(&self, h: &mut [f64], q: &[f64], c: &mut [f64]) {
        let k = self.k;
        h.iter_mut().zip(&self.scales).for_each(|(h, by)| *h *= by);
        if self.tau > 0.0 {
            for (y, q) in self.y.iter().zip(q) {
                h.iter_mut().zip(y).for_each(|(h, y)| *h += self.tau * q * y);
            }
        }
        self.factor.forward(h);
        for i in 0..k {
            let sum: f64 = (0..i).map(|l| self.small[i * k + l] * c[l]).sum();
            c[i] = (q[i] - dot(&self.u[i], h) - sum) / self.small[i * k + i];
        }
        for i in (0..k).rev() {
            let sum: f64 = (i + 1..k).map(|l| self.small[l * k + i] * c[l]).sum();
            c[i] = (c[i] - sum) / self.small[i * k + i];
        }
        for (u, c) in self.u.iter().zip(&*c) {
            h.iter_mut().zip(u).for_each(|(h, u)| *h += c * u);
        }
        self.factor.backward(h);
        h.iter_mut().zip(&self.scales).for_each(|(h, by)| *h *= by);
    }
}
