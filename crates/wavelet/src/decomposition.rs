//! A decomposition that knows its layout: blocks by level and type, thresholds, the largest, norms.

use std::ops::Range;

use crate::coefficient::{Coefficient, Scalar};
use crate::gram;
use crate::pyramid::Pyramid;
use crate::scaling::energy_diagonals;
use crate::tensor::{Layout, Tensor, for_rows};

/// What a block holds along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Part {
    /// Smooth functions of a level.
    Smooth(usize),
    /// Detail functions (wavelets) of a level.
    Detail(usize),
}

impl Part {
    /// Its level.
    pub fn level(self) -> usize {
        match self {
            Part::Smooth(i) | Part::Detail(i) => i,
        }
    }

    /// True for wavelets.
    pub fn is_detail(self) -> bool {
        matches!(self, Part::Detail(_))
    }

    pub(crate) fn height(self, pyramid: &Pyramid) -> f64 {
        match self {
            Part::Smooth(i) => pyramid.heights().smooth(i),
            Part::Detail(i) => pyramid.heights().detail(i),
        }
    }

    fn range(self, pyramid: &Pyramid) -> Range<usize> {
        match self {
            Part::Smooth(i) => 0..pyramid.smooth_len(i),
            Part::Detail(i) => pyramid.detail_range(i),
        }
    }
}

/// A box of coefficients of one level and type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Block {
    /// What it holds along each axis.
    pub parts: Vec<Part>,
    /// Where it lies along each axis.
    pub ranges: Vec<Range<usize>>,
}

impl Block {
    /// True for the block without any wavelet.
    pub fn is_smooth(&self) -> bool {
        !self.parts.iter().any(|p| p.is_detail())
    }

    /// Number of coefficients.
    pub fn len(&self) -> usize {
        self.ranges.iter().map(ExactSizeIterator::len).product()
    }

    /// True without coefficients.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Wavelet coefficients of a grid with their layout, made by [`Tensor::up`].
#[derive(Clone, Debug)]
pub struct Decomposition<C> {
    tensor: Tensor,
    values: Vec<C>,
}

/// Norms of coefficients, all channels together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Norms {
    /// Sum of magnitudes.
    pub l1: f64,
    /// Root of the sum of squares.
    pub l2: f64,
    /// Largest magnitude.
    pub max: f64,
}

/// The blocks of a transform, coarse to fine; the all-smooth one first.
pub(crate) fn blocks_of(tensor: &Tensor) -> Vec<Block> {
    let axes = tensor.axes();
    let mut all: Vec<Vec<Part>> = Vec::new();
    let product = |choices: &[Vec<Part>]| {
        choices.iter().fold(vec![Vec::new()], |all: Vec<Vec<Part>>, axis| {
            all.iter().flat_map(|head| axis.iter().map(|p| [&head[..], &[*p]].concat())).collect()
        })
    };
    match tensor.layout() {
        Layout::Standard => {
            let choices = axes
                .iter()
                .map(|a| std::iter::once(Part::Smooth(0)).chain((0..a.levels()).map(Part::Detail)).collect::<Vec<_>>());
            all = product(&choices.collect::<Vec<_>>());
        }
        Layout::NonStandard => {
            all.push(vec![Part::Smooth(0); axes.len()]);
            for i in 0..axes[0].levels() {
                let both = vec![vec![Part::Smooth(i), Part::Detail(i)]; axes.len()];
                all.extend(product(&both).into_iter().skip(1));
            }
        }
    }
    all.into_iter()
        .map(|parts| Block { ranges: parts.iter().zip(axes).map(|(p, a)| p.range(a)).collect(), parts })
        .collect()
}

impl<C: Coefficient> Decomposition<C> {
    pub(crate) fn from_parts(tensor: &Tensor, values: Vec<C>) -> Decomposition<C> {
        Decomposition { tensor: tensor.clone(), values }
    }

    /// Takes values in the layout of a transform, as [`Decomposition::values`] gives them.
    ///
    /// # Panics
    /// If the number of values does not fit.
    #[track_caller]
    pub fn new(tensor: &Tensor, values: Vec<C>) -> Decomposition<C> {
        assert_eq!(values.len(), tensor.len(), "values for another transform");
        Decomposition { tensor: tensor.clone(), values }
    }

    /// The transform this belongs to.
    pub fn tensor(&self) -> &Tensor {
        &self.tensor
    }

    /// All coefficients, row-major in the shape of the grid. Standard: each axis in flat order `b | w_0 | w_1 | ...`.
    /// Non-standard: in place, the leading corner all-smooth, the trailing part of an axis its detail.
    pub fn values(&self) -> &[C] {
        &self.values
    }

    /// All coefficients, to be changed in place.
    pub fn values_mut(&mut self) -> &mut [C] {
        &mut self.values
    }

    /// The coefficients alone.
    pub fn into_values(self) -> Vec<C> {
        self.values
    }

    /// The blocks, coarse to fine; the all-smooth one first.
    pub fn blocks(&self) -> Vec<Block> {
        blocks_of(&self.tensor)
    }

