//! The node hierarchy: where each mesh stands, and the first camera.

use ::gltf::json::camera::Type;
use ::gltf::json::scene::UnitQuaternion;
use ::gltf::json::validation::Checked;
use ::gltf::json::{Index, Mesh, Node, Root};
use glam::{DMat4, DQuat, DVec3};
use ondelette_radiosity::scene::Camera;

/// A mesh under a node.
pub(super) struct Instance {
    /// Name of the node, else of the mesh, else the node's number.
    pub(super) name: String,
    /// Which mesh.
    pub(super) mesh: Index<Mesh>,
    /// From the mesh to the scene.
    pub(super) transform: DMat4,
}

/// What hangs on the nodes of the scene.
pub(super) struct Walk {
    /// Meshes, depth first in file order.
    pub(super) instances: Vec<Instance>,
    /// The first perspective camera.
    pub(super) camera: Option<Camera>,
    /// What was ignored.
    pub(super) warnings: Vec<String>,
}

/// Walks the default scene (else the first, else every node without a parent).
///
/// **Errors** when a node is reached twice: glTF hierarchies are trees, and a ring would never end.
pub(super) fn walk(root: &Root) -> Result<Walk, String> {
    let mut walk = Walk { instances: Vec::new(), camera: None, warnings: Vec::new() };
    let mut stack: Vec<(usize, DMat4)> = roots(root)?.into_iter().rev().map(|n| (n, DMat4::IDENTITY)).collect();
    let mut reached = vec![false; root.nodes.len()];
    let (mut skinned, mut cameras) = (0usize, 0usize);
    while let Some((number, above)) = stack.pop() {
        let node = root.nodes.get(number).ok_or_else(|| format!("node {number} is not there"))?;
        if std::mem::replace(&mut reached[number], true) {
            return Err(format!("node {number} is reached twice: the node hierarchy is not a tree"));
        }
        let transform = above * local(node).map_err(|m| format!("node {number}: {m}"))?;
        if let Some(mesh) = node.mesh {
            let named = |name: &Option<String>| name.clone().filter(|n| !n.is_empty());
            let name = named(&node.name)
                .or_else(|| root.get(mesh).and_then(|m| named(&m.name)))
                .unwrap_or_else(|| format!("node {number}"));
            skinned += usize::from(node.skin.is_some());
            walk.instances.push(Instance { name, mesh, transform });
        }
        if let Some(index) = node.camera {
            let camera = root.get(index).ok_or_else(|| format!("node {number}: camera {index} is not there"))?;
            match (&camera.type_, &camera.perspective) {
                (Checked::Valid(Type::Perspective), Some(lens)) => {
                    cameras += 1;
                    if walk.camera.is_none() {
                        walk.camera = Some(look(&transform, f64::from(lens.yfov).to_degrees()));
                    }
                }
                _ => walk.warnings.push(format!("camera {index} has no perspective: ignored")),
            }
        }
        for child in node.children.iter().flatten().rev() {
            stack.push((child.value(), transform));
        }
    }
    if cameras > 1 {
        walk.warnings.push(format!("{cameras} cameras; the first is used"));
    }
    if skinned > 0 {
        let s = if skinned == 1 { "" } else { "es" };
        walk.warnings.push(format!("{skinned} skinned mesh{s}: the rest pose is used"));
    }
    Ok(walk)
}

fn roots(root: &Root) -> Result<Vec<usize>, String> {
    let chosen = match root.scene {
        Some(index) => Some(root.get(index).ok_or_else(|| format!("scene {index} is not there"))?),
        None => root.scenes.first(),
    };
    if let Some(scene) = chosen {
        return Ok(scene.nodes.iter().map(|n| n.value()).collect());
    }
    let mut is_root = vec![true; root.nodes.len()];
    for child in root.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
        if let Some(flag) = is_root.get_mut(child.value()) {
            *flag = false;
        }
    }
    Ok((0..root.nodes.len()).filter(|&n| is_root[n]).collect())
}

/// The node's own transform: a matrix, or translation times rotation times scale.
fn local(node: &Node) -> Result<DMat4, String> {
    let matrix = if let Some(columns) = node.matrix {
        DMat4::from_cols_array(&columns.map(f64::from))
    } else {
        let vector = |v: Option<[f32; 3]>, or: f64| v.map_or(DVec3::splat(or), |v| DVec3::from(v.map(f64::from)));
        let turn = match node.rotation {
            None => DQuat::IDENTITY,
            Some(UnitQuaternion(q)) => {
                let q = DQuat::from_array(q.map(f64::from));
                if !(q.length() > 0.0 && q.length().is_finite()) {
                    return Err("the rotation is not a unit quaternion".into());
                }
                q.normalize()
            }
        };
        DMat4::from_scale_rotation_translation(vector(node.scale, 1.0), turn, vector(node.translation, 0.0))
    };
    if matrix.is_finite() { Ok(matrix) } else { Err("the transform is not finite".into()) }
}

/// glTF cameras look along -z with y up.
fn look(transform: &DMat4, fov: f64) -> Camera {
    let eye = transform.transform_point3(DVec3::ZERO);
    let forward = transform.transform_vector3(DVec3::NEG_Z).normalize_or_zero();
    let up = transform.transform_vector3(DVec3::Y).normalize_or_zero();
    Camera { eye, at: eye + forward, up, fov }
}
