//! `ondelette transform` from the outside: files in, files out, exit codes.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn npy(descr: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let mut header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
    header.extend(std::iter::repeat_n(' ', 63 - (header.len() + 10) % 64));
    header.push('\n');
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend_from_slice(&(header.len() as u16).to_le_bytes());
    out.extend_from_slice(header.as_bytes());
    out.extend_from_slice(data);
    out
}

fn bytes64(x: &[f64]) -> Vec<u8> {
    x.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// The values after the header of a file of f64.
fn values(path: &Path) -> Vec<f64> {
    let all = std::fs::read(path).unwrap();
    let header = 10 + usize::from(u16::from_le_bytes([all[8], all[9]]));
    all[header..].chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect()
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Folder {
        Folder(tempfile::tempdir().unwrap())
    }
    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }
    fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        std::fs::write(self.path(name), bytes).unwrap();
        self.path(name)
    }
    fn run(&self, input: &str, output: &str, flags: &str) -> Output {
        Command::new(env!("CARGO_BIN_EXE_ondelette"))
            .arg("transform")
            .arg(self.path(input))
            .arg("-o")
            .arg(self.path(output))
            .args(flags.split_whitespace())
            .output()
            .unwrap()
    }
    #[track_caller]
    fn ok(&self, input: &str, output: &str, flags: &str) {
        let out = self.run(input, output, flags);
        assert!(out.status.success(), "{flags}: {}", String::from_utf8_lossy(&out.stderr));
    }
    #[track_caller]
    fn refused(&self, input: &str, flags: &str, words: &[&str]) {
        let out = self.run(input, "refused.npy", flags);
        let text = String::from_utf8_lossy(&out.stderr).into_owned();
        assert_eq!(out.status.code(), Some(2), "{input} {flags}: {text}");
        for word in words {
            assert!(text.contains(word), "{input} {flags}: {text:?} does not say {word:?}");
        }
        assert!(!self.path("refused.npy").exists() && !self.path("refused.npy.json").exists());
    }
}

fn wave(n: usize) -> Vec<f64> {
    (0..n).map(|i| (i as f64 * 0.37).sin() + (i % 5) as f64).collect()
}

#[test]
fn every_family_comes_back_through_its_sidecar() {
    let folder = Folder::new();
    let (rows, cols) = (48, 24);
    let x = wave(rows * cols);
    folder.write("x.npy", &npy("<f8", &format!("({rows}, {cols})"), &bytes64(&x)));
    let families = "bspline bspline22 bspline33 bspline46 bspline612 haar d4 d12 d20 cdf53 cdf97 m2 m3 m6 f2 f3 f4";
    let open = "bspline --boundary open";
    for family in families.split(' ').chain([open, "bspline --boundary periodic", "bspline33 --boundary periodic"]) {
        for layout in ["standard", "nonstandard"] {
            for more in ["", "--kind basis", "--scaling 2", "--scaling l2 --levels 1"] {
                let flags = format!("--family {family} --layout {layout} {more}");
                folder.ok("x.npy", "w.npy", &flags);
                folder.ok("w.npy", "y.npy", "--inverse");
                // Scaled duals of long filters lose digits; 1e-9 still shows any wrong path.
                let worst =
                    values(&folder.path("y.npy")).iter().zip(&x).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
                assert!(worst < 1e-10, "{flags}: {worst:e}");
            }
        }
    }
}

#[test]
fn haar_numbers_and_sidecar_are_as_documented() {
    let folder = Folder::new();
    folder.write("x.npy", &npy("<f8", "(4,)", &bytes64(&[9.0, 7.0, 3.0, 5.0])));
    folder.ok("x.npy", "w.npy", "--family haar");
    // b | w_0 | w_1: mean, half difference of halves, half differences of pairs.
    assert_eq!(values(&folder.path("w.npy")), [6.0, 2.0, 1.0, -1.0]);
    folder.ok("x.npy", "l2.npy", "--family haar --scaling l2");
    let norm = |v: Vec<f64>| v.iter().map(|x| x * x).sum::<f64>();
    assert!((norm(values(&folder.path("l2.npy"))) - 164.0).abs() < 1e-12);
    let text = std::fs::read_to_string(folder.path("w.npy.json")).unwrap();
    let side: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(side["version"], 1);
    assert_eq!(side["family"], "haar");
    assert_eq!(side["spans"], serde_json::json!([4]));
    assert_eq!(side["levels"], serde_json::json!([2]));
    assert_eq!(side["blocks"], serde_json::json!([{ "smooth": 1, "detail": [1, 2] }]));
    // The same without the sidecar, by flags.
    std::fs::remove_file(folder.path("w.npy.json")).unwrap();
    folder.ok("w.npy", "y.npy", "--family haar --inverse");
    assert_eq!(values(&folder.path("y.npy")), [9.0, 7.0, 3.0, 5.0]);
}

