//! The standard decomposition (thesis 4.4.1): a full matrix transformed on both axes, S = W K W^T (Eq. 99), and what is
//! left of it once small terms are dropped. Beside it, how many terms the non-standard decomposition (4.4.2, Eq. 103)
//! of the same matrix would keep.
//!
//! Both bases of functions of two variables are orthonormal, so that the squares of dropped terms add up to the square
//! of the Hilbert-Schmidt norm of the change, and the same budget means the same guarantee: the change of K times B has
//! at most budget times the norm of B.

use crate::forest::{Forest, NodeId};
use crate::links::Links;
use crate::pyramid::Pyramid;
use ondelette_numerics::par;

/// How many terms a matrix has, and how many of them are kept in either decomposition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terms {
    /// Of the full matrix, zeros of pairs that do not see each other included.
    pub full: u64,
    /// Kept of the standard decomposition.
    pub standard: u64,
    /// Kept of the non-standard decomposition.
    pub nonstandard: u64,
}

/// A thresholded operator in the standard decomposition: a sparse matrix between wavelet coefficients.
#[derive(Clone, Debug)]
pub struct Standard {
    pyramid: Pyramid,
    starts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl Standard {
    /// Bytes that decomposing takes for each term of the matrix, beside the links: it is stored dense, and once more
    /// while it is turned over.
    pub fn bytes_of_term() -> u64 {
        16
    }

    /// Decomposes a full matrix (links between leaves) and drops the smallest terms, whose squares add up to at most
    /// `budget` squared. `None` for flatlets, which are not orthogonal.
    ///
    /// Cost: the square of the number of rows, in time (times the functions of a cell) and memory.
    pub fn of(forest: &Forest, links: &Links, budget: f64) -> Option<(Self, Terms)> {
        let pyramid = Pyramid::of(forest)?;
        let n = pyramid.len();
        let mut matrix = dense(forest, links, &pyramid);
        let nonstandard = nonstandard(forest, &pyramid, &matrix);
        // W on the columns of every row, then on the rows
        for _ in 0..2 {
            par::for_each_chunk(&mut matrix, n.max(1), |_, row| row.copy_from_slice(&pyramid.up(forest, row)));
            matrix = transposed(&matrix, n);
        }
        let sizes = par::map(n, |i| {
            let mut sizes = Sizes::default();
            matrix[i * n..(i + 1) * n].iter().for_each(|v| sizes.add(*v));
            sizes
        });
        let all = sizes.into_iter().fold(Sizes::default(), Sizes::merged);
        let threshold = all.threshold(budget);
        let mut standard = Standard { pyramid, starts: vec![0], columns: Vec::new(), values: Vec::new() };
        for row in matrix.chunks(n.max(1)) {
            for (j, v) in row.iter().enumerate().filter(|(_, v)| bin(**v).is_some_and(|bin| bin >= threshold)) {
                standard.columns.push(j as u32);
                standard.values.push(*v);
            }
            standard.starts.push(standard.values.len());
        }
        let terms = Terms {
            full: (n * n) as u64,
            standard: standard.values.len() as u64,
            nonstandard: nonstandard.kept(nonstandard.threshold(budget)),
        };
        Some((standard, terms))
    }

    /// The operator applied to values at the leaves, in the layout of [`Forest`]; inner nodes of `result` are zero.
    ///
    /// # Panics
    /// If the forest has changed.
    pub fn apply<const C: usize>(&self, forest: &Forest, values: &[[f64; C]], result: &mut [[f64; C]]) {
        let stride = forest.stride();
        result.fill([0.0; C]);
        for c in 0..C {
            let mut leaves = vec![0.0; self.pyramid.len()];
            each_leaf(forest, |id, n, root| {
                let at = self.pyramid.leaf(id);
                (0..n).for_each(|j| leaves[at + j] = root * values[id.index() * stride + j][c]);
            });
            let wavelets = self.pyramid.up(forest, &leaves);
            let product = par::map(self.pyramid.len(), |i| {
                let row = self.starts[i]..self.starts[i + 1];
                let terms = self.columns[row.clone()].iter().zip(&self.values[row]);
                terms.map(|(&j, v)| v * wavelets[j as usize]).sum::<f64>()
            });
            let leaves = self.pyramid.down(forest, &product);
            each_leaf(forest, |id, n, root| {
                let at = self.pyramid.leaf(id);
                (0..n).for_each(|j| result[id.index() * stride + j][c] = leaves[at + j] / root);
            });
        }
    }
}

/// Calls `f` with every leaf, its number of functions and the root of its measure.
fn each_leaf(forest: &Forest, mut f: impl FnMut(NodeId, usize, f64)) {
    for (k, node) in forest.nodes().iter().enumerate() {
        if node.first_child == 0 {
            f(NodeId(k as u32), forest.basis(node.cell.shape).len(), node.measure.sqrt());
        }
    }
}

/// The matrix between orthonormal functions of the leaves.
fn dense(forest: &Forest, links: &Links, pyramid: &Pyramid) -> Vec<f64> {
    let n = pyramid.len();
    let mut matrix = vec![0.0; n * n];
    for link in links.as_slice() {
        let rows = forest.basis_of(link.receiver).truncated(usize::from(link.orders[0]));
        let columns = forest.basis_of(link.shooter).truncated(usize::from(link.orders[1]));
        let scale = (forest.node(link.receiver).measure / forest.node(link.shooter).measure).sqrt();
        let (r, s) = (pyramid.leaf(link.receiver), pyramid.leaf(link.shooter));
        let block = &links.blocks()[link.block as usize..][..rows.len() * columns.len()];
        for (&i, row) in rows.iter().zip(block.chunks(columns.len())) {
            for (&j, v) in columns.iter().zip(row) {
                matrix[(r + usize::from(i)) * n + s + usize::from(j)] = scale * v;
            }
        }
    }
    matrix
}

fn transposed(matrix: &[f64], n: usize) -> Vec<f64> {
    let mut out = vec![0.0; n * n];
    par::for_each_chunk(&mut out, n.max(1), |i, row| {
        for (j, v) in row.iter_mut().enumerate() {
            *v = matrix[j * n + i];
        }
    });
    out
}

/// Sizes of the terms of the non-standard decomposition: for each pair of nodes of equal depth (or of which one is a
/// leaf) all products but that of scaling functions, which the pair above holds; at the roots that as well.
fn nonstandard(forest: &Forest, pyramid: &Pyramid, matrix: &[f64]) -> Sizes {
    let roots = forest.roots();
    let sizes = par::map(roots.len(), |r| {
        let mut sizes = Sizes::default();
        for &s in roots {
            if let Some(block) = ascend(forest, pyramid, matrix, [roots[r], s], &mut sizes) {
                block.iter().for_each(|v| sizes.add(*v));
            }
        }
        sizes
    });
    sizes.into_iter().fold(Sizes::default(), Sizes::merged)
}

/// The block between the scaling functions of a pair of nodes; `None` if it is zero. Counts all detail below.
fn ascend(
    forest: &Forest,
    pyramid: &Pyramid,
    matrix: &[f64],
    pair: [NodeId; 2],
    sizes: &mut Sizes,
) -> Option<Vec<f64>> {
    let [n, m] = pair.map(|id| forest.basis_of(id).len());
    let [p, q] = pair;
    if forest.is_leaf(p) && forest.is_leaf(q) {
        let (r, s, wide) = (pyramid.leaf(p), pyramid.leaf(q), pyramid.len());
        let block: Vec<f64> =
            (0..n).flat_map(|i| &matrix[(r + i) * wide + s..(r + i) * wide + s + m]).copied().collect();
        return block.iter().any(|v| *v != 0.0).then_some(block);
    }
    let below = |id: NodeId| -> Vec<NodeId> {
        if forest.is_leaf(id) {
            return vec![id];
        }
        (0..forest.node(id).cell.shape.arity()).map(|c| forest.child(id, c)).collect()
    };
    let (rows, columns) = (below(p), below(q));
    let wide = columns.len() * m;
    let mut block = vec![0.0; rows.len() * n * wide];
    let mut any = false;
    for (a, &row) in rows.iter().enumerate() {
        for (b, &column) in columns.iter().enumerate() {
            let Some(part) = ascend(forest, pyramid, matrix, [row, column], sizes) else { continue };
            any = true;
            for (i, values) in part.chunks(m).enumerate() {
                block[(a * n + i) * wide + b * m..][..m].copy_from_slice(values);
            }
        }
    }
    if !any {
        return None;
    }
    if columns.len() > 1 {
        let q = pyramid.block(forest.node(q).cell.shape);
        let turn = |row: &[f64]| -> Vec<f64> { q.chunks(wide).map(|w| dot(w, row)).collect() };
        block = block.chunks(wide).flat_map(turn).collect();
    }
    if rows.len() > 1 {
        let high = rows.len() * n;
        let turned = pyramid.block(forest.node(p).cell.shape).chunks(high).flat_map(|w| {
            let block = &block;
            (0..wide).map(move |j| w.iter().enumerate().map(|(i, w)| w * block[i * wide + j]).sum::<f64>())
        });
        block = turned.collect();
    }
    for (i, row) in block.chunks(wide).enumerate() {
        row.iter().enumerate().filter(|(j, _)| i >= n || *j >= m).for_each(|(_, v)| sizes.add(*v));
    }
    Some((0..n).flat_map(|i| &block[i * wide..i * wide + m]).copied().collect())
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Bins an octave of a size.
const BINS: f64 = 16.0;
/// Bins in all: sizes down to 2^-128.
const ALL_BINS: usize = 16 * 160;

/// The bin of a size, larger sizes in higher bins; `None` for what is as good as zero.
fn bin(value: f64) -> Option<usize> {
    let bin = (BINS * (value.abs().log2() + 128.0)).floor();
    (bin >= 0.0).then(|| (bin as usize).min(ALL_BINS - 1))
}

/// How many terms there are of each size.
struct Sizes {
    counts: Vec<u64>,
    squares: Vec<f64>,
}

impl Default for Sizes {
    fn default() -> Self {
        Sizes { counts: vec![0; ALL_BINS], squares: vec![0.0; ALL_BINS] }
    }
}

impl Sizes {
    fn add(&mut self, value: f64) {
        if let Some(bin) = bin(value) {
            self.counts[bin] += 1;
            self.squares[bin] += value * value;
        }
    }

    fn merged(mut self, other: Sizes) -> Sizes {
        for k in 0..ALL_BINS {
            self.counts[k] += other.counts[k];
            self.squares[k] += other.squares[k];
        }
        self
    }

    /// The lowest bin that must be kept.
    fn threshold(&self, budget: f64) -> usize {
        let mut dropped = 0.0;
        (0..ALL_BINS)
            .find(|&k| {
                dropped += self.squares[k];
                dropped > budget * budget
            })
            .unwrap_or(ALL_BINS)
    }

    fn kept(&self, threshold: usize) -> u64 {
        self.counts[threshold.min(ALL_BINS)..].iter().sum()
    }
}
