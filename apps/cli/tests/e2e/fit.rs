//! `ondelette fit` from file to file.

use crate::program::Place;
use serde_json::Value;

/// Numbers without pattern in [0, 1].
fn noise(k: u32) -> f64 {
    f64::from(k.wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24)
}

#[test]
fn scattered_heights_become_a_surface_that_predicts() {
    let place = Place::new();
    let height = |x: f64, y: f64| (3.0 * x).sin() + x * y;
    let row = |k: u32| {
        let (x, y) = (noise(2 * k), noise(2 * k + 1));
        format!("{x},{y},{}\n", height(x, y))
    };
    place.write("points.csv", (0..400).map(row).collect::<String>());
    place.run("fit points.csv -o out.json -o out.png -o out.glb --report r.json").with_code(0);
    let report: Value = serde_json::from_str(&place.text("r.json")).unwrap();
    assert!(report["rms"].as_f64().unwrap() < 5e-3, "{report}");
    assert_eq!(report["points"], 400);
    place.run("edit out.json --level 2 --move 2,2 0.5 -o edited.json").with_code(0);
}

#[test]
fn an_outline_is_smoothed_as_much_as_predicts_it_best() {
    let place = Place::new();
    // A circle of radius 1, closed, with scatter of 0.01 rms: the curve is nearer to the circle than the points are.
    let point = |k: u32| {
        let a = f64::from(k % 120) / 120.0 * std::f64::consts::TAU;
        let r = 1.0 + 0.035 * (noise(k % 120) - 0.5);
        format!("{},{}\n", r * a.cos(), r * a.sin())
    };
    place.write("ring.csv", (0..=120).map(point).collect::<String>());
    place.run("fit ring.csv -o ring.json -o ring.svg -o ring.png --report r.json").with_code(0);
    let report: Value = serde_json::from_str(&place.text("r.json")).unwrap();
    assert_eq!((&report["points"], &report["closed"]), (&120.into(), &true.into()), "{report}");
    let document: Value = serde_json::from_str(&place.text("ring.json")).unwrap();
    let radii = document["points"].as_array().unwrap().iter().map(|p| {
        let [x, y]: [f64; 2] = serde_json::from_value(p.clone()).unwrap();
        x.hypot(y)
    });
    let rms = (radii.clone().map(|r| (r - 1.0).powi(2)).sum::<f64>() / radii.len() as f64).sqrt();
    assert!(rms < 0.006, "{rms}");
    // What is given is kept.
    place.run("fit ring.csv --weight 1e-3 --stiffening 0 --spans 12 -o few.json --report r.json").with_code(0);
    let report: Value = serde_json::from_str(&place.text("r.json")).unwrap();
    assert_eq!((&report["weight"], &report["spans"]), (&1e-3.into(), &12.into()));
    place.write("one.csv", "0.5,1\n");
    assert!(place.run("fit one.csv -o x.json").with_code(2).err.contains("at least 4"));
}

#[test]
fn an_outline_is_made_fair_within_its_tolerance() {
    let place = Place::new();
    let point = |k: u32| {
        let a = f64::from(k) / 40.0 * std::f64::consts::PI;
        format!("{} {}\n", a.cos(), a.sin() + 1e-3 * (noise(k) - 0.5))
    };
    place.write("half.dat", format!("half a circle\n{}", (0..=40).map(point).collect::<String>()));
    place.run("fit half.dat --fair --tolerance 1e-3 -o out.svg -o out.png --comb --report r.json").with_code(0);
    let report: Value = serde_json::from_str(&place.text("r.json")).unwrap();
    assert!(report["largest_move"].as_f64().unwrap() <= 1e-3, "{report}");
    for (arguments, said) in [
        ("fit half.dat --fair -o x.svg", "--tolerance"),
        ("fit half.dat --tolerance 1 -o x.svg", "--fair"),
        ("fit half.dat --fair --tolerance 0 -o x.svg", "--tolerance 0"),
        ("fit half.dat --fair --tolerance 1e-3 -o x.glb", "curve"),
        ("fit none.csv -o x.json", "none.csv"),
        ("fit half.bmp -o x.json", "half.bmp"),
    ] {
        let ended = place.run(arguments).with_code(2);
        assert!(ended.err.starts_with("error: ") && ended.err.contains(said), "{arguments}: {}", ended.err);
    }
    place.write("bad.csv", "1,2,3\n1,2\n");
    assert!(place.run("fit bad.csv -o x.json").with_code(2).err.contains("line 2"));
}
