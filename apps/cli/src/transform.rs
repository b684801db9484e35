//! `ondelette transform`: wavelet transforms of arrays and pictures.

mod picture;
mod plan;

use std::path::{Path, PathBuf};

use ondelette_io::npy::{self, Grid, Values};
use ondelette_io::write::write_bytes;
use ondelette_wavelet::{Coefficient, Decomposition, Kind, Sampling, Scalar};
use plan::Plan;

/// Transform an array (.npy of f32 or f64, 1 to 3 dimensions) or a picture (.png, .exr) to wavelets and back.
///
/// The output has the input's shape and type. OUT.npy.json states the flags, spans and block sizes; --inverse reads it.
#[derive(clap::Args, Debug, Default)]
pub(crate) struct TransformArgs {
    /// Input: .npy, .png or .exr.
    #[arg(value_name = "IN")]
    pub(crate) input: PathBuf,
    /// Output: .npy, .exr, with --inverse also .png.
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: PathBuf,
    /// bspline (cubic), bspline22, bspline33, bspline46, bspline612, haar, d4 d6 .. d20, cdf53, cdf97, m1..m6, f1..f4
    /// [default: bspline]
    #[arg(long)]
    pub(crate) family: Option<String>,
    /// mirror, open or periodic [default: mirror where it exists, else periodic]
    #[arg(long)]
    pub(crate) boundary: Option<String>,
    /// Number of levels [default: the deepest allowed]
    #[arg(long, value_name = "N")]
    pub(crate) levels: Option<usize>,
    /// standard: each axis b | w_coarsest | ... | w_finest; nonstandard: in place, leading corner smooth
    /// [default: standard]
    #[arg(long)]
    pub(crate) layout: Option<String>,
    /// coef (coefficients) or basis (basis functions, dual coefficients) [default: coef]
    #[arg(long)]
    pub(crate) kind: Option<String>,
    /// Height of functions per coarser level: 1, l2 (1/sqrt2), 2, 1.414 (sqrt2), 2.828 (2 sqrt2) [default: 1]
    #[arg(long)]
    pub(crate) scaling: Option<String>,
    /// none, or last: the last axis holds channels [default: none; pictures: last]
    #[arg(long)]
    pub(crate) channels: Option<String>,
    /// coefficients, or samples: interpolate first [default: coefficients]
    #[arg(long)]
    pub(crate) from: Option<String>,
    /// Keep the M detail coefficients (of each channel) with the largest magnitude times norm of their function
    #[arg(long, value_name = "M", conflicts_with = "threshold")]
    pub(crate) keep: Option<usize>,
    /// Drop detail coefficients below T in magnitude
    #[arg(long, value_name = "T")]
    pub(crate) threshold: Option<f64>,
    /// From wavelets back
    #[arg(long)]
    pub(crate) inverse: bool,
}

/// Runs the command.
///
/// # Errors
/// A message that names the file, what is wrong, and what to do; nothing has been written then. The exit code is 2.
pub(crate) fn run(args: &TransformArgs) -> Result<(), String> {
    let input = read(&args.input)?;
    check_output(args)?;
    let sidecar = if args.inverse { plan::read_sidecar(&args.input)? } else { None };
    let plan = Plan::new(args, sidecar.as_ref(), &input).map_err(|e| format!("{}: {e}", args.input.display()))?;
    let mut kept = None;
    let named = |e: String| format!("{}: {e}", args.input.display());
    let values = match &input.values {
        Values::F32(x) => Values::F32(transform(&plan, args, x, &mut kept).map_err(named)?),
        Values::F64(x) => Values::F64(transform(&plan, args, x, &mut kept).map_err(named)?),
    };
    let output = Grid { shape: input.shape, values };
    if picture::is_picture(&args.output) {
        picture::write(&args.output, &output)?;
    } else {
        write_bytes(&args.output, &npy::write(&output)).map_err(|e| e.to_string())?;
    }
    if !args.inverse {
        let text = plan.sidecar(&output, kept);
        write_bytes(&plan::sidecar_path(&args.output), text.as_bytes()).map_err(|e| e.to_string())?;
    }
    Ok(())
}

