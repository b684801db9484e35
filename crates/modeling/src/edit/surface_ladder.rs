//! A surface on all its levels: the non-standard tensor pyramid, a level at a time.

use super::axis_ladder::{AxisLadder, levels_of};
use super::ladder::{EditError, Ladder};
use super::orientation::Turn;
use crate::axis::Axis;
use crate::shape::Surface;
use ondelette_wavelet::{Kind, Rung};

/// A surface in all its hybrid bases. Directions of different length have their finest levels in common; the shorter
/// one stays at its coarsest while the other goes on.
#[derive(Clone, Debug)]
pub struct SurfaceLadder {
    axes: [AxisLadder; 2],
    dim: usize,
    /// Smooth control nets by level.
    smooth: Vec<Vec<[f64; 3]>>,
    /// By level: the whole split net of the level above it, its smooth corner without meaning.
    detail: Vec<Vec<[f64; 3]>>,
}

impl SurfaceLadder {
    /// All levels of a surface, all valid. Linear time.
    ///
    /// # Errors
    /// An axis without levels.
    pub fn new(surface: &Surface) -> Result<SurfaceLadder, EditError> {
        let [s, t] = *surface.axes();
        let levels = levels_of(&s)?.max(levels_of(&t)?);
        let axes = [AxisLadder::new(s, levels)?, AxisLadder::new(t, levels)?];
        let count = |level: usize| axes[0].len(level) * axes[1].len(level);
        let mut out = SurfaceLadder {
            smooth: (0..=levels).map(|i| vec![[0.0; 3]; count(i)]).collect(),
            detail: (0..levels).map(|i| vec![[0.0; 3]; count(i + 1)]).collect(),
            dim: surface.dim(),
            axes,
        };
        out.replace(surface.points());
        out.coarser(levels, 0);
        Ok(out)
    }
}

/// Towards coarser along rows of a net of `width` columns, in place: smooth, then detail.
fn rows_up(rung: &Rung, net: &mut [[f64; 3]], width: usize) {
    for row in net.chunks_mut(width) {
        let fine = row.to_vec();
        let (smooth, detail) = row.split_at_mut(rung.smooth());
        rung.up(Kind::Coefficients, &fine, smooth, detail);
    }
}

fn rows_down(rung: &Rung, net: &mut [[f64; 3]], width: usize) {
    let mut fine = vec![[0.0; 3]; width];
    for row in net.chunks_mut(width) {
        let (smooth, detail) = row.split_at(rung.smooth());
        rung.down(Kind::Coefficients, smooth, detail, &mut fine);
        row.copy_from_slice(&fine);
    }
}

/// The net with rows and columns exchanged; `width` columns before.
fn transposed(net: &[[f64; 3]], width: usize) -> Vec<[f64; 3]> {
    let height = net.len() / width;
    let mut out = vec![[0.0; 3]; net.len()];
    // blocks keep both sides in the cache
    const BLOCK: usize = 32;
    for i0 in (0..height).step_by(BLOCK) {
        for j0 in (0..width).step_by(BLOCK) {
            for i in i0..height.min(i0 + BLOCK) {
                for j in j0..width.min(j0 + BLOCK) {
                    out[j * height + i] = net[i * width + j];
                }
            }
        }
    }
    out
}

impl Ladder for SurfaceLadder {
    type Shape = Surface;

    fn axes(&self) -> Vec<Axis> {
        self.axes.iter().map(|a| a.axis).collect()
    }

    fn levels(&self) -> usize {
        self.detail.len()
    }

    fn shape(&self, level: usize) -> [usize; 2] {
        [self.axes[0].len(level), self.axes[1].len(level)]
    }

    fn sites(&self, level: usize) -> [Vec<f64>; 2] {
        [self.axes[0].sites(level), self.axes[1].sites(level)]
    }

    fn smooth(&self, level: usize) -> &[[f64; 3]] {
        &self.smooth[level]
    }

    fn smooth_mut(&mut self, level: usize) -> &mut [[f64; 3]] {
        &mut self.smooth[level]
    }

    fn coarser(&mut self, from: usize, to: usize) {
        for level in (to..from).rev() {
            let [height, width] = self.shape(level + 1);
            let mut net = self.smooth[level + 1].clone();
            if let Some(rung) = self.axes[1].rung(level) {
                rows_up(rung, &mut net, width);
            }
            if let Some(rung) = self.axes[0].rung(level) {
                net = transposed(&net, width);
                rows_up(rung, &mut net, height);
                net = transposed(&net, height);
            }
            let columns = self.shape(level)[1];
            for (row, from) in self.smooth[level].chunks_mut(columns).zip(net.chunks(width)) {
                row.copy_from_slice(&from[..columns]);
            }
            self.detail[level] = net;
        }
    }

    fn finer(&mut self, from: usize, to: usize) {
        for level in from..to {
            let [height, width] = self.shape(level + 1);
            let mut net = self.detail[level].clone();
            let columns = self.shape(level)[1];
            for (row, to) in self.smooth[level].chunks(columns).zip(net.chunks_mut(width)) {
                to[..columns].copy_from_slice(row);
            }
            if let Some(rung) = self.axes[0].rung(level) {
                net = transposed(&net, width);
                rows_down(rung, &mut net, height);
                net = transposed(&net, height);
            }
            if let Some(rung) = self.axes[1].rung(level) {
                rows_down(rung, &mut net, width);
            }
            self.smooth[level + 1] = net;
        }
    }

    fn prolong(&self, from: usize, to: usize, points: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let (height, width) = (self.shape(from)[0], self.shape(to)[1]);
        let half: Vec<_> =
            points.chunks(self.shape(from)[1]).flat_map(|row| self.axes[1].prolong(from, to, row.to_vec())).collect();
        let columns = transposed(&half, width);
        let tall: Vec<_> =
            columns.chunks(height).flat_map(|column| self.axes[0].prolong(from, to, column.to_vec())).collect();
        transposed(&tall, self.shape(to)[0])
    }

    fn parents(&self, level: usize, index: [usize; 2]) -> [Vec<(usize, f64)>; 2] {
        [self.axes[0].parents(level, index[0]), self.axes[1].parents(level, index[1])]
    }

    fn row(&self, level: usize, at: [f64; 2], orders: [usize; 2]) -> [Vec<(usize, f64)>; 2] {
        [self.axes[0].row(level, at[0], orders[0]), self.axes[1].row(level, at[1], orders[1])]
    }

    fn build(&self, finest: Vec<[f64; 3]>) -> Result<Surface, EditError> {
        Ok(Surface::new([self.axes[0].axis, self.axes[1].axis], self.dim, finest)?)
    }

    fn turns(&self, level: usize, old: &[[f64; 3]], new: &[[f64; 3]]) -> Vec<Turn> {
        let [ss, ts] = self.sites(level);
        let none = || vec![Turn::NONE; ss.len() * ts.len()];
        let [Ok(old), Ok(new)] = [old, new].map(|p| self.build(p.to_vec())) else { return none() };
        if self.dim < 3 {
            return none();
        }
        let tangents = |x: &Surface, at: [f64; 2]| [x.derivative(at, [1, 0]), x.derivative(at, [0, 1])];
        let mut out = Vec::with_capacity(ss.len() * ts.len());
        for &s in &ss {
            out.extend(ts.iter().map(|&t| Turn::of_surfaces(tangents(&old, [s, t]), tangents(&new, [s, t]))));
        }
        out
    }

    fn finer_in_frames(&mut self, _: usize, _: &[Vec<[f64; 3]>]) -> Result<(), EditError> {
        Err(EditError::FrenetSurface)
    }
}
