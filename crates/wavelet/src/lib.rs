//! Wavelet bases: B-splines, trees, Daubechies; exact, for any length, fast.
//!
//! The ladder: a [`Family`] with a [`Boundary`] gives nested spaces; a [`Rung`] joins two of them with four verbs; a
//! [`Pyramid`] climbs one axis; a [`Tensor`] climbs grids and returns a [`Decomposition`] that knows its layout.
//! [`SplineSpace`] and [`Piecewise`] say what coefficients mean as functions, [`gram`] integrates them,
//! [`cell`] has the two-dimensional cells that hierarchical operators stand on; [`NonStandardOperator`] holds operators
//! in wavelets. Tables are exact rationals ([`exact`]); every inverse and transpose is derived from them.
//!
//! ```
//! use ondelette_wavelet::{Boundary, Layout, Pyramid, Tensor};
//! // A 100 x 70 grid of cubic B-spline coefficients, mirrored at its edges.
//! let axis = |n| Pyramid::new("bspline".parse().unwrap(), Boundary::Mirrored, n, 4);
//! let tensor = Tensor::new(vec![axis(100)?, axis(70)?], Layout::NonStandard)?;
//! let heights: Vec<f64> = (0..7000).map(|i| ((i / 70) as f64 * 0.1).sin()).collect();
//! let mut wavelets = tensor.analyze(&heights)?;
//! wavelets.keep_largest(300);
//! let smooth = tensor.synthesize(&wavelets)?;
//! assert!(heights.iter().zip(&smooth).all(|(a, b)| (a - b).abs() < 1e-2));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! family -> rung -> pyramid -> tensor -> decomposition

mod axis;
mod banded;
mod cascade;
pub mod cell;
mod coefficient;
mod cubic;
mod decomposition;
pub mod exact;
mod extension;
mod family;
mod frame;
pub mod gram;
mod hybrid;
mod lifted;
mod lifting;
pub mod notation;
pub mod open;
mod operator;
mod picture;
mod piecewise;
mod polynomials;
mod pyramid;
mod rung;
mod sampling;
mod scaling;
mod space;
mod spare;
mod sparse;
mod sweep;
mod tables;
mod tensor;
pub mod tree;

pub use cascade::cascade;
pub use coefficient::{Coefficient, Scalar};
pub use decomposition::{Block, Decomposition, FunctionNorms, Norms, Part};
pub use family::{Boundary, Family, FamilyError, SplineFamily};
pub use frame::Frame;
pub use hybrid::Hybrid;
pub use open::{OpenColumns, OpenKnots};
pub use operator::{Expansion, LevelBox, NonStandardOperator, OperatorError, StandardOperator};
pub use piecewise::Piecewise;
pub use pyramid::{Pyramid, PyramidError, TransformError, levels_allowed};
pub use rung::{Kind, Rung};
pub use sampling::{Sampling, SamplingError};
pub use scaling::{EnergyDiagonals, Heights, Scaling, energy_diagonals};
pub use space::{SpaceError, SplineSpace};
pub use sparse::Sparse;
pub use tensor::{Layout, Tensor, TensorError, Workspace};
pub use tree::{OrderError, TreeFamily, TreeKind};
