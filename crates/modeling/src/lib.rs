//! Curves and surfaces: multiresolution editing and variational design of B-splines (thesis chapters 5 to 7).
//!
//! [`axis`] says where a spline lives: boundary, spans, domain.

pub mod axis;

pub use axis::{Axis, AxisError};
