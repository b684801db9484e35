//! What a shape must do: pass through points, have derivatives, normals, curvature; hard, or soft with a weight.
//!
//! A [`Constraint`] becomes one or more rows of A x = b over the coefficients of all coordinates: a position or
//! derivative one row a coordinate that it fixes, a normal two rows that couple the coordinates.

pub(crate) mod curvature;
mod functional;
mod rail;
mod row;

pub(crate) use functional::Functional;
pub use rail::along;
pub(crate) use row::Row;

use crate::system::Space;

/// One constraint with its name.
///
/// ```
/// use ondelette_modeling::constraint::{Constraint, Demand};
/// // Through (1, 2), at t = 0.5; the third coordinate stays free.
/// let c = Constraint::new("nose", &[0.5], Demand::Position(vec![Some(1.0), Some(2.0), None]));
/// assert_eq!(c.weight, None);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Constraint {
    /// Its name, unique in a problem.
    pub id: String,
    /// Parameter: `[t]` on curves, `[s, t]` on surfaces, in domain units.
    pub at: Vec<f64>,
    /// What is asked there.
    pub demand: Demand,
    /// `None`: exactly. `Some(w)`: as far as the energy plus w times the squared misses allow.
    pub weight: Option<f64>,
}

/// What a constraint asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Demand {
    /// The point; `None` leaves a coordinate free.
    Position(Vec<Option<f64>>),
    /// A first derivative in full, along axis 0 (curves: the tangent; surfaces: d/ds) or axis 1 (d/dt), in domain
    /// units; `None` leaves a coordinate free.
    Derivative(usize, Vec<Option<f64>>),
    /// Both derivatives of a surface in three coordinates are orthogonal to this vector (curves: the tangent is).
    Normal(Vec<f64>),
    /// Curvature of a plane or space curve, or of the graph of a height over a line; solved by Newton's method. The
    /// sign is that of x' y'' - y' x''; in space it must not be negative.
    Curvature(f64),
    /// The point here is the point at another parameter, coordinate by coordinate times a sign, plus an offset: joins
    /// and symmetries.
    Image {
        /// The other parameter.
        of: Vec<f64>,
        /// One factor a coordinate.
        factors: Vec<f64>,
        /// One offset a coordinate.
        offset: Vec<f64>,
    },
}

/// Why a constraint makes no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ConstraintError {
    /// A number is NaN or infinite.
    #[error("constraint {id}: {what} is {value}; give finite numbers")]
    NotFinite {
        /// Name of the constraint.
        id: String,
        /// Which number.
        what: &'static str,
        /// What it is.
        value: f64,
    },
    /// The wrong number of parameters or coordinates.
    #[error("constraint {id}: {got} numbers for {what}, this shape needs {want}")]
    Count {
        /// Name of the constraint.
        id: String,
        /// What was counted.
        what: &'static str,
        /// Numbers given.
        got: usize,
        /// Numbers needed.
        want: usize,
    },
    /// Outside the domain.
    #[error("constraint {id}: parameter {value} is outside the domain [{from}, {to}]")]
    Outside {
        /// Name of the constraint.
        id: String,
        /// The parameter.
        value: f64,
        /// Start of the domain.
        from: f64,
        /// End of the domain.
        to: f64,
    },
    /// A weight that is not positive.
    #[error("constraint {id}: weight {value}; a weight is finite and above 0, or left out for an exact constraint")]
    Weight {
        /// Name of the constraint.
        id: String,
        /// The weight.
        value: f64,
    },
    /// A demand that this kind of shape cannot meet.
    #[error("constraint {id}: {what}")]
    Unfit {
        /// Name of the constraint.
        id: String,
        /// What does not fit.
        what: &'static str,
    },
    /// Two constraints of the same name.
    #[error("two constraints are called {id}: names are unique")]
    Name {
        /// The name.
        id: String,
    },
}