#[test]
fn any_length_keeps_its_shape_and_spans_are_counted() {
    let folder = Folder::new();
    folder.write("x.npy", &npy("<f8", "(129, 255)", &bytes64(&wave(129 * 255))));
    for (boundary, spans) in [("mirror", [128, 254]), ("open", [126, 252])] {
        folder.ok("x.npy", "w.npy", &format!("--family bspline --boundary {boundary} --layout nonstandard"));
        assert_eq!(values(&folder.path("w.npy")).len(), 129 * 255);
        let side = std::fs::read_to_string(folder.path("w.npy.json")).unwrap();
        let side: serde_json::Value = serde_json::from_str(&side).unwrap();
        assert_eq!(side["spans"], serde_json::json!(spans));
    }
}

#[test]
fn samples_are_interpolated_and_come_back() {
    let folder = Folder::new();
    let x = wave(3 * 24);
    folder.write("x.npy", &npy("<f8", "(24, 3)", &bytes64(&x)));
    for family in ["bspline", "bspline --boundary open", "bspline --boundary periodic", "bspline33", "m3", "f2", "haar"]
    {
        folder.ok("x.npy", "w.npy", &format!("--family {family} --from samples --channels last"));
        folder.ok("w.npy", "y.npy", "--inverse");
        let y = values(&folder.path("y.npy"));
        assert!(x.iter().zip(&y).all(|(a, b)| (a - b).abs() < 1e-11), "{family}");
    }
    // A cubic in the open space has no detail at all.
    let cubic: Vec<f64> = (0..19)
        .map(|j: i64| {
            let knot = |i: i64| i.clamp(0, 16) as f64;
            let t = (knot(j - 2) + knot(j - 1) + knot(j)) / 3.0 / 16.0;
            t * t * t - t
        })
        .collect();
    folder.write("c.npy", &npy("<f8", "(19,)", &bytes64(&cubic)));
    folder.ok("c.npy", "w.npy", "--boundary open --from samples");
    assert!(values(&folder.path("w.npy"))[4..].iter().all(|v| v.abs() < 1e-12));
}

#[test]
fn keep_spares_the_smooth_and_counts_details() {
    let folder = Folder::new();
    folder.write("x.npy", &npy("<f8", "(64,)", &bytes64(&wave(64))));
    folder.ok("x.npy", "w.npy", "--family d4 --scaling l2 --levels 3");
    folder.ok("x.npy", "k.npy", "--family d4 --scaling l2 --levels 3 --keep 5");
    let (all, kept) = (values(&folder.path("w.npy")), values(&folder.path("k.npy")));
    assert_eq!(all[..8], kept[..8]);
    let mut details: Vec<f64> = all[8..].iter().map(|v| v.abs()).collect();
    details.sort_by(|a, b| b.total_cmp(a));
    let survivors: Vec<f64> = kept[8..].iter().copied().filter(|v| *v != 0.0).collect();
    assert_eq!(survivors.len(), 5);
    assert!(survivors.iter().all(|v| v.abs() >= details[4]));
    folder.ok("x.npy", "t.npy", "--family d4 --scaling l2 --levels 3 --threshold 1.5");
    assert!(values(&folder.path("t.npy"))[8..].iter().all(|v| *v == 0.0 || v.abs() >= 1.5));
}

