//! `ondelette verify`: does a solution keep its promise?

use super::{Outcome, Refusal, print, tell};
use crate::interrupt::Stop;
use crate::plan::values;
use crate::progress::Progress;
use ondelette_io::onl::read_solution;
use ondelette_numerics::par;
use ondelette_radiosity::probe::Prober;
use ondelette_radiosity::{Scene, Solution};
use ondelette_verify::{Group, Report, Verdict, Verifier};
use serde_json::json;
use std::fmt::Write;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  ondelette light room.glb --error 2% -o room.onl
  ondelette verify room.onl
  ondelette verify room.onl --points 20000 --json > verdict.json
  ondelette verify room.onl --error 1%             against another promise than its own

Exit codes: 0 the promise is kept, or this number of points cannot tell (the last line says so, and how many would); \
1 it is broken, or the check was stopped; 2 bad input. The verdict goes to standard output, the same every time.")]
pub(crate) struct VerifyArgs {
    /// Solution file of `ondelette light -o NAME.onl`
    #[arg(value_name = "SOLUTION.onl")]
    pub(crate) solution: PathBuf,

    /// Points at which the light is traced, from 100 to 1000000
    #[arg(long, default_value_t = 2000, value_name = "N", allow_hyphen_values = true)]
    pub(crate) points: u64,

    /// Check against this error, in per cent of the mean irradiance [default: what the solution promises]
    #[arg(long, value_name = "PERCENT", allow_hyphen_values = true)]
    pub(crate) error: Option<String>,

    /// Stop after this time: 10s, 2m. What the points so far say is printed, and the exit code is 1
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    pub(crate) max_time: Option<String>,

    /// Number of threads; the verdict does not depend on it [default: one a processor]
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub(crate) threads: Option<String>,

