//! From polygons to patches, as a user of a scene file sees it.

use glam::DVec3;
use ondelette_radiosity::Rgb;
use ondelette_radiosity::scene::{
    BuildOptions, Camera, DraftFace, LengthUnit, MOST_CORNERS, Material, Object, Quantity, SceneDraft, SceneError,
    Shape,
};

fn face(corners: &[[f64; 3]], index: u32) -> DraftFace {
    DraftFace {
        corners: corners.iter().map(|&c| DVec3::from(c)).collect(),
        uv0: Vec::new(),
        uv1: Vec::new(),
        material: 0,
        object: 0,
        index,
        line: Some(index + 1),
    }
}

fn draft(faces: Vec<DraftFace>) -> SceneDraft {
    let material =
        Material { name: "paint".into(), reflectance: Rgb::grey(0.5), radiance: Rgb::BLACK, two_sided: false };
    SceneDraft {
        name: "test".into(),
        unit: LengthUnit { metres: 1.0, stated: false },
        quantity: Quantity::Radiometric,
        materials: vec![material],
        objects: vec![Object { name: "wall".into(), mesh: 0, primitive: 0 }],
        faces,
        camera: None,
        warnings: Vec::new(),
    }
}

const SQUARE: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];

/// An n x n floor of triangles as an exporter writes it: two a cell, single precision, texture coordinates.
fn floor(n: u8) -> Vec<DraftFace> {
    let at = |i: u8, j: u8| [f64::from(f32::from(i) * 0.1), f64::from(f32::from(j) * 0.1), 0.0];
    let mut faces = Vec::new();
    for i in 0..n {
        for j in 0..n {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            for triangle in [[a, b, c], [a, c, d]] {
                let mut f = face(&triangle, u32::try_from(faces.len()).unwrap());
                f.uv0 = triangle.iter().map(|p| [2.0 * p[0] + 0.5, -3.0 * p[1]]).collect();
                faces.push(f);
            }
        }
    }
    faces
}

/// A regular floor can be paired in three ways; only one gives back the cells, in whatever order the triangles come.
#[test]
fn a_triangulated_floor_becomes_its_cells_again_in_any_order() {
    let mut faces = floor(7);
    for turn in 0..4 {
        let scene = draft(faces.clone()).build(BuildOptions::default()).unwrap();
        assert_eq!(scene.patches.len(), 49);
        for p in &scene.patches {
            assert_eq!(p.shape, Shape::Parallelogram);
            assert_eq!(p.provenance.faces.len(), 2);
            assert!(p.u.dot(p.v).abs() < 1e-9, "turn {turn}: a cell came back skewed");
            assert!((p.normal() - DVec3::Z).length() < 1e-12);
        }
        // A fixed shuffle: steps of 97 triangles, coprime to their number.
        let count = faces.len();
        faces = (0..count).map(|i| faces[(i * 97 + turn) % count].clone()).collect();
    }
}

/// Texture coordinates follow the corners of the patch, or lightmaps would be laid out turned.
#[test]
fn texture_coordinates_stay_at_their_corners() {
    let mut quad = face(&SQUARE, 1000);
    quad.corners.iter_mut().for_each(|c| *c += DVec3::new(5.0, 5.0, 0.0));
    quad.uv0 = quad.corners.iter().map(|p| [2.0 * p.x + 0.5, -3.0 * p.y]).collect();
    let mut faces = floor(3);
    faces.push(quad);
    let scene = draft(faces).build(BuildOptions::default()).unwrap();
    assert_eq!(scene.patches.len(), 10);
    for p in &scene.patches {
        let uv = p.provenance.uv0.unwrap();
        for (at, uv) in [p.origin, p.origin + p.u, p.origin + p.v, p.origin + p.u + p.v].iter().zip(uv) {
            assert!((uv[0] - 2.0 * at.x - 0.5).abs() < 1e-6 && (uv[1] + 3.0 * at.y).abs() < 1e-6, "{uv:?} at {at}");
        }
        assert!(p.provenance.uv1.is_none());
    }
}

