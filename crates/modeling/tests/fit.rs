//! Fits against other solvers, and what they say when they cannot do what is asked.

use ondelette_modeling::constraint::{Constraint, Demand};
use ondelette_modeling::energy::Energy;
use ondelette_modeling::fit::{FairError, FitError, FitSettings, Scatter, curve, fair, surface};
use ondelette_modeling::solve::{Method, Settings, Solver};
use ondelette_modeling::system::Problem;
use ondelette_numerics::seed;

fn random(k: u64, i: u64) -> f64 {
    seed::unit(seed::combine(k, i))
}

/// Heights of a wave with some noise, on a domain of the given sides.
fn wave(count: u64, sides: [f64; 2]) -> (Vec<[f64; 2]>, Vec<f64>) {
    let of = |i: u64| {
        let [x, y] = [random(1, i), random(2, i)];
        ([sides[0] * x, sides[1] * y], (6.0 * x).sin() * (4.0 * y).cos() + 0.1 * (random(3, i) - 0.5))
    };
    (0..count).map(of).unzip()
}

#[test]
fn a_fit_is_the_least_of_its_sum_whatever_the_sides_of_the_domain() {
    for sides in [[1.0, 1.0], [30.0, 1.0], [1.0, 30.0], [1000.0, 1.0], [1.0, 1000.0], [1e6, 1.0]] {
        let (places, heights) = wave(200, sides);
        let (weight, stiffening) = (1e-5 * sides[0] * sides[1], 2.0);
        let settings = FitSettings {
            weight: Some(weight),
            stiffening: Some(stiffening),
            spans: Some(16),
            ..FitSettings::default()
        };
        let fit = surface(&Scatter::new(places.clone(), heights.clone()).unwrap(), settings).unwrap();
        assert!(fit.converged, "{sides:?}");
        let mean = heights.iter().sum::<f64>() / 200.0;
        let soft = |(i, (p, z)): (usize, (&[f64; 2], &f64))| {
            Constraint::new(i.to_string(), p, Demand::Position(vec![Some(z - mean)])).soft(1.0)
        };
        let rows = places.iter().zip(&heights).enumerate().map(soft).collect();
        let area: f64 = fit.space.axes().iter().map(|a| a.domain()[1] - a.domain()[0]).product();
        let energy = Energy::new(weight * stiffening * stiffening / area, weight, 0.0).unwrap();
        let problem = Problem::new(fit.space.clone(), 1, energy, None, rows).unwrap();
        let settings = Settings { method: Method::Cholesky, ..Settings::default() };
        let want = Solver::new(problem, settings).unwrap().run().unwrap();
        let pairs = fit.coefficients.iter().zip(&want.coefficients()[0]);
        let off = pairs.fold(0.0, |m: f64, (a, b)| m.max((a - mean - b).abs()));
        assert!(off < 1e-4, "{sides:?}: off by {off}");
    }
}

#[test]
fn a_long_domain_has_more_spans_along_than_across() {
    for (sides, want) in [
        ([1.0, 1.0], [32, 32]),
        ([1.3, 1.0], [32, 32]),
        ([16.0, 1.0], [128, 8]),
        ([1.0, 16.0], [8, 128]),
        ([1e4, 1.0], [256, 4]),
    ] {
        let (places, heights) = wave(200, sides);
        let given = FitSettings {
            weight: Some(1e-3 * sides[0] * sides[1]),
            stiffening: Some(1.0),
            domain: Some([[0.0, sides[0]], [0.0, sides[1]]]),
            ..FitSettings::default()
        };
        let fit = surface(&Scatter::new(places, heights).unwrap(), given).unwrap();
        assert_eq!(fit.space.axes().iter().map(|a| a.spans()).collect::<Vec<_>>(), want, "{sides:?}");
        assert!(fit.converged, "{sides:?}");
    }
}

