//! The parts of a GLB file: description and binary chunk, each length checked against the file.

/// Description and binary chunk of a file.
pub(super) struct Container<'a> {
    /// glTF description.
    pub(super) json: &'a [u8],
    /// Binary chunk of a GLB file.
    pub(super) binary: Option<&'a [u8]>,
}

impl<'a> Container<'a> {
    /// Splits a GLB file by its magic number; any other file is all description.
    pub(super) fn split(bytes: &'a [u8]) -> Result<Self, String> {
        let Some(rest) = bytes.strip_prefix(b"glTF") else {
            let start = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
            if start.trim_ascii_start().first() != Some(&b'{') {
                return Err("is neither GLB (which starts with 'glTF') nor a glTF description in JSON".into());
            }
            return Ok(Container { json: start, binary: None });
        };
        let (Some(version), Some(length)) = (word(rest, 0), word(rest, 4)) else {
            return Err(format!("is truncated: {} bytes are less than a GLB header", bytes.len()));
        };
        if version != 2 {
            return Err(format!("is GLB version {version}; only version 2 can be read"));
        }
        if (length as usize) > bytes.len() {
            return Err(format!("is truncated: the header states {length} bytes, but the file has {}", bytes.len()));
        }
        let mut at = 12;
        let (mut json, mut binary) = (None, None);
        while at + 8 <= length as usize {
            let (Some(size), Some(kind)) = (word(bytes, at), bytes.get(at + 4..at + 8)) else { break };
            let end = (at + 8).saturating_add(size as usize);
            let Some(chunk) = bytes.get(at + 8..end) else {
                return Err(format!("is truncated: a chunk ends at byte {end}, the file at {}", bytes.len()));
            };
            match kind {
                b"JSON" if json.is_none() => json = Some(chunk),
                b"BIN\0" if binary.is_none() => binary = Some(chunk),
                _ => {}
            }
            at = end;
        }
        let json = json.ok_or("has no JSON chunk")?;
        Ok(Container { json, binary })
    }
}

/// A little-endian word of four bytes.
fn word(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
}
