//! A variational problem and the linear system it stands for.
//!
//! [`Problem`] = space + coordinates + energy + constraints. It is cut into blocks of coordinates that no row couples;
//! blocks with the same rows share all that does not depend on the targets. Rows that follow from others are named.

mod block;
mod dependence;
mod space;

pub(crate) use block::{Block, Redundant, Structure, merged, sight};
pub(crate) use dependence::sparse_dot;
pub use space::Space;

use crate::constraint::{Constraint, ConstraintError, Demand};
use crate::energy::{Energy, EnergyError, Stiffness};

/// A shape to be found: the smoothest spline that does what the constraints say.
///
/// ```
/// use ondelette_modeling::constraint::{Constraint, Demand};
/// use ondelette_modeling::energy::Energy;
/// use ondelette_modeling::system::{Problem, Space};
/// use ondelette_modeling::Axis;
/// use ondelette_wavelet::Boundary;
/// let space = Space::curve(Axis::new(Boundary::Open, 16, [0.0, 1.0])?);
/// let through = |t: f64, y: f64| Constraint::new(format!("t = {t}"), &[t], Demand::Position(vec![Some(y)]));
/// let problem = Problem::new(space, 1, Energy::BEND, None, vec![through(0.0, 0.0), through(1.0, 2.0)])?;
/// assert_eq!(problem.coordinates(), 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Problem {
    space: Space,
    coordinates: usize,
    energy: Energy,
    stiffness: Option<Stiffness>,
    constraints: Vec<Constraint>,
}

/// Why a problem cannot be posed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProblemError {
    /// A constraint makes no sense.
    #[error(transparent)]
    Constraint(#[from] ConstraintError),
    /// The stiffness does not fit.
    #[error(transparent)]
    Energy(#[from] EnergyError),
    /// Number of coordinates.
    #[error("{0} coordinates: a shape has 1 (heights), 2 or 3")]
    Coordinates(usize),
    /// Constraints that contradict each other.
    #[error("constraint {id} contradicts {others}: it misses by {miss:.3e}; remove one of them, or give one a weight")]
    Conflict {
        /// The constraint that cannot be met.
        id: String,
        /// Those it follows from, up to its target.
        others: String,
        /// By how much.
        miss: f64,
    },
    /// Powers of spans this long or short are no numbers.
    #[error("a domain of length {0:e}: energies can be computed for lengths from 1e-25 to 1e25")]
    Domain(f64),
    /// Heights whose squares are lost.
    #[error("no position is above {0:e} in size: energies are squares, so scale the shape to above 1e-100")]
    Tiny(f64),
    /// More memory than the limit.
    #[error("{what} would take {bytes} bytes, the limit is {limit}: use fewer spans or constraints")]
    Memory {
        /// What is too large.
        what: &'static str,
        /// Bytes needed.
        bytes: u64,
        /// Bytes allowed.
        limit: u64,
    },
}

/// Positions none of which is as large as this have energies that may be no numbers.
const SMALLEST: f64 = 1e-100;

/// No problem may need more memory than this, for its coefficients or for a dense matrix of its constraints.
pub(crate) const MEMORY: u64 = 8 << 30;

impl Problem {
    /// Checks everything that can be checked without solving.
    ///
    /// # Errors
    /// [`ProblemError`]: wrong counts, numbers that are not finite, parameters outside the domain, names used twice,
    /// absurd sizes.
    pub fn new(
        space: Space,
        coordinates: usize,
        energy: Energy,
        stiffness: Option<Stiffness>,
        constraints: Vec<Constraint>,
    ) -> Result<Problem, ProblemError> {
        if !(1..=3).contains(&coordinates) {
            return Err(ProblemError::Coordinates(coordinates));
        }
        let energy = Energy::new(energy.stretch, energy.bend, energy.variation)?;
        let mut sides = space.axes().iter().map(|a| a.domain()[1] - a.domain()[0]);
        if let Some(side) = sides.find(|side| !(1e-25..=1e25).contains(side)) {
            return Err(ProblemError::Domain(side));
        }
        // Two dozen vectors of all coefficients is what the leanest solver needs.
        let lengths: Vec<u64> = space.axes().iter().map(|a| a.spans() as u64 + 3).collect();
        let all = lengths.iter().try_fold(24 * 8 * coordinates as u64, |a, n| a.checked_mul(*n)).unwrap_or(u64::MAX);
        if all > MEMORY {
            return Err(ProblemError::Memory { what: "this many coefficients", bytes: all, limit: MEMORY });
        }
        if let Some(map) = &stiffness
            && map.factors().len() != space.cells()
        {
            return Err(EnergyError::Cells { got: map.factors().len(), want: space.cells() }.into());
        }
        for c in &constraints {
            c.check(&space, coordinates)?;
        }
        let sizes = constraints.iter().flat_map(|c| match &c.demand {
            Demand::Position(values) => values.iter().flatten().map(|v| v.abs()).collect(),
            Demand::Derivative(_, values) => values.iter().flatten().map(|v| v.abs()).collect(),
            Demand::Image { offset, .. } => offset.iter().map(|v| v.abs()).collect::<Vec<f64>>(),
            _ => Vec::new(),
        });
        let size = sizes.fold(0.0, f64::max);
        if size > 0.0 && size < SMALLEST {
            return Err(ProblemError::Tiny(size));
        }
        let mut names: Vec<&str> = constraints.iter().map(|c| c.id.as_str()).collect();
        names.sort_unstable();
        if let Some(pair) = names.windows(2).find(|w| w[0] == w[1]) {
            return Err(ConstraintError::Name { id: pair[0].to_owned() }.into());
        }
        Ok(Problem { space, coordinates, energy, stiffness, constraints })
    }

    /// Where the unknowns live.
    pub fn space(&self) -> &Space {
        &self.space
    }

    /// 1 (heights), 2 or 3.
    pub fn coordinates(&self) -> usize {
        self.coordinates
    }

    /// What is minimised.
    pub fn energy(&self) -> &Energy {
        &self.energy
    }

    /// Local factors of the energy.
    pub fn stiffness(&self) -> Option<&Stiffness> {
        self.stiffness.as_ref()
    }

    /// The constraints, in order.
    pub fn constraints(&self) -> &[Constraint] {
        &self.constraints
    }
}
