//! Curvature constraints: found on ordinary problems, at the least energy, and never claimed where they are missed.

use ondelette_modeling::Axis;
use ondelette_modeling::constraint::{Constraint, Demand};
use ondelette_modeling::energy::Energy;
use ondelette_modeling::solve::{Method, Settings, Solution, Solver};
use ondelette_modeling::system::{Problem, Space};
use ondelette_numerics::seed;
use ondelette_wavelet::Boundary;

fn at(id: &str, t: f64, to: &[f64]) -> Constraint {
    Constraint::new(id, &[t], Demand::Position(to.iter().copied().map(Some).collect()))
}

fn along(id: &str, t: f64, to: &[f64]) -> Constraint {
    Constraint::new(id, &[t], Demand::Derivative(0, to.iter().copied().map(Some).collect()))
}

fn bent(id: &str, t: f64, k: f64) -> Constraint {
    Constraint::new(id, &[t], Demand::Curvature(k))
}

fn solve(spans: usize, energy: Energy, coordinates: usize, rows: &[Constraint]) -> Solution {
    let axis = Axis::new(Boundary::Open, spans, [0.0, 1.0]).unwrap();
    let problem = Problem::new(Space::curve(axis), coordinates, energy, None, rows.to_vec()).unwrap();
    let mut solver = Solver::new(problem, Settings::default()).unwrap();
    while solver.step().is_some() {}
    solver.solution()
}

/// The largest miss of all rows.
fn worst(solution: &Solution) -> f64 {
    solution.residuals().iter().fold(0.0, |m: f64, r| m.max(r.miss.abs()))
}

#[test]
fn sharp_bends_between_few_points_are_found() {
    for k in [5.0, 6.0, 8.0, 20.0, -2.0, -8.0] {
        let points = [at("a", 0.0, &[0.0, 0.0]), at("b", 0.5, &[1.0, 1.0]), at("c", 1.0, &[2.0, 0.0])];
        let found = solve(16, Energy::BEND, 2, &[&points[..], &[bent("k", 0.25, k)]].concat());
        assert!(found.converged(), "{k}: {:?}", found.notes());
        assert!(worst(&found) < 1e-9 * k.abs(), "{k}: {:e}", worst(&found));
    }
}

/// Four points and a curvature in the plane or in space, sometimes with a tangent.
fn random(number: u64) -> (usize, Energy, usize, Vec<Constraint>) {
    let mut count = 0;
    let mut unit = || {
        count += 1;
        seed::unit(seed::combine(number, count))
    };
    let coordinates = 2 + usize::from(unit() < 0.5);
    let spans = 16 << (unit() * 3.0) as usize;
    let energy = match (unit() * 3.0) as usize {
        0 => Energy::BEND,
        1 => Energy::new(0.0, 0.0, 1.0).unwrap(),
        _ => Energy::new(1.0, 1.0, 0.0).unwrap(),
    };
    let mut rows = Vec::new();
    for (i, t) in [0.0, 0.3, 0.6, 1.0].into_iter().enumerate() {
        let to: Vec<f64> = (0..coordinates).map(|_| 2.0 * unit() - 1.0).collect();
        rows.push(at(&format!("p{i}"), t, &to));
    }
    let place = [0.15, 0.45, 0.8, 0.5][(unit() * 4.0) as usize];
    rows.push(bent("k", place, 0.5 + 7.5 * unit()));
    if unit() < 0.5 {
        let to: Vec<f64> = (0..coordinates).map(|_| 6.0 * unit() - 3.0).collect();
        rows.push(along("t", 0.0, &to));
    }
    (spans, energy, coordinates, rows)
}

#[test]
fn ordinary_problems_converge_to_a_shape_of_least_energy() {
    for number in 0..150 {
        let (spans, energy, coordinates, rows) = random(number);
        let found = solve(spans, energy, coordinates, &rows);
        assert!(found.converged() && worst(&found) < 1e-7, "{number}: {:e} {:?}", worst(&found), found.notes());
        // The tangent there, a little longer, shorter or turned, costs more.
        let place = rows[4].at[0];
        let tangent: Vec<f64> = found.eval(&[place], [1, 0]);
        let size = tangent.iter().map(|v| v * v).sum::<f64>().sqrt();
        let energy_with = |d: &[f64]| {
            let held = solve(spans, energy, coordinates, &[&rows[..], &[along("held", place, d)]].concat());
            assert!(held.converged(), "{number}: {:?}", held.notes());
            held.energy()
        };
        let least = found.energy();
        assert!((energy_with(&tangent) / least - 1.0).abs() < 1e-6, "{number}");
        for axis in 0..coordinates {
            for by in [-1e-3, 1e-3] {
                let mut moved = tangent.clone();
                moved[axis] += by * size;
                let more = energy_with(&moved);
                assert!(more >= least * (1.0 - 1e-8), "{number}: {more} below {least}");
            }
        }
    }
}

