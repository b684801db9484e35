//! The engine of sampled rows: exact where it must be, honest about its error, the same for any number of threads.

use glam::DVec3;
use ondelette_numerics::par;
use ondelette_radiosity::ledger::Ledger;
use ondelette_radiosity::probe::Prober;
use ondelette_radiosity::scene::{Paint, samples};
use ondelette_radiosity::{Basis, DirectLight, Event, Method, Rgb, Scene, Settings, Solution, SolveError, Solver};

fn solve(scene: Scene, basis: &str, error: f64) -> Solution {
    let basis: Basis = basis.parse().unwrap();
    let mut solver =
        Solver::new(scene, Settings { basis, method: Method::Sampled, error, ..Settings::default() }).unwrap();
    while solver.step().is_some() {}
    let solution = solver.into_solution();
    assert!(solution.is_finished());
    solution
}

const PLACES: [[f64; 2]; 6] = [[0.01, 0.01], [0.5, 0.5], [0.03, 0.7], [0.9, 0.99], [0.33, 0.25], [0.999, 0.001]];

/// A box in a unit cube; `foot` is where it stands.
fn room_with_box(foot: f64) -> Vec<([[f64; 3]; 4], Rgb, Rgb)> {
    let p = |i: u32, o: [f64; 3], s: f64| [0, 1, 2].map(|k| o[k] + s * f64::from(i >> k & 1));
    let walls = [[0, 1, 3, 2], [6, 7, 5, 4], [0, 2, 6, 4], [3, 1, 5, 7], [1, 0, 4, 5], [2, 3, 7, 6]];
    let mut faces: Vec<_> =
        walls.iter().map(|w| (w.map(|i| p(i, [0.0; 3], 1.0)), Rgb::grey(0.6), Rgb::BLACK)).collect();
    let corner = [0.35, 0.3, foot];
    faces.extend(
        walls[1..].iter().map(|w| ([w[3], w[2], w[1], w[0]].map(|i| p(i, corner, 0.35)), Rgb::grey(0.6), Rgb::BLACK)),
    );
    let lamp = [[0.4, 0.4, 0.99], [0.4, 0.6, 0.99], [0.6, 0.6, 0.99], [0.6, 0.4, 0.99]];
    faces.push((lamp, Rgb::BLACK, Rgb::grey(10.0)));
    faces
}

#[test]
fn a_white_furnace_is_equally_bright_everywhere() {
    for basis in ["haar", "m2", "m3", "f2"] {
        for rho in [0.5, 0.9] {
            let solution = solve(samples::cube(rho, [1.0; 6]), basis, 0.01);
            for side in 0..6 {
                for at in PLACES {
                    let error = solution.radiosity(side, at).0[1] * (1.0 - rho) - 1.0;
                    assert!(error.abs() <= 2e-3, "{basis} rho {rho} side {side} {at:?}: off by {error:.2e}");
                }
            }
        }
    }
}

#[test]
fn unequal_emission_in_a_closed_box_keeps_the_energy_identity() {
    // integral of B = integral of M / (1 - rho), whatever M
    for (basis, error) in [("haar", 0.05), ("m2", 0.01), ("m3", 0.01)] {
        let rho = 0.7;
        let solution = solve(samples::cube(rho, [3.0, 0.0, 0.5, 0.0, 0.0, 1.0]), basis, error);
        let e: f64 = (0..6).map(|side| solution.mean_irradiance(side).0[0]).sum();
        let expected = 4.5 / (1.0 - rho);
        assert!((e / expected - 1.0).abs() < 0.5 * error, "{basis}: {e} instead of {expected}");
    }
}

#[test]
fn facing_squares_exchange_what_howell_c11_says() {
    for basis in ["haar", "m2", "m3", "f2"] {
        let solution = solve(samples::facing_squares(1.0), basis, 0.01);
        let got = solution.mean_irradiance(0).0[0];
        assert!((got / 0.199824895698387 - 1.0).abs() < 5e-3, "{basis}: {got}");
    }
}

