//! What every family, boundary and length must satisfy, level by level and as a whole.
//!
//! The definition of a rung is a pair of sparse matrices; the fast passes are held against them here.

use ondelette_wavelet::exact::{ratio, to_f64};
use ondelette_wavelet::{Boundary, Family, Kind, Pyramid, Rung, SplineFamily, SplineSpace, levels_allowed};

/// Repeatable numbers in [-1, 1).
fn numbers(n: usize, seed: u64) -> Vec<f64> {
    let mut s = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    (0..n)
        .map(|_| {
            s ^= s << 13;
            s ^= s >> 7;
            s ^= s << 17;
            (s >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        })
        .collect()
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m, v| v.abs().max(m))
}

#[track_caller]
fn close(what: &str, a: &[f64], b: &[f64], tol: f64) {
    assert_eq!(a.len(), b.len(), "{what}");
    let scale = largest(b).max(1.0);
    for (i, (x, y)) in a.iter().zip(b).enumerate() {
        assert!((x - y).abs() <= tol * scale, "{what}: [{i}] {x} against {y}, relative {:e}", (x - y).abs() / scale);
    }
}

fn rung_matches_its_definition(rung: &Rung, exact_inverse: f64) {
    let (n, s) = (rung.fine(), rung.smooth());
    let synthesis = rung.synthesis();
    let x = numbers(n, 1 + n as u64);
    let up = |kind| {
        let (mut a, mut b) = (vec![0.0; s], vec![0.0; n - s]);
        rung.up(kind, &x, &mut a, &mut b);
        [a, b].concat()
    };
    let down = |kind| {
        let mut f = vec![0.0; n];
        rung.down(kind, &x[..s], &x[s..], &mut f);
        f
    };
    close("synthesis", &down(Kind::Coefficients), &synthesis.times(&x), 1e-13);
    close("synthesis transposed", &up(Kind::Basis), &synthesis.transposed().times(&x), 1e-13);
    if let Some(analysis) = rung.analysis() {
        close("analysis", &up(Kind::Coefficients), &analysis.times(&x), 1e-13);
        close("analysis transposed", &down(Kind::Basis), &analysis.transposed().times(&x), 1e-13);
        let eye = analysis.product(&synthesis).to_dense();
        for (i, v) in eye.iter().enumerate() {
            let delta = if i / n == i % n { 1.0 } else { 0.0 };
            assert!((v - delta).abs() < exact_inverse, "analysis times synthesis at {i}: {v}");
        }
    } else {
        close("analysis solves", &synthesis.times(&up(Kind::Coefficients)), &x, 1e-13);
        close("transposed analysis solves", &synthesis.transposed().times(&down(Kind::Basis)), &x, 1e-13);
    }
}

fn conforms(family: Family, boundary: Boundary, len: usize) {
    let Ok(most) = levels_allowed(family, boundary, len) else { return };
    let pyramid = Pyramid::new(family, boundary, len, most).expect("allowed levels");
    for i in 0..most {
        rung_matches_its_definition(pyramid.rung(i), 1e-12);
    }
    let x = numbers(len, 7);
    let y = numbers(len, 8);
    for kind in [Kind::Coefficients, Kind::Basis] {
        // Reconstruction, both ways round.
        close("up then down", &pyramid.down(kind, &pyramid.up(kind, &x).unwrap()).unwrap(), &x, 1e-13);
        // Adjointness: <W^-1 y, x> = <y, W^-T x>.
        let other = if kind == Kind::Basis { Kind::Coefficients } else { Kind::Basis };
        let (a, b) = (pyramid.down(kind, &y).unwrap(), pyramid.up(other, &x).unwrap());
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let scale = dot(&a, &a).sqrt() * dot(&x, &x).sqrt();
        assert!((dot(&a, &x) - dot(&y, &b)).abs() <= 1e-13 * scale.max(1.0), "adjointness of {kind:?}");
        // Linearity.
        let mixed: Vec<f64> = x.iter().zip(&y).map(|(a, b)| 2.0 * a - 3.0 * b).collect();
        let (ux, uy) = (pyramid.up(kind, &x).unwrap(), pyramid.up(kind, &y).unwrap());
        let expected: Vec<f64> = ux.iter().zip(&uy).map(|(a, b)| 2.0 * a - 3.0 * b).collect();
        close("linearity", &pyramid.up(kind, &mixed).unwrap(), &expected, 1e-12);
    }
    // Constants have no detail (multiwavelets: the constant is the first function of each cell).
    let m = family.cell();
    let multi = matches!(family, Family::Multiwavelet(_));
    let ones: Vec<f64> = (0..len).map(|i| if !multi || i % m == 0 { 1.0 } else { 0.0 }).collect();
    let flat = pyramid.analyze(&ones).unwrap();
    let smooth = pyramid.smooth_len(0);
    assert!(largest(&flat[smooth..]) < 1e-12 * largest(&flat[..smooth]).max(1.0), "constants leave detail");
}

