//! glTF and GLB scenes: what is read, and what each broken file is told.

use ondelette_io::{ReadError, ReadOptions, read_scene};
use ondelette_radiosity::Scene;
use ondelette_radiosity::scene::{Quantity, Shape};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

fn seed(name: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/seeds")).join(name)
}

fn read_bytes(name: &str, bytes: &[u8]) -> Result<Scene, ReadError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    read_scene(path, &ReadOptions::default())
}

/// The seed scene with a change to its description.
fn changed(change: impl FnOnce(&mut Value)) -> Result<Scene, ReadError> {
    let mut root: Value = serde_json::from_slice(&std::fs::read(seed("room.gltf")).unwrap()).unwrap();
    change(&mut root);
    read_bytes("s.gltf", root.to_string().as_bytes())
}

fn refusal(change: impl FnOnce(&mut Value)) -> String {
    changed(change).unwrap_err().to_string()
}

/// Patches of the object of that name.
fn normals(scene: &Scene, object: &str) -> Vec<[f64; 3]> {
    scene
        .patches
        .iter()
        .filter(|p| scene.objects[p.provenance.object as usize].name == object)
        .map(|p| p.normal().to_array().map(|c| c.round() + 0.0))
        .collect()
}

#[test]
fn the_seed_room_is_read_whole_from_glb_and_gltf() {
    let scene = read_scene(seed("room.glb"), &ReadOptions::default()).unwrap();
    assert_eq!(scene, read_scene(seed("room.gltf"), &ReadOptions::default()).unwrap());
    assert_eq!(scene.quantity, Quantity::Photometric, "the unit of glTF emission is cd/m^2");
    assert!(scene.unit.stated && scene.unit.metres == 1.0);
    let names: Vec<&str> = scene.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["floor", "mirrored", "lamp.0", "lamp.1"]);
    // The room is turned so that its z is up (+y). The mirrored instance faces down, its winding turned with it;
    // the lamp is turned over.
    assert_eq!(normals(&scene, "floor"), [[0., 1., 0.]]);
    assert_eq!(normals(&scene, "mirrored"), [[0., -1., 0.]]);
    assert_eq!(normals(&scene, "lamp.0"), [[0., -1., 0.]]);
    let area = |name: &str| -> f64 {
        let of = |o: u32| scene.objects[o as usize].name == name;
        scene.patches.iter().filter(|p| of(p.provenance.object)).map(|p| p.area()).sum()
    };
    // 4 x 4; a strip scaled by 4/4; a fan whose third corner a sparse accessor moved from (1, 1) to (2, 1).
    for (name, expected) in [("floor", 16.0), ("mirrored", 16.0), ("lamp.0", 1.0), ("lamp.1", 1.5)] {
        assert!((area(name) - expected).abs() < 1e-6, "{name}: {} for {expected}", area(name));
    }
    let floor = &scene.patches[0];
    assert_eq!((floor.shape, floor.provenance.faces.as_slice()), (Shape::Parallelogram, &[0, 1][..]));
    assert!(floor.provenance.uv0.is_some() && floor.provenance.uv1.is_none());
    assert!(scene.patches[2].provenance.uv0.is_none() && scene.patches[2].provenance.uv1.is_some());
    let camera = scene.camera.unwrap();
    assert!((camera.eye - glam::DVec3::new(2.0, 1.5, 3.0)).length() < 1e-6);
    assert!((camera.at - camera.eye + glam::DVec3::Z).length() < 1e-6, "glTF cameras look along -z");
    assert!((camera.fov - 0.8_f64.to_degrees()).abs() < 1e-5);
}

