//! Scene files to a valid [`Scene`]: OBJ with MTL, glTF and GLB, and the scenes that are built in.
//!
//! The readers turn a file into a [`SceneDraft`]; what is a legal scene is
//! decided there, once for all formats. Every error names the file, the line or the object, the value and its limit.

pub mod builtin;
mod error;
mod gltf;
mod mtl;
mod obj;
mod panel;
mod picture;

pub use error::ReadError;
pub use panel::Panel;

use ondelette_radiosity::Scene;
use ondelette_radiosity::scene::{BuildOptions, SceneDraft};
use std::path::Path;

/// Endings of the scene files that can be read.
pub const ENDINGS: [&str; 3] = [".obj", ".gltf", ".glb"];

/// How to read a scene file.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// Treat every material as two-sided, whatever the file says.
    pub two_sided: bool,
    /// Lamps that are added.
    pub panels: Vec<Panel>,
}

/// Reads a scene: a file that ends in `.obj`, `.gltf` or `.glb` (in any case), or `builtin:NAME`.
///
/// **Units** OBJ: radiometric, metres assumed, `Ke` is radiance. glTF: photometric, metres stated, the emissive factor
/// (times its texture's mean, times `KHR_materials_emissive_strength`) is luminance in cd/m^2.
///
/// **Errors** [`ReadError`]: a file that cannot be opened, an unknown ending, a broken file, a scene that is not valid.
///
/// ```
/// use ondelette_io::{ReadOptions, read_scene};
/// let scene = read_scene("builtin:cornell", &ReadOptions::default())?;
/// assert!(scene.has_emitter());
/// let refused = read_scene("room.blend", &ReadOptions::default()).unwrap_err();
/// assert!(refused.to_string().contains(".obj, .gltf, .glb"));
/// # Ok::<(), ondelette_io::ReadError>(())
/// ```
pub fn read_scene(path: impl AsRef<Path>, options: &ReadOptions) -> Result<Scene, ReadError> {
    let path = path.as_ref();
    let build = BuildOptions { two_sided: options.two_sided };
    let mut draft = if let Some(name) = path.to_str().and_then(|p| p.strip_prefix("builtin:")) {
        builtin::draft(name)?
    } else {
        read_draft(path)?
    };
    panel::add(&mut draft, &options.panels);
    draft.build(build).map_err(|error| ReadError::Scene { path: path.into(), error })
}

/// Reads a file by its ending, without the checks of [`SceneDraft::build`].
fn read_draft(path: &Path) -> Result<SceneDraft, ReadError> {
    let ending = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    match ending.as_deref() {
        Some("obj") => obj::read(path),
        Some("gltf" | "glb") => gltf::read(path),
        _ => Err(ReadError::Ending { path: path.into() }),
    }
}

/// All bytes of a file.
fn read_bytes(path: &Path) -> Result<Vec<u8>, ReadError> {
    std::fs::read(path).map_err(|error| ReadError::Open { path: path.into(), reason: error.to_string() })
}

/// The name of a scene: the file's name without its ending.
fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| "scene".into(), |s| s.to_string_lossy().into_owned())
}