#[test]
fn a_square_in_the_way_takes_what_the_clipped_closed_form_says() {
    // parallel unit squares one apart, an opaque coaxial square half way: Howell B-3 clipped point by point
    for (side, expected) in [(0.25, 0.169474204911786), (0.5, 0.0995062945989849)] {
        let light = Rgb::grey(std::f64::consts::FRAC_1_PI);
        let (a, b) = (0.5 - side / 2.0, 0.5 + side / 2.0);
        let floor = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let lamp = [[0.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0]];
        let block = [[a, a, 0.5], [b, a, 0.5], [b, b, 0.5], [a, b, 0.5]];
        let faces = [(floor, Rgb::BLACK, Rgb::BLACK), (lamp, Rgb::BLACK, light), (block, Rgb::BLACK, Rgb::BLACK)];
        let got = solve(samples::quads("blocked", &faces), "m2", 0.01).mean_irradiance(0).0[0];
        assert!((got / expected - 1.0).abs() < 0.01, "{side}: {got} instead of {expected}");
    }
}

#[test]
fn the_error_is_kept_and_the_ledger_closes() {
    let scene = samples::quads("box", &room_with_box(0.0));
    let fine = solve(scene.clone(), "m2", 0.004);
    let coarse = solve(scene, "m2", 0.02);
    let (mut error, mut whole) = (0.0, 0.0);
    let probers = [&coarse, &fine].map(Prober::new);
    for side in 0..11 {
        let area = if side < 6 { 1.0 } else { 0.35 * 0.35 };
        for i in 0..400 {
            let at = [(f64::from(i % 20) + 0.5) / 20.0, (f64::from(i / 20) + 0.5) / 20.0];
            let [a, b] = [0, 1].map(|k: usize| probers[k].irradiance(side, at));
            error += area * (a + b * -1.0).0[0].abs();
            whole += area * b.0[0];
        }
    }
    assert!(error / whole < 0.02, "error {}", error / whole);
    assert!(fine.statistics().estimated_error <= 0.004);
    for (solution, most) in [(&coarse, 0.01), (&fine, 0.003)] {
        let closure = Ledger::count(solution, 1 << 18).closure();
        assert!(closure.abs() < most, "ledger off by {closure}");
    }
}

#[test]
fn it_is_dark_under_a_box_and_bright_right_beside_it() {
    let scene = samples::quads("box", &room_with_box(0.0));
    let solution = solve(scene, "m2", 0.02);
    let prober = Prober::new(&solution);
    let under = |x: f64, y: f64| {
        let (side, at) = prober.find(DVec3::new(x, y, 0.0), DVec3::Z).unwrap();
        prober.irradiance(side, at).0[0]
    };
    let open = under(0.1, 0.1);
    for [x, y] in [[0.36, 0.31], [0.5, 0.5], [0.69, 0.64], [0.355, 0.4]] {
        assert_eq!(under(x, y), 0.0, "at {x}, {y}");
    }
    for [x, y] in [[0.34, 0.29], [0.71, 0.5], [0.345, 0.4]] {
        assert!(under(x, y) > 0.05 * open, "at {x}, {y}: {} against {open}", under(x, y));
    }
}

#[test]
fn threads_change_nothing_and_every_state_is_valid() {
    let run = |threads| {
        par::with_threads(threads, || {
            let scene = samples::quads("box", &room_with_box(0.1));
            let mut solver = Solver::new(scene, Settings { error: 0.03, ..Settings::default() }).unwrap();
            let mut states = Vec::new();
            while let Some(event) = solver.step() {
                if matches!(event, Event::Solved { .. } | Event::Refining { .. }) {
                    let state = solver.solution();
                    assert!(state.coefficients().as_flattened().iter().all(|c| c.is_finite()));
                    states.push(state.mean_irradiance(0));
                }
            }
            (states, solver.into_solution().coefficients().to_vec())
        })
        .unwrap()
    };
    let one = run(1);
    assert!(one.0.len() > 3);
    assert_eq!(one, run(3));
}