fn read(path: &Path) -> Result<Grid, String> {
    let named = |e: String| format!("{}: {e}", path.display());
    let grid = if picture::is_picture(path) {
        picture::read(path).map_err(named)?
    } else {
        npy::parse(&std::fs::read(path).map_err(|e| named(e.to_string()))?).map_err(named)?
    };
    if grid.shape.iter().product::<usize>() == 0 || grid.shape.is_empty() {
        return Err(named(format!("shape {:?} is empty: there is nothing to transform", grid.shape)));
    }
    Ok(grid)
}

fn check_output(args: &TransformArgs) -> Result<(), String> {
    let out = &args.output;
    let ending = picture::ending(out);
    match ending.as_str() {
        "npy" | "exr" => {}
        "png" if args.inverse => {}
        "png" => {
            return Err(format!(
                "{}: wavelet coefficients have signs, a .png has none: write .npy or .exr",
                out.display()
            ));
        }
        _ => return Err(format!("{}: unknown ending {ending:?}; write .npy, .exr or (--inverse) .png", out.display())),
    }
    if args.inverse && (args.keep.is_some() || args.threshold.is_some()) {
        return Err("--keep and --threshold choose wavelets: they do not go with --inverse".to_owned());
    }
    if args.threshold.is_some_and(|t| !t.is_finite() || t < 0.0) {
        return Err("--threshold needs a number that is not negative".to_owned());
    }
    Ok(())
}

/// Transforms each channel; `kept` receives the number of details that are not zero.
fn transform<S: Coefficient<Scalar = S> + Scalar>(
    plan: &Plan,
    args: &TransformArgs,
    x: &[S],
    kept: &mut Option<usize>,
) -> Result<Vec<S>, String> {
    if let Some(at) = x.iter().position(|v| !v.to_f64().is_finite()) {
        let index = plan.index(at);
        return Err(format!("value {index:?} is {}: a transform needs finite numbers", x[at].to_f64()));
    }
    let channels = plan.channels;
    let mut out = vec![S::default(); x.len()];
    let sampling: Vec<Sampling> = if plan.samples {
        let axes = plan.tensor.axes().iter().map(Sampling::new);
        axes.collect::<Result<_, _>>().map_err(|e| e.to_string())?
    } else {
        Vec::new()
    };
    for c in 0..channels {
        let mut plane: Vec<S> = x.iter().skip(c).step_by(channels).copied().collect();
        let done = if args.inverse {
            let mut done =
                plan.tensor.down(plan.kind, &Decomposition::new(&plan.tensor, plane)).map_err(|e| e.to_string())?;
            along_axes(plan, &sampling, &mut done, Sampling::to_samples);
            done
        } else {
            along_axes(plan, &sampling, &mut plane, Sampling::to_coefficients);
            let mut wavelets = plan.tensor.up(plan.kind, &plane).map_err(|e| e.to_string())?;
            if let Some(t) = args.threshold {
                *kept = Some(kept.unwrap_or(0) + wavelets.threshold(t));
            }
            if let Some(m) = args.keep {
                wavelets.keep_largest(m);
                let details = wavelets.blocks().into_iter().filter(|b| !b.is_smooth());
                let count = details.flat_map(|b| wavelets.block(&b)).filter(|v| v.to_f64() != 0.0).count();
                *kept = Some(kept.unwrap_or(0) + count);
            }
            wavelets.into_values()
        };
        for (to, from) in out.iter_mut().skip(c).step_by(channels).zip(done) {
            *to = from;
        }
    }
    debug_assert!(plan.kind == Kind::Coefficients || sampling.is_empty());
    Ok(out)
}

/// Runs a prefilter along every axis.
fn along_axes<S: Scalar>(plan: &Plan, sampling: &[Sampling], data: &mut [S], f: impl Fn(&Sampling, &mut [S], usize)) {
    let mut inner = data.len();
    for (axis, s) in plan.tensor.axes().iter().zip(sampling) {
        inner /= axis.len();
        f(s, data, inner);
    }
}
