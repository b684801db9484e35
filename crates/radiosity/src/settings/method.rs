//! The space of projection methods (thesis Fig. 15), by name.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Writes `Display` and `FromStr` of an enum whose variants have one name each.
macro_rules! names {
    ($type:ident, $what:literal, $error:ident, [$(($variant:ident, $name:literal)),+ $(,)?]) => {
        impl fmt::Display for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(match self {
                    $($type::$variant => $name),+
                })
            }
        }

        #[doc = concat!("A name that is no ", $what, ".")]
        #[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
        #[error("'{0}' is no {what}: choose {all}", what = $what, all = [$($name),+].join(", "))]
        pub struct $error(pub String);

        impl FromStr for $type {
            type Err = $error;

            fn from_str(name: &str) -> Result<Self, $error> {
                match name {
                    $($name => Ok($type::$variant),)+
                    _ => Err($error(name.to_string())),
                }
            }
        }
    };
}

/// How light is transported: the space of methods (thesis Fig. 15), and the sampled engine beside it.
///
/// ```
/// use ondelette_radiosity::settings::Method;
/// let method: Method = "galerkin".parse().unwrap();
/// assert!(method.has_links() && method.is_full());
/// assert!("raytracing".parse::<Method>().is_err());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Method {
    /// Direct light exact, indirect light by sampled rows of the operator: scenes of any size.
    #[default]
    Sampled,
    /// Wavelet links between pairs of elements, of any tree basis.
    Wavelet,
    /// Constant elements of one size, every pair coupled: the full matrix of Eq. 71.
    Classical,
    /// Elements of one size and higher order, every pair coupled: the full matrix of Eq. 88.
    Galerkin,
    /// Links between constant elements of all sizes (Hanrahan, Salzman, Aupperle 1991): wavelets of first order.
    Hierarchical,
}

names!(
    Method,
    "method",
    MethodError,
    [
        (Sampled, "sampled"),
        (Wavelet, "wavelet"),
        (Classical, "classical"),
        (Galerkin, "galerkin"),
        (Hierarchical, "hierarchical"),
    ]
);

impl Method {
    /// Whether pairs of elements are linked; else rows are sampled.
    pub fn has_links(self) -> bool {
        self != Method::Sampled
    }

    /// Whether every pair of elements is linked, on elements of one size.
    pub fn is_full(self) -> bool {
        matches!(self, Method::Classical | Method::Galerkin)
    }
}

/// How the linear system E = K (M + rho E) is solved. All converge to the same solution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Iteration {
    /// Krylov subspaces (Saad and Schultz 1986): the fewest sweeps.
    #[default]
    Gmres,
    /// A sweep reflects all light once.
    Jacobi,
    /// A sweep goes from surface to surface in the order of the file, each gathering what the others send by now.
    GaussSeidel,
    /// Shoots from the element with the most unshot power.
    Southwell,
    /// Progressive radiosity (Cohen et al. 1988): shoots from the surface with the most unshot power, all its elements
    /// at once; Southwell by groups (Gortler, Cohen, Slusallek 1994). No ambient term stands in for what is unshot.
    Shooting,
}

names!(
    Iteration,
    "solver",
    IterationError,
    [
        (Gmres, "gmres"),
        (Jacobi, "jacobi"),
        (GaussSeidel, "gauss-seidel"),
        (Southwell, "southwell"),
        (Shooting, "shooting"),
    ]
);

impl Iteration {
    /// Whether it goes by single surfaces or elements, which only links between nodes allow.
    pub fn is_local(self) -> bool {
        matches!(self, Iteration::GaussSeidel | Iteration::Southwell | Iteration::Shooting)
    }
}

/// What decides which links are refined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Oracle {
    /// The form factor (Hanrahan, Salzman, Aupperle 1991): what exchanges most is refined first.
    Magnitude,
    /// How far a polynomial of the link's order misses the kernel (thesis 4.5.3).
    Fit,
    /// What refining a link takes off the estimated error of the scene.
    #[default]
    Error,
}

names!(Oracle, "oracle", OracleError, [(Magnitude, "magnitude"), (Fit, "fit"), (Error, "error")]);

/// What an oracle's test of the kernel is weighted with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Weight {
    /// Brightness refinement: the radiosity of the shooter.
    Brightness,
    /// Variation refinement, which the thesis describes and leaves open: how the kernel varies over the shooter is
    /// weighted with how the shooter's radiosity does, beyond its basis.
    Variation,
    /// The kernel alone.
    None,
}

names!(Weight, "weight", WeightError, [(Brightness, "brightness"), (Variation, "variation"), (None, "none")]);

/// How an operator is written in wavelets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Decomposition {
    /// Links between nodes of any level (thesis 4.4.2): what an oracle refines.
    #[default]
    Nonstandard,
    /// The full matrix transformed on both axes (thesis 4.4.1), small terms dropped.
    Standard,
}

names!(Decomposition, "decomposition", DecompositionError, [(Nonstandard, "nonstandard"), (Standard, "standard")]);
