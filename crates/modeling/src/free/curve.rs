//! Free curves and paths of them.

use super::knots::{FreeError, H, Knots};
use crate::shape::vector::{V, length};
use crate::shape::{Curve, CurveJet, ParametricCurve};

/// A spline curve of any degree and knots, with weights or without, of 2 or 3 coordinates.
///
/// ```
/// use ondelette_modeling::{free::{FreeCurve, Knots}, shape::ParametricCurve};
/// let knots = Knots::new(2, vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], 3)?;
/// let half = 0.5_f64.sqrt();
/// let points = vec![[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
/// let arc = FreeCurve::new(2, knots, points, Some(vec![1.0, half, 1.0]))?;
/// let p = arc.jet(0.3).point;
/// assert!((p[0].hypot(p[1]) - 1.0).abs() < 1e-15, "a quarter of a circle");
/// # Ok::<(), ondelette_modeling::free::FreeError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct FreeCurve {
    dim: usize,
    knots: Knots,
    points: Vec<[f64; 3]>,
    weights: Option<Vec<f64>>,
}

/// Several curves that belong together: the sub-paths of an outline, the edges of a part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FreePath {
    /// Sub-paths in order.
    pub parts: Vec<FreeCurve>,
}

/// Checks points and weights; weights that are all equal are none.
pub(super) fn checked(
    dim: usize,
    want: usize,
    points: &mut [V],
    weights: Option<Vec<f64>>,
) -> Result<Option<Vec<f64>>, FreeError> {
    if !(2..=3).contains(&dim) {
        return Err(FreeError::Dimension(dim));
    }
    if points.len() != want {
        return Err(FreeError::Count { what: "control points", got: points.len(), want });
    }
    for (index, p) in points.iter_mut().enumerate() {
        p[dim..].fill(0.0);
        if let Some(&value) = p.iter().find(|x| !x.is_finite()) {
            return Err(FreeError::NotFinite { what: "control point", index, value });
        }
    }
    let Some(weights) = weights else { return Ok(None) };
    if weights.len() != want {
        return Err(FreeError::Count { what: "weights", got: weights.len(), want });
    }
    if let Some(index) = weights.iter().position(|w| !(w.is_finite() && *w > 0.0)) {
        return Err(FreeError::Weight { index, value: weights[index] });
    }
    Ok(weights.iter().any(|w| *w != weights[0]).then_some(weights))
}

impl FreeCurve {
    /// The curve with the given control points (only `dim` coordinates are used) and weights. Weights that are all
    /// equal mean none.
    ///
    /// # Errors
    /// [`FreeError`].
    pub fn new(
        dim: usize,
        knots: Knots,
        mut points: Vec<[f64; 3]>,
        weights: Option<Vec<f64>>,
    ) -> Result<FreeCurve, FreeError> {
        let weights = checked(dim, knots.points(), &mut points, weights)?;
        Ok(FreeCurve { dim, knots, points, weights })
    }

    /// Number of coordinates, 2 or 3.
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// Degree and knots.
    pub fn knots(&self) -> &Knots {
        &self.knots
    }

    /// Control points.
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// Weights, if they differ.
    pub fn weights(&self) -> Option<&[f64]> {
        self.weights.as_deref()
    }

    /// Whether the last point is the first, to 1e-12 of the size of the curve.
    pub fn is_closed(&self) -> bool {
        let [a, b] = self.knots.domain();
        let (p, q) = (self.jet(a).point, self.jet(b).point);
        let size = self.points.iter().fold(0.0_f64, |m, x| m.max(length(crate::shape::vector::sub(*x, p))));
        length(crate::shape::vector::sub(p, q)) <= 1e-12 * size
    }

    pub(super) fn control(&self, i: usize) -> H {
        let w = self.weights.as_ref().map_or(1.0, |w| w[i]);
        let p = self.points[i];
        [w * p[0], w * p[1], w * p[2], w]
    }

    /// The point at `t`, which is clamped to the domain.
    pub fn point(&self, t: f64) -> [f64; 3] {
        self.jet(t).point
    }

    /// Point and derivatives of the piece on `span` (one of [`Knots::spans`]), which tells the sides of a knot apart.
    pub fn jet_on(&self, span: usize, t: f64) -> CurveJet {
        let h = [0, 1, 2, 3].map(|order| self.knots.derivative(span, t, order, |i| self.control(i)));
        let [a, b, c, d] = h.map(|h| [h[0], h[1], h[2]]);
        if self.weights.is_none() {
            return CurveJet { point: a, first: b, second: c, third: d };
        }
        let w = h.map(|h| h[3]);
        let point: V = std::array::from_fn(|k| a[k] / w[0]);
        let first: V = std::array::from_fn(|k| (b[k] - w[1] * point[k]) / w[0]);
        let second: V = std::array::from_fn(|k| (c[k] - 2.0 * w[1] * first[k] - w[2] * point[k]) / w[0]);
        let third: V =
            std::array::from_fn(|k| (d[k] - 3.0 * w[1] * second[k] - 3.0 * w[2] * first[k] - w[3] * point[k]) / w[0]);
        CurveJet { point, first, second, third }
    }

