//! Light is never negative: where scatter or the edge of a shadow tilts an element's function below zero, its slopes
//! are lowered until its darkest corner is dark. The mean stays as it is.

use ondelette_compress::Forest;
use ondelette_wavelet::cell::CellShape;

/// Lowers slopes of coefficients at the leaves. Bases of the second order only; others are left as they are. Cost
/// linear in the nodes.
pub(super) fn keep_positive(forest: &Forest, irradiance: &mut [[f64; 3]]) {
    let stride = forest.stride();
    let corners = [CellShape::Square, CellShape::Triangle].map(|shape| {
        let basis = forest.basis(shape);
        let at = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        let used = if shape == CellShape::Square { 4 } else { 3 };
        at[..used]
            .iter()
            .map(|x| {
                let mut values = [0.0; 36];
                basis.eval(*x, &mut values);
                values
            })
            .collect::<Vec<_>>()
    });
    for (n, node) in forest.nodes().iter().enumerate().filter(|(_, node)| node.first_child == 0) {
        let basis = forest.basis(node.cell.shape);
        if !basis.is_nested() || basis.order() != 2 {
            continue;
        }
        let own = &mut irradiance[n * stride..n * stride + basis.len()];
        let corners = &corners[usize::from(node.cell.shape == CellShape::Triangle)];
        for c in 0..3 {
            let mean = own[0][c];
            let value = |functions: &[f64; 36]| own.iter().zip(functions).map(|(k, f)| k[c] * f).sum::<f64>();
            let darkest = corners.iter().map(value).fold(f64::INFINITY, f64::min);
            if darkest < 0.0 && mean > 0.0 {
                let scale = mean / (mean - darkest);
                own[1..].iter_mut().for_each(|k| k[c] *= scale);
            }
        }
    }
}