/// Triangles that differ in object, material, facing or texture seam keep apart.
#[test]
fn only_triangles_that_belong_together_merge() {
    let pair = || vec![face(&[SQUARE[0], SQUARE[1], SQUARE[2]], 0), face(&[SQUARE[0], SQUARE[2], SQUARE[3]], 1)];
    let count = |faces: Vec<DraftFace>| {
        let mut d = draft(faces);
        d.materials.push(d.materials[0].clone());
        d.objects.push(d.objects[0].clone());
        d.build(BuildOptions::default()).unwrap().patches.len()
    };
    assert_eq!(count(pair()), 1);
    let mut other = pair();
    other[1].material = 1;
    assert_eq!(count(other), 2);
    let mut other = pair();
    other[1].object = 1;
    assert_eq!(count(other), 2);
    let mut other = pair();
    other[1].corners.reverse();
    assert_eq!(count(other), 2);
    let mut other = pair();
    other[0].uv1 = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
    other[1].uv1 = vec![[0.0, 0.0], [0.5, 1.0], [0.0, 1.0]];
    assert_eq!(count(other), 2);
}

/// No light may be lost or invented by cutting: areas agree for quadrilaterals that are no parallelograms, planar or
/// bent, and for an outline with a notch.
#[test]
fn cutting_keeps_area_and_facing() {
    let trapezium = [[0., 0., 0.], [4., 0., 0.], [3., 2., 0.], [1., 2., 0.]];
    let notch = [[0., 0., 5.], [2., 0., 5.], [2., 2., 5.], [1., 0.5, 5.], [0., 2., 5.]];
    let bent = [[0., 0., 9.], [1., 0., 9.], [1., 1., 9.2], [0., 1., 9.]];
    let scene =
        draft(vec![face(&trapezium, 0), face(&notch, 1), face(&bent, 2)]).build(BuildOptions::default()).unwrap();
    let area =
        |index: u32| -> f64 { scene.patches.iter().filter(|p| p.provenance.faces == [index]).map(|p| p.area()).sum() };
    assert!((area(0) - 6.0).abs() < 1e-12);
    assert!((area(1) - 2.5).abs() < 1e-12);
    assert!((area(2) - 1.0).abs() < 0.05);
    assert!(scene.patches.iter().all(|p| p.normal().z > 0.9 && p.shape == Shape::Triangle));
    assert_eq!(scene.patches.len(), 2 + 3 + 2);
}

/// Dropped faces are counted and the first is named, so that the user can find them.
#[test]
fn faces_without_area_and_repeated_faces_are_counted() {
    let mut turned = SQUARE;
    turned.rotate_left(2);
    let mut back = SQUARE;
    back.reverse();
    let line = [[0., 0., 0.], [1., 0., 0.], [2., 0., 0.]];
    let faces = vec![face(&SQUARE, 0), face(&line, 1), face(&turned, 2), face(&line[..2], 3), face(&back, 4)];
    let scene = draft(faces.clone()).build(BuildOptions::default()).unwrap();
    assert_eq!(scene.patches.len(), 2, "a face and its reverse are two sides of a thin wall");
    assert_eq!(
        scene.warnings,
        [
            "2 zero-area faces dropped; the first is face 1 of object 'wall' (line 2)",
            "1 duplicate face dropped; the first is face 2 of object 'wall' (line 3)"
        ]
    );
    let both = draft(faces).build(BuildOptions { two_sided: true }).unwrap();
    assert_eq!(both.patches.len(), 1, "of two-sided faces the reverse is a repetition");
}

/// The order of sides is what solutions are stored in: fronts in patch order, each followed by its back.
#[test]
fn backs_follow_their_fronts_and_face_away() {
    let mut d = draft(vec![face(&SQUARE, 0), face(&SQUARE.map(|p| [p[0], p[1], 1.0]), 1)]);
    let lamp = Material { name: "lamp".into(), radiance: Rgb::grey(2.0), two_sided: true, ..d.materials[0].clone() };
    d.materials.push(lamp);
    d.faces[0].material = 1;
    let scene = d.build(BuildOptions::default()).unwrap();
    let order: Vec<(u32, bool)> = scene.sides.iter().map(|s| (s.patch, s.back)).collect();
    assert_eq!(order, [(0, false), (0, true), (1, false)]);
    let normal = |i: usize| {
        let (_, a, b) = scene.frame(scene.sides[i]);
        a.cross(b).z
    };
    assert!(normal(0) > 0.0 && normal(1) < 0.0);
    // Both sides give light: 2 sides * 1 m^2 * pi * 2.
    let [lamp] = &scene.emitters()[..] else { panic!("one emitter") };
    assert_eq!((lamp.sides, lamp.area), (2, 2.0));
    assert!((scene.emitted_power().0[0] - 4.0 * std::f64::consts::PI).abs() < 1e-12);
    assert_eq!(scene.bounds, [DVec3::ZERO, DVec3::ONE]);
}

