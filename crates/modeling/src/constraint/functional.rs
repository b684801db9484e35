//! A linear functional of a spline: a value or a derivative at a parameter, as entries on its coefficients.

use crate::axis::Axis;
use crate::basis::{self, Taps};
use crate::system::Space;
use ondelette_wavelet::Boundary;

/// A derivative at a point, on any space over the same domain.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Functional {
    /// Parameter, domain units; curves use the second place.
    pub(crate) at: [f64; 2],
    pub(crate) derivative: [usize; 2],
    /// Entries along both axes.
    pub(crate) taps: [Taps; 2],
    first: [isize; 2],
    width: usize,
    curve: bool,
}

const UNIT: Taps = Taps { index: [0; 4], values: [1.0, 0.0, 0.0, 0.0] };

impl Functional {
    pub(crate) fn new(space: &Space, at: [f64; 2], derivative: [usize; 2]) -> Functional {
        let taps = match space.axes() {
            [s, t] => [basis::taps(s, at[0], derivative[0]), basis::taps(t, at[1], derivative[1])],
            [t] => [UNIT, basis::taps(t, at[1], derivative[1])],
            _ => [UNIT, UNIT],
        };
        let span = |axis: &Axis, t: f64| {
            let n = axis.spans() as f64;
            let u = axis.to_knots(t);
            let u = if axis.boundary() == Boundary::Periodic { u.rem_euclid(n) } else { u.clamp(0.0, n) };
            (u as usize).min(axis.spans() - 1) as isize - 1
        };
        let first = match space.axes() {
            [s, t] => [span(s, at[0]), span(t, at[1])],
            [t] => [0, span(t, at[1])],
            _ => [0; 2],
        };
        Functional { at, derivative, taps, first, width: space.shape()[1], curve: space.is_curve() }
    }

    /// The same functional on another space over the same domain.
    pub(crate) fn on(&self, space: &Space) -> Functional {
        Functional::new(space, self.at, self.derivative)
    }

    /// Coefficients and factors; up to 16, indices may repeat.
    pub(crate) fn entries(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let rows = if self.curve { 1 } else { 4 };
        (0..rows).flat_map(move |a| {
            let (row, v) = (self.taps[0].index[a] * self.width, self.taps[0].values[a]);
            self.taps[1].iter().map(move |(i, w)| (row + i, v * w))
        })
    }

    /// The knot at which the first of its four functions along axis `side` has its centre, on the continued line.
    pub(crate) fn first(&self, side: usize) -> isize {
        self.first[side]
    }

    /// Its value on coefficients.
    pub(crate) fn apply(&self, x: &[f64]) -> f64 {
        self.entries().map(|(i, v)| v * x[i]).sum()
    }
}
