//! Wavefront OBJ: polygons with any number of corners, objects and groups, materials from MTL.
//!
//! Own reader rather than a crate: faces must keep their corners (quadrilaterals stay patches), coordinates their full
//! precision, every error its line, and the usual crate panics on short `Kd` lines.
//! Free-form curves, lines, points and normals are ignored.

use super::mtl::{DEFAULT_REFLECTANCE, Library};
use super::{ReadError, read_bytes, stem};
use glam::DVec3;
use ondelette_radiosity::Rgb;
use ondelette_radiosity::scene::{DraftFace, LengthUnit, Material, Object, Quantity, SceneDraft};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// One statement of an OBJ or MTL file: comments removed, continued lines joined.
pub(super) struct Statement<'a> {
    path: &'a Path,
    /// Line on which it starts, from 1.
    pub(super) line: u32,
    /// First word.
    pub(super) keyword: String,
    /// All after the first word, trimmed.
    pub(super) rest: String,
}

impl Statement<'_> {
    /// An error at this line.
    pub(super) fn error(&self, message: String) -> ReadError {
        ReadError::Line { path: self.path.into(), line: self.line, message }
    }

    /// The words after the keyword, up to a comment.
    fn words(&self) -> impl Iterator<Item = &str> {
        self.rest.split_whitespace().take_while(|w| !w.starts_with('#'))
    }

    /// The finite numbers after the keyword.
    pub(super) fn numbers(&self) -> Result<Vec<f64>, ReadError> {
        self.words().map(|word| self.number(word)).collect()
    }

    fn number(&self, word: &str) -> Result<f64, ReadError> {
        match word.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(x),
            Ok(_) => Err(self.error(format!("'{word}' after {} is not a finite number", self.keyword))),
            Err(_) => Err(self.error(format!("'{word}' after {} is not a number", self.keyword))),
        }
    }
}

/// The statements of a text, in order.
pub(super) struct Statements<'a> {
    path: &'a Path,
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
}

impl<'a> Statements<'a> {
    pub(super) fn new(path: &'a Path, text: &'a str) -> Self {
        Statements { path, lines: text.trim_start_matches('\u{feff}').lines().enumerate() }
    }
}

impl<'a> Iterator for Statements<'a> {
    type Item = Statement<'a>;

    fn next(&mut self) -> Option<Statement<'a>> {
        loop {
            let (number, first) = self.lines.next()?;
            let mut whole = first.trim().to_string();
            if whole.is_empty() || whole.starts_with('#') {
                continue;
            }
            while whole.ends_with('\\') {
                whole.pop();
                whole.push(' ');
                let Some((_, next)) = self.lines.next() else { break };
                whole.push_str(next.trim());
            }
            let whole = whole.trim();
            let (keyword, rest) = whole.split_once(char::is_whitespace).unwrap_or((whole, ""));
            if keyword.is_empty() {
                continue;
            }
            let line = u32::try_from(number + 1).unwrap_or(u32::MAX);
            return Some(Statement { path: self.path, line, keyword: keyword.into(), rest: rest.trim().into() });
        }
    }
}

/// A face whose indices are not yet checked: positions and texture coordinates from 0, and where it stands.
struct RawFace {
    corners: Vec<(usize, Option<usize>)>,
    material: Option<u32>,
    object: u32,
    index: u32,
    line: u32,
}

/// What has been read so far.
#[derive(Default)]
struct Reader {
    positions: Vec<DVec3>,
    texture: Vec<[f64; 2]>,
    faces: Vec<RawFace>,
    objects: Vec<Object>,
    object_by_name: HashMap<String, u32>,
    /// Faces of each object so far.
    counts: Vec<u32>,
    object: Option<u32>,
    /// Names after `usemtl` and the line of the first use.
    used: Vec<(String, u32)>,
    used_by_name: HashMap<String, u32>,
    material: Option<u32>,
    library: Library,
    warnings: Vec<String>,
    ignored: Option<(usize, String, u32)>,
}

/// Reads an OBJ file and the MTL files that it names.
pub(super) fn read(path: &Path) -> Result<SceneDraft, ReadError> {
    let bytes = read_bytes(path)?;
    let text = String::from_utf8_lossy(&bytes);
    let mut reader = Reader::default();
    for statement in Statements::new(path, &text) {
        reader.statement(&statement, path)?;
    }
    reader.finish(path)
}

impl Reader {
    fn statement(&mut self, s: &Statement<'_>, path: &Path) -> Result<(), ReadError> {
        match s.keyword.as_str() {
            "v" => {
                let n = s.numbers()?;
                let &[x, y, z, ..] = n.as_slice() else {
                    return Err(s.error(format!("a vertex needs three coordinates, but has {}", n.len())));
                };
                self.positions.push(DVec3::new(x, y, z));
            }
            "vt" => {
                let n = s.numbers()?;
                let Some(&u) = n.first() else {
                    return Err(s.error("a texture coordinate needs a number".into()));
                };
                self.texture.push([u, n.get(1).copied().unwrap_or(0.0)]);
            }
            "f" | "fo" => self.face(s, path)?,
            "o" | "g" => self.object = Some(self.named_object(if s.rest.is_empty() { "default" } else { &s.rest })),
            "usemtl" => {
                let next = u32::try_from(self.used.len()).unwrap_or(u32::MAX);
                let index = *self.used_by_name.entry(s.rest.clone()).or_insert(next);
                if index == next {
                    self.used.push((s.rest.clone(), s.line));
                }
                self.material = Some(index);
            }
            "mtllib" => self.libraries(s, path)?,
            "vn" | "vp" | "s" | "mg" | "usemap" | "lod" | "shadow_obj" | "trace_obj" | "bevel" | "c_interp"
            | "d_interp" => {}
            other => {
                let (count, ..) = self.ignored.get_or_insert_with(|| (0, other.into(), s.line));
                *count += 1;
            }
        }
        Ok(())
    }

