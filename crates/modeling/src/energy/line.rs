//! The derivatives of one axis: differences, and Gram matrices of the B-splines of lower degree.
//!
//! The a-th derivative of a cubic spline is a spline of degree 3 - a whose coefficients are (scaled) differences; its
//! squared norm is `|D x|^2` in the Gram matrix `B` of those splines. `D^T B D` annihilates polynomials of degree
//! below a, up to the rounding of the coefficients themselves; a table of its entries does not.

use super::stencil::Stencil;
use crate::axis::Axis;
use ondelette_numerics::gauss;
use ondelette_wavelet::Boundary;

/// Differences and Gram matrices of an axis, in knot units.
#[derive(Clone, Debug)]
pub(crate) struct Line {
    pub(crate) boundary: Boundary,
    pub(crate) spans: usize,
    pub(crate) n: usize,
    /// `differences[a]`: coefficients to those of the a-th derivative, `spans + 3 - a` of them.
    pub(crate) differences: [Stencil; 4],
    pub(crate) transposed: [Stencil; 4],
    /// Gram matrix of the B-splines of degree 3 - a.
    pub(crate) gram: [Stencil; 4],
    /// `D^T B D`, multiplied out: fast, with the rounding of its entries.
    pub(crate) energy: [Stencil; 4],
}

/// Spans of which all are looked at; a longer line has only more rows like those in the middle.
const SHORT: usize = 64;

impl Line {
    /// The line of an axis. Cost O(1) in its spans.
    pub(crate) fn new(axis: &Axis) -> Line {
        let spans = axis.spans().min(SHORT);
        let more = axis.spans() - spans;
        let mut line = Line::short(axis.boundary(), spans, axis.len() - more);
        for all in [&mut line.differences, &mut line.transposed, &mut line.gram, &mut line.energy] {
            all.iter_mut().for_each(|stencil| stencil.lengthen(more));
        }
        Line { spans: axis.spans(), n: axis.len(), ..line }
    }

    fn short(boundary: Boundary, spans: usize, n: usize) -> Line {
        let differences: [Stencil; 4] = std::array::from_fn(|a| difference(boundary, spans, n, a));
        let gram: [Stencil; 4] = std::array::from_fn(|a| gram(boundary, spans, a, None));
        let transposed: [Stencil; 4] = std::array::from_fn(|a| differences[a].transposed());
        let energy = std::array::from_fn(|a| transposed[a].times(&gram[a]).times(&differences[a]));
        Line { boundary, spans, n, differences, transposed, gram, energy }
    }

    /// `D^T B D` with a weight a span.
    pub(crate) fn weighted(&self, a: usize, weights: &[f64]) -> Stencil {
        self.transposed[a].times(&gram(self.boundary, self.spans, a, Some(weights))).times(&self.differences[a])
    }

    /// The Gram matrix of the a-th derivatives with a weight a span.
    pub(crate) fn weighted_gram(&self, a: usize, weights: &[f64]) -> Stencil {
        gram(self.boundary, self.spans, a, Some(weights))
    }

    /// The coefficients of 1, t, t^2, ... (knot units, from the middle, scaled to size 1) below `degree` that the
    /// boundary allows.
    pub(crate) fn polynomials(&self, degree: usize) -> Vec<Vec<f64>> {
        let most = if self.boundary == Boundary::Open { degree } else { degree.min(1) };
        let n = self.spans as f64;
        let knot = |i: isize| i.clamp(0, self.spans as isize) as f64 / n * 2.0 - 1.0;
        let blossom = |j: isize, d: usize| {
            // The blossom of t^d at the three inner knots of function j (Marsden).
            let (a, b, c) = (knot(j - 2), knot(j - 1), knot(j));
            match d {
                0 => 1.0,
                1 => (a + b + c) / 3.0,
                2 => (a * b + b * c + c * a) / 3.0,
                _ => a * b * c,
            }
        };
        (0..most).map(|d| (0..self.n as isize).map(|j| blossom(j, d)).collect()).collect()
    }
}

/// Where coefficient `i` of the line continued past its ends (`0 ..= spans + 2`) is stored.
fn stored(boundary: Boundary, spans: usize, i: usize) -> usize {
    let n = spans as isize;
    let at = i as isize - 1;
    match boundary {
        Boundary::Open => i,
        Boundary::Periodic => at.rem_euclid(n) as usize,
        Boundary::Mirrored => {
            let at = at.rem_euclid(2 * n);
            at.min(2 * n - at) as usize
        }
    }
}

/// Row `r` of the a-th differences of the continued line, `spans + 3 - a` rows.
fn difference_row(boundary: Boundary, spans: usize, a: usize, r: usize) -> Vec<(usize, f64)> {
    if a == 0 {
        return vec![(r, 1.0)];
    }
    let width = match boundary {
        // The B-splines of degree d = 4 - a, number r + 1, have knots r + 1 ..= r + 1 + d of the clamped vector.
        Boundary::Open => {
            let d = 4 - a as isize;
            let knot = |i: isize| (i - d).clamp(0, spans as isize);
            let r = r as isize + 1;
            d as f64 / (knot(r + d) - knot(r)) as f64
        }
        _ => 1.0,
    };
    let mut row: Vec<(usize, f64)> = Vec::new();
    for (r, sign) in [(r, -width), (r + 1, width)] {
        row.extend(difference_row(boundary, spans, a - 1, r).into_iter().map(|(c, v)| (c, sign * v)));
    }
    row
}

