//! Reading the container: everything is checked before anything is handed out.

use super::{ALIGNMENT, ENTRY, HEADER, MAGIC, OnlError, VERSION, table_checksum};
use bytemuck::{AnyBitPattern, NoUninit};
use serde::de::DeserializeOwned;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::xxh3_64;

/// An `.onl` file in memory, every byte of it verified.
///
/// Checksums guard against accidents, not against malice: what a chunk says must still be checked by whoever uses it.
/// Reading never allocates more than a small multiple of the file's length.
#[derive(Clone, Debug)]
pub struct ChunkFile {
    path: PathBuf,
    bytes: Vec<u8>,
    chunks: Vec<(String, Range<usize>)>,
}

impl ChunkFile {
    /// Reads and verifies the file `path`.
    ///
    /// # Errors
    /// The file cannot be read, is not an `.onl` file, has another version, is cut short or damaged.
    pub fn read(path: &Path) -> Result<Self, OnlError> {
        let failed = |source| OnlError::Read { path: path.to_path_buf(), source };
        let mut file = File::open(path).map_err(failed)?;
        // the first bytes first: nobody wants to wait for a film to be loaded that was named by mistake
        let mut bytes = Vec::new();
        (&mut file).take(HEADER as u64).read_to_end(&mut bytes).map_err(failed)?;
        check_start(path, &bytes)?;
        file.read_to_end(&mut bytes).map_err(failed)?;
        Self::from_bytes(path, bytes)
    }

    /// Verifies the bytes of a file; `path` is for messages only.
    ///
    /// # Errors
    /// As [`ChunkFile::read`].
    pub fn from_bytes(path: &Path, bytes: Vec<u8>) -> Result<Self, OnlError> {
        check_start(path, &bytes)?;
        let damaged = |reason: &str| OnlError::Table { path: path.to_path_buf(), reason: reason.into() };
        let found = bytes.len() as u64;
        if bytes.len() < HEADER {
            return Err(OnlError::Length { path: path.to_path_buf(), stated: HEADER as u64, found });
        }
        let stated = u64_at(&bytes, 24);
        if stated != found {
            return Err(OnlError::Length { path: path.to_path_buf(), stated, found });
        }
        let count = u32_at(&bytes, 20) as usize;
        let table_end = count.checked_mul(ENTRY).and_then(|n| n.checked_add(HEADER)).filter(|&n| n <= bytes.len());
        let table_end = table_end.ok_or_else(|| damaged("the chunk table is longer than the file"))?;
        if u64_at(&bytes, 32) != table_checksum(&bytes[..HEADER], &bytes[HEADER..table_end]) {
            return Err(damaged("its checksum does not match"));
        }
        let mut chunks: Vec<(String, Range<usize>)> = Vec::with_capacity(count);
        let mut names = BTreeSet::new();
        let mut end = table_end;
        let zeros = |gap: Range<usize>| bytes[gap].iter().all(|&b| b == 0);
        for entry in bytes[HEADER..table_end].chunks_exact(ENTRY) {
            let name = chunk_name(&entry[..8]).ok_or_else(|| damaged("a chunk has no readable name"))?;
            let start = end.next_multiple_of(ALIGNMENT);
            let stop = usize::try_from(u64_at(entry, 16)).ok().and_then(|length| start.checked_add(length));
            let Some(stop) = stop.filter(|&stop| stop <= bytes.len() && u64_at(entry, 8) == start as u64) else {
                return Err(damaged(&format!("the chunk '{name}' lies where no chunk can")));
            };
            if !zeros(end..start) {
                return Err(damaged(&format!("the bytes before the chunk '{name}' are not zero")));
            }
            if !names.insert(name.clone()) {
                return Err(damaged(&format!("there are two chunks '{name}'")));
            }
            if xxh3_64(&bytes[start..stop]) != u64_at(entry, 24) {
                return Err(OnlError::Checksum { path: path.to_path_buf(), chunk: name });
            }
            chunks.push((name, start..stop));
            end = stop;
        }
        if end != bytes.len() || !zeros(40..HEADER) {
            return Err(damaged("there are bytes that belong to no chunk"));
        }
        Ok(ChunkFile { path: path.to_path_buf(), bytes, chunks })
    }

