//! STEP (ISO 10303-21): `B_SPLINE_CURVE_WITH_KNOTS` and `B_SPLINE_SURFACE_WITH_KNOTS`, rational too.
//!
//! Lengths are taken as they stand; the files written say millimetres.

use super::part21::{self, Instances, Record, Value};
use super::{Splines, plane_if_flat};
use ondelette_modeling::free::{FreeCurve, FreeSurface, Knots};
use std::collections::BTreeSet;
use std::fmt::Write;

/// Reads all B-spline curves and surfaces of a STEP file; curves in the parameters of a surface are left out.
///
/// # Errors
/// A sentence: a broken file, a broken spline (with its instance number), none at all.
pub fn read(text: &str) -> Result<Splines, String> {
    let instances = part21::parse(text)?;
    let parametric = parameter_curves(&instances);
    let mut out = Splines::default();
    for (id, records) in &instances {
        let named = |e: String| format!("#{id}: {e}");
        let find = |name: &str| records.iter().find(|r| r.name == name);
        let weights = |name: &str| find(name).map(|r| floats(r.arguments.first()));
        if let Some(spline) = find("B_SPLINE_CURVE_WITH_KNOTS") {
            if parametric.contains(id) {
                continue;
            }
            let shape = find("B_SPLINE_CURVE").map_or(&spline.arguments[..], |r| &r.arguments[..]);
            let curve = curve(&instances, records.len() > 1, shape, spline, weights("RATIONAL_B_SPLINE_CURVE"));
            out.curves.push(curve.map_err(named)?);
        } else if let Some(spline) = find("B_SPLINE_SURFACE_WITH_KNOTS") {
            let shape = find("B_SPLINE_SURFACE").map_or(&spline.arguments[..], |r| &r.arguments[..]);
            let weights = find("RATIONAL_B_SPLINE_SURFACE").map(|r| match r.arguments.first() {
                Some(Value::List(rows)) => rows.iter().map(|r| floats(Some(r))).collect::<Result<Vec<_>, _>>(),
                _ => Err("weights are missing".to_owned()),
            });
            let weights = weights.map(|w| w.map(|rows| rows.concat()));
            let surface = surface(&instances, records.len() > 1, shape, spline, weights);
            out.surfaces.push(surface.map_err(named)?);
        }
    }
    if out.curves.is_empty() && out.surfaces.is_empty() {
        return Err("the file holds no B-spline curve or surface with knots".to_owned());
    }
    Ok(out)
}

/// Instances that definitional representations refer to: curves in a surface's own parameters.
fn parameter_curves(instances: &Instances) -> BTreeSet<u64> {
    let mut out = BTreeSet::new();
    for record in instances.values().flatten().filter(|r| r.name == "DEFINITIONAL_REPRESENTATION") {
        let mut stack: Vec<&Value> = record.arguments.iter().collect();
        while let Some(v) = stack.pop() {
            match v {
                Value::Reference(id) => {
                    out.insert(*id);
                }
                Value::List(list) => stack.extend(list),
                _ => {}
            }
        }
    }
    out
}

fn floats(list: Option<&Value>) -> Result<Vec<f64>, String> {
    let Some(Value::List(list)) = list else { return Err("a list of numbers is missing".to_owned()) };
    let number = |v: &Value| match v {
        Value::Number(x) => Ok(*x),
        _ => Err("a list holds something that is no number".to_owned()),
    };
    list.iter().map(number).collect()
}

fn integer(v: Option<&Value>, what: &str) -> Result<usize, String> {
    match v {
        Some(Value::Number(x)) if *x >= 0.0 && x.fract() == 0.0 && *x < 1e6 => Ok(*x as usize),
        _ => Err(format!("{what} is missing or no count")),
    }
}

/// Knots from distinct values and multiplicities.
fn knots(degree: usize, times: Option<&Value>, values: Option<&Value>, points: usize) -> Result<Knots, String> {
    let (times, values) = (floats(times)?, floats(values)?);
    if times.len() != values.len() {
        return Err(format!("{} multiplicities for {} knots", times.len(), values.len()));
    }
    let mut out = Vec::new();
    for (n, v) in times.iter().zip(values) {
        if !(*n >= 1.0 && *n <= 100.0 && n.fract() == 0.0) {
            return Err(format!("the multiplicity {n} is none"));
        }
        out.extend(std::iter::repeat_n(v, *n as usize));
    }
    Knots::new(degree, out, points).map_err(|e| e.to_string())
}

