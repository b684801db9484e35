//! Writing the container.

use super::{ALIGNMENT, ENTRY, HEADER, MAGIC, VERSION, table_checksum};
use crate::write::{AtomicFile, WriteError};
use bytemuck::NoUninit;
use serde::Serialize;
use std::borrow::Cow;
use std::io::{self, Write};
use std::path::Path;
use xxhash_rust::xxh3::xxh3_64;

/// Collects named chunks and writes them as one `.onl` file.
///
/// Names have one to eight printable ASCII characters and are used once. Chunks keep the order in which they were
/// added.
///
/// ```
/// use ondelette_io::onl::{ChunkFile, ChunkWriter};
/// let mut writer = ChunkWriter::new();
/// writer.add_struct("settings", &("m2", 0.01)).unwrap();
/// writer.add_array("coeffs", &[1.0, 2.5]);
/// let file = ChunkFile::from_bytes("memory".as_ref(), writer.to_bytes()).unwrap();
/// assert_eq!(file.structure::<(String, f64)>("settings").unwrap().1, 0.01);
/// assert_eq!(file.finite_f64("coeffs").unwrap(), [1.0, 2.5]);
/// ```
#[derive(Clone, Debug, Default)]
pub struct ChunkWriter<'a> {
    chunks: Vec<([u8; 8], Cow<'a, [u8]>)>,
}

impl<'a> ChunkWriter<'a> {
    /// A container without chunks.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a chunk of raw bytes, its own or lent.
    ///
    /// # Panics
    /// If the name is empty, longer than eight bytes, not printable ASCII, or used before.
    #[track_caller]
    pub fn add_bytes(&mut self, name: &str, bytes: impl Into<Cow<'a, [u8]>>) {
        assert!(
            (1..=8).contains(&name.len()) && name.bytes().all(|b| b.is_ascii_graphic()),
            "a chunk name has one to eight printable ASCII characters, not {name:?}"
        );
        let mut padded = [0; 8];
        padded[..name.len()].copy_from_slice(name.as_bytes());
        assert!(self.chunks.iter().all(|c| c.0 != padded), "chunk '{name}' is added twice");
        self.chunks.push((padded, bytes.into()));
    }

    /// Adds a structure in the postcard encoding.
    ///
    /// # Errors
    /// The structure has no postcard encoding (a sequence of unknown length, a map key that fails).
    ///
    /// # Panics
    /// As [`ChunkWriter::add_bytes`].
    #[track_caller]
    pub fn add_struct<T: Serialize>(&mut self, name: &str, value: &T) -> Result<(), postcard::Error> {
        let bytes = postcard::to_stdvec(value)?;
        self.add_bytes(name, bytes);
        Ok(())
    }

    /// Adds an array of numbers or of padding-free records (`f64`, `f32`, `u32`, ...), little-endian, which is not
    /// copied.
    ///
    /// # Panics
    /// As [`ChunkWriter::add_bytes`].
    #[track_caller]
    pub fn add_array<T: NoUninit>(&mut self, name: &str, values: &'a [T]) {
        self.add_bytes(name, bytemuck::cast_slice::<T, u8>(values));
    }

    /// The bytes of the file: a function of the chunks alone. Cost O(bytes).
    ///
    /// # Panics
    /// If there are 2^32 chunks or more.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.put(&mut bytes).expect("memory takes every byte");
        bytes
    }

    /// Writes the file `path`, whole or not at all, without a second copy of the chunks in memory.
    ///
    /// # Errors
    /// As [`AtomicFile::create`] and [`AtomicFile::commit`].
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        let mut file = AtomicFile::create(path)?;
        self.put(&mut file).map_err(|e| file.refused("writing", e))?;
        file.commit()
    }

    fn put(&self, out: &mut impl Write) -> io::Result<()> {
        let mut end = HEADER + self.chunks.len() * ENTRY;
        let mut table = Vec::with_capacity(self.chunks.len() * ENTRY);
        for (name, bytes) in &self.chunks {
            let offset = end.next_multiple_of(ALIGNMENT);
            table.extend(name);
            table.extend((offset as u64).to_le_bytes());
            table.extend((bytes.len() as u64).to_le_bytes());
            table.extend(xxh3_64(bytes).to_le_bytes());
            end = offset + bytes.len();
        }
        let count = u32::try_from(self.chunks.len()).expect("fewer than 2^32 chunks");
        let mut header = MAGIC.to_vec();
        header.extend(VERSION.to_le_bytes());
        header.extend(count.to_le_bytes());
        header.extend((end as u64).to_le_bytes());
        header.resize(HEADER, 0);
        let checksum = table_checksum(&header, &table);
        header[32..40].copy_from_slice(&checksum.to_le_bytes());
        out.write_all(&header)?;
        out.write_all(&table)?;
        let mut at = HEADER + table.len();
        for (_, bytes) in &self.chunks {
            let start = at.next_multiple_of(ALIGNMENT);
            out.write_all(&[0; ALIGNMENT][..start - at])?;
            out.write_all(bytes)?;
            at = start + bytes.len();
        }
        Ok(())
    }
}
