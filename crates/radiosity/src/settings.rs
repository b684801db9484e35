//! What the user chooses.

mod links;
mod method;

pub use links::{LinkSettings, LinkSettingsError};
pub use method::{
    Decomposition, DecompositionError, Iteration, IterationError, Method, MethodError, Oracle, OracleError, Weight,
    WeightError,
};

use ondelette_wavelet::cell::{CellBasis, CellFamily};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// A tree basis by its name on the command line.
///
/// ```
/// use ondelette_radiosity::Basis;
/// let m3: Basis = "m3".parse().unwrap();
/// assert_eq!((m3.order, m3.to_string().as_str()), (3, "m3"));
/// assert_eq!("haar".parse::<Basis>().unwrap().order, 1);
/// assert!("m7".parse::<Basis>().is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Basis {
    /// Whether flatlets (else multiwavelets).
    pub flatlet: bool,
    /// Order M; Haar is the multiwavelet of order 1.
    pub order: u8,
}

impl Basis {
    /// Constants.
    pub const HAAR: Basis = Basis { flatlet: false, order: 1 };

    /// The highest of those that links choose from where each has its own order.
    pub const HIGHEST_AUTO: Basis = Basis { flatlet: false, order: 4 };

    /// The default: bilinear multiwavelets.
    pub const M2: Basis = Basis { flatlet: false, order: 2 };

    /// The family of the wavelet library.
    pub fn family(self) -> CellFamily {
        if self.flatlet { CellFamily::Flatlet } else { CellFamily::Multiwavelet }
    }
}

impl fmt::Display for Basis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.flatlet, self.order) {
            (false, 1) => write!(f, "haar"),
            (false, m) => write!(f, "m{m}"),
            (true, m) => write!(f, "f{m}"),
        }
    }
}

/// A name that is no basis.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "'{0}' is no basis: choose haar, m1 to m{m}, or f1 to f{f}",
    m = CellBasis::MAX_MULTIWAVELET,
    f = CellBasis::MAX_FLATLET
)]
pub struct BasisError(pub String);

impl FromStr for Basis {
    type Err = BasisError;

    fn from_str(name: &str) -> Result<Self, BasisError> {
        let wrong = || BasisError(name.to_string());
        if name == "haar" {
            return Ok(Basis { flatlet: false, order: 1 });
        }
        let (flatlet, highest) = match name.as_bytes().first() {
            Some(b'm') => (false, CellBasis::MAX_MULTIWAVELET),
            Some(b'f') => (true, CellBasis::MAX_FLATLET),
            _ => return Err(wrong()),
        };
        let order: u8 = name[1..].parse().map_err(|_| wrong())?;
        if order == 0 || usize::from(order) > highest || name.len() != 2 {
            return Err(wrong());
        }
        Ok(Basis { flatlet, order })
    }
}

/// How direct light is read from a solution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum DirectLight {
    /// From the functions that were fitted to it: reading costs next to nothing, and elements are small along shadows.
    #[default]
    Fitted,
    /// From the lamps themselves, with exact visibility, at every point that is read in a penumbra. Elements need to be
    /// small only where that matters to reflected light, and the promise is for what is read so.
    Gathered,
}

/// Settings of a solution; the same settings and scene give the same bytes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Basis on every side.
    pub basis: Basis,
    /// How light is transported.
    pub method: Method,
    /// Promised error: area-weighted mean absolute error of the irradiance over its area-weighted mean, as a fraction.
    pub error: f64,
    /// How direct light is read; gathered only by [`Method::Sampled`].
    pub direct: DirectLight,
    /// What methods with links are told; the default for others.
    pub links: LinkSettings,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            basis: Basis::M2,
            method: Method::Sampled,
            error: 0.01,
            direct: DirectLight::Fitted,
            links: LinkSettings::default(),
        }
    }
}

/// Settings that make no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// The promised error is no number in the range we can keep.
    #[error("an error of {0} % makes no sense: give between 0.01 % and 100 %")]
    Error(f64),
    /// Direct light to be gathered of a method that does not know its lamps.
    #[error("direct light can be gathered only with --method sampled (the default), not with {0}: leave it out")]
    Gathered(Method),
    /// Choices that do not go together.
    #[error(transparent)]
    Links(#[from] LinkSettingsError),
}

impl Settings {
    /// Whether all elements are of one size and all their pairs are coupled.
    pub fn is_uniform(&self) -> bool {
        self.method.is_full() || self.links.decomposition == Decomposition::Standard
    }

    /// Checks the numbers, and that the choices go together.
    ///
    /// ```
    /// use ondelette_radiosity::settings::{Method, Settings};
    /// let settings = Settings { method: Method::Classical, ..Settings::default() };
    /// // the default basis m2 is none of constant elements
    /// assert!(settings.validated().unwrap_err().to_string().contains("galerkin"));
    /// ```
    ///
    /// # Errors
    /// [`SettingsError`].
    pub fn validated(self) -> Result<Self, SettingsError> {
        if !(1e-4..=1.0).contains(&self.error) {
            return Err(SettingsError::Error(100.0 * self.error));
        }
        if self.direct == DirectLight::Gathered && self.method.has_links() {
            return Err(SettingsError::Gathered(self.method));
        }
        links::validate(&self)?;
        Ok(self)
    }
}
