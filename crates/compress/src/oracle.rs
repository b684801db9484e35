//! Oracles: which links to refine, and how (thesis 4.5.3).
//!
//! An oracle puts the kernel between two nodes to a test at either end; what passes between them weights the test. The
//! receiver's test says how the result varies over the receiver beyond its basis, the shooter's how the kernel varies
//! over the shooter. In the wavelet basis the former multiplies the shooter's mean (the coefficients psi phi), the
//! latter its detail (phi psi and psi psi): that is [`Weight::Detail`].

use crate::estimate::{Estimate, Magnitudes};
use crate::forest::Forest;
use crate::links::{Link, Links};
use crate::refine::{Change, End};
use ondelette_numerics::par;

/// What the kernel is tested for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Oracle {
    /// The size of the coupling, as in the first hierarchical methods (Hanrahan, Salzman, Aupperle 1991): what is large
    /// is taken for uneven.
    Magnitude,
    /// How far a polynomial of the link's order misses the kernel at points off those it was fitted to (thesis 4.5.3).
    Fit,
    /// The same misses, as far as those of all links that a receiver has do not cancel: what refining takes off the
    /// estimated error.
    #[default]
    Error,
}

/// What the tests are weighted with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// Both tests with the shooter's mean.
    Mean,
    /// The receiver's test with the shooter's mean, the shooter's with its detail beyond its basis: a large shooter
    /// that is a polynomial of low order is not split, however uneven the kernel.
    Detail,
    /// The kernel alone.
    Unit,
}

/// An oracle's answer on all links.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// What refining each link is worth, by link index; [`Oracle::Error`]: its share of [`Estimate::total`].
    pub gains: Vec<f32>,
    /// How to refine each link.
    pub changes: Vec<Change>,
}

impl Oracle {
    /// Judges all links. With `graded`, links may have orders of their own, and are raised where that promises more for
    /// the work than a split. Cost linear in links.
    pub fn judge<const C: usize>(
        self,
        weight: Weight,
        graded: bool,
        forest: &Forest,
        links: &Links,
        magnitudes: &Magnitudes<C>,
        estimate: &Estimate<C>,
    ) -> Judgement {
        let judged = par::map(links.len(), |k| {
            let link = &links.as_slice()[k];
            let (r, s) = (link.receiver.index(), link.shooter.index());
            let node = &forest.nodes()[r];
            let arity = node.cell.shape.arity();
            let [at_receiver, at_shooter] = match self {
                Oracle::Magnitude => [f64::from(link.strength.abs()); 2],
                _ => {
                    let misses = link.residual[..arity].iter().map(|d| f64::from(d.abs()));
                    [misses.sum::<f64>() / arity as f64, f64::from(link.roughness + link.spread)]
                }
            };
            let mean = match weight {
                Weight::Unit => 1.0,
                _ => magnitudes.mean[s].iter().map(|m| m.abs()).sum(),
            };
            let detail = match weight {
                Weight::Detail => magnitudes.detail(s, link.orders[1]).iter().sum(),
                _ => mean,
            };
            let (receiver, shooter) = (at_receiver * mean, at_shooter * detail);
            let unseen = f64::from(link.unseen) * mean;
            let share = if self == Oracle::Error { estimate.share[r] } else { 1.0 };
            let gain = node.measure * (receiver + shooter + unseen) * share;
            let larger = if node.measure >= forest.nodes()[s].measure { End::Receiver } else { End::Shooter };
            // a leaf has no detail, but what its basis has above the link's order
            let has_detail = weight != Weight::Detail
                || forest.nodes()[s].first_child != 0
                || (graded && usize::from(link.orders[1]) < forest.basis_of(link.shooter).order());
            let end = if (unseen > receiver && unseen > shooter) || (receiver == shooter && weight != Weight::Detail) {
                larger
            } else if shooter > receiver && has_detail {
                End::Shooter
            } else {
                End::Receiver
            };
            let change = if graded && unseen <= receiver.max(shooter) {
                raise_or_split(forest, links, link, end, magnitudes)
            } else {
                Change::Split(end)
            };
            (gain as f32, change)
        });
        let (gains, changes) = judged.into_iter().unzip();
        Judgement { gains, changes }
    }
}

/// Pieces of work that a coupling of these orders takes: moments at each point, and samples of the mask.
fn work(orders: [u8; 2], masked: bool) -> f64 {
    let [p, q] = orders.map(f64::from);
    ((p + 1.0) * (p + 1.0) + 4.0) * (q * q + if masked { 20.0 } else { 2.0 })
}

