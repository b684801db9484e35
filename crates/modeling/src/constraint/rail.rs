//! A given curve on a surface: where it runs, and what it passes through, sampled.

use super::{Constraint, ConstraintError, Demand};
use crate::axis::Axis;
use crate::energy::Energy;
use crate::solve::{Method, Settings, Solution, SolveError, Solver};
use crate::system::{Problem, Space};
use ondelette_wavelet::Boundary;

/// Most samples of a curve.
const MOST_SAMPLES: usize = 4096;

/// Positions along a curve on a surface: the point at `places(u)` is `points(u)`, u from 0 to 1, both natural cubic
/// splines through the given lists at equal steps of u (two give a straight line).
///
/// `samples`: how many; `None`: one more than the spans that the curve crosses, as many as a curve along an axis can
/// meet exactly. The constraints are called `id[0]`, `id[1]`, ...; those that follow from others are named by the
/// solver.
///
/// # Errors
/// [`SolveError`]: fewer than two places or points, numbers that are not finite, points of different dimension.
///
/// ```
/// use ondelette_modeling::Axis;
/// use ondelette_modeling::constraint::along;
/// use ondelette_modeling::system::Space;
/// use ondelette_wavelet::Boundary;
/// let axis = Axis::new(Boundary::Open, 8, [0.0, 1.0])?;
/// let edge = along("edge", &Space::surface(axis, axis), &[[0.0, 0.0], [1.0, 0.0]], &[vec![0.0], vec![2.0]], None)?;
/// assert_eq!((edge.len(), edge[4].at.as_slice()), (9, &[0.5, 0.0][..]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn along(
    id: &str,
    space: &Space,
    places: &[[f64; 2]],
    points: &[Vec<f64>],
    samples: Option<usize>,
) -> Result<Vec<Constraint>, SolveError> {
    let wrong = |what: &'static str, got: usize, want: usize| {
        let error = ConstraintError::Count { id: id.to_owned(), what, got, want };
        SolveError::Problem(error.into())
    };
    let k = points.first().map_or(0, Vec::len);
    if places.len() < 2 || points.len() < 2 {
        return Err(wrong("a curve's places and points", places.len().min(points.len()), 2));
    }
    if let Some(other) = points.iter().find(|p| p.len() != k) {
        return Err(wrong("a point of the curve", other.len(), k));
    }
    let &[s, t] = space.axes() else { return Err(wrong("the parameter of a curve on a surface", 2, 1)) };
    let places: Vec<Vec<f64>> = places.iter().map(|p| p.to_vec()).collect();
    let crossed: f64 = places
        .windows(2)
        .map(|w| (w[1][0] - w[0][0]).abs() * s.density() + (w[1][1] - w[0][1]).abs() * t.density())
        .sum();
    let count = samples.unwrap_or((crossed.min(MOST_SAMPLES as f64).ceil() as usize).max(1) + 1);
    if !(2..=MOST_SAMPLES).contains(&count) {
        return Err(wrong("the samples of a curve (most)", count, MOST_SAMPLES));
    }
    let size = points.iter().flatten().fold(0.0, |m: f64, v| m.max(v.abs()));
    let (places, points) = (natural(id, &places)?, natural(id, points)?);
    let sample = |i: usize| {
        let u = [i as f64 / (count - 1) as f64];
        let mut at = places.eval(&u, [0, 0]);
        // A spline along an edge may leave it by a rounding.
        for (p, axis) in at.iter_mut().zip([s, t]) {
            let [from, to] = axis.domain();
            let edge = 1e-9 * (to - from);
            if axis.boundary() != Boundary::Periodic && (from - edge..=to + edge).contains(p) {
                *p = p.clamp(from, to);
            }
        }
        // What rounding leaves of a zero is a zero, or another curve through it would contradict this one.
        let clean = |v: f64| Some(if v.abs() < 1e-14 * size { 0.0 } else { v });
        let point = points.eval(&u, [0, 0]).into_iter().map(clean).collect();
        Constraint::new(format!("{id}[{i}]"), &at, Demand::Position(point))
    };
    Ok((0..count).map(sample).collect())
}

/// The natural cubic spline through points at equal steps.
fn natural(id: &str, points: &[Vec<f64>]) -> Result<Solution, SolveError> {
    let n = points.len() - 1;
    let axis = Axis::new(Boundary::Open, n, [0.0, 1.0]).map_err(|_| SolveError::Tolerance(0.0))?;
    let row = |(i, p): (usize, &Vec<f64>)| {
        let at = p.iter().map(|v| Some(*v)).collect();
        Constraint::new(format!("{id}, point {i}"), &[axis.from_knots(i as f64)], Demand::Position(at))
    };
    let rows = points.iter().enumerate().map(row).collect();
    let problem = Problem::new(Space::curve(axis), points[0].len(), Energy::BEND, None, rows)?;
    Solver::new(problem, Settings { method: Method::Banded, ..Settings::default() })?.run()
}