    /// Names of the chunks, in file order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.chunks.iter().map(|c| c.0.as_str())
    }

    /// Whether there is a chunk of that name.
    pub fn has(&self, name: &str) -> bool {
        self.names().any(|n| n == name)
    }

    /// The bytes of a chunk.
    ///
    /// # Errors
    /// There is no such chunk.
    pub fn bytes(&self, name: &str) -> Result<&[u8], OnlError> {
        match self.chunks.iter().find(|c| c.0 == name) {
            Some((_, range)) => Ok(&self.bytes[range.clone()]),
            None => Err(OnlError::MissingChunk { path: self.path.clone(), chunk: name.into() }),
        }
    }

    /// A structure that [`super::ChunkWriter::add_struct`] wrote.
    ///
    /// # Errors
    /// There is no such chunk, or it holds another structure.
    pub fn structure<T: DeserializeOwned>(&self, name: &str) -> Result<T, OnlError> {
        match postcard::take_from_bytes(self.bytes(name)?) {
            Ok((value, [])) => Ok(value),
            Ok((_, rest)) => Err(self.content(name, format!("{} bytes are left over", rest.len()))),
            Err(e) => Err(self.content(name, e.to_string())),
        }
    }

    /// An array that [`super::ChunkWriter::add_array`] wrote. Any bit pattern is accepted: for floats that must be
    /// numbers see [`ChunkFile::finite_f64`].
    ///
    /// # Errors
    /// There is no such chunk, or its length is not a multiple of the element's.
    pub fn array<T: AnyBitPattern + NoUninit>(&self, name: &str) -> Result<Vec<T>, OnlError> {
        let (bytes, size) = (self.bytes(name)?, size_of::<T>());
        if size == 0 || !bytes.len().is_multiple_of(size) {
            let reason = format!("its {} bytes are not a whole number of elements of {size} bytes", bytes.len());
            return Err(self.content(name, reason));
        }
        // a copy: the file's bytes need not be aligned in memory
        Ok(bytemuck::pod_collect_to_vec(bytes))
    }

    /// An array of f64, every one finite.
    ///
    /// # Errors
    /// As [`ChunkFile::array`]; a number that is infinite or not a number.
    pub fn finite_f64(&self, name: &str) -> Result<Vec<f64>, OnlError> {
        let values: Vec<f64> = self.array(name)?;
        self.refuse_unless_finite(name, values.iter().position(|v| !v.is_finite()))?;
        Ok(values)
    }

    /// An array of f32, every one finite.
    ///
    /// # Errors
    /// As [`ChunkFile::finite_f64`].
    pub fn finite_f32(&self, name: &str) -> Result<Vec<f32>, OnlError> {
        let values: Vec<f32> = self.array(name)?;
        self.refuse_unless_finite(name, values.iter().position(|v| !v.is_finite()))?;
        Ok(values)
    }

    /// The error for a chunk whose content makes no sense to its user.
    pub fn content(&self, name: &str, reason: impl Into<String>) -> OnlError {
        OnlError::Content { path: self.path.clone(), chunk: name.into(), reason: reason.into() }
    }

    fn refuse_unless_finite(&self, name: &str, bad: Option<usize>) -> Result<(), OnlError> {
        match bad {
            Some(i) => Err(self.content(name, format!("its number {i} (counted from 0) is not finite"))),
            None => Ok(()),
        }
    }
}

/// Magic and version: what can be judged before the rest is read.
fn check_start(path: &Path, bytes: &[u8]) -> Result<(), OnlError> {
    if !bytes.starts_with(MAGIC) {
        return Err(OnlError::NotOnl(path.to_path_buf()));
    }
    match bytes.get(16..20) {
        Some(_) if u32_at(bytes, 16) != VERSION => {
            Err(OnlError::Version { path: path.to_path_buf(), found: u32_at(bytes, 16), supported: VERSION })
        }
        _ => Ok(()),
    }
}

/// The name in a table entry: one to eight printable ASCII characters, then zeros.
fn chunk_name(field: &[u8]) -> Option<String> {
    let length = field.iter().position(|&b| b == 0).unwrap_or(field.len());
    let (name, rest) = field.split_at(length);
    let good = !name.is_empty() && name.iter().all(u8::is_ascii_graphic) && rest.iter().all(|&b| b == 0);
    good.then(|| String::from_utf8_lossy(name).into_owned())
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(std::array::from_fn(|i| bytes[at + i]))
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(std::array::from_fn(|i| bytes[at + i]))
}
