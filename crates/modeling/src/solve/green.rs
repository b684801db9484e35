//! What a solver with multipliers asks of an approximate or exact inverse of H.

use crate::constraint::Functional;

/// How good an inverse is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Inverse {
    /// Up to rounding, off the null space: one correction solves the system.
    Exact,
    /// A preconditioner for conjugate gradients.
    Approximate,
}

/// A symmetric positive (semi-)definite P that stands for the inverse of H off its null space.
pub(crate) trait Green {
    /// `g = P r`, one coordinate.
    fn apply(&mut self, r: &[f64], g: &mut [f64]);

    /// P between functionals, packed lower triangle.
    fn between(&mut self, functionals: &[Functional]) -> Vec<f64>;

    /// How good it is.
    fn inverse(&self) -> Inverse;
}
