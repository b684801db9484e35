//! Rows that follow from others are left out, rows that contradict them refused, whatever the size of the shape.

use ondelette_modeling::Axis;
use ondelette_modeling::constraint::{Constraint, Demand};
use ondelette_modeling::energy::Energy;
use ondelette_modeling::solve::{Settings, SolveError, Solver};
use ondelette_modeling::system::{Problem, ProblemError, Space};
use ondelette_wavelet::Boundary;
use proptest::prelude::*;

fn solver(space: &Space, coordinates: usize, rows: Vec<Constraint>) -> Result<Solver, SolveError> {
    Solver::new(Problem::new(space.clone(), coordinates, Energy::BEND, None, rows).unwrap(), Settings::default())
}

fn position(id: usize, at: &[f64], to: Vec<f64>) -> Constraint {
    Constraint::new(format!("p{id}"), at, Demand::Position(to.into_iter().map(Some).collect()))
}

fn conflict(made: Result<Solver, SolveError>) -> Option<f64> {
    match made {
        Err(SolveError::Problem(ProblemError::Conflict { miss, .. })) => Some(miss),
        Ok(_) => None,
        Err(e) => panic!("{e}"),
    }
}

#[test]
fn zeros_that_were_rounded_agree_with_zeros() {
    let space = Space::curve(Axis::new(Boundary::Open, 8, [0.0, 1.0]).unwrap());
    let twice = |a: Vec<f64>, b: Vec<f64>| {
        let coordinates = a.len();
        let rows = vec![position(0, &[0.0], vec![0.0; coordinates]), position(1, &[0.5], a), position(2, &[0.5], b)];
        conflict(solver(&space, coordinates, rows))
    };
    // sin(pi), alone and beside a coordinate that is not zero.
    assert_eq!(twice(vec![0.0], vec![1.2246e-16]), None);
    assert_eq!(twice(vec![40.0, 0.0], vec![40.0, 40.0 * 1.2246e-16]), None);
    // Small shapes are shapes.
    assert!(twice(vec![0.0], vec![1e-9]).is_some_and(|m| (m - 1e-9).abs() < 1e-15));
    assert!(twice(vec![1e-9], vec![1.001e-9]).is_some());
    assert!(twice(vec![1.0, 0.0], vec![1.0, 1e-9]).is_some());
    assert_eq!(twice(vec![1e6, 0.0], vec![1e6, 1e-9]), None);
}

/// A spline on an axis, by number of coefficients: what it is asked for must be possible to have.
fn sampled(space: &Space, size: f64, offset: f64, heights: &[f64], at: &[(f64, bool)]) -> Vec<Constraint> {
    let spread = |(i, y): (usize, &f64)| position(i, &[i as f64 / heights.len() as f64], vec![offset + size * y]);
    let shape = solver(space, 1, heights.iter().enumerate().map(spread).collect()).and_then(Solver::run).unwrap();
    let row = |(i, &(t, slope)): (usize, &(f64, bool))| {
        let demand = match slope {
            true => Demand::Derivative(0, vec![Some(shape.eval(&[t], [1, 0])[0])]),
            false => Demand::Position(vec![Some(shape.eval(&[t], [0, 0])[0])]),
        };
        Constraint::new(format!("p{i}"), &[t], demand)
    };
    at.iter().enumerate().map(row).collect()
}

#[test]
fn what_no_shape_can_have_is_refused_and_not_ignored() {
    let space = |boundary| Space::curve(Axis::new(boundary, 8, [0.0, 1.0]).unwrap());
    let slope = |boundary, t: f64, d: f64| {
        let rows = vec![Constraint::new("slope", &[t], Demand::Derivative(0, vec![Some(d)]))];
        Problem::new(space(boundary), 1, Energy::BEND, None, rows).err().map(|e| e.to_string())
    };
    for t in [0.0, 1.0] {
        assert!(slope(Boundary::Mirrored, t, 0.5).is_some_and(|e| e.contains("slope") && e.contains("mirrored")));
        assert_eq!(slope(Boundary::Mirrored, t, 0.0), None);
        assert_eq!(slope(Boundary::Open, t, 0.5), None);
    }
    assert_eq!(slope(Boundary::Mirrored, 0.3, 0.5), None);
    let image = |offset: f64| {
        let demand = Demand::Image { of: vec![0.5], factors: vec![1.0], offset: vec![offset] };
        let rows = vec![Constraint::new("self", &[0.5], demand)];
        Problem::new(space(Boundary::Open), 1, Energy::BEND, None, rows).err().map(|e| e.to_string())
    };
    assert!(image(1.0).is_some_and(|e| e.contains("differ from itself")));
    assert_eq!(image(0.0), None);
}

