//! From the polygons of a file to a valid [`Scene`].

use super::cut;
use super::merge::{self, Piece};
use super::polygon;
use super::{Camera, LengthUnit, Material, Object, Patch, Provenance, Quantity, Scene, Shape, Side};
use glam::DVec3;
use std::collections::HashSet;

/// One polygon of a file, with any number of corners.
#[derive(Clone, Debug)]
pub struct DraftFace {
    /// Corners counter-clockwise as seen from the front.
    pub corners: Vec<DVec3>,
    /// First texture coordinates, one a corner, or empty.
    pub uv0: Vec<[f64; 2]>,
    /// Second texture coordinates, one a corner, or empty.
    pub uv1: Vec<[f64; 2]>,
    /// Index into [`SceneDraft::materials`].
    pub material: u32,
    /// Index into [`SceneDraft::objects`].
    pub object: u32,
    /// Index of the face in its object, counted in the file.
    pub index: u32,
    /// Line in the file, where the format has lines.
    pub line: Option<u32>,
}

/// What a file said, before it is checked.
#[derive(Clone, Debug)]
pub struct SceneDraft {
    /// Name for reports and output files.
    pub name: String,
    /// Length unit.
    pub unit: LengthUnit,
    /// Radiometric or photometric.
    pub quantity: Quantity,
    /// Materials, reflectances already checked or clamped by the reader.
    pub materials: Vec<Material>,
    /// Mesh instances.
    pub objects: Vec<Object>,
    /// Faces.
    pub faces: Vec<DraftFace>,
    /// Camera of the file.
    pub camera: Option<Camera>,
    /// Warnings of the reader.
    pub warnings: Vec<String>,
}

/// How to read a draft.
#[derive(Clone, Copy, Debug, Default)]
pub struct BuildOptions {
    /// Treat every material as two-sided (`--two-sided`, for OBJ).
    pub two_sided: bool,
}

/// Coordinates beyond this are refused: products of three lengths must stay finite in single precision, in which rays
/// are traced.
pub const LARGEST_COORDINATE: f64 = 1e12;

/// A scene whose diagonal is below this is refused, for the same reason.
pub const SMALLEST_DIAGONAL: f64 = 1e-9;

/// A polygon with more corners is refused: cutting it into triangles costs up to the square of their number.
pub const MOST_CORNERS: usize = 10_000;

/// Radiances that squares and products of f64 can carry; 0 is none.
pub(super) const RADIANCES: std::ops::RangeInclusive<f64> = 1e-30..=1e30;

/// Why a draft is not a scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// Nothing left to light.
    #[error("the scene '{0}' has no face with an area: nothing to light")]
    Empty(String),
    /// A NaN or an infinity.
    #[error("{what} of {place} is not a finite number: correct it in the file")]
    NotFinite {
        /// Which number.
        what: &'static str,
        /// Where it stands.
        place: String,
    },
    /// A coordinate too large to trace rays with.
    #[error(
        "{place} has a coordinate of {value:e}, beyond the limit of {LARGEST_COORDINATE:e}: \
         move the scene to the origin or choose a larger unit"
    )]
    TooFar {
        /// The face.
        place: String,
        /// The coordinate.
        value: f64,
    },
    /// A polygon with too many corners to cut.
    #[error("{place} has {corners} corners, more than the limit of {MOST_CORNERS}: cut it into smaller faces")]
    TooManyCorners {
        /// The face.
        place: String,
        /// Its corners.
        corners: usize,
    },
    /// A scene too small to trace rays in.
    #[error("the scene is only {0:e} units across, below the limit of {SMALLEST_DIAGONAL:e}: choose a smaller unit")]
    TooSmall(f64),
    /// A reflectance outside [0, 1).
    #[error(
        "material '{material}' has a reflectance of {value}, outside [0, 1): \
         no surface reflects all the light it gets; lower it"
    )]
    Reflectance {
        /// Name of the material.
        material: String,
        /// The worst channel.
        value: f64,
    },
    /// A radiance below zero, or so large or small that its square is no number any more.
    #[error(
        "material '{material}' emits a radiance of {value}: light cannot be negative, \
         and must be 0 or from 1e-30 to 1e30"
    )]
    Radiance {
        /// Name of the material.
        material: String,
        /// The worst channel.
        value: f64,
    },
    /// A length unit that is not a length.
    #[error("the length unit of the scene is {0} m; it must be a finite length above zero")]
    Unit(f64),
    /// A face that names a material or object that is not there.
    #[error("{place} refers to {what} {index}, but there are only {count}")]
    Index {
        /// The face.
        place: String,
        /// Material or object.
        what: &'static str,
        /// The index.
        index: u32,
        /// How many there are.
        count: usize,
    },
}

