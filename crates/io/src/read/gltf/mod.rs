//! glTF 2.0 and GLB: nodes with transforms, instances, triangles in every mode, materials, the first camera.
//!
//! The `gltf` crate gives the types of the JSON; everything that follows an index, an offset or a count of the file is
//! checked here, because the crate's own validation and accessors panic on some broken files.
//!
//! glTF is in metres and photometric: the emissive factor, times its texture's mean, times
//! `KHR_materials_emissive_strength`, is luminance in cd/m^2.

mod container;
mod data;
mod material;
mod nodes;
mod texture;

use super::{ReadError, read_bytes, stem};
use ::gltf::json::{Root, mesh::Mode, mesh::Semantic, validation::Checked};
use container::Container;
use data::Data;
use glam::{DMat4, DVec3};
use material::Materials;
use ondelette_radiosity::scene::{DraftFace, LengthUnit, Object, Quantity, SceneDraft};
use std::path::Path;

/// More triangles than this, instances counted, are refused before they fill the memory.
const MOST_TRIANGLES: usize = 20_000_000;

/// Extensions that a file may require: read, or without influence on diffuse light (then ignored).
const SUPPORTED: [&str; 14] = [
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
];

/// Reads a `.gltf` or `.glb` file and the buffers and pictures that it names.
pub(super) fn read(path: &Path) -> Result<SceneDraft, ReadError> {
    let bytes = read_bytes(path)?;
    let broken = |message: String| ReadError::Gltf { path: path.into(), message };
    let container = Container::split(&bytes).map_err(broken)?;
    let root = Root::from_slice(container.json)
        .map_err(|error| broken(format!("the glTF description (JSON) is broken: {error}")))?;
    if !root.asset.version.starts_with("2.") {
        return Err(broken(format!("is glTF version '{}'; only version 2 can be read", root.asset.version)));
    }
    if let Some(name) = root.extensions_required.iter().find(|e| !SUPPORTED.contains(&e.as_str())) {
        return Err(ReadError::Extension { path: path.into(), name: name.clone(), supported: SUPPORTED.join(", ") });
    }
    let data = Data::load(&root, path, container.binary).map_err(broken)?;
    draft(&root, &data, path).map_err(broken)
}

fn draft(root: &Root, data: &Data<'_>, path: &Path) -> Result<SceneDraft, String> {
    let walk = nodes::walk(root)?;
    let mut warnings = walk.warnings;
    let mut materials = Materials::new(root, data);
    let mut objects = Vec::new();
    let mut faces: Vec<DraftFace> = Vec::new();
    let (mut not_triangles, mut morphed, mut unlit) = (0usize, 0usize, 0usize);
    for instance in &walk.instances {
        let mesh = root
            .get(instance.mesh)
            .ok_or_else(|| format!("node '{}' refers to mesh {}, which is not there", instance.name, instance.mesh))?;
        for (number, primitive) in (0u32..).zip(&mesh.primitives) {
            let name = match mesh.primitives.len() {
                1 => instance.name.clone(),
                _ => format!("{}.{number}", instance.name),
            };
            let place = |message: String| format!("object '{name}': {message}");
            let mode = match primitive.mode {
                Checked::Valid(m @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => m,
                Checked::Valid(_) => {
                    not_triangles += 1;
                    continue;
                }
                Checked::Invalid => return Err(place("the mode of a primitive is not one that glTF knows".into())),
            };
            let attribute = |semantic: Semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
            let Some(positions) = attribute(Semantic::Positions) else {
                not_triangles += 1;
                continue;
            };
            if primitive.targets.as_ref().is_some_and(|t| !t.is_empty()) {
                morphed += 1;
            }
            if materials.is_unlit(primitive.material) {
                unlit += 1;
                continue;
            }
            let positions = data.vectors::<3>(positions).map_err(|m| place(format!("POSITION: {m}")))?;
            let corners = match primitive.indices {
                Some(indices) => data.indices(indices).map_err(|m| place(format!("indices: {m}")))?,
                None => (0..u32::try_from(positions.len()).map_err(|_| place("too many vertices".into()))?).collect(),
            };
            if let Some(&worst) = corners.iter().max()
                && worst as usize >= positions.len()
            {
                let have = positions.len();
                return Err(place(format!("an index refers to vertex {worst}, but there are only {have} (from 0)")));
            }
            let triangles = triangles(mode, &corners);
            if faces.len() + triangles.len() > MOST_TRIANGLES {
                return Err(place(format!(
                    "the scene has more than {MOST_TRIANGLES} triangles (instances counted), which is the limit"
                )));
            }
            let per_vertex = |set: u32| -> Result<Vec<[f64; 2]>, String> {
                let Some(accessor) = attribute(Semantic::TexCoords(set)) else { return Ok(Vec::new()) };
                let uv = data.vectors::<2>(accessor).map_err(|m| place(format!("TEXCOORD_{set}: {m}")))?;
                same_length(uv, positions.len()).map_err(|m| place(format!("TEXCOORD_{set}: {m}")))
            };
            let (uv0, uv1) = (per_vertex(0)?, per_vertex(1)?);
            let tint = match attribute(Semantic::Colors(0)) {
                None => [1.0; 3],
                Some(accessor) => {
                    let colours = data
                        .colours(accessor)
                        .and_then(|c| same_length(c, positions.len()))
                        .map_err(|m| place(format!("COLOR_0: {m}")))?;
                    mean_colour(&triangles, &positions, &colours)
                }
            };
            let material = materials.index(primitive.material, tint, &mut warnings).map_err(place)?;
            let object = u32::try_from(objects.len()).map_err(|_| "too many objects".to_string())?;
            let mesh = u32::try_from(instance.mesh.value()).unwrap_or(u32::MAX);
            objects.push(Object { name, mesh, primitive: number });
            let flip = instance.transform.determinant() < 0.0;
            let world: Vec<DVec3> = positions.iter().map(|&p| place_point(&instance.transform, p)).collect();
            for (index, mut triangle) in (0u32..).zip(triangles) {
                if flip {
                    triangle.swap(1, 2);
                }
                let pick = |uv: &Vec<[f64; 2]>| -> Vec<[f64; 2]> {
                    if uv.is_empty() { Vec::new() } else { triangle.map(|i| uv[i as usize]).to_vec() }
                };
                faces.push(DraftFace {
                    corners: triangle.map(|i| world[i as usize]).to_vec(),
                    uv0: pick(&uv0),
                    uv1: pick(&uv1),
                    material,
                    object,
                    index,
                    line: None,
                });
            }
        }
    }
    if faces.is_empty() && unlit > 0 {
        return Err(
            "all of it is unlit (KHR_materials_unlit), as in a lit model: give the scene that it was made from".into(),
        );
    }
    let mut note = |count: usize, what: &str| {
        if count > 0 {
            warnings.push(format!("{count} primitive{} {what}", if count == 1 { "" } else { "s" }));
        }
    };
    note(not_triangles, "of points, lines or nothing ignored");
    note(morphed, "with morph targets: the rest shape is used");
    note(unlit, "with KHR_materials_unlit left out: what is not lit takes no part");
    ignored_extensions(root, &mut warnings);
    Ok(SceneDraft {
        name: stem(path),
        unit: LengthUnit { metres: 1.0, stated: true },
        quantity: Quantity::Photometric,
        materials: materials.into_list(),
        objects,
        faces,
        camera: walk.camera,
        warnings,
    })
}

/// A point under an affine transform.
fn place_point(transform: &DMat4, p: [f64; 3]) -> DVec3 {
    transform.transform_point3(DVec3::from(p))
}

fn same_length<T>(list: Vec<T>, expected: usize) -> Result<Vec<T>, String> {
    if list.len() == expected { Ok(list) } else { Err(format!("has {} entries for {expected} vertices", list.len())) }
}

/// The triangles of a list, strip or fan (glTF 2.0, section 3.7.2.1), all with the same winding.
fn triangles(mode: Mode, corners: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => corners
            .windows(3)
            .enumerate()
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
            .collect(),
        Mode::TriangleFan => match corners.split_first() {
            Some((&hub, rim)) => rim.windows(2).map(|w| [hub, w[0], w[1]]).collect(),
            None => Vec::new(),
        },
        _ => corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
    }
}

