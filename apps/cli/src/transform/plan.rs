//! From flags, the sidecar and the shape of the input to a transform.

use std::path::{Path, PathBuf};

use ondelette_wavelet::{Boundary, Family, Kind, Layout, Pyramid, Scaling, Tensor, levels_allowed};
use serde_json::{Value, json};

use super::TransformArgs;
use super::picture::is_picture;
use ondelette_io::npy::Grid;

/// Version of the sidecar.
const VERSION: u64 = 1;

/// What will be done.
pub(crate) struct Plan {
    pub(crate) tensor: Tensor,
    pub(crate) kind: Kind,
    /// Channels of the last axis, 1 without.
    pub(crate) channels: usize,
    pub(crate) samples: bool,
    shape: Vec<usize>,
    flags: Flags,
}

/// The resolved flags, as text.
struct Flags {
    family: String,
    boundary: String,
    layout: String,
    kind: String,
    scaling: String,
    channels: String,
    from: String,
    keep: Option<usize>,
    threshold: Option<f64>,
}

/// `PATH.json`.
pub(crate) fn sidecar_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_os_string();
    name.push(".json");
    PathBuf::from(name)
}

/// Reads the sidecar beside an input, if there is one.
pub(crate) fn read_sidecar(input: &Path) -> Result<Option<Value>, String> {
    let path = sidecar_path(input);
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(format!("{}: {e}", path.display())),
    };
    let value: Value = serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))?;
    match value["version"].as_u64() {
        Some(VERSION) => Ok(Some(value)),
        v => Err(format!("{}: version {v:?} is not {VERSION}; give the flags and remove it", path.display())),
    }
}

fn choice(flag: &str, value: &str, known: &[&str]) -> Result<(), String> {
    if known.contains(&value) { Ok(()) } else { Err(format!("--{flag} {value:?}: choose {}", known.join(", "))) }
}

impl Flags {
    fn new(args: &TransformArgs, sidecar: Option<&Value>) -> Result<Flags, String> {
        let pick = |name: &str, flag: &Option<String>, default: &str| {
            let stored = || sidecar.and_then(|s| s[name].as_str()).map(str::to_owned);
            flag.clone().or_else(stored).unwrap_or_else(|| default.to_owned())
        };
        let family = pick("family", &args.family, "bspline");
        let parsed: Family = family.parse().map_err(|e| format!("--family: {e}"))?;
        let picture = is_picture(&args.input) || (args.inverse && is_picture(&args.output));
        let out = Flags {
            boundary: pick("boundary", &args.boundary, &parsed.default_boundary().to_string()),
            family,
            layout: pick("layout", &args.layout, "standard"),
            kind: pick("kind", &args.kind, "coef"),
            scaling: pick("scaling", &args.scaling, "1"),
            channels: pick("channels", &args.channels, if picture { "last" } else { "none" }),
            from: pick("from", &args.from, "coefficients"),
            keep: args.keep,
            threshold: args.threshold,
        };
        choice("layout", &out.layout, &["standard", "nonstandard"])?;
        choice("kind", &out.kind, &["coef", "basis"])?;
        choice("scaling", &out.scaling, &["1", "l2", "2", "1.414", "2.828"])?;
        choice("channels", &out.channels, &["none", "last"])?;
        choice("from", &out.from, &["coefficients", "samples"])?;
        if out.kind == "basis" && out.from == "samples" {
            return Err("--kind basis takes dual coefficients: --from samples goes with --kind coef".to_owned());
        }
        if out.kind == "basis" && (out.keep.is_some() || out.threshold.is_some()) {
            return Err("--keep and --threshold rank coefficients of functions: they go with --kind coef".to_owned());
        }
        Ok(out)
    }

    fn sigma(&self) -> Scaling {
        match self.scaling.as_str() {
            "l2" => Scaling::L2,
            "2" => Scaling::Anti,
            "1.414" => Scaling::Energy { derivative: 2, dimension: 2 },
            "2.828" => Scaling::Energy { derivative: 2, dimension: 1 },
            _ => Scaling::Unnormalized,
        }
    }
}

