//! Plans of the commands on curves and surfaces.

use super::check_distinct;
use crate::args::shape::{DesignArgs, EditArgs, FitArgs, ShapeOutputs};
use crate::run::Refusal;
use ondelette_io::write::check_writable;
use ondelette_modeling::edit::Orientation;
use std::path::{Path, PathBuf};

/// Formats by ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    Json,
    Svg,
    Csv,
    Dat,
    Step,
    Iges,
    Png,
    Glb,
    Obj,
    Npy,
    Asc,
}

impl Format {
    /// The format that a file name promises.
    pub(crate) fn of(path: &Path) -> Option<Format> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match ending.as_str() {
            "json" => Format::Json,
            "svg" => Format::Svg,
            "csv" | "txt" | "xyz" => Format::Csv,
            "dat" => Format::Dat,
            "step" | "stp" => Format::Step,
            "igs" | "iges" => Format::Iges,
            "png" => Format::Png,
            "glb" => Format::Glb,
            "obj" => Format::Obj,
            "npy" => Format::Npy,
            "asc" => Format::Asc,
            _ => return None,
        })
    }
}

/// Formats that a curve is written in.
pub(crate) const OF_CURVES: [Format; 6] =
    [Format::Svg, Format::Json, Format::Csv, Format::Step, Format::Iges, Format::Png];
/// Formats that a surface is written in.
pub(crate) const OF_SURFACES: [Format; 8] =
    [Format::Glb, Format::Obj, Format::Json, Format::Npy, Format::Asc, Format::Step, Format::Iges, Format::Png];

/// What to write, checked.
#[derive(Clone, Debug)]
pub(crate) struct OutputPlan {
    pub(crate) files: Vec<(PathBuf, Format)>,
    /// Largest distance of meshes; `None`: by the size of the shape.
    pub(crate) flatness: Option<f64>,
    pub(crate) comb: bool,
    pub(crate) zebra: bool,
}

impl OutputPlan {
    pub(crate) fn new(args: &ShapeOutputs, inputs: &[&Path], report: Option<&Path>) -> Result<OutputPlan, Refusal> {
        let mut files = Vec::new();
        for path in &args.outputs {
            let format = Format::of(path).filter(|f| OF_CURVES.contains(f) || OF_SURFACES.contains(f));
            let format = format.ok_or_else(|| {
                let name = path.display();
                format!(
                    "{name}: unknown ending; curves: .svg .json .csv .step .igs .png, surfaces: .glb .obj .json \
                     .npy .asc .step .igs .png"
                )
            })?;
            files.push((path.clone(), format));
        }
        if files.is_empty() && report.is_none() {
            return Err(Refusal::new("nothing to write: name a file with -o, such as -o out.png"));
        }
        let outputs: Vec<&Path> = files.iter().map(|f| f.0.as_path()).chain(report).collect();
        check_distinct(inputs, &outputs)?;
        for path in outputs {
            check_writable(path)?;
        }
        let flatness = args.flatness.as_deref().map(|t| match t.parse::<f64>() {
            Ok(x) if x > 0.0 && x.is_finite() => Ok(x),
            _ => Err(format!("--flatness {t}: give a positive distance")),
        });
        Ok(OutputPlan { files, flatness: flatness.transpose()?, comb: args.comb, zebra: args.zebra })
    }

    /// Refuses files that this kind of shape cannot be written as.
    pub(crate) fn check_kind(&self, curve: bool) -> Result<(), Refusal> {
        let (known, kind) = if curve { (&OF_CURVES[..], "curve") } else { (&OF_SURFACES[..], "surface") };
        match self.files.iter().find(|f| !known.contains(&f.1)) {
            None => Ok(()),
            Some((path, _)) => Err(Refusal::new(format!("{}: a {kind} is not written as that", path.display()))),
        }
    }
}

/// A move: index, displacement with as many numbers as were given.
pub(crate) type Move = ([usize; 2], Vec<f64>, bool);

/// `ondelette edit`, checked.
#[derive(Clone, Debug)]
pub(crate) struct EditPlan {
    pub(crate) shape: PathBuf,
    pub(crate) level: Option<f64>,
    /// Index, displacement, and whether the index has two numbers.
    pub(crate) moves: Vec<Move>,
    pub(crate) pulls: Vec<(Vec<f64>, Vec<Option<f64>>)>,
    pub(crate) detail: Orientation,
    pub(crate) see: Option<f64>,
    pub(crate) part: Option<usize>,
    pub(crate) out: OutputPlan,
}

fn numbers(flag: &str, text: &str) -> Result<Vec<f64>, String> {
    let number = |t: &str| match t.trim().parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        _ => Err(format!("{flag} {text}: {:?} is no finite number", t.trim())),
    };
    text.split(',').map(number).collect()
}

