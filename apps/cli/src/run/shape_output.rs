//! Shapes to files.

use super::Refusal;
use crate::plan::shape::{Format, OutputPlan};
use ondelette_io::npy;
use ondelette_io::shape::height::{self, HeightField};
use ondelette_io::shape::picture::{self, CurvePicture, Mark, Picture, SurfacePicture};
use ondelette_io::shape::{Document, Geometry, Splines, YAxis, iges, mesh, points, step, svg};
use ondelette_io::write::{write_bytes, write_png};
use ondelette_modeling::free::{FreeCurve, FreePath, FreeSurface};
use ondelette_modeling::shape::{Bounds, Curve, Mesh, ParametricCurve, ParametricSurface, Surface};
use ondelette_wavelet::Boundary;
use std::path::Path;

/// A shape on its way out.
pub(crate) struct Outgoing<'a> {
    pub(crate) document: &'a Document,
    /// The file it came from, whose other splines go along (SVG, STEP, IGES).
    pub(crate) around: Option<(&'a Splines, usize)>,
    /// Constraints to be drawn.
    pub(crate) marks: Vec<Mark>,
    /// Control points to be drawn with a curve; its own if left out.
    pub(crate) control: Option<Vec<[f64; 3]>>,
    /// The height field that a surface was fitted to, with s and t from its first height: grids are written on it.
    pub(crate) grid: Option<HeightField>,
}

/// Finest meshes of pictures.
const MOST_PARTS: usize = 12;

impl Outgoing<'_> {
    /// Writes all files.
    pub(crate) fn write(&self, plan: &OutputPlan) -> Result<(), Refusal> {
        for (path, format) in &plan.files {
            self.write_one(path, *format, plan)?;
        }
        Ok(())
    }

    fn write_one(&self, path: &Path, format: Format, plan: &OutputPlan) -> Result<(), Refusal> {
        let named = |e: String| Refusal::new(format!("{}: {e}", path.display()));
        let name = path.file_stem().map_or_else(|| "shape".into(), |s| s.to_string_lossy().into_owned());
        let bytes = match (format, &self.document.geometry) {
            (_, Geometry::None) => return Err(named("there is no shape to write".into())),
            (Format::Json, _) => self.document.write().into_bytes(),
            (Format::Step, _) => step::write(&self.splines(), &name).map_err(named)?.into_bytes(),
            (Format::Iges, _) => iges::write(&self.splines(), &name).map_err(named)?.into_bytes(),
            (Format::Svg, Geometry::Curve(c)) => {
                let path = FreePath { parts: self.splines().curves };
                let flatness = flatness(plan, &c.bounds());
                svg::write(&path, self.document.y == YAxis::Down, flatness).map_err(named)?.into_bytes()
            }
            (Format::Csv, Geometry::Curve(c)) => {
                let line = c.tessellate(flatness(plan, &c.bounds())).map_err(|e| named(e.to_string()))?;
                points::write_csv(&line.points, c.dim().max(2)).into_bytes()
            }
            (Format::Png, Geometry::Curve(c)) => return self.picture(path, &self.draw_curve(c, plan)),
            (Format::Png, Geometry::Surface(s)) => return self.picture(path, &self.draw_surface(s, plan)),
            (Format::Glb, Geometry::Surface(s)) => {
                mesh::glb(&triangles(s, plan).map_err(named)?, &name).map_err(named)?
            }
            (Format::Obj, Geometry::Surface(s)) => mesh::obj(&triangles(s, plan).map_err(named)?, &name).into_bytes(),
            (Format::Npy, Geometry::Surface(s)) => array(s).map_err(named)?,
            (Format::Asc, Geometry::Surface(s)) if s.dim() == 1 => {
                let grid = self.grid.as_ref().map_or_else(|| heights(s), |grid| on_grid(s, grid));
                height::write_asc(&grid.map_err(named)?).into_bytes()
            }
            (Format::Asc, _) => return Err(named("only height fields (one coordinate) are written as .asc".into())),
            _ => return Err(named("this kind of shape is not written as that".into())),
        };
        Ok(write_bytes(path, &bytes)?)
    }

    fn splines(&self) -> Splines {
        let mut out = self.around.map_or_else(Splines::default, |a| a.0.clone());
        let place = self.around.map_or(0, |a| a.1);
        match &self.document.geometry {
            Geometry::None => {}
            Geometry::Curve(c) if place < out.curves.len() => out.curves[place] = FreeCurve::from(c),
            Geometry::Curve(c) => out.curves.push(FreeCurve::from(c)),
            Geometry::Surface(s) if place < out.surfaces.len() => out.surfaces[place] = FreeSurface::from(s),
            Geometry::Surface(s) => out.surfaces.push(FreeSurface::from(s)),
        }
        out
    }

    fn picture(&self, path: &Path, picture: &Picture) -> Result<(), Refusal> {
        Ok(write_png(path, picture.width, picture.height, &picture.pixels)?)
    }

    fn draw_curve(&self, curve: &Curve, plan: &OutputPlan) -> Picture {
        let around: &[FreeCurve] = self.around.map_or(&[], |a| &a.0.curves);
        let place = self.around.map_or(0, |a| a.1);
        let others = around.iter().enumerate().filter(|(i, _)| *i != place).map(|(_, c)| c as &dyn ParametricCurve);
        let curves: Vec<&dyn ParametricCurve> = std::iter::once(curve as &dyn ParametricCurve).chain(others).collect();
        let closed = curve.closed();
        let control = match &self.control {
            // heights have no place in the plane of their own
            Some(control) if curve.dim() > 1 => control.clone(),
            _ if closed => curve.points().to_vec(),
            _ => curve.in_space().points().to_vec(),
        };
        let with = CurvePicture {
            comb: plan.comb,
            control,
            control_closed: closed,
            marks: self.marks.clone(),
            y_down: self.document.y == YAxis::Down,
            ..CurvePicture::default()
        };
        picture::curve(&curves, &with)
    }

    fn draw_surface(&self, surface: &Surface, plan: &OutputPlan) -> Picture {
        let spans = surface.axes().map(|a| a.spans()).into_iter().max().unwrap_or(1);
        let mut mesh = surface.mesh((480 / spans).clamp(1, MOST_PARTS * 4));
        let mut marks = self.marks.clone();
        if surface.dim() == 1 {
            exaggerate(&mut mesh, &mut marks);
        }
        let with = SurfacePicture { zebra: plan.zebra, marks, ..SurfacePicture::default() };
        picture::surface(&mesh, &with)
    }
}

