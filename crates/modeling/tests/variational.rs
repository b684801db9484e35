//! Solvers against reference solutions, laws, and each other.

use ondelette_modeling::constraint::{Constraint, Demand};
use ondelette_modeling::energy::{Energy, Stiffness};
use ondelette_modeling::solve::{Iteration, Method, Settings, Solution, SolveError, Solver};
use ondelette_modeling::system::{Problem, ProblemError, Space};
use ondelette_modeling::{Axis, basis};
use ondelette_numerics::seed;
use ondelette_wavelet::Boundary;
use serde_json::Value;

const ALL: [Method; 6] =
    [Method::Spectral, Method::Banded, Method::Bpx, Method::Multigrid, Method::Wavelet, Method::Cholesky];

fn vectors() -> Value {
    serde_json::from_str(include_str!("data/variational.json")).unwrap()
}

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

/// The solution by a method; `None` where it does not apply.
fn solve(problem: &Problem, method: Method, tolerance: f64) -> Option<Solution> {
    let settings = Settings { method, tolerance, ..Settings::default() };
    match Solver::new(problem.clone(), settings).and_then(Solver::run) {
        Ok(solution) => Some(solution),
        Err(SolveError::Method { .. }) => None,
        Err(e) => panic!("{method}: {e}"),
    }
}

fn axis(boundary: Boundary, spans: usize) -> Axis {
    Axis::new(boundary, spans, [0.0, spans as f64]).unwrap()
}

fn point(i: usize, at: &[f64], value: f64) -> Constraint {
    Constraint::new(format!("p{i}"), at, Demand::Position(vec![Some(value)]))
}

fn far(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    a.iter().zip(b).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs())) / size
}

#[test]
fn every_method_finds_the_reference_solutions() {
    for entry in vectors()["problems"].as_array().unwrap() {
        let boundary = if entry["bc"] == "mirror" { Boundary::Mirrored } else { Boundary::Open };
        let axis = axis(boundary, 1 << entry["L"].as_u64().unwrap());
        let dim = entry["dim"].as_u64().unwrap() as usize;
        let space = if dim == 1 { Space::curve(axis) } else { Space::surface(axis, axis) };
        let points: Vec<f64> = entry["pts"]
            .as_array()
            .unwrap()
            .iter()
            .flat_map(|p| if p.is_array() { numbers(p) } else { vec![p.as_f64().unwrap()] })
            .collect();
        let values = numbers(&entry["b"]);
        let rows = points.chunks(dim).zip(&values).enumerate().map(|(i, (at, b))| point(i, at, *b)).collect();
        let problem = Problem::new(space, 1, Energy::BEND, None, rows).unwrap();
        let (x, energy) = (numbers(&entry["x"]), entry["energy"].as_f64().unwrap());
        let mut methods = 0;
        for method in ALL {
            let Some(solution) = solve(&problem, method, 1e-8) else { continue };
            methods += 1;
            let name = &entry["name"];
            assert!(solution.converged(), "{name} {method}");
            assert!(far(&solution.coefficients()[0], &x) < 1e-8, "{name} {method}");
            assert!((solution.energy() / energy - 1.0).abs() < 1e-9, "{name} {method}");
            assert!(solution.residuals().iter().all(|r| r.miss.abs() < 1e-12), "{name} {method}");
        }
        assert!(methods >= 4);
    }
}

#[test]
fn small_problems_of_the_thesis_with_derivatives() {
    let vectors = vectors();
    for entry in vectors["variational"]["curve"].as_array().unwrap() {
        let spans = 1 << entry["L"].as_u64().unwrap();
        let rows = entry["constraints"].as_array().unwrap().iter().enumerate().map(|(i, c)| {
            let value = vec![c["value"].as_f64()];
            let demand = if c["deriv"] == 1 { Demand::Derivative(0, value) } else { Demand::Position(value) };
            Constraint::new(format!("{i}"), &[c["t"].as_f64().unwrap()], demand)
        });
        let space = Space::curve(axis(Boundary::Mirrored, spans));
        let problem = Problem::new(space, 1, Energy::BEND, None, rows.collect()).unwrap();
        for method in [Method::Spectral, Method::Banded, Method::Bpx] {
            let solution = solve(&problem, method, 1e-10).unwrap();
            assert!(far(&solution.coefficients()[0], &numbers(&entry["x"])) < 1e-8, "{method}");
            assert!((solution.energy() / entry["energy"].as_f64().unwrap() - 1.0).abs() < 1e-8);
        }
    }
    for entry in vectors["variational"]["surface"].as_array().unwrap() {
        let a = axis(Boundary::Mirrored, 1 << entry["L"].as_u64().unwrap());
        let rows = entry["constraints"].as_array().unwrap().iter().enumerate().map(|(i, c)| {
            point(i, &[c["s"].as_f64().unwrap(), c["t"].as_f64().unwrap()], c["value"].as_f64().unwrap())
        });
        let problem = Problem::new(Space::surface(a, a), 1, Energy::BEND, None, rows.collect()).unwrap();
        for method in [Method::Spectral, Method::Bpx, Method::Cholesky] {
            let solution = solve(&problem, method, 1e-10).unwrap();
            assert!(far(&solution.coefficients()[0], &numbers(&entry["x"])) < 1e-8, "{method}");
        }
    }
}

