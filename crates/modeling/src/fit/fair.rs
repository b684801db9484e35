//! Fair curves: measured points moved by no more than a tolerance, so that curvature varies as little as it can.
//!
//! The curve minimises variation plus weighted squared misses; one common weight is lowered until a point moves by the
//! tolerance, then weights follow the misses: points that hold the curve back grow heavy, the others light, and the
//! common weight is lowered further. Variation counts in proportion to the curvature there is.

use crate::axis::Axis;
use crate::constraint::curvature::curvature;
use crate::constraint::{Constraint, ConstraintError, Demand};
use crate::energy::{Energy, Stiffness};
use crate::solve::{Method, Settings, Solution, SolveError, Solver};
use crate::system::{Problem, ProblemError, Space};
use ondelette_wavelet::Boundary;

/// A fair curve and the points on it.
#[derive(Clone, Debug)]
pub struct Fair {
    /// The curve: open, over [0, 1] by chord length.
    pub curve: Solution,
    /// Parameter of each point.
    pub parameters: Vec<f64>,
    /// The moved points, in order.
    pub points: Vec<Vec<f64>>,
    /// The largest distance that a point moved.
    pub largest_move: f64,
}

/// Why there is no fair curve.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FairError {
    /// Too few points, or points of different or unfit dimension.
    #[error("{0} points: a curve needs at least 4, all of 2 or 3 finite coordinates, not all in one place")]
    Points(usize),
    /// No such tolerance.
    #[error("tolerance {0}: give a distance above 0")]
    Tolerance(f64),
    /// Points closer together than the curve can follow, or a tolerance below the rounding of the points.
    #[error("tolerance {tolerance:e} cannot be reached: the curve passes a point by {nearest:.1e} at best")]
    Unreachable {
        /// The tolerance asked for.
        tolerance: f64,
        /// The largest distance that is left.
        nearest: f64,
    },
    /// The inner solver failed.
    #[error(transparent)]
    Solve(#[from] SolveError),
}

impl From<ConstraintError> for FairError {
    fn from(e: ConstraintError) -> FairError {
        FairError::Solve(SolveError::Problem(ProblemError::Constraint(e)))
    }
}

/// Evens the curvature of a polygon of measured points without moving a point further than `tolerance`: less where
/// weights light enough to use it up are lost beside the energy.
///
/// # Errors
/// [`FairError`].
pub fn fair(points: &[Vec<f64>], tolerance: f64) -> Result<Fair, FairError> {
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(FairError::Tolerance(tolerance));
    }
    let k = points.first().map_or(0, Vec::len);
    let fits = points.len() >= 4
        && (2..=3).contains(&k)
        && points.iter().all(|p| p.len() == k && p.iter().all(|v| v.is_finite()));
    if !fits {
        return Err(FairError::Points(points.len()));
    }
    let distance = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let mut parameters = vec![0.0];
    for w in points.windows(2) {
        parameters.push(parameters[parameters.len() - 1] + distance(&w[0], &w[1]));
    }
    let length = parameters[parameters.len() - 1];
    if length <= 0.0 || !length.is_finite() {
        return Err(FairError::Points(points.len()));
    }
    parameters.iter_mut().for_each(|t| *t /= length);
    let spans = (4 * points.len()).next_power_of_two();
    let axis = Axis::new(Boundary::Open, spans, [0.0, 1.0]).map_err(|_| FairError::Points(points.len()))?;
    let solve = |weights: &[f64], map: &Option<Stiffness>| -> Result<Solution, FairError> {
        let rows = points.iter().zip(&parameters).zip(weights).enumerate().map(|(i, ((p, t), w))| {
            let at = p.iter().map(|v| Some(*v)).collect();
            Constraint::new(format!("{i}"), &[*t], Demand::Position(at)).soft(*w)
        });
        let energy = Energy { stretch: 0.0, bend: 0.0, variation: 1.0 };
        let problem = Problem::new(Space::curve(axis), k, energy, map.clone(), rows.collect());
        let problem = problem.map_err(SolveError::Problem)?;
        let settings = Settings { method: Method::Banded, ..Settings::default() };
        Ok(Solver::new(problem, settings)?.run()?)
    };
    let moves = |curve: &Solution| -> Vec<f64> {
        parameters.iter().zip(points).map(|(t, p)| distance(&curve.eval(&[*t], [0, 0]), p)).collect()
    };
    let most = |m: &[f64]| m.iter().fold(0.0, |a: f64, b| a.max(*b));
    let mut shares = vec![1.0; points.len()];
    let (mut first, mut best): (Option<Solution>, Option<(f64, Solution)>) = (None, None);
    let mut middle = 4.0_f64;
    let mut map = None;
    let mut nearest = f64::INFINITY;
    for round in 0..ROUNDS {
        // The least common weight that keeps all points within the tolerance.
        let (mut low, mut high) = if round < 2 { (-6.0, 16.0) } else { (middle - 2.0, middle + 2.0) };
        let mut found = None;
        loop {
            let end = high;
            for _ in 0..if round < 2 { 24 } else { 14 } {
                let w = 0.5 * (low + high);
                let weights: Vec<f64> = shares.iter().map(|s| s * 10.0_f64.powf(w)).collect();
                let curve = solve(&weights, &map)?;
                let m = moves(&curve);
                // Weights too light for the solver are too light.
                let good = curve.converged() && most(&m) <= tolerance;
                if curve.converged() {
                    nearest = nearest.min(most(&m));
                }
                if good {
                    high = w;
                    found = Some((curve, m));
                } else {
                    low = w;
                }
            }
            if found.is_some() || round >= 2 || end >= MOST_WEIGHT {
                break;
            }
            (low, high) = (end, end + 4.0);
        }
        middle = high;
        let Some((curve, m)) = found else { break };
        if round == 0 {
            // From here on curvature counts in proportion: a nose may stay sharp.
            map = softened(&curve, spans);
            first = Some(curve);
            continue;
        }
        let energy = curve.energy();
        if best.as_ref().is_none_or(|b| energy < b.0) {
            best = Some((energy, curve));
        }
        for (s, m) in shares.iter_mut().zip(&m) {
            *s = (*s * (0.05 + m / tolerance)).clamp(1e-9, 1e9);
        }
    }
    let Some(curve) = best.map(|b| b.1).or(first) else { return Err(FairError::Unreachable { tolerance, nearest }) };
    let largest_move = most(&moves(&curve));
    let moved = parameters.iter().map(|t| curve.eval(&[*t], [0, 0])).collect();
    Ok(Fair { curve, parameters, points: moved, largest_move })
}

/// Rounds of new shares.
const ROUNDS: usize = 16;
/// Logarithm of the largest common weight: more moves no point closer.
const MOST_WEIGHT: f64 = 32.0;

/// Stiffness that falls where a curve is bent more than usual.
fn softened(curve: &Solution, spans: usize) -> Option<Stiffness> {
    let bent = |i: usize| {
        let t = [(i as f64 + 0.5) / spans as f64];
        curvature(&curve.eval(&t, [1, 0]), &curve.eval(&t, [2, 0])).map_or(0.0, |k| k.0.abs())
    };
    let bent: Vec<f64> = (0..spans).map(bent).collect();
    let mut sorted = bent.clone();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted[spans / 2].max(1e-6 * sorted[spans - 1]);
    let factors = bent.iter().map(|b| (1.0 / (1.0 + (b / usual).powi(2))).max(1e-5)).collect();
    if usual > 0.0 { Stiffness::new(spans, factors).ok() } else { None }
}