fn level(flag: &str, text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x >= 0.0 && x.is_finite() => Ok(x),
        _ => Err(format!("{flag} {text}: a level is a number from 0 on")),
    }
}

impl EditPlan {
    pub(crate) fn new(args: &EditArgs) -> Result<EditPlan, Refusal> {
        let mut moves = Vec::new();
        for pair in args.moves.chunks(2) {
            let [index, by] = pair else { continue };
            let wrong = || format!("--move {index}: an index is i (curves) or i,j (surfaces), counted from 0");
            let parts = index.split(',').map(|t| t.trim().parse::<usize>()).collect::<Result<Vec<_>, _>>();
            let index = match *parts.map_err(|_| wrong())?.as_slice() {
                [i] => ([i, 0], false),
                [i, j] => ([i, j], true),
                _ => return Err(wrong().into()),
            };
            moves.push((index.0, numbers("--move", by)?, index.1));
        }
        let mut pulls = Vec::new();
        for pair in args.pulls.chunks(2) {
            let [at, to] = pair else { continue };
            let target = |t: &str| match t.trim() {
                "-" => Ok(None),
                t => numbers("--pull", t).map(|n| Some(n[0])),
            };
            pulls.push((numbers("--pull", at)?, to.split(',').map(target).collect::<Result<_, String>>()?));
        }
        let detail = match args.detail.as_str() {
            "fixed" => Orientation::Fixed,
            "turning" => Orientation::Turning,
            "frames" => Orientation::Frenet,
            other => return Err(format!("--detail {other}: fixed, turning or frames").into()),
        };
        let part =
            args.part.as_deref().map(|t| t.parse::<usize>().map_err(|_| format!("--part {t}: a number from 0 on")));
        Ok(EditPlan {
            shape: args.shape.clone(),
            level: args.level.as_deref().map(|t| level("--level", t)).transpose()?,
            moves,
            pulls,
            detail,
            see: args.see.as_deref().map(|t| level("--see", t)).transpose()?,
            part: part.transpose()?,
            out: OutputPlan::new(&args.out, &[&args.shape], None)?,
        })
    }
}

/// `ondelette curve` and `ondelette surface`, checked.
#[derive(Clone, Debug)]
pub(crate) struct DesignPlan {
    pub(crate) spec: PathBuf,
    /// 1: curve, 2: surface.
    pub(crate) axes: usize,
    pub(crate) solver: Option<String>,
    pub(crate) report: Option<PathBuf>,
    pub(crate) out: OutputPlan,
}

impl DesignPlan {
    pub(crate) fn new(args: &DesignArgs, axes: usize) -> Result<DesignPlan, Refusal> {
        let out = OutputPlan::new(&args.out, &[&args.spec], args.report.as_deref())?;
        out.check_kind(axes == 1)?;
        Ok(DesignPlan { spec: args.spec.clone(), axes, solver: args.solver.clone(), report: args.report.clone(), out })
    }

    /// Folders in which files are made.
    pub(crate) fn folders(&self) -> Vec<PathBuf> {
        let paths = self.out.files.iter().map(|f| &f.0).chain(&self.report);
        paths.filter_map(|p| p.parent()).map(Path::to_path_buf).collect()
    }
}

/// `ondelette fit`, checked.
#[derive(Clone, Debug)]
pub(crate) struct FitPlan {
    pub(crate) data: PathBuf,
    pub(crate) weight: Option<f64>,
    pub(crate) stiffening: Option<f64>,
    pub(crate) spans: Option<usize>,
    pub(crate) fair: bool,
    pub(crate) tolerance: Option<f64>,
    pub(crate) report: Option<PathBuf>,
    pub(crate) out: OutputPlan,
}

impl FitPlan {
    pub(crate) fn new(args: &FitArgs) -> Result<FitPlan, Refusal> {
        let positive = |flag: &str, text: Option<&str>, zero: bool| {
            let judge = |t: &str| match t.parse::<f64>() {
                Ok(x) if x.is_finite() && (x > 0.0 || (zero && x == 0.0)) => Ok(x),
                _ => Err(format!("{flag} {t}: a positive number is needed")),
            };
            text.map(judge).transpose()
        };
        let spans =
            args.spans.as_deref().map(|t| t.parse().map_err(|_| format!("--spans {t}: a whole number is needed")));
        if args.tolerance.is_some() && !args.fair {
            return Err(Refusal::new("--tolerance goes with --fair"));
        }
        Ok(FitPlan {
            data: args.data.clone(),
            weight: positive("--weight", args.weight.as_deref(), false)?,
            stiffening: positive("--stiffening", args.stiffening.as_deref(), true)?,
            spans: spans.transpose()?,
            fair: args.fair,
            tolerance: positive("--tolerance", args.tolerance.as_deref(), false)?,
            report: args.report.clone(),
            out: OutputPlan::new(&args.out, &[&args.data], args.report.as_deref())?,
        })
    }
}
