//! Closed forms and couplings against numbers from independent computations (tests/data/formfactor.json).

use glam::DVec3;
use ondelette_compress::{Cell, CoupleSettings, Kernel, Pair, couple};
use ondelette_numerics::gauss;
use ondelette_radiosity::form_factor::{Polygon, point_to_polygon};
use ondelette_radiosity::kernel::{LightKernel, density};
use ondelette_radiosity::scene::samples;
use ondelette_radiosity::{Basis, Method, Rgb, Settings, Solver};
use ondelette_wavelet::cell::{CellBasis, CellFamily, CellShape};
use serde_json::Value;

fn vectors() -> Value {
    serde_json::from_str(include_str!("data/formfactor.json")).unwrap()
}

fn point(v: &Value) -> DVec3 {
    DVec3::new(v[0].as_f64().unwrap(), v[1].as_f64().unwrap(), v[2].as_f64().unwrap())
}

fn polygon(v: &Value) -> Vec<DVec3> {
    v.as_array().unwrap().iter().map(point).collect()
}

#[test]
fn point_to_polygon_matches_to_twelve_digits() {
    for case in vectors()["point"].as_array().unwrap() {
        let (p, n) = (point(&case["p"]), point(&case["n"]));
        let got = point_to_polygon(p, n, &Polygon::new(&polygon(&case["poly"])).clipped(p, n));
        let want = case["F"].as_f64().unwrap();
        assert!((got - want).abs() <= 1e-12, "{}: {got} instead of {want}", case["note"]);
    }
}

#[test]
fn the_kernel_is_cos_cos_over_pi_r_squared() {
    for case in vectors()["kernel"].as_array().unwrap() {
        let got = density(point(&case["p"]), point(&case["n"]), point(&case["q"]), point(&case["m"]));
        assert!((got - case["K_no_rho_visible"].as_f64().unwrap()).abs() <= 1e-14);
    }
}

/// Form factor of two polygons: the closed form at one end, a graded rule over triangles of the other.
fn polygon_to_polygon(from: &[DVec3], to: &[DVec3]) -> f64 {
    let target = Polygon::new(to);
    let (points, weights) = gauss::triangle_rule(24);
    let (mut sum, mut area) = (0.0, 0.0);
    for k in 1..from.len() - 1 {
        let (u, v) = (from[k] - from[0], from[k + 1] - from[0]);
        let normal = u.cross(v);
        let a = 0.5 * normal.length();
        area += a;
        for (x, w) in points.iter().zip(&weights) {
            let p = from[0] + u * x[0] + v * x[1];
            sum += a * w * point_to_polygon(p, normal.normalize(), &target.clipped(p, normal));
        }
    }
    sum / area
}

#[test]
fn form_factors_of_named_and_general_polygons_match_both_ways() {
    let all = vectors();
    for case in all["named"].as_array().unwrap().iter().chain(all["general"].as_array().unwrap()) {
        let (p, q) = (polygon(&case["P"]), polygon(&case["Q"]));
        // near and touching pairs converge slowly with the rule: it is Gauss points on one end only
        let tolerance = if case["touching"] == true || case["name"].is_string() { 2e-5 } else { 1e-9 };
        for (from, to, key) in [(&p, &q, "F_PQ"), (&q, &p, "F_QP")] {
            let (got, want) = (polygon_to_polygon(from, to), case[key].as_f64().unwrap());
            assert!((got - want).abs() <= tolerance, "{} {key}: {got} instead of {want}", case["name"]);
        }
    }
}

/// The thesis's Fig. 23: a unit emitter 0.1 above the middle of a receiver of side 2.
fn figure_23() -> ondelette_radiosity::Scene {
    let receiver = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    let emitter = [[-0.5, 0.5, 0.1], [0.5, 0.5, 0.1], [0.5, -0.5, 0.1], [-0.5, -0.5, 0.1]];
    let light = Rgb::grey(std::f64::consts::FRAC_1_PI);
    samples::quads("figure 23", &[(receiver, Rgb::BLACK, Rgb::BLACK), (emitter, Rgb::BLACK, light)])
}

#[test]
fn couplings_of_figure_23_match_the_projected_answer_element_by_element() {
    let all = vectors();
    let kernel = LightKernel::new(&figure_23());
    for case in all["fig23_multiwavelet"].as_array().unwrap() {
        let m = case["M"].as_u64().unwrap() as usize;
        let n = case["elements_per_side"].as_u64().unwrap() as usize;
        let basis = CellBasis::new(CellShape::Square, CellFamily::Multiwavelet, m).unwrap();
        let mut cells = vec![Cell::root(0, CellShape::Square)];
        for _ in 0..n.ilog2() {
            cells = cells.iter().flat_map(|c| (0..4).map(move |k| c.child(k))).collect();
        }
        let emitter = Cell::root(1, CellShape::Square);
        let settings = CoupleSettings::EXACT;
        for cell in cells {
            let coupling = couple(&kernel, &cell, &basis, &emitter, &basis, settings).unwrap();
            let at = cell.origin.map(|o| (o * n as f64).round() as usize);
            for a in 0..m {
                for b in 0..m {
                    // orthonormal on [-1, 1]^2: the mean-normalised coefficient times the root of the element's area
                    let got = coupling.block[(a * m + b) * coupling.block.len() / (m * m)] * 2.0 / n as f64;
                    let want = case["coef"][at[0] * m + a][at[1] * m + b].as_f64().unwrap();
                    assert!((got - want).abs() < 3e-3, "M{m} element {at:?} function {a},{b}: {got} instead of {want}");
                }
            }
        }
    }
}

