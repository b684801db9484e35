//! The engine for scenes of any size: direct light exact, indirect light by sampled rows of the operator.
//!
//! E = D + I. **D**, what the lamps send, holds nearly all sharp edges: it is known exactly at any point (the visible
//! part of a lamp is cut out of it) and fitted on an adaptive tree. **I**, everything that was reflected, is smooth: it
//! is gathered on a coarser cut through the same trees, by rays that are drawn once and read the present solution
//! wherever they arrive. No pair of surfaces is ever looked at, so n surfaces cost about n log n; no element of one
//! part refines the other.
//!
//! [`lamps`] -> [`direct`] (D on an element), [`gather`] (a row of I) -> [`Sampled`] (the stepped solver) with
//! [`balance`] (the equations solved) and [`plan`] (what to spend the next batch on).

mod balance;
mod direct;
mod exact;
mod field;
mod gather;
mod grow;
mod kept;
mod lamps;
mod memory;
mod penumbra;
mod plan;
mod points;
mod positive;
mod rays;
mod shares;
mod sights;
mod slots;
mod sphere;
mod stitch;
mod verdict;

pub(crate) use exact::ExactDirect;
pub use kept::Kept;

use crate::kernel::LightKernel;
use crate::rgb::Rgb;
use crate::scene::Scene;
use crate::settings::{DirectLight, Settings};
use crate::solution::{Solution, Statistics};
use crate::solver::{Event, SolveError};
use balance::{Left, Spread, Sweep};
use direct::Known;
use field::Form;
use gather::{Draw, Gather};
use lamps::Lamps;
use ondelette_compress::{Forest, Links, NodeId, transport};
use ondelette_numerics::par;
use penumbra::Missed;
use points::Grain;
use slots::Slots;
use std::sync::Arc;
use verdict::Verdict;

/// Elements are at first no larger than this share of the scene's surface.
const FIRST_SHARE: f64 = 1.0 / 256.0;
/// Elements below this share of the scene's surface gather at few points.
const SMALL_SHARE: f64 = 1.0 / 2048.0;
/// And below this one at hardly any: there are very many of them, which make up for one another.
const TINY_SHARE: f64 = 1.0 / 131_072.0;
/// Directions of a point and half in the first round.
const FIRST_DIRECTIONS: u32 = 4;
/// Samples cast in one step.
const RAYS_A_STEP: usize = 16_384;
/// Fewest rays of a point to all lamps together that it may see past many things.
const LEAST_LAMP_RAYS: f32 = 8.0;
/// Relative error that the first balance is to be fit for.
const FIRST_PRECISION: f64 = 0.09;
/// Pairs of element and lamp fitted in one step.
const FITS_A_STEP: usize = 1024;

enum Phase {
    /// Fitting direct light on new elements; then drawing samples, if there are any to draw.
    Fitting {
        nodes: Vec<NodeId>,
        done: usize,
        draws: Vec<Draw>,
    },
    /// Drawing samples.
    Casting {
        draws: Vec<Draw>,
        done: usize,
    },
    /// Gathering the present solution with all samples.
    Sweeping(Sweep),
    /// Balancing with the first samples of every element: towards the solution, or the scatter's way through it.
    Solving(Left),
    Spreading(Spread),
    /// Judged; what comes next is still to be planned.
    Judged,
    Finished,
}

