//! `ondelette curve` and `ondelette surface` from file to file.

use crate::program::Place;
use serde_json::{Value, json};

fn document(place: &Place, name: &str) -> Value {
    serde_json::from_str(&place.text(name)).unwrap()
}

#[test]
fn the_natural_spline_comes_out_of_a_specification() {
    let place = Place::new();
    // Least bending through knots: the natural cubic spline through (0, 0), (1/2, 1), (1, 0) is 3 t - 4 t^3 up to 1/2,
    // with energy 2 * int_0^(1/2) (24 t)^2 = 48.
    place.write(
        "arch.json",
        r#"{ "levels": 3, "constraints": [ { "id": "a", "at": 0, "position": [0, 0] },
            { "id": "b", "at": 0.5, "position": [1, null] }, { "id": "c", "at": 0.5, "position": [null, 1] },
            { "id": "d", "at": 1, "position": [2, 0] } ] }"#,
    );
    place.run("curve arch.json -o out.json -o out.svg -o out.png --comb --report r.json").with_code(0);
    let report = document(&place, "r.json");
    let close = |v: &Value, want: f64| (v.as_f64().unwrap() - want).abs() < 1e-9 * want.abs().max(1.0);
    assert!(close(&report["energy"], 48.0), "{report}");
    assert!(close(&report["energy_knots"], 48.0 / 512.0), "{report}");
    assert!(["a", "b", "c", "d"].iter().all(|id| close(&report["residuals"][id], 0.0)));
    assert_eq!((&report["converged"], &report["active"]), (&json!(true), &json!(11)));
    assert!(report["seconds"]["total"].is_number() && report["solver"].is_string() && report["why"].is_string());
    // The document that comes out holds everything, goes in again, and edits.
    place.run("curve out.json -o again.json").with_code(0);
    assert_eq!(place.text("out.json"), place.text("again.json"));
    assert_eq!(document(&place, "out.json")["constraints"][1]["position"], json!([1.0, null]));
    place.run("edit out.json --level 1 --move 2 0,1 -o edited.json").with_code(0);
    // All solvers agree.
    let points = document(&place, "out.json")["points"].clone();
    for solver in ["banded", "cholesky", "bpx", "multigrid"] {
        place.run(&format!("curve arch.json --solver {solver} -o {solver}.json")).with_code(0);
        let other = document(&place, &format!("{solver}.json"));
        for k in 0..11 {
            let miss = other["points"][k][1].as_f64().unwrap() - points[k][1].as_f64().unwrap();
            assert!(miss.abs() < 1e-7, "{solver}: {miss}");
        }
    }
}

#[test]
fn an_adaptive_surface_says_how_few_wavelets_hold_it() {
    let place = Place::new();
    let spec = r#"{ "boundary": "mirror", "levels": 5, ADAPTIVE "constraints": [
        { "id": "a", "at": [0, 0], "position": 1 },
        { "id": "b", "at": [0.5, 0.5], "position": 0 }, { "id": "c", "at": [1, 0.3], "position": -1 } ] }"#;
    place.write("few.json", spec.replace("ADAPTIVE", "\"adaptive\": true,"));
    place.write("all.json", spec.replace("ADAPTIVE", ""));
    let ended = place.run("surface few.json -o few.npy --report few-r.json").with_code(0);
    assert!(ended.err.contains("active wavelets"), "{}", ended.err);
    place.run("surface all.json -o all.npy --report all-r.json").with_code(0);
    let (few, all) = (document(&place, "few-r.json"), document(&place, "all-r.json"));
    let number = |r: &Value, name: &str| r[name].as_f64().unwrap();
    assert!(number(&few, "active") < 200.0 && number(&all, "active") == 1089.0, "{few}");
    let over = number(&few, "energy") / number(&all, "energy") - 1.0;
    assert!((0.0..1e-3).contains(&over) && over * number(&all, "energy") <= number(&few, "excess"), "{over}");
    assert!(["a", "b", "c"].iter().all(|id| number(&few["residuals"], id).abs() < 1e-12));
    // So small a surface is solved sooner with all wavelets, and the program says so; a large one is not.
    assert_eq!((&few["adaptive"]["faster_than_full"], &all["adaptive"]), (&json!(false), &Value::Null));
    assert!(ended.err.contains("not expected to be faster"), "{}", ended.err);
    place
        .write("large.json", spec.replace("ADAPTIVE", "\"adaptive\": true,").replace("\"levels\": 5", "\"levels\": 8"));
    let ended = place.run("surface large.json -o large.npy --report large-r.json").with_code(0);
    assert_eq!(document(&place, "large-r.json")["adaptive"]["faster_than_full"], json!(true));
    assert!(!ended.err.contains("not expected"), "{}", ended.err);
}

