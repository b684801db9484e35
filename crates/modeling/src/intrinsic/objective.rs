//! The functional of a whole curve, with gradient and second derivatives.

use super::Minimum;
use super::span::{GAUSS, PACES, Parts, Place, Places, bend, parts};
use crate::axis::Axis;
use crate::basis;
use ondelette_numerics::gauss;

/// What is minimised over the control points of a curve, in units of the first curve's length.
pub(crate) struct Objective {
    pub(crate) axis: Axis,
    /// Coordinates: 2 or 3.
    pub(crate) k: usize,
    pub(crate) minimum: Minimum,
    places: Vec<Places>,
    /// Wanted speeds at start, middle and end, span by span.
    pub(crate) wanted: Vec<[f64; 3]>,
}

/// Value and derivatives.
pub(crate) struct Value {
    /// The intrinsic functional.
    pub(crate) functional: f64,
    /// Squared change of the logarithm of speed over wanted speed, integrated over the parameter (from 0 to 1).
    pub(crate) speed: f64,
    /// Of functional + weight * speed.
    pub(crate) gradient: Vec<f64>,
    /// Lower triangle of the second derivatives, entries may repeat: row, column, value.
    pub(crate) entries: Vec<(usize, usize, f64)>,
}

/// The places of one span.
pub(crate) fn places(axis: &Axis, span: usize) -> Places {
    let at = |x: f64| {
        let of = |d| basis::span_taps(axis.boundary(), axis.spans(), span, x, d).values;
        Place { first: of(1), second: of(2) }
    };
    let (nodes, weights) = gauss::rule(GAUSS);
    Places {
        paces: PACES.map(at),
        inner: std::array::from_fn(|g| at(nodes[g])),
        weights: std::array::from_fn(|g| weights[g]),
    }
}

impl Objective {
    pub(crate) fn new(axis: Axis, k: usize, minimum: Minimum) -> Objective {
        let places = (0..axis.spans()).map(|i| places(&axis, i)).collect();
        Objective { axis, k, minimum, places, wanted: vec![[1.0; 3]; axis.spans()] }
    }

    fn indices(&self, span: usize) -> [usize; 4] {
        basis::span_taps(self.axis.boundary(), self.axis.spans(), span, 0.0, 0).index
    }

    fn points<const K: usize>(&self, index: &[usize; 4], x: &[f64]) -> [[f64; K]; 4] {
        index.map(|i| std::array::from_fn(|c| x[i * K + c]))
    }

    /// Speeds at the points of Gauss's rule of a span, with their weights, in knot units.
    pub(crate) fn speeds(&self, span: usize, x: &[f64]) -> [(f64, f64); GAUSS] {
        let index = self.indices(span);
        std::array::from_fn(|g| {
            let f = &self.places[span].inner[g].first;
            let square = (0..self.k).map(|c| (0..4).map(|a| f[a] * x[index[a] * self.k + c]).sum::<f64>().powi(2));
            (square.sum::<f64>().sqrt(), self.places[span].weights[g])
        })
    }

    /// Value and derivatives at control points `x` (point by point), the speed's part times `weight`.
    pub(crate) fn value(&self, x: &[f64], weight: f64) -> Value {
        if self.k == 2 { self.sum::<8, 2>(x, weight) } else { self.sum::<12, 3>(x, weight) }
    }

    fn sum<const N: usize, const K: usize>(&self, x: &[f64], weight: f64) -> Value {
        let spans = self.axis.spans();
        // Two halves a span, each 1 / (2 spans) long.
        let scale = 2.0 * spans as f64;
        let mut out = Value {
            functional: 0.0,
            speed: 0.0,
            gradient: vec![0.0; x.len()],
            entries: Vec::with_capacity(spans * N * (N + 1) / 2),
        };
        for span in 0..spans {
            let index = self.indices(span);
            let Parts { functional, speed } =
                parts::<N, K>(self.minimum, &self.points(&index, x), &self.places[span], &self.wanted[span]);
            out.functional += functional.value;
            out.speed += scale * speed.value;
            let total = functional + speed.times(weight * scale);
            let global = |i: usize| index[i / K] * K + i % K;
            for i in 0..N {
                out.gradient[global(i)] += total.first[i];
                for j in 0..=i {
                    let (r, c) = (global(i), global(j));
                    out.entries.push((r.max(c), r.min(c), total.second[i][j]));
                }
            }
        }
        out
    }

    /// Curvature at a parameter (domain units), with its derivatives: unknowns, value, gradient, second derivatives.
    pub(crate) fn bend(&self, x: &[f64], t: f64) -> Bend {
        if self.k == 2 { self.bend_of::<8, 2>(x, t) } else { self.bend_of::<12, 3>(x, t) }
    }

    fn bend_of<const N: usize, const K: usize>(&self, x: &[f64], t: f64) -> Bend {
        let taps = |d| basis::knot_taps(self.axis.boundary(), self.axis.spans(), self.axis.to_knots(t), d);
        let (first, second) = (taps(1), taps(2));
        let place = Place { first: first.values, second: second.values };
        let jet = bend::<N, K>(&self.points(&first.index, x), &place);
        let global = |i: usize| first.index[i / K] * K + i % K;
        let pairs = (0..N).flat_map(|i| (0..=i).map(move |j| (i, j)));
        Bend {
            value: jet.value,
            gradient: (0..N).map(|i| (global(i), jet.first[i])).collect(),
            entries: pairs
                .map(|(i, j)| (global(i).max(global(j)), global(i).min(global(j)), jet.second[i][j]))
                .collect(),
        }
    }
}

/// Curvature at one place.
pub(crate) struct Bend {
    pub(crate) value: f64,
    pub(crate) gradient: Vec<(usize, f64)>,
    /// Lower triangle of the second derivatives.
    pub(crate) entries: Vec<(usize, usize, f64)>,
}
