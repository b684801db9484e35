//! An open-plan office of any size, for the growth of time with the scene: the same numbers give the same file.
//!
//! A grid of stations, each a desk with four things on it, a chair and a partition, turned a little; a lamp hangs over
//! every second one. Some 78 quads a station, all parallelograms and objects of their own, with black backs.

use std::fmt::Write;

/// Metres between stations.
const PITCH: f64 = 2.6;
/// Height of the room.
const HEIGHT: f64 = 3.0;

/// Materials: name, reflectance, radiance.
const MATERIALS: [(&str, [f64; 3], [f64; 3]); 9] = [
    ("carpet", [0.4, 0.37, 0.33], [0.0; 3]),
    ("ceiling", [0.8; 3], [0.0; 3]),
    ("wall", [0.7, 0.68, 0.64], [0.0; 3]),
    ("wood", [0.5, 0.35, 0.2], [0.0; 3]),
    ("metal", [0.3; 3], [0.0; 3]),
    ("cloth", [0.25, 0.3, 0.45], [0.0; 3]),
    ("paper", [0.65, 0.6, 0.55], [0.0; 3]),
    ("case", [0.55; 3], [0.0; 3]),
    ("lamp", [0.0; 3], [3.8, 3.5, 3.2]),
];

/// Faces of a box: whether to draw them, in the order x low, x high, y low, y high, bottom, top.
type Faces = [bool; 6];
const ALL: Faces = [true; 6];
/// What stands on something.
const STANDING: Faces = [true, true, true, true, false, true];
/// What joins two things.
const LEG: Faces = [true, true, true, true, false, false];

/// A piece of furniture's own frame in the room.
#[derive(Clone, Copy)]
struct Frame {
    origin: [f64; 2],
    angle: f64,
}

impl Frame {
    fn turned(self, at: [f64; 2], angle: f64) -> Frame {
        let [x, y, _] = self.place([at[0], at[1], 0.0]);
        Frame { origin: [x, y], angle: self.angle + angle }
    }

    fn place(self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let (sin, cos) = self.angle.sin_cos();
        [self.origin[0] + cos * x - sin * y, self.origin[1] + sin * x + cos * y, z]
    }
}

#[derive(Default)]
struct Writer {
    text: String,
    quads: usize,
}

impl Writer {
    fn quad(&mut self, material: &str, corners: [[f64; 3]; 4]) {
        let n = 4 * self.quads;
        for [x, y, z] in corners {
            let _ = writeln!(self.text, "v {x:.6} {y:.6} {z:.6}");
        }
        let _ = writeln!(self.text, "o q{:05}_{material}\nusemtl {material}", self.quads);
        let _ = writeln!(self.text, "f {} {} {} {}", n + 1, n + 2, n + 3, n + 4);
        self.quads += 1;
    }

    /// A box around the middle of its frame's x and y, fronts outside.
    fn block(&mut self, material: &str, frame: Frame, size: [f64; 3], bottom: f64, faces: Faces) {
        let corner = |i: usize| {
            let side = |k: usize| if i >> k & 1 == 1 { 0.5 } else { -0.5 };
            frame.place([side(0) * size[0], side(1) * size[1], bottom + (side(2) + 0.5) * size[2]])
        };
        let outside = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        for (indices, _) in outside.into_iter().zip(faces).filter(|(_, drawn)| *drawn) {
            self.quad(material, indices.map(corner));
        }
    }

    fn legs(&mut self, frame: Frame, [x, y]: [f64; 2], thick: f64, height: f64) {
        for [s, t] in [[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]] {
            let at = [s * (x - 2.0 * thick), t * (y - 2.0 * thick)];
            self.block("metal", frame.turned(at, 0.0), [thick, thick, height], 0.0, LEG);
        }
    }
}

