//! Integrals and norms of piecewise functions on the sides, and what reflection makes of them.

use super::Linked;
use crate::rgb::Rgb;
use ondelette_compress::transport;

impl Linked {
    /// One reflection: what `values` at the leaves, as radiosity, bring to the leaves of `result`. Inner nodes of
    /// `values` are overwritten by their pulls.
    pub(super) fn transport(&self, values: &mut [[f64; 3]], result: &mut [[f64; 3]]) {
        match &self.standard {
            Some(standard) => standard.apply(&self.forest, values, result),
            None => transport::apply(&self.forest, &self.links, values, result),
        }
        self.receive_openly(values, result);
    }

    /// Exitance (if asked for) plus reflectance times irradiance at the leaves.
    pub(super) fn radiosity(&self, irradiance: &[[f64; 3]], with_exitance: bool) -> Vec<[f64; 3]> {
        let stride = self.forest.stride();
        let mut values = vec![[0.0; 3]; irradiance.len()];
        for (n, slots) in values.chunks_mut(stride).enumerate() {
            self.reflect(n, &irradiance[n * stride..(n + 1) * stride], with_exitance, slots);
        }
        values
    }

    /// The same for the slots of one node, if it is a leaf.
    pub(super) fn reflect(&self, n: usize, irradiance: &[[f64; 3]], with_exitance: bool, slots: &mut [[f64; 3]]) {
        let node = &self.forest.nodes()[n];
        if node.first_child != 0 {
            return;
        }
        let material = self.scene.material(self.scene.sides[node.cell.root as usize]);
        let basis = self.forest.basis(node.cell.shape);
        let own = &mut slots[..basis.len()];
        for (v, e) in own.iter_mut().zip(irradiance) {
            *v = (material.reflectance * Rgb(*e)).0;
        }
        if with_exitance {
            let exitance = material.radiance * std::f64::consts::PI;
            let constant = if basis.is_nested() { 1 } else { basis.len() };
            for v in &mut own[..constant] {
                *v = (Rgb(*v) + exitance).0;
            }
        }
    }

    /// Integral over counted sides of a piecewise function, channels summed, from its coefficients.
    pub(super) fn leaf_sum(&self, coefficient: impl Fn(usize) -> Rgb) -> f64 {
        let stride = self.forest.stride();
        let mut sum = 0.0;
        for (n, node) in self.forest.nodes().iter().enumerate() {
            if node.first_child == 0 && self.counts(node.cell.root) {
                let basis = self.forest.basis(node.cell.shape);
                let constant = if basis.is_nested() { 1 } else { basis.len() };
                let share = node.measure / constant as f64;
                sum += (0..constant).map(|j| coefficient(n * stride + j).sum() * share).sum::<f64>();
            }
        }
        sum
    }

    /// Whether the promise counts a side: pure emitters receive too, but nobody asked how much.
    pub(super) fn counts(&self, side: u32) -> bool {
        !self.scene.material(self.scene.sides[side as usize]).is_pure_emitter()
    }

    /// Weight of each coefficient in the area-weighted square mean: leaves of counted sides only.
    pub(super) fn slot_weights(&self) -> Vec<f64> {
        let stride = self.forest.stride();
        let mut weights = vec![0.0; self.forest.len() * stride];
        for (n, node) in self.forest.nodes().iter().enumerate() {
            if node.first_child == 0 && self.counts(node.cell.root) {
                let basis = self.forest.basis(node.cell.shape);
                let share = if basis.is_nested() { node.measure } else { node.measure / basis.len() as f64 };
                weights[n * stride..n * stride + basis.len()].fill(share);
            }
        }
        weights
    }

    /// Area-weighted mean irradiance over the sides that the promise counts.
    pub(super) fn mean_irradiance(&self) -> Rgb {
        let stride = self.forest.stride();
        let mut sum = Rgb::BLACK;
        for (n, node) in self.forest.nodes().iter().enumerate() {
            if node.first_child == 0 && self.counts(node.cell.root) {
                let own = &self.irradiance[n * stride..(n + 1) * stride];
                let basis = self.forest.basis(node.cell.shape);
                sum += Rgb(basis.mean(own, [0.0; 3], |a, b, k| (Rgb(a) + Rgb(b) * k).0)) * node.measure;
            }
        }
        if self.counted_area > 0.0 { sum * (1.0 / self.counted_area) } else { sum }
    }

    pub(super) fn highest_reflectance(&self) -> f64 {
        self.scene.materials.iter().map(|m| m.reflectance.max()).fold(0.0, f64::max)
    }
}
