//! Wavefront MTL: `Kd` is the diffuse reflectance, `Ke` the emitted radiance; the rest is noted or ignored.

use super::obj::{Statement, Statements};
use super::{ReadError, read_bytes};
use ondelette_radiosity::Rgb;
use ondelette_radiosity::scene::Material;
use std::collections::HashMap;
use std::path::Path;

/// Reflectance of faces and materials for which the file states none.
pub(super) const DEFAULT_REFLECTANCE: f64 = 0.5;

/// The materials of all libraries of an OBJ file.
#[derive(Default)]
pub(super) struct Library {
    /// In file order.
    pub(super) materials: Vec<Material>,
    /// Index by name.
    pub(super) by_name: HashMap<String, u32>,
}

impl Library {
    /// Adds the materials of one MTL file.
    ///
    /// **Errors** with file and line for numbers that are missing, not finite or out of range.
    pub(super) fn add(&mut self, path: &Path, warnings: &mut Vec<String>) -> Result<(), ReadError> {
        let bytes = read_bytes(path)?;
        let text = String::from_utf8_lossy(&bytes);
        let file = path.file_name().map_or_else(String::new, |f| f.to_string_lossy().into_owned());
        let mut current: Option<usize> = None;
        let mut stated = vec![true; self.materials.len()];
        for statement in Statements::new(path, &text) {
            match statement.keyword.as_str() {
                "newmtl" => {
                    current = Some(self.begin(statement.rest.trim(), &file, statement.line, warnings));
                    stated.resize(self.materials.len(), false);
                }
                "Kd" => {
                    let index = Self::owner(current, &statement)?;
                    self.materials[index].reflectance = reflectance(&statement, &self.materials[index].name)?;
                    stated[index] = true;
                }
                "Ke" => {
                    let index = Self::owner(current, &statement)?;
                    let radiance = colour(&statement)?;
                    if let Some(c) = radiance.0.iter().find(|&&c| c < 0.0) {
                        let name = &self.materials[index].name;
                        return Err(statement
                            .error(format!("Ke of material '{name}' is {c}: an emitted radiance cannot be negative")));
                    }
                    self.materials[index].radiance = radiance;
                }
                "map_Kd" | "map_Ke" => {
                    let index = Self::owner(current, &statement)?;
                    warnings.push(format!(
                        "{file}:{}: {} of material '{}' is not read; its {} alone is used",
                        statement.line,
                        statement.keyword,
                        self.materials[index].name,
                        &statement.keyword[4..]
                    ));
                }
                "d" | "Tr" => {
                    let index = Self::owner(current, &statement)?;
                    let opaque = if statement.keyword == "d" { 1.0 } else { 0.0 };
                    let value = statement.rest.split_whitespace().next().and_then(|w| w.parse::<f64>().ok());
                    if value.is_some_and(|v| v != opaque) {
                        let name = &self.materials[index].name;
                        warnings.push(format!("material '{name}' is transparent; it is treated as opaque"));
                    }
                }
                _ => {}
            }
        }
        for (material, stated) in self.materials.iter().zip(&stated) {
            if !stated {
                warnings.push(format!(
                    "material '{}' of {file} states no Kd; reflectance {DEFAULT_REFLECTANCE} is assumed",
                    material.name
                ));
            }
        }
        Ok(())
    }

    /// Index of a material by name; a repeated name starts over.
    fn begin(&mut self, name: &str, file: &str, line: u32, warnings: &mut Vec<String>) -> usize {
        let fresh = Material {
            name: name.to_string(),
            reflectance: Rgb::grey(DEFAULT_REFLECTANCE),
            radiance: Rgb::BLACK,
            two_sided: false,
        };
        if let Some(&index) = self.by_name.get(name) {
            warnings.push(format!("{file}:{line}: material '{name}' is defined twice; the later one is used"));
            self.materials[index as usize] = fresh;
            return index as usize;
        }
        let index = self.materials.len();
        self.by_name.insert(name.to_string(), u32::try_from(index).unwrap_or(u32::MAX));
        self.materials.push(fresh);
        index
    }

    fn owner(current: Option<usize>, statement: &Statement<'_>) -> Result<usize, ReadError> {
        current.ok_or_else(|| statement.error(format!("{} stands before the first newmtl", statement.keyword)))
    }
}

/// One number (all channels) or three.
fn colour(statement: &Statement<'_>) -> Result<Rgb, ReadError> {
    let numbers = statement.numbers()?;
    match numbers[..] {
        [grey] => Ok(Rgb::grey(grey)),
        [r, g, b] => Ok(Rgb::new(r, g, b)),
        _ => Err(statement.error(format!(
            "{} needs three numbers (red, green, blue), but has {}",
            statement.keyword,
            numbers.len()
        ))),
    }
}

fn reflectance(statement: &Statement<'_>, name: &str) -> Result<Rgb, ReadError> {
    let reflectance = colour(statement)?;
    if let Some(c) = reflectance.0.iter().find(|c| !(0.0..1.0).contains(*c)) {
        return Err(statement.error(format!(
            "Kd of material '{name}' is {c}, outside [0, 1): a surface cannot reflect all the light it gets; \
             choose a value below 1 (white paint: about 0.8)"
        )));
    }
    Ok(reflectance)
}
