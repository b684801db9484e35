//! What a solver hands back.

use super::method::Method;
use crate::basis;
use crate::constraint::Row;
use crate::energy::Operator;
use crate::system::{Problem, Space};
use std::sync::Arc;

/// How far a constraint row is missed.
#[derive(Clone, Debug, PartialEq)]
pub struct Residual {
    /// Name of the constraint.
    pub id: String,
    /// True for rows with a weight, which need not be met.
    pub soft: bool,
    /// Value minus target, in the units of the constraint.
    pub miss: f64,
}

/// Coefficients of a solved problem, with what there is to say about them.
#[derive(Clone, Debug)]
pub struct Solution {
    space: Space,
    coefficients: Vec<Vec<f64>>,
    h: Arc<Operator>,
    residuals: Vec<Residual>,
    method: (Method, &'static str),
    iterations: usize,
    converged: bool,
    notes: Vec<String>,
    adapted: Option<(usize, f64)>,
    begun: bool,
}

impl Residual {
    /// The misses of rows, in their order.
    pub(crate) fn all(problem: &Problem, rows: &[Row], coefficients: &[Vec<f64>]) -> Vec<Residual> {
        let of = |row: &Row| {
            let value: f64 = row.entries().map(|(c, i, v)| v * coefficients[c][i]).sum();
            let id = problem.constraints()[row.constraint].id.clone();
            Residual { id, soft: row.give > 0.0, miss: (value - row.target) * row.length }
        };
        rows.iter().map(of).collect()
    }
}

impl Solution {
    #[allow(clippy::too_many_arguments, reason = "the one constructor, called once")]
    pub(crate) fn new(
        space: Space,
        coefficients: Vec<Vec<f64>>,
        h: Arc<Operator>,
        residuals: Vec<Residual>,
        method: (Method, &'static str),
        iterations: usize,
        converged: bool,
        notes: Vec<String>,
    ) -> Solution {
        Solution { space, coefficients, h, residuals, method, iterations, converged, notes, adapted: None, begun: true }
    }

    /// The same, found on some of the functions only, with an estimate of its energy above the least.
    pub(crate) fn adapted(mut self, active: usize, excess: f64) -> Solution {
        self.adapted = Some((active, excess));
        self
    }

    /// The same solution; not `begun` where nothing was computed.
    pub(crate) fn begun_if(mut self, begun: bool) -> Solution {
        self.begun = begun;
        self
    }

    /// Of adaptive solutions: how many functions a coordinate needed; all others are zero (data reduction, 7.10).
    pub fn active(&self) -> Option<usize> {
        self.adapted.map(|a| a.0)
    }

    /// Of adaptive solutions: an estimate of the energy above that of all functions together, in domain units.
    pub fn excess(&self) -> Option<f64> {
        self.adapted.map(|a| a.1)
    }

    /// Where the coefficients live.
    pub fn space(&self) -> &Space {
        &self.space
    }

    /// The B-spline coefficients, coordinate by coordinate; of surfaces row-major (s, t).
    pub fn coefficients(&self) -> &[Vec<f64>] {
        &self.coefficients
    }

    /// The energy, in domain units (soft rows not included). Linear time.
    pub fn energy(&self) -> f64 {
        self.coefficients.iter().map(|x| self.h.energy(x)).sum()
    }

    /// The miss of every constraint row, in the order of the constraints.
    pub fn residuals(&self) -> &[Residual] {
        &self.residuals
    }

    /// The method, and why it was chosen.
    pub fn method(&self) -> (Method, &'static str) {
        self.method
    }

    /// Iterations of all corrections and coordinates; 0 for direct methods.
    pub fn iterations(&self) -> usize {
        self.iterations
    }

    /// True when the tolerance was reached.
    pub fn converged(&self) -> bool {
        self.converged
    }

    /// False where no method could make a first shape: all coefficients are zero, and the notes say why.
    pub fn begun(&self) -> bool {
        self.begun
    }

    /// Redundant rows and other remarks, a sentence each.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The point at a parameter (`[t]` or `[s, t]`), or a derivative of the given orders along s and t (curves: the
    /// first), in domain units.
    ///
    /// # Panics
    /// If `at` has another number of parameters than the space has axes.
    pub fn eval(&self, at: &[f64], derivative: [usize; 2]) -> Vec<f64> {
        let axes = self.space.axes();
        assert_eq!(at.len(), axes.len(), "one parameter an axis");
        let of = |x: &Vec<f64>| match axes {
            [s, t] => {
                let (s, t, n) = (basis::taps(s, at[0], derivative[0]), basis::taps(t, at[1], derivative[1]), t.len());
                s.iter().map(|(i, v)| v * t.apply(&x[i * n..][..n])).sum()
            }
            _ => basis::taps(&axes[0], at[0], derivative[0]).apply(x),
        };
        self.coefficients.iter().map(of).collect()
    }
}