#[test]
fn an_intrinsic_energy_finds_the_circle_and_says_when_there_is_no_minimum() {
    let place = Place::new();
    let points = r#""constraints": [ { "id": "e", "at": 0, "position": [1, 0] }, { "at": 0.25, "position": [0, 1] },
        { "at": 0.5, "position": [-1, 0] }, { "at": 0.75, "position": [0, -1] } ] }"#;
    place.write(
        "ring.json",
        format!(r#"{{ "boundary": "periodic", "spans": 128, "energy": {{ "intrinsic": "mvc" }}, {points}"#),
    );
    place.run("curve ring.json -o out.json -o out.svg -o out.png --comb --report r.json").with_code(0);
    let report = document(&place, "r.json");
    assert!((report["length"].as_f64().unwrap() - std::f64::consts::TAU).abs() < 1e-6, "{report}");
    assert!(report["functional"].as_f64().unwrap() < 1e-9 && report["iterations"].as_u64().unwrap() < 40, "{report}");
    assert_eq!(document(&place, "out.json")["energy"], json!({ "intrinsic": "mvc" }));
    // The document goes in again, and edits.
    place.run("curve out.json -o again.json").with_code(0);
    place.run("edit out.json --level 2 --move 2 0,1 -o edited.json").with_code(0);
    // A loop held at three points of nearly a line opens without end.
    place.write(
        "loose.json",
        r#"{ "boundary": "periodic", "spans": 32, "energy": { "intrinsic": "mec" }, "constraints": [
            { "at": 0, "position": [1, 0] }, { "at": 0.25, "position": [0, 0.2] },
            { "at": 0.5, "position": [-1, 0] } ] }"#,
    );
    let ended = place.run("curve loose.json -o loose-out.json").with_code(1);
    assert!(ended.err.contains("without bound") && ended.err.contains("not converged"), "{}", ended.err);
}

#[test]
fn a_surface_is_led_along_curves_and_mirrored() {
    let place = Place::new();
    let arch = "[0, 0, 0], [1, 0, 0.5], [2, 0, 0]";
    place.write(
        "tent.json",
        format!(
            r#"{{ "levels": 4, "constraints": [
            {{ "id": "front", "curve": {{ "at": [[0, 0], [1, 0]], "position": [{arch}] }} }},
            {{ "id": "spine", "curve": {{ "at": [[0.2, 0], [0.5, 0.4], [0.6, 1]],
                "position": [[0.4, 0, 0.284], [1, 1, 1], [1.2, 2, 0]] }} }},
            {{ "id": "corner", "at": [0, 1], "position": [0, 2, 0] }},
            {{ "id": "other", "at": [1, 1],
                "image": {{ "of": [0, 1], "factors": [-1, 1, 1], "offset": [2, 0, 0] }} }} ] }}"#
        ),
    );
    let ended = place.run("surface tent.json -o out.json -o out.png --report r.json");
    let report = if ended.code == Some(0) { document(&place, "r.json") } else { panic!("{}", ended.err) };
    let residuals = report["residuals"].as_object().unwrap();
    assert!(residuals.len() > 30 && residuals.contains_key("front[16]") && residuals.contains_key("spine[20]"));
    assert!(residuals.values().all(|v| v.as_f64().unwrap() < 1e-9), "{report}");
    let points = document(&place, "out.json")["points"].take();
    let corner = |i: usize, j: usize, c: usize| points[i][j][c].as_f64().unwrap();
    // s runs along rows, the other corner mirrors the first; the middle of the front edge is the top of its arch.
    assert!((corner(18, 18, 0) - 2.0).abs() < 1e-9 && (corner(18, 18, 1) - 2.0).abs() < 1e-9);
    assert_eq!(document(&place, "out.json")["constraints"][0]["curve"]["at"], json!([[0.0, 0.0], [1.0, 0.0]]));
    // A sample that says the same again is named; one that says otherwise refused.
    let twice = |z: f64| {
        format!(
            r#"{{ "levels": 3, "constraints": [
            {{ "id": "a", "curve": {{ "at": [[0, 0], [1, 0]], "position": [[0], [1]] }} }},
            {{ "id": "b", "curve": {{ "at": [[1, 0], [0, 0]], "position": [[{z}], [0]] }} }} ] }}"#
        )
    };
    place.write("twice.json", twice(1.0));
    let ended = place.run("surface twice.json -o twice-out.json").with_code(0);
    assert!(ended.err.contains("b[0]") && ended.err.contains("redundant"), "{}", ended.err);
    place.write("clash.json", twice(1.5));
    let ended = place.run("surface clash.json -o clash-out.json").with_code(2);
    assert!(ended.err.contains("b[0]") && ended.err.contains("contradicts"), "{}", ended.err);
}

