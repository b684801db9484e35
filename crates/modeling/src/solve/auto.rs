//! The rule of [`Method::Auto`].

use super::bpx;
use super::method::Method;
use super::refine::SolveError;
use crate::energy::Operator;
use crate::system::Problem;
use ondelette_wavelet::Boundary;

/// Coefficients of the coarsest level up to which its dense factor costs next to nothing.
const COARSE: usize = 400;

/// Coefficients up to which a sparse factor is faster than a dense one of more than [`COARSE`].
const SMALL: usize = 10_000;

/// Coefficients with varying stiffness up to which a sparse factor is faster than conjugate gradients.
const STIFF: usize = 4500;

/// Rows of a curve from which on their dense products cost more than a sparse factor.
const MANY: usize = 64;

/// Unknowns that a sparse factor is made for unasked.
const LARGE: usize = 400_000;

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

/// What a sparse factor gives way to where crowded constraints are too much for it.
pub(crate) fn spare(problem: &Problem, chosen: Method) -> Option<(Method, &'static str)> {
    let space = problem.space();
    match chosen {
        Method::Cholesky if space.is_curve() => Some((Method::Banded, "a curve with crowded constraints")),
        Method::Cholesky if bpx::coarsest(space).len() <= bpx::MOST => {
            Some((Method::Bpx, "constraints too crowded for a sparse factor"))
        }
        _ => None,
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
    if !h.is_uniform() && n <= STIFF {
        return Ok((Method::Cholesky, "varying stiffness on few spans"));
    }
    Ok((Method::Bpx, "open axes or varying stiffness"))
}
