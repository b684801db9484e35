//! Dragging against solving anew.

use ondelette_modeling::Axis;
use ondelette_modeling::constraint::{Constraint, Demand};
use ondelette_modeling::drag::{DragError, Handles};
use ondelette_modeling::energy::Energy;
use ondelette_modeling::solve::{Method, Settings, Solver};
use ondelette_modeling::system::{Problem, Space};
use ondelette_numerics::seed;
use ondelette_wavelet::Boundary;

fn problem(boundary: Boundary, coordinates: usize) -> Problem {
    let a = Axis::new(boundary, 16, [0.0, 1.0]).unwrap();
    let random = |k: u64, i: usize| seed::unit(seed::combine(k, i as u64));
    let mut rows: Vec<Constraint> = (0..12)
        .map(|i| {
            let at = (0..coordinates).map(|c| Some(random(10 + c as u64, i) - 0.5)).collect();
            Constraint::new(format!("p{i}"), &[random(1, i), random(2, i)], Demand::Position(at))
        })
        .collect();
    if coordinates == 3 {
        rows.push(Constraint::new("n", &[0.5, 0.5], Demand::Normal(vec![0.1, 0.2, 1.0])));
    }
    rows.push(Constraint::new("ds", &[0.3, 0.6], Demand::Derivative(0, vec![Some(0.5); coordinates])));
    Problem::new(Space::surface(a, a), coordinates, Energy::BEND, None, rows).unwrap()
}

fn cold(problem: &Problem, settings: Settings) -> Vec<Vec<f64>> {
    Solver::new(problem.clone(), settings).unwrap().run().unwrap().coefficients().to_vec()
}

#[test]
fn a_drag_is_a_cold_solution_with_the_new_target() {
    for (boundary, coordinates) in [(Boundary::Mirrored, 1), (Boundary::Open, 1), (Boundary::Open, 3)] {
        let settings = Settings { tolerance: 1e-10, ..Settings::default() };
        let mut handles = Handles::new(problem(boundary, coordinates), settings, usize::MAX).unwrap();
        for (step, id) in ["p3", "ds", "p0", "p3", "p11"].into_iter().enumerate() {
            let to = vec![Some(0.1 * step as f64); coordinates];
            handles.drag(id, &to).unwrap();
        }
        let want = cold(handles.problem(), settings);
        for (x, y) in handles.coefficients().iter().zip(&want) {
            let size = y.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            assert!(x.iter().zip(y).all(|(a, b)| (a - b).abs() < 1e-8 * size));
        }
    }
}

#[test]
fn adding_removing_and_undoing_give_the_same_bits() {
    let settings = Settings::default();
    let mut handles = Handles::new(problem(Boundary::Mirrored, 1), settings, usize::MAX).unwrap();
    let before = handles.coefficients().to_vec();
    handles.save();
    handles.drag("p2", &[Some(3.0)]).unwrap();
    handles.add(Constraint::new("new", &[0.77, 0.11], Demand::Position(vec![Some(1.0)]))).unwrap();
    assert_eq!(handles.coefficients(), cold(handles.problem(), settings));
    handles.remove("p5").unwrap();
    assert_eq!(handles.coefficients(), cold(handles.problem(), settings));
    assert!(handles.undo().unwrap());
    assert_eq!(handles.coefficients(), before);
    assert!(!handles.undo().unwrap());
    handles.drag("p2", &[Some(1.0)]).unwrap();
}

#[test]
fn columns_stay_within_their_budget_and_wrong_names_are_refused() {
    let bytes = 8 * 17 * 17;
    let settings = Settings { method: Method::Spectral, ..Settings::default() };
    let mut handles = Handles::new(problem(Boundary::Mirrored, 1), settings, 3 * bytes).unwrap();
    for i in 0..8 {
        handles.grab(&format!("p{i}")).unwrap();
        assert!(handles.bytes() <= 3 * bytes && handles.bytes() >= bytes);
    }
    assert!(matches!(handles.grab("nobody"), Err(DragError::Name(_))));
    assert!(matches!(handles.drag("p1", &[Some(f64::NAN)]), Err(DragError::Targets(_))));
    assert!(matches!(handles.drag("p1", &[None]), Err(DragError::Targets(_))));
}

fn position(id: &str, at: [f64; 2], to: &[Option<f64>]) -> Constraint {
    Constraint::new(id, &at, Demand::Position(to.to_vec()))
}

fn sheet(coordinates: usize, rows: Vec<Constraint>) -> Problem {
    let a = Axis::new(Boundary::Open, 16, [0.0, 1.0]).unwrap();
    Problem::new(Space::surface(a, a), coordinates, Energy::BEND, None, rows).unwrap()
}

