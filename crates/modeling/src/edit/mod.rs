//! Multiresolution editing (thesis chapter 6): handles and direct manipulation at a chosen level.
//!
//! A [`Ladder`] is one shape on all its levels at once, smooth and detail: [`CurveLadder`], [`SurfaceLadder`]. An
//! [`Editor`] drags handles of its do level and shows its see level; [`least_squares`] drags points of the shape itself
//! (6.3). Beside them, for comparison: [`pentland`]'s diagonal shortcut and [`Hierarchy`], the hierarchical B-splines
//! that wavelets extend.
//!
//! shape -> ladder -> editor -> shape

mod axis_ladder;
mod curve_ladder;
mod editor;
mod hierarchy;
mod ladder;
mod orientation;
mod pulls;
mod surface_ladder;

pub use curve_ladder::CurveLadder;
pub use editor::Editor;
pub use hierarchy::Hierarchy;
pub use ladder::{EditError, Ladder};
pub use orientation::{Orientation, Turn};
pub use pulls::{Pull, Pulled, delta_curve, delta_surface, least_squares, pentland};
pub use surface_ladder::SurfaceLadder;