/// How many faces something happened to, and where first.
#[derive(Default)]
struct Tally {
    count: usize,
    first: String,
}

impl Tally {
    fn add(&mut self, place: impl FnOnce() -> String) {
        if self.count == 0 {
            self.first = place();
        }
        self.count += 1;
    }

    fn warn(self, what: &str, warnings: &mut Vec<String>) {
        if self.count > 0 {
            let (n, s) = (self.count, if self.count == 1 { "" } else { "s" });
            warnings.push(format!("{n} {}; the first is {}", what.replace("(s)", s), self.first));
        }
    }
}

impl SceneDraft {
    /// Checks the draft and turns its polygons into patches.
    ///
    /// Quadrilaterals that close as a parallelogram stay one patch; pairs of triangles of one object and material that
    /// make one are merged; every other polygon becomes triangles. Faces without area and repeated faces (same
    /// corners, same facing; any facing once a two-sided face is there) are dropped, with one warning each that counts
    /// them and names the first.
    /// A face that touches another, or lies on it, is legal; patches that others divide into rooms are cut there.
    ///
    /// **Cost** O(n log n) in the number of corners.
    ///
    /// **Errors** [`SceneError`] for numbers that are not finite or out of range, for indices out of range, and for a
    /// draft in which no face has an area.
    ///
    /// ```
    /// use glam::DVec3;
    /// use ondelette_radiosity::scene::{BuildOptions, DraftFace, LengthUnit, Material, Object, Quantity, SceneDraft};
    /// use ondelette_radiosity::scene::{SceneError, Shape};
    /// use ondelette_radiosity::Rgb;
    /// let corners = [[0., 0., 0.], [2., 0., 0.], [2., 1., 0.], [0., 1., 0.]];
    /// let floor = DraftFace {
    ///     corners: corners.map(DVec3::from).to_vec(),
    ///     uv0: vec![],
    ///     uv1: vec![],
    ///     material: 0,
    ///     object: 0,
    ///     index: 0,
    ///     line: Some(7),
    /// };
    /// let white = Material {
    ///     name: "white".into(),
    ///     reflectance: Rgb::grey(0.7),
    ///     radiance: Rgb::BLACK,
    ///     two_sided: false,
    /// };
    /// let mut draft = SceneDraft {
    ///     name: "floor".into(),
    ///     unit: LengthUnit { metres: 1.0, stated: false },
    ///     quantity: Quantity::Radiometric,
    ///     materials: vec![white],
    ///     objects: vec![Object { name: "floor".into(), mesh: 0, primitive: 0 }],
    ///     faces: vec![floor],
    ///     camera: None,
    ///     warnings: vec![],
    /// };
    /// let scene = draft.clone().build(BuildOptions { two_sided: true })?;
    /// assert_eq!(scene.patches[0].shape, Shape::Parallelogram);
    /// assert_eq!(scene.sides.len(), 2);
    ///
    /// draft.faces[0].corners[1].x = f64::NAN;
    /// let refused = draft.build(BuildOptions::default()).unwrap_err();
    /// assert!(refused.to_string().contains("line 7"));
    /// # Ok::<(), SceneError>(())
    /// ```
    pub fn build(mut self, options: BuildOptions) -> Result<Scene, SceneError> {
        self.check()?;
        let mut warnings = std::mem::take(&mut self.warnings);
        if options.two_sided {
            self.materials.iter_mut().for_each(|m| m.two_sided = true);
        }
        let (mut patches, divided) = cut::cut(self.patches(&mut warnings));
        patches.shrink_to_fit();
        if divided > 0 {
            let (s, are) = if divided == 1 { ("", "is") } else { ("es", "are") };
            warnings.push(format!(
                "{divided} patch{s} {are} divided by walls that stand on or cross them: cut along these"
            ));
        }
        if patches.is_empty() {
            return Err(SceneError::Empty(self.name));
        }
        let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let mut sides = Vec::with_capacity(patches.len());
        for (n, patch) in (0u32..).zip(&patches) {
            for corner in patch.corners() {
                bounds = [bounds[0].min(corner), bounds[1].max(corner)];
            }
            sides.push(Side { patch: n, back: false });
            if self.materials[patch.material as usize].two_sided {
                sides.push(Side { patch: n, back: true });
            }
        }
        let diagonal = bounds[0].distance(bounds[1]);
        if diagonal < SMALLEST_DIAGONAL {
            return Err(SceneError::TooSmall(diagonal));
        }
        let camera = self.camera.filter(Camera::is_usable);
        if camera != self.camera {
            warnings.push("the camera of the file is not usable (no direction, or no field of view): ignored".into());
        }
        sides.shrink_to_fit();
        Ok(Scene {
            name: self.name,
            unit: self.unit,
            quantity: self.quantity,
            materials: self.materials,
            objects: self.objects,
            patches,
            sides,
            camera,
            warnings,
            bounds,
        })
    }