#[test]
fn bends_that_hardly_cost_are_settled_too() {
    // Whole steps shrink by 2.5 percent each: next to nothing holds the shape along the way.
    let rows = [
        at("p0", 0.0, &[-0.695_735_956_871_603_9, 0.255_543_744_206_260_25]),
        at("p1", 0.3, &[0.874_899_246_391_171_1, 0.499_460_552_606_074_47]),
        at("p2", 0.6, &[0.908_178_289_791_787_2, 0.509_844_070_556_762_4]),
        at("p3", 1.0, &[0.111_166_859_666_836_26, -0.826_148_565_762_538]),
        bent("k", 0.45, 1.999_585_027_427_400_3),
    ];
    let found = solve(64, Energy::new(0.0, 0.0, 1.0).unwrap(), 2, &rows);
    assert!(found.converged() && worst(&found) < 1e-7, "{:e} {:?}", worst(&found), found.notes());
    let rows = [
        at("p0", 0.0, &[-0.794_727_247_820_122_8, -0.550_423_879_457_791_6]),
        at("p1", 0.3, &[0.551_307_665_123_204_5, -0.175_833_114_003_393_3]),
        at("p2", 0.6, &[0.655_611_958_410_718_1, -0.232_190_737_697_512_53]),
        at("p3", 1.0, &[0.254_006_249_298_127_1, 0.406_874_649_412_082_73]),
        bent("k", 0.45, 7.364_749_680_871_376),
        along("t", 0.0, &[2.453_277_836_817_558_3, 2.354_780_363_309_338]),
    ];
    let found = solve(32, Energy::new(1.0, 1.0, 0.0).unwrap(), 2, &rows);
    assert!(found.converged() && worst(&found) < 1e-7, "{:e} {:?}", worst(&found), found.notes());
}

#[test]
fn what_diverged_before_is_finite_now() {
    // Energy was infinite, the miss 1e140, and the solver content.
    let rows = [
        at("p0", 0.0, &[0.969_224_125_374_198_9, 0.225_223_453_208_789_12]),
        at("p1", 0.3, &[-0.923_795_895_397_726_6, -0.584_241_589_046_153_4]),
        at("p2", 0.6, &[0.917_339_309_749_611_6, 0.591_356_421_779_289]),
        at("p3", 1.0, &[0.480_977_405_597_461_4, 0.323_975_200_420_706_4]),
        bent("k", 0.15, 7.953_746_531_350_516),
    ];
    let found = solve(16, Energy::new(0.0, 0.0, 1.0).unwrap(), 2, &rows);
    assert!(found.converged() && found.energy() < 1e6, "{:e} {:?}", found.energy(), found.notes());
    assert!(worst(&found) < 1e-9);
}

#[test]
fn a_point_has_no_curvature_and_nobody_says_so() {
    let collapsed = [at("a", 0.0, &[0.0, 0.0]), at("b", 1.0, &[0.0, 0.0]), bent("k", 0.5, 5.0)];
    let lone = [at("a", 0.0, &[-1.2, -1.6, 0.4]), bent("k", 0.7, 1.6)];
    for (coordinates, rows) in [(2, &collapsed[..]), (3, &lone[..])] {
        let found = solve(3, Energy::BEND, coordinates, rows);
        assert!(!found.converged());
        assert!(
            found.notes().iter().any(|n| n.contains("constraint k") && n.contains("collapsed")),
            "{:?}",
            found.notes()
        );
    }
}

