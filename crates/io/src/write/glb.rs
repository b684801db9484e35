//! Lit models: binary glTF 2.0 with vertex colours and an unlit material.
//!
//! One JSON chunk and one binary chunk. The material is `KHR_materials_unlit`: a viewer shows base colour times
//! `COLOR_0`, takes both as linear, and encodes to sRGB itself. Colours are therefore *displayed* linear values in [0,
//! 1], exposure and tone curve already applied ([`super::ToneMap::display`]); `asset.extras` says which.

use super::{WriteError, write_bytes};
use ondelette_radiosity::scene::Camera;
use serde_json::{Value, json};
use std::path::Path;

/// One mesh of a lit model: triangles with a colour at each vertex.
#[derive(Clone, Debug, Default)]
pub struct LitMesh {
    /// Name of the node and of the mesh.
    pub name: String,
    /// Vertex positions, in metres as glTF wants.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals, one a vertex, or empty: an unlit material does not need them.
    pub normals: Vec<[f32; 3]>,
    /// Linear display colours, one a vertex; clamped to [0, 1], stored as normalised 16-bit integers.
    pub colors: Vec<[f32; 3]>,
    /// Three vertex indices a triangle, counter-clockwise seen from the front.
    pub indices: Vec<u32>,
    /// Whether viewers shall draw the back too.
    pub double_sided: bool,
}

/// What the colours of a lit model mean: written as `asset.extras`.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelNote {
    /// What was solved for, such as "radiosity" or "luminous exitance".
    pub quantity: String,
    /// Its unit, such as "W/m^2".
    pub unit: String,
    /// Factor from the quantity to exposed values.
    pub exposure: f64,
    /// White point of the tone curve ([`super::ToneMap`]); 1 means no curve.
    pub white: f64,
}

/// A lit model: meshes, what their colours mean, and a camera.
#[derive(Clone, Debug)]
pub struct LitModel {
    /// Meshes; those without triangles are left out of the file.
    pub meshes: Vec<LitMesh>,
    /// What the colours mean.
    pub note: ModelNote,
    /// Where to look from, in the coordinates of the meshes.
    pub camera: Option<Camera>,
}

/// Writes a lit model as the GLB file `path`.
///
/// # Errors
/// What [`glb_bytes`] refuses, or the file cannot be written.
pub fn write_glb(path: &Path, model: &LitModel) -> Result<(), WriteError> {
    let bytes = glb_bytes(model).map_err(|reason| WriteError::data(path, reason))?;
    write_bytes(path, &bytes)
}

/// The bytes of [`write_glb`]'s file: a function of the model alone. Cost O(vertices + triangles).
///
/// # Errors
/// A sentence naming the mesh and the vertex: a number that is not finite, an index past the last vertex, lists of
/// different lengths; a model without triangles; more than 4 GiB.
///
/// ```
/// use ondelette_io::write::{LitMesh, LitModel, ModelNote, glb_bytes};
/// let floor = LitMesh {
///     name: "floor".into(),
///     positions: vec![[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
///     colors: vec![[0.5, 0.5, 0.5]; 3],
///     indices: vec![0, 1, 2],
///     ..LitMesh::default()
/// };
/// let note = ModelNote { quantity: "radiosity".into(), unit: "W/m^2".into(), exposure: 2.0, white: 1.0 };
/// let bytes = glb_bytes(&LitModel { meshes: vec![floor], note, camera: None }).unwrap();
/// assert_eq!(&bytes[..4], b"glTF");
/// ```
pub fn glb_bytes(model: &LitModel) -> Result<Vec<u8>, String> {
    let ModelNote { exposure, white, .. } = model.note;
    if !(exposure.is_finite() && white.is_finite()) {
        return Err(format!("its exposure {exposure} and white point {white} must be finite"));
    }
    let mut parts = Parts::default();
    for mesh in &model.meshes {
        check_mesh(mesh)?;
        if !mesh.indices.is_empty() {
            parts.add_mesh(mesh);
        }
    }
    if parts.meshes.is_empty() {
        return Err("the model has no triangles".into());
    }
    if let Some(camera) = &model.camera {
        parts.add_camera(camera)?;
    }
    parts.into_glb(&model.note)
}

