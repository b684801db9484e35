//! Shape formats: files of other programs, round trips, damaged files.

mod cad;
mod damage;
mod document;
mod outline;
