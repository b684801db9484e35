//! A source split towards a receiver point: the graded quadrature of near pairs.

use super::{Element, MOST_FUNCTIONS, density};
use crate::form_factor::point_to_polygon;
use glam::DVec3;
use ondelette_wavelet::cell::CellBasis;

/// Pieces closer than this many radii are split.
const NEAR: f64 = 1.5;
/// Deepest grading: pieces of 1/1024 of the source.
const DEEPEST: u32 = 10;

/// A part of a source, offset + scale * local, with its form factor from a point in closed form.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    offset: [f64; 2],
    scale: f64,
    pub(super) exact: f64,
}

/// Splits a source towards the point x until every piece is small against its distance, and calls `each` on those that
/// are seen, in a fixed order.
pub(super) fn pieces(x: DVec3, n: DVec3, shooter: &Element, each: &mut dyn FnMut(Piece)) {
    descend(x, n, shooter, [0.0; 2], 1.0, 0, each);
}

fn descend(
    x: DVec3,
    n: DVec3,
    shooter: &Element,
    offset: [f64; 2],
    scale: f64,
    depth: u32,
    each: &mut dyn FnMut(Piece),
) {
    let element = shooter.part(offset, scale);
    let (centre, radius) = element.ball();
    if n.dot(centre - x) < -radius {
        return;
    }
    if depth < DEEPEST && (centre - x).length() < (1.0 + NEAR) * radius {
        for c in 0..4 {
            let (o, sign) = element.shape.child(c);
            let child = [offset[0] + scale * o[0], offset[1] + scale * o[1]];
            descend(x, n, shooter, child, 0.5 * sign * scale, depth + 1, each);
        }
        return;
    }
    let exact = point_to_polygon(x, n, &element.polygon().clipped(x, n));
    if exact > 0.0 {
        each(Piece { offset, scale, exact });
    }
}

impl Piece {
    /// The source's local coordinates of a point of the piece.
    pub(super) fn to_source(self, y: [f64; 2]) -> [f64; 2] {
        [self.offset[0] + self.scale * y[0], self.offset[1] + self.scale * y[1]]
    }

    /// Adds the moments 1.. of the piece: its closed form times the kernel-weighted means of the basis functions.
    pub(super) fn add_moments(&self, x: DVec3, n: DVec3, shooter: &Element, basis: &CellBasis, moments: &mut [f64]) {
        let rule = basis.analysis(basis.order() + 1);
        let mut values = [0.0; MOST_FUNCTIONS];
        let mut sums = [0.0; MOST_FUNCTIONS];
        let mut whole = 0.0;
        // the first row of a nested basis's analysis is the quadrature rule itself
        for (y, w) in rule.points.iter().zip(&rule.matrix) {
            let y = self.to_source(*y);
            let k = w * density(x, n, shooter.point(y), shooter.normal);
            if k > 0.0 {
                whole += k;
                basis.eval(y, &mut values);
                for j in 1..basis.len() {
                    sums[j] += k * values[j];
                }
            }
        }
        if whole > 0.0 {
            for j in 1..basis.len() {
                moments[j] += self.exact * sums[j] / whole;
            }
        } else {
            basis.eval(self.to_source([1.0 / 3.0; 2]), &mut values);
            for j in 1..basis.len() {
                moments[j] += self.exact * values[j];
            }
        }
    }
}
