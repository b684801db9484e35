//! The report: what was done, what it cost, how good it is; as JSON, and in a few lines for people.

use crate::interrupt::Reason;
use crate::plan::light::LightPlan;
use ondelette_radiosity::ledger::Ledger;
use ondelette_radiosity::{DirectLight, Method, Rgb, Solution};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::PathBuf;
use std::time::Instant;

/// Seconds spent in each stage, in order.
#[derive(Debug)]
pub(crate) struct Stages {
    start: Instant,
    last: Instant,
    spent: Vec<(&'static str, f64)>,
}

impl Stages {
    pub(crate) fn start() -> Self {
        let now = Instant::now();
        Stages { start: now, last: now, spent: Vec::new() }
    }

    /// Books the time since the last call to `stage`.
    pub(crate) fn end(&mut self, stage: &'static str) {
        let now = Instant::now();
        self.spent.push((stage, now.duration_since(self.last).as_secs_f64()));
        self.last = now;
    }

    /// Seconds by stage, and in all.
    pub(crate) fn json(&self) -> Value {
        let mut out: serde_json::Map<String, Value> =
            self.spent.iter().map(|(stage, seconds)| ((*stage).to_owned(), json!(seconds))).collect();
        out.insert("total".to_owned(), json!(self.total()));
        out.into()
    }

    fn total(&self) -> f64 {
        self.last.duration_since(self.start).as_secs_f64()
    }
}

/// Bytes that the solver counted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Memory {
    /// Most of elements, samples or links, and working arrays.
    pub(crate) counted: u64,
    /// The scene and its ray structure.
    pub(crate) scene: u64,
}

/// All that a report is made of.
#[derive(Debug)]
pub(crate) struct Record<'a> {
    pub(crate) plan: &'a LightPlan,
    pub(crate) solution: &'a Solution,
    pub(crate) memory: Memory,
    pub(crate) ledger: Option<Ledger>,
    pub(crate) stopped: Option<Reason>,
    pub(crate) stages: Stages,
    pub(crate) written: Vec<PathBuf>,
}

