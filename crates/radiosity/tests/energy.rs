//! What closed boxes must satisfy whatever their light, and what the promised error means.

use glam::DVec3;
use ondelette_radiosity::ledger::Ledger;
use ondelette_radiosity::scene::samples;
use ondelette_radiosity::{Basis, Method, Rgb, Scene, Settings, Solution, Solver};

fn solve(scene: Scene, basis: &str, error: f64) -> Solution {
    let basis: Basis = basis.parse().unwrap();
    let mut solver =
        Solver::new(scene, Settings { basis, method: Method::Wavelet, error, ..Settings::default() }).unwrap();
    while solver.step().is_some() {}
    let solution = solver.solution();
    assert!(solution.is_finished());
    solution
}

const PLACES: [[f64; 2]; 6] = [[0.01, 0.01], [0.5, 0.5], [0.03, 0.7], [0.9, 0.99], [0.33, 0.25], [0.999, 0.001]];

#[test]
fn a_white_furnace_is_equally_bright_everywhere() {
    for basis in ["haar", "m2", "m3", "f2"] {
        for rho in [0.5, 0.9, 0.99] {
            let solution = solve(samples::cube(rho, [1.0; 6]), basis, 0.01);
            for side in 0..6 {
                for at in PLACES {
                    let b = solution.radiosity(side, at).0[1];
                    let error = b * (1.0 - rho) - 1.0;
                    assert!(error.abs() <= 1e-3, "{basis} rho {rho} side {side} {at:?}: off by {error:.2e}");
                }
            }
        }
    }
}

#[test]
fn a_refined_furnace_stays_white() {
    // furniture forces masks and refinement, and still B = M / (1 - rho)
    let p = |i: u32, o: f64, s: f64| [0, 1, 2].map(|k| o + s * f64::from(i >> k & 1));
    let walls = [[0, 1, 3, 2], [6, 7, 5, 4], [0, 2, 6, 4], [3, 1, 5, 7], [1, 0, 4, 5], [2, 3, 7, 6]];
    let (grey, light) = (Rgb::grey(0.5), Rgb::grey(std::f64::consts::FRAC_1_PI));
    let mut faces: Vec<_> = walls.iter().map(|w| (w.map(|i| p(i, 0.0, 1.0)), grey, light)).collect();
    faces.extend(walls.iter().map(|w| ([w[3], w[2], w[1], w[0]].map(|i| p(i, 0.3, 0.35)), grey, light)));
    let solution = solve(samples::quads("furnished furnace", &faces), "m2", 0.01);
    let mut sum = 0.0;
    for side in 0..12 {
        for at in PLACES {
            let error = solution.radiosity(side, at).0[0] / 2.0 - 1.0;
            assert!(error.abs() < 0.1, "side {side} {at:?}: off by {error:.2e}");
            sum += error.abs();
        }
    }
    assert!(sum / 72.0 < 0.01, "mean error {}", sum / 72.0);
}

#[test]
fn unequal_emission_in_a_closed_box_keeps_the_energy_identity() {
    // integral of B = integral of M / (1 - rho), whatever M
    for (basis, error) in [("haar", 0.05), ("m2", 0.01), ("m3", 0.01), ("f2", 0.05)] {
        let rho = 0.7;
        let solution = solve(samples::cube(rho, [3.0, 0.0, 0.5, 0.0, 0.0, 1.0]), basis, error);
        let reflected: f64 = (0..6).map(|s| rho * solution.mean_irradiance(s).0[0]).sum();
        let (radiosity, want) = (reflected + 4.5, 4.5 / (1.0 - rho));
        assert!((radiosity / want - 1.0).abs() < 0.005, "{basis}: {radiosity} instead of {want}");
    }
}

#[test]
fn the_ledger_of_a_closed_box_closes_and_nothing_escapes() {
    let solution = solve(samples::cube(0.5, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]), "m2", 0.005);
    let ledger = Ledger::count(&solution, 1 << 16);
    assert!(ledger.closure().abs() < 1e-3, "{ledger:?}");
    assert_eq!((ledger.escaped, ledger.lost_on_backs), (Rgb::BLACK, Rgb::BLACK));
}