#[test]
fn open_curves_are_natural_cubic_splines() {
    // Knots 0 .. n with a value on each: the natural spline, by its tridiagonal system.
    let n = 40;
    let y: Vec<f64> = (0..=n).map(|i| seed::unit(i as u64) - 0.5).collect();
    let problem = Problem::new(
        Space::curve(axis(Boundary::Open, n)),
        1,
        Energy::BEND,
        None,
        y.iter().enumerate().map(|(i, y)| point(i, &[i as f64], *y)).collect(),
    )
    .unwrap();
    // Second derivatives M: M_{i-1} + 4 M_i + M_{i+1} = 6 (y_{i-1} - 2 y_i + y_{i+1}), M_0 = M_n = 0.
    let mut m = vec![0.0; n + 1];
    let (mut c, mut d) = (vec![0.0; n + 1], vec![0.0; n + 1]);
    for i in 1..n {
        let w = 4.0 - c[i - 1];
        c[i] = 1.0 / w;
        d[i] = (6.0 * (y[i - 1] - 2.0 * y[i] + y[i + 1]) - d[i - 1]) / w;
    }
    for i in (1..n).rev() {
        m[i] = d[i] - c[i] * m[i + 1];
    }
    for method in [Method::Banded, Method::Bpx, Method::Cholesky, Method::Multigrid] {
        // Spans that do not halve often enough have no multilevel method.
        let Some(solution) = solve(&problem, method, 1e-10) else { continue };
        for i in 0..n {
            for x in [0.1, 0.5, 0.8] {
                let u = 1.0 - x;
                let want = u * y[i] + x * y[i + 1] + ((u * u * u - u) * m[i] + (x * x * x - x) * m[i + 1]) / 6.0;
                let got = solution.eval(&[i as f64 + x], [0, 0])[0];
                assert!((got - want).abs() < 1e-10, "{method} {i} {x}: {got} {want}");
            }
        }
    }
}

#[test]
fn open_energies_reproduce_the_polynomials_they_do_not_see() {
    let (s, t) =
        (Axis::new(Boundary::Open, 16, [-1.0, 3.0]).unwrap(), Axis::new(Boundary::Open, 8, [0.0, 1.0]).unwrap());
    let plane = |s: f64, t: f64| 0.3 - 2.0 * s + 5.0 * t;
    let quadric = |s: f64, t: f64| 1.0 + s - t + s * s - 3.0 * s * t + 0.5 * t * t;
    let places = [[-1.0, 0.0], [3.0, 0.0], [-1.0, 1.0], [2.5, 0.9], [0.3, 0.4], [1.1, 0.7], [2.0, 0.1], [-0.4, 0.6]];
    let variation = Energy::new(0.0, 0.0, 1.0).unwrap();
    for (energy, f) in [(Energy::BEND, &plane as &dyn Fn(f64, f64) -> f64), (variation, &quadric)] {
        let rows = places.iter().enumerate().map(|(i, p)| point(i, p, f(p[0], p[1]))).collect();
        let problem = Problem::new(Space::surface(s, t), 1, energy, None, rows).unwrap();
        for method in [Method::Auto, Method::Bpx, Method::Multigrid, Method::Wavelet, Method::Cholesky] {
            let Some(solution) = solve(&problem, method, 1e-12) else { continue };
            for i in 0..=10 {
                for j in 0..=10 {
                    let (a, b) = (-1.0 + 0.4 * f64::from(i), 0.1 * f64::from(j));
                    let got = solution.eval(&[a, b], [0, 0])[0];
                    assert!((got - f(a, b)).abs() < 1e-9, "{method} ({a}, {b}): {got} {}", f(a, b));
                }
            }
        }
    }
}

