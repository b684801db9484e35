//! What the user typed, not yet judged.

pub(crate) mod shape;

use clap::{Parser, Subcommand};
use std::path::PathBuf;

#[derive(Debug, Parser)]
#[command(
    name = "ondelette",
    version,
    about = "Lights rooms: the interreflection of light between matt surfaces, in wavelets, to an accuracy in per cent",
    after_help = "Examples:
  ondelette light                                  the built-in Cornell box, into out/
  ondelette info room.glb                          what is in a scene
  ondelette light room.glb --error 1%              out/room.png, out/room.glb, out/room.json
  ondelette probe room.onl points.csv -o out.csv   irradiance and radiosity at points
  ondelette verify room.onl                        an independent check of the promised error
  ondelette curve arch.json -o arch.svg            the smoothest curve under constraints
  ondelette edit logo.svg --level 2 --move 3 1,0 -o logo2.svg

Exit codes: 0 done; 1 a valid result that is unfinished or misses its tolerance; 2 bad input or usage."
)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// How direct light is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum DirectLight {
    /// As solved.
    Fitted,
    /// Exactly, at the point.
    Gather,
}

impl From<DirectLight> for ondelette_radiosity::DirectLight {
    fn from(named: DirectLight) -> Self {
        match named {
            DirectLight::Fitted => Self::Fitted,
            DirectLight::Gather => Self::Gathered,
        }
    }
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Light a scene
    Light(LightArgs),
    /// Light a solved scene anew: other emissions, other reflectances, a finer error
    Relight(RelightArgs),
    /// Irradiance and radiosity at points of a solved scene
    Probe(ProbeArgs),
    /// Check a solution's promised error by independent random paths
    Verify(crate::run::verify::VerifyArgs),
    /// What is in a scene file
    Info(InfoArgs),
    /// Transform arrays and pictures into a wavelet basis and back
    Transform(crate::transform::TransformArgs),
    /// The smoothest curve under constraints
    Curve(shape::CurveArgs),
    /// The smoothest surface under constraints
    Surface(shape::SurfaceArgs),
    /// Smoothing splines through measured points, height fields, outlines
    Fit(shape::FitArgs),
    /// Move control points of any level of a curve or surface
    Edit(shape::EditArgs),
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  ondelette light
  ondelette light room.glb -o room.png -o room.glb -o room.onl --report room.json
  ondelette light room.obj --two-sided --basis m3 --error 0.5% --max-time 2m
  ondelette light room.glb -o view.exr --camera eye=1,1.6,5:at=1,1,0:fov=50
  ondelette light room.glb --error 3% --direct gather -o baked.glb -o room.png
  ondelette light room.obj --method wavelet --basis m3 --solver gauss-seidel
  ondelette light room.obj --method classical --error 10% --solver shooting
  ondelette light room.obj --method galerkin --basis m2 --subdivision 3
  ondelette light room.obj --method hierarchical --error 5% --oracle magnitude
  ondelette light room.obj --method wavelet --basis m3 --decomposition standard --error 5%
  ondelette light room.obj --method wavelet --basis auto --oracle fit --weight variation

Ctrl-C stops the solver; what was asked for is written from the state reached, and the exit code is 1. A second \
Ctrl-C ends the program at once.")]
pub(crate) struct LightArgs {
    /// Scene: a file ending in .obj, .gltf or .glb, or builtin:cornell
    #[arg(default_value = "builtin:cornell", value_name = "SCENE")]
    pub(crate) scene: PathBuf,

    /// What to write; may be repeated. The ending says what: .glb lit model, .png or .exr picture, .csv links (and
    /// NAME.elements.csv elements), .onl solution [default: out/NAME.png, out/NAME.glb and the report out/NAME.json]
    #[arg(short = 'o', long = "output", value_name = "PATH")]
    pub(crate) outputs: Vec<PathBuf>,

    /// Functions that light is represented in: haar, m1 to m6 (multiwavelets), f1 to f4 (flatlets); with --method
    /// wavelet also auto (an order for each link, m1 to m4, by what it promises for the work) [default: m2; haar for
    /// the methods classical and hierarchical, which have no other]
    #[arg(long, value_name = "NAME", allow_hyphen_values = true)]
    pub(crate) basis: Option<String>,

