//! Many lamps, hidden lamps, lamps of very different strength: none is forgotten, and none is paid for twice.

use ondelette_radiosity::ledger::Ledger;
use ondelette_radiosity::scene::{Paint, samples};
use ondelette_radiosity::{Event, Rgb, Scene, Settings, Solution, Solver};

type Quad = ([[f64; 3]; 4], Rgb, Rgb);

/// Walls of a unit cube, seen from inside; side 0 is the floor.
fn room(reflectance: f64) -> Vec<Quad> {
    let p = |i: u32| [0, 1, 2].map(|k| f64::from(i >> k & 1));
    let walls = [[0, 1, 3, 2], [6, 7, 5, 4], [0, 2, 6, 4], [3, 1, 5, 7], [1, 0, 4, 5], [2, 3, 7, 6]];
    walls.iter().map(|w| (w.map(p), Rgb::grey(reflectance), Rgb::BLACK)).collect()
}

/// A square lamp that faces down.
fn lamp([x, y, z]: [f64; 3], size: f64, radiance: f64) -> Quad {
    ([[x, y, z], [x, y + size, z], [x + size, y + size, z], [x + size, y, z]], Rgb::BLACK, Rgb::grey(radiance))
}

fn solver(scene: Scene, error: f64) -> Solver {
    let mut solver = Solver::new(scene, Settings { error, ..Settings::default() }).unwrap();
    while solver.step().is_some() {}
    solver
}

fn solve(faces: &[Quad], error: f64) -> Solution {
    let solution = solver(samples::quads("room", faces), error).into_solution();
    assert!(solution.is_finished());
    solution
}

/// Mean irradiance of the floor and the walls.
fn light(solution: &Solution) -> f64 {
    (0..6).map(|side| solution.mean_irradiance(side).sum()).sum()
}

/// Steps to the next estimate of the error.
fn balance(solver: &mut Solver) {
    while !matches!(solver.step(), Some(Event::Solved { .. }) | None) {}
}

#[test]
fn a_bright_lamp_behind_the_ceiling_takes_nothing_from_a_faint_one_below() {
    let mut faces = room(0.5);
    faces.push(lamp([0.6, 0.6, 0.9], 0.2, 1.0));
    let alone = light(&solve(&faces, 0.03));
    for (many, radiance) in [(1, 1000.0), (5, 100.0)] {
        let mut faces = faces.clone();
        for k in 0..many * many {
            let at = |i: usize| 0.05 + 0.9 * i as f64 / many as f64;
            faces.push(lamp([at(k % many), at(k / many), 1.3], 0.15, radiance));
        }
        let found = light(&solve(&faces, 0.03));
        assert!((found / alone - 1.0).abs() < 0.02, "{many}: {found} instead of {alone}");
    }
}

#[test]
fn lamps_behind_the_ceiling_cost_next_to_nothing() {
    let rays = |hidden: f64| {
        let mut faces = room(0.5);
        faces.push(lamp([0.6, 0.6, 0.9], 0.2, 1.0));
        for k in 0..25 {
            let at = |i: usize| 0.05 + 0.18 * i as f64;
            faces.push(lamp([at(k % 5), at(k / 5), 1.3], 0.15, hidden));
        }
        let solution = solve(&faces, 0.03);
        (solution.statistics().rays + solution.statistics().kernel_samples) as f64
    };
    let (faint, bright) = (rays(1e-3), rays(1000.0));
    assert!(bright < 6.0 * faint, "{bright} rays and fits where faint ones take {faint}");
}

/// A room under a lamp with many small boards between.
fn crowd() -> Vec<Quad> {
    let mut faces = room(0.0);
    faces.push(lamp([0.4, 0.4, 0.95], 0.2, 10.0));
    for k in 0..196 {
        let at = |i: usize| 0.02 + 0.07 * i as f64;
        faces.push((lamp([at(k % 14), at(k / 14), 0.6], 0.05, 0.0).0, Rgb::grey(0.1), Rgb::BLACK));
    }
    faces
}

