//! What solvers ask of an energy matrix that is applied without being formed.

use super::operator::{Operator, Scratch};

/// A symmetric positive semi-definite matrix of one coordinate, applied without being formed.
pub(crate) trait Hessian {
    /// `y = H x`.
    fn times(&self, x: &[f64], y: &mut [f64], scratch: &mut Scratch);

    /// The sum of its diagonal.
    fn trace(&self) -> f64;

    /// True for energies of surfaces.
    fn is_surface(&self) -> bool;
}

impl Hessian for Operator {
    fn times(&self, x: &[f64], y: &mut [f64], scratch: &mut Scratch) {
        self.apply(x, y, scratch);
    }

    fn trace(&self) -> f64 {
        self.diagonal().iter().sum()
    }

    fn is_surface(&self) -> bool {
        self.lines.len() == 2
    }
}
