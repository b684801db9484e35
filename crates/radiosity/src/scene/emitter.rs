//! What the lamps of a scene give off, before any light has bounced.

use super::Scene;
use crate::rgb::Rgb;
use std::f64::consts::PI;

/// An object that emits light.
#[derive(Clone, Debug, PartialEq)]
pub struct Emitter {
    /// Index into [`Scene::objects`].
    pub object: u32,
    /// Emitting sides of it.
    pub sides: usize,
    /// Area of those sides in square metres (both sides of a two-sided patch count).
    pub area: f64,
    /// Emitted power pi * L * area, in [`super::Quantity::power_unit`].
    pub power: Rgb,
}

impl Scene {
    /// The emitting objects, in the order of [`Scene::objects`].
    ///
    /// **Units** square metres and [`super::Quantity::power_unit`], from the scene's length unit.
    ///
    /// **Cost** O(sides).
    pub fn emitters(&self) -> Vec<Emitter> {
        let square_metre = self.unit.metres * self.unit.metres;
        let mut found: Vec<Option<Emitter>> = vec![None; self.objects.len()];
        for &side in &self.sides {
            let radiance = self.material(side).radiance;
            if radiance.sum() <= 0.0 {
                continue;
            }
            let patch = &self.patches[side.patch as usize];
            let area = patch.area() * square_metre;
            let object = patch.provenance.object;
            let emitter =
                found[object as usize].get_or_insert(Emitter { object, sides: 0, area: 0.0, power: Rgb::BLACK });
            emitter.sides += 1;
            emitter.area += area;
            emitter.power += radiance * (PI * area);
        }
        found.into_iter().flatten().collect()
    }

    /// Power of all emitters together, in [`super::Quantity::power_unit`].
    pub fn emitted_power(&self) -> Rgb {
        self.emitters().iter().fold(Rgb::BLACK, |sum, e| sum + e.power)
    }
}