/// The stepped solver.
pub(crate) struct Sampled {
    scene: Arc<Scene>,
    settings: Settings,
    kernel: LightKernel,
    lamps: Lamps,
    forest: Forest,
    /// Direct light for unit exitance, at most about 1: `[node][group][function]`.
    direct: Vec<f32>,
    /// Mean absolute misfit of the direct light of each leaf, for unit exitance: `[node][group]`.
    misfit: Vec<f32>,
    /// Scatter of the direct light of each leaf, where rays decide what is seen, likewise.
    scatter: Vec<f32>,
    /// Rays a point to the lamps that it may see past many things.
    rays: Vec<f32>,
    /// Leaves among many things, whose errors grow with a finer promise.
    crowded: Vec<bool>,
    /// What was found out of the lamps of each leaf.
    known: Vec<Option<Known>>,
    /// Share of each leaf that is not inside of something.
    lit: Vec<f32>,
    gathers: Vec<Gather>,
    verdicts: Vec<Verdict>,
    /// Indirect light of the gathering elements, and where it stands.
    indirect: Vec<[f64; 3]>,
    slots: Slots,
    irradiance: Vec<[f64; 3]>,
    phase: Phase,
    counted_area: f64,
    /// Integral of the irradiance over counted sides, channels summed; 0 before the first balance.
    whole: f64,
    /// The part of it that is reflected light.
    reflected: f64,
    /// Counted bytes that elements and samples may take, and whether only the first samples are stored.
    cap: Option<u64>,
    streaming: bool,
    /// How much more of a residual there is once it was reflected as often as it can be.
    amplification: f64,
    /// Solves of the present samples so far, what they left over, and whether they are to be with all samples.
    corrections: u32,
    left: f64,
    thorough: bool,
    /// What share of the promise batches aim at.
    aim: f64,
    /// How much more all errors together are than the root of the sum of their squares.
    overlap: f64,
    /// Work so far for direct light, in rays: what is cut out exactly, and what rays decide.
    work: [f64; 2],
    rounds: u32,
    /// Whether direct light changed since the last balance.
    refitted: bool,
    stalled: bool,
    /// Whether memory had no room for all that was wanted: what there is is balanced, and that is all.
    full: bool,
    /// Estimated integral of the error over each side, channels summed.
    missed: Vec<f64>,
    error: f64,
    /// Relative error that the balance is to be fit for.
    precision: f64,
    statistics: Statistics,
    scratch: Scratch,
}

/// Arrays that every sweep works in, kept from one to the next.
#[derive(Default)]
struct Scratch {
    values: Vec<[f64; 3]>,
    forms: Vec<Form>,
}

/// Area of the sides that the promise counts.
fn counted_area(scene: &Scene, kernel: &LightKernel) -> f64 {
    let counted = scene.sides.iter().zip(kernel.sides()).filter(|(s, _)| !scene.material(**s).is_pure_emitter());
    counted.map(|(_, frame)| frame.area).sum()
}

impl Sampled {
    pub(crate) fn new(scene: Scene, settings: Settings) -> Result<Self, SolveError> {
        let kernel = LightKernel::new(&scene);
        let lamps = Lamps::of(&scene, &kernel, settings.error);
        let mut forest = Forest::new(settings.basis.family(), usize::from(settings.basis.order))
            .expect("a parsed basis has a valid order");
        let mut area = 0.0;
        for side in kernel.sides() {
            forest.add_root(side.shape, side.area);
            area += side.area;
        }
        let mut n = 0;
        while n < forest.len() {
            let id = NodeId(n as u32);
            if forest.node(id).measure > FIRST_SHARE * area {
                forest.split(id);
            }
            n += 1;
        }
        let leaves: Vec<NodeId> = (0..forest.len() as u32).map(NodeId).filter(|&id| forest.is_leaf(id)).collect();
        let grain = |id: NodeId| match forest.node(id).measure / area {
            share if share > SMALL_SHARE => Grain::Fine,
            share if share > TINY_SHARE => Grain::Coarse,
            _ => Grain::Tiny,
        };
        let gathers = par::map(leaves.len(), |k| {
            let mut gather = Gather::new(&forest, leaves[k], grain(leaves[k]));
            gather.stick_out(&kernel, &forest, 0);
            gather
        });
        let draw = |(k, gather): (usize, &Gather)| Gather::all(k, gather.points(), 0..FIRST_DIRECTIONS);
        let draws = gathers.iter().enumerate().map(draw).collect();
        let phase = Phase::Fitting { nodes: leaves, done: 0, draws };
        Ok(Sampled { phase, ..Self::at_the_start(Arc::new(scene), settings, kernel, lamps, forest, gathers) })
    }