impl Record<'_> {
    /// Whether the promise is kept.
    pub(crate) fn keeps_promise(&self) -> bool {
        let statistics = self.solution.statistics();
        statistics.finished
            && statistics.estimated_error <= self.solution.settings().error
            && self.ledger.is_none_or(|l| self.closes(&l))
    }

    /// Whether an oracle refines links.
    fn refines(&self) -> bool {
        let settings = self.solution.settings();
        settings.method.has_links() && !settings.is_uniform()
    }

    /// Whether the ledger closes as far as the promised error allows: more energy than that cannot go astray unless the
    /// scene has something that the solver misjudges.
    fn closes(&self, ledger: &Ledger) -> bool {
        ledger.closure().abs() <= 0.01 + self.solution.settings().error
    }

    /// The report as JSON. Powers are in the unit of the scene's power, lengths in metres, times in seconds; what is
    /// not known (an error before the first balance, the ledger of an interrupted run, memory on some systems) is null.
    pub(crate) fn json(&self) -> Value {
        let (solution, scene) = (self.solution, self.solution.scene());
        let (statistics, settings, forest) = (solution.statistics(), solution.settings(), solution.forest());
        let mut levels: Vec<u64> = Vec::new();
        for link in solution.links().as_slice() {
            let level = forest.node(link.receiver).cell.depth as usize;
            levels.resize(levels.len().max(level + 1), 0);
            levels[level] += 1;
        }
        let mut seconds: serde_json::Map<String, Value> =
            self.stages.spent.iter().map(|(stage, s)| ((*stage).to_owned(), json!(s))).collect();
        seconds.insert("total".into(), json!(self.stages.total()));
        let known = |x: f64| if x.is_finite() { json!(x) } else { Value::Null };
        json!({
            "program": "ondelette",
            "version": env!("CARGO_PKG_VERSION"),
            "scene": {
                "name": scene.name,
                "patches": scene.patches.len(),
                "sides": scene.sides.len(),
                "metres_per_unit": scene.unit.metres,
                "warnings": scene.warnings,
            },
            "settings": {
                "basis": if settings.links.graded { "auto".into() } else { settings.basis.to_string() },
                "method": settings.method.to_string(),
                "solver": settings.method.has_links().then(|| settings.links.iteration.to_string()),
                "oracle": self.refines().then(|| settings.links.oracle.to_string()),
                "weight": self.refines().then(|| settings.links.weight().to_string()),
                "decomposition": matches!(settings.method, Method::Hierarchical | Method::Wavelet)
                    .then(|| settings.links.decomposition.to_string()),
                "subdivision": settings.links.subdivision,
                "error": settings.error,
                "direct": if settings.direct == DirectLight::Gathered { "gather" } else { "fitted" },
                "two_sided": self.plan.two_sided,
                "max_time_seconds": self.plan.max_time.map(|t| t.as_secs_f64()),
                "threads": self.plan.threads,
            },
            "finished": statistics.finished,
            "keeps_promise": self.keeps_promise(),
            "stopped_by": self.stopped.map(|reason| reason.to_string()),
            "seconds": seconds,
            "elements": forest.leaves(),
            "links": { "total": solution.links().len(), "by_level": levels },
            "terms": statistics.terms.map(|terms| {
                json!({ "full": terms.full, "standard": terms.standard, "nonstandard": terms.nonstandard })
            }),
            "kernel_samples": statistics.kernel_samples,
            "rays": statistics.rays,
            "iterations": statistics.iterations,
            "shots": statistics.shots,
            "residual": known(statistics.residual),
            "estimated_error": known(statistics.estimated_error),
            "surfaces": surfaces(solution),
            "ledger": self.ledger.as_ref().map(|ledger| {
                let power = |p: Rgb| (p * square_metre(solution)).0;
                json!({
                    "unit": scene.quantity.power_unit(),
                    "emitted": power(ledger.emitted),
                    "absorbed": power(ledger.absorbed),
                    "lost_on_backs": power(ledger.lost_on_backs),
                    "escaped": power(ledger.escaped),
                    "closure": known(ledger.closure()),
                    "rays": ledger.rays,
                })
            }),
            "memory": {
                "cap_bytes": self.plan.memory,
                "counted_bytes": self.memory.counted,
                "scene_bytes": self.memory.scene,
            },
            "peak_memory_bytes": peak_memory(),
            "units": {
                "radiance": scene.quantity.radiance_unit(),
                "irradiance": scene.quantity.irradiance_unit(),
                "power": scene.quantity.power_unit(),
            },
            "outputs": self.written.iter().map(|p| p.display().to_string()).collect::<Vec<_>>(),
        })
    }

    /// A few lines for people.
    pub(crate) fn summary(&self) -> String {
        let (solution, scene) = (self.solution, self.solution.scene());
        let statistics = solution.statistics();
        let mut text = String::new();
        // Writing to a String does not fail.
        let _ = self.write_summary(&mut text, scene.quantity.power_unit());
        if !self.keeps_promise() {
            let why = match self.stopped {
                Some(Reason::Signal) => "stopped by Ctrl-C: this result is unfinished".to_owned(),
                Some(Reason::Time) => "stopped by --max-time: this result is unfinished".to_owned(),
                None if self.ledger.is_some_and(|l| !self.closes(&l)) => {
                    "the energy ledger does not close: this result is not to be trusted".to_owned()
                }
                None => {
                    let missed = format!("the tolerance of {} % is missed: ", 100.0 * solution.settings().error);
                    match (statistics.too_large, solution.settings().links.subdivision) {
                        (Some(matrix), _) => format!("{missed}{matrix}"),
                        (None, Some(n)) => format!("{missed}a subdivision of {n} is too coarse"),
                        (None, None) if self.plan.stays => {
                            format!("{missed}--refine spends the rays that are missing")
                        }
                        (None, None) => {
                            format!("{missed}no element may be split further, or the memory allowed is used up")
                        }
                    }
                }
            };
            let known = if statistics.estimated_error.is_finite() { "" } else { " (before its first balance)" };
            let _ = writeln!(text, "{why}{known}");
        }
        text
    }

    fn write_summary(&self, text: &mut String, unit: &str) -> std::fmt::Result {
        let (solution, scene) = (self.solution, self.solution.scene());
        let statistics = solution.statistics();
        let (elements, links) = (solution.forest().leaves(), solution.links().len());
        writeln!(
            text,
            "{}: {} sides, {elements} elements, {links} links, {} sweeps{}, {:.2} s",
            scene.name,
            scene.sides.len(),
            statistics.iterations,
            if statistics.shots > 0 { format!(" and {} shots", statistics.shots) } else { String::new() },
            self.stages.total()
        )?;
        let wanted = 100.0 * solution.settings().error;
        if statistics.estimated_error.is_finite() {
            let error = 100.0 * statistics.estimated_error;
            let name = scene.quantity.irradiance_name();
            writeln!(text, "error    {error:.3} % of the mean {name} (estimated; {wanted} % asked)")?;
        } else {
            writeln!(text, "error    not known yet ({wanted} % asked)")?;
        }
        if let Some(terms) = statistics.terms {
            let [standard, nonstandard] = [terms.standard, terms.nonstandard];
            writeln!(text, "terms    {} in all; kept {standard} (standard), {nonstandard} (nonstandard)", terms.full)?;
        }
        if let Some(ledger) = &self.ledger {
            let power = |p: Rgb| significant(p.sum() * square_metre(solution));
            writeln!(
                text,
                "ledger   {} {unit} emitted (r + g + b) = {} absorbed + {} lost on black backs + {} escaped, {:+.3} %",
                power(ledger.emitted),
                power(ledger.absorbed),
                power(ledger.lost_on_backs),
                power(ledger.escaped),
                100.0 * ledger.closure()
            )?;
        }
        if !self.written.is_empty() {
            let names: Vec<String> = self.written.iter().map(|p| p.display().to_string()).collect();
            writeln!(text, "written  {}", names.join(", "))?;
        }
        Ok(())
    }
}

