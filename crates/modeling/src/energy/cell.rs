//! The energy of one cell of a surface, in differences of its 16 coefficients.
//!
//! On a span a spline is known by one coefficient each of itself and of its three derivatives. In those numbers the
//! matrix of the a-th derivative has exact zeros where a polynomial of lower degree costs nothing, so that a sum over
//! cells with any weights keeps the null space.

use super::line::{Line, span_gram};
use ondelette_wavelet::Boundary;

/// The local matrices of a class of spans: all interior spans, or one span near an open end.
#[derive(Clone, Debug)]
pub(crate) struct SpanClass {
    /// The four local coefficients to the first coefficient of each derivative, lower triangular.
    pub(crate) to_differences: [[f64; 4]; 4],
    /// Energy of the a-th derivative in those numbers.
    pub(crate) energy: [[[f64; 4]; 4]; 4],
}

impl SpanClass {
    fn new(line: &Line, span: usize) -> SpanClass {
        let (boundary, spans) = (line.boundary, line.spans);
        // Rows of the continued line: for open axes they are those of `differences`, else plain binomials.
        let row = |a: usize| -> [f64; 4] {
            if boundary == Boundary::Open {
                let rows = line.differences[a].to_rows();
                let mut out = [0.0; 4];
                rows[span].iter().for_each(|(c, v)| out[c - span] = *v);
                out
            } else {
                [[1.0, 0.0, 0.0, 0.0], [-1.0, 1.0, 0.0, 0.0], [1.0, -2.0, 1.0, 0.0], [-1.0, 3.0, -3.0, 1.0]][a]
            }
        };
        let t: [[f64; 4]; 4] = std::array::from_fn(row);
        let inverse = invert_lower(&t);
        // Local differences of order a in terms of the local coefficients, then of the new numbers.
        let energy = std::array::from_fn(|a| {
            let gram = span_gram(boundary, spans, span, a);
            let differences: Vec<[f64; 4]> = (0..4 - a)
                .map(|r| {
                    let in_coefficients = local_difference(line, span, a, r);
                    // times the inverse; below a the entries are zero, and are made so
                    std::array::from_fn(|k| {
                        if k < a { 0.0 } else { (0..4).map(|c| in_coefficients[c] * inverse[c][k]).sum() }
                    })
                })
                .collect();
            let mut out = [[0.0; 4]; 4];
            for (i, di) in differences.iter().enumerate() {
                for (j, dj) in differences.iter().enumerate() {
                    for k in 0..4 {
                        for l in 0..4 {
                            out[k][l] += gram[i][j] * di[k] * dj[l];
                        }
                    }
                }
            }
            out
        });
        SpanClass { to_differences: t, energy }
    }
}

fn local_difference(line: &Line, span: usize, a: usize, r: usize) -> [f64; 4] {
    let mut out = [0.0; 4];
    if line.boundary == Boundary::Open {
        line.differences[a].to_rows()[span + r].iter().for_each(|(c, v)| out[c - span] = *v);
    } else {
        let binomial: &[f64] = [&[1.0][..], &[-1.0, 1.0], &[1.0, -2.0, 1.0], &[-1.0, 3.0, -3.0, 1.0]][a];
        binomial.iter().enumerate().for_each(|(k, v)| out[r + k] = *v);
    }
    out
}

fn invert_lower(t: &[[f64; 4]; 4]) -> [[f64; 4]; 4] {
    let mut out = [[0.0; 4]; 4];
    for c in 0..4 {
        for r in c..4 {
            let sum: f64 = (c..r).map(|k| t[r][k] * out[k][c]).sum();
            out[r][c] = (f64::from(u8::from(r == c)) - sum) / t[r][r];
        }
    }
    out
}

/// The classes of the spans of an axis.
#[derive(Clone, Debug)]
pub(crate) struct Classes {
    pub(crate) classes: Vec<SpanClass>,
    pub(crate) of: Vec<usize>,
    /// Where the four coefficients of each span are stored.
    pub(crate) index: Vec<[usize; 4]>,
}

