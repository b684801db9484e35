//! `ondelette curve` with an intrinsic energy: curves of least energy or variation whatever their parameter.

use super::constraints::constraints;
use super::design::{marks, worst_by_id};
use super::shape_output::Outgoing;
use super::{Outcome, Refusal, tell};
use crate::interrupt::Stop;
use crate::plan::shape::DesignPlan;
use crate::report::Stages;
use ondelette_io::shape::{Document, Geometry};
use ondelette_io::write::write_bytes;
use ondelette_modeling::intrinsic::{IntrinsicSolver, Minimum};
use serde_json::json;

pub(super) fn run(
    plan: &DesignPlan,
    mut document: Document,
    minimum: Minimum,
    stop: &Stop,
    mut stages: Stages,
) -> Result<Outcome, Refusal> {
    let named = |e: String| Refusal::new(format!("{}: {e}", plan.spec.display()));
    if !matches!(document.solver.as_str(), "auto" | "banded") {
        let solver = &document.solver;
        return Err(named(format!("solver {solver}: an intrinsic energy has one solver of its own; leave it out")));
    }
    if !document.stiffness.is_empty() || document.adaptive {
        return Err(named("stiffness and adaptive do not go with an intrinsic energy".to_owned()));
    }
    let (constraints, coordinates) = constraints(&document).map_err(named)?;
    let axis = document.axes[0];
    let solver = IntrinsicSolver::new(axis, coordinates, &constraints, minimum, document.tolerance);
    let mut solver = solver.map_err(|e| named(e.to_string()))?;
    stages.end("prepare");
    let mut stopped = false;
    while solver.step().is_some() {
        stopped = stop.signalled();
        if stopped {
            tell("stopped by Ctrl-C: what follows is the state reached");
            break;
        }
    }
    let found = solver.solution();
    stages.end("solve");
    document.geometry = Geometry::Curve(found.curve.clone());
    let marks = marks(&document, &constraints, coordinates);
    Outgoing { document: &document, around: None, marks, control: None, grid: None }.write(&plan.out)?;
    stages.end("write");
    if let Some(path) = &plan.report {
        let report = json!({
            "intrinsic": minimum.to_string(),
            "functional": found.functional,
            "length": found.length,
            "speed_term": found.speed_term,
            "last_move": found.change,
            "residuals": worst_by_id(&found.residuals),
            "iterations": found.iterations,
            "control_points": found.curve.points().len(),
            "coordinates": coordinates,
            "converged": found.converged && !stopped,
            "solver": "newton",
            "why": "an intrinsic energy",
            "tolerance": document.tolerance,
            "notes": found.notes,
            "seconds": stages.json(),
        });
        write_bytes(path, format!("{report:#}\n").as_bytes())?;
    }
    let worst = found.residuals.iter().filter(|r| !r.soft).fold(0.0_f64, |m, r| m.max(r.miss.abs()));
    tell(format_args!(
        "{} control points, {} constraints, {minimum}: functional {:.6e}, length {:.6e}, {} Newton steps, largest miss \
         {worst:.1e}",
        found.curve.points().len(),
        constraints.len(),
        found.functional,
        found.length,
        found.iterations,
    ));
    found.notes.iter().for_each(|note| tell(format_args!("note: {note}")));
    if found.converged && !stopped {
        return Ok(Outcome::Done);
    }
    tell(format_args!("not converged: the last step moved the curve by {:.1e} of its length", found.change));
    Ok(Outcome::Unfinished)
}