#[test]
fn every_bicubic_is_reproduced_by_interpolation() {
    // As many values as coefficients, none smoothed: the fit of zero weight.
    let (s, t) =
        (Axis::new(Boundary::Open, 6, [-1.0, 3.0]).unwrap(), Axis::new(Boundary::Open, 4, [0.0, 1.0]).unwrap());
    // Means of three neighbouring knots: one place a function.
    let places = |a: &Axis| -> Vec<f64> {
        let knot = |i: usize| (i as f64 - 2.0).clamp(0.0, a.spans() as f64);
        (0..a.len()).map(|j| a.from_knots((knot(j) + knot(j + 1) + knot(j + 2)) / 3.0)).collect()
    };
    for (p, q) in (0..4).flat_map(|p| (0..4).map(move |q| (p, q))) {
        let f = |s: f64, t: f64| (0.5 * s).powi(p) * t.powi(q);
        let at: Vec<[f64; 2]> = places(&s).iter().flat_map(|s| places(&t).into_iter().map(|t| [*s, t])).collect();
        let rows = at.iter().enumerate().map(|(i, at)| point(i, at, f(at[0], at[1]))).collect();
        let problem = Problem::new(Space::surface(s, t), 1, Energy::BEND, None, rows).unwrap();
        let solution = solve(&problem, Method::Cholesky, 1e-12).unwrap();
        for (i, j) in (0..=20).flat_map(|i| (0..=20).map(move |j| (i, j))) {
            let (a, b) = (-1.0 + 0.2 * f64::from(i), 0.05 * f64::from(j));
            let miss = solution.eval(&[a, b], [0, 0])[0] - f(a, b);
            assert!(miss.abs() < 1e-12 * 1.5_f64.powi(3), "s^{p} t^{q} at ({a}, {b}): {miss:e}");
        }
    }
}

#[test]
fn normals_couple_the_coordinates_and_free_coordinates_stay_free() {
    let a = Axis::new(Boundary::Open, 8, [0.0, 1.0]).unwrap();
    let corner = |i: usize, s: f64, t: f64, z: f64| {
        Constraint::new(format!("c{i}"), &[s, t], Demand::Position(vec![Some(s), Some(t), Some(z)]))
    };
    let rows = vec![
        corner(0, 0.0, 0.0, 0.0),
        corner(1, 1.0, 0.0, 0.0),
        corner(2, 0.0, 1.0, 0.0),
        corner(3, 1.0, 1.0, 0.5),
        Constraint::new("n", &[0.4, 0.6], Demand::Normal(vec![0.3, -0.2, 1.0])),
        Constraint::new("z", &[0.5, 0.5], Demand::Position(vec![None, None, Some(0.3)])),
        Constraint::new("soft", &[0.2, 0.8], Demand::Position(vec![None, Some(0.7), Some(0.1)])).soft(30.0),
    ];
    let problem = Problem::new(Space::surface(a, a), 3, Energy::BEND, None, rows).unwrap();
    let exact = solve(&problem, Method::Cholesky, 1e-10).unwrap();
    for method in [Method::Auto, Method::Bpx, Method::Multigrid, Method::Cholesky] {
        let solution = solve(&problem, method, 1e-10).unwrap();
        assert!(solution.converged());
        for r in solution.residuals().iter().filter(|r| !r.soft) {
            assert!(r.miss.abs() < 1e-12, "{method}: {} misses by {}", r.id, r.miss);
        }
        let (ds, dt) = (solution.eval(&[0.4, 0.6], [1, 0]), solution.eval(&[0.4, 0.6], [0, 1]));
        for d in [ds, dt] {
            assert!((0.3 * d[0] - 0.2 * d[1] + d[2]).abs() < 1e-12);
        }
        for (x, y) in solution.coefficients().iter().zip(exact.coefficients()) {
            assert!(far(x, y) < 1e-8, "{method}");
        }
    }
}

