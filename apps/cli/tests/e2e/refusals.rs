//! Bad input: exit code 2, a message that names the culprit, and nothing written.

use crate::program::{Place, ROOM, room};

/// Runs and checks that it is refused, in one line, with these words, leaving the folder as it was.
#[track_caller]
fn refused(place: &Place, arguments: &str, said: &[&str]) {
    let before = place.names();
    let ended = place.run(arguments).with_code(2);
    assert!(ended.err.starts_with("error: ") || ended.err.contains("\nerror: "), "{arguments}: {}", ended.err);
    for word in said {
        assert!(ended.err.contains(word), "{arguments}: no '{word}' in: {}", ended.err);
    }
    assert!(ended.out.is_empty() && !ended.err.contains("panicked"), "{arguments}: {}", ended.err);
    assert_eq!(place.names(), before, "{arguments}");
}

#[test]
fn scene_files_that_are_broken() {
    let place = Place::new();
    room(&place);
    let change = |name: &str, from: &str, to: &str| {
        assert!(ROOM.contains(from));
        place.write(name, ROOM.replace(from, to));
    };
    change("nan.obj", "v 2 2 0", "v 2 nan 0");
    change("index.obj", "f 5 6 7 8", "f 5 6 7 9");
    change("dark.obj", "usemtl lamp", "usemtl grey");
    change("bright.obj", "mtllib room.mtl", "mtllib bright.mtl");
    place.write("bright.mtl", "newmtl grey\nKd 0.5 1.5 0.5\nnewmtl lamp\nKe 1 1 1\n");
    place.write("empty.obj", "");
    place.write("cut.glb", &glb(r#"{"asset":{"version":"2.0"}}"#)[..20]);
    place.write("short.glb", b"glTF\x02\0\0\0\xff\0\0\0");
    place.write(
        "draco.glb",
        glb(r#"{"asset":{"version":"2.0"},"extensionsUsed":["KHR_draco_mesh_compression"],
               "extensionsRequired":["KHR_draco_mesh_compression"]}"#),
    );
    for (scene, said) in [
        ("missing.obj", &["missing.obj", "cannot be read"][..]),
        ("nan.obj", &["nan.obj:4"]),
        ("index.obj", &["index.obj:15", "9"]),
        ("dark.obj", &["dark", "no emitter", "Ke"]),
        ("bright.obj", &["'grey'", "1.5"]),
        ("empty.obj", &["empty.obj"]),
        ("cut.glb", &["cut.glb"]),
        ("short.glb", &["short.glb"]),
        ("draco.glb", &["draco.glb", "KHR_draco_mesh_compression"]),
        ("room.mtl", &["room.mtl", ".obj, .gltf, .glb"]),
        ("builtin:palace", &["palace", "cornell"]),
    ] {
        refused(&place, &format!("light {scene}"), said);
        refused(&place, &format!("light {scene} -o a.png -o a.onl --report a.json"), said);
        if scene != "dark.obj" {
            refused(&place, &format!("info {scene}"), said);
        }
    }
}

/// A GLB file with this JSON and no binary chunk.
fn glb(json: &str) -> Vec<u8> {
    let mut text = json.as_bytes().to_vec();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((20 + text.len() as u32).to_le_bytes());
    bytes.extend((text.len() as u32).to_le_bytes());
    bytes.extend(b"JSON");
    bytes.extend(text);
    bytes
}

#[test]
fn outputs_that_cannot_be() {
    let place = Place::new();
    room(&place);
    for (arguments, said) in [
        ("-o a.jpg", &["a.jpg", "unknown ending", ".png"][..]),
        ("-o a", &["unknown ending"]),
        ("-o a.json", &["--report a.json"]),
        ("-o no/a.png", &["no/a.png", "does not exist"]),
        ("-o a.png -o no/b.png", &["no/b.png"]),
        ("-o a.png -o ./a.png", &["a.png", "twice"]),
        ("-o a.csv -o a.elements.csv", &["a.elements.csv", "twice"]),
        ("-o a.png --report a.png", &["a.png", "twice"]),
        ("-o room.obj/a.png", &["room.obj"]),
        ("--report no/a.json", &["no/a.json"]),
    ] {
        refused(&place, &format!("light room.obj {arguments}"), said);
    }
    // the scene itself is not overwritten by its model
    place.write("room.glb", glb(r#"{"asset":{"version":"2.0"}}"#));
    refused(&place, "light room.glb -o room.glb", &["room.glb", "would be overwritten"]);
    // a folder in the way of a default output, and of the default folder
    place.write("out", "a file");
    refused(&place, "light room.obj", &["out"]);
    assert_eq!(place.text("room.obj"), ROOM);
}

#[test]
fn flags_that_make_no_sense() {
    let place = Place::new();
    room(&place);
    for (flags, said) in [
        ("--error much", &["--error much", "0.5%"][..]),
        ("--error 0", &["--error", "0.01 %"]),
        ("--error -1%", &["--error"]),
        ("--error NaN", &["--error"]),
        ("--error 200%", &["--error", "100 %"]),
        ("--basis m9", &["--basis", "m9", "haar"]),
        ("--method teapot", &["--method", "teapot", "sampled", "galerkin"]),
        ("--solver jacobi", &["--solver", "sampled", "no links"]),
        ("--subdivision 2", &["--subdivision", "no links"]),
        ("--method wavelet --solver cramer", &["--solver", "cramer", "gauss-seidel"]),
        ("--method classical --basis m2", &["--basis", "classical", "haar", "galerkin"]),
        ("--method hierarchical --basis m2", &["--basis", "hierarchical", "wavelet"]),
        ("--method galerkin --basis haar", &["--basis", "galerkin", "classical"]),
        ("--method galerkin --basis f2", &["--basis", "flatlets", "m2 to m6"]),
        ("--method wavelet --subdivision 2", &["--subdivision", "wavelet", "classical"]),
        ("--method classical --subdivision 99", &["--subdivision 99", "0 to 12"]),
        ("--method classical --subdivision 9", &["full matrix", "elements", "GB", "hierarchical"]),
        ("--oracle fit", &["--oracle", "sampled", "no links"]),
        ("--weight none", &["--weight", "sampled", "no links"]),
        ("--basis auto", &["--basis", "sampled", "wavelet"]),
        ("--method galerkin --basis auto", &["--basis", "galerkin", "wavelet"]),
        ("--method classical --oracle error", &["--oracle", "classical", "all pairs"]),
        ("--method galerkin --weight none", &["--weight", "galerkin", "all pairs"]),
        ("--method wavelet --oracle delphi", &["--oracle", "delphi", "magnitude, fit, error"]),
        ("--method wavelet --weight gold", &["--weight", "gold", "brightness, variation, none"]),
        ("--method wavelet --oracle magnitude --weight variation", &["--weight", "magnitude", "error and fit"]),
        ("--decomposition standard", &["--decomposition", "sampled", "no links"]),
        ("--method classical --decomposition standard", &["--decomposition", "classical", "wavelet"]),
        ("--method wavelet --decomposition upright", &["--decomposition", "upright", "nonstandard, standard"]),
        ("--method wavelet --decomposition standard --basis f2", &["--decomposition", "flatlets", "m2 to m6"]),
        ("--method wavelet --decomposition standard --basis auto", &["--decomposition", "auto"]),
        ("--method wavelet --decomposition standard --oracle fit", &["--decomposition", "oracle", "full matrix"]),
        ("--method wavelet --decomposition standard --solver southwell", &["--decomposition", "local", "jacobi"]),
        ("--threads 0", &["--threads 0", "1 to 1024"]),
        ("--threads 100000", &["--threads", "1 to 1024"]),
        ("--max-time 10", &["--max-time 10", "500ms"]),
        ("--max-time -1s", &["--max-time"]),
        ("--camera eye=1,2:at=0,0,0", &["--camera", "'1,2'", "eye=x,y,z"]),
        ("--camera at=0,0,0", &["--camera", "'eye' is missing"]),
        ("--bogus", &["--bogus"]),
        ("second.obj", &["second.obj"]),
    ] {
        refused(&place, &format!("light room.obj {flags} -o a.onl"), said);
    }
    place.write("room.glb", glb(r#"{"asset":{"version":"2.0"}}"#));
    refused(&place, "light room.glb --two-sided", &["--two-sided", "doubleSided"]);
    place.run("shine").with_code(2);
    place.run("").with_code(2);
}
