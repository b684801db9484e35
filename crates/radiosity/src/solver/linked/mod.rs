//! The engine with links: link, solve, see where the error is, refine there, solve again (thesis 4.5, multigridding).
//!
//! A resumable state machine: every [`Solver::step`](super::Solver::step) does a bounded piece of work and says what it
//! did. Stop stepping to pause or cancel; the solution is valid after any step.
//!
//! The unknown is the irradiance E of each side: E = K (M + rho E), with M = pi L the exitance of emitters. Reflectance
//! multiplies at the shooter when light leaves again, so three colours share one set of links.
//!
//! The methods of thesis Fig. 15 share all of it but where links are: `hierarchical` and `wavelet` refine the links
//! that an oracle points at ([`judge`]), `classical` and `galerkin` couple all elements of one size and halve that size
//! ([`uniform`]), and the standard decomposition compresses such a matrix ([`standard`]). [`balance`] solves the linear
//! system; [`measure`] integrates; [`guess`] says how many rays a pair gets.

mod again;
mod balance;
mod guess;
mod judge;
mod measure;
mod memory;
mod standard;
mod uniform;

use super::{Event, SolveError};
use crate::kernel::LightKernel;
use crate::scene::Scene;
use crate::settings::Settings;
use crate::solution::{Solution, Statistics};
use balance::Balance;
use guess::Guess;
use memory::OpenRows;
use ondelette_compress::{Forest, Links, NodeId, Refinement, Standard, Task, transport};
use std::sync::Arc;
pub use uniform::MatrixTooLarge;
use uniform::{Uniform, Weaving};

enum Phase {
    /// A solve on the links as they are is next.
    Beginning,
    Linking(Refinement),
    /// Coupling all pairs of a full matrix.
    Weaving(Weaving),
    Solving(Balance),
    /// A full matrix keeps the promise, and is to be decomposed.
    Decomposing,
    Refining(Refinement),
    /// Coupling masked links anew with the radiosity that is known at last.
    Renewing(Refinement),
    Finished,
}

/// The stepped solver.
pub(super) struct Linked {
    scene: Arc<Scene>,
    settings: Settings,
    kernel: LightKernel,
    forest: Forest,
    links: Links,
    irradiance: Vec<[f64; 3]>,
    phase: Phase,
    /// How fine a full matrix is; `None` where links adapt.
    uniform: Option<Uniform>,
    /// The full matrix in its standard decomposition, once it is there: used in place of the links.
    standard: Option<Standard>,
    /// Rows of a full matrix that memory has no room for.
    open: Option<OpenRows>,
    /// Counted bytes that may be taken.
    cap: Option<u64>,
    /// Whether it goes on from the links of a solution, and the rays that these took.
    resumed: bool,
    rays_before: u64,
    /// Whether the present solve goes to the final tolerance.
    strict: bool,
    /// Area of the sides that the promise counts.
    counted_area: f64,
    /// Integral of the irradiance over counted sides, channels summed: what residuals are measured against.
    whole: f64,
    /// Whether nothing is left to do although the promise is not kept.
    stalled: bool,
    /// Whether the masked links were coupled anew since the last refinement.
    renewed: bool,
    error: f64,
    statistics: Statistics,
}

/// Sides up to which all pairs are linked.
pub(super) const MOST_SIDES: usize = 6_000;
/// Work a step, in units of a few ten microseconds: some ten milliseconds in all.
const WORK_A_STEP: usize = 1024;
/// Rays of a receiver point in the first, coarse linking.
const COARSE_RAYS: usize = 16;
/// Orders of the first links where each has its own.
const FIRST_ORDERS: [u8; 2] = [3, 3];
/// Deepest split.
const DEEPEST: u32 = 16;

/// Area of the sides that the promise counts.
fn counted_area(scene: &Scene, kernel: &LightKernel) -> f64 {
    let counted = scene.sides.iter().zip(kernel.sides()).filter(|(s, _)| !scene.material(**s).is_pure_emitter());
    counted.map(|(_, frame)| frame.area).sum()
}

impl Linked {
    /// Prepares a scene. Nothing is linked yet.
    ///
    /// # Errors
    /// See [`SolveError`].
    pub(super) fn new(scene: Scene, settings: Settings, cap: Option<u64>) -> Result<Self, SolveError> {
        if scene.sides.len() > MOST_SIDES {
            return Err(SolveError::TooManySides { sides: scene.sides.len(), most: MOST_SIDES });
        }
        let kernel = LightKernel::new(&scene);
        let mut forest = Forest::new(settings.basis.family(), usize::from(settings.basis.order))
            .expect("a parsed basis has a valid order");
        for side in kernel.sides() {
            forest.add_root(side.shape, side.area);
        }
        let mut engine = Self::at_the_start(Arc::new(scene), settings, kernel, forest);
        engine.cap = cap;
        if settings.is_uniform() {
            engine.start_weaving(settings.links.subdivision.map(u32::from))?;
        } else {
            engine.phase = Phase::Linking(Refinement::linking(engine.pairs_of_sides()));
            cap.map_or(Ok(()), |cap| engine.limit_memory(cap))?;
        }
        Ok(engine)
    }

