//! Grids: the picture sweep against one axis at a time, layouts, keeping the largest.

use ondelette_wavelet::{Boundary, Coefficient, Decomposition, Family, Kind, Layout, Part, Pyramid, Scaling, Tensor};

fn numbers(n: usize) -> Vec<f64> {
    (0..n).map(|i| ((i * 7919 + 13) % 1009) as f64 / 504.5 - 1.0 + (i as f64 * 0.01).sin()).collect()
}

fn axis(family: &str, boundary: Boundary, n: usize, levels: usize) -> Pyramid {
    Pyramid::new(family.parse().unwrap(), boundary, n, levels).unwrap()
}

/// One level at a time with the verbs of single rungs: what a non-standard transform means.
fn reference(tensor: &Tensor, kind: Kind, grid: &[f64]) -> Vec<f64> {
    let shape = tensor.shape();
    let (rows, cols) = (shape[0], shape[1]);
    let [a, b] = tensor.axes() else { panic!("two axes") };
    let mut out = grid.to_vec();
    for level in (0..a.levels()).rev() {
        let (ra, rb) = (a.rung(level), b.rung(level));
        for i in 0..ra.fine() {
            let row = out[i * cols..i * cols + rb.fine()].to_vec();
            let (s, d) = out[i * cols..i * cols + rb.fine()].split_at_mut(rb.smooth());
            rb.up(kind, &row, s, d);
        }
        for j in 0..rb.fine() {
            let column: Vec<f64> = (0..ra.fine()).map(|i| out[i * cols + j]).collect();
            let (mut s, mut d) = (vec![0.0; ra.smooth()], vec![0.0; ra.detail()]);
            ra.up(kind, &column, &mut s, &mut d);
            s.iter().chain(&d).enumerate().for_each(|(i, v)| out[i * cols + j] = *v);
        }
    }
    assert_eq!(out.len(), rows * cols);
    out
}

#[track_caller]
fn close(a: &[f64], b: &[f64], tol: f64) {
    let scale = b.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
    assert_eq!(a.len(), b.len());
    for (i, (x, y)) in a.iter().zip(b).enumerate() {
        assert!((x - y).abs() <= tol * scale, "[{i}] {x} against {y}");
    }
}

#[test]
fn picture_sweep_equals_rows_then_columns() {
    for (family, boundary) in [
        ("bspline", Boundary::Mirrored),
        ("bspline", Boundary::Periodic),
        ("bspline", Boundary::Open),
        ("bspline33", Boundary::Mirrored),
        ("bspline612", Boundary::Mirrored),
        ("bspline612", Boundary::Periodic),
        ("cdf97", Boundary::Mirrored),
        ("haar", Boundary::Periodic),
        ("d4", Boundary::Periodic),
        ("d12", Boundary::Periodic),
        ("m2", Boundary::Periodic),
        ("f3", Boundary::Periodic),
    ] {
        for (rows, cols) in [(48, 24), (24, 48), (576, 48), (129, 35), (255, 300), (8, 8)] {
            let family: Family = family.parse().unwrap();
            let levels = [rows, cols].map(|n| ondelette_wavelet::levels_allowed(family, boundary, n).unwrap_or(0));
            let levels = levels[0].min(levels[1]).min(4);
            let [Ok(a), Ok(b)] = [rows, cols].map(|n| Pyramid::new(family, boundary, n, levels)) else { continue };
            let tensor = Tensor::new(vec![a, b], Layout::NonStandard).unwrap();
            let x = numbers(rows * cols);
            for kind in [Kind::Coefficients, Kind::Basis] {
                let up = tensor.up(kind, &x).unwrap();
                close(up.values(), &reference(&tensor, kind, &x), 2e-13);
                close(&tensor.down(kind, &up).unwrap(), &x, 2e-13);
            }
        }
    }
}

#[test]
fn same_bytes_for_any_thread_count() {
    let tensor = Tensor::new(
        vec![axis("bspline", Boundary::Mirrored, 1025, 5), axis("bspline", Boundary::Mirrored, 700, 5)],
        Layout::NonStandard,
    )
    .unwrap();
    let x = numbers(1025 * 700);
    let run =
        |threads| ondelette_numerics::par::with_threads(threads, || tensor.analyze(&x).unwrap().into_values()).unwrap();
    let one = run(1);
    assert!(one.iter().zip(&run(2)).all(|(a, b)| a.to_bits() == b.to_bits()));
    assert!(one.iter().zip(&run(5)).all(|(a, b)| a.to_bits() == b.to_bits()));
}

#[test]
fn standard_is_the_kronecker_product_of_its_axes() {
    let (a, b) = (axis("bspline", Boundary::Mirrored, 9, 3), axis("bspline", Boundary::Open, 11, 2));
    let c = axis("f2", Boundary::Periodic, 8, 2);
    let tensor = Tensor::new(vec![a.clone(), b.clone(), c.clone()], Layout::Standard).unwrap();
    let column = |p: &Pyramid, j: usize| {
        let mut e = vec![0.0; p.len()];
        e[j] = 1.0;
        p.analyze(&e).unwrap()
    };
    for (i, j, k) in [(0, 0, 0), (3, 7, 5), (8, 10, 7), (4, 2, 1)] {
        let mut x = vec![0.0; 9 * 11 * 8];
        x[(i * 11 + j) * 8 + k] = 1.0;
        let (ca, cb, cc) = (column(&a, i), column(&b, j), column(&c, k));
        let product = |(u, v): (f64, f64)| cc.iter().map(move |w| u * v * w);
        let pairs = ca.iter().flat_map(|u| cb.iter().map(move |v| (*u, *v)));
        let expected: Vec<f64> = pairs.flat_map(product).collect();
        close(tensor.analyze(&x).unwrap().values(), &expected, 1e-14);
    }
}

