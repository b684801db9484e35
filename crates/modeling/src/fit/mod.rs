//! Smoothing splines: surfaces through scattered heights and curves through outlines with the smoothing chosen by
//! cross-validation, and fair curves within a tolerance.

mod choose;
mod curve;
mod fair;
mod normal;
mod plane;
mod surface;

pub use curve::{CurveFit, curve};
pub use fair::{Fair, FairError, fair};
pub(crate) use normal::Normal;
pub use surface::{Fit, FitError, FitSettings, Scatter, surface};
