//! Wavefront MTL: `Kd` (times the mean of `map_Kd`) is the diffuse reflectance, `Ke` (times the mean of `map_Ke`) the
//! emitted radiance; transparency is noted, the rest ignored.

use super::obj::{Statement, Statements};
use super::picture::{self, UNREAD, Unread};
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

/// A material while its statements are read.
struct Entry {
    name: String,
    /// `Kd` and its line.
    reflectance: Option<(Rgb, u32)>,
    radiance: Option<Rgb>,
    reflectance_map: Option<(Rgb, u32)>,
    radiance_map: Option<Rgb>,
}

impl Library {
    /// Adds the materials of one MTL file; a name that is there already starts over.
    ///
    /// **Errors** with file and line for numbers that are missing, not finite or out of range.
    pub(super) fn add(&mut self, path: &Path, warnings: &mut Vec<String>) -> Result<(), ReadError> {
        let bytes = read_bytes(path)?;
        let text = String::from_utf8_lossy(&bytes);
        let file = path.file_name().map_or_else(String::new, |f| f.to_string_lossy().into_owned());
        let mut entries: Vec<Entry> = Vec::new();
        for statement in Statements::new(path, &text) {
            let keyword = statement.keyword.as_str();
            if keyword == "newmtl" {
                let name = statement.rest.clone();
                if self.by_name.contains_key(&name) || entries.iter().any(|e| e.name == name) {
                    let line = statement.line;
                    warnings.push(format!("{file}:{line}: material '{name}' is defined twice; the later one is used"));
                }
                entries.push(Entry {
                    name,
                    reflectance: None,
                    radiance: None,
                    reflectance_map: None,
                    radiance_map: None,
                });
                continue;
            }
            if !["Kd", "Ke", "map_Kd", "map_Ke", "d", "Tr"].contains(&keyword) {
                continue;
            }
            let Some(entry) = entries.last_mut() else {
                return Err(statement.error(format!("{keyword} stands before the first newmtl")));
            };
            match keyword {
                "Kd" => entry.reflectance = Some((colour(&statement)?, statement.line)),
                "Ke" => entry.radiance = Some(radiance(&statement, &entry.name)?),
                "map_Kd" => {
                    entry.reflectance_map = Some((texture(&statement, path, &entry.name, warnings)?, statement.line));
                }
                "map_Ke" => entry.radiance_map = Some(texture(&statement, path, &entry.name, warnings)?),
                _ => {
                    let opaque = if keyword == "d" { 1.0 } else { 0.0 };
                    let value = statement.rest.split_whitespace().next().and_then(|w| w.parse::<f64>().ok());
                    if value.is_some_and(|v| v != opaque) {
                        warnings.push(format!("material '{}' is transparent; it is treated as opaque", entry.name));
                    }
                }
            }
        }
        for entry in entries {
            let material = entry.finish(path, &file, warnings)?;
            match self.by_name.get(&material.name) {
                Some(&index) => self.materials[index as usize] = material,
                None => {
                    let index = u32::try_from(self.materials.len()).unwrap_or(u32::MAX);
                    self.by_name.insert(material.name.clone(), index);
                    self.materials.push(material);
                }
            }
        }
        Ok(())
    }
}

impl Entry {
    fn finish(self, path: &Path, file: &str, warnings: &mut Vec<String>) -> Result<Material, ReadError> {
        let name = self.name;
        let (reflectance, line) = match (self.reflectance, self.reflectance_map) {
            (Some((kd, line)), map) => (kd * map.map_or(Rgb::grey(1.0), |(mean, _)| mean), line),
            (None, Some((mean, line))) => (mean, line),
            (None, None) => {
                warnings.push(format!(
                    "material '{name}' of {file} states no Kd; reflectance {DEFAULT_REFLECTANCE} is assumed"
                ));
                (Rgb::grey(DEFAULT_REFLECTANCE), 0)
            }
        };
        if let Some(c) = reflectance.0.iter().find(|c| !(0.0..1.0).contains(*c)) {
            let times = if self.reflectance_map.is_some() { " (times the mean of map_Kd)" } else { "" };
            let message = format!(
                "Kd of material '{name}'{times} is {c}, outside [0, 1): a surface cannot reflect all the light it \
                 gets; choose a value below 1 (white paint: about 0.8)"
            );
            return Err(ReadError::Line { path: path.into(), line, message });
        }
        let radiance = match (self.radiance, self.radiance_map) {
            (Some(ke), Some(mean)) => ke * mean,
            (Some(ke), None) => ke,
            (None, Some(mean)) => mean,
            (None, None) => Rgb::BLACK,
        };
        Ok(Material { name, reflectance, radiance, two_sided: false })
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

fn radiance(statement: &Statement<'_>, name: &str) -> Result<Rgb, ReadError> {
    let radiance = colour(statement)?;
    match radiance.0.iter().find(|&&c| c < 0.0) {
        None => Ok(radiance),
        Some(c) => {
            Err(statement.error(format!("Ke of material '{name}' is {c}: an emitted radiance cannot be negative")))
        }
    }
}

/// Mean of a picture beside the library, in linear light. Options before the name change its place, not its mean.
fn texture(
    statement: &Statement<'_>,
    path: &Path,
    material: &str,
    warnings: &mut Vec<String>,
) -> Result<Rgb, ReadError> {
    let beside = |name: &str| path.parent().unwrap_or_else(|| Path::new("")).join(name.replace('\\', "/"));
    let mut file = beside(&statement.rest);
    if !file.is_file() {
        file = beside(statement.rest.split_whitespace().last().unwrap_or(""));
    }
    let keyword = &statement.keyword;
    let broken = |why: String| {
        let name = file.display();
        statement.error(format!(
            "{keyword} of material '{material}': {name}: {why}; put the picture there or remove this line"
        ))
    };
    let bytes = std::fs::read(&file).map_err(|error| broken(error.to_string()))?;
    match picture::mean(&bytes) {
        Ok(mean) => Ok(Rgb(mean.linear)),
        Err(Unread::Broken(why)) => Err(broken(why)),
        Err(Unread::Format(why)) => {
            warnings.push(format!("{keyword} of material '{material}': {why}; its mean is taken as {UNREAD}"));
            Ok(Rgb::grey(UNREAD))
        }
    }
}
