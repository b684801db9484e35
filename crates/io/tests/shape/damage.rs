//! Damaged files: any answer but a panic or a hang.

use crate::cad::{IGES, STEP};
use ondelette_io::shape::{Document, height, iges, points, step, svg};
use proptest::prelude::*;
use std::time::{Duration, Instant};

const SVG: &str = r#"<svg xmlns="http://www.w3.org/2000/svg"><g transform="translate(1 2)rotate(30,1,1)"><path
 d="M1 1C2 2 3 2 4 1S6 0 7 1Q8 2 9 1T11 1A3 2 30 1 0 14 2H15V3h1v1l1,1z"/></g><polyline points="0,0 1,1 2,0"/></svg>"#;
const SPEC: &str = r#"{"boundary":"open","levels":3,"domain":[0,1],"energy":{"bend":1},
 "constraints":[{"id":"a","at":0.5,"position":[1,null]},{"at":[0.25],"tangent":[0,1],"weight":3}],"tolerance":1e-8}"#;
const DAT: &str = "FOO\n 3. 3.\n\n 0.0 0.0\n 0.5 0.1\n 1.0 0.0\n\n 0.0 0.0\n 0.5 -0.1\n 1.0 0.0\n";
const ASC: &str = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 30\nNODATA_value -9999\n1 2 3\n4 -9999 6\n";

/// What damage does to numbers and words.
const POISON: [&str; 16] = [
    "1e39",
    "1e400",
    "-1e308",
    "nan",
    "inf",
    "99999999999999999999",
    "-1",
    "0",
    "",
    "(((((((((((((((((((",
    "<g>",
    "#1",
    "M1e39 10 L 20 20 Z A 5 5 0 0 1 3 3",
    "4294967296",
    "'",
    "&#0;",
];

fn read_all(text: &str) {
    let start = Instant::now();
    let _ = svg::read(text).map(|p| svg::write(&p.path, p.y_down, 1e-3));
    let _ = step::read(text).map(|s| step::write(&s, "x"));
    let _ = iges::read(text).map(|s| iges::write(&s, "x"));
    let _ = Document::read(text, None).map(|d| d.write());
    let _ = Document::read(text, Some(2));
    let _ = points::read_csv(text);
    let _ = points::read_dat(text);
    let _ = height::read_asc(text).map(|h| height::write_asc(&h));
    let _ = height::read_npy(text.as_bytes());
    let _ = height::read_png(text.as_bytes());
    assert!(start.elapsed() < Duration::from_secs(5), "{text}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]
    #[test]
    fn damaged_files_neither_panic_nor_hang(
        which in 0usize..6, cuts in prop::collection::vec((0.0f64..1.0, 0.0f64..0.02, 0usize..16), 1..6),
    ) {
        let mut bytes = [SVG, SPEC, DAT, ASC, STEP, IGES][which].as_bytes().to_vec();
        for (at, len, poison) in cuts {
            let from = (at * bytes.len() as f64) as usize;
            let to = (from + (len * bytes.len() as f64) as usize).min(bytes.len());
            bytes.splice(from..to, POISON[poison].bytes());
        }
        read_all(&String::from_utf8_lossy(&bytes));
    }

    #[test]
    fn damaged_arrays_neither_panic_nor_hang(bytes in prop::collection::vec(any::<u8>(), 0..200), at in 0usize..150) {
        let field = height::HeightField::new([2, 2], vec![1.0, 2.0, 3.0, 4.0]).unwrap();
        for good in [height::write_npy(&field), height::write_png(&field).unwrap().0] {
            let mut bad = good.clone();
            for (i, b) in bytes.iter().enumerate() {
                if let Some(x) = bad.get_mut(at + i * 7) {
                    *x ^= b;
                }
            }
            let _ = height::read_npy(&bad);
            let _ = height::read_png(&bad);
        }
    }
}

#[test]
fn deep_nesting_does_not_overflow_the_stack() {
    read_all(&format!("<svg>{}", "<g>".repeat(100_000)));
    read_all(&format!("<svg>{}{}</svg>", "<g>".repeat(20_000), "</g>".repeat(20_000)));
    read_all(&format!("ISO-10303-21;DATA;#1=A({}", "(".repeat(1_000_000)));
    read_all(&"[".repeat(1_000_000));
}
