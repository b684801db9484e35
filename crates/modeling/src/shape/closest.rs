//! The nearest point of a curve or surface.

use super::geometry::{ParametricCurve, ParametricSurface};
use super::vector::{distance, dot, length, sub};

/// Nearest point of a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Parameter.
    pub t: f64,
    /// The point.
    pub point: [f64; 3],
    /// Its distance.
    pub distance: f64,
}

/// Nearest point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestOnSurface {
    /// Parameters s and t.
    pub at: [f64; 2],
    /// The point.
    pub point: [f64; 3],
    /// Its distance.
    pub distance: f64,
}

/// Samples a piece is searched by before Newton's method takes over.
const SEEDS: usize = 8;
const SEEDS_ON_SURFACE: usize = 4;
/// Golden sections: width down to 4e-9.
const SECTIONS: usize = 40;
const NEWTON: usize = 60;

/// The nearest point of a curve: pieces are visited by a lower bound of their distance, those that cannot win are
/// skipped; on each, the best of 9 samples and of every local minimum between them starts a guarded Newton iteration.
pub(super) fn on_curve<C: ParametricCurve + ?Sized>(curve: &C, to: [f64; 3]) -> Nearest {
    let breaks = curve.breaks();
    let mut order: Vec<(f64, usize)> = (0..breaks.len() - 1)
        .map(|i| {
            let (middle, radius) = curve.ball(i);
            (distance(middle, to) - radius, i)
        })
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut best = {
        let point = curve.jet(breaks[0]).point;
        Nearest { t: breaks[0], point, distance: distance(point, to) }
    };
    for (bound, i) in order {
        if bound >= best.distance {
            break;
        }
        let (a, b) = (breaks[i], breaks[i + 1]);
        let at = |k: usize| a + (b - a) * k as f64 / SEEDS as f64;
        let ds: Vec<f64> = (0..=SEEDS).map(|k| distance(curve.jet(at(k)).point, to)).collect();
        for k in 0..=SEEDS {
            let (low, high) = (k.saturating_sub(1), (k + 1).min(SEEDS));
            if ds[k] <= ds[low] && ds[k] <= ds[high] {
                let t = refine(curve, to, at(low), at(high), at(k));
                let point = curve.jet(t).point;
                let d = distance(point, to);
                if d < best.distance {
                    best = Nearest { t, point, distance: d };
                }
            }
        }
    }
    best
}

/// The local minimum between `a` and `b`: golden section, which needs no slopes (they vanish at mirrored ends), then
/// Newton steps on (C - to) . C' as long as they come nearer.
fn refine<C: ParametricCurve + ?Sized>(curve: &C, to: [f64; 3], a: f64, b: f64, start: f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let far = |t: f64| distance(curve.jet(t).point, to);
    let (mut low, mut high) = (a, b);
    let (mut p, mut q) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut fp, mut fq) = (far(p), far(q));
    for _ in 0..SECTIONS {
        if fp <= fq {
            (high, q, fq) = (q, p, fp);
            p = high - GOLDEN * (high - low);
            fp = far(p);
        } else {
            (low, p, fp) = (p, q, fq);
            q = low + GOLDEN * (high - low);
            fq = far(q);
        }
    }
    let (mut t, mut d) = (start, far(start));
    for x in [low, p, q, high] {
        let f = far(x);
        if f < d {
            (t, d) = (x, f);
        }
    }
    for _ in 0..NEWTON {
        let j = curve.jet(t);
        let v = sub(j.point, to);
        let next = t - dot(v, j.first) / (dot(j.first, j.first) + dot(v, j.second));
        // a step from or to not-a-number fails both comparisons
        if !(next >= a && next <= b && far(next) <= d) || next == t {
            break;
        }
        (t, d) = (next, far(next));
    }
    t
}

