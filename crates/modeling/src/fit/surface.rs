//! A smoothing spline surface through scattered heights.
//!
//! Minimises the sum of squared misses plus `weight` times (bend + `stiffening`^2 stretch) on an open tensor spline, by
//! multigrid conjugate gradients. Weight and stiffening are chosen by cross-validation unless given: points are left
//! out in turns, and the pair that predicts them best is taken.

use super::choose::{BEGIN, STEPS, search};
use super::normal::Normal;
use super::plane::{is_line, take_off};
use crate::axis::{Axis, AxisError};
use crate::basis;
use crate::energy::{Energy, EnergyError, Operator};
use crate::solve::cycle::{Cycle, coarser};
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
    /// Spans an axis; `None`: the power of two above twice the square root of the number of points, 8 to 512, and where
    /// one side of the domain is longer than the other as many more on it as there are fewer on the other.
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
    /// False where the iteration ended before it reached its tolerance.
    pub converged: bool,
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
    /// A height or coordinate whose square is no number.
    #[error("a value of {0:e} is too large: squares are summed, so scale the data to below 1e100")]
    Large(f64),
    /// Heights that differ by so little that the squares are lost.
    #[error("values differ by no more than {0:e}: squares are summed, so scale the data to above 1e-100")]
    Small(f64),
    /// A point outside the domain.
    #[error("point {0} is outside the domain")]
    Outside(usize),
    /// No such domain or spans.
    #[error(transparent)]
    Axis(#[from] AxisError),
    /// A weight that is none.
    #[error(transparent)]
    Energy(#[from] EnergyError),
    /// Too few points of an outline, or points that make no curve.
    #[error("{0} points: an outline needs at least 4, all of 2 or 3 finite coordinates, not all in one place")]
    Outline(usize),
    /// The inner solver failed.
    #[error(transparent)]
    Solve(#[from] crate::solve::SolveError),
    /// Numbers that leave no factor.
    #[error("weight {weight:e}, stiffening {stiffening:e}: beside the data these numbers are too small or too large")]
    Lost {
        /// The weight of the energy.
        weight: f64,
        /// Square root of stretch over bend.
        stiffening: f64,
    },
    /// Points that leave the tilt across their line to nothing.
    #[error(
        "all points lie on a line: what is as high as they are there may tilt across it as it likes; give a stiffening \
         above 0, or none to have it chosen"
    )]
    Line,
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
    let coordinates = data.points.iter().chain(&domain).flatten();
    if let Some(value) = data.values.iter().chain(coordinates).find(|v| v.abs() > LARGEST) {
        return Err(FitError::Large(*value));
    }
    let spans = match settings.spans {
        Some(spans) if spans.is_power_of_two() && (4..=1024).contains(&spans) => [spans; 2],
        Some(spans) => return Err(FitError::Spans(spans)),
        None => spans_for(m, domain.map(|[low, high]| high - low)),
    };
    let inside = |p: &[f64; 2]| (0..2).all(|a| (domain[a][0]..=domain[a][1]).contains(&p[a]));
    if let Some(i) = data.points.iter().position(|p| !inside(p)) {
        return Err(FitError::Outside(i));
    }
    let axis = |a: usize| Axis::new(Boundary::Open, spans[a], domain[a]);
    let space = Space::surface(axis(0)?, axis(1)?);
    for (name, given) in [("weight", settings.weight), ("stiffening", settings.stiffening)] {
        if let Some(value) = given
            && !(value.is_finite() && value >= 0.0 && (value > 0.0 || name == "stiffening"))
        {
            return Err(EnergyError::Weight { name, value }.into());
        }
    }
    let line = is_line(&data.points);
    if line && settings.stiffening == Some(0.0) && m > 1 {
        return Err(FitError::Line);
    }
    let side = ((domain[0][1] - domain[0][0]) * (domain[1][1] - domain[1][0])).sqrt();
    let mean = data.values.iter().sum::<f64>() / m as f64;
    let centred: Vec<f64> = data.values.iter().map(|v| v - mean).collect();
    let most = centred.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    if most > 0.0 && most < SMALLEST {
        return Err(FitError::Small(most));
    }
    let unit = m as f64 * side * side;
    let (mut weight, mut stiffening) = (settings.weight, settings.stiffening);
    let mut validation = None;
    let mut start = None;
    if (weight.is_none() || stiffening.is_none()) && m > 3 {
        let given = [weight, stiffening];
        let mut parts = Part::windows(&space, &data.points, &centred, side)?;
        let (mut begin, mut steps) = (BEGIN, &STEPS[..]);
        // A coarser surface finds nearly the same weights; the last steps are the fine one's.
        if let (1, Some(coarse)) = (parts.len(), coarser(&space).filter(|c| c.cells() >= 128 * 128)) {
            let mut parts = Part::windows(&coarse, &data.points, &centred, side)?;
            let found = search(unit, given, begin, &STEPS[..2], &mut |w, s| Part::validate_all(&mut parts, w, s))?;
            (begin, steps) = ([found.0 / unit, found.1], &STEPS[2..]);
        }
        let (w, s, v) = search(unit, given, begin, steps, &mut |w, s| Part::validate_all(&mut parts, w, s))?;
        (weight, stiffening, validation) = (Some(w), Some(s), Some(v));
        if let [whole] = &mut parts[..] {
            start = whole.folds.first_mut().map(|f| std::mem::take(&mut f.x));
        }
    }
    let weight = weight.unwrap_or(1e-9 * unit);
    let stiffening = stiffening.unwrap_or(if line { 1.0 } else { 0.0 });
    let (mut rest, mut off) = (centred, vec![0.0; space.len()]);
    if stiffening == 0.0 {
        off = take_off(&space, &data.points, &mut rest);
    }
    // The B-splines sum to one.
    off.iter_mut().for_each(|v| *v += mean);
    let mut whole = Part::new(space.clone(), data.points.clone(), rest, side);
    whole.off = off.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let mut all = whole.fold(&|_| false);
    if let Some(start) = start.filter(|x| x.len() == all.x.len() && stiffening > 0.0) {
        all.x = start;
    }
    let converged = whole.settle(&mut all, weight, stiffening)?;
    let miss = |i: usize| eval(&space, &all.x, data.points[i]) - whole.values[i];
    let rms = ((0..m).map(|i| miss(i).powi(2)).sum::<f64>() / m as f64).sqrt();
    let coefficients = all.x.iter().zip(off).map(|(v, off)| v + off).collect();
    Ok(Fit { space, coefficients, weight, stiffening, rms, validation, converged })
}

