//! `ondelette edit` from file to file.

use crate::program::Place;
use serde_json::Value;

const LINE: &str = r#"{ "kind": "curve", "levels": 3, "points":
 [[0,0],[1,1],[2,0],[3,1],[4,0],[5,1],[6,0],[7,1],[8,0],[9,1],[10,0]], "note": "a zigzag" }"#;

fn sheet() -> String {
    let row = |i: usize| (0..7).map(|j| format!("[{i},{j},{}]", (i * j) % 3)).collect::<Vec<_>>().join(",");
    let rows = (0..11).map(|i| format!("[{}]", row(i))).collect::<Vec<_>>().join(",");
    format!(r#"{{ "kind": "surface", "spans": [8, 4], "points": [{rows}] }}"#)
}

fn points(place: &Place, name: &str) -> Value {
    serde_json::from_str::<Value>(&place.text(name)).unwrap()["points"].take()
}

#[test]
fn a_handle_moves_the_stored_array_of_its_level() {
    let place = Place::new();
    place.write("a.json", LINE);
    place.run("edit a.json --move 4 0,2.5 -o fine.json").with_code(0);
    assert_eq!(points(&place, "fine.json")[4], serde_json::json!([4.0, 2.5]));
    assert_eq!(points(&place, "fine.json")[5], serde_json::json!([5.0, 1.0]));
    place.run("edit a.json --level 1 --move 2 0,4 -o coarse.json").with_code(0);
    let after = points(&place, "coarse.json");
    // the zigzag is still there, on top of a broad hump
    let y = |k: usize| after[k][1].as_f64().unwrap();
    assert!(y(5) > 2.0 && (y(5) - y(4)) * (y(5) - y(6)) > 0.0, "{after}");
    // Moving it back gives the file that was edited.
    place.run("edit coarse.json --level 1 --move 2 0,-4 -o back.json").with_code(0);
    for k in 0..11 {
        let (a, b) = (&points(&place, "back.json")[k], k as f64);
        assert!(
            (a[0].as_f64().unwrap() - b).abs() < 1e-12
                && (a[1].as_f64().unwrap() - f64::from(k as u8 % 2)).abs() < 1e-12
        );
    }
    // Several edits, a fraction, a pull, a smooth version.
    place.run("edit a.json --level 1.5 --move 2 0,1 --move 3 0,1 --see 1.5 -o soft.json").with_code(0);
    place.run("edit a.json --level 2 --pull 0.25 -,3 --detail fixed -o pulled.csv --flatness 0.01").with_code(0);
    assert!(place.text("pulled.csv").starts_with("x,y\n"));
}

#[test]
fn every_format_is_written_and_the_exchange_formats_come_back() {
    let place = Place::new();
    place.write("a.json", LINE);
    place.write("s.json", sheet());
    let outputs = "-o c.json -o c.svg -o c.csv -o c.step -o c.igs -o c.png --comb";
    place.run(&format!("edit a.json --level 1 --move 1 0.5,1 {outputs}")).with_code(0);
    let outputs = "-o s.glb -o s.obj -o s.npy -o s.step -o s.igs -o s2.json -o s.png --zebra";
    place.run(&format!("edit s.json --level 1 --move 1,1 0,0,2 --detail turning {outputs}")).with_code(0);
    assert_eq!(&place.read("s.glb")[..4], b"glTF");
    assert_eq!(&place.read("c.png")[1..4], b"PNG");
    assert!(place.text("c.step").starts_with("ISO-10303-21;") && place.text("c.svg").contains("<path d=\"M"));
    for file in ["c.svg", "c.step", "c.igs"] {
        place.run(&format!("edit {file} -o back.json")).with_code(0);
        let (a, b) = (points(&place, "back.json"), points(&place, "c.json"));
        for k in 0..11 {
            for c in 0..2 {
                let miss = a[k][c].as_f64().unwrap() - b[k][c].as_f64().unwrap();
                assert!(miss.abs() < 1e-12, "{file} {k} {c}: {miss}");
            }
        }
    }
    for file in ["s.step", "s.igs"] {
        place.run(&format!("edit {file} -o back.json")).with_code(0);
        let (a, b) = (points(&place, "back.json"), points(&place, "s2.json"));
        let miss = a[5][3][2].as_f64().unwrap() - b[5][3][2].as_f64().unwrap();
        assert!(miss.abs() < 1e-12, "{file}: {miss}");
    }
    // The same run, the same bytes.
    let first = ["c.png", "c.step", "c.json"].map(|f| place.read(f));
    place.run("edit a.json --level 1 --move 1 0.5,1 -o c.json -o c.step -o c.png --comb").with_code(0);
    assert_eq!(["c.png", "c.step", "c.json"].map(|f| place.read(f)), first);
}

#[test]
fn one_path_of_many_is_edited_and_the_others_stay() {
    let place = Place::new();
    place.write("two.svg", "<svg><path d='M0 0C1 1 2 1 3 0M5 5C6 6 7 6 8 5'/></svg>");
    place.run("edit two.svg --part 1 --move 1 0,3 -o out.svg").with_code(0);
    let text = place.text("out.svg");
    assert!(text.contains("M0,0 C1,1 2,1 3,0") && text.contains("M5,5 C6,9 7,6 8,5"), "{text}");
}

#[test]
fn what_makes_no_sense_is_refused_before_anything_is_written() {
    let place = Place::new();
    place.write("a.json", LINE);
    place.write("s.json", sheet());
    place.write("spec.json", r#"{ "kind": "curve", "levels": 3 }"#);
    place.write("broken.json", "{ \"levels\": ");
    place.write("two.svg", "<svg><path d='M0 0C1 1 2 1 3 0M5 5C6 6 7 6 8 5'/></svg>");
    place.write("hang.svg", "<svg><path d='M1e39 10 L 20 20 Z A 5 5 0 0 1 3 3'/></svg>");
    place.write("cut.step", "ISO-10303-21;\nDATA;\n#1=B_SPLINE_CURVE_WITH_KNOTS('',3,(#2");
    for (arguments, said) in [
        ("edit none.json -o x.json", "none.json"),
        ("edit a.json", "-o"),
        ("edit a.json -o x.bmp", "x.bmp"),
        ("edit a.json -o x.glb", "curve"),
        ("edit s.json -o x.svg", "surface"),
        ("edit a.json -o a.json", "overwritten"),
        ("edit a.json -o none/x.json", "none"),
        ("edit a.json --level 4 -o x.json", "levels 0 to 3"),
        ("edit a.json --level -1 -o x.json", "--level -1"),
        ("edit a.json --level nan -o x.json", "--level nan"),
        ("edit a.json --level 1 --move 9 0,1 -o x.json", "level 1"),
        ("edit a.json --move 1,1 0,1 -o x.json", "--move"),
        ("edit s.json --move 1 0,1,0 -o x.json", "i,j"),
        ("edit a.json --move x 0,1 -o x.json", "--move x"),
        ("edit a.json --move 1 0 -o x.json", "2 coordinates"),
        ("edit a.json --move 1 0,1,1 -o x.json", "2 coordinates"),
        ("edit a.json --move 1 0,inf -o x.json", "finite"),
        ("edit a.json --pull 0.5 1 -o x.json", "2"),
        (
            "edit a.json --level 0 --pull .1 1,1 --pull .2 9,1 --pull .3 1,1 --pull .4 9,1 --pull .5 1,1 -o x.json",
            "contradicts",
        ),
        ("edit a.json --detail loose -o x.json", "turning"),
        ("edit s.json --level 1 --move 0,0 1,1,1 --detail frames -o x.json", "frames"),
        ("edit a.json --see 7 -o x.json", "level 7"),
        ("edit a.json --flatness 0 -o x.csv", "--flatness"),
        ("edit spec.json -o x.json", "no points"),
        ("edit broken.json -o x.json", "line 1"),
        ("edit two.svg -o x.json", "--part 0 to 1"),
        ("edit two.svg --part 2 -o x.json", "--part 2"),
        ("edit hang.svg -o x.json", "1e39"),
        ("edit cut.step -o x.json", "line 3"),
    ] {
        let before = place.names();
        let ended = place.run(arguments).with_code(2);
        assert!(ended.err.starts_with("error: ") && ended.err.contains(said), "{arguments}: {}", ended.err);
        assert_eq!(place.names(), before, "{arguments}");
    }
    let help = place.run("edit --help").with_code(0);
    assert!(help.out.contains("--pull") && help.out.contains("Examples:"));
}

#[test]
fn a_pull_outside_the_domain_is_refused() {
    let place = Place::new();
    place.write("a.json", LINE);
    let ended = place.run("edit a.json --pull 5 1,2 -o x.json").with_code(2);
    assert!(ended.err.contains("outside the domain [0, 1]"), "{}", ended.err);
}
