//! Whether a scene that was stored and read back is one that [`super::SceneDraft::build`] could have made.

use super::draft::RADIANCES;
use super::{Camera, LARGEST_COORDINATE, SMALLEST_DIAGONAL, Scene, Side};
use glam::DVec3;

impl Scene {
    /// Checks every promise of the type: finite numbers, indices in range, sides in order, reflectances in [0, 1).
    ///
    /// For scenes that come from a file of our own. **Cost** O(patches).
    ///
    /// # Errors
    /// A sentence naming the first thing that is wrong.
    ///
    /// ```
    /// use ondelette_radiosity::scene::samples;
    /// let mut scene = samples::facing_squares(1.0);
    /// assert!(scene.check().is_ok());
    /// scene.patches[1].material = 9;
    /// assert!(scene.check().unwrap_err().contains("patch 1"));
    /// ```
    pub fn check(&self) -> Result<(), String> {
        let metres = self.unit.metres;
        if !(metres.is_finite() && metres > 0.0) {
            return Err(format!("its length unit is {metres} m"));
        }
        for m in &self.materials {
            if !m.reflectance.0.iter().all(|c| (0.0..1.0).contains(c)) {
                return Err(format!("material '{}' reflects {:?}, outside [0, 1)", m.name, m.reflectance.0));
            }
            if !m.radiance.0.iter().all(|c| *c == 0.0 || RADIANCES.contains(c)) {
                return Err(format!("material '{}' emits {:?}", m.name, m.radiance.0));
            }
        }
        let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let mut sides = self.sides.iter();
        for (n, patch) in (0u32..).zip(&self.patches) {
            let Some(material) = self.materials.get(patch.material as usize) else {
                return Err(format!("patch {n} has material {} of {}", patch.material, self.materials.len()));
            };
            if patch.provenance.object as usize >= self.objects.len() {
                return Err(format!("patch {n} is of object {} of {}", patch.provenance.object, self.objects.len()));
            }
            for corner in patch.corners() {
                if !(corner.is_finite() && corner.abs().max_element() <= LARGEST_COORDINATE) {
                    return Err(format!("patch {n} has a corner at {corner}"));
                }
                bounds = [bounds[0].min(corner), bounds[1].max(corner)];
            }
            let area = patch.area();
            if !(area > 0.0 && area.is_finite() && patch.normal().is_finite()) {
                return Err(format!("patch {n} has no area"));
            }
            let uv = [&patch.provenance.uv0, &patch.provenance.uv1];
            if uv.into_iter().flatten().flatten().flatten().any(|c| !c.is_finite()) {
                return Err(format!("patch {n} has a texture coordinate that is not finite"));
            }
            let front = sides.next() == Some(&Side { patch: n, back: false });
            if !front || material.two_sided && sides.next() != Some(&Side { patch: n, back: true }) {
                return Err(format!("the sides of patch {n} are not where they belong"));
            }
        }
        if sides.next().is_some() {
            return Err("it has sides without a patch".into());
        }
        // "not at least", so that a NaN is refused too
        let diagonal = bounds[0].distance(bounds[1]);
        if self.patches.is_empty() || bounds != self.bounds || diagonal.is_nan() || diagonal < SMALLEST_DIAGONAL {
            return Err(format!("its bounds {} {} are not those of its patches", self.bounds[0], self.bounds[1]));
        }
        if self.camera.is_some_and(|c: Camera| !c.is_usable()) {
            return Err("its camera looks nowhere".into());
        }
        Ok(())
    }
}