#[test]
fn no_unit_of_length_is_better_than_another() {
    let scaled = |k: f64| {
        let mut faces = room_with_box(0.1);
        faces.iter_mut().flat_map(|f| f.0.iter_mut()).flatten().for_each(|x| *x *= k);
        solve(samples::quads("box", &faces), "m2", 0.05).mean_irradiance(0).0[0]
    };
    let one = scaled(1.0);
    for k in [1e-3, 1e3] {
        assert!((scaled(k) / one - 1.0).abs() < 1e-6, "scale {k}: {} against {one}", scaled(k));
    }
}

#[test]
fn every_basis_lights_a_room() {
    // high orders must converge with few points, and flatlets must stand a floor under a box
    for basis in ["m1", "m3", "m4", "m5", "m6", "f2", "f3", "f4"] {
        let scene = samples::quads("box", &room_with_box(0.0));
        let mean = solve(scene, basis, 0.1).mean_irradiance(1).0[0];
        assert!((mean / 0.317 - 1.0).abs() < 0.1, "{basis}: {mean}");
    }
}

/// Steps to the next estimate of the error.
fn balance(solver: &mut Solver) {
    while !matches!(solver.step(), Some(Event::Solved { .. }) | None) {}
}

#[test]
fn relighting_casts_no_ray_and_gives_what_a_fresh_solve_gives() {
    let settings = Settings { error: 0.01, ..Settings::default() };
    let scene = samples::cube(0.6, [3.0, 0.0, 0.5, 0.0, 0.0, 1.0]);
    let paints = [
        Paint::Emission(scene.materials[0].name.clone(), Rgb::new(0.0, 1.0, 2.0)),
        Paint::Reflectance(scene.materials[2].name.clone(), Rgb::new(0.1, 0.5, 0.8)),
        // this one did not shine before
        Paint::Emission(scene.materials[1].name.clone(), Rgb::grey(0.2)),
    ];
    let mut painted = scene.clone();
    paints.iter().for_each(|p| painted.paint(p).unwrap());
    let fresh = solve(painted, "m2", 0.003);

    let mut first = Solver::new(scene, settings).unwrap();
    while first.step().is_some() {}
    let kept = first.into_kept();
    let rays = kept.statistics().rays;
    let mut again = Solver::resume(&kept).unwrap();
    again.relight(&paints).unwrap();
    balance(&mut again);
    let relit = again.solution();
    assert_eq!(relit.statistics().rays, rays);
    let stated = relit.statistics().estimated_error;
    assert!(stated < 0.05, "{stated}");
    let (mut missed, mut whole) = (0.0, 0.0);
    for side in 0..6 {
        missed +=
            (relit.mean_irradiance(side) + fresh.mean_irradiance(side) * -1.0).0.map(f64::abs).iter().sum::<f64>();
        whole += fresh.mean_irradiance(side).sum();
    }
    assert!(missed <= (stated + 0.003) * whole, "{missed} of {whole}, stated {stated}");

    // and with the missing rays it keeps a finer promise
    again.promise(0.005).unwrap();
    while again.step().is_some() {}
    assert!(again.solution().is_finished() && again.solution().statistics().rays > rays);
}

