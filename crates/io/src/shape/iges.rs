//! IGES 5.3: entities 126 (rational B-spline curve) and 128 (rational B-spline surface).
//!
//! Lengths are taken as they stand; the files written say millimetres.

use super::{Splines, plane_if_flat};
use ondelette_modeling::free::{FreeCurve, FreeSurface, Knots};
use std::fmt::Write;

/// Reads all entities 126 and 128 of an IGES file, moved by their transformation matrices; curves in the parameters of
/// a surface (entity use 05) are left out. Bytes that are not ASCII (names in some encoding) hold their columns.
///
/// # Errors
/// A sentence: no IGES file, a broken entity (with its directory line), one that uses a part of its knots only, none.
pub fn read(file: impl AsRef<[u8]>) -> Result<Splines, String> {
    let ascii = |b: &u8| if b.is_ascii() { char::from(*b) } else { '?' };
    let text: String = file.as_ref().iter().map(ascii).collect();
    let file = Sections::of(&text)?;
    let mut out = Splines::default();
    for (i, pair) in file.directory.chunks(2).enumerate() {
        let Ok(kind @ (126 | 128)) = field(pair[0].1, 0) else { continue };
        // Blanks stand for zeros.
        let status = format!("{:0>8}", pair[0].1.get(64..72).unwrap_or_default().trim());
        if status.get(4..6) == Some("05") {
            continue;
        }
        let named = |e: String| format!("line {}, entity {kind}: {e}", pair[0].0);
        let numbers = file.numbers(i).map_err(named)?;
        let motion = file.motion(pair[0].1).map_err(named)?;
        let mut reader = Fields { numbers: &numbers, at: 1, motion };
        match kind {
            126 => out.curves.push(reader.curve().map_err(named)?),
            _ => out.surfaces.push(reader.surface().map_err(named)?),
        }
    }
    if out.curves.is_empty() && out.surfaces.is_empty() {
        return Err("the file holds no B-spline curve (126) or surface (128)".to_owned());
    }
    Ok(out)
}

/// A number of a directory line.
fn field(body: &str, k: usize) -> Result<usize, String> {
    let text = body.get(8 * k..8 * k + 8).unwrap_or_default().trim();
    text.parse().map_err(|_| format!("its directory holds {text:?}, which is no count"))
}

/// A rotation (or any 3 x 3 matrix) and a shift, row by row.
type Motion = [[f64; 4]; 3];

/// Matrices that apply to each other, at most.
const MOST_MOTIONS: usize = 16;

/// The sections of a file that are read.
struct Sections<'a> {
    /// Line numbers and the first 72 columns; two lines an entity.
    directory: Vec<(usize, &'a str)>,
    parameters: Vec<&'a str>,
    separator: char,
    end: char,
}

