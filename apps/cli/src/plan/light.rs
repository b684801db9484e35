//! The plan of `ondelette light`.

use super::check_distinct;
use super::values::{self, CameraRequest};
use crate::args::{LightArgs, RelightArgs};
use crate::run::Refusal;
use ondelette_io::Panel;
use ondelette_io::write::{check_writable, elements_path};
use ondelette_radiosity::scene::Paint;
use ondelette_radiosity::settings::{LinkSettingsError, SettingsError};
use ondelette_radiosity::{Basis, Decomposition, DirectLight, Iteration, LinkSettings, Method, Oracle, Settings};
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

/// What an ending asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kind {
    /// `.onl`: the solution.
    Solution,
    /// `.csv`: links and elements.
    Tables,
    /// `.glb`: the lit model.
    Model,
    /// `.png`: the picture, tone mapped.
    Picture,
    /// `.exr`: the picture, linear.
    LinearPicture,
}

/// Known endings.
const ENDINGS: [(&str, Kind); 5] = [
    ("glb", Kind::Model),
    ("png", Kind::Picture),
    ("exr", Kind::LinearPicture),
    ("csv", Kind::Tables),
    ("onl", Kind::Solution),
];

/// One file to write.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Output {
    pub(crate) kind: Kind,
    pub(crate) path: PathBuf,
}

impl Output {
    fn new(path: &Path) -> Result<Self, Refusal> {
        let ending = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
        let kind = ENDINGS.iter().find(|(known, _)| ending.as_deref() == Some(known)).map(|(_, kind)| *kind);
        match kind {
            Some(kind) => Ok(Output { kind, path: path.to_path_buf() }),
            None if ending.as_deref() == Some("json") => {
                Err(Refusal::new(format!("-o {0}: a report is asked for with --report {0}", path.display())))
            }
            None => {
                let known: Vec<String> = ENDINGS.iter().map(|(ending, _)| format!(".{ending}")).collect();
                let known = known.join(", ");
                Err(Refusal::new(format!("-o {}: unknown ending; known endings: {known}", path.display())))
            }
        }
    }

    /// The files that it consists of.
    fn files(&self) -> Vec<PathBuf> {
        match self.kind {
            Kind::Tables => vec![self.path.clone(), elements_path(&self.path)],
            _ => vec![self.path.clone()],
        }
    }
}

/// Folder of the default outputs.
pub(crate) const DEFAULT_FOLDER: &str = "out";

/// What to write, once the scene's name is known.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Outputs {
    /// Files, the most valuable first.
    pub(crate) files: Vec<Output>,
    /// The report.
    pub(crate) report: Option<PathBuf>,
}

impl Outputs {
    /// Refuses what cannot be written, while nothing is lost yet.
    pub(crate) fn check(&self, scene: &Path) -> Result<(), Refusal> {
        let all: Vec<PathBuf> = self.files.iter().flat_map(Output::files).chain(self.report.clone()).collect();
        let all: Vec<&Path> = all.iter().map(PathBuf::as_path).collect();
        check_distinct(&[scene], &all)?;
        all.into_iter().try_for_each(|path| Ok(check_writable(path)?))
    }
}

/// A validated `ondelette light`.
#[derive(Clone, Debug)]
pub(crate) struct LightPlan {
    pub(crate) scene: PathBuf,
    pub(crate) two_sided: bool,
    pub(crate) panels: Vec<Panel>,
    pub(crate) settings: Settings,
    /// Whether the samples go into the solution file.
    pub(crate) keep: bool,
    /// Whether no ray is cast, whatever the error: relighting without refinement.
    pub(crate) stays: bool,
    /// Bytes that elements and samples may take.
    pub(crate) memory: Option<u64>,
    pub(crate) max_time: Option<Duration>,
    pub(crate) threads: Option<usize>,
    pub(crate) camera: Option<CameraRequest>,
    /// What the user named with -o; empty for the default.
    named: Vec<Output>,
    report: Option<PathBuf>,
}

/// The flag's value, judged by its type.
fn parsed<T: FromStr<Err: Display>>(flag: &str, value: &str) -> Result<T, Refusal> {
    value.parse().map_err(|e| Refusal::new(format!("{flag}: {e}")))
}