#[test]
fn light_that_meets_a_back_is_lost_there() {
    // the lamp shines on the floor; a one-sided screen between them shows the lamp its black back
    let floor = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let screen = [[0.0, 1.0, 0.5], [1.0, 1.0, 0.5], [1.0, 0.0, 0.5], [0.0, 0.0, 0.5]];
    let lamp = [[0.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0]];
    let light = Rgb::grey(std::f64::consts::FRAC_1_PI);
    let grey = Rgb::grey(0.5);
    let faces = [(floor, grey, Rgb::BLACK), (screen, grey, Rgb::BLACK), (lamp, Rgb::BLACK, light)];
    let solution = solve(samples::quads("screen", &faces), "m2", 0.01);
    let ledger = Ledger::count(&solution, 1 << 16);
    // form factor of parallel unit squares at distance 1/2
    assert!((ledger.lost_on_backs.0[0] - 0.415253).abs() < 2e-3, "{ledger:?}");
    assert!(ledger.closure().abs() < 1e-3);
    // what gets past the screen reaches the floor only through nothing: the screen hides it whole
    assert!(solution.mean_irradiance(0).0[0] < 1e-12);
}

/// A closed room of side 3 with its corner at x = 5, and a lamp under its ceiling.
fn room(reflectance: f64) -> Vec<([[f64; 3]; 4], Rgb, Rgb)> {
    let p = |i: u32| [5.0 + 3.0 * f64::from(i & 1), 3.0 * f64::from(i >> 1 & 1), 3.0 * f64::from(i >> 2 & 1)];
    let walls = [[0, 1, 3, 2], [6, 7, 5, 4], [0, 2, 6, 4], [3, 1, 5, 7], [1, 0, 4, 5], [2, 3, 7, 6]];
    let mut faces: Vec<_> = walls.iter().map(|w| (w.map(p), Rgb::grey(reflectance), Rgb::BLACK)).collect();
    let lamp = [[6.0, 1.0, 2.5], [6.0, 2.0, 2.5], [7.0, 2.0, 2.5], [7.0, 1.0, 2.5]];
    faces.push((lamp, Rgb::BLACK, Rgb::grey(1.0)));
    faces
}

#[test]
fn a_carpet_on_the_floor_receives_in_its_place_and_creates_no_light() {
    let mut faces = room(0.6);
    let carpet = [[5.3, 0.3, 0.0], [7.7, 0.3, 0.0], [7.7, 2.7, 0.0], [5.3, 2.7, 0.0]];
    let plain = solve(samples::quads("room", &faces), "m2", 0.03);
    faces.push((carpet, Rgb::grey(0.6), Rgb::BLACK));
    let covered = solve(samples::quads("room with carpet", &faces), "m2", 0.03);
    let ledger = Ledger::count(&covered, 1 << 16);
    assert!(ledger.closure().abs() < 0.02, "{ledger:?}");
    // under the carpet it is dark; on it, as on the bare floor
    assert!(covered.irradiance(0, [0.5, 0.5]).0[0].abs() < 0.02 * plain.irradiance(0, [0.5, 0.5]).0[0]);
    let (bare, on) = (plain.irradiance(0, [0.5, 0.5]).0[0], covered.irradiance(7, [0.5, 0.5]).0[0]);
    assert!((on / bare - 1.0).abs() < 0.05, "{on} on the carpet, {bare} on the bare floor");
}

#[test]
fn a_blazing_lamp_elsewhere_does_not_hide_an_unsolved_room() {
    // a tiny closed cube of bright pure emitters: its huge irradiance must not stop the iteration early
    let faces = room(0.8);
    let alone = solve(samples::quads("room", &faces), "m2", 0.02);
    let p = |i: u32| [0, 1, 2].map(|k| 20.0 + 0.01 * f64::from(i >> k & 1));
    let walls = [[0, 1, 3, 2], [6, 7, 5, 4], [0, 2, 6, 4], [3, 1, 5, 7], [1, 0, 4, 5], [2, 3, 7, 6]];
    let mut both = faces.clone();
    both.extend(walls.iter().map(|w| (w.map(p), Rgb::BLACK, Rgb::grey(1e6))));
    let together = solve(samples::quads("room and furnace", &both), "m2", 0.02);
    for side in 0..6 {
        let (a, b) = (alone.mean_irradiance(side).0[0], together.mean_irradiance(side).0[0]);
        assert!((b / a - 1.0).abs() < 0.04, "side {side}: {b} beside the furnace, {a} alone");
    }
}

#[test]
fn a_far_black_floor_does_not_dilute_the_error() {
    let lit = solve(samples::quads("room", &room(0.95)), "m2", 0.03);
    let mut faces = room(0.95);
    let far = [[100.0, 0.0, 0.0], [140.0, 0.0, 0.0], [140.0, 40.0, 0.0], [100.0, 40.0, 0.0]];
    faces.push((far, Rgb::BLACK, Rgb::BLACK));
    let diluted = solve(samples::quads("room and far floor", &faces), "m2", 0.03);
    for side in 0..6 {
        let (a, b) = (lit.mean_irradiance(side).0[0], diluted.mean_irradiance(side).0[0]);
        assert!((b / a - 1.0).abs() < 0.06, "side {side}: {b} with the far floor, {a} without");
    }
}

