//! Hierarchical compression of integral operators with tree wavelets (thesis 4.2 to 4.5), for any kernel.
//!
//! [`cell`] (a dyadic piece of a domain) -> [`forest`] (the tree of cells over each root domain) -> [`kernel`] (what is
//! integrated) -> [`mod@couple`] (one block of the operator, with what its own test samples say of its error) ->
//! [`links`] (all blocks) -> [`estimate`] (where the error is) -> [`oracle`] (what to refine, knowing the magnitudes at
//! both ends) -> [`refine`] (ProjectKernel, second form: links replaced by links between children) ->
//! [`transport`] (pull, gather, push). Beside them [`assembly`], the matrix that nothing compresses, [`standard`], its
//! other decomposition (on a [`pyramid`]), and [`trees`], the passes one root at a time.
//!
//! The approximate operator is the congruence P^T M P: pull P takes finest coefficients to all levels, the links M join
//! equal or unequal levels, push P^T brings the result down. The thesis splits both ends of a link; splitting one end
//! is just as exact for tree bases, because pull and push fill every level.
//!
//! This crate knows kernels and numbers, nothing of what they mean.

pub mod assembly;
pub mod cell;
pub mod couple;
pub mod estimate;
pub mod forest;
pub mod kernel;
pub mod links;
pub mod oracle;
pub mod pyramid;
pub mod refine;
pub mod standard;
pub mod transport;
pub mod trees;

pub use assembly::Assembly;
pub use cell::Cell;
pub use couple::{CoupleSettings, Coupling, couple};
pub use estimate::{Estimate, Magnitudes};
pub use forest::{Forest, NodeId};
pub use kernel::{Detail, Kernel, Masked, Pair};
pub use links::{Link, Links};
pub use oracle::{Judgement, Oracle, Weight};
pub use pyramid::Pyramid;
pub use refine::{Change, End, Refinement, Task};
pub use standard::{Standard, Terms};
pub use trees::Trees;
