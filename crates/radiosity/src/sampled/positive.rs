//! Light is never negative: where scatter or the edge of a shadow tilts an element's function below zero, its slopes
//! are lowered until its darkest corner is dark. The mean stays as it is.

use ondelette_compress::Forest;
use ondelette_compress::forest::Node;
use ondelette_wavelet::cell::CellShape;

/// Values of the functions of second order at the corners of a square and a triangle.
fn at_corners(forest: &Forest) -> [Vec<[f64; 36]>; 2] {
    [CellShape::Square, CellShape::Triangle].map(|shape| {
        let basis = forest.basis(shape);
        let at = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        let used = if shape == CellShape::Square { 4 } else { 3 };
        let value = |x: &[f64; 2]| {
            let mut values = [0.0; 36];
            basis.eval(*x, &mut values);
            values
        };
        at[..used].iter().map(value).collect()
    })
}

/// The least of a channel at the corners.
fn darkest(own: &[[f64; 3]], corners: &[[f64; 36]], c: usize) -> f64 {
    let value = |functions: &[f64; 36]| own.iter().zip(functions).map(|(k, f)| k[c] * f).sum::<f64>();
    corners.iter().map(value).fold(f64::INFINITY, f64::min)
}

/// Lowers slopes of coefficients at the leaves. Bases of the second order only; others are left as they are. Cost
/// linear in the nodes.
pub(super) fn keep_positive(forest: &Forest, irradiance: &mut [[f64; 3]]) {
    let stride = forest.stride();
    let corners = at_corners(forest);
    for (n, node) in forest.nodes().iter().enumerate().filter(|(_, node)| node.first_child == 0) {
        let basis = forest.basis(node.cell.shape);
        if !basis.is_nested() || basis.order() != 2 {
            continue;
        }
        let own = &mut irradiance[n * stride..n * stride + basis.len()];
        let corners = &corners[usize::from(node.cell.shape == CellShape::Triangle)];
        for c in 0..3 {
            let (mean, darkest) = (own[0][c], darkest(own, corners, c));
            if darkest < 0.0 && mean > 0.0 {
                let scale = mean / (mean - darkest);
                own[1..].iter_mut().for_each(|k| k[c] *= scale);
            }
        }
    }
}

/// A corner darker than this share of the mean may have been raised to 0.
const DARK: f64 = 1e-5;

/// Whether [`keep_positive`] may have lowered the slopes of leaves, by channel; nothing of other nodes. Cost linear in
/// the nodes.
pub(super) fn may_be_lowered(forest: &Forest, irradiance: &[[f64; 3]]) -> Vec<[bool; 3]> {
    let corners = at_corners(forest);
    let of = |(n, node): (usize, &Node)| {
        let basis = forest.basis(node.cell.shape);
        if node.first_child != 0 || !basis.is_nested() || basis.order() != 2 {
            return [false; 3];
        }
        let own = &irradiance[n * forest.stride()..][..basis.len()];
        let corners = &corners[usize::from(node.cell.shape == CellShape::Triangle)];
        std::array::from_fn(|c| darkest(own, corners, c) < DARK * own[0][c])
    };
    forest.nodes().iter().enumerate().map(of).collect()
}
