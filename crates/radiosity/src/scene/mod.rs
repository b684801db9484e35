//! The validated scene: patches with two sides, materials, a camera, units.
//!
//! File -> [`SceneDraft`] (whatever the file said, faces as polygons) -> [`SceneDraft::build`] -> [`Scene`] (cannot be
//! wrong: finite, non-degenerate parallelograms and triangles, reflectances below 1).
//!
//! Meaning of the numbers, fixed for the whole project:
//! * emission is **radiance** L (photometric scenes: luminance), so the exitance of an emitter is pi * L;
//! * the **front** of a patch is the side from which its corners run counter-clockwise; a one-sided patch reflects and
//!   emits at its front, and its back is opaque black for every ray but those of the camera;
//! * a two-sided material makes two [`Side`]s of one patch: two receivers and two emitters that share one geometry.

mod check;
mod cut;
mod describe;
mod draft;
mod emitter;
mod merge;
mod polygon;
mod repaint;
pub mod samples;

pub use describe::describe;
pub use draft::{BuildOptions, DraftFace, LARGEST_COORDINATE, MOST_CORNERS, SMALLEST_DIAGONAL, SceneDraft, SceneError};
pub use emitter::Emitter;
pub use repaint::{Paint, PaintError};

use crate::rgb::Rgb;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Whether the scene's emission is radiometric (W) or photometric (lm).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Quantity {
    /// Radiance in W/(m^2 sr), irradiance in W/m^2.
    Radiometric,
    /// Luminance in cd/m^2, illuminance in lx.
    Photometric,
}

impl Quantity {
    /// Unit of irradiance (illuminance) and radiosity (luminous exitance).
    pub fn irradiance_unit(self) -> &'static str {
        match self {
            Quantity::Radiometric => "W/m^2",
            Quantity::Photometric => "lx",
        }
    }

    /// What radiance is called.
    pub fn radiance_name(self) -> &'static str {
        match self {
            Quantity::Radiometric => "radiance",
            Quantity::Photometric => "luminance",
        }
    }

    /// What irradiance is called.
    pub fn irradiance_name(self) -> &'static str {
        match self {
            Quantity::Radiometric => "irradiance",
            Quantity::Photometric => "illuminance",
        }
    }

    /// Unit of emitted radiance (luminance).
    pub fn radiance_unit(self) -> &'static str {
        match self {
            Quantity::Radiometric => "W/(m^2 sr)",
            Quantity::Photometric => "cd/m^2",
        }
    }

    /// Unit of power (luminous flux).
    pub fn power_unit(self) -> &'static str {
        match self {
            Quantity::Radiometric => "W",
            Quantity::Photometric => "lm",
        }
    }
}

/// The length unit of the coordinates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LengthUnit {
    /// Metres in one scene unit.
    pub metres: f64,
    /// Whether the file or its format states the unit (glTF: metres) or we assume it (OBJ: metres).
    pub stated: bool,
}

/// A diffuse material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// Diffuse reflectance, each channel in [0, 1).
    pub reflectance: Rgb,
    /// Emitted radiance L in [`Quantity::radiance_unit`]; exitance is pi * L.
    pub radiance: Rgb,
    /// Whether the back reflects and emits like the front.
    pub two_sided: bool,
}

impl Material {
    /// Whether anything made of it ever sends light.
    pub fn sends_light(&self) -> bool {
        self.radiance.max() > 0.0 || self.reflectance.max() > 0.0
    }

    /// Whether it only emits: such sides receive too, but the promised error does not count them.
    pub fn is_pure_emitter(&self) -> bool {
        self.reflectance.max() == 0.0 && self.radiance.max() > 0.0
    }
}

/// A mesh instance of the file: an OBJ object, or one primitive under one glTF node.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Object {
    /// Name in the file (for glTF: node name, with the primitive's index where the mesh has several).
    pub name: String,
    /// Index of the mesh in the file.
    pub mesh: u32,
    /// Index of the primitive in that mesh.
    pub primitive: u32,
}

/// Shape of a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Shape {
    /// Points o + s u + t v for (s, t) in the unit square.
    Parallelogram,
    /// The same for s, t >= 0, s + t <= 1.
    Triangle,
}

/// The way back from a patch to the faces of the file that it was made of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Index into [`Scene::objects`].
    pub object: u32,
    /// Index of each face (OBJ) or triangle (glTF) of that object under this patch: one or two.
    pub faces: Vec<u32>,
    /// First texture coordinates at the patch's corners (o, o+u, o+v and for parallelograms o+u+v), if the file has
    /// them.
    pub uv0: Option<[[f64; 2]; 4]>,
    /// Second texture coordinates (lightmaps), likewise.
    pub uv1: Option<[[f64; 2]; 4]>,
}

