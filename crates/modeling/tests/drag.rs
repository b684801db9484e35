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
