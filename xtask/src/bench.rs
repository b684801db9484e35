//! `cargo xtask bench light`: scenes lit to several tolerances: what it costs, how good it is, how it grows.

use crate::office::office;
use serde_json::Value;
use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

/// How direct light is read: each line of the offices is run both ways.
const READINGS: [&str; 2] = ["fitted", "gather"];
const SCENES: [&str; 2] = ["cornell", "two_room"];
const ERRORS: [&str; 3] = ["5%", "2%", "1%"];
/// Stations of the generated offices, and the errors that they are lit to; the first of them shows the growth.
const OFFICES: [(usize, &[&str]); 3] = [(3, &["5%", "2%", "1%"]), (36, &["5%", "2%", "1%"]), (366, &["5%"])];
/// Runs of each line on small scenes; the median counts.
const RUNS: usize = 3;
/// Points of a reference cell along an axis.
const POINTS: usize = 4;

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Extent {
    /// All of it.
    Full,
    /// No run of more than some seconds: the largest office and its tighter tolerances are left out.
    Quick,
}

/// The program, and a folder for what it writes.
struct Bench {
    program: PathBuf,
    folder: PathBuf,
}

/// What a run took.
#[derive(Clone, Copy, Debug)]
struct Cost {
    cpu: f64,
    wall: f64,
}

/// Builds the program and prints the tables.
pub(crate) fn light(root: &Path, extent: Extent) -> Result<(), String> {
    let mut build = Command::new("cargo");
    build.args(["build", "--quiet", "--release", "-p", "ondelette"]).current_dir(root);
    finish(&mut build)?;
    let bench = Bench { program: root.join("target/release/ondelette"), folder: root.join("target/bench") };
    fs::create_dir_all(&bench.folder).map_err(|e| format!("{}: {e}", bench.folder.display()))?;
    println!("CPU and wall seconds: `light`, median of {RUNS} runs, offices of one; memory: peak of the process.");
    println!("error: of cell means, against bench/scenes; verify: point by point, by `ondelette verify`, at most.");
    println!("direct: `gather` leaves the edges of shadows to what reads the solution, some 8 microseconds a point.");
    println!("scene        quads   asked  direct     CPU s    wall s   memory    error   verify (95 %)");
    for scene in SCENES {
        let file = root.join(format!("bench/scenes/{scene}.obj"));
        let reference = Reference::read(&root.join(format!("bench/scenes/{scene}.csv")))?;
        for error in ERRORS {
            bench.line(scene, &file, [error, READINGS[0]], RUNS, Some(&reference))?;
        }
    }
    let mut growth = READINGS.map(|_| Vec::new());
    for (stations, errors) in OFFICES {
        if extent == Extent::Quick && stations > 36 {
            continue;
        }
        let name = format!("office_{stations}");
        let file = bench.folder.join(format!("{name}.obj"));
        let (text, materials, quads) = office(&name, stations);
        for (path, content) in [(&file, text), (&file.with_extension("mtl"), materials)] {
            fs::write(path, content).map_err(|e| format!("{}: {e}", path.display()))?;
        }
        let errors = if extent == Extent::Quick { &errors[..1] } else { errors };
        for (k, error) in errors.iter().enumerate() {
            for (direct, growth) in READINGS.into_iter().zip(&mut growth) {
                let cost = bench.line(&name, &file, [error, direct], 1, None)?;
                if k == 0 {
                    growth.push((quads as f64, cost.cpu));
                }
            }
        }
    }
    for (direct, growth) in READINGS.into_iter().zip(growth) {
        let asked = OFFICES[0].1[0];
        println!("\ngrowth of the offices at {asked}, direct light {direct}: CPU s as a power of the number of quads");
        for pair in growth.windows(2) {
            let ((n, t), (m, u)) = (pair[0], pair[1]);
            println!("{n:>6} to {m:>6} quads: {t:>7.2} to {u:>7.2} s, exponent {:.2}", (u / t).ln() / (m / n).ln());
        }
        if let Some(exponent) = slope(&growth) {
            println!("over all: exponent {exponent:.2}");
        }
    }
    println!("\nscene       asked   solve: CPU s   wall s   relight: CPU s   wall s   of the solve");
    bench.relight("cornell", &root.join("bench/scenes/cornell.obj"), "1%", "m1=10,10,10")?;
    bench.relight("office_36", &bench.folder.join("office_36.obj"), "5%", "lamp=2,3,4")
}

