//! How far the solution is from the truth, and what to do about it.

use super::guess::rays_for;
use super::{DEEPEST, Event, Linked, Phase};
use crate::rgb::Rgb;
use crate::settings::{Decomposition, Oracle, Weight};
use ondelette_compress::{
    Change, CoupleSettings, End, Estimate, Judgement, Link, Magnitudes, NodeId, Refinement, transport,
};

/// Fewest rays of a receiver point in the last look at a masked pair.
const LEAST_LAST_RAYS: usize = 32;
/// Share of the promise aimed at, so that the last look at the links does not break it.
const AIM: f64 = 0.97;
/// One in so many links is refined at least in a round of an oracle that does not know the error.
const LEAST_SHARE: usize = 16;
/// Sweeps that follow a bias through the scene.
const CARRIED_SWEEPS: usize = 4;

impl Linked {
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
            self.transport(&mut values, &mut error);
            let now = size(&error);
            sum += now;
            ratio = if last > 0.0 { (now / last).min(0.99) } else { 0.0 };
            last = now;
        }
        sum + last * ratio / (1.0 - ratio)
    }

    /// Estimates the error; finishes, tightens the solve, or starts the next batch of refinement.
    pub(super) fn judge(&mut self) -> Event {
        let mut values = self.radiosity(&self.irradiance, true);
        transport::pull(&self.forest, &mut values);
        let magnitudes = Magnitudes::of(&self.forest, &values, self.is_graded());
        let rows = |id: NodeId, each: &mut dyn FnMut(&Link)| self.row(id, each);
        let estimate = Estimate::of_rows(&self.forest, rows, &magnitudes, |root| self.counts(root));
        let mean = self.mean_irradiance();
        let whole = mean.sum() * self.counted_area;
        // a bias is carried on by every reflection, scatter is not; and the equations are only solved so far
        let unsolved = self.statistics.residual * whole / (1.0 - self.highest_reflectance());
        let missed = estimate.total + self.carried(&estimate.bias) + unsolved;
        self.error = if whole > 0.0 { missed / whole } else { 0.0 };
        let event = Event::Solved { error: self.error, links: self.links.len(), elements: self.forest.leaves() };
        if self.uniform.is_some() {
            self.proceed_uniformly();
        } else {
            self.know_present(&values);
            self.proceed(&estimate, &magnitudes, mean.sum());
        }
        event
    }

    /// After a balance of a full matrix: done, tighten the solve, or halve the elements.
    fn proceed_uniformly(&mut self) {
        let decomposes = self.settings.links.decomposition == Decomposition::Standard && !self.resumed;
        let enough = if decomposes { 1.0 - super::standard::SHARE } else { 1.0 };
        if self.error > enough * self.settings.error {
            self.halve_elements();
        } else if self.strict {
            self.phase = if decomposes { Phase::Decomposing } else { Phase::Finished };
        } else {
            self.strict = true;
            self.start_solving();
        }
    }

    /// After a balance of adapting links: done, tighten the solve, look again at what is masked, or refine. `unit` is
    /// the mean irradiance, channels summed.
    fn proceed(&mut self, estimate: &Estimate<3>, magnitudes: &Magnitudes<3>, unit: f64) {
        let graded = self.is_graded();
        let settings = |k: u32| {
            let link = self.links.as_slice()[k as usize];
            let shot: f64 = magnitudes.mean[link.shooter.index()].iter().sum();
            let share = f64::from(link.strength) * shot / unit;
            let samples = rays_for(share, self.settings.error, 4);
            if graded {
                return CoupleSettings { orders: link.orders, negligible: -1.0, samples, thorough: false };
            }
            let negligible = if shot > 0.0 { 0.003 * self.settings.error * unit / shot } else { 0.0 };
            CoupleSettings { negligible, samples, ..CoupleSettings::EXACT }
        };
        // the first time good enough, with a little to spare: renew; then tighten; then done
        let enough = if self.renewed { 1.0 } else { AIM };
        if self.error <= enough * self.settings.error {
            if !self.renewed {
                self.renewed = true;
                let chosen = self.worth_renewing(magnitudes);
                if !chosen.is_empty() {
                    let thorough = |k: u32| {
                        let usual = settings(k);
                        CoupleSettings { samples: usual.samples.max(LEAST_LAST_RAYS), thorough: true, ..usual }
                    };
                    self.phase = Phase::Renewing(Refinement::renewing(&self.links, &chosen, thorough));
                    return;
                }
            }
            if self.strict {
                self.phase = Phase::Finished;
            } else {
                self.strict = true;
                self.start_solving();
            }
            return;
        }
        self.strict = false;
        self.renewed = false;
        let (oracle, weight) = (self.settings.links.oracle, self.settings.links.weight());
        let judgement =
            oracle.of_links().judge(weight.of_links(), graded, &self.forest, &self.links, magnitudes, estimate);
        let chosen = self.choose(&judgement, estimate, self.settings.error * unit * self.counted_area);
        if chosen.is_empty() {
            self.stalled = true;
            self.phase = Phase::Finished;
            return;
        }
        self.phase = Phase::Refining(Refinement::changing(&self.forest, &self.links, &chosen, settings));
    }

    /// The links to change: those that together address what is missing to the `target`, or by other oracles those
    /// above a threshold that falls from round to round.
    fn choose(&self, judgement: &Judgement, estimate: &Estimate<3>, target: f64) -> Vec<(u32, Change)> {
        let may = |k: u32| {
            let link = self.links.as_slice()[k as usize];
            match judgement.changes[k as usize] {
                Change::Split(End::Receiver) => self.forest.node(link.receiver).cell.depth < DEEPEST,
                Change::Split(End::Shooter) => self.forest.node(link.shooter).cell.depth < DEEPEST,
                Change::Raise(_) => true,
            }
        };
        let most = (self.links.len() / 2).max(64).min(self.room_for_changes());
        let chosen = if self.settings.links.oracle == Oracle::Error {
            let wanted = (estimate.total - 0.5 * target).min(0.6 * estimate.total).max(0.2 * estimate.total);
            judgement.largest(wanted, most, may)
        } else {
            judgement.upper_half(self.links.len() / LEAST_SHARE, most, may)
        };
        chosen.into_iter().map(|k| (k, judgement.changes[k as usize])).collect()
    }

    /// Whether links have orders of their own.
    fn is_graded(&self) -> bool {
        self.settings.links.graded
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
                let detail: f64 = magnitudes.detail(l.shooter.index(), l.orders[1]).iter().sum();
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
}

impl Oracle {
    fn of_links(self) -> ondelette_compress::Oracle {
        match self {
            Oracle::Magnitude => ondelette_compress::Oracle::Magnitude,
            Oracle::Fit => ondelette_compress::Oracle::Fit,
            Oracle::Error => ondelette_compress::Oracle::Error,
        }
    }
}

impl Weight {
    fn of_links(self) -> ondelette_compress::Weight {
        match self {
            Weight::Brightness => ondelette_compress::Weight::Mean,
            Weight::Variation => ondelette_compress::Weight::Detail,
            Weight::None => ondelette_compress::Weight::Unit,
        }
    }
}
