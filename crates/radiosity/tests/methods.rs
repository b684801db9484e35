//! The space of methods (thesis Fig. 15): whatever links pairs and however the system is solved, the light is the same.

use ondelette_radiosity::ledger::Ledger;
use ondelette_radiosity::scene::{Paint, samples};
use ondelette_radiosity::{Event, Iteration, LinkSettings, Method, Rgb, Scene, Settings, Solution, SolveError, Solver};

/// Every method with the bases it has.
const SPACE: [(Method, &str); 10] = [
    (Method::Classical, "haar"),
    (Method::Galerkin, "m2"),
    (Method::Galerkin, "m3"),
    (Method::Galerkin, "m4"),
    (Method::Hierarchical, "haar"),
    (Method::Wavelet, "m2"),
    (Method::Wavelet, "m3"),
    (Method::Wavelet, "m4"),
    (Method::Wavelet, "f2"),
    (Method::Wavelet, "f3"),
];

const SOLVERS: [Iteration; 5] =
    [Iteration::Gmres, Iteration::Jacobi, Iteration::GaussSeidel, Iteration::Southwell, Iteration::Shooting];

fn settings(method: Method, basis: &str, error: f64, iteration: Iteration) -> Settings {
    let links = LinkSettings { iteration, ..LinkSettings::default() };
    Settings { basis: basis.parse().unwrap(), method, error, links, ..Settings::default() }
}

fn solve(scene: &Scene, settings: Settings) -> Solution {
    let mut solver = Solver::new(scene.clone(), settings).unwrap();
    while solver.step().is_some() {}
    let solution = solver.into_solution();
    let statistics = solution.statistics();
    assert!(solution.is_finished() && statistics.estimated_error <= settings.error, "{settings:?}: {statistics:?}");
    solution
}

type Face = ([[f64; 3]; 4], Rgb, Rgb);

/// The six walls of a box seen from inside: floor, ceiling, x = low, x = high, y = low, y = high.
fn walls(low: [f64; 3], high: [f64; 3]) -> [[[f64; 3]; 4]; 6] {
    let p = |i: u32| [0, 1, 2].map(|k| if i >> k & 1 == 1 { high[k as usize] } else { low[k as usize] });
    [[0, 1, 3, 2], [6, 7, 5, 4], [0, 2, 6, 4], [3, 1, 5, 7], [1, 0, 4, 5], [2, 3, 7, 6]].map(|w| w.map(p))
}

fn outside(low: [f64; 3], high: [f64; 3]) -> [[[f64; 3]; 4]; 6] {
    walls(low, high).map(|[a, b, c, d]| [d, c, b, a])
}

/// A room whose ceiling glows, with a box in the middle that throws a soft shadow.
fn room_with_box() -> Scene {
    let grey = Rgb::grey(0.5);
    let mut faces: Vec<Face> = walls([0.0; 3], [3.0; 3]).map(|w| (w, grey, Rgb::BLACK)).into();
    faces[1].2 = Rgb::grey(1.0);
    faces.extend(outside([1.0, 1.0, 0.5], [2.0, 2.0, 1.0]).map(|w| (w, grey, Rgb::BLACK)));
    samples::quads("room with box", &faces)
}

/// A room with one red and one green wall, and a lamp below the ceiling.
fn coloured_room() -> Scene {
    let mut faces: Vec<Face> = walls([0.0; 3], [3.0; 3]).map(|w| (w, Rgb::grey(0.7), Rgb::BLACK)).into();
    faces[2].1 = Rgb([0.6, 0.1, 0.1]);
    faces[3].1 = Rgb([0.1, 0.5, 0.1]);
    let lamp = [[1.0, 1.0, 2.5], [1.0, 2.0, 2.5], [2.0, 2.0, 2.5], [2.0, 1.0, 2.5]];
    faces.push((lamp, Rgb::BLACK, Rgb([1.0, 0.8, 0.5])));
    samples::quads("coloured room", &faces)
}

/// Two closed cubes that do not see each other, each equally bright everywhere.
fn two_furnaces() -> Scene {
    let wall = |w, rho: f64, m: f64| (w, Rgb::grey(rho), Rgb::grey(m * std::f64::consts::FRAC_1_PI));
    let mut faces: Vec<Face> = walls([0.0; 3], [1.0; 3]).map(|w| wall(w, 0.5, 1.0)).into();
    faces.extend(walls([5.0, 0.0, 0.0], [7.0, 2.0, 2.0]).map(|w| wall(w, 0.9, 0.2)));
    samples::quads("two furnaces", &faces)
}

