//! The engine: link coarsely, solve, see where the error is, refine there, solve again (thesis 4.5, multigridding).
//!
//! A resumable state machine: every [`Solver::step`] does a bounded piece of work and says what it did. Stop stepping
//! to pause or cancel; [`Solver::solution`] is valid after any step.
//!
//! The unknown is the irradiance E of each side: E = K (M + rho E), with M = pi L the exitance of emitters. Reflectance
//! multiplies at the shooter when light leaves again, so three colours share one set of links.

use crate::kernel::{LightKernel, SideFrame};
use crate::rgb::Rgb;
use crate::scene::Scene;
use crate::settings::Settings;
use crate::solution::{Solution, Statistics};
use ondelette_compress::{CoupleSettings, End, Estimate, Forest, Link, Links, Magnitudes, Refinement, Task, transport};
use ondelette_numerics::krylov::Gmres;
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
    /// Links were refined.
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

enum Phase {
    Linking(Refinement),
    Solving(Box<Gmres<3>>),
    Refining(Refinement),
    /// Coupling masked links anew with the radiosity that is known at last.
    Renewing(Refinement),
    Finished,
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
pub struct Solver {
    scene: Arc<Scene>,
    settings: Settings,
    kernel: LightKernel,
    forest: Forest,
    links: Links,
    irradiance: Vec<[f64; 3]>,
    phase: Phase,
    /// Whether the present solve goes to the final tolerance.
    strict: bool,
    /// Whether nothing is left to refine although the promise is not kept.
    stalled: bool,
    /// Whether the masked links were coupled anew since the last refinement.
    renewed: bool,
    error: f64,
    statistics: Statistics,
}

/// Sides up to which all pairs are linked.
pub const MOST_SIDES: usize = 12_000;
/// Pairs a step: a few milliseconds of work, a few tens at worst.
const PAIRS_A_STEP: usize = 128;
/// Rays of a receiver point in the first, coarse linking.
const COARSE_RAYS: usize = 16;
/// Most rays of a receiver point.
const MOST_RAYS: usize = 1024;
/// Fewest rays of a receiver point in the last look at a masked pair.
const LEAST_LAST_RAYS: usize = 32;
/// Krylov vectors kept before a restart.
const RESTART: usize = 60;
/// Deepest split.
const DEEPEST: u32 = 16;

impl Solver {
    /// Prepares a scene. Nothing is linked yet.
    ///
    /// # Errors
    /// See [`SolveError`].
    pub fn new(scene: Scene, settings: Settings) -> Result<Self, SolveError> {
        let settings = settings.validated()?;
        if !scene.has_emitter() {
            return Err(SolveError::NoEmitter(scene.name));
        }
        if scene.sides.len() > MOST_SIDES {
            return Err(SolveError::TooManySides { sides: scene.sides.len(), most: MOST_SIDES });
        }
        let kernel = LightKernel::new(&scene);
        let mut forest = Forest::new(settings.basis.family(), usize::from(settings.basis.order))
            .expect("a parsed basis has a valid order");
        for side in kernel.sides() {
            forest.add_root(side.shape, side.area);
        }
        let irradiance = vec![[0.0; 3]; forest.len() * forest.stride()];
        let guess = Guess::of(&scene, &kernel, settings.error);
        let mut tasks = Vec::new();
        for (r, &receiver) in forest.roots().iter().enumerate() {
            for (s, &shooter) in forest.roots().iter().enumerate() {
                if kernel.may_see(r, s) {
                    tasks.push(Task::between(receiver, shooter, guess.settings(&scene, &kernel, r, s)));
                }
            }
        }
        Ok(Solver {
            scene: Arc::new(scene),
            settings,
            kernel,
            forest,
            links: Links::new(),
            irradiance,
            phase: Phase::Linking(Refinement::linking(tasks)),
            strict: false,
            stalled: false,
            renewed: false,
            error: f64::INFINITY,
            statistics: Statistics::default(),
        })
    }

    /// The scene being solved.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Does a bounded piece of work; `None` when the promise is kept.
    pub fn step(&mut self) -> Option<Event> {
        match std::mem::replace(&mut self.phase, Phase::Finished) {
            Phase::Linking(batch) => {
                Some(self.work(batch, |done, total| Event::Linking { done, total }, Phase::Linking))
            }
            Phase::Refining(batch) => {
                Some(self.work(batch, |done, total| Event::Refining { done, total }, Phase::Refining))
            }
            Phase::Renewing(batch) => {
                Some(self.work(batch, |done, total| Event::Refining { done, total }, Phase::Renewing))
            }
            Phase::Solving(gmres) => Some(self.sweep(gmres)),
            Phase::Finished => None,
        }
    }

