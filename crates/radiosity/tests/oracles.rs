//! Oracles, orders per link and the standard decomposition: other ways to the same light.

use glam::DVec3;
use ondelette_radiosity::form_factor::{Polygon, point_to_polygon};
use ondelette_radiosity::scene::samples;
use ondelette_radiosity::{
    Basis, Decomposition, LinkSettings, Method, Oracle, Rgb, Scene, Settings, Solution, Solver, Weight,
};

/// Oracles with their weights, and how far the promise may be missed: refinement that does not know the error leaves
/// links behind that the estimate judges too mildly.
const JUDGES: [(Oracle, Weight, f64); 8] = [
    (Oracle::Error, Weight::Variation, 1.0),
    (Oracle::Fit, Weight::Variation, 1.0),
    (Oracle::Error, Weight::Brightness, 1.5),
    (Oracle::Fit, Weight::Brightness, 1.5),
    (Oracle::Magnitude, Weight::Brightness, 1.5),
    (Oracle::Error, Weight::None, 1.5),
    (Oracle::Fit, Weight::None, 1.5),
    (Oracle::Magnitude, Weight::None, 1.5),
];

fn judged(basis: &str, error: f64, oracle: Oracle, weight: Weight) -> Settings {
    let links = LinkSettings { oracle, weight: Some(weight), ..LinkSettings::default() };
    Settings { basis: basis.parse().unwrap(), method: Method::Wavelet, error, links, ..Settings::default() }
}

fn auto(error: f64) -> Settings {
    let links = LinkSettings { graded: true, ..LinkSettings::default() };
    Settings { basis: Basis::HIGHEST_AUTO, method: Method::Wavelet, error, links, ..Settings::default() }
}

fn solve(scene: &Scene, settings: Settings) -> Solution {
    let mut solver = Solver::new(scene.clone(), settings).unwrap();
    while solver.step().is_some() {}
    let solution = solver.into_solution();
    assert!(solution.is_finished(), "{settings:?}: {:?}", solution.statistics());
    assert!(solution.statistics().estimated_error <= settings.error);
    solution
}

/// A unit lamp close over the middle of a black square of side 2 (thesis, figure 23).
fn figure_23() -> Scene {
    let receiver = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    let emitter = [[-0.5, 0.5, 0.1], [0.5, 0.5, 0.1], [0.5, -0.5, 0.1], [-0.5, -0.5, 0.1]];
    let light = Rgb::grey(std::f64::consts::FRAC_1_PI);
    samples::quads("figure 23", &[(receiver, Rgb::BLACK, Rgb::BLACK), (emitter, Rgb::BLACK, light)])
}

/// Its relative L1 error against the closed form, on a grid off every dyadic line.
fn error_of_figure_23(solution: &Solution) -> f64 {
    let lamp = [[-0.5, 0.5], [0.5, 0.5], [0.5, -0.5], [-0.5, -0.5]].map(|[x, y]| DVec3::new(x, y, 0.1));
    let (mut miss, mut whole) = (0.0, 0.0);
    for k in 0..151 * 151 {
        let at = [(f64::from(k % 151) + 0.37) / 151.0, (f64::from(k / 151) + 0.61) / 151.0];
        let x = DVec3::new(2.0 * at[0] - 1.0, 2.0 * at[1] - 1.0, 0.0);
        let want = point_to_polygon(x, DVec3::Z, &Polygon::new(&lamp));
        miss += (solution.irradiance(0, at).0[0] - want).abs();
        whole += want;
    }
    miss / whole
}

/// A room with a lamp and a box that throws a shadow.
fn room_with_box() -> Scene {
    let walls = |low: [f64; 3], high: [f64; 3]| {
        let p = move |i: u32| [0, 1, 2].map(|k| if i >> k & 1 == 1 { high[k as usize] } else { low[k as usize] });
        [[0, 1, 3, 2], [6, 7, 5, 4], [0, 2, 6, 4], [3, 1, 5, 7], [1, 0, 4, 5], [2, 3, 7, 6]].map(|w| w.map(p))
    };
    let mut faces: Vec<_> = walls([0.0; 3], [3.0; 3]).map(|w| (w, Rgb::grey(0.6), Rgb::BLACK)).into();
    let flipped = walls([1.0, 1.2, 0.4], [2.0, 2.2, 1.0]).map(|[a, b, c, d]| [d, c, b, a]);
    faces.extend(flipped.map(|w| (w, Rgb([0.6, 0.3, 0.2]), Rgb::BLACK)));
    let lamp = [[0.8, 0.8, 2.6], [0.8, 2.2, 2.6], [2.2, 2.2, 2.6], [2.2, 0.8, 2.6]];
    faces.push((lamp, Rgb::BLACK, Rgb::grey(1.0)));
    samples::quads("room with box", &faces)
}

/// Mean absolute difference at a grid of points on every side that reflects, relative to the mean.
fn difference(a: &Solution, b: &Solution) -> f64 {
    let scene = a.scene();
    let (mut miss, mut whole) = (0.0, 0.0);
    for (side, of) in scene.sides.iter().enumerate().filter(|(_, of)| !scene.material(**of).is_pure_emitter()) {
        let area = scene.patches[of.patch as usize].area();
        for k in 0..24 * 24 {
            let at = [(f64::from(k % 24) + 0.43) / 24.0, (f64::from(k / 24) + 0.57) / 24.0];
            let (x, y) = (a.irradiance(side, at), b.irradiance(side, at));
            miss += area * (0..3).map(|c| (x.0[c] - y.0[c]).abs()).sum::<f64>();
            whole += area * y.sum();
        }
    }
    miss / whole
}

