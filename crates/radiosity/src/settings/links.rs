//! What methods with links can be told.

use super::Settings;
use super::method::{Decomposition, Iteration, Method, Oracle, Weight};
use serde::{Deserialize, Serialize};

/// Choices of the methods that link pairs of elements. The default is what is usually best.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LinkSettings {
    /// How the linear system is solved.
    pub iteration: Iteration,
    /// What decides which links are refined.
    pub oracle: Oracle,
    /// What its tests are weighted with; see [`LinkSettings::weight`].
    pub weight: Option<Weight>,
    /// An order for each link, up to that of the basis (`--basis auto`), else the basis's for all.
    pub graded: bool,
    /// How the operator of hierarchical and wavelet is written.
    pub decomposition: Decomposition,
    /// Full matrices: into 2^n parts the longest edge of the scene is divided, shorter edges as often as makes their
    /// parts no longer. `None`: as often as the promised error asks.
    pub subdivision: Option<u8>,
}

impl LinkSettings {
    /// Finest uniform subdivision.
    pub const FINEST: u8 = 12;

    /// The weight in force: the one asked for, else variation for the oracle `error`, brightness for the others.
    pub fn weight(&self) -> Weight {
        self.weight.unwrap_or(match self.oracle {
            Oracle::Error => Weight::Variation,
            Oracle::Fit | Oracle::Magnitude => Weight::Brightness,
        })
    }
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
    #[error(
        "the method {0} chooses where to divide: a uniform subdivision is for classical, galerkin and the standard \
         decomposition"
    )]
    Adaptive(Method),
    /// An oracle where nothing is refined.
    #[error("the method {0} links all pairs of elements: oracles and weights are for hierarchical and wavelet")]
    NoOracle(Method),
    /// Orders of their own where links cannot have them.
    #[error("the method {0} has one order for all links: auto is a basis of the method wavelet")]
    NotGraded(Method),
    /// A decomposition of what is not decomposed.
    #[error("the method {0} has no wavelets: decompositions are for hierarchical and wavelet")]
    NotDecomposed(Method),
    /// Something that the standard decomposition does not have.
    #[error("the standard decomposition has no {0}: {1}")]
    Standard(&'static str, &'static str),
    /// Weights for the two ends of an oracle that does not tell them apart.
    #[error("the oracle magnitude does not say at which end the kernel varies: variation is for error and fit")]
    NoVariation,
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
    if links.graded && (method != Method::Wavelet || basis.flatlet) {
        return Err(LinkSettingsError::NotGraded(method));
    }
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
    if links.oracle == Oracle::Magnitude && links.weight == Some(Weight::Variation) {
        return Err(LinkSettingsError::NoVariation);
    }
    if links.decomposition == Decomposition::Standard {
        let lacks = |what, why| Err(LinkSettingsError::Standard(what, why));
        if !matches!(method, Method::Hierarchical | Method::Wavelet) {
            return Err(LinkSettingsError::NotDecomposed(method));
        }
        if basis.flatlet && basis.order > 1 {
            return lacks("flatlets", "they are not orthogonal; choose haar or m2 to m6");
        }
        if links.graded {
            return lacks("basis auto", "it has no links that could choose; choose haar or m2 to m6");
        }
        if links.oracle != Oracle::default() || links.weight.is_some() {
            return lacks("oracle", "it starts from the full matrix");
        }
        if links.iteration.is_local() {
            return lacks("local solvers", "its terms reach across surfaces; choose gmres or jacobi");
        }
    }
    if method.is_full() && (links.oracle != Oracle::default() || links.weight.is_some()) {
        return Err(LinkSettingsError::NoOracle(method));
    }
    match links.subdivision {
        Some(_) if !settings.is_uniform() => Err(LinkSettingsError::Adaptive(method)),
        Some(n) if n > LinkSettings::FINEST => Err(LinkSettingsError::TooFine(n)),
        _ => Ok(()),
    }
}
