//! From a scene to its light, step by step.
//!
//! A resumable state machine: every [`Solver::step`] does a bounded piece of work and says what it did. Stop stepping
//! to pause or cancel; [`Solver::solution`] is valid after any step. Two engines stand behind it: `linked` joins
//! pairs of elements by wavelet links, `sampled` samples the rows of the operator.

mod linked;

use crate::sampled::Sampled;
use crate::scene::{Paint, Scene};
use crate::settings::{DirectLight, Method, Settings};
use crate::solution::Solution;
use linked::Linked;
pub use linked::MatrixTooLarge;
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
    /// A full matrix asked for is too large.
    #[error(transparent)]
    Matrix(#[from] MatrixTooLarge),
    /// The settings make no sense.
    #[error(transparent)]
    Settings(#[from] crate::settings::SettingsError),
    /// Not even the coarsest state fits.
    #[error(
        "a memory of {cap} bytes is too small for this scene: elements and first samples alone take {least} bytes; \
         allow more, or join small faces"
    )]
    Memory {
        /// What is allowed.
        cap: u64,
        /// What it takes.
        least: u64,
    },
    /// A material cannot be painted so.
    #[error(transparent)]
    Paint(#[from] crate::scene::PaintError),
    /// A solution without samples or links to go on from.
    #[error(
        "the solution of '{0}' kept no samples or links to go on from: solve it again with --keep-links; methods with \
         links keep them unless --memory has no room for all"
    )]
    NothingKept(String),
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
        Self::within(scene, settings, None)
    }

    /// The same with a cap on the counted bytes, if any: see [`Solver::limit_memory`].
    ///
    /// # Errors
    /// See [`SolveError`].
    ///
    /// ```
    /// use ondelette_radiosity::{Method, Settings, Solver, scene::samples};
    /// let links = ondelette_radiosity::LinkSettings { subdivision: Some(3), ..Default::default() };
    /// let (method, basis, error) = (Method::Classical, "haar".parse().unwrap(), 0.1);
    /// let settings = Settings { method, basis, links, error, ..Settings::default() };
    /// let scene = || samples::facing_squares(1.0);
    /// let light = |cap| {
    ///     let mut solver = Solver::within(scene(), settings, cap)?;
    ///     while solver.step().is_some() {}
    ///     Ok::<_, ondelette_radiosity::SolveError>(solver.solution().coefficients().to_vec())
    /// };
    /// // half of the matrix does not fit: its rows are coupled anew in every sweep, to the same bits
    /// assert!(light(None)? == light(Some(500_000))?);
    /// # Ok::<(), ondelette_radiosity::SolveError>(())
    /// ```
    pub fn within(scene: Scene, settings: Settings, bytes: Option<u64>) -> Result<Self, SolveError> {
        let settings = settings.validated()?;
        if !scene.has_emitter() {
            return Err(SolveError::NoEmitter(scene.name));
        }
        let mut solver = Solver(match settings.method {
            Method::Sampled => Engine::Sampled(Box::new(Sampled::new(scene, settings)?)),
            _ => return Ok(Solver(Engine::Linked(Box::new(Linked::new(scene, settings, bytes)?)))),
        });
        bytes.map_or(Ok(()), |bytes| solver.limit_memory(bytes))?;
        Ok(solver)
    }

    /// Goes on from a solution that kept its samples ([`Solver::into_kept`]) or has links: no ray is cast before the
    /// first [`Event::Solved`].
    ///
    /// # Errors
    /// [`SolveError::NothingKept`].
    pub fn resume(solution: &Solution) -> Result<Self, SolveError> {
        let engine = if solution.settings().method.has_links() {
            Linked::resume(solution).map(|engine| Engine::Linked(Box::new(engine)))
        } else {
            Sampled::resume(solution).map(|engine| Engine::Sampled(Box::new(engine)))
        };
        engine.map(Solver).ok_or_else(|| SolveError::NothingKept(solution.scene().name.clone()))
    }

    /// Lights the scene anew: materials emit or reflect something else, the samples or links stay. The next
    /// [`Event::Solved`] states the new error; steps after that spend the rays that are missing to the promise.
    ///
    /// **Cost** to that event some sweeps over the samples or links; no ray.
    ///
    /// # Errors
    /// [`SolveError::Paint`]; the solver is then as it was.
    ///
    /// ```
    /// use ondelette_radiosity::{Event, Rgb, Settings, Solver, scene::{Paint, samples}};
    /// let mut solver = Solver::new(samples::facing_squares(1.0), Settings::default())?;
    /// while solver.step().is_some() {}
    /// let mut again = Solver::resume(&solver.into_kept())?;
    /// let lamp = again.scene().materials.iter().find(|m| m.radiance.sum() > 0.0).unwrap().clone();
    /// again.relight(&[Paint::Emission(lamp.name, lamp.radiance * 2.0)])?;
    /// while !matches!(again.step(), Some(Event::Solved { .. }) | None) {}
    /// let twice = again.solution();
    /// assert!((twice.mean_irradiance(0).0[0] - 2.0 * 0.199824895698387).abs() < 4e-3);
    /// # Ok::<(), ondelette_radiosity::SolveError>(())
    /// ```
    pub fn relight(&mut self, paints: &[Paint]) -> Result<(), SolveError> {
        match &mut self.0 {
            Engine::Linked(engine) => Ok(engine.paint(paints)?),
            Engine::Sampled(engine) => Ok(engine.paint(paints)?),
        }
    }

    /// Caps the counted bytes of elements, samples and working arrays (the scene and its ray structure come on top).
    /// Samples that do not fit are drawn again whenever they are read: the answer stays within the promise, the time
    /// grows. So do rows of a full matrix with the solvers gmres and jacobi. Where not even elements fit, or links that
    /// adapt do not, the solver stops, and [`crate::Statistics::finished`] is false. Call it before the first step.
    ///
    /// # Errors
    /// [`SolveError::Memory`] if the first elements or links alone take more; [`SolveError::Matrix`] if that is a full
    /// matrix.
    pub fn limit_memory(&mut self, bytes: u64) -> Result<(), SolveError> {
        match &mut self.0 {
            Engine::Linked(engine) => engine.limit_memory(bytes),
            Engine::Sampled(engine) => engine.limit_memory(bytes),
        }
    }

    /// Counted bytes of elements, samples or links, and working arrays.
    pub fn counted_bytes(&self) -> u64 {
        match &self.0 {
            Engine::Linked(engine) => engine.bytes(),
            Engine::Sampled(engine) => engine.bytes(),
        }
    }

    /// Bytes of the scene and its ray structure, which no cap counts.
    pub fn scene_bytes(&self) -> u64 {
        match &self.0 {
            Engine::Linked(engine) => engine.scene_bytes(),
            Engine::Sampled(engine) => engine.scene_bytes(),
        }
    }

    /// Promises another error (a fraction), for a solver that was resumed; it goes on from what it has.
    ///
    /// # Errors
    /// The error is no fraction that can be promised.
    pub fn promise(&mut self, error: f64) -> Result<(), SolveError> {
        let settings = match &self.0 {
            Engine::Linked(engine) => engine.settings(),
            Engine::Sampled(engine) => engine.settings(),
        };
        let error = Settings { error, ..settings }.validated()?.error;
        match &mut self.0 {
            Engine::Linked(engine) => engine.promise(error),
            Engine::Sampled(engine) => engine.promise(error),
        }
        Ok(())
    }

    /// Lets direct light be read in another way from now on, for a solver that was resumed: the promise is for what is
    /// read so.
    ///
    /// # Errors
    /// Direct light is to be gathered of a method with links.
    pub fn read_direct(&mut self, direct: DirectLight) -> Result<(), SolveError> {
        match &mut self.0 {
            Engine::Linked(engine) => Settings { direct, ..engine.settings() }.validated().map(|_| ())?,
            Engine::Sampled(engine) => engine.read_direct(direct),
        }
        Ok(())
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

    /// The end, with the samples that [`Solver::resume`] goes on from; without, if it was stopped in the middle of a
    /// refinement, or has links (which a solution always keeps).
    pub fn into_kept(self) -> Solution {
        match self.0 {
            Engine::Linked(engine) => engine.into_solution(),
            Engine::Sampled(engine) => engine.into_kept(),
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