#[test]
fn soft_rows_balance_energy_and_misses() {
    // One soft value against one hard one and a slope: check the first-order condition by comparing energies.
    let a = Axis::new(Boundary::Open, 12, [0.0, 1.0]).unwrap();
    let value = |y: f64| {
        let rows = vec![point(0, &[0.0], 0.0), point(1, &[1.0], 0.0), point(2, &[0.5], y)];
        let problem = Problem::new(Space::curve(a), 1, Energy::BEND, None, rows).unwrap();
        solve(&problem, Method::Banded, 1e-12).unwrap().energy()
    };
    // E = k y^2 through y at the middle; with weight w the best is y = w / (k + w).
    let (k, w) = (value(1.0), 7.0);
    let rows = vec![point(0, &[0.0], 0.0), point(1, &[1.0], 0.0), point(2, &[0.5], 1.0).soft(w)];
    let problem = Problem::new(Space::curve(a), 1, Energy::BEND, None, rows).unwrap();
    for method in [Method::Banded, Method::Bpx, Method::Multigrid, Method::Cholesky] {
        let Some(solution) = solve(&problem, method, 1e-10) else { continue };
        let got = solution.eval(&[0.5], [0, 0])[0];
        assert!((got - w / (k + w)).abs() < 1e-9, "{method}: {got}, {}", w / (k + w));
    }
}

#[test]
fn redundant_rows_are_named_and_conflicts_refused() {
    let a = axis(Boundary::Open, 8);
    let rows = |third: f64| vec![point(0, &[2.0], 1.0), point(1, &[5.0], 2.0), point(2, &[2.0], third)];
    let problem = |third| Problem::new(Space::curve(a), 1, Energy::BEND, None, rows(third)).unwrap();
    let solution = solve(&problem(1.0), Method::Auto, 1e-8).unwrap();
    assert!(solution.notes().iter().any(|n| n.contains("p2") && n.contains("p0")), "{:?}", solution.notes());
    match Solver::new(problem(1.5), Settings::default()) {
        Err(SolveError::Problem(ProblemError::Conflict { id, others, miss })) => {
            assert_eq!((id.as_str(), others.as_str()), ("p2", "p0"));
            assert!((miss - 0.5).abs() < 1e-9);
        }
        other => panic!("{:?}", other.map(|_| ())),
    }
    // A dozen values on four coefficients.
    let dense = (0..12).map(|i| point(i, &[0.9 * i as f64 / 12.0], 0.0)).collect();
    let problem = Problem::new(Space::curve(a), 1, Energy::BEND, None, dense).unwrap();
    let solution = solve(&problem, Method::Auto, 1e-8).unwrap();
    assert_eq!(solution.notes().len(), 8);
}

#[test]
fn creases_and_stiff_regions_have_one_solution_for_all_methods() {
    let n = 32;
    let a = axis(Boundary::Open, n);
    let space = Space::surface(a, a);
    for (low, high) in [(1e-4, 1.0), (1.0, 1e4)] {
        let factor = |i: usize, j: usize| if i == 11 || (i > 20 && j > 20) { (low, high) } else { (1.0, 1.0) };
        let factors = (0..n * n).map(|c| factor(c / n, c % n)).map(|(l, h)| l * h).collect();
        let map = Stiffness::new(n * n, factors).unwrap();
        let rows = (0..23).map(|i| {
            let at = |k: u64| (seed::unit(seed::combine(k, i as u64)) * n as f64 * 8.0).round() / 8.0;
            point(i, &[at(1), at(2)], seed::unit(i as u64 + 99) - 0.5)
        });
        let problem = Problem::new(space.clone(), 1, Energy::BEND, Some(map), rows.collect()).unwrap();
        let direct = solve(&problem, Method::Cholesky, 1e-10).unwrap();
        for method in [Method::Bpx, Method::Multigrid, Method::Wavelet] {
            let solution = solve(&problem, method, 1e-8).unwrap();
            let error = far(&solution.coefficients()[0], &direct.coefficients()[0]);
            let bound = if method == Method::Wavelet { 1e-5 } else { 1e-6 };
            assert!(error < bound, "{method}: {error}");
        }
    }
}

