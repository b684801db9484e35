//! Arguments of the commands on curves and surfaces.

use std::path::PathBuf;

/// What is written, and how it looks: the same for all commands on shapes.
#[derive(Debug, clap::Args)]
pub(crate) struct ShapeOutputs {
    /// What to write; may be repeated. The ending says what. Curves: .svg .json .csv .step .igs .png; surfaces: .glb
    /// .obj .json .npy .step .igs .png
    #[arg(short = 'o', long = "output", value_name = "PATH")]
    pub(crate) outputs: Vec<PathBuf>,

    /// Largest distance of meshes and .csv points from the shape [default: 2e-4 of its size]
    #[arg(long, value_name = "DISTANCE", allow_hyphen_values = true)]
    pub(crate) flatness: Option<String>,

    /// Draw the curvature comb on .png pictures of curves
    #[arg(long)]
    pub(crate) comb: bool,

    /// Draw zebra stripes on .png pictures of surfaces
    #[arg(long)]
    pub(crate) zebra: bool,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  ondelette edit wing.json --level 2 --move 3 0,0.5 -o wing2.json -o wing2.png
  ondelette edit logo.svg --part 0 --level 2 --move 4 1,0 --detail turning -o logo2.svg
  ondelette edit bowl.json --level 1 --move 2,3 0,0,0.4 -o bowl.glb -o bowl.png --zebra
  ondelette edit wing.json --level 3 --pull 0.25 -,0.1 -o wing2.svg
  ondelette edit coast.json --see 2.5 -o smooth.svg

Level 0 is the coarsest; without --level the finest is edited. Control points are counted from 0 in the stored array \
of their level; on a fractional level such as 2.5 in that of the level above. Edits are done in the order: moves, then \
pulls, then --see.")]
pub(crate) struct EditArgs {
    /// Shape: .json (with points), .svg, .step, .igs
    #[arg(value_name = "SHAPE")]
    pub(crate) shape: PathBuf,

    /// Level whose control points are moved, 0 to the finest; fractions lie between levels [default: the finest]
    #[arg(long, value_name = "R", allow_hyphen_values = true)]
    pub(crate) level: Option<String>,

    /// Move a control point of the level: INDEX is i on curves, i,j on surfaces; may be repeated
    #[arg(long = "move", num_args = 2, value_names = ["INDEX", "dx,dy,dz"], allow_hyphen_values = true,
          action = clap::ArgAction::Append)]
    pub(crate) moves: Vec<String>,

    /// Pull the point at a parameter (t, or s,t) to a place, by the least change of the level's control points; -
    /// leaves a coordinate free; may be repeated
    #[arg(long = "pull", num_args = 2, value_names = ["AT", "x,y,z"], allow_hyphen_values = true,
          action = clap::ArgAction::Append)]
    pub(crate) pulls: Vec<String>,

    /// What finer detail does when the sweep below it turns: fixed (keeps x, y, z), turning (turns with it), frames
    /// (tangent, normal, binormal per wavelet as in the thesis, section 6.2.1; curves only)
    #[arg(long, default_value = "fixed", value_name = "HOW")]
    pub(crate) detail: String,

    /// Write the smooth version of this level instead of the whole shape
    #[arg(long, value_name = "LEVEL", allow_hyphen_values = true)]
    pub(crate) see: Option<String>,

    /// Which path, curve or surface of a file that holds several, counted from 0 (surfaces first)
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub(crate) part: Option<String>,

    #[command(flatten)]
    pub(crate) out: ShapeOutputs,
}

/// What `curve` and `surface` share.
#[derive(Debug, clap::Args)]
pub(crate) struct DesignArgs {
    /// Specification: a JSON document (docs/formats/shape.md)
    #[arg(value_name = "SPEC.json")]
    pub(crate) spec: PathBuf,

    /// Solve with this instead of what the document says: auto, spectral, banded, bpx, wavelet, multigrid, cholesky,
    /// thesis-wavelet, thesis-bspline
    #[arg(long, value_name = "NAME")]
    pub(crate) solver: Option<String>,

    /// Write the report here: energy, misses by constraint, iterations, seconds per stage, the solver and why
    #[arg(long, value_name = "PATH")]
    pub(crate) report: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) out: ShapeOutputs,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Example, arch.json:
  { \"levels\": 5, \"energy\": { \"bend\": 1 }, \"constraints\": [
      { \"id\": \"foot\", \"at\": 0, \"position\": [0, 0], \"tangent\": [0, 6] },
      { \"id\": \"top\", \"at\": 0.5, \"position\": [1, 2] },
      { \"id\": \"end\", \"at\": 1, \"position\": [3, 0] } ] }

  ondelette curve arch.json -o arch.svg -o arch.png --comb
  ondelette curve arch.json -o arch.step --solver cholesky --report arch-report.json

Of all curves that meet the constraints the one of least energy is found; Ctrl-C writes the state reached. \
Exit codes: 0 done, 1 not converged, 2 bad input.")]
pub(crate) struct CurveArgs {
    #[command(flatten)]
    pub(crate) design: DesignArgs,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Example, tent.json (one number a position: heights over the domain):
  { \"levels\": 5, \"energy\": { \"stretch\": 0.1, \"bend\": 1 }, \"constraints\": [
      { \"at\": [0, 0], \"position\": [0] }, { \"at\": [1, 0], \"position\": [0] },
      { \"at\": [0, 1], \"position\": [0] }, { \"at\": [1, 1], \"position\": [0] },
      { \"at\": [0.5, 0.5], \"position\": [1] } ] }

  ondelette surface tent.json -o tent.glb -o tent.png --zebra
  ondelette surface tent.json -o tent.npy --report tent-report.json

Of all surfaces that meet the constraints the one of least energy is found; Ctrl-C writes the state reached. \
Exit codes: 0 done, 1 not converged, 2 bad input.")]
pub(crate) struct SurfaceArgs {
    #[command(flatten)]
    pub(crate) design: DesignArgs,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  ondelette fit terrain.csv -o terrain.json -o terrain.png      x,y,height a line
  ondelette fit scan.npy --weight 1e-3 -o smooth.npy --report fit.json
  ondelette fit sketch.csv -o sketch.svg --report fit.json      x,y a line
  ondelette fit wing.dat --fair --tolerance 1e-3 -o wing.svg -o wing.png --comb

Smoothing weight and stiffening are chosen by cross-validation unless given. Height fields: rows run along s, \
columns along t; not-a-number and NODATA cells are gaps.")]
pub(crate) struct FitArgs {
    /// Scattered heights (.csv of x,y,height), a height field (.npy, .asc, grey .png) or an outline (.dat, .svg, .csv
    /// of x,y)
    #[arg(value_name = "POINTS")]
    pub(crate) data: PathBuf,

    /// Weight of the energy against the sum of squared misses [default: chosen]
    #[arg(long, value_name = "W", allow_hyphen_values = true)]
    pub(crate) weight: Option<String>,

    /// Square root of stretch over bend, per side of the domain [default: chosen]
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub(crate) stiffening: Option<String>,

    /// Spans a direction, of surfaces a power of two [default: by the number of points]
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub(crate) spans: Option<String>,

    /// Even the curvature of an outline without moving a point further than --tolerance
    #[arg(long)]
    pub(crate) fair: bool,

    /// How far --fair may move a point
    #[arg(long, value_name = "DISTANCE", allow_hyphen_values = true)]
    pub(crate) tolerance: Option<String>,

    /// Write the report here: misses, what was chosen, seconds per stage
    #[arg(long, value_name = "PATH")]
    pub(crate) report: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) out: ShapeOutputs,
}
