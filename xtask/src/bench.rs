//! `cargo xtask bench light`: the scenes of bench/scenes lit to several tolerances: what it costs, how good it is.

use serde_json::Value;
use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

const SCENES: [&str; 2] = ["cornell", "two_room"];
const ERRORS: [&str; 3] = ["5%", "2%", "1%"];
/// Runs of each line; the median counts.
const RUNS: usize = 3;
/// Points of a reference cell along an axis.
const POINTS: usize = 4;

/// Builds the program and prints the table.
pub(crate) fn light(root: &Path) -> Result<(), String> {
    let mut build = Command::new("cargo");
    build.args(["build", "--quiet", "--release", "-p", "ondelette"]).current_dir(root);
    finish(&mut build)?;
    let program = root.join("target/release/ondelette");
    let folder = root.join("target/bench");
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    println!("CPU and wall seconds: `light`, median of {RUNS} runs; memory: peak of the process.");
    println!("error: of cell means, against bench/scenes; verify: point by point, by `ondelette verify`, at most.");
    println!("scene       asked     CPU s    wall s   memory    error   verify (95 %)");
    for scene in SCENES {
        let file = root.join(format!("bench/scenes/{scene}.obj"));
        let reference = Reference::read(&root.join(format!("bench/scenes/{scene}.csv")))?;
        for error in ERRORS {
            let (onl, report) = (folder.join(format!("{scene}.onl")), folder.join(format!("{scene}.json")));
            let mut costs: Vec<(f64, f64)> = Vec::new();
            for _ in 0..RUNS {
                let mut run = Command::new(&program);
                run.arg("light").arg(&file).args(["--error", error, "-o"]).arg(&onl).arg("--report").arg(&report);
                let (start, before) = (Instant::now(), children_seconds());
                finish(&mut run)?;
                costs.push((children_seconds() - before, start.elapsed().as_secs_f64()));
            }
            let median = |mut all: Vec<f64>| {
                all.sort_by(f64::total_cmp);
                all[all.len() / 2]
            };
            let cpu = median(costs.iter().map(|c| c.0).collect());
            let wall = median(costs.iter().map(|c| c.1).collect());
            let report = json(&fs::read_to_string(&report).map_err(|e| format!("{}: {e}", report.display()))?)?;
            let memory = report["peak_memory_bytes"].as_f64().map_or("-".into(), |b| format!("{:.0} MB", b / 1e6));
            let measured = reference.error_of(&program, &onl, &folder)?;
            let verdict = verified(&program, &onl).unwrap_or_else(|| "-".into());
            println!(
                "{scene:<10} {error:>6} {cpu:>9.2} {wall:>9.2} {memory:>8} {:>6.2} %   {verdict}",
                100.0 * measured
            );
        }
    }
    Ok(())
}

/// Runs a command that may end with exit code 0 or 1 (a missed tolerance is a result too).
fn finish(command: &mut Command) -> Result<String, String> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command.stdin(Stdio::null()).output().map_err(|e| format!("{name} does not start: {e}"))?;
    if output.status.code().is_some_and(|code| code <= 1) {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    Err(format!("{name} failed:\n{}", String::from_utf8_lossy(&output.stderr)))
}

/// User and system seconds of all children so far; 0 where the system does not say (only Linux does, in hundredths).
fn children_seconds() -> f64 {
    let Ok(stat) = fs::read_to_string("/proc/self/stat") else { return 0.0 };
    // the fields after the name, which may hold blanks, in parentheses
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or("").split_whitespace().collect();
    let ticks = |k: usize| fields.get(k).and_then(|f| f.parse::<f64>().ok()).unwrap_or(0.0);
    (ticks(13) + ticks(14)) / 100.0
}

fn json(text: &str) -> Result<Value, String> {
    serde_json::from_str(text).map_err(|e| format!("not JSON: {e}"))
}