    /// The state as it stands, valid after any step.
    pub fn solution(&self) -> Solution {
        let mut statistics = self.statistics.clone();
        statistics.estimated_error = self.error;
        statistics.finished = matches!(self.phase, Phase::Finished) && !self.stalled;
        Solution::new(
            self.scene.clone(),
            self.settings,
            self.forest.clone(),
            self.links.clone(),
            self.irradiance.clone(),
            statistics,
        )
    }

    /// The state as it stands, without a copy: for the end.
    pub fn into_solution(mut self) -> Solution {
        self.statistics.estimated_error = self.error;
        self.statistics.finished = matches!(self.phase, Phase::Finished) && !self.stalled;
        Solution::new(self.scene, self.settings, self.forest, self.links, self.irradiance, self.statistics)
    }

    fn work(
        &mut self,
        mut batch: Refinement,
        event: impl Fn(usize, usize) -> Event,
        phase: impl Fn(Refinement) -> Phase,
    ) -> Event {
        let (finished, samples, _) = batch.step(&self.kernel, &self.forest, PAIRS_A_STEP);
        self.statistics.kernel_samples += samples;
        self.statistics.rays = self.kernel.rays_cast();
        let event = event(batch.done(), batch.len());
        if !finished {
            self.phase = phase(batch);
            return event;
        }
        let stride = self.forest.stride();
        let split = batch.commit(&mut self.forest, &mut self.links);
        self.irradiance.resize(self.forest.len() * stride, [0.0; 3]);
        for id in split {
            transport::push_node(&self.forest, id, &mut self.irradiance);
            self.irradiance[id.index() * stride..(id.index() + 1) * stride].fill([0.0; 3]);
        }
        self.start_solving();
        event
    }

    /// Exitance plus reflectance times irradiance at the leaves.
    fn radiosity(&self, irradiance: &[[f64; 3]], with_exitance: bool) -> Vec<[f64; 3]> {
        let stride = self.forest.stride();
        let mut values = vec![[0.0; 3]; irradiance.len()];
        for (n, node) in self.forest.nodes().iter().enumerate() {
            if node.first_child != 0 {
                continue;
            }
            let material = self.scene.material(self.scene.sides[node.cell.root as usize]);
            let basis = self.forest.basis(node.cell.shape);
            let own = &mut values[n * stride..n * stride + basis.len()];
            for (v, e) in own.iter_mut().zip(&irradiance[n * stride..]) {
                *v = (material.reflectance * Rgb(*e)).0;
            }
            if with_exitance {
                let exitance = material.radiance * std::f64::consts::PI;
                let constant = if basis.is_nested() { 1 } else { basis.len() };
                for v in &mut own[..constant] {
                    *v = (Rgb(*v) + exitance).0;
                }
            }
        }
        values
    }

    fn start_solving(&mut self) {
        // residual = K (M + rho E) - E
        let mut values = self.radiosity(&self.irradiance, true);
        let mut residual = vec![[0.0; 3]; values.len()];
        transport::apply(&self.forest, &self.links, &mut values, &mut residual);
        self.statistics.iterations += 1;
        for (r, e) in residual.iter_mut().zip(&self.irradiance) {
            for c in 0..3 {
                r[c] -= e[c];
            }
        }
        let weights = self.slot_weights();
        self.phase = Phase::Solving(Box::new(Gmres::new(self.irradiance.clone(), residual, weights)));
    }

    /// Weight of each coefficient in the area-weighted square mean: leaves only.
    fn slot_weights(&self) -> Vec<f64> {
        let stride = self.forest.stride();
        let mut weights = vec![0.0; self.forest.len() * stride];
        for (n, node) in self.forest.nodes().iter().enumerate() {
            if node.first_child == 0 {
                let basis = self.forest.basis(node.cell.shape);
                let share = if basis.is_nested() { node.measure } else { node.measure / basis.len() as f64 };
                weights[n * stride..n * stride + basis.len()].fill(share);
            }
        }
        weights
    }

