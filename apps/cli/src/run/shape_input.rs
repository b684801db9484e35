//! Shapes from files, for commands that change them.

use super::{Refusal, tell};
use crate::plan::shape::Format;
use ondelette_io::shape::{Document, Geometry, Splines, YAxis, iges, step, svg};
use ondelette_modeling::free::{Converted, Fit, FreeCurve};
use ondelette_modeling::shape::ParametricSurface;
use std::path::Path;

/// A shape, and the file around it.
#[derive(Debug)]
pub(crate) struct Loaded {
    pub(crate) document: Document,
    /// The other splines of the file, with the chosen one in its place.
    pub(crate) splines: Splines,
    /// Place of the shape among the surfaces or the curves.
    pub(crate) place: usize,
}

pub(crate) fn read_text(path: &Path) -> Result<String, Refusal> {
    let bytes = std::fs::read(path).map_err(|e| format!("{}: cannot be read: {e}", path.display()))?;
    // some exchange files hold names in other encodings: only ASCII matters
    Ok(String::from_utf8(bytes).unwrap_or_else(|e| String::from_utf8_lossy(e.as_bytes()).into_owned()))
}

/// Reads a shape that has control points.
pub(crate) fn read(path: &Path, part: Option<usize>) -> Result<Loaded, Refusal> {
    let named = |e: String| Refusal::new(format!("{}: {e}", path.display()));
    let format = Format::of(path);
    let (splines, y) = match format {
        Some(Format::Json) => {
            let document = Document::read(&read_text(path)?, None).map_err(named)?;
            if document.geometry == Geometry::None {
                return Err(named(
                    "it holds no points: solve it first, with ondelette curve or surface -o SHAPE.json".into(),
                ));
            }
            return Ok(Loaded { document, splines: Splines::default(), place: 0 });
        }
        Some(Format::Svg) => {
            let paths = svg::read(&read_text(path)?).map_err(named)?;
            let y = if paths.y_down { YAxis::Down } else { YAxis::Up };
            (Splines { curves: paths.path.parts, surfaces: Vec::new() }, y)
        }
        Some(Format::Step) => (step::read(&read_text(path)?).map_err(named)?, YAxis::Up),
        Some(Format::Iges) => {
            let bytes = std::fs::read(path).map_err(|e| named(format!("cannot be read: {e}")))?;
            (iges::read(bytes).map_err(named)?, YAxis::Up)
        }
        _ => return Err(named("a shape to edit is .json, .svg, .step or .igs; fit points with ondelette fit".into())),
    };
    let (surfaces, curves) = (splines.surfaces.len(), splines.curves.len());
    let count = surfaces + curves;
    let part = match part {
        // the edges of a lone surface are not what is meant
        None if count == 1 || surfaces == 1 => 0,
        None => {
            return Err(named(format!(
                "it holds {surfaces} surfaces and {curves} curves: choose one with --part 0 to {}",
                count - 1
            )));
        }
        Some(p) if p < count => p,
        Some(p) => return Err(named(format!("--part {p}: it holds {count}, counted from 0"))),
    };
    if part < surfaces {
        let surface = &splines.surfaces[part];
        let size = surface.mesh(2).points.iter().fold(0.0_f64, |m, p| p.iter().fold(m, |m, x| m.max(x.abs())));
        let fit = Fit { tolerance: 1e-5 * size, most_spans: 256 };
        let converted = surface.to_uniform(&fit).map_err(|e| named(e.to_string()))?;
        say_fit(&converted, path);
        let document = Document { y, ..Document::of_surface(converted.shape) };
        return Ok(Loaded { document, splines, place: part });
    }
    let place = part - surfaces;
    let converted = uniform_curve(&splines.curves[place]).map_err(named)?;
    say_fit(&converted, path);
    Ok(Loaded { document: Document { y, ..Document::of_curve(converted.shape) }, splines, place })
}

/// A free curve as a uniform one, within 1e-5 of its size.
pub(crate) fn uniform_curve(curve: &FreeCurve) -> Result<Converted<ondelette_modeling::shape::Curve>, String> {
    let first = curve.points()[0];
    let far = |p: &[f64; 3]| (0..3).map(|c| (p[c] - first[c]).powi(2)).sum::<f64>().sqrt();
    let size = curve.points().iter().map(far).fold(0.0, f64::max);
    curve.to_uniform(&Fit { tolerance: 1e-5 * size, most_spans: 4096 }).map_err(|e| e.to_string())
}

fn say_fit<S>(converted: &Converted<S>, path: &Path) {
    if !converted.exact {
        tell(format_args!(
            "{}: not a uniform cubic spline; fitted, {:.2e} off at most",
            path.display(),
            converted.deviation
        ));
    }
}
