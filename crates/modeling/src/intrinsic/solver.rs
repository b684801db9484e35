//! The stepped solver of intrinsic curves.

use super::objective::{Bend, Objective, Value};
use super::pose::{Equation, Pose};
use super::step::{Newton, newton};
use super::{IntrinsicError, Minimum, speed};
use crate::axis::Axis;
use crate::constraint::{Constraint, Demand};
use crate::energy::{Energy, Operator};
use crate::shape::{Curve, ParametricCurve, ShapeError};
use crate::solve::Residual;
use crate::system::Space;
use ondelette_wavelet::Boundary;

/// What a step did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntrinsicStep {
    /// Newton steps so far, rejected ones included.
    pub iterations: usize,
    /// The functional, in the units of the constraints.
    pub functional: f64,
    /// Largest move of a control point in the last step, over the length of the curve.
    pub change: f64,
}

/// An intrinsic curve, or how far it got.
#[derive(Clone, Debug)]
pub struct IntrinsicCurve {
    /// The curve.
    pub curve: Curve,
    /// The integral that was to be least, in the units of the constraints: 1 / length for energy, 1 / length^3 for
    /// variation.
    pub functional: f64,
    /// Length of the curve.
    pub length: f64,
    /// What is left of the term of even speed: the integral, over the parameter from 0 to 1, of the squared
    /// derivative of the logarithm of speed over wanted speed.
    pub speed_term: f64,
    /// Largest move of a control point in the last Newton step, over the length of the curve.
    pub change: f64,
    /// Newton steps, rejected ones included.
    pub iterations: usize,
    /// True when the tolerance was reached.
    pub converged: bool,
    /// The miss of every constraint row.
    pub residuals: Vec<Residual>,
    /// Redundant rows, why it did not converge, and other remarks, a sentence each.
    pub notes: Vec<String>,
}

/// A solver for an intrinsic curve, stepped by its caller; between two steps its curve is valid, if unfinished.
///
/// A step costs linear time in the spans, and the square of the constraints.
///
/// ```
/// use ondelette_modeling::Axis;
/// use ondelette_modeling::constraint::{Constraint, Demand};
/// use ondelette_modeling::intrinsic::{IntrinsicSolver, Minimum};
/// use ondelette_wavelet::Boundary;
/// // Three points of a circle of radius 2 are enough: a circle has no variation of curvature.
/// let axis = Axis::new(Boundary::Periodic, 48, [0.0, 1.0])?;
/// let point = |i: usize| {
///     let a = std::f64::consts::TAU * i as f64 / 3.0;
///     let at = vec![Some(2.0 * a.cos()), Some(2.0 * a.sin())];
///     Constraint::new(format!("{i}"), &[i as f64 / 3.0], Demand::Position(at))
/// };
/// let points: Vec<Constraint> = (0..3).map(point).collect();
/// let circle = IntrinsicSolver::new(axis, 2, &points, Minimum::Variation, 1e-8)?.run();
/// assert!(circle.converged && (circle.length / std::f64::consts::TAU - 2.0).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct IntrinsicSolver {
    objective: Objective,
    pose: Pose,
    /// Length of the first curve: the unit of `x`.
    unit: f64,
    /// Control points, point by point, in units.
    x: Vec<f64>,
    value: Value,
    /// The quadratic energy, and a little of every coefficient.
    damping: Vec<(usize, usize, f64)>,
    by: f64,
    weight: f64,
    tolerance: f64,
    /// Parameters of the constraints that are places.
    places: Vec<f64>,
    stage: usize,
    change: f64,
    iterations: usize,
    state: State,
    notes: Vec<String>,
    /// What a unit of missed curvature costs a step: above every multiplier seen.
    penalty: f64,
    /// Multipliers of the curvatures in the last step.
    pulls: Vec<f64>,
    /// The functional at the end of the last stage.
    before: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Working,
    Converged,
    Stopped,
}

/// Newton steps after which a curve is given up.
const MOST: usize = 400;
/// Settings of the even speed's term, each followed to rest.
const STAGES: usize = 40;
/// A curve this much longer than at the start has no minimum.
const LONG: f64 = 10.0;
/// The longest move of a control point in a step, over the length.
const LEAP: f64 = 0.05;
/// The damping at which nothing moves any more.
const STUCK: f64 = 1e12;

