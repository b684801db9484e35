//! STEP, IGES and meshes.

use ondelette_io::shape::{Splines, iges, mesh, step};
use ondelette_modeling::Axis;
use ondelette_modeling::free::{FreeCurve, FreeSurface, Knots};
use ondelette_modeling::shape::{Curve, ParametricSurface, Surface};
use ondelette_wavelet::Boundary;
use serde_json::Value;

pub(crate) const STEP: &str = include_str!("data/oracle_bicubic_9x7.step");
pub(crate) const IGES: &str = include_str!("data/oracle_bicubic_9x7.igs");

fn samples() -> Vec<[f64; 5]> {
    let oracle: Value = serde_json::from_str(include_str!("data/oracle_bicubic_9x7.json")).unwrap();
    let rows = oracle.as_object().unwrap().values().find(|v| v[0].as_array().is_some_and(|r| r.len() == 5)).unwrap();
    serde_json::from_value(rows.clone()).unwrap()
}

fn worst(surface: &FreeSurface) -> f64 {
    let samples = samples();
    assert!(samples.len() >= 42);
    let miss = |&[u, v, x, y, z]: &[f64; 5]| {
        let p = surface.point(u, v);
        (p[0] - x).abs().max((p[1] - y).abs()).max((p[2] - z).abs())
    };
    samples.iter().map(miss).fold(0.0, f64::max)
}

#[test]
fn surfaces_of_another_kernel_are_read_and_evaluated_alike() {
    let read = step::read(STEP).unwrap();
    assert_eq!((read.surfaces.len(), read.curves.len()), (1, 4), "the face and its edges, no parameter curves");
    assert!(worst(&read.surfaces[0]) < 1e-12, "{:e}", worst(&read.surfaces[0]));
    let uniform = read.surfaces[0].exactly_uniform().expect("its knots are uniform");
    assert_eq!(uniform.shape(), [9, 7]);
    // that file has nine digits
    let read = iges::read(IGES).unwrap();
    assert!(worst(&read.surfaces[0]) < 1e-8, "{:e}", worst(&read.surfaces[0]));
}

pub(crate) fn everything() -> Splines {
    let wavy = |n: usize| -> Vec<[f64; 3]> {
        (0..n).map(|i| i as f64).map(|x| [x * 1.7, (1.3 * x).sin() / 3.0, (0.7 * x * x).cos() * 1e-7]).collect()
    };
    let flat = wavy(11).into_iter().map(|p| [p[0], p[1], 0.0]).collect();
    let ring = Axis::new(Boundary::Periodic, 11, [0.1, 0.8]).unwrap();
    let open = Axis::new(Boundary::Open, 6, [0.0, 1.0]).unwrap();
    let knots = Knots::new(4, vec![-1.0, -0.5, 0.0, 0.0, 0.1, 1.0, 1.0, 1.5, 2.5, 3.0, 3.0, 4.0], 7).unwrap();
    let weights = (0..7).map(|i| 1.0 + f64::from(i) / 3.0).collect();
    let free = FreeCurve::new(3, knots, wavy(7), Some(weights)).unwrap();
    let weights = (0..4 * 5).map(|i| 1.0 + (f64::from(i) / 3.0).sin().abs()).collect();
    let uv = [Knots::bezier(3, &[0.0, 1.0]).unwrap(), Knots::bezier(2, &[0.0, 1.0, 3.0]).unwrap()];
    Splines {
        curves: vec![FreeCurve::from(&Curve::new(ring, 2, flat).unwrap()), free],
        surfaces: vec![
            FreeSurface::from(&Surface::new([open, ring], 3, wavy(99)).unwrap()),
            FreeSurface::new(uv, wavy(20), Some(weights)).unwrap(),
            FreeSurface::from(&Surface::new([ring, open], 1, wavy(99)).unwrap()),
        ],
    }
}