#[test]
fn every_oracle_keeps_the_promise_where_the_answer_is_known() {
    for (oracle, weight, slack) in JUDGES {
        for (basis, error) in [("m2", 0.01), ("haar", 0.04), ("f2", 0.03)] {
            let solution = solve(&figure_23(), judged(basis, error, oracle, weight));
            let off = error_of_figure_23(&solution);
            assert!(off <= slack * error, "{oracle} {weight} {basis}: {:.2} % measured", 100.0 * off);
        }
    }
    let off = error_of_figure_23(&solve(&figure_23(), auto(0.01)));
    assert!(off <= 0.01, "auto: {:.2} % measured", 100.0 * off);
}

#[test]
fn every_oracle_finds_the_shadow_of_a_box() {
    let scene = room_with_box();
    let reference = solve(&scene, judged("m2", 0.01, Oracle::Error, Weight::Variation));
    let mut links = Vec::new();
    for (oracle, weight, slack) in JUDGES.into_iter().take(5) {
        let solution = solve(&scene, judged("m2", 0.05, oracle, weight));
        let off = difference(&solution, &reference);
        assert!(off <= slack * 0.05, "{oracle} {weight}: {:.2} %", 100.0 * off);
        links.push(solution.links().len());
    }
    // what knows the kernel's misses and the shooter's detail needs fewer links than the form factor alone
    assert!(links[0] < links[4] && links[1] < links[4], "{links:?}");
    let off = difference(&solve(&scene, auto(0.05)), &reference);
    assert!(off <= 0.05, "auto: {:.2} %", 100.0 * off);
}

#[test]
fn variation_refinement_leaves_a_lamp_of_constant_brightness_whole() {
    // the lamp's radiosity is a polynomial of degree 0: only the receiver is worth dividing
    let elements = |weight| {
        let solution = solve(&figure_23(), judged("m2", 0.01, Oracle::Fit, weight));
        let mut lamp = 0;
        solution.each_leaf(|_, side, _, _| lamp += usize::from(side == 1));
        lamp
    };
    assert_eq!(elements(Weight::Variation), 1);
    assert!(elements(Weight::Brightness) > 1);
}

#[test]
fn links_of_their_own_order_use_several_and_stay_white_in_a_furnace() {
    let solution = solve(&room_with_box(), auto(0.05));
    let mut orders: Vec<[u8; 2]> = solution.links().as_slice().iter().map(|l| l.orders).collect();
    orders.sort_unstable();
    orders.dedup();
    assert!(orders.len() > 1, "{orders:?}");
    let white = solve(&samples::cube(0.9, [1.0; 6]), auto(0.01));
    for side in 0..6 {
        for at in [[0.01, 0.01], [0.5, 0.5], [0.9, 0.99]] {
            assert!((white.radiosity(side, at).0[1] * 0.1 - 1.0).abs() < 1e-6);
        }
    }
}

#[test]
fn the_standard_decomposition_gives_the_same_light_on_fewer_terms() {
    let lit_cube = samples::cube(0.5, [1.0, 0.0, 0.0, 0.2, 0.0, 0.0]);
    for (method, full, basis, error) in [
        (Method::Hierarchical, Method::Classical, "haar", 0.05),
        (Method::Wavelet, Method::Galerkin, "m2", 0.01),
        (Method::Wavelet, Method::Galerkin, "m3", 0.01),
    ] {
        let basis: Basis = basis.parse().unwrap();
        let links = LinkSettings { decomposition: Decomposition::Standard, ..LinkSettings::default() };
        let standard = solve(&lit_cube, Settings { basis, method, error, links, ..Settings::default() });
        let subdivision = (0..8).find(|n| {
            let count = 6 << (2 * n);
            count == standard.forest().leaves()
        });
        // the full matrix of the same elements, solved as it is
        let links = LinkSettings { subdivision, ..LinkSettings::default() };
        let galerkin = solve(&lit_cube, Settings { basis, method: full, error, links, ..Settings::default() });
        assert_eq!(galerkin.forest().leaves(), standard.forest().leaves());
        let off = difference(&standard, &galerkin);
        // dropped terms may take a tenth of the promise, and the two iterations end a tenth of it from the truth
        assert!(off <= 0.3 * error, "{basis}: {off:.1e}");
        let terms = standard.statistics().terms.unwrap();
        let rows = (standard.forest().leaves() * standard.forest().stride()) as u64;
        assert_eq!(terms.full, rows * rows);
        assert!(terms.standard < terms.full && terms.standard > rows, "{basis}: {terms:?}");
        assert!(terms.nonstandard < terms.full && terms.nonstandard > rows, "{basis}: {terms:?}");
        assert!(galerkin.statistics().terms.is_none());
    }
}

#[test]
fn the_standard_decomposition_is_the_same_for_any_number_of_threads() {
    let links = LinkSettings { decomposition: Decomposition::Standard, ..LinkSettings::default() };
    let told = Settings { basis: Basis::M2, method: Method::Wavelet, error: 0.05, links, ..Settings::default() };
    let run = |threads| {
        ondelette_numerics::par::with_threads(threads, || {
            let solution = solve(&samples::cube(0.5, [1.0, 0.0, 0.0, 0.2, 0.0, 0.0]), told);
            (solution.coefficients().to_vec(), solution.statistics().clone())
        })
        .unwrap()
    };
    let one = run(1);
    assert!(one == run(2) && one == run(5));
}