#[test]
fn galerkin_blocks_match_also_for_touching_patches() {
    for case in vectors()["galerkin3d"].as_array().unwrap() {
        let m = case["M"].as_u64().unwrap() as usize;
        let corners = |p: &Value| {
            let (o, u, v) = (point(&p["o"]), point(&p["u"]), point(&p["v"]));
            [o, o + u, o + u + v, o + v].map(|c| c.to_array())
        };
        let (x, y) = (corners(&case["patch_x"]), corners(&case["patch_y"]));
        let white = Rgb::grey(0.5);
        let scene = samples::quads("pair", &[(x, white, white), (y, white, white)]);
        let kernel = LightKernel::new(&scene);
        let areas: Vec<f64> = kernel.sides().iter().map(|s| s.area).collect();
        let basis = CellBasis::new(CellShape::Square, CellFamily::Multiwavelet, m).unwrap();
        let (r, s) = (Cell::root(0, CellShape::Square), Cell::root(1, CellShape::Square));
        let settings = CoupleSettings::EXACT;
        let coupling = couple(&kernel, &r, &basis, &s, &basis, settings).unwrap();
        let scale = (areas[0] / areas[1]).sqrt();
        for i in 0..m * m {
            for j in 0..m * m {
                let (got, want) = (scale * coupling.block[i * m * m + j], case["k"][i][j].as_f64().unwrap());
                assert!((got - want).abs() < 2e-3, "M{m} {i},{j}: {got} instead of {want}");
            }
        }
    }
}

#[test]
fn rows_of_a_room_with_furniture_sum_to_one_at_any_point() {
    // a cube with a smaller cube in it: what a wall point sees of all sides, visibility included
    let p = |i: u32, o: f64, s: f64| [0, 1, 2].map(|k| o + s * f64::from(i >> k & 1));
    let walls = [[0, 1, 3, 2], [6, 7, 5, 4], [0, 2, 6, 4], [3, 1, 5, 7], [1, 0, 4, 5], [2, 3, 7, 6]];
    let grey = Rgb::grey(0.5);
    let mut faces: Vec<_> = walls.iter().map(|w| (w.map(|i| p(i, 0.0, 1.0)), grey, grey)).collect();
    // the furniture shows its faces outwards
    faces.extend(walls.iter().map(|w| ([w[3], w[2], w[1], w[0]].map(|i| p(i, 0.3, 0.35)), grey, Rgb::BLACK)));
    let scene = samples::quads("furnished cube", &faces);
    let kernel = LightKernel::new(&scene);
    let basis = CellBasis::new(CellShape::Square, CellFamily::Multiwavelet, 1).unwrap();
    for r in 0..12 {
        for x in [[0.3, 0.2], [0.77, 0.6]] {
            let mut sum = 0.0;
            for s in 0..12 {
                let cells = [r, s].map(|k| Cell::root(k, CellShape::Square));
                let Some(pair) = kernel.pair(&cells[0], &cells[1]) else { continue };
                let mut moments = [0.0];
                pair.moments(x, &basis, &mut moments);
                if pair.is_masked() {
                    pair.mask(x, &basis, &mut moments, 2048, 7);
                }
                sum += moments[0];
            }
            assert!((sum - 1.0).abs() < 3e-3, "side {r} at {x:?}: {sum}");
        }
    }
}

#[test]
fn touching_unit_squares_exchange_what_howell_c14_says() {
    let floor = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let wall = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]];
    let light = Rgb::grey(std::f64::consts::FRAC_1_PI);
    let scene = samples::quads("hinge", &[(floor, Rgb::BLACK, Rgb::BLACK), (wall, Rgb::BLACK, light)]);
    for name in ["haar", "m2", "m3", "f2"] {
        let basis: Basis = name.parse().unwrap();
        let mut solver =
            Solver::new(scene.clone(), Settings { basis, method: Method::Wavelet, error: 0.01, ..Settings::default() })
                .unwrap();
        while solver.step().is_some() {}
        let got = solver.solution().mean_irradiance(0).0[0];
        assert!((got / 0.200043776075403 - 1.0).abs() < 1e-3, "{name}: {got}");
    }
}

#[test]
fn faces_in_contact_exchange_nothing() {
    // a box bottom that lies on the floor and faces it: no link, no singularity, no light
    let floor = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let bottom = [[0.2, 0.8, 0.0], [0.8, 0.8, 0.0], [0.8, 0.2, 0.0], [0.2, 0.2, 0.0]];
    let light = Rgb::grey(1.0);
    let scene = samples::quads("contact", &[(floor, Rgb::grey(0.5), Rgb::BLACK), (bottom, Rgb::grey(0.5), light)]);
    let mut solver = Solver::new(scene, Settings::default()).unwrap();
    while solver.step().is_some() {}
    let solution = solver.solution();
    assert!(solution.links().is_empty());
    assert_eq!(solution.mean_irradiance(0), Rgb::BLACK);
}