/// Whether a link's order should rise at one end, or that end be split: whichever takes off more of the miss for its
/// work, if misses go on falling as they did from one order to the next.
fn raise_or_split<const C: usize>(
    forest: &Forest,
    links: &Links,
    link: &Link,
    end: End,
    magnitudes: &Magnitudes<C>,
) -> Change {
    let e = usize::from(end == End::Shooter);
    let id = if end == End::Receiver { link.receiver } else { link.shooter };
    let order = link.orders[e];
    let leaf = forest.is_leaf(id);
    let highest = usize::from(order) >= forest.basis_of(id).order();
    // no polynomial follows an edge of the mask
    let mixed = link.masked && link.spread > 0.0;
    if highest || (mixed && end == End::Receiver) {
        return Change::Split(if end == End::Shooter && leaf { End::Receiver } else { end });
    }
    let decay = decay(forest, links, link, end);
    let by_split = 0.5f64.powi(i32::from(order));
    let mut raised = link.orders;
    raised[e] += 1;
    let (cost_raise, cost_split) = (work(raised, link.masked), 4.0 * work(link.orders, link.masked));
    let (left_raise, left_split) = if end == End::Receiver {
        (decay, by_split)
    } else {
        let detail = |n: usize, order: u8| magnitudes.detail(n, order).iter().sum::<f64>();
        let (rough, spread) = (f64::from(link.roughness), f64::from(link.spread));
        let before = (rough + spread) * detail(id.index(), order);
        let raised = (rough * decay + spread) * detail(id.index(), order + 1);
        let arity = forest.node(id).cell.shape.arity();
        let below = match leaf {
            true => detail(id.index(), order) * by_split,
            false => {
                let square = |c| detail(forest.child(id, c).index(), order).powi(2);
                ((0..arity).map(square).sum::<f64>() / arity as f64).sqrt()
            }
        };
        let split = (rough * by_split + spread) * below;
        if before > 0.0 { (raised / before, split / before) } else { (1.0, 0.0) }
    };
    if (1.0 - left_raise) / cost_raise > (1.0 - left_split) / cost_split {
        Change::Raise(end)
    } else {
        Change::Split(end)
    }
}

/// By how much the block's highest order at one end is smaller than the order below: 0.3 where there is none below.
fn decay(forest: &Forest, links: &Links, link: &Link, end: End) -> f64 {
    let e = usize::from(end == End::Shooter);
    let order = usize::from(link.orders[e]);
    if order < 2 {
        return 0.3;
    }
    let rows = forest.basis_of(link.receiver).truncated(usize::from(link.orders[0]));
    let columns = forest.basis_of(link.shooter).truncated(usize::from(link.orders[1]));
    let basis = forest.basis_of(if end == End::Receiver { link.receiver } else { link.shooter });
    let (below, lowest) = (basis.truncated(order - 1), order.checked_sub(2).filter(|o| *o > 0));
    let least = lowest.map_or(&[][..], |o| basis.truncated(o));
    let block = &links.blocks()[link.block as usize..][..rows.len() * columns.len()];
    let (mut top, mut next) = (0.0f64, 0.0f64);
    for (i, row) in rows.iter().zip(block.chunks(columns.len())) {
        for (j, k) in columns.iter().zip(row) {
            let function = if end == End::Receiver { i } else { j };
            if !below.contains(function) {
                top += k * k;
            } else if !least.contains(function) {
                next += k * k;
            }
        }
    }
    if next > 0.0 { (top / next).sqrt().clamp(0.02, 1.0) } else { 1.0 }
}

impl Judgement {
    /// The links that `may` be changed with the largest gains, which together address `wanted`, at most `most` of them;
    /// ties to the lower index.
    pub fn largest(&self, wanted: f64, most: usize, may: impl Fn(u32) -> bool) -> Vec<u32> {
        let mut sum = 0.0;
        let mut chosen = Vec::new();
        for k in self.ranked(may).into_iter().take(most) {
            if sum >= wanted {
                break;
            }
            sum += f64::from(self.gains[k as usize]);
            chosen.push(k);
        }
        chosen.sort_unstable();
        chosen
    }

    /// The links that `may` be changed with at least half the largest gain, as if a threshold were halved from round to
    /// round: at least `least` and at most `most` of them; ties to the lower index.
    pub fn upper_half(&self, least: usize, most: usize, may: impl Fn(u32) -> bool) -> Vec<u32> {
        let mut chosen = self.ranked(may);
        let threshold = chosen.first().map_or(0.0, |&k| 0.5 * self.gains[k as usize]);
        let count = chosen.iter().take_while(|&&k| self.gains[k as usize] >= threshold).count();
        chosen.truncate(count.clamp(least.min(most), most));
        chosen.sort_unstable();
        chosen
    }

    fn ranked(&self, may: impl Fn(u32) -> bool) -> Vec<u32> {
        let worth = |&k: &u32| self.gains[k as usize] > 0.0 && may(k);
        let mut order: Vec<u32> = (0..self.gains.len() as u32).filter(worth).collect();
        order.sort_by(|&a, &b| self.gains[b as usize].total_cmp(&self.gains[a as usize]).then(a.cmp(&b)));
        order
    }
}