    /// How light is transported: sampled (direct light exact, reflected light by sampled rows of the transport
    /// operator; scenes of any size), or by links between pairs of elements (a few thousand surfaces): classical (equal
    /// constant elements, full matrix), galerkin (equal elements of a higher order, full matrix), hierarchical (links
    /// between constant elements of all sizes), wavelet (the same in any basis)
    #[arg(long, default_value = "sampled", value_name = "NAME", allow_hyphen_values = true)]
    pub(crate) method: String,

    /// Methods with links: how the linear system is solved: gmres (fewest sweeps), jacobi, gauss-seidel, southwell
    /// (shoots from the brightest element), shooting (progressive radiosity: from the brightest surface). All converge
    /// to the same light [default: gmres]
    #[arg(long, value_name = "NAME", allow_hyphen_values = true)]
    pub(crate) solver: Option<String>,

    /// Hierarchical and wavelet: what decides which links are refined: error (what refining takes off the estimated
    /// error), fit (how far a polynomial misses the kernel), magnitude (the form factor) [default: error]
    #[arg(long, value_name = "NAME", allow_hyphen_values = true)]
    pub(crate) oracle: Option<String>,

    /// Hierarchical and wavelet: what the oracle's test is weighted with: brightness (of the shooter), variation (of
    /// the shooter's radiosity beyond its basis), none [default: variation for the oracle error, brightness for the
    /// others]
    #[arg(long, value_name = "NAME", allow_hyphen_values = true)]
    pub(crate) weight: Option<String>,

    /// Hierarchical and wavelet: nonstandard (links between elements of any size) or standard (the full matrix of equal
    /// elements, transformed on both axes, small terms dropped; the report counts what either keeps) [default:
    /// nonstandard]
    #[arg(long, value_name = "NAME", allow_hyphen_values = true)]
    pub(crate) decomposition: Option<String>,

    /// Classical, galerkin and the standard decomposition: divide the longest edge of the scene into 2^N parts, shorter
    /// edges into parts no longer than these [default: halved until the error is small enough]
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub(crate) subdivision: Option<String>,

    /// Mean absolute error of the irradiance that is allowed, in per cent of its mean: 1%, 0.5, 3%
    #[arg(long, default_value = "1%", value_name = "PERCENT", allow_hyphen_values = true)]
    pub(crate) error: String,

    /// Stop solving after this time: 10s, 2m, 500ms. The state reached is written, and the exit code is 1
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    pub(crate) max_time: Option<String>,

    /// How direct light is read from the solution: fitted (elements are as small as shadows need), or gathered from
    /// the lamps, with exact visibility, at every pixel, vertex and point in a penumbra. The promise is for what is
    /// read so: gathered, far fewer elements do, and what reads the solution takes longer; models get as many vertices
    /// as the shadows need
    #[arg(long, value_name = "HOW", default_value = "fitted")]
    pub(crate) direct: DirectLight,

    /// Keep in the .onl file what `ondelette relight` goes on from: the samples of the transport operator (links are
    /// always kept)
    #[arg(long)]
    pub(crate) keep_links: bool,

    /// Most memory for elements, samples and links: 512MB, 2GB. Samples that do not fit are drawn again, and rows of a
    /// full matrix coupled again, whenever they are read; links that adapt stop there, with an unfinished solution (the
    /// scene and its ray structure come on top; see the report)
    #[arg(long, value_name = "SIZE", allow_hyphen_values = true)]
    pub(crate) memory: Option<String>,

    /// Number of threads; the result does not depend on it [default: one a processor]
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub(crate) threads: Option<String>,

    /// Add a lamp: a rectangular panel, in the coordinates of the scene; may be repeated.
    /// at=x,y,z:size=w,d:radiance=r,g,b:facing=x,y,z (one number for grey; facing: 0,-1,0 unless given, down where y is
    /// up)
    #[arg(long = "light", value_name = "PANEL", allow_hyphen_values = true)]
    pub(crate) lights: Vec<String>,

    /// Let both sides of every surface of an OBJ file reflect and emit (glTF files say so a material: doubleSided)
    #[arg(long)]
    pub(crate) two_sided: bool,

    /// Where pictures are taken from, in the coordinates of the scene: eye=x,y,z:at=x,y,z:fov=40 (fov: vertical, in
    /// degrees) [default: the file's camera, else one that frames the scene from inside]
    #[arg(long, value_name = "CAMERA", allow_hyphen_values = true)]
    pub(crate) camera: Option<String>,

