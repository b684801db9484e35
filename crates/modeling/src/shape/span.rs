//! One knot span: which control points are alive on it and how they blend.

use super::vector::{V, mix};
use crate::axis::Axis;
use ondelette_wavelet::Boundary;

/// The cubic piece of a uniform spline on one knot span: four control points, six knots (in knot units).
///
/// Control point `k` of the four is the value of the blossom (polar form) at knots `k, k + 1, k + 2` of the six; the
/// span itself lies between knots 2 and 3. Everything else (values, derivatives, Bezier points, refinement) follows.
///
/// ```
/// use ondelette_modeling::{Axis, shape::Span};
/// use ondelette_wavelet::Boundary;
/// let axis = Axis::new(Boundary::Periodic, 8, [0.0, 1.0])?;
/// let span = Span::new(&axis, 7);
/// assert_eq!(span.points(), [6, 7, 0, 1]);
/// assert!((span.weights(7.0, 0)[1] - 2.0 / 3.0).abs() < 1e-15);
/// # Ok::<(), ondelette_modeling::AxisError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    points: [usize; 4],
    knots: [f64; 6],
}

impl Span {
    /// Span `i` of an axis.
    ///
    /// # Panics
    /// If there is no such span.
    pub fn new(axis: &Axis, i: usize) -> Span {
        let n = axis.spans();
        assert!(i < n, "span {i} of {n}");
        let (at, last) = (i as isize, n as isize);
        let points = std::array::from_fn(|k| {
            let p = at - 1 + k as isize;
            let index = match axis.boundary() {
                Boundary::Open => p + 1,
                Boundary::Periodic => p.rem_euclid(last),
                Boundary::Mirrored if p < 0 => -p,
                Boundary::Mirrored if p > last => 2 * last - p,
                Boundary::Mirrored => p,
            };
            index as usize
        });
        let knots = std::array::from_fn(|k| {
            let p = at - 2 + k as isize;
            if axis.boundary() == Boundary::Open { p.clamp(0, last) as f64 } else { p as f64 }
        });
        Span { points, knots }
    }

    /// The span that holds parameter `u` (knot units) and `u` brought into the axis: clamped, or wrapped if periodic.
    pub fn at(axis: &Axis, u: f64) -> (Span, f64) {
        let n = axis.spans() as f64;
        let u = if axis.boundary() == Boundary::Periodic { u.rem_euclid(n) } else { u.clamp(0.0, n) };
        // a periodic remainder can round up to n; not-a-number becomes span 0
        let u = if u < n || axis.boundary() != Boundary::Periodic { u } else { 0.0 };
        (Span::new(axis, (u as usize).min(axis.spans() - 1)), u)
    }

    /// Indices of the four control points.
    pub fn points(&self) -> [usize; 4] {
        self.points
    }

    /// Weights of the control points in the `derivative`-th derivative at `u`, both in knot units.
    pub fn weights(&self, u: f64, derivative: usize) -> [f64; 4] {
        let mut out = [0.0; 4];
        if derivative > 3 {
            return out;
        }
        let k = &self.knots;
        let plain = 3 - derivative;
        out[0] = 1.0;
        // Functions of degree d alive on the span: function i starts at knot 2 - d + i.
        for d in 1..=plain {
            let mut next = [0.0; 4];
            for i in 0..d {
                let (a, b) = (k[3 - d + i], k[3 + i]);
                let w = (u - a) / (b - a);
                next[i] += (1.0 - w) * out[i];
                next[i + 1] += w * out[i];
            }
            out = next;
        }
        for d in plain + 1..=3 {
            let mut next = [0.0; 4];
            for i in 0..d {
                let w = d as f64 / (k[3 + i] - k[3 - d + i]);
                next[i] -= w * out[i];
                next[i + 1] += w * out[i];
            }
            out = next;
        }
        out
    }

    /// The blossom of the piece: its polar form at three arguments in knot units.
    pub fn blossom(&self, control: [[f64; 3]; 4], u: [f64; 3]) -> [f64; 3] {
        let mut d: [V; 4] = control;
        for (r, &x) in u.iter().enumerate() {
            for i in (r + 1..4).rev() {
                let (a, b) = (self.knots[i - 1], self.knots[i + 2 - r]);
                d[i] = mix(d[i - 1], d[i], (x - a) / (b - a));
            }
        }
        d[3]
    }