impl Sections<'_> {
    fn of(text: &str) -> Result<Sections<'_>, String> {
        let mut global = String::new();
        let (mut directory, mut parameters) = (Vec::new(), Vec::new());
        for (i, line) in text.lines().enumerate() {
            let (Some(body), Some(section)) = (line.get(..72), line.get(72..73)) else { continue };
            match section {
                "G" => global.push_str(body),
                "D" => directory.push((i + 1, body)),
                "P" => parameters.push(&body[..64]),
                _ => {}
            }
        }
        if directory.is_empty() || parameters.is_empty() {
            return Err("no IGES file: directory or parameter section is missing".to_owned());
        }
        let (separator, end) = delimiters(&global);
        Ok(Sections { directory, parameters, separator, end })
    }

    /// The parameters of an entity, its type first.
    fn numbers(&self, entity: usize) -> Result<Vec<f64>, String> {
        let first = self.directory.get(2 * entity).ok_or("it is not in the directory")?.1;
        let second = self.directory.get(2 * entity + 1).ok_or("its second line is missing")?.1;
        let (Ok(start), Ok(count)) = (field(first, 1), field(second, 3)) else {
            return Err("it does not say where its parameters are".into());
        };
        let lines = start.checked_sub(1).and_then(|s| self.parameters.get(s..s.checked_add(count)?));
        let data = lines.ok_or("its parameters are not in the file")?.concat();
        let data = data.split(self.end).next().unwrap_or_default();
        let numbers = data.split(self.separator).map(number).collect::<Result<Vec<f64>, String>>()?;
        if numbers.first() != field(first, 0).ok().map(|kind| kind as f64).as_ref() {
            return Err("its parameters are those of another entity".into());
        }
        Ok(numbers)
    }

    /// What the transformation matrices (124) of an entity do together; `None` without any.
    fn motion(&self, directory: &str) -> Result<Option<Motion>, String> {
        let pointer =
            |body: &str| if body.get(48..56).unwrap_or_default().trim().is_empty() { Ok(0) } else { field(body, 6) };
        let mut next = pointer(directory)?;
        let mut motion: Option<Motion> = None;
        for _ in 0..MOST_MOTIONS {
            if next == 0 {
                return Ok(motion);
            }
            if next % 2 == 0 {
                return Err(format!("its transformation matrix is said to be at {next}, where no entity begins"));
            }
            let numbers = self.numbers(next / 2).map_err(|e| format!("its transformation matrix: {e}"))?;
            let [124.0, m @ ..] = numbers.as_slice() else {
                return Err(format!("directory entry {next} is no transformation matrix"));
            };
            let rows = m.get(..12).ok_or("its transformation matrix has fewer than 12 numbers")?;
            let outer: Motion = std::array::from_fn(|i| std::array::from_fn(|k| rows[4 * i + k]));
            motion = Some(match motion {
                None => outer,
                Some(inner) => std::array::from_fn(|i| {
                    std::array::from_fn(|k| {
                        let shift = if k == 3 { outer[i][3] } else { 0.0 };
                        (0..3).map(|j| outer[i][j] * inner[j][k]).sum::<f64>() + shift
                    })
                }),
            });
            next = pointer(self.directory[next / 2 * 2].1)?;
        }
        Err(format!("more than {MOST_MOTIONS} transformation matrices apply to it"))
    }
}

/// Parameter and record delimiter: the first two global parameters, `1H,` and `1H;` if left out.
fn delimiters(global: &str) -> (char, char) {
    let mut separator = ',';
    let rest = match global.trim_start().strip_prefix("1H") {
        Some(rest) => {
            let mut chars = rest.chars();
            separator = chars.next().unwrap_or(',');
            chars.as_str().strip_prefix(separator).unwrap_or_default()
        }
        None => global.trim_start().strip_prefix(',').unwrap_or_default(),
    };
    let end = rest.strip_prefix("1H").and_then(|r| r.chars().next()).unwrap_or(';');
    (separator, end)
}

fn number(text: &str) -> Result<f64, String> {
    let text = text.trim();
    if text.is_empty() {
        return Ok(0.0);
    }
    let plain: String = text.chars().map(|c| if matches!(c, 'D' | 'd') { 'E' } else { c }).collect();
    match plain.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        _ => Err(format!("{text:?} is no finite number")),
    }
}

struct Fields<'a> {
    numbers: &'a [f64],
    at: usize,
    motion: Option<Motion>,
}