    /// A face in words.
    fn place(&self, face: &DraftFace) -> String {
        let object = self.objects.get(face.object as usize).map_or("?", |o| o.name.as_str());
        match face.line {
            Some(line) => format!("face {} of object '{object}' (line {line})", face.index),
            None => format!("face {} of object '{object}'", face.index),
        }
    }

    /// Everything that makes the whole draft unusable.
    fn check(&self) -> Result<(), SceneError> {
        if !(self.unit.metres.is_finite() && self.unit.metres > 0.0) {
            return Err(SceneError::Unit(self.unit.metres));
        }
        for m in &self.materials {
            let place = || format!("material '{}'", m.name);
            if !m.reflectance.is_finite() {
                return Err(SceneError::NotFinite { what: "the reflectance", place: place() });
            }
            if !m.radiance.is_finite() {
                return Err(SceneError::NotFinite { what: "the radiance", place: place() });
            }
            if let Some(&value) = m.reflectance.0.iter().find(|c| !(0.0..1.0).contains(*c)) {
                return Err(SceneError::Reflectance { material: m.name.clone(), value });
            }
            if let Some(&value) = m.radiance.0.iter().find(|&&c| c != 0.0 && !RADIANCES.contains(&c)) {
                return Err(SceneError::Radiance { material: m.name.clone(), value });
            }
        }
        for face in &self.faces {
            for (what, index, count) in
                [("material", face.material, self.materials.len()), ("object", face.object, self.objects.len())]
            {
                if index as usize >= count {
                    return Err(SceneError::Index { place: self.place(face), what, index, count });
                }
            }
            if face.corners.len() > MOST_CORNERS {
                return Err(SceneError::TooManyCorners { place: self.place(face), corners: face.corners.len() });
            }
            for corner in &face.corners {
                if !corner.is_finite() {
                    return Err(SceneError::NotFinite { what: "a corner", place: self.place(face) });
                }
                let value = corner.abs().max_element();
                if value > LARGEST_COORDINATE {
                    return Err(SceneError::TooFar { place: self.place(face), value });
                }
            }
            if face.uv0.iter().chain(&face.uv1).flatten().any(|c| !c.is_finite()) {
                return Err(SceneError::NotFinite { what: "a texture coordinate", place: self.place(face) });
            }
        }
        Ok(())
    }

