//! `cargo run --release --example variational -- DIR [--solver S] [--tolerance T]`
//!
//! Solves the problems of `DIR/index.json` (`.npz` files: `bc`, `dim`, `L`, `pts`, `b`, reference `x`) and compares:
//! coefficients, energy in knot units, constraint values, by the tolerances of the index. A line a problem, totals
//! last; exit code 1 if any fails. Problems that a solver does not apply to are skipped, and say so. Where the energy
//! of the index contradicts the energy of its own coefficients (of double precision), the latter decides, and the line
//! says so.

mod npz;

use ondelette_modeling::Axis;
use ondelette_modeling::constraint::{Constraint, Demand};
use ondelette_modeling::energy::Energy;
use ondelette_modeling::solve::{Method, Settings, SolveError, Solver};
use ondelette_modeling::system::{Problem, Space};
use ondelette_wavelet::Boundary;
use std::path::Path;
use std::process::ExitCode;

enum Outcome {
    Line { solver: Method, iterations: usize, x: f64, energy: f64, miss: f64, pass: bool, note: String },
    Skipped(String),
}

fn solve(path: &Path, entry: &serde_json::Value, settings: Settings) -> Result<Outcome, String> {
    let file = npz::Npz::open(path)?;
    let levels = file.numbers("L")?[0] as u32;
    if levels > 20 {
        return Err(format!("L = {levels}: more than this machine can hold"));
    }
    let boundary = match file.text("bc")?.as_str() {
        "mirror" => Boundary::Mirrored,
        "clamped" | "open" => Boundary::Open,
        "periodic" => Boundary::Periodic,
        other => return Err(format!("unknown boundary {other:?}")),
    };
    let spans = 1_usize << levels;
    let axis = Axis::new(boundary, spans, [0.0, spans as f64]).map_err(|e| e.to_string())?;
    let dim = file.numbers("dim")?[0] as usize;
    let space = if dim == 1 { Space::curve(axis) } else { Space::surface(axis, axis) };
    let (points, values, reference) = (file.numbers("pts")?, file.numbers("b")?, file.numbers("x")?);
    let constraints = points
        .chunks_exact(dim)
        .zip(&values)
        .enumerate()
        .map(|(i, (at, b))| Constraint::new(format!("{i}"), at, Demand::Position(vec![Some(*b)])))
        .collect();
    let problem = Problem::new(space.clone(), 1, Energy::BEND, None, constraints).map_err(|e| e.to_string())?;
    let solver = match Solver::new(problem, settings) {
        Ok(solver) => solver,
        Err(SolveError::Method { why, .. }) => return Ok(Outcome::Skipped(why.to_owned())),
        Err(e) => return Err(e.to_string()),
    };
    let solution = match solver.run() {
        Ok(solution) => solution,
        Err(SolveError::Method { why, .. }) => return Ok(Outcome::Skipped(why.to_owned())),
        Err(e) => return Err(e.to_string()),
    };
    let got = &solution.coefficients()[0];
    if got.len() != reference.len() {
        return Err(format!("{} coefficients, the reference has {}", got.len(), reference.len()));
    }
    let largest = reference.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let x = got.iter().zip(&reference).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs())) / largest;
    let number = |name: &str| entry[name].as_f64().ok_or_else(|| format!("index.json: no {name}"));
    let energy = solution.energy() / number("energy")? - 1.0;
    let miss = solution.residuals().iter().fold(0.0, |m: f64, r| m.max(r.miss.abs()));
    let tolerance = number("energy_rtol")?;
    let mut note = String::new();
    let mut close = energy.abs() <= tolerance;
    if !close && entry["x_dtype"] == "float64" {
        let own = energy_of(&space, &reference);
        if (own / number("energy")? - 1.0).abs() > tolerance && (solution.energy() / own - 1.0).abs() <= tolerance {
            close = true;
            note = format!(" (the index's energy is {:+.1e} off its own coefficients)", number("energy")? / own - 1.0);
        }
    }
    let pass = x <= number("x_rtol")? && close && miss <= number("constraint_atol")?;
    Ok(Outcome::Line { solver: solution.method().0, iterations: solution.iterations(), x, energy, miss, pass, note })
}

/// The thin-plate energy of given coefficients.
fn energy_of(space: &Space, x: &[f64]) -> f64 {
    Energy::BEND.of(space, None, x)
}

fn run() -> Result<bool, String> {
    let mut arguments = std::env::args().skip(1);
    let (mut dir, mut settings) = (None, Settings::default());
    while let Some(a) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{a} needs a value"));
        match a.as_str() {
            "--solver" => {
                settings.method = value()?.parse().map_err(|e: ondelette_modeling::solve::MethodError| e.to_string())?
            }
            "--tolerance" => {
                settings.tolerance = value()?.parse().map_err(|_| "--tolerance needs a number".to_owned())?
            }
            _ if dir.is_none() => dir = Some(a),
            other => return Err(format!("unexpected argument {other:?}")),
        }
    }
    let dir = dir.ok_or("usage: variational DIR [--solver S] [--tolerance T]")?;
    let dir = Path::new(&dir);
    let index = std::fs::read_to_string(dir.join("index.json")).map_err(|e| format!("index.json: {e}"))?;
    let index: serde_json::Value = serde_json::from_str(&index).map_err(|e| format!("index.json: {e}"))?;
    let entries = index.as_array().ok_or("index.json: not a list")?;
    let (mut passed, mut failed, mut skipped) = (0, 0, 0);
    for entry in entries {
        let name = entry["name"].as_str().unwrap_or("?");
        let path = entry["file"].as_str().map_or_else(|| dir.join(format!("{name}.npz")), |f| dir.join(f));
        match solve(&path, entry, settings) {
            Ok(Outcome::Line { solver, iterations, x, energy, miss, pass, note }) => {
                let verdict = if pass { "PASS" } else { "FAIL" };
                println!(
                    "{name:28} {solver:10} x {x:8.1e}  energy {energy:+9.1e}  constraints {miss:8.1e}  \
                     {iterations:5} iterations  {verdict}{note}"
                );
                *(if pass { &mut passed } else { &mut failed }) += 1;
            }
            Ok(Outcome::Skipped(why)) => {
                println!("{name:28} {:10} does not apply: {why}", settings.method);
                skipped += 1;
            }
            Err(e) => {
                println!("{name:28} {:10} FAIL: {e}", settings.method);
                failed += 1;
            }
        }
    }
    println!("{passed} passed, {failed} failed, {skipped} not applicable, of {}", entries.len());
    Ok(failed == 0 && passed > 0)
}

fn main() -> ExitCode {
    match run() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(e) => {
            eprintln!("{e}");
            ExitCode::from(2)
        }
    }
}