impl Classes {
    pub(crate) fn new(line: &Line) -> Classes {
        let n = line.spans;
        let mut classes = Vec::new();
        let mut of = Vec::with_capacity(n);
        let mut inner = None;
        for span in 0..n {
            let edge = line.boundary == Boundary::Open && (span < 3 || span + 3 >= n);
            let class = match (edge, inner) {
                (false, Some(c)) => c,
                _ => {
                    classes.push(SpanClass::new(line, span));
                    if !edge {
                        inner = Some(classes.len() - 1);
                    }
                    classes.len() - 1
                }
            };
            of.push(class);
        }
        let index = (0..n).map(|s| crate::basis::span_taps(line.boundary, n, s, 0.5, 0).index).collect();
        Classes { classes, of, index }
    }
}

/// A pair of classes: transforms of both axes and the matrix of the whole energy in differences.
#[derive(Clone, Debug)]
pub(crate) struct CellMatrix {
    s: [[f64; 4]; 4],
    t: [[f64; 4]; 4],
    matrix: Vec<f64>,
}

impl CellMatrix {
    pub(crate) fn new(s: &SpanClass, t: &SpanClass, terms: &[(usize, usize, f64)]) -> CellMatrix {
        let mut matrix = vec![0.0; 256];
        for &(p, q, c) in terms {
            for i in 0..16 {
                for j in 0..16 {
                    matrix[i * 16 + j] += c * s.energy[p][i / 4][j / 4] * t.energy[q][i % 4][j % 4];
                }
            }
        }
        CellMatrix { s: s.to_differences, t: t.to_differences, matrix }
    }

    /// Differences of the local coefficients.
    pub(crate) fn differences(&self, x: &[f64; 16]) -> [f64; 16] {
        let mut half = [0.0; 16];
        for i in 0..4 {
            for j in 0..4 {
                half[i * 4 + j] = (0..=j).map(|l| self.t[j][l] * x[i * 4 + l]).sum();
            }
        }
        let mut out = [0.0; 16];
        for i in 0..4 {
            for k in 0..=i {
                for j in 0..4 {
                    out[i * 4 + j] += self.s[i][k] * half[k * 4 + j];
                }
            }
        }
        out
    }

    fn transposed_differences(&self, x: &[f64; 16]) -> [f64; 16] {
        let mut half = [0.0; 16];
        for i in 0..4 {
            for k in 0..=i {
                for j in 0..4 {
                    half[k * 4 + j] += self.s[i][k] * x[i * 4 + j];
                }
            }
        }
        let mut out = [0.0; 16];
        for i in 0..4 {
            for j in 0..4 {
                for l in 0..=j {
                    out[i * 4 + l] += self.t[j][l] * half[i * 4 + j];
                }
            }
        }
        out
    }

    /// The matrix times local coefficients.
    pub(crate) fn apply(&self, x: &[f64; 16]) -> [f64; 16] {
        let d = self.differences(x);
        let mut y = [0.0; 16];
        for (i, y) in y.iter_mut().enumerate() {
            let row = &self.matrix[i * 16..][..16];
            let mut acc = [0.0; 4];
            for k in 0..4 {
                for l in 0..4 {
                    acc[l] += row[k * 4 + l] * d[k * 4 + l];
                }
            }
            *y = (acc[0] + acc[1]) + (acc[2] + acc[3]);
        }
        self.transposed_differences(&y)
    }

    /// Energy of local coefficients.
    pub(crate) fn energy(&self, x: &[f64; 16]) -> f64 {
        let d = self.differences(x);
        (0..16).map(|i| d[i] * (0..16).map(|j| self.matrix[i * 16 + j] * d[j]).sum::<f64>()).sum()
    }

    /// The dense matrix in local coefficients.
    pub(crate) fn dense(&self) -> Vec<f64> {
        let mut out = vec![0.0; 256];
        for j in 0..16 {
            let mut unit = [0.0; 16];
            unit[j] = 1.0;
            for (i, v) in self.apply(&unit).into_iter().enumerate() {
                out[i * 16 + j] = v;
            }
        }
        out
    }
}