/// What `verify` measures, with its interval.
fn verified(program: &Path, onl: &Path) -> Option<String> {
    let mut run = Command::new(program);
    run.arg("verify").arg(onl).arg("--json");
    let verdict = json(&finish(&mut run).ok()?).ok()?;
    let percent = |v: &Value| v.as_f64().map(|x| format!("{:.2}", 100.0 * x));
    let (low, high) = (percent(&verdict["interval_95"][0])?, percent(&verdict["interval_95"][1])?);
    Some(format!("{} % ({low} to {high}) {}", percent(&verdict["measured"])?, verdict["verdict"].as_str()?))
}

/// Cells with a known mean irradiance.
struct Reference {
    cells: Vec<Cell>,
}

struct Cell {
    area: f64,
    /// Origin, two edges and the normal.
    frame: [[f64; 3]; 4],
    irradiance: [f64; 3],
}

impl Reference {
    fn read(path: &Path) -> Result<Self, String> {
        let text = fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
        let mut lines = text.lines().filter(|line| !line.starts_with('#'));
        let head: Vec<&str> = lines.next().unwrap_or("").split(',').collect();
        let mut cells = Vec::new();
        for line in lines {
            let row: HashMap<&str, f64> =
                head.iter().copied().zip(line.split(',').map(|n| n.parse().unwrap_or(f64::NAN))).collect();
            let get = |name: &str| {
                row.get(name).copied().filter(|x| x.is_finite()).ok_or(format!("{}: no {name}", path.display()))
            };
            if get("emitter")? != 0.0 {
                continue;
            }
            let mut frame = [[0.0; 3]; 4];
            for (vector, name) in frame.iter_mut().zip(["o", "u", "v", "n"]) {
                for (x, axis) in vector.iter_mut().zip(["x", "y", "z"]) {
                    *x = get(&format!("{name}{axis}"))?;
                }
            }
            let irradiance = [get("E_r")?, get("E_g")?, get("E_b")?];
            cells.push(Cell { area: get("area")?, frame, irradiance });
        }
        Ok(Reference { cells })
    }

    /// Area-weighted mean of the absolute differences of cell means, over the mean irradiance.
    fn error_of(&self, program: &Path, onl: &Path, folder: &Path) -> Result<f64, String> {
        let (points, values): (PathBuf, PathBuf) = (folder.join("points.csv"), folder.join("values.csv"));
        let mut text = String::from("x,y,z,nx,ny,nz\n");
        for cell in &self.cells {
            let [o, u, v, n] = cell.frame;
            for k in 0..POINTS * POINTS {
                let [s, t] = [k % POINTS, k / POINTS].map(|i| (i as f64 + 0.5) / POINTS as f64);
                let p: Vec<String> = (0..3).map(|d| (o[d] + s * u[d] + t * v[d]).to_string()).collect();
                text += &format!("{},{},{},{}\n", p.join(","), n[0], n[1], n[2]);
            }
        }
        fs::write(&points, text).map_err(|e| format!("{}: {e}", points.display()))?;
        finish(Command::new(program).arg("probe").arg(onl).arg(&points).arg("-o").arg(&values))?;
        let table = fs::read_to_string(&values).map_err(|e| format!("{}: {e}", values.display()))?;
        let rows: Vec<[f64; 3]> = table
            .lines()
            .skip(1)
            .map(|line| {
                let mut numbers = line.split(',').skip(6).map(|n| n.parse().unwrap_or(f64::NAN));
                std::array::from_fn(|_| numbers.next().unwrap_or(f64::NAN))
            })
            .collect();
        let a_cell = POINTS * POINTS;
        if rows.len() != a_cell * self.cells.len() {
            return Err(format!("probe answered {} of {} points", rows.len(), a_cell * self.cells.len()));
        }
        let (mut off, mut whole) = (0.0, 0.0);
        for (cell, rows) in self.cells.iter().zip(rows.chunks(a_cell)) {
            for c in 0..3 {
                let mean = rows.iter().map(|row| row[c]).sum::<f64>() / a_cell as f64;
                off += cell.area * (mean - cell.irradiance[c]).abs();
                whole += cell.area * cell.irradiance[c];
            }
        }
        Ok(off / whole)
    }
}
