//! The rule of [`Method::Auto`].

use super::bpx;
use super::method::Method;
use super::refine::{SolveError, Solver, Stage};
use crate::energy::Operator;
use crate::system::{MEMORY, Problem, ProblemError, Space, Structure};
use ondelette_wavelet::Boundary;

/// Coefficients of the coarsest level up to which its dense factor costs next to nothing.
const COARSE: usize = 400;

/// Coefficients up to which a sparse factor is faster than a dense one of more than [`COARSE`].
const SMALL: usize = 10_000;

/// Coefficients with varying stiffness up to which a sparse factor is faster than conjugate gradients.
const STIFF: usize = 4500;

/// Rows of a curve from which on their dense products cost more than a sparse factor.
const MANY: usize = 64;

/// Rows of a surface from which on their dense matrix costs more than multigrid with multipliers.
const CROWD: usize = 2500;

/// Coefficients of the coarsest level, all coordinates, that multigrid with multipliers makes a dense factor of.
const COARSEST: usize = 1000;

/// Rows for which multigrid prepares a cycle each, and projects; with more it works by multipliers.
pub(crate) const CYCLES: usize = 100;

/// Unknowns that a sparse factor is made for unasked.
const LARGE: usize = 400_000;

/// Sides of a cell that differ by more than this are too long for levels that halve both axes.
const LONG: f64 = 2.5;

/// The rule of [`Method::Auto`], and what each method needs.
pub(crate) fn choose(problem: &Problem, h: &Operator, asked: Method) -> Result<(Method, &'static str), SolveError> {
    let axes = problem.space().axes();
    let waves = h.is_uniform() && axes.iter().all(|a| a.boundary() != Boundary::Open);
    let unfit = |why| Err(SolveError::Method { method: asked, why });
    match asked {
        Method::Auto if problem.space().is_curve() && rows(problem) > MANY => {
            Ok((Method::Cholesky, "a curve with many constraints"))
        }
        Method::Auto if problem.space().is_curve() => Ok((Method::Banded, "a curve")),
        Method::Auto if rows(problem) > CROWD => crowd(problem),
        Method::Auto if waves => Ok((Method::Spectral, "mirrored or periodic axes of uniform stiffness")),
        Method::Auto => sparse_or_levels(problem, h),
        Method::Banded if !problem.space().is_curve() => unfit("it is for curves"),
        Method::Spectral if !waves => unfit("it needs mirrored or periodic axes and uniform stiffness"),
        method => Ok((method, "asked for")),
    }
}

/// Rows of a coordinate, about.
fn rows(problem: &Problem) -> usize {
    problem.rows().len() / problem.coordinates()
}

/// For surfaces of so many rows that nothing dense may be made of them.
fn crowd(problem: &Problem) -> Result<(Method, &'static str), SolveError> {
    if coarse_enough(problem) {
        return Ok((Method::Multigrid, "a surface with very many constraints"));
    }
    if problem.space().len() * problem.coordinates() > LARGE {
        let why = "so many constraints on so large a surface need spans that halve often: take a power of two";
        return Err(SolveError::Method { method: Method::Auto, why });
    }
    Ok((Method::Cholesky, "a surface with very many constraints"))
}

fn coarse_enough(problem: &Problem) -> bool {
    bpx::coarsest(problem.space()).len() * problem.coordinates() <= COARSEST
}

/// Refuses dense matrices that are too large for a method's constraints.
///
/// # Errors
/// [`ProblemError::Memory`].
pub(crate) fn fits(structure: &Structure, method: Method) -> Result<(), ProblemError> {
    let [m, f, n] = [structure.rows(), structure.functionals.len(), structure.n].map(|v| v as u64);
    let entries = match method {
        // The sides of the band's factor, a square, its triangle and the factor of that.
        Method::Banded if structure.k == 1 && structure.is_separable() => n.saturating_mul(m) + 2 * m * m,
        Method::Banded => n.saturating_mul(f) + f * f / 2 + m * m,
        Method::Spectral | Method::Bpx | Method::Wavelet => f * f / 2 + m * m,
        Method::Multigrid if m <= CYCLES as u64 => f * f / 2 + m * m,
        _ => 0,
    };
    let bytes = entries.saturating_mul(8);
    if bytes <= MEMORY {
        return Ok(());
    }
    let what = "a dense matrix of this many constraints (solvers multigrid and cholesky make none)";
    Err(ProblemError::Memory { what, bytes, limit: MEMORY })
}