    /// The weights that [`Span::blossom`] gives the control points.
    pub fn blossom_weights(&self, u: [f64; 3]) -> [f64; 4] {
        let mut out = [0.0; 4];
        for (k, w) in out.iter_mut().enumerate() {
            let mut unit = [[0.0; 3]; 4];
            unit[k][0] = 1.0;
            *w = self.blossom(unit, u)[0];
        }
        out
    }
}

/// One new control point as a combination of four old ones.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    pub(crate) points: [usize; 4],
    pub(crate) weights: [f64; 4],
}

/// The control points at the given knot triples (in knot units of `axis`), on the span that holds the middle knot.
pub(crate) fn rows(axis: &Axis, triples: impl Iterator<Item = [f64; 3]>) -> Vec<Row> {
    triples
        .map(|u| {
            let i = (u[1].max(0.0) as usize).min(axis.spans() - 1);
            let span = Span::new(axis, i);
            Row { points: span.points, weights: span.blossom_weights(u) }
        })
        .collect()
}

/// Knot triples of the control points of `axis`, in its knot units.
pub(crate) fn triples(axis: &Axis) -> impl Iterator<Item = [f64; 3]> {
    let (open, n) = (axis.boundary() == Boundary::Open, axis.spans() as f64);
    (0..axis.len()).map(move |j| {
        let j = j as f64;
        if open { [j - 2.0, j - 1.0, j].map(|x| x.clamp(0.0, n)) } else { [j - 1.0, j, j + 1.0] }
    })
}

/// Places of the control points (Greville abscissae: means of their knot triples), in knot units.
pub(crate) fn greville(axis: &Axis) -> Vec<f64> {
    triples(axis).map(|k| (k[0] + k[1] + k[2]) / 3.0).collect()
}

/// Rows to the same function on `factor` times as many spans.
pub(crate) fn refining(axis: &Axis, finer: &Axis) -> Vec<Row> {
    let ratio = axis.spans() as f64 / finer.spans() as f64;
    rows(axis, triples(finer).map(|k| k.map(|x| x * ratio)))
}

pub(crate) fn combine(row: &Row, points: &[V]) -> V {
    let mut out = [0.0; 3];
    for (&i, &w) in row.points.iter().zip(&row.weights) {
        for c in 0..3 {
            out[c] += w * points[i][c];
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use ondelette_wavelet::{SplineFamily, SplineSpace};

    #[test]
    fn functions_and_derivatives_are_those_of_the_spline_space() {
        for (boundary, spans) in [
            (Boundary::Open, 1),
            (Boundary::Open, 2),
            (Boundary::Open, 7),
            (Boundary::Mirrored, 1),
            (Boundary::Mirrored, 6),
            (Boundary::Periodic, 4),
            (Boundary::Periodic, 9),
        ] {
            let axis = Axis::new(boundary, spans, [0.0, 1.0]).unwrap();
            let space = SplineSpace::new(SplineFamily::CUBIC, boundary, axis.len()).unwrap();
            for step in 0..=40 {
                let u = spans as f64 * f64::from(step) / 40.0;
                for derivative in 0..=3 {
                    let mut dense = vec![0.0; axis.len()];
                    space.basis(u, derivative).iter().for_each(|&(i, v)| dense[i] += v);
                    let (span, u) = Span::at(&axis, u);
                    span.points().iter().zip(span.weights(u, derivative)).for_each(|(&i, w)| dense[i] -= w);
                    let worst = dense.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                    assert!(worst < 1e-13, "{boundary} {spans} u {u} derivative {derivative}: {worst}");
                }
            }
        }
    }

    #[test]
    fn the_blossom_on_the_diagonal_is_the_piece() {
        let axis = Axis::new(Boundary::Open, 5, [0.0, 1.0]).unwrap();
        for i in 0..5 {
            let span = Span::new(&axis, i);
            let u = i as f64 + 0.3;
            let (a, b) = (span.blossom_weights([u; 3]), span.weights(u, 0));
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-15), "{a:?} {b:?}");
        }
    }
}
