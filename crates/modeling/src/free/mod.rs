//! Splines as other programs write them: any degree, any knots, weights, sub-paths.
//!
//! They evaluate, refine and go out again without loss. Editing and design want a uniform cubic shape: the conversion
//! is exact where the knots allow it, otherwise a fit whose deviation is reported.
//!
//! file -> free spline -> uniform shape (exact, or fitted within a reported deviation); shape -> free spline, exact

mod curve;
mod knots;
mod surface;
mod uniform;

pub use curve::{FreeCurve, FreePath};
pub use knots::{FreeError, Knots, MOST_DEGREE};
pub use surface::FreeSurface;
pub use uniform::{Converted, Fit};
