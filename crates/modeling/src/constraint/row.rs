//! Rows of A x = b over the coefficients of all coordinates.

use super::{Constraint, Demand, Functional};
use crate::system::Space;

/// A functional of one coordinate, with a factor.
#[derive(Clone, Debug)]
pub(crate) struct Term {
    pub(crate) coordinate: usize,
    pub(crate) functional: Functional,
    pub(crate) factor: f64,
}

/// One scalar equation, divided by the length of its row of entries.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    /// Which constraint of the problem it belongs to.
    pub(crate) constraint: usize,
    pub(crate) terms: Vec<Term>,
    pub(crate) target: f64,
    /// 1 / w of a soft row (w that of the divided row); 0 for a hard one.
    pub(crate) give: f64,
    /// Length of the row before the division.
    pub(crate) length: f64,
}

impl Row {
    /// Divides by the length of the entries; `None` for a row of zeros.
    pub(crate) fn new(constraint: usize, mut terms: Vec<Term>, target: f64, weight: Option<f64>) -> Option<Row> {
        let mut entries: Vec<(usize, usize, f64)> = Vec::new();
        for t in &terms {
            entries.extend(t.functional.entries().map(|(i, v)| (t.coordinate, i, v * t.factor)));
        }
        entries.sort_by_key(|e| (e.0, e.1));
        let mut square = 0.0;
        let mut at = 0;
        while at < entries.len() {
            let mut sum = 0.0;
            let key = (entries[at].0, entries[at].1);
            while at < entries.len() && (entries[at].0, entries[at].1) == key {
                sum += entries[at].2;
                at += 1;
            }
            square += sum * sum;
        }
        let length: f64 = f64::sqrt(square);
        let most = entries.iter().fold(0.0, |m: f64, e| m.max(e.2.abs()));
        if length <= 1e-13 * most || most == 0.0 {
            return None;
        }
        terms.iter_mut().for_each(|t| t.factor /= length);
        let give = weight.map_or(0.0, |w| 1.0 / (w * length * length));
        Some(Row { constraint, terms, target: target / length, give, length })
    }

    /// Entries `(coordinate, coefficient, value)`; may repeat.
    pub(crate) fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        self.terms.iter().flat_map(|t| t.functional.entries().map(move |(i, v)| (t.coordinate, i, v * t.factor)))
    }
}

/// Parameters with the curve's in the second place.
pub(crate) fn place(at: &[f64]) -> [f64; 2] {
    match at {
        [s, t] => [*s, *t],
        [t] => [0.0, *t],
        _ => [0.0; 2],
    }
}

/// The derivative of order `order` along `axis`.
pub(crate) fn along(space: &Space, axis: usize, order: usize) -> [usize; 2] {
    if space.is_curve() || axis == 1 { [0, order] } else { [order, 0] }
}

impl Constraint {
    /// Its linear rows with their targets; none for curvature, whose rows depend on the shape, and none where all
    /// shapes have the same.
    pub(crate) fn rows(&self, space: &Space, number: usize, out: &mut Vec<Row>) {
        self.equations(space, |terms, target| out.extend(Row::new(number, terms, target, self.weight)));
    }

    /// True if it asks for something else where all shapes have the same: a slope across a mirrored end, or a point
    /// that is an image of itself.
    pub(crate) fn is_impossible(&self, space: &Space) -> bool {
        let mut impossible = false;
        if matches!(self.demand, Demand::Derivative(..) | Demand::Image { .. }) {
            self.equations(space, |terms, b| impossible |= b != 0.0 && Row::new(0, terms, b, None).is_none());
        }
        impossible
    }

    /// Left and right sides of its equations.
    fn equations(&self, space: &Space, mut out: impl FnMut(Vec<Term>, f64)) {
        let at = place(&self.at);
        let mut put = |derivative: [usize; 2], factors: &[(usize, f64)], target: f64| {
            let functional = Functional::new(space, at, derivative);
            let terms = factors.iter().filter(|f| f.1 != 0.0);
            let terms = terms.map(|&(coordinate, factor)| Term { coordinate, functional: functional.clone(), factor });
            out(terms.collect(), target);
        };
        match &self.demand {
            Demand::Position(values) => {
                for (c, v) in values.iter().enumerate() {
                    v.iter().for_each(|v| put([0, 0], &[(c, 1.0)], *v));
                }
            }
            Demand::Derivative(axis, values) => {
                for (c, v) in values.iter().enumerate() {
                    v.iter().for_each(|v| put(along(space, *axis, 1), &[(c, 1.0)], *v));
                }
            }
            Demand::Normal(normal) => {
                let size = normal.iter().map(|v| v * v).sum::<f64>().sqrt();
                let factors: Vec<(usize, f64)> = normal.iter().map(|v| v / size).enumerate().collect();
                for axis in 0..space.axes().len() {
                    put(along(space, axis, 1), &factors, 0.0);
                }
            }
            Demand::Curvature(_) => {}
            Demand::Image { of, factors, offset } => {
                let there = Functional::new(space, place(of), [0, 0]);
                let here = Functional::new(space, at, [0, 0]);
                for c in 0..factors.len() {
                    let terms = vec![
                        Term { coordinate: c, functional: here.clone(), factor: 1.0 },
                        Term { coordinate: c, functional: there.clone(), factor: -factors[c] },
                    ];
                    out(terms, offset[c]);
                }
            }
        }
    }
}