    /// Print the verdict as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// Surfaces that are listed.
const LISTED: usize = 8;

pub(crate) fn run(args: &VerifyArgs) -> Result<Outcome, Refusal> {
    let threads = args.threads.as_deref().map(values::threads).transpose()?;
    let limit = args.max_time.as_deref().map(values::duration).transpose()?;
    let stop = Stop::new(limit, Vec::new())?;
    match threads {
        Some(n) => par::with_threads(n, || verify(args, stop))
            .map_err(|e| Refusal::new(format!("--threads {n}: the system gives no such number of threads: {e}")))?,
        None => verify(args, stop),
    }
}

fn verify(args: &VerifyArgs, stop: Stop) -> Result<Outcome, Refusal> {
    let solution = read_solution(&args.solution)?;
    let promised = match &args.error {
        Some(text) => values::percent(text)?,
        None => solution.settings().error,
    };
    if !(1e-4..=1.0).contains(&promised) {
        let percent = 100.0 * promised;
        return Err(Refusal::new(format!("--error: {percent} % makes no sense: give between 0.01 % and 100 %")));
    }
    if !solution.is_finished() {
        let percent = 100.0 * solution.statistics().estimated_error;
        tell(format_args!("note: {} is unfinished; its estimated error is {percent:.3} %", args.solution.display()));
    }
    let mut verifier = Verifier::new(solution.scene(), promised, args.points)
        .map_err(|e| Refusal::new(format!("{}: {e}", args.solution.display())))?;
    let mut progress = Progress::new(promised);
    let mut stopped = None;
    let prober = Prober::new(&solution);
    while stopped.is_none() && verifier.step(|side, at| prober.irradiance(side, at)) {
        let (done, all) = verifier.progress();
        progress.stage(&format!("tracing paths, {done} of {all} points"), done as f64 / all as f64);
        stopped = stop.asked();
    }
    progress.finish();
    let (done, all) = verifier.progress();
    let report = verifier.report();
    if args.json {
        print(&format!("{:#}\n", json(&report, &solution)))?;
    } else {
        print(&text(&report, &solution))?;
    }
    if let Some(reason) = stopped.filter(|_| done < all) {
        tell(format_args!("stopped by {reason} after {done} of {all} points"));
        return Ok(Outcome::Unfinished);
    }
    Ok(if report.verdict == Verdict::Broken { Outcome::Unfinished } else { Outcome::Done })
}

fn percent(x: f64) -> String {
    format!("{:.3} %", 100.0 * x)
}

/// What a group of points is called.
fn name(group: &Group, scene: &Scene) -> String {
    let Some(side) = group.side else { return "small surfaces of one brightness".into() };
    let side_of = scene.sides[side as usize];
    let object = scene.patches[side_of.patch as usize].provenance.object;
    let back = if side_of.back { ", back" } else { "" };
    format!("{} (side {side}{back})", scene.objects[object as usize].name)
}

fn text(report: &Report, solution: &Solution) -> String {
    let mut out = String::new();
    // writing to a String does not fail
    let _ = write_text(&mut out, report, solution);
    out
}

fn write_text(out: &mut String, report: &Report, solution: &Solution) -> std::fmt::Result {
    let scene = solution.scene();
    let [low, high] = report.interval;
    writeln!(out, "promised   {}", percent(report.promised))?;
    let interval = format!("95 %: {} to {}", percent(low), percent(high));
    writeln!(out, "measured   {} at most on average ({interval})", percent(report.measured))?;
    writeln!(out, "at least   {}", percent(report.at_least))?;
    let [bias, spread] = report.bias;
    writeln!(out, "bias       {:+.3} % (give or take {})", 100.0 * bias, percent(2.0 * spread))?;
    writeln!(out, "points     {} with {} paths each", report.points, report.paths)?;
    let unit = scene.quantity.irradiance_unit();
    let [r, g, b] = report.mean.0;
    writeln!(out, "mean       {r:.6} {g:.6} {b:.6} {unit} ({})", scene.quantity.irradiance_name())?;
    if !report.groups.is_empty() {
        writeln!(out, "\n  root mean square, of the scene's mean   area   points   surface")?;
    }
    for group in report.groups.iter().take(LISTED) {
        let (rms, share) = (percent(group.rms), percent(group.share));
        writeln!(out, "  {rms:>37}   {share:>8}   {:>6}   {}", group.points, name(group, scene))?;
    }
    if report.groups.len() > LISTED {
        writeln!(out, "  and {} more with less of the error", report.groups.len() - LISTED)?;
    }
    writeln!(out, "\n{}", sentence(report))
}

fn sentence(report: &Report) -> String {
    match report.verdict {
        Verdict::Kept => "kept: the error is within the promise".into(),
        Verdict::Broken => "broken: the error is above the promise".into(),
        Verdict::Inconclusive(Some(points)) => {
            format!("inconclusive: the promise lies in the interval; --points {points} would probably decide")
        }
        Verdict::Inconclusive(None) => {
            "inconclusive: the error is so close to the promise that no affordable number of points decides".into()
        }
    }
}

fn json(report: &Report, solution: &Solution) -> serde_json::Value {
    let scene = solution.scene();
    let groups: Vec<_> = report
        .groups
        .iter()
        .map(|g| {
            json!({
                "surface": name(g, scene), "side": g.side, "points": g.points, "area_share": g.share,
                "mean_irradiance_summed": g.mean, "rms": g.rms, "rms_squared_spread": g.spread,
            })
        })
        .collect();
    let (verdict, decide) = match report.verdict {
        Verdict::Kept => ("kept", None),
        Verdict::Broken => ("broken", None),
        Verdict::Inconclusive(points) => ("inconclusive", points),
    };
    json!({
        "verdict": verdict,
        "promised": report.promised,
        "measured": report.measured,
        "interval_95": report.interval,
        "at_least": report.at_least,
        "bias": report.bias[0],
        "bias_spread": report.bias[1],
        "points": report.points,
        "points_wanted": report.wanted,
        "points_that_would_decide": decide,
        "paths_a_point": report.paths,
        "mean_irradiance": report.mean.0,
        "unit": scene.quantity.irradiance_unit(),
        "finished": solution.is_finished(),
        "estimated_error": solution.statistics().estimated_error,
        "surfaces": groups,
    })
}