/// Heights in other units than the domain (metres over a unit square) would be a needle or a sheet of paper: pictures
/// stretch heights to a fifth of the domain's diagonal if they are far off. Normals follow.
fn exaggerate(mesh: &mut Mesh, marks: &mut [Mark]) {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for p in &mesh.points {
        for c in 0..3 {
            low[c] = low[c].min(p[c]);
            high[c] = high[c].max(p[c]);
        }
    }
    let side = (high[0] - low[0]).hypot(high[1] - low[1]);
    let tall = high[2] - low[2];
    if tall <= 1e-6 * side.min(1e-300_f64.max(high[2].abs())) || (0.02..=0.8).contains(&(tall / side)) {
        return;
    }
    let by = 0.2 * side / tall;
    let lift = |p: &mut [f64; 3]| p[2] = (p[2] - low[2]) * by;
    mesh.points.iter_mut().for_each(lift);
    for n in &mut mesh.normals {
        let m = [n[0] * by, n[1] * by, n[2]];
        let size = m.iter().map(|x| x * x).sum::<f64>().sqrt();
        *n = m.map(|x| x / size);
    }
    for mark in marks {
        match mark {
            Mark::Point(p) => lift(p),
            Mark::Soft(p, q) => {
                lift(p);
                lift(q);
            }
            Mark::Direction(p, d) => {
                lift(p);
                d[2] *= by;
            }
        }
    }
}

fn flatness(plan: &OutputPlan, bounds: &Bounds) -> f64 {
    // a shape of one point has no size: any distance will do
    plan.flatness.unwrap_or_else(|| (2e-4 * bounds.diagonal()).max(1e-300))
}

fn triangles(surface: &Surface, plan: &OutputPlan) -> Result<Mesh, String> {
    surface.tessellate(flatness(plan, &surface.bounds())).map_err(|e| e.to_string())
}

/// Values at the knots, without the repeated end of periodic directions.
fn at_knots(surface: &Surface) -> ([usize; 2], Vec<[f64; 3]>) {
    let knots = surface.axes().map(|a| {
        let last = if a.boundary() == Boundary::Periodic { a.spans() } else { a.spans() + 1 };
        (0..last).map(|i| a.from_knots(i as f64)).collect::<Vec<_>>()
    });
    let shape = [knots[0].len(), knots[1].len()];
    let values = knots[0].iter().flat_map(|&s| knots[1].iter().map(move |&t| surface.point(s, t))).collect();
    (shape, values)
}

fn heights(surface: &Surface) -> Result<HeightField, String> {
    let (shape, values) = at_knots(surface);
    let mut field = HeightField::new(shape, values.iter().map(|p| p[0]).collect())?;
    field.cell = surface.axes().map(|a| 1.0 / a.density());
    if (field.cell[0] - field.cell[1]).abs() <= 1e-12 * field.cell[0] {
        field.cell[1] = field.cell[0];
    }
    Ok(field)
}

/// Heights of a surface in the cells of a grid; those outside its domain are missing.
fn on_grid(surface: &Surface, grid: &HeightField) -> Result<HeightField, String> {
    let [rows, columns] = grid.shape;
    let domain = surface.axes().map(|a| a.domain());
    let place = |i: usize| [(i / columns) as f64 * grid.cell[0], (i % columns) as f64 * grid.cell[1]];
    let inside = |p: [f64; 2]| (0..2).all(|a| (domain[a][0]..=domain[a][1]).contains(&p[a]));
    let places = || (0..rows * columns).map(place);
    let height = |p: [f64; 2]| if inside(p) { surface.point(p[0], p[1])[0] } else { 0.0 };
    let mut field = HeightField::new(grid.shape, places().map(height).collect())?;
    if !places().all(inside) {
        field.known = places().map(inside).collect();
    }
    (field.cell, field.corner) = (grid.cell, grid.corner);
    Ok(field)
}

fn array(surface: &Surface) -> Result<Vec<u8>, String> {
    if surface.dim() == 1 {
        return Ok(height::write_npy(&heights(surface)?));
    }
    let (shape, values) = at_knots(surface);
    let flat = values.iter().flat_map(|p| p[..surface.dim()].iter().copied()).collect();
    let grid = npy::Grid { shape: vec![shape[0], shape[1], surface.dim()], values: npy::Values::F64(flat) };
    Ok(npy::write(&grid))
}
