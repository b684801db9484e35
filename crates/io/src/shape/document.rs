//! The JSON document of a shape: one file for geometry, energy, constraints and weights, for programs and people.
//!
//! A document that a person writes may leave out almost everything (docs/formats/shape.md); one that is written here
//! says its schema and version, and holds the control points. Ids and their order are kept.

use ondelette_modeling::Axis;
use ondelette_modeling::intrinsic::Minimum;
use ondelette_modeling::shape::{Curve, Surface};
use ondelette_wavelet::Boundary;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

/// Value of `schema`.
pub const SCHEMA: &str = "ondelette-shape";
/// Value of `version`.
pub const VERSION: u64 = 1;
/// Most control points of a document.
pub const MOST_POINTS: usize = 1 << 24;

/// Which way y points in pictures of a plane shape.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum YAxis {
    /// Up, as in mathematics.
    #[default]
    Up,
    /// Down, as in SVG files.
    Down,
}

/// Control points, once there are some.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// None yet: a specification.
    None,
    /// A curve.
    Curve(Curve),
    /// A surface.
    Surface(Surface),
}

/// A constraint as it is written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConstraintSpec {
    /// Name; given by position (`c0`, `c1`, ...) if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// Parameter, `t` or `[s, t]`; of a curve on a surface none.
    #[serde(default, skip_serializing_if = "Vec::is_empty", deserialize_with = "one_or_many")]
    pub at: Vec<f64>,
    /// A curve on a surface, sampled.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curve: Option<RailSpec>,
    /// The point here is that of another parameter, reflected or shifted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub image: Option<ImageSpec>,
    /// Point; null leaves a coordinate free.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "coordinates")]
    pub position: Option<Vec<Option<f64>>>,
    /// Derivative of a curve.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "coordinates")]
    pub tangent: Option<Vec<Option<f64>>>,
    /// Derivative of a surface by s.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "coordinates")]
    pub ds: Option<Vec<Option<f64>>>,
    /// Derivative of a surface by t.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "coordinates")]
    pub dt: Option<Vec<Option<f64>>>,
    /// Normal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<Vec<f64>>,
    /// Curvature of a curve.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curvature: Option<f64>,
    /// Soft with this weight; exact if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weight: Option<f64>,
}

/// A curve on a surface: where it runs and what it passes through, each a smooth curve through its list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RailSpec {
    /// Parameters `[s, t]` that it runs through, two or more.
    pub at: Vec<[f64; 2]>,
    /// Points that the surface has along it, two or more.
    pub position: Vec<Vec<f64>>,
    /// How often it is sampled; left out: by the spans that it crosses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<usize>,
}

/// The point at another parameter times factors plus an offset: symmetries and joins.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImageSpec {
    /// The other parameter.
    #[serde(deserialize_with = "one_or_many")]
    pub of: Vec<f64>,
    /// A factor a coordinate.
    #[serde(deserialize_with = "one_or_many")]
    pub factors: Vec<f64>,
    /// An offset a coordinate; zero if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset: Option<Vec<f64>>,
}

/// A part of the domain with another stiffness; later regions win.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Lower corner, `t` or `[s, t]`.
    #[serde(deserialize_with = "one_or_many")]
    pub from: Vec<f64>,
    /// Upper corner.
    #[serde(deserialize_with = "one_or_many")]
    pub to: Vec<f64>,
    /// Factor on the energy of the spans whose middle lies in the region.
    pub factor: f64,
}

/// A document, judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Document {
    /// One axis for a curve, two for a surface.
    pub axes: Vec<Axis>,
    /// Control points.
    pub geometry: Geometry,
    /// Weights of stretch, bend and variation.
    pub energy: [f64; 3],
    /// A functional of the shape alone in place of the energy; of curves.
    pub intrinsic: Option<Minimum>,
    /// Constraints in order.
    pub constraints: Vec<ConstraintSpec>,
    /// Weight map of the energy.
    pub stiffness: Vec<Region>,
    /// Name of the solver.
    pub solver: String,
    /// Tolerance of the solver.
    pub tolerance: f64,
    /// Whether to solve on an adaptive set of wavelets.
    pub adaptive: bool,
    /// Do level and see level of the last edit.
    pub edit_levels: Option<[f64; 2]>,
    /// Which way y points.
    pub y: YAxis,
}

