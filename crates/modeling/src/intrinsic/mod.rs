//! Curves of least energy and of least variation, whatever their parameter: MEC and MVC.
//!
//! The minimum-energy curve (elastica) has the least integral of squared curvature over arc length among the curves
//! that meet the constraints, the minimum-variation curve (Moreton and Sequin 1992) the least integral of the squared
//! change of curvature along it (across the tangent: k_s^2, in space k_s^2 + k^2 torsion^2): circles and straight lines
//! cost nothing. Both are functionals of the shape alone; the parameter runs along it as evenly as the parameters of
//! the constraints allow.
//!
//! Newton's method with exact second derivatives of every span, damped by the quadratic energy whose functional it is
//! (Levenberg and Marquardt), on a sparse factor with the constraints as a small dense one. A term that asks for even
//! speed makes the problem regular; its weight falls, and the speeds that it asks for follow the curve until the
//! term is zero, so that the result is the functional's own.

mod jet;
mod objective;
mod pose;
mod solver;
mod span;
mod speed;
mod step;

pub use solver::{IntrinsicCurve, IntrinsicSolver, IntrinsicStep};

use crate::solve::SolveError;
use std::fmt;
use std::str::FromStr;

/// Which functional is least.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Minimum {
    /// Squared curvature over arc length: the minimum-energy curve, MEC. It scales with one over the length, so that
    /// long loops are cheap: of closed curves of free length none is the least, and what is found is a local minimum.
    Energy,
    /// Squared change of curvature over arc length: the minimum-variation curve, MVC.
    Variation,
}

impl fmt::Display for Minimum {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Minimum::Energy => "mec",
            Minimum::Variation => "mvc",
        })
    }
}

impl FromStr for Minimum {
    type Err = IntrinsicError;

    fn from_str(text: &str) -> Result<Minimum, IntrinsicError> {
        match text {
            "mec" => Ok(Minimum::Energy),
            "mvc" => Ok(Minimum::Variation),
            _ => Err(IntrinsicError::Name(text.to_owned())),
        }
    }
}

/// Why there is no such curve.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IntrinsicError {
    /// Not the name of a functional.
    #[error("intrinsic {0:?}: mec (least squared curvature) or mvc (least change of curvature)")]
    Name(String),
    /// Something that intrinsic curves cannot do.
    #[error("{0}")]
    Unfit(&'static str),
    /// A constraint that they cannot meet.
    #[error("constraint {id}: {why}")]
    Constraint {
        /// Its name.
        id: String,
        /// What does not fit.
        why: &'static str,
    },
    /// The constraints leave no curve to begin with.
    #[error(
        "the constraints hold no curve that could be evened: its points coincide, or it turns back on the spot; give \
         more points, or tangents"
    )]
    Collapsed,
    /// Constraints that contradict each other, or do not fit.
    #[error(transparent)]
    Solve(#[from] SolveError),
}
