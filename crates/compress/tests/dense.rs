//! The compressed operator against the dense matrix, on kernels that have nothing to do with any application.

use ondelette_compress::kernel::PointKernel;
use ondelette_compress::*;
use ondelette_wavelet::cell::{CellFamily, CellShape};

/// Kernels on [0, 1]: smooth, singular on the diagonal (softened at the finest scale), singular at one point.
fn smooth(x: f64, y: f64) -> f64 {
    1.0 / (1.5 + x - y)
}

const FULL: CoupleSettings = CoupleSettings::EXACT;

/// Links between the leaves of uniform trees of the given depth: every pair coupled at the finest level.
fn uniform<F: Fn(u32, [f64; 2], u32, [f64; 2]) -> f64 + Sync>(
    forest: &mut Forest,
    kernel: &PointKernel<F>,
    depth: u32,
) -> Links {
    let mut links = Links::new();
    let root = forest.roots()[0];
    let mut level = vec![root];
    for _ in 0..depth {
        level = level
            .iter()
            .flat_map(|&n| {
                let first = forest.split(n);
                (0..forest.node(n).cell.shape.arity() as u32).map(move |c| NodeId(first.0 + c))
            })
            .collect();
    }
    let tasks = level.iter().flat_map(|&r| level.iter().map(move |&s| Task::between(r, s, FULL))).collect();
    let mut batch = Refinement::linking(tasks);
    while !batch.step(kernel, forest, 1000).0 {}
    batch.commit(forest, &mut links);
    links
}

/// The same operator with links at several levels: the root link refined `times` times over, shooter and receiver in
/// turn.
fn layered<F: Fn(u32, [f64; 2], u32, [f64; 2]) -> f64 + Sync>(
    forest: &mut Forest,
    kernel: &PointKernel<F>,
    accept: impl Fn(&Forest, &Link) -> bool,
    deepest: u32,
) -> Links {
    let mut links = Links::new();
    let root = forest.roots()[0];
    let mut batch = Refinement::linking(vec![Task::between(root, root, FULL)]);
    loop {
        while !batch.step(kernel, forest, 640).0 {}
        batch.commit(forest, &mut links);
        let chosen: Vec<(u32, Change)> = links
            .as_slice()
            .iter()
            .enumerate()
            .filter(|(_, l)| !accept(forest, l))
            .filter_map(|(k, l)| {
                let depth = |id| forest.node(id).cell.depth;
                let end = if depth(l.receiver) <= depth(l.shooter) { End::Receiver } else { End::Shooter };
                let split = if end == End::Receiver { l.receiver } else { l.shooter };
                (depth(split) < deepest).then_some((k as u32, Change::Split(end)))
            })
            .collect();
        if chosen.is_empty() {
            return links;
        }
        batch = Refinement::changing(forest, &links, &chosen, |_| FULL);
    }
}

/// Dense application: the leaves' functions integrated one by one against the kernel.
fn apply_leaves(forest: &Forest, links: &Links, b: &[[f64; 1]]) -> Vec<f64> {
    let mut values = b.to_vec();
    let mut result = vec![[0.0]; b.len()];
    transport::apply(forest, links, &mut values, &mut result);
    result.iter().map(|r| r[0]).collect()
}

fn leaf_values(forest: &Forest) -> Vec<[f64; 1]> {
    let stride = forest.stride();
    let mut b = vec![[0.0]; forest.len() * stride];
    for (n, node) in forest.nodes().iter().enumerate() {
        if node.first_child == 0 {
            for j in 0..forest.basis(node.cell.shape).len() {
                b[n * stride + j][0] = ((n * 13 + j * 7) % 11) as f64 / 5.0 - 1.0;
            }
        }
    }
    b
}

