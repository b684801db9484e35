//! Uniform cubic B-spline curves and tensor surfaces over an [`Axis`](crate::Axis) in each direction.
//!
//! Control points have 1 to 3 coordinates; one coordinate means heights over the domain, which geometry (tessellation,
//! bounding box, closest point, curvature) sees as the graph. [`Span`] is the only place that knows how control points
//! become polynomials; conversions between bases are rows of its blossom, exact up to rounding.
//!
//! spans -> curves, surfaces -> polylines, meshes, boxes, nearest points

mod bounds;
mod closest;
mod curve;
mod geometry;
mod span;
mod surface;
mod tessellate;
pub(crate) mod vector;

pub use bounds::Bounds;
pub use closest::{Nearest, NearestOnSurface};
pub use curve::{Curve, ShapeError};
pub(crate) use geometry::ball;
pub use geometry::{Curvature, CurveJet, ParametricCurve, ParametricSurface, SurfaceJet};
pub use span::Span;
pub(crate) use span::triples;
pub use surface::Surface;
pub use tessellate::{Mesh, Polyline, TessellateError};
