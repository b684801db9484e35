//! SVG paths, points, height fields.

use ondelette_io::shape::{height, points, svg};
use ondelette_modeling::Axis;
use ondelette_modeling::free::{FreeCurve, FreePath};
use ondelette_modeling::shape::Curve;
use ondelette_wavelet::Boundary;

fn wrap(d: &str) -> String {
    format!(r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 24 24"><path d="{d}"/></svg>"#)
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn every_command_of_a_path_draws_what_it_should() {
    // The same corner points in all spellings.
    for d in [
        "M1 2L4 2 4 6L1 6Z",
        "m1,2l3,0 0,4-3,0z",
        "M1 2H4V6H1z",
        "m1 2h3v4h-3z",
        "M 1 2 4 2 4 6 1 6 1 2",
        "M1 2C2 2 3 2 4 2S4 5 4 6 2 6 1 6z",
        "M1,2q1.5,0,3,0t0,4L1 6Z",
    ] {
        let read = svg::read(&wrap(d)).unwrap();
        let part = &read.path.parts[0];
        for corner in [[1.0, 2.0, 0.0], [4.0, 2.0, 0.0], [4.0, 6.0, 0.0], [1.0, 6.0, 0.0]] {
            assert!(part.points().iter().any(|p| apart(*p, corner) < 1e-12), "{d} misses {corner:?}");
        }
        assert!(part.is_closed(), "{d}");
    }
    // Numbers without blanks, and two sub-paths.
    assert_eq!(svg::read(&wrap("M.5.5-1-1e0M0 0 1 1")).unwrap().path.parts.len(), 2);
}

#[test]
fn arcs_are_round() {
    for (d, middle, radius) in [
        ("M1 0A1 1 0 0 1 -1 0A1 1 0 0 1 1 0z", [0.0, 0.0, 0.0], 1.0),
        ("M3 1a2 2 0 1 0 -2 2", [1.0, 1.0, 0.0], 2.0),
        // too small a radius is blown up
        ("M0 0A1 1 45 0 0 6 0", [3.0, 0.0, 0.0], 3.0),
    ] {
        let part = svg::read(&wrap(d)).unwrap().path.parts.remove(0);
        let [a, b] = part.knots().domain();
        for k in 0..=200 {
            let p = part.point(a + (b - a) * f64::from(k) / 200.0);
            assert!((apart(p, middle) - radius).abs() < 4e-7 * radius, "{d}: {p:?}");
        }
    }
}

#[test]
fn transforms_are_applied_from_the_inside_out() {
    let text = r#"<svg><defs><path d="M9 9 8 8"/></defs><g transform="translate(10,20) scale(2)">
        <path transform="rotate(90)" d="M0 0 3 0"/></g><polygon points="0,0 1,0 1,1"/></svg>"#;
    let read = svg::read(text).unwrap();
    assert_eq!(read.path.parts.len(), 2);
    assert!(apart(read.path.parts[0].point(1.0), [10.0, 26.0, 0.0]) < 1e-12);
    assert!(read.path.parts[1].is_closed());
    assert!(svg::read(r#"<svg><path transform="spin(3)" d="M0 0 1 1"/></svg>"#).unwrap_err().contains("spin"));
}

#[test]
fn curves_go_out_as_paths_and_come_back_as_curves() {
    for (boundary, spans) in [(Boundary::Open, 13), (Boundary::Periodic, 9)] {
        let axis = Axis::new(boundary, spans, [0.0, 1.0]).unwrap();
        let points = (0..axis.len()).map(|i| i as f64).map(|x| [x / 3.0, (x * 1.1).sin() * 7.0, 0.0]).collect();
        let curve = Curve::new(axis, 2, points).unwrap();
        for y_down in [false, true] {
            let path = FreePath { parts: vec![FreeCurve::from(&curve)] };
            let text = svg::write(&path, y_down, 1e-6).unwrap();
            let read = svg::read(&text).unwrap();
            assert_eq!(read.y_down, y_down);
            let back = read.path.parts[0].exactly_uniform().expect("smooth, so uniform again");
            assert_eq!((back.axis().boundary(), back.axis().spans()), (boundary, spans));
            let worst = back.points().iter().zip(curve.points()).map(|(&a, &b)| apart(a, b)).fold(0.0, f64::max);
            assert!(worst < 1e-12, "{worst}");
        }
    }
}

#[test]
fn nasty_paths_are_refused_at_once() {
    for (d, word) in [
        ("M1e39 10 L 20 20 Z A 5 5 0 0 1 3 3", "1e39"),
        ("M1e400 0L1 1", "inf"),
        ("L1 1", "begins with M"),
        ("M0 0 X", "command"),
        ("M0 0 L", "number"),
        ("M0 0A1 1 0 2 0 1 1", "flag"),
        ("M0 0 1 1 z 5 5", "command"),
        ("hello", "begins with M"),
    ] {
        let error = svg::read(&wrap(d)).unwrap_err();
        assert!(error.contains(word), "{d}: {error}");
    }
    assert!(svg::read("<svg/>").unwrap_err().contains("no path"));
    assert!(svg::read("<svg><path d='M0 0'/></svg>").is_err());
    assert!(svg::read("no xml").is_err());
}

#[test]
fn points_and_outlines_are_read() {
    let read = points::read_csv("# a comment\nx;y;z\n1;2;3\n\n4;5;6\n").unwrap();
    assert_eq!((read.dim, read.points), (3, vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]));
    assert_eq!(points::read_csv(&points::write_csv(&[[0.1, -2e-9, 0.0]], 2)).unwrap().points, [[0.1, -2e-9, 0.0]]);
    for (text, word) in [("", "no points"), ("1,2\n3\n", "line 2"), ("1,2\nx,y\n", "line 2"), ("1,nan\n", "line 1")] {
        assert!(points::read_csv(text).unwrap_err().contains(word), "{text}");
    }
    let selig = "FOO 12\n 1.0 0.0\n 0.5 0.1\n 0.0 0.0\n 0.5 -0.1\n 1.0 0.0\n";
    let lednicer = "FOO 12\n 3. 3.\n\n 0.0 0.0\n 0.5 0.1\n 1.0 0.0\n\n 0.0 0.0\n 0.5 -0.1\n 1.0 0.0\n";
    assert_eq!(points::read_dat(selig), points::read_dat(lednicer));
    assert!(points::read_dat("FOO\n1 2\n").unwrap_err().contains("at least 3"));
    assert!(points::read_dat("FOO\n1 2\n1 2 3\n").unwrap_err().contains("line 3"));
}

#[test]
fn height_fields_come_back() {
    let heights: Vec<f64> = (0..12).map(|i| f64::from(i * i) - 30.5).collect();
    let mut field = height::HeightField::new([3, 4], heights).unwrap();
    assert_eq!(height::read_npy(&height::write_npy(&field)).unwrap(), field);
    assert_eq!(height::read_asc(&height::write_asc(&field)).unwrap(), field);
    let (png, [low, high]) = height::write_png(&field).unwrap();
    let back = height::read_png(&png).unwrap();
    for (a, b) in back.heights.iter().zip(&field.heights) {
        assert!((low + a / 65535.0 * (high - low) - b).abs() <= 0.51 / 65535.0 * (high - low));
    }
    field.known = (0..12).map(|i| i != 5).collect();
    field.heights[5] = 0.0;
    assert_eq!(height::read_npy(&height::write_npy(&field)).unwrap(), field);
    assert_eq!(height::read_asc(&height::write_asc(&field)).unwrap(), field);
    for text in
        ["", "ncols 2\nnrows 2\n1 2 3\n", "ncols 2\nnrows 2\n1 2 3 x\n", "ncols 99999999999\nnrows 99999999999\n1"]
    {
        assert!(height::read_asc(text).is_err(), "{text}");
    }
    // Where it lies and how large its cells are comes back, square or not.
    (field.cell, field.corner) = ([30.0, 30.0], [746_000.5, 4_022_000.25]);
    assert!(height::write_asc(&field).contains("xllcorner 746000.5\nyllcorner 4022000.25\ncellsize 30\n"));
    assert_eq!(height::read_asc(&height::write_asc(&field)).unwrap(), field);
    field.cell = [10.5, 30.0];
    assert!(height::write_asc(&field).contains("dx 30\ndy 10.5\n"));
    assert_eq!(height::read_asc(&height::write_asc(&field)).unwrap(), field);
    let centred = "ncols 1\nnrows 1\nxllcenter 20\nyllcenter 7\ndx 4\ndy 2\n5\n";
    assert_eq!(height::read_asc(centred).unwrap().corner, [18.0, 6.0]);
    for text in ["ncols 1\nnrows 1\ndx 0\n5", "ncols 1\nnrows 1\nxllcorner inf\n5"] {
        assert!(height::read_asc(text).is_err(), "{text}");
    }
    assert!(height::read_png(b"no picture").is_err());
}

#[test]
fn a_grid_may_begin_with_a_gap() {
    let header = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\nNODATA_value nan\n";
    for gap in ["nan", "NaN", "NAN", "-nan"] {
        let field = height::read_asc(&format!("{header}{gap} 1 2\n3 {gap} 5\n")).unwrap();
        assert_eq!(field.known, [false, true, true, true, false, true], "{gap}");
        assert_eq!(field.heights, [0.0, 1.0, 2.0, 3.0, 0.0, 5.0], "{gap}");
    }
    let infinite = height::read_asc(&format!("{header}inf 1 2 3 4 5")).unwrap_err();
    assert!(infinite.contains("row 0, column 0"), "{infinite}");
}

#[test]
fn a_curve_whose_y_points_up_may_be_moved_in_the_picture() {
    let svg = |around: &str, transform: &str| {
        let text = format!(
            "<svg xmlns='http://www.w3.org/2000/svg'><g {around}><g data-ondelette-y='up' {transform}>\
             <path d='M0 0C0 1 1 1 1 0'/></g></g></svg>"
        );
        let read = svg::read(&text).unwrap();
        assert!(!read.y_down);
        read.path.parts[0].points().iter().map(|p| [p[0], p[1]]).collect::<Vec<[f64; 2]>>()
    };
    let as_written = svg("", "transform='scale(1,-1)'");
    assert_eq!(as_written, [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]]);
    // Editors move the mirror to the path itself, or into its numbers: the picture is the same.
    for path in ["transform='scale(1,-1)' d='M0 0C0 1 1 1 1 0'", "d='M0 0C0 -1 1 -1 1 0'"] {
        let text = format!(
            "<svg xmlns='http://www.w3.org/2000/svg'><g data-ondelette-y='up'>\
             <g data-ondelette-y='up'><path {path}/></g></g><path d='M0 3L1 4'/></svg>"
        );
        let read = svg::read(&text).unwrap();
        let points = |k: usize| read.path.parts[k].points().iter().map(|p| [p[0], p[1]]).collect::<Vec<[f64; 2]>>();
        assert!(!read.y_down);
        assert_eq!(points(0), as_written, "{path}");
        // What is beside it in the file stays beside it.
        assert_eq!((points(1)[0], points(1).last()), ([0.0, -3.0], Some(&[1.0, -4.0])));
        let again = svg::read(&svg::write(&read.path, read.y_down, 1e-9).unwrap()).unwrap();
        assert_eq!((again.path, again.y_down), (read.path, false));
    }
    // An editor moves the picture 100 right and 200 down.
    let moved = [[100.0, -200.0], [100.0, -199.0], [101.0, -199.0], [101.0, -200.0]];
    assert_eq!(svg("", "transform='matrix(1,0,0,-1,100,200)'"), moved);
    assert_eq!(svg("transform='translate(100,200)'", "transform='scale(1,-1)'"), moved);
}