/// What a document may say; most of it in more than one way, which is why values are judged later.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    schema: Option<String>,
    version: Option<u64>,
    kind: Option<String>,
    boundary: Option<Value>,
    levels: Option<Value>,
    spans: Option<Value>,
    domain: Option<Value>,
    #[serde(default)]
    energy: Map<String, Value>,
    #[serde(default)]
    constraints: Vec<ConstraintSpec>,
    #[serde(default)]
    stiffness: Vec<Region>,
    solver: Option<String>,
    tolerance: Option<f64>,
    adaptive: Option<bool>,
    points: Option<Value>,
    edit_levels: Option<[f64; 2]>,
    y: Option<String>,
    /// Anything a person wants to say.
    #[serde(rename = "note")]
    _note: Option<Value>,
}

fn one_or_many<'de, D: serde::Deserializer<'de>>(d: D) -> Result<Vec<f64>, D::Error> {
    let value = Value::deserialize(d)?;
    numbers(&value).map_err(serde::de::Error::custom)
}

/// A list of numbers and nulls, or one number; null in its place is kept apart from nothing at all.
fn coordinates<'de, D: serde::Deserializer<'de>>(d: D) -> Result<Option<Vec<Option<f64>>>, D::Error> {
    let one = |v: &Value| match v {
        Value::Null => Ok(None),
        v => v.as_f64().map(Some).ok_or_else(|| serde::de::Error::custom(format!("{v} is neither number nor null"))),
    };
    match Value::deserialize(d)? {
        Value::Null => Ok(None),
        Value::Array(list) => list.iter().map(one).collect::<Result<_, _>>().map(Some),
        v => Ok(Some(vec![one(&v)?])),
    }
}

fn numbers(value: &Value) -> Result<Vec<f64>, String> {
    let one = |v: &Value| v.as_f64().ok_or_else(|| format!("{v} is no number"));
    match value {
        Value::Array(list) => list.iter().map(one).collect(),
        v => Ok(vec![one(v)?]),
    }
}

/// One value for all axes, or a list with one each.
fn each<T: Clone>(value: &Value, axes: usize, one: impl Fn(&Value) -> Result<T, String>) -> Result<Vec<T>, String> {
    match value {
        Value::Array(list) if list.len() == axes => list.iter().map(one).collect(),
        Value::Array(list) => Err(format!("{} values for {axes} directions", list.len())),
        v => Ok(vec![one(v)?; axes]),
    }
}

fn boundary(v: &Value) -> Result<Boundary, String> {
    match v.as_str() {
        Some("open") => Ok(Boundary::Open),
        Some("mirror" | "mirrored") => Ok(Boundary::Mirrored),
        Some("periodic") => Ok(Boundary::Periodic),
        _ => Err(format!("boundary {v}: open, mirror or periodic")),
    }
}

fn count(what: &str, v: &Value, most: u64) -> Result<usize, String> {
    let wrong = || format!("{what} {v}: a whole number from 0 to {most} is needed");
    let n = v.as_u64().filter(|n| *n <= most).ok_or_else(wrong)?;
    usize::try_from(n).map_err(|_| wrong())
}

