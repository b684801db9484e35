//! The full matrix, its standard decomposition and the passes one root at a time, against the operator on links.

use ondelette_compress::kernel::PointKernel;
use ondelette_compress::*;
use ondelette_wavelet::cell::{CellFamily, CellShape};

/// Two roots that couple with each other, smooth but for a peak; nothing couples with itself.
fn kernel() -> PointKernel<impl Fn(u32, [f64; 2], u32, [f64; 2]) -> f64 + Sync> {
    let function = |r: u32, x: [f64; 2], s: u32, y: [f64; 2]| {
        let d = (x[0] - y[0]).powi(2) + (x[1] - y[1]).powi(2);
        if r == s { 0.0 } else { 1.0 / (0.3 + d) }
    };
    PointKernel { function, measures: vec![2.0, 0.5], points: 4 }
}

/// The full matrix over two squares (or triangles) divided unequally often.
fn full(shape: CellShape, order: usize, depths: [u32; 2]) -> (Forest, Links) {
    let mut forest = Forest::new(CellFamily::Multiwavelet, order).unwrap();
    forest.add_root(shape, 2.0);
    forest.add_root(shape, 0.5);
    let mut n = 0;
    while let Some(node) = forest.nodes().get(n).copied() {
        if node.cell.depth < depths[node.cell.root as usize] {
            forest.split(NodeId(n as u32));
        }
        n += 1;
    }
    let mut matrix = Assembly::of(&forest, 0, 0);
    let between =
        |r: NodeId, s: NodeId| (forest.node(r).cell.root != forest.node(s).cell.root).then_some(CoupleSettings::EXACT);
    while !matrix.step(&kernel(), &forest, between, 10).0 {}
    let links = matrix.into_links(&forest);
    (forest, links)
}

fn values(forest: &Forest) -> Vec<[f64; 2]> {
    let stride = forest.stride();
    let mut values = vec![[0.0; 2]; forest.len() * stride];
    for (n, node) in forest.nodes().iter().enumerate().filter(|(_, node)| node.first_child == 0) {
        for j in 0..forest.basis(node.cell.shape).len() {
            values[n * stride + j] = [((n * 13 + j * 7) % 11) as f64 / 5.0 - 1.0, (n as f64 + j as f64).cos()];
        }
    }
    values
}

fn applied(forest: &Forest, links: &Links) -> Vec<[f64; 2]> {
    let mut values = values(forest);
    let mut result = vec![[0.0; 2]; values.len()];
    transport::apply(forest, links, &mut values, &mut result);
    result
}

fn largest(a: &[[f64; 2]]) -> f64 {
    a.iter().flatten().fold(0.0, |m: f64, v| m.max(v.abs()))
}

fn apart(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()))
}

#[test]
fn with_no_budget_the_standard_decomposition_is_the_full_matrix() {
    for (shape, order) in [(CellShape::Square, 1), (CellShape::Square, 2), (CellShape::Triangle, 2)] {
        let (forest, links) = full(shape, order, [2, 1]);
        let want = applied(&forest, &links);
        let (standard, terms) = Standard::of(&forest, &links, 0.0).unwrap();
        let mut got = vec![[0.0; 2]; want.len()];
        standard.apply(&forest, &values(&forest), &mut got);
        assert!(apart(&got, &want) < 1e-12 * largest(&want), "{shape:?} {order}");
        let rows = (forest.leaves() * forest.basis(shape).len()) as u64;
        assert_eq!(terms.full, rows * rows);
    }
}

#[test]
fn what_is_dropped_changes_the_answer_by_no_more_than_the_budget() {
    let (forest, links) = full(CellShape::Square, 2, [3, 2]);
    let want = applied(&forest, &links);
    let stride = forest.stride();
    let norm = |v: &[[f64; 2]]| -> f64 {
        let square = |n: usize| v[n * stride..(n + 1) * stride].iter().map(|v| v[0] * v[0]).sum::<f64>();
        forest.nodes().iter().enumerate().map(|(n, node)| node.measure * square(n)).sum::<f64>().sqrt()
    };
    let mut last = u64::MAX;
    for budget in [1e-6, 1e-4, 1e-2] {
        let (standard, terms) = Standard::of(&forest, &links, budget).unwrap();
        let mut got = vec![[0.0; 2]; want.len()];
        standard.apply(&forest, &values(&forest), &mut got);
        let change: Vec<[f64; 2]> = got.iter().zip(&want).map(|(g, w)| [g[0] - w[0], g[1] - w[1]]).collect();
        assert!(norm(&change) <= budget * norm(&values(&forest)), "{budget}");
        assert!(terms.standard < last, "{budget}: {terms:?}");
        last = terms.standard;
    }
    // a smooth kernel: far fewer terms than the matrix has, whichever way it is decomposed
    let (_, terms) = Standard::of(&forest, &links, 1e-2).unwrap();
    assert!(20 * terms.standard < terms.full && 20 * terms.nonstandard < terms.full, "{terms:?}");
}

#[test]
fn one_root_at_a_time_is_the_same_operator() {
    let (forest, links) = full(CellShape::Triangle, 2, [1, 2]);
    let trees = Trees::of(&forest, &links);
    let want = applied(&forest, &links);
    let mut pulled = values(&forest);
    transport::pull(&forest, &mut pulled);
    let mut got = vec![[0.0; 2]; want.len()];
    (0..2).for_each(|root| trees.receive(&forest, &links, root, &pulled, &mut got));
    assert!(apart(&got, &want) == 0.0);
    // and leaf by leaf, shot from all nodes above it
    let mut sum = vec![[0.0; 2]; want.len()];
    let stride = forest.stride();
    for n in (0..forest.len()).filter(|&n| forest.is_leaf(NodeId(n as u32))) {
        let mut alone = vec![[0.0; 2]; want.len()];
        alone[n * stride..(n + 1) * stride].copy_from_slice(&values(&forest)[n * stride..(n + 1) * stride]);
        transport::pull(&forest, &mut alone);
        let mut from = vec![NodeId(n as u32)];
        while forest.node(from[from.len() - 1]).parent != from[from.len() - 1] {
            from.push(forest.node(from[from.len() - 1]).parent);
        }
        let reached = trees.shoot(&forest, &links, &from, &alone, &mut sum);
        assert!(!reached.is_empty() && reached.iter().all(|&id| forest.is_leaf(id)));
    }
    assert!(apart(&sum, &want) < 1e-13 * largest(&want));
}