fn difference(boundary: Boundary, spans: usize, n: usize, a: usize) -> Stencil {
    let rows = (0..spans + 3 - a)
        .map(|r| {
            let row = difference_row(boundary, spans, a, r);
            row.into_iter().map(|(c, v)| (stored(boundary, spans, c), v)).collect()
        })
        .collect();
    Stencil::new(n, rows)
}

/// Values of the B-splines of degree `degree` alive on a span, at `x` in `0 ..= 1`.
pub(crate) fn lower_degree(boundary: Boundary, spans: usize, span: usize, degree: usize, x: f64) -> [f64; 4] {
    let knot = |i: isize| {
        let at = span as isize + i;
        let at = if boundary == Boundary::Open { at.clamp(0, spans as isize) } else { at };
        (at - span as isize) as f64
    };
    let mut values = [1.0, 0.0, 0.0, 0.0];
    for d in 1..=degree {
        let old = values;
        values = [0.0; 4];
        for k in 0..d {
            let (left, right) = (knot(k as isize + 1 - d as isize), knot(k as isize + 1));
            let part = old[k] / (right - left);
            values[k] += (right - x) * part;
            values[k + 1] += (x - left) * part;
        }
    }
    values
}

/// `int_0^1 b_i b_j` of the B-splines of degree 3 - a alive on a span.
pub(crate) fn span_gram(boundary: Boundary, spans: usize, span: usize, a: usize) -> [[f64; 4]; 4] {
    let (nodes, weights) = gauss::rule(4);
    let mut out = [[0.0; 4]; 4];
    for (x, w) in nodes.iter().zip(&weights) {
        let v = lower_degree(boundary, spans, span, 3 - a, *x);
        for i in 0..4 {
            for j in 0..4 {
                out[i][j] += w * v[i] * v[j];
            }
        }
    }
    out
}

fn gram(boundary: Boundary, spans: usize, a: usize, weights: Option<&[f64]>) -> Stencil {
    let m = spans + 3 - a;
    let mut rows = vec![Vec::new(); m];
    let inner = span_gram(boundary, 16, 8, a);
    for span in 0..spans {
        let edge = boundary == Boundary::Open && (span < 3 || span + 3 >= spans);
        let local = if edge { span_gram(boundary, spans, span, a) } else { inner };
        let w = weights.map_or(1.0, |w| w[span]);
        for i in 0..4 - a {
            for j in 0..4 - a {
                rows[span + i].push((span + j, w * local[i][j]));
            }
        }
    }
    Stencil::new(m, rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ondelette_wavelet::exact::to_f64;
    use ondelette_wavelet::{SplineFamily, gram};

    #[test]
    fn energies_are_the_exact_ones_of_the_wavelet_crate() {
        for (boundary, least) in [(Boundary::Open, 1), (Boundary::Mirrored, 1), (Boundary::Periodic, 4)] {
            for spans in (least..8).chain([16, 33]) {
                let axis = Axis::new(boundary, spans, [0.0, 1.0]).unwrap();
                let line = Line::new(&axis);
                let n = axis.len();
                for a in 0..3 {
                    let mut want = vec![0.0; n * n];
                    for (i, j, v) in gram::exact_energy(SplineFamily::CUBIC, boundary, n, a) {
                        want[i * n + j] += to_f64(&v);
                    }
                    let mut got = vec![0.0; n * n];
                    for (i, row) in line.energy[a].to_rows().into_iter().enumerate() {
                        row.into_iter().for_each(|(j, v)| got[i * n + j] += v);
                    }
                    for (k, (g, w)) in got.iter().zip(&want).enumerate() {
                        assert!((g - w).abs() < 1e-13, "{boundary:?} {spans} a {a} entry {k}: {g} {w}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_long_line_is_a_short_one_with_more_in_the_middle() {
        for boundary in [Boundary::Open, Boundary::Mirrored, Boundary::Periodic] {
            for spans in [SHORT - 1, SHORT, SHORT + 1, 3 * SHORT + 5] {
                let axis = Axis::new(boundary, spans, [0.0, 1.0]).unwrap();
                let (line, whole) = (Line::new(&axis), Line::short(boundary, spans, axis.len()));
                assert_eq!((line.spans, line.n), (whole.spans, whole.n));
                for (a, b) in [
                    (&line.differences, &whole.differences),
                    (&line.transposed, &whole.transposed),
                    (&line.gram, &whole.gram),
                    (&line.energy, &whole.energy),
                ] {
                    for (a, b) in a.iter().zip(b) {
                        let whole = (b.rows, b.cols, b.to_rows());
                        assert_eq!((a.rows, a.cols, a.to_rows()), whole, "{boundary:?} {spans}");
                    }
                }
            }
        }
    }

    #[test]
    fn differences_annihilate_polynomials() {
        let line = Line::new(&Axis::new(Boundary::Open, 21, [0.0, 1.0]).unwrap());
        for (d, p) in line.polynomials(3).iter().enumerate() {
            for a in d + 1..4 {
                let mut y = vec![1.0; line.differences[a].rows];
                line.differences[a].along(p, &mut y);
                assert!(y.iter().all(|y| y.abs() < 1e-14), "degree {d}, derivative {a}");
            }
        }
    }
}
