//! What `auto` picks, beside every solver that applies: median CPU time to the default tolerance, one thread.
//!
//! `cargo bench -p ondelette-modeling --bench auto` prints a table; the last column is the time of the picked solver
//! over that of the fastest. A word behind `--` shows only the cases whose names contain it.

mod clock;

use clock::median;
use ondelette_modeling::Axis;
use ondelette_modeling::constraint::{Constraint, Demand};
use ondelette_modeling::energy::{Energy, Stiffness};
use ondelette_modeling::solve::{Method, Settings, Solver};
use ondelette_modeling::system::{Problem, Space};
use ondelette_numerics::seed;
use ondelette_wavelet::Boundary;

const METHODS: [Method; 6] =
    [Method::Spectral, Method::Banded, Method::Bpx, Method::Multigrid, Method::Wavelet, Method::Cholesky];

fn problem(boundary: Boundary, spans: usize, surface: bool, m: usize, stiff: bool) -> Problem {
    let a = Axis::new(boundary, spans, [0.0, spans as f64]).expect("an axis");
    let space = if surface { Space::surface(a, a) } else { Space::curve(a) };
    let random = |k: u64, i: usize| seed::unit(seed::combine(k, i as u64));
    let row = |i: usize| {
        let at = if surface {
            vec![random(1, i) * spans as f64, random(2, i) * spans as f64]
        } else {
            vec![(i as f64 + 0.5) / m as f64 * spans as f64]
        };
        Constraint::new(format!("{i}"), &at, Demand::Position(vec![Some(random(3, i) - 0.5)]))
    };
    let map = stiff.then(|| {
        let factors = (0..space.cells()).map(|i| if i % spans < spans / 3 { 30.0 } else { 1.0 }).collect();
        Stiffness::new(space.cells(), factors).expect("a map")
    });
    Problem::new(space, 1, Energy::BEND, map, (0..m).map(row).collect()).expect("a problem")
}

fn main() {
    print!("{:34}", "case");
    METHODS.iter().for_each(|m| print!("{:>11}", m.to_string()));
    println!("{:>11}{:>8}", "auto", "ratio");
    let mut cases: Vec<(Boundary, usize, bool, usize, bool)> = Vec::new();
    for boundary in [Boundary::Open, Boundary::Mirrored, Boundary::Periodic] {
        for (spans, m) in [(16, 4), (64, 13), (512, 13), (512, 100), (4096, 13), (4096, 500)] {
            cases.push((boundary, spans, false, m, false));
        }
        for (spans, m) in
            [(8, 5), (16, 5), (16, 40), (32, 5), (32, 64), (64, 5), (64, 64), (64, 500), (128, 64), (256, 256)]
        {
            cases.push((boundary, spans, true, m, false));
        }
    }
    for (spans, m) in [(16, 5), (32, 64), (64, 64), (128, 64)] {
        cases.push((Boundary::Open, spans, true, m, true));
    }
    // Spans that do not halve often, and many constraints.
    for (spans, m) in [(37, 64), (50, 64), (52, 64), (80, 64), (100, 64), (200, 64), (32, 150), (64, 300), (128, 500)] {
        cases.push((Boundary::Open, spans, true, m, false));
    }
    let only = std::env::args().skip(1).find(|a| !a.starts_with('-')).unwrap_or_default();
    for (boundary, spans, surface, m, stiff) in cases {
        let p = problem(boundary, spans, surface, m, stiff);
        let kind = if surface { "surface" } else { "curve" };
        let name = format!("{boundary:?} {kind} {spans} / {m}{}", if stiff { " stiff" } else { "" });
        if !name.contains(&only) {
            continue;
        }
        print!("{name:34}");
        let mut fastest = f64::INFINITY;
        let mut by_method = Vec::new();
        let picked = Solver::new(p.clone(), Settings::default()).expect("a solver").method();
        for method in METHODS {
            let settings = Settings { method, ..Settings::default() };
            let run = || Solver::new(p.clone(), settings).and_then(Solver::run);
            let slow = method == Method::Wavelet && surface && spans > 64;
            if slow || !run().is_ok_and(|s| s.converged()) {
                print!("{:>11}", "-");
                continue;
            }
            let t = median(0.2, if spans > 100 && surface { 3 } else { 7 }, || drop(run()));
            fastest = fastest.min(t);
            by_method.push((method, t));
            print!("{:>11}", format!("{:.3}", t * 1e3));
        }
        let own = by_method.iter().find(|m| m.0 == picked).map_or(f64::NAN, |m| m.1);
        println!("{:>11}{:>8.2}", picked.to_string(), own / fastest);
    }
}