/// A flat piece of surface: the root of one quad-tree per side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Patch {
    /// Parallelogram or triangle.
    pub shape: Shape,
    /// Corner o, in scene units.
    pub origin: DVec3,
    /// Edge u from the corner.
    pub u: DVec3,
    /// Edge v from the corner; the front is where u x v points.
    pub v: DVec3,
    /// Index into [`Scene::materials`].
    pub material: u32,
    /// Where it came from.
    pub provenance: Provenance,
}

impl Patch {
    /// Area in scene units squared.
    pub fn area(&self) -> f64 {
        let parallelogram = self.u.cross(self.v).length();
        match self.shape {
            Shape::Parallelogram => parallelogram,
            Shape::Triangle => 0.5 * parallelogram,
        }
    }

    /// Unit normal of the front.
    pub fn normal(&self) -> DVec3 {
        self.u.cross(self.v).normalize()
    }

    /// Corners counter-clockwise as seen from the front; three or four.
    pub fn corners(&self) -> Vec<DVec3> {
        let (o, u, v) = (self.origin, self.u, self.v);
        match self.shape {
            Shape::Parallelogram => vec![o, o + u, o + u + v, o + v],
            Shape::Triangle => vec![o, o + u, o + v],
        }
    }
}

/// One reflecting, emitting, receiving side of a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Side {
    /// Index into [`Scene::patches`].
    pub patch: u32,
    /// Whether this is the back (parameters s and t change places, the normal turns round).
    pub back: bool,
}

/// A pinhole camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Eye point.
    pub eye: DVec3,
    /// Point looked at.
    pub at: DVec3,
    /// Up direction.
    pub up: DVec3,
    /// Vertical field of view in degrees.
    pub fov: f64,
}

impl Camera {
    /// Whether it looks somewhere, at an angle that makes a picture.
    pub fn is_usable(&self) -> bool {
        let view = self.at - self.eye;
        let finite = self.eye.is_finite() && self.at.is_finite() && self.up.is_finite();
        finite && view.length() > 0.0 && view.cross(self.up).length() > 0.0 && self.fov > 0.0 && self.fov < 180.0
    }
}

/// What a scene is: the input of the solver. Made by [`SceneDraft::build`] and never wrong.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Name (the file's stem or the built-in's name).
    pub name: String,
    /// Length unit.
    pub unit: LengthUnit,
    /// Radiometric or photometric.
    pub quantity: Quantity,
    /// Materials.
    pub materials: Vec<Material>,
    /// Mesh instances.
    pub objects: Vec<Object>,
    /// Patches.
    pub patches: Vec<Patch>,
    /// Sides that reflect, emit and receive: the fronts in patch order, each followed by its back if two-sided.
    pub sides: Vec<Side>,
    /// The file's camera.
    pub camera: Option<Camera>,
    /// What the import changed or ignored, one sentence each.
    pub warnings: Vec<String>,
    /// Axis-aligned box of all patches.
    pub bounds: [DVec3; 2],
}

impl Scene {
    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        let names = |length: usize| length + size_of::<String>();
        let materials = self.materials.iter().map(|m| size_of::<Material>() + m.name.len()).sum::<usize>();
        let objects = self.objects.iter().map(|o| size_of::<Object>() + o.name.len()).sum::<usize>();
        // beside the faces of each, what the allocator adds and rounds up to
        let faces = |p: &Patch| (size_of_val(&*p.provenance.faces) + 8).next_multiple_of(16).max(32);
        let patches = self.patches.iter().map(|p| size_of::<Patch>() + faces(p)).sum::<usize>();
        let warnings = self.warnings.iter().map(|w| names(w.len())).sum::<usize>();
        (size_of::<Scene>() + materials + objects + patches + size_of_val(&*self.sides) + warnings) as u64
    }

    /// Material of a side.
    pub fn material(&self, side: Side) -> &Material {
        &self.materials[self.patches[side.patch as usize].material as usize]
    }

    /// Corner and edges (o, e1, e2) of a side, such that e1 x e2 is its normal.
    pub fn frame(&self, side: Side) -> (DVec3, DVec3, DVec3) {
        let p = &self.patches[side.patch as usize];
        if side.back { (p.origin, p.v, p.u) } else { (p.origin, p.u, p.v) }
    }

    /// Whether any side emits.
    pub fn has_emitter(&self) -> bool {
        self.sides.iter().any(|&s| self.material(s).radiance.sum() > 0.0)
    }

    /// Length of the diagonal of [`Scene::bounds`].
    pub fn diagonal(&self) -> f64 {
        self.bounds[0].distance(self.bounds[1])
    }
}
