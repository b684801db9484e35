//! `ondelette fit`: smoothing splines through measured data.

use super::shape_input::read_text;
use super::shape_output::Outgoing;
use super::{Outcome, Refusal, tell};
use crate::plan::shape::{FitPlan, Format};
use crate::report::Stages;
use ondelette_io::shape::height::{self, HeightField};
use ondelette_io::shape::picture::Mark;
use ondelette_io::shape::points::{self, Points};
use ondelette_io::shape::{Document, YAxis, svg};
use ondelette_io::write::write_bytes;
use ondelette_modeling::fit::{self, FitSettings, Scatter};
use ondelette_modeling::shape::{Curve, ParametricCurve, Surface};
use serde_json::{Value, json};
use std::path::Path;

/// Most points drawn on a picture.
const MOST_MARKS: usize = 400;

pub(crate) fn run(plan: &FitPlan) -> Result<Outcome, Refusal> {
    let mut stages = Stages::start();
    let named = |e: String| Refusal::new(format!("{}: {e}", plan.data.display()));
    let data = read(&plan.data).map_err(named)?;
    stages.end("read");
    let (document, marks, mut report, grid) = match data {
        Data::Outline(points, y) => {
            plan.out.check_kind(true)?;
            let (document, marks, report) = outline(plan, &points).map_err(named)?;
            (Document { y, ..document }, marks, report, None)
        }
        Data::Scattered(scatter, grid) => {
            plan.out.check_kind(false)?;
            let (document, marks, report) = surface(plan, &scatter).map_err(named)?;
            (document, marks, report, grid)
        }
    };
    stages.end("fit");
    let converged = report["converged"] != json!(false);
    Outgoing { document: &document, around: None, marks, control: None, grid }.write(&plan.out)?;
    stages.end("write");
    report["seconds"] = stages.json();
    if let Some(path) = &plan.report {
        write_bytes(path, format!("{report:#}\n").as_bytes())?;
    }
    if converged {
        return Ok(Outcome::Done);
    }
    tell(match plan.weight {
        Some(weight) if weight > 1.0 => "not converged: give a smaller weight",
        _ => "not converged: give fewer spans, a larger weight, or a stiffening above 0",
    });
    Ok(Outcome::Unfinished)
}

/// What there is to fit.
enum Data {
    /// Points along a curve, and where their y points.
    Outline(Points, YAxis),
    /// Heights at places, and the grid they are on.
    Scattered(Scatter, Option<HeightField>),
}

fn bytes(path: &Path) -> Result<Vec<u8>, String> {
    std::fs::read(path).map_err(|e| format!("cannot be read: {e}"))
}

fn read(path: &Path) -> Result<Data, String> {
    let text = || read_text(path).map_err(|e| e.to_string());
    let field = match Format::of(path) {
        Some(Format::Csv) => {
            let points = points::read_csv(&text()?)?;
            return match points.dim {
                2 => Ok(Data::Outline(points, YAxis::Up)),
                3 => {
                    let (at, values) = points.points.iter().map(|p| ([p[0], p[1]], p[2])).unzip();
                    Scatter::new(at, values).map(|s| Data::Scattered(s, None)).map_err(|e| e.to_string())
                }
                _ => Err("one number a line: x,y is a curve, x,y,height a surface".to_owned()),
            };
        }
        Some(Format::Dat) => return points::read_dat(&text()?).map(|p| Data::Outline(p, YAxis::Up)),
        Some(Format::Svg) => return outline_of_svg(&text()?),
        Some(Format::Npy) => height::read_npy(&bytes(path)?)?,
        Some(Format::Asc) => height::read_asc(&text()?)?,
        Some(Format::Png) => height::read_png(&bytes(path)?)?,
        _ => return Err("points are .csv, outlines .dat, .svg or .csv, height fields .npy, .asc or .png".to_owned()),
    };
    // Rows along s, columns along t, a cell a unit.
    let width = field.shape[1];
    let known = (0..field.heights.len()).filter(|i| field.is_known(*i));
    let place = |i: usize| [(i / width) as f64 * field.cell[0], (i % width) as f64 * field.cell[1]];
    let (at, values) = known.map(|i| (place(i), field.heights[i])).unzip();
    Scatter::new(at, values).map(|s| Data::Scattered(s, Some(field))).map_err(|e| e.to_string())
}

/// Points on the first path of an SVG file, close enough to hold its shape.
fn outline_of_svg(text: &str) -> Result<Data, String> {
    let picture = svg::read(text)?;
    let paths = picture.path.parts;
    if paths.len() > 1 {
        return Err(format!("it has {} paths: an outline is one", paths.len()));
    }
    let path = &paths[0];
    let first = path.points()[0];
    let far = |p: &[f64; 3]| (p[0] - first[0]).hypot(p[1] - first[1]);
    let size = path.points().iter().map(far).fold(0.0, f64::max);
    let line = path.tessellate((1e-4 * size).max(1e-300)).map_err(|e| e.to_string())?;
    let y = if picture.y_down { YAxis::Down } else { YAxis::Up };
    Ok(Data::Outline(Points { dim: 2, points: line.points }, y))
}

type Fitted = (Document, Vec<Mark>, Value);