    fn libraries(&mut self, s: &Statement<'_>, path: &Path) -> Result<(), ReadError> {
        let beside =
            |name: &str| -> PathBuf { path.parent().unwrap_or_else(|| Path::new("")).join(name.replace('\\', "/")) };
        // A name may hold spaces; several names may stand on a line.
        let whole = beside(&s.rest);
        let files = if whole.is_file() { vec![whole] } else { s.words().map(beside).collect() };
        for file in files {
            self.library.add(&file, &mut self.warnings).map_err(|error| match error {
                ReadError::Open { path, reason } => s.error(format!(
                    "the material file {} cannot be read ({reason}); put it there, or remove this line to use \
                     reflectance {DEFAULT_REFLECTANCE} everywhere",
                    path.display()
                )),
                other => other,
            })?;
        }
        Ok(())
    }

    fn named_object(&mut self, name: &str) -> u32 {
        if let Some(&index) = self.object_by_name.get(name) {
            return index;
        }
        let index = u32::try_from(self.objects.len()).unwrap_or(u32::MAX);
        self.objects.push(Object { name: name.to_string(), mesh: index, primitive: 0 });
        self.counts.push(0);
        self.object_by_name.insert(name.to_string(), index);
        index
    }

    fn face(&mut self, s: &Statement<'_>, path: &Path) -> Result<(), ReadError> {
        let mut corners = Vec::with_capacity(4);
        for word in s.words() {
            let mut parts = word.split('/');
            let position = parts.next().unwrap_or("");
            let texture = parts.next().filter(|t| !t.is_empty());
            corners.push((
                reference(s, word, position, self.positions.len())?,
                texture.map(|t| reference(s, word, t, self.texture.len())).transpose()?,
            ));
        }
        let object = match self.object {
            Some(object) => object,
            None => self.named_object(&stem(path)),
        };
        self.object = Some(object);
        let count = &mut self.counts[object as usize];
        let index = *count;
        *count += 1;
        self.faces.push(RawFace { corners, material: self.material, object, index, line: s.line });
        Ok(())
    }

    /// Checks the references and gives every face its material.
    fn finish(mut self, path: &Path) -> Result<SceneDraft, ReadError> {
        let at = |line: u32, message: String| ReadError::Line { path: path.into(), line, message };
        let mut materials = self.library.materials;
        let mut resolved = Vec::with_capacity(self.used.len());
        for (name, line) in &self.used {
            let Some(&index) = self.library.by_name.get(name) else {
                return Err(at(*line, format!("material '{name}' is not defined in any mtllib of this file")));
            };
            resolved.push(index);
        }
        let bare = self.faces.iter().filter(|f| f.material.is_none()).count();
        let default = u32::try_from(materials.len()).unwrap_or(u32::MAX);
        if bare > 0 {
            self.warnings.push(format!(
                "{bare} face{} without a material: reflectance {DEFAULT_REFLECTANCE} is assumed",
                if bare == 1 { "" } else { "s" }
            ));
            materials.push(Material {
                name: "(no material)".into(),
                reflectance: Rgb::grey(DEFAULT_REFLECTANCE),
                radiance: Rgb::BLACK,
                two_sided: false,
            });
        }
        if let Some((count, keyword, line)) = self.ignored {
            self.warnings.push(format!(
                "{count} statement{} ignored; the first is '{keyword}' at line {line}",
                if count == 1 { "" } else { "s" }
            ));
        }
        let mut faces = Vec::with_capacity(self.faces.len());
        for face in self.faces {
            let mut corners = Vec::with_capacity(face.corners.len());
            let mut uv0 = Vec::new();
            for &(position, texture) in &face.corners {
                corners.push(*self.positions.get(position).ok_or_else(|| {
                    let (n, have) = (position + 1, self.positions.len());
                    at(face.line, format!("the face refers to vertex {n}, but the file has only {have}"))
                })?);
                if let Some(texture) = texture {
                    uv0.push(*self.texture.get(texture).ok_or_else(|| {
                        let (n, have) = (texture + 1, self.texture.len());
                        at(
                            face.line,
                            format!("the face refers to texture coordinate {n}, but the file has only {have}"),
                        )
                    })?);
                }
            }
            if uv0.len() != corners.len() {
                uv0.clear();
            }
            faces.push(DraftFace {
                corners,
                uv0,
                uv1: Vec::new(),
                material: face.material.map_or(default, |m| resolved[m as usize]),
                object: face.object,
                index: face.index,
                line: Some(face.line),
            });
        }
        Ok(SceneDraft {
            name: stem(path),
            unit: LengthUnit { metres: 1.0, stated: false },
            quantity: Quantity::Radiometric,
            materials,
            objects: self.objects,
            faces,
            camera: None,
            warnings: self.warnings,
        })
    }
}

/// An index from 0: the file counts from 1, or backwards from the last with negative numbers.
fn reference(s: &Statement<'_>, word: &str, part: &str, so_far: usize) -> Result<usize, ReadError> {
    let wrong = |why: &str| s.error(format!("'{word}' is not a corner of a face: {why}"));
    let number: i64 = part.parse().map_err(|_| wrong("expected v, v/vt, v//vn or v/vt/vn with whole numbers"))?;
    match number {
        0 => Err(wrong("indices count from 1")),
        n if n > 0 => usize::try_from(n - 1).map_err(|_| wrong("the index is too large")),
        n => usize::try_from(n.unsigned_abs())
            .ok()
            .and_then(|back| so_far.checked_sub(back))
            .ok_or_else(|| wrong(&format!("only {so_far} precede it"))),
    }
}