    /// All that is known of a scene before anything is fitted, drawn or balanced.
    fn at_the_start(
        scene: Arc<Scene>,
        settings: Settings,
        kernel: LightKernel,
        lamps: Lamps,
        forest: Forest,
        gathers: Vec<Gather>,
    ) -> Self {
        let (nodes, stride) = (forest.len(), forest.stride());
        let slots = Slots::of(&forest, &gathers);
        Sampled {
            direct: vec![0.0; nodes * stride * lamps.groups.len()],
            misfit: vec![0.0; nodes * lamps.groups.len()],
            scatter: vec![0.0; nodes * lamps.groups.len()],
            lit: vec![1.0; nodes],
            known: vec![None; nodes],
            rays: vec![LEAST_LAMP_RAYS; nodes],
            crowded: vec![false; nodes],
            verdicts: vec![Verdict::default(); gathers.len()],
            indirect: vec![[0.0; 3]; slots.len()],
            slots,
            irradiance: vec![[0.0; 3]; nodes * stride],
            counted_area: counted_area(&scene, &kernel),
            scene,
            settings,
            kernel,
            lamps,
            forest,
            gathers,
            phase: Phase::Finished,
            whole: 0.0,
            reflected: 0.0,
            scratch: Scratch::default(),
            cap: None,
            streaming: false,
            amplification: 1.0,
            corrections: 0,
            left: 0.0,
            thorough: false,
            aim: plan::AIM,
            overlap: 1.0,
            work: [0.0; 2],
            rounds: 0,
            refitted: false,
            stalled: false,
            full: false,
            missed: Vec::new(),
            error: f64::INFINITY,
            precision: settings.error.max(FIRST_PRECISION),
            statistics: Statistics::default(),
        }
    }

    pub(crate) fn settings(&self) -> Settings {
        self.settings
    }

    pub(crate) fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    pub(crate) fn step(&mut self) -> Option<Event> {
        match std::mem::replace(&mut self.phase, Phase::Finished) {
            Phase::Fitting { nodes, done, draws } => Some(self.fit(nodes, done, draws)),
            Phase::Casting { draws, done } => Some(self.cast(draws, done)),
            Phase::Sweeping(sweep) => Some(self.sweep(sweep)),
            Phase::Solving(left) => Some(self.solve(left)),
            Phase::Spreading(spread) => Some(self.spread(spread)),
            Phase::Judged => {
                self.spend();
                self.step()
            }
            Phase::Finished => None,
        }
    }

    fn counts_now(&self) -> Statistics {
        let mut statistics = self.statistics.clone();
        statistics.estimated_error = self.error;
        statistics.finished = matches!(self.phase, Phase::Finished) && !self.stalled;
        statistics
    }

    pub(crate) fn solution(&self) -> Solution {
        let (forest, irradiance) = (self.forest.clone(), self.irradiance.clone());
        Solution::new(self.scene.clone(), self.settings, forest, Links::new(), irradiance, self.counts_now())
            .with_lit(self.lit.clone())
            .with_errors(self.missed.clone())
    }

    /// The end; with what direct light is read by, if that is to be gathered.
    pub(crate) fn into_solution(mut self) -> Solution {
        let kept = match self.settings.direct {
            DirectLight::Gathered => self.keep_direct(),
            DirectLight::Fitted => None,
        };
        let solution = self.without_samples();
        match kept {
            Some(kept) => solution.with_kept(Arc::new(kept)),
            None => solution,
        }
    }

    fn without_samples(self) -> Solution {
        let statistics = self.counts_now();
        Solution::new(self.scene, self.settings, self.forest, Links::new(), self.irradiance, statistics)
            .with_lit(self.lit)
            .with_errors(self.missed)
    }

    /// Whether the promise counts a side: pure emitters receive too, but nobody asked how much.
    fn counts(&self, side: u32) -> bool {
        !self.scene.material(self.scene.sides[side as usize]).is_pure_emitter()
    }

    // ---- direct light

    fn fit(&mut self, nodes: Vec<NodeId>, done: usize, draws: Vec<Draw>) -> Event {
        let count = (FITS_A_STEP / self.lamps.len().clamp(1, FITS_A_STEP / 16)).min(nodes.len() - done);
        let batch = &nodes[done..done + count];
        let fits = par::map(count, |i| {
            let (n, cell) = (batch[i].index(), self.forest.node(batch[i]).cell);
            let before = (f64::from(self.rays[n]), self.known.get(n).and_then(Option::as_ref));
            direct::fit(&self.kernel, &self.lamps, &self.forest, &cell, before)
        });
        let (groups, stride) = (self.lamps.groups.len(), self.forest.stride());
        for (&id, fit) in batch.iter().zip(fits) {
            let basis = self.forest.basis_of(id);
            let n = basis.len();
            let own = &mut self.direct[id.index() * groups * stride..(id.index() + 1) * groups * stride];
            for g in 0..groups {
                let fitted = fit.coefficients[g * n..(g + 1) * n].iter().map(|c| *c as f32);
                own[g * stride..g * stride + n].iter_mut().zip(fitted).for_each(|(own, c)| *own = c);
            }
            let own = id.index() * groups..(id.index() + 1) * groups;
            self.misfit[own.clone()].copy_from_slice(&fit.misfit);
            self.scatter[own].copy_from_slice(&fit.scatter);
            self.lit[id.index()] = fit.lit as f32;
            self.crowded[id.index()] = fit.crowded;
            (0..2).for_each(|k| self.work[k] += fit.work[k]);
            // a cap on memory has better use for it, and leaves it no place
            if let Some(known) = self.known.get_mut(id.index()) {
                *known = fit.known;
            }
        }
        self.statistics.kernel_samples += count as u64;
        self.refitted = true;
        let event = Event::Refining { done: done + count, total: nodes.len() };
        if done + count < nodes.len() {
            self.phase = Phase::Fitting { nodes, done: done + count, draws };
        } else if draws.is_empty() {
            self.spend();
        } else {
            self.phase = Phase::Casting { draws, done: 0 };
        }
        event
    }