#[test]
fn what_is_written_reads_back_to_the_bit() {
    let all = everything();
    let back = step::read(&step::write(&all, "all kinds").unwrap()).unwrap();
    assert_eq!(back, all);
    let back = iges::read(iges::write(&all, "all kinds").unwrap()).unwrap();
    assert_eq!(back, all);
    for line in iges::write(&all, "x").unwrap().lines() {
        assert_eq!(line.len(), 80, "{line}");
    }
    let none = Splines::default();
    assert!(step::write(&none, "").is_err() && iges::write(&none, "").is_err());
}

#[test]
fn periodic_shapes_survive_exchange_as_periodic_shapes() {
    let all = everything();
    let text = step::write(&all, "x").unwrap();
    let back = step::read(&text).unwrap();
    assert_eq!(back.curves[0].exactly_uniform().unwrap().axis().boundary(), Boundary::Periodic);
    let surface = back.surfaces[0].exactly_uniform().unwrap();
    assert_eq!(surface.axes().map(|a| a.boundary()), [Boundary::Open, Boundary::Periodic]);
    assert_eq!(surface.shape(), [9, 11]);
}

#[test]
fn meshes_say_what_they_hold() {
    let surface = &everything().surfaces[0];
    let mesh = surface.tessellate(0.05).unwrap();
    let obj = mesh::obj(&mesh, "a b");
    assert!(obj.starts_with("o a_b\nv "));
    let count = |c: &str| obj.lines().filter(|l| l.starts_with(c)).count();
    assert_eq!((count("v "), count("vn "), count("f ")), (mesh.points.len(), mesh.points.len(), mesh.triangles.len()));
    let glb = mesh::glb(&mesh, "sheet").unwrap();
    let length = u32::from_le_bytes(glb[8..12].try_into().unwrap());
    assert_eq!(length as usize, glb.len());
    let json = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let document: Value = serde_json::from_slice(&glb[20..20 + json]).unwrap();
    assert_eq!(document["accessors"][0]["count"], mesh.points.len());
    let gltf = gltf::Gltf::from_slice(&glb).expect("another reader takes it");
    let primitive = gltf.meshes().next().unwrap().primitives().next().unwrap();
    let reader = primitive.reader(|_| gltf.blob.as_deref());
    let positions: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
    assert_eq!(positions[3], mesh.points[3].map(|x| x as f32));
    assert_eq!(reader.read_indices().unwrap().into_u32().count(), 3 * mesh.triangles.len());
}

#[test]
fn broken_files_say_where() {
    for (text, word) in [
        ("", "ISO-10303-21"),
        ("ISO-10303-21;\nDATA;\n#1=POINT('',\n(1.,2.);\n", "line 4"),
        ("ISO-10303-21;DATA;#1=FOO();ENDSEC;", "no B-spline"),
        ("ISO-10303-21;DATA;#1=B_SPLINE_CURVE_WITH_KNOTS('',3,(#1,#2),.U.,.F.,.F.,(4,4),(0.,1.),.U.);", "#1"),
    ] {
        let error = step::read(text).unwrap_err();
        assert!(error.contains(word), "{error}");
    }
    assert!(iges::read("hello").unwrap_err().contains("no IGES file"));
    let cut = IGES.replace("128,8,6,3,3", "128,8,6,3,9");
    assert!(iges::read(&cut).unwrap_err().contains("128"));
    let trimmed = iges::write(&Splines { surfaces: Vec::new(), ..everything() }, "x").unwrap();
    assert!(iges::read(&trimmed).is_ok());
}

/// An IGES file of entities: type, number of the matrix's entity, entity use flag, parameters.
fn entities(all: &[(u32, usize, &str, &str)]) -> String {
    let (mut directory, mut parameters) = (String::new(), String::new());
    let mut next = 1;
    for (i, (kind, matrix, usage, fields)) in all.iter().enumerate() {
        let d = 2 * i + 1;
        let matrix = if *matrix == 0 { 0 } else { 2 * matrix - 1 };
        let data = format!("{kind},{fields};");
        let lines: Vec<&str> = data.split_inclusive(',').collect();
        directory += &format!(
            "{kind:>8}{next:>8}{0:>8}{0:>8}{0:>8}{0:>8}{matrix:>8}{0:>8}{status:>8}D{d:>7}\n",
            0,
            status = format!("0000{usage}00"),
        );
        let count = lines.len();
        directory += &format!("{kind:>8}{0:>8}{0:>8}{count:>8}{0:>8}{0:>8}{0:>8}{0:>8}{0:>8}D{1:>7}\n", 0, d + 1);
        for line in lines {
            parameters += &format!("{line:<64}{d:>8}P{next:>7}\n");
            next += 1;
        }
    }
    format!("{:<72}S      1\n{:<72}G      1\n{directory}{parameters}", "", "1H,,1H;")
}