fn check_mesh(mesh: &LitMesh) -> Result<(), String> {
    let (name, n) = (&mesh.name, mesh.positions.len());
    if mesh.colors.len() != n {
        return Err(format!("mesh '{name}' has {n} positions but {} colours", mesh.colors.len()));
    }
    if !mesh.normals.is_empty() && mesh.normals.len() != n {
        return Err(format!("mesh '{name}' has {n} positions but {} normals", mesh.normals.len()));
    }
    if !mesh.indices.len().is_multiple_of(3) {
        return Err(format!("mesh '{name}' has {} indices, not three a triangle", mesh.indices.len()));
    }
    for (what, values) in [("position", &mesh.positions), ("colour", &mesh.colors), ("normal", &mesh.normals)] {
        if let Some(i) = values.iter().position(|v| v.iter().any(|c| !c.is_finite())) {
            return Err(format!("mesh '{name}': the {what} of vertex {i} is {:?}, which is not finite", values[i]));
        }
    }
    match mesh.indices.iter().position(|&i| i as usize >= n) {
        Some(k) => Err(format!("mesh '{name}', triangle {}: no vertex {} among {n}", k / 3, mesh.indices[k])),
        None => Ok(()),
    }
}

const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// The growing arrays of the document, and the binary chunk.
#[derive(Default)]
struct Parts {
    nodes: Vec<Value>,
    meshes: Vec<Value>,
    materials: Vec<Value>,
    /// Material index of one-sided and of double-sided meshes, once used.
    material_of: [Option<usize>; 2],
    accessors: Vec<Value>,
    views: Vec<Value>,
    cameras: Vec<Value>,
    binary: Vec<u8>,
}

impl Parts {
    fn add_mesh(&mut self, mesh: &LitMesh) {
        let n = mesh.positions.len();
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for p in &mesh.positions {
            for axis in 0..3 {
                low[axis] = low[axis].min(p[axis]);
                high[axis] = high[axis].max(p[axis]);
            }
        }
        let positions = self.add_view(floats(&mesh.positions), ARRAY_BUFFER);
        let positions = self.add_accessor(json!({
            "bufferView": positions, "componentType": FLOAT, "count": n, "type": "VEC3", "min": low, "max": high,
        }));
        // Four channels make eight bytes a vertex: three 16-bit ones would break the rule that elements start at
        // multiples of 4.
        let colors = mesh.colors.iter().flat_map(|&[r, g, b]| [unorm(r), unorm(g), unorm(b), u16::MAX]);
        let colors = self.add_view(colors.flat_map(u16::to_le_bytes).collect(), ARRAY_BUFFER);
        let colors = self.add_accessor(json!({
            "bufferView": colors, "componentType": UNSIGNED_SHORT, "normalized": true, "count": n, "type": "VEC4",
        }));
        let mut attributes = json!({ "POSITION": positions, "COLOR_0": colors });
        if !mesh.normals.is_empty() {
            let normals = self.add_view(floats(&mesh.normals), ARRAY_BUFFER);
            attributes["NORMAL"] = self
                .add_accessor(json!({ "bufferView": normals, "componentType": FLOAT, "count": n, "type": "VEC3" }))
                .into();
        }
        let indices = mesh.indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let indices = self.add_view(indices, ELEMENT_ARRAY_BUFFER);
        let indices = self.add_accessor(json!({
            "bufferView": indices, "componentType": UNSIGNED_INT, "count": mesh.indices.len(), "type": "SCALAR",
        }));
        let material = self.material(mesh.double_sided);
        self.nodes.push(json!({ "name": mesh.name, "mesh": self.meshes.len() }));
        self.meshes.push(json!({
            "name": mesh.name,
            "primitives": [{ "attributes": attributes, "indices": indices, "material": material, "mode": 4 }],
        }));
    }

    fn material(&mut self, double_sided: bool) -> usize {
        *self.material_of[usize::from(double_sided)].get_or_insert_with(|| {
            self.materials.push(json!({
                "name": if double_sided { "lit, double-sided" } else { "lit" },
                "doubleSided": double_sided,
                // what viewers without the extension fall back to
                "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0, "roughnessFactor": 1 },
                "extensions": { "KHR_materials_unlit": {} },
            }));
            self.materials.len() - 1
        })
    }

