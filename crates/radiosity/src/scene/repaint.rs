//! Changing what materials emit and reflect, once the shapes are fixed.

use super::Scene;
use super::draft::RADIANCES;
use crate::rgb::Rgb;

/// Another emission or reflectance for a material.
#[derive(Clone, Debug, PartialEq)]
pub enum Paint {
    /// Radiance of this material, in [`super::Quantity::radiance_unit`].
    Emission(String, Rgb),
    /// Diffuse reflectance of this material, each channel in [0, 1).
    Reflectance(String, Rgb),
}

/// Why a material cannot be painted so.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PaintError {
    /// No such material.
    #[error("there is no material '{name}' in the scene; it has {known}")]
    Unknown {
        /// The name.
        name: String,
        /// Those that there are.
        known: String,
    },
    /// Not a radiance.
    #[error("'{name}' cannot emit {value}: radiance is 0 or from 1e-30 to 1e30")]
    Emission {
        /// The material.
        name: String,
        /// The worst channel.
        value: f64,
    },
    /// A solution with links, in which nothing links this material's light.
    #[error(
        "'{name}' neither shines nor reflects in the solution that is to be lit anew, so that links may not know its \
         light: start from a solution in which it did, or solve the scene anew with a trace of it (a reflectance of \
         0.001), or with --method sampled"
    )]
    Unlinked {
        /// The material.
        name: String,
    },
    /// Not a reflectance.
    #[error(
        "'{name}' cannot reflect {value}: a reflectance lies in [0, 1), for no surface reflects all the light it gets"
    )]
    Reflectance {
        /// The material.
        name: String,
        /// The worst channel.
        value: f64,
    },
}

/// Names listed in an error.
const LISTED: usize = 12;

impl Scene {
    /// The scene with materials changed, as by [`Scene::paint`], one after the other.
    pub(crate) fn painted(&self, paints: &[Paint]) -> Result<Scene, PaintError> {
        let mut scene = self.clone();
        for paint in paints {
            scene.paint(paint)?;
        }
        Ok(scene)
    }

    /// Changes every material of the given name. Shapes, sides and their order stay as they are.
    ///
    /// # Errors
    /// See [`PaintError`]; the scene is then as it was.
    ///
    /// ```
    /// use ondelette_radiosity::{Rgb, scene::{Paint, samples}};
    /// let mut scene = samples::facing_squares(1.0);
    /// let name = scene.materials[0].name.clone();
    /// scene.paint(&Paint::Reflectance(name.clone(), Rgb::grey(0.25))).unwrap();
    /// assert_eq!(scene.materials[0].reflectance, Rgb::grey(0.25));
    /// assert!(scene.paint(&Paint::Reflectance(name, Rgb::grey(1.0))).is_err());
    /// ```
    pub fn paint(&mut self, paint: &Paint) -> Result<(), PaintError> {
        let (name, value) = match paint {
            Paint::Emission(name, value) | Paint::Reflectance(name, value) => (name, *value),
        };
        let is_right = |c: &f64| match paint {
            Paint::Emission(..) => *c == 0.0 || RADIANCES.contains(c),
            Paint::Reflectance(..) => (0.0..1.0).contains(c),
        };
        if let Some(&value) = value.0.iter().find(|c| !is_right(c)) {
            let name = name.clone();
            return Err(match paint {
                Paint::Emission(..) => PaintError::Emission { name, value },
                Paint::Reflectance(..) => PaintError::Reflectance { name, value },
            });
        }
        if !self.materials.iter().any(|m| m.name == *name) {
            let names: Vec<String> = self.materials.iter().take(LISTED).map(|m| format!("'{}'", m.name)).collect();
            let more = self.materials.len().saturating_sub(LISTED);
            let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
            return Err(PaintError::Unknown { name: name.clone(), known: format!("{}{rest}", names.join(", ")) });
        }
        for material in self.materials.iter_mut().filter(|m| m.name == *name) {
            match paint {
                Paint::Emission(..) => material.radiance = value,
                Paint::Reflectance(..) => material.reflectance = value,
            }
        }
        Ok(())
    }
}