/// What the solver is told.
fn settings(args: &LightArgs) -> Result<Settings, Refusal> {
    let method: Method = parsed("--method", &args.method)?;
    let linked = [
        ("--solver", &args.solver),
        ("--oracle", &args.oracle),
        ("--weight", &args.weight),
        ("--decomposition", &args.decomposition),
        ("--subdivision", &args.subdivision),
    ];
    if let Some((flag, _)) = linked.iter().find(|(_, value)| value.is_some() && !method.has_links()) {
        return Err(Refusal::new(format!(
            "{flag}: the method {method} has no links; it is for --method classical, galerkin, hierarchical or wavelet"
        )));
    }
    let refining = [("--oracle", &args.oracle), ("--weight", &args.weight)];
    if let Some((flag, _)) = refining.iter().find(|(_, value)| value.is_some() && method.is_full()) {
        return Err(Refusal::new(format!("{flag}: {}", LinkSettingsError::NoOracle(method))));
    }
    if args.decomposition.is_some() && method.is_full() {
        return Err(Refusal::new(format!("--decomposition: {}", LinkSettingsError::NotDecomposed(method))));
    }
    let graded = args.basis.as_deref() == Some("auto");
    let basis = match &args.basis {
        Some(_) if graded => Basis::HIGHEST_AUTO,
        Some(name) => parsed("--basis", name)?,
        None if matches!(method, Method::Classical | Method::Hierarchical) => Basis::HAAR,
        None => Basis::M2,
    };
    let links = LinkSettings {
        iteration: args.solver.as_deref().map_or(Ok(Iteration::default()), |name| parsed("--solver", name))?,
        oracle: args.oracle.as_deref().map_or(Ok(Oracle::default()), |name| parsed("--oracle", name))?,
        weight: args.weight.as_deref().map(|name| parsed("--weight", name)).transpose()?,
        graded,
        decomposition: args
            .decomposition
            .as_deref()
            .map_or(Ok(Decomposition::default()), |name| parsed("--decomposition", name))?,
        subdivision: args.subdivision.as_deref().map(subdivision).transpose()?,
    };
    let settings = Settings { basis, method, error: values::percent(&args.error)?, direct: args.direct.into(), links };
    settings.validated().map_err(|e| {
        let flag = match &e {
            SettingsError::Error(_) => "--error",
            SettingsError::Gathered(_) => "--direct",
            SettingsError::Links(LinkSettingsError::NotGraded(_) | LinkSettingsError::Basis { .. }) => "--basis",
            SettingsError::Links(LinkSettingsError::NoVariation) => "--weight",
            SettingsError::Links(LinkSettingsError::Standard(..)) => "--decomposition",
            SettingsError::Links(_) => "--subdivision",
        };
        Refusal::new(format!("{flag}: {e}"))
    })
}

fn subdivision(text: &str) -> Result<u8, Refusal> {
    let most = LinkSettings::FINEST;
    let refusal = || Refusal::new(format!("--subdivision {text}: give a whole number from 0 to {most}"));
    text.parse().ok().filter(|n| *n <= most).ok_or_else(refusal)
}

impl LightPlan {
    /// Judges every flag, and whether named outputs can be written.
    pub(crate) fn new(args: &LightArgs) -> Result<Self, Refusal> {
        let settings = settings(args)?;
        let mut named = args.outputs.iter().map(|path| Output::new(path)).collect::<Result<Vec<_>, _>>()?;
        named.sort_by_key(|o| o.kind);
        let is_gltf =
            args.scene.extension().is_some_and(|e| e.eq_ignore_ascii_case("gltf") || e.eq_ignore_ascii_case("glb"));
        if args.two_sided && is_gltf {
            return Err(Refusal::new(format!(
                "--two-sided is for OBJ files: in {} each material says whether it is doubleSided; leave the flag out",
                args.scene.display()
            )));
        }
        let plan = LightPlan {
            scene: args.scene.clone(),
            two_sided: args.two_sided,
            panels: args.lights.iter().map(|text| values::panel(text)).collect::<Result<_, _>>()?,
            settings,
            keep: args.keep_links,
            stays: false,
            memory: args.memory.as_deref().map(values::memory).transpose()?,
            max_time: args.max_time.as_deref().map(values::duration).transpose()?,
            threads: args.threads.as_deref().map(values::threads).transpose()?,
            camera: args.camera.as_deref().map(values::camera).transpose()?,
            named,
            report: args.report.clone(),
        };
        plan.check_outputs()?;
        Ok(plan)
    }