#[test]
fn no_unit_of_length_is_better_than_another_among_many_things() {
    let scaled = |k: f64| {
        let mut faces = crowd();
        faces.iter_mut().flat_map(|f| f.0.iter_mut()).flatten().for_each(|x| *x *= k);
        light(&solve(&faces, 0.03))
    };
    let one = scaled(1.0);
    for k in [1e-3, 1e3] {
        assert!((scaled(k) / one - 1.0).abs() < 1e-6, "scale {k}: {} against {one}", scaled(k));
    }
}

#[test]
fn no_cap_on_memory_is_exceeded_and_none_wastes_what_it_allows() {
    let after = |cap: u64| {
        let settings = Settings { error: 0.01, ..Settings::default() };
        let mut solver = Solver::new(samples::quads("crowd", &crowd()), settings).unwrap();
        solver.limit_memory(cap).unwrap();
        while solver.step().is_some() {
            assert!(solver.counted_bytes() <= cap, "{} under a cap of {cap}", solver.counted_bytes());
        }
        solver.into_solution().statistics().estimated_error
    };
    let errors = [2_100_000, 3_000_000, 5_000_000].map(after);
    assert!(errors[0] > errors[1] && errors[1] > errors[2], "{errors:?}");
}

#[test]
fn light_from_what_was_no_lamp_is_bounced_as_often_as_any() {
    let mut faces = room(0.6);
    faces.push(lamp([0.1, 0.1, 0.95], 0.25, 10.0));
    faces.push(lamp([0.6, 0.6, 0.95], 0.25, 0.0));
    let scene = samples::quads("room", &faces);
    let [on, off] = [6, 7].map(|m: usize| scene.materials[m].name.clone());
    let kept = solver(scene, 0.02).into_kept();
    let mut again = Solver::resume(&kept).unwrap();
    again.relight(&[Paint::Emission(on, Rgb::BLACK), Paint::Emission(off, Rgb::grey(10.0))]).unwrap();
    balance(&mut again);
    (faces[6].2, faces[7].2) = (Rgb::BLACK, Rgb::grey(10.0));
    let fresh = light(&solve(&faces, 0.01));
    let (stated, off) = (again.solution().statistics().estimated_error, light(&again.solution()) / fresh - 1.0);
    assert!(off.abs() < stated + 0.01, "off by {off}, stated {stated}");
}

#[test]
fn a_promise_that_comes_and_goes_leaves_the_stated_error_alone() {
    // errors are told with a doubt
    let kept = solver(samples::quads("crowd", &crowd()), 0.03).into_kept();
    let mut again = Solver::resume(&kept).unwrap();
    let mut stated = |error: f64| {
        again.promise(error).unwrap();
        balance(&mut again);
        again.solution().statistics().estimated_error
    };
    let first = stated(0.03);
    let finer = stated(0.005);
    let last = stated(0.03);
    assert!(finer > 1.1 * first, "no doubt where there is a crowd: {first}, {finer}");
    assert!((last / first - 1.0).abs() < 1e-3, "{first} became {last}");
}

#[test]
fn a_lamp_of_its_own_material_costs_no_more_than_a_shared_one() {
    let lamps = |own: f64| -> Vec<Quad> {
        let at = |i: usize| 0.1 + 0.2 * i as f64 - 0.025;
        (0..25).map(|k| lamp([at(k % 5), at(k / 5), 0.95], 0.05, 10.0 * (1.0 + own * k as f64))).collect()
    };
    let with = |own: f64| {
        let mut faces = room(0.5);
        faces.extend(lamps(own));
        let mut scene = samples::quads("room", &faces);
        if own == 0.0 {
            let shared = scene.patches.iter().map(|p| p.material).max().unwrap();
            let shines = |m: u32| faces[m as usize].2.sum() > 0.0;
            scene.patches.iter_mut().filter(|p| shines(p.material)).for_each(|p| p.material = shared);
        }
        let solution = solver(scene, 0.05).into_solution();
        assert!(solution.is_finished());
        (solution.forest().leaves() as f64, light(&solution))
    };
    let ((few, shared), (many, own)) = (with(0.0), with(1e-4));
    assert!(many < 2.0 * few + 500.0, "{many} elements where a shared material takes {few}");
    assert!((own / shared - 1.0).abs() < 0.02, "{own} and {shared}");
}

