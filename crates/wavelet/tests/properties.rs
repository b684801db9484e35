//! Random lengths, random data, and everything that must be refused.

use ondelette_wavelet::{
    Boundary, Family, Kind, Layout, Pyramid, PyramidError, Scaling, Tensor, TransformError, levels_allowed,
};
use proptest::prelude::*;

const NAMES: [&str; 20] = [
    "bspline",
    "bspline22",
    "bspline33",
    "bspline46",
    "bspline612",
    "haar",
    "d4",
    "d8",
    "d20",
    "cdf53",
    "cdf97",
    "m1",
    "m2",
    "m3",
    "m6",
    "f1",
    "f2",
    "f3",
    "f4",
    "d14",
];

fn any_family() -> impl Strategy<Value = (Family, Boundary)> {
    let boundary = prop_oneof![Just(Boundary::Mirrored), Just(Boundary::Open), Just(Boundary::Periodic)];
    (0..NAMES.len(), boundary).prop_map(|(i, b)| (NAMES[i].parse().expect("a family"), b))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn any_data_of_any_length_comes_back(
        (family, boundary) in any_family(),
        len in 1_usize..300,
        sigma in 0.4_f64..3.0,
        data in prop::collection::vec(-1e6_f64..1e6, 300),
    ) {
        let Ok(most) = levels_allowed(family, boundary, len) else { return Ok(()) };
        let levels = most.min(6);
        let pyramid = Pyramid::new(family, boundary, len, levels).expect("allowed").with_scaling(Scaling::Sigma(sigma));
        let x = &data[..len];
        for kind in [Kind::Coefficients, Kind::Basis] {
            let back = pyramid.down(kind, &pyramid.up(kind, x).expect("finite")).expect("finite");
            let scale = x.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
            for (a, b) in x.iter().zip(&back) {
                prop_assert!((a - b).abs() <= 1e-11 * scale, "{family} {boundary} {len} {kind:?}: {a} {b}");
            }
        }
    }

    #[test]
    fn single_precision_grids_come_back(
        (family, boundary) in any_family(),
        rows in 1_usize..40,
        cols in 1_usize..40,
        standard in any::<bool>(),
        data in prop::collection::vec(-1.0_f32..1.0, 1600),
    ) {
        let levels = [rows, cols].map(|n| levels_allowed(family, boundary, n));
        let [Ok(a), Ok(b)] = levels else { return Ok(()) };
        let levels = a.min(b).min(3);
        let axis = |n| Pyramid::new(family, boundary, n, levels).expect("allowed");
        let layout = if standard { Layout::Standard } else { Layout::NonStandard };
        let tensor = Tensor::new(vec![axis(rows), axis(cols)], layout).expect("equal levels");
        let x = &data[..rows * cols];
        let back = tensor.synthesize(&tensor.analyze(x).expect("finite")).expect("finite");
        for (a, b) in x.iter().zip(&back) {
            prop_assert!((a - b).abs() <= 2e-3, "{family} {boundary} {rows}x{cols}: {a} {b}");
        }
    }

    #[test]
    fn a_value_that_is_not_finite_is_found(at in 0_usize..5000, which in 0..3, len in 5000_usize..9000) {
        let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY][which as usize];
        let pyramid = Pyramid::deepest("bspline".parse().expect("a family"), Boundary::Mirrored, len).expect("fits");
        let mut x = vec![1.0; len];
        x[at] = bad;
        match pyramid.analyze(&x) {
            Err(TransformError::NotFinite { index, .. }) => prop_assert_eq!(index, at),
            other => prop_assert!(false, "{other:?}"),
        }
        prop_assert!(pyramid.synthesize(&x).is_err());
    }

    #[test]
    fn a_value_that_is_not_finite_is_found_in_grids(
        (family, boundary) in any_family(),
        rows in 1_usize..40,
        cols in 1_usize..40,
        at in 0_usize..1600,
        infinite in any::<bool>(),
        standard in any::<bool>(),
    ) {
        let levels = [rows, cols].map(|n| levels_allowed(family, boundary, n));
        let [Ok(a), Ok(b)] = levels else { return Ok(()) };
        let axis = |n| Pyramid::new(family, boundary, n, a.min(b)).expect("allowed");
        let layout = if standard { Layout::Standard } else { Layout::NonStandard };
        let tensor = Tensor::new(vec![axis(rows), axis(cols)], layout).expect("equal levels");
        let mut x = vec![1.0_f32; rows * cols];
        let at = at % x.len();
        x[at] = if infinite { f32::INFINITY } else { f32::NAN };
        for kind in [Kind::Coefficients, Kind::Basis] {
            match tensor.up(kind, &x) {
                Err(TransformError::NotFinite { index, .. }) => prop_assert_eq!(index, at),
                other => {
                    let norms = other.map(|d| d.norms());
                    prop_assert!(false, "{family} {boundary} {rows}x{cols} {kind:?}: {norms:?}");
                }
            }
            let mut back = x.clone();
            match tensor.down_into(kind, &x, &mut back) {
                Err(TransformError::NotFinite { index, .. }) => prop_assert_eq!(index, at),
                other => prop_assert!(false, "{family} {boundary} {rows}x{cols} {kind:?} down: {other:?}"),
            }
        }
    }

    #[test]
    fn too_many_levels_are_refused((family, boundary) in any_family(), len in 0_usize..200, more in 1_usize..70) {
        match levels_allowed(family, boundary, len) {
            Ok(most) => {
                let refused = Pyramid::new(family, boundary, len, most + more);
                let told = matches!(refused, Err(PyramidError::Levels { most: m, .. }) if m == most);
                prop_assert!(told);
            }
            Err(e) => prop_assert!(!e.to_string().is_empty()),
        }
    }
}