#[test]
fn a_tilted_plane_is_found_and_written_in_every_format() {
    let place = Place::new();
    place.write(
        "plane.json",
        r#"{ "spans": [6, 9], "domain": [[0, 2], [0, 1]], "energy": { "bend": 1 }, "constraints": [
            { "at": [0, 0], "position": 1 }, { "at": [2, 0], "position": 3 }, { "at": [1, 1], "position": 5 } ] }"#,
    );
    let outputs = "-o p.json -o p.npy -o p.glb -o p.obj -o p.step -o p.igs -o p.png -o p.asc --report r.json";
    place.run(&format!("surface plane.json {outputs}")).with_code(0);
    assert!(document(&place, "r.json")["energy"].as_f64().unwrap() < 1e-18);
    // h = 1 + s + 3 t at the knots, in f64 after the header of 128 bytes
    let npy = place.read("p.npy");
    assert_eq!(npy.len(), 128 + 8 * 7 * 10);
    for (k, bytes) in npy[128..].chunks(8).enumerate() {
        let (s, t) = ((k / 10) as f64 / 3.0, (k % 10) as f64 / 9.0);
        let h = f64::from_le_bytes(bytes.try_into().unwrap());
        assert!((h - (1.0 + s + 3.0 * t)).abs() < 1e-9, "{s} {t}: {h}");
    }
    let help = place.run("surface --help").with_code(0);
    assert!(help.out.contains("tent.json") && help.out.contains("--zebra"));
}

