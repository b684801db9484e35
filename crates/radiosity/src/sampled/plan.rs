//! What the error is, and what the next batch of work is spent on.
//!
//! Three errors are known apart: the misfit of direct light (measured at test points), the scatter of gathered light
//! (half the difference of two independent halves), and what the functions of the gathering elements cannot say (the
//! product of both halves' misses, which is free of scatter on average).

use super::gather::{Draw, Gather};
use super::shares::{Kind, shares, turning_point};
use super::{FIRST_PRECISION, Phase, Sampled};
use crate::settings::DirectLight;
use crate::solver::Event;
use ondelette_compress::NodeId;

/// The estimate of the mean absolute error times this is above it also where estimates are low: among furniture, and
/// at the sharpest edges.
const SAFETY: f64 = 1.35;
/// Share of the precision asked of a balance that it may leave over, and how finely what is lit anew is balanced, in
/// units of the promise.
pub(super) const UNSOLVED: f64 = 0.1;
pub(super) const FINELY: f64 = 0.3;
/// Share of the promise that is aimed at.
pub(super) const AIM: f64 = 0.95;
/// Mean absolute value of a scattered number, over its standard deviation.
pub(super) const MEAN_OF_SCATTER: f64 = 0.8;
/// To halve the misfit of direct light takes twice the work along edges, and in smooth parts; to halve the scatter
/// where rays decide what is seen, four times.
const MISFIT_POWER: f64 = 1.0;
const LAMP_POWER: f64 = 2.0;
/// Work that smaller gathering elements take, as a share of what rays take: their rays count as rays.
const SPLITTING: f64 = 0.4;
/// Limits of how much more all errors together are than the root of the sum of their squares.
const OVERLAP: [f64; 2] = [1.0, 2.2];
/// Scatter falls with this power of the samples.
const POWER: f64 = 0.7;
/// Most directions of a point and half.
pub(super) const MOST_DIRECTIONS: f64 = 65_536.0;
/// Most growth of an element's directions in a round.
const GROWTH: f64 = 32.0;
/// Mean absolute value of a misfit over its root mean square.
pub(super) const MEAN_OF_MISFIT: f64 = 0.8;
/// What gathering elements cannot say is more than their points see: legs and feet pass between them. Where direct
/// light is gathered, nothing else is overrated to make up for it.
const UNSEEN: f64 = 1.4;
/// Mean root of the positive part of a scattered number of mean 0, over the root of its standard deviation.
pub(super) const FLOOR: f64 = 0.4;
/// A misfit larger than this many of its standard deviations is one.
pub(super) const SIGNIFICANT: f64 = 1.5;
/// Most rays of a point to the lamps where they scatter, and the factor of them below which more are not worth it.
pub(super) const MOST_LAMP_RAYS: f64 = 16_384.0;
const ENOUGH_LAMP_RAYS: f64 = 1.2;
/// Share of the room in memory that is left which direct light may take.
const DIRECT_SHARE: f64 = 0.75;
/// Where nothing brings down a kind of error that alone is too much, this share of the aim is tried before the end: a
/// little more of some rays is not worth it, more may be.
const STUCK: f64 = 0.8;
/// Deepest split.
pub(super) const DEEPEST: u32 = 16;
/// Rounds after which every round aims lower by as much as is missing, within these limits.
const PATIENT_ROUNDS: u32 = 3;
const LOWER: [f64; 2] = [0.65, 0.95];
/// Rounds after which nothing more is hoped for.
const MOST_ROUNDS: u32 = 40;

