//! A smoothing spline surface through scattered heights.
//!
//! Minimises the sum of squared misses plus `weight` times (bend + `stiffening`^2 stretch) on an open tensor spline, by
//! multigrid conjugate gradients. Weight and stiffening are chosen by cross-validation unless given: points are left
//! out in turns, and the pair that predicts them best is taken.

use super::normal::Normal;
use crate::axis::{Axis, AxisError};
use crate::basis;
use crate::energy::{Energy, EnergyError, Operator};
use crate::solve::cycle::Cycle;
use crate::system::Space;
use ondelette_numerics::seed;
use ondelette_wavelet::Boundary;
use std::sync::Arc;

/// Heights at places (s, t).
#[derive(Clone, Debug)]
pub struct Scatter {
    points: Vec<[f64; 2]>,
    values: Vec<f64>,
}

/// What is given, and what the program chooses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FitSettings {
    /// Weight of the energy against the sum of squared misses; `None`: by cross-validation.
    pub weight: Option<f64>,
    /// Square root of stretch over bend, per side of the domain; `None`: by cross-validation.
    pub stiffening: Option<f64>,
    /// Spans an axis; `None`: the power of two above twice the square root of the number of points, at most 512.
    pub spans: Option<usize>,
    /// The domain `[[s0, s1], [t0, t1]]`; `None`: the bounding box of the points.
    pub domain: Option<[[f64; 2]; 2]>,
}

/// A fitted surface.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Where the coefficients live.
    pub space: Space,
    /// Row-major (s, t).
    pub coefficients: Vec<f64>,
    /// The weight of the energy.
    pub weight: f64,
    /// Square root of stretch over bend, per side of the domain.
    pub stiffening: f64,
    /// Root mean square of the misses at the points.
    pub rms: f64,
    /// Root mean square of predictions of left-out points, if any were left out.
    pub validation: Option<f64>,
}

/// Why nothing can be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// No points, or not as many values.
    #[error("{points} points and {values} values: give one value a point, and at least one point")]
    Count {
        /// Points given.
        points: usize,
        /// Values given.
        values: usize,
    },
    /// A number that is NaN or infinite.
    #[error("point {0} is not finite: leave it out (missing data need no stand-in)")]
    NotFinite(usize),
    /// A point outside the domain.
    #[error("point {0} is outside the domain")]
    Outside(usize),
    /// No such domain or spans.
    #[error(transparent)]
    Axis(#[from] AxisError),
    /// A weight that is none.
    #[error(transparent)]
    Energy(#[from] EnergyError),
    /// Spans that cannot be solved on.
    #[error("{0} spans: give a power of two from 4 to 1024")]
    Spans(usize),
}

impl Scatter {
    /// Takes points and their values.
    ///
    /// # Errors
    /// [`FitError::Count`], [`FitError::NotFinite`].
    pub fn new(points: Vec<[f64; 2]>, values: Vec<f64>) -> Result<Scatter, FitError> {
        if points.is_empty() || points.len() != values.len() {
            return Err(FitError::Count { points: points.len(), values: values.len() });
        }
        let bad = |i: &usize| !(points[*i].iter().all(|v| v.is_finite()) && values[*i].is_finite());
        match (0..points.len()).find(bad) {
            Some(i) => Err(FitError::NotFinite(i)),
            None => Ok(Scatter { points, values }),
        }
    }

    /// The points.
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points
    }
}

/// One training set: its sums on every level, and what is left out.
struct Fold {
    normals: Vec<Arc<Normal>>,
    right: Vec<f64>,
    out: Vec<usize>,
    /// The last solution.
    x: Vec<f64>,
}

