//! Wavelet bases.

mod axis;
mod banded;
mod coefficient;
mod cubic;
mod decomposition;
pub mod exact;
mod extension;
mod family;
pub mod gram;
mod lifted;
mod lifting;
pub mod open;
mod picture;
mod piecewise;
mod pyramid;
mod rung;
mod scaling;
mod sparse;
mod sweep;
mod tables;
mod tensor;
pub mod tree;

pub use coefficient::{Coefficient, Scalar};
pub use decomposition::{Block, Decomposition, FunctionNorms, Norms, Part};
pub use family::{Boundary, Family, FamilyError, SplineFamily};
pub use open::{OpenColumns, OpenKnots};
pub use piecewise::Piecewise;
pub use pyramid::{Pyramid, PyramidError, TransformError, levels_allowed};
pub use rung::{Kind, Rung};
pub use scaling::{EnergyDiagonals, Heights, Scaling, energy_diagonals};
pub use sparse::Sparse;
pub use tensor::{Layout, Tensor, TensorError, Workspace};
pub use tree::{OrderError, TreeFamily, TreeKind};
