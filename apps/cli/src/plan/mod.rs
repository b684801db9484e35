//! What is going to be done, judged before anything is computed.

pub(crate) mod light;
pub(crate) mod shape;
pub(crate) mod values;

use crate::run::Refusal;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// A path by which two names of one file are recognised, also of a file that is not there yet.
fn identity(path: &Path) -> PathBuf {
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    match (path.canonicalize(), folder.canonicalize(), path.file_name()) {
        (Ok(whole), _, _) => whole,
        (_, Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_path_buf(),
    }
}

/// Refuses to write one file twice, or over one that is read.
pub(crate) fn check_distinct(inputs: &[&Path], outputs: &[&Path]) -> Result<(), Refusal> {
    let inputs: HashSet<PathBuf> = inputs.iter().map(|p| identity(p)).collect();
    let mut seen = HashSet::new();
    for path in outputs {
        let identity = identity(path);
        if inputs.contains(&identity) {
            let name = path.display();
            return Err(Refusal::new(format!("{name} is read and would be overwritten: choose another output")));
        }
        if !seen.insert(identity) {
            return Err(Refusal::new(format!("{} would be written twice: name each output once", path.display())));
        }
    }
    Ok(())
}