/// What a choice by rule gives way to where it does not converge.
pub(crate) fn spare(problem: &Problem, chosen: Method) -> Option<(Method, &'static str)> {
    let space = problem.space();
    match chosen {
        Method::Multigrid if space.len() * problem.coordinates() <= LARGE => {
            Some((Method::Cholesky, "a surface with very many constraints, too uneven for multigrid"))
        }
        Method::Bpx if space.len() * problem.coordinates() <= LARGE => {
            Some((Method::Cholesky, "constraints or cells too uneven for levels"))
        }
        Method::Cholesky if space.is_curve() => Some((Method::Banded, "a curve with crowded constraints")),
        Method::Cholesky if rows(problem) > CROWD => None,
        Method::Cholesky if bpx::coarsest(space).len() <= bpx::MOST => {
            Some((Method::Bpx, "constraints too crowded for a sparse factor"))
        }
        _ => None,
    }
}

impl Solver {
    /// Starts anew with the spare method, if there is one that fits into memory.
    pub(super) fn give_way(&mut self) -> bool {
        let Some((method, why)) = self.spare.take() else { return false };
        if let Err(e) = self.blocks.iter().try_for_each(|b| fits(&b.0, method)) {
            self.notes.push(format!("constraints crowded for solver {}, and {method} does not fit: {e}", self.method));
            return false;
        }
        (self.method, self.why) = (method, why);
        for side in self.sides.iter_mut().flatten() {
            side.x.fill(0.0);
            side.multipliers.fill(0.0);
            (side.corrections, side.change, side.miss) = (0, f64::INFINITY, f64::INFINITY);
        }
        self.correctors.iter_mut().for_each(|c| *c = None);
        self.at = (0, 0);
        self.stage = Stage::Residual;
        true
    }
}

/// For surfaces on open axes or of varying stiffness; measured by `cargo bench --bench auto`.
fn sparse_or_levels(problem: &Problem, h: &Operator) -> Result<(Method, &'static str), SolveError> {
    let n = problem.space().len();
    let coarsest = bpx::coarsest(problem.space()).len();
    if coarsest > bpx::MOST {
        if n * problem.coordinates() > LARGE {
            let why = "so large a surface needs spans that halve often: take a power of two, or solver cholesky";
            return Err(SolveError::Method { method: Method::Auto, why });
        }
        return Ok((Method::Cholesky, "spans that do not halve often"));
    }
    if coarsest > COARSE && n <= SMALL {
        return Ok((Method::Cholesky, "spans that do not halve often"));
    }
    if cells_are_long(problem.space()) && n * problem.coordinates() <= LARGE {
        return Ok((Method::Cholesky, "cells far from square"));
    }
    if !h.is_uniform() && n <= STIFF {
        return Ok((Method::Cholesky, "varying stiffness on few spans"));
    }
    Ok((Method::Bpx, "open axes or varying stiffness"))
}

/// True for surfaces whose cells are much longer one way: the energy of a long cell is that of its short side, and what
/// waves along the long one is lost beside it to whatever smooths both at once.
fn cells_are_long(space: &Space) -> bool {
    let [s, t] = space.axes() else { return false };
    !(1.0 / LONG..=LONG).contains(&(s.density() / t.density()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::Axis;
    use crate::constraint::{Constraint, Demand};
    use crate::energy::Energy;
    use crate::solve::Settings;

    fn solver(spans: usize, points: usize) -> Solver {
        let axis = Axis::new(Boundary::Open, spans, [0.0, 1.0]).unwrap();
        let at = |i: usize| {
            let t = 0.3 + 4.0 * i as f64 / spans as f64;
            Constraint::new(format!("{i}"), &[t], Demand::Position(vec![Some((i % 7) as f64)]))
        };
        let problem = Problem::new(Space::curve(axis), 1, Energy::BEND, None, (0..points).map(at).collect()).unwrap();
        Solver::new(problem, Settings::default()).unwrap()
    }

    #[test]
    fn a_method_whose_matrix_is_too_large_is_no_way_out() {
        // 12.6 GB of a band's sides for crowded points of a long curve.
        let mut long = solver(1 << 20, 1500);
        assert_eq!(long.method(), Method::Cholesky);
        assert!(!long.give_way() && long.method() == Method::Cholesky);
        assert!(long.notes.iter().any(|n| n.contains("banded does not fit")), "{:?}", long.notes);
        // A shorter one may.
        let mut short = solver(1 << 12, 150);
        assert!(short.give_way() && short.method() == Method::Banded && short.notes.is_empty());
    }
}