/// Most iterations of the final solution. Ten to fifty are usual; weights that hardly smooth take more.
const MOST: usize = 2000;
/// The sum may be above its least by this share of the energy.
const SETTLED: f64 = 1e-8;
/// Where rounding keeps the sum up, this many times the share will do.
const SLACK: f64 = 1e3;
/// Coefficients are rounded to this share of their size.
const ROUNDING: f64 = 1e-15;
/// No sum needs to be nearer to its least than this share of what the data would have if nothing was fitted, or an even
/// bend as high: shapes differ by the root of it.
const FAINT: f64 = 1e-18;
/// An energy whose largest entry is this share of the data's is lost in their rounding.
const DROWNED: f64 = 1e-18;
/// Values above this have squares whose sums may be no numbers.
pub(super) const LARGEST: f64 = 1e100;

/// Values that differ by less than this have squares that may be nothing.
const SMALLEST: f64 = 1e-100;

/// Spans an axis for `m` points over a domain with such sides: about four cells a point, about as long as wide.
fn spans_for(m: usize, sides: [f64; 2]) -> [usize; 2] {
    let even = ((2.0 * (m as f64).sqrt()) as usize).next_power_of_two().clamp(8, 512);
    let aspect = (sides[0] / sides[1]).log2();
    let doublings = aspect.abs().round() as u32;
    // Where the doublings cannot be shared equally, half as many cells or twice as many.
    let enough = even == 512 || even * even / 2 >= 4 * m;
    let most = (even / 4).ilog2();
    let fewer = (if enough { doublings.div_ceil(2) } else { doublings / 2 }).min(most);
    let more = (doublings - fewer).min(if fewer == most { most } else { u32::MAX });
    let (long, short) = (even << more, even >> fewer);
    if aspect > 0.0 { [long, short] } else { [short, long] }
}

