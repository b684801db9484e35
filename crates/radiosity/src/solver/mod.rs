//! From a scene to its light, step by step.
//!
//! A resumable state machine: every [`Solver::step`] does a bounded piece of work and says what it did. Stop stepping
//! to pause or cancel; [`Solver::solution`] is valid after any step. Two engines stand behind it: `linked` joins
//! pairs of elements by wavelet links, `sampled` samples the rows of the operator.

mod linked;

use crate::sampled::Sampled;
use crate::scene::Scene;
use crate::settings::{Method, Settings};
use crate::solution::Solution;
use linked::Linked;
use std::sync::Arc;

/// What a step did. Counts and residuals only: whoever listens adds the clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// Pairs of sides were looked at.
    Linking {
        /// Pairs done.
        done: usize,
        /// Pairs in all.
        total: usize,
    },
    /// One sweep over all links.
    Iterated {
        /// Sweeps so far.
        iterations: u64,
        /// Relative residual.
        residual: f64,
        /// Residual at which this solve ends.
        wanted: f64,
    },
    /// The light is balanced on the present links, and its error estimated.
    Solved {
        /// Estimated error, relative to the mean irradiance.
        error: f64,
        /// Links.
        links: usize,
        /// Leaf elements.
        elements: usize,
    },
    /// Samples of the operator's rows were drawn.
    Gathering {
        /// Elements done.
        done: usize,
        /// Elements in this batch.
        total: usize,
    },
    /// Links or elements were refined.
    Refining {
        /// Pairs done.
        done: usize,
        /// Pairs in this batch.
        total: usize,
    },
}

/// Why a scene cannot be solved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// No light.
    #[error(
        "the scene '{0}' has no emitter, so there is nothing to solve: \
         give a material an emission (OBJ: Ke, glTF: emissiveFactor)"
    )]
    NoEmitter(String),
    /// Too large for all-pairs initial linking.
    #[error(
        "the scene has {sides} sides and this version links at most {most}: \
         clustering of many small faces is not there yet"
    )]
    TooManySides {
        /// Sides in the scene.
        sides: usize,
        /// The limit.
        most: usize,
    },
    /// The settings make no sense.
    #[error(transparent)]
    Settings(#[from] crate::settings::SettingsError),
}

/// Steps from a scene to its light.
///
/// ```
/// use ondelette_radiosity::{Settings, Solver, scene::samples};
/// let mut solver = Solver::new(samples::facing_squares(1.0), Settings::default()).unwrap();
/// while solver.step().is_some() {}
/// let solution = solver.solution();
/// assert!(solution.is_finished());
/// // the whole square receives the form factor 0.1998 of what the other emits
/// assert!((solution.mean_irradiance(0).0[0] - 0.199824895698387).abs() < 2e-3);
/// ```
pub struct Solver(Engine);

enum Engine {
    Linked(Box<Linked>),
    Sampled(Box<Sampled>),
}

impl Solver {
    /// Prepares a scene. Nothing is solved yet.
    ///
    /// # Errors
    /// See [`SolveError`].
    pub fn new(scene: Scene, settings: Settings) -> Result<Self, SolveError> {
        let settings = settings.validated()?;
        if !scene.has_emitter() {
            return Err(SolveError::NoEmitter(scene.name));
        }
        Ok(Solver(match settings.method {
            Method::Sampled => Engine::Sampled(Box::new(Sampled::new(scene, settings)?)),
            Method::Wavelet => Engine::Linked(Box::new(Linked::new(scene, settings)?)),
        }))
    }

    /// The scene being solved.
    pub fn scene(&self) -> &Arc<Scene> {
        match &self.0 {
            Engine::Linked(engine) => engine.scene(),
            Engine::Sampled(engine) => engine.scene(),
        }
    }

    /// Does a bounded piece of work; `None` when the promise is kept, or when nothing is left to refine
    /// ([`crate::Statistics::finished`] says which).
    pub fn step(&mut self) -> Option<Event> {
        match &mut self.0 {
            Engine::Linked(engine) => engine.step(),
            Engine::Sampled(engine) => engine.step(),
        }
    }

    /// The state as it stands, valid after any step.
    pub fn solution(&self) -> Solution {
        match &self.0 {
            Engine::Linked(engine) => engine.solution(),
            Engine::Sampled(engine) => engine.solution(),
        }
    }

    /// The state as it stands, without a copy: for the end.
    pub fn into_solution(self) -> Solution {
        match self.0 {
            Engine::Linked(engine) => engine.into_solution(),
            Engine::Sampled(engine) => engine.into_solution(),
        }
    }
}