/// The nearest point of a surface: as [`on_curve`], with 5 x 5 samples a patch and a damped Newton iteration clamped
/// to the domain.
pub(super) fn on_surface<S: ParametricSurface + ?Sized>(surface: &S, to: [f64; 3]) -> NearestOnSurface {
    let [bs, bt] = surface.breaks();
    let mut order = Vec::with_capacity((bs.len() - 1) * (bt.len() - 1));
    for i in 0..bs.len() - 1 {
        for j in 0..bt.len() - 1 {
            let (middle, radius) = surface.ball(i, j);
            order.push((distance(middle, to) - radius, i, j));
        }
    }
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let at = |s: f64, t: f64| {
        let point = surface.jet(s, t).point;
        NearestOnSurface { at: [s, t], point, distance: distance(point, to) }
    };
    let mut best = at(bs[0], bt[0]);
    for (bound, i, j) in order {
        if bound >= best.distance {
            break;
        }
        let s = |k: usize| bs[i] + (bs[i + 1] - bs[i]) * k as f64 / SEEDS_ON_SURFACE as f64;
        let t = |k: usize| bt[j] + (bt[j + 1] - bt[j]) * k as f64 / SEEDS_ON_SURFACE as f64;
        let mut grid = [[0.0; SEEDS_ON_SURFACE + 1]; SEEDS_ON_SURFACE + 1];
        for (k, row) in grid.iter_mut().enumerate() {
            for (l, d) in row.iter_mut().enumerate() {
                *d = at(s(k), t(l)).distance;
            }
        }
        for k in 0..=SEEDS_ON_SURFACE {
            for l in 0..=SEEDS_ON_SURFACE {
                let near = |k: usize| [k.saturating_sub(1), (k + 1).min(SEEDS_ON_SURFACE)];
                let here = grid[k][l];
                if near(k).iter().all(|&a| here <= grid[a][l]) || near(l).iter().all(|&b| here <= grid[k][b]) {
                    let found = settle(surface, to, at(s(k), t(l)));
                    if found.distance < best.distance {
                        best = found;
                    }
                }
            }
        }
    }
    best
}

/// Newton's method on the squared distance, damped until it descends, clamped to the domain.
fn settle<S: ParametricSurface + ?Sized>(surface: &S, to: [f64; 3], start: NearestOnSurface) -> NearestOnSurface {
    let domain = surface.domain();
    let closed = surface.closed();
    let mut now = start;
    for _ in 0..NEWTON {
        let j = surface.jet(now.at[0], now.at[1]);
        let d = sub(j.point, to);
        let g = j.first.map(|f| dot(d, f));
        let full = [
            dot(j.first[0], j.first[0]) + dot(d, j.second[0]),
            dot(j.first[0], j.first[1]) + dot(d, j.second[1]),
            dot(j.first[1], j.first[1]) + dot(d, j.second[2]),
        ];
        let gauss = [dot(j.first[0], j.first[0]), dot(j.first[0], j.first[1]), dot(j.first[1], j.first[1])];
        let good = full[0] > 0.0 && full[0] * full[2] - full[1] * full[1] > 1e-9 * (full[0] * full[2]).abs();
        let h = if good { full } else { gauss };
        // A direction that would leave the domain is held.
        let held: [bool; 2] = std::array::from_fn(|a| {
            !closed[a] && ((now.at[a] <= domain[a][0] && g[a] > 0.0) || (now.at[a] >= domain[a][1] && g[a] < 0.0))
        });
        let det = h[0] * h[2] - h[1] * h[1];
        let step = match held {
            [true, true] => return now,
            [true, false] => [0.0, -g[1] / h[2]],
            [false, true] => [-g[0] / h[0], 0.0],
            [false, false] if det > 1e-14 * h[0] * h[2] => {
                [(h[1] * g[1] - h[2] * g[0]) / det, (h[1] * g[0] - h[0] * g[1]) / det]
            }
            [false, false] => [-g[0] / h[0], -g[1] / h[2]],
        };
        // Newton's step first; clamped at the border it may not descend, the projected gradient always does.
        let slide = [-g[0] / gauss[0], -g[1] / gauss[2]].map(|x| if x.is_finite() { 0.5 * x } else { 0.0 });
        let mut moved = false;
        'steps: for step in [step, slide] {
            let mut by = 1.0;
            while by > 1e-6 && step.iter().all(|x| x.is_finite()) {
                let at: [f64; 2] = std::array::from_fn(|a| {
                    let x = now.at[a] + by * step[a];
                    if closed[a] {
                        domain[a][0] + (x - domain[a][0]).rem_euclid(domain[a][1] - domain[a][0])
                    } else {
                        x.clamp(domain[a][0], domain[a][1])
                    }
                });
                let point = surface.jet(at[0], at[1]).point;
                let d = length(sub(point, to));
                if at != now.at && d < now.distance {
                    now = NearestOnSurface { at, point, distance: d };
                    moved = true;
                    break 'steps;
                }
                by *= 0.5;
            }
        }
        if !moved {
            break;
        }
    }
    now
}
