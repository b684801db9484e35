//! Solvers: median CPU time of several runs, one thread.
//!
//! `cargo bench -p ondelette-modeling` prints `case,seconds,iterations,error`; errors are eq. 168 of the thesis (sum of
//! differences over that of the start) against a solution refined to 1e-12. `bench/peers/modeling.py` runs CHOLMOD and
//! SciPy on the same cases.

mod clock;

use clock::median;
use ondelette_modeling::Axis;
use ondelette_modeling::constraint::{Constraint, Demand};
use ondelette_modeling::drag::Handles;
use ondelette_modeling::energy::{Energy, Stiffness};
use ondelette_modeling::solve::{Method, Settings, Solver};
use ondelette_modeling::system::{Problem, Space};
use ondelette_numerics::seed;
use ondelette_wavelet::Boundary;

/// Scattered places: four corners and a low-discrepancy sequence.
fn problem(boundary: Boundary, spans: usize, m: usize, key: u64, stiffness: Option<Stiffness>) -> Problem {
    let a = Axis::new(boundary, spans, [0.0, spans as f64]).expect("an axis");
    let n = spans as f64;
    let (g, h) = (0.754_877_666_246_692_7, 0.569_840_290_998_053_3);
    let place = |i: usize| match i {
        0..4 => [(i / 2) as f64 * n, (i % 2) as f64 * n],
        _ => [(0.5 + g * i as f64).fract() * n, (0.5 + h * i as f64).fract() * n],
    };
    let value = |i: usize| seed::unit(seed::combine(key, i as u64)) * 2.0 - 1.0;
    let row = |i: usize| Constraint::new(format!("{i}"), &place(i), Demand::Position(vec![Some(value(i))]));
    Problem::new(Space::surface(a, a), 1, Energy::BEND, stiffness, (0..m).map(row).collect()).expect("a problem")
}

/// Median seconds, by a third of a second of work at least.
fn measured(runs: usize, f: impl FnMut()) -> f64 {
    median(0.35, runs, f)
}

fn error(x: &[f64], want: &[f64], start: &[f64]) -> f64 {
    let sum = |a: &[f64]| a.iter().zip(want).map(|(a, b)| (a - b).abs()).sum::<f64>();
    sum(x) / sum(start)
}

fn solved(problem: &Problem, settings: Settings) -> (Vec<f64>, usize) {
    let solution = Solver::new(problem.clone(), settings).and_then(Solver::run).expect("a solution");
    (solution.coefficients()[0].clone(), solution.iterations())
}

fn report(case: &str, seconds: f64, iterations: usize, error: f64) {
    println!("{case},{seconds:.6},{iterations},{error:.1e}");
}

/// Time and iterations to given errors, at the loosest tolerance that reaches them.
fn iterated(boundary: Boundary, spans: usize, m: usize, runs: usize) {
    let exact = Settings { tolerance: 1e-12, ..Settings::default() };
    let p = problem(boundary, spans, m, 1, None);
    let (want, _) = solved(&p, exact);
    let start = solved(&problem(boundary, spans, 4, 1, None), exact).0;
    for method in [Method::Bpx, Method::Multigrid] {
        for goal in [1e-4, 1e-8] {
            let (mut tolerance, mut reached, mut iterations) = (1e-1, f64::INFINITY, 0);
            let mut settings = Settings { method, tolerance, refine: false, ..Settings::default() };
            while reached > goal && tolerance > 1e-12 {
                tolerance *= 0.5;
                settings.tolerance = tolerance;
                let (x, n) = solved(&p, settings);
                (reached, iterations) = (error(&x, &want, &start), n);
            }
            let t = measured(runs, || drop(solved(&p, settings)));
            let name = if boundary == Boundary::Open { "open" } else { "mirrored" };
            report(&format!("{name}-{spans}-{m}-{method}-{goal:.0e}"), t, iterations, reached);
        }
    }
}

/// A hundred handles of three coordinates at 129 x 129: the slowest move of any.
fn drags() {
    let a = Axis::new(Boundary::Mirrored, 128, [0.0, 1.0]).expect("an axis");
    let unit = |k: u64, i: usize| seed::unit(seed::combine(k, i as u64));
    let row = |i: usize| {
        let to = (3..6).map(|k| Some(unit(k, i))).collect();
        Constraint::new(format!("{i}"), &[unit(1, i), unit(2, i)], Demand::Position(to))
    };
    let p = Problem::new(Space::surface(a, a), 3, Energy::BEND, None, (0..100).map(row).collect()).expect("a problem");
    let mut handles = Handles::new(p, Settings::default(), 1 << 30).expect("handles");
    (0..100).for_each(|i| handles.grab(&format!("{i}")).expect("a column"));
    let mut slowest = 0.0_f64;
    for i in 0..100 {
        let mut v = 0.0;
        let t = median(0.02, 5, || {
            v += 0.01;
            handles.drag(&format!("{i}"), &[Some(v), Some(-v), Some(0.5 * v)]).expect("a drag");
        });
        slowest = slowest.max(t);
    }
    report("mirrored-128-100-move-of-any-3-coordinates", slowest, 0, 0.0);
}