#[test]
fn rounding_on_a_very_long_domain_is_no_lack_of_convergence() {
    // Cells of 4000 by 0.25: the stiffest shapes cost 1e30 times what the softest do.
    let (places, heights) = wave(150, [1e6, 1.0]);
    let given = FitSettings { weight: Some(4.6e7), stiffening: Some(316.0), ..FitSettings::default() };
    let fit = surface(&Scatter::new(places, heights.clone()).unwrap(), given).unwrap();
    assert_eq!(fit.space.axes().iter().map(|a| a.spans()).collect::<Vec<_>>(), [256, 4]);
    assert!(fit.converged);
    // So stiff that it is flat: no higher than the mean, and missed by as much as there is of the wave.
    let mean = heights.iter().sum::<f64>() / 150.0;
    let rms = (heights.iter().map(|z| (z - mean).powi(2)).sum::<f64>() / 150.0).sqrt();
    let (low, high) = fit.coefficients.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    assert!(fit.rms <= rms * (1.0 + 1e-9) && low > -1.2 && high < 1.2, "{} of {rms}, {low} to {high}", fit.rms);
}

#[test]
fn the_smoothing_of_a_long_domain_is_chosen_as_that_of_a_square_one() {
    // The same wave four times as long, with four times the points: as predictable as one square of it.
    let of = |i: u64| {
        let [x, y] = [4.0 * random(1, i), random(2, i)];
        ([x, y], (2.0 * x).sin() * (2.0 * y).cos() + 0.2 * (random(3, i) - 0.5))
    };
    let (places, heights) = (0..300).map(of).unzip();
    let fit = surface(&Scatter::new(places, heights).unwrap(), FitSettings::default()).unwrap();
    assert_eq!(fit.space.axes().iter().map(|a| a.spans()).collect::<Vec<_>>(), [128, 32]);
    // The noise is 0.058 rms.
    assert!(fit.converged && fit.validation.unwrap() < 0.075, "{:?}", fit.validation);
}

#[test]
fn a_fit_that_does_not_converge_says_so() {
    let (places, heights) = wave(300, [1.0, 1.0]);
    let settings =
        FitSettings { weight: Some(1e-12), stiffening: Some(0.0), spans: Some(32), ..FitSettings::default() };
    assert!(!surface(&Scatter::new(places, heights).unwrap(), settings).unwrap().converged);
}

#[test]
fn a_fit_that_hardly_smooths_is_right_or_says_that_it_is_not() {
    // Coefficients were off by more than all heights together from weights of 1e-12 on, and the fit was content.
    // Four spans need no iteration: their factor was believed whatever it was.
    let powers = [2, 4, 6, 7, 8, 9, 10, 11, 12, 13, 14, 16];
    for (count, spans, power) in powers.into_iter().flat_map(|p| [(150, 16, p), (20, 4, p), (150, 4, p)]) {
        let (places, heights) = wave(count, [1.0, 1.0]);
        let mean = heights.iter().sum::<f64>() / count as f64;
        let weight = 10.0_f64.powi(-power);
        let settings =
            FitSettings { weight: Some(weight), stiffening: Some(0.0), spans: Some(spans), ..FitSettings::default() };
        let fit = surface(&Scatter::new(places.clone(), heights.clone()).unwrap(), settings).unwrap();
        let soft = |(i, (p, z)): (usize, (&[f64; 2], &f64))| {
            Constraint::new(i.to_string(), p, Demand::Position(vec![Some(z - mean)])).soft(1.0 / weight)
        };
        let rows = places.iter().zip(&heights).enumerate().map(soft).collect();
        let problem = Problem::new(fit.space.clone(), 1, Energy::BEND, None, rows).unwrap();
        let want = Solver::new(problem, Settings::default()).and_then(Solver::run).unwrap();
        assert!(want.converged(), "{count} {spans} 1e-{power}");
        let pairs = fit.coefficients.iter().zip(&want.coefficients()[0]);
        let off = pairs.fold(0.0, |m: f64, (a, b)| m.max((a - mean - b).abs()));
        let size = want.coefficients()[0].iter().fold(0.0, |m: f64, b| m.max(b.abs()));
        assert!(fit.converged || power > 9, "{count} {spans} 1e-{power}: off by {off:e} of {size:e}");
        assert!(!fit.converged || off < 1e-4 * size, "{count} {spans} 1e-{power}: off by {off:e} of {size:e}");
    }
}

