//! Lamps that are not in the file: rectangular panels added while reading.

use glam::DVec3;
use ondelette_radiosity::Rgb;
use ondelette_radiosity::scene::{DraftFace, Material, Object, SceneDraft};

/// A flat rectangular lamp that shines to one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Panel {
    /// Its middle, in the coordinates of the scene.
    pub at: DVec3,
    /// Edge lengths, in scene units: across and along (see [`Panel::corners`]).
    pub size: [f64; 2],
    /// Where it shines to; any length but 0.
    pub facing: DVec3,
    /// Emitted radiance (photometric scenes: luminance).
    pub radiance: Rgb,
}

impl Panel {
    /// Corners counter-clockwise from the lit side. The first edge lies along the coordinate axis that is most nearly
    /// across the direction it faces (x for a panel in a ceiling).
    pub fn corners(&self) -> [DVec3; 4] {
        let n = self.facing.normalize();
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let across = axes.into_iter().min_by(|a, b| n.dot(*a).abs().total_cmp(&n.dot(*b).abs())).unwrap_or(DVec3::X);
        let u = (across - n * n.dot(across)).normalize();
        let v = n.cross(u);
        let (u, v) = (u * (0.5 * self.size[0]), v * (0.5 * self.size[1]));
        [self.at - u - v, self.at + u - v, self.at + u + v, self.at - u + v]
    }
}

/// Adds panels to a draft, as materials and objects of their own: `panel 1`, `panel 2`, ...
pub(super) fn add(draft: &mut SceneDraft, panels: &[Panel]) {
    for (k, panel) in panels.iter().enumerate() {
        let name = format!("panel {}", k + 1);
        draft.materials.push(Material {
            name: name.clone(),
            reflectance: Rgb::BLACK,
            radiance: panel.radiance,
            two_sided: false,
        });
        draft.objects.push(Object { name, mesh: draft.objects.len() as u32, primitive: 0 });
        draft.faces.push(DraftFace {
            corners: panel.corners().to_vec(),
            uv0: Vec::new(),
            uv1: Vec::new(),
            material: draft.materials.len() as u32 - 1,
            object: draft.objects.len() as u32 - 1,
            index: 0,
            line: None,
        });
    }
}
