//! A curve on all its levels.

use super::axis_ladder::{AxisLadder, levels_of};
use super::ladder::{EditError, Ladder};
use super::orientation::Turn;
use crate::axis::Axis;
use crate::shape::{Curve, ParametricCurve};
use ondelette_wavelet::{Frame, Hybrid};

/// A curve in all its hybrid bases.
///
/// ```
/// use ondelette_modeling::{Axis, edit::{CurveLadder, Ladder}, shape::Curve};
/// use ondelette_wavelet::Boundary;
/// let axis = Axis::new(Boundary::Open, 16, [0.0, 1.0])?;
/// let curve = Curve::new(axis, 2, (0..19).map(|i| [f64::from(i), f64::from(i % 2), 0.0]).collect())?;
/// let mut ladder = CurveLadder::new(&curve)?;
/// ladder.coarser(4, 2);
/// assert_eq!(ladder.smooth(2).len(), 7);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct CurveLadder {
    axis: AxisLadder,
    dim: usize,
    hybrid: Hybrid<[f64; 3]>,
}

impl CurveLadder {
    /// All levels of a curve, all valid. Linear time.
    ///
    /// # Errors
    /// An axis without levels.
    pub fn new(curve: &Curve) -> Result<CurveLadder, EditError> {
        let axis = AxisLadder::new(*curve.axis(), levels_of(curve.axis())?)?;
        let hybrid = Hybrid::new(axis.pyramid(), curve.points())?;
        Ok(CurveLadder { axis, dim: curve.dim(), hybrid })
    }

    /// Wavelet coefficients of a level.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn detail(&self, level: usize) -> &[[f64; 3]] {
        self.hybrid.detail(level)
    }

    /// Parameters where the wavelets of a level are strongest, in domain units.
    pub fn wavelet_sites(&self, level: usize) -> Vec<f64> {
        self.axis.wavelet_sites(level)
    }

    /// The frames (6.2.1) of the smooth curve of `level`, given by its control points, where that level's wavelets are
    /// strongest; `None` where the curve has none.
    pub fn frames(&self, level: usize, points: &[[f64; 3]]) -> Vec<Option<Frame>> {
        let fine = self.prolong(level, self.levels(), points);
        let Ok(curve) = Curve::new(self.axis.axis, self.dim, fine) else { return Vec::new() };
        let at = |t: f64| Frame::new(curve.derivative(t, 1), curve.derivative(t, 2));
        self.wavelet_sites(level).into_iter().map(at).collect()
    }

    pub(super) fn axis(&self) -> &AxisLadder {
        &self.axis
    }
}

impl Ladder for CurveLadder {
    type Shape = Curve;

    fn axes(&self) -> Vec<Axis> {
        vec![self.axis.axis]
    }

    fn levels(&self) -> usize {
        self.axis.pyramid().levels()
    }

    fn shape(&self, level: usize) -> [usize; 2] {
        [self.axis.len(level), 1]
    }

    fn sites(&self, level: usize) -> [Vec<f64>; 2] {
        [self.axis.sites(level), vec![0.0]]
    }

    fn smooth(&self, level: usize) -> &[[f64; 3]] {
        self.hybrid.smooth(level)
    }

    fn smooth_mut(&mut self, level: usize) -> &mut [[f64; 3]] {
        self.hybrid.smooth_mut(level)
    }

    fn coarser(&mut self, from: usize, to: usize) {
        self.hybrid.coarser(from, to);
    }

    fn finer(&mut self, from: usize, to: usize) {
        self.hybrid.finer(from, to);
    }

    fn prolong(&self, from: usize, to: usize, points: &[[f64; 3]]) -> Vec<[f64; 3]> {
        self.axis.prolong(from, to, points.to_vec())
    }

    fn parents(&self, level: usize, index: [usize; 2]) -> [Vec<(usize, f64)>; 2] {
        [self.axis.parents(level, index[0]), vec![(0, 1.0)]]
    }

    fn row(&self, level: usize, at: [f64; 2], orders: [usize; 2]) -> [Vec<(usize, f64)>; 2] {
        [self.axis.row(level, at[0], orders[0]), vec![(0, 1.0)]]
    }

    fn build(&self, finest: Vec<[f64; 3]>) -> Result<Curve, EditError> {
        Ok(Curve::new(self.axis.axis, self.dim, finest)?)
    }

    fn turns(&self, level: usize, old: &[[f64; 3]], new: &[[f64; 3]]) -> Vec<Turn> {
        let sites = self.axis.sites(level);
        let curves = [old, new].map(|p| Curve::new(self.axis.axis, self.dim, p.to_vec()));
        let [Ok(old), Ok(new)] = curves else { return vec![Turn::NONE; sites.len()] };
        if self.dim == 1 {
            return vec![Turn::NONE; sites.len()];
        }
        let turn = |t: f64| {
            let [a, b] = [&old, &new].map(|c| tangent(c, t));
            Turn::between(a, b, self.dim == 2)
        };
        sites.into_iter().map(turn).collect()
    }

    fn finer_in_frames(&mut self, from: usize, old: &[Vec<[f64; 3]>]) -> Result<(), EditError> {
        for level in from..self.levels() {
            let before = self.frames(level, &old[level - from]);
            let after = self.frames(level, self.hybrid.smooth(level));
            for ((w, a), b) in self.hybrid.detail_mut(level).iter_mut().zip(before).zip(after) {
                if let (Some(a), Some(b)) = (a, b) {
                    *w = b.from_frame(a.to_frame(*w));
                }
            }
            self.hybrid.finer(level, level + 1);
        }
        Ok(())
    }
}

/// Direction of a curve; where it stands still (mirrored ends) that of the second derivative, into the curve.
fn tangent(curve: &Curve, t: f64) -> [f64; 3] {
    let first = curve.derivative(t, 1);
    let size = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let second = curve.derivative(t, 2);
    let [a, b] = curve.domain();
    if size(first) > 1e-9 * size(second) * (b - a) {
        return first;
    }
    if t > 0.5 * (a + b) { second.map(|x| -x) } else { second }
}
