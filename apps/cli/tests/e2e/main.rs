//! The program as its users meet it: files, exit codes, messages.

mod damage;
mod design;
mod edit;
mod fit;
mod light;
mod probe;
mod program;
mod refusals;
mod relight;
#[cfg(unix)]
mod stopping;
mod verify;
