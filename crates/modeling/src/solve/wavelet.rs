//! The preconditioner of the thesis: H taken as diagonal in a wavelet basis (7.3), coarsest level exactly.
//!
//! Bi-orthogonal cubic wavelets on mirrored and periodic axes, semi-orthogonal ones on open axes. The exact diagonal
//! is the best scaling; the heights of the thesis's experiments stay available for comparison.

use super::bpx::dense_factor;
use super::cholesky::{Cholesky, dot, start};
use super::green::{Green, Inverse};
use crate::axis::Axis;
use crate::constraint::Functional;
use crate::energy::{Energy, Operator};
use crate::system::Space;
use ondelette_wavelet::{
    Boundary, Decomposition, EnergyDiagonals, Family, Kind, Layout, OpenColumns, Part, Pyramid, Scaling, Sparse,
    SplineFamily, Tensor, energy_diagonals, levels_allowed,
};

/// P = W^-1 D^-1 W^-T.
pub(crate) struct WaveletGreen {
    tensor: Tensor,
    /// Inverse diagonal in the layout of the transform; 0 in the all-smooth corner.
    inverse: Vec<f64>,
    corner: Vec<usize>,
    coarse: Cholesky,
    space: Space,
    /// Heights that give every function unit energy (the corner: as its level has elsewhere).
    heights: Vec<f64>,
}

/// The spaces of the common pyramid of the axes, finest first, and a pyramid an axis: bi-orthogonal cubic wavelets, on
/// open axes semi-orthogonal ones. `None` where the axes have none, or its coarsest level is too large.
pub(crate) fn pyramids(space: &Space) -> Option<(Vec<Space>, Vec<Pyramid>)> {
    let family = Family::Spline(SplineFamily::CUBIC);
    let mut spaces = vec![space.clone()];
    let least = |a: &Axis| a.spans() > if a.boundary() == Boundary::Open { 8 } else { 4 };
    let mut now = space.clone();
    while let Some(coarser) = now.coarser().filter(|_| now.axes().iter().all(least)) {
        let deep = spaces.len() - 1;
        let fits = |a: &Axis| levels_allowed(family, a.boundary(), a.len()).is_ok_and(|most| deep < most);
        if !space.axes().iter().all(fits) {
            break;
        }
        spaces.push(coarser.clone());
        now = coarser;
    }
    let levels = spaces.len() - 1;
    if levels == 0 || now.len() > 2000 {
        return None;
    }
    let pyramid = |a: &Axis| match a.boundary() {
        Boundary::Open => Pyramid::open(a.len(), levels, OpenColumns::Unit).ok(),
        b => Pyramid::new(family, b, a.len(), levels).ok(),
    };
    let axes = space.axes().iter().map(pyramid).collect::<Option<_>>()?;
    Some((spaces, axes))
}

/// Energies of the functions of each axis, derivative by derivative (orders 0 to 3), in knot units of the finest level.
pub(crate) fn diagonals(axes: &[Pyramid], h: &Operator) -> Vec<Vec<EnergyDiagonals>> {
    axes.iter()
        .zip(&h.lines)
        .map(|(p, line)| {
            let of = |a: usize| {
                let rows = line.energy[a].to_rows().into_iter().enumerate();
                let entries = rows.flat_map(|(r, row)| row.into_iter().map(move |(c, v)| (r, c, v)));
                energy_diagonals(p, &Sparse::from_triplets(line.n, line.n, entries.collect()))
            };
            (0..4).map(of).collect()
        })
        .collect()
}