#[test]
fn auto_solves_surfaces_of_any_number_of_spans() {
    let solved = |spans: [usize; 2], m: usize, stiff: bool| {
        let [s, t] = spans.map(|n| Axis::new(Boundary::Open, n, [0.0, 1.0]).unwrap());
        let space = Space::surface(s, t);
        let unit = |k: u64, i: usize| seed::unit(seed::combine(k, i as u64));
        let rows = (0..m).map(|i| point(i, &[unit(1, i), unit(2, i)], unit(3, i))).collect();
        let factor = |c: usize| if c < 20 { 50.0 } else { 1.0 };
        let map = stiff.then(|| Stiffness::new(space.cells(), (0..space.cells()).map(factor).collect()).unwrap());
        let problem = Problem::new(space, 1, Energy::BEND, map, rows).unwrap();
        let solution = solve(&problem, Method::Auto, 1e-8).unwrap();
        assert!(solution.converged() && solution.residuals().iter().all(|r| r.miss.abs() < 1e-7), "{spans:?}");
        solution.method().0
    };
    assert_eq!(solved([32, 32], 20, false), Method::Bpx);
    // Nothing to halve: levels would have to factor all coefficients densely.
    assert_eq!(solved([37, 37], 20, false), Method::Cholesky);
    assert_eq!(solved([13, 64], 20, false), Method::Cholesky);
    assert_eq!(solved([32, 32], 20, true), Method::Cholesky);
}

#[test]
fn auto_gives_way_where_constraints_are_too_crowded_for_a_sparse_factor() {
    // 500 random values on 4096 spans: some so close that the shape oscillates by 1e4 times their size.
    let a = Axis::new(Boundary::Open, 4096, [0.0, 1.0]).unwrap();
    let solved = |places: &dyn Fn(usize) -> f64, method: Method| {
        let rows = (0..500).map(|i| point(i, &[places(i)], seed::unit(i as u64 + 77))).collect();
        let problem = Problem::new(Space::curve(a), 1, Energy::BEND, None, rows).unwrap();
        let solution = solve(&problem, method, 1e-8).unwrap();
        (solution.converged(), solution.method().0, solution.energy())
    };
    let even = |i: usize| (i as f64 + 0.5) / 500.0;
    let crowded = |i: usize| if i == 0 { 1.5 / 500.0 + 1e-8 } else { even(i) };
    let (converged, method, energy) = solved(&even, Method::Auto);
    assert!(converged && method == Method::Cholesky);
    assert!((energy / solved(&even, Method::Banded).2 - 1.0).abs() < 1e-8);
    assert!(!solved(&crowded, Method::Cholesky).0, "this problem is too easy to show anything");
    let (converged, method, energy) = solved(&crowded, Method::Auto);
    assert!(converged && method == Method::Banded);
    assert!((energy / solved(&crowded, Method::Banded).2 - 1.0).abs() < 1e-12);
}

#[test]
fn periodic_axes_close() {
    let circle = |i: usize| {
        let angle = std::f64::consts::TAU * i as f64 / 5.0;
        let at = vec![Some(angle.cos()), Some(angle.sin())];
        Constraint::new(format!("{i}"), &[i as f64 / 5.0], Demand::Position(at))
    };
    let a = Axis::new(Boundary::Periodic, 40, [0.0, 1.0]).unwrap();
    let problem = Problem::new(Space::curve(a), 2, Energy::BEND, None, (0..5).map(circle).collect()).unwrap();
    let want = solve(&problem, Method::Spectral, 1e-10).unwrap();
    for method in [Method::Banded, Method::Bpx, Method::Wavelet, Method::Cholesky] {
        let Some(got) = solve(&problem, method, 1e-10) else { continue };
        for (x, y) in got.coefficients().iter().zip(want.coefficients()) {
            assert!(far(x, y) < 1e-9, "{method}");
        }
    }
    // A torus: both ways round.
    let b = Axis::new(Boundary::Periodic, 16, [0.0, 1.0]).unwrap();
    let rows = (0..9).map(|i| point(i, &[0.13 * i as f64, 0.29 * i as f64 % 1.0], seed::unit(i as u64))).collect();
    let problem = Problem::new(Space::surface(b, a), 1, Energy::new(0.5, 1.0, 0.1).unwrap(), None, rows).unwrap();
    let want = solve(&problem, Method::Spectral, 1e-10).unwrap();
    for method in [Method::Bpx, Method::Multigrid, Method::Wavelet, Method::Cholesky] {
        let Some(got) = solve(&problem, method, 1e-10) else { continue };
        assert!(far(&got.coefficients()[0], &want.coefficients()[0]) < 1e-8, "{method}");
    }
}

