//! Where the error is: the oracle's view of all links at once.
//!
//! Each link knows, for a unit shooter, how far its block misses in each child of its receiver (signed), how it would
//! miss if the shooter were not as smooth as its order (unsigned), and what its mask samples may have overlooked
//! (unsigned). Multiplied with the shooter's mean and detail, pushed down to the leaves and added up there with their
//! signs, they estimate the error of the *sum* that the leaf receives: misses of links that cancel cost nothing.

use crate::couple::CHILDREN;
use crate::forest::{Forest, NodeId};
use crate::links::Links;
use crate::refine::End;
use ondelette_numerics::par;

/// What every node shoots: its mean, and the root mean square of its detail below the node's own basis.
#[derive(Clone, Debug)]
pub struct Magnitudes<const C: usize> {
    /// Mean of the function over the node.
    pub mean: Vec<[f64; C]>,
    /// Root mean square of what the node's own coefficients leave out.
    pub detail: Vec<[f64; C]>,
}

impl<const C: usize> Magnitudes<C> {
    /// Of pulled values (see [`crate::transport::pull`]).
    pub fn of(forest: &Forest, values: &[[f64; C]]) -> Self {
        let stride = forest.stride();
        let mut mean = vec![[0.0; C]; forest.len()];
        let mut detail = vec![[0.0; C]; forest.len()];
        let mut square = vec![[0.0; C]; forest.len()];
        for n in (0..forest.len()).rev() {
            let id = NodeId(n as u32);
            let basis = forest.basis_of(id);
            let own = &values[n * stride..n * stride + basis.len()];
            mean[n] = basis.mean(own, [0.0; C], |a, b, k| std::array::from_fn(|c| a[c] + k * b[c]));
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
                for c in 0..C {
                    detail[n][c] = (square[n][c] - norm[c]).max(0.0).sqrt();
                }
            }
        }
        Magnitudes { mean, detail }
    }
}

/// The estimated error of the operator applied to given magnitudes.
#[derive(Clone, Debug)]
pub struct Estimate<const C: usize> {
    /// Integral over all receivers of the absolute error, channels summed.
    pub total: f64,
    /// Mean signed error of each node (of leaves; inner nodes 0): what the operator would carry on as a bias.
    pub bias: Vec<[f64; C]>,
    /// Share of [`Estimate::total`] that refining each link addresses, by link index.
    pub gains: Vec<f32>,
    /// Which end of each link to split.
    pub ends: Vec<End>,
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
        let zero = Misses { signed: [[0.0; C]; CHILDREN], square: [0.0; C], absolute: [0.0; CHILDREN] };
        // what each node's own links miss
        let mut misses: Vec<Misses<C>> = par::map(forest.len(), |n| {
            let mut m = zero;
            for link in links.of(NodeId(n as u32)) {
                let s = link.shooter.index();
                let mut unsigned = 0.0;
                for c in 0..C {
                    let mean = magnitudes.mean[s][c];
                    let u = f64::from(link.roughness) * magnitudes.detail[s][c];
                    let v = f64::from(link.unseen) * mean;
                    let w = f64::from(link.spread) * magnitudes.detail[s][c];
                    m.square[c] += u * u + v * v + w * w;
                    unsigned += u + v.abs() + w;
                    for q in 0..CHILDREN {
                        let r = f64::from(link.residual[q]) * mean;
                        m.signed[q][c] += r;
                        m.absolute[q] += r.abs();
                    }
                }
                m.absolute.iter_mut().for_each(|a| *a += unsigned);
            }
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
        let judged = par::map(links.len(), |k| {
            let link = &links.as_slice()[k];
            let (r, s) = (link.receiver.index(), link.shooter.index());
            let node = &forest.nodes()[r];
            let arity = node.cell.shape.arity();
            let (mut receiver, mut shooter, mut unseen) = (0.0, 0.0, 0.0);
            for c in 0..C {
                let mean = magnitudes.mean[s][c].abs();
                receiver +=
                    link.residual[..arity].iter().map(|d| f64::from(d.abs())).sum::<f64>() / arity as f64 * mean;
                shooter += f64::from(link.roughness + link.spread) * magnitudes.detail[s][c];
                unseen += f64::from(link.unseen) * mean;
            }
            let share = if absolute[r] > 0.0 { (error[r] / absolute[r]).min(1.0) } else { 0.0 };
            let gain = node.measure * (receiver + shooter + unseen) * share;
            let end = if unseen > receiver && unseen > shooter {
                if node.measure >= forest.nodes()[s].measure { End::Receiver } else { End::Shooter }
            } else if shooter > receiver && forest.nodes()[s].first_child != 0 {
                End::Shooter
            } else {
                End::Receiver
            };
            (gain as f32, end)
        });
        let (gains, ends) = judged.into_iter().unzip();
        Estimate { total, bias, gains, ends }
    }

    /// The links that `may` be split with the largest gains, which together address `wanted`, at most `most` of them;
    /// ties to the lower index.
    pub fn largest(&self, wanted: f64, most: usize, may: impl Fn(u32) -> bool) -> Vec<u32> {
        let worth = |&k: &u32| self.gains[k as usize] > 0.0 && may(k);
        let mut order: Vec<u32> = (0..self.gains.len() as u32).filter(worth).collect();
        order.sort_by(|&a, &b| self.gains[b as usize].total_cmp(&self.gains[a as usize]).then(a.cmp(&b)));
        let mut sum = 0.0;
        let mut chosen = Vec::new();
        for k in order.into_iter().take(most) {
            if sum >= wanted {
                break;
            }
            sum += f64::from(self.gains[k as usize]);
            chosen.push(k);
        }
        chosen.sort_unstable();
        chosen
    }
}
