//! Pictures of shapes, for a look without another program: curves with their constraints and curvature comb, shaded
//! surfaces with zebra stripes. Drawn by a few lines of own code: dots, lines and a depth buffer need no library.

mod camera;
mod canvas;
mod curve;
mod surface;

pub use curve::{CurvePicture, curve};
pub use surface::{SurfacePicture, surface};

/// What a mark on a picture stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mark {
    /// A point that the shape goes through.
    Point([f64; 3]),
    /// A point that it comes near: where it should be, where it is.
    Soft([f64; 3], [f64; 3]),
    /// A direction at a point: tangent or normal.
    Direction([f64; 3], [f64; 3]),
}

/// A finished picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// sRGB, from the top left.
    pub pixels: Vec<[u8; 3]>,
}