#[test]
fn problems_that_determine_too_little_still_have_a_finite_answer() {
    // One point on an open surface: any plane through it is as good; no rows at all: zero.
    let a = axis(Boundary::Open, 16);
    for rows in [vec![], vec![point(0, &[3.0, 4.5], 2.0)]] {
        let some = !rows.is_empty();
        let problem = Problem::new(Space::surface(a, a), 1, Energy::BEND, None, rows).unwrap();
        for method in [Method::Auto, Method::Bpx, Method::Multigrid, Method::Wavelet, Method::Cholesky] {
            let solution = solve(&problem, method, 1e-8).unwrap();
            assert!(solution.coefficients()[0].iter().all(|v| v.is_finite()));
            assert!(solution.energy() < 1e-12, "{method} {} {:?}", solution.energy(), &solution.coefficients()[0][..5]);
            if some {
                let value = solution.eval(&[3.0, 4.5], [0, 0])[0];
                assert!((value - 2.0).abs() < 1e-9, "{method}: {value}");
            }
        }
    }
}

#[test]
fn bad_input_is_named() {
    let a = axis(Boundary::Open, 8);
    let space = Space::curve(a);
    let pose = |c: Constraint| Problem::new(space.clone(), 1, Energy::BEND, None, vec![c]);
    let message = |c: Constraint| pose(c).map(|_| ()).unwrap_err().to_string();
    assert!(message(point(0, &[f64::NAN], 0.0)).contains("p0"));
    assert!(message(point(0, &[9.0], 0.0)).contains("outside"));
    assert!(message(point(0, &[1.0, 2.0], 0.0)).contains("parameter"));
    for length in [1e-300, 1e300] {
        let space = Space::curve(Axis::new(Boundary::Open, 8, [0.0, length]).unwrap());
        let refused = Problem::new(space, 1, Energy::BEND, None, vec![point(0, &[0.0], 0.0)]);
        assert!(refused.is_err_and(|e| e.to_string().contains("length")));
    }
    assert!(message(point(0, &[1.0], f64::INFINITY)).contains("inf"));
    assert!(message(point(0, &[1.0], 0.0).soft(0.0)).contains("weight"));
    assert!(message(Constraint::new("n", &[1.0], Demand::Normal(vec![1.0]))).contains("coordinate"));
    let twice = vec![point(0, &[1.0], 0.0), point(0, &[2.0], 0.0)];
    assert!(Problem::new(space.clone(), 1, Energy::BEND, None, twice).is_err());
    let huge = Axis::new(Boundary::Open, 1 << 40, [0.0, 1.0]).unwrap();
    assert!(matches!(
        Problem::new(Space::surface(huge, huge), 3, Energy::BEND, None, vec![]),
        Err(ProblemError::Memory { .. })
    ));
    let _ = basis::taps(&a, 0.0, 0);
}

#[test]
fn curvature_is_met_by_newton_steps() {
    let a = Axis::new(Boundary::Open, 32, [0.0, 1.0]).unwrap();
    let at = |i: usize, t: f64, p: [f64; 2]| {
        Constraint::new(format!("p{i}"), &[t], Demand::Position(vec![Some(p[0]), Some(p[1])]))
    };
    let bend = |id: &str, t: f64, k: f64| Constraint::new(id, &[t], Demand::Curvature(k));
    let rows = vec![at(0, 0.0, [0.0, 0.0]), at(1, 0.5, [1.0, 0.4]), at(2, 1.0, [2.0, 0.0]), bend("k", 0.3, -2.5)];
    let problem = Problem::new(Space::curve(a), 2, Energy::BEND, None, rows).unwrap();
    let solution = solve(&problem, Method::Auto, 1e-9).unwrap();
    assert!(solution.converged());
    let (d, e) = (solution.eval(&[0.3], [1, 0]), solution.eval(&[0.3], [2, 0]));
    let k = (d[0] * e[1] - d[1] * e[0]) / (d[0] * d[0] + d[1] * d[1]).powf(1.5);
    assert!((k + 2.5).abs() < 1e-8, "{k}");
    assert!(solution.residuals().iter().all(|r| r.miss.abs() < 1e-8));
}