impl Plan {
    pub(crate) fn new(args: &TransformArgs, sidecar: Option<&Value>, input: &Grid) -> Result<Plan, String> {
        let flags = Flags::new(args, sidecar)?;
        let family: Family = flags.family.parse().map_err(|e| format!("--family: {e}"))?;
        let boundary: Boundary = flags.boundary.parse().map_err(|e| format!("--boundary: {e}"))?;
        family.check(boundary).map_err(|e| e.to_string())?;
        let (axes, channels) = match input.shape.split_last() {
            Some((&channels, axes)) if flags.channels == "last" => (axes.to_vec(), channels),
            _ => (input.shape.clone(), 1),
        };
        if !(1..=3).contains(&axes.len()) {
            return Err(format!(
                "shape {:?} has {} axes to transform; 1 to 3 are possible (--channels last leaves the last one out)",
                input.shape,
                axes.len()
            ));
        }
        let allowed = axes
            .iter()
            .enumerate()
            .map(|(i, &n)| levels_allowed(family, boundary, n).map_err(|e| format!("axis {i}: {e}")))
            .collect::<Result<Vec<_>, _>>()?;
        let layout = if flags.layout == "standard" { Layout::Standard } else { Layout::NonStandard };
        let stored = sidecar.and_then(|s| s["levels"].as_array());
        let levels: Vec<usize> = match (args.levels, stored) {
            (Some(n), _) => vec![n; axes.len()],
            (None, Some(stored)) => stored.iter().filter_map(|v| v.as_u64().map(|n| n as usize)).collect(),
            (None, None) if layout == Layout::Standard => allowed.clone(),
            (None, None) => vec![allowed.iter().copied().min().unwrap_or(0); axes.len()],
        };
        if levels.len() != axes.len() {
            return Err(format!("the sidecar has levels for {} axes, the input has {}", levels.len(), axes.len()));
        }
        let pyramid = |(i, (&n, &l)): (usize, (&usize, &usize))| {
            let p = Pyramid::new(family, boundary, n, l).map_err(|e| format!("axis {i}: {e}"))?;
            Ok(p.with_scaling(flags.sigma()))
        };
        let pyramids = axes.iter().zip(&levels).enumerate().map(pyramid).collect::<Result<Vec<_>, String>>()?;
        let tensor = Tensor::new(pyramids, layout).map_err(|e| e.to_string())?;
        let kind = if flags.kind == "coef" { Kind::Coefficients } else { Kind::Basis };
        let samples = flags.from == "samples";
        Ok(Plan { tensor, kind, channels, samples, shape: input.shape.clone(), flags })
    }

    /// The index of a flat position of the input.
    pub(crate) fn index(&self, mut at: usize) -> Vec<usize> {
        let mut index = vec![0; self.shape.len()];
        for (i, &n) in index.iter_mut().zip(&self.shape).rev() {
            *i = at % n;
            at /= n;
        }
        index
    }

    /// The sidecar as text.
    pub(crate) fn sidecar(&self, output: &Grid, kept: Option<usize>) -> String {
        let axes = self.tensor.axes();
        let blocks: Vec<Value> = axes
            .iter()
            .map(|a| {
                let detail: Vec<usize> = (0..a.levels()).map(|i| a.detail_range(i).len()).collect();
                json!({ "smooth": a.smooth_len(0), "detail": detail })
            })
            .collect();
        let f = &self.flags;
        let value = json!({
            "format": "ondelette transform",
            "version": VERSION,
            "program": concat!("ondelette ", env!("CARGO_PKG_VERSION")),
            "family": f.family,
            "boundary": f.boundary,
            "levels": axes.iter().map(Pyramid::levels).collect::<Vec<_>>(),
            "layout": f.layout,
            "kind": f.kind,
            "scaling": f.scaling,
            "channels": f.channels,
            "from": f.from,
            "keep": f.keep,
            "threshold": f.threshold,
            "kept": kept,
            "dtype": output.values.name(),
            "shape": output.shape,
            "spans": axes.iter().map(Pyramid::spans).collect::<Vec<_>>(),
            "blocks": blocks,
        });
        format!("{value:#}\n")
    }
}
