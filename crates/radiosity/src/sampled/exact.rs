//! Direct light read exactly: where a fitted function blurs the edge of a shadow, the light of the lamps is looked
//! up at the very point instead.

use super::lamps::Lamps;
use super::penumbra::{self, Missed};
use super::sights::Sights;
use super::{Kept, positive};
use crate::kernel::LightKernel;
use crate::rgb::Rgb;
use crate::solution::Solution;
use crate::visible::View;
use ondelette_compress::NodeId;
use ondelette_numerics::seed;
use std::sync::Arc;

/// The lamps of a solution that kept its direct light, for points of its surfaces.
pub(crate) struct ExactDirect {
    lamps: Lamps,
    kept: Arc<Kept>,
    /// What the functions of a leaf miss, and how much of it makes it penumbra.
    missed: Vec<Missed>,
    allowed: f64,
    /// Whether its slopes may have been lowered, by channel.
    lowered: Vec<[bool; 3]>,
    sights: Sights,
}

impl ExactDirect {
    /// `None` if nothing was kept.
    pub(crate) fn new(solution: &Solution, kernel: &LightKernel) -> Option<Self> {
        let kept = solution.kept()?.clone();
        let (scene, error, nodes) = (solution.scene(), solution.settings().error, solution.forest().len());
        let lamps = Lamps::restore(scene, kernel, error, &kept).for_points();
        let (mut whole, mut area) = (0.0, 0.0);
        solution.each_leaf(|_, side, measure, mean| {
            if !scene.material(scene.sides[side]).is_pure_emitter() {
                whole += measure * mean.sum();
                area += measure;
            }
        });
        let groups = lamps.groups.len();
        let missed = |n: usize| {
            let own = n * groups..(n + 1) * groups;
            Missed::of(&lamps.groups, &kept.misfit[own.clone()], &kept.scatter[own])
        };
        Some(ExactDirect {
            missed: (0..nodes).map(missed).collect(),
            allowed: if area > 0.0 { penumbra::allowed(error, whole / area) } else { 0.0 },
            lowered: positive::may_be_lowered(solution.forest(), solution.coefficients()),
            sights: Sights::new(nodes),
            lamps,
            kept,
        })
    }

    /// Whether direct light is read exactly on a leaf.
    pub(crate) fn is_marked(&self, leaf: NodeId) -> bool {
        self.missed[leaf.index()].is_marked(self.allowed, self.lamp_rays(leaf))
    }

    /// Rays of a point that the leaf was fitted with.
    fn lamp_rays(&self, leaf: NodeId) -> f64 {
        f64::from(self.kept.lamp_rays[leaf.index()])
    }

    /// Irradiance at a local point of a leaf: the direct light there, and what the leaf's function says of reflected
    /// light. Nothing inside of things, where no lamp shines.
    pub(crate) fn irradiance(&self, solution: &Solution, kernel: &LightKernel, leaf: NodeId, x: [f64; 2]) -> Rgb {
        let forest = solution.forest();
        let cell = &forest.node(leaf).cell;
        let groups = &self.lamps.groups;
        let direct = self.direct(solution, kernel, leaf, x);
        let is_dark = direct.iter().all(|d| *d == 0.0);
        if is_dark && kernel.is_buried(cell.root as usize, kernel.element(cell).point(x)) {
            return Rgb::BLACK;
        }
        let basis = forest.basis_of(leaf);
        let mut functions = [0.0; 36];
        basis.eval(x, &mut functions);
        let (mut exact, mut fitted, mut fitted_mean) = (Rgb::BLACK, Rgb::BLACK, Rgb::BLACK);
        for (g, (_, exitance)) in groups.iter().enumerate() {
            let own = &self.kept.direct[(leaf.index() * groups.len() + g) * forest.stride()..];
            exact += *exitance * direct[g];
            fitted += *exitance * own.iter().zip(&functions[..basis.len()]).map(|(c, f)| c * f).sum::<f64>();
            fitted_mean += *exitance * own[0];
        }
        let present = solution.inside(leaf, x);
        let mean = Rgb(solution.coefficients()[leaf.index() * forest.stride()]);
        // where slopes were lowered, what was fitted is not in the sum any more: the mean still is
        let lowered = self.lowered[leaf.index()];
        let reflected = |c: usize| if lowered[c] { mean.0[c] - fitted_mean.0[c] } else { present.0[c] - fitted.0[c] };
        Rgb(std::array::from_fn(|c| exact.0[c] + reflected(c).max(0.0)))
    }

    /// Direct light at a point of a leaf, for unit exitance of each group of lamps.
    fn direct(&self, solution: &Solution, kernel: &LightKernel, leaf: NodeId, x: [f64; 2]) -> Vec<f64> {
        let cell = &solution.forest().node(leaf).cell;
        let element = kernel.element(cell);
        let (side, point, normal) = (cell.root as usize, element.point(x), element.normal());
        let mut exact = vec![0.0; self.lamps.groups.len()];
        if kernel.is_covered(side, point) {
            return exact;
        }
        let (missed, lamp_rays) = (self.missed[leaf.index()], self.lamp_rays(leaf));
        let rays = |may_bring: f64| missed.rays(may_bring, self.allowed, lamp_rays);
        let sight = self.sights.about((&self.lamps, kernel), (leaf.index(), cell), x, rays);
        let mut view = View::new(kernel.occluders().tolerance());
        self.lamps.exact(kernel, &mut view, &sight.seen, (point, normal), &mut exact);
        if !sight.seen.crowded.is_empty() {
            let key = x.iter().fold(cell.key, |key, x| seed::combine(key, x.to_bits()));
            let crowded = (&sight.seen.crowded[..], &sight.sums[..], sight.rays);
            let mut found = vec![[0.0; 2]; exact.len()];
            self.lamps.by_rays(kernel, crowded, (side, point, normal), key, &mut found);
            exact.iter_mut().zip(found).for_each(|(exact, found)| *exact += 0.5 * (found[0] + found[1]));
        }
        exact
    }
}
