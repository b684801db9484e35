//! Elements split, and gather at more points.

use super::gather::{Draw, Gather, MOST, mean_of};
use super::plan::{DEEPEST, MEAN_OF_MISFIT, SIGNIFICANT};
use super::slots::Slots;
use super::verdict::Verdict;
use super::{LEAST_LAMP_RAYS, SMALL_SHARE, Sampled, TINY_SHARE};
use crate::rgb::Rgb;
use ondelette_compress::{NodeId, transport};

/// Under a cap on memory a misfit below this share of what is allowed is not worth the samples of a split.
const WORTHY: f64 = 1.0 / 400.0;
/// An element that sends on this many times the share of the light that its grain is meant for is not one of very many.
const BRIGHT: f64 = 4.0;

impl Sampled {
    /// Splits leaves: children take over what is known, and are to be fitted.
    pub(super) fn split(&mut self, leaves: &[NodeId]) -> Vec<NodeId> {
        let (groups, stride) = (self.lamps.groups.len(), self.forest.stride());
        // not a byte more than is counted
        let more: usize = leaves.iter().map(|&id| self.forest.node(id).cell.shape.arity()).sum();
        self.forest.reserve(more);
        self.irradiance.reserve_exact(more * stride);
        self.direct.reserve_exact(more * groups * stride);
        [&mut self.misfit, &mut self.scatter].into_iter().for_each(|v| v.reserve_exact(more * groups));
        [&mut self.lit, &mut self.rays].into_iter().for_each(|v| v.reserve_exact(more));
        let mut fresh = Vec::with_capacity(more);
        for &id in leaves {
            self.forest.split(id);
            if let Some(known) = self.known.get_mut(id.index()) {
                *known = None;
            }
            let arity = self.forest.node(id).cell.shape.arity();
            fresh.extend((0..arity).map(|c| self.forest.child(id, c)));
            self.irradiance.resize(self.forest.len() * stride, [0.0; 3]);
            transport::push_node(&self.forest, id, &mut self.irradiance);
            self.irradiance[id.index() * stride..(id.index() + 1) * stride].fill([0.0; 3]);
        }
        self.direct.resize(self.forest.len() * groups * stride, 0.0);
        self.misfit.resize(self.forest.len() * groups, 0.0);
        self.scatter.resize(self.forest.len() * groups, 0.0);
        self.lit.resize(self.forest.len(), 1.0);
        self.crowded.reserve_exact(more);
        self.crowded.resize(self.forest.len(), false);
        if self.cap.is_none() {
            self.known.resize(self.forest.len(), None);
        }
        // smaller elements need fewer rays
        for &id in &fresh {
            let parent = self.rays[self.forest.node(id).parent.index()];
            self.rays.push((0.5 * parent).max(LEAST_LAMP_RAYS));
        }
        fresh
    }

    /// The gathering elements that their functions do not fit, as many as bring the sum down to `target`, the worst
    /// first.
    fn misfits(&self, target: f64) -> Vec<usize> {
        let mut worst: Vec<(f64, usize)> = Vec::new();
        let total = self.misfit_of_gathers();
        if total <= target {
            return Vec::new();
        }
        for (k, (gather, verdict)) in self.gathers.iter().zip(&self.verdicts).enumerate() {
            let node = self.forest.node(gather.node);
            if self.counts(node.cell.root) {
                let missed = node.measure * MEAN_OF_MISFIT * verdict.misfit.max(0.0).sqrt();
                // what scatter alone may pretend is left alone
                let has_room = node.cell.depth < DEEPEST && gather.points() as usize + 4 <= Gather::MOST_POINTS;
                if verdict.misfit > SIGNIFICANT * verdict.certainty && has_room {
                    worst.push((missed, k));
                }
            }
        }
        worst.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let least = if self.cap.is_some() { WORTHY * target } else { 0.0 };
        let mut rest = 1.3 * (total - target);
        let enough = worst.iter().take_while(|(missed, _)| {
            let more = rest > 0.0 && *missed >= least;
            rest -= missed;
            more
        });
        enough.map(|w| w.1).collect()
    }

