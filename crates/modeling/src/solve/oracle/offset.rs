//! Heights far from zero: what all targets have in common is taken off before solving, and put on again.
//!
//! B-splines sum to one, and constants cost nothing, so the shape is the same; but rounding grows with the square of
//! the heights, and drowns the energy of what is left of them.

use crate::system::Block;

/// Common heights this many times as large as what is left of them are taken off.
const FAR: f64 = 4.0;

/// What is left of a target is nothing but rounding up to this share of it.
const ROUNDING: f64 = 1e-15;

/// Takes the mean height of each coordinate off the targets, where it is far from zero; returns them.
pub(super) fn take_off(blocks: &mut [Block], coordinates: usize) -> Vec<f64> {
    let mut means = vec![0.0; coordinates];
    for block in blocks {
        let structure = &block.structure;
        let ones = vec![1.0; structure.n];
        for c in 0..structure.k {
            let seen = structure.sight(c, &ones);
            let square: f64 = seen.iter().map(|y| y * y).sum();
            for side in block.sides.iter_mut().filter(|_| square > 0.0) {
                let pairs = || seen.iter().zip(&side.targets).filter(|e| *e.0 != 0.0);
                let mean = pairs().map(|(y, b)| y * b).sum::<f64>() / square;
                let rest = pairs().fold(0.0, |m: f64, (y, b)| m.max((b / y - mean).abs()));
                if !(mean.abs() > FAR * rest && mean.is_finite()) {
                    continue;
                }
                means[side.coordinates[c]] = mean;
                for (b, y) in side.targets.iter_mut().zip(&seen) {
                    let left = *b - y * mean;
                    *b = if left.abs() <= ROUNDING * b.abs() { 0.0 } else { left };
                }
            }
        }
    }
    means
}