#[test]
fn a_polynomial_kernel_gives_the_same_answer_whatever_level_carries_the_links() {
    // of degree < M in both variables one root link is exact: it must equal the dense finest matrix to rounding
    for (shape, family, order) in [
        (CellShape::Interval, CellFamily::Multiwavelet, 3),
        (CellShape::Square, CellFamily::Multiwavelet, 2),
        (CellShape::Triangle, CellFamily::Multiwavelet, 3),
        (CellShape::Interval, CellFamily::Flatlet, 3),
        (CellShape::Square, CellFamily::Flatlet, 2),
    ] {
        let polynomial = |_: u32, x: [f64; 2], _: u32, y: [f64; 2]| {
            let second = if shape == CellShape::Interval { 0.0 } else { 0.25 * x[1] - 0.5 * y[1] };
            (1.0 + x[0] - 0.3 * y[0] + second) * if order == 3 { 1.0 + 0.1 * x[0] - 0.2 * y[0] } else { 1.0 }
        };
        let kernel = PointKernel { function: polynomial, measures: vec![2.0], points: 5 };
        let depth = if shape == CellShape::Interval { 4 } else { 2 };
        let mut fine = Forest::new(family, order).unwrap();
        fine.add_root(shape, 2.0);
        let dense = uniform(&mut fine, &kernel, depth);
        let b = leaf_values(&fine);
        let want = apply_leaves(&fine, &dense, &b);
        let scale = want.iter().fold(0.0, |m: f64, v| m.max(v.abs()));

        // one link at the root, over the same leaves
        let mut batch = Refinement::linking(vec![Task::between(fine.roots()[0], fine.roots()[0], FULL)]);
        while !batch.step(&kernel, &fine, 80).0 {}
        let mut coarse = Links::new();
        batch.commit(&mut fine, &mut coarse);
        let got = apply_leaves(&fine, &coarse, &b);
        for (g, w) in got.iter().zip(&want) {
            assert!((g - w).abs() <= 1e-12 * scale, "{shape:?} {family:?} {order}: {g} instead of {w}");
        }
    }
}

#[test]
fn full_refinement_equals_the_dense_matrix_to_rounding() {
    for (family, order) in [(CellFamily::Multiwavelet, 1), (CellFamily::Multiwavelet, 2), (CellFamily::Flatlet, 2)] {
        let function = |_: u32, x: [f64; 2], _: u32, y: [f64; 2]| smooth(x[0], y[0]);
        let kernel = PointKernel { function, measures: vec![1.0], points: 4 };
        let mut a = Forest::new(family, order).unwrap();
        a.add_root(CellShape::Interval, 1.0);
        let dense = uniform(&mut a, &kernel, 4);
        let mut b = Forest::new(family, order).unwrap();
        b.add_root(CellShape::Interval, 1.0);
        let refined = layered(&mut b, &kernel, |_, _| false, 4);
        assert_eq!(dense.len(), 256);
        assert_eq!(refined.len(), 256);
        // the trees were split in different orders: compare leaf by leaf, by position
        let order_of = |f: &Forest| {
            let mut leaves: Vec<usize> = (0..f.len()).filter(|&n| f.is_leaf(NodeId(n as u32))).collect();
            leaves.sort_by(|&p, &q| f.nodes()[p].cell.origin[0].total_cmp(&f.nodes()[q].cell.origin[0]));
            leaves
        };
        let stride = a.stride();
        let fill = |f: &Forest| {
            let mut v = vec![[0.0]; f.len() * stride];
            for (i, &n) in order_of(f).iter().enumerate() {
                for j in 0..stride {
                    v[n * stride + j][0] = (i as f64 * 0.37 + j as f64).sin();
                }
            }
            v
        };
        let (x, y) = (apply_leaves(&a, &dense, &fill(&a)), apply_leaves(&b, &refined, &fill(&b)));
        for (p, q) in order_of(&a).into_iter().zip(order_of(&b)) {
            for j in 0..stride {
                assert!((x[p * stride + j] - y[q * stride + j]).abs() < 1e-14, "{family:?} {order}");
            }
        }
    }
}

#[test]
fn compression_keeps_the_answer_within_the_tolerance_of_its_links() {
    let function = |_: u32, x: [f64; 2], _: u32, y: [f64; 2]| smooth(x[0], y[0]);
    let kernel = PointKernel { function, measures: vec![1.0], points: 4 };
    let mut a = Forest::new(CellFamily::Multiwavelet, 2).unwrap();
    a.add_root(CellShape::Interval, 1.0);
    let compressed = layered(&mut a, &kernel, |_, l| l.residual.iter().all(|r| r.abs() < 1e-4 * l.strength), 8);
    // the error of K applied to the constant 1: the integral of 1 / (1.5 + x - y) is ln((1.5 + x) / (0.5 + x))
    let stride = a.stride();
    let mut ones = vec![[0.0]; a.len() * stride];
    for (n, node) in a.nodes().iter().enumerate() {
        ones[n * stride][0] = if node.first_child == 0 { 1.0 } else { 0.0 };
    }
    let got = apply_leaves(&a, &compressed, &ones);
    let mut values = [0.0; 2];
    for i in 0..50 {
        let x = [(i as f64 + 0.5) / 50.0, 0.0];
        let (leaf, local) = a.locate(0, x);
        a.basis_of(leaf).eval(local, &mut values);
        let e = values[0] * got[leaf.index() * stride] + values[1] * got[leaf.index() * stride + 1];
        let want = ((1.5 + x[0]) / (0.5 + x[0])).ln();
        assert!((e / want - 1.0).abs() < 1e-3, "{e} {want}");
    }
    // the dense matrix over these leaves would need 65,536
    assert!(compressed.len() < 1000, "{} links for a smooth kernel", compressed.len());
}