#[test]
fn materials_keep_what_diffuse_light_needs() {
    let scene = read_scene(seed("room.glb"), &ReadOptions::default()).unwrap();
    let material = |name: &str| scene.materials.iter().find(|m| m.name == name).unwrap();
    // 0.8, times a half black and half white picture, times white and red corners in the ratio 2 : 1.
    let checks = material("checks").reflectance.0;
    let expected = [0.4, 0.4 * 2.0 / 3.0, 0.4 * 2.0 / 3.0];
    assert!(checks.iter().zip(expected).all(|(c, e)| (c - e).abs() < 1e-6), "{checks:?}");
    assert_eq!(material("glow").radiance.0, [100.0, 50.0, 25.0], "factor times strength");
    assert!(material("glow").two_sided && !material("checks").two_sided);
    assert_eq!(material("white").reflectance.0, [0.95; 3]);
    assert!(scene.warnings.iter().any(|w| w.contains("'white'") && w.contains("0.95")), "{:?}", scene.warnings);
}

#[test]
fn metal_reflects_no_diffuse_light_and_a_bare_material_is_white() {
    let scene = changed(|r| {
        r["materials"][0]["pbrMetallicRoughness"]["metallicFactor"] = json!(0.25);
        r["materials"][1]["pbrMetallicRoughness"] = json!({"baseColorFactor": [0.5, 0.5, 0.5, 1]});
        r["meshes"][1]["primitives"][1].as_object_mut().unwrap().remove("material");
    })
    .unwrap();
    let material = |name: &str| scene.materials.iter().find(|m| m.name == name).unwrap();
    assert!((material("checks").reflectance.0[0] - 0.3).abs() < 1e-6);
    assert_eq!(material("glow").reflectance.0, [0.0; 3], "metallicFactor is 1 where the file leaves it out");
    assert!(scene.warnings.iter().any(|w| w.contains("'glow'") && w.contains("all metal")));
    assert_eq!(material("(no material)").reflectance.0, [0.95; 3]);
}

#[test]
fn what_is_not_read_is_said() {
    let scene = changed(|r| {
        r["materials"][0]["alphaMode"] = json!("BLEND");
        r["materials"][2]["extensions"] = json!({"KHR_materials_unlit": {}});
        r["extensionsUsed"] =
            json!(["KHR_lights_punctual", "KHR_materials_transmission", "KHR_materials_ior", "VENDOR_magic"]);
        r["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": 0}]);
        r["meshes"][1]["primitives"].as_array_mut().unwrap().push(json!({"attributes": {"POSITION": 0}, "mode": 1}));
    })
    .unwrap();
    let all = scene.warnings.join("\n");
    for word in [
        "'checks' is transparent",
        "1 primitive with KHR_materials_unlit left out",
        "KHR_lights_punctual) are ignored",
        "KHR_materials_transmission is ignored",
        "VENDOR_magic is ignored",
        "2 primitives with morph targets",
        "1 primitive of points, lines or nothing",
    ] {
        assert!(all.contains(word), "no word about '{word}' in:\n{all}");
    }
    assert!(!all.contains("KHR_materials_ior"), "what does not touch diffuse light is no news:\n{all}");
    assert!(scene.patches.iter().all(|p| scene.materials[p.material as usize].name != "white"));
}

#[test]
fn required_extensions_are_named() {
    let text = refusal(|r| r["extensionsRequired"] = json!(["KHR_mesh_quantization", "EXT_meshopt_compression"]));
    assert!(text.contains("s.gltf") && text.contains("'EXT_meshopt_compression'"), "{text}");
    assert!(text.contains("not supported") && text.contains("export"), "{text}");
}

#[test]
fn truncated_files_are_refused_wherever_they_end() {
    let whole = std::fs::read(seed("room.glb")).unwrap();
    for length in (0..whole.len()).step_by(5) {
        let text = read_bytes("s.glb", &whole[..length]).unwrap_err().to_string();
        assert!(text.contains("s.glb"), "{text}");
        assert!(length < 4 || text.contains("truncated"), "cut to {length}: {text}");
    }
    let whole = std::fs::read(seed("room.gltf")).unwrap();
    let text = read_bytes("s.gltf", &whole[..whole.len() / 2]).unwrap_err().to_string();
    assert!(text.contains("JSON") && text.contains("line"), "{text}");
}

