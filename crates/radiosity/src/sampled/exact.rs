//! Direct light read exactly: where a fitted function blurs the edge of a shadow, the light of the lamps is looked
//! up at the very point instead.

use super::Kept;
use super::lamps::Lamps;
use crate::kernel::LightKernel;
use crate::rgb::Rgb;
use crate::solution::Solution;
use crate::visible::View;
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
        Some(ExactDirect { lamps, kept, marked })
    }

    /// What a solution's irradiance at a point lacks: the direct light there less its fitted function; `None` where the
    /// function is good enough.
    pub(crate) fn correction(
        &self,
        solution: &Solution,
        kernel: &LightKernel,
        side: usize,
        at: [f64; 2],
    ) -> Option<Rgb> {
        let forest = solution.forest();
        let (leaf, x) = forest.locate(side, at);
        if !self.marked[leaf.index()] {
            return None;
        }
        let cell = &forest.node(leaf).cell;
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
            self.lamps.by_rays(kernel, (&seen.crowded, RAYS), (side, point, normal), key, &mut values);
        }
        let basis = forest.basis_of(leaf);
        let mut functions = [0.0; 36];
        basis.eval(x, &mut functions);
        let mut sum = Rgb::BLACK;
        for (g, (_, exitance)) in groups.iter().enumerate() {
            let own = &self.kept.direct[(leaf.index() * groups.len() + g) * forest.stride()..];
            let fitted: f64 = own.iter().zip(&functions[..basis.len()]).map(|(c, f)| c * f).sum();
            sum += *exitance * (0.5 * (values[g][0] + values[g][1]) - fitted);
        }
        Some(sum)
    }
}
