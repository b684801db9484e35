//! The checks and benchmarks that CI and contributors run.
//!
//! ```text
//! cargo xtask ci        everything, as .ci/run does
//! cargo xtask layers    the architecture alone: who may depend on whom, and the habits a compiler does not check
//! cargo xtask bench light   what lighting costs, how good the result is, how it grows with the scene, and relighting
//! ```

mod bench;
mod ci;
mod layers;
mod links;
mod office;
mod source;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let root = workspace_root();
    let result = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["ci"] => ci::run(&root),
        ["layers"] => ci::layers(&root),
        ["bench", "light"] => bench::light(&root, bench::Extent::Full),
        ["bench", "light", "--quick"] => bench::light(&root, bench::Extent::Quick),
        _ => {
            eprintln!("usage: cargo xtask ci | layers | bench light [--quick]");
            return ExitCode::from(2);
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

/// The folder of the workspace's Cargo.toml.
fn workspace_root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_path_buf()
}
