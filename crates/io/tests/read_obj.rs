//! OBJ scenes: what is read, and what each broken file is told.

use ondelette_io::{ReadError, ReadOptions, builtin, read_scene};
use ondelette_radiosity::Scene;
use ondelette_radiosity::scene::{Quantity, Shape, describe};
use std::path::Path;

const SEEDS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/seeds");

/// Reads a scene written into a fresh folder.
fn read(obj: &str, mtl: Option<&str>) -> Result<Scene, ReadError> {
    let folder = tempfile::tempdir().unwrap();
    if let Some(mtl) = mtl {
        std::fs::write(folder.path().join("m.mtl"), mtl).unwrap();
    }
    let path = folder.path().join("s.obj");
    std::fs::write(&path, obj).unwrap();
    read_scene(path, &ReadOptions::default())
}

fn refusal(obj: &str, mtl: Option<&str>) -> String {
    read(obj, mtl).unwrap_err().to_string()
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn the_seed_room_is_read_whole() {
    let scene = read_scene(Path::new(SEEDS).join("room.obj"), &ReadOptions::default()).unwrap();
    assert_eq!(scene.quantity, Quantity::Radiometric);
    assert!(!scene.unit.stated, "OBJ has no unit; a report must not pretend it has");
    let names: Vec<&str> = scene.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["floor", "shelf", "lamp"]);
    let area =
        |object: u32| -> f64 { scene.patches.iter().filter(|p| p.provenance.object == object).map(|p| p.area()).sum() };
    assert_eq!(scene.patches[0].shape, Shape::Parallelogram);
    assert!((area(0) - 12.0).abs() < 1e-12);
    assert!((area(1) - 1.5).abs() < 1e-12, "the notch of the shelf was covered");
    // The lamp is one triangle and its reverse, the second on a continued line.
    let lamp: Vec<f64> = scene.patches.iter().filter(|p| p.provenance.object == 2).map(|p| p.normal().z).collect();
    assert_eq!(lamp, [-1.0, 1.0]);
    assert_eq!(scene.patches[0].provenance.uv0, Some([[0., 0.], [1., 0.], [0., 1.], [1., 1.]]));
    assert_eq!(scene.materials[1].reflectance.0, [0.8; 3], "one number after Kd means all channels");
    assert_eq!(scene.materials[2].radiance.0, [10.0, 9.0, 8.0], "Ke is radiance as it stands");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn two_sided_doubles_the_sides() {
    let path = Path::new(SEEDS).join("room.obj");
    let one = read_scene(&path, &ReadOptions::default()).unwrap();
    let two = read_scene(&path, &ReadOptions { two_sided: true, ..ReadOptions::default() }).unwrap();
    assert_eq!(one.sides.len(), one.patches.len());
    assert_eq!(two.sides.len(), 2 * two.patches.len());
}

#[test]
fn numbers_that_are_none_are_refused_with_their_line() {
    for (bad, word) in [("nan", "not a finite number"), ("1e999", "not a finite number"), ("1,5", "not a number")] {
        let text = refusal(&format!("# corner\nv 0 {bad} 0\n{SQUARE}f 1 2 3\n"), None);
        assert!(text.contains("s.obj:2:") && text.contains(word) && text.contains(bad), "{text}");
    }
    let text = refusal("v 0 1\n", None);
    assert!(text.contains("s.obj:1:") && text.contains("three coordinates"), "{text}");
}

#[test]
fn indices_out_of_range_are_refused_with_their_line() {
    let over = refusal(&format!("{SQUARE}f 1 2 3\nf 1 2 5\n"), None);
    assert!(over.contains("s.obj:6:") && over.contains("vertex 5") && over.contains("only 4"), "{over}");
    let under = refusal(&format!("{SQUARE}f -5 -2 -1\n"), None);
    assert!(under.contains("s.obj:5:") && under.contains("-5"), "{under}");
    let zero = refusal(&format!("{SQUARE}f 0 1 2\n"), None);
    assert!(zero.contains("s.obj:5:") && zero.contains("count from 1"), "{zero}");
    let texture = refusal(&format!("{SQUARE}f 1/1 2/1 3/1\n"), None);
    assert!(texture.contains("s.obj:5:") && texture.contains("texture coordinate 1"), "{texture}");
    let word = refusal(&format!("{SQUARE}f 1 x 3\n"), None);
    assert!(word.contains("s.obj:5:") && word.contains("'x'"), "{word}");
}

#[test]
fn reflectances_of_one_and_more_are_refused_by_name() {
    for (kd, value) in [("1 1 1", "is 1,"), ("0.5 1.2 0.5", "1.2"), ("-0.1 0 0", "-0.1")] {
        let mtl = format!("newmtl grey\nKd 0.5 0.5 0.5\nnewmtl snow white\nKd {kd}\n");
        let text = refusal(&format!("mtllib m.mtl\nusemtl snow white\n{SQUARE}f 1 2 3 4\n"), Some(&mtl));
        assert!(text.contains("m.mtl:4:") && text.contains("'snow white'") && text.contains(value), "{text}");
        assert!(text.contains("below 1"), "{text}");
    }
}

#[test]
fn broken_materials_are_refused_with_their_line() {
    let with = |mtl: &str| refusal(&format!("mtllib m.mtl\n{SQUARE}f 1 2 3 4\n"), Some(mtl));
    let short = with("newmtl a\nKd 0.5 0.5\n");
    assert!(short.contains("m.mtl:2:") && short.contains("three numbers"), "{short}");
    let empty = with("newmtl a\nKd\n");
    assert!(empty.contains("m.mtl:2:") && empty.contains("three numbers"), "{empty}");
    let dark = with("newmtl a\nKe 0 -1 0\n");
    assert!(dark.contains("m.mtl:2:") && dark.contains("-1") && dark.contains("negative"), "{dark}");
    let lost = with("Kd 1 1 1\n");
    assert!(lost.contains("m.mtl:1:") && lost.contains("newmtl"), "{lost}");
    let spectral = with("newmtl a\nKd spectral x.rfl\n");
    assert!(spectral.contains("m.mtl:2:") && spectral.contains("'spectral'"), "{spectral}");
    let missing = refusal(&format!("{SQUARE}mtllib gone.mtl\nf 1 2 3 4\n"), None);
    assert!(missing.contains("s.obj:5:") && missing.contains("gone.mtl"), "{missing}");
    let unknown = refusal(&format!("mtllib m.mtl\n{SQUARE}usemtl b\nf 1 2 3 4\n"), Some("newmtl a\nKd 0 0 0\n"));
    assert!(unknown.contains("s.obj:6:") && unknown.contains("'b'"), "{unknown}");
}

#[test]
fn what_the_file_leaves_open_is_assumed_aloud() {
    let scene = read(&format!("{SQUARE}f 1 2 3 4\nl 1 2\np 1\n"), None).unwrap();
    assert_eq!(scene.material(scene.sides[0]).reflectance.0, [0.5; 3]);
    assert!(scene.warnings[0].contains("1 face without a material"), "{:?}", scene.warnings);
    assert!(scene.warnings[1].contains("2 statements ignored") && scene.warnings[1].contains("'l' at line 6"));
    let scene = read(&format!("mtllib m.mtl\n{SQUARE}usemtl a\nf 1 2 3 4\n"), Some("newmtl a\nd 0.5\n")).unwrap();
    let all = scene.warnings.join("\n");
    for word in ["transparent", "states no Kd"] {
        assert!(all.contains(word), "no word about '{word}' in:\n{all}");
    }
}

/// A texture darkens its material by its mean in linear light; an exporter's Kd 1 beside it is legal.
#[test]
fn textures_count_with_their_mean() {
    let folder = tempfile::tempdir().unwrap();
    let checks = image::RgbImage::from_fn(4, 4, |x, y| image::Rgb([if (x + y) % 2 == 0 { 255 } else { 0 }; 3]));
    checks.save(folder.path().join("dark checks.png")).unwrap();
    let obj = folder.path().join("s.obj");
    std::fs::write(&obj, format!("mtllib m.mtl\nusemtl a\n{SQUARE}f 1 2 3 4\n")).unwrap();
    let read = |mtl: &str| {
        std::fs::write(folder.path().join("m.mtl"), mtl).unwrap();
        read_scene(&obj, &ReadOptions::default())
    };
    let scene = read("newmtl a\nKd 1 0.5 0\nKe 4 4 4\nmap_Kd dark checks.png\nmap_Ke dark checks.png\n").unwrap();
    assert_eq!(scene.materials[0].reflectance.0, [0.5, 0.25, 0.0]);
    assert_eq!(scene.materials[0].radiance.0, [2.0; 3]);
    let gone = read("newmtl a\nKd 0.5 0.5 0.5\nmap_Kd -s 2 2 1 gone.png\n").unwrap_err().to_string();
    assert!(gone.contains("m.mtl:3:") && gone.contains("gone.png") && gone.contains("'a'"), "{gone}");
    std::fs::write(folder.path().join("wood.tga"), "no picture").unwrap();
    let scene = read("newmtl a\nKd 0.8 0.8 0.8\nmap_Kd wood.tga\n").unwrap();
    assert_eq!(scene.materials[0].reflectance.0, [0.4; 3]);
    assert!(scene.warnings[0].contains("neither PNG nor JPEG") && scene.warnings[0].contains("'a'"));
}

#[test]
fn dropped_faces_reach_the_report() {
    let scene = read(&format!("o wall\n{SQUARE}f 1 2 3 4\nf 1 2 2\nf 3 4 1 2\nf 2 1 1 2\n"), None).unwrap();
    assert_eq!(scene.patches.len(), 1);
    let text = describe(&scene);
    assert!(text.contains("2 zero-area faces dropped; the first is face 1 of object 'wall' (line 7)"), "{text}");
    assert!(text.contains("1 duplicate face dropped; the first is face 2 of object 'wall' (line 8)"), "{text}");
}

#[test]
fn scenes_without_a_surface_are_refused() {
    for obj in ["", "# nothing\n", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"] {
        let text = refusal(obj, None);
        assert!(text.contains("s.obj") && text.contains("nothing to light"), "{text}");
    }
}

#[test]
fn missing_files_and_unknown_kinds_are_told_apart() {
    let missing = read_scene("no/such/room.obj", &ReadOptions::default()).unwrap_err();
    assert!(matches!(missing, ReadError::Open { .. }) && missing.to_string().contains("no/such/room.obj"));
    for name in ["room.stl", "room", "builtin.txt"] {
        let text = read_scene(name, &ReadOptions::default()).unwrap_err().to_string();
        assert!(text.contains(name) && text.contains(".obj, .gltf, .glb"), "{text}");
    }
    let text = read_scene("builtin:sponza", &ReadOptions::default()).unwrap_err().to_string();
    assert!(text.contains("sponza") && text.contains("cornell"), "{text}");
}

/// The box a newcomer lights first: its faces must look into the room and out of the blocks, and close.
#[test]
fn the_built_in_box_faces_the_right_way() {
    let scene = builtin::cornell().unwrap();
    assert!(scene.warnings.is_empty() && scene.patches.iter().all(|p| p.shape == Shape::Parallelogram));
    let centre = glam::DVec3::new(278.0, 274.4, 279.6);
    for p in &scene.patches {
        let name = &scene.objects[p.provenance.object as usize].name;
        let middle = p.origin + 0.5 * (p.u + p.v);
        if name.contains("block") {
            let inside = if name.contains("short") { [186.0, 82.5, 169.5] } else { [368.5, 165.0, 351.5] };
            assert!((middle - glam::DVec3::from(inside)).dot(p.normal()) > 0.0, "{name} is turned inside out");
        } else {
            assert!((centre - middle).dot(p.normal()) > 0.0, "{name} looks out of the room");
        }
    }
    // The room is closed but for its front: area vectors of all fronts add up to the missing wall's.
    let sum: glam::DVec3 = scene.patches.iter().map(|p| p.normal() * p.area()).sum();
    // The blocks have no bottoms, which adds their footprints.
    let footprints: f64 = scene
        .patches
        .iter()
        .filter(|p| scene.objects[p.provenance.object as usize].name.contains("block") && p.normal().y > 0.9)
        .map(|p| p.area())
        .sum();
    let expected = glam::DVec3::new(0.0, footprints, -556.0 * 548.8);
    assert!((sum - expected).length() < 1e-6, "{sum} for {expected}");
    assert!(scene.camera.unwrap().is_usable());
    assert_eq!(scene.unit.metres, 0.001);
}