/// Mean absolute difference over the scene, relative to the mean, at a grid of points on every side that reflects.
fn difference(a: &Solution, b: &Solution) -> f64 {
    let scene = a.scene();
    let (mut miss, mut whole) = (0.0, 0.0);
    for (side, of) in scene.sides.iter().enumerate() {
        if scene.material(*of).is_pure_emitter() {
            continue;
        }
        let area = scene.patches[of.patch as usize].area();
        for i in 0..24 {
            for j in 0..24 {
                let at = [(f64::from(i) + 0.43) / 24.0, (f64::from(j) + 0.57) / 24.0];
                let (x, y) = (a.irradiance(side, at), b.irradiance(side, at));
                miss += area * (0..3).map(|c| (x.0[c] - y.0[c]).abs()).sum::<f64>();
                whole += area * y.sum();
            }
        }
    }
    miss / whole
}

#[test]
fn all_methods_agree_to_the_tolerance() {
    for (scene, error) in [(room_with_box(), 0.04), (coloured_room(), 0.05)] {
        let reference = solve(&scene, settings(Method::Wavelet, "m3", 0.01, Iteration::Gmres));
        for (method, basis) in SPACE {
            let solution = solve(&scene, settings(method, basis, error, Iteration::Gmres));
            let off = difference(&solution, &reference);
            assert!(off <= error + 0.01, "{}: {method} {basis} is off by {:.2} %", scene.name, 100.0 * off);
        }
    }
}

#[test]
fn two_white_furnaces_are_white_in_every_method_and_basis() {
    let scene = two_furnaces();
    for (method, basis) in SPACE {
        for iteration in SOLVERS {
            let solution = solve(&scene, settings(method, basis, 0.01, iteration));
            // B = M / (1 - rho): 2 in both; the residual that ends the iteration is a tenth of the promise
            for side in 0..12 {
                for at in [[0.01, 0.01], [0.5, 0.5], [0.9, 0.99]] {
                    let off = solution.radiosity(side, at).0[1] / 2.0 - 1.0;
                    let allowed = if iteration == Iteration::Gmres { 1e-6 } else { 2e-3 };
                    assert!(off.abs() < allowed, "{method} {basis} {iteration} side {side}: off by {off:.1e}");
                }
            }
        }
    }
}

#[test]
fn every_method_and_basis_keeps_the_energy() {
    // integral of B = integral of M / (1 - rho) in a closed box, whatever M; and the ledger closes
    let rho = 0.6;
    let scene = samples::cube(rho, [3.0, 0.0, 0.5, 0.0, 0.0, 1.0]);
    for (method, basis) in SPACE {
        let error = if basis == "haar" || basis == "f2" { 0.05 } else { 0.02 };
        let solution = solve(&scene, settings(method, basis, error, Iteration::Gmres));
        let reflected: f64 = (0..6).map(|s| rho * solution.mean_irradiance(s).0[0]).sum();
        let off = (reflected + 4.5) / (4.5 / (1.0 - rho)) - 1.0;
        assert!(off.abs() < 0.005, "{method} {basis}: off by {off:.1e}");
        let ledger = Ledger::count(&solution, 1 << 15);
        assert!(ledger.closure().abs() < 5e-3, "{method} {basis}: {ledger:?}");
    }
}

#[test]
fn all_solvers_converge_to_the_same_light() {
    let scene = coloured_room();
    for (method, basis) in [(Method::Classical, "haar"), (Method::Wavelet, "m2"), (Method::Wavelet, "f2")] {
        // the same links for all: one full matrix, or the first links of a generous promise
        let links = LinkSettings { subdivision: method.is_full().then_some(2), ..LinkSettings::default() };
        let told = |iteration| Settings {
            basis: basis.parse().unwrap(),
            method,
            error: if method.is_full() { 0.01 } else { 0.3 },
            links: LinkSettings { iteration, ..links },
            ..Settings::default()
        };
        let run = |iteration| {
            let mut solver = Solver::new(scene.clone(), told(iteration)).unwrap();
            while solver.step().is_some() {}
            solver.into_solution()
        };
        let krylov = run(Iteration::Gmres);
        for iteration in SOLVERS {
            let solution = run(iteration);
            assert_eq!(solution.links().len(), krylov.links().len(), "{method} {iteration}");
            let off = difference(&solution, &krylov);
            // a tenth of the promise, at either of the two
            let allowed = 0.2 * told(iteration).error;
            assert!(off < allowed, "{method} {basis} {iteration}: {off:.1e}");
            let statistics = solution.statistics();
            let shoots = matches!(iteration, Iteration::Southwell | Iteration::Shooting);
            assert_eq!(statistics.shots > 0, shoots, "{iteration}: {statistics:?}");
        }
    }
}