    /// Patches in file order: a merged pair stands where its earlier triangle stood.
    fn patches(&self, warnings: &mut Vec<String>) -> Vec<Patch> {
        let (mut flat, mut twice, mut crossed) = (Tally::default(), Tally::default(), Tally::default());
        let mut seen = HashSet::with_capacity(self.faces.len());
        // Patches in file order; a triangle's slot is emptied when it joins an earlier one.
        let mut slots: Vec<Option<Patch>> = Vec::with_capacity(self.faces.len());
        let mut pieces: Vec<Piece> = Vec::new();
        let mut slot_of: Vec<usize> = Vec::new();
        for face in &self.faces {
            let kept = distinct_corners(&face.corners);
            let corners: Vec<DVec3> = kept.iter().map(|&i| face.corners[i]).collect();
            if polygon::is_thin(&corners) {
                flat.add(|| self.place(face));
                continue;
            }
            if !seen.insert(outline(corners.iter())) {
                twice.add(|| self.place(face));
                continue;
            }
            if self.materials[face.material as usize].two_sided {
                // Its back is there already: a copy that faces the other way repeats it.
                seen.insert(outline(corners.iter().rev()));
            }
            let at = |uv: &Vec<[f64; 2]>, i: usize| {
                if uv.len() == face.corners.len() { Some(uv[kept[i]]) } else { None }
            };
            if let Ok(quad) = <&[DVec3; 4]>::try_from(corners.as_slice())
                && polygon::is_parallelogram(quad)
            {
                let four = |uv| Some([at(uv, 0)?, at(uv, 1)?, at(uv, 3)?, at(uv, 2)?]);
                slots.push(Some(Patch {
                    shape: Shape::Parallelogram,
                    origin: quad[0],
                    u: quad[1] - quad[0],
                    v: quad[3] - quad[0],
                    material: face.material,
                    provenance: Provenance {
                        object: face.object,
                        faces: vec![face.index],
                        uv0: four(&face.uv0),
                        uv1: four(&face.uv1),
                    },
                }));
                continue;
            }
            let cut = polygon::triangulate(&corners);
            if !cut.covers {
                crossed.add(|| self.place(face));
            }
            for t in cut.triangles {
                let triangle = t.map(|i| corners[i]);
                if polygon::is_thin(&triangle) {
                    continue;
                }
                let three = |uv| Some([at(uv, t[0])?, at(uv, t[1])?, at(uv, t[2])?]);
                let piece = Piece {
                    corners: triangle,
                    uv: [three(&face.uv0), three(&face.uv1)],
                    group: (face.object, face.material),
                    face: face.index,
                };
                slot_of.push(slots.len());
                slots.push(Some(lone(&piece)));
                pieces.push(piece);
            }
        }
        flat.warn("zero-area face(s) dropped", warnings);
        twice.warn("duplicate face(s) dropped", warnings);
        crossed.warn("face(s) with an outline that crosses itself, cut into triangles as well as could be", warnings);

        for pair in merge::pairs(&pieces) {
            let (first, second) = (pair.first.0 as usize, pair.second.0 as usize);
            slots[slot_of[first]] = Some(joined(&pieces[first], pair.first.1, &pieces[second], pair.second.1));
            slots[slot_of[second]] = None;
        }
        slots.into_iter().flatten().collect()
    }
}

/// Indices of the corners that differ from the one before them.
fn distinct_corners(corners: &[DVec3]) -> Vec<usize> {
    let n = corners.len();
    (0..n).filter(|&i| n == 1 || corners[i] != corners[(i + n - 1) % n]).collect()
}

/// The cyclic sequence of corners, started at its smallest: equal for faces with the same corners and facing.
fn outline<'a>(corners: impl Iterator<Item = &'a DVec3>) -> Vec<[u64; 3]> {
    let mut ids: Vec<[u64; 3]> = corners.map(|&c| merge::bits(c)).collect();
    let start = (0..ids.len()).min_by_key(|&i| (ids[i], ids[(i + 1) % ids.len()])).unwrap_or(0);
    ids.rotate_left(start);
    ids
}

/// A triangle that found no partner.
fn lone(p: &Piece) -> Patch {
    let uv = |set: usize| p.uv[set].map(|[a, b, c]| [a, b, c, [b[0] + c[0] - a[0], b[1] + c[1] - a[1]]]);
    Patch {
        shape: Shape::Triangle,
        origin: p.corners[0],
        u: p.corners[1] - p.corners[0],
        v: p.corners[2] - p.corners[0],
        material: p.group.1,
        provenance: Provenance { object: p.group.0, faces: vec![p.face], uv0: uv(0), uv1: uv(1) },
    }
}

/// The parallelogram of `p` and `q`: o starts the shared edge of `p` (its corner `j`), o+u is corner `k` of `q`, o+v
/// is the corner of `p` off the shared edge.
fn joined(p: &Piece, j: usize, q: &Piece, k: usize) -> Patch {
    let (end, off) = ((j + 1) % 3, (j + 2) % 3);
    let uv = |set: usize| match (&p.uv[set], &q.uv[set]) {
        (Some(a), Some(b)) => Some([a[j], b[k], a[off], a[end]]),
        _ => None,
    };
    let mut faces = vec![p.face, q.face];
    faces.sort_unstable();
    faces.dedup();
    Patch {
        shape: Shape::Parallelogram,
        origin: p.corners[j],
        u: q.corners[k] - p.corners[j],
        v: p.corners[off] - p.corners[j],
        material: p.group.1,
        provenance: Provenance { object: p.group.0, faces, uv0: uv(0), uv1: uv(1) },
    }
}
