//! Curves and surfaces: multiresolution editing and variational design of B-splines (thesis chapters 5 to 7).
//!
//! [`axis`] says where a spline lives: boundary, spans, domain; [`basis`] which functions are alive at a parameter.

pub mod axis;
pub mod basis;

pub use axis::{Axis, AxisError};
