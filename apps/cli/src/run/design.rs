//! `ondelette curve` and `ondelette surface`: the smoothest shape under constraints.

use super::constraints::constraints;
use super::intrinsic;
use super::shape_input::read_text;
use super::shape_output::Outgoing;
use super::stiffness::stiffness;
use super::{Outcome, Refusal, tell};
use crate::interrupt::Stop;
use crate::plan::shape::DesignPlan;
use crate::report::Stages;
use ondelette_io::shape::picture::Mark;
use ondelette_io::shape::{Document, Geometry};
use ondelette_io::write::write_bytes;
use ondelette_modeling::Axis;
use ondelette_modeling::constraint::{Constraint, Demand};
use ondelette_modeling::energy::Energy;
use ondelette_modeling::shape::{Curve, ParametricCurve, ParametricSurface, Surface};
use ondelette_modeling::solve::{Method, Oracle, Residual, Settings, Solution, Solver};
use ondelette_modeling::system::{Problem, Space};
use serde_json::{Value, json};
use std::fmt::Display;

/// How far above the least energy an adaptive solution may be, of the energy.
const ADAPTIVE: f64 = 1e-3;

pub(crate) fn run(plan: &DesignPlan) -> Result<Outcome, Refusal> {
    let stop = Stop::new(None, plan.folders())?;
    let mut stages = Stages::start();
    let named = |e: &dyn Display| Refusal::new(format!("{}: {e}", plan.spec.display()));
    let mut document = Document::read(&read_text(&plan.spec)?, Some(plan.axes)).map_err(|e| named(&e))?;
    if let Some(solver) = &plan.solver {
        document.solver.clone_from(solver);
    }
    if let Some(minimum) = document.intrinsic {
        return intrinsic::run(plan, document, minimum, &stop, stages);
    }
    let problem = problem(&document).map_err(|e| named(&e))?;
    let method: Method = document.solver.parse().map_err(|e| named(&e))?;
    let settings = Settings { method, tolerance: document.tolerance, ..Settings::default() };
    stages.end("read");

    let (solution, stopped) = if document.adaptive {
        if !matches!(method, Method::Auto | Method::Wavelet) {
            return Err(named(&format!("solver {method}: an adaptive set is one of wavelets; solver auto or wavelet")));
        }
        let mut oracle = Oracle::new(problem.clone(), ADAPTIVE).map_err(|e| named(&e))?;
        stages.end("prepare");
        let mut stopped = false;
        while !stopped && oracle.step().map_err(|e| named(&e))?.is_some() {
            stopped = stop.signalled();
        }
        (oracle.solution(), stopped)
    } else {
        let mut solver = Solver::new(problem.clone(), settings).map_err(|e| named(&e))?;
        stages.end("prepare");
        let mut stopped = false;
        while !stopped && solver.step().is_some() {
            stopped = stop.signalled();
        }
        (solver.solution(), stopped)
    };
    if stopped {
        tell("stopped by Ctrl-C: what follows is the state reached");
    }
    stages.end("solve");
    // A solver that could not begin has no state worth writing.
    if !solution.converged() && !stopped && !solution.begun() && !solution.notes().is_empty() {
        return Err(named(&solution.notes().join("; ")));
    }
    if !solution.energy().is_finite() {
        return Err(named(&"the shape has no finite energy: use smaller numbers, or a longer domain"));
    }
    document.geometry = geometry(&document.axes, &solution).map_err(|e| named(&e))?;
    let out = Outgoing {
        document: &document,
        around: None,
        marks: marks(&document, problem.constraints(), problem.coordinates()),
        control: None,
        grid: None,
    };
    out.write(&plan.out)?;
    stages.end("write");
    if let Some(path) = &plan.report {
        let report = report(&document, &problem, &solution, &stages);
        write_bytes(path, format!("{report:#}\n").as_bytes())?;
    }
    let (method, _) = solution.method();
    let worst = solution.residuals().iter().filter(|r| !r.soft).fold(0.0_f64, |m, r| m.max(r.miss.abs()));
    let points = solution.space().len();
    let active = solution.active().map_or_else(String::new, |n| format!("{n} active wavelets for "));
    tell(format_args!(
        "{active}{points} control points, {} constraints, solver {method}: energy {:.6e}, largest miss {worst:.1e}",
        problem.constraints().len(),
        solution.energy(),
    ));
    if document.adaptive && !Oracle::pays(&problem) {
        tell("note: adaptive is not expected to be faster than all wavelets here: it reduces data only");
    }
    solution.notes().iter().for_each(|note| tell(format_args!("note: {note}")));
    if solution.converged() && !stopped {
        return Ok(Outcome::Done);
    }
    tell("not converged: try another solver, fewer spans, or a larger tolerance");
    Ok(Outcome::Unfinished)
}

