//! Arrays of an `.npz` archive: numbers of 4 or 8 bytes, little-endian, and one text.

use std::fs::File;
use std::io::Read;
use std::path::Path;

/// An open archive.
pub(crate) struct Npz {
    arrays: Vec<(String, String, Vec<u8>)>,
}

impl Npz {
    /// Reads all arrays.
    pub(crate) fn open(path: &Path) -> Result<Npz, String> {
        let at = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let file = File::open(path).map_err(|e| at(&e))?;
        let mut archive = zip::ZipArchive::new(file).map_err(|e| at(&e))?;
        let mut arrays = Vec::new();
        for i in 0..archive.len() {
            let mut member = archive.by_index(i).map_err(|e| at(&e))?;
            let name = member.name().trim_end_matches(".npy").to_owned();
            let mut bytes = Vec::new();
            member.read_to_end(&mut bytes).map_err(|e| at(&e))?;
            let (kind, data) = array(&bytes).ok_or_else(|| at(&format!("{name} is not an .npy array")))?;
            arrays.push((name, kind, data.to_vec()));
        }
        Ok(Npz { arrays })
    }

    fn find(&self, name: &str) -> Result<&(String, String, Vec<u8>), String> {
        self.arrays.iter().find(|a| a.0 == name).ok_or_else(|| format!("no array {name}"))
    }

    /// All values of an array, row-major.
    pub(crate) fn numbers(&self, name: &str) -> Result<Vec<f64>, String> {
        let (_, kind, data) = self.find(name)?;
        let eight =
            |f: &dyn Fn([u8; 8]) -> f64| data.chunks_exact(8).map(|c| f(c.try_into().unwrap_or_default())).collect();
        let four =
            |f: &dyn Fn([u8; 4]) -> f64| data.chunks_exact(4).map(|c| f(c.try_into().unwrap_or_default())).collect();
        let values: Vec<f64> = match kind.as_str() {
            "<f8" => eight(&f64::from_le_bytes),
            "<f4" => four(&|b| f64::from(f32::from_le_bytes(b))),
            "<i8" => eight(&|b| i64::from_le_bytes(b) as f64),
            "<i4" => four(&|b| f64::from(i32::from_le_bytes(b))),
            other => return Err(format!("array {name} holds {other}")),
        };
        if values.is_empty() || values.iter().any(|v| !v.is_finite()) {
            return Err(format!("array {name} is empty or not finite"));
        }
        Ok(values)
    }

    /// A text of numpy's fixed-width type.
    pub(crate) fn text(&self, name: &str) -> Result<String, String> {
        let (_, kind, data) = self.find(name)?;
        if !kind.starts_with("<U") {
            return Err(format!("array {name} holds {kind}, not a text"));
        }
        let codes = data.chunks_exact(4).map(|c| u32::from_le_bytes(c.try_into().unwrap_or_default()));
        Ok(codes.take_while(|c| *c != 0).filter_map(char::from_u32).collect())
    }
}

/// Element type and data of the bytes of an `.npy` file.
fn array(bytes: &[u8]) -> Option<(String, &[u8])> {
    let version = bytes.strip_prefix(b"\x93NUMPY")?;
    let (length, from) = match version.first()? {
        1 => (usize::from(u16::from_le_bytes(version.get(2..4)?.try_into().ok()?)), 10),
        _ => (u32::from_le_bytes(version.get(2..6)?.try_into().ok()?) as usize, 12),
    };
    let header = std::str::from_utf8(bytes.get(from..from + length)?).ok()?;
    if header.contains("'fortran_order': True") {
        return None;
    }
    let kind = header.split("'descr': '").nth(1)?.split('\'').next()?;
    Some((kind.to_owned(), &bytes[from + length..]))
}
