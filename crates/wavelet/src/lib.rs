//! Wavelet bases.

mod banded;
mod coefficient;
pub mod exact;
mod extension;
mod lifted;
mod lifting;
pub mod open;
mod piecewise;
mod rung;
mod sparse;
mod sweep;
mod tables;
pub mod tree;

pub use coefficient::{Coefficient, Scalar};
pub use open::{OpenColumns, OpenKnots};
pub use piecewise::Piecewise;
pub use rung::{Kind, Rung};
pub use sparse::Sparse;
pub use tree::{OrderError, TreeFamily, TreeKind};
