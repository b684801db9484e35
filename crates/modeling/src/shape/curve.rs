//! Uniform cubic B-spline curves.

use super::geometry::{CurveJet, ParametricCurve, ball};
use super::span;
use super::vector::{V, length};
use crate::axis::Axis;
use crate::basis::{self, Taps};
use ondelette_wavelet::Boundary;

/// A uniform cubic B-spline curve of 1 (a function of the parameter), 2 or 3 coordinates.
///
/// ```
/// use ondelette_modeling::{Axis, shape::Curve};
/// use ondelette_wavelet::Boundary;
/// let axis = Axis::new(Boundary::Open, 1, [0.0, 1.0])?;
/// let arch = Curve::new(axis, 2, vec![[0.0; 3], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0]])?;
/// assert_eq!(arch.point(0.5), [0.5, 0.75, 0.0]);
/// assert_eq!(arch.refined(1)?.point(0.5), [0.5, 0.75, 0.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    axis: Axis,
    dim: usize,
    points: Vec<[f64; 3]>,
}

/// Why there is no such curve or surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// Not 1 to 3 coordinates.
    #[error("control points of {0} coordinates: a shape has 1 (heights), 2 or 3")]
    Dimension(usize),
    /// The wrong number of control points.
    #[error("{got} control points where the axes want {want}")]
    Points {
        /// Control points given.
        got: usize,
        /// Control points needed.
        want: usize,
    },
    /// A coordinate that is NaN or infinite.
    #[error("control point {index}: coordinate {coordinate} is {value}, which is not a finite number")]
    NotFinite {
        /// Its index in the stored array.
        index: usize,
        /// Which coordinate.
        coordinate: usize,
        /// What it is.
        value: f64,
    },
    /// A refinement that would not fit into memory.
    #[error("{levels} levels finer is {points:.3e} control points, more than {limit}: choose fewer levels")]
    TooFine {
        /// Levels asked for.
        levels: usize,
        /// Control points that this would make.
        points: f64,
        /// Most that are made.
        limit: usize,
    },
    /// An axis that does not exist.
    #[error(transparent)]
    Axis(#[from] crate::axis::AxisError),
}

/// Most control points that a refinement makes (3 GiB).
pub(crate) const MOST_POINTS: usize = 1 << 27;

/// Checks the control points of a shape; unused coordinates become 0.
pub(crate) fn checked(dim: usize, want: usize, mut points: Vec<V>) -> Result<Vec<V>, ShapeError> {
    if !(1..=3).contains(&dim) {
        return Err(ShapeError::Dimension(dim));
    }
    if points.len() != want {
        return Err(ShapeError::Points { got: points.len(), want });
    }
    for (index, p) in points.iter_mut().enumerate() {
        p[dim..].fill(0.0);
        if let Some(coordinate) = p.iter().position(|x| !x.is_finite()) {
            return Err(ShapeError::NotFinite { index, coordinate, value: p[coordinate] });
        }
    }
    Ok(points)
}

/// The axis with `2^levels` times as many spans.
pub(crate) fn finer(axis: &Axis, levels: usize) -> Result<Axis, ShapeError> {
    let points = axis.len() as f64 * 2f64.powi(levels.min(1000) as i32);
    if points > MOST_POINTS as f64 {
        return Err(ShapeError::TooFine { levels, points, limit: MOST_POINTS });
    }
    Ok(Axis::new(axis.boundary(), axis.spans() << levels, axis.domain())?)
}

impl Curve {
    /// The curve with the given control points, `axis.len()` of them; only the first `dim` coordinates are used.
    ///
    /// # Errors
    /// [`ShapeError`].
    pub fn new(axis: Axis, dim: usize, points: Vec<[f64; 3]>) -> Result<Curve, ShapeError> {
        Ok(Curve { axis, dim, points: checked(dim, axis.len(), points)? })
    }

    /// The axis.
    pub fn axis(&self) -> &Axis {
        &self.axis
    }

    /// Number of coordinates.
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// Control points; coordinates past [`Curve::dim`] are 0.
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// The value at `t` (domain units): for one coordinate the height alone. Outside the domain `t` is clamped, or
    /// wrapped if the curve is periodic.
    pub fn point(&self, t: f64) -> [f64; 3] {
        self.derivative(t, 0)
    }