#[test]
fn emitters_that_see_only_each_other_are_done_at_once() {
    let floor = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let lamp = [[0.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0]];
    let solution = solve(
        samples::quads("lamps", &[(floor, Rgb::BLACK, Rgb::grey(1.0)), (lamp, Rgb::BLACK, Rgb::grey(2.0))]),
        "m2",
        0.01,
    );
    assert_eq!(solution.links().len(), 2);
    assert!(solution.mean_irradiance(0).0[0] > 0.0);
}

#[test]
fn faces_back_to_back_lose_nothing() {
    // a sheet of two one-sided faces in the middle of a lit room: every ray meets a front first
    let mut faces = room(0.6);
    let up = [[5.5, 0.5, 1.0], [7.5, 0.5, 1.0], [7.5, 2.5, 1.0], [5.5, 2.5, 1.0]];
    let down = [up[3], up[2], up[1], up[0]];
    faces.push((up, Rgb::grey(0.5), Rgb::BLACK));
    faces.push((down, Rgb::grey(0.5), Rgb::BLACK));
    // the lamp is one-sided: its black back faces the ceiling
    let ledger = Ledger::count(&solve(samples::quads("sheet", &faces), "m2", 0.02), 1 << 16);
    assert!(ledger.closure().abs() < 0.01, "{ledger:?}");
}

/// The irradiance of figure 23's receiver in closed form.
fn figure_23_exact(x: f64, y: f64) -> f64 {
    use ondelette_radiosity::form_factor::{Polygon, point_to_polygon};
    let lamp = [[-0.5, 0.5], [0.5, 0.5], [0.5, -0.5], [-0.5, -0.5]].map(|[x, y]| DVec3::new(x, y, 0.1));
    point_to_polygon(DVec3::new(x, y, 0.0), DVec3::Z, &Polygon::new(&lamp))
}

#[test]
fn the_promised_error_is_kept_pointwise() {
    let receiver = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    let emitter = [[-0.5, 0.5, 0.1], [0.5, 0.5, 0.1], [0.5, -0.5, 0.1], [-0.5, -0.5, 0.1]];
    let light = Rgb::grey(std::f64::consts::FRAC_1_PI);
    let scene = samples::quads("figure 23", &[(receiver, Rgb::BLACK, Rgb::BLACK), (emitter, Rgb::BLACK, light)]);
    let mut links = Vec::new();
    for (basis, error) in [("m3", 0.01), ("m2", 0.01), ("haar", 0.02), ("f2", 0.02), ("m2", 0.003)] {
        let solution = solve(scene.clone(), basis, error);
        // a grid off every dyadic line
        let n = 211;
        let (mut miss, mut whole) = (0.0, 0.0);
        for i in 0..n {
            for j in 0..n {
                let at = [(i as f64 + 0.37) / n as f64, (j as f64 + 0.61) / n as f64];
                let want = figure_23_exact(2.0 * at[0] - 1.0, 2.0 * at[1] - 1.0);
                miss += (solution.irradiance(0, at).0[0] - want).abs();
                whole += want;
            }
        }
        assert!(
            miss / whole <= error,
            "{basis}: {:.3} % measured, {:.1} % promised",
            100.0 * miss / whole,
            100.0 * error
        );
        links.push(solution.links().len());
    }
    // thesis 4.6.2: higher order needs fewer links for the same error
    assert!(links[0] < links[1] && links[1] < links[2], "links of m3, m2, haar: {links:?}");
}

#[test]
fn the_same_bits_come_out_for_any_number_of_threads() {
    let run = |threads| {
        ondelette_numerics::par::with_threads(threads, || {
            let solution = solve(samples::cube(0.6, [1.0, 0.0, 0.0, 0.3, 0.0, 0.0]), "m2", 0.02);
            let ledger = Ledger::count(&solution, 10_000);
            (solution.coefficients().to_vec(), solution.links().blocks().to_vec(), ledger)
        })
        .unwrap()
    };
    let one = run(1);
    assert!(one == run(2) && one == run(5));
}

#[test]
fn a_scene_without_light_is_refused_by_name() {
    let error = Solver::new(samples::cube(0.5, [0.0; 6]), Settings::default()).err().unwrap();
    assert!(error.to_string().contains("'cube'") && error.to_string().contains("no emitter"), "{error}");
}