    fn add_camera(&mut self, camera: &Camera) -> Result<(), String> {
        let back = (camera.eye - camera.at).normalize_or_zero();
        let right = camera.up.cross(back).normalize_or_zero();
        let up = back.cross(right);
        let fov = camera.fov.to_radians();
        // written so that a NaN anywhere is refused too
        if !(camera.eye.is_finite() && up.length() > 0.5 && fov > 0.0 && fov < std::f64::consts::PI) {
            return Err(format!(
                "the camera (eye {}, at {}, up {}, fov {}) looks nowhere: eye and at must differ, up must not lie \
                 along the view, fov must be between 0 and 180 degrees",
                camera.eye, camera.at, camera.up, camera.fov
            ));
        }
        let near = camera.eye.distance(camera.at) * 1e-3;
        let matrix: Vec<f64> = [(right, 0), (up, 0), (back, 0), (camera.eye, 1)]
            .into_iter()
            .flat_map(|(v, w)| [v.x, v.y, v.z, f64::from(w)])
            .collect();
        self.nodes.push(json!({ "name": "camera", "camera": 0, "matrix": matrix }));
        self.cameras.push(json!({ "type": "perspective", "perspective": { "yfov": fov, "znear": near } }));
        Ok(())
    }

    /// Appends a part of the binary chunk, which starts at a multiple of 4.
    fn add_view(&mut self, bytes: Vec<u8>, target: u32) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.views
            .push(json!({ "buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len(), "target": target }));
        self.binary.extend(bytes);
        self.views.len() - 1
    }

    fn add_accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn into_glb(mut self, note: &ModelNote) -> Result<Vec<u8>, String> {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let mut document = json!({
            "asset": {
                "version": "2.0",
                "generator": concat!("Ondelette ", env!("CARGO_PKG_VERSION")),
                "extras": {
                    "quantity": note.quantity, "unit": note.unit, "exposure": note.exposure, "white": note.white,
                    "toneCurve": "L = exposure * luminance; shown = L (1 + L / white^2) / (1 + L)",
                },
            },
            "extensionsUsed": ["KHR_materials_unlit"],
            "scene": 0,
            "scenes": [{ "nodes": (0..self.nodes.len()).collect::<Vec<_>>() }],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{ "byteLength": self.binary.len() }],
        });
        if !self.cameras.is_empty() {
            document["cameras"] = self.cameras.into();
        }
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + text.len() + 8 + self.binary.len();
        let size =
            |n: usize| u32::try_from(n).map_err(|_| format!("the model takes {total} bytes, a GLB file holds 4 GiB"));
        let mut glb = Vec::with_capacity(total);
        glb.extend(b"glTF");
        glb.extend(2u32.to_le_bytes());
        glb.extend(size(total)?.to_le_bytes());
        for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &self.binary)] {
            glb.extend(size(chunk.len())?.to_le_bytes());
            glb.extend(kind);
            glb.extend(chunk);
        }
        Ok(glb)
    }
}

fn floats(vectors: &[[f32; 3]]) -> Vec<u8> {
    vectors.as_flattened().iter().flat_map(|c| c.to_le_bytes()).collect()
}

