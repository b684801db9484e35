//! The engine: link coarsely, solve, see where the error is, refine there, solve again (thesis 4.5, multigridding).
//!
//! A resumable state machine: every [`Solver::step`] does a bounded piece of work and says what it did. Stop stepping
//! to pause or cancel; [`Solver::solution`] is valid after any step.
//!
//! The unknown is the irradiance E of each side: E = K (M + rho E), with M = pi L the exitance of emitters. Reflectance
//! multiplies at the shooter when light leaves again, so three colours share one set of links.

use super::{Event, SolveError};
use crate::kernel::{LightKernel, SideFrame};
use crate::rgb::Rgb;
use crate::scene::Scene;
use crate::settings::Settings;
use crate::solution::{Solution, Statistics};
use ondelette_compress::{CoupleSettings, End, Estimate, Forest, Link, Links, Magnitudes, Refinement, Task, transport};
use ondelette_numerics::krylov::Gmres;
use std::sync::Arc;

enum Phase {
    Linking(Refinement),
    Solving(Box<Gmres<3>>),
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
    /// Whether the present solve goes to the final tolerance.
    strict: bool,
    /// Area of the sides that the promise counts.
    counted_area: f64,
    /// Integral of the irradiance over counted sides, channels summed: what residuals are measured against.
    whole: f64,
    /// Whether nothing is left to refine although the promise is not kept.
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
/// Most rays of a receiver point.
const MOST_RAYS: usize = 1024;
/// Fewest rays of a receiver point in the last look at a masked pair.
const LEAST_LAST_RAYS: usize = 32;
/// Share of the promise aimed at, so that the last look at the links does not break it.
const AIM: f64 = 0.97;
/// Krylov vectors kept before a restart.
const RESTART: usize = 60;
/// Sweeps that follow a bias through the scene.
const CARRIED_SWEEPS: usize = 4;
/// Deepest split.
const DEEPEST: u32 = 16;

impl Linked {
    /// Prepares a scene. Nothing is linked yet.
    ///
    /// # Errors
    /// See [`SolveError`].
    pub(super) fn new(scene: Scene, settings: Settings) -> Result<Self, SolveError> {
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
        let counted = scene.sides.iter().zip(kernel.sides()).filter(|(s, _)| !scene.material(**s).is_pure_emitter());
        let counted_area = counted.map(|(_, frame)| frame.area).sum();
        let guess = Guess::of(&scene, &kernel, settings.error);
        let mut tasks = Vec::new();
        for (r, &receiver) in forest.roots().iter().enumerate() {
            for (s, &shooter) in forest.roots().iter().enumerate() {
                if kernel.may_see(r, s) {
                    tasks.push(Task::between(receiver, shooter, guess.settings(&scene, &kernel, r, s)));
                }
            }
        }
        Ok(Linked {
            scene: Arc::new(scene),
            settings,
            kernel,
            forest,
            links: Links::new(),
            irradiance,
            phase: Phase::Linking(Refinement::linking(tasks)),
            strict: false,
            counted_area,
            whole: 0.0,
            stalled: false,
            renewed: false,
            error: f64::INFINITY,
            statistics: Statistics::default(),
        })
    }