fn assert_solved(handles: &Handles, settings: Settings) {
    for (x, y) in handles.coefficients().iter().zip(&cold(handles.problem(), settings)) {
        let size = y.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let off = x.iter().zip(y).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        assert!(off <= 1e-8 * size, "{off} of {size}");
    }
}

#[test]
fn a_coordinate_moves_by_its_own_column_whichever_coordinates_a_normal_couples() {
    let settings = Settings { tolerance: 1e-10, ..Settings::default() };
    for normal in [vec![1.0, 0.0, 1.0], vec![0.0, 1.0, 1.0], vec![1.0, 1.0, 0.0]] {
        let corner = |k: usize| [[0.1, 0.1], [0.9, 0.2], [0.2, 0.8], [0.8, 0.9]][k];
        let to = |k: usize| corner(k).iter().copied().chain([0.3 * k as f64]).map(Some).collect::<Vec<_>>();
        let mut rows: Vec<Constraint> = (0..4).map(|k| position(&k.to_string(), corner(k), &to(k))).collect();
        rows.push(Constraint::new("n", &[0.5, 0.5], Demand::Normal(normal)));
        // A slope with a free coordinate: its second row is that of the third one.
        rows.push(Constraint::new("dt", &[0.4, 0.3], Demand::Derivative(1, vec![Some(0.1), None, Some(0.2)])));
        let mut handles = Handles::new(sheet(3, rows), settings, usize::MAX).unwrap();
        handles.drag("2", &[Some(0.3), Some(0.9), Some(-1.0)]).unwrap();
        handles.drag("dt", &[Some(0.4), None, Some(1.0)]).unwrap();
        assert_solved(&handles, settings);
    }
}

#[test]
fn a_point_with_one_redundant_coordinate_is_dragged_in_the_others() {
    let settings = Settings { tolerance: 1e-10, ..Settings::default() };
    let heights = [[0.1, 0.1], [0.9, 0.2], [0.2, 0.8], [0.8, 0.9]].into_iter().enumerate();
    let mut rows: Vec<Constraint> =
        heights.map(|(k, at)| position(&k.to_string(), at, &[Some(at[0]), Some(k as f64)])).collect();
    rows.push(position("half", [0.5, 0.5], &[Some(0.5), None]));
    rows.push(position("whole", [0.5, 0.5], &[Some(0.5), Some(1.0)]));
    let mut handles = Handles::new(sheet(2, rows), settings, usize::MAX).unwrap();
    handles.drag("whole", &[Some(0.5), Some(2.0)]).unwrap();
    assert_solved(&handles, settings);
    assert!(matches!(handles.drag("whole", &[Some(0.6), Some(2.0)]), Err(DragError::Fixed(_))));
    assert_solved(&handles, settings);
}

#[test]
fn a_point_is_not_dragged_away_from_its_twin() {
    let settings = Settings::default();
    let mut rows: Vec<Constraint> = [[0.1, 0.1], [0.9, 0.2], [0.2, 0.8]]
        .into_iter()
        .enumerate()
        .map(|(k, at)| position(&k.to_string(), at, &[Some(k as f64)]))
        .collect();
    rows.push(position("twin", [0.9, 0.2], &[Some(1.0)]));
    let mut handles = Handles::new(sheet(1, rows), settings, usize::MAX).unwrap();
    let before = handles.coefficients().to_vec();
    let refused = handles.drag("1", &[Some(5.0)]).unwrap_err().to_string();
    assert!(refused.contains("twin contradicts 1"), "{refused}");
    assert_eq!(handles.coefficients(), before);
    assert_eq!(handles.problem().constraints()[1].demand, Demand::Position(vec![Some(1.0)]));
    handles.drag("0", &[Some(5.0)]).unwrap();
    assert_solved(&handles, settings);
    handles.remove("twin").unwrap();
    handles.drag("1", &[Some(5.0)]).unwrap();
    assert_solved(&handles, settings);
}

#[test]
fn undo_makes_the_factors_of_the_constraints_it_brings_back() {
    let settings = Settings { tolerance: 1e-10, ..Settings::default() };
    let rows = |b: Constraint| -> Vec<Constraint> {
        let three = [[0.1, 0.1], [0.9, 0.2], [0.2, 0.8]].into_iter().enumerate();
        three.map(|(k, at)| position(&k.to_string(), at, &[Some(k as f64)])).chain([b]).collect()
    };
    let others = [
        position("b", [0.3, 0.4], &[Some(0.5)]),
        position("b", [0.7, 0.6], &[Some(0.5)]).soft(2.0),
        Constraint::new("b", &[0.7, 0.6], Demand::Derivative(1, vec![Some(0.5)])),
    ];
    for other in others {
        let problem = sheet(1, rows(position("b", [0.7, 0.6], &[Some(0.5)])));
        let mut handles = Handles::new(problem, settings, usize::MAX).unwrap();
        handles.save();
        handles.remove("b").unwrap();
        handles.add(other).unwrap();
        handles.drag("b", &[Some(1.0)]).unwrap();
        assert!(handles.undo().unwrap());
        handles.drag("b", &[Some(2.0)]).unwrap();
        handles.drag("1", &[Some(-2.0)]).unwrap();
        assert_solved(&handles, settings);
    }
}

