//! Which crate may depend on which: the matrix of ARCHITECTURE.md, checked against `cargo metadata`.

use serde_json::Value;

/// Our crates, lowest first, each with those of ours that it may use. Nothing may use an application or xtask.
const OURS: [(&str, &[&str]); 9] = [
    ("ondelette-numerics", &[]),
    ("ondelette-wavelet", &["ondelette-numerics"]),
    ("ondelette-compress", &["ondelette-numerics", "ondelette-wavelet"]),
    ("ondelette-radiosity", &["ondelette-numerics", "ondelette-wavelet", "ondelette-compress"]),
    ("ondelette-modeling", &["ondelette-numerics", "ondelette-wavelet"]),
    // an independent check: it may use scenes and rays, and nothing that solves
    ("ondelette-verify", &["ondelette-numerics", "ondelette-radiosity"]),
    (
        "ondelette-io",
        &["ondelette-numerics", "ondelette-wavelet", "ondelette-compress", "ondelette-radiosity", "ondelette-modeling"],
    ),
    (
        "ondelette",
        &[
            "ondelette-numerics",
            "ondelette-wavelet",
            "ondelette-compress",
            "ondelette-radiosity",
            "ondelette-modeling",
            "ondelette-verify",
            "ondelette-io",
        ],
    ),
    ("xtask", &[]),
];

/// Foreign crates that only some of ours may use, and why.
const OWNED: [(&str, &[&str], &str); 19] = [
    ("rayon", &["ondelette-numerics"], "results must not depend on the number of threads"),
    ("clap", &["ondelette"], "libraries know no command line"),
    ("ctrlc", &["ondelette"], "libraries know no signals"),
    ("indicatif", &["ondelette"], "libraries never print"),
    ("exr", &["ondelette-io", "ondelette"], "engines know no file format"),
    ("gltf", &["ondelette-io"], "engines know no file format"),
    ("image", &["ondelette-io", "ondelette"], "engines know no file format"),
    ("postcard", &["ondelette-io"], "engines know no file format"),
    ("tobj", &["ondelette-io"], "engines know no file format"),
    ("xxhash-rust", &["ondelette-io"], "engines know no file format"),
    ("roxmltree", &["ondelette-io"], "engines know no file format"),
    ("serde_json", &["ondelette-io", "ondelette", "xtask"], "engines know no file format"),
    ("obvhs", &["ondelette-radiosity"], "rays are the business of light"),
    (
        "glam",
        &["ondelette-radiosity", "ondelette-verify", "ondelette-io", "ondelette"],
        "bases and links know no space",
    ),
    ("faer", &["ondelette-modeling"], "sparse factorisation is the business of shape"),
    ("rustfft", &["ondelette-modeling"], "spectral solutions are the business of shape"),
    ("tracing", &[], "libraries neither print nor log: engines return events"),
    ("log", &[], "libraries neither print nor log: engines return events"),
    ("anyhow", &["xtask"], "errors say what, where, the limit and what to do: an enum beside its function"),
];

/// What the matrix forbids in the output of `cargo metadata --no-deps --format-version 1`, a sentence each.
///
/// Dependencies of tests must keep the arrows between our crates (a test that needs a higher crate belongs there) and
/// the rule on threads; other foreign crates are free to them.
pub(crate) fn faults(metadata: &str) -> Result<Vec<String>, String> {
    let metadata: Value = serde_json::from_str(metadata).map_err(|e| format!("cargo metadata is not JSON: {e}"))?;
    let packages = metadata["packages"].as_array().ok_or("cargo metadata lists no packages")?;
    let mut faults = Vec::new();
    for package in packages {
        let name = package["name"].as_str().unwrap_or_default();
        let Some((_, may_use)) = OURS.iter().find(|ours| ours.0 == name) else {
            faults.push(format!("crate {name} has no place in the matrix: give it one in xtask/src/layers.rs"));
            continue;
        };
        for dependency in package["dependencies"].as_array().into_iter().flatten() {
            let target = dependency["name"].as_str().unwrap_or_default();
            let for_tests = dependency["kind"].as_str() == Some("dev");
            if OURS.iter().any(|ours| ours.0 == target) && !may_use.contains(&target) {
                faults.push(format!("crate {name} must not depend on {target}: that arrow is not in the matrix"));
            }
            let owned = OWNED.iter().find(|owned| owned.0 == target);
            if let Some((_, owners, why)) = owned
                && !owners.contains(&name)
                && (!for_tests || target == "rayon")
            {
                let owners = if owners.is_empty() { "no crate".to_owned() } else { owners.join(", ") };
                faults.push(format!("crate {name} must not depend on {target} (only {owners}): {why}"));
            }
        }
    }
    Ok(faults)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn check(name: &str, dependencies: &[(&str, Option<&str>)]) -> Vec<String> {
        let dependencies: Vec<Value> =
            dependencies.iter().map(|(name, kind)| json!({ "name": name, "kind": kind })).collect();
        let metadata = json!({ "packages": [{ "name": name, "dependencies": dependencies }] });
        faults(&metadata.to_string()).unwrap()
    }

    #[test]
    fn the_arrows_of_the_matrix_pass() {
        assert!(check("ondelette-io", &[("ondelette-radiosity", None), ("gltf", None), ("glam", None)]).is_empty());
        assert!(check("ondelette-radiosity", &[("ondelette-compress", None), ("thiserror", None)]).is_empty());
        assert!(check("ondelette", &[("ondelette-io", None), ("clap", None)]).is_empty());
    }

    #[test]
    fn an_arrow_that_points_up_is_caught() {
        for (from, to) in [
            ("ondelette-numerics", "ondelette-wavelet"),
            ("ondelette-wavelet", "ondelette-compress"),
            ("ondelette-compress", "ondelette-radiosity"),
            ("ondelette-radiosity", "ondelette-io"),
            ("ondelette-io", "ondelette"),
            ("ondelette-io", "xtask"),
            ("xtask", "ondelette-numerics"),
        ] {
            for kind in [None, Some("dev"), Some("build")] {
                let faults = check(from, &[(to, kind)]);
                assert_eq!(faults.len(), 1, "{from} -> {to}");
                assert!(faults[0].contains(from) && faults[0].contains(to));
            }
        }
    }

    #[test]
    fn a_second_user_of_rayon_is_caught_even_in_tests() {
        assert!(check("ondelette-numerics", &[("rayon", None)]).is_empty());
        assert_eq!(check("ondelette-compress", &[("rayon", None)]).len(), 1);
        assert_eq!(check("ondelette-compress", &[("rayon", Some("dev"))]).len(), 1);
    }

    #[test]
    fn file_formats_and_command_lines_stay_where_they_belong_but_tests_may_use_them() {
        assert_eq!(check("ondelette-radiosity", &[("image", None), ("clap", None)]).len(), 2);
        assert!(check("ondelette", &[("gltf", Some("dev"))]).is_empty());
        assert_eq!(check("ondelette", &[("gltf", None)]).len(), 1);
    }

    #[test]
    fn a_new_crate_must_be_given_a_place() {
        assert!(check("ondelette-magic", &[])[0].contains("no place"));
    }

    #[test]
    fn metadata_that_is_none_is_an_error_not_a_pass() {
        assert!(faults("").is_err());
        assert!(faults("{}").is_err());
    }
}
