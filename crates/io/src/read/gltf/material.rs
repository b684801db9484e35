//! Materials: one diffuse reflectance and one luminance each.
//!
//! reflectance = base colour factor * mean of its texture * mean of COLOR_0 * (1 - metallic), with metallic = its
//! factor * the mean of its texture. Channels of 1 and more become [`CLAMPED`], with a warning.

use super::super::picture::{Mean, UNREAD, Unread};
use super::data::Data;
use super::texture;
use ::gltf::json::material::AlphaMode;
use ::gltf::json::validation::Checked;
use ::gltf::json::{Index, Material as Source, Root};
use ondelette_radiosity::Rgb;
use ondelette_radiosity::scene::Material;
use std::collections::{HashMap, HashSet};

/// What a reflectance of 1 or more becomes.
pub(super) const CLAMPED: f64 = 0.95;

/// The materials of the scene, made when first used.
pub(super) struct Materials<'a> {
    root: &'a Root,
    data: &'a Data<'a>,
    list: Vec<Material>,
    /// By the file's material and the bits of the vertex colour.
    made: HashMap<(Option<usize>, [u64; 3]), u32>,
    /// Materials whose warnings have been given.
    noted: HashSet<Option<usize>>,
    textures: HashMap<usize, Mean>,
}

impl<'a> Materials<'a> {
    pub(super) fn new(root: &'a Root, data: &'a Data<'a>) -> Self {
        Materials {
            root,
            data,
            list: Vec::new(),
            made: HashMap::new(),
            noted: HashSet::new(),
            textures: HashMap::new(),
        }
    }

    pub(super) fn into_list(self) -> Vec<Material> {
        self.list
    }

    /// Whether the file says that the material is not lit.
    pub(super) fn is_unlit(&self, index: Option<Index<Source>>) -> bool {
        index
            .and_then(|i| self.root.get(i))
            .and_then(|m| m.extensions.as_ref())
            .is_some_and(|e| e.others.contains_key("KHR_materials_unlit"))
    }

    /// The material of a primitive whose vertex colours have the mean `tint`.
    pub(super) fn index(
        &mut self,
        index: Option<Index<Source>>,
        tint: [f64; 3],
        warnings: &mut Vec<String>,
    ) -> Result<u32, String> {
        let key = (index.map(|i| i.value()), tint.map(f64::to_bits));
        if let Some(&found) = self.made.get(&key) {
            return Ok(found);
        }
        let mut notes = Vec::new();
        let material = match index {
            None => self.convert(&Source::default(), "(no material)".into(), tint, &mut notes)?,
            Some(i) => {
                let source = self.root.get(i).ok_or_else(|| format!("material {i} is not there"))?;
                let name = source.name.clone().filter(|n| !n.is_empty()).unwrap_or_else(|| format!("material {i}"));
                self.convert(source, name, tint, &mut notes)?
            }
        };
        if self.noted.insert(key.0) {
            warnings.append(&mut notes);
        }
        let made = u32::try_from(self.list.len()).map_err(|_| "too many materials".to_string())?;
        self.list.push(material);
        self.made.insert(key, made);
        Ok(made)
    }

    fn convert(
        &mut self,
        source: &Source,
        name: String,
        tint: [f64; 3],
        notes: &mut Vec<String>,
    ) -> Result<Material, String> {
        let surface = &source.pbr_metallic_roughness;
        let mut texture_of = |texture: Option<usize>, linear: bool, notes: &mut Vec<String>| match texture {
            None => Ok([1.0; 3]),
            Some(texture) => self.mean(texture, linear, &name, notes),
        };
        let base = texture_of(surface.base_color_texture.as_ref().map(|t| t.index.value()), true, notes)?;
        let metal = texture_of(surface.metallic_roughness_texture.as_ref().map(|t| t.index.value()), false, notes)?;
        let glow = texture_of(source.emissive_texture.as_ref().map(|t| t.index.value()), true, notes)?;

        let factor = surface.base_color_factor.0.map(f64::from);
        let mut metallic = f64::from(surface.metallic_factor.0) * metal[2];
        let states_nothing = factor == [1.0; 4]
            && surface.metallic_factor.0 == 1.0
            && surface.roughness_factor.0 == 1.0
            && surface.base_color_texture.is_none()
            && surface.metallic_roughness_texture.is_none();
        if states_nothing {
            // By the letter a white mirror; nobody who states nothing means that.
            metallic = 0.0;
        } else if metallic >= 1.0 {
            notes.push(format!(
                "material '{name}' is all metal (metallicFactor 1, also when the file leaves it out): it reflects no \
                 diffuse light"
            ));
        }
        let mut reflectance = Rgb(std::array::from_fn(|i| factor[i] * base[i] * tint[i] * (1.0 - metallic).max(0.0)));
        let largest = reflectance.max();
        if largest >= 1.0 {
            reflectance = reflectance.map(|c| if c >= 1.0 { CLAMPED } else { c });
            notes.push(format!(
                "material '{name}' has a reflectance of {largest:.4}; channels of 1 and more become {CLAMPED}"
            ));
        }
        let strength = source
            .extensions
            .as_ref()
            .and_then(|e| e.emissive_strength.as_ref())
            .map_or(1.0, |s| f64::from(s.emissive_strength.0));
        let radiance = Rgb(std::array::from_fn(|i| f64::from(source.emissive_factor.0[i]) * glow[i] * strength));
        match source.alpha_mode {
            Checked::Valid(AlphaMode::Opaque) => {}
            _ => notes.push(format!("material '{name}' is transparent (alpha mode); it is treated as opaque")),
        }
        let others = source.extensions.as_ref().map(|e| &e.others);
        if others.is_some_and(|o| o.contains_key("KHR_materials_pbrSpecularGlossiness")) {
            notes.push(format!("material '{name}': KHR_materials_pbrSpecularGlossiness is ignored"));
        }
        Ok(Material { name, reflectance, radiance, two_sided: source.double_sided })
    }

    /// Mean of a texture, decoded once.
    fn mean(
        &mut self,
        texture: usize,
        linear: bool,
        material: &str,
        notes: &mut Vec<String>,
    ) -> Result<[f64; 3], String> {
        if !self.textures.contains_key(&texture) {
            match texture::mean(self.root, self.data, texture) {
                Ok(mean) => {
                    self.textures.insert(texture, mean);
                }
                Err(Unread::Broken(message)) => return Err(format!("material '{material}': {message}")),
                Err(Unread::Format(message)) => {
                    notes.push(format!("material '{material}': {message}; its mean is taken as {UNREAD}"));
                    return Ok([UNREAD; 3]);
                }
            }
        }
        Ok(self.textures.get(&texture).map_or([1.0; 3], |m| if linear { m.linear } else { m.stored }))
    }
}
