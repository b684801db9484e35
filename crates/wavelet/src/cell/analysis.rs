//! From samples of a function to its coefficients on a cell.

use super::basis::{CellBasis, CellFamily};

/// How samples become coefficients: `coefficient[i] = sum_q matrix[i][q] f(points[q])`.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// Local sample points.
    pub points: Vec<[f64; 2]>,
    /// Row-major, one row a function, one column a point.
    pub matrix: Vec<f64>,
}

impl Analysis {
    /// Coefficients of samples taken at the points.
    pub fn coefficients(&self, samples: &[f64]) -> Vec<f64> {
        self.matrix.chunks(self.points.len()).map(|row| row.iter().zip(samples).map(|(a, s)| a * s).sum()).collect()
    }
}

impl CellBasis {
    /// The rule with `n` points an axis (or an axis of a box).
    pub(super) fn make_analysis(&self, n: usize) -> Analysis {
        let functions = self.len();
        match self.family {
            CellFamily::Multiwavelet => {
                let (points, weights) = self.shape.rule(n.max(self.order));
                let mut analysis = vec![0.0; functions * points.len()];
                let mut values = vec![0.0; functions];
                for (q, (x, w)) in points.iter().zip(&weights).enumerate() {
                    self.eval(*x, &mut values);
                    for i in 0..functions {
                        analysis[i * points.len() + q] = w * values[i];
                    }
                }
                Analysis { points, matrix: analysis }
            }
            CellFamily::Flatlet => {
                let (local, weights) = self.shape.rule(n);
                let (per_box, width) = (local.len(), 1.0 / self.order as f64);
                let mut points = Vec::with_capacity(functions * per_box);
                let mut analysis = vec![0.0; functions * functions * per_box];
                for (i, k) in self.index.iter().enumerate() {
                    for (q, x) in local.iter().enumerate() {
                        points.push([(f64::from(k[0]) + x[0]) * width, (f64::from(k[1]) + x[1]) * width]);
                        analysis[i * functions * per_box + i * per_box + q] = weights[q];
                    }
                }
                Analysis { points, matrix: analysis }
            }
        }
    }
}
