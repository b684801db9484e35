//! Minimum-energy and minimum-variation curves against curves that are known.

use ondelette_modeling::Axis;
use ondelette_modeling::constraint::{Constraint, Demand};
use ondelette_modeling::intrinsic::{IntrinsicCurve, IntrinsicError, IntrinsicSolver, Minimum};
use ondelette_modeling::shape::{Curve, ParametricCurve};
use ondelette_wavelet::Boundary;
use std::f64::consts::{PI, TAU};

fn through(i: usize, t: f64, p: &[f64]) -> Constraint {
    Constraint::new(format!("p{i}"), &[t], Demand::Position(p.iter().copied().map(Some).collect()))
}

fn tangent(id: &str, t: f64, d: &[f64]) -> Constraint {
    Constraint::new(id, &[t], Demand::Derivative(0, d.iter().copied().map(Some).collect()))
}

fn find(axis: Axis, k: usize, constraints: &[Constraint], minimum: Minimum) -> IntrinsicCurve {
    let found = IntrinsicSolver::new(axis, k, constraints, minimum, 1e-8).unwrap().run();
    assert!(found.converged, "{:?} after {}", found.notes, found.iterations);
    for r in found.residuals.iter().filter(|r| !r.soft) {
        assert!(r.miss.abs() < 1e-9, "{}: {}", r.id, r.miss);
    }
    found
}

fn samples(curve: &Curve, count: usize) -> impl Iterator<Item = f64> {
    let [a, b] = curve.domain();
    (0..=count).map(move |i| a + (b - a) * i as f64 / count as f64)
}

#[test]
fn four_points_of_a_circle_give_the_circle() {
    let axis = |spans| Axis::new(Boundary::Periodic, spans, [0.0, 1.0]).unwrap();
    let corner = |i: usize| [7.0 + 2.0 * (TAU * i as f64 / 4.0).cos(), 2.0 * (TAU * i as f64 / 4.0).sin() - 3.0];
    let points: Vec<Constraint> = (0..4).map(|i| through(i, i as f64 / 4.0, &corner(i))).collect();
    for spans in [128, 130, 512] {
        let found = find(axis(spans), 2, &points, Minimum::Variation);
        for t in samples(&found.curve, 997) {
            let p = found.curve.point(t);
            let miss = (p[0] - 7.0).hypot(p[1] + 3.0) / 2.0 - 1.0;
            assert!(miss.abs() < 1e-6, "{spans} spans, {t}: {miss}");
        }
        assert!(found.functional < 1e-9);
    }
    // Parameters that do not fit the circle only change how fast it is run through.
    let uneven: Vec<Constraint> =
        [0.0, 0.2, 0.5, 0.8].iter().enumerate().map(|(i, t)| through(i, *t, &corner(i))).collect();
    let found = find(axis(256), 2, &uneven, Minimum::Variation);
    for t in samples(&found.curve, 997) {
        let p = found.curve.point(t);
        assert!(((p[0] - 7.0).hypot(p[1] + 3.0) / 2.0 - 1.0).abs() < 5e-5);
    }
    // In space too, tilted.
    let tilted: Vec<Constraint> =
        (0..4).map(|i| through(i, i as f64 / 4.0, &[corner(i)[0], 0.6 * corner(i)[1], 0.8 * corner(i)[1]])).collect();
    let found = find(axis(128), 3, &tilted, Minimum::Variation);
    for t in samples(&found.curve, 997) {
        let p = found.curve.point(t);
        let r = ((p[0] - 7.0).powi(2) + (p[1] + 1.8).powi(2) + (p[2] + 2.4).powi(2)).sqrt();
        assert!((r / 2.0 - 1.0).abs() < 1e-6, "{t}: {r}");
    }
}

