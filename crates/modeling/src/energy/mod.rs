//! Quadratic energies of curves and surfaces (thesis chapter 7): stretch, bend (thin plate), variation.
//!
//! [`Energy`] holds the three weights, [`Stiffness`] local factors a cell. The matrix H of E = x^T H x is never formed:
//! `operator` applies it by differences and Gram matrices of one axis (`line`, `stencil`), or cell by cell
//! (`cell`) where the stiffness varies.

mod cell;
mod entries;
mod hessian;
mod line;
mod operator;
mod stencil;
pub(crate) mod twofold;

pub(crate) use cell::{CellMatrix, Classes, SpanClass};
pub(crate) use hessian::Hessian;
pub(crate) use operator::{Operator, Scratch};

use crate::system::Space;
use serde::{Deserialize, Serialize};

/// E = a E1 + b E2 + c E3, without factors of 1/2 (thesis 7.1).
///
/// Curves: E1, E2, E3 are the integrals of |f'|^2, |f''|^2, |f'''|^2. Surfaces: of f_s^2 + f_t^2, of
/// f_ss^2 + 2 f_st^2 + f_tt^2 (thin plate), and of f_sss^2 + 3 f_sst^2 + 3 f_stt^2 + f_ttt^2. In domain units.
///
/// ```
/// use ondelette_modeling::energy::Energy;
/// let energy = Energy::new(0.0, 1.0, 0.0)?;
/// assert_eq!(energy, Energy::BEND);
/// assert!(Energy::new(0.0, 0.0, 0.0).is_err());
/// # Ok::<(), ondelette_modeling::energy::EnergyError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Energy {
    /// Weight of the squared first derivatives.
    pub stretch: f64,
    /// Weight of the squared second derivatives.
    pub bend: f64,
    /// Weight of the squared third derivatives.
    pub variation: f64,
}

/// Why there is no such energy.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum EnergyError {
    /// A weight is negative or not finite.
    #[error("energy weight {name} is {value}: weights are finite and at least 0")]
    Weight {
        /// Which one.
        name: &'static str,
        /// What it is.
        value: f64,
    },
    /// All three are zero.
    #[error("all energy weights are 0: give stretch, bend or variation a positive weight")]
    None,
    /// The wrong number of local factors.
    #[error("{got} stiffness factors for {want} cells")]
    Cells {
        /// Factors given.
        got: usize,
        /// Cells of the space.
        want: usize,
    },
    /// A local factor is not positive or not finite.
    #[error("stiffness of cell {cell} is {value}: factors are finite and above 0")]
    Factor {
        /// Which cell.
        cell: usize,
        /// Its factor.
        value: f64,
    },
}

impl Energy {
    /// Bending alone: the thin plate of the thesis.
    pub const BEND: Energy = Energy { stretch: 0.0, bend: 1.0, variation: 0.0 };

    /// An energy with the given weights.
    ///
    /// # Errors
    /// [`EnergyError::Weight`], [`EnergyError::None`].
    pub fn new(stretch: f64, bend: f64, variation: f64) -> Result<Energy, EnergyError> {
        for (name, value) in [("stretch", stretch), ("bend", bend), ("variation", variation)] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(EnergyError::Weight { name, value });
            }
        }
        if stretch + bend + variation == 0.0 {
            return Err(EnergyError::None);
        }
        Ok(Energy { stretch, bend, variation })
    }

    /// The energy of the coefficients `x` of one coordinate, in domain units; from differences, so that no null space
    /// is lost to rounding. Linear time.
    ///
    /// # Panics
    /// If the number of coefficients does not fit.
    pub fn of(&self, space: &Space, stiffness: Option<&Stiffness>, x: &[f64]) -> f64 {
        assert_eq!(x.len(), space.len(), "coefficients of another space");
        Operator::new(space, self, stiffness).energy(x)
    }

    /// Polynomials of total degree below this cost nothing (0 never occurs).
    pub(crate) fn free_degree(&self) -> usize {
        match (self.stretch > 0.0, self.bend > 0.0) {
            (true, _) => 1,
            (_, true) => 2,
            _ => 3,
        }
    }
}

/// Local factors of the energy, one a cell: stiff regions above 1, creases far below 1.
///
/// Cells are spans of a curve, or pairs of spans of a surface, row-major (s, t).
#[derive(Clone, Debug, PartialEq)]
pub struct Stiffness {
    factors: Vec<f64>,
}

impl Stiffness {
    /// Takes one factor a cell.
    ///
    /// # Errors
    /// [`EnergyError::Cells`], [`EnergyError::Factor`].
    pub fn new(cells: usize, factors: Vec<f64>) -> Result<Stiffness, EnergyError> {
        if factors.len() != cells {
            return Err(EnergyError::Cells { got: factors.len(), want: cells });
        }
        match factors.iter().position(|f| !(f.is_finite() && *f > 0.0)) {
            Some(cell) => Err(EnergyError::Factor { cell, value: factors[cell] }),
            None => Ok(Stiffness { factors }),
        }
    }

    /// One factor a cell.
    pub fn factors(&self) -> &[f64] {
        &self.factors
    }

    /// True where every factor is 1.
    pub fn is_uniform(&self) -> bool {
        self.factors.iter().all(|f| *f == 1.0)
    }

    /// Means over two by two cells (two of a curve), for the coarser space with `shape` cells.
    pub(crate) fn coarser(&self, shape: [usize; 2]) -> Stiffness {
        let [ns, nt] = shape;
        let down = if ns == 1 && self.factors.len() == 2 * nt { 1 } else { 2 };
        let mut factors = Vec::with_capacity(ns * nt);
        for i in 0..ns {
            for j in 0..nt {
                let mut sum = 0.0;
                for a in 0..down {
                    for b in 0..2 {
                        sum += self.factors[(down * i + a) * 2 * nt + 2 * j + b];
                    }
                }
                factors.push(sum / (2 * down) as f64);
            }
        }
        Stiffness { factors }
    }
}