#[test]
fn what_is_given_leaves_the_other_free_even_where_no_search_would_go() {
    let (places, heights) = wave(300, [1.0, 1.0]);
    let scatter = Scatter::new(places, heights).unwrap();
    let fitted = |weight, stiffening| {
        let spans = Some(8);
        surface(&scatter, FitSettings { weight, stiffening, spans, ..FitSettings::default() }).unwrap()
    };
    let free = fitted(None, None).validation.unwrap();
    for stiffening in [0.0, 1e4] {
        let start = 1e-8 * 300.0;
        let fit = fitted(None, Some(stiffening));
        assert!((fit.weight / start).ln().abs() > 1.0, "stiffening {stiffening}: weight {} is the start", fit.weight);
        assert!(stiffening > 1.0 || fit.validation.unwrap() < 1.1 * free);
    }
    let fit = fitted(Some(1e7), None);
    assert_ne!(fit.stiffening, 10.0, "the start");
    let ring: Vec<Vec<f64>> = (0..60)
        .map(|i| {
            let r = 1.0 + 0.05 * (random(4, i) - 0.5);
            let a = i as f64 / 60.0 * std::f64::consts::TAU;
            vec![r * a.cos(), r * a.sin()]
        })
        .collect();
    let fit = curve(&ring, true, FitSettings { stiffening: Some(0.0), ..FitSettings::default() }).unwrap();
    assert!((fit.weight / (60.0 * 1e-8)).ln().abs() > 1.0, "{}", fit.weight);
}

#[test]
fn heights_without_squares_are_refused() {
    let places: Vec<[f64; 2]> = (0..20).map(|i| [random(1, i), random(2, i)]).collect();
    let scatter = Scatter::new(places.clone(), vec![1e200; 20]).unwrap();
    assert_eq!(surface(&scatter, FitSettings::default()).unwrap_err(), FitError::Large(1e200));
    let low = Scatter::new(places.clone(), places.iter().map(|p| 1e-200 * p[0]).collect()).unwrap();
    assert!(matches!(surface(&low, FitSettings::default()), Err(FitError::Small(v)) if v < 1e-200));
    let outline: Vec<Vec<f64>> = places.iter().map(|p| vec![1e150 * p[0], p[1]]).collect();
    assert!(matches!(curve(&outline, false, FitSettings::default()), Err(FitError::Large(_))));
}

#[test]
fn a_fair_curve_reaches_tolerances_far_below_the_noise_and_says_which_it_cannot() {
    let points: Vec<Vec<f64>> = (0..120)
        .map(|i| {
            let (a, r) = (i as f64 / 119.0 * std::f64::consts::PI, 1.0 + 0.04 * (random(5, i) - 0.5));
            vec![r * a.cos(), r * a.sin()]
        })
        .collect();
    for tolerance in [1e-4, 1e-6, 1e-9] {
        let found = fair(&points, tolerance).unwrap();
        assert!(found.largest_move <= tolerance && found.largest_move > 0.5 * tolerance);
    }
    let refused = fair(&points, 1e-18).unwrap_err();
    assert!(matches!(refused, FairError::Unreachable { .. }), "{refused}");
}

#[test]
fn generous_tolerances_give_fair_curves_too() {
    // Weights sank until no solver held the points, and the worst of those curves was the fairest by its energy.
    let line: Vec<Vec<f64>> = (0..40).map(|i| vec![f64::from(i), 2.0 * f64::from(i)]).collect();
    let rough: Vec<Vec<f64>> = line
        .iter()
        .zip(0..)
        .map(|(p, i)| vec![p[0] + 0.02 * (random(6, i) - 0.5), p[1] + 0.02 * (random(7, i) - 0.5)])
        .collect();
    let wing: Vec<Vec<f64>> = (0..60)
        .map(|i| {
            let a = f64::from(i) / 59.0 * std::f64::consts::TAU;
            let x = 0.5 * (1.0 + a.cos());
            vec![x, a.sin().signum() * 0.6 * (0.297 * x.sqrt() - 0.126 * x - 0.351 * x * x + 0.18 * x.powi(3))]
        })
        .collect();
    for (name, points) in [("line", &line), ("rough", &rough), ("wing", &wing)] {
        for tolerance in [0.03, 0.1, 0.5, 1.5, 10.0] {
            let found = fair(points, tolerance).unwrap();
            assert!(found.curve.converged(), "{name} {tolerance}: {:?}", found.curve.notes());
            assert!(found.largest_move <= tolerance, "{name} {tolerance}: {:e}", found.largest_move);
            let energy = found.curve.energy();
            assert!(
                tolerance < 0.5 || energy < 1e-9,
                "{name} {tolerance}: a parabola is as fair as can be, not {energy:e}"
            );
        }
    }
}

