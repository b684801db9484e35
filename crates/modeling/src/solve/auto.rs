//! The rule of [`Method::Auto`].

use super::method::Method;
use super::refine::SolveError;
use crate::energy::Operator;
use crate::system::Problem;
use ondelette_wavelet::Boundary;

/// The rule of [`Method::Auto`], and what each method needs.
pub(crate) fn choose(problem: &Problem, h: &Operator, asked: Method) -> Result<(Method, &'static str), SolveError> {
    let axes = problem.space().axes();
    let waves = h.is_uniform() && axes.iter().all(|a| a.boundary() != Boundary::Open);
    let unfit = |why| Err(SolveError::Method { method: asked, why });
    match asked {
        Method::Auto if waves && !problem.space().is_curve() => {
            Ok((Method::Spectral, "mirrored or periodic axes of uniform stiffness"))
        }
        Method::Auto if problem.space().is_curve() => Ok((Method::Banded, "a curve")),
        Method::Auto => Ok((Method::Bpx, "open axes or varying stiffness")),
        Method::Banded if !problem.space().is_curve() => unfit("it is for curves"),
        Method::Spectral if !waves => unfit("it needs mirrored or periodic axes and uniform stiffness"),
        method => Ok((method, "asked for")),
    }
}
