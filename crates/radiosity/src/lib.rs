//! Diffuse interreflection of light by wavelet radiosity (thesis chapters 3 and 4).

pub mod form_factor;
pub mod kernel;
pub mod ledger;
pub mod occluder;
pub mod probe;
mod rgb;
mod sampled;
pub mod scene;
pub mod settings;
pub mod solution;
pub mod solver;
pub mod view;
pub mod visible;

pub use rgb::Rgb;
pub use sampled::Kept;
pub use scene::Scene;
pub use settings::{Basis, Decomposition, DirectLight, Iteration, LinkSettings, Method, Oracle, Settings, Weight};
pub use solution::{Solution, Statistics, Terms};
pub use solver::{Event, MatrixTooLarge, SolveError, Solver};