    /// The coefficients of a block, row-major.
    pub fn block(&self, block: &Block) -> Vec<C> {
        let mut out = Vec::with_capacity(block.len());
        for_rows(&self.tensor.shape(), &block.ranges, |row| out.extend_from_slice(&self.values[row]));
        out
    }

    /// Sets every detail coefficient below `t` in magnitude to zero; the number of details kept. Magnitudes are those
    /// of the stored numbers (all channels of a coefficient together), in whatever scaling they have.
    pub fn threshold(&mut self, t: f64) -> usize {
        let shape = self.tensor.shape();
        let mut kept = 0;
        for block in self.blocks().iter().filter(|b| !b.is_smooth()) {
            for_rows(&shape, &block.ranges, |row| {
                for value in &mut self.values[row] {
                    if magnitude(value) >= t { kept += 1 } else { *value = C::default() }
                }
            });
        }
        kept
    }

    /// Keeps the `m` detail coefficients with the largest magnitude times L2 norm of their function, sets the other
    /// details to zero; smooth coefficients stay and are not counted. Ties go to the lower index.
    pub fn keep_largest(&mut self, m: usize) {
        let shape = self.tensor.shape();
        let norms: Vec<FunctionNorms> = self.tensor.axes().iter().map(FunctionNorms::new).collect();
        let mut ranked: Vec<(f64, usize)> = Vec::new();
        for block in self.blocks().iter().filter(|b| !b.is_smooth()) {
            let axes: Vec<&[f64]> = block.parts.iter().zip(&norms).map(|(p, n)| n.of(*p)).collect();
            let lens: Vec<usize> = axes.iter().map(|a| a.len()).collect();
            let local: Vec<Range<usize>> = lens.iter().map(|&n| 0..n).collect();
            let mut outer = Vec::new();
            for_rows(&lens, &local, |row| {
                // Rows start at the first entry of the last axis; the other indices give the weight of the row.
                let mut at = row.start / lens[lens.len() - 1];
                let mut weight = 1.0;
                for (a, &n) in axes.iter().zip(&lens).rev().skip(1) {
                    weight *= a[at % n];
                    at /= n;
                }
                outer.push(weight);
            });
            let mut outer = outer.into_iter();
            for_rows(&shape, &block.ranges, |row| {
                let weight = outer.next().unwrap_or(1.0);
                let last = axes[axes.len() - 1];
                ranked.extend(row.zip(last).map(|(i, w)| (magnitude(&self.values[i]) * weight * w, i)));
            });
        }
        if m < ranked.len() {
            ranked.select_nth_unstable_by(m, |a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            ranked[m..].iter().for_each(|&(_, i)| self.values[i] = C::default());
        }
    }

    /// Norms of all coefficients.
    pub fn norms(&self) -> Norms {
        norms_of(C::flat(&self.values))
    }

    /// Norms of the coefficients of a block.
    pub fn block_norms(&self, block: &Block) -> Norms {
        norms_of(C::flat(&self.block(block)))
    }
}

fn norms_of<S: Scalar>(x: &[S]) -> Norms {
    let mut out = Norms { l1: 0.0, l2: 0.0, max: 0.0 };
    for v in x {
        let v = v.to_f64().abs();
        out.l1 += v;
        out.l2 += v * v;
        out.max = out.max.max(v);
    }
    out.l2 = out.l2.sqrt();
    out
}

fn magnitude<C: Coefficient>(value: &C) -> f64 {
    let flat = C::flat(std::slice::from_ref(value));
    match flat {
        [x] => x.to_f64().abs(),
        _ => flat.iter().map(|x| x.to_f64() * x.to_f64()).sum::<f64>().sqrt(),
    }
}

/// L2 norms of the functions of a pyramid on one axis, with their heights, up to one factor for the whole axis.
#[derive(Clone, Debug)]
pub struct FunctionNorms {
    smooth: Vec<Vec<f64>>,
    detail: Vec<Vec<f64>>,
}

impl FunctionNorms {
    /// The norms of all functions of a pyramid, by its Gram matrix; in units of the finest span.
    pub fn new(pyramid: &Pyramid) -> FunctionNorms {
        let d = energy_diagonals(pyramid, &gram::mass(pyramid));
        let root = |rows: Vec<Vec<f64>>, height: &dyn Fn(usize) -> f64| {
            let scale = |(i, row): (usize, Vec<f64>)| row.iter().map(|e| e.max(0.0).sqrt() * height(i)).collect();
            rows.into_iter().enumerate().map(scale).collect()
        };
        let h = pyramid.heights();
        FunctionNorms { smooth: root(d.smooth, &|i| h.smooth(i)), detail: root(d.detail, &|i| h.detail(i)) }
    }

    /// Norms of the functions of a part.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn of(&self, part: Part) -> &[f64] {
        match part {
            Part::Smooth(i) => &self.smooth[i],
            Part::Detail(i) => &self.detail[i],
        }
    }
}
