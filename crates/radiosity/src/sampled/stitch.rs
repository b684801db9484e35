//! Neighbouring elements agree at their corners.
//!
//! Every gathering element is fitted by itself, so its scatter shows as a facet. At a corner the functions of all
//! elements of the side that meet there are averaged, and an element takes the bilinear function of its four corners:
//! the scatter of neighbours cancels, and the facets are gone. Neighbours that differ by more than their scatter have
//! an edge of the light between them and are left alone. What the field itself does between corners is below the
//! scatter, or the element would have been split.

use super::gather::{Gather, MOST};
use super::slots::Slots;
use ondelette_compress::{Forest, NodeId};
use ondelette_wavelet::cell::CellShape;

/// How far to either side of a corner its neighbours are looked for, in units of the element.
const BESIDE: f64 = 1e-6;

/// Differences up to this many times the noise at both elements' points are scatter; others are edges of the light.
const ALIKE: f64 = 3.0;

/// Values of a field and of half the difference of its halves, by channel.
type Values = [[f64; 3]; 2];

/// Visits every gathering element with some of its functions and their coefficients in the same field with its corners
/// averaged; and in half the difference of its halves, treated alike. Parallelograms with bases of the second order
/// only; others, and elements partly inside of something, are left as they are.
pub(super) fn stitched(
    forest: &Forest,
    (gathers, slots): (&[Gather], &Slots),
    fields: [&[[f64; 3]]; 2],
    noise: impl Fn(usize) -> f64,
    mut visit: impl FnMut(usize, &[u16], [&[[f64; 3]]; 2]),
) {
    let whole = |gather: &Gather| gather.is_whole();
    let mut of_node = vec![u32::MAX; forest.len()];
    gathers.iter().enumerate().for_each(|(k, gather)| of_node[gather.node.index()] = k as u32);
    let basis = forest.basis(CellShape::Square);
    let is_bilinear = basis.is_nested() && basis.order() == 2;
    // the gather over a point of a side, and the value of its function there
    let value = |side: u32, at: [f64; 2]| -> Option<(usize, Values)> {
        let mut id = forest.roots()[side as usize];
        let mut x = at;
        while of_node[id.index()] == u32::MAX {
            if forest.is_leaf(id) {
                return None;
            }
            let (c, local) = CellShape::Square.descend(x);
            (id, x) = (forest.child(id, c), local);
        }
        let k = of_node[id.index()] as usize;
        if !whole(&gathers[k]) {
            return None;
        }
        let mut functions = [0.0; MOST];
        basis.eval(x, &mut functions);
        let sum = |sum: [f64; 3], (c, f): (&[f64; 3], &f64)| std::array::from_fn(|i| sum[i] + c[i] * f);
        let index = gathers[k].functions(forest).iter().map(|&i| &functions[usize::from(i)]);
        let own = |field: &[[f64; 3]]| field[slots.range(k)].iter().zip(index.clone()).fold([0.0; 3], sum);
        Some((k, fields.map(own)))
    };
    let analysis = basis.analysis(2);
    for (k, gather) in gathers.iter().enumerate() {
        let cell = &forest.node(NodeId(gather.node.0)).cell;
        if cell.shape != CellShape::Square || !whole(gather) || !is_bilinear {
            visit(k, gather.functions(forest), fields.map(|field| &field[slots.range(k)]));
            continue;
        }
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|corner| {
            let inside = cell.to_root(corner.map(|x| BESIDE + x * (1.0 - 2.0 * BESIDE)));
            let (_, own) = value(cell.root, inside).unwrap_or_default();
            let (mut sum, mut count) = (own, 1.0);
            for [s, t] in [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]] {
                let at = cell.to_root([corner[0] + s * BESIDE, corner[1] + t * BESIDE]);
                if at.iter().all(|x| (0.0..=1.0).contains(x))
                    && let Some((other, v)) = value(cell.root, at)
                    && other != k
                    && (0..3).map(|c| (v[0][c] - own[0][c]).abs()).sum::<f64>() <= ALIKE * (noise(k) + noise(other))
                {
                    for (sum, v) in sum.iter_mut().flatten().zip(v.iter().flatten()) {
                        *sum += v;
                    }
                    count += 1.0;
                }
            }
            sum.map(|field| field.map(|v| v / count))
        });
        let samples = |f: usize, c: usize| -> Vec<f64> {
            let bilinear = |x: &[f64; 2]| {
                let [s, t] = *x;
                (1.0 - s) * (1.0 - t) * corners[0][f][c]
                    + s * (1.0 - t) * corners[1][f][c]
                    + (1.0 - s) * t * corners[2][f][c]
                    + s * t * corners[3][f][c]
            };
            analysis.points.iter().map(bilinear).collect()
        };
        let mut out = [[[0.0; 3]; MOST]; 2];
        for (f, out) in out.iter_mut().enumerate() {
            for c in 0..3 {
                let own = analysis.coefficients(&samples(f, c)).into_iter().zip(&mut *out);
                own.for_each(|(v, out)| out[c] = v);
            }
        }
        visit(k, basis.truncated(basis.order()), [&out[0][..basis.len()], &out[1][..basis.len()]]);
    }
}