fn domains(value: Option<&Value>, spans: &[usize]) -> Result<Vec<[f64; 2]>, String> {
    let wrong = |v: &Value| format!("domain {v}: give [from, to], one each for surfaces, or \"knots\"");
    let pair = |v: &Value| match numbers(v).ok().as_deref() {
        Some(&[a, b]) => Ok([a, b]),
        _ => Err(wrong(v)),
    };
    match value {
        None => Ok(vec![[0.0, 1.0]; spans.len()]),
        Some(Value::String(s)) if s == "knots" => Ok(spans.iter().map(|n| [0.0, *n as f64]).collect()),
        Some(v @ Value::Array(list)) if list.first().is_some_and(Value::is_number) => Ok(vec![pair(v)?; spans.len()]),
        Some(Value::Array(list)) if list.len() == spans.len() => list.iter().map(pair).collect(),
        Some(v) => Err(wrong(v)),
    }
}

/// Points of any depth of nesting: coordinates (or single numbers) innermost.
fn points(value: &Value, depth: usize, out: &mut Vec<[f64; 3]>, dim: &mut usize) -> Result<(), String> {
    let Value::Array(list) = value else { return Err("points: lists of points are needed".to_owned()) };
    for v in list {
        if depth > 1 {
            points(v, depth - 1, out, dim)?;
            continue;
        }
        let xyz = numbers(v).map_err(|e| format!("points: {e}"))?;
        if !(1..=3).contains(&xyz.len()) || (*dim != 0 && *dim != xyz.len()) {
            return Err(format!("points: {v} has {} coordinates; all points have the same 1 to 3", xyz.len()));
        }
        *dim = xyz.len();
        let mut p = [0.0; 3];
        p[..*dim].copy_from_slice(&xyz);
        out.push(p);
    }
    Ok(())
}

impl Document {
    /// A document for axes, without points and constraints.
    pub fn new(axes: Vec<Axis>) -> Document {
        Document {
            axes,
            geometry: Geometry::None,
            energy: [0.0, 1.0, 0.0],
            intrinsic: None,
            constraints: Vec::new(),
            stiffness: Vec::new(),
            solver: "auto".to_owned(),
            tolerance: 1e-8,
            adaptive: false,
            edit_levels: None,
            y: YAxis::Up,
        }
    }

    /// A document that holds a curve.
    pub fn of_curve(curve: Curve) -> Document {
        Document { geometry: Geometry::Curve(curve.clone()), ..Document::new(vec![*curve.axis()]) }
    }

    /// A document that holds a surface.
    pub fn of_surface(surface: Surface) -> Document {
        Document { geometry: Geometry::Surface(surface.clone()), ..Document::new(surface.axes().to_vec()) }
    }

    /// Reads a document. `axes` is 1 for a curve, 2 for a surface, and must agree with what the document says.
    ///
    /// ```
    /// use ondelette_io::shape::Document;
    /// let text = r#"{ "levels": 4, "constraints": [ { "at": 0.5, "position": [1, null] } ] }"#;
    /// let document = Document::read(text, Some(1))?;
    /// assert_eq!((document.axes[0].spans(), document.constraints[0].id.as_deref()), (16, Some("c0")));
    /// # Ok::<(), String>(())
    /// ```
    ///
    /// # Errors
    /// A sentence: no JSON (with line and column), an unknown or missing field, a value that makes no sense.
    pub fn read(text: &str, axes: Option<usize>) -> Result<Document, String> {
        let raw: Raw = serde_json::from_str(text).map_err(|e| format!("the document is not understood: {e}"))?;
        if let Some(schema) = raw.schema.as_ref().filter(|s| *s != SCHEMA) {
            return Err(format!("schema {schema:?}: {SCHEMA:?} is read"));
        }
        if let Some(version) = raw.version.filter(|v| *v != VERSION) {
            return Err(format!("version {version}: this program reads version {VERSION}"));
        }
        let said = match raw.kind.as_deref() {
            None => None,
            Some("curve") => Some(1),
            Some("surface") => Some(2),
            Some(kind) => return Err(format!("kind {kind:?}: curve or surface")),
        };
        let kind = |n: usize| if n == 1 { "curve" } else { "surface" };
        let axes = match (said, axes) {
            (Some(a), Some(b)) if a != b => {
                return Err(format!("the document is of a {}, not of a {}", kind(a), kind(b)));
            }
            (Some(n), _) | (None, Some(n)) => n,
            (None, None) => {
                return Err("the document does not say its kind: add \"kind\": \"curve\" or \"surface\"".to_owned());
            }
        };
        let mut out = Document::new(raw.axes(axes)?);
        out.settings(&raw)?;
        if let Some(value) = &raw.points {
            out.geometry = out.geometry_of(value)?;
        }
        out.stiffness.clone_from(&raw.stiffness);
        for (i, r) in out.stiffness.iter().enumerate() {
            if r.from.len() != axes || r.to.len() != axes {
                return Err(format!("stiffness {i}: from and to need {axes} numbers"));
            }
            if !(r.factor.is_finite() && r.factor > 0.0) {
                return Err(format!("stiffness {i}: the factor {} is not positive", r.factor));
            }
        }
        out.constraints = raw.constraints;
        for (i, c) in out.constraints.iter_mut().enumerate() {
            c.id.get_or_insert_with(|| format!("c{i}"));
        }
        Ok(out)
    }

