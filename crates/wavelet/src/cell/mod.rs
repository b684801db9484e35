//! Tree bases on cells: intervals, squares (tensor products) and triangles, split into 2 or 4 equal children.
//!
//! What the transport of an operator needs of a tree wavelet basis: the scaling functions of one cell and the two-scale
//! matrices to its children (thesis 4.5.1). Splitting a cell into children and dropping detail is the second form of
//! ProjectKernel (4.5.2), so wavelets appear only in [`CellBasis::detail`], for the standard decomposition.
//!
//! Heights are chosen so that a coefficient has the unit of the function: multiwavelets are orthonormal for the *mean*
//! over the cell (the first function is 1), flatlet boxes have height 1. Then for both families, with the same matrices
//! T:
//! * push (a function seen from the children): `child[j] += sum_i T_c[i][j] parent[i]`;
//! * pull (its adjoint): `parent[i] = 1/arity sum_c sum_j T_c[i][j] child_c[j]`.
//!
//! For flatlets the coarser functions are therefore the thesis's *duals*: staircases of polynomials of degree M - 1
//! (Eq. 115's inverse transpose), which is what lets a piecewise constant basis have M vanishing moments.

mod analysis;
mod basis;
mod detail;
mod shape;
#[cfg(test)]
mod tests;
mod two_scale;

pub use crate::tree::OrderError;
pub use analysis::Analysis;
pub use basis::{CellBasis, CellFamily};
pub use shape::CellShape;
