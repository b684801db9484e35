//! What methods with links can be told.

use super::Settings;
use super::method::{Iteration, Method};
use serde::{Deserialize, Serialize};

/// Choices of the methods that link pairs of elements. The default is what is usually best.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LinkSettings {
    /// How the linear system is solved.
    pub iteration: Iteration,
    /// Full matrices: into 2^n parts the longest edge of the scene is divided, shorter edges as often as makes their
    /// parts no longer. `None`: as often as the promised error asks.
    pub subdivision: Option<u8>,
}

impl LinkSettings {
    /// Finest uniform subdivision.
    pub const FINEST: u8 = 12;
}

/// Settings of links that make no sense.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LinkSettingsError {
    /// Something about links where there are none.
    #[error("the method sampled has no links: solvers, oracles and subdivisions are for {linked}", linked = LINKED)]
    NoLinks,
    /// A basis that the method does not have.
    #[error("the method {method} has no basis {basis}: {instead}")]
    Basis {
        /// The method.
        method: Method,
        /// The basis.
        basis: super::Basis,
        /// What to choose.
        instead: &'static str,
    },
    /// A uniform subdivision where elements adapt.
    #[error("the method {0} chooses where to divide: a uniform subdivision is for classical and galerkin")]
    Adaptive(Method),
    /// Too fine.
    #[error("a subdivision of {0} is too fine: give 0 to {most}", most = LinkSettings::FINEST)]
    TooFine(u8),
}

/// The methods with links, for messages.
const LINKED: &str = "classical, galerkin, hierarchical and wavelet";

/// Whether the choices go together.
pub(super) fn validate(settings: &Settings) -> Result<(), LinkSettingsError> {
    let Settings { basis, method, links, .. } = *settings;
    let no_basis = |instead| Err(LinkSettingsError::Basis { method, basis, instead });
    match method {
        Method::Sampled if links != LinkSettings::default() => return Err(LinkSettingsError::NoLinks),
        Method::Classical if basis.order > 1 => {
            return no_basis("its elements are constant (haar); higher orders are the method galerkin");
        }
        Method::Hierarchical if basis.order > 1 => {
            return no_basis("its elements are constant (haar); higher orders are the method wavelet");
        }
        Method::Galerkin if basis.order < 2 => {
            return no_basis("choose m2 to m6; constant elements are the method classical");
        }
        Method::Galerkin if basis.flatlet => {
            return no_basis(
                "without a hierarchy flatlets are mere boxes, as in the method classical; choose m2 to m6",
            );
        }
        _ => {}
    }
    match links.subdivision {
        Some(_) if !method.is_full() => Err(LinkSettingsError::Adaptive(method)),
        Some(n) if n > LinkSettings::FINEST => Err(LinkSettingsError::TooFine(n)),
        _ => Ok(()),
    }
}
