//! Why a solution file cannot be used.

use std::io;
use std::path::PathBuf;

/// Why a `.onl` file was refused. Every message names the file; those about a chunk name the chunk.
///
/// ```
/// use ondelette_io::onl::{ChunkFile, OnlError};
/// let error = ChunkFile::from_bytes("room.onl".as_ref(), b"v 0 0 0".to_vec()).unwrap_err();
/// assert!(matches!(error, OnlError::NotOnl(_)));
/// ```
#[derive(Debug, thiserror::Error)]
pub enum OnlError {
    /// The file cannot be read at all.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file does not begin as solution files do.
    #[error("{} is not an Ondelette solution (.onl) file, or was changed by a transfer in text mode", .0.display())]
    NotOnl(PathBuf),
    /// The file is of another version of the format.
    #[error("{} has format version {found}; this program reads version {supported}: solve again, or use the program \
             that wrote it", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// The version it states.
        found: u32,
        /// The version that this program reads.
        supported: u32,
    },
    /// The file has not the length that it states.
    #[error("{} {}: it states {stated} bytes and has {found}", path.display(),
            if found < stated { "is cut short" } else { "goes on after its end" })]
    Length {
        /// The file.
        path: PathBuf,
        /// Bytes that it should have.
        stated: u64,
        /// Bytes that it has.
        found: u64,
    },
    /// Header, chunk table or the zeros between chunks are not what was written.
    #[error("{} is damaged in its header or chunk table: {reason}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The bytes of a chunk are not those that were written.
    #[error("{} is damaged: the checksum of its chunk '{chunk}' does not match", path.display())]
    Checksum {
        /// The file.
        path: PathBuf,
        /// The chunk's name.
        chunk: String,
    },
    /// A chunk that should be there is not.
    #[error("{} has no chunk '{chunk}'", path.display())]
    MissingChunk {
        /// The file.
        path: PathBuf,
        /// The chunk's name.
        chunk: String,
    },
    /// A chunk is whole but does not hold what was asked of it.
    #[error("{}: the chunk '{chunk}' does not hold what it should: {reason}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// The chunk's name.
        chunk: String,
        /// What is wrong.
        reason: String,
    },
}
