//! From constraints to the rows of an intrinsic problem, and a curve to begin with.

use super::{IntrinsicError, Minimum};
use crate::axis::Axis;
use crate::constraint::{Constraint, Demand};
use crate::energy::Energy;
use crate::solve::{Settings, Solver};
use crate::system::{Problem, ProblemError, Space};
use ondelette_wavelet::Boundary;

/// One linear equation over the unknowns: coordinate c of control point i is unknown i k + c.
#[derive(Clone, Debug)]
pub(crate) struct Equation {
    pub(crate) entries: Vec<(usize, f64)>,
    pub(crate) target: f64,
    /// 1 / weight of soft ones, 0 of exact ones.
    pub(crate) give: f64,
}

impl Equation {
    /// Value minus target.
    pub(crate) fn miss(&self, x: &[f64]) -> f64 {
        self.entries.iter().map(|(i, v)| v * x[*i]).sum::<f64>() - self.target
    }
}

/// A tangent's sense: where, and which way.
#[derive(Clone, Debug)]
pub(crate) struct Sense {
    pub(crate) id: String,
    pub(crate) at: f64,
    pub(crate) direction: Vec<f64>,
}

/// A posed problem.
pub(crate) struct Pose {
    /// Its constraints with directions in place of tangents.
    pub(crate) problem: Problem,
    pub(crate) equations: Vec<Equation>,
    pub(crate) senses: Vec<Sense>,
    /// Curvatures: name, parameter, value.
    pub(crate) bends: Vec<(String, f64, f64)>,
    /// Control points to begin with, point by point.
    pub(crate) start: Vec<f64>,
    pub(crate) notes: Vec<String>,
}

/// Vectors that span the plane (in two coordinates the line) orthogonal to a direction.
fn across(direction: &[f64]) -> Vec<Vec<f64>> {
    match *direction {
        [x, y] => vec![vec![-y, x]],
        [x, y, z] => {
            let least = (0..3).min_by(|a, b| direction[*a].abs().total_cmp(&direction[*b].abs())).unwrap_or(0);
            let mut e = [0.0; 3];
            e[least] = 1.0;
            let cross = |a: [f64; 3], b: [f64; 3]| {
                [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
            };
            let first = cross([x, y, z], e);
            vec![first.to_vec(), cross([x, y, z], first).to_vec()]
        }
        _ => Vec::new(),
    }
}

/// Length of the polygon through the positions, over the range of their parameters.
fn mean_speed(axis: &Axis, constraints: &[Constraint]) -> Option<f64> {
    let whole = |c: &Constraint| match &c.demand {
        Demand::Position(p) => p.iter().copied().collect::<Option<Vec<f64>>>().map(|p| (c.at[0], p)),
        _ => None,
    };
    let mut points: Vec<(f64, Vec<f64>)> = constraints.iter().filter_map(whole).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let [from, to] = axis.domain();
    let mut range = points.last()?.0 - points.first()?.0;
    if axis.boundary() == Boundary::Periodic {
        points.push(points[0].clone());
        range = to - from;
    }
    let far = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let length: f64 = points.windows(2).map(|w| far(&w[0].1, &w[1].1)).sum();
    (range > 0.0 && length > 0.0).then(|| length / range)
}

impl Pose {
    pub(crate) fn new(
        axis: Axis,
        coordinates: usize,
        constraints: &[Constraint],
        minimum: Minimum,
    ) -> Result<Pose, IntrinsicError> {
        if !(2..=3).contains(&coordinates) {
            return Err(IntrinsicError::Unfit(
                "an intrinsic curve has 2 or 3 coordinates; a height over a line has none",
            ));
        }
        if axis.boundary() == Boundary::Mirrored {
            return Err(IntrinsicError::Unfit("a mirrored curve stands still at its ends: use open or periodic"));
        }
        let energy = match minimum {
            Minimum::Energy => Energy::BEND,
            Minimum::Variation => Energy { stretch: 0.0, bend: 0.0, variation: 1.0 },
        };
        let posed = |constraints: Vec<Constraint>| {
            Problem::new(Space::curve(axis), coordinates, energy, None, constraints).map_err(wrong)
        };
        // What was given is judged as it was given.
        posed(constraints.to_vec())?;
        let speed = mean_speed(&axis, constraints);
        let (mut first, mut exact, mut senses, mut bends) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for c in constraints {
            let unfit = |why: &'static str| IntrinsicError::Constraint { id: c.id.clone(), why };
            match &c.demand {
                Demand::Curvature(k) => bends.push((c.id.clone(), c.at[0], *k)),
                Demand::Derivative(_, v) => {
                    let whole = v.iter().copied().collect::<Option<Vec<f64>>>();
                    let direction =
                        whole.ok_or_else(|| unfit("a tangent is a direction here: give all coordinates"))?;
                    let size = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
                    if size <= 0.0 {
                        return Err(unfit("a tangent is a direction here: the zero vector has none"));
                    }
                    let by = speed.unwrap_or(size) / size;
                    let scaled = Demand::Derivative(0, direction.iter().map(|v| Some(v * by)).collect());
                    first.push(Constraint { demand: scaled, ..c.clone() });
                    for (i, n) in across(&direction).into_iter().enumerate() {
                        let id = if i == 0 { c.id.clone() } else { format!("{} (across)", c.id) };
                        exact.push(Constraint { id, demand: Demand::Normal(n), ..c.clone() });
                    }
                    senses.push(Sense { id: c.id.clone(), at: c.at[0], direction });
                }
                _ => {
                    first.push(c.clone());
                    exact.push(c.clone());
                }
            }
        }
        let solver = Solver::new(posed(first)?, Settings::default())?;
        let solution = solver.run()?;
        let problem = posed(exact)?;
        let (equations, notes) = equations(&problem)?;
        let n = axis.len();
        let start = (0..n * coordinates).map(|u| solution.coefficients()[u % coordinates][u / coordinates]).collect();
        Ok(Pose { problem, equations, senses, bends, start, notes })
    }
}

fn wrong(e: ProblemError) -> IntrinsicError {
    IntrinsicError::Solve(e.into())
}

/// The independent rows of a problem, and remarks on the others.
fn equations(problem: &Problem) -> Result<(Vec<Equation>, Vec<String>), IntrinsicError> {
    let k = problem.coordinates();
    let (blocks, redundant) = problem.blocks(problem.rows()).map_err(wrong)?;
    let mut out = Vec::new();
    for block in &blocks {
        let structure = &block.structure;
        for side in &block.sides {
            for r in 0..structure.rows() {
                let (columns, values) = structure.row(r);
                let unknown = |u: u32| {
                    let u = u as usize;
                    u % structure.n * k + side.coordinates[u / structure.n]
                };
                let entries = columns.iter().zip(values).map(|(c, v)| (unknown(*c), *v)).collect();
                out.push(Equation { entries, target: side.targets[r], give: structure.give[r] });
            }
        }
    }
    let name = |c: &usize| problem.constraints()[*c].id.clone();
    let notes = redundant.iter().map(|r| {
        let others: Vec<String> = r.others.iter().take(8).map(name).collect();
        format!("constraint {} follows from {}: redundant", name(&r.constraint), others.join(", "))
    });
    Ok((out, notes.collect()))
}
