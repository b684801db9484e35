//! The matrix of a sum of squares over points: what scattered data add to an energy.

use crate::basis;
use crate::system::Space;

/// A^T A of values at points, on an open surface: 7 x 7 entries a coefficient.
#[derive(Clone, Debug)]
pub(crate) struct Normal {
    shape: [usize; 2],
    entries: Vec<f64>,
}

impl Normal {
    /// Sums over the points; linear time.
    pub(crate) fn new<'a>(space: &Space, points: impl Iterator<Item = &'a [f64; 2]>) -> Normal {
        let shape = space.shape();
        let mut entries = vec![0.0; shape[0] * shape[1] * 49];
        let axes = space.axes();
        for p in points {
            let (s, t) = (basis::taps(&axes[0], p[0], 0), basis::taps(&axes[axes.len() - 1], p[1], 0));
            for (a, (i, u)) in s.iter().enumerate() {
                for (b, (j, v)) in t.iter().enumerate() {
                    let row = &mut entries[(i * shape[1] + j) * 49..][..49];
                    for c in 0..4 {
                        for d in 0..4 {
                            row[(3 + c - a) * 7 + 3 + d - b] += u * v * s.values[c] * t.values[d];
                        }
                    }
                }
            }
        }
        Normal { shape, entries }
    }

    /// `y += A^T A x`.
    pub(crate) fn add(&self, x: &[f64], y: &mut [f64]) {
        let [ns, nt] = self.shape;
        for i in 0..ns {
            for j in 0..nt {
                let row = &self.entries[(i * nt + j) * 49..][..49];
                let mut sum = 0.0;
                let (from, to) = (j.saturating_sub(3), (j + 4).min(nt));
                for k in i.saturating_sub(3)..(i + 4).min(ns) {
                    let taps = &row[(k + 3 - i) * 7 + from + 3 - j..][..to - from];
                    sum += taps.iter().zip(&x[k * nt + from..k * nt + to]).map(|(a, b)| a * b).sum::<f64>();
                }
                y[i * nt + j] += sum;
            }
        }
    }

    /// The diagonal.
    pub(crate) fn diagonal(&self) -> impl Iterator<Item = f64> + '_ {
        self.entries.chunks_exact(49).map(|row| row[24])
    }

    /// Every entry of the lower triangle.
    pub(crate) fn entries(&self, mut put: impl FnMut(usize, usize, f64)) {
        let nt = self.shape[1];
        for (at, row) in self.entries.chunks_exact(49).enumerate() {
            let (i, j) = (at / nt, at % nt);
            for (o, v) in row.iter().enumerate().filter(|e| *e.1 != 0.0) {
                let other = (i + o / 7 - 3) * nt + j + o % 7 - 3;
                if other <= at {
                    put(at, other, *v);
                }
            }
        }
    }
}
