//! One direction of a ladder: which pyramid step belongs to which level of the shape.

use crate::axis::Axis;
use crate::basis;
use crate::edit::EditError;
use ondelette_wavelet::{Boundary, Family, Kind, OpenKnots, Pyramid, Rung, SplineFamily, levels_allowed};

/// An axis and its pyramid. The finest levels of both directions of a surface coincide; a direction that has fewer
/// levels stays at its coarsest.
#[derive(Clone, Debug)]
pub(super) struct AxisLadder {
    pub(super) axis: Axis,
    pyramid: Pyramid,
    /// Level of the shape on which this direction reaches its coarsest.
    offset: usize,
}

/// Levels that an axis allows.
pub(super) fn levels_of(axis: &Axis) -> Result<usize, EditError> {
    levels_allowed(Family::Spline(SplineFamily::CUBIC), axis.boundary(), axis.len()).map_err(EditError::Pyramid)
}

impl AxisLadder {
    pub(super) fn new(axis: Axis, levels: usize) -> Result<AxisLadder, EditError> {
        let own = levels_of(&axis)?;
        let family = Family::Spline(SplineFamily::CUBIC);
        let pyramid = Pyramid::new(family, axis.boundary(), axis.len(), own).map_err(EditError::Pyramid)?;
        Ok(AxisLadder { axis, pyramid, offset: levels - own })
    }

    pub(super) fn pyramid(&self) -> &Pyramid {
        &self.pyramid
    }

    fn own(&self, level: usize) -> usize {
        level.saturating_sub(self.offset)
    }

    pub(super) fn len(&self, level: usize) -> usize {
        self.pyramid.smooth_len(self.own(level))
    }

    /// The rung between `level` and `level + 1`; `None` where this direction stays.
    pub(super) fn rung(&self, level: usize) -> Option<&Rung> {
        (level >= self.offset).then(|| self.pyramid.rung(level - self.offset))
    }

    /// Smooth control points of `from` on the finer level `to`: the same function.
    pub(super) fn prolong(&self, from: usize, to: usize, points: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
        (from..to).filter_map(|i| self.rung(i)).fold(points, |smooth, rung| {
            let mut fine = vec![[0.0; 3]; rung.fine()];
            rung.down(Kind::Coefficients, &smooth, &vec![[0.0; 3]; rung.detail()], &mut fine);
            fine
        })
    }

    /// How control points of a level make control point `i` of the next finer one.
    pub(super) fn parents(&self, level: usize, i: usize) -> Vec<(usize, f64)> {
        let Some(rung) = self.rung(level) else { return vec![(i, 1.0)] };
        let (mut fine, mut smooth) = (vec![0.0; rung.fine()], vec![0.0; rung.smooth()]);
        fine[i] = 1.0;
        rung.up(Kind::Basis, &fine, &mut smooth, &mut vec![0.0; rung.detail()]);
        smooth.into_iter().enumerate().filter(|e| e.1 != 0.0).collect()
    }

    /// The functions of a level alive at `t` with their derivative, in domain units.
    pub(super) fn row(&self, level: usize, t: f64, order: usize) -> Vec<(usize, f64)> {
        let mut fine = vec![0.0; self.axis.len()];
        basis::taps(&self.axis, t, order).iter().for_each(|(i, v)| fine[i] += v);
        for i in (self.own(level)..self.pyramid.levels()).rev() {
            let rung = self.pyramid.rung(i);
            let (mut smooth, mut detail) = (vec![0.0; rung.smooth()], vec![0.0; rung.detail()]);
            rung.up(Kind::Basis, &fine, &mut smooth, &mut detail);
            fine = smooth;
        }
        fine.into_iter().enumerate().filter(|e| e.1 != 0.0).collect()
    }

    /// Parameters of the control points of a level (Greville abscissae), in domain units.
    pub(super) fn sites(&self, level: usize) -> Vec<f64> {
        let steps = self.pyramid.levels() - self.own(level);
        let axis = &self.axis;
        if axis.boundary() == Boundary::Open {
            let knots = (0..steps).fold(OpenKnots::uniform(axis.spans()), |k, _| k.coarser());
            let n = knots.spans() as isize;
            let knot = |i: isize| knots.breaks()[i.clamp(0, n) as usize] as f64;
            return (0..n + 3).map(|j| axis.from_knots((knot(j - 2) + knot(j - 1) + knot(j)) / 3.0)).collect();
        }
        (0..self.len(level)).map(|j| axis.from_knots((j << steps) as f64)).collect()
    }

    /// Parameters where the wavelets of a level are strongest (6.2.1), in domain units: the middle of interior ones,
    /// the centre of mass of those at open ends.
    pub(super) fn wavelet_sites(&self, level: usize) -> Vec<f64> {
        let Some(rung) = self.rung(level) else { return Vec::new() };
        let fine = self.sites(level + 1);
        if self.axis.boundary() != Boundary::Open {
            return (0..rung.detail()).map(|j| fine[2 * j + 1]).collect();
        }
        let synthesis = rung.synthesis().columns(rung.smooth(), rung.fine()).transposed();
        (0..rung.detail())
            .map(|j| {
                let row = synthesis.row(j);
                let mass: f64 = row.iter().map(|e| e.1 * e.1).sum();
                row.iter().map(|&(i, v)| v * v * fine[i]).sum::<f64>() / mass
            })
            .collect()
    }
}