    fn settings(&mut self, raw: &Raw) -> Result<(), String> {
        if !raw.energy.is_empty() {
            self.energy = [0.0; 3];
        }
        if let Some(value) = raw.energy.get("intrinsic") {
            if raw.energy.len() > 1 {
                return Err("energy: intrinsic stands alone, without stretch, bend and variation".to_owned());
            }
            if self.axes.len() != 1 {
                return Err("energy intrinsic: it is for curves".to_owned());
            }
            let name = value.as_str().ok_or_else(|| format!("energy intrinsic {value}: \"mec\" or \"mvc\""))?;
            self.intrinsic = Some(name.parse().map_err(|e| format!("energy: {e}"))?);
            self.energy = [0.0, 1.0, 0.0];
        }
        for (name, value) in raw.energy.iter().filter(|e| e.0 != "intrinsic") {
            let slot = match name.as_str() {
                "stretch" => 0,
                "bend" => 1,
                "variation" => 2,
                _ => return Err(format!("energy {name:?}: stretch, bend, variation and intrinsic are known")),
            };
            let weight = value.as_f64().filter(|x| *x >= 0.0 && x.is_finite());
            self.energy[slot] = weight.ok_or_else(|| format!("energy {name} {value}: a number from 0 on is needed"))?;
        }
        if self.energy.iter().all(|e| *e == 0.0) {
            return Err("the energy is 0: give stretch, bend or variation a weight".to_owned());
        }
        if let Some(t) = raw.tolerance {
            if !(t > 0.0 && t < 1.0) {
                return Err(format!("tolerance {t}: a number between 0 and 1 is needed"));
            }
            self.tolerance = t;
        }
        if let Some(solver) = &raw.solver {
            self.solver.clone_from(solver);
        }
        self.adaptive = raw.adaptive.unwrap_or(false);
        self.edit_levels = raw.edit_levels;
        self.y = match raw.y.as_deref() {
            None | Some("up") => YAxis::Up,
            Some("down") => YAxis::Down,
            Some(y) => return Err(format!("y {y:?}: up or down")),
        };
        Ok(())
    }

    fn geometry_of(&self, value: &Value) -> Result<Geometry, String> {
        let (mut list, mut dim) = (Vec::new(), 0);
        points(value, self.axes.len(), &mut list, &mut dim)?;
        let wrong = |e: ondelette_modeling::shape::ShapeError| format!("points: {e}");
        match *self.axes.as_slice() {
            [axis] => Curve::new(axis, dim, list).map(Geometry::Curve).map_err(wrong),
            [s, t] => {
                let rows = value.as_array().map_or(&[][..], Vec::as_slice);
                let width = |row: &Value| row.as_array().map_or(0, Vec::len);
                if rows.len() != s.len() || rows.iter().any(|r| width(r) != t.len()) {
                    return Err(format!("points: {} rows of {} are needed", s.len(), t.len()));
                }
                Surface::new([s, t], dim, list).map(Geometry::Surface).map_err(wrong)
            }
            _ => Err("a shape has one or two axes".to_owned()),
        }
    }

