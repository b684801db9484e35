//! Smoothing splines: surfaces through scattered heights with the smoothing chosen by cross-validation, and fair curves
//! within a tolerance.

mod fair;
mod normal;
mod surface;

pub use fair::{Fair, FairError, fair};
pub(crate) use normal::Normal;
pub use surface::{Fit, FitError, FitSettings, Scatter, surface};