/// The mean of vertex colours over the area of the triangles (in the mesh's own coordinates).
fn mean_colour(triangles: &[[u32; 3]], positions: &[[f64; 3]], colours: &[[f64; 3]]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let mut whole = 0.0;
    for t in triangles {
        let [a, b, c] = t.map(|i| DVec3::from(positions[i as usize]));
        let area = (b - a).cross(c - a).length();
        whole += area;
        for (channel, total) in sum.iter_mut().enumerate() {
            *total += area / 3.0 * t.iter().map(|&i| colours[i as usize][channel]).sum::<f64>();
        }
    }
    if whole > 0.0 { sum.map(|s| s / whole) } else { [1.0; 3] }
}

/// One sentence about each used extension that changes the light but is not read.
fn ignored_extensions(root: &Root, warnings: &mut Vec<String>) {
    for name in &root.extensions_used {
        match name.as_str() {
            "KHR_lights_punctual" => {
                warnings.push(
                    "punctual lights (KHR_lights_punctual) are ignored: only emissive surfaces give light".into(),
                );
            }
            "KHR_materials_transmission" | "KHR_materials_diffuse_transmission" | "KHR_materials_volume" => {
                warnings.push(format!("extension {name} is ignored: every surface is opaque"));
            }
            known if SUPPORTED.contains(&known) => {}
            other => warnings.push(format!("extension {other} is ignored")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every second triangle of a strip runs the other way in the list of corners: unturned, half of a strip would be
    /// lit from behind.
    #[test]
    fn strips_and_fans_keep_their_winding() {
        let plane = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.], [0., 2., 0.]];
        let up = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| DVec3::from(plane[i as usize]));
            (b - a).cross(c - a).z
        };
        let strip = triangles(Mode::TriangleStrip, &[0, 1, 2, 3, 4]);
        assert_eq!(strip.len(), 3);
        assert!(strip.iter().all(|t| up(t) > 0.0), "{strip:?}");
        let fan = triangles(Mode::TriangleFan, &[0, 1, 3, 2]);
        assert_eq!(fan.len(), 2);
        assert!(fan.iter().all(|t| up(t) > 0.0), "{fan:?}");
    }

    /// Vertex colours count by the area they cover, not by how finely a mesh is cut.
    #[test]
    fn vertex_colours_are_averaged_over_area() {
        let positions = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 0.], [3., 0., 0.], [0., 1., 0.]];
        let colours = [[0.0; 3], [0.0; 3], [0.0; 3], [1.0; 3], [1.0; 3], [1.0; 3]];
        let mean = mean_colour(&[[0, 1, 2], [3, 4, 5]], &positions, &colours);
        assert!((mean[0] - 0.75).abs() < 1e-15);
    }
}