macro_rules! conformance {
    ($($name:ident: $family:expr, $boundary:ident, $lengths:expr;)*) => {$(
        #[test]
        fn $name() {
            let family: Family = $family.parse().unwrap();
            for len in $lengths {
                conforms(family, Boundary::$boundary, len);
            }
        }
    )*};
}

conformance! {
    haar: "haar", Periodic, [1, 2, 4, 6, 24, 64, 4096];
    m2: "m2", Periodic, [2, 4, 8, 12, 128];
    m3: "m3", Periodic, [3, 6, 12, 96];
    m4: "m4", Periodic, [4, 8, 64];
    m5: "m5", Periodic, [5, 10, 80];
    m6: "m6", Periodic, [6, 12, 96];
    f1: "f1", Periodic, [2, 64];
    f2: "f2", Periodic, [2, 4, 12, 128];
    f3: "f3", Periodic, [3, 6, 96];
    f4: "f4", Mirrored, [4, 8, 128];
    linear_mirrored: "bspline22", Mirrored, (1..40).chain([129, 255, 1000, 4097]);
    linear_periodic: "bspline22", Periodic, [2, 4, 6, 20, 64, 4096];
    quadratic_mirrored: "bspline33", Mirrored, (1..40).chain([129, 255, 1000, 4096]);
    quadratic_periodic: "bspline33", Periodic, [2, 4, 6, 20, 64, 4096];
    cubic_mirrored: "bspline", Mirrored, (1..40).chain([129, 255, 1000, 2047, 2048, 2049, 2050, 2051, 4097]);
    cubic_periodic: "bspline", Periodic, [2, 4, 6, 20, 64, 2046, 2050, 4096];
    cubic_open: "bspline", Open, (4..50).chain([129, 255, 515, 1000]);
    cubic6_mirrored: "bspline46", Mirrored, (1..40).chain([129, 255, 1000, 4097]);
    cubic6_periodic: "bspline46", Periodic, [2, 4, 6, 20, 64, 4096];
    quintic_mirrored: "bspline612", Mirrored, (1..40).chain([129, 255, 1000, 4097]);
    quintic_periodic: "bspline612", Periodic, [2, 4, 6, 20, 64, 4096];
    cdf53: "cdf53", Mirrored, (1..40).chain([4097]);
    cdf97_mirrored: "cdf97", Mirrored, (1..40).chain([129, 255, 4097]);
    cdf97_periodic: "cdf97", Periodic, [2, 4, 6, 20, 64, 4096];
    d4: "d4", Periodic, [2, 4, 6, 20, 64, 4096];
    d6: "d6", Periodic, [2, 4, 64];
    d8: "d8", Periodic, [2, 4, 64];
    d10: "d10", Periodic, [2, 4, 64];
    d12: "d12", Periodic, [2, 4, 64];
    d14: "d14", Periodic, [2, 4, 64];
    d16: "d16", Periodic, [2, 4, 64];
    d18: "d18", Periodic, [2, 4, 64];
    d20: "d20", Periodic, [2, 4, 6, 20, 64, 4096];
}

/// Moments `int psi t^k dt` of the finest wavelets, by exact moments of the finest functions.
fn moments(family: SplineFamily, boundary: Boundary, len: usize, powers: u32) -> Vec<Vec<f64>> {
    let space = SplineSpace::new(family, boundary, len).unwrap();
    let pyramid = Pyramid::new(Family::Spline(family), boundary, len, 1).unwrap();
    let rung = pyramid.rung(0);
    let middle = space.spans() as i64 / 2;
    let functions: Vec<Vec<f64>> = (0..len)
        .map(|i| {
            // About the middle, to keep powers small.
            let f = space.function(i).transformed(&ratio(1, 1), &ratio(-middle, 1));
            (0..powers).map(|k| to_f64(&f.moment(k))).collect()
        })
        .collect();
    let columns = rung.synthesis().transposed();
    (rung.smooth()..len)
        .map(|j| (0..powers as usize).map(|k| columns.row(j).iter().map(|&(i, v)| v * functions[i][k]).sum()).collect())
        .collect()
}