fn points(instances: &Instances, list: Option<&Value>) -> Result<Vec<[f64; 3]>, String> {
    let Some(Value::List(list)) = list else { return Err("control points are missing".to_owned()) };
    let point = |v: &Value| {
        let Value::Reference(id) = v else { return Err("a control point is no reference".to_owned()) };
        let record = instances.get(id).and_then(|r| r.iter().find(|r| r.name == "CARTESIAN_POINT"));
        let record = record.ok_or_else(|| format!("#{id} is no CARTESIAN_POINT"))?;
        let xyz = floats(record.arguments.get(1)).map_err(|e| format!("#{id}: {e}"))?;
        let mut p = [0.0; 3];
        if !(2..=3).contains(&xyz.len()) {
            return Err(format!("#{id} has {} coordinates", xyz.len()));
        }
        p[..xyz.len()].copy_from_slice(&xyz);
        Ok(p)
    };
    list.iter().map(point).collect()
}

/// Simple instances have a name first and their knots in the same record; complex ones neither.
fn curve(
    instances: &Instances,
    complex: bool,
    shape: &[Value],
    spline: &Record,
    weights: Option<Result<Vec<f64>, String>>,
) -> Result<FreeCurve, String> {
    let (first, knots_at) = if complex { (0, 0) } else { (1, 6) };
    let degree = integer(shape.get(first), "the degree")?;
    let points = points(instances, shape.get(first + 1))?;
    let at = |k: usize| spline.arguments.get(knots_at + k);
    let knots = knots(degree, at(0), at(1), points.len())?;
    let dim = plane_if_flat(&points);
    FreeCurve::new(dim, knots, points, weights.transpose()?).map_err(|e| e.to_string())
}

fn surface(
    instances: &Instances,
    complex: bool,
    shape: &[Value],
    spline: &Record,
    weights: Option<Result<Vec<f64>, String>>,
) -> Result<FreeSurface, String> {
    let (first, knots_at) = if complex { (0, 0) } else { (1, 8) };
    let degrees = [integer(shape.get(first), "a degree")?, integer(shape.get(first + 1), "a degree")?];
    let Some(Value::List(rows)) = shape.get(first + 2) else { return Err("control points are missing".to_owned()) };
    let rows = rows.iter().map(|r| points(instances, Some(r))).collect::<Result<Vec<_>, _>>()?;
    let width = rows.first().map_or(0, Vec::len);
    if rows.iter().any(|r| r.len() != width) {
        return Err("rows of control points have different lengths".to_owned());
    }
    let at = |k: usize| spline.arguments.get(knots_at + k);
    let knots = [knots(degrees[0], at(0), at(2), rows.len())?, knots(degrees[1], at(1), at(3), width)?];
    FreeSurface::new(knots, rows.concat(), weights.transpose()?).map_err(|e| e.to_string())
}

/// A real as Part 21 wants it: with a point.
fn real(x: f64) -> String {
    let text = super::shortest(x);
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, ""));
    let point = if mantissa.contains('.') { "" } else { "." };
    if exponent.is_empty() { format!("{mantissa}{point}") } else { format!("{mantissa}{point}E{exponent}") }
}

fn list<T>(items: &[T], f: impl Fn(&T) -> String) -> String {
    let items: Vec<String> = items.iter().map(f).collect();
    format!("({})", items.join(","))
}

/// Different knots and how often each appears.
fn grouped(knots: &Knots) -> (String, String) {
    let runs: Vec<&[f64]> = knots.values().chunk_by(|a, b| a == b).collect();
    (list(&runs, |run| run.len().to_string()), list(&runs, |run| real(run[0])))
}

