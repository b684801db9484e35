//! Solvers of variational problems behind one stepped interface.
//!
//! [`Solver`] refines: residual of the saddle system, one [`Method`]'s correction, again, until the shape no longer
//! moves. Residuals of curves are computed with twice the precision, so that every method reaches the last digits.

mod auto;
mod banded;
mod border;
mod bpx;
pub(crate) mod cholesky;
mod correct;
mod cosine;
mod curving;
pub(crate) mod cycle;
mod dropped;
mod edges;
mod gradients;
mod green;
mod method;
mod multigrid;
mod oracle;
mod projected;
mod refine;
mod residual;
mod response;
mod solution;
mod sparse;
mod spectral;
mod strip;
mod thesis;
mod transfer;
mod verdict;
mod wavelet;

pub use method::{Iteration, Method, MethodError, Settings};
pub use oracle::{Oracle, Round};
pub use refine::{SolveError, Solver, Step};
pub use solution::{Residual, Solution};