#[test]
fn wavelets_have_their_vanishing_moments() {
    for (family, reach) in [(SplineFamily::LINEAR, 3), (SplineFamily::CUBIC, 3), (SplineFamily::CUBIC6, 5)] {
        let powers = family.vanishing_moments();
        let all = moments(family, Boundary::Mirrored, 65, powers);
        for (j, m) in all.iter().enumerate() {
            assert!(m[0].abs() < 1e-12, "{family:?}: wavelet {j} of the mirrored space has a mean: {}", m[0]);
            if (reach..all.len() - reach).contains(&j) {
                assert!(
                    m.iter().enumerate().all(|(k, x)| x.abs() < 1e-12 * 32.0_f64.powi(k as i32)),
                    "{family:?} {j}: {m:?}"
                );
            }
        }
        // At the mirror only the first moment vanishes.
        assert!(all[0][1].abs() > 1e-3, "{family:?}: {:?}", all[0]);
    }
    // The open basis: four everywhere, the ends included.
    for (j, m) in moments(SplineFamily::CUBIC, Boundary::Open, 67, 4).iter().enumerate() {
        assert!(m.iter().enumerate().all(|(k, x)| x.abs() < 1e-12 * 32.0_f64.powi(k as i32)), "open {j}: {m:?}");
    }
}

#[test]
fn boundary_moments_of_the_thesis_and_their_erratum() {
    // First moments of the three left boundary wavelets of the mirrored cubic basis, in fine units about t = 0.
    let space = SplineSpace::new(SplineFamily::CUBIC, Boundary::Mirrored, 65).unwrap();
    let pyramid = Pyramid::new(Family::Spline(SplineFamily::CUBIC), Boundary::Mirrored, 65, 1).unwrap();
    let columns = pyramid.rung(0).synthesis().transposed();
    for (j, want) in [-9.0 / 40.0, 37.0 / 160.0, 1.0 / 96.0].into_iter().enumerate() {
        let first: f64 = columns.row(33 + j).iter().map(|&(i, v)| v * to_f64(&space.function(i).moment(1))).sum();
        let relative = (first / want).abs();
        assert!(
            (relative - 1.0).abs() < 1e-10 || (relative - 4.0).abs() < 1e-10,
            "wavelet {j}: {first} against {want}"
        );
    }
}

#[test]
fn levels_cost_a_constant_per_coefficient() {
    for (family, boundary, most) in [
        ("bspline", Boundary::Mirrored, 16.5),
        ("bspline", Boundary::Open, 16.5),
        ("bspline612", Boundary::Periodic, 40.0),
        ("d20", Boundary::Periodic, 20.0),
        ("m3", Boundary::Periodic, 6.0),
    ] {
        for len in [96, 960, 9600] {
            let len = if boundary == Boundary::Open { len + 3 } else { len };
            let pyramid = Pyramid::new(family.parse().unwrap(), boundary, len, 5).unwrap();
            let entries: usize = (0..5).map(|i| pyramid.rung(i).synthesis().len()).sum();
            // Levels halve: all together at most twice the finest.
            assert!(entries as f64 <= 2.0 * most * len as f64, "{family} {boundary} {len}: {entries}");
        }
    }
}

/// Condition number of the synthesis of a rung, by power iterations on `S^T S` and on its inverse.
fn condition(rung: &Rung) -> f64 {
    let n = rung.fine();
    let s = rung.smooth();
    let root = |f: &dyn Fn(&[f64]) -> Vec<f64>| {
        let mut x = numbers(n, 3);
        let mut gain = 0.0;
        for _ in 0..300 {
            let y = f(&x);
            gain = y.iter().map(|v| v * v).sum::<f64>().sqrt();
            x = y.into_iter().map(|v| v / gain).collect();
        }
        gain.sqrt()
    };
    let up = |kind, x: &[f64]| {
        let (mut a, mut b) = (vec![0.0; s], vec![0.0; n - s]);
        rung.up(kind, x, &mut a, &mut b);
        [a, b].concat()
    };
    let down = |kind, x: &[f64]| {
        let mut f = vec![0.0; n];
        rung.down(kind, &x[..s], &x[s..], &mut f);
        f
    };
    let largest = root(&|x| up(Kind::Basis, &down(Kind::Coefficients, x)));
    let inverse = root(&|x| up(Kind::Coefficients, &down(Kind::Basis, x)));
    largest * inverse
}

#[test]
fn open_levels_are_well_conditioned_at_any_length() {
    for spans in (1..40).chain([64, 127, 128, 200, 333]) {
        let pyramid = Pyramid::deepest("bspline".parse().unwrap(), Boundary::Open, spans + 3).unwrap();
        for i in 0..pyramid.levels() {
            let kappa = condition(pyramid.rung(i));
            assert!(kappa < 6.6, "{spans} spans, level {i}: condition {kappa}");
        }
    }
}
