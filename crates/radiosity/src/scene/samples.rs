//! Tiny scenes with known answers, for examples and tests.

use super::{BuildOptions, DraftFace, LengthUnit, Material, Object, Quantity, Scene, SceneDraft};
use crate::rgb::Rgb;
use glam::DVec3;

/// A scene from quadrilaterals: corners, reflectance and emitted radiance of each.
///
/// # Panics
/// If the quadrilaterals make no valid scene.
pub fn quads(name: &str, faces: &[([[f64; 3]; 4], Rgb, Rgb)]) -> Scene {
    let draft = SceneDraft {
        name: name.into(),
        unit: LengthUnit { metres: 1.0, stated: true },
        quantity: Quantity::Radiometric,
        materials: faces
            .iter()
            .enumerate()
            .map(|(i, f)| Material { name: format!("m{i}"), reflectance: f.1, radiance: f.2, two_sided: false })
            .collect(),
        objects: (0..faces.len()).map(|i| Object { name: format!("o{i}"), mesh: i as u32, primitive: 0 }).collect(),
        faces: faces
            .iter()
            .enumerate()
            .map(|(i, f)| DraftFace {
                corners: f.0.iter().map(|c| DVec3::from_array(*c)).collect(),
                uv0: Vec::new(),
                uv1: Vec::new(),
                material: i as u32,
                object: i as u32,
                index: 0,
                line: None,
            })
            .collect(),
        camera: None,
        warnings: Vec::new(),
    };
    draft.build(BuildOptions::default()).expect("a valid sample scene")
}

/// A black unit square (side 0) facing an emitter of exitance 1 (side 1) at the given distance.
pub fn facing_squares(distance: f64) -> Scene {
    let d = distance;
    let floor = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let lamp = [[0.0, 1.0, d], [1.0, 1.0, d], [1.0, 0.0, d], [0.0, 0.0, d]];
    let light = Rgb::grey(std::f64::consts::FRAC_1_PI);
    quads("facing squares", &[(floor, Rgb::BLACK, Rgb::BLACK), (lamp, Rgb::BLACK, light)])
}

/// The inside of a unit cube; every wall has the given reflectance and emits exitance 1 times its entry in `emission`.
/// Walls: floor, ceiling, x = 0, x = 1, y = 0, y = 1.
pub fn cube(reflectance: f64, emission: [f64; 6]) -> Scene {
    let p = |i: u32| [f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1)];
    let walls = [[0, 1, 3, 2], [6, 7, 5, 4], [0, 2, 6, 4], [3, 1, 5, 7], [1, 0, 4, 5], [2, 3, 7, 6]];
    let faces: Vec<_> = walls
        .iter()
        .zip(emission)
        .map(|(w, m)| (w.map(p), Rgb::grey(reflectance), Rgb::grey(m * std::f64::consts::FRAC_1_PI)))
        .collect();
    quads("cube", &faces)
}