/// Writes curves and surfaces as a STEP file (AP214): a geometric set in millimetres. Numbers read back to the bit.
///
/// # Errors
/// Nothing to write.
pub fn write(splines: &Splines, name: &str) -> Result<String, String> {
    if splines.curves.is_empty() && splines.surfaces.is_empty() {
        return Err("there is no spline to write".to_owned());
    }
    let mut file = Writer { text: String::new(), next: 1 };
    let name: String =
        name.chars().map(|c| if c.is_ascii_alphanumeric() || " _-.".contains(c) { c } else { '_' }).collect();
    let mut items = Vec::new();
    for c in &splines.curves {
        items.push(file.curve(c));
    }
    for s in &splines.surfaces {
        items.push(file.surface(s));
    }
    let kind = if splines.surfaces.is_empty() { "GEOMETRIC_CURVE_SET" } else { "GEOMETRIC_SET" };
    let set = file.put(format!("{kind}('',{})", list(&items, |i| format!("#{i}"))));
    let length = file.put("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))".into());
    let angle = file.put("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))".into());
    let solid = file.put("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())".into());
    let fuzz = file
        .put(format!("UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-7),#{length},'distance_accuracy_value','')"));
    let context = file.put(format!(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{fuzz}))\
         GLOBAL_UNIT_ASSIGNED_CONTEXT((#{length},#{angle},#{solid}))REPRESENTATION_CONTEXT('',''))"
    ));
    let kind = if splines.surfaces.is_empty() {
        "GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION"
    } else {
        "GEOMETRICALLY_BOUNDED_SURFACE_SHAPE_REPRESENTATION"
    };
    let shape = file.put(format!("{kind}('',(#{set}),#{context})"));
    let application = file.put("APPLICATION_CONTEXT('automotive design')".into());
    file.put(format!(
        "APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#{application})"
    ));
    let product_context = file.put(format!("PRODUCT_CONTEXT('',#{application},'mechanical')"));
    let product = file.put(format!("PRODUCT('{name}','{name}','',(#{product_context}))"));
    let formation = file.put(format!("PRODUCT_DEFINITION_FORMATION('','',#{product})"));
    let design = file.put(format!("PRODUCT_DEFINITION_CONTEXT('part definition',#{application},'design')"));
    let definition = file.put(format!("PRODUCT_DEFINITION('design','',#{formation},#{design})"));
    let of = file.put(format!("PRODUCT_DEFINITION_SHAPE('','',#{definition})"));
    file.put(format!("SHAPE_DEFINITION_REPRESENTATION(#{of},#{shape})"));
    Ok(format!(
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(('{name}'),'2;1');\n\
         FILE_NAME('{name}','2000-01-01T00:00:00',(''),(''),'Ondelette','Ondelette','');\n\
         FILE_SCHEMA(('AUTOMOTIVE_DESIGN {{ 1 0 10303 214 1 1 1 1 }}'));\nENDSEC;\nDATA;\n{}ENDSEC;\n\
         END-ISO-10303-21;\n",
        file.text
    ))
}

/// Numbers instances as they are written.
struct Writer {
    text: String,
    next: u64,
}

impl Writer {
    fn put(&mut self, what: String) -> u64 {
        // Writing to a String does not fail.
        let _ = writeln!(self.text, "#{}={what};", self.next);
        self.next += 1;
        self.next - 1
    }

    fn point(&mut self, p: [f64; 3]) -> u64 {
        self.put(format!("CARTESIAN_POINT('',{})", list(&p, |x| real(*x))))
    }

    fn curve(&mut self, c: &FreeCurve) -> u64 {
        let points: Vec<u64> = c.points().iter().map(|p| self.point(*p)).collect();
        let (times, values) = grouped(c.knots());
        let degree = c.knots().degree();
        let closed = if c.is_closed() { ".T." } else { ".F." };
        let points = list(&points, |i| format!("#{i}"));
        let Some(weights) = c.weights() else {
            return self.put(format!(
                "B_SPLINE_CURVE_WITH_KNOTS('',{degree},{points},.UNSPECIFIED.,{closed},.U.,{times},{values},\
                 .UNSPECIFIED.)"
            ));
        };
        let weights = list(weights, |w| real(*w));
        self.put(format!(
            "(BOUNDED_CURVE()B_SPLINE_CURVE({degree},{points},.UNSPECIFIED.,{closed},.U.)\
             B_SPLINE_CURVE_WITH_KNOTS({times},{values},.UNSPECIFIED.)CURVE()GEOMETRIC_REPRESENTATION_ITEM()\
             RATIONAL_B_SPLINE_CURVE({weights})REPRESENTATION_ITEM(''))"
        ))
    }

    fn surface(&mut self, s: &FreeSurface) -> u64 {
        let width = s.knots()[1].points();
        let ids: Vec<u64> = s.points().iter().map(|p| self.point(*p)).collect();
        let rows: Vec<&[u64]> = ids.chunks(width).collect();
        let points = list(&rows, |r| list(r, |i| format!("#{i}")));
        let [u, v] = s.knots();
        let ((tu, ku), (tv, kv)) = (grouped(u), grouped(v));
        let (du, dv) = (u.degree(), v.degree());
        let Some(weights) = s.weights() else {
            return self.put(format!(
                "B_SPLINE_SURFACE_WITH_KNOTS('',{du},{dv},{points},.UNSPECIFIED.,.F.,.F.,.U.,{tu},{tv},{ku},{kv},\
                 .UNSPECIFIED.)"
            ));
        };
        let rows: Vec<&[f64]> = weights.chunks(width).collect();
        let weights = list(&rows, |r| list(r, |w| real(*w)));
        self.put(format!(
            "(BOUNDED_SURFACE()B_SPLINE_SURFACE({du},{dv},{points},.UNSPECIFIED.,.F.,.F.,.U.)\
             B_SPLINE_SURFACE_WITH_KNOTS({tu},{tv},{ku},{kv},.UNSPECIFIED.)GEOMETRIC_REPRESENTATION_ITEM()\
             RATIONAL_B_SPLINE_SURFACE({weights})REPRESENTATION_ITEM('')SURFACE())"
        ))
    }
}
