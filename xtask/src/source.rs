//! What a compiler does not check in the sources: length, names, and words that a crate must not know.

use std::fs;
use std::path::Path;

/// A file may be longer than this only with a reason; `layers` notes it.
const LONG: usize = 500;
/// A file longer than this holds more than one idea.
const TOO_LONG: usize = 800;
/// Characters in a line; rustfmt does not break comments and strings.
const WIDTH: usize = 120;

/// Names that say nothing about what is inside.
const EMPTY_NAMES: [&str; 7] = ["common", "helper", "helpers", "misc", "stuff", "util", "utils"];

/// Words that a crate must not contain: a word is found if it *begins* with one of the stems, so that "slightly" and
/// "flux" are no light. `compress` compresses any integral operator; a word about light in it means that physics has
/// crept below the line. `wavelet` knows spaces of functions and nothing of what they are used for.
const UNSPOKEN: [(&str, &[&str]); 2] = [
    ("crates/compress/src/", &["light", "radios", "irradian", "radian", "lumin", "illumin", "photo", "lux"]),
    ("crates/wavelet/src/", &["radios", "irradian", "lumin", "illumin", "photo"]),
];

/// What no library may do, and why.
const NOT_IN_LIBRARIES: [(&str, &str); 9] = [
    ("println!", "libraries never print"),
    ("eprintln!", "libraries never print"),
    ("print!", "libraries never print"),
    ("eprint!", "libraries never print"),
    ("Instant::now", "no result depends on a clock"),
    ("SystemTime::now", "no result depends on a clock"),
    ("env::var", "no result depends on the environment"),
    ("current_dir", "no result depends on the working directory"),
    ("thread::spawn", "only ondelette-numerics runs threads"),
];

/// A source file, its path relative to the workspace with `/` between folders.
pub(crate) struct Source {
    pub(crate) path: String,
    pub(crate) text: String,
}

/// Every Rust file of the workspace, in order of path.
pub(crate) fn read_all(root: &Path) -> Result<Vec<Source>, String> {
    let mut found = Vec::new();
    for folder in ["apps", "crates", "xtask"] {
        collect(&root.join(folder), folder, &mut found)?;
    }
    found.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(found)
}

fn collect(folder: &Path, name: &str, found: &mut Vec<Source>) -> Result<(), String> {
    let failed = |e: std::io::Error| format!("cannot read {}: {e}", folder.display());
    for entry in fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let file = entry.file_name().to_string_lossy().into_owned();
        let path = format!("{name}/{file}");
        if entry.path().is_dir() {
            if file != "target" && !file.starts_with('.') {
                collect(&entry.path(), &path, found)?;
            }
        } else if file.ends_with(".rs") {
            let text = fs::read_to_string(entry.path()).map_err(|e| format!("cannot read {path}: {e}"))?;
            found.push(Source { path, text });
        }
    }
    Ok(())
}

/// What is wrong with a source file, a sentence each.
pub(crate) fn faults(path: &str, text: &str) -> Vec<String> {
    let mut faults = Vec::new();
    let lines = text.lines().count();
    if lines > TOO_LONG {
        faults.push(format!("{path}: {lines} lines, more than {TOO_LONG}: split it where its second idea begins"));
    }
    if let Some(part) = path.split(['/', '.']).find(|part| EMPTY_NAMES.contains(part)) {
        faults.push(format!("{path}: the name '{part}' says nothing about what is inside"));
    }
    let stems = UNSPOKEN.iter().find(|(folder, _)| path.starts_with(folder)).map_or(&[][..], |(_, stems)| stems);
    let library = path.starts_with("crates/") && path.contains("/src/");
    for (line, number) in text.lines().zip(1..) {
        let width = line.chars().count();
        if width > WIDTH {
            faults.push(format!("{path}:{number}: {width} characters, more than {WIDTH}"));
        }
        if let Some(word) = words(line).into_iter().find(|word| stems.iter().any(|stem| word.starts_with(stem))) {
            faults.push(format!("{path}:{number}: the word '{word}' does not belong in this crate"));
        }
        if library && !line.trim_start().starts_with("//") {
            let slip = NOT_IN_LIBRARIES.iter().find(|(call, _)| contains_call(line, call));
            faults.extend(slip.map(|(call, why)| format!("{path}:{number}: {call} in a library: {why}")));
        }
    }
    faults
}

/// A remark on a file that is long but not too long.
pub(crate) fn length_note(path: &str, text: &str) -> Option<String> {
    let lines = text.lines().count();
    (lines > LONG && lines <= TOO_LONG).then(|| format!("{path} has {lines} lines; {LONG} are usually enough"))
}

/// The words of a line in lower case: runs of letters, cut where snake_case and CamelCase are.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut after_lower = false;
    for c in line.chars() {
        if !c.is_alphabetic() || (after_lower && c.is_uppercase()) {
            words.push(String::new());
        }
        if c.is_alphabetic() {
            words.last_mut().unwrap_or(&mut String::new()).extend(c.to_lowercase());
        }
        after_lower = c.is_lowercase();
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Whether `call` occurs in the line other than as the end of a longer name (`print!` in `eprint!`).
fn contains_call(line: &str, call: &str) -> bool {
    line.match_indices(call).any(|(at, _)| !line[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_about_light_are_caught_in_compress_and_nowhere_else() {
        for line in
            ["// the light of a lamp", "let b = radiosity;", "struct SkyLight;", "fn e_irradiance() {}", "// 5 lux"]
        {
            assert_eq!(faults("crates/compress/src/link.rs", line).len(), 1, "{line}");
            assert!(faults("crates/radiosity/src/link.rs", line).is_empty(), "{line}");
        }
        for line in ["// slightly", "let flux = 1;", "// highlights", "fn delight() {}"] {
            assert!(faults("crates/compress/src/link.rs", line).is_empty(), "{line}");
        }
        assert_eq!(faults("crates/wavelet/src/tree.rs", "/// used by radiosity").len(), 1);
    }

    #[test]
    fn libraries_that_print_or_look_at_clocks_are_caught() {
        let said = faults("crates/io/src/write.rs", "fn f() {\n    eprintln!(\"x\");\n    let t = Instant::now();\n}");
        assert_eq!(said.len(), 2);
        assert!(said[0].contains(":2: eprintln! in a library") && said[1].contains(":3: Instant::now"));
        assert!(faults("crates/io/src/write.rs", "/// println!(\"an example\")").is_empty());
        assert!(faults("apps/cli/src/main.rs", "println!();").is_empty());
        assert!(faults("crates/io/tests/a.rs", "println!();").is_empty());
    }

    #[test]
    fn lengths_and_empty_names_are_caught() {
        let long = "//\n".repeat(801);
        assert!(faults("crates/io/src/a.rs", &long)[0].contains("801 lines"));
        assert!(length_note("crates/io/src/a.rs", &long[..3 * 600]).is_some());
        assert!(length_note("crates/io/src/a.rs", &long[..3 * 500]).is_none());
        assert!(faults("crates/io/src/utils.rs", "")[0].contains("utils"));
        assert!(faults("crates/io/src/common/mod.rs", "")[0].contains("common"));
        assert!(faults("crates/io/src/commonly.rs", "").is_empty());
        assert_eq!(faults("crates/io/src/a.rs", &"x".repeat(121)).len(), 1);
    }

    #[test]
    fn the_check_sees_the_workspace() {
        let sources = read_all(&crate::workspace_root()).unwrap();
        assert!(sources.iter().any(|s| s.path == "xtask/src/source.rs"));
        assert!(sources.iter().any(|s| s.path == "crates/numerics/src/par.rs"));
    }
}