/// Objects that are listed with their errors.
const LISTED: usize = 1000;

/// Estimated errors by object: the largest first, as far as they are listed.
fn surfaces(solution: &Solution) -> Value {
    if solution.errors().is_empty() {
        return Value::Null;
    }
    let scene = solution.scene();
    // area, integral of the irradiance, integral of its error
    let mut sums = vec![[0.0; 3]; scene.objects.len()];
    let object = |side: usize| scene.patches[scene.sides[side].patch as usize].provenance.object as usize;
    solution.each_leaf(|_, side, area, mean| {
        let sum = &mut sums[object(side)];
        sum[0] += area;
        sum[1] += area * mean.sum();
    });
    for (side, error) in solution.errors().iter().enumerate() {
        sums[object(side)][2] += error;
    }
    let whole: f64 = sums.iter().map(|s| s[2]).sum();
    let mut order: Vec<usize> = (0..sums.len()).filter(|&o| sums[o][0] > 0.0).collect();
    order.sort_by(|&a, &b| sums[b][2].total_cmp(&sums[a][2]).then(a.cmp(&b)));
    let metres = square_metre(solution);
    let ratio = |a: f64, b: f64| if b > 0.0 { json!(a / b) } else { Value::Null };
    let listed = order.iter().take(LISTED).map(|&o| {
        let [area, irradiance, error] = sums[o];
        json!({
            "name": scene.objects[o].name,
            "area_square_metres": area * metres,
            "mean_irradiance_rgb_sum": irradiance / area,
            "estimated_error": ratio(error, irradiance),
            "share_of_all_error": ratio(error, whole),
        })
    });
    listed.collect()
}

/// Five significant digits.
fn significant(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return x.to_string();
    }
    let digits = 4 - x.abs().log10().floor() as i32;
    if (0..=9).contains(&digits) { format!("{x:.*}", digits as usize) } else { format!("{x:.4e}") }
}

/// Square metres in a square unit of the scene.
fn square_metre(solution: &Solution) -> f64 {
    let metres = solution.scene().unit.metres;
    metres * metres
}

/// The most memory this process ever held, in bytes; known on Linux.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| 1024 * kib)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_told_in_five_digits_whatever_their_size() {
        let said = [0.0, 1.415_128, 16_000.2, 534_543.1, 0.000_123_456, 1e-12].map(significant);
        assert_eq!(said, ["0", "1.4151", "16000", "5.3454e5", "0.00012346", "1.0000e-12"]);
    }
}