#[test]
fn volumes_points_and_odd_shapes_come_back() {
    for layout in [Layout::Standard, Layout::NonStandard] {
        let axes = [17, 20, 9].map(|n| axis("bspline", Boundary::Mirrored, n, 2));
        let tensor = Tensor::new(axes.to_vec(), layout).unwrap().clone();
        let points: Vec<[f32; 3]> =
            numbers(17 * 20 * 9).iter().map(|x| [*x as f32, 1.0 - *x as f32, (x * x) as f32]).collect();
        let up = tensor.analyze(&points).unwrap();
        let back = tensor.synthesize(&up).unwrap();
        let worst = <[f32; 3]>::flat(&points)
            .iter()
            .zip(<[f32; 3]>::flat(&back))
            .fold(0.0_f32, |m, (a, b)| m.max((a - b).abs()));
        assert!(worst < 1e-5, "{worst:e}");
        let total: usize = up.blocks().iter().map(ondelette_wavelet::Block::len).sum();
        assert_eq!(total, points.len());
    }
    // 129 x 255 comes back as 129 x 255.
    let tensor = Tensor::new(
        vec![axis("bspline", Boundary::Mirrored, 129, 7), axis("bspline", Boundary::Mirrored, 255, 7)],
        Layout::NonStandard,
    )
    .unwrap();
    let x = numbers(129 * 255);
    close(&tensor.synthesize(&tensor.analyze(&x).unwrap()).unwrap(), &x, 1e-13);
}

#[test]
fn scalings_differ_by_one_diagonal_per_block() {
    let axes = |s| {
        vec![
            axis("bspline", Boundary::Mirrored, 17, 3).with_scaling(s),
            axis("bspline", Boundary::Mirrored, 9, 3).with_scaling(s),
        ]
    };
    let plain = Tensor::new(axes(Scaling::Unnormalized), Layout::NonStandard).unwrap();
    let anti = Tensor::new(axes(Scaling::Anti), Layout::NonStandard).unwrap();
    let x = numbers(17 * 9);
    let (p, a) = (plain.analyze(&x).unwrap(), anti.analyze(&x).unwrap());
    for block in p.blocks() {
        // Functions are 2^(L-i) times as tall on each axis, so coefficients are as many times smaller.
        let by = 4.0_f64.powi(3 - block.parts[0].level() as i32);
        let scaled: Vec<f64> = p.block(&block).iter().map(|v| v / by).collect();
        assert_eq!(scaled, a.block(&block));
    }
    close(&anti.synthesize(&a).unwrap(), &x, 1e-13);
}

#[test]
fn keeping_the_largest_ranks_by_function_norm_and_spares_the_smooth() {
    // Haar, unnormalised: a coarse wavelet of half the coefficient but four times the area has the same norm squared.
    let p = axis("haar", Boundary::Periodic, 8, 3);
    let tensor = Tensor::new(vec![p], Layout::Standard).unwrap();
    let mut d = Decomposition::new(&tensor, vec![0.1, 1.0, 1.2, 0.0, 1.9, 0.0, 0.0, 1.0]);
    d.keep_largest(2);
    // Norms: 8^.5, 4^.5, 2^.5: 2.83, 2.4, 2.69, 1.41.
    assert_eq!(d.values(), [0.1, 1.0, 0.0, 0.0, 1.9, 0.0, 0.0, 0.0]);
    // A tie goes to the lower index.
    let mut d = Decomposition::new(&tensor, vec![0.0, 0.0, 0.0, 0.0, 0.0, 1.0, -1.0, 1.0]);
    d.keep_largest(1);
    assert_eq!(d.values(), [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    let mut d = Decomposition::new(&tensor, vec![9.0, 0.5, -2.0, 0.1, 3.0, 0.0, 0.0, 0.2]);
    assert_eq!(d.threshold(0.5), 3);
    assert_eq!(d.values(), [9.0, 0.5, -2.0, 0.0, 3.0, 0.0, 0.0, 0.0]);
    let finest = d.blocks().into_iter().find(|b| b.parts == [Part::Detail(2)]).unwrap();
    assert_eq!(d.block_norms(&finest).max, 3.0);
}

#[test]
fn keeping_m_is_a_best_choice_for_orthonormal_bases() {
    let axes = || vec![axis("d6", Boundary::Periodic, 16, 2), axis("d6", Boundary::Periodic, 32, 2)];
    for layout in [Layout::Standard, Layout::NonStandard] {
        let tensor = Tensor::new(axes(), layout).unwrap();
        let x = numbers(16 * 32);
        let error = |m: usize| {
            let mut d = tensor.analyze(&x).unwrap();
            d.keep_largest(m);
            let y = tensor.synthesize(&d).unwrap();
            x.iter().zip(&y).map(|(a, b)| (a - b) * (a - b)).sum::<f64>()
        };
        // With equal-norm bases each further coefficient takes away the largest remaining share.
        let e: Vec<f64> = (0..40).map(error).collect();
        let gains: Vec<f64> = e.windows(2).map(|w| w[0] - w[1]).collect();
        assert!(gains.windows(2).all(|g| g[0] >= g[1] - 1e-12), "{gains:?}");
    }
}
