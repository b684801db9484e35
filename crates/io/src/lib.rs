//! Scene, picture, model and solution files.
//!
//! [`mod@write`]: pictures, lit models and tables, each written whole or not at all; [`onl`]: the versioned,
//! checksummed container of solutions. Engines know no file format: everything that parses or prints bytes for a user's
//! disk is here.

pub mod onl;
pub mod write;