    /// Refuses outputs that cannot be written, and samples or links to be kept nowhere.
    fn check_outputs(&self) -> Result<(), Refusal> {
        if self.keep && !self.named.iter().any(|o| o.kind == Kind::Solution) {
            return Err(Refusal::new("--keep-links: they are kept in a solution file; add -o NAME.onl"));
        }
        Outputs { files: self.named.clone(), report: self.report.clone() }.check(&self.scene)
    }

    /// Whether the files go to [`DEFAULT_FOLDER`].
    pub(crate) fn uses_default_folder(&self) -> bool {
        self.named.is_empty()
    }

    /// What to write for a scene of this name.
    pub(crate) fn outputs(&self, name: &str) -> Outputs {
        if !self.uses_default_folder() {
            return Outputs { files: self.named.clone(), report: self.report.clone() };
        }
        let name: String = name.chars().map(|c| if std::path::is_separator(c) || c == ':' { '_' } else { c }).collect();
        let file = |ending: &str| Path::new(DEFAULT_FOLDER).join(format!("{name}.{ending}"));
        let files =
            vec![Output { kind: Kind::Model, path: file("glb") }, Output { kind: Kind::Picture, path: file("png") }];
        Outputs { files, report: Some(self.report.clone().unwrap_or_else(|| file("json"))) }
    }

    /// Folders in which files will be under construction.
    pub(crate) fn folders(&self) -> Vec<PathBuf> {
        let named = self.named.iter().map(|o| &o.path).chain(&self.report);
        let mut folders: Vec<PathBuf> = named.filter_map(|p| p.parent()).map(Path::to_path_buf).collect();
        if self.uses_default_folder() {
            folders.push(DEFAULT_FOLDER.into());
        }
        folders.sort();
        folders.dedup();
        folders
    }
}

/// A validated `ondelette relight`.
#[derive(Clone, Debug)]
pub(crate) struct RelightPlan {
    /// What is common with lighting; its settings are those of the solution, once that is read.
    pub(crate) light: LightPlan,
    pub(crate) paints: Vec<Paint>,
    pub(crate) refine: bool,
    /// Another promise.
    pub(crate) error: Option<f64>,
    /// Another way to read direct light.
    pub(crate) direct: Option<DirectLight>,
}

impl RelightPlan {
    /// Judges every flag, and whether named outputs can be written.
    pub(crate) fn new(args: &RelightArgs) -> Result<Self, Refusal> {
        let mut named = args.outputs.iter().map(|path| Output::new(path)).collect::<Result<Vec<_>, _>>()?;
        named.sort_by_key(|o| o.kind);
        let emission = args
            .emission
            .iter()
            .map(|text| values::painted("--emission", text).map(|(material, value)| Paint::Emission(material, value)));
        let reflectance = args.reflectance.iter().map(|text| {
            values::painted("--reflectance", text).map(|(material, value)| Paint::Reflectance(material, value))
        });
        let paints = emission.chain(reflectance).collect::<Result<Vec<_>, _>>()?;
        let error = args.error.as_deref().map(values::percent).transpose()?;
        if paints.is_empty() && error.is_none() && args.direct.is_none() && !args.refine {
            return Err(Refusal::new(
                "nothing to change: give --emission MATERIAL=r,g,b, --reflectance MATERIAL=r,g,b, --direct gather, \
                 or --refine --error 0.5%",
            ));
        }
        let plan = LightPlan {
            scene: args.solution.clone(),
            two_sided: false,
            panels: Vec::new(),
            settings: Settings::default(),
            keep: args.keep_links,
            stays: !args.refine,
            memory: None,
            max_time: args.max_time.as_deref().map(values::duration).transpose()?,
            threads: args.threads.as_deref().map(values::threads).transpose()?,
            camera: args.camera.as_deref().map(values::camera).transpose()?,
            named,
            report: args.report.clone(),
        };
        plan.check_outputs()?;
        Ok(RelightPlan { light: plan, paints, refine: args.refine, error, direct: args.direct.map(Into::into) })
    }
}