    /// Write the report here: seconds per stage, elements, links, rays, iterations, error, energy ledger, memory,
    /// settings
    #[arg(long, value_name = "PATH")]
    pub(crate) report: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  ondelette light room.glb --keep-links -o room.onl
  ondelette relight room.onl --emission lamp=0,0,0 -o evening.png
  ondelette relight room.onl --reflectance wall=0.8,0.75,0.7 --refine --error 1% -o repainted.onl -o repainted.glb

Without --refine no ray is cast: the new error is stated, and the exit code is 1 if it is above the promise.")]
pub(crate) struct RelightArgs {
    /// Solution file of `ondelette light --keep-links -o NAME.onl`, or of a method with links
    #[arg(value_name = "SOLUTION.onl")]
    pub(crate) solution: PathBuf,

    /// Another emitted radiance for a material: MATERIAL=r,g,b or MATERIAL=grey; may be repeated
    #[arg(long, value_name = "MATERIAL=RGB")]
    pub(crate) emission: Vec<String>,

    /// Another diffuse reflectance for a material, from 0 to below 1; may be repeated
    #[arg(long, value_name = "MATERIAL=RGB")]
    pub(crate) reflectance: Vec<String>,

    /// Spend the rays that are missing to the promised error
    #[arg(long)]
    pub(crate) refine: bool,

    /// Promise another error than the solution did: 1%, 0.5
    #[arg(long, value_name = "PERCENT", allow_hyphen_values = true)]
    pub(crate) error: Option<String>,

    /// What to write; may be repeated: .glb .png .exr .csv .onl as for `ondelette light`
    #[arg(short = 'o', long = "output", value_name = "PATH", required = true)]
    pub(crate) outputs: Vec<PathBuf>,

    /// How direct light is read: fitted or gather, as for `ondelette light` [default: as before]
    #[arg(long, value_name = "HOW")]
    pub(crate) direct: Option<DirectLight>,

    /// Keep the samples in the .onl file that is written
    #[arg(long)]
    pub(crate) keep_links: bool,

    /// Stop refining after this time: 10s, 2m, 500ms
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    pub(crate) max_time: Option<String>,

    /// Number of threads; the result does not depend on it [default: one a processor]
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub(crate) threads: Option<String>,

    /// Where pictures are taken from: eye=x,y,z:at=x,y,z:fov=40
    #[arg(long, value_name = "CAMERA", allow_hyphen_values = true)]
    pub(crate) camera: Option<String>,

    /// Write the report here
    #[arg(long, value_name = "PATH")]
    pub(crate) report: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  ondelette light room.glb -o room.onl
  ondelette probe room.onl points.csv -o values.csv
  ondelette probe room.onl points.csv --gather > values.csv

The points are read from the solved surface under them, whose front faces the normal; a point farther from every \
such surface than 1e-5 of the scene's diagonal fails the run. Where surfaces meet, the one of lower number answers.")]
pub(crate) struct ProbeArgs {
    /// Solution file of `ondelette light -o NAME.onl`
    #[arg(value_name = "SOLUTION.onl")]
    pub(crate) solution: PathBuf,

    /// Points: x,y,z,nx,ny,nz a line, in the coordinates of the scene; a header line is optional
    #[arg(value_name = "POINTS.csv")]
    pub(crate) points: PathBuf,

    /// Table to write, a row a point in order [default: standard output]
    #[arg(short = 'o', long = "output", value_name = "OUT.csv")]
    pub(crate) output: Option<PathBuf>,

    /// Direct light: fitted, or gathered at every point in a penumbra, with exact visibility (needs a solution of
    /// `light --direct gather` or `--keep-links`) [default: as the solution was solved]
    #[arg(long, value_name = "HOW")]
    pub(crate) direct: Option<DirectLight>,

    /// Irradiance at free points and normals, gathered from the solved scene; the radiosity columns stay empty
    #[arg(long)]
    pub(crate) gather: bool,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  ondelette info room.glb
  ondelette info builtin:cornell")]
pub(crate) struct InfoArgs {
    /// Scene: a file ending in .obj, .gltf or .glb, or builtin:cornell
    #[arg(value_name = "SCENE")]
    pub(crate) scene: PathBuf,
}