pub(super) fn eval(space: &Space, x: &[f64], p: [f64; 2]) -> f64 {
    let axes = space.axes();
    let (s, t, n) = (basis::taps(&axes[0], p[0], 0), basis::taps(&axes[1], p[1], 0), axes[1].len());
    s.iter().map(|(i, v)| v * t.apply(&x[i * n..][..n])).sum()
}

/// Data on a part of the domain, or the whole of it: what cross-validation works on.
struct Part {
    /// From fine to coarse.
    spaces: Vec<Space>,
    points: Vec<[f64; 2]>,
    values: Vec<f64>,
    /// The height of what was taken off the values.
    off: f64,
    /// Side of the whole domain.
    side: f64,
    folds: Vec<Fold>,
}

/// Points that a window aims at.
const WINDOW: f64 = 2000.0;
/// Windows on which the smoothing of many points is chosen.
const WINDOWS: u64 = 6;

impl Part {
    fn new(space: Space, points: Vec<[f64; 2]>, values: Vec<f64>, side: f64) -> Part {
        let mut spaces = vec![space];
        while let Some(next) = coarser(&spaces[spaces.len() - 1]).filter(|_| spaces[spaces.len() - 1].len() > 60) {
            spaces.push(next);
        }
        Part { spaces, points, values, off: 0.0, side, folds: Vec::new() }
    }

    /// The whole domain with ten folds; or, where there are many points, windows of it with the same knots, as dense as
    /// it is: energy and misses are sums over places, so that the best weights there are the best ones of the whole.
    /// Each is around a point, so that there are more where the points are.
    fn windows(space: &Space, points: &[[f64; 2]], values: &[f64], side: f64) -> Result<Vec<Part>, FitError> {
        let axes = space.axes();
        let spans = [0, 1].map(|a: usize| axes[a].spans());
        let share = WINDOW / points.len() as f64;
        let part = |a: usize, share: f64| {
            ((spans[a] as f64 * share).ceil() as usize).next_power_of_two().max(16).min(spans[a])
        };
        let mut few = [part(0, share.sqrt()), part(1, share.sqrt())];
        // A strip is cut across only.
        for a in 0..2 {
            if few[a] == spans[a] && spans[a] < spans[1 - a] {
                few[1 - a] = part(1 - a, share);
            }
        }
        if few == spans {
            let mut part = Part::new(space.clone(), points.to_vec(), values.to_vec(), side);
            part.leave_out(10, 10);
            return Ok(vec![part]);
        }
        let mut parts = Vec::new();
        for k in 0..WINDOWS {
            let centre = points[(seed::mix(k ^ 0x0e11) % points.len() as u64) as usize];
            let range = |a: usize| {
                let axis = &axes[a];
                let first =
                    (axis.to_knots(centre[a]) - 0.5 * few[a] as f64).round().clamp(0.0, (spans[a] - few[a]) as f64);
                [axis.from_knots(first), axis.from_knots(first + few[a] as f64)]
            };
            let frame = [range(0), range(1)];
            let inside = |i: &usize| (0..2).all(|a| (frame[a][0]..=frame[a][1]).contains(&points[*i][a]));
            let chosen: Vec<usize> = (0..points.len()).filter(inside).collect();
            let axis = |a: usize| Axis::new(Boundary::Open, few[a], frame[a]);
            let (places, heights) = chosen.iter().map(|i| (points[*i], values[*i])).unzip();
            let mut part = Part::new(Space::surface(axis(0)?, axis(1)?), places, heights, side);
            part.leave_out(2, 10);
            parts.push(part);
        }
        Ok(parts)
    }