/// Least squares through logarithms: the power of x that y grows with.
fn slope(points: &[(f64, f64)]) -> Option<f64> {
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let (mx, my) = (logs.iter().map(|l| l.0).sum::<f64>() / n, logs.iter().map(|l| l.1).sum::<f64>() / n);
    let (mut xy, mut xx) = (0.0, 0.0);
    for (x, y) in logs {
        xy += (x - mx) * (y - my);
        xx += (x - mx) * (x - mx);
    }
    (points.len() > 1 && xx > 0.0).then(|| xy / xx)
}

impl Bench {
    /// Runs the program and returns what that took.
    fn timed(&self, arguments: &[&str]) -> Result<Cost, String> {
        let (start, before) = (Instant::now(), children_seconds());
        finish(Command::new(&self.program).args(arguments))?;
        Ok(Cost { cpu: children_seconds() - before, wall: start.elapsed().as_secs_f64() })
    }

    fn path(&self, name: &str, ending: &str) -> String {
        self.folder.join(format!("{name}.{ending}")).display().to_string()
    }

    /// Lights a scene and prints a line of the table.
    fn line(
        &self,
        scene: &str,
        file: &Path,
        [error, direct]: [&str; 2],
        runs: usize,
        reference: Option<&Reference>,
    ) -> Result<Cost, String> {
        let (onl, report) = (self.path(scene, "onl"), self.path(scene, "json"));
        let file = file.display().to_string();
        let mut costs = Vec::new();
        for _ in 0..runs {
            let asked = ["light", &file, "--error", error, "--direct", direct, "-o", &onl, "--report", &report];
            costs.push(self.timed(&asked)?);
        }
        costs.sort_by(|a, b| a.cpu.total_cmp(&b.cpu));
        let cost = costs[runs / 2];
        let told = json(&fs::read_to_string(&report).map_err(|e| format!("{report}: {e}"))?)?;
        let memory = told["peak_memory_bytes"].as_f64().map_or("-".into(), |b| format!("{:.0} MB", b / 1e6));
        let quads = told["scene"]["sides"].as_u64().map_or("-".into(), |n| n.to_string());
        let onl = Path::new(&onl);
        let measured = match reference {
            Some(reference) => format!("{:.2} %", 100.0 * reference.error_of(&self.program, onl, &self.folder)?),
            None => "-".into(),
        };
        let verdict = verified(&self.program, onl).unwrap_or_else(|| "-".into());
        let Cost { cpu, wall } = cost;
        println!(
            "{scene:<12} {quads:>5} {error:>7} {direct:>7} {cpu:>9.2} {wall:>9.2} {memory:>8} {measured:>8}   {verdict}"
        );
        Ok(cost)
    }

    /// Lights a scene, gives its lamps another colour, and prints what either took.
    fn relight(&self, scene: &str, file: &Path, error: &str, emission: &str) -> Result<(), String> {
        let [first, second] = ["kept", "relit"].map(|what| self.path(&format!("{scene}.{what}"), "onl"));
        let file = file.display().to_string();
        let solve = self.timed(&["light", &file, "--error", error, "--keep-links", "-o", &first])?;
        let again = self.timed(&["relight", &first, "--emission", emission, "-o", &second])?;
        println!(
            "{scene:<11} {error:>5} {:>14.2} {:>8.2} {:>16.2} {:>8.2} {:>14.3}",
            solve.cpu,
            solve.wall,
            again.cpu,
            again.wall,
            again.wall / solve.wall
        );
        Ok(())
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_is_the_power() {
        let points = [1.0, 10.0, 300.0].map(|x: f64| (x, 5.0 * x.powf(1.2)));
        assert!((slope(&points).unwrap() - 1.2).abs() < 1e-12);
        assert_eq!(slope(&points[..1]), None);
    }
}