#[test]
fn curvature_at_a_mirrored_end_is_refused_but_of_heights() {
    let space = Space::curve(Axis::new(Boundary::Mirrored, 16, [0.0, 1.0]).unwrap());
    let problem = |coordinates: usize, t: f64| {
        let rows = vec![at("a", 0.3, &vec![1.0; coordinates]), bent("k", t, 1.0)];
        Problem::new(space.clone(), coordinates, Energy::BEND, None, rows)
    };
    for t in [0.0, 1.0] {
        let refused = problem(2, t).unwrap_err().to_string();
        assert!(refused.contains("constraint k") && refused.contains("mirrored"), "{refused}");
    }
    assert!(problem(2, 0.5).is_ok());
    // A height has curvature at its crest.
    let solution = Solver::new(problem(1, 0.0).unwrap(), Settings::default()).and_then(Solver::run).unwrap();
    assert!(solution.converged() && worst(&solution) < 1e-9, "{:?}", solution.notes());
}

#[test]
fn a_row_that_is_missed_is_named_whatever_the_solver_says() {
    // Crowded rows on few spans: multipliers of the sparse factor creep, and small steps looked like an end.
    let axis = Axis::new(Boundary::Mirrored, 6, [-1.0, 0.0]).unwrap();
    let rows = vec![
        at("c0", -0.121_604_112_216_482_04, &[-0.898_650_132_549_513_1]),
        at("c1", -0.672_805_647_985_107, &[-0.908_740_616_218_448_6]),
        at("c2", -0.650_150_787_629_907_4, &[0.230_995_042_313_945_3]),
        along("c3", -0.161_408_858_703_005_36, &[-0.521_082_009_376_231_4]),
        at("c4", -0.393_856_273_255_477, &[-0.582_494_531_709_464_5]),
        at("c5", -0.079_925_651_009_075_2, &[-0.195_596_994_322_190_46]),
        at("c9", -0.534_895_991_307_091_8, &[-0.731_641_838_198_307_6]),
        along("c6", -0.866_268_726_479_592_7, &[0.785_716_690_519_800_1]).soft(399.9),
        at("c7", -0.250_366_648_337_772_34, &[0.242_003_802_595_648_35]).soft(1.288),
        at("c11", -0.748_945_425_289_596_5, &[0.200_863_278_363_686_56]).soft(9.77),
    ];
    let problem = Problem::new(Space::curve(axis), 1, Energy::new(1.0, 0.0, 0.0).unwrap(), None, rows.clone()).unwrap();
    // One whose other coordinate is left out, which a note says, is named for this one too.
    let other = |to: Vec<Option<f64>>, at: f64, id: &str| Constraint::new(id, &[at], Demand::Position(to));
    let mut both: Vec<Constraint> = vec![other(vec![None, Some(1.0)], rows[2].at[0] - 5e-9, "beside")];
    both.extend(rows.iter().enumerate().map(|(i, row)| {
        let more = |v: &[Option<f64>]| vec![v[0], (i == 2).then_some(1.0 + 1e-8)];
        let mut row = row.clone();
        match &mut row.demand {
            Demand::Position(v) | Demand::Derivative(_, v) => *v = more(v),
            _ => {}
        }
        row
    }));
    let twice = Problem::new(Space::curve(axis), 2, Energy::new(1.0, 0.0, 0.0).unwrap(), None, both).unwrap();
    let settings = Settings { method: Method::Cholesky, ..Settings::default() };
    let found = Solver::new(twice, settings).and_then(Solver::run).unwrap();
    assert!(found.notes().iter().any(|n| n.contains("constraint c2 cannot be told from beside")));
    assert!(found.notes().iter().any(|n| n.starts_with("constraint c2 is missed by 4")), "{:?}", found.notes());
    for method in [Method::Cholesky, Method::Auto, Method::Banded] {
        let settings = Settings { method, ..Settings::default() };
        let found = Solver::new(problem.clone(), settings).and_then(Solver::run).unwrap();
        let worst = found.residuals().iter().filter(|r| !r.soft).max_by(|a, b| a.miss.abs().total_cmp(&b.miss.abs()));
        let worst = worst.unwrap();
        println!("{method}: {} {:e}", found.converged(), worst.miss);
        let named = format!("constraint {} is missed", worst.id);
        if worst.miss.abs() > 1e-6 {
            assert!(!found.converged() && found.notes().iter().any(|n| n.contains(&named)), "{:?}", found.notes());
        }
        if method != Method::Cholesky {
            assert!(found.converged() && worst.miss.abs() < 1e-9);
        }
    }
}

