//! Small exact numerics below every other crate.
//!
//! [`gauss`]: quadrature rules; [`dense`]: small dense matrices; [`par`]: the only parallelism of the project, the same
//! bits for any thread count; [`seed`]: counter-based random numbers; [`sobol`]: low-discrepancy points; [`krylov`]:
//! stepping solvers for linear systems.

pub mod dense;
pub mod gauss;
pub mod krylov;
pub mod par;
pub mod seed;
pub mod sobol;