    /// The document as text, with its schema and version.
    pub fn write(&self) -> String {
        let name = |b: Boundary| match b {
            Boundary::Open => "open",
            Boundary::Mirrored => "mirror",
            Boundary::Periodic => "periodic",
        };
        let single = self.axes.len() == 1;
        let list = |values: Vec<Value>| if single { values[0].clone() } else { Value::Array(values) };
        let mut out = json!({
            "schema": SCHEMA,
            "version": VERSION,
            "kind": if single { "curve" } else { "surface" },
            "boundary": list(self.axes.iter().map(|a| name(a.boundary()).into()).collect()),
            "spans": list(self.axes.iter().map(|a| a.spans().into()).collect()),
            "domain": list(self.axes.iter().map(|a| json!(a.domain())).collect()),
            "energy": match self.intrinsic {
                Some(minimum) => json!({ "intrinsic": minimum.to_string() }),
                None => json!({ "stretch": self.energy[0], "bend": self.energy[1], "variation": self.energy[2] }),
            },
            "constraints": self.constraints,
            "solver": self.solver,
            "tolerance": self.tolerance,
        });
        if !self.stiffness.is_empty() {
            out["stiffness"] = json!(self.stiffness);
        }
        if self.adaptive {
            out["adaptive"] = true.into();
        }
        if let Some(levels) = self.edit_levels {
            out["edit_levels"] = json!(levels);
        }
        if self.y == YAxis::Down {
            out["y"] = "down".into();
        }
        let plain = |p: &[f64; 3], dim: usize| if dim == 1 { json!(p[0]) } else { json!(p[..dim]) };
        match &self.geometry {
            Geometry::None => {}
            Geometry::Curve(c) => {
                out["points"] = c.points().iter().map(|p| plain(p, c.dim())).collect();
            }
            Geometry::Surface(s) => {
                let rows = s.points().chunks(s.shape()[1]);
                out["points"] = rows.map(|r| r.iter().map(|p| plain(p, s.dim())).collect::<Value>()).collect();
            }
        }
        // one line a field: readable, and points do not take a line a number
        let fields = out.as_object().map(|m| m.iter().map(|(k, v)| format!("{}: {v}", json!(k))).collect::<Vec<_>>());
        format!("{{\n{}\n}}\n", fields.unwrap_or_default().join(",\n"))
    }
}

impl Raw {
    fn axes(&self, axes: usize) -> Result<Vec<Axis>, String> {
        let boundaries = match &self.boundary {
            None => vec![Boundary::Open; axes],
            Some(v) => each(v, axes, boundary)?,
        };
        let spans = match (&self.levels, &self.spans) {
            (Some(_), Some(_)) => return Err("levels and spans say the same: give one of them".to_owned()),
            (None, None) => return Err("give levels (2^levels spans) or spans".to_owned()),
            (Some(v), None) => each(v, axes, |v| count("levels", v, 48).map(|l| 1_usize << l))?,
            (None, Some(v)) => each(v, axes, |v| count("spans", v, 1 << 48))?,
        };
        let total = spans.iter().fold(1.0, |n, s| n * (*s as f64 + 3.0));
        if total > MOST_POINTS as f64 {
            return Err(format!(
                "{spans:?} spans are {total:.2e} control points, {:.1} GB; at most {MOST_POINTS} are allowed",
                total * 24e-9
            ));
        }
        let domains = domains(self.domain.as_ref(), &spans)?;
        let axis = |i: usize| Axis::new(boundaries[i], spans[i], domains[i]).map_err(|e| e.to_string());
        (0..axes).map(axis).collect()
    }
}
