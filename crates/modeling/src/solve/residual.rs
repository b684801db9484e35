//! The residual of the saddle system: on curves, with twice the precision.

use super::refine::SideState;
use crate::energy::{Operator, Scratch, twofold};
use crate::system::{Block, Structure};
use std::sync::Arc;

/// What is left of both equations.
pub(super) fn residual(
    h: &Operator,
    block: &(Arc<Structure>, Block),
    s: usize,
    side: &SideState,
    only_rows: bool,
    scratch: &mut Scratch,
) -> (Vec<f64>, Vec<f64>) {
    let (structure, block) = block;
    let targets = &block.sides[s].targets;
    let r2: Vec<f64> = (0..structure.rows())
        .map(|r| targets[r] - structure.apply_row(r, &side.x) + structure.give[r] * side.multipliers[r])
        .collect();
    let mut r1 = vec![0.0; side.x.len()];
    if only_rows || side.corrections == 0 {
        return (r1, r2);
    }
    let n = structure.n;
    if h.lines.len() == 1 {
        let mut sum: Vec<twofold::Twofold> = Vec::with_capacity(side.x.len());
        for x in side.x.chunks_exact(n) {
            sum.extend(h.apply_twofold(x).unwrap_or_default());
        }
        for (r, l) in side.multipliers.iter().enumerate() {
            let (columns, values) = structure.row(r);
            for (c, v) in columns.iter().zip(values) {
                sum[*c as usize] = twofold::add(sum[*c as usize], twofold::product(*l, *v));
            }
        }
        r1.iter_mut().zip(sum).for_each(|(r, s)| *r = -(s.0 + s.1));
    } else {
        for (x, y) in side.x.chunks_exact(n).zip(r1.chunks_exact_mut(n)) {
            h.apply_exactly(x, y, scratch);
        }
        structure.add_transposed(&side.multipliers, 1.0, &mut r1);
        r1.iter_mut().for_each(|r| *r = -*r);
    }
    (r1, r2)
}