    // ---- samples

    fn cast(&mut self, draws: Vec<Draw>, done: usize) -> Event {
        let mut count = 0;
        let mut rays = 0;
        while done + count < draws.len() && rays < RAYS_A_STEP {
            rays += draws[done + count].rays();
            count += 1;
        }
        let batch = &draws[done..done + count];
        let made = par::map(count, |i| {
            let draw = if self.streaming { &batch[i].early() } else { &batch[i] };
            gather::cast(&self.kernel, &self.forest, &self.gathers[draw.gather as usize], draw)
        });
        for (draw, rays) in batch.iter().zip(made) {
            self.gathers[draw.gather as usize].take(draw, rays);
        }
        self.statistics.rays += rays as u64;
        let event = Event::Gathering { done: done + count, total: draws.len() };
        if done + count < draws.len() {
            self.phase = Phase::Casting { draws, done: done + count };
        } else {
            self.prepare();
            self.start_sweeping();
        }
        event
    }

    /// Brings samples up to date with the forest.
    fn prepare(&mut self) {
        let forest = &self.forest;
        let before: Vec<&[u16]> = self.gathers.iter().map(|g| g.functions(forest)).collect();
        par::for_each_chunk(&mut self.gathers, 16, |_, gathers| {
            for gather in gathers {
                gather.relocate(forest);
                gather.prepare(forest.basis_of(gather.node));
            }
        });
        // functions that are in use now have their places
        let slots = Slots::of(forest, &self.gathers);
        let mut indirect = Vec::with_capacity(slots.len());
        let mut all = [[0.0; 3]; gather::MOST];
        for (k, (gather, before)) in self.gathers.iter().zip(before).enumerate() {
            let now = gather.functions(forest);
            now.iter().for_each(|&i| all[usize::from(i)] = [0.0; 3]);
            before.iter().zip(&self.indirect[self.slots.range(k)]).for_each(|(&i, v)| all[usize::from(i)] = *v);
            indirect.extend(now.iter().map(|&i| all[usize::from(i)]));
        }
        (self.indirect, self.slots) = (indirect, slots);
    }

    // ---- balance

    /// What counts of the direct light of a leaf that the functions cannot say, of its scatter, and of that of what is
    /// read there: mean absolute values, channels summed.
    fn direct_error(&self, node: usize) -> [f64; 3] {
        let groups = self.lamps.groups.len();
        let own = node * groups..(node + 1) * groups;
        let missed = Missed::of(&self.lamps.groups, &self.misfit[own.clone()], &self.scatter[own]);
        let (counted, read) = match self.settings.direct {
            DirectLight::Fitted => (missed, 0.0),
            DirectLight::Gathered => {
                let allowed = penumbra::allowed(self.settings.error, self.whole / self.counted_area);
                missed.gathered(allowed, f64::from(self.rays[node]))
            }
        };
        [counted.misfit, plan::MEAN_OF_SCATTER * counted.scatter, plan::MEAN_OF_SCATTER * read]
    }

    /// Direct light at the leaves.
    fn direct_light(&self, mut values: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
        let (groups, stride) = (self.lamps.groups.len(), self.forest.stride());
        values.clear();
        values.reserve_exact(self.forest.len() * stride);
        values.resize(self.forest.len() * stride, [0.0; 3]);
        for (n, node) in self.forest.nodes().iter().enumerate() {
            if node.first_child == 0 {
                for (g, (_, exitance)) in self.lamps.groups.iter().enumerate() {
                    for j in 0..stride {
                        let d = f64::from(self.direct[(n * groups + g) * stride + j]);
                        (0..3).for_each(|c| values[n * stride + j][c] += exitance.0[c] * d);
                    }
                }
            }
        }
        values
    }