impl Constraint {
    /// An exact constraint.
    pub fn new(id: impl Into<String>, at: &[f64], demand: Demand) -> Constraint {
        Constraint { id: id.into(), at: at.to_vec(), demand, weight: None }
    }

    /// The same constraint, soft.
    pub fn soft(mut self, weight: f64) -> Constraint {
        self.weight = Some(weight);
        self
    }

    /// Refuses what makes no sense on a space with so many coordinates.
    pub(crate) fn check(&self, space: &Space, coordinates: usize) -> Result<(), ConstraintError> {
        let id = || self.id.clone();
        let finite = |what: &'static str, values: &[f64]| match values.iter().find(|v| !v.is_finite()) {
            Some(value) => Err(ConstraintError::NotFinite { id: id(), what, value: *value }),
            None => Ok(()),
        };
        let given = |values: &[Option<f64>]| values.iter().flatten().copied().collect::<Vec<f64>>();
        let count = |what: &'static str, got: usize, want: usize| {
            if got == want { Ok(()) } else { Err(ConstraintError::Count { id: id(), what, got, want }) }
        };
        let parameter = |at: &[f64]| {
            count("the parameter", at.len(), space.axes().len())?;
            finite("the parameter", at)?;
            for (&value, axis) in at.iter().zip(space.axes()) {
                let [from, to] = axis.domain();
                let slack = 1e-12 * (to - from);
                if axis.boundary() != ondelette_wavelet::Boundary::Periodic
                    && !(from - slack..=to + slack).contains(&value)
                {
                    return Err(ConstraintError::Outside { id: id(), value, from, to });
                }
            }
            Ok(())
        };
        parameter(&self.at)?;
        if let Some(value) = self.weight
            && !(value.is_finite() && value > 0.0)
        {
            return Err(ConstraintError::Weight { id: id(), value });
        }
        let unfit = |what: &'static str| Err(ConstraintError::Unfit { id: id(), what });
        match &self.demand {
            Demand::Position(values) => {
                count("the position", values.len(), coordinates)?;
                finite("the position", &given(values))
            }
            Demand::Derivative(axis, values) => {
                if *axis >= space.axes().len() {
                    return unfit("a curve has no second derivative direction: use the tangent");
                }
                count("the derivative", values.len(), coordinates)?;
                finite("the derivative", &given(values))?;
                if self.is_impossible(space) {
                    return unfit("the derivative across a mirrored end is 0: use an open boundary, or leave it out");
                }
                Ok(())
            }
            Demand::Normal(normal) => {
                if coordinates < 2 {
                    return unfit("a height field has one coordinate: give its derivatives instead of a normal");
                }
                count("the normal", normal.len(), coordinates)?;
                finite("the normal", normal)?;
                if normal.iter().all(|v| *v == 0.0) {
                    return unfit("the normal is the zero vector: give a direction");
                }
                Ok(())
            }
            Demand::Curvature(k) => {
                if !space.is_curve() {
                    return unfit("curvature is for curves");
                }
                if self.weight.is_some() {
                    return unfit("a curvature constraint is exact: leave its weight out");
                }
                finite("the curvature", &[*k])?;
                if coordinates == 3 && *k < 0.0 {
                    return unfit("a space curve has no negative curvature");
                }
                let [from, to] = space.axes()[0].domain();
                let slack = 1e-12 * (to - from);
                if coordinates > 1
                    && space.axes()[0].boundary() == ondelette_wavelet::Boundary::Mirrored
                    && (self.at[0] <= from + slack || self.at[0] >= to - slack)
                {
                    return unfit("the tangent at a mirrored end is 0, so there is no curvature: use an open boundary");
                }
                Ok(())
            }
            Demand::Image { of, factors, offset } => {
                parameter(of)?;
                count("the factors", factors.len(), coordinates)?;
                count("the offset", offset.len(), coordinates)?;
                finite("the factors", factors)?;
                finite("the offset", offset)?;
                if self.is_impossible(space) {
                    return unfit("a point cannot differ from itself: give another place in of, or no offset");
                }
                Ok(())
            }
        }
    }
}