    fn fold(&self, out: &dyn Fn(usize) -> bool) -> Fold {
        let kept = |i: &usize| !out(*i);
        let points = &self.points;
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

    fn prepare(&self, fold: &Fold, weight: f64, stiffening: f64) -> Result<(Operator, Cycle), FitError> {
        let ratio = stiffening / self.side;
        let energy = Energy::new(weight * ratio * ratio, weight, 0.0)?;
        let h = Operator::new(&self.spaces[0], &energy, None);
        let largest = |diagonal: &mut dyn Iterator<Item = f64>| diagonal.fold(0.0, f64::max);
        let (own, data) = (largest(&mut h.diagonal().into_iter()), largest(&mut fold.normals[0].diagonal()));
        if !(own > DROWNED * data && own.is_finite()) {
            return Err(FitError::Lost { weight, stiffening });
        }
        let cycle = Cycle::with_data(&self.spaces[0], &energy, &h, &fold.normals);
        Ok((h, cycle.ok_or(FitError::Lost { weight, stiffening })?))
    }

    /// For cross-validation.
    fn solve(&self, fold: &mut Fold, weight: f64, stiffening: f64) -> Result<(), FitError> {
        let (_, mut cycle) = self.prepare(fold, weight, stiffening)?;
        cycle.conjugate_gradients(&fold.right, &mut fold.x, 1e-4, 200);
        Ok(())
    }

    /// The last word, from all points; false where it does not converge.
    ///
    /// What the sum may be above its least is measured by the energy: misses alone would leave free what no point is
    /// near. Beside it counts the energy of a shape that is bent evenly over the domain, as high as the data, because
    /// planes have none. Of data that are met exactly neither is left: there it is a share of what the data would
    /// have, and the rounding of heights as they are given.
    fn settle(&self, fold: &mut Fold, weight: f64, stiffening: f64) -> Result<bool, FitError> {
        let (h, mut cycle) = self.prepare(fold, weight, stiffening)?;
        let squares: f64 = self.values.iter().map(|v| v * v).sum();
        let even = weight * (1.0 + stiffening * stiffening) * squares / self.values.len() as f64;
        let even = even / (self.side * self.side);
        let trace = h.diagonal().iter().sum::<f64>() + fold.normals[0].diagonal().sum::<f64>();
        let goal = |x: &[f64]| {
            let miss = |(p, v): (&[f64; 2], &f64)| (eval(&self.spaces[0], x, *p) - v).powi(2);
            let misses: f64 = self.points.iter().zip(&self.values).map(miss).sum();
            let energy = h.energy(x);
            let size = self.off + x.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            let least = (FAINT * squares.min(even)).max((ROUNDING * size).powi(2) * trace);
            (SETTLED * (misses + energy).min(energy.max(even))).max(least)
        };
        Ok(cycle.settle(&fold.right, &mut fold.x, 1e-8, MOST, &goal, SLACK))
    }

    /// Root mean square of the predictions of what all folds leave out.
    fn validate_all(parts: &mut [Part], weight: f64, stiffening: f64) -> Result<f64, FitError> {
        let (mut sum, mut count) = (0.0, 0);
        for part in parts {
            let (s, c) = part.validate(weight, stiffening)?;
            sum += s;
            count += c;
        }
        Ok((sum / count.max(1) as f64).sqrt())
    }

    /// Sum of squares and number of the predictions of what the folds leave out.
    fn validate(&mut self, weight: f64, stiffening: f64) -> Result<(f64, usize), FitError> {
        let (mut sum, mut count) = (0.0, 0);
        let mut folds = std::mem::take(&mut self.folds);
        for fold in &mut folds {
            // From the solution of the last weights: neighbours are alike.
            self.solve(fold, weight, stiffening)?;
            for &i in &fold.out {
                sum += (eval(&self.spaces[0], &fold.x, self.points[i]) - self.values[i]).powi(2);
                count += 1;
            }
        }
        self.folds = folds;
        Ok((sum, count))
    }
}
