//! Holds the library against a file of reference vectors.
//!
//! `cargo run --release --example vectors -- FILE.json` prints a line per field, `section[i].field PASS|FAIL rel tol`,
//! SKIP for sections about other crates, and the totals; it exits with 1 if a field fails, with 2 if the file cannot be
//! read. Sections may be missing.

mod bases;
mod report;
mod sections;
mod shapes;

use report::Report;

fn main() -> std::process::ExitCode {
    let Some(path) = std::env::args().nth(1) else {
        eprintln!("usage: vectors FILE.json");
        return 2.into();
    };
    let parsed = std::fs::read_to_string(&path)
        .map_err(|e| e.to_string())
        .and_then(|text| serde_json::from_str(&text).map_err(|e| e.to_string()));
    let file: serde_json::Value = match parsed {
        Ok(v) => v,
        Err(e) => {
            eprintln!("{path}: {e}");
            return 2.into();
        }
    };
    let mut report = Report::default();
    sections::run(&file, &mut report);
    for line in &report.lines {
        println!("{line}");
    }
    println!("total: {} PASS, {} FAIL, {} SKIP", report.passed, report.failed, report.skipped);
    if report.failed > 0 { 1.into() } else { 0.into() }
}
