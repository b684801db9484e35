//! The least energy of all functions together, where the gains of single ones say too little about it.

use crate::solve::method::{Method, Settings};
use crate::solve::refine::Solver;
use crate::solve::solution::Solution;
use crate::system::{Problem, Space};

/// Sides of a cell that differ by this factor are not square any more.
const SQUARE: f64 = 1.5;

/// True for curves, and surfaces whose cells are about square: there wavelets of unit energy are all that an energy
/// needs to be known by. Long cells couple many of them, and what one would save alone is a small part of what all
/// would save.
pub(super) fn cells_are_square(space: &Space) -> bool {
    let [s, t] = space.axes() else { return true };
    (1.0 / SQUARE..=SQUARE).contains(&(s.density() / t.density()))
}

/// What the shape of least energy is known by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Least {
    /// Energy, soft rows included.
    pub(super) energy: f64,
    /// The largest distance of a coefficient from the middle one of its coordinate.
    pub(super) height: f64,
}

/// The least energy and its shape, by the solver that `auto` picks, or a sparse factor where that one fails.
///
/// # Errors
/// A sentence: they failed, or did not converge.
pub(super) fn energy(problem: &Problem) -> Result<(Least, Solution), String> {
    let solved = |method: Method| {
        let settings = Settings { method, tolerance: 1e-9, ..Settings::default() };
        Solver::new(problem.clone(), settings).and_then(Solver::run)
    };
    let full = match solved(Method::Auto) {
        Ok(full) if full.converged() => Ok(full),
        _ => solved(Method::Cholesky),
    };
    let why = "cells are far from square, and the full solution to compare with";
    let full = full.map_err(|e| format!("{why} failed: {e}"))?;
    if !full.converged() {
        return Err(format!("{why} did not converge"));
    }
    let x = full.coefficients();
    let soft = |row: &crate::constraint::Row| {
        let value: f64 = row.entries().map(|(c, i, v)| v * x[c][i]).sum();
        (value - row.target).powi(2) / row.give
    };
    let height = |x: &Vec<f64>| {
        let (low, high) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        0.5 * (high - low)
    };
    let least = Least {
        energy: full.energy() + problem.rows().iter().filter(|r| r.give > 0.0).map(soft).sum::<f64>(),
        height: x.iter().map(height).fold(0.0, f64::max),
    };
    Ok((least, full))
}