/// A channel in [0, 1] as a normalised 16-bit integer.
fn unorm(channel: f32) -> u16 {
    (f64::from(channel).clamp(0.0, 1.0) * 65535.0).round() as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn note() -> ModelNote {
        ModelNote { quantity: "radiosity".into(), unit: "W/m^2".into(), exposure: 0.25, white: 3.0 }
    }

    fn quad(name: &str, double_sided: bool) -> LitMesh {
        LitMesh {
            name: name.into(),
            positions: vec![[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [1.5, -2.25, 0.0], [0.0, -2.25, 0.1]],
            normals: vec![[0.0, 0.0, 1.0]; 4],
            colors: vec![[0.0, 0.25, 1.0], [0.1, 0.2, 0.3], [2.0, -1.0, 0.5], [0.9, 0.9, 0.9]],
            indices: vec![0, 1, 2, 0, 2, 3],
            double_sided,
        }
    }

    fn model(meshes: Vec<LitMesh>) -> LitModel {
        LitModel { meshes, note: note(), camera: None }
    }

    #[test]
    fn an_independent_reader_finds_the_same_model() {
        let mut odd = quad("odd", true);
        odd.normals.clear();
        odd.positions.truncate(3);
        odd.colors.truncate(3);
        odd.indices.truncate(3);
        let meshes = vec![quad("floor", false), LitMesh { name: "nothing".into(), ..LitMesh::default() }, odd];
        let camera = Camera {
            eye: DVec3::new(0.0, 1.0, 5.0),
            at: DVec3::new(0.0, 1.0, 0.0),
            up: DVec3::new(0.0, 1.0, 0.0),
            fov: 40.0,
        };
        let bytes = glb_bytes(&LitModel { meshes, note: note(), camera: Some(camera) }).unwrap();
        let file = gltf::Gltf::from_slice(&bytes).expect("the file validates");
        let binary = file.blob.clone().unwrap();
        let read: Vec<gltf::Mesh> = file.meshes().collect();
        assert_eq!(read.iter().map(|m| m.name().unwrap()).collect::<Vec<_>>(), ["floor", "odd"]);
        let floor = read[0].primitives().next().unwrap();
        let reader = floor.reader(|_| Some(&binary));
        let want = quad("floor", false);
        assert_eq!(reader.read_positions().unwrap().collect::<Vec<_>>(), want.positions);
        assert_eq!(reader.read_normals().unwrap().collect::<Vec<_>>(), want.normals);
        assert_eq!(reader.read_indices().unwrap().into_u32().collect::<Vec<_>>(), want.indices);
        let colors: Vec<[f32; 4]> = reader.read_colors(0).unwrap().into_rgba_f32().collect();
        for (got, want) in colors.iter().zip(&want.colors) {
            for channel in 0..3 {
                assert!((got[channel] - want[channel].clamp(0.0, 1.0)).abs() < 1e-5);
            }
            assert_eq!(got[3], 1.0);
        }
        assert_eq!(floor.bounding_box().min, [0.0, -2.25, 0.0]);
        assert_eq!(floor.bounding_box().max, [1.5, 0.0, 0.1]);
        assert!(!floor.material().double_sided());
        assert!(read[1].primitives().next().unwrap().material().double_sided());
        for view in file.views() {
            assert_eq!(view.offset() % 4, 0);
            assert!(view.target().is_some());
        }
        for accessor in file.accessors() {
            assert_eq!(accessor.size() % 4, 0);
        }
        // the camera looks along -z from its eye
        let node = file.nodes().find(|n| n.camera().is_some()).unwrap();
        let matrix = node.transform().matrix();
        assert_eq!(matrix[3], [0.0, 1.0, 5.0, 1.0]);
        assert_eq!(matrix[2], [0.0, 0.0, 1.0, 0.0]);
    }

    #[test]
    fn the_file_declares_the_unlit_extension_and_what_its_colours_mean() {
        let bytes = glb_bytes(&model(vec![quad("floor", false), quad("wall", false)])).unwrap();
        assert_eq!(bytes.len() as u32, u32::from_le_bytes(bytes[8..12].try_into().unwrap()));
        assert_eq!(bytes.len() % 4, 0);
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let document: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
        assert_eq!(document["extensionsUsed"], json!(["KHR_materials_unlit"]));
        assert_eq!(document["materials"].as_array().unwrap().len(), 1);
        assert!(document["materials"][0]["extensions"]["KHR_materials_unlit"].is_object());
        let extras = &document["asset"]["extras"];
        assert_eq!((&extras["exposure"], &extras["unit"]), (&json!(0.25), &json!("W/m^2")));
        assert!(document["asset"]["generator"].as_str().unwrap().starts_with("Ondelette "));
    }

    #[test]
    fn a_model_that_no_viewer_could_open_is_refused_by_mesh_and_vertex() {
        let refuse = |change: fn(&mut LitMesh)| {
            let mut mesh = quad("wall", false);
            change(&mut mesh);
            glb_bytes(&model(vec![mesh])).unwrap_err()
        };
        assert!(refuse(|m| m.positions[2][1] = f32::NAN).contains("position of vertex 2"));
        assert!(refuse(|m| m.colors[3][0] = f32::INFINITY).contains("colour of vertex 3"));
        assert!(refuse(|m| m.indices[4] = 4).contains("triangle 1: no vertex 4 among 4"));
        assert!(refuse(|m| m.indices.truncate(5)).contains("5 indices"));
        assert!(refuse(|m| m.colors.truncate(1)).contains("1 colours"));
        assert!(refuse(|m| m.normals.truncate(1)).contains("1 normals"));
        assert!(refuse(|m| m.indices.clear()).contains("no triangles"));
        let mut unexposed = model(vec![quad("wall", false)]);
        unexposed.note.exposure = f64::NAN;
        assert!(glb_bytes(&unexposed).unwrap_err().contains("exposure NaN"));
        let eye = DVec3::ONE;
        let camera = Some(Camera { eye, at: eye, up: DVec3::Y, fov: 40.0 });
        let blind = LitModel { meshes: vec![quad("wall", false)], note: note(), camera };
        assert!(glb_bytes(&blind).unwrap_err().contains("looks nowhere"));
    }
}
