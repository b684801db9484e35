//! Direct light read exactly: where a fitted function blurs the edge of a shadow, the light of the lamps is looked
//! up at the very point instead.

use super::lamps::{self, Lamps};
use super::{Kept, positive};
use crate::kernel::LightKernel;
use crate::rgb::Rgb;
use crate::solution::Solution;
use crate::visible::View;
use ondelette_compress::NodeId;
use ondelette_numerics::seed;
use std::sync::Arc;

/// A leaf is penumbra when its direct light misses this share of the promised error times the mean irradiance.
const MARKED: f64 = 0.25;
/// Rays of a point to all lamps together that it may see past many things.
const RAYS: f64 = 256.0;

/// The lamps of a solution that kept its samples, for points of its surfaces.
pub(crate) struct ExactDirect {
    lamps: Lamps,
    kept: Arc<Kept>,
    /// Whether a leaf is penumbra.
    marked: Vec<bool>,
    /// Whether its slopes may have been lowered, by channel.
    lowered: Vec<[bool; 3]>,
}

impl ExactDirect {
    /// `None` if nothing was kept.
    pub(crate) fn new(solution: &Solution, kernel: &LightKernel) -> Option<Self> {
        let kept = solution.kept()?.clone();
        let lamps = Lamps::restore(solution.scene(), kernel, solution.settings().error, &kept);
        let (mut whole, mut area) = (0.0, 0.0);
        solution.each_leaf(|_, _, measure, mean| {
            whole += measure * mean.sum();
            area += measure;
        });
        let allowed = if area > 0.0 { MARKED * solution.settings().error * whole / area } else { 0.0 };
        let groups = lamps.groups.len();
        let missed = |n: usize| -> f64 {
            let each = lamps.groups.iter().enumerate();
            each.map(|(g, (_, e))| e.sum() * f64::from(kept.misfit[n * groups + g] + kept.scatter[n * groups + g]))
                .sum()
        };
        let marked = (0..solution.forest().len()).map(|n| missed(n) > allowed).collect();
        let lowered = positive::may_be_lowered(solution.forest(), solution.coefficients());
        Some(ExactDirect { lamps, kept, marked, lowered })
    }

    /// Whether direct light is read exactly on a leaf.
    pub(crate) fn is_marked(&self, leaf: NodeId) -> bool {
        self.marked[leaf.index()]
    }

    /// What a leaf's function lacks at a local point: the direct light there less its fitted function.
    pub(crate) fn correction(&self, solution: &Solution, kernel: &LightKernel, leaf: NodeId, x: [f64; 2]) -> Rgb {
        let forest = solution.forest();
        let cell = &forest.node(leaf).cell;
        let (side, at) = (cell.root as usize, cell.to_root(x));
        let (point, normal) = (solution.point(side, at), kernel.element(cell).normal());
        let groups = &self.lamps.groups;
        let mut values = vec![[0.0; 2]; groups.len()];
        if !kernel.is_covered(side, point) {
            let seen = self.lamps.seen_by(kernel, cell);
            let mut view = View::new(kernel.occluders().tolerance());
            let key = at.iter().fold(cell.key, |key, x| seed::combine(key, x.to_bits()));
            let mut exact = vec![0.0; groups.len()];
            self.lamps.exact(kernel, &mut view, &seen, (point, normal), &mut exact);
            values.iter_mut().zip(exact).for_each(|(v, exact)| *v = [exact; 2]);
            let sums = lamps::sums(&seen.crowded);
            self.lamps.by_rays(kernel, (&seen.crowded, &sums, RAYS), (side, point, normal), key, &mut values);
        }
        let basis = forest.basis_of(leaf);
        let mut functions = [0.0; 36];
        basis.eval(x, &mut functions);
        let (mut exact, mut fitted, mut fitted_mean) = (Rgb::BLACK, Rgb::BLACK, Rgb::BLACK);
        for (g, (_, exitance)) in groups.iter().enumerate() {
            let own = &self.kept.direct[(leaf.index() * groups.len() + g) * forest.stride()..];
            exact += *exitance * (0.5 * (values[g][0] + values[g][1]));
            fitted += *exitance * own.iter().zip(&functions[..basis.len()]).map(|(c, f)| c * f).sum::<f64>();
            fitted_mean += *exitance * own[0];
        }
        // where slopes were lowered, what was fitted is not in the sum any more: the mean still is
        let lowered = self.lowered[leaf.index()];
        let present = solution.inside(leaf, x);
        let mean = solution.coefficients()[leaf.index() * forest.stride()];
        Rgb(std::array::from_fn(|c| {
            let reflected = (mean[c] - fitted_mean.0[c]).max(0.0);
            if lowered[c] { exact.0[c] + reflected - present.0[c] } else { exact.0[c] - fitted.0[c] }
        }))
    }
}