/// Links that a depth-limited refinement leaves when pairs closer than their size are split.
fn links_at(depth: u32, singular_at: impl Fn(f64, f64) -> f64 + Sync) -> usize {
    // the softening is far below the finest scale, so that the link count is that of the singular kernel
    let function = |_: u32, x: [f64; 2], _: u32, y: [f64; 2]| 1.0 / (1e-6 + singular_at(x[0], y[0]));
    let kernel = PointKernel { function, measures: vec![1.0], points: 3 };
    let mut forest = Forest::new(CellFamily::Multiwavelet, 2).unwrap();
    forest.add_root(CellShape::Interval, 1.0);
    let fits = |_: &Forest, l: &Link| l.residual.iter().all(|r| f64::from(r.abs()) < 0.02 * f64::from(l.strength));
    layered(&mut forest, &kernel, fits, depth).len()
}

#[test]
fn links_grow_linearly_with_the_finest_elements_for_a_singular_diagonal() {
    let count: Vec<usize> = (4..=9).map(|depth| links_at(depth, |x, y| (x - y).abs())).collect();
    for pair in count.windows(2) {
        let ratio = pair[1] as f64 / pair[0] as f64;
        assert!((1.6..2.4).contains(&ratio), "links {count:?}: n doubles, links should double");
    }
}

#[test]
fn links_grow_linearly_with_the_level_for_a_point_singularity() {
    let count: Vec<usize> = (4..=12).map(|depth| links_at(depth, |x, y| x + y)).collect();
    let steps: Vec<isize> = count.windows(2).map(|w| w[1] as isize - w[0] as isize).collect();
    let (least, most) = (steps.iter().min().unwrap(), steps.iter().max().unwrap());
    assert!(*least > 0 && most - least <= 4, "links {count:?} should grow by the same number a level");
}

#[test]
fn a_batch_that_is_given_up_changes_nothing() {
    let function = |_: u32, x: [f64; 2], _: u32, y: [f64; 2]| smooth(x[0], y[0]);
    let kernel = PointKernel { function, measures: vec![1.0], points: 4 };
    let mut forest = Forest::new(CellFamily::Multiwavelet, 2).unwrap();
    let root = forest.add_root(CellShape::Interval, 1.0);
    let mut links = Links::new();
    let mut first = Refinement::linking(vec![Task::between(root, root, FULL)]);
    while !first.step(&kernel, &forest, 80).0 {}
    first.commit(&mut forest, &mut links);
    let mut second = Refinement::changing(&forest, &links, &[(0, Change::Split(End::Receiver))], |_| FULL);
    second.step(&kernel, &forest, 1);
    drop(second);
    assert_eq!((forest.len(), links.len()), (1, 1));
}

#[test]
fn stored_links_with_indices_out_of_range_are_refused() {
    let mut forest = Forest::new(CellFamily::Multiwavelet, 1).unwrap();
    let root = forest.add_root(CellShape::Square, 1.0);
    let good = Link {
        receiver: root,
        shooter: root,
        orders: [1, 1],
        masked: false,
        block: 0,
        residual: [0.0; 4],
        strength: 1.0,
        roughness: 0.0,
        spread: 0.0,
        unseen: 0.0,
    };
    assert!(Links::restore(&forest, vec![good], vec![1.0]).is_ok());
    for bad in [
        Link { shooter: NodeId(9), ..good },
        Link { orders: [2, 1], ..good },
        Link { orders: [0, 1], ..good },
        Link { block: 1, ..good },
        Link { block: u64::MAX, ..good },
    ] {
        assert!(Links::restore(&forest, vec![bad], vec![1.0]).is_err());
    }
    assert!(Links::restore(&forest, vec![good, good], vec![1.0]).is_err());
}