#[test]
fn a_faint_lamp_is_known_well_enough_when_the_bright_one_goes_out() {
    for ratio in [60.0, 1e6] {
        let mut faces = room(0.5);
        faces.extend([lamp([0.1, 0.1, 0.95], 0.25, ratio), lamp([0.6, 0.6, 0.95], 0.25, 1.0)]);
        let scene = samples::quads("room", &faces);
        let bright = scene.materials[6].name.clone();
        let kept = solver(scene, 0.1).into_kept();
        let mut again = Solver::resume(&kept).unwrap();
        again.relight(&[Paint::Emission(bright, Rgb::BLACK)]).unwrap();
        balance(&mut again);
        faces.remove(6);
        let fresh = light(&solve(&faces, 0.01));
        let (stated, off) = (again.solution().statistics().estimated_error, light(&again.solution()) / fresh - 1.0);
        assert!(off.abs() < stated + 0.01, "{ratio}: off by {off}, stated {stated}");
        while again.step().is_some() {}
        let off = light(&again.solution()) / fresh - 1.0;
        assert!(again.solution().is_finished() && off.abs() < 0.08, "{ratio}: refined, off by {off}");
    }
}

#[test]
fn lighting_anew_with_the_same_lamps_keeps_the_promise_without_a_ray() {
    let mut faces = room(0.7);
    faces.push(lamp([0.4, 0.4, 0.95], 0.2, 10.0));
    for error in [0.03, 0.005] {
        let scene = samples::quads("room", &faces);
        let same = Paint::Emission(scene.materials[6].name.clone(), scene.materials[6].radiance);
        let kept = solver(scene, error).into_kept();
        let mut again = Solver::resume(&kept).unwrap();
        again.relight(&[same]).unwrap();
        balance(&mut again);
        let statistics = again.solution().statistics().clone();
        assert!(statistics.estimated_error <= error, "{error}: {}", statistics.estimated_error);
        assert_eq!(statistics.rays, kept.statistics().rays);
    }
}

/// The six sides of a block, seen from outside.
fn block([x, y, z]: [f64; 3], size: [f64; 3], reflectance: f64) -> Vec<Quad> {
    let mut faces = room(reflectance);
    for (corners, ..) in &mut faces {
        corners.reverse();
        *corners = corners.map(|p| [x + size[0] * p[0], y + size[1] * p[1], z + size[2] * p[2]]);
    }
    faces
}

#[test]
fn a_bright_box_in_a_wide_field_closes_the_ledger() {
    // its sides are tiny beside the field, and yet they hold nearly all of the light
    let mut faces = room(0.9);
    faces.remove(3);
    faces.push(lamp([0.25, 0.25, 0.95], 0.1, 1000.0));
    faces.extend(block([0.25, 0.25, 0.1], [0.15, 0.25, 0.4], 0.9));
    faces.extend(block([0.6, 0.5, 0.0025], [0.25, 0.35, 0.2475], 0.9));
    let (low, high) = (-48.2, 51.8);
    let field = [[low, low, -0.5], [high, low, -0.5], [high, high, -0.5], [low, high, -0.5]];
    faces.push((field, Rgb::grey(0.1), Rgb::BLACK));
    let solution = solve(&faces, 0.05);
    let closure = Ledger::count(&solution, 1 << 16).closure();
    assert!(closure.abs() < 0.06, "the ledger is open by {closure}");
}