    fn sweep(&mut self, mut gmres: Box<Gmres<3>>) -> Event {
        // the residual a first, coarse balance needs, and the one that the promise needs
        let highest = self.scene.materials.iter().map(|m| m.reflectance.max()).fold(0.0, f64::max);
        let tolerance =
            if self.strict { self.settings.error } else { self.settings.error.max(0.3 * self.error.min(0.3)) };
        let wanted = 0.1 * tolerance * (1.0 - highest);
        let scale = norm(&gmres.solution(), &self.slot_weights());
        let residual = |g: &Gmres<3>, scale: f64| {
            let r = g.residual().iter().map(|r| r * r).sum::<f64>().sqrt();
            if scale > 0.0 {
                r / scale
            } else if r > 0.0 {
                1.0
            } else {
                0.0
            }
        };
        let now = residual(&gmres, scale);
        let direction = if now <= wanted { None } else { gmres.direction() };
        let Some(direction) = direction else {
            self.irradiance = gmres.solution();
            self.statistics.residual = now;
            return self.judge();
        };
        let mut values = self.radiosity(direction, false);
        let mut product = vec![[0.0; 3]; values.len()];
        transport::apply(&self.forest, &self.links, &mut values, &mut product);
        for (p, d) in product.iter_mut().zip(direction) {
            for c in 0..3 {
                p[c] = d[c] - p[c];
            }
        }
        gmres.supply(product);
        self.statistics.iterations += 1;
        let event =
            Event::Iterated { iterations: self.statistics.iterations, residual: residual(&gmres, scale), wanted };
        if gmres.steps() >= RESTART {
            self.irradiance = gmres.solution();
            self.start_solving();
        } else {
            self.phase = Phase::Solving(gmres);
        }
        event
    }

    /// Estimates the error; finishes, tightens the solve, or starts the next batch of refinement.
    fn judge(&mut self) -> Event {
        let mut values = self.radiosity(&self.irradiance, true);
        transport::pull(&self.forest, &mut values);
        let magnitudes = Magnitudes::of(&self.forest, &values);
        let estimate = Estimate::of(&self.forest, &self.links, &magnitudes);
        let (mean, area) = self.mean_irradiance();
        let whole = mean.sum() * area;
        // a bias is carried on by every reflection, scatter is not
        let carried = self.mean_reflectance();
        let bias: f64 = (0..3).map(|c| carried.0[c] / (1.0 - carried.0[c]) * estimate.bias[c].abs()).sum();
        let missed = estimate.total + bias;
        self.error = if whole > 0.0 {
            missed / whole
        } else if missed > 0.0 {
            f64::INFINITY
        } else {
            0.0
        };
        let event = Event::Solved { error: self.error, links: self.links.len(), elements: self.forest.leaves() };
        self.know_present(&values);
        let unit = mean.sum();
        let settings = |k: u32| {
            let link = self.links.as_slice()[k as usize];
            let shot: f64 = magnitudes.mean[link.shooter.index()].iter().sum();
            let share = f64::from(link.strength) * shot / unit;
            let samples = rays_for(share, self.settings.error, 4);
            let negligible = if shot > 0.0 { 0.003 * self.settings.error * unit / shot } else { 0.0 };
            CoupleSettings { negligible, samples, thorough: false }
        };
        // the first time good enough: renew; then tighten; then done, even where renewing moved the estimate a little
        let slack = if self.renewed { 1.02 } else { 1.0 };
        if self.error <= slack * self.settings.error {
            if !self.renewed {
                self.renewed = true;
                let chosen = self.worth_renewing(&magnitudes);
                if !chosen.is_empty() {
                    let thorough = |k: u32| {
                        let usual = settings(k);
                        CoupleSettings { samples: usual.samples.max(LEAST_LAST_RAYS), thorough: true, ..usual }
                    };
                    self.phase = Phase::Renewing(Refinement::renewing(&self.links, &chosen, thorough));
                    return event;
                }
            }
            if self.strict {
                self.phase = Phase::Finished;
            } else {
                self.strict = true;
                self.start_solving();
            }
            return event;
        }
        self.strict = false;
        self.renewed = false;
        let target = self.settings.error * whole;
        let wanted = (estimate.total - 0.5 * target).min(0.6 * estimate.total).max(0.2 * estimate.total);
        let chosen: Vec<(u32, End)> = estimate
            .largest(wanted, (self.links.len() / 2).max(64))
            .into_iter()
            .map(|k| (k, estimate.ends[k as usize]))
            .filter(|&(k, end)| {
                let link = self.links.as_slice()[k as usize];
                let id = if end == End::Receiver { link.receiver } else { link.shooter };
                self.forest.node(id).cell.depth < DEEPEST
            })
            .collect();
        if chosen.is_empty() {
            self.stalled = true;
            self.phase = Phase::Finished;
            return event;
        }
        let batch = Refinement::splitting(&self.forest, &self.links, &chosen, settings);
        self.phase = Phase::Refining(batch);
        event
    }

    /// Gives the kernel the radiosity as it stands.
    fn know_present(&mut self, pulled: &[[f64; 3]]) {
        let values = pulled.iter().map(|v| [v[0] + v[1] + v[2]]).collect();
        self.kernel.set_present(self.forest.clone(), values);
    }