impl Fields<'_> {
    fn count(&mut self, what: &str) -> Result<usize, String> {
        let x = self.take(1)?[0];
        // every count is of numbers that follow
        if x >= 0.0 && x.fract() == 0.0 && x <= self.numbers.len() as f64 {
            return Ok(x as usize);
        }
        Err(format!("{what} is {x}, which is no count"))
    }

    fn take(&mut self, n: usize) -> Result<&[f64], String> {
        let end = self.at.checked_add(n).filter(|e| *e <= self.numbers.len());
        let end = end.ok_or_else(|| format!("it ends early: {n} numbers are missing at number {}", self.at))?;
        let out = &self.numbers[self.at..end];
        self.at = end;
        Ok(out)
    }

    fn points(&mut self, n: usize) -> Result<Vec<[f64; 3]>, String> {
        let motion = self.motion;
        let flat = self.take(n.saturating_mul(3))?;
        let moved = |p: &[f64]| match motion {
            None => [p[0], p[1], p[2]],
            Some(m) => m.map(|row| row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3]),
        };
        Ok(flat.chunks_exact(3).map(moved).collect())
    }

    fn curve(&mut self) -> Result<FreeCurve, String> {
        let (last, degree) = (self.count("the last index")?, self.count("the degree")?);
        self.take(4)?;
        let knots = self.take(last + degree + 2)?.to_vec();
        let weights = self.take(last + 1)?.to_vec();
        let points = self.points(last + 1)?;
        let ends = self.take(2).map(|e| [e[0], e[1]]);
        let knots = Knots::new(degree, knots, last + 1).map_err(|e| e.to_string())?;
        whole(knots.domain(), ends)?;
        FreeCurve::new(plane_if_flat(&points), knots, points, Some(weights)).map_err(|e| e.to_string())
    }

    fn surface(&mut self) -> Result<FreeSurface, String> {
        let (k1, k2) = (self.count("the last index")?, self.count("the last index")?);
        let (m1, m2) = (self.count("the degree")?, self.count("the degree")?);
        self.take(5)?;
        let u = self.take(k1 + m1 + 2)?.to_vec();
        let v = self.take(k2 + m2 + 2)?.to_vec();
        let total = (k1 + 1) * (k2 + 1);
        // the first direction runs fastest
        let weights = self.take(total)?.to_vec();
        let points = self.points(total)?;
        let ends = self.take(4).map(|e| [[e[0], e[1]], [e[2], e[3]]]);
        let turned = |i: usize| (i % (k2 + 1)) * (k1 + 1) + i / (k2 + 1);
        let weights = (0..total).map(|i| weights[turned(i)]).collect();
        let points = (0..total).map(|i| points[turned(i)]).collect();
        let u = Knots::new(m1, u, k1 + 1).map_err(|e| e.to_string())?;
        let v = Knots::new(m2, v, k2 + 1).map_err(|e| e.to_string())?;
        whole(u.domain(), ends.clone().map(|e| e[0]))?;
        whole(v.domain(), ends.map(|e| e[1]))?;
        FreeSurface::new([u, v], points, Some(weights)).map_err(|e| e.to_string())
    }
}

/// Splines that use a part of their knots only would need a split, which is not done silently.
fn whole(domain: [f64; 2], ends: Result<[f64; 2], String>) -> Result<(), String> {
    let Ok([a, b]) = ends else { return Ok(()) };
    let slack = 1e-9 * (domain[1] - domain[0]);
    if (a - domain[0]).abs() <= slack && (b - domain[1]).abs() <= slack {
        return Ok(());
    }
    Err(format!("it is trimmed to [{a}, {b}] of [{}, {}]: export it with its whole domain", domain[0], domain[1]))
}

/// A real with a point, as IGES wants it.
fn real(x: f64) -> String {
    let text = super::shortest(x);
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, ""));
    let point = if mantissa.contains('.') { "" } else { "." };
    if exponent.is_empty() { format!("{mantissa}{point}") } else { format!("{mantissa}{point}D{exponent}") }
}