/// Fits a surface to scattered heights. About `n + points` work a solution; a hundred small ones where cross-validation
/// chooses.
///
/// # Errors
/// [`FitError`].
///
/// ```
/// use ondelette_modeling::fit::{FitSettings, Scatter, surface};
/// let places: Vec<[f64; 2]> = (0..80).map(|i| [f64::from(i * 37 % 80) / 79.0, f64::from(i) / 79.0]).collect();
/// let heights = places.iter().map(|p| 1.0 + 2.0 * p[0] - p[1]).collect();
/// let fit = surface(&Scatter::new(places, heights)?, FitSettings::default())?;
/// assert!(fit.rms < 1e-2);
/// # Ok::<(), ondelette_modeling::fit::FitError>(())
/// ```
pub fn surface(data: &Scatter, settings: FitSettings) -> Result<Fit, FitError> {
    let m = data.points.len();
    let domain = settings.domain.unwrap_or_else(|| {
        let range = |a: usize| {
            let low = data.points.iter().map(|p| p[a]).fold(f64::INFINITY, f64::min);
            let high = data.points.iter().map(|p| p[a]).fold(f64::NEG_INFINITY, f64::max);
            if high > low { [low, high] } else { [low - 0.5, high + 0.5] }
        };
        [range(0), range(1)]
    });
    let spans =
        settings.spans.unwrap_or_else(|| ((2.0 * (m as f64).sqrt()) as usize).next_power_of_two().clamp(8, 512));
    if !(spans.is_power_of_two() && (4..=1024).contains(&spans)) {
        return Err(FitError::Spans(spans));
    }
    let inside = |p: &[f64; 2]| (0..2).all(|a| (domain[a][0]..=domain[a][1]).contains(&p[a]));
    if let Some(i) = data.points.iter().position(|p| !inside(p)) {
        return Err(FitError::Outside(i));
    }
    let axis = |a: usize| Axis::new(Boundary::Open, spans, domain[a]);
    let space = Space::surface(axis(0)?, axis(1)?);
    for (name, given) in [("weight", settings.weight), ("stiffening", settings.stiffening)] {
        if let Some(value) = given
            && !(value.is_finite() && value >= 0.0 && (value > 0.0 || name == "stiffening"))
        {
            return Err(EnergyError::Weight { name, value }.into());
        }
    }
    let side = ((domain[0][1] - domain[0][0]) * (domain[1][1] - domain[1][0])).sqrt();
    let mean = data.values.iter().sum::<f64>() / m as f64;
    let centred: Vec<f64> = data.values.iter().map(|v| v - mean).collect();
    let mut spaces = vec![space.clone()];
    while let Some(next) = spaces[spaces.len() - 1].coarser().filter(|_| spaces[spaces.len() - 1].len() > 60) {
        spaces.push(next);
    }
    let mut choice = Choice { spaces: &spaces, data, values: &centred, side, folds: Vec::new() };
    let unit = m as f64 * side * side;
    let (mut weight, mut stiffening) = (settings.weight, settings.stiffening);
    let mut validation = None;
    if (weight.is_none() || stiffening.is_none()) && m > 3 {
        // A coarser surface tells the same weights where there are many spans.
        let few = if m > 20_000 { 1 } else { 10 };
        choice.leave_out(few, 10);
        let (w, s, v) = choice.search(unit, weight, stiffening)?;
        (weight, stiffening, validation) = (Some(w), Some(s), Some(v));
    }
    let weight = weight.unwrap_or(1e-9 * unit);
    let stiffening = stiffening.unwrap_or(0.0);
    let start = choice.folds.first().map(|f| f.x.clone());
    choice.folds.clear();
    let mut all = choice.fold(&|_| false);
    if let Some(start) = start {
        all.x = start;
    }
    choice.solve(&mut all, weight, stiffening, 1e-8)?;
    let miss = |i: usize| eval(&space, &all.x, data.points[i]) - centred[i];
    let rms = ((0..m).map(|i| miss(i).powi(2)).sum::<f64>() / m as f64).sqrt();
    // The B-splines sum to one.
    let coefficients = all.x.iter().map(|v| v + mean).collect();
    Ok(Fit { space, coefficients, weight, stiffening, rms, validation })
}

fn eval(space: &Space, x: &[f64], p: [f64; 2]) -> f64 {
    let axes = space.axes();
    let (s, t, n) = (basis::taps(&axes[0], p[0], 0), basis::taps(&axes[1], p[1], 0), axes[1].len());
    s.iter().map(|(i, v)| v * t.apply(&x[i * n..][..n])).sum()
}

struct Choice<'a> {
    spaces: &'a [Space],
    data: &'a Scatter,
    values: &'a [f64],
    side: f64,
    folds: Vec<Fold>,
}