fn main() {
    let refined = |method| Settings { method, tolerance: 1e-12, ..Settings::default() };
    for (spans, m, runs) in [(64, 64, 50), (256, 256, 10), (512, 1024, 4)] {
        let p = problem(Boundary::Mirrored, spans, m, 1, None);
        let (want, _) = solved(&p, refined(Method::Spectral));
        let start = solved(&problem(Boundary::Mirrored, spans, 4, 1, None), refined(Method::Spectral)).0;
        for refine in [false, true] {
            let settings = Settings { refine, ..refined(Method::Spectral) };
            let (x, _) = solved(&p, settings);
            let t = measured(runs, || drop(solved(&p, settings)));
            let name = if refine { "refined" } else { "unrefined" };
            report(&format!("mirrored-{spans}-{m}-cold-{name}"), t, 0, error(&x, &want, &start));
            let mut solver = Solver::new(p.clone(), settings).expect("a solver");
            solver.finish().expect("a solution");
            let other = problem(Boundary::Mirrored, spans, m, 2, None);
            let t = measured(runs, || {
                solver.retarget(other.clone()).expect("the same rows");
                solver.finish().expect("a solution");
            });
            report(&format!("mirrored-{spans}-{m}-values-{name}"), t, 0, 0.0);
        }
        // A budget for one column: every other grab builds its column anew.
        let mut handles = Handles::new(p.clone(), refined(Method::Spectral), 1).expect("handles");
        let mut odd = false;
        let t = measured(runs, || {
            odd = !odd;
            handles.grab(if odd { "7" } else { "11" }).expect("a column");
        });
        report(&format!("mirrored-{spans}-{m}-grab"), t, 0, 0.0);
        handles.grab("7").expect("a column");
        let mut v = 0.0;
        let t = measured(runs, || {
            v += 0.01;
            handles.drag("7", &[Some(v)]).expect("a drag");
        });
        report(&format!("mirrored-{spans}-{m}-move"), t, 0, 0.0);
    }
    for boundary in [Boundary::Open, Boundary::Mirrored] {
        for (spans, m, runs) in [(32, 23, 21), (64, 64, 21), (128, 64, 5), (256, 256, 5), (512, 1024, 1)] {
            iterated(boundary, spans, m, runs);
        }
    }
    drags();
    // Creases and stiff regions.
    for (name, factor) in [("crease-1e-4", 1e-4), ("stiff-1e4", 1e4)] {
        let n = 64;
        let stiff = |c: usize| {
            let (i, j) = ((c / n) as f64 - 31.5, (c % n) as f64 - 31.5);
            let inside = if factor < 1.0 { c / n == 20 } else { i.hypot(j) < 12.0 };
            if inside { factor } else { 1.0 }
        };
        let map = Stiffness::new(n * n, (0..n * n).map(stiff).collect()).expect("a map");
        let p = problem(Boundary::Open, n, 23, 1, Some(map));
        let (want, _) = solved(&p, Settings { tolerance: 1e-11, ..refined(Method::Cholesky) });
        let start = solved(&problem(Boundary::Open, n, 4, 1, None), refined(Method::Bpx)).0;
        let mut tolerance = 1e-1;
        let (mut reached, mut iterations) = (f64::INFINITY, 0);
        while reached > 1e-4 && tolerance > 1e-12 {
            tolerance *= 0.5;
            let settings = Settings { method: Method::Bpx, tolerance, refine: false, ..Settings::default() };
            let (x, n) = solved(&p, settings);
            (reached, iterations) = (error(&x, &want, &start), n);
        }
        report(&format!("open-64-23-{name}-bpx-1e-4"), 0.0, iterations, reached);
    }
    // A curve of 65 control points, 13 values, one coordinate.
    let a = Axis::new(Boundary::Mirrored, 64, [0.0, 64.0]).expect("an axis");
    let row = |i: usize| {
        let at = vec![Some(seed::unit(i as u64))];
        Constraint::new(format!("{i}"), &[i as f64 * 64.0 / 12.0], Demand::Position(at))
    };
    let p = Problem::new(Space::curve(a), 1, Energy::BEND, None, (0..13).map(row).collect()).expect("a problem");
    let settings = Settings { method: Method::Banded, ..Settings::default() };
    let t = measured(300, || drop(solved(&p, settings)));
    report("curve-65-13-cold", t, 0, 0.0);
    let mut solver = Solver::new(p.clone(), settings).expect("a solver");
    solver.finish().expect("a solution");
    let t = measured(300, || {
        solver.retarget(p.clone()).expect("the same rows");
        solver.finish().expect("a solution");
    });
    report("curve-65-13-values", t, 0, 0.0);
}
