//! A smoothing spline curve through the points of an outline.
//!
//! Minimises the sum of squared misses at chord-length parameters plus `weight` times (bend + `stiffening`^2 stretch),
//! by the banded solver. Weight and stiffening are chosen by cross-validation unless given, as of surfaces.

use super::choose::{BEGIN, STEPS, search};
use super::surface::LARGEST;
use super::{FitError, FitSettings};
use crate::axis::Axis;
use crate::constraint::{Constraint, Demand};
use crate::energy::{Energy, EnergyError};
use crate::shape::Curve;
use crate::solve::{Method, Settings, Solution, SolveError, Solver};
use crate::system::{Problem, Space};
use ondelette_numerics::seed;
use ondelette_wavelet::Boundary;

/// A fitted curve.
#[derive(Clone, Debug)]
pub struct CurveFit {
    /// The curve, over [0, 1] by chord length.
    pub curve: Curve,
    /// Parameter of each point.
    pub parameters: Vec<f64>,
    /// The weight of the energy.
    pub weight: f64,
    /// Square root of stretch over bend.
    pub stiffening: f64,
    /// Root mean square of the misses.
    pub rms: f64,
    /// Root mean square of predictions of left-out points, if any were left out.
    pub validation: Option<f64>,
    /// False where the solver did not reach its tolerance.
    pub converged: bool,
}

/// Points left out in turns: one in so many.
const FOLDS: u64 = 10;
/// Most spans that are chosen for a curve.
const MOST_SPANS: usize = 4096;

struct Data<'a> {
    points: &'a [Vec<f64>],
    parameters: Vec<f64>,
    axis: Axis,
}

impl Data<'_> {
    fn distance(&self, curve: &Solution, i: usize) -> f64 {
        let p = curve.eval(&[self.parameters[i]], [0, 0]);
        p.iter().zip(&self.points[i]).map(|(a, b)| (a - b).powi(2)).sum()
    }

    /// The curve through the points that are kept.
    fn solve(&self, weight: f64, stiffening: f64, kept: &dyn Fn(usize) -> bool) -> Result<Solution, FitError> {
        let row = |i: usize| {
            let at = self.points[i].iter().map(|v| Some(*v)).collect();
            Constraint::new(i.to_string(), &[self.parameters[i]], Demand::Position(at)).soft(1.0)
        };
        let rows = (0..self.points.len()).filter(|i| kept(*i)).map(row).collect();
        let energy = Energy::new(weight * stiffening * stiffening, weight, 0.0)?;
        let k = self.points[0].len();
        let problem = Problem::new(Space::curve(self.axis), k, energy, None, rows).map_err(SolveError::Problem)?;
        let solver = Solver::new(problem, Settings { method: Method::Banded, ..Settings::default() })?;
        // Points are no constraints of the user's, who gave the weight if anything.
        solver.run().map_err(|e| match e {
            SolveError::Degenerate { .. } | SolveError::Method { .. } => FitError::Lost { weight, stiffening },
            e => e.into(),
        })
    }
}

/// Fits a curve to the points of an outline, in order; `closed` joins the last to the first. `settings.domain` does not
/// matter here, spans are any number. Linear time a solution, some hundred small ones where cross-validation chooses.
///
/// # Errors
/// [`FitError`].
///
/// ```
/// use ondelette_modeling::fit::{FitSettings, curve};
/// let points: Vec<Vec<f64>> = (0..30).map(|i| vec![f64::from(i), (0.3 * f64::from(i)).sin()]).collect();
/// let fit = curve(&points, false, FitSettings::default())?;
/// assert!(fit.rms < 1e-3);
/// # Ok::<(), ondelette_modeling::fit::FitError>(())
/// ```
pub fn curve(points: &[Vec<f64>], closed: bool, settings: FitSettings) -> Result<CurveFit, FitError> {
    let k = points.first().map_or(0, Vec::len);
    let m = points.len();
    let wrong = FitError::Outline(m);
    if m < 4 || !(2..=3).contains(&k) || points.iter().any(|p| p.len() != k || p.iter().any(|v| !v.is_finite())) {
        return Err(wrong);
    }
    if let Some(value) = points.iter().flatten().find(|v| v.abs() > LARGEST) {
        return Err(FitError::Large(*value));
    }
    for (name, given) in [("weight", settings.weight), ("stiffening", settings.stiffening)] {
        if let Some(value) = given
            && !(value.is_finite() && value >= 0.0 && (value > 0.0 || name == "stiffening"))
        {
            return Err(EnergyError::Weight { name, value }.into());
        }
    }
    let far = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let mut parameters = vec![0.0];
    for w in points.windows(2) {
        parameters.push(parameters[parameters.len() - 1] + far(&w[0], &w[1]));
    }
    let length = parameters[m - 1] + if closed { far(&points[m - 1], &points[0]) } else { 0.0 };
    if !(length > 0.0 && length.is_finite()) {
        return Err(wrong);
    }
    parameters.iter_mut().for_each(|t| *t /= length);
    let boundary = if closed { Boundary::Periodic } else { Boundary::Open };
    let spans = settings.spans.unwrap_or_else(|| (2 * m).next_power_of_two().clamp(16, MOST_SPANS));
    let data = Data { points, parameters, axis: Axis::new(boundary, spans, [0.0, 1.0])? };
    let (mut weight, mut stiffening, mut validation) = (settings.weight, settings.stiffening, None);
    if weight.is_none() || stiffening.is_none() {
        // The ends of an open curve are not left out: nothing would be between.
        let inner = |i: usize| closed || (i > 0 && i + 1 < m);
        let fold = |i: usize| if inner(i) { seed::mix(i as u64 ^ 0x0ca7) % FOLDS } else { FOLDS };
        let mut validate = |weight: f64, stiffening: f64| {
            let (mut sum, mut count) = (0.0, 0);
            for k in 0..FOLDS {
                let out: Vec<usize> = (0..m).filter(|i| fold(*i) == k).collect();
                if out.is_empty() {
                    continue;
                }
                let curve = data.solve(weight, stiffening, &|i| fold(i) != k)?;
                sum += out.iter().map(|i| data.distance(&curve, *i)).sum::<f64>();
                count += out.len();
            }
            Ok(f64::sqrt(sum / f64::max(1.0, count as f64)))
        };
        let (w, s, v) = search(m as f64, [weight, stiffening], BEGIN, &STEPS, &mut validate)?;
        (weight, stiffening, validation) = (Some(w), Some(s), Some(v));
    }
    let (weight, stiffening) = (weight.unwrap_or(1e-9 * m as f64), stiffening.unwrap_or(0.0));
    let solution = data.solve(weight, stiffening, &|_| true)?;
    let rms = ((0..m).map(|i| data.distance(&solution, i)).sum::<f64>() / m as f64).sqrt();
    let converged = solution.converged();
    let x = solution.coefficients();
    let control = (0..data.axis.len()).map(|i| std::array::from_fn(|c| x.get(c).map_or(0.0, |x| x[i])));
    let curve = Curve::new(data.axis, k, control.collect()).map_err(|_| wrong)?;
    Ok(CurveFit { curve, parameters: data.parameters, weight, stiffening, rms, validation, converged })
}