    /// The gathering elements with few points that send on much of the light, and the levels of points that they
    /// need: nothing makes up for what so few get wrong.
    fn starved(&self) -> Vec<(usize, u32)> {
        let stride = self.forest.stride();
        let nodes = self.forest.nodes();
        let mut light = vec![0.0; nodes.len()];
        for n in (0..nodes.len()).rev() {
            let node = &nodes[n];
            if node.first_child == 0 {
                let basis = self.forest.basis(node.cell.shape);
                let own = &self.irradiance[n * stride..n * stride + basis.len()];
                let mean = mean_of(basis, own);
                let side = self.scene.sides[node.cell.root as usize];
                light[n] = node.measure * (self.scene.material(side).reflectance * Rgb(mean)).sum();
            }
            if node.cell.depth > 0 {
                light[node.parent.index()] += light[n];
            }
        }
        let levels = |(k, gather): (usize, &Gather)| {
            let share = light[gather.node.index()] / self.whole;
            match gather.points() {
                0..4 if share > BRIGHT * TINY_SHARE => Some((k, if share > BRIGHT * SMALL_SHARE { 2 } else { 1 })),
                4..16 if share > BRIGHT * SMALL_SHARE => Some((k, 2)),
                _ => None,
            }
        };
        self.gathers.iter().enumerate().filter_map(levels).collect()
    }

    /// Splits the gathering elements that their functions do not fit, and adds points where few are too few; returns
    /// new leaves to be fitted, and what is to be drawn at new points. Memory may have room for a part of it only.
    pub(super) fn split_gathers(&mut self, target: f64) -> (Vec<NodeId>, Vec<Draw>) {
        let mut draws = Vec::new();
        let (starved, mut chosen) = (self.starved(), self.misfits(target));
        chosen.retain(|k| starved.binary_search_by_key(k, |s| s.0).is_err());
        let children = |k: &usize| self.forest.node(self.gathers[*k].node).cell.shape.arity();
        let costs = starved.iter().map(|(k, levels)| self.bytes_of_points(*k, 4 << (2 * (levels - 1))));
        let costs = costs.chain(chosen.iter().map(|k| self.bytes_of_children(*k, children(k)))).collect();
        let affordable = self.affordable(costs, 1.0);
        let starved: Vec<(usize, u32)> = starved.into_iter().take(affordable).collect();
        chosen.truncate(affordable - starved.len());
        chosen.sort_unstable();
        let is_coarse = |k: &usize| self.gathers[*k].is_coarse(self.forest.basis_of(self.gathers[*k].node));
        let (coarse, fine): (Vec<usize>, Vec<usize>) = chosen.into_iter().partition(is_coarse);
        for (k, levels) in starved.into_iter().chain(coarse.into_iter().map(|k| (k, 2))) {
            let gather = &mut self.gathers[k];
            let known = gather.points();
            gather.add_points(&self.forest, levels);
            draws.push(Draw { gather: k as u32, points: known..gather.points(), directions: 0..gather.drawn });
        }
        let leaves: Vec<NodeId> =
            fine.iter().map(|k| self.gathers[*k].node).filter(|id| self.forest.is_leaf(*id)).collect();
        let fresh = self.split(&leaves);
        // the first child takes its parent's place, the others come last
        let arity = |k: &usize| self.forest.node(self.gathers[*k].node).cell.shape.arity();
        let more = fine.iter().map(arity).sum::<usize>() - fine.len();
        self.gathers.reserve_exact(more);
        self.verdicts.reserve_exact(more);
        for k in fine {
            let node = self.gathers[k].node;
            let basis = self.forest.basis_of(node);
            let functions = basis.truncated(self.gathers[k].order);
            let (parent_points, verdict) = (self.gathers[k].points(), self.verdicts[k]);
            let [mut parent, mut values] = [[[0.0; 3]; MOST]; 2];
            let own = self.slots.range(k);
            functions.iter().zip(&self.indirect[own.clone()]).for_each(|(&i, v)| parent[usize::from(i)] = *v);
            for (c, (mut child, known)) in self.gathers[k].split(&self.forest).into_iter().enumerate() {
                child.stick_out(&self.kernel, &self.forest, known);
                values.fill([0.0; 3]);
                let n = basis.len();
                basis.push(c, &parent[..n], &mut values[..n], |to: &mut [f64; 3], k, from: [f64; 3]| {
                    (0..3).for_each(|c| to[c] += k * from[c]);
                });
                let values = functions.iter().map(|&i| values[usize::from(i)]);
                // fewer points for as many functions
                let share = verdict.share * (f64::from(parent_points) / f64::from(child.points())).sqrt();
                let share = share.min(1.0);
                let verdict = Verdict { share, scatter: verdict.scatter * share / verdict.share, ..verdict };
                let place = if c == 0 { k } else { self.gathers.len() };
                let points = known..child.points();
                draws.push(Draw { gather: place as u32, points, directions: 0..child.drawn });
                if c == 0 {
                    self.indirect[own.clone()].iter_mut().zip(values).for_each(|(own, v)| *own = v);
                    (self.gathers[k], self.verdicts[k]) = (child, verdict);
                } else {
                    self.indirect.extend(values);
                    self.gathers.push(child);
                    self.verdicts.push(verdict);
                }
            }
        }
        self.slots = Slots::of(&self.forest, &self.gathers);
        (fresh, draws)
    }
}