#[test]
fn who_stops_early_keeps_the_last_good_shape() {
    // Two bends that contradict each other keep the solver busy.
    let rows = [
        at("a", 0.0, &[0.0, 0.0]),
        at("b", 0.5, &[1.0, 1.0]),
        at("c", 1.0, &[2.0, 0.0]),
        bent("k", 0.25, 3.0),
        bent("l", 0.2501, -4.0),
    ];
    let axis = Axis::new(Boundary::Open, 128, [0.0, 1.0]).unwrap();
    let problem = || Problem::new(Space::curve(axis), 2, Energy::BEND, None, rows.to_vec()).unwrap();
    let points = |found: &Solution| {
        let ends = found.residuals().iter().filter(|r| ["a", "b", "c"].contains(&&r.id[..]));
        ends.fold(0.0, |m: f64, r| m.max(r.miss.abs()))
    };
    let settings = Settings { method: Method::Wavelet, ..Settings::default() };
    let mut solver = Solver::new(problem(), settings).unwrap();
    let mut begun = None;
    for _ in 0..2000 {
        if solver.step().is_none() {
            break;
        }
        let found = solver.solution();
        if begun.is_none() && points(&found) < 1e-7 {
            begun = Some(found.iterations());
        }
        let kept = points(&found) < 1e-7 && found.energy() > 1.0;
        assert!(begun.is_none() || kept, "{:e} after {}", points(&found), found.iterations());
    }
    // So does the limit of iterations.
    let begun = begun.unwrap();
    for more in [0, 1, 20, 50, 100] {
        let settings = Settings { most_iterations: begun + more, ..settings };
        let found = Solver::new(problem(), settings).and_then(Solver::run).unwrap();
        assert!(!found.converged() && points(&found) < 1e-7, "{more} more than {begun}: {:e}", points(&found));
    }
}

#[test]
fn bends_that_contradict_each_other_are_not_told_to_take_a_weight() {
    let rows = [at("a", 0.0, &[0.0, 0.0]), at("b", 0.5, &[1.0, 1.0]), at("c", 1.0, &[2.0, 0.0])];
    let found = solve(32, Energy::BEND, 2, &[&rows[..], &[bent("k", 0.25, 3.0), bent("l", 0.25, 4.0)]].concat());
    assert!(!found.converged());
    let said = |word: &str| found.notes().iter().any(|n| n.contains(word));
    assert!(said("constraint l contradicts k") && !said("weight"), "{:?}", found.notes());
    // No step was taken.
    assert!(!said("did not settle"), "{:?}", found.notes());
}

#[test]
fn straight_places_in_space_are_found() {
    let points = [
        at("a", 0.0, &[0.0, 0.0, 0.0]),
        at("b", 0.3, &[1.0, 0.2, 0.3]),
        at("c", 0.6, &[1.2, 1.0, 0.1]),
        at("d", 1.0, &[0.0, 1.5, 1.0]),
    ];
    for place in [0.1, 0.3, 0.45, 0.6, 0.8] {
        for (spans, energy) in [(32, Energy::BEND), (64, Energy::new(1.0, 1.0, 0.0).unwrap())] {
            let straight = solve(spans, energy, 3, &[&points[..], &[bent("k", place, 0.0)]].concat());
            assert!(straight.converged() && worst(&straight) < 1e-7, "{place}: {:?}", straight.notes());
            // Hardly bent is hardly more, however hardly, and falls with the curvature allowed.
            let with = |k: f64| {
                let found = solve(spans, energy, 3, &[&points[..], &[bent("k", place, k)]].concat());
                assert!(found.converged() && worst(&found) < 1e-7, "{place} {k:e}: {:?}", found.notes());
                found.energy() / straight.energy() - 1.0
            };
            let slope = with(1e-3) / 1e-3;
            assert!(slope < 0.0, "{place}: {slope}");
            for k in [1e-300, 1e-14, 1e-12, 1e-10, 1e-9, 1e-8, 1e-7, 3e-7, 1e-6, 3e-6, 1e-5, 3e-5, 1e-4] {
                let (less, want) = (with(k), slope * k);
                assert!((less - want).abs() < 0.02 * want.abs() + 1e-12, "{place} {k:e}: {less:e} not {want:e}");
            }
            let hardly = solve(spans, energy, 3, &[&points[..], &[bent("k", place, 1e-4)]].concat());
            let less = hardly.energy() / straight.energy() - 1.0;
            assert!(less.abs() < 1e-2, "{place}: {less}");
        }
    }
}

