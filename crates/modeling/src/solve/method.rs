//! Which method, and how exactly.

use ondelette_wavelet::Scaling;
use serde::{Deserialize, Serialize};

/// How the saddle system is solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Chosen by rule: see [`crate::solve`].
    #[default]
    Auto,
    /// Cosines and waves: mirrored and periodic axes, uniform stiffness. Direct.
    Spectral,
    /// A banded factor: curves. Direct.
    Banded,
    /// Projected conjugate gradients, multilevel diagonal preconditioner.
    Bpx,
    /// Projected conjugate gradients, wavelet preconditioner.
    Wavelet,
    /// Multigrid with multipliers: any number of rows, any stiffness.
    Multigrid,
    /// A sparse factor by a library. Direct.
    Cholesky,
    /// The thesis: conjugate gradients on the squared system, in wavelets.
    ThesisWavelet,
    /// The thesis: conjugate gradients on the squared system, in B-splines.
    ThesisBspline,
}

/// A method name that does not exist.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no solver {0:?}: auto, spectral, banded, bpx, wavelet, multigrid, cholesky, thesis-wavelet or thesis-bspline")]
pub struct MethodError(pub String);

const NAMES: [(Method, &str); 9] = [
    (Method::Auto, "auto"),
    (Method::Spectral, "spectral"),
    (Method::Banded, "banded"),
    (Method::Bpx, "bpx"),
    (Method::Wavelet, "wavelet"),
    (Method::Multigrid, "multigrid"),
    (Method::Cholesky, "cholesky"),
    (Method::ThesisWavelet, "thesis-wavelet"),
    (Method::ThesisBspline, "thesis-bspline"),
];

impl std::str::FromStr for Method {
    type Err = MethodError;

    fn from_str(s: &str) -> Result<Method, MethodError> {
        NAMES.iter().find(|n| n.1 == s).map(|n| n.0).ok_or_else(|| MethodError(s.to_owned()))
    }
}

impl std::fmt::Display for Method {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(NAMES.iter().find(|n| n.0 == *self).map_or("auto", |n| n.1))
    }
}

/// The iterations that the thesis compares (7.2.1, 7.7), all on the squared saddle system.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Iteration {
    /// Conjugate gradients.
    #[default]
    ConjugateGradients,
    /// Steepest descent: the gradient itself, again and again.
    SteepestDescent,
    /// One unknown after the other; an iteration is a sweep.
    GaussSeidel,
}

/// How exactly, and how long at most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Which method.
    pub method: Method,
    /// Largest error of a coefficient, relative to the largest coefficient, that counts as solved.
    pub tolerance: f64,
    /// Iterations of all corrections together after which a solver gives up (an outcome, not an error).
    pub most_iterations: usize,
    /// False: one correction only, unrefined.
    pub refine: bool,
    /// Heights of wavelets, where they are used; `None`: the exact diagonal of the energy.
    pub scaling: Option<Scaling>,
    /// Methods of the thesis: how they iterate.
    pub iteration: Iteration,
    /// Methods of the thesis: the matrix of the saddle system formed entry by entry (7.4.1), not applied by transforms
    /// and stencils; for up to 5000 unknowns. Gauss-Seidel always forms it.
    pub explicit: bool,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            method: Method::Auto,
            tolerance: 1e-8,
            most_iterations: 100_000,
            refine: true,
            scaling: None,
            iteration: Iteration::ConjugateGradients,
            explicit: false,
        }
    }
}