impl Sampled {
    /// Estimates the error, and plans what comes next.
    pub(super) fn judge(&mut self, unsolved: f64) -> Event {
        self.whole = self.integral(&self.irradiance);
        self.reflected = (self.whole - self.integral_of_direct()).max(0.0);
        self.missed = self.missed_by_side();
        let missed: f64 = self.missed.iter().sum();
        let apart = self.kinds().iter().map(|k| k.error * k.error).sum::<f64>().sqrt();
        if apart > 0.0 {
            self.overlap = (missed / apart).clamp(OVERLAP[0], OVERLAP[1]);
        }
        // in the dark, all that may be missed is all there is
        let dark = if missed > 0.0 { 1.0 } else { 0.0 };
        // what lighting anew may leave over counts from the first, so that the same lamps keep the promise
        let unsolved = unsolved.max(UNSOLVED * FINELY * self.settings.error);
        self.error = if self.whole > 0.0 { SAFETY * missed / self.whole + unsolved } else { dark };
        self.precision = self.settings.error.max((0.3 * self.error).min(FIRST_PRECISION));
        self.missed.iter_mut().for_each(|m| *m *= SAFETY);
        self.rounds += 1;
        self.refitted = false;
        let event = Event::Solved { error: self.error, links: 0, elements: self.forest.leaves() };
        if self.error <= self.settings.error {
            self.phase = Phase::Finished;
        } else if self.rounds >= MOST_ROUNDS || self.full {
            self.stalled = true;
            self.phase = Phase::Finished;
        } else {
            let missing = self.settings.error / self.error;
            if self.rounds > PATIENT_ROUNDS {
                self.aim *= missing.clamp(LOWER[0], LOWER[1]);
            }
            self.phase = Phase::Judged;
        }
        event
    }

    /// All three errors together, as an integral over each counted side, channels summed: on every leaf they are
    /// independent of one another, so their squares add up there.
    fn missed_by_side(&self) -> Vec<f64> {
        let root = |k: usize| self.verdicts[k].misfit.max(0.0).sqrt();
        let counted = |k: &usize| self.counts(self.forest.node(self.gathers[*k].node).cell.root);
        let roots: f64 = (0..self.gathers.len())
            .filter(counted)
            .map(|k| self.forest.node(self.gathers[k].node).measure * root(k))
            .sum();
        let scale = if roots > 0.0 { self.misfit_of_gathers() / roots } else { 0.0 };
        let mut local = vec![0.0; self.forest.len()];
        for k in (0..self.gathers.len()).filter(counted) {
            let scatter = MEAN_OF_SCATTER * self.verdicts[k].scatter;
            local[self.gathers[k].node.index()] = scatter.hypot(scale * root(k));
        }
        let mut together = vec![0.0; self.scene.sides.len()];
        for (n, node) in self.forest.nodes().iter().enumerate() {
            if !self.counts(node.cell.root) {
                continue;
            }
            if node.first_child != 0 {
                for c in 0..node.cell.shape.arity() {
                    local[node.first_child as usize + c] += local[n];
                }
            } else {
                let [direct, scatter, read] = self.direct_error(n);
                let area = node.measure * f64::from(self.lit[n]);
                together[node.cell.root as usize] += area * direct.hypot(local[n].hypot(scatter)).hypot(read);
            }
        }
        together
    }

    /// Integral of what the gathering elements' functions cannot say: roots of estimated squares, less what scatter
    /// alone would make of them, and at least those that scatter would hardly make.
    pub(super) fn misfit_of_gathers(&self) -> f64 {
        let (mut sum, mut sure) = (0.0, 0.0);
        for (gather, verdict) in self.gathers.iter().zip(&self.verdicts) {
            let node = self.forest.node(gather.node);
            if self.counts(node.cell.root) {
                let root = node.measure * verdict.misfit.max(0.0).sqrt();
                sum += root;
                if verdict.misfit < verdict.certainty {
                    sum -= FLOOR * node.measure * verdict.certainty.sqrt();
                }
                if verdict.misfit > SIGNIFICANT * verdict.certainty {
                    sure += root;
                }
            }
        }
        let more = if self.settings.direct == DirectLight::Gathered { UNSEEN } else { 1.0 };
        more * MEAN_OF_MISFIT * sure.max(sum)
    }