impl WaveletGreen {
    /// `scaling`: `None` takes the exact diagonal, else functions of these heights count as of unit energy.
    /// `None` where the axes have no common pyramid, or its coarsest level is too large.
    pub(crate) fn new(space: &Space, energy: &Energy, h: &Operator, scaling: Option<Scaling>) -> Option<WaveletGreen> {
        let (spaces, axes) = pyramids(space)?;
        let (levels, now) = (spaces.len() - 1, spaces.last()?.clone());
        let diagonals = diagonals(&axes, h);
        let tensor = Tensor::new(axes, Layout::NonStandard).ok()?;
        let of = |axis: usize, a: usize, part: Part, j: usize| match part {
            Part::Smooth(i) => diagonals[axis][a].smooth[i][j],
            Part::Detail(i) => diagonals[axis][a].detail[i][j],
        };
        let mut values = vec![0.0; tensor.len()];
        let width = space.shape()[1];
        let mut corner = Vec::new();
        let blocks = Decomposition::new(&tensor, values.clone()).blocks();
        for block in blocks {
            let smooth = block.is_smooth();
            let (last, rows) =
                (block.ranges.len() - 1, if block.ranges.len() == 2 { block.ranges[0].clone() } else { 0..1 });
            for (i, r) in rows.enumerate() {
                for (j, c) in block.ranges[last].clone().enumerate() {
                    let at = r * width + c;
                    if smooth {
                        corner.push(at);
                        continue;
                    }
                    values[at] = if let Some(s) = scaling {
                        let level = block.parts[last].level();
                        let height = s.sigma().powi((levels - level) as i32);
                        height.powi(2 * (last as i32 + 1))
                    } else {
                        let e: f64 = h
                            .terms
                            .iter()
                            .map(|&(p, q, c)| {
                                let s = if last == 1 { of(0, p, block.parts[0], i) } else { 1.0 };
                                c * s * of(last, q, block.parts[last], j)
                            })
                            .sum();
                        1.0 / e
                    };
                }
            }
        }
        let coarse = dense_factor(&Operator::new(&now, energy, None), energy)?;
        let mut heights: Vec<f64> = values.iter().map(|v| v.sqrt()).collect();
        let tallest = heights.iter().fold(0.0, |m: f64, v| m.max(*v));
        corner.iter().for_each(|i| heights[*i] = tallest);
        Some(WaveletGreen { tensor, inverse: values, corner, coarse, space: now, heights })
    }

    /// Coefficients of functions of unit energy to B-spline coefficients.
    pub(crate) fn synthesis(&self, w: &[f64]) -> Vec<f64> {
        let w: Vec<f64> = w.iter().zip(&self.heights).map(|(w, h)| w * h).collect();
        let mut out = vec![0.0; w.len()];
        if self.tensor.down_into(Kind::Coefficients, &w, &mut out).is_err() {
            out.fill(0.0);
        }
        out
    }

    /// The transpose of [`WaveletGreen::synthesis`].
    pub(crate) fn synthesis_transposed(&self, y: &[f64]) -> Vec<f64> {
        self.to_wavelets(y).into_iter().zip(&self.heights).map(|(w, h)| w * h).collect()
    }

    fn to_wavelets(&self, r: &[f64]) -> Vec<f64> {
        // Finite by contract; a failed transform would leave zeros, which end the iteration.
        self.tensor.up(Kind::Basis, r).map_or_else(|_| vec![0.0; r.len()], Decomposition::into_values)
    }
}

impl Green for WaveletGreen {
    fn apply(&mut self, r: &[f64], g: &mut [f64]) {
        let mut w = self.to_wavelets(r);
        let mut corner: Vec<f64> = self.corner.iter().map(|i| w[*i]).collect();
        self.coarse.forward(&mut corner);
        self.coarse.backward(&mut corner);
        w.iter_mut().zip(&self.inverse).for_each(|(w, d)| *w *= d);
        self.corner.iter().zip(&corner).for_each(|(i, v)| w[*i] = *v);
        if self.tensor.down_into(Kind::Coefficients, &w, g).is_err() {
            g.fill(0.0);
        }
    }

    fn between(&mut self, functionals: &[Functional]) -> Vec<f64> {
        let n = self.tensor.len();
        debug_assert_eq!(self.space.len(), self.corner.len());
        let mut sparse: Vec<Vec<(u32, f64)>> = Vec::with_capacity(functionals.len());
        let mut dense = Vec::with_capacity(functionals.len());
        let mut row = vec![0.0; n];
        for f in functionals {
            f.entries().for_each(|(i, v)| row[i] += v);
            let w = self.to_wavelets(&row);
            f.entries().for_each(|(i, _)| row[i] = 0.0);
            let mut corner: Vec<f64> = self.corner.iter().map(|i| w[*i]).collect();
            self.coarse.forward(&mut corner);
            dense.push(corner);
            let kept = w.iter().zip(&self.inverse).enumerate().filter(|(_, (w, d))| **w != 0.0 && **d != 0.0);
            sparse.push(kept.map(|(i, (w, d))| (i as u32, w * d.sqrt())).collect());
        }
        let mut place = vec![0.0; n];
        let mut out = Vec::with_capacity(start(functionals.len()));
        for i in 0..functionals.len() {
            sparse[i].iter().for_each(|&(at, v)| place[at as usize] = v);
            for j in 0..=i {
                let fine: f64 = sparse[j].iter().map(|&(at, v)| v * place[at as usize]).sum();
                out.push(fine + dot(&dense[i], &dense[j]));
            }
            sparse[i].iter().for_each(|&(at, _)| place[at as usize] = 0.0);
        }
        out
    }

    fn inverse(&self) -> Inverse {
        Inverse::Approximate
    }
}