#[test]
fn buffers_and_pictures_come_from_files_beside_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let glb = std::fs::read(seed("room.glb")).unwrap();
    let json_length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    std::fs::write(folder.path().join("my room.bin"), &glb[20 + json_length + 8..]).unwrap();
    let mut root: Value = serde_json::from_slice(&glb[20..20 + json_length]).unwrap();
    root["buffers"][0]["uri"] = json!("my%20room.bin");
    let path = folder.path().join("room.gltf");
    std::fs::write(&path, root.to_string()).unwrap();
    assert_eq!(
        read_scene(&path, &ReadOptions::default()).unwrap(),
        read_scene(seed("room.glb"), &ReadOptions::default()).unwrap()
    );
    root["images"][0] = json!({"uri": "gone.png"});
    std::fs::write(&path, root.to_string()).unwrap();
    let text = read_scene(&path, &ReadOptions::default()).unwrap_err().to_string();
    assert!(text.contains("gone.png") && text.contains("'checks'"), "{text}");
    root["buffers"][0]["uri"] = json!("gone.bin");
    std::fs::write(&path, root.to_string()).unwrap();
    let text = read_scene(&path, &ReadOptions::default()).unwrap_err().to_string();
    assert!(text.contains("buffer 0") && text.contains("gone.bin"), "{text}");
}

/// Every place in which a file can point outside itself.
#[test]
fn references_out_of_range_are_refused_by_name() {
    type Change = fn(&mut Value);
    let cases: [(&str, Change); 16] = [
        ("POSITION: accessor 99", |r| r["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(99)),
        ("indices: accessor 99", |r| r["meshes"][0]["primitives"][0]["indices"] = json!(99)),
        ("material 99", |r| r["meshes"][0]["primitives"][0]["material"] = json!(99)),
        ("mesh 99", |r| r["nodes"][1]["mesh"] = json!(99)),
        ("node 99", |r| r["nodes"][0]["children"] = json!([1, 99])),
        ("camera 99", |r| r["nodes"][4]["camera"] = json!(99)),
        ("scene 99", |r| r["scene"] = json!(99)),
        ("texture 99", |r| r["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = json!(99)),
        ("buffer view 99", |r| r["accessors"][0]["bufferView"] = json!(99)),
        ("buffer 99", |r| r["bufferViews"][0]["buffer"] = json!(99)),
        ("over the end", |r| r["bufferViews"][0]["byteLength"] = json!(1_000_000)),
        ("over the end", |r| r["accessors"][0]["count"] = json!(u64::MAX)),
        ("stride", |r| r["bufferViews"][0]["byteStride"] = json!(0)),
        ("not a tree", |r| r["nodes"][1]["children"] = json!([0])),
        ("is not a Vec3", |r| r["accessors"][0]["type"] = json!("SCALAR")),
        ("refers to vertex 3, but there are only 3", |r| {
            for attribute in [0, 1, 5] {
                r["accessors"][attribute]["count"] = json!(3);
            }
        }),
    ];
    for (expected, change) in cases {
        let text = refusal(change);
        assert!(text.contains("s.gltf") && text.contains(expected), "'{expected}' is not in: {text}");
    }
}

#[test]
fn numbers_that_are_none_are_refused() {
    let text = refusal(|r| r["nodes"][1]["translation"] = json!([0, 1e39, 0]));
    assert!(text.contains("s.gltf") && text.contains("number out of range"), "{text}");
    let mut glb = std::fs::read(seed("room.glb")).unwrap();
    let start = glb.windows(4).position(|w| w == b"BIN\0").unwrap() + 4;
    glb[start..start + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let text = read_bytes("s.glb", &glb).unwrap_err().to_string();
    assert!(text.contains("face 0 of object 'floor'") && text.contains("finite"), "{text}");
}

#[test]
fn emission_cannot_be_negative_and_version_1_is_refused() {
    let text = refusal(|r| r["materials"][1]["emissiveFactor"] = json!([1, -1, 0]));
    assert!(text.contains("'glow'") && text.contains("negative"), "{text}");
    let text = refusal(|r| r["asset"]["version"] = json!("1.0"));
    assert!(text.contains("1.0") && text.contains("version 2"), "{text}");
    let text = read_bytes("s.glb", b"solid cube").unwrap_err().to_string();
    assert!(text.contains("neither GLB"), "{text}");
}