impl IntrinsicSolver {
    /// Poses the problem: an open or periodic curve of 2 or 3 coordinates.
    ///
    /// Positions are met at their parameters; tangents as directions with a sense (their length means nothing here);
    /// normals as orthogonal directions; curvatures by linearising. Soft constraints (weight times the squared miss)
    /// join the functional. Between exact positions the parameter is in proportion to length, as smoothly as they
    /// allow.
    /// `tolerance`: the largest last move of a control point, over the length of the curve.
    ///
    /// # Errors
    /// [`IntrinsicError`].
    pub fn new(
        axis: Axis,
        coordinates: usize,
        constraints: &[Constraint],
        minimum: Minimum,
        tolerance: f64,
    ) -> Result<IntrinsicSolver, IntrinsicError> {
        if !(1e-15..1.0).contains(&tolerance) {
            return Err(crate::solve::SolveError::Tolerance(tolerance).into());
        }
        let mut pose = Pose::new(axis, coordinates, constraints, minimum)?;
        let mut objective = Objective::new(axis, coordinates, minimum);
        let unit = speed::length(&objective, &pose.start);
        let size = pose.start.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        if !(unit.is_finite() && unit > 1e-12 * size) {
            return Err(IntrinsicError::Collapsed);
        }
        let x: Vec<f64> = pose.start.iter().map(|v| v / unit).collect();
        // Weights of soft rows: per squared unit, on a functional of its own unit.
        let power = if minimum == Minimum::Energy { 1 } else { 3 };
        for e in &mut pose.equations {
            e.target /= unit;
            e.give /= unit.powi(power + 2);
        }
        // Soft points may slide along the curve; exact ones share out its length.
        let positions =
            |c: &&Constraint| c.weight.is_none() && matches!(c.demand, Demand::Position(_) | Demand::Image { .. });
        let at = constraints.iter().filter(positions).flat_map(|c| match &c.demand {
            Demand::Image { of, .. } => vec![c.at[0], of[0]],
            _ => vec![c.at[0]],
        });
        let places = speed::places(&axis, at);
        speed::set(&mut objective, &x, &places);
        let slowest = (0..axis.spans()).flat_map(|i| objective.speeds(i, &x)).fold(f64::INFINITY, |m, s| m.min(s.0));
        if slowest * axis.spans() as f64 <= 1e-6 {
            return Err(IntrinsicError::Collapsed);
        }
        let mut notes = std::mem::take(&mut pose.notes);
        if minimum == Minimum::Energy && axis.boundary() == Boundary::Periodic {
            notes.push(
                "closed curves of free length have no least energy (long loops cost less): this is a local minimum"
                    .to_owned(),
            );
        }
        let mut solver = IntrinsicSolver {
            damping: damping(&axis, coordinates, minimum),
            value: objective.value(&x, 0.0),
            objective,
            pose,
            unit,
            x,
            by: 1e-3,
            weight: 1.0,
            tolerance,
            places,
            stage: 0,
            change: f64::INFINITY,
            iterations: 0,
            state: State::Working,
            notes,
            penalty: 0.0,
            pulls: Vec::new(),
            before: f64::INFINITY,
        };
        solver.weight = solver.weight_at(0);
        solver.value = solver.at(&solver.x);
        Ok(solver)
    }

    /// The functional with the term of even speed and the soft rows.
    fn at(&self, x: &[f64]) -> Value {
        let mut value = self.objective.value(x, self.weight);
        for e in self.soft() {
            let (w, miss) = (2.0 / e.give, e.miss(x));
            for (i, v) in &e.entries {
                value.gradient[*i] += w * miss * v;
                value.entries.extend(e.entries.iter().filter(|f| f.0 <= *i).map(|(j, u)| (*i, *j, w * v * u)));
            }
        }
        value
    }

    fn soft(&self) -> impl Iterator<Item = &Equation> {
        self.pose.equations.iter().filter(|e| e.give > 0.0)
    }

    fn total(&self, x: &[f64], value: &Value) -> f64 {
        let soft: f64 = self.soft().map(|e| e.miss(x).powi(2) / e.give).sum();
        value.functional + self.weight * value.speed + soft
    }

    /// Curvatures of `x` at the constraints on them, less what is wanted.
    fn bends(&self, x: &[f64]) -> Vec<Bend> {
        let of = |b: &(String, f64, f64)| {
            let mut bend = self.objective.bend(x, b.1);
            bend.value -= b.2 * self.unit;
            bend
        };
        self.pose.bends.iter().map(of).collect()
    }

    fn missed(&self, x: &[f64]) -> f64 {
        self.bends(x).iter().map(|b| b.value.abs()).sum()
    }