#[test]
fn very_many_constraints_on_a_surface_need_no_dense_matrix() {
    let a = axis(Boundary::Open, 64);
    let row = |i: usize| {
        let at = |k: u64| 64.0 * seed::unit(seed::combine(k, i as u64));
        point(i, &[at(1), at(2)], seed::unit(seed::combine(3, i as u64))).soft(10.0)
    };
    let make = |rows: usize| Problem::new(Space::surface(a, a), 1, Energy::BEND, None, (0..rows).map(row).collect());
    // A dense matrix of 6000 rows and its factor took seconds, of 40000 the program's life.
    let crowd = solve(&make(6000).unwrap(), Method::Auto, 1e-8).unwrap();
    assert!(crowd.converged() && crowd.method().0 == Method::Multigrid, "{:?}", crowd.method());
    let few = make(2600).unwrap();
    let (got, want) = (solve(&few, Method::Auto, 1e-10).unwrap(), solve(&few, Method::Bpx, 1e-10).unwrap());
    assert!(far(&got.coefficients()[0], &want.coefficients()[0]) < 1e-8);
    let refused = Solver::new(make(40_000).unwrap(), Settings { method: Method::Bpx, ..Settings::default() });
    let said = refused.err().map(|e| e.to_string()).unwrap_or_default();
    assert!(said.contains("bytes") && said.contains("multigrid"), "{said}");
}

#[test]
fn what_rows_hardly_hold_is_found_by_the_sparse_factor_too() {
    // One point, and a weight that is nothing beside the energy's: a factor alone is left with rounding.
    let short = Axis::new(Boundary::Open, 16, [0.0, 0.01]).unwrap();
    let axis = |b: f64| Axis::new(Boundary::Open, 32, [0.0, b]).unwrap();
    let both = Energy::new(1.0, 1.0, 0.0).unwrap();
    for (space, energy, at, weight) in [
        (Space::surface(axis(1.0), axis(1.0)), Energy::BEND, vec![0.01, 0.714], None),
        (Space::surface(axis(1.0), axis(0.1)), Energy::BEND, vec![0.01, 0.0714], None),
        (Space::curve(short), both, vec![0.004_26], Some(1e-5)),
        (Space::curve(short), Energy::BEND, vec![0.004_26], Some(1e-5)),
    ] {
        let one = Constraint::new("one", &at, Demand::Position(vec![Some(-0.86)]));
        let row = weight.map_or(one.clone(), |w| one.soft(w));
        let problem = Problem::new(space, 1, energy, None, vec![row]).unwrap();
        let found = solve(&problem, Method::Cholesky, 1e-8).unwrap();
        assert!(found.converged(), "{at:?}");
        assert!(found.residuals()[0].miss.abs() < 1e-8, "{at:?}: {:e}", found.residuals()[0].miss);
        assert!(found.coefficients()[0].iter().all(|x| x.abs() < 10.0), "{at:?}");
    }
}

#[test]
fn the_thesis_iterates_to_the_same_shapes() {
    let a = axis(Boundary::Mirrored, 16);
    let rows = (0..5).map(|i| point(i, &[4.0 * i as f64], seed::unit(i as u64))).collect();
    let problem = Problem::new(Space::curve(a), 1, Energy::BEND, None, rows).unwrap();
    let want = solve(&problem, Method::Banded, 1e-10).unwrap();
    let run = |method: Method, iteration: Iteration, explicit: bool, tolerance: f64| {
        let settings = Settings { method, iteration, explicit, tolerance, ..Settings::default() };
        Solver::new(problem.clone(), settings).and_then(Solver::run).unwrap()
    };
    use Iteration::{ConjugateGradients, GaussSeidel, SteepestDescent};
    for (method, iteration, explicit, tolerance) in [
        (Method::ThesisBspline, ConjugateGradients, false, 1e-8),
        (Method::ThesisBspline, ConjugateGradients, true, 1e-8),
        (Method::ThesisBspline, GaussSeidel, true, 1e-4),
        (Method::ThesisWavelet, ConjugateGradients, false, 1e-8),
        (Method::ThesisWavelet, ConjugateGradients, true, 1e-8),
        (Method::ThesisWavelet, SteepestDescent, false, 1e-4),
        (Method::ThesisWavelet, GaussSeidel, false, 1e-4),
    ] {
        let got = run(method, iteration, explicit, tolerance);
        let away = far(&got.coefficients()[0], &want.coefficients()[0]);
        println!("{method} {iteration:?} {explicit}: {} iterations, {away:.1e}", got.iterations());
        assert!(away < 100.0 * tolerance, "{method} {iteration:?} {explicit}: {away:e}");
        assert!(got.iterations() > 5);
    }
    // The same numbers, formed or applied.
    let (a, b) = (
        run(Method::ThesisWavelet, ConjugateGradients, false, 1e-8),
        run(Method::ThesisWavelet, ConjugateGradients, true, 1e-8),
    );
    assert!(far(&a.coefficients()[0], &b.coefficients()[0]) < 1e-7);
}