#[test]
fn a_light_that_is_switched_off_and_on_again_is_as_it_was() {
    let scene = samples::quads("box", &room_with_box(0.0));
    let lamp = scene.materials.iter().find(|m| m.radiance.sum() > 0.0).unwrap().clone();
    let mut solver = Solver::new(scene, Settings { error: 0.03, ..Settings::default() }).unwrap();
    while solver.step().is_some() {}
    let mut again = Solver::resume(&solver.into_kept()).unwrap();
    balance(&mut again);
    let before = again.solution().mean_irradiance(1);
    again.relight(&[Paint::Emission(lamp.name.clone(), Rgb::BLACK)]).unwrap();
    balance(&mut again);
    assert_eq!(again.solution().mean_irradiance(1), Rgb::BLACK);
    again.relight(&[Paint::Emission(lamp.name, lamp.radiance)]).unwrap();
    balance(&mut again);
    assert!((again.solution().mean_irradiance(1).sum() / before.sum() - 1.0).abs() < 1e-6);
}

#[test]
fn a_cap_on_memory_is_kept_and_the_promise_too() {
    let scene = || samples::quads("box", &room_with_box(0.0));
    let settings = Settings { error: 0.01, ..Settings::default() };
    let free = solve(scene(), "m2", 0.01);
    let mut solver = Solver::new(scene(), settings).unwrap();
    assert!(matches!(solver.limit_memory(1000), Err(SolveError::Memory { .. })));
    let cap = 6_000_000;
    solver.limit_memory(cap).unwrap();
    let mut most = 0;
    while solver.step().is_some() {
        most = most.max(solver.counted_bytes());
    }
    assert!(most <= cap, "{most}");
    let capped = solver.into_solution();
    assert!(capped.is_finished());
    for side in 0..free.scene().sides.len() {
        let [a, b] = [&free, &capped].map(|s| s.mean_irradiance(side).sum());
        assert!((a - b).abs() <= 0.01 * (a + b) + 1e-9, "side {side}: {a} and {b}");
    }
    // without the cap it takes more
    let mut solver = Solver::new(scene(), settings).unwrap();
    while solver.step().is_some() {}
    assert!(solver.counted_bytes() > cap);
}

#[test]
fn slats_in_step_with_the_elements_are_seen() {
    // 64 slats over a floor, as wide as the gaps between them, in the light of a large panel right above
    let mut faces = vec![
        ([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]], Rgb::grey(0.0), Rgb::BLACK),
        ([[0.0, 0.0, 2.0], [0.0, 1.0, 2.0], [1.0, 1.0, 2.0], [1.0, 0.0, 2.0]], Rgb::BLACK, Rgb::grey(1.0)),
    ];
    for k in 0..64 {
        let [a, b] = [0.25, 0.75].map(|o| (f64::from(k) + o) / 64.0);
        faces.push(([[a, 0.0, 1e-4], [b, 0.0, 1e-4], [b, 1.0, 1e-4], [a, 1.0, 1e-4]], Rgb::BLACK, Rgb::BLACK));
    }
    let solution = solve(samples::quads("slats", &faces), "m2", 0.05);
    let open = solve(samples::quads("floor", &faces[..2]), "m2", 0.01);
    let share = solution.mean_irradiance(0).sum() / open.mean_irradiance(0).sum();
    assert!((share - 0.5).abs() < 0.03, "{share}");
}

#[test]
fn strong_reflections_of_a_spot_carry_their_scatter() {
    // a small lamp close over the floor of a bright room: nearly all light has been reflected several times
    let walls = samples::cube(0.9, [0.0; 6]);
    let mut faces: Vec<_> = walls
        .patches
        .iter()
        .map(|p| {
            let corners = p.corners();
            ([0, 1, 2, 3].map(|i| corners[i].to_array()), Rgb::grey(0.9), Rgb::BLACK)
        })
        .collect();
    let low = walls.bounds[0];
    let size = walls.bounds[1] - low;
    let corner = |s: f64, t: f64| (low + size * DVec3::new(0.45 + 0.1 * s, 0.45 + 0.1 * t, 0.15)).to_array();
    let lamp = [corner(0.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0), corner(1.0, 0.0)];
    faces.push((lamp, Rgb::BLACK, Rgb::grey(1.0)));
    let solution = solve(samples::quads("spot", &faces), "m2", 0.01);
    let ledger = Ledger::count(&solution, 1 << 18);
    assert!(ledger.closure().abs() < 0.012, "{}", ledger.closure());
}

