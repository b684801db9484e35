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

fn json(place: &Place, name: &str) -> Value {
    serde_json::from_str(&place.text(name)).unwrap()
}

#[test]
fn a_height_field_comes_out_on_the_grid_that_went_in() {
    let place = Place::new();
    let height = |i: usize, j: usize| 500.0 + 3.0 * i as f64 + (0.2 * j as f64).sin();
    let row = |i: usize| (0..30).map(|j| height(i, j).to_string()).collect::<Vec<_>>().join(" ");
    let rows: String = (0..12).map(|i| format!("{}\n", row(i))).collect();
    let header = "ncols 30\nnrows 12\nxllcorner 746000.5\nyllcorner 4022000\ncellsize 30\nNODATA_value -9999\n";
    place.write("in.asc", format!("{header}{rows}"));
    place.run("fit in.asc --weight 1e-3 --stiffening 1 -o out.asc -o out.json").with_code(0);
    let out = place.text("out.asc");
    assert!(out.starts_with(header), "{}", &out[..200]);
    let heights: Vec<f64> = out[header.len()..].split_whitespace().map(|w| w.parse().unwrap()).collect();
    assert_eq!(heights.len(), 12 * 30);
    for (k, h) in heights.iter().enumerate() {
        assert!((h - height(k / 30, k % 30)).abs() < 0.05, "{k}: {h}");
    }
    // Away from its file a surface is written at its knots, whose cells say how wide and how high they are.
    place.run("edit out.json -o again.asc").with_code(0);
    let spans = json(&place, "out.json")["spans"].clone();
    let size = |k: usize, cells: f64| 30.0 * cells / spans[k].as_f64().unwrap();
    let again = place.text("again.asc");
    let number = |name: &str| {
        let line = again.lines().find(|l| l.starts_with(name)).unwrap_or_else(|| panic!("no {name} in {again}"));
        line.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap()
    };
    assert!((number("dx") / size(1, 29.0) - 1.0).abs() < 1e-12 && (number("dy") / size(0, 11.0) - 1.0).abs() < 1e-12);
}

#[test]
fn an_outline_whose_y_points_down_stays_upright() {
    let place = Place::new();
    place.write(
        "in.svg",
        r#"<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0 C 10 0 20 5 30 20 S 40 60 60 80" fill="none"/></svg>"#,
    );
    for how in ["", "--fair --tolerance 0.1"] {
        place.run(&format!("fit in.svg {how} -o out.svg -o out.json")).with_code(0);
        assert_eq!(json(&place, "out.json")["y"], "down", "{how}");
        place.run("edit out.svg -o back.json").with_code(0);
        let back = json(&place, "back.json");
        let last = back["points"].as_array().unwrap().last().unwrap().clone();
        assert_eq!(back["y"], "down");
        assert!((last[0].as_f64().unwrap() - 60.0).abs() < 1.0 && (last[1].as_f64().unwrap() - 80.0).abs() < 1.0);
    }
}

#[test]
fn a_fit_states_the_energy_that_it_minimised_and_whether_it_converged() {
    let place = Place::new();
    let row = |k: u32| format!("{},{},{}\n", 40.0 * noise(2 * k), 10.0 * noise(2 * k + 1), noise(7 * k + 3));
    place.write("points.csv", (0..200).map(row).chain(["0,0,1\n40,10,2\n".to_owned()]).collect::<String>());
    place.run("fit points.csv --weight 1e-2 --stiffening 6 -o out.json --report r.json").with_code(0);
    assert_eq!(json(&place, "r.json")["converged"], true);
    // Stiffening is per side of the domain, squared: 36 / (40 * 10).
    assert_eq!(json(&place, "out.json")["energy"]["stretch"], 0.09);
    let ended = place.run("fit points.csv --weight 1e-14 --stiffening 0 --spans 32 -o out.json --report r.json");
    assert!(ended.with_code(1).err.contains("not converged"));
    assert_eq!(json(&place, "r.json")["converged"], false);
    place.write("tall.csv", "0,0,1e200\n1,0,0\n0,1,0\n1,1,1\n");
    assert!(place.run("fit tall.csv -o x.json").with_code(2).err.contains("too large"));
}

#[test]
fn an_outline_that_no_solver_can_hold_is_said_not_to_be_one() {
    let place = Place::new();
    place.write("square.csv", "0,0\n1,0\n1,1\n0,1\n0,0\n");
    place.run("fit square.csv --weight 1e-3 -o out.json --report r.json").with_code(0);
    assert_eq!(json(&place, "r.json")["converged"], true);
    // Points weigh nothing beside this energy: what comes out is not the least of its sum.
    let ended = place.run("fit square.csv --weight 1e300 -o out.json --report r.json").with_code(1);
    assert!(ended.err.contains("smaller weight"), "{}", ended.err);
    assert_eq!(json(&place, "r.json")["converged"], false);
}