    /// The exact equations around the curve so far, and by how much it misses them.
    fn equations(&self, bends: &[Bend]) -> (Vec<Equation>, Vec<f64>) {
        let mut exact: Vec<Equation> = self.pose.equations.iter().filter(|e| e.give == 0.0).cloned().collect();
        let mut misses: Vec<f64> = exact.iter().map(|e| e.miss(&self.x)).collect();
        for b in bends {
            let size = b.gradient.iter().map(|e| e.1 * e.1).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
            let entries = b.gradient.iter().map(|(i, v)| (*i, v / size)).collect();
            exact.push(Equation { entries, target: 0.0, give: 0.0 });
            misses.push(b.value / size);
        }
        (exact, misses)
    }

    /// One Newton step, taken or damped more; `None` when there is nothing left to do.
    pub fn step(&mut self) -> Option<IntrinsicStep> {
        if self.state != State::Working {
            return None;
        }
        self.iterations += 1;
        let bends = self.bends(&self.x);
        let (exact, misses) = self.equations(&bends);
        let mut entries = std::mem::take(&mut self.value.entries);
        let own = entries.len();
        for (b, pull) in bends.iter().zip(&self.pulls) {
            entries.extend(b.entries.iter().map(|e| (e.0, e.1, pull * e.2)));
        }
        let found = newton(&self.value.gradient, &entries, &self.damping, self.by, &exact, &misses);
        entries.truncate(own);
        self.value.entries = entries;
        let settled = match found {
            None => {
                self.by *= 10.0;
                false
            }
            Some(found) => {
                let count = bends.len();
                let size = |b: &Bend| b.gradient.iter().map(|e| e.1 * e.1).sum::<f64>().sqrt();
                let linear = misses.len() - count;
                self.pulls = (0..count).map(|i| found.multipliers[linear + i] / size(&bends[i])).collect();
                self.penalty = self.pulls.iter().fold(self.penalty, |m, p| m.max(2.0 * p.abs()));
                let far = misses[..linear].iter().fold(0.0, |m: f64, v| m.max(v.abs())) > 1e-9;
                self.try_step(&found, far)
            }
        };
        if settled {
            self.next_stage();
        }
        self.give_up();
        Some(IntrinsicStep { iterations: self.iterations, functional: self.functional(), change: self.change })
    }

    /// Takes a step or damps the next one more; true where the curve has come to rest. `far`: the linear equations are
    /// not met yet, so that any step goes.
    fn try_step(&mut self, found: &Newton, far: bool) -> bool {
        let missed = self.missed(&self.x);
        let here = self.total(&self.x, &self.value) + self.penalty * missed;
        let expected = found.expected + self.penalty * missed;
        let next: Vec<f64> = self.x.iter().zip(&found.step).map(|(x, d)| x + d).collect();
        let value = self.at(&next);
        let gained = here - self.total(&next, &value) - self.penalty * self.missed(&next);
        let noise = 1e-12 * (1.0 + here.abs());
        let small = expected.abs() <= noise;
        let finite = value.gradient.iter().all(|v| v.is_finite());
        let change = found.step.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        // A long step would leap over the nearest minimum to a loop.
        if change > LEAP * speed::length(&self.objective, &self.x) && !far {
            self.by *= 4.0;
            return false;
        }
        if finite && (gained > 1e-4 * expected || far || (small && gained >= -noise)) {
            self.change = change;
            (self.x, self.value) = (next, value);
            // Undamped at last: Newton's own convergence decides.
            let settled = self.by <= 1e-2 && (self.change <= self.goal() || small);
            if gained > 0.5 * expected || small {
                self.by = (0.1 * self.by).max(1e-9);
            }
            return settled && self.missed(&self.x) <= 1e-9 * (1.0 + missed);
        }
        if small {
            return true;
        }
        self.by *= 10.0;
        false
    }

    /// The size of a Newton step that ends a stage: loose until the last weight.
    fn goal(&self) -> f64 {
        if self.stage == 0 { 1e-4 } else { self.tolerance }
    }

    /// The weight of even speed at a stage: a lighter one would let the parameter drift to where the spline's own error
    /// hides part of the functional. It does not bend the curve, since the wanted speeds follow it.
    fn weight_at(&self, stage: usize) -> f64 {
        let light = f64::max(0.1, 0.02 * self.value.functional);
        if stage == 0 { 10.0 * light } else { light }
    }