    /// The scene being solved.
    pub(super) fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Does a bounded piece of work; `None` when the promise is kept, or when nothing is left to refine
    /// ([`Statistics::finished`] says which).
    pub(super) fn step(&mut self) -> Option<Event> {
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
    pub(super) fn solution(&self) -> Solution {
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
    pub(super) fn into_solution(mut self) -> Solution {
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
        let (finished, samples) = batch.step(&self.kernel, &self.forest, WORK_A_STEP);
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
        // E is at least what the present radiosity brings, and that is the residual plus E
        let brought: f64 = self.leaf_sum(|slot| Rgb(residual[slot]) + Rgb(self.irradiance[slot]));
        let known: f64 = self.leaf_sum(|slot| Rgb(self.irradiance[slot]));
        self.whole = brought.max(known);
        self.phase = Phase::Solving(Box::new(Gmres::new(self.irradiance.clone(), residual, weights)));
    }

    /// Integral over counted sides of a piecewise function, channels summed, from its coefficients.
    fn leaf_sum(&self, coefficient: impl Fn(usize) -> Rgb) -> f64 {
        let stride = self.forest.stride();
        let mut sum = 0.0;
        for (n, node) in self.forest.nodes().iter().enumerate() {
            if node.first_child == 0 && self.counts(node.cell.root) {
                let basis = self.forest.basis(node.cell.shape);
                let constant = if basis.is_nested() { 1 } else { basis.len() };
                let share = node.measure / constant as f64;
                sum += (0..constant).map(|j| coefficient(n * stride + j).sum() * share).sum::<f64>();
            }
        }
        sum
    }

    /// Whether the promise counts a side: pure emitters receive too, but nobody asked how much.
    fn counts(&self, side: u32) -> bool {
        !self.scene.material(self.scene.sides[side as usize]).is_pure_emitter()
    }

    /// Weight of each coefficient in the area-weighted square mean: leaves of counted sides only.
    fn slot_weights(&self) -> Vec<f64> {
        let stride = self.forest.stride();
        let mut weights = vec![0.0; self.forest.len() * stride];
        for (n, node) in self.forest.nodes().iter().enumerate() {
            if node.first_child == 0 && self.counts(node.cell.root) {
                let basis = self.forest.basis(node.cell.shape);
                let share = if basis.is_nested() { node.measure } else { node.measure / basis.len() as f64 };
                weights[n * stride..n * stride + basis.len()].fill(share);
            }
        }
        weights
    }

    fn sweep(&mut self, mut gmres: Box<Gmres<3>>) -> Event {
        // the residual a first, coarse balance needs, and the one that the promise needs
        let highest = self.highest_reflectance();
        let tolerance =
            if self.strict { self.settings.error } else { self.settings.error.max(0.3 * self.error.min(0.3)) };
        let wanted = 0.1 * tolerance * (1.0 - highest);
        // by Cauchy and Schwarz the integral of |r| is at most the root of the area times the norm of r
        let residual = |g: &Gmres<3>| {
            let r = g.residual().iter().sum::<f64>() * self.counted_area.sqrt();
            if self.whole > 0.0 { r / self.whole } else { 0.0 }
        };
        let now = residual(&gmres);
        let direction = if now <= wanted { None } else { gmres.direction() };
        let Some(direction) = direction else {
            self.irradiance = gmres.solution();
            self.settle();
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
        let event = Event::Iterated { iterations: self.statistics.iterations, residual: residual(&gmres), wanted };
        if gmres.steps() >= RESTART {
            self.irradiance = gmres.solution();
            self.start_solving();
        } else {
            self.phase = Phase::Solving(gmres);
        }
        event
    }

    /// One plain sweep at the end of a solve: sides that the norm leaves out get what the others send them.
    fn settle(&mut self) {
        let mut values = self.radiosity(&self.irradiance, true);
        let mut result = vec![[0.0; 3]; values.len()];
        transport::apply(&self.forest, &self.links, &mut values, &mut result);
        self.irradiance = result;
        self.statistics.iterations += 1;
    }

    /// What a signed error of the irradiance becomes by reflection: the integral of its absolute value over all further
    /// bounces. A few sweeps, then a geometric tail.
    fn carried(&self, bias: &[[f64; 3]]) -> f64 {
        let stride = self.forest.stride();
        let mut error = vec![[0.0; 3]; self.irradiance.len()];
        for (n, node) in self.forest.nodes().iter().enumerate() {
            let basis = self.forest.basis(node.cell.shape);
            let constant = if basis.is_nested() { 1 } else { basis.len() };
            error[n * stride..n * stride + constant].fill(bias[n]);
        }
        let size = |e: &[[f64; 3]]| self.leaf_sum(|slot| Rgb(e[slot].map(f64::abs)));
        let (mut sum, mut last, mut ratio) = (0.0, size(&error), 0.0);
        for _ in 0..CARRIED_SWEEPS {
            let mut values = self.radiosity(&error, false);
            transport::apply(&self.forest, &self.links, &mut values, &mut error);
            let now = size(&error);
            sum += now;
            ratio = if last > 0.0 { (now / last).min(0.99) } else { 0.0 };
            last = now;
        }
        sum + last * ratio / (1.0 - ratio)
    }

    /// Estimates the error; finishes, tightens the solve, or starts the next batch of refinement.
    fn judge(&mut self) -> Event {
        let mut values = self.radiosity(&self.irradiance, true);
        transport::pull(&self.forest, &mut values);
        let magnitudes = Magnitudes::of(&self.forest, &values);
        let estimate = Estimate::of(&self.forest, &self.links, &magnitudes, |root| self.counts(root));
        let mean = self.mean_irradiance();
        let whole = mean.sum() * self.counted_area;
        // a bias is carried on by every reflection, scatter is not; and the equations are only solved so far
        let unsolved = self.statistics.residual * whole / (1.0 - self.highest_reflectance());
        let missed = estimate.total + self.carried(&estimate.bias) + unsolved;
        self.error = if whole > 0.0 { missed / whole } else { 0.0 };
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
        // the first time good enough, with a little to spare: renew; then tighten; then done
        let enough = if self.renewed { 1.0 } else { AIM };
        if self.error <= enough * self.settings.error {
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
        let may_split = |k: u32| {
            let link = self.links.as_slice()[k as usize];
            let id = if estimate.ends[k as usize] == End::Receiver { link.receiver } else { link.shooter };
            self.forest.node(id).cell.depth < DEEPEST
        };
        let chosen: Vec<(u32, End)> = estimate
            .largest(wanted, (self.links.len() / 2).max(64), may_split)
            .into_iter()
            .map(|k| (k, estimate.ends[k as usize]))
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

    /// Area-weighted mean irradiance over the sides that the promise counts.
    fn mean_irradiance(&self) -> Rgb {
        let stride = self.forest.stride();
        let mut sum = Rgb::BLACK;
        for (n, node) in self.forest.nodes().iter().enumerate() {
            if node.first_child == 0 && self.counts(node.cell.root) {
                let own = &self.irradiance[n * stride..(n + 1) * stride];
                let basis = self.forest.basis(node.cell.shape);
                sum += Rgb(basis.mean(own, [0.0; 3], |a, b, k| (Rgb(a) + Rgb(b) * k).0)) * node.measure;
            }
        }
        if self.counted_area > 0.0 { sum * (1.0 / self.counted_area) } else { sum }
    }

    fn highest_reflectance(&self) -> f64 {
        self.scene.materials.iter().map(|m| m.reflectance.max()).fold(0.0, f64::max)
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
    let rays = (4.0 * share / error).powf(4.0 / 3.0);
    if rays.is_nan() { least } else { rays.clamp(least as f64, MOST_RAYS as f64) as usize }
}
