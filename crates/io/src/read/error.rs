//! Why a scene file could not be read.

use super::{ENDINGS, builtin};
use ondelette_radiosity::scene::SceneError;
use std::path::PathBuf;

/// Why a scene file could not be read.
///
/// ```
/// use ondelette_io::{ReadError, ReadOptions, read_scene};
/// let missing = read_scene("no/such/room.obj", &ReadOptions::default()).unwrap_err();
/// assert!(matches!(missing, ReadError::Open { .. }));
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReadError {
    /// The file is not there or may not be read.
    #[error("{}: cannot be read: {reason}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        reason: String,
    },
    /// The ending is not one of [`ENDINGS`].
    #[error("{}: unknown kind of scene file; known endings: {}", path.display(), ENDINGS.join(", "))]
    Ending {
        /// The file.
        path: PathBuf,
    },
    /// There is no built-in scene of that name.
    #[error("builtin:{name}: no such scene; built in: {}", builtin::NAMES.join(", "))]
    Builtin {
        /// The name asked for.
        name: String,
    },
    /// A line of a text file is wrong.
    #[error("{}:{line}: {message}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1.
        line: u32,
        /// What is wrong and what to do.
        message: String,
    },
    /// A glTF or GLB file is broken.
    #[error("{}: {message}", path.display())]
    Gltf {
        /// The file.
        path: PathBuf,
        /// What is wrong and what to do.
        message: String,
    },
    /// A glTF file cannot be understood without an extension that is not supported.
    #[error(
        "{}: needs the glTF extension '{name}', which is not supported; export the scene without it \
         (supported: {supported})",
        path.display()
    )]
    Extension {
        /// The file.
        path: PathBuf,
        /// Name of the extension.
        name: String,
        /// Names of the extensions that may be required.
        supported: String,
    },
    /// The file is well formed, but not a scene that can be lit.
    #[error("{}: {error}", path.display())]
    Scene {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        error: SceneError,
    },
}