    /// The derivative of the given order by `t`, in domain units; 0 from order 4 on.
    pub fn derivative(&self, t: f64, order: usize) -> [f64; 3] {
        span::combine(&basis::taps(&self.axis, t, order), &self.points)
    }

    /// The same curve with `2^levels` times as many spans. Linear time.
    ///
    /// # Errors
    /// [`ShapeError::TooFine`].
    pub fn refined(&self, levels: usize) -> Result<Curve, ShapeError> {
        let axis = finer(&self.axis, levels)?;
        Ok(self.along(axis, &span::refining(&self.axis, &axis)))
    }

    /// The same curve in the open basis.
    pub fn opened(&self) -> Curve {
        match open_axis(&self.axis) {
            Some(axis) => self.along(axis, &span::refining(&self.axis, &axis)),
            None => self.clone(),
        }
    }

    /// The curve in space that [`ParametricCurve`] sees, in the open basis: for one coordinate the graph (t, value),
    /// exactly, since open splines hold straight lines.
    pub fn in_space(&self) -> Curve {
        let mut out = self.opened();
        if self.dim == 1 {
            out.dim = 2;
            let sites = span::greville(&out.axis);
            for (p, u) in out.points.iter_mut().zip(sites) {
                *p = [out.axis.from_knots(u), p[0], 0.0];
            }
        }
        out
    }

    fn along(&self, axis: Axis, rows: &[Taps]) -> Curve {
        Curve { axis, dim: self.dim, points: rows.iter().map(|r| span::combine(r, &self.points)).collect() }
    }

    /// Bezier points of span `i`: the same cubic. One coordinate gives heights alone.
    ///
    /// # Panics
    /// If there is no such span.
    pub fn bezier(&self, i: usize) -> [[f64; 3]; 4] {
        span::bezier(&self.axis, i).map(|row| span::combine(&row, &self.points))
    }

    /// Bezier points of span `i` in space: of the graph if there is one coordinate.
    ///
    /// # Panics
    /// If there is no such span.
    pub fn bezier_in_space(&self, i: usize) -> [[f64; 3]; 4] {
        let mut b = self.bezier(i);
        if self.dim == 1 {
            for (k, p) in b.iter_mut().enumerate() {
                *p = [self.axis.from_knots(i as f64 + k as f64 / 3.0), p[0], 0.0];
            }
        }
        b
    }
}

/// The open axis of the same spans; `None` if it is open already.
pub(crate) fn open_axis(axis: &Axis) -> Option<Axis> {
    if axis.boundary() == Boundary::Open {
        return None;
    }
    Axis::new(Boundary::Open, axis.spans(), axis.domain()).ok()
}

impl ParametricCurve for Curve {
    fn domain(&self) -> [f64; 2] {
        self.axis.domain()
    }

    fn breaks(&self) -> Vec<f64> {
        (0..=self.axis.spans()).map(|i| self.axis.from_knots(i as f64)).collect()
    }

    fn closed(&self) -> bool {
        self.axis.boundary() == Boundary::Periodic && self.dim > 1
    }

    fn jet(&self, t: f64) -> CurveJet {
        let [mut point, mut first, mut second, mut third] = [0, 1, 2, 3].map(|k| self.derivative(t, k));
        if self.dim == 1 {
            point = [t, point[0], 0.0];
            first = [1.0, first[0], 0.0];
            second = [0.0, second[0], 0.0];
            third = [0.0, third[0], 0.0];
        }
        CurveJet { point, first, second, third }
    }

    fn ball(&self, i: usize) -> ([f64; 3], f64) {
        ball(&self.bezier_in_space(i))
    }

    fn bend(&self, i: usize) -> f64 {
        let b = self.bezier_in_space(i);
        let bend = |k: usize| length(std::array::from_fn(|c| b[k][c] - 2.0 * b[k + 1][c] + b[k + 2][c]));
        6.0 * bend(0).max(bend(1)) * self.axis.density().powi(2)
    }
}