    /// The kinds of error, as integrals: misfit and scatter of direct light, scatter of the gathered, and what its
    /// elements cannot say.
    fn kinds(&self) -> [Kind; 4] {
        let (mut misfit, mut lamps) = (0.0, 0.0);
        for (n, node) in self.forest.nodes().iter().enumerate() {
            if node.first_child == 0 && self.counts(node.cell.root) {
                let [own, scatter, _] = self.direct_error(n);
                let area = node.measure * f64::from(self.lit[n]);
                misfit += area * own;
                lamps += area * scatter;
            }
        }
        let (mut scatter, mut rays) = (0.0, 0.0);
        for (gather, verdict) in self.gathers.iter().zip(&self.verdicts) {
            let node = self.forest.node(gather.node);
            rays += gather.samples() as f64;
            if self.counts(node.cell.root) {
                scatter += MEAN_OF_SCATTER * node.measure * verdict.scatter;
            }
        }
        [
            Kind { error: misfit, cost: self.work[0], power: MISFIT_POWER },
            Kind { error: lamps, cost: self.work[1], power: LAMP_POWER },
            Kind { error: scatter, cost: rays, power: 1.0 / POWER },
            Kind { error: self.misfit_of_gathers(), cost: SPLITTING * rays, power: MISFIT_POWER },
        ]
    }

    /// Plans the next batch: direct light first, then the gathered.
    pub(super) fn spend(&mut self) {
        self.whole = self.integral_of_direct() + self.reflected;
        let first_aim = self.aim;
        loop {
            let aim = self.aim * self.settings.error * self.whole / (SAFETY * self.overlap);
            let kinds = self.kinds();
            let [direct, lamps, scatter, misfit] = shares(kinds, aim);
            let leaves = if self.full { Vec::new() } else { self.worst_leaves(direct) };
            if !leaves.is_empty() {
                let nodes = self.split(&leaves);
                self.phase = Phase::Fitting { nodes, done: 0, draws: Vec::new() };
                return;
            }
            let nodes = self.unclear_leaves(lamps);
            if !nodes.is_empty() {
                self.phase = Phase::Fitting { nodes, done: 0, draws: Vec::new() };
                return;
            }
            let stuck = kinds[..2].iter().any(|k| k.error > aim);
            let (nodes, draws) = if stuck { Default::default() } else { self.more_samples(misfit, scatter) };
            if !draws.is_empty() {
                // children need direct light as well
                self.phase = Phase::Fitting { nodes, done: 0, draws };
                return;
            }
            if self.refitted {
                // see what it brought
                self.phase = Phase::Casting { draws, done: 0 };
                return;
            }
            // every part is within its share, and yet the sum is not
            self.aim *= 0.93;
            let hopeless = stuck && self.aim < STUCK * first_aim;
            if self.aim < 0.05 || self.full || hopeless {
                self.stalled = true;
                self.phase = Phase::Finished;
                return;
            }
        }
    }

    /// Splits gathering elements, and plans samples: new leaves, and what is to be drawn.
    fn more_samples(&mut self, misfit: f64, scatter: f64) -> (Vec<NodeId>, Vec<Draw>) {
        let (nodes, mut draws) = self.split_gathers(misfit);
        let more = self.draws(scatter);
        draws.extend_from_slice(&more);
        if self.make_room(&draws) {
            self.full = true;
            draws.truncate(draws.len() - more.len());
        }
        (nodes, draws)
    }

    /// The leaves whose direct light misses most, as many as bring the sum down to `target`.
    fn worst_leaves(&mut self, target: f64) -> Vec<NodeId> {
        let mut worst: Vec<(f64, u32)> = Vec::new();
        let mut total = 0.0;
        for (n, node) in self.forest.nodes().iter().enumerate() {
            if node.first_child == 0 && self.counts(node.cell.root) {
                let missed = node.measure * f64::from(self.lit[n]) * self.direct_error(n)[0];
                total += missed;
                if missed > 0.0 && node.cell.depth < DEEPEST {
                    worst.push((missed, n as u32));
                }
            }
        }
        if total <= target {
            return Vec::new();
        }
        worst.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut rest = (1.4 * (total - target)).min(0.7 * total);
        let enough = worst.iter().take_while(|w| {
            let more = rest > 0.0;
            rest -= w.0;
            more
        });
        let mut leaves: Vec<NodeId> = enough.map(|w| NodeId(w.1)).collect();
        // the rest of the room is for what gathers
        let cost = |id: &NodeId| self.forest.node(*id).cell.shape.arity() as u64 * self.bytes_a_node();
        let costs = leaves.iter().map(cost).collect();
        leaves.truncate(self.affordable(costs, DIRECT_SHARE));
        leaves.sort_unstable();
        leaves
    }