#[test]
fn what_was_left_out_and_said_to_be_missed_is_judged_once() {
    let space = Space::curve(Axis::new(Boundary::Open, 16, [0.0, 1.0]).unwrap());
    let near = |extra: &[Constraint]| {
        let rows = [position(0, &[0.0], vec![0.0]), position(1, &[0.5], vec![1.0])];
        let rows = [&rows[..], &[position(2, &[0.5 + 5e-9], vec![1.0 + 4e-8]), position(3, &[1.0], vec![0.0])], extra];
        solver(&space, 1, rows.concat()).and_then(Solver::run).unwrap()
    };
    let alone = near(&[]);
    assert!(alone.converged() && alone.notes().len() == 1 && alone.notes()[0].contains("p2"), "{:?}", alone.notes());
    // A point given twice elsewhere has nothing to do with it.
    let beside = near(&[position(4, &[1.0], vec![0.0])]);
    assert!(beside.converged(), "{:?}", beside.notes());
    assert_eq!(beside.notes().iter().filter(|n| n.contains("p2")).count(), 1, "{:?}", beside.notes());
}

#[test]
fn a_row_that_is_left_out_is_named_with_the_worst_of_its_coordinates() {
    let space = Space::curve(Axis::new(Boundary::Open, 16, [0.0, 1.0]).unwrap());
    for moved in [[4e-8, 0.0], [0.0, 4e-8]] {
        let rows = vec![
            position(0, &[0.0], vec![0.0, 0.0]),
            position(1, &[0.5], vec![1.0, 1.0]),
            position(2, &[0.5 + 5e-9], vec![1.0 + moved[0], 1.0 + moved[1]]),
            position(3, &[1.0], vec![0.0, 0.0]),
        ];
        let found = solver(&space, 2, rows).and_then(Solver::run).unwrap();
        let notes = found.notes();
        assert!(notes.len() == 1 && notes[0].contains("p2") && notes[0].contains("missed by 4.0e-8"), "{notes:?}");
    }
}

#[test]
fn long_domains_excuse_no_contradiction() {
    for length in [1.0, 1e6, 1e9, 1e12, 1e15] {
        let space = Space::curve(Axis::new(Boundary::Open, 16, [0.0, length]).unwrap());
        let rows = |again: f64| {
            let at = |id: usize, share: f64, to: f64| position(id, &[share * length], vec![to]);
            vec![at(0, 0.0, 0.0), at(1, 0.5, 0.0), at(2, 0.5, again), at(3, 1.0, 1.0)]
        };
        let miss = conflict(solver(&space, 1, rows(1e-4)));
        assert!(miss.is_some_and(|m| (m / 1e-4 - 1.0).abs() < 1e-9), "{length:e}: {miss:?}");
        assert_eq!(conflict(solver(&space, 1, rows(1e-16))), None);
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        rng_seed: proptest::test_runner::RngSeed::Fixed(7),
        cases: 300,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn samples_of_a_spline_never_contradict_each_other_and_a_moved_one_always_does(
        boundary in 0..3_usize,
        power in -8..9_i32,
        offset in prop_oneof![Just(0.0), Just(100.0)],
        heights in prop::collection::vec(-1.0..1.0_f64, 3..8),
        at in prop::collection::vec(((0..64_u32).prop_map(|k| f64::from(k) / 64.0), any::<bool>()), 4..60),
        again in 0..60_usize,
        by in 1e-4..1.0_f64,
    ) {
        let boundary = [Boundary::Mirrored, Boundary::Periodic, Boundary::Open][boundary];
        let space = Space::curve(Axis::new(boundary, 16, [0.0, 1.0]).unwrap());
        let size = 10.0_f64.powi(power);
        // All slopes at mirrored ends are zero, and no other can be had.
        let at: Vec<(f64, bool)> = at.into_iter().map(|(t, slope)| (t, slope && t > 0.0)).collect();
        let mut rows = sampled(&space, size, offset * size, &heights, &at);
        prop_assert_eq!(conflict(solver(&space, 1, rows.clone())), None);
        // One sample once more, elsewhere.
        let mut other = rows[again % rows.len()].clone();
        other.id = "moved".to_owned();
        rows.push(other.clone());
        prop_assert_eq!(conflict(solver(&space, 1, rows.clone())), None);
        if let Demand::Position(v) | Demand::Derivative(_, v) = &mut other.demand {
            v[0] = v[0].map(|v| v + by * size);
        }
        *rows.last_mut().unwrap() = other;
        let miss = conflict(solver(&space, 1, rows));
        prop_assert!(miss.is_some_and(|m| (m / (by * size) - 1.0).abs() < 1e-3), "{:?}", miss);
    }
}