#[test]
fn nothing_is_dragged_past_a_curvature_that_came_back_or_needed_no_work() {
    let at = |id: &str, t: f64, x: f64, y: f64| Constraint::new(id, &[t], Demand::Position(vec![Some(x), Some(y)]));
    let axis = Axis::new(Boundary::Open, 16, [0.0, 1.0]).unwrap();
    let handles = |k: f64| {
        let bent = Constraint::new("k", &[0.25], Demand::Curvature(k));
        let rows = vec![
            at("a", 0.0, 0.0, 0.0),
            at("b", 0.5, 1.0, if k == 0.0 { 0.0 } else { 1.0 }),
            at("c", 1.0, 2.0, 0.0),
            bent,
        ];
        let problem = Problem::new(Space::curve(axis), 2, Energy::BEND, None, rows).unwrap();
        Handles::new(problem, Settings::default(), usize::MAX).unwrap()
    };
    let mut bent = handles(-2.0);
    bent.save();
    bent.remove("k").unwrap();
    bent.drag("b", &[Some(1.0), Some(0.5)]).unwrap();
    assert!(bent.undo().unwrap());
    assert_eq!(bent.drag("b", &[Some(1.0), Some(2.0)]), Err(DragError::Fixed("b".to_owned())));
    // A straight line has no curvature from the start.
    let mut straight = handles(0.0);
    assert_eq!(straight.drag("b", &[Some(1.0), Some(2.0)]), Err(DragError::Fixed("b".to_owned())));
}

#[test]
fn an_answer_that_did_not_converge_moves_nothing() {
    let settings = Settings { method: Method::Bpx, most_iterations: 3, ..Settings::default() };
    let mut solver = Solver::new(problem(Boundary::Open, 1), settings).unwrap();
    solver.finish().unwrap();
    let before = solver.solution();
    let answer = solver.response("p3", 0);
    assert!(matches!(&answer, Err(e) if e.to_string().contains("p3 did not converge")), "{answer:?}");
    let after = solver.solution();
    assert_eq!((before.notes(), before.coefficients()), (after.notes(), after.coefficients()));
}

#[test]
fn an_answer_has_all_iterations_that_a_solution_has() {
    // What the solution took was taken from the answers.
    let with = |most_iterations: usize| {
        let settings = Settings { method: Method::Bpx, most_iterations, ..Settings::default() };
        let mut solver = Solver::new(problem(Boundary::Open, 1), settings).unwrap();
        solver.finish().unwrap();
        solver
    };
    let free = with(10_000);
    let taken = free.solution().iterations();
    assert!(taken > 5);
    let mut solver = with(taken + 1);
    assert!(solver.solution().converged());
    let answer = solver.response("p3", 0).unwrap().unwrap();
    let mut free = free;
    assert_eq!(answer, free.response("p3", 0).unwrap().unwrap());
    assert_eq!(solver.solution().iterations(), taken, "the solution's own");
}

#[test]
fn other_targets_have_words_of_their_own() {
    // Two points too near to be told apart, which others targets may make one.
    let space = Space::curve(Axis::new(Boundary::Open, 16, [0.0, 1.0]).unwrap());
    let with = |y: f64| {
        let at = |id: &str, t: f64, y: f64| Constraint::new(id, &[t], Demand::Position(vec![Some(y)]));
        let rows = vec![at("a", 0.0, 0.0), at("b", 0.5, 1.0), at("c", 0.5 + 5e-9, y), at("d", 1.0, 0.0)];
        Problem::new(space.clone(), 1, Energy::BEND, None, rows).unwrap()
    };
    let cold = |y: f64| Solver::new(with(y), Settings::default()).and_then(Solver::run).unwrap();
    let mut solver = Solver::new(with(1.0 + 4e-8), Settings::default()).unwrap();
    for y in [1.0 + 4e-8, 1.0, 1.0 + 2e-8, 1.0] {
        solver.retarget(with(y)).unwrap();
        solver.finish().unwrap();
        let (found, want) = (solver.solution(), cold(y));
        assert_eq!((found.notes(), found.converged()), (want.notes(), want.converged()), "{y}");
    }
    assert_ne!(cold(1.0 + 4e-8).notes(), cold(1.0).notes());
}
