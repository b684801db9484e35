//! One parameter direction of a uniform cubic spline: boundary, number of spans, domain.

use ondelette_wavelet::Boundary;
use serde::{Deserialize, Serialize};

/// Where a uniform cubic spline lives in one direction.
///
/// Control points: `spans + 3` (open, quadruple end knots), `spans + 1` (mirrored), `spans` (periodic).
///
/// ```
/// use ondelette_modeling::Axis;
/// use ondelette_wavelet::Boundary;
/// let axis = Axis::new(Boundary::Open, 64, [0.0, 2.0])?;
/// assert_eq!(axis.len(), 67);
/// assert_eq!(axis.to_knots(1.0), 32.0);
/// # Ok::<(), ondelette_modeling::AxisError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    boundary: Boundary,
    spans: usize,
    domain: [f64; 2],
}

/// Why there is no such axis.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error, Serialize, Deserialize)]
pub enum AxisError {
    /// Too few spans.
    #[error("{0} spans: a spline needs at least 1 (open), 1 (mirror) or 4 (periodic)")]
    Spans(usize),
    /// The domain is empty, turned round or not finite.
    #[error("domain [{0}, {1}]: give two finite numbers, the first below the second")]
    Domain(f64, f64),
    /// Neighbouring knots would be the same number, or nearly.
    #[error(
        "domain [{from}, {to}] with {spans} spans: neighbouring knots cannot be told apart; use fewer spans, or \
         numbers nearer to 0"
    )]
    Narrow {
        /// Start of the domain.
        from: f64,
        /// End of the domain.
        to: f64,
        /// Spans.
        spans: usize,
    },
}

/// Least length of a span, as a share of the largest parameter: knots are known to a hundredth of a span.
const APART: f64 = 1e-13;

impl Axis {
    /// An axis with `spans` knot spans over `domain`.
    ///
    /// # Errors
    /// [`AxisError`].
    pub fn new(boundary: Boundary, spans: usize, domain: [f64; 2]) -> Result<Self, AxisError> {
        let least = if boundary == Boundary::Periodic { 4 } else { 1 };
        if spans < least {
            return Err(AxisError::Spans(spans));
        }
        if !(domain[0].is_finite() && domain[1].is_finite() && domain[0] < domain[1]) {
            return Err(AxisError::Domain(domain[0], domain[1]));
        }
        let axis = Axis { boundary, spans, domain };
        let largest = domain[0].abs().max(domain[1].abs());
        // Lengths and their inverses are numbers, too.
        if !(axis.density() > 0.0 && axis.density().is_finite() && 1.0 / axis.density() >= APART * largest) {
            return Err(AxisError::Narrow { from: domain[0], to: domain[1], spans });
        }
        Ok(axis)
    }

    /// Boundary.
    pub fn boundary(&self) -> Boundary {
        self.boundary
    }

    /// Knot spans.
    pub fn spans(&self) -> usize {
        self.spans
    }

    /// First and last parameter.
    pub fn domain(&self) -> [f64; 2] {
        self.domain
    }

    /// Number of control points.
    #[allow(clippy::len_without_is_empty, reason = "an axis is never empty")]
    pub fn len(&self) -> usize {
        match self.boundary {
            Boundary::Open => self.spans + 3,
            Boundary::Mirrored => self.spans + 1,
            Boundary::Periodic => self.spans,
        }
    }

    /// Knot spans per domain unit: what a derivative in knot units is multiplied with.
    pub fn density(&self) -> f64 {
        self.spans as f64 / (self.domain[1] - self.domain[0])
    }

    /// Parameter in knot units, 0 to [`Axis::spans`].
    pub fn to_knots(&self, t: f64) -> f64 {
        (t - self.domain[0]) * self.density()
    }

    /// Parameter in domain units.
    pub fn from_knots(&self, u: f64) -> f64 {
        self.domain[0] + u / self.density()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_whose_knots_are_no_different_numbers_are_refused() {
        for (spans, domain) in [
            (64, [1e16, 1e16 + 32.0]),
            (64, [-1e16 - 32.0, -1e16]),
            (1 << 45, [0.0, 1.0]),
            (4, [0.0, 1e-310]),
            (4, [-1e308, 1e308]),
            (64, [1e9, 1e9 + 1e-3]),
        ] {
            let refused = Axis::new(Boundary::Open, spans, domain);
            assert!(matches!(refused, Err(AxisError::Narrow { .. })), "{spans} {domain:?}: {refused:?}");
        }
        // Map coordinates, dates in seconds.
        for (spans, domain) in [(512, [4.5e6, 4.5e6 + 100.0]), (64, [1.7e9, 1.7e9 + 1.0]), (4096, [0.0, 1e-20])] {
            assert!(Axis::new(Boundary::Open, spans, domain).is_ok());
        }
    }
}
