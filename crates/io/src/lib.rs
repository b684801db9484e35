//! Scene, picture, model and solution files.

mod read;

pub use read::{ENDINGS, ReadError, ReadOptions, builtin, read_scene};