/// The clothoid of curvature a + b s from the origin, by Simpson's rule on fine steps.
fn clothoid(a: f64, b: f64, s: f64) -> [f64; 2] {
    let n = 4000;
    let h = s / f64::from(n);
    let angle = |s: f64| a * s + 0.5 * b * s * s;
    (0..n).fold([0.0; 2], |p, i| {
        let s = h * f64::from(i);
        let at = [angle(s), angle(s + 0.5 * h), angle(s + h)];
        let rule = |f: fn(f64) -> f64| h / 6.0 * (f(at[0]) + 4.0 * f(at[1]) + f(at[2]));
        [p[0] + rule(f64::cos), p[1] + rule(f64::sin)]
    })
}

#[test]
fn points_of_a_clothoid_give_linear_curvature() {
    // Curvature s from -2 to 3: 0.25 rad of turning or less between points, from the left-hand to the right-hand coil.
    let turning = |s: f64| 0.5 * s * s.abs();
    let (from, to) = (-2.0_f64, 3.0_f64);
    let count = 30;
    let place = |i: usize| {
        let angle = turning(from) + (turning(to) - turning(from)) * i as f64 / f64::from(count as u8);
        angle.signum() * (2.0 * angle.abs()).sqrt()
    };
    let points: Vec<[f64; 2]> = (0..=count).map(|i| clothoid(from, 1.0, place(i) - from)).collect();
    assert!(turning(place(1)) - turning(place(0)) < 0.25);
    // Parameters by chords, as someone would who knows only the points.
    let mut at = vec![0.0];
    for w in points.windows(2) {
        at.push(at[at.len() - 1] + (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1]));
    }
    let whole = at[at.len() - 1];
    let mut rows: Vec<Constraint> =
        points.iter().zip(&at).enumerate().map(|(i, (p, t))| through(i, t / whole, p)).collect();
    // Without ends that are told how to bend, curvature would level off towards them.
    let angle = 0.5 * (to * to - from * from);
    rows.push(tangent("from", 0.0, &[1.0, 0.0]));
    rows.push(tangent("to", 1.0, &[angle.cos(), angle.sin()]));
    rows.push(Constraint::new("k from", &[0.0], Demand::Curvature(from)));
    rows.push(Constraint::new("k to", &[1.0], Demand::Curvature(to)));
    let axis = Axis::new(Boundary::Open, 1024, [0.0, 1.0]).unwrap();
    let found = find(axis, 2, &rows, Minimum::Variation);
    assert!((found.length - 5.0).abs() < 1e-4 && (found.functional / 5.0 - 1.0).abs() < 1e-3);
    // Curvature over arc length.
    let (mut s, mut last, mut worst) = (from, 0.0, 0.0_f64);
    for t in samples(&found.curve, 4096) {
        let speed = |t: f64| found.curve.jet(t).first.iter().map(|v| v * v).sum::<f64>().sqrt();
        s += (t - last) / 6.0 * (speed(last) + 4.0 * speed(0.5 * (t + last)) + speed(t));
        last = t;
        worst = worst.max((found.curve.jet(t).signed_curvature().unwrap() - s).abs());
    }
    assert!(worst < 1e-4, "{worst:e}");
}