#[test]
fn numbers_out_of_all_proportion_are_named_for_what_they_are() {
    let (places, heights) = wave(200, [1.0, 1.0]);
    let data = Scatter::new(places.clone(), heights.clone()).unwrap();
    let with = |weight: f64| FitSettings { weight: Some(weight), stiffening: Some(0.0), ..FitSettings::default() };
    let lost = surface(&data, FitSettings { spans: Some(64), ..with(1e-300) });
    assert!(matches!(lost, Err(FitError::Lost { .. })), "{lost:?}");
    let far = places.iter().map(|p| [1e200 * p[0], p[1]]).collect();
    let far = surface(&Scatter::new(far, heights).unwrap(), FitSettings::default());
    assert!(matches!(far, Err(FitError::Large(v)) if v > 1e100), "{far:?}");
}

#[test]
fn exact_data_is_met_exactly_whatever_the_domain() {
    // What is left of constants, planes and a few points is nothing, and a share of nothing was asked of rounding.
    for (count, sides) in [(3, [1.0, 1.0]), (3, [400.0, 1.0]), (4, [1e-3, 1.0]), (5, [1.0, 90.0]), (100, [1.0, 200.0])]
    {
        let (places, _) = wave(count, sides);
        let plane = |p: &[f64; 2]| 3.0 + 2.0 * p[0] / sides[0] - p[1] / sides[1];
        for height in [&plane as &dyn Fn(&[f64; 2]) -> f64, &|_| 0.3] {
            let data = Scatter::new(places.clone(), places.iter().map(height).collect()).unwrap();
            for (weight, stiffening) in [(None, None), (None, Some(0.0)), (Some(1e-6 * sides[0] * sides[1]), Some(0.0))]
            {
                let fit = surface(&data, FitSettings { weight, stiffening, ..FitSettings::default() }).unwrap();
                assert!(fit.converged, "{count} {sides:?} {weight:?} {stiffening:?}");
                assert!(stiffening.is_none() || fit.rms < 1e-12, "{count} {sides:?} {weight:?}: {:e}", fit.rms);
            }
        }
    }
    // Few spans, which need no iteration.
    let (places, _) = wave(30, [1.0, 1.0]);
    let data = Scatter::new(places, vec![0.1; 30]).unwrap();
    for spans in [4, 8, 16] {
        assert!(surface(&data, FitSettings { spans: Some(spans), ..FitSettings::default() }).unwrap().converged);
    }
}

#[test]
fn a_tilt_that_no_point_sees_is_not_invented() {
    // Heights of 634 came from rounding, for data between -1 and 1.
    let line: Vec<[f64; 2]> = (0..40).map(|i| [f64::from(i) / 39.0, f64::from(i) / 78.0]).collect();
    let heights: Vec<f64> = line.iter().map(|p| (5.0 * p[0]).sin()).collect();
    let given = |stiffening| FitSettings { stiffening, ..FitSettings::default() };
    for count in [2, 3, 40] {
        let data = Scatter::new(line[..count].to_vec(), heights[..count].to_vec()).unwrap();
        assert_eq!(surface(&data, given(Some(0.0))).unwrap_err(), FitError::Line);
        let fit = surface(&data, given(None)).unwrap();
        let size = fit.coefficients.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        assert!(fit.converged && size < 5.0, "{count}: {size}");
    }
}

#[test]
fn a_weight_that_loses_an_outline_is_blamed_and_no_point_is() {
    let line: Vec<Vec<f64>> = (0..40).map(|i| vec![f64::from(i), (0.3 * f64::from(i)).sin()]).collect();
    for weight in [1e-25, 1e-60] {
        let settings = FitSettings { weight: Some(weight), stiffening: Some(0.0), ..FitSettings::default() };
        match curve(&line, false, settings) {
            Ok(fit) => assert!(!fit.converged || fit.rms < 1e-6, "{weight:e}: {:e}", fit.rms),
            Err(e) => assert_eq!(e, FitError::Lost { weight, stiffening: 0.0 }),
        }
    }
}
