//! A receiver and a shooter element: moments in closed form, masks by stratified rays keyed by the pair.

use super::piece::pieces;
use super::{Element, LightKernel, MOST_FUNCTIONS, density, sequence};
use crate::form_factor::point_to_polygon;
use glam::DVec3;
use ondelette_compress::{Cell, Detail, Masked, NodeId, Pair};
use ondelette_numerics::seed;
use ondelette_wavelet::cell::CellBasis;
use std::sync::atomic::Ordering;

/// A receiver and a shooter element that face each other.
pub struct LightPair<'a> {
    pub(super) kernel: &'a LightKernel,
    pub(super) receiver: Element,
    pub(super) shooter: Element,
    /// The shooter's cell, and its node in the present solution if that has detail below it.
    pub(super) cell: Cell,
    pub(super) node: Option<NodeId>,
    pub(super) sides: [usize; 2],
    pub(super) patches: [u32; 2],
    pub(super) masked: bool,
}

impl Pair for LightPair<'_> {
    fn sample(&self, x: [f64; 2], y: [f64; 2]) -> f64 {
        density(self.receiver.point(x), self.receiver.normal, self.shooter.point(y), self.shooter.normal)
    }

    fn moments(&self, x: [f64; 2], basis: &CellBasis, moments: &mut [f64]) {
        self.kernel.moments_at(self.receiver.point(x), self.receiver.normal, &self.shooter, basis, moments);
    }

    fn receiver_points(&self, order: usize) -> usize {
        let (a, ra) = self.receiver.ball();
        let (b, rb) = self.shooter.ball();
        let gap = (a - b).length() - ra - rb;
        if gap < 0.25 * ra {
            (order + 2).max(4)
        } else if gap < ra {
            order + 1
        } else {
            order.max(2)
        }
    }

    fn largest(&self) -> f64 {
        // at the corners, drawn in a little: a corner may touch the shooter
        let centre = self.receiver.ball().0;
        let n = self.receiver.normal;
        let corners = self.receiver.polygon();
        let at = |c: &DVec3| {
            let x = *c + (centre - *c) * 0.02;
            let in_front = self.shooter.normal.dot(x - self.shooter.origin) > 0.0;
            if in_front { point_to_polygon(x, n, &self.shooter.polygon().clipped(x, n)) } else { 0.0 }
        };
        corners.corners().iter().map(at).fold(0.0, f64::max)
    }

    fn is_masked(&self) -> bool {
        self.masked
    }

    fn mask(&self, x: [f64; 2], basis: &CellBasis, moments: &mut [f64], samples: usize, key: u64) -> Masked {
        let from = self.receiver.point(x);
        let mut seen = Seen::default();
        self.cast(from, samples, key, basis, &mut seen);
        let mask = if seen.whole > 0.0 { seen.open / seen.whole } else { 0.0 };
        // exact moments times the mean mask, plus the sampled covariance of mask and basis function
        let unmasked = if basis.is_nested() { moments[0] } else { moments[..basis.len()].iter().sum() };
        for (j, m) in moments.iter_mut().enumerate().take(basis.len()) {
            *m *= mask;
            if mask > 0.0 && mask < 1.0 {
                *m += unmasked * (seen.open_moments[j] - mask * seen.whole_moments[j]) / seen.whole;
            }
        }
        let scale = if seen.whole > 0.0 { unmasked / seen.whole } else { 0.0 };
        let detail = Detail { actual: scale * seen.actual, projected: scale * seen.projected };
        Masked { mean: mask, detail }
    }

    fn detail(&self, x: [f64; 2], basis: &CellBasis) -> Detail {
        let mut detail = Detail::default();
        let (Some(node), Some(present)) = (self.node, &self.kernel.present) else { return detail };
        let (from, n) = (self.receiver.point(x), self.receiver.normal);
        if self.shooter.normal.dot(from - self.shooter.origin) <= 0.0 {
            return detail;
        }
        let rule = basis.analysis(basis.order() + 1);
        let weight = 1.0 / rule.points.len() as f64;
        pieces(from, n, &self.shooter, &mut |piece| {
            let (mut whole, mut actual, mut projected) = (0.0, 0.0, 0.0);
            for y in &rule.points {
                let y = piece.to_source(*y);
                let k = weight * density(from, n, self.shooter.point(y), self.shooter.normal);
                whole += k;
                actual += k * present.at(self.cell.root, self.cell.to_root(y));
                projected += k * present.value(node, y, basis.order());
            }
            if whole > 0.0 {
                detail.actual += piece.exact / whole * actual;
                detail.projected += piece.exact / whole * projected;
            }
        });
        detail
    }
}

