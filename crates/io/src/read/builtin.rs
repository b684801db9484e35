//! Scenes that need no file.
//!
//! `cornell` is the Cornell box as measured at Cornell University's Program of Computer Graphics ("Cornell Box Data",
//! 1998), made regular so that every face is a parallelogram: the room is 0.556 x 0.5488 x 0.5592 m (the measured
//! walls taper by up to 6 mm), and each block keeps three of its measured top corners. The lamp fills a hole in the
//! ceiling; its reflectance (0.78) is set to 0 and its spectrum to linear red, green and blue (17, 12, 4 in the
//! proportions common in rendering). Coordinates are millimetres. The front of the room is open, the camera stands
//! before it where Cornell's stood.

use super::ReadError;
use glam::DVec3;
use ondelette_radiosity::Rgb;
use ondelette_radiosity::Scene;
use ondelette_radiosity::scene::{
    BuildOptions, Camera, DraftFace, LengthUnit, Material, Object, Quantity, SceneDraft, SceneError,
};

/// Names of the built-in scenes.
pub const NAMES: [&str; 1] = ["cornell"];

/// A built-in scene by name, before it is checked.
pub(super) fn draft(name: &str) -> Result<SceneDraft, ReadError> {
    match name {
        "cornell" => Ok(cornell_draft()),
        _ => Err(ReadError::Builtin { name: name.into() }),
    }
}

/// The Cornell box: 19 parallelograms, one lamp of 0.01365 m^2.
///
/// **Errors** none in practice: the tables below make a valid scene.
///
/// ```
/// let scene = ondelette_io::builtin::cornell()?;
/// assert_eq!(scene.patches.len(), 19);
/// # Ok::<(), ondelette_radiosity::scene::SceneError>(())
/// ```
pub fn cornell() -> Result<Scene, SceneError> {
    cornell_draft().build(BuildOptions::default())
}

type Point = [f64; 3];

const WHITE: u32 = 0;
const RED: u32 = 1;
const GREEN: u32 = 2;
const LAMP: u32 = 3;

/// Walls, corners counter-clockwise as seen from inside the room.
const WALLS: [(&str, u32, [Point; 4]); 9] = [
    ("floor", WHITE, [[0., 0., 0.], [0., 0., 559.2], [556., 0., 559.2], [556., 0., 0.]]),
    ("lamp", LAMP, [[213., 548.8, 227.], [343., 548.8, 227.], [343., 548.8, 332.], [213., 548.8, 332.]]),
    ("ceiling front", WHITE, [[0., 548.8, 0.], [556., 548.8, 0.], [556., 548.8, 227.], [0., 548.8, 227.]]),
    ("ceiling back", WHITE, [[0., 548.8, 332.], [556., 548.8, 332.], [556., 548.8, 559.2], [0., 548.8, 559.2]]),
    ("ceiling right", WHITE, [[0., 548.8, 227.], [213., 548.8, 227.], [213., 548.8, 332.], [0., 548.8, 332.]]),
    ("ceiling left", WHITE, [[343., 548.8, 227.], [556., 548.8, 227.], [556., 548.8, 332.], [343., 548.8, 332.]]),
    ("back wall", WHITE, [[0., 0., 559.2], [0., 548.8, 559.2], [556., 548.8, 559.2], [556., 0., 559.2]]),
    ("left wall", RED, [[556., 0., 0.], [556., 0., 559.2], [556., 548.8, 559.2], [556., 548.8, 0.]]),
    ("right wall", GREEN, [[0., 0., 0.], [0., 548.8, 0.], [0., 548.8, 559.2], [0., 0., 559.2]]),
];

/// Blocks: name, height, and three measured corners of the top (the fourth closes the parallelogram).
const BLOCKS: [(&str, f64, [[f64; 2]; 3]); 2] = [
    ("short block", 165., [[130., 65.], [82., 225.], [290., 114.]]),
    ("tall block", 330., [[423., 247.], [265., 296.], [472., 406.]]),
];

fn cornell_draft() -> SceneDraft {
    let material =
        |name: &str, reflectance, radiance| Material { name: name.into(), reflectance, radiance, two_sided: false };
    let mut objects = Vec::new();
    let mut faces = Vec::new();
    let mut add = |name: &str, material: u32, quads: &[[Point; 4]]| {
        let object = u32::try_from(objects.len()).unwrap_or(u32::MAX);
        objects.push(Object { name: name.into(), mesh: object, primitive: 0 });
        for (index, quad) in (0..).zip(quads) {
            faces.push(DraftFace {
                corners: quad.map(DVec3::from).to_vec(),
                uv0: Vec::new(),
                uv1: Vec::new(),
                material,
                object,
                index,
                line: None,
            });
        }
    };
    for (name, material, quad) in WALLS {
        add(name, material, &[quad]);
    }
    for (name, height, [a, b, d]) in BLOCKS {
        let c = [b[0] + d[0] - a[0], b[1] + d[1] - a[1]];
        let ring = [a, b, c, d];
        let mut quads = vec![ring.map(|[x, z]| [x, height, z])];
        for i in 0..4 {
            let ([x0, z0], [x1, z1]) = (ring[i], ring[(i + 1) % 4]);
            quads.push([[x0, 0., z0], [x1, 0., z1], [x1, height, z1], [x0, height, z0]]);
        }
        add(name, WHITE, &quads);
    }
    SceneDraft {
        name: "cornell".into(),
        unit: LengthUnit { metres: 0.001, stated: true },
        quantity: Quantity::Radiometric,
        materials: vec![
            material("white", Rgb::new(0.73, 0.73, 0.73), Rgb::BLACK),
            material("red", Rgb::new(0.63, 0.065, 0.05), Rgb::BLACK),
            material("green", Rgb::new(0.14, 0.45, 0.091), Rgb::BLACK),
            material("lamp", Rgb::BLACK, Rgb::new(17.0, 12.0, 4.0)),
        ],
        objects,
        faces,
        camera: Some(Camera {
            eye: DVec3::new(278., 273., -800.),
            at: DVec3::new(278., 273., 279.6),
            up: DVec3::Y,
            // A 0.025 m square film behind a lens of 0.035 m focal length: 2 atan(0.025 / 0.07).
            fov: 39.3077,
        }),
        warnings: Vec::new(),
    }
}
