//! Curves and surfaces: multiresolution editing and variational design of B-splines (thesis chapters 5 to 7).
//!
//! [`axis`] says where a spline lives: boundary, spans, domain; [`basis`] which functions are alive at a parameter.
//! [`shape`]: curves and surfaces, what they mean as geometry; [`edit`]: handles on every level; [`free`]: splines of
//! other programs.
//! [`energy`], [`constraint`]s and a [`system::Problem`] go to a [`solve::Solver`], which finds the smoothest shape;
//! [`drag::Handles`] moves it, [`fit`] smooths data; [`intrinsic`] curves depend on no parameter.

pub mod axis;
pub mod basis;
pub mod constraint;
pub mod drag;
pub mod edit;
pub mod energy;
pub mod fit;
pub mod free;
pub mod intrinsic;
pub mod shape;
pub mod solve;
pub mod system;

pub use axis::{Axis, AxisError};