#[test]
fn low_heights_bend_as_they_are_asked_to() {
    let axis = |length: f64| Axis::new(Boundary::Open, 32, [0.0, length]).unwrap();
    for (height, length, tolerance) in
        [(1.0, 1.0, 1e-8), (1e-6, 1.0, 1e-4), (1e-6, 1.0, 1e-8), (1e-10, 1.0, 1e-8), (1e-6, 100.0, 1e-8)]
    {
        let want = -40.0 * height / length / length;
        let rows = vec![
            at("a", 0.0, &[0.0]),
            at("b", 0.5 * length, &[height]),
            at("c", length, &[0.0]),
            bent("k", 0.5 * length, want),
        ];
        let problem = Problem::new(Space::curve(axis(length)), 1, Energy::BEND, None, rows).unwrap();
        let settings = Settings { tolerance, ..Settings::default() };
        let found = Solver::new(problem, settings).and_then(Solver::run).unwrap();
        let miss = found.residuals().last().unwrap().miss;
        assert!(found.converged(), "{height} over {length}: {:?}", found.notes());
        assert!(miss.abs() <= 1e-3 * want.abs(), "{height} over {length}: {miss:e} of {want:e}");
    }
    // Whatever they are above.
    for offset in [0.0, 1.0, -10.0] {
        let rows =
            [at("a", 0.0, &[offset]), at("b", 0.5, &[offset + 1e-10]), at("c", 1.0, &[offset]), bent("k", 0.5, -4e-9)];
        let found = solve(32, Energy::BEND, 1, &rows);
        let miss = found.residuals().last().unwrap().miss.abs();
        // Second derivatives of 32 spans have no more digits.
        let least = 1e-17_f64.max(1e-11 * offset.abs());
        assert!(found.converged(), "above {offset}: {:?}", found.notes());
        assert!(miss < least, "above {offset}: {miss:e}");
    }
    // Nothing is asked of what is flat and shall be.
    let flat = [at("a", 0.0, &[5.0]), at("b", 1.0, &[5.0]), bent("k", 0.5, 0.0)];
    let found = solve(64, Energy::BEND, 1, &flat);
    assert!(found.converged() && found.iterations() == 0, "{:?}", found.notes());
}

#[test]
fn steep_heights_bend_as_they_are_asked_to() {
    // Rounding of the second derivative was held against the curvature of a graph that is far less steep in it.
    let points = [at("a", 0.0, &[0.0]), at("b", 0.5, &[5000.0]), at("c", 1.0, &[10000.0])];
    for want in [1e-10, -3e-9] {
        let found = solve(64, Energy::BEND, 1, &[&points[..], &[bent("k", 0.3, want)]].concat());
        let miss = found.residuals().last().unwrap().miss;
        assert!(found.converged(), "{want:e}: {:?}", found.notes());
        assert!(miss.abs() < 1e-2 * want.abs(), "{want:e}: missed by {miss:e}");
    }
}

#[test]
fn places_in_space_that_would_bend_less_if_they_were_let_settle() {
    // Pulled back against their bend, the next program turned them round, and the one after that.
    let straight = [at("a", 0.0, &[0.0, 0.0, 0.0]), at("b", 1.0, &[1.0, 0.0, 0.0])];
    let wave = [
        at("a", 0.0, &[0.0, 0.0, 0.0]),
        at("b", 1.0 / 3.0, &[1.0, 1.0, 0.0]),
        at("c", 2.0 / 3.0, &[2.0, -1.0, 0.0]),
        at("d", 1.0, &[3.0, 0.0, 0.0]),
    ];
    for (spans, place, points) in [(4, 0.4, &straight[..]), (8, 0.5, &wave[..])] {
        let of = |k: &[f64]| {
            let rows: Vec<Constraint> = k.iter().map(|k| bent("k", place, *k)).collect();
            solve(spans, Energy::BEND, 3, &[points, &rows].concat())
        };
        let free = of(&[]).energy();
        for k in [1e-6, 3e-6, 1e-5] {
            let found = of(&[k]);
            assert!(found.converged(), "{place} {k:e}: {:?}", found.notes());
            assert!(worst(&found) < 1e-2 * k, "{place} {k:e}: {:e}", worst(&found));
            assert!(found.energy() <= free + 1e3 * k * k, "{place} {k:e}: {:e} from {free:e}", found.energy());
        }
    }
}
