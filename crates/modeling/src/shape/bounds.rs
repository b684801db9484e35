//! Tight bounding boxes: extremes of each coordinate, not of the control points.

use super::curve::Curve;
use super::surface::Surface;
use super::vector::V;

/// An axis-parallel box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Least coordinates.
    pub low: [f64; 3],
    /// Largest coordinates.
    pub high: [f64; 3],
}

impl Bounds {
    fn empty() -> Bounds {
        Bounds { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] }
    }

    fn include(&mut self, p: V) {
        for c in 0..3 {
            self.low[c] = self.low[c].min(p[c]);
            self.high[c] = self.high[c].max(p[c]);
        }
    }

    /// Length of the diagonal.
    pub fn diagonal(&self) -> f64 {
        super::vector::distance(self.low, self.high)
    }
}

impl Curve {
    /// The smallest box around the curve (its graph, for one coordinate): exact, from the zeros of the derivative of
    /// each span. Linear time.
    pub fn bounds(&self) -> Bounds {
        let mut out = Bounds::empty();
        for i in 0..self.axis().spans() {
            let b = self.bezier_in_space(i);
            out.include(b[0]);
            out.include(b[3]);
            for c in 0..3 {
                let [p, q, r, s] = b.map(|p| p[c]);
                if q.min(r) >= out.low[c] && q.max(r) <= out.high[c] {
                    continue;
                }
                for u in unit_roots(q - p, r - q, s - r) {
                    let v = 1.0 - u;
                    let x = v * v * v * p + 3.0 * v * v * u * q + 3.0 * v * u * u * r + u * u * u * s;
                    out.low[c] = out.low[c].min(x);
                    out.high[c] = out.high[c].max(x);
                }
            }
        }
        out
    }
}

/// Zeros in [0, 1] of the quadratic with Bezier ordinates `a, b, c`.
fn unit_roots(a: f64, b: f64, c: f64) -> impl Iterator<Item = f64> {
    let (p, q) = (a - 2.0 * b + c, b - a);
    let root = (q * q - p * a).max(0.0).sqrt();
    // the stable pair of formulas for p u^2 + 2 q u + a = 0
    let k = -(q + root.copysign(q));
    [k / p, a / k].into_iter().filter(|u| (0.0..=1.0).contains(u))
}

/// A patch that may hold an extreme: bound on the coordinate and its Bezier ordinates.
#[derive(Clone, Copy)]
struct Part {
    bound: f64,
    b: [[f64; 4]; 4],
}

/// Most subdivisions spent on one side of the box.
const MOST_PARTS: usize = 20_000;

impl Surface {
    /// The box around the surface (its graph, for one coordinate): each side within 1e-12 of the box's diagonal outside
    /// the true extreme, by subdividing the patches that may hold it.
    pub fn bounds(&self) -> Bounds {
        let [ns, nt] = self.axes().map(|a| a.spans());
        let mut seen = Bounds::empty();
        let mut hull = Bounds::empty();
        let mut patches = Vec::with_capacity(ns * nt);
        for i in 0..ns {
            for j in 0..nt {
                let b = self.bezier_in_space(i, j);
                for p in [b[0][0], b[0][3], b[3][0], b[3][3]] {
                    seen.include(p);
                }
                b.iter().flatten().for_each(|&p| hull.include(p));
                patches.push(b);
            }
        }
        let slack = 1e-12 * hull.diagonal();
        let mut out = seen;
        for c in 0..3 {
            out.high[c] = highest(patches.iter().map(|b| b.map(|r| r.map(|p| p[c]))), seen.high[c], slack);
            out.low[c] = -highest(patches.iter().map(|b| b.map(|r| r.map(|p| -p[c]))), -seen.low[c], slack);
        }
        out
    }
}

/// The largest value of polynomial patches, at most `slack` too large.
fn highest(patches: impl Iterator<Item = [[f64; 4]; 4]>, mut best: f64, slack: f64) -> f64 {
    let bound = |b: &[[f64; 4]; 4]| b.iter().flatten().fold(f64::NEG_INFINITY, |m, &x| m.max(x));
    let mut open: Vec<Part> =
        patches.map(|b| Part { bound: bound(&b), b }).filter(|p| p.bound > best + slack).collect();
    let mut spent = 0;
    while let Some(at) = (0..open.len()).max_by(|&i, &j| open[i].bound.total_cmp(&open[j].bound)) {
        let part = open.swap_remove(at);
        if part.bound <= best + slack || spent > MOST_PARTS {
            return part.bound.max(best);
        }
        spent += 1;
        for half in halves_s(&part.b) {
            for b in halves_t(&half) {
                best = best.max(b[0][0]).max(b[0][3]).max(b[3][0]).max(b[3][3]);
                let bound = bound(&b);
                if bound > best + slack {
                    open.push(Part { bound, b });
                }
            }
        }
    }
    best
}

fn split(p: [f64; 4]) -> [[f64; 4]; 2] {
    let m = |a: f64, b: f64| 0.5 * (a + b);
    let (a, b, c) = (m(p[0], p[1]), m(p[1], p[2]), m(p[2], p[3]));
    let (d, e) = (m(a, b), m(b, c));
    let f = m(d, e);
    [[p[0], a, d, f], [f, e, c, p[3]]]
}

fn halves_t(b: &[[f64; 4]; 4]) -> [[[f64; 4]; 4]; 2] {
    let rows = b.map(split);
    [rows.map(|r| r[0]), rows.map(|r| r[1])]
}

fn halves_s(b: &[[f64; 4]; 4]) -> [[[f64; 4]; 4]; 2] {
    let transposed: [[f64; 4]; 4] = std::array::from_fn(|j| std::array::from_fn(|i| b[i][j]));
    halves_t(&transposed).map(|h| std::array::from_fn(|i| std::array::from_fn(|j| h[j][i])))
}