    /// The same curve with one more knot at `t`.
    ///
    /// # Errors
    /// `t` is not finite, or repeated too often there.
    pub fn with_knot(&self, t: f64) -> Result<FreeCurve, FreeError> {
        let knots = self.knots.with(t)?;
        let (points, weights) = plain(self.knots.refine(&knots, |i| self.control(i)));
        FreeCurve::new(self.dim, knots, points, self.weights.is_some().then_some(weights))
    }

    /// Bezier points of the piece on `span`, with their weights.
    pub fn bezier(&self, span: usize) -> (Vec<[f64; 3]>, Vec<f64>) {
        let ([a, b], p) = (self.knots.ends(span), self.knots.degree());
        let point = |k: usize| {
            let arguments: Vec<f64> = (0..p).map(|i| if i < p - k { a } else { b }).collect();
            self.knots.blossom(span, &arguments, |i| self.control(i))
        };
        plain((0..=p).map(point).collect())
    }

    /// The same curve, run through backwards.
    pub fn reversed(&self) -> FreeCurve {
        let sum = self.knots.values().first().unwrap_or(&0.0) + self.knots.values().last().unwrap_or(&0.0);
        let values = self.knots.values().iter().rev().map(|k| sum - k).collect();
        let mut out = self.clone();
        out.points.reverse();
        if let Some(w) = &mut out.weights {
            w.reverse();
        }
        if let Ok(knots) = Knots::new(self.knots.degree(), values, self.points.len()) {
            out.knots = knots;
        }
        out
    }
}

/// Points and weights of homogeneous points.
pub(super) fn plain(h: Vec<H>) -> (Vec<V>, Vec<f64>) {
    h.into_iter().map(|h| ([h[0] / h[3], h[1] / h[3], h[2] / h[3]], h[3])).unzip()
}

/// A uniform curve as others write it: open knots in domain units; one coordinate becomes the graph.
impl From<&Curve> for FreeCurve {
    fn from(curve: &Curve) -> FreeCurve {
        let curve = curve.in_space();
        let axis = *curve.axis();
        FreeCurve { dim: curve.dim(), knots: open_knots(&axis), points: curve.points().to_vec(), weights: None }
    }
}

/// The quadruple-end knots of an open axis, in domain units.
pub(super) fn open_knots(axis: &crate::Axis) -> Knots {
    let n = axis.spans();
    let [a, b] = axis.domain();
    let inner = (1..n).map(|i| axis.from_knots(i as f64));
    let knots = [a; 4].into_iter().chain(inner).chain([b; 4]).collect();
    Knots::new(3, knots, n + 3).expect("open axes have knots that increase")
}

impl ParametricCurve for FreeCurve {
    fn domain(&self) -> [f64; 2] {
        self.knots.domain()
    }

    fn breaks(&self) -> Vec<f64> {
        self.knots.breaks()
    }

    fn closed(&self) -> bool {
        self.is_closed()
    }

    fn jet(&self, t: f64) -> CurveJet {
        let [a, b] = self.knots.domain();
        let t = t.clamp(a, b);
        self.jet_on(self.knots.span(t), t)
    }

    fn ball(&self, i: usize) -> ([f64; 3], f64) {
        let span = self.knots.spans()[i];
        crate::shape::ball(&self.points[span - self.knots.degree()..=span])
    }

    /// From Bezier points; with weights, twice the largest of 17 samples.
    fn bend(&self, i: usize) -> f64 {
        let span = self.knots.spans()[i];
        let [a, b] = self.knots.ends(span);
        if self.weights.is_some() {
            let at = |k: i32| length(self.jet_on(span, a + (b - a) * f64::from(k) / 16.0).second);
            return 2.0 * (0..=16).map(at).fold(0.0, f64::max);
        }
        let p = self.knots.degree();
        let (points, _) = self.bezier(span);
        let bend = |w: &[V]| length(std::array::from_fn(|c| w[0][c] - 2.0 * w[1][c] + w[2][c]));
        (p * (p - 1)) as f64 * points.windows(3).map(bend).fold(0.0, f64::max) / (b - a).powi(2)
    }
}
