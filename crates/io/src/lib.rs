//! Scene, picture, model and solution files.
//!
//! [`read_scene`]: scene files and the built-in scenes; [`mod@write`]: pictures, lit models and tables, each written
//! whole or not at all; [`onl`]: solutions, versioned and checksummed. Engines know no file format: everything that
//! parses or prints bytes for a user's disk is here. [`shape`]: curves and surfaces; [`npy`]: arrays.

pub mod npy;
pub mod onl;
mod read;
pub mod shape;
pub mod write;

pub use read::{ENDINGS, Panel, ReadError, ReadOptions, builtin, read_scene};