    /// Adds gathered light, pushed to the leaves, to `values`.
    fn add_indirect(&self, indirect: &[[f64; 3]], values: &mut [[f64; 3]]) {
        for (k, gather) in self.gathers.iter().enumerate() {
            self.add_at(gather.node, gather.functions(&self.forest), &indirect[self.slots.range(k)], values);
        }
        self.push_to_leaves(values);
    }

    /// Adds coefficients of functions of a node.
    fn add_at(&self, node: NodeId, functions: &[u16], coefficients: &[[f64; 3]], values: &mut [[f64; 3]]) {
        for (&i, from) in functions.iter().zip(coefficients) {
            let to = &mut values[node.index() * self.forest.stride() + usize::from(i)];
            (0..3).for_each(|c| to[c] += from[c]);
        }
    }

    /// Moves coefficients at all nodes to the leaves.
    fn push_to_leaves(&self, values: &mut [[f64; 3]]) {
        let stride = self.forest.stride();
        transport::push(&self.forest, values);
        for (n, node) in self.forest.nodes().iter().enumerate() {
            if node.first_child != 0 {
                values[n * stride..(n + 1) * stride].fill([0.0; 3]);
            }
        }
    }

    /// Irradiance at the leaves to what they send on, without what lamps send themselves.
    fn reflect(&self, values: &mut [[f64; 3]], with_faint: bool) {
        let stride = self.forest.stride();
        for (n, node) in self.forest.nodes().iter().enumerate() {
            if node.first_child != 0 {
                continue;
            }
            let side = node.cell.root as usize;
            let material = self.scene.material(self.scene.sides[side]);
            for v in &mut values[n * stride..(n + 1) * stride] {
                *v = (material.reflectance * Rgb(*v)).0;
            }
            if with_faint && material.radiance.sum() > 0.0 && !self.lamps.is_lamp(side) {
                let basis = self.forest.basis(node.cell.shape);
                let constant = if basis.is_nested() { 1 } else { basis.len() };
                for v in &mut values[n * stride..n * stride + constant] {
                    *v = (Rgb(*v) + material.radiance * std::f64::consts::PI).0;
                }
            }
        }
    }

    /// Integral over counted sides, channels summed, of coefficients at the leaves.
    fn integral(&self, values: &[[f64; 3]]) -> f64 {
        let stride = self.forest.stride();
        let mut sum = 0.0;
        for (n, node) in self.forest.nodes().iter().enumerate() {
            if node.first_child == 0 && self.counts(node.cell.root) {
                let basis = self.forest.basis(node.cell.shape);
                let own = &values[n * stride..n * stride + basis.len()];
                let mean = gather::mean_of(basis, own);
                sum += node.measure * f64::from(self.lit[n]) * mean.iter().sum::<f64>();
            }
        }
        sum
    }

    /// That of gathered light.
    fn integral_of_gathered(&self, gathered: &[[f64; 3]]) -> f64 {
        let mut sum = 0.0;
        for (k, gather) in self.gathers.iter().enumerate() {
            let node = self.forest.node(gather.node);
            if self.counts(node.cell.root) {
                let basis = self.forest.basis_of(gather.node);
                let mut all = [[0.0; 3]; gather::MOST];
                let own = gather.functions(&self.forest).iter().zip(&gathered[self.slots.range(k)]);
                own.for_each(|(&i, v)| all[usize::from(i)] = *v);
                sum += node.measure * gather::mean_of(basis, &all[..basis.len()]).iter().sum::<f64>();
            }
        }
        sum
    }

    /// That of direct light.
    fn integral_of_direct(&self) -> f64 {
        let (groups, stride) = (self.lamps.groups.len(), self.forest.stride());
        let mut sum = 0.0;
        for (n, node) in self.forest.nodes().iter().enumerate() {
            if node.first_child == 0 && self.counts(node.cell.root) {
                let basis = self.forest.basis(node.cell.shape);
                let own = self.direct[n * groups * stride..].chunks(stride).zip(&self.lamps.groups);
                let mean = own.map(|(d, (_, exitance))| {
                    exitance.sum() * f64::from(basis.mean(&d[..basis.len()], 0.0, |a, b: f32, k| a + b * k as f32))
                });
                sum += node.measure * f64::from(self.lit[n]) * mean.sum::<f64>();
            }
        }
        sum
    }
}
