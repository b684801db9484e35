//! A sealed dark room beside a bright one stays exactly dark, however the walls are drawn.

use glam::DVec3;
use ondelette_radiosity::occluder::Occluders;
use ondelette_radiosity::scene::samples;
use ondelette_radiosity::{Rgb, Scene, Settings, Solution, Solver};

type Face = ([[f64; 3]; 4], Rgb, Rgb);

const WHITE: Rgb = Rgb::grey(0.7);

fn face(corners: [[f64; 3]; 4]) -> Face {
    (corners, WHITE, Rgb::BLACK)
}

/// A rectangle in a plane of constant coordinate `axis`, facing up or down that axis; `a` and `b` are its ranges along
/// the next two axes.
fn wall(axis: usize, at: f64, up: bool, a: [f64; 2], b: [f64; 2]) -> Face {
    let corner = |s: f64, t: f64| {
        let mut c = [at; 3];
        c[(axis + 1) % 3] = s;
        c[(axis + 2) % 3] = t;
        c
    };
    let mut corners = [corner(a[0], b[0]), corner(a[1], b[0]), corner(a[1], b[1]), corner(a[0], b[1])];
    if !up {
        corners.swap(1, 3);
    }
    face(corners)
}

/// Both sides of a wall without thickness.
fn screen(axis: usize, at: f64, a: [f64; 2], b: [f64; 2]) -> [Face; 2] {
    [wall(axis, at, true, a, b), wall(axis, at, false, a, b)]
}

/// The shell of one big room, 3 x 1 x 1: floor, ceiling and four walls, one rectangle each.
fn shell() -> Vec<Face> {
    vec![
        wall(2, 0.0, true, [0.0, 3.0], [0.0, 1.0]),
        wall(2, 1.0, false, [0.0, 3.0], [0.0, 1.0]),
        wall(0, 0.0, true, [0.0, 1.0], [0.0, 1.0]),
        wall(0, 3.0, false, [0.0, 1.0], [0.0, 1.0]),
        wall(1, 0.0, true, [0.0, 1.0], [0.0, 3.0]),
        wall(1, 1.0, false, [0.0, 1.0], [0.0, 3.0]),
    ]
}

fn lamp() -> Face {
    ([[2.0, 0.7, 0.99], [2.5, 0.7, 0.99], [2.5, 0.3, 0.99], [2.0, 0.3, 0.99]], Rgb::BLACK, Rgb::grey(5.0))
}

fn solved(mut faces: Vec<Face>) -> Solution {
    faces.push(lamp());
    let scene = samples::quads("rooms", &faces);
    let mut solver = Solver::new(scene, Settings { error: 0.1, ..Settings::default() }).unwrap();
    while solver.step().is_some() {}
    solver.into_solution()
}

/// Checks every side at a grid of points: within `dark` nothing arrives, at all; elsewhere something does.
#[track_caller]
fn assert_dark(solution: &Solution, dark: impl Fn(DVec3) -> bool) {
    let scene: &Scene = solution.scene();
    let (mut points, mut bright, mut worst) = (0, 0, 0.0f64);
    for (side, s) in scene.sides.iter().enumerate() {
        let normal = {
            let (_, u, v) = scene.frame(*s);
            u.cross(v).normalize()
        };
        for i in 0..24 {
            for j in 0..24 {
                let at = [(f64::from(i) + 0.5) / 24.0, (f64::from(j) + 0.3) / 24.0];
                if scene.patches[s.patch as usize].corners().len() == 3 && at[0] + at[1] > 1.0 {
                    continue;
                }
                // a little above the surface: on which side of a wall is its own business
                let place = solution.point(side, at) + normal * 1e-3;
                let e = solution.irradiance(side, at);
                if dark(place) {
                    points += 1;
                    worst = worst.max(e.0[0].abs());
                } else {
                    bright += usize::from(e.0[0] > 1e-3);
                }
            }
        }
    }
    assert!(points > 500 && bright > 500, "{points} dark and {bright} bright points");
    assert_eq!(worst, 0.0, "light in the dark room");
}

const LEFT: f64 = 1.1;

fn left(p: DVec3) -> bool {
    p.x < LEFT
}

/// Floor, ceiling and side walls run on under the wall between the rooms.
#[test]
fn a_wall_that_stands_on_one_floor_divides_it() {
    let mut faces = shell();
    faces.extend(screen(0, LEFT, [0.0, 1.0], [0.0, 1.0]));
    assert_dark(&solved(faces), left);
}

/// The wall sticks out through floor, ceiling and sides.
#[test]
fn a_wall_that_crosses_everything_divides_it() {
    let mut faces = shell();
    faces.extend(screen(0, LEFT, [-0.2, 1.3], [-0.1, 1.2]));
    assert_dark(&solved(faces), |p| left(p) && p.cmpgt(DVec3::ZERO).all() && p.cmplt(DVec3::new(3.0, 1.0, 1.0)).all());
}

