//! Where the error is: the oracle's view of all links at once.
//!
//! Each link knows, for a unit shooter, how far its block misses in each child of its receiver (signed), how it would
//! miss if the shooter were not as smooth as its order (unsigned), and what its mask samples may have overlooked
//! (unsigned). Multiplied with the shooter's mean and detail, pushed down to the leaves and added up there with their
//! signs, they estimate the error of the *sum* that the leaf receives: misses of links that cancel cost nothing.

use crate::couple::CHILDREN;
use crate::forest::{Forest, NodeId};
use crate::links::{Link, Links};
use ondelette_numerics::par;
use ondelette_wavelet::cell::CellShape;

/// What every node shoots: its mean, and the root mean square of its detail below the node's own basis.
#[derive(Clone, Debug)]
pub struct Magnitudes<const C: usize> {
    /// Mean of the function over the node.
    pub mean: Vec<[f64; C]>,
    /// [`Magnitudes::detail`] by node and order.
    details: Vec<[f64; C]>,
    orders: usize,
}

impl<const C: usize> Magnitudes<C> {
    /// Of pulled values (see [`crate::transport::pull`]). With `graded`, links have orders of their own, and what a
    /// lower order leaves out is detail too; else what links were coupled without does not matter.
    pub fn of(forest: &Forest, values: &[[f64; C]], graded: bool) -> Self {
        let stride = forest.stride();
        let orders = forest.basis(CellShape::Square).order();
        let mut mean = vec![[0.0; C]; forest.len()];
        let mut details = vec![[0.0; C]; forest.len() * orders];
        let mut square = vec![[0.0; C]; forest.len()];
        for n in (0..forest.len()).rev() {
            let id = NodeId(n as u32);
            let basis = forest.basis_of(id);
            let own = &values[n * stride..n * stride + basis.len()];
            mean[n] = basis.mean(own, [0.0; C], |a, b, k| std::array::from_fn(|c| a[c] + k * b[c]));
            let mut detail = [0.0; C];
            if forest.is_leaf(id) {
                let scale = if basis.is_nested() { 1.0 } else { 1.0 / basis.len() as f64 };
                square[n] = std::array::from_fn(|c| scale * own.iter().map(|v| v[c] * v[c]).sum::<f64>());
            } else {
                let norm: [f64; C] = std::array::from_fn(|c| basis.projected_square(own.iter().map(|v| v[c])));
                let arity = basis.shape().arity();
                for k in 0..arity {
                    let child = forest.child(id, k).index();
                    for c in 0..C {
                        square[n][c] += square[child][c] / arity as f64;
                    }
                }
                detail = std::array::from_fn(|c| (square[n][c] - norm[c]).max(0.0));
            }
            let own_details = &mut details[n * orders..(n + 1) * orders];
            own_details.fill(detail);
            if graded && basis.is_nested() {
                for (order, detail) in own_details.iter_mut().enumerate() {
                    let kept = basis.truncated(order + 1);
                    for (_, v) in own.iter().enumerate().filter(|(j, _)| !kept.contains(&(*j as u16))) {
                        (0..C).for_each(|c| detail[c] += v[c] * v[c]);
                    }
                }
            }
            own_details.iter_mut().for_each(|d| *d = d.map(f64::sqrt));
        }
        Magnitudes { mean, details, orders }
    }

    /// Root mean square of what the node's own coefficients of the first `order` orders leave out.
    ///
    /// # Panics
    /// If there is no such node or order.
    pub fn detail(&self, node: usize, order: u8) -> &[f64; C] {
        &self.details[node * self.orders + usize::from(order) - 1]
    }
}

/// The estimated error of the operator applied to given magnitudes.
#[derive(Clone, Debug)]
pub struct Estimate<const C: usize> {
    /// Integral over all receivers of the absolute error, channels summed.
    pub total: f64,
    /// Mean signed error of each node (of leaves; inner nodes 0): what the operator would carry on as a bias.
    pub bias: Vec<[f64; C]>,
    /// Of what the links of each node miss in absolute terms, the share that does not cancel with other links' misses.
    pub share: Vec<f64>,
}