#[test]
fn tangents_and_normals_hold_directions() {
    // Symmetric tangents of angle a against the chord: squared curvature of the free elastica is proportional to the
    // cosine of the tangent's angle (Horn 1983), so that its energy is I^2 / chord, I the integral of the root of the
    // cosine over -a .. a.
    let a = PI / 3.0;
    let n = 2000;
    let at = |i: usize| (a * (i as f64 / f64::from(n) - 0.5) * 2.0).cos().sqrt();
    let simpson = |i: usize| {
        if i == 0 || i == n as usize {
            1.0
        } else if i % 2 == 1 {
            4.0
        } else {
            2.0
        }
    };
    let i: f64 = (0..=n as usize).map(|i| simpson(i) * at(i)).sum::<f64>() * 2.0 * a / f64::from(n) / 3.0;
    let ends = |a: f64| {
        [
            through(0, 0.0, &[-1.0, 0.0]),
            tangent("up", 0.0, &[5.0 * a.cos(), 5.0 * a.sin()]),
            through(1, 1.0, &[1.0, 0.0]),
            tangent("down", 1.0, &[0.1 * a.cos(), -0.1 * a.sin()]),
        ]
    };
    let axis = Axis::new(Boundary::Open, 128, [0.0, 1.0]).unwrap();
    let found = find(axis, 2, &ends(a), Minimum::Energy);
    assert!((found.functional / (i * i / 2.0) - 1.0).abs() < 1e-6, "{} {}", found.functional, i * i / 2.0);
    let ends = ends(PI / 2.0);
    // The variation's own between the same tangents is the half circle, at no cost.
    let found = find(axis, 2, &ends, Minimum::Variation);
    assert!(
        found.functional < 1e-10 && (found.length / PI - 1.0).abs() < 1e-6,
        "{} {}",
        found.functional,
        found.length
    );
    // A normal says the same as a tangent without a sense.
    let normal = |id: &str, t: f64| Constraint::new(id, &[t], Demand::Normal(vec![1.0, 0.0]));
    let ends = [ends[0].clone(), normal("a", 0.0), through(2, 0.5, &[0.0, 1.0]), normal("b", 1.0), ends[2].clone()];
    let found = find(axis, 2, &ends, Minimum::Variation);
    assert!((found.length / PI - 1.0).abs() < 1e-6);
}

#[test]
fn soft_points_give_way_to_fairness() {
    let axis = Axis::new(Boundary::Open, 64, [0.0, 1.0]).unwrap();
    let off = |w: f64| {
        let bump = through(9, 0.5, &[0.0, 1.3]).soft(w);
        let rows = [through(0, 0.0, &[-1.0, 0.0]), tangent("t", 0.0, &[0.0, 1.0]), bump, through(1, 1.0, &[1.0, 0.0])];
        let found = find(axis, 2, &rows, Minimum::Variation);
        (found.curve.point(0.5)[1] - 1.3).abs()
    };
    let (weak, strong) = (off(1e-3), off(1e3));
    assert!(weak > 0.1 && strong < 1e-2 && strong > 0.0, "{weak} {strong}");
}

#[test]
fn what_has_no_minimum_says_so() {
    let ring = Axis::new(Boundary::Periodic, 32, [0.0, 1.0]).unwrap();
    let open = Axis::new(Boundary::Open, 32, [0.0, 1.0]).unwrap();
    let new = |axis, k, rows: &[Constraint], minimum| IntrinsicSolver::new(axis, k, rows, minimum, 1e-8);
    // One point, or a line there and back: no curve to begin with.
    let one = [through(0, 0.0, &[1.0, 0.0])];
    assert!(matches!(new(ring, 2, &one, Minimum::Variation).err(), Some(IntrinsicError::Collapsed)));
    // A closed curve of free length grows; that is said, not hidden.
    let two = [through(0, 0.0, &[1.0, 0.0]), through(1, 0.25, &[0.0, 0.2]), through(2, 0.5, &[-1.0, 0.0])];
    let found = new(ring, 2, &two, Minimum::Energy).unwrap().run();
    assert!(!found.converged && found.curve.points().iter().flatten().all(|v| v.is_finite()));
    assert!(found.notes[0].contains("closed curves of free length") && found.notes[1].contains("without bound"));
    let heights = [through(0, 0.0, &[1.0]), through(1, 1.0, &[2.0])];
    assert!(matches!(new(open, 1, &heights, Minimum::Energy).err(), Some(IntrinsicError::Unfit(_))));
    let mirror = Axis::new(Boundary::Mirrored, 32, [0.0, 1.0]).unwrap();
    assert!(matches!(new(mirror, 2, &two, Minimum::Energy).err(), Some(IntrinsicError::Unfit(_))));
    let clash = [two[0].clone(), through(5, 0.0, &[2.0, 0.0]), two[2].clone()];
    assert!(new(open, 2, &clash, Minimum::Energy).err().unwrap().to_string().contains("contradicts"));
    let nan = [two[0].clone(), through(5, 0.3, &[f64::NAN, 0.0])];
    assert!(new(open, 2, &nan, Minimum::Energy).err().unwrap().to_string().contains("NaN"));
}