const SEGMENT: &str = "1,1,0,0,1,0,0.,0.,1.,1.,1.,1.,0.,0.,0.,2.,0.,0.,0.,1.,0.,0.,0.";

#[test]
fn iges_matrices_move_what_they_belong_to_one_after_the_other() {
    // A quarter turn about z with a shift along x, then twice as large and up.
    let turn = "0.,-1.,0.,10.,1.,0.,0.,0.,0.,0.,1.,0.";
    let grow = "2.,0.,0.,0.,0.,2.,0.,0.,0.,0.,2.,5.";
    let plain = iges::read(entities(&[(126, 0, "00", SEGMENT)])).unwrap();
    assert_eq!(plain.curves[0].points(), [[0.0; 3], [2.0, 0.0, 0.0]]);
    let moved = iges::read(entities(&[(124, 2, "00", turn), (124, 0, "00", grow), (126, 1, "00", SEGMENT)])).unwrap();
    assert_eq!(moved.curves[0].points(), [[20.0, 0.0, 5.0], [20.0, 4.0, 5.0]]);
    // A matrix that is none, that is of itself, that is not there.
    for wrong in [
        entities(&[(110, 0, "00", "0.,0.,0.,1.,1.,1."), (126, 1, "00", SEGMENT)]),
        entities(&[(124, 1, "00", turn), (126, 1, "00", SEGMENT)]),
        entities(&[(126, 7, "00", SEGMENT)]),
        entities(&[(124, 0, "00", "1.,0.,0."), (126, 1, "00", SEGMENT)]),
    ] {
        assert!(iges::read(&wrong).unwrap_err().contains("entity 126"), "{wrong}");
    }
}

#[test]
fn iges_curves_of_parameters_are_left_out_and_parts_of_surfaces_refused() {
    let both = iges::read(entities(&[(126, 0, "05", SEGMENT), (126, 0, "00", SEGMENT)])).unwrap();
    assert_eq!(both.curves.len(), 1, "a curve in the parameters of a surface is none in space");
    let sheet = |ends: &str| {
        let points = "0.,0.,0.,1.,0.,0.,0.,1.,0.,1.,1.,0.";
        format!("1,1,1,1,0,0,1,0,0,0.,0.,1.,1.,0.,0.,1.,1.,1.,1.,1.,1.,{points},{ends}")
    };
    assert!(iges::read(entities(&[(128, 0, "00", &sheet("0.,1.,0.,1."))])).is_ok());
    for ends in ["0.,0.5,0.,1.", "0.,1.,0.25,1."] {
        let refused = iges::read(entities(&[(128, 0, "00", &sheet(ends))])).unwrap_err();
        assert!(refused.contains("trimmed"), "{refused}");
    }
}

#[test]
fn iges_columns_hold_whatever_bytes_a_name_has() {
    let text = entities(&[(126, 0, "00", SEGMENT)]);
    let name = text.find("1H,,1H;").unwrap() + 20;
    let mut bytes = text.clone().into_bytes();
    bytes[name] = 0xe9;
    assert_eq!(iges::read(&bytes).unwrap(), iges::read(&text).unwrap());
    // Behind a parameter list's end, in a line that counts.
    let end = text.rfind("0.;").unwrap() + 5;
    let mut bytes = text.clone().into_bytes();
    bytes[end..end + 2].copy_from_slice("\u{e9}".as_bytes());
    assert_eq!(iges::read(&bytes).unwrap(), iges::read(&text).unwrap());
}
