//! The speed that a curve is asked to have: as even as the parameters of its points allow.
//!
//! Arc length over the parameter is interpolated, monotonely, through the arc lengths that the curve has at its
//! constraints (Fritsch and Carlson's cubics, slopes by harmonic means); the speed is its derivative. The curve can
//! then have exactly that speed without changing its shape, and the term that asks for it does not bend the result.

use super::objective::Objective;
use super::span::{GAUSS, PACES};
use crate::axis::Axis;
use ondelette_numerics::gauss;
use ondelette_wavelet::Boundary;

/// Arc lengths at parameters (knot units, ascending) of the curve with control points `x`.
fn lengths(objective: &Objective, x: &[f64], at: &[f64]) -> Vec<f64> {
    let axis = &objective.axis;
    let whole: Vec<f64> = (0..axis.spans()).map(|i| objective.speeds(i, x).iter().map(|(s, w)| s * w).sum()).collect();
    let (nodes, weights) = gauss::rule(GAUSS);
    let mut before = vec![0.0];
    whole.iter().for_each(|l| before.push(before[before.len() - 1] + l));
    let part = |u: f64| {
        let span = (u.max(0.0) as usize).min(axis.spans() - 1);
        let rest = u - span as f64;
        let ds = |y: f64| {
            let taps = crate::basis::span_taps(axis.boundary(), axis.spans(), span, y * rest, 1);
            let k = objective.k;
            let along = |c: usize| taps.iter().map(|(i, v)| v * x[i * k + c]).sum::<f64>();
            (0..k).map(|c| along(c).powi(2)).sum::<f64>().sqrt()
        };
        before[span] + rest * nodes.iter().zip(&weights).map(|(y, w)| w * ds(*y)).sum::<f64>()
    };
    at.iter().map(|u| part(*u)).collect()
}

/// Length of the curve.
pub(crate) fn length(objective: &Objective, x: &[f64]) -> f64 {
    let spans = 0..objective.axis.spans();
    spans.map(|i| objective.speeds(i, x).iter().map(|(s, w)| s * w).sum::<f64>()).sum()
}

/// The places (knot units, ascending, different) between which a curve's length is to be shared out.
pub(crate) fn places(axis: &Axis, at: impl Iterator<Item = f64>) -> Vec<f64> {
    let n = axis.spans() as f64;
    let closed = axis.boundary() == Boundary::Periodic;
    let mut places: Vec<f64> =
        at.map(|t| axis.to_knots(t)).map(|u| if closed { u.rem_euclid(n) } else { u.clamp(0.0, n) }).collect();
    places.sort_by(f64::total_cmp);
    places.dedup_by(|b, a| *b - *a < 1e-6);
    if closed && places.len() > 1 && places[0] + n - places[places.len() - 1] < 1e-6 {
        places.pop();
    }
    places
}

/// Sets the wanted speeds by the arc lengths of `x` at the places; returns the largest relative change of one.
pub(crate) fn set(objective: &mut Objective, x: &[f64], places: &[f64]) -> f64 {
    let axis = objective.axis;
    let n = axis.spans() as f64;
    let total = length(objective, x);
    let closed = axis.boundary() == Boundary::Periodic;
    // Knots of the interpolation: parameter, arc length; of closed curves three rounds, the middle one is used.
    let mut knots: Vec<[f64; 2]> =
        places.iter().copied().zip(lengths(objective, x, places)).map(|(u, s)| [u, s]).collect();
    if closed {
        let once = knots.clone();
        let round = |by: f64| once.iter().map(move |k| [k[0] + by * n, k[1] + by * total]).collect::<Vec<_>>();
        knots = [round(-1.0), once.clone(), round(1.0)].concat();
    }
    let mean = total / n;
    let secant = |i: usize| (knots[i + 1][1] - knots[i][1]) / (knots[i + 1][0] - knots[i][0]);
    let count = knots.len();
    let slope = |i: usize| match i {
        0 => secant(0),
        i if i + 1 == count => secant(count - 2),
        i => {
            let (a, b) = (knots[i][0] - knots[i - 1][0], knots[i + 1][0] - knots[i][0]);
            let (p, q) = (secant(i - 1), secant(i));
            (3.0 * (a + b)) / ((2.0 * b + a) / p + (b + 2.0 * a) / q)
        }
    };
    let speed = |u: f64| {
        if count < 2 {
            return mean;
        }
        let i = knots.partition_point(|k| k[0] <= u).clamp(1, count - 1) - 1;
        let (a, b) = (knots[i], knots[i + 1]);
        let x = ((u - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0);
        let (s0, s1) = (slope(i), slope(i + 1));
        6.0 * x * (1.0 - x) * secant(i) + (1.0 - x) * (1.0 - 3.0 * x) * s0 + x * (3.0 * x - 2.0) * s1
    };
    let wanted: Vec<[f64; 3]> =
        (0..axis.spans()).map(|i| PACES.map(|x| speed(i as f64 + x).max(1e-3 * mean) / mean)).collect();
    let change = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).fold(0.0, |m: f64, g| m.max((a[g] / b[g] - 1.0).abs()));
    let most = objective.wanted.iter().zip(&wanted).map(change).fold(0.0, f64::max);
    objective.wanted = wanted;
    most
}