#[test]
fn a_sweep_of_gauss_seidel_does_more_than_one_of_jacobi_and_krylov_more_than_both() {
    let scene = samples::cube(0.9, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let sweeps = |iteration| {
        let links = LinkSettings { iteration, subdivision: Some(2), ..LinkSettings::default() };
        let told = Settings {
            basis: "haar".parse().unwrap(),
            method: Method::Classical,
            error: 0.01,
            links,
            ..Settings::default()
        };
        let mut solver = Solver::new(scene.clone(), told).unwrap();
        while solver.step().is_some() {}
        solver.into_solution().statistics().iterations
    };
    let [krylov, seidel, jacobi] = [Iteration::Gmres, Iteration::GaussSeidel, Iteration::Jacobi].map(sweeps);
    assert!(krylov < seidel && 3 * seidel < 2 * jacobi, "gmres {krylov}, gauss-seidel {seidel}, jacobi {jacobi}");
}

#[test]
fn progressive_shooting_lights_the_scene_from_the_lamp_on() {
    // after the first shots the solution is drawable: what the lamp sends, and nothing unshot is added to it
    let told = settings(Method::Classical, "haar", 0.2, Iteration::Shooting);
    let mut solver = Solver::new(coloured_room(), told).unwrap();
    while solver.solution().statistics().shots == 0 {
        solver.step().unwrap();
    }
    let early = solver.solution();
    assert!(!early.is_finished() && early.mean_irradiance(0).sum() > 0.0);
    while solver.step().is_some() {}
    assert!(solver.solution().is_finished());
}

#[test]
fn every_solver_gives_the_same_bits_for_any_number_of_threads() {
    let scene = coloured_room();
    for iteration in SOLVERS {
        for (method, basis) in [(Method::Classical, "haar"), (Method::Wavelet, "m2")] {
            let run = |threads| {
                let told = settings(method, basis, 0.2, iteration);
                ondelette_numerics::par::with_threads(threads, || {
                    let solution = solve(&scene, told);
                    (solution.coefficients().to_vec(), solution.statistics().clone())
                })
                .unwrap()
            };
            let one = run(1);
            assert!(one == run(2) && one == run(5), "{method} {iteration}");
        }
    }
}

#[test]
fn a_full_matrix_beyond_memory_is_refused_or_ends_the_refinement_with_numbers() {
    let mut told = settings(Method::Classical, "haar", 0.01, Iteration::Gmres);
    told.links.subdivision = Some(8);
    match Solver::new(coloured_room(), told) {
        Err(SolveError::Matrix(matrix)) => {
            // six walls in 256 x 256 elements, and the lamp: a third as long, so 128 x 128
            assert_eq!(matrix.elements, 6 * 65_536 + 16_384);
            assert!(matrix.bytes > 100 * matrix.most);
            assert!(matrix.to_string().contains("409600 elements"), "{matrix}");
        }
        other => panic!("{:?}", other.err()),
    }
}

#[test]
fn a_given_subdivision_is_the_one_that_is_solved() {
    for (n, elements) in [(0, 7), (1, 6 * 4 + 1), (2, 6 * 16 + 4)] {
        let mut told = settings(Method::Galerkin, "m2", 1e-4, Iteration::Gmres);
        told.links.subdivision = Some(n);
        let mut solver = Solver::new(coloured_room(), told).unwrap();
        while solver.step().is_some() {}
        let solution = solver.into_solution();
        assert_eq!(solution.forest().leaves(), elements);
        assert!(!solution.is_finished() && solution.statistics().estimated_error > 1e-4);
    }
}

#[test]
fn rows_that_memory_has_no_room_for_change_no_bit() {
    let scene = room_with_box();
    for (method, basis) in [(Method::Classical, "haar"), (Method::Galerkin, "m2")] {
        for iteration in [Iteration::Gmres, Iteration::Jacobi] {
            let links = LinkSettings { iteration, subdivision: Some(2), ..LinkSettings::default() };
            let wanted = Settings { links, ..settings(method, basis, 0.3, iteration) };
            assert!(matches!(Solver::within(scene.clone(), wanted, Some(1)), Err(SolveError::Matrix(_))));
            // room for the elements, and for a third of the matrix
            let mut solver = Solver::new(scene.clone(), wanted).unwrap();
            while solver.step().is_some() {}
            let cap = solver.counted_bytes() - solver.solution().links().bytes() * 2 / 3;
            let free = solver.into_solution();
            let mut solver = Solver::within(scene.clone(), wanted, Some(cap)).unwrap();
            let mut most = 0;
            while solver.step().is_some() {
                most = most.max(solver.counted_bytes());
            }
            assert!(most <= cap, "{method} {basis}: {most} bytes of {cap}");
            let capped = solver.into_solution();
            assert!(capped.coefficients() == free.coefficients(), "{method} {basis}");
            assert!(capped.statistics().rays > free.statistics().rays, "no row was coupled twice");
            assert!(capped.links().is_empty() && Solver::resume(&capped).is_err(), "a part of a matrix is no matrix");
        }
    }
}

#[test]
fn solvers_that_need_the_whole_matrix_say_what_it_takes() {
    let scene = room_with_box();
    let mut solver =
        Solver::within(scene, settings(Method::Classical, "haar", 0.05, Iteration::Shooting), Some(2_000_000)).unwrap();
    while solver.step().is_some() {}
    let statistics = solver.solution().statistics().clone();
    let too_large = statistics.too_large.unwrap();
    assert!(!statistics.finished && too_large.bytes > 2_000_000);
    assert!(too_large.to_string().contains("gmres"), "{too_large}");
}

#[test]
fn links_that_adapt_stop_at_the_cap_with_a_solution() {
    let scene = room_with_box();
    let wanted = settings(Method::Wavelet, "m2", 0.01, Iteration::Gmres);
    assert!(matches!(Solver::within(scene.clone(), wanted, Some(1000)), Err(SolveError::Memory { .. })));
    let cap = 600_000;
    let mut solver = Solver::within(scene, wanted, Some(cap)).unwrap();
    while solver.step().is_some() {
        assert!(solver.counted_bytes() <= cap);
    }
    let solution = solver.into_solution();
    assert!(!solution.is_finished() && solution.statistics().estimated_error < 1.0);
}

#[test]
fn links_are_lit_anew_without_a_ray() {
    let scene = coloured_room();
    let lamp = scene.materials.iter().find(|m| m.radiance.sum() > 0.0).unwrap().name.clone();
    let wall = scene.material(scene.sides[2]).name.clone();
    let paints = [Paint::Emission(lamp, Rgb([0.5, 1.0, 0.7])), Paint::Reflectance(wall, Rgb::grey(0.3))];
    let mut painted = scene.clone();
    paints.iter().for_each(|paint| painted.paint(paint).unwrap());
    use Iteration::{GaussSeidel, Gmres, Jacobi, Shooting, Southwell};
    for (method, basis, iterations) in [
        (Method::Classical, "haar", &[Gmres, Shooting][..]),
        (Method::Galerkin, "m3", &[Jacobi]),
        (Method::Wavelet, "m2", &[Gmres, GaussSeidel, Southwell]),
    ] {
        for &iteration in iterations {
            let wanted = settings(method, basis, 0.08, iteration);
            let first = solve(&scene, wanted);
            let mut solver = Solver::resume(&first).unwrap();
            solver.relight(&paints).unwrap();
            let error = loop {
                if let Some(Event::Solved { error, .. }) = solver.step() {
                    break error;
                }
            };
            let again = solver.solution();
            assert_eq!(again.statistics().rays, first.statistics().rays, "{method} {basis}");
            let fresh = solve(&painted, wanted);
            let off = difference(&again, &fresh);
            assert!(off <= error + 0.08 && error < 0.2, "{method} {basis} {iteration}: {off} off, {error} stated");
            // and finer from there, with rays
            solver.promise(0.06).unwrap();
            while solver.step().is_some() {}
            let finer = solver.into_solution();
            assert!(finer.is_finished() && difference(&finer, &fresh) <= 0.14, "{method} {basis} {iteration}");
        }
    }
}

#[test]
fn what_was_black_when_links_were_made_is_not_lit_anew_in_silence() {
    let mut scene = coloured_room();
    let wall = scene.material(scene.sides[2]).name.clone();
    scene.paint(&Paint::Reflectance(wall.clone(), Rgb::BLACK)).unwrap();
    for (method, basis) in [(Method::Classical, "haar"), (Method::Wavelet, "m2")] {
        let solution = solve(&scene, settings(method, basis, 0.1, Iteration::Gmres));
        let mut solver = Solver::resume(&solution).unwrap();
        for paint in [Paint::Reflectance(wall.clone(), Rgb::grey(0.3)), Paint::Emission(wall.clone(), Rgb::grey(1.0))] {
            let refused = solver.relight(&[paint]).unwrap_err().to_string();
            assert!(refused.contains(&wall) && refused.contains("solve the scene anew"), "{refused}");
        }
    }
}
