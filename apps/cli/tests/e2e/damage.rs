//! The commands on shapes, fed with damaged files: an answer and an exit code, never a panic or a hang.

use crate::program::{Ended, Place};
use std::process::Stdio;
use std::time::{Duration, Instant};

const CURVE: &str = r#"{ "boundary": "open", "levels": 3, "domain": [0, 1], "energy": { "bend": 1 }, "constraints": [
 { "id": "a", "at": 0, "position": [0, 0] }, { "id": "b", "at": 0.5, "position": [1, 2], "weight": 30 },
 { "id": "c", "at": 1, "position": [2, null], "tangent": [1, 0] }, { "id": "k", "at": 0.2, "curvature": 0.5 } ] }"#;
const RING: &str = r#"{ "boundary": "periodic", "spans": 16, "energy": { "intrinsic": "mvc" }, "constraints": [
 { "at": 0, "position": [1, 0] }, { "at": 0.25, "position": [0, 1] }, { "at": 0.5, "position": [-1, 0] } ] }"#;
const SHEET: &str = r#"{ "levels": 2, "stiffness": [ { "from": [0, 0], "to": [0.5, 1], "factor": 10 } ],
    "constraints": [
 { "at": [0, 0], "position": 1 }, { "at": [1, 0], "position": 3 }, { "at": [1, 1], "position": 5 },
 { "id": "rail", "curve": { "at": [[0, 1], [1, 0.5]], "position": [[1], [2]] } } ] }"#;
const DAT: &str = "FOO\n 1.0 0.0\n 0.6 0.1\n 0.3 0.12\n 0.0 0.0\n 0.3 -0.1\n 0.7 -0.05\n 1.0 0.0\n";
const CSV: &str = "0,0,1\n1,0,2\n0,1,3\n1,1,4\n0.5,0.4,2\n0.2,0.9,3\n";
const SVG: &str = "<svg><path d='M0 0C1 1 2 1 3 0S6 0 7 1Q8 2 9 1A3 2 30 1 0 14 2H15V3h1l1,1'/></svg>";

/// What damage does to numbers and words.
const POISON: [&str; 14] = [
    "1e39",
    "1e400",
    "-1e308",
    "nan",
    "null",
    "99999999999999999999",
    "-1",
    "0",
    "",
    "[[[[[[[[",
    "}",
    "4294967296",
    "\"",
    "1e-300",
];

/// Numbers without pattern.
struct Dice(u64);

impl Dice {
    fn next(&mut self, sides: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % sides
    }
}

/// A run that must end by itself.
fn run(place: &Place, arguments: &str, text: &str) -> Ended {
    let mut command = place.command(arguments);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program starts");
    let start = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        if start.elapsed() > Duration::from_secs(60) {
            child.kill().expect("a child to end");
            panic!("{arguments} did not end on\n{text}");
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    Ended::of(child.wait_with_output().expect("its output"))
}

#[test]
fn damaged_files_get_an_answer() {
    let place = Place::new();
    let cases = [
        (CURVE, "a.json", "curve a.json -o x.json -o x.svg"),
        (RING, "b.json", "curve b.json -o x.json"),
        (SHEET, "c.json", "surface c.json -o x.json -o x.obj"),
        (DAT, "d.dat", "fit d.dat --fair --tolerance 1e-2 -o x.json"),
        (DAT, "e.dat", "fit e.dat -o x.json"),
        (CSV, "f.csv", "fit f.csv --spans 8 -o x.json"),
        (SVG, "g.svg", "edit g.svg --part 0 --move 1 0,1 -o x.svg"),
    ];
    let mut dice = Dice(20_261_122);
    for (good, name, arguments) in cases {
        place.write(name, good);
        run(&place, arguments, good).with_code(0);
        for _ in 0..24 {
            let mut bytes = good.as_bytes().to_vec();
            for _ in 0..=dice.next(3) {
                let from = dice.next(bytes.len() + 1);
                let to = (from + dice.next(4)).min(bytes.len());
                let poison = POISON[dice.next(POISON.len())];
                bytes.splice(from..to, poison.bytes());
            }
            let text = String::from_utf8_lossy(&bytes).into_owned();
            place.write(name, &text);
            let ended = run(&place, arguments, &text);
            assert!(matches!(ended.code, Some(0..=2)), "{arguments}: {:?} {}\n{text}", ended.code, ended.err);
            assert!(!ended.err.contains("panicked"), "{arguments}: {}\n{text}", ended.err);
            assert!(ended.code != Some(2) || ended.err.starts_with("error: "), "{arguments}: {}\n{text}", ended.err);
        }
    }
}

#[test]
fn data_that_make_no_fit_are_refused_with_a_reason() {
    let place = Place::new();
    for (text, flags, said) in [
        ("", "", "no"),
        ("0,0,nan\n1,0,2\n", "", "line 1"),
        ("0,0,inf\n1,0,2\n", "", "line 1"),
        ("0,0,1\n1,0,2\n0,1,3\n", "--spans 1000000000000", "spans"),
        ("0,0,1\n1,0,2\n0,1,3\n", "--spans 0", "spans"),
        ("0,0,1\n1,0,2\n0,1,3\n", "--weight 0", "--weight"),
        ("0,0\n1,0\n2,0\n3,1\n", "--spans 1000000000000", "limit"),
        ("0,0\n1,0\n2,0\n3,1\n", "--spans 0", "spans"),
        ("1,1\n1,1\n1,1\n1,1\n", "", "one place"),
        ("1,1\n1,2\n", "--fair --tolerance 1e-3", "at least 4"),
    ] {
        place.write("data.csv", text);
        let ended = run(&place, &format!("fit data.csv {flags} -o x.json"), text).with_code(2);
        assert!(ended.err.starts_with("error: ") && ended.err.contains(said), "{text} {flags}: {}", ended.err);
        assert!(!place.names().contains(&"x.json".to_owned()), "{text} {flags}");
    }
    // One point, and points on one another, have an answer.
    for text in ["1,2,3\n", "1,2,3\n1,2,5\n1,2,4\n1,2,4\n"] {
        place.write("data.csv", text);
        run(&place, "fit data.csv -o y.json", text).with_code(0);
    }
}
