//! `ondelette probe`.

use crate::program::{Place, room};
use std::f64::consts::PI;

const HEADER: &str = "x,y,z,nx,ny,nz,irradiance_r,irradiance_g,irradiance_b,radiosity_r,radiosity_g,radiosity_b";

fn solved() -> Place {
    let place = Place::new();
    room(&place);
    place.run("light room.obj --error 0.1% -o room.onl").with_code(0);
    place
}

fn rows(table: &str) -> Vec<Vec<f64>> {
    let mut lines = table.lines();
    assert_eq!(lines.next(), Some(HEADER));
    lines.map(|line| line.split(',').map(|n| n.parse().unwrap()).collect()).collect()
}

/// Form factor from a point to a parallel rectangle centred above it at height 1, with half sides a and b: four times
/// that of a rectangle over its corner (Howell's catalogue, configuration B-3).
fn from_centre(a: f64, b: f64) -> f64 {
    let (p, q) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
    4.0 / (2.0 * PI) * (a / p * (b / p).atan() + b / q * (a / q).atan())
}

#[test]
fn values_are_read_at_the_points_in_order_with_the_inputs_as_given() {
    let place = solved();
    let inputs = "1,1,0,0,0,1\n0.1,0.30000000000000004,0,0,0,2\n1,1,1,0,0,-1\n1e-7,0,0,0,1e-3,1\n";
    place.write("points.csv", format!("x,y,z,nx,ny,nz\n{inputs}"));
    let ended = place.run("probe room.onl points.csv -o out.csv").with_code(0);
    assert!(ended.out.is_empty() && ended.err.is_empty(), "{}{}", ended.out, ended.err);
    let table = place.text("out.csv");
    let found = rows(&table);
    assert_eq!(found.len(), 4);
    for (row, input) in found.iter().zip(inputs.lines()) {
        let input: Vec<f64> = input.split(',').map(|n| n.parse().unwrap()).collect();
        assert_eq!(row[..6], input);
    }
    // under the middle of the lamp, whose exitance is pi (3, 2, 1)
    for (c, radiance) in [(0, 3.0), (1, 2.0), (2, 1.0)] {
        let expected = PI * radiance * from_centre(0.5, 0.5);
        assert!((found[0][6 + c] / expected - 1.0).abs() < 0.02, "{} {expected}", found[0][6 + c]);
        // the floor reflects half, the lamp nothing
        assert!((found[0][9 + c] - 0.5 * found[0][6 + c]).abs() < 1e-12);
        assert!((found[2][9 + c] - PI * radiance).abs() < 1e-12);
    }
    // without -o: the same bytes on standard output
    let printed = place.run("probe room.onl points.csv").with_code(0).out;
    assert_eq!(printed, table);
}

#[test]
fn free_points_are_gathered_and_have_no_radiosity() {
    let place = solved();
    place.write("points.csv", "1,1,0.25,0,0,1\n1,1,0.25,0,0,-1\n");
    let table = place.run("probe room.onl points.csv --gather").with_code(0).out;
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!((lines[0], lines.len()), (HEADER, 3));
    assert!(lines.iter().skip(1).all(|line| line.ends_with(",,,") && line.split(',').count() == 12), "{table}");
    let red: f64 = lines[1].split(',').nth(6).unwrap().parse().unwrap();
    // the lamp at a distance of 0.75: half sides 2 / 3 of it
    let expected = 3.0 * PI * from_centre(2.0 / 3.0, 2.0 / 3.0);
    assert!((red / expected - 1.0).abs() < 0.02, "{red} {expected}");
}

#[test]
fn points_off_the_surfaces_fail_the_run_and_are_listed() {
    let place = solved();
    let mut points = String::from("x,y,z,nx,ny,nz\n1,1,0,0,0,1\n");
    for k in 1..=12 {
        points += &format!("1,1,0.{k:02},0,0,1\n");
    }
    // on the floor, but facing its black back
    points += "1,1,0,0,0,-1\n";
    place.write("points.csv", points);
    let before = place.names();
    let ended = place.run("probe room.onl points.csv -o out.csv").with_code(2);
    assert!(ended.err.starts_with("error: points.csv: ") && ended.err.contains("13 of 14"), "{}", ended.err);
    assert!(
        ended.err.contains("line 3: point 1,1,0.01 normal 0,0,1") && ended.err.contains("line 12:"),
        "{}",
        ended.err
    );
    assert!(!ended.err.contains("line 13:") && ended.err.contains("3 more") && ended.err.contains("--gather"));
    assert_eq!(place.names(), before);
    assert!(place.run("probe room.onl points.csv").with_code(2).out.is_empty());
}

#[test]
fn bad_points_and_solutions_are_refused_by_name() {
    let place = solved();
    place.write("good.csv", "1,1,0,0,0,1\n");
    place.write("nan.csv", "1,1,0,0,0,1\n1,nan,0,0,0,1\n");
    place.write("short.csv", "x,y,z,nx,ny,nz\n1,1,0,0,0\n");
    place.write("flat.csv", "1,1,0,0,0,0\n");
    place.write("binary.csv", b"1,1,0,0,0,1\n\xff\xfe\n");
    let mut bytes = place.read("room.onl");
    place.write("cut.onl", &bytes[..bytes.len() / 2]);
    let middle = bytes.len() - 9;
    bytes[middle] ^= 1;
    place.write("damaged.onl", &bytes);
    bytes[16] = 9;
    place.write("future.onl", &bytes);
    let before = place.names();
    for (arguments, said) in [
        ("probe room.onl nan.csv -o o.csv", "nan.csv:2: y is NaN"),
        ("probe room.onl short.csv -o o.csv", "short.csv:2: 5 columns"),
        ("probe room.onl flat.csv -o o.csv", "flat.csv:1: the normal is zero"),
        ("probe room.onl binary.csv -o o.csv", "binary.csv:2: not a text file"),
        ("probe room.onl missing.csv -o o.csv", "missing.csv"),
        ("probe missing.onl good.csv -o o.csv", "missing.onl"),
        ("probe cut.onl good.csv -o o.csv", "cut short"),
        ("probe damaged.onl good.csv -o o.csv", "damaged"),
        ("probe future.onl good.csv -o o.csv", "version 9"),
        ("probe room.obj good.csv -o o.csv", "not an Ondelette solution"),
        ("probe room.onl good.csv -o no/o.csv", "no/o.csv"),
        ("probe room.onl good.csv -o good.csv", "would be overwritten"),
        ("probe room.onl", "POINTS.csv"),
    ] {
        let ended = place.run(arguments).with_code(2);
        assert!(ended.err.contains(said) && ended.err.starts_with("error: "), "{arguments}: {}", ended.err);
        assert_eq!(place.names(), before, "{arguments}");
    }
    assert_eq!(place.text("good.csv"), "1,1,0,0,0,1\n");
}