/// Kernel-weighted sums over rays: of those that arrive, and of all; plain and times each basis function.
struct Seen {
    open: f64,
    whole: f64,
    open_moments: [f64; MOST_FUNCTIONS],
    whole_moments: [f64; MOST_FUNCTIONS],
    /// Of what arrives, times the present radiosity, and times its projection.
    actual: f64,
    projected: f64,
}

impl Default for Seen {
    fn default() -> Self {
        Seen {
            open: 0.0,
            whole: 0.0,
            open_moments: [0.0; MOST_FUNCTIONS],
            whole_moments: [0.0; MOST_FUNCTIONS],
            actual: 0.0,
            projected: 0.0,
        }
    }
}

impl LightPair<'_> {
    /// Casts about `samples` rays, shared among the pieces of the source by their form factors: where the kernel is
    /// concentrated, near a common edge say, a plain sample of the source would miss most of what arrives.
    fn cast(&self, x: DVec3, samples: usize, key: u64, basis: &CellBasis, seen: &mut Seen) {
        let n = self.receiver.normal;
        let covered = self.kernel.is_covered(self.sides[0], x);
        let mut parts = Vec::new();
        pieces(x, n, &self.shooter, &mut |piece| parts.push(piece));
        let whole: f64 = parts.iter().map(|p| p.exact).sum();
        let mut rays = 0;
        let mut values = [0.0; MOST_FUNCTIONS];
        let mut used = 0.0;
        for (k, piece) in parts.iter().enumerate() {
            // rounded so that the counts add up to about `samples`, at least one a piece
            let before = (used / whole * samples as f64).round() as usize;
            used += piece.exact;
            let count = ((used / whole * samples as f64).round() as usize).saturating_sub(before).max(1);
            let mut sum = Seen::default();
            for y in sequence(seed::combine(key, k as u64), self.shooter.shape, 0..count) {
                let y = piece.to_source(y);
                let point = self.shooter.point(y);
                let weight = density(x, n, point, self.shooter.normal);
                if weight <= 0.0 {
                    continue;
                }
                rays += 1;
                let open = !covered
                    && !self.kernel.is_covered(self.sides[1], point)
                    && !self.kernel.occluders.blocked(x, point, self.patches);
                basis.eval(y, &mut values);
                sum.add(weight, open, &values[..basis.len()]);
                if open && let (Some(node), Some(present)) = (self.node, &self.kernel.present) {
                    sum.actual += weight * present.at(self.cell.root, self.cell.to_root(y));
                    sum.projected += weight * present.value(node, y, basis.order());
                }
            }
            if sum.whole > 0.0 {
                seen.merge(&sum, piece.exact / sum.whole, basis.len());
            }
        }
        self.kernel.rays.fetch_add(rays, Ordering::Relaxed);
    }
}

impl Seen {
    fn add(&mut self, weight: f64, open: bool, values: &[f64]) {
        let through = if open { weight } else { 0.0 };
        self.whole += weight;
        self.open += through;
        for (j, v) in values.iter().enumerate() {
            self.whole_moments[j] += weight * v;
            self.open_moments[j] += through * v;
        }
    }

    fn merge(&mut self, part: &Seen, factor: f64, functions: usize) {
        self.whole += factor * part.whole;
        self.open += factor * part.open;
        self.actual += factor * part.actual;
        self.projected += factor * part.projected;
        for j in 0..functions {
            self.whole_moments[j] += factor * part.whole_moments[j];
            self.open_moments[j] += factor * part.open_moments[j];
        }
    }
}