    /// The links that deserve a last look: those that make up nearly all of what detail and mask do together, and those
    /// of which the first few rays saw nothing, which no refinement would ever look at again.
    fn worth_renewing(&self, magnitudes: &Magnitudes<3>) -> Vec<u32> {
        let links = self.links.as_slice();
        let stakes: Vec<f64> = links
            .iter()
            .map(|l| {
                let detail: f64 = magnitudes.detail[l.shooter.index()].iter().sum();
                self.forest.node(l.receiver).measure * f64::from(l.spread + l.roughness) * detail
            })
            .collect();
        let whole: f64 = stakes.iter().sum();
        let mut order: Vec<u32> = (0..stakes.len() as u32).filter(|&k| stakes[k as usize] > 0.0).collect();
        order.sort_by(|&a, &b| stakes[b as usize].total_cmp(&stakes[a as usize]).then(a.cmp(&b)));
        let mut sum = 0.0;
        let enough = order.iter().take_while(|&&k| {
            let before = sum;
            sum += stakes[k as usize];
            before < 0.98 * whole
        });
        let mut chosen: Vec<u32> = enough.copied().collect();
        let unseen = |l: &Link| l.masked && l.strength == 0.0 && l.unseen > 0.0;
        chosen.extend((0..links.len() as u32).filter(|&k| unseen(&links[k as usize])));
        chosen.sort_unstable();
        chosen.dedup();
        chosen
    }

    /// Area-weighted mean irradiance over the sides that the promise counts, and their area.
    fn mean_irradiance(&self) -> (Rgb, f64) {
        let stride = self.forest.stride();
        let (mut sum, mut area) = (Rgb::BLACK, 0.0);
        for (n, node) in self.forest.nodes().iter().enumerate() {
            let material = self.scene.material(self.scene.sides[node.cell.root as usize]);
            if node.first_child != 0 || material.is_pure_emitter() {
                continue;
            }
            let own = &self.irradiance[n * stride..(n + 1) * stride];
            let mean = self.forest.basis(node.cell.shape).mean(own, [0.0; 3], |a, b, k| (Rgb(a) + Rgb(b) * k).0);
            sum += Rgb(mean) * node.measure;
            area += node.measure;
        }
        (if area > 0.0 { sum * (1.0 / area) } else { sum }, area)
    }

    /// Area-weighted mean reflectance.
    fn mean_reflectance(&self) -> Rgb {
        let (mut sum, mut area) = (Rgb::BLACK, 0.0);
        for (side, frame) in self.scene.sides.iter().zip(self.kernel.sides()) {
            sum += self.scene.material(*side).reflectance * frame.area;
            area += frame.area;
        }
        sum * (1.0 / area)
    }
}

/// What can be said of the light before anything is linked: it spreads evenly.
struct Guess {
    irradiance: f64,
    error: f64,
}

impl Guess {
    fn of(scene: &Scene, kernel: &LightKernel, error: f64) -> Self {
        let (mut power, mut absorbing) = (0.0, 0.0);
        for (side, frame) in scene.sides.iter().zip(kernel.sides()) {
            let material = scene.material(*side);
            power += material.radiance.sum() * std::f64::consts::PI * frame.area;
            absorbing += (1.0 - material.reflectance.sum() / 3.0) * frame.area;
        }
        Guess { irradiance: power / absorbing, error }
    }

    /// Few mask samples for pairs that can hardly matter, more for those that may.
    fn settings(&self, scene: &Scene, kernel: &LightKernel, receiver: usize, shooter: usize) -> CoupleSettings {
        let (r, s) = (&kernel.sides()[receiver], &kernel.sides()[shooter]);
        let material = scene.material(scene.sides[shooter]);
        let shot = material.radiance.sum() * std::f64::consts::PI + material.reflectance.sum() / 3.0 * self.irradiance;
        let middle = |f: &SideFrame| f.origin + (f.edges[0] + f.edges[1]) * 0.5;
        let spread = std::f64::consts::PI * middle(r).distance_squared(middle(s));
        let share = s.area / (spread + s.area) * shot / self.irradiance;
        let samples = rays_for(share, self.error, 1).min(COARSE_RAYS);
        CoupleSettings { negligible: 0.0, samples, thorough: false }
    }
}

/// Rays for one receiver point of a link that brings this share of the mean irradiance: so many that their error, of
/// some twenty such links together, stays below the promise (stratified rays err like n^-3/4).
fn rays_for(share: f64, error: f64, least: usize) -> usize {
    (4.0 * share / error).powf(4.0 / 3.0).clamp(least as f64, MOST_RAYS as f64) as usize
}

fn norm(values: &[[f64; 3]], weights: &[f64]) -> f64 {
    values.iter().zip(weights).map(|(v, w)| w * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])).sum::<f64>().sqrt()
}
