//! Free splines: lossless both ways, exact conversion where there is one, honest fits elsewhere.

use ondelette_modeling::Axis;
use ondelette_modeling::free::{Fit, FreeCurve, FreeSurface, Knots};
use ondelette_modeling::shape::{Curve, ParametricCurve, ParametricSurface, Surface};
use ondelette_wavelet::Boundary::{self, Mirrored, Open, Periodic};

fn wavy(count: usize) -> Vec<[f64; 3]> {
    (0..count).map(|i| i as f64).map(|x| [x + (2.1 * x).sin(), (1.3 * x).cos() * 2.0, (0.7 * x * x).sin()]).collect()
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

fn steps([a, b]: [f64; 2], n: usize) -> impl Iterator<Item = f64> {
    (0..=n).map(move |k| a + (b - a) * k as f64 / n as f64)
}

fn uniform(boundary: Boundary, spans: usize) -> Curve {
    let axis = Axis::new(boundary, spans, [0.3, 4.7]).unwrap();
    Curve::new(axis, 3, wavy(axis.len())).unwrap()
}

#[test]
fn uniform_curves_go_out_and_come_back() {
    for (boundary, spans) in [(Open, 1), (Open, 7), (Open, 48), (Mirrored, 9), (Periodic, 12)] {
        let curve = uniform(boundary, spans);
        let free = FreeCurve::from(&curve);
        for t in steps([0.3, 4.7], 77) {
            let t = if boundary == Periodic { t.min(4.7 - 1e-9) } else { t };
            assert!(apart(free.point(t), curve.point(t)) < 1e-12 * 50.0);
            assert!(apart(free.jet(t).first, curve.jet(t).first) < 1e-9);
        }
        let back = free.exactly_uniform().expect("its knots are uniform");
        if boundary == Mirrored {
            assert_eq!(back.axis().boundary(), Open);
        } else {
            assert_eq!(back.axis(), curve.axis());
            let worst = back.points().iter().zip(curve.points()).map(|(&a, &b)| apart(a, b)).fold(0.0, f64::max);
            assert!(worst < 1e-11, "{boundary} {spans}: {worst}");
        }
    }
}

#[test]
fn bezier_chains_that_are_smooth_are_uniform_curves_again() {
    // What an SVG file holds of a spline: its Bezier spans.
    for (boundary, spans) in [(Open, 6), (Periodic, 9)] {
        let curve = uniform(boundary, spans);
        let mut points = vec![curve.bezier(0)[0]];
        (0..spans).for_each(|i| points.extend_from_slice(&curve.bezier(i)[1..]));
        let breaks: Vec<f64> = (0..=spans).map(|i| i as f64).collect();
        let chain = FreeCurve::new(3, Knots::bezier(3, &breaks).unwrap(), points.clone(), None).unwrap();
        let back = chain.exactly_uniform().expect("its pieces join smoothly");
        assert_eq!(back.axis().boundary(), boundary);
        let worst = back.points().iter().zip(curve.points()).map(|(&a, &b)| apart(a, b)).fold(0.0, f64::max);
        assert!(worst < 1e-11, "{worst}");
        // One point off: a kink, and no conversion.
        points[4][0] += 1e-3;
        let kink = FreeCurve::new(3, Knots::bezier(3, &breaks).unwrap(), points, None).unwrap();
        assert!(kink.exactly_uniform().is_none());
        let fit = kink.to_uniform(&Fit { tolerance: 1e-4, most_spans: 4096 }).unwrap();
        assert!(!fit.exact && fit.deviation < 1e-4 && fit.deviation > 0.0, "{}", fit.deviation);
    }
}

#[test]
fn lower_degrees_convert_when_they_can() {
    let line = FreeCurve::new(2, Knots::new(1, vec![0.0, 0.0, 3.0, 3.0], 2).unwrap(), wavy(2), None).unwrap();
    let cubic = line.exactly_uniform().unwrap();
    assert!(apart(cubic.point(1.2), line.point(1.2)) < 1e-15);
    let parabola = FreeCurve::new(3, Knots::bezier(2, &[0.0, 1.0]).unwrap(), wavy(3), None).unwrap();
    let cubic = parabola.exactly_uniform().unwrap();
    assert!(apart(cubic.point(0.3), parabola.point(0.3)) < 1e-15);
    // A quadratic spline has jumps of the second derivative.
    let bend = FreeCurve::new(3, Knots::new(2, vec![0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0], 4).unwrap(), wavy(4), None);
    assert!(bend.unwrap().exactly_uniform().is_none());
}

#[test]
fn any_degree_evaluates_with_derivatives_and_takes_knots() {
    for degree in 1..=7 {
        let count = degree + 5;
        let mut knots = vec![0.0; degree + 1];
        knots.extend([0.4, 1.0, 1.7, 2.9]);
        knots.extend(vec![3.5; degree + 1]);
        let weights: Vec<f64> = (0..count).map(|i| 1.0 + 0.3 * (i as f64).sin()).collect();
        for weights in [None, Some(weights)] {
            let knots = Knots::new(degree, knots.clone(), count).unwrap();
            let curve = FreeCurve::new(3, knots, wavy(count), weights).unwrap();
            let finer = curve.with_knot(1.3).unwrap().with_knot(0.4).unwrap_or_else(|_| curve.with_knot(1.3).unwrap());
            for t in [0.01, 0.39, 0.8, 1.31, 2.0, 3.3] {
                assert!(apart(curve.point(t), finer.point(t)) < 1e-11, "degree {degree}");
                let h = 1e-5;
                let slope = |f: &dyn Fn(f64) -> [f64; 3]| -> [f64; 3] {
                    let (a, b) = (f(t - h), f(t + h));
                    std::array::from_fn(|c| (b[c] - a[c]) / (2.0 * h))
                };
                let jet = curve.jet(t);
                assert!(apart(slope(&|t| curve.jet(t).point), jet.first) < 1e-6);
                assert!(apart(slope(&|t| curve.jet(t).first), jet.second) < 1e-4);
                assert!(apart(slope(&|t| curve.jet(t).second), jet.third) < 1e-2);
            }
            let line = curve.tessellate(1e-3).unwrap();
            for (t, p) in line.parameters.windows(2).zip(line.points.windows(2)) {
                let chord = std::array::from_fn(|c| 0.5 * (p[0][c] + p[1][c]));
                assert!(apart(chord, curve.point(0.5 * (t[0] + t[1]))) < 1e-3);
            }
            let back = curve.reversed().reversed();
            assert!(apart(back.point(1.1), curve.point(1.1)) < 1e-13);
            assert!(apart(curve.reversed().point(3.5 - 1.1), curve.point(1.1)) < 1e-13);
        }
    }
}

#[test]
fn a_rational_circle_is_fitted_within_what_is_reported() {
    let half = 0.5_f64.sqrt();
    let corners = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]];
    let points = corners.map(|[x, y]| [f64::from(x), f64::from(y), 0.0]).to_vec();
    let weights = (0..9).map(|i| if i % 2 == 1 { half } else { 1.0 }).collect();
    let circle =
        FreeCurve::new(2, Knots::bezier(2, &[0.0, 1.0, 2.0, 3.0, 4.0]).unwrap(), points, Some(weights)).unwrap();
    let fit = circle.to_uniform(&Fit { tolerance: 1e-7, most_spans: 1024 }).unwrap();
    assert!(!fit.exact && fit.deviation < 1e-7);
    assert_eq!(fit.shape.axis().boundary(), Periodic);
    let worst = steps([0.0, 4.0], 1000)
        .map(|t| (fit.shape.point(t)[0].hypot(fit.shape.point(t)[1]) - 1.0).abs())
        .fold(0.0, f64::max);
    assert!(worst <= fit.deviation * 1.01, "{worst} off the circle, {} reported", fit.deviation);
}