#[test]
fn direct_light_gathered_anew_makes_shadows_crisp() {
    let scene = || samples::quads("box", &room_with_box(0.0));
    let mut solver = Solver::new(scene(), Settings { error: 0.1, ..Settings::default() }).unwrap();
    while solver.step().is_some() {}
    let coarse = solver.into_kept();
    let fine = solve(scene(), "m2", 0.01);
    assert!(Prober::reading(&fine, DirectLight::Gathered).is_none(), "nothing was kept");
    let [fitted, exact] = [Prober::new(&coarse), Prober::reading(&coarse, DirectLight::Gathered).unwrap()];
    let truth = Prober::new(&fine);
    // root mean square on a line across the shadow of the box on the floor
    let miss = |prober: &Prober| {
        let square = |k: u32| {
            let at = [0.02 + 0.96 * f64::from(k) / 200.0, 0.71];
            (prober.irradiance(0, at).0[0] - truth.irradiance(0, at).0[0]).powi(2)
        };
        ((0..200).map(square).sum::<f64>() / 200.0).sqrt()
    };
    let [blurred, crisp] = [miss(&fitted), miss(&exact)];
    assert!(crisp < 0.7 * blurred, "{crisp} against {blurred}");
}

#[test]
fn where_direct_light_is_gathered_few_elements_keep_the_promise() {
    let scene = || samples::quads("box", &room_with_box(0.0));
    let told = |direct| Settings { error: 0.01, direct, ..Settings::default() };
    let [fitted, gathered] = [DirectLight::Fitted, DirectLight::Gathered].map(|direct| {
        let mut solver = Solver::new(scene(), told(direct)).unwrap();
        while solver.step().is_some() {}
        solver.into_solution()
    });
    assert!(gathered.is_finished() && !gathered.kept().unwrap().has_samples());
    let [many, few] = [&fitted, &gathered].map(|s| s.forest().leaves());
    assert!(3 * few < 2 * many, "{few} and {many} elements");
    let fine = solve(scene(), "m2", 0.003);
    // mean absolute error of what is read, relative to the mean
    let error = |prober: &Prober| {
        let truth = Prober::new(&fine);
        let (mut off, mut whole) = (0.0, 0.0);
        for side in
            (0..scene().sides.len()).filter(|&i| !fine.scene().material(fine.scene().sides[i]).is_pure_emitter())
        {
            let area = fine.scene().patches[fine.scene().sides[side].patch as usize].area();
            for k in 0..400 {
                let at = [(f64::from(k % 20) + 0.4) / 20.0, (f64::from(k / 20) + 0.6) / 20.0];
                let [a, b] = [prober, &truth].map(|p| p.irradiance(side, at).sum());
                off += area * (a - b).abs();
                whole += area * b;
            }
        }
        off / whole
    };
    let blurred = error(&Prober::reading(&gathered, DirectLight::Fitted).unwrap());
    let crisp = error(&Prober::new(&gathered));
    assert!(crisp < 0.01 && crisp < 0.95 * blurred, "{crisp}, read as fitted {blurred}");
    // what is read does not depend on what was read before
    let points: Vec<[f64; 2]> =
        (0..64).map(|k| [f64::from(k % 8) / 8.0 + 0.03, f64::from(k / 8) / 8.0 + 0.05]).collect();
    let [forth, back] = [Prober::new(&gathered), Prober::new(&gathered)];
    let mut there: Vec<Rgb> = points.iter().map(|at| forth.irradiance(0, *at)).collect();
    there.reverse();
    let here: Vec<Rgb> = points.iter().rev().map(|at| back.irradiance(0, *at)).collect();
    assert_eq!(there, here);
}