#[test]
fn specifications_that_make_no_sense_are_refused_by_name() {
    let place = Place::new();
    let constraints = |c: &str| format!(r#"{{ "levels": 3, "constraints": [{c}] }}"#);
    let a = r#"{ "id": "a", "at": 0.5, "position": [1, 2] }"#;
    for (kind, text, said) in [
        ("curve", String::new(), "line 1"),
        ("curve", "{".to_owned(), "line 1"),
        ("curve", "{}".to_owned(), "levels"),
        ("curve", r#"{ "levels": 40 }"#.to_owned(), "GB"),
        ("curve", constraints(""), "no constraints"),
        ("curve", constraints(r#"{ "id": "q", "at": 0.5 }"#), "q asks for nothing"),
        ("curve", constraints(r#"{ "id": "q", "at": 1.5, "position": [1, 2] }"#), "outside"),
        ("curve", constraints(r#"{ "id": "q", "at": 0.5, "position": [1, 2], "weight": -1 }"#), "weight"),
        ("curve", constraints(r#"{ "id": "q", "at": 0.5, "position": [1, 2, 3, 4] }"#), "4 coordinates"),
        ("curve", constraints(r#"{ "id": "q", "at": 0.5, "ds": [1, 2] }"#), "surfaces"),
        ("curve", constraints(&format!(r#"{a}, {{ "id": "b", "at": 0.1, "position": [1] }}"#)), "coordinates"),
        ("curve", constraints(&format!("{a}, {a}")), "a"),
        ("curve", constraints(&format!(r#"{a}, {{ "id": "b", "at": 0.5, "position": [1, 3] }}"#)), "b contradicts"),
        ("curve", constraints(a).replace("{ \"levels\"", "{ \"solver\": \"magic\", \"levels\""), "magic"),
        ("curve", constraints(a).replace("{ \"levels\"", "{ \"solver\": \"spectral\", \"levels\""), "spectral"),
        (
            "curve",
            constraints(a).replace("{ \"levels\"", "{ \"adaptive\": true, \"solver\": \"banded\", \"levels\""),
            "adaptive",
        ),
        ("curve", constraints(a).replace("{ \"levels\"", "{ \"energy\": { \"intrinsic\": 3 }, \"levels\""), "mec"),
        (
            "curve",
            constraints(a).replace("{ \"levels\"", "{ \"energy\": { \"intrinsic\": \"mic\" }, \"levels\""),
            "mic",
        ),
        (
            "curve",
            constraints(a).replace("{ \"levels\"", "{ \"energy\": { \"intrinsic\": \"mec\" }, \"levels\""),
            "coincide",
        ),
        (
            "surface",
            constraints(a).replace("{ \"levels\"", "{ \"energy\": { \"intrinsic\": \"mec\" }, \"levels\""),
            "curves",
        ),
        ("surface", constraints(r#"{ "id": "q", "curve": { "at": [[0, 0]], "position": [[1], [2]] } }"#), "q"),
        (
            "surface",
            constraints(r#"{ "id": "q", "curve": { "at": [[0, 0], [1, 2]], "position": [[1], [2]] } }"#),
            "outside",
        ),
        ("curve", constraints(r#"{ "id": "q", "curve": { "at": [[0, 0], [1, 1]], "position": [[1], [2]] } }"#), "q"),
        ("curve", constraints(r#"{ "id": "q", "position": [1, 2] }"#), "at is missing"),
        ("curve", constraints(a).replace("{ \"levels\"", "{ \"domain\": [0, 1e-300], \"levels\""), "length"),
        ("surface", constraints(a), "a"),
        ("surface", r#"{ "kind": "curve", "levels": 3 }"#.to_owned(), "surface"),
    ] {
        place.write("spec.json", &text);
        let before = place.names();
        let ended = place.run(&format!("{kind} spec.json -o x.json")).with_code(2);
        assert!(ended.err.starts_with("error: ") && ended.err.contains(said), "{text}: {}", ended.err);
        assert!(!ended.err.contains("panicked"), "{}", ended.err);
        assert_eq!(place.names(), before, "{text}");
    }
    // What no shape of finite energy can do is named, with the shape that does the rest.
    let sharp = format!(r#"{a}, {{ "id": "k", "at": 0.2, "position": [0, 0], "curvature": 1e300 }}"#);
    place.write("spec.json", constraints(&sharp));
    let ended = place.run("curve spec.json -o sharp.json").with_code(1);
    assert!(
        ended.err.contains("constraint k.curvature is missed") && !ended.err.contains("constraint a"),
        "{}",
        ended.err
    );
    place.write("spec.json", constraints(a));
    for (arguments, said) in [
        ("curve spec.json", "-o"),
        ("curve spec.json -o x.glb", "curve"),
        ("surface spec.json -o x.svg", "surface"),
        ("curve spec.json -o spec.json", "overwritten"),
        ("curve none.json -o x.json", "none.json"),
    ] {
        let ended = place.run(arguments).with_code(2);
        assert!(ended.err.contains(said), "{arguments}: {}", ended.err);
    }
}

#[test]
fn a_crease_of_no_width_counts_and_regions_that_count_for_nothing_are_refused() {
    let place = Place::new();
    let write = |region: &str, rest: &str| {
        let rows = r#"{ "at": 0, "position": 0 }, { "at": 0.5, "position": 1 }, { "at": 1, "position": 0 }"#;
        place.write("a.json", format!(r#"{{ "spans": 16, "constraints": [{rows}], "stiffness": [{region}] {rest} }}"#));
    };
    let energy = |region: &str| {
        write(region, "");
        place.run("curve a.json -o out.json --report r.json").with_code(0);
        document(&place, "r.json")["energy"].as_f64().unwrap()
    };
    let plain = energy("");
    for crease in [r#""from": 0.5, "to": 0.5"#, r#""from": 0.49, "to": 0.51"#, r#""from": 0.52, "to": 0.521"#] {
        let creased = energy(&format!(r#"{{ {crease}, "factor": 1e-4 }}"#));
        assert!(creased < 0.9 * plain, "{crease}: {creased} of {plain}");
    }
    for (region, word) in [
        (r#"{ "from": 0.6, "to": 0.4, "factor": 2 }"#, "lower corner"),
        (r#"{ "from": 1.5, "to": 2, "factor": 2 }"#, "outside the domain"),
    ] {
        write(region, "");
        let ended = place.run("curve a.json -o out.json").with_code(2);
        assert!(ended.err.contains("stiffness 0") && ended.err.contains(word), "{}", ended.err);
    }
    write(r#"{ "from": 0.9, "to": 1.1, "factor": 2 }"#, r#", "boundary": "periodic""#);
    place.run("curve a.json -o out.json").with_code(0);
}

#[test]
fn numbers_that_leave_nothing_to_compute_with_are_refused() {
    let place = Place::new();
    let rows = r#"{ "at": AT, "position": [0, 1] }, { "at": AT, "position": [1, 1], "weight": 1e-310 }"#;
    for (domain, at, word) in [("[0, 1]", "0", "weight"), ("[1e16, 10000000000000032]", "1e16", "told apart")] {
        let rows = rows.replace("AT", at);
        place.write("a.json", format!(r#"{{ "spans": 64, "domain": {domain}, "constraints": [{rows}] }}"#));
        for out in ["x.step", "x.igs", "x.svg", "x.json"] {
            let ended = place.run(&format!("curve a.json -o {out}")).with_code(2);
            assert!(ended.err.contains(word), "{}", ended.err);
        }
    }
}