/// Writes curves and surfaces as an IGES file in millimetres. Numbers read back to the bit.
///
/// # Errors
/// Nothing to write; more than fits the format's seven-digit line numbers.
pub fn write(splines: &Splines, name: &str) -> Result<String, String> {
    if splines.curves.is_empty() && splines.surfaces.is_empty() {
        return Err("there is no spline to write".to_owned());
    }
    let mut directory = String::new();
    let mut parameters = String::new();
    let (mut d, mut p) = (1_usize, 1_usize);
    let entities = splines.curves.iter().map(|c| (126, curve_fields(c)));
    let entities = entities.chain(splines.surfaces.iter().map(|s| (128, surface_fields(s))));
    let mut largest: f64 = 1.0;
    let points = splines.curves.iter().flat_map(FreeCurve::points);
    for q in points.chain(splines.surfaces.iter().flat_map(FreeSurface::points)) {
        largest = q.iter().fold(largest, |m, x| m.max(x.abs()));
    }
    for (kind, fields) in entities {
        let start = p;
        for line in packed(&fields, 64) {
            // Writing to a String does not fail.
            let _ = writeln!(parameters, "{line:<64}{d:>8}P{p:>7}");
            p += 1;
        }
        let lines = p - start;
        let _ =
            writeln!(directory, "{kind:>8}{start:>8}{0:>8}{0:>8}{0:>8}{0:>8}{0:>8}{0:>8}{1:>8}D{d:>7}", 0, "00000000");
        let _ = writeln!(
            directory,
            "{kind:>8}{0:>8}{0:>8}{lines:>8}{0:>8}{1:>8}{1:>8}{2:>8}{0:>8}D{3:>7}",
            0,
            "",
            "SPLINE",
            d + 1
        );
        d += 2;
    }
    if d.max(p) > 9_999_999 {
        return Err(format!("{p} lines do not fit IGES's seven digits: write STEP instead"));
    }
    let text = |s: &str| format!("{}H{s}", s.len());
    let name: String = name.chars().filter(char::is_ascii_graphic).take(40).collect();
    let name = if name.is_empty() { "shape".to_owned() } else { name };
    let date = text("20000101.000000");
    let global: Vec<String> = [
        text(","),
        text(";"),
        text(&name),
        text("ondelette.igs"),
        text("Ondelette"),
        text("Ondelette"),
        "32".into(),
        "308".into(),
        "15".into(),
        "308".into(),
        "15".into(),
        text(&name),
        "1.".into(),
        "2".into(),
        text("MM"),
        "1".into(),
        "0.01".into(),
        date.clone(),
        "1.D-7".into(),
        real(largest),
        String::new(),
        String::new(),
        "11".into(),
        "0".into(),
        date,
    ]
    .into();
    let mut out = String::new();
    let _ = writeln!(out, "{:<72}S{:>7}", "B-spline geometry written by Ondelette", 1);
    let lines = packed(&global, 72);
    for (i, line) in lines.iter().enumerate() {
        let _ = writeln!(out, "{line:<72}G{:>7}", i + 1);
    }
    out.push_str(&directory);
    out.push_str(&parameters);
    let counts = format!("S{:>7}G{:>7}D{:>7}P{:>7}", 1, lines.len(), d - 1, p - 1);
    let _ = writeln!(out, "{counts:<72}T{:>7}", 1);
    Ok(out)
}

/// Fields with commas between and a semicolon at the end, in lines that split no field.
fn packed(fields: &[String], width: usize) -> Vec<String> {
    let mut out = vec![String::new()];
    for (i, field) in fields.iter().enumerate() {
        let piece = format!("{field}{}", if i + 1 == fields.len() { ';' } else { ',' });
        if out[out.len() - 1].len() + piece.len() > width {
            out.push(String::new());
        }
        if let Some(line) = out.last_mut() {
            line.push_str(&piece);
        }
    }
    out
}

fn flag(on: bool) -> String {
    u8::from(on).to_string()
}

fn curve_fields(c: &FreeCurve) -> Vec<String> {
    let knots = c.knots();
    let [a, b] = knots.domain();
    let mut out = vec!["126".to_owned(), (knots.points() - 1).to_string(), knots.degree().to_string()];
    out.extend([flag(c.dim() == 2), flag(c.is_closed()), flag(c.weights().is_none()), flag(false)]);
    out.extend(knots.values().iter().map(|k| real(*k)));
    out.extend((0..knots.points()).map(|i| real(c.weights().map_or(1.0, |w| w[i]))));
    out.extend(c.points().iter().flatten().map(|x| real(*x)));
    out.extend([real(a), real(b)]);
    out.extend([0.0, 0.0, f64::from(u8::from(c.dim() == 2))].map(real));
    out
}

fn surface_fields(s: &FreeSurface) -> Vec<String> {
    let [u, v] = s.knots();
    let mut out = vec!["128".to_owned()];
    out.extend([u.points() - 1, v.points() - 1, u.degree(), v.degree()].map(|n| n.to_string()));
    out.extend([flag(false), flag(false), flag(s.weights().is_none()), flag(false), flag(false)]);
    out.extend(u.values().iter().chain(v.values()).map(|k| real(*k)));
    let order = || (0..v.points()).flat_map(|j| (0..u.points()).map(move |i| (i, j)));
    out.extend(order().map(|(i, j)| real(s.weights().map_or(1.0, |w| w[i * v.points() + j]))));
    out.extend(order().flat_map(|(i, j)| s.points()[i * v.points() + j]).map(real));
    let ([a, b], [c, d]) = (u.domain(), v.domain());
    out.extend([a, b, c, d].map(real));
    out
}
