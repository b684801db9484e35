//! What geometry needs of a parametric curve or surface, and what follows from it: normals and curvature.

use super::closest::{self, Nearest, NearestOnSurface};
use super::tessellate::{self, Mesh, Polyline, TessellateError};
use super::vector::{V, cross, dot, length, scale, sub, unit};

/// A curve's point and derivatives by the parameter, in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveJet {
    /// Position.
    pub point: [f64; 3],
    /// First derivative.
    pub first: [f64; 3],
    /// Second derivative.
    pub second: [f64; 3],
    /// Third derivative.
    pub third: [f64; 3],
}

impl CurveJet {
    /// Unit tangent; `None` where the first derivative vanishes.
    pub fn tangent(&self) -> Option<[f64; 3]> {
        unit(self.first)
    }

    /// Curvature vector: it points to the centre of the osculating circle, its length is one over the radius.
    pub fn curvature_vector(&self) -> Option<[f64; 3]> {
        let t = self.tangent()?;
        let speed = dot(self.first, self.first);
        Some(scale(sub(self.second, scale(t, dot(self.second, t))), 1.0 / speed))
    }

    /// Curvature, not negative.
    pub fn curvature(&self) -> Option<f64> {
        self.curvature_vector().map(length)
    }

    /// Curvature in the x-y plane: positive where the curve turns left.
    pub fn signed_curvature(&self) -> Option<f64> {
        let speed = self.first[0].hypot(self.first[1]);
        let area = self.first[0] * self.second[1] - self.first[1] * self.second[0];
        (speed > 0.0).then(|| area / speed.powi(3))
    }

    /// Torsion; `None` where the curve has no osculating plane.
    pub fn torsion(&self) -> Option<f64> {
        let area = cross(self.first, self.second);
        let size = dot(area, area);
        (size > 1e-24 * dot(self.first, self.first) * dot(self.second, self.second))
            .then(|| dot(area, self.third) / size)
    }
}

/// A surface's point and derivatives by its parameters `s` and `t`, in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceJet {
    /// Position.
    pub point: [f64; 3],
    /// First derivatives by s and by t.
    pub first: [[f64; 3]; 2],
    /// Second derivatives: ss, st, tt.
    pub second: [[f64; 3]; 3],
}

/// Curvatures of a surface at a point, signed by its normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curvature {
    /// Product of the principal curvatures.
    pub gaussian: f64,
    /// Mean of the principal curvatures.
    pub mean: f64,
    /// Principal curvatures, the smaller first.
    pub principal: [f64; 2],
}

impl SurfaceJet {
    /// Unit normal, first derivative by s times first derivative by t; `None` where they are zero or parallel.
    pub fn normal(&self) -> Option<[f64; 3]> {
        let [a, b] = self.first;
        let n = cross(a, b);
        (length(n) > 1e-12 * length(a) * length(b)).then(|| unit(n)).flatten()
    }

    /// Gaussian, mean and principal curvature; `None` where there is no normal.
    pub fn curvature(&self) -> Option<Curvature> {
        let n = self.normal()?;
        let [a, b] = self.first;
        let (e, f, g) = (dot(a, a), dot(a, b), dot(b, b));
        let [l, m, k] = self.second.map(|d| dot(d, n));
        let area = e * g - f * f;
        let gaussian = (l * k - m * m) / area;
        let mean = (e * k - 2.0 * f * m + g * l) / (2.0 * area);
        let root = (mean * mean - gaussian).max(0.0).sqrt();
        Some(Curvature { gaussian, mean, principal: [mean - root, mean + root] })
    }
}

/// A curve in space, made of smooth pieces.
///
/// ```
/// use ondelette_modeling::{Axis, shape::{Curve, ParametricCurve}};
/// use ondelette_wavelet::Boundary;
/// let axis = Axis::new(Boundary::Open, 1, [0.0, 3.0])?;
/// let line = Curve::new(axis, 2, (0..4).map(|i| [f64::from(i), 0.0, 0.0]).collect())?;
/// let near = line.closest([1.25, -2.0, 0.0]);
/// assert!((near.t - 1.25).abs() < 1e-12 && (near.distance - 2.0).abs() < 1e-12);
/// assert_eq!(line.tessellate(1e-3)?.points.len(), 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait ParametricCurve {
    /// First and last parameter.
    fn domain(&self) -> [f64; 2];
    /// Parameters where the pieces meet, from the first to the last of the domain.
    fn breaks(&self) -> Vec<f64>;
    /// Whether the end joins the start smoothly, as one more point inside.
    fn closed(&self) -> bool;
    /// Point and derivatives at `t`.
    fn jet(&self, t: f64) -> CurveJet;
    /// A ball that holds piece `i`: bounds the distance to it from below. Centre and radius.
    fn ball(&self, i: usize) -> ([f64; 3], f64);
    /// A bound on the length of the second derivative over piece `i`, in parameter units.
    fn bend(&self, i: usize) -> f64;

    /// Points on the curve whose chords leave it by at most `tolerance`; the pieces' ends are among them.
    ///
    /// # Errors
    /// [`TessellateError`]: a tolerance that is not positive, or too many points.
    fn tessellate(&self, tolerance: f64) -> Result<Polyline, TessellateError> {
        tessellate::curve(self, tolerance)
    }

    /// The nearest point: pieces are visited by a lower bound of their distance, those that cannot win are skipped; on
    /// each, every local minimum of 9 samples is refined by golden section and Newton's method.
    fn closest(&self, to: [f64; 3]) -> Nearest {
        closest::on_curve(self, to)
    }
}

/// A surface in space, made of smooth patches in a grid.
pub trait ParametricSurface {
    /// First and last parameter of each direction.
    fn domain(&self) -> [[f64; 2]; 2];
    /// Parameters where the patches meet, by direction.
    fn breaks(&self) -> [Vec<f64>; 2];
    /// Whether the end joins the start, by direction.
    fn closed(&self) -> [bool; 2];
    /// Point and derivatives at `s, t`.
    fn jet(&self, s: f64, t: f64) -> SurfaceJet;
    /// A ball that holds patch `i, j`. Centre and radius.
    fn ball(&self, i: usize, j: usize) -> ([f64; 3], f64);
    /// Bounds on the lengths of the second derivatives ss, st, tt over patch `i, j`, in parameter units.
    fn bend(&self, i: usize, j: usize) -> [f64; 3];

    /// Triangles that leave the surface by at most `tolerance`, without cracks: a grid, finer where it bends.
    ///
    /// # Errors
    /// [`TessellateError`]: a tolerance that is not positive, or too many vertices.
    fn tessellate(&self, tolerance: f64) -> Result<Mesh, TessellateError> {
        tessellate::surface(self, tolerance)
    }

    /// The mesh with `parts` equal parts of each patch in each direction.
    fn mesh(&self, parts: usize) -> Mesh {
        tessellate::even(self, parts.max(1))
    }

    /// The nearest point: patches are visited by a lower bound of their distance, those that cannot win are skipped; on
    /// each, every local minimum of 5 x 5 samples starts a damped Newton iteration clamped to the domain.
    fn closest(&self, to: [f64; 3]) -> NearestOnSurface {
        closest::on_surface(self, to)
    }
}

/// A ball around points.
pub(crate) fn ball(points: &[V]) -> (V, f64) {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in points {
        for c in 0..3 {
            low[c] = low[c].min(p[c]);
            high[c] = high[c].max(p[c]);
        }
    }
    let middle: V = std::array::from_fn(|c| 0.5 * (low[c] + high[c]));
    (middle, points.iter().map(|&p| length(sub(p, middle))).fold(0.0, f64::max))
}
