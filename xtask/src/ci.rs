//! The list of checks, in one place.

use crate::{layers, links, source};
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// Commands of the check, cheapest first. All use the release profile: tests solve real scenes, and one profile means
/// that build scripts, macros and dependencies are built once.
const STEPS: [(&str, &[&str]); 4] = [
    ("format", &["fmt", "--all", "--check"]),
    ("clippy", &["clippy", "--workspace", "--all-targets", "--release", "--locked", "--", "-D", "warnings"]),
    ("tests", &["test", "--workspace", "--release", "--locked"]),
    ("documentation", &["doc", "--workspace", "--release", "--locked", "--no-deps"]),
];

/// Runs every check, stopping at the first that fails.
pub(crate) fn run(root: &Path) -> Result<(), String> {
    let start = Instant::now();
    println!("== layers");
    layers(root)?;
    for (name, arguments) in STEPS {
        println!("== {name}: cargo {}", arguments.join(" "));
        let step = Instant::now();
        let status = cargo(root)
            .args(arguments)
            .env("RUSTDOCFLAGS", "-Dwarnings")
            .status()
            .map_err(|e| format!("cargo does not start: {e}"))?;
        if !status.success() {
            return Err(format!("== {name} failed ({status}); to repeat it: cargo {}", arguments.join(" ")));
        }
        println!("== {name}: ok, {:.0} s", step.elapsed().as_secs_f64());
    }
    println!("== all checks passed in {:.0} s", start.elapsed().as_secs_f64());
    Ok(())
}

/// The architecture check: crates and sources.
pub(crate) fn layers(root: &Path) -> Result<(), String> {
    let output = cargo(root)
        .args(["metadata", "--no-deps", "--format-version", "1"])
        .output()
        .map_err(|e| format!("cargo does not start: {e}"))?;
    if !output.status.success() {
        return Err(format!("cargo metadata failed:\n{}", String::from_utf8_lossy(&output.stderr)));
    }
    let text = String::from_utf8_lossy(&output.stdout);
    let mut faults = layers::faults(&text)?;
    let sources = source::read_all(root)?;
    for file in &sources {
        faults.extend(source::faults(&file.path, &file.text));
        if let Some(note) = source::length_note(&file.path, &file.text) {
            println!("note: {note}");
        }
    }
    faults.extend(links::faults(root)?);
    if faults.is_empty() {
        println!("layers: {} source files keep to the architecture", sources.len());
        return Ok(());
    }
    Err(format!("{}\n{} breaches of the architecture (ARCHITECTURE.md says why)", faults.join("\n"), faults.len()))
}

fn cargo(root: &Path) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root);
    command
}