/// Numbers in [0, 1) that only depend on how many were asked for before (splitmix64).
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// An office with so many stations: the text of its .obj and of its .mtl file, and the number of quads.
pub(crate) fn office(name: &str, stations: usize) -> (String, String, usize) {
    let row = (1..).find(|n| n * n >= stations).unwrap_or(1);
    let side = row as f64 * PITCH + 1.0;
    let mut w = Writer { text: format!("# {name}: {stations} stations\nmtllib {name}.mtl\n"), quads: 0 };
    let room = |i: usize| [0, 1, 2].map(|k| if i >> k & 1 == 1 { [side, side, HEIGHT][k] } else { 0.0 });
    for (material, corners) in [
        ("carpet", [0, 1, 3, 2]),
        ("ceiling", [4, 6, 7, 5]),
        ("wall", [0, 2, 6, 4]),
        ("wall", [1, 5, 7, 3]),
        ("wall", [0, 4, 5, 1]),
        ("wall", [2, 3, 7, 6]),
    ] {
        w.quad(material, corners.map(room));
    }
    let mut dice = Dice(1);
    for k in 0..stations {
        let at = [(k % row) as f64, (k / row) as f64].map(|i| 0.5 + (i + 0.5) * PITCH + dice.between(-0.1, 0.1));
        let station = Frame { origin: at, angle: dice.between(-0.25, 0.25) };
        let desk = [dice.between(1.3, 1.6), dice.between(0.7, 0.85)];
        w.block("wood", station, [desk[0], desk[1], 0.04], 0.7, ALL);
        w.legs(station, desk, 0.06, 0.7);
        for item in 0..4 {
            let place = [(f64::from(item) + 0.5) / 4.0 * desk[0] - 0.5 * desk[0], dice.between(-0.12, 0.12)];
            let size = [dice.between(0.12, 0.22), dice.between(0.1, 0.2), dice.between(0.1, 0.4)];
            let material = if item % 2 == 0 { "case" } else { "paper" };
            w.block(material, station.turned(place, dice.between(-0.5, 0.5)), size, 0.74, STANDING);
        }
        let chair = station.turned([dice.between(-0.2, 0.2), -0.75], dice.between(-0.4, 0.4));
        w.block("cloth", chair, [0.45, 0.45, 0.05], 0.42, ALL);
        w.legs(chair, [0.45, 0.45], 0.04, 0.42);
        w.block("cloth", chair.turned([0.0, -0.2], 0.0), [0.42, 0.04, 0.4], 0.55, ALL);
        let partition = station.turned([0.0, 0.5 * desk[1] + 0.08], 0.0);
        w.block("cloth", partition, [1.7, 0.05, 1.3], 0.0, STANDING);
        if k % 2 == 1 {
            let lamp = station.turned([0.0, 0.1], 0.0);
            w.block("metal", lamp, [1.2, 0.3, 0.06], 2.65, [true, true, true, true, false, true]);
            w.block("lamp", lamp, [1.2, 0.3, 0.06], 2.65, [false, false, false, false, true, false]);
        }
    }
    let mut materials = String::new();
    for (name, kd, ke) in MATERIALS {
        let numbers = |c: [f64; 3]| c.map(|x| x.to_string()).join(" ");
        let _ = writeln!(materials, "newmtl {name}\nKd {}\nKe {}", numbers(kd), numbers(ke));
    }
    (w.text, materials, w.quads)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offices_grow_with_their_stations_and_are_always_the_same() {
        let [small, large] = [3, 36].map(|n| office("office", n));
        assert_eq!(small, office("office", 3));
        assert!((150..400).contains(&small.2) && (9..15).contains(&(large.2 / small.2)), "{} {}", small.2, large.2);
        assert_eq!(large.0.matches("usemtl lamp").count(), 18);
    }

    #[test]
    fn every_quad_is_a_parallelogram_inside_of_the_room() {
        let (text, ..) = office("office", 9);
        let row = |line: &str| -> Vec<f64> { line.split_whitespace().skip(1).map(|x| x.parse().unwrap()).collect() };
        let corners: Vec<Vec<f64>> = text.lines().filter(|l| l.starts_with("v ")).map(row).collect();
        let side = 3.0 * PITCH + 1.0;
        for quad in corners.chunks(4) {
            for k in 0..3 {
                assert!((quad[0][k] + quad[2][k] - quad[1][k] - quad[3][k]).abs() < 5e-6, "{quad:?}");
                assert!(quad.iter().all(|c| (-1e-9..=[side, side, HEIGHT][k] + 1e-9).contains(&c[k])), "{quad:?}");
            }
        }
    }
}