#[derive(Clone, Copy)]
struct Misses<const C: usize> {
    signed: [[f64; C]; CHILDREN],
    square: [f64; C],
    absolute: [f64; CHILDREN],
}

impl<const C: usize> Estimate<C> {
    /// Estimates the error over the roots that `counts` says. Cost linear in links and nodes.
    pub fn of(forest: &Forest, links: &Links, magnitudes: &Magnitudes<C>, counts: impl Fn(u32) -> bool + Sync) -> Self {
        let rows = |id: NodeId, each: &mut dyn FnMut(&Link)| links.of(id).iter().for_each(each);
        Self::of_rows(forest, rows, magnitudes, counts)
    }

    /// The same where links are not all stored: `rows` hands the links of a receiver to a function, in order.
    pub fn of_rows(
        forest: &Forest,
        rows: impl Fn(NodeId, &mut dyn FnMut(&Link)) + Sync,
        magnitudes: &Magnitudes<C>,
        counts: impl Fn(u32) -> bool + Sync,
    ) -> Self {
        let zero = Misses { signed: [[0.0; C]; CHILDREN], square: [0.0; C], absolute: [0.0; CHILDREN] };
        // what each node's own links miss
        let mut misses: Vec<Misses<C>> = par::map(forest.len(), |n| {
            let mut m = zero;
            rows(NodeId(n as u32), &mut |link| {
                let s = link.shooter.index();
                let mut unsigned = 0.0;
                let detail = magnitudes.detail(s, link.orders[1]);
                for c in 0..C {
                    let mean = magnitudes.mean[s][c];
                    let u = f64::from(link.roughness) * detail[c];
                    let v = f64::from(link.unseen) * mean;
                    let w = f64::from(link.spread) * detail[c];
                    m.square[c] += u * u + v * v + w * w;
                    unsigned += u + v.abs() + w;
                    for q in 0..CHILDREN {
                        let r = f64::from(link.residual[q]) * mean;
                        m.signed[q][c] += r;
                        m.absolute[q] += r.abs();
                    }
                }
                m.absolute.iter_mut().for_each(|a| *a += unsigned);
            });
            m
        });
        // pushed down: a child inherits what its parent misses there
        for n in 0..forest.len() {
            let id = NodeId(n as u32);
            if forest.is_leaf(id) {
                continue;
            }
            let from = misses[n];
            for k in 0..forest.node(id).cell.shape.arity() {
                let to = &mut misses[forest.child(id, k).index()];
                for q in 0..CHILDREN {
                    for c in 0..C {
                        to.signed[q][c] += from.signed[k][c];
                    }
                    to.absolute[q] += from.absolute[k];
                }
                for c in 0..C {
                    to.square[c] += from.square[c];
                }
            }
        }
        // summed at the leaves, and up again
        let mut error = vec![0.0; forest.len()];
        let mut absolute = vec![0.0; forest.len()];
        let mut total = 0.0;
        let mut bias = vec![[0.0; C]; forest.len()];
        for n in (0..forest.len()).rev() {
            let node = &forest.nodes()[n];
            let arity = node.cell.shape.arity();
            if !counts(node.cell.root) {
                continue;
            }
            if node.first_child == 0 {
                let m = &misses[n];
                let weight = node.measure / arity as f64;
                for q in 0..arity {
                    for c in 0..C {
                        error[n] += weight * (m.signed[q][c] * m.signed[q][c] + m.square[c]).sqrt();
                        bias[n][c] += m.signed[q][c] / arity as f64;
                    }
                    absolute[n] += weight * m.absolute[q];
                }
                total += error[n];
            } else {
                for k in 0..arity {
                    error[n] += error[node.first_child as usize + k];
                    absolute[n] += absolute[node.first_child as usize + k];
                }
            }
        }
        let share = (0..forest.len()).map(|n| if absolute[n] > 0.0 { (error[n] / absolute[n]).min(1.0) } else { 0.0 });
        Estimate { total, bias, share: share.collect() }
    }
}