    /// The leaves whose view of the lamps scatters too much for the sum to be `target`: they are given the rays that
    /// bring it there, where they do most.
    fn unclear_leaves(&mut self, target: f64) -> Vec<NodeId> {
        // the scatter of one ray, as an integral over the leaf: n rays of a point leave its part 1 / sqrt(n)
        struct Leaf {
            node: usize,
            /// Its scatter with one ray, and the power of it that its share of the rays is in proportion to.
            one: f64,
            density: f64,
        }
        let mut leaves: Vec<Leaf> = Vec::new();
        let mut total = 0.0;
        for (n, node) in self.forest.nodes().iter().enumerate() {
            if node.first_child == 0 && self.counts(node.cell.root) {
                let scatter = node.measure * f64::from(self.lit[n]) * self.direct_error(n)[1];
                if scatter > 0.0 {
                    total += scatter;
                    let one = scatter * f64::from(self.rays[n]).sqrt();
                    leaves.push(Leaf { node: n, one, density: one.powf(2.0 / 3.0) });
                }
            }
        }
        if total <= target * (1.0 + 1e-3) {
            return Vec::new();
        }
        // least rays for a sum of scatter / sqrt(n): n in proportion to scatter^(2/3)
        let wanted = |factor: f64, leaf: &Leaf| {
            let now = f64::from(self.rays[leaf.node]);
            (factor * leaf.density).clamp(now, MOST_LAMP_RAYS.max(now))
        };
        let sum = |factor: f64| leaves.iter().map(|leaf| leaf.one / wanted(factor, leaf).sqrt()).sum::<f64>();
        let [_, factor] = turning_point(|factor| sum(factor) <= target);
        let more: Vec<(usize, f64)> = leaves
            .iter()
            .map(|leaf| (leaf.node, wanted(factor, leaf)))
            .filter(|&(n, rays)| rays > ENOUGH_LAMP_RAYS * f64::from(self.rays[n]))
            .collect();
        for &(n, rays) in &more {
            self.rays[n] = rays as f32;
        }
        more.into_iter().map(|(n, _)| NodeId(n as u32)).collect()
    }

    /// The samples that bring the scatter down to `target`, where they do most.
    fn draws(&self, target: f64) -> Vec<Draw> {
        // the scatter of each element, predicted from the noise at its points (which is known better than the scatter
        // itself), scaled so that the sum is the measured one
        let (mut measured, mut predicted) = (0.0, 0.0);
        let mut elements = Vec::with_capacity(self.gathers.len());
        for (gather, verdict) in self.gathers.iter().zip(&self.verdicts) {
            let node = self.forest.node(gather.node);
            if !self.counts(node.cell.root) {
                elements.push((0.0, 1.0, 1.0));
                continue;
            }
            let weight = MEAN_OF_SCATTER * node.measure * verdict.noise * verdict.share;
            predicted += weight;
            measured += MEAN_OF_SCATTER * node.measure * verdict.scatter;
            elements.push((weight, f64::from(gather.drawn.max(1)), f64::from(gather.points())));
        }
        if measured <= target || predicted <= 0.0 {
            return Vec::new();
        }
        let ratio = measured / predicted;
        let density_of =
            |(weight, drawn, points): (f64, f64, f64)| (weight * drawn.powf(POWER) / points).powf(1.0 / (1.0 + POWER));
        let density: Vec<f64> = elements.iter().map(|&e| density_of(e)).collect();
        let wanted = |scale: f64, (e, density): (&(f64, f64, f64), &f64)| {
            (scale * density).clamp(e.1, e.1 * GROWTH).min(MOST_DIRECTIONS.max(e.1))
        };
        let scatter = |scale: f64| -> f64 {
            elements.iter().zip(&density).map(|e| ratio * e.0.0 * (wanted(scale, e) / e.0.1).powf(-POWER)).sum()
        };
        let [_, high] = turning_point(|scale| scatter(scale) <= target);
        let mut draws = Vec::new();
        for (k, (gather, element)) in self.gathers.iter().zip(elements.iter().zip(&density)).enumerate() {
            let each = wanted(high, element).ceil() as u32;
            if each > gather.drawn + gather.drawn / 4 {
                draws.push(Gather::all(k, gather.points(), gather.drawn..each));
            }
        }
        draws
    }
}