impl Choice<'_> {
    fn fold(&self, out: &dyn Fn(usize) -> bool) -> Fold {
        let kept = |i: &usize| !out(*i);
        let points = &self.data.points;
        let m = points.len();
        let normals =
            self.spaces.iter().map(|s| Arc::new(Normal::new(s, (0..m).filter(kept).map(|i| &points[i])))).collect();
        let space = &self.spaces[0];
        let n = space.shape()[1];
        let mut right = vec![0.0; space.len()];
        for i in (0..m).filter(kept) {
            let (s, t) =
                (basis::taps(&space.axes()[0], points[i][0], 0), basis::taps(&space.axes()[1], points[i][1], 0));
            for (a, u) in s.iter() {
                t.iter().for_each(|(b, v)| right[a * n + b] += u * v * self.values[i]);
            }
        }
        Fold { normals, right, out: (0..m).filter(|i| out(*i)).collect(), x: vec![0.0; space.len()] }
    }

    /// `count` folds, each leaving out one in `of` points.
    fn leave_out(&mut self, count: usize, of: u64) {
        let number = |i: usize| seed::mix(i as u64 ^ 0x5eed) % of;
        self.folds = (0..count as u64).map(|k| self.fold(&|i| number(i) == k)).collect();
    }

    fn solve(&self, fold: &mut Fold, weight: f64, stiffening: f64, tolerance: f64) -> Result<(), FitError> {
        let ratio = stiffening / self.side;
        let energy = Energy::new(weight * ratio * ratio, weight, 0.0)?;
        let h = Operator::new(&self.spaces[0], &energy, None);
        let Some(mut cycle) = Cycle::with_data(&self.spaces[0], &energy, &h, &fold.normals) else {
            return Err(FitError::Spans(self.spaces[0].axes()[0].spans()));
        };
        cycle.conjugate_gradients(&fold.right, &mut fold.x, tolerance, 200);
        Ok(())
    }

    /// Root mean square of the predictions of what the folds leave out.
    fn validate(&mut self, weight: f64, stiffening: f64) -> Result<f64, FitError> {
        let (mut sum, mut count) = (0.0, 0);
        let mut folds = std::mem::take(&mut self.folds);
        for fold in &mut folds {
            fold.x.fill(0.0);
            self.solve(fold, weight, stiffening, 1e-4)?;
            for &i in &fold.out {
                sum += (eval(&self.spaces[0], &fold.x, self.data.points[i]) - self.values[i]).powi(2);
                count += 1;
            }
        }
        self.folds = folds;
        Ok((sum / count.max(1) as f64).sqrt())
    }

    /// A search along both logarithms in turns, with halved steps.
    fn search(&mut self, unit: f64, weight: Option<f64>, stiffening: Option<f64>) -> Result<(f64, f64, f64), FitError> {
        let mut at = [weight.map_or(-8.0, |w| (w / unit).log10()), stiffening.map_or(1.0, |s| s.max(1e-3).log10())];
        let value = |me: &mut Self, at: [f64; 2]| -> Result<f64, FitError> {
            let s = stiffening.unwrap_or(10.0_f64.powf(at[1]));
            me.validate(10.0_f64.powf(at[0]) * unit, s)
        };
        let free = [weight.is_none(), stiffening.is_none()];
        let mut best = value(self, at)?;
        for step in [[1.0, 0.5], [0.5, 0.25], [0.25, 0.12]] {
            // Along the axes and both diagonals, as long as it helps.
            let mut moved = true;
            while moved {
                moved = false;
                for (a, b) in [(-1.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)]
                {
                    if (a != 0.0 && !free[0]) || (b != 0.0 && !free[1]) {
                        continue;
                    }
                    loop {
                        let next = [at[0] + a * step[0], at[1] + b * step[1]];
                        if !(-16.0..=2.0).contains(&next[0]) || !(-1.0..=2.5).contains(&next[1]) {
                            break;
                        }
                        let got = value(self, next)?;
                        if got >= best {
                            break;
                        }
                        (best, at, moved) = (got, next, true);
                    }
                }
            }
        }
        Ok((10.0_f64.powf(at[0]) * unit, stiffening.unwrap_or(10.0_f64.powf(at[1])), best))
    }
}