#[test]
fn empty_and_short_input_is_refused() {
    let haar = "haar".parse().expect("a family");
    assert!(matches!(Pyramid::deepest(haar, Boundary::Periodic, 0), Err(PyramidError::Length { len: 0, .. })));
    let pyramid = Pyramid::deepest(haar, Boundary::Periodic, 8).expect("fits");
    assert_eq!(pyramid.analyze::<f64>(&[]), Err(TransformError::Length { got: 0, want: 8 }));
    let cubic = "bspline".parse().expect("a family");
    assert!(Pyramid::deepest(cubic, Boundary::Open, 3).is_err());
    let fits = Pyramid::new(cubic, Boundary::Periodic, 100, 3).expect_err("100 is not divisible by 8").to_string();
    assert!(fits.contains("96 or 104"), "{fits}");
}

#[test]
fn absurd_lengths_are_refused() {
    for name in NAMES {
        let family: Family = name.parse().expect("a family");
        for boundary in [Boundary::Mirrored, Boundary::Open, Boundary::Periodic] {
            for len in [usize::MAX, usize::MAX - 1, usize::MAX / 2 + 1, usize::MAX / 2 + 2, 1 << 62, (1 << 40) + 8] {
                assert!(levels_allowed(family, boundary, len).is_err(), "{name} {boundary} {len}");
                assert!(Pyramid::deepest(family, boundary, len).is_err(), "{name} {boundary} {len}");
            }
        }
    }
    let axis = Pyramid::new("haar".parse().expect("a family"), Boundary::Periodic, 1 << 40, 2).expect("allowed");
    assert!(Tensor::new(vec![axis.clone(), axis], Layout::NonStandard).is_err());
}

#[test]
fn memory_of_an_earlier_call_changes_no_bit() {
    let axis = |n| Pyramid::new("bspline".parse().expect("a family"), Boundary::Mirrored, n, 3).expect("allowed");
    let tensor = Tensor::new(vec![axis(70), axis(83)], Layout::NonStandard).expect("equal levels");
    let x: Vec<f64> = (0..70 * 83).map(|i| (f64::from(i) * 0.37).sin()).collect();
    let (mut fresh, mut reused, mut work) = (x.clone(), x.clone(), ondelette_wavelet::Workspace::default());
    let bad = vec![f64::NAN; x.len()];
    assert!(tensor.up_with(Kind::Coefficients, &bad, &mut reused, &mut work).is_err());
    assert!(tensor.down_with(Kind::Coefficients, &bad, &mut reused, &mut work).is_err());
    tensor.up_into(Kind::Coefficients, &x, &mut fresh).expect("finite");
    tensor.up_with(Kind::Coefficients, &x, &mut reused, &mut work).expect("finite");
    assert!(fresh == reused);
    let (mut back, mut again) = (x.clone(), x.clone());
    tensor.down_into(Kind::Coefficients, &fresh, &mut back).expect("finite");
    tensor.down_with(Kind::Coefficients, &fresh, &mut again, &mut work).expect("finite");
    assert!(back == again);
}

#[test]
fn polynomials_leave_no_detail_where_the_moments_vanish() {
    // Dual moments: the cubic spaces reproduce cubics inside; the open one up to its ends.
    let cubic = |t: f64| 2.0 - t + 0.3 * t * t - 0.01 * t * t * t;
    let open = Pyramid::new("bspline".parse().expect("a family"), Boundary::Open, 53, 3).expect("fits");
    let space = ondelette_wavelet::SplineSpace::new(ondelette_wavelet::SplineFamily::CUBIC, Boundary::Open, 53);
    let space = space.expect("a space");
    let samples: Vec<f64> = space.sites().iter().map(|&t| cubic(t)).collect();
    let flat = open.analyze(&space.interpolate(&samples).expect("as many")).expect("finite");
    let scale = flat.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    assert!(flat[open.smooth_len(0)..].iter().all(|v| v.abs() < 1e-12 * scale));
    // Mirrored: 4 moments inside, 1 at the ends (section 2.5.1 and its erratum).
    let n = 257;
    let mirrored = Pyramid::new("bspline".parse().expect("a family"), Boundary::Mirrored, n, 1).expect("fits");
    for power in 0..4 {
        let x: Vec<f64> = (0..n).map(|i| (i as f64 / 128.0 - 1.0).powi(power)).collect();
        let flat = mirrored.analyze(&x).expect("finite");
        let detail = &flat[129..];
        assert!(detail[2..126].iter().all(|v| v.abs() < 1e-13), "power {power} inside");
        // The discrete filter g~ of 5 taps reaches the mirror from the first and last wavelet only.
        let ends = detail[0].abs().max(detail[127].abs());
        assert!(
            if power == 0 { ends < 1e-13 } else { ends > 1e-7 || power % 2 == 0 && ends > 1e-9 },
            "power {power}: {ends:e}"
        );
    }
}
