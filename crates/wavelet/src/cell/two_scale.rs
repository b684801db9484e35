//! Two-scale matrices, derived from the functions.

use super::basis::{CellBasis, CellFamily};
use super::shape::CellShape;
use ondelette_numerics::dense::inverse;

impl CellBasis {
    /// A pulled coefficient is the mean of the function times the staircase of height n T_c\[i\]\[k\] on box k of child
    /// c (n boxes a cell); this inverts the Gram matrix n/arity sum_c T_c T_c^T of these staircases.
    pub(super) fn make_inverse_gram(&self) -> Vec<f64> {
        let n = self.len();
        let mut gram = vec![0.0; n * n];
        for t in &self.two_scale {
            for i in 0..n {
                for j in 0..n {
                    let dot: f64 = (0..n).map(|k| t[i * n + k] * t[j * n + k]).sum();
                    gram[i * n + j] += dot * n as f64 / self.two_scale.len() as f64;
                }
            }
        }
        inverse(&gram, n)
    }

    /// T_c of child `c`.
    pub(super) fn two_scale_matrix(&self, c: usize) -> Vec<f64> {
        let n = self.len();
        let (offset, sign) = self.shape.child(c);
        match self.family {
            CellFamily::Multiwavelet => {
                let (points, weights) = self.shape.rule(self.order + 1);
                let mut matrix = vec![0.0; n * n];
                let (mut parent, mut child) = (vec![0.0; n], vec![0.0; n]);
                for (x, w) in points.iter().zip(&weights) {
                    self.eval([offset[0] + 0.5 * sign * x[0], offset[1] + 0.5 * sign * x[1]], &mut parent);
                    self.eval(*x, &mut child);
                    for i in 0..n {
                        for j in 0..n {
                            matrix[i * n + j] += w * parent[i] * child[j];
                        }
                    }
                }
                matrix
            }
            CellFamily::Flatlet => {
                let axis = |half: usize| flatlet_axis(self.order, half);
                let s = axis(usize::from(offset[0] > 0.0));
                let t = if self.shape == CellShape::Square { axis(usize::from(offset[1] > 0.0)) } else { vec![1.0] };
                let m = self.order;
                let mut matrix = Vec::with_capacity(n * n);
                for i in &self.index {
                    for j in &self.index {
                        let [a, b] = i.map(usize::from);
                        let [c, d] = j.map(usize::from);
                        matrix.push(s[a * m + c] * t[if t.len() == 1 { 0 } else { b * m + d }]);
                    }
                }
                matrix
            }
        }
    }
}

/// One axis of the flatlets' dual two-scale relation: the polynomial of degree M - 1 with mean 1 on box `i` and 0 on
/// the other boxes, averaged over the M boxes of one half. Row-major `[i][j]`. Exact: differences of a Lagrange
/// primitive.
fn flatlet_axis(m: usize, half: usize) -> Vec<f64> {
    // P(x) = integral from 0 to x (in units of one box); P(k) = number of unit boxes passed of box i
    let lagrange = |i: usize, x: f64| -> f64 {
        (0..=m)
            .filter(|&k| k > i)
            .map(|k| (0..=m).filter(|&l| l != k).map(|l| (x - l as f64) / (k as f64 - l as f64)).product::<f64>())
            .sum()
    };
    let mut matrix = Vec::with_capacity(m * m);
    for i in 0..m {
        for j in 0..m {
            let from = 0.5 * (j + half * m) as f64;
            matrix.push(2.0 * (lagrange(i, from + 0.5) - lagrange(i, from)));
        }
    }
    matrix
}
