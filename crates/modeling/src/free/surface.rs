//! Free surfaces.

use super::curve::{checked, open_knots};
use super::knots::{FreeError, H, Knots};
use crate::shape::vector::{V, length};
use crate::shape::{ParametricSurface, Surface, SurfaceJet};

/// A tensor spline surface in space of any degrees and knots, with weights or without.
///
/// ```
/// use ondelette_modeling::{free::{FreeSurface, Knots}, shape::ParametricSurface};
/// let knots = || Knots::new(1, vec![0.0, 0.0, 1.0, 1.0], 2);
/// let points = vec![[0.0; 3], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 1.0]];
/// let saddle = FreeSurface::new([knots()?, knots()?], points, None)?;
/// assert_eq!(saddle.jet(0.5, 0.5).point, [0.5, 0.5, 0.25]);
/// # Ok::<(), ondelette_modeling::free::FreeError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct FreeSurface {
    knots: [Knots; 2],
    points: Vec<[f64; 3]>,
    weights: Option<Vec<f64>>,
}

impl FreeSurface {
    /// The surface with the given control points and weights, row-major by the first direction. Weights that are all
    /// equal mean none.
    ///
    /// # Errors
    /// [`FreeError`].
    pub fn new(
        knots: [Knots; 2],
        mut points: Vec<[f64; 3]>,
        weights: Option<Vec<f64>>,
    ) -> Result<FreeSurface, FreeError> {
        let want = knots[0].points().saturating_mul(knots[1].points());
        let weights = checked(3, want, &mut points, weights)?;
        Ok(FreeSurface { knots, points, weights })
    }

    /// Degree and knots of both directions.
    pub fn knots(&self) -> &[Knots; 2] {
        &self.knots
    }

    /// Control points, row-major.
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// Weights, row-major, if they differ.
    pub fn weights(&self) -> Option<&[f64]> {
        self.weights.as_deref()
    }

    pub(super) fn control(&self, i: usize, j: usize) -> H {
        let k = i * self.knots[1].points() + j;
        let w = self.weights.as_ref().map_or(1.0, |w| w[k]);
        let p = self.points[k];
        [w * p[0], w * p[1], w * p[2], w]
    }

    /// The point at `s, t`, which are clamped to the domain.
    pub fn point(&self, s: f64, t: f64) -> [f64; 3] {
        self.jet(s, t).point
    }

    /// The same surface with one more knot at `t` of `direction` (0 or 1).
    ///
    /// # Errors
    /// `t` is not finite, or repeated too often there.
    ///
    /// # Panics
    /// If there is no such direction.
    pub fn with_knot(&self, direction: usize, t: f64) -> Result<FreeSurface, FreeError> {
        let mut knots = self.knots.clone();
        knots[direction] = self.knots[direction].with(t)?;
        let [n, m] = [knots[0].points(), knots[1].points()];
        let mut h = vec![[0.0; 4]; n * m];
        for line in 0..if direction == 0 { m } else { n } {
            let control = |i: usize| if direction == 0 { self.control(i, line) } else { self.control(line, i) };
            for (i, p) in self.knots[direction].refine(&knots[direction], control).into_iter().enumerate() {
                h[if direction == 0 { i * m + line } else { line * m + i }] = p;
            }
        }
        let (points, weights) = super::curve::plain(h);
        FreeSurface::new(knots, points, self.weights.is_some().then_some(weights))
    }

    /// Homogeneous mixed derivative of the patch on the given spans.
    fn homogeneous(&self, spans: [usize; 2], at: [f64; 2], orders: [usize; 2]) -> H {
        self.knots[0].derivative(spans[0], at[0], orders[0], |i| {
            self.knots[1].derivative(spans[1], at[1], orders[1], |j| self.control(i, j))
        })
    }

    /// Point and derivatives of the patch on the given spans (see [`Knots::spans`]).
    pub fn jet_on(&self, spans: [usize; 2], s: f64, t: f64) -> SurfaceJet {
        let of = |a: usize, b: usize| self.homogeneous(spans, [s, t], [a, b]);
        let h = [of(0, 0), of(1, 0), of(0, 1), of(2, 0), of(1, 1), of(0, 2)];
        let v = h.map(|h| [h[0], h[1], h[2]]);
        if self.weights.is_none() {
            return SurfaceJet { point: v[0], first: [v[1], v[2]], second: [v[3], v[4], v[5]] };
        }
        let w = h.map(|h| h[3]);
        let point: V = std::array::from_fn(|c| v[0][c] / w[0]);
        let first: [V; 2] = [1, 2].map(|k| std::array::from_fn(|c| (v[k][c] - w[k] * point[c]) / w[0]));
        let second = [(3, 0, 0), (4, 0, 1), (5, 1, 1)].map(|(k, a, b)| {
            std::array::from_fn(|c| {
                (v[k][c] - w[1 + a] * first[b][c] - w[1 + b] * first[a][c] - w[k] * point[c]) / w[0]
            })
        });
        SurfaceJet { point, first, second }
    }

    fn spans_of(&self, i: usize, j: usize) -> [usize; 2] {
        [self.knots[0].spans()[i], self.knots[1].spans()[j]]
    }
}

/// A uniform surface as others write it: open knots in domain units; heights become the graph, planar nets get z = 0.
impl From<&Surface> for FreeSurface {
    fn from(surface: &Surface) -> FreeSurface {
        let surface = surface.in_space();
        let [s, t] = surface.axes();
        FreeSurface { knots: [open_knots(s), open_knots(t)], points: surface.points().to_vec(), weights: None }
    }
}

impl ParametricSurface for FreeSurface {
    fn domain(&self) -> [[f64; 2]; 2] {
        [self.knots[0].domain(), self.knots[1].domain()]
    }

    fn breaks(&self) -> [Vec<f64>; 2] {
        [self.knots[0].breaks(), self.knots[1].breaks()]
    }

    fn closed(&self) -> [bool; 2] {
        [false; 2]
    }

    fn jet(&self, s: f64, t: f64) -> SurfaceJet {
        let [[a, b], [c, d]] = self.domain();
        let (s, t) = (s.clamp(a, b), t.clamp(c, d));
        self.jet_on([self.knots[0].span(s), self.knots[1].span(t)], s, t)
    }

    fn ball(&self, i: usize, j: usize) -> ([f64; 3], f64) {
        let spans = self.spans_of(i, j);
        let [p, q] = [self.knots[0].degree(), self.knots[1].degree()];
        let width = self.knots[1].points();
        let rows = spans[0] - p..=spans[0];
        let points: Vec<V> =
            rows.flat_map(|i| self.points[i * width + spans[1] - q..=i * width + spans[1]].iter().copied()).collect();
        crate::shape::ball(&points)
    }

    /// From 9 x 9 samples, half as much again: not a strict bound.
    fn bend(&self, i: usize, j: usize) -> [f64; 3] {
        let spans = self.spans_of(i, j);
        let ends = [self.knots[0].ends(spans[0]), self.knots[1].ends(spans[1])];
        let at = |k: usize, a: usize| ends[a][0] + (ends[a][1] - ends[a][0]) * k as f64 / 8.0;
        let mut out = [0.0_f64; 3];
        for k in 0..=8 {
            for l in 0..=8 {
                let jet = self.jet_on(spans, at(k, 0), at(l, 1));
                for (o, d) in out.iter_mut().zip(jet.second) {
                    *o = o.max(1.5 * length(d));
                }
            }
        }
        out
    }
}