    fn next_stage(&mut self) {
        self.stage += 1;
        let moved = speed::set(&mut self.objective, &self.x, &self.places);
        let now = self.value.functional;
        let still = (now - self.before).abs() <= 1e-6 * (now + 1.0);
        self.before = now;
        if self.stage > 1 && still && moved <= 1e-3 {
            self.state = State::Converged;
            self.check_senses();
        } else if self.stage >= STAGES {
            self.state = State::Stopped;
            self.notes.push(format!("the speed along the curve did not settle: it still changes by {moved:.1e}"));
        }
        self.weight = self.weight_at(self.stage);
        self.value = self.at(&self.x);
    }

    fn give_up(&mut self) {
        if self.state != State::Working {
            return;
        }
        let length = speed::length(&self.objective, &self.x);
        let why = if length > LONG {
            format!(
                "the curve grows without bound ({length:.0} times its first length) and has no minimum: hold it by \
                 more points or tangents"
            )
        } else if self.by > STUCK {
            format!("no step lowers the functional any more; the last moved the curve by {:.1e}", self.change)
        } else if self.iterations >= MOST {
            format!("{MOST} Newton steps were not enough; the last moved the curve by {:.1e}", self.change)
        } else {
            return;
        };
        self.state = State::Stopped;
        self.notes.push(why);
    }

    /// Tangents hold the line of a direction; its sense is what the first curve chose.
    fn check_senses(&mut self) {
        let Ok(curve) = self.curve() else { return };
        for s in &self.pose.senses {
            let first = curve.jet(s.at).first;
            if s.direction.iter().zip(first).map(|(a, b)| a * b).sum::<f64>() <= 0.0 {
                self.state = State::Stopped;
                self.notes.push(format!("constraint {}: the curve runs against the tangent there", s.id));
            }
        }
    }

    fn functional(&self) -> f64 {
        let power = if self.objective.minimum == Minimum::Energy { 1 } else { 3 };
        self.value.functional / self.unit.powi(power)
    }

    fn curve(&self) -> Result<Curve, ShapeError> {
        let k = self.objective.k;
        let point = |p: &[f64]| std::array::from_fn(|c| p.get(c).map_or(0.0, |v| v * self.unit));
        Curve::new(self.objective.axis, k, self.x.chunks_exact(k).map(point).collect())
    }

    /// Steps to the end.
    pub fn run(mut self) -> IntrinsicCurve {
        while self.step().is_some() {}
        self.solution()
    }

    /// The curve so far.
    ///
    /// # Panics
    /// Never: accepted control points are finite.
    pub fn solution(&self) -> IntrinsicCurve {
        let problem = &self.pose.problem;
        let k = self.objective.k;
        let residuals = problem.rows().into_iter().map(|row| {
            let value: f64 = row.entries().map(|(c, i, v)| v * self.x[i * k + c] * self.unit).sum();
            let id = problem.constraints()[row.constraint].id.clone();
            Residual { id, soft: row.give > 0.0, miss: (value - row.target) * row.length }
        });
        let bent = |(spec, b): (&(String, f64, f64), Bend)| Residual {
            id: spec.0.clone(),
            soft: false,
            miss: b.value / self.unit,
        };
        let bends = self.pose.bends.iter().zip(self.bends(&self.x)).map(bent);
        IntrinsicCurve {
            curve: self.curve().expect("accepted control points are finite"),
            functional: self.functional(),
            length: speed::length(&self.objective, &self.x) * self.unit,
            speed_term: self.value.speed,
            change: self.change,
            iterations: self.iterations,
            converged: self.state == State::Converged,
            residuals: residuals.chain(bends).collect(),
            notes: self.notes.clone(),
        }
    }
}

/// Second derivatives of the quadratic energy whose functional it is, at the speed of the first curve, with a little on
/// the diagonal for what it does not see.
fn damping(axis: &Axis, k: usize, minimum: Minimum) -> Vec<(usize, usize, f64)> {
    let [from, to] = axis.domain();
    let scale = (to - from).powi(if minimum == Minimum::Energy { 3 } else { 5 });
    let energy = match minimum {
        Minimum::Energy => Energy { stretch: 0.0, bend: scale, variation: 0.0 },
        Minimum::Variation => Energy { stretch: 0.0, bend: 0.0, variation: scale },
    };
    let mut out = Vec::new();
    let h = Operator::new(&Space::curve(*axis), &energy, None);
    h.entries(|r, c, v| out.extend((0..k).map(|d| (r * k + d, c * k + d, 2.0 * v))));
    let little = 1.0 / axis.len() as f64;
    out.extend((0..axis.len() * k).map(|i| (i, i, little)));
    out
}