#[test]
fn surfaces_go_out_and_come_back_and_fit() {
    for (boundaries, spans) in [([Open, Open], [6, 4]), ([Periodic, Open], [8, 3]), ([Open, Periodic], [1, 5])] {
        let axes = [0, 1].map(|a| Axis::new(boundaries[a], spans[a], [0.0, 1.0 + a as f64]).unwrap());
        let surface = Surface::new(axes, 3, wavy(axes[0].len() * axes[1].len())).unwrap();
        let free = FreeSurface::from(&surface);
        let back = free.exactly_uniform().unwrap();
        assert_eq!(back.axes(), surface.axes());
        let worst = back.points().iter().zip(surface.points()).map(|(&a, &b)| apart(a, b)).fold(0.0, f64::max);
        assert!(worst < 1e-9, "{worst}");
        let finer = free.with_knot(0, 0.371_234_567).unwrap().with_knot(1, 0.9).unwrap();
        for (s, t) in [(0.1, 0.2), (0.37, 0.9), (0.99, 1.7)] {
            let (a, b) = (free.jet(s, t), finer.jet(s, t));
            assert!(apart(a.point, b.point) < 1e-10 && apart(a.second[1], b.second[1]) < 1e-6);
        }
        assert!(finer.exactly_uniform().is_none(), "that knot is on no coarse grid");
    }
    // A quarter of a cylinder, with weights.
    let half = 0.5_f64.sqrt();
    let knots = [Knots::bezier(2, &[0.0, 1.0]).unwrap(), Knots::bezier(1, &[0.0, 2.0]).unwrap()];
    let arc = [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let points = arc.iter().flat_map(|p| [[p[0], p[1], 0.0], [p[0], p[1], 5.0]]).collect();
    let weights = [1.0, 1.0, half, half, 1.0, 1.0].to_vec();
    let cylinder = FreeSurface::new(knots, points, Some(weights)).unwrap();
    let jet = cylinder.jet(0.3, 0.7);
    assert!((jet.point[0].hypot(jet.point[1]) - 1.0).abs() < 1e-15);
    let curvature = jet.curvature().unwrap();
    assert!(curvature.gaussian.abs() < 1e-12 && (curvature.mean.abs() - 0.5).abs() < 1e-12, "{curvature:?}");
    let fit = cylinder.to_uniform(&Fit { tolerance: 1e-6, most_spans: 64 }).unwrap();
    assert!(!fit.exact && fit.deviation < 1e-6);
}

#[test]
fn wrong_knots_and_weights_are_refused() {
    assert!(Knots::new(0, vec![0.0, 1.0], 1).is_err());
    assert!(Knots::new(3, vec![0.0; 8], 4).unwrap_err().to_string().contains("repeated"));
    assert!(Knots::new(1, vec![0.0, 0.0, 0.0, 1.0], 2).is_err());
    assert!(Knots::new(3, vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 4.5, 7.0], 4).unwrap_err().to_string().contains("knot 6"));
    assert!(Knots::new(2, vec![0.0, 0.0, 0.0, f64::NAN, 1.0, 1.0, 1.0], 4).is_err());
    assert!(Knots::new(3, vec![0.0; 3], 4).is_err());
    let knots = Knots::bezier(3, &[0.0, 1.0]).unwrap();
    let weights = |w: f64| FreeCurve::new(2, knots.clone(), wavy(4), Some(vec![1.0, w, 1.0, 1.0]));
    assert!(weights(0.0).is_err() && weights(-1.0).is_err() && weights(f64::NAN).is_err());
    assert!(weights(1.0).unwrap().weights().is_none());
    assert!(FreeCurve::new(1, knots, wavy(4), None).is_err());
    assert!(Knots::bezier(3, &[]).is_err() && Knots::bezier(3, &[1.0]).is_err());
}
