//! Functions on a forest in its wavelet basis: the scaling functions of the roots and the wavelets of all inner nodes.

use crate::forest::{Forest, NodeId};
use ondelette_wavelet::cell::CellShape;

/// The orthonormal wavelet transform of a forest: leaf coefficients to wavelet coefficients and back.
///
/// Both are vectors of [`Pyramid::len`] numbers, in units in which squares add up to the integral of the square (a
/// coefficient times the root of its cell's measure).
#[derive(Clone, Debug)]
pub struct Pyramid {
    len: usize,
    /// Where the coefficients of a leaf begin.
    leaf_at: Vec<usize>,
    /// Where the wavelets of an inner node begin; for a root its scaling functions follow.
    detail_at: Vec<usize>,
    root_at: Vec<usize>,
    /// Scaling functions, then wavelets, of the cells of each shape in use; see
    /// [`CellBasis::detail`](ondelette_wavelet::cell::CellBasis::detail).
    blocks: [Vec<f64>; 3],
}

impl Pyramid {
    /// Of a forest as it is; `None` for flatlets, which are not orthogonal.
    pub fn of(forest: &Forest) -> Option<Self> {
        let mut blocks: [Vec<f64>; 3] = Default::default();
        for shape in [CellShape::Interval, CellShape::Square, CellShape::Triangle] {
            let basis = forest.basis(shape);
            let (n, arity) = (basis.len(), shape.arity());
            let scale = 1.0 / (arity as f64).sqrt();
            let block = &mut blocks[place(shape)];
            block.extend((0..n).flat_map(|i| {
                (0..arity * n).map(move |k| (i, k)).map(|(i, k)| scale * basis.two_scale(k / n)[i * n + k % n])
            }));
            block.extend(basis.detail()?);
        }
        let (mut leaf_at, mut detail_at) = (vec![0; forest.len()], vec![0; forest.len()]);
        let (mut leaves, mut wavelets) = (0, 0);
        for (k, node) in forest.nodes().iter().enumerate() {
            let n = forest.basis(node.cell.shape).len();
            if node.first_child == 0 {
                leaf_at[k] = leaves;
                leaves += n;
            } else {
                detail_at[k] = wavelets;
                wavelets += (node.cell.shape.arity() - 1) * n;
            }
        }
        let root_at = forest.roots().iter().map(|&id| {
            wavelets += forest.basis_of(id).len();
            wavelets - forest.basis_of(id).len()
        });
        let root_at = root_at.collect();
        debug_assert_eq!(leaves, wavelets);
        Some(Pyramid { len: leaves, leaf_at, detail_at, root_at, blocks })
    }

    /// Number of coefficients: leaves times functions.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is no leaf.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Where the coefficients of a leaf begin.
    pub fn leaf(&self, id: NodeId) -> usize {
        self.leaf_at[id.index()]
    }

    /// The orthogonal matrix of a cell: scaling functions, then wavelets, in the functions of its children.
    pub fn block(&self, shape: CellShape) -> &[f64] {
        &self.blocks[place(shape)]
    }

    /// Leaf coefficients to wavelet coefficients (`coef_pyrm_up`). Cost linear in nodes.
    ///
    /// # Panics
    /// If `leaves` has not [`Pyramid::len`] entries, or the forest has changed.
    pub fn up(&self, forest: &Forest, leaves: &[f64]) -> Vec<f64> {
        assert_eq!(leaves.len(), self.len);
        let stride = forest.stride();
        let mut smooth = vec![0.0; forest.len() * stride];
        let mut out = vec![0.0; self.len];
        for k in (0..forest.len()).rev() {
            let id = NodeId(k as u32);
            let n = forest.basis_of(id).len();
            if forest.is_leaf(id) {
                smooth[k * stride..k * stride + n].copy_from_slice(&leaves[self.leaf_at[k]..self.leaf_at[k] + n]);
                continue;
            }
            let shape = forest.node(id).cell.shape;
            let wide = shape.arity() * n;
            for (i, row) in self.block(shape).chunks(wide).enumerate() {
                let sum = row.chunks(n).enumerate().map(|(c, row)| {
                    let child = forest.child(id, c).index() * stride;
                    row.iter().zip(&smooth[child..child + n]).map(|(a, b)| a * b).sum::<f64>()
                });
                let sum = sum.sum();
                if i < n {
                    smooth[k * stride + i] = sum;
                } else {
                    out[self.detail_at[k] + i - n] = sum;
                }
            }
        }
        for (id, at) in forest.roots().iter().zip(&self.root_at) {
            let n = forest.basis_of(*id).len();
            out[*at..at + n].copy_from_slice(&smooth[id.index() * stride..id.index() * stride + n]);
        }
        out
    }

    /// Wavelet coefficients to leaf coefficients (`coef_pyrm_down`): the inverse and the transpose of [`Pyramid::up`].
    ///
    /// # Panics
    /// As [`Pyramid::up`].
    pub fn down(&self, forest: &Forest, wavelets: &[f64]) -> Vec<f64> {
        assert_eq!(wavelets.len(), self.len);
        let stride = forest.stride();
        let mut smooth = vec![0.0; forest.len() * stride];
        let mut out = vec![0.0; self.len];
        for (id, at) in forest.roots().iter().zip(&self.root_at) {
            let n = forest.basis_of(*id).len();
            smooth[id.index() * stride..id.index() * stride + n].copy_from_slice(&wavelets[*at..at + n]);
        }
        for k in 0..forest.len() {
            let id = NodeId(k as u32);
            let n = forest.basis_of(id).len();
            if forest.is_leaf(id) {
                out[self.leaf_at[k]..self.leaf_at[k] + n].copy_from_slice(&smooth[k * stride..k * stride + n]);
                continue;
            }
            let shape = forest.node(id).cell.shape;
            let wide = shape.arity() * n;
            for (i, row) in self.block(shape).chunks(wide).enumerate() {
                let value = if i < n { smooth[k * stride + i] } else { wavelets[self.detail_at[k] + i - n] };
                for (c, row) in row.chunks(n).enumerate() {
                    let child = forest.child(id, c).index() * stride;
                    for (s, a) in smooth[child..child + n].iter_mut().zip(row) {
                        *s += a * value;
                    }
                }
            }
        }
        out
    }
}

fn place(shape: CellShape) -> usize {
    match shape {
        CellShape::Interval => 0,
        CellShape::Square => 1,
        CellShape::Triangle => 2,
    }
}