/// Power is in watts, not in watts times whatever the unit squared is: a 1000 mm square emits what a 1 m square does.
#[test]
fn power_knows_the_length_unit() {
    let mut d = draft(vec![face(&SQUARE.map(|p| p.map(|x| 1000.0 * x)), 0)]);
    d.unit = LengthUnit { metres: 0.001, stated: true };
    d.materials[0].radiance = Rgb::grey(1.0);
    let scene = d.build(BuildOptions::default()).unwrap();
    assert!((scene.emitted_power().0[1] - std::f64::consts::PI).abs() < 1e-9);
}

/// A box that stands on the floor, its bottom in the floor's plane and facing it, is how furniture is modelled.
#[test]
fn contact_is_legal() {
    let bottom = [[0.2, 0.2, 0.], [0.2, 0.4, 0.], [0.4, 0.4, 0.], [0.4, 0.2, 0.]];
    let scene = draft(vec![face(&SQUARE, 0), face(&bottom, 1)]).build(BuildOptions::default()).unwrap();
    assert_eq!((scene.patches.len(), scene.warnings.len()), (2, 0));
}

/// Each refusal names the face or material and the value.
#[test]
fn bad_numbers_are_refused_with_their_place() {
    let refuse = |change: &dyn Fn(&mut SceneDraft)| {
        let mut d = draft(vec![face(&SQUARE, 0)]);
        change(&mut d);
        d.build(BuildOptions::default()).unwrap_err().to_string()
    };
    let nan = refuse(&|d| d.faces[0].corners[2].y = f64::NAN);
    assert!(nan.contains("face 0 of object 'wall' (line 1)") && nan.contains("finite"), "{nan}");
    let uv = refuse(&|d| d.faces[0].uv0 = vec![[0.0, f64::INFINITY]; 4]);
    assert!(uv.contains("texture coordinate"), "{uv}");
    let far = refuse(&|d| d.faces[0].corners[0].x = -2e12);
    assert!(far.contains("2e12") && far.contains("limit"), "{far}");
    let small = refuse(&|d| d.faces[0].corners.iter_mut().for_each(|c| *c *= 1e-12));
    assert!(small.contains("limit"), "{small}");
    for value in [1.0, 1.5, -0.1] {
        let text = refuse(&|d| d.materials[0].reflectance = Rgb::new(0.2, value, 0.2));
        assert!(text.contains("'paint'") && text.contains(&value.to_string()), "{text}");
    }
    let dark = refuse(&|d| d.materials[0].radiance = Rgb::new(1.0, 1.0, -3.0));
    assert!(dark.contains("'paint'") && dark.contains("-3"), "{dark}");
    assert!(refuse(&|d| d.materials[0].radiance = Rgb::grey(f64::NAN)).contains("'paint'"));
    assert!(refuse(&|d| d.materials[0].reflectance = Rgb::grey(f64::NAN)).contains("'paint'"));
    assert!(refuse(&|d| d.unit.metres = 0.0).contains("unit"));
    assert!(refuse(&|d| d.faces[0].material = 7).contains("material 7"));
    assert!(refuse(&|d| d.faces[0].object = 7).contains("object 7"));
    assert!(refuse(&|d| d.faces.clear()).contains("nothing to light"));
    let many = refuse(&|d| d.faces[0].corners = vec![DVec3::ZERO; MOST_CORNERS + 1]);
    assert!(many.contains("10001 corners"), "{many}");
}

/// A draft without a usable face is an error of its own kind: programs test for it.
#[test]
fn an_empty_scene_says_so() {
    let refused = draft(vec![face(&[[0.; 3], [1., 0., 0.], [2., 0., 0.]], 0)]).build(BuildOptions::default());
    assert_eq!(refused, Err(SceneError::Empty("test".into())));
}

/// A camera without a direction must not become a picture of nothing.
#[test]
fn unusable_cameras_are_left_out_with_a_warning() {
    let mut d = draft(vec![face(&SQUARE, 0)]);
    let good = Camera { eye: DVec3::ZERO, at: DVec3::X, up: DVec3::Z, fov: 40.0 };
    d.camera = Some(good);
    assert_eq!(d.clone().build(BuildOptions::default()).unwrap().camera, Some(good));
    for bad in [
        Camera { at: DVec3::ZERO, ..good },
        Camera { up: DVec3::X, ..good },
        Camera { fov: f64::NAN, ..good },
        Camera { fov: 180.0, ..good },
    ] {
        d.camera = Some(bad);
        let scene = d.clone().build(BuildOptions::default()).unwrap();
        assert_eq!((scene.camera, scene.warnings.len()), (None, 1));
    }
}