#[test]
fn relighting_may_change_how_direct_light_is_read() {
    let mut solver =
        Solver::new(samples::quads("box", &room_with_box(0.0)), Settings { error: 0.03, ..Settings::default() })
            .unwrap();
    while solver.step().is_some() {}
    let kept = solver.into_kept();
    let stated = |direct, from: &Solution| {
        let mut solver = Solver::resume(from).unwrap();
        solver.read_direct(direct).unwrap();
        loop {
            match solver.step().unwrap() {
                Event::Solved { error, .. } => return (error, solver.into_kept()),
                _ => continue,
            }
        }
    };
    let (gathered, other) = stated(DirectLight::Gathered, &kept);
    let (fitted, _) = stated(DirectLight::Fitted, &other);
    let before = kept.statistics().estimated_error;
    assert!((gathered / before - 1.0).abs() > 0.01, "{gathered} from {before}");
    assert!((fitted - before).abs() < 0.1 * before, "{fitted} from {before}");
    assert_eq!(other.statistics().rays, kept.statistics().rays);
    // methods with links know no lamps
    let linked = Settings { method: Method::Wavelet, error: 0.2, ..Settings::default() };
    let mut solver = Solver::new(samples::facing_squares(1.0), linked).unwrap();
    assert!(solver.read_direct(DirectLight::Gathered).is_err() && solver.read_direct(DirectLight::Fitted).is_ok());
}

#[test]
fn full_shadow_stays_dark_where_light_is_gathered_anew() {
    let level = |x: [f64; 2], y: f64, z: [f64; 2]| [[x[0], y, z[0]], [x[0], y, z[1]], [x[1], y, z[1]], [x[1], y, z[0]]];
    let (half, height, blocker) = (0.05, 2.0, [[-0.37, 0.39], [-0.41, 0.43]]);
    let mut lamp = level([-half, half], height, [-half, half]);
    lamp.reverse();
    let faces = [
        (level([-2.0, 2.0], 0.0, [-2.0, 2.0]), Rgb::BLACK, Rgb::BLACK),
        (lamp, Rgb::BLACK, Rgb::grey(1.0)),
        (level(blocker[0], 0.5, blocker[1]), Rgb::BLACK, Rgb::BLACK),
    ];
    let mut solver =
        Solver::new(samples::quads("hard", &faces), Settings { error: 0.01, ..Settings::default() }).unwrap();
    while solver.step().is_some() {}
    let solution = solver.into_kept();
    let prober = Prober::reading(&solution, DirectLight::Gathered).unwrap();
    // nothing reflects: a sum over the lamp's points is all there is
    let truth = |p: [f64; 2]| {
        let n = 64;
        let mut sum = 0.0;
        for k in 0..n * n {
            let l = [k % n, k / n].map(|i| half * (2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0));
            let at = [0, 1].map(|c| p[c] + 0.25 * (l[c] - p[c]));
            let hidden = (0..2).all(|c| (blocker[c][0]..blocker[c][1]).contains(&at[c]));
            let square = (0..2).map(|c| (l[c] - p[c]).powi(2)).sum::<f64>() + height * height;
            sum += if hidden { 0.0 } else { height * height / (square * square) };
        }
        sum * (2.0 * half / f64::from(n)).powi(2)
    };
    let (mut seen, mut worst) = (0, 0.0f64);
    for k in 0..3000 {
        let at = [0.3 + 0.4 * f64::from(k % 60) / 60.0, 0.3 + 0.4 * f64::from(k / 60) / 50.0];
        if prober.is_penumbra(solution.forest().locate(0, at).0) {
            let p = solution.point(0, at);
            worst = worst.max((prober.irradiance(0, at).0[0] - truth([p.x, p.z])).abs());
            seen += 1;
        }
    }
    let lit = truth([0.8, 0.0]);
    assert!(seen > 100 && worst < 0.05 * lit, "{seen} points, off by {} of what is lit", worst / lit);
}
