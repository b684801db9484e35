//! One knot span: which control points are alive on it and how they blend.

use super::vector::V;
use crate::axis::Axis;
use crate::basis::{self, Taps};
use ondelette_wavelet::Boundary;

/// The cubic piece of a uniform spline on one knot span: four control points, six knots (in knot units).
///
/// Control point `k` of the four is the value of the blossom (polar form) at knots `k, k + 1, k + 2` of the six; the
/// span itself lies between knots 2 and 3. Bezier points, refinement and changes of basis follow from it.
///
/// ```
/// use ondelette_modeling::{Axis, shape::Span};
/// use ondelette_wavelet::Boundary;
/// let axis = Axis::new(Boundary::Periodic, 8, [0.0, 1.0])?;
/// let span = Span::new(&axis, 7);
/// assert_eq!(span.points(), [6, 7, 0, 1]);
/// // three equal arguments: the value of the curve
/// assert!((span.blossom([7.0; 3])[1] - 2.0 / 3.0).abs() < 1e-15);
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
        let points = basis::span_taps(axis.boundary(), n, i, 0.0, 0).index;
        let knots = std::array::from_fn(|k| {
            let p = i as f64 + k as f64 - 2.0;
            if axis.boundary() == Boundary::Open { p.clamp(0.0, n as f64) } else { p }
        });
        Span { points, knots }
    }

    /// Indices of the four control points.
    pub fn points(&self) -> [usize; 4] {
        self.points
    }

    /// The weights of the four control points in the blossom of the piece at three arguments, in knot units: de Boor's
    /// algorithm, with an argument a step.
    pub fn blossom(&self, u: [f64; 3]) -> [f64; 4] {
        std::array::from_fn(|k| {
            let mut d = [0.0; 4];
            d[k] = 1.0;
            for (r, &x) in u.iter().enumerate() {
                for i in (r + 1..4).rev() {
                    let (a, b) = (self.knots[i - 1], self.knots[i + 2 - r]);
                    let w = (x - a) / (b - a);
                    d[i] = (1.0 - w) * d[i - 1] + w * d[i];
                }
            }
            d[3]
        })
    }

    /// The control point of another basis with the given knot triple.
    fn taps(&self, u: [f64; 3]) -> Taps {
        Taps { index: self.points, values: self.blossom(u) }
    }
}

/// The control points at the given knot triples (in knot units of `axis`), on the span that holds the middle knot.
pub(crate) fn rows(axis: &Axis, triples: impl Iterator<Item = [f64; 3]>) -> Vec<Taps> {
    triples
        .map(|u| {
            let i = (u[1].max(0.0) as usize).min(axis.spans() - 1);
            Span::new(axis, i).taps(u)
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
pub(crate) fn refining(axis: &Axis, finer: &Axis) -> Vec<Taps> {
    let ratio = axis.spans() as f64 / finer.spans() as f64;
    rows(axis, triples(finer).map(|k| k.map(|x| x * ratio)))
}

/// The rows that make the Bezier points of span `i`.
pub(crate) fn bezier(axis: &Axis, i: usize) -> [Taps; 4] {
    let span = Span::new(axis, i);
    let (a, b) = (i as f64, i as f64 + 1.0);
    [[a, a, a], [a, a, b], [a, b, b], [b, b, b]].map(|u| span.taps(u))
}

pub(crate) fn combine(taps: &Taps, points: &[V]) -> V {
    let mut out = [0.0; 3];
    for (i, w) in taps.iter() {
        for c in 0..3 {
            out[c] += w * points[i][c];
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_blossom_on_the_diagonal_is_the_value() {
        for (boundary, spans) in [(Boundary::Open, 5), (Boundary::Mirrored, 1), (Boundary::Periodic, 4)] {
            let axis = Axis::new(boundary, spans, [0.0, 1.0]).unwrap();
            for i in 0..spans {
                let a = Span::new(&axis, i).blossom([i as f64 + 0.3; 3]);
                let b = basis::span_taps(boundary, spans, i, 0.3, 0).values;
                assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-15), "{a:?} {b:?}");
            }
        }
    }
}
