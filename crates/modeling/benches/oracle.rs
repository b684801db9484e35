//! The adaptive oracle beside the full solution of the same method: median CPU time, one thread, to an energy within a
//! thousandth of the least.
//!
//! `cargo bench -p ondelette-modeling --bench oracle` prints kind, spans, constraints, active functions, energy above
//! the least, time; then iterations and time of all wavelets, at the loosest tolerance that reaches the same energy and
//! at 1e-8; last whether [`Oracle::pays`] promises that it is faster than the latter.

mod clock;

use clock::median;
use ondelette_modeling::Axis;
use ondelette_modeling::constraint::{Constraint, Demand};
use ondelette_modeling::energy::Energy;
use ondelette_modeling::solve::{Method, Oracle, Settings, Solver};
use ondelette_modeling::system::{Problem, Space};
use ondelette_numerics::seed;
use ondelette_wavelet::Boundary;

fn main() {
    println!("case,active,of,above,seconds,full_iterations,full_seconds,full_1e-8_seconds,promised");
    for spans in [32, 64, 128, 256, 512] {
        for m in [2, 5, 23, 64] {
            case("mirrored surface", Boundary::Mirrored, true, spans, m);
        }
    }
    for spans in [64, 128, 256] {
        for m in [5, 23, 64] {
            case("open surface", Boundary::Open, true, spans, m);
        }
    }
    for (name, boundary) in [("mirrored curve", Boundary::Mirrored), ("open curve", Boundary::Open)] {
        for spans in [512, 4096, 32768] {
            for m in [5, 23] {
                case(name, boundary, false, spans, m);
            }
        }
    }
}

fn case(name: &str, boundary: Boundary, surface: bool, spans: usize, m: usize) {
    let a = Axis::new(boundary, spans, [0.0, 1.0]).expect("an axis");
    let random = |k: u64, i: usize| seed::unit(seed::combine(k, i as u64));
    let row = |i: usize| {
        let at = if surface { vec![random(1, i), random(2, i)] } else { vec![(i as f64 + 0.5) / m as f64] };
        Constraint::new(format!("{i}"), &at, Demand::Position(vec![Some(random(3, i))]))
    };
    let space = if surface { Space::surface(a, a) } else { Space::curve(a) };
    let p = Problem::new(space, 1, Energy::BEND, None, (0..m).map(row).collect()).expect("a problem");
    let least = Solver::new(p.clone(), Settings::default()).and_then(Solver::run).expect("a solution").energy();
    let Ok(few) = Oracle::new(p.clone(), 1e-3).and_then(Oracle::run) else {
        println!("{name} {spans} {m},-");
        return;
    };
    let t = median(0.2, 3, || drop(Oracle::new(p.clone(), 1e-3).and_then(Oracle::run)));
    let full = |tolerance: f64, refine: bool| {
        let settings = Settings { method: Method::Wavelet, tolerance, refine, ..Settings::default() };
        Solver::new(p.clone(), settings).and_then(Solver::run).expect("a solution")
    };
    let mut tolerance = 0.5;
    while full(tolerance, false).energy() > (1.0 + 1e-3) * least && tolerance > 1e-6 {
        tolerance *= 0.5;
    }
    let loose = median(0.1, 1, || drop(full(tolerance, false)));
    let tight = median(0.1, 1, || drop(full(1e-8, true)));
    println!(
        "{name} {spans} {m},{},{},{:.1e},{t:.5},{},{loose:.5},{tight:.5},{}",
        few.active().unwrap_or(0),
        few.space().len(),
        few.energy() / least - 1.0,
        full(tolerance, false).iterations(),
        Oracle::pays(&p),
    );
}