#[test]
fn single_precision_and_volumes_keep_their_type() {
    let folder = Folder::new();
    let data: Vec<u8> = wave(5 * 6 * 7).iter().flat_map(|v| (*v as f32).to_le_bytes()).collect();
    let file = npy("<f4", "(5, 6, 7)", &data);
    folder.write("x.npy", &file);
    folder.ok("x.npy", "w.npy", "--layout nonstandard");
    folder.ok("w.npy", "y.npy", "--inverse");
    let back = std::fs::read(folder.path("y.npy")).unwrap();
    assert_eq!(back.len(), file.len());
    let floats =
        |b: &[u8]| b[128..].chunks_exact(4).map(|c| f32::from_le_bytes(c.try_into().unwrap())).collect::<Vec<_>>();
    assert!(floats(&file).iter().zip(floats(&back)).all(|(a, b)| (a - b).abs() < 1e-5));
}

#[test]
fn pictures_go_through_wavelets_by_channel() {
    let folder = Folder::new();
    let mut picture = image::RgbImage::new(20, 13);
    picture
        .enumerate_pixels_mut()
        .for_each(|(x, y, p)| *p = image::Rgb([(x * 12) as u8, (y * 19) as u8, ((x * y) % 256) as u8]));
    picture.save(folder.path("in.png")).unwrap();
    for middle in ["w.npy", "w.exr"] {
        folder.ok("in.png", middle, "--layout nonstandard");
        folder.ok(middle, "out.png", "--inverse");
        let back = image::open(folder.path("out.png")).unwrap().to_rgb8();
        assert_eq!(back.dimensions(), (20, 13));
        assert!(back.iter().zip(picture.iter()).all(|(a, b)| a.abs_diff(*b) <= 1), "{middle}");
    }
}

#[test]
fn bad_input_is_refused_with_a_reason() {
    let folder = Folder::new();
    let mut x = wave(12);
    folder.write("good.npy", &npy("<f8", "(12,)", &bytes64(&x)));
    x[7] = f64::NAN;
    folder.write("nan.npy", &npy("<f8", "(3, 4)", &bytes64(&x)));
    x[7] = f64::INFINITY;
    folder.write("inf.npy", &npy("<f8", "(3, 4)", &bytes64(&x)));
    folder.write("empty.npy", &npy("<f8", "(0,)", &[]));
    folder.write("int.npy", &npy("<i8", "(1,)", &[0; 8]));
    folder.write("four.npy", &npy("<f8", "(1, 2, 3, 2)", &bytes64(&wave(12))));
    folder.write("short.npy", &npy("<f8", "(13,)", &bytes64(&wave(12))));
    folder.write("text.npy", b"hello");
    folder.write("broken.png", b"\x89PNG\r\n\x1a\nnothing");
    folder.refused("nan.npy", "", &["nan.npy", "[1, 3]", "NaN"]);
    folder.refused("inf.npy", "", &["[1, 3]", "inf"]);
    folder.refused("empty.npy", "", &["empty"]);
    folder.refused("int.npy", "", &["<i8", "f32", "f64"]);
    folder.refused("four.npy", "", &["4 axes"]);
    folder.refused("short.npy", "", &["13"]);
    folder.refused("text.npy", "", &["not a .npy"]);
    folder.refused("missing.npy", "", &["missing.npy"]);
    folder.refused("broken.png", "", &["broken.png"]);
    folder.refused("good.npy", "--levels 9", &["9 levels", "at most"]);
    folder.refused("good.npy", "--boundary periodic --levels 3", &["at most 2", "8 or 16"]);
    folder.refused("good.npy", "--family haar --boundary open", &["open", "bspline"]);
    folder.refused("good.npy", "--family d4 --boundary mirror", &["periodic"]);
    folder.refused("good.npy", "--family cdf97 --boundary open", &["mirror or periodic"]);
    folder.refused("good.npy", "--family m5", &["10 and 15"]);
    folder.refused("good.npy", "--family d5", &["d5"]);
    folder.refused("good.npy", "--scaling 3", &["2.828"]);
    folder.refused("good.npy", "--family d4 --from samples", &["prefilter"]);
    folder.refused("good.npy", "--kind basis --keep 3", &["--kind coef"]);
    folder.refused("good.npy", "--keep 3 --threshold 1", &["cannot be used with"]);
    folder.refused("good.npy", "--threshold nan", &["--threshold"]);
    folder.refused("good.npy", "--inverse --keep 3", &["--inverse"]);
    let out = folder.run("good.npy", "no/such/folder/out.npy", "");
    assert_eq!(out.status.code(), Some(2));
    let out = folder.run("good.npy", "out.txt", "");
    assert_eq!(out.status.code(), Some(2));
}
