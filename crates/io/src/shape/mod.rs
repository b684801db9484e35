//! Curves and surfaces on disk, one format a file.
//!
//! | | in | out |
//! |---|---|---|
//! | JSON document ([`Document`]) | shape, levels, energy, constraints | the same |
//! | SVG paths ([`svg`]) | paths, arcs, transforms | exact Bezier spans |
//! | points ([`points`]) | .csv, .dat outlines | .csv |
//! | STEP, IGES ([`step`], [`iges`]) | B-spline curves and surfaces, rational too | the same |
//! | OBJ, GLB ([`mesh`]) | | triangles by tolerance |
//! | height fields ([`height`]) | .npy, .asc, .png (8 and 16 bits) | .npy, .asc, .png (16 bits) |
//! | pictures ([`picture`]) | | .png of curves, combs, shaded surfaces |
//!
//! Readers take bytes or text and return a value or a sentence that says where what is wrong; damaged files neither
//! panic nor hang, their work is bounded by their length. Writers return text or bytes for
//! [`write_bytes`](crate::write::write_bytes).

mod document;
pub mod height;
pub mod iges;
pub mod mesh;
mod part21;
pub mod picture;
pub mod points;
pub mod step;
pub mod svg;

pub use document::{
    ConstraintSpec, Document, Geometry, ImageSpec, MOST_POINTS, RailSpec, Region, SCHEMA, VERSION, YAxis,
};

use ondelette_modeling::free::{FreeCurve, FreeSurface};

/// The splines of a CAD file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Splines {
    /// Curves in file order.
    pub curves: Vec<FreeCurve>,
    /// Surfaces in file order.
    pub surfaces: Vec<FreeSurface>,
}

/// A number as short as it can be without losing a bit.
pub(crate) fn shortest(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let (plain, exponent) = (format!("{x}"), format!("{x:e}"));
    if exponent.len() < plain.len() { exponent } else { plain }
}

/// Curves all of whose points lie in z = 0 are plane curves: formats in space do not tell.
pub(crate) fn plane_if_flat(points: &[[f64; 3]]) -> usize {
    if points.iter().all(|p| p[2] == 0.0) { 2 } else { 3 }
}
