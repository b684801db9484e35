//! What the program leaves on a user's disk: pictures, lit models, tables.
//!
//! Every writer takes plain numbers, checks them, and then goes through [`AtomicFile`]: a file appears under its name
//! complete or not at all. Bytes depend on the input alone: no clock, no thread count, no path is written.

mod atomic;
mod csv;
mod glb;
mod lit;
mod picture;
mod tables;
mod tone;

pub use atomic::{AtomicFile, check_writable, create_folder, remove_unfinished, write_bytes};
pub use csv::{Cell, CsvWriter, push_row};
pub use glb::{LitMesh, LitModel, ModelNote, glb_bytes, write_glb};
pub use lit::{ModelPainter, lit_model, scene_tone};
pub use picture::{exr_bytes, png_bytes, write_exr, write_png};
pub use tables::{elements_path, write_tables};
pub use tone::ToneMap;

use std::io;
use std::path::{Path, PathBuf};

/// Why an output file was not written. The disk is as it was before, except for what [`create_folder`] made.
///
/// ```
/// use ondelette_io::write::{WriteError, check_writable};
/// let error = check_writable("no/such/folder/room.png".as_ref()).unwrap_err();
/// assert!(matches!(error, WriteError::MissingFolder { .. }));
/// assert!(error.to_string().contains("no/such/folder"));
/// ```
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The folder that should hold the file is not there.
    #[error("cannot write {}: the folder {} does not exist; create it or choose another place",
            path.display(), folder.display())]
    MissingFolder {
        /// The file asked for.
        path: PathBuf,
        /// Its folder.
        folder: PathBuf,
    },
    /// The path names a folder, a device, a pipe, or nothing.
    #[error("cannot write {}: that is not a regular file; give the name of a file", .0.display())]
    NotAFile(PathBuf),
    /// A file of that name exists and is marked read-only.
    #[error("cannot write {}: a read-only file of that name exists; remove it or choose another name", .0.display())]
    ReadOnly(PathBuf),
    /// The operating system refused.
    #[error("cannot write {}: {doing} failed: {source}", path.display())]
    Refused {
        /// The file asked for.
        path: PathBuf,
        /// Which step failed.
        doing: &'static str,
        /// What the system said.
        source: io::Error,
    },
    /// The numbers to be written are not writable in this format.
    #[error("cannot write {}: {reason}", path.display())]
    Data {
        /// The file asked for.
        path: PathBuf,
        /// What is wrong with which number.
        reason: String,
    },
}

impl WriteError {
    fn data(path: &Path, reason: impl Into<String>) -> Self {
        WriteError::Data { path: path.to_path_buf(), reason: reason.into() }
    }
}