/// The wall is made of pieces that meet in Ts, with corners that are a little off.
#[test]
fn walls_of_pieces_leave_no_cracks() {
    for crack in [0.0, 1e-12, 3e-8] {
        let mut faces = shell();
        let third = 1.0 / 3.0;
        faces.extend(screen(0, LEFT, [0.0, third - crack], [0.0, 0.7 - crack]));
        faces.extend(screen(0, LEFT, [third, 1.0], [0.0, 0.1 + 0.2]));
        faces.extend(screen(0, LEFT, [third, 1.0], [0.3 + crack, 0.7]));
        faces.extend(screen(0, LEFT, [0.0, 1.0], [0.7, 1.0 - crack]));
        assert_dark(&solved(faces), left);
    }
}

/// Rays aimed at the very cracks and corners of such a wall do not pass.
#[test]
fn rays_do_not_pass_cracks() {
    let (third, crack) = (1.0 / 3.0, 1e-7);
    let mut faces = shell();
    faces.extend(screen(0, LEFT, [0.0, third - crack], [0.0, 0.7 - crack]));
    faces.extend(screen(0, LEFT, [third, 1.0], [0.0, 0.7 - crack]));
    faces.extend(screen(0, LEFT, [0.0, 1.0], [0.7, 1.0 - crack]));
    let occluders = Occluders::new(&samples::quads("wall", &faces));
    let none = u32::MAX;
    for i in 0..2000 {
        let share = f64::from(i) / 1999.0;
        let from = DVec3::new(0.3, 0.2 + 0.5 * share, 0.4);
        for y in [third - 0.5 * crack, third, 0.2, 0.0] {
            for z in [0.7 - 0.5 * crack, 0.7, 1.0 - 0.5 * crack, 0.35] {
                let aim = DVec3::new(LEFT, y, z);
                let to = from + (aim - from) * 1.7;
                assert!(occluders.blocked(from, to, [none, none]), "{from} to {aim}");
                let hit = occluders.first_hit(from, aim - from, |_, _| false);
                assert!(hit.is_some_and(|h| h.t < 1.0 + 1e-6), "{from} to {aim}: {hit:?}");
            }
        }
    }
}

/// A closet in a corner of the big room: two walls that meet, neither of which divides the floor alone.
#[test]
fn a_closet_in_a_corner_stays_dark() {
    let mut faces = shell();
    faces.extend(screen(0, LEFT, [0.0, 0.6], [0.0, 1.0]));
    faces.extend(screen(1, 0.6, [0.0, 1.0], [0.0, LEFT]));
    assert_dark(&solved(faces), |p| left(p) && p.y < 0.6);
}

/// Two rooms with walls of their own, drawn as two boxes that touch.
#[test]
fn boxes_side_by_side_share_no_light() {
    let mut faces = Vec::new();
    for (from, to) in [(0.0, LEFT), (LEFT, 3.0)] {
        let x = [from, to];
        faces.push(wall(2, 0.0, true, x, [0.0, 1.0]));
        faces.push(wall(2, 1.0, false, x, [0.0, 1.0]));
        faces.push(wall(0, from, true, [0.0, 1.0], [0.0, 1.0]));
        faces.push(wall(0, to, false, [0.0, 1.0], [0.0, 1.0]));
        faces.push(wall(1, 0.0, true, [0.0, 1.0], x));
        faces.push(wall(1, 1.0, false, [0.0, 1.0], x));
    }
    assert_dark(&solved(faces), left);
}

/// The same in other units and places.
#[test]
fn the_dark_does_not_depend_on_units() {
    for scale in [1e-3, 1e3] {
        let mut faces = shell();
        faces.extend(screen(0, LEFT, [0.0, 1.0], [0.0, 1.0]));
        faces.push(lamp());
        for corner in faces.iter_mut().flat_map(|f| &mut f.0) {
            *corner = (DVec3::from(*corner) * scale + DVec3::splat(7.0 * scale)).to_array();
        }
        let scene = samples::quads("rooms", &faces);
        let mut solver = Solver::new(scene, Settings { error: 0.1, ..Settings::default() }).unwrap();
        while solver.step().is_some() {}
        let solution = solver.into_solution();
        for (side, s) in solution.scene().sides.iter().enumerate() {
            let (_, u, v) = solution.scene().frame(*s);
            let place = solution.point(side, [0.3, 0.4]) + u.cross(v).normalize() * (1e-3 * scale);
            if place.x < (LEFT + 7.0) * scale {
                assert_eq!(solution.irradiance(side, [0.3, 0.4]), Rgb::BLACK, "side {side} at scale {scale}");
            }
        }
    }
}
