//! Links of the papers to files of the project: each must lead somewhere.

use std::fs;
use std::path::Path;

/// Dead links in the Markdown files of the workspace's folder and of `docs/`, a sentence each.
pub(crate) fn faults(root: &Path) -> Result<Vec<String>, String> {
    let mut faults = Vec::new();
    in_folder(root, "", false, &mut faults)?;
    in_folder(&root.join("docs"), "docs/", true, &mut faults)?;
    faults.sort();
    Ok(faults)
}

fn in_folder(folder: &Path, name: &str, deep: bool, faults: &mut Vec<String>) -> Result<(), String> {
    let failed = |e: std::io::Error| format!("cannot read {}: {e}", folder.display());
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() && deep {
            in_folder(&path, &format!("{name}{file}/"), deep, faults)?;
        } else if file.ends_with(".md") {
            let text = fs::read_to_string(&path).map_err(|e| format!("cannot read {name}{file}: {e}"))?;
            for target in targets(&text) {
                if !folder.join(&target).exists() {
                    faults.push(format!("{name}{file}: the link to {target} leads nowhere"));
                }
            }
        }
    }
    Ok(())
}

/// Files that a text links to, without those of the web and without the place inside the file.
fn targets(text: &str) -> Vec<String> {
    let mut targets = Vec::new();
    let mut in_code = false;
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            in_code = !in_code;
        }
        if in_code {
            continue;
        }
        for part in line.split("](").skip(1) {
            let target = part.split([')', '#', ' ']).next().unwrap_or_default();
            if !target.is_empty() && !target.contains("://") && !target.starts_with("mailto:") {
                targets.push(target.to_owned());
            }
        }
    }
    targets
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_to_files_are_found_and_those_to_the_web_are_left_alone() {
        let text = "see [a](docs/a.md#part) and ![b](b.png), [web](https://a.b/c)\n```\n[x](y)\n```\n[here](#top)";
        assert_eq!(targets(text), ["docs/a.md", "b.png"]);
    }

    #[test]
    fn a_dead_link_is_named_with_its_file() {
        let folder = std::env::temp_dir().join(format!("ondelette-links-{}", std::process::id()));
        fs::create_dir_all(folder.join("docs/guide")).unwrap();
        fs::write(folder.join("README.md"), "[guide](docs/guide/light.md) [gone](gone.md)").unwrap();
        fs::write(folder.join("docs/guide/light.md"), "[back](../../README.md) [lost](../lost.md)").unwrap();
        let found = faults(&folder);
        fs::remove_dir_all(&folder).unwrap();
        let want = [
            "README.md: the link to gone.md leads nowhere",
            "docs/guide/light.md: the link to ../lost.md leads nowhere",
        ];
        assert_eq!(found.unwrap(), want);
    }
}
