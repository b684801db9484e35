//! The Monte Carlo check against scenes whose light is known, and against solutions that are wrong on purpose.

use ondelette_numerics::par;
use ondelette_radiosity::scene::samples;
use ondelette_radiosity::{Rgb, Scene, Settings, Solution, Solver};
use ondelette_verify::{Report, Verdict, Verifier, VerifyError};

fn solved(scene: Scene, error: f64) -> Solution {
    let mut solver = Solver::new(scene, Settings { error, ..Settings::default() }).unwrap();
    while solver.step().is_some() {}
    solver.into_solution()
}

fn check(scene: &Scene, solution: &Solution, promised: f64, points: u64) -> Report {
    let mut verifier = Verifier::new(scene, promised, points).unwrap();
    while verifier.step(|side, at| solution.irradiance(side, at)) {}
    verifier.report()
}

/// White furnaces: E = 1 / (1 - rho) everywhere, through any number of reflections.
#[test]
fn paths_in_a_furnace_find_its_light() {
    for (reflectance, error) in [(0.5, 0.05), (0.8, 0.1)] {
        let scene = samples::cube(reflectance, [1.0; 6]);
        let solution = solved(scene.clone(), 0.01);
        let report = check(&scene, &solution, error, 2000);
        let want = 1.0 / (1.0 - reflectance);
        // the solution itself is exact here: the bias is the check's own
        let [bias, spread] = report.bias;
        assert!(bias.abs() < 4.0 * spread + 1e-3, "{bias} +- {spread}");
        assert!((report.mean.0[0] / want - 1.0).abs() < 0.01, "{:?} for {want}", report.mean);
        assert_eq!(report.verdict, Verdict::Kept, "{report:?}");
    }
}

/// Two unit squares at distance 1: the form factor is known to 15 digits.
#[test]
fn paths_between_two_squares_find_their_form_factor() {
    let scene = samples::facing_squares(1.0);
    let solution = solved(scene.clone(), 0.001);
    let report = check(&scene, &solution, 0.01, 1500);
    assert!((report.mean.0[0] - 0.199824895698387).abs() < 1e-3, "{:?}", report.mean);
    assert!(report.measured < 0.005 && report.verdict == Verdict::Kept, "{report:?}");
}

/// A room with a lamp and a box in it, lit from above.
fn room(reflectance: f64) -> Scene {
    let mut faces: Vec<([[f64; 3]; 4], Rgb, Rgb)> = Vec::new();
    let white = Rgb::new(reflectance, 0.8 * reflectance, 0.6 * reflectance);
    let cube = samples::cube(0.5, [0.0; 6]);
    for patch in &cube.patches {
        let c = patch.corners();
        faces.push(([c[0], c[1], c[2], c[3]].map(|p| p.to_array()), white, Rgb::BLACK));
    }
    let lamp = [[0.4, 0.6, 0.999], [0.6, 0.6, 0.999], [0.6, 0.4, 0.999], [0.4, 0.4, 0.999]];
    faces.push((lamp, Rgb::BLACK, Rgb::new(5.0, 4.0, 3.0)));
    let table = [[0.2, 0.2, 0.4], [0.7, 0.2, 0.4], [0.7, 0.7, 0.4], [0.2, 0.7, 0.4]];
    let under = [table[3], table[2], table[1], table[0]].map(|[x, y, z]| [x, y, z - 0.02]);
    faces.push((table, white, Rgb::BLACK));
    faces.push((under, white, Rgb::BLACK));
    samples::quads("room", &faces)
}

#[test]
fn a_right_solution_passes_and_wrong_ones_do_not() {
    let scene = room(0.5);
    let right = solved(scene.clone(), 0.015);
    let report = check(&scene, &right, 0.03, 1000);
    assert_eq!(report.verdict, Verdict::Kept, "{report:?}");
    assert!(report.at_least <= report.measured && report.groups.len() >= 6);
    // the same room with a little more reflectance: every value is plausible, and too high
    let bright = solved(room(0.56), 0.03);
    let report = check(&scene, &bright, 0.03, 1000);
    assert_eq!(report.verdict, Verdict::Broken, "{report:?}");
    assert!(report.bias[0] > 0.03 && report.interval[0] > 0.03, "{report:?}");
    // the same solution breaks a promise that it never made
    let coarse = solved(scene.clone(), 0.2);
    let report = check(&scene, &coarse, 0.01, 300);
    assert_ne!(report.verdict, Verdict::Kept, "{report:?}");
}

#[test]
fn a_light_that_is_off_in_one_corner_only_is_found_there() {
    let scene = room(0.5);
    let mut dim = scene.clone();
    // the table's top reflects half of what it should: its own irradiance hardly changes, the ceiling's does
    dim.materials[7].reflectance = Rgb::grey(0.05);
    let solution = solved(dim, 0.03);
    let report = check(&scene, &solution, 0.02, 1500);
    assert_eq!(report.verdict, Verdict::Broken, "{report:?}");
    assert!(report.groups[0].side.is_some_and(|s| s != 7), "{:?}", report.groups[0]);
}

#[test]
fn any_number_of_threads_gives_the_same_report() {
    let scene = room(0.5);
    let solution = solved(scene.clone(), 0.1);
    let run = |threads| par::with_threads(threads, || check(&scene, &solution, 0.1, 300)).unwrap();
    assert_eq!(run(1), run(3));
}

#[test]
fn a_report_can_be_had_at_any_time() {
    let scene = samples::facing_squares(1.0);
    let solution = solved(scene.clone(), 0.05);
    let mut verifier = Verifier::new(&scene, 0.05, 1000).unwrap();
    assert_eq!(verifier.report().verdict, Verdict::Inconclusive(None));
    verifier.step(|side, at| solution.irradiance(side, at));
    let report = verifier.report();
    assert!(report.points < report.wanted && report.points > 0 && report.measured.is_finite());
    assert_eq!(verifier.progress(), (report.points, 1000));
}

#[test]
fn what_cannot_be_verified_is_refused() {
    let scene = samples::facing_squares(1.0);
    assert_eq!(Verifier::new(&scene, 0.01, 3).err(), Some(VerifyError::Points(3)));
    assert!(Verifier::new(&scene, 0.01, u64::MAX).is_err());
    let lamp = [[0.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0]];
    let lamps = samples::quads("lamps", &[(lamp, Rgb::BLACK, Rgb::grey(1.0))]);
    assert_eq!(Verifier::new(&lamps, 0.01, 1000).err(), Some(VerifyError::NothingCounted("lamps".into())));
}
