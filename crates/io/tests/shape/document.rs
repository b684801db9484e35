//! The JSON document.

use ondelette_io::shape::{Document, Geometry};
use ondelette_modeling::Axis;
use ondelette_modeling::shape::{Curve, Surface};
use ondelette_wavelet::Boundary;

#[test]
fn a_specification_is_read_in_all_its_spellings() {
    let text = r#"{
        "boundary": ["open", "periodic"], "levels": 3, "domain": [[0, 2], [-1, 1]],
        "energy": { "stretch": 0.1, "variation": 2 },
        "constraints": [
            { "id": "top", "at": [1, 0], "position": [1, null, 3.5], "weight": 2 },
            { "at": [0, 0.5], "ds": [0, 0, 1], "normal": [0, 0, 1] }
        ],
        "stiffness": [{ "from": [0, -1], "to": [1, 1], "factor": 1e-4 }],
        "solver": "bpx", "tolerance": 1e-10
    }"#;
    let d = Document::read(text, Some(2)).unwrap();
    assert_eq!((d.axes[0].spans(), d.axes[1].boundary()), (8, Boundary::Periodic));
    assert_eq!(d.axes[1].domain(), [-1.0, 1.0]);
    assert_eq!(d.energy, [0.1, 0.0, 2.0]);
    assert_eq!(d.constraints[0].position, Some(vec![Some(1.0), None, Some(3.5)]));
    assert_eq!(d.constraints[1].id.as_deref(), Some("c1"));
    assert_eq!(Document::read(&d.write(), Some(2)).unwrap(), d);
    let d = Document::read(r#"{"spans": 5, "domain": "knots", "boundary": "mirror"}"#, Some(1)).unwrap();
    assert_eq!((d.axes[0].domain(), d.axes[0].boundary()), ([0.0, 5.0], Boundary::Mirrored));
    let d =
        Document::read(r#"{"spans": [5, 7], "domain": [0, 3], "constraints":[{"at":[0,0],"position":2}]}"#, Some(2));
    let d = d.unwrap();
    assert_eq!((d.axes[0].domain(), d.axes[1].domain()), ([0.0, 3.0], [0.0, 3.0]));
    assert_eq!(d.constraints[0].position, Some(vec![Some(2.0)]));
}

#[test]
fn shapes_come_back_to_the_bit() {
    let axes =
        [Axis::new(Boundary::Open, 3, [0.0, 1.0]).unwrap(), Axis::new(Boundary::Periodic, 4, [0.1, 0.3]).unwrap()];
    for dim in 1..=3 {
        let points = |n: usize| (0..n).map(|i| i as f64 / 7.0).map(|x| [x, x.sin() * 1e-9, -x * 1e9]).collect();
        let surface = Document::of_surface(Surface::new(axes, dim, points(24)).unwrap());
        let curve = Document::of_curve(Curve::new(axes[1], dim, points(4)).unwrap());
        assert_eq!(Document::read(&surface.write(), None).unwrap(), surface);
        assert_eq!(Document::read(&curve.write(), None).unwrap(), curve);
        assert!(matches!(surface.geometry, Geometry::Surface(_)));
    }
}

#[test]
fn what_makes_no_sense_is_refused_with_its_name() {
    for (text, word) in [
        ("", "line 1"),
        ("[1]", "not understood"),
        ("{}", "levels"),
        (r#"{"levels": 0.5}"#, "levels"),
        (r#"{"levels": 60}"#, "levels"),
        (r#"{"levels": 30}"#, "GB"),
        (r#"{"levels": 3, "spans": 8}"#, "one of them"),
        (r#"{"spans": 0}"#, "0 spans"),
        (r#"{"spans": 4, "colour": 3}"#, "colour"),
        (r#"{"spans": 4, "boundary": "shut"}"#, "shut"),
        (r#"{"spans": 4, "domain": [1, 1]}"#, "domain"),
        (r#"{"spans": 4, "domain": [1]}"#, "domain"),
        (r#"{"spans": 4, "energy": {"bend": -1}}"#, "bend"),
        (r#"{"spans": 4, "energy": {"bend": 0}}"#, "energy"),
        (r#"{"spans": 4, "energy": {"fun": 1}}"#, "fun"),
        (r#"{"spans": 4, "constraints": [{"at": 0, "position": ["x"]}]}"#, "neither number nor null"),
        (r#"{"spans": 4, "constraints": [{"at": 1e999, "position": 1}]}"#, "number out of range"),
        (r#"{"spans": 4, "points": [[1,2],[3]]}"#, "coordinates"),
        (r#"{"spans": 4, "points": [[1,2],[3,4]]}"#, "7"),
        (r#"{"spans": 4, "version": 9}"#, "version 9"),
        (r#"{"spans": 4, "schema": "other"}"#, "other"),
        (r#"{"spans": 4, "kind": "surface"}"#, "surface"),
        (r#"{"spans": 4, "tolerance": 2}"#, "tolerance"),
        (r#"{"spans": 4, "stiffness": [{"from": 0, "to": 1, "factor": 0}]}"#, "factor"),
    ] {
        let error = Document::read(text, Some(1)).unwrap_err();
        assert!(error.contains(word), "{text}: {error}");
    }
    let uneven = r#"{"spans": [1, 1], "points": [[1,2,3,4],[1,2,3],[1,2,3,4],[1,2,3,4,5]]}"#;
    assert!(Document::read(uneven, Some(2)).unwrap_err().contains("4 rows of 4"));
}