/// The smoothing spline of an outline.
fn smooth(plan: &FitPlan, points: &Points) -> Result<Fitted, String> {
    let mut list: Vec<Vec<f64>> = points.points.iter().map(|p| p[..points.dim].to_vec()).collect();
    // Outlines of aerofoils end in an edge, even where both ends meet.
    let closed = list.len() > 4 && list.first() == list.last() && Format::of(&plan.data) != Some(Format::Dat);
    if closed {
        list.pop();
    }
    let settings =
        FitSettings { weight: plan.weight, stiffening: plan.stiffening, spans: plan.spans, ..FitSettings::default() };
    let fit = fit::curve(&list, closed, settings).map_err(|e| e.to_string())?;
    tell(format_args!(
        "{} points, {} spans{}: rms miss {:.4e}, weight {:.3e}, stiffening {:.3e}{}",
        list.len(),
        fit.curve.axis().spans(),
        if closed { ", closed" } else { "" },
        fit.rms,
        fit.weight,
        fit.stiffening,
        fit.validation.map(|v| format!(", predicted within {v:.4e} rms")).unwrap_or_default(),
    ));
    let report = json!({
        "points": list.len(),
        "closed": closed,
        "spans": fit.curve.axis().spans(),
        "converged": fit.converged,
        "rms": fit.rms,
        "weight": fit.weight,
        "stiffening": fit.stiffening,
        "validation_rms": fit.validation,
    });
    let on = |(p, t): (&Vec<f64>, &f64)| {
        let given = std::array::from_fn(|c| p.get(c).copied().unwrap_or(0.0));
        Mark::Soft(given, fit.curve.point(*t))
    };
    let marks = if list.len() <= MOST_MARKS { list.iter().zip(&fit.parameters).map(on).collect() } else { Vec::new() };
    let energy = [fit.stiffening.powi(2), 1.0, 0.0];
    Ok((Document { energy, ..Document::of_curve(fit.curve) }, marks, report))
}

fn outline(plan: &FitPlan, points: &Points) -> Result<Fitted, String> {
    if !plan.fair {
        return smooth(plan, points);
    }
    let tolerance = plan.tolerance.ok_or("--fair needs --tolerance: how far a point may move")?;
    let list: Vec<Vec<f64>> = points.points.iter().map(|p| p[..points.dim].to_vec()).collect();
    if list.len() > 4 && list.first() == list.last() && Format::of(&plan.data) != Some(Format::Dat) {
        tell("note: the outline is closed; --fair makes an open curve of it, whose ends need not meet smoothly");
    }
    let fair = fit::fair(&list, tolerance).map_err(|e| e.to_string())?;
    let x = fair.curve.coefficients();
    let control = (0..fair.curve.space().len()).map(|k| std::array::from_fn(|c| x.get(c).map_or(0.0, |x| x[k])));
    let curve = Curve::new(fair.curve.space().axes()[0], points.dim, control.collect()).map_err(|e| e.to_string())?;
    tell(format_args!(
        "{} points, {} control points: largest move {:.3e} of {tolerance:e} allowed",
        list.len(),
        curve.points().len(),
        fair.largest_move
    ));
    let report = json!({
        "points": list.len(),
        "control_points": curve.points().len(),
        "converged": fair.curve.converged(),
        "largest_move": fair.largest_move,
        "tolerance": tolerance,
    });
    Ok((Document::of_curve(curve), Vec::new(), report))
}

fn surface(plan: &FitPlan, scatter: &Scatter) -> Result<Fitted, String> {
    if plan.fair {
        return Err("--fair is for outlines; a surface's smoothing is --weight and --stiffening".to_owned());
    }
    let settings =
        FitSettings { weight: plan.weight, stiffening: plan.stiffening, spans: plan.spans, ..FitSettings::default() };
    let fit = fit::surface(scatter, settings).map_err(|e| e.to_string())?;
    let &[s, t] = fit.space.axes() else { return Err("the fit is no surface".to_owned()) };
    let points = fit.coefficients.iter().map(|h| [*h, 0.0, 0.0]).collect();
    let surface = Surface::new([s, t], 1, points).map_err(|e| e.to_string())?;
    let count = scatter.points().len();
    tell(format_args!(
        "{count} points, {} x {} spans: rms miss {:.4e}, weight {:.3e}, stiffening {:.3e}{}",
        s.spans(),
        t.spans(),
        fit.rms,
        fit.weight,
        fit.stiffening,
        fit.validation.map(|v| format!(", predicted within {v:.4e} rms")).unwrap_or_default(),
    ));
    let report = json!({
        "points": count,
        "spans": [s.spans(), t.spans()],
        "converged": fit.converged,
        "rms": fit.rms,
        "weight": fit.weight,
        "stiffening": fit.stiffening,
        "validation_rms": fit.validation,
    });
    let marks = if count <= MOST_MARKS {
        let on = |p: &[f64; 2]| Mark::Point([p[0], p[1], surface.point(p[0], p[1])[0]]);
        scatter.points().iter().map(on).collect()
    } else {
        Vec::new()
    };
    // Stiffening is per side of the domain.
    let area: f64 = [s, t].map(|a| a.domain()[1] - a.domain()[0]).iter().product();
    let energy = [fit.stiffening.powi(2) / area, 1.0, 0.0];
    Ok((Document { energy, ..Document::of_surface(surface) }, marks, report))
}