    /// No links and no light yet.
    fn at_the_start(scene: Arc<Scene>, settings: Settings, kernel: LightKernel, forest: Forest) -> Self {
        let irradiance = vec![[0.0; 3]; forest.len() * forest.stride()];
        let counted_area = counted_area(&scene, &kernel);
        Linked {
            scene,
            settings,
            kernel,
            forest,
            links: Links::new(),
            irradiance,
            phase: Phase::Finished,
            uniform: None,
            standard: None,
            open: None,
            cap: None,
            resumed: false,
            rays_before: 0,
            strict: false,
            counted_area,
            whole: 0.0,
            stalled: false,
            renewed: false,
            error: f64::INFINITY,
            statistics: Statistics::default(),
        }
    }

    /// All pairs of sides that face each other.
    fn pairs_of_sides(&self) -> Vec<Task> {
        let guess = Guess::of(&self.scene, &self.kernel, self.settings.error);
        let mut tasks = Vec::new();
        for (r, &receiver) in self.forest.roots().iter().enumerate() {
            for (s, &shooter) in self.forest.roots().iter().enumerate() {
                if self.kernel.may_see(r, s) {
                    let mut settings = guess.settings(&self.scene, &self.kernel, r, s);
                    if self.settings.links.graded {
                        (settings.orders, settings.negligible) = (FIRST_ORDERS, -1.0);
                    }
                    tasks.push(Task::between(receiver, shooter, settings));
                }
            }
        }
        tasks
    }

    /// The scene being solved.
    pub(super) fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Does a bounded piece of work; `None` when the promise is kept, or when nothing is left to refine
    /// ([`Statistics::finished`] says which).
    pub(super) fn step(&mut self) -> Option<Event> {
        match std::mem::replace(&mut self.phase, Phase::Finished) {
            Phase::Beginning => {
                self.start_solving();
                let (iterations, wanted) = (self.statistics.iterations, self.wanted());
                Some(Event::Iterated { iterations, residual: 1.0, wanted })
            }
            Phase::Linking(batch) => {
                Some(self.work(batch, |done, total| Event::Linking { done, total }, Phase::Linking))
            }
            Phase::Refining(batch) => {
                Some(self.work(batch, |done, total| Event::Refining { done, total }, Phase::Refining))
            }
            Phase::Renewing(batch) => {
                Some(self.work(batch, |done, total| Event::Refining { done, total }, Phase::Renewing))
            }
            Phase::Weaving(weaving) => Some(self.weave(weaving)),
            Phase::Solving(balance) => Some(self.iterate(balance)),
            Phase::Decomposing => Some(self.decompose()),
            Phase::Finished => None,
        }
    }

    /// The state as it stands, valid after any step. Links of which only a part is stored are left out.
    pub(super) fn solution(&self) -> Solution {
        let links = if self.open.is_some() { Links::new() } else { self.links.clone() };
        Solution::new(
            self.scene.clone(),
            self.settings,
            self.forest.clone(),
            links,
            self.irradiance.clone(),
            self.present_statistics(),
        )
    }

    /// The state as it stands, without a copy: for the end.
    pub(super) fn into_solution(self) -> Solution {
        let statistics = self.present_statistics();
        let links = if self.open.is_some() { Links::new() } else { self.links };
        Solution::new(self.scene, self.settings, self.forest, links, self.irradiance, statistics)
    }

    fn present_statistics(&self) -> Statistics {
        let mut statistics = self.statistics.clone();
        statistics.estimated_error = self.error;
        statistics.finished = matches!(self.phase, Phase::Finished) && !self.stalled;
        statistics
    }

    fn work(
        &mut self,
        mut batch: Refinement,
        event: impl Fn(usize, usize) -> Event,
        phase: impl Fn(Refinement) -> Phase,
    ) -> Event {
        let (finished, samples) = batch.step(&self.kernel, &self.forest, WORK_A_STEP);
        self.statistics.kernel_samples += samples;
        self.statistics.rays = self.rays_before + self.kernel.rays_cast();
        let event = event(batch.done(), batch.len());
        if !finished {
            self.phase = phase(batch);
            return event;
        }
        let split = batch.commit(&mut self.forest, &mut self.links);
        self.inherit(split);
        self.start_solving();
        event
    }

    /// Hands the irradiance of nodes that were split on to their children.
    fn inherit(&mut self, split: Vec<NodeId>) {
        let stride = self.forest.stride();
        self.irradiance.resize(self.forest.len() * stride, [0.0; 3]);
        for id in split {
            transport::push_node(&self.forest, id, &mut self.irradiance);
            self.irradiance[id.index() * stride..(id.index() + 1) * stride].fill([0.0; 3]);
        }
    }
}
