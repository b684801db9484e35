//! Broken files of every kind must be answered by a scene or by an error: never by a panic, never by hanging.

use ondelette_io::{ReadOptions, read_scene};
use proptest::prelude::*;
use std::path::Path;
use std::time::{Duration, Instant};

/// No mutant of a seed of a few kilobytes may take longer (they take about a millisecond).
const PATIENCE: Duration = Duration::from_secs(10);

fn seed(name: &str) -> Vec<u8> {
    std::fs::read(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/seeds")).join(name)).unwrap()
}

/// One way to break a file; positions are fractions of its length.
#[derive(Clone, Debug)]
enum Damage {
    Flip(f64, u8),
    Cut(f64),
    Remove(f64, usize),
    Repeat(f64, usize),
    /// Replaces the number at or after the position.
    Number(f64, &'static str),
    /// Exchanges two numbers.
    Swap(f64, f64),
}

const NUMBERS: [&str; 22] = [
    "0",
    "-1",
    "1",
    "2",
    "3",
    "7",
    "255",
    "5120",
    "5121",
    "5123",
    "5125",
    "5126",
    "65536",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "1e30",
    "1e39",
    "-1e-300",
    "0.0000001",
    "nan",
    "inf",
];

fn damage() -> impl Strategy<Value = Damage> {
    let at = || 0.0..1.0f64;
    prop_oneof![
        (at(), any::<u8>()).prop_map(|(a, b)| Damage::Flip(a, b)),
        at().prop_map(Damage::Cut),
        (at(), 1..40usize).prop_map(|(a, n)| Damage::Remove(a, n)),
        (at(), 1..200usize).prop_map(|(a, n)| Damage::Repeat(a, n)),
        (at(), prop::sample::select(&NUMBERS[..])).prop_map(|(a, n)| Damage::Number(a, n)),
        (at(), at()).prop_map(|(a, b)| Damage::Swap(a, b)),
    ]
}

/// The first run of characters of a number at or after a place.
fn number_at(bytes: &[u8], from: usize) -> Option<std::ops::Range<usize>> {
    let start = from + bytes[from..].iter().position(u8::is_ascii_digit)?;
    let length = bytes[start..].iter().take_while(|b| b.is_ascii_digit() || **b == b'.').count();
    Some(start..start + length)
}

fn apply(bytes: &mut Vec<u8>, damage: &Damage) {
    if bytes.is_empty() {
        return;
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a fraction of a length")]
    let place = |fraction: f64| ((bytes.len() as f64 * fraction) as usize).min(bytes.len() - 1);
    match *damage {
        Damage::Flip(a, mask) => {
            let at = place(a);
            bytes[at] ^= mask;
        }
        Damage::Cut(a) => {
            let at = place(a);
            bytes.truncate(at);
        }
        Damage::Remove(a, n) => {
            let at = place(a);
            bytes.drain(at..(at + n).min(bytes.len()));
        }
        Damage::Repeat(a, n) => {
            let at = place(a);
            let part = bytes[at..(at + n).min(bytes.len())].to_vec();
            bytes.splice(at..at, part);
        }
        Damage::Number(a, text) => {
            if let Some(range) = number_at(bytes, place(a)) {
                bytes.splice(range, text.bytes());
            }
        }
        Damage::Swap(a, b) => {
            let (a, b) = (place(a).min(place(b)), place(a).max(place(b)));
            if let (Some(first), Some(second)) = (number_at(bytes, a), number_at(bytes, b))
                && first.end <= second.start
            {
                let (left, right) = (bytes[first.clone()].to_vec(), bytes[second.clone()].to_vec());
                bytes.splice(second, left);
                bytes.splice(first, right);
            }
        }
    }
}

/// A GLB around a description and a binary chunk, lengths right: damage inside must get past the outer checks.
fn pack(json: &[u8], binary: &[u8]) -> Vec<u8> {
    let word = |n: usize| u32::try_from(n).unwrap().to_le_bytes();
    let mut out = Vec::new();
    out.extend_from_slice(b"glTF");
    out.extend_from_slice(&word(2));
    out.extend_from_slice(&word(28 + json.len() + binary.len()));
    out.extend_from_slice(&word(json.len()));
    out.extend_from_slice(b"JSON");
    out.extend_from_slice(json);
    out.extend_from_slice(&word(binary.len()));
    out.extend_from_slice(b"BIN\0");
    out.extend_from_slice(binary);
    out
}

/// Reads the file; a scene that comes out keeps what scenes promise.
fn read(files: &[(&str, &[u8])]) {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let start = Instant::now();
    let result = read_scene(folder.path().join(files[0].0), &ReadOptions::default());
    assert!(start.elapsed() < PATIENCE, "took {:?}", start.elapsed());
    match result {
        Err(error) => assert!(error.to_string().contains('.'), "an error must name its file: {error}"),
        Ok(scene) => {
            assert!(!scene.patches.is_empty());
            for p in &scene.patches {
                assert!(p.area() > 0.0 && p.normal().is_finite());
            }
            for m in &scene.materials {
                assert!(m.reflectance.0.iter().all(|c| (0.0..1.0).contains(c)));
                assert!(m.radiance.0.iter().all(|&c| c >= 0.0 && c.is_finite()));
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn broken_obj_files_are_answered(damages in prop::collection::vec(damage(), 1..4), library in any::<bool>()) {
        let (mut obj, mut mtl) = (seed("room.obj"), seed("room.mtl"));
        for d in &damages {
            apply(if library { &mut mtl } else { &mut obj }, d);
        }
        read(&[("room.obj", &obj), ("room.mtl", &mtl)]);
    }

    #[test]
    fn broken_gltf_files_are_answered(damages in prop::collection::vec(damage(), 1..4)) {
        let mut gltf = seed("room.gltf");
        damages.iter().for_each(|d| apply(&mut gltf, d));
        read(&[("room.gltf", &gltf)]);
    }

    #[test]
    fn broken_glb_files_are_answered(damages in prop::collection::vec(damage(), 1..4)) {
        let mut glb = seed("room.glb");
        damages.iter().for_each(|d| apply(&mut glb, d));
        read(&[("room.glb", &glb)]);
    }

    #[test]
    fn broken_chunks_are_answered(damages in prop::collection::vec(damage(), 1..4), inside in any::<bool>()) {
        let glb = seed("room.glb");
        let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
        let (mut json, mut binary) = (glb[20..20 + length].to_vec(), glb[28 + length..].to_vec());
        for d in &damages {
            apply(if inside { &mut binary } else { &mut json }, d);
        }
        read(&[("room.glb", &pack(&json, &binary))]);
    }
}