/// The problem of a document.
fn problem(document: &Document) -> Result<Problem, String> {
    let (constraints, coordinates) = constraints(document)?;
    let [stretch, bend, variation] = document.energy;
    let energy = Energy::new(stretch, bend, variation).map_err(|e| e.to_string())?;
    let space = space(&document.axes);
    let stiffness = stiffness(document, &space)?;
    Problem::new(space, coordinates, energy, stiffness, constraints).map_err(|e| e.to_string())
}

pub(super) fn space(axes: &[Axis]) -> Space {
    match *axes {
        [s, t] => Space::surface(s, t),
        _ => Space::curve(axes[0]),
    }
}

fn geometry(axes: &[Axis], solution: &Solution) -> Result<Geometry, String> {
    let x = solution.coefficients();
    let point = |k: usize| std::array::from_fn(|c| x.get(c).map_or(0.0, |x| x[k]));
    let points = (0..solution.space().len()).map(point).collect();
    let shape = match *axes {
        [s, t] => Surface::new([s, t], x.len(), points).map(Geometry::Surface),
        _ => Curve::new(axes[0], x.len(), points).map(Geometry::Curve),
    };
    shape.map_err(|e| format!("the solution is no shape: {e}"))
}

/// What pictures show of the constraints.
pub(super) fn marks(document: &Document, constraints: &[Constraint], coordinates: usize) -> Vec<Mark> {
    let jet = |at: &[f64]| match &document.geometry {
        Geometry::Curve(c) => {
            let j = c.jet(at[0]);
            Some((j.point, [j.first, j.first]))
        }
        Geometry::Surface(s) => {
            let j = s.jet(at[0], at[1]);
            Some((j.point, j.first))
        }
        Geometry::None => None,
    };
    let heights = coordinates == 1;
    let place = |values: &[Option<f64>], here: [f64; 3]| -> [f64; 3] {
        let shift = if heights { document.axes.len() } else { 0 };
        std::array::from_fn(|c| match c.checked_sub(shift).and_then(|k| values.get(k)) {
            Some(Some(v)) => *v,
            _ => here[c],
        })
    };
    let mut out = Vec::new();
    for c in constraints {
        let Some((here, first)) = jet(&c.at) else { continue };
        match &c.demand {
            Demand::Position(values) if c.weight.is_some() => out.push(Mark::Soft(place(values, here), here)),
            Demand::Position(values) => out.push(Mark::Point(place(values, here))),
            Demand::Derivative(axis, _) => out.push(Mark::Direction(here, first[*axis])),
            Demand::Normal(n) => {
                let n = std::array::from_fn(|k| n.get(k).copied().unwrap_or(0.0));
                out.push(Mark::Direction(here, n));
            }
            _ => out.push(Mark::Point(here)),
        }
    }
    out
}

fn report(document: &Document, problem: &Problem, solution: &Solution, stages: &Stages) -> Value {
    // The same shape on a domain of unit spans: the energy in knot units.
    let knots = |a: &Axis| Axis::new(a.boundary(), a.spans(), [0.0, a.spans() as f64]);
    let knots: Vec<Axis> = document.axes.iter().filter_map(|a| knots(a).ok()).collect();
    let unit = space(&knots);
    let energy_knots: f64 =
        solution.coefficients().iter().map(|x| problem.energy().of(&unit, problem.stiffness(), x)).sum();
    let (method, why) = solution.method();
    json!({
        "energy": solution.energy(),
        "energy_knots": energy_knots,
        "residuals": worst_by_id(solution.residuals()),
        "iterations": solution.iterations(),
        "control_points": solution.space().len(),
        "active": solution.active().unwrap_or_else(|| solution.space().len()),
        "excess": solution.excess(),
        "adaptive": document.adaptive.then(|| pace(problem)),
        "coordinates": problem.coordinates(),
        "converged": solution.converged(),
        "solver": method.to_string(),
        "why": why,
        "tolerance": document.tolerance,
        "notes": solution.notes(),
        "seconds": stages.json(),
    })
}

/// Whether an adaptive solution saves time, or data alone, and by which rule.
fn pace(problem: &Problem) -> Value {
    let rule =
        "surfaces of about square cells and 3000 control points a constraint (100 with an open axis); else data only";
    json!({ "faster_than_full": Oracle::pays(problem), "rule": rule })
}

/// The largest miss of each constraint.
pub(super) fn worst_by_id(residuals: &[Residual]) -> serde_json::Map<String, Value> {
    let mut out = serde_json::Map::new();
    for r in residuals {
        let worst = out.get(&r.id).and_then(Value::as_f64).unwrap_or(0.0);
        out.insert(r.id.clone(), json!(worst.max(r.miss.abs())));
    }
    out
}
