//! What was solved: the irradiance of every side, readable anywhere.

use crate::rgb::Rgb;
use crate::sampled::Kept;
use crate::scene::Scene;
use crate::settings::{DirectLight, Settings};
use crate::solver::MatrixTooLarge;
use glam::DVec3;
use ondelette_compress::{Forest, Links, NodeId};
use ondelette_wavelet::cell::CellShape;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Counts of a solution: deterministic, no clock.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// Whether the promise is kept.
    pub finished: bool,
    /// Sweeps over all links.
    pub iterations: u64,
    /// Relative residual of the last solve.
    pub residual: f64,
    /// Estimated error, relative to the mean irradiance.
    pub estimated_error: f64,
    /// Kernel samples taken.
    pub kernel_samples: u64,
    /// Visibility rays cast.
    pub rays: u64,
    /// Shots of the solvers that shoot.
    pub shots: u64,
    /// The full matrix that would have been next, had it not been too large.
    pub too_large: Option<MatrixTooLarge>,
    /// What the standard decomposition kept.
    pub terms: Option<Terms>,
}

/// How many terms a full matrix has, and how many are kept in either decomposition for the same guarantee.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Terms {
    /// Of the full matrix.
    pub full: u64,
    /// Of the standard decomposition, on which the solution is solved.
    pub standard: u64,
    /// Of the non-standard decomposition.
    pub nonstandard: u64,
}

/// Closer to an element's edge than this (in its local units) counts as on it.
const EDGE: f64 = 1e-7;

/// A solved (or half-solved) scene.
#[derive(Clone, Debug)]
pub struct Solution {
    scene: Arc<Scene>,
    settings: Settings,
    forest: Forest,
    links: Links,
    irradiance: Vec<[f64; 3]>,
    statistics: Statistics,
    /// Share of each node that is not inside of something.
    lit: Vec<f32>,
    /// Estimated integral of the absolute error over each side, channels summed; empty if not known.
    errors: Vec<f64>,
    /// The samples behind it.
    kept: Option<Arc<Kept>>,
}

impl Solution {
    /// Puts the parts together; `irradiance` holds `forest.stride()` coefficients a node, at the leaves.
    ///
    /// # Panics
    /// If the lengths do not fit.
    pub fn new(
        scene: Arc<Scene>,
        settings: Settings,
        forest: Forest,
        links: Links,
        irradiance: Vec<[f64; 3]>,
        statistics: Statistics,
    ) -> Self {
        assert_eq!(irradiance.len(), forest.len() * forest.stride());
        assert_eq!(forest.roots().len(), scene.sides.len());
        let lit = vec![1.0; forest.len()];
        Solution { scene, settings, forest, links, irradiance, statistics, lit, errors: Vec::new(), kept: None }
    }

    /// Says which share of each leaf is not inside of something (a floor under a box): the rest is dark, and no part of
    /// the leaf's function.
    ///
    /// # Panics
    /// If there is not one share a node.
    #[must_use]
    pub fn with_lit(mut self, lit: Vec<f32>) -> Self {
        assert_eq!(lit.len(), self.forest.len());
        self.lit = lit;
        self
    }

    /// Says what error is estimated for each side: the integral of its absolute value, channels summed.
    ///
    /// # Panics
    /// If there are errors, but not one a side.
    #[must_use]
    pub fn with_errors(mut self, errors: Vec<f64>) -> Self {
        assert!(errors.is_empty() || errors.len() == self.scene.sides.len());
        self.errors = errors;
        self
    }

    /// Estimated integral of the absolute error of the irradiance over each side, channels summed; empty before the
    /// first balance and with links. 0 for sides that the promise does not count.
    pub fn errors(&self) -> &[f64] {
        &self.errors
    }

    /// Adds the samples that relighting and refining go on from, or direct light alone (see [`Kept::check`]).
    #[must_use]
    pub fn with_kept(mut self, kept: Arc<Kept>) -> Self {
        self.kept = Some(kept);
        self
    }

    /// The same without kept samples; of these stays what direct light is read by, if it is to be gathered.
    #[must_use]
    pub fn without_samples(mut self) -> Self {
        self.kept = match self.settings.direct {
            DirectLight::Gathered => self.kept.map(|kept| Arc::new(kept.without_samples())),
            DirectLight::Fitted => None,
        };
        self
    }

    /// What was kept, if anything: samples to go on from, or direct light alone.
    pub fn kept(&self) -> Option<&Arc<Kept>> {
        self.kept.as_ref()
    }

    /// Shares of the nodes that are not inside of something; 1 but for some leaves.
    pub fn lit(&self) -> &[f32] {
        &self.lit
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The settings.
    pub fn settings(&self) -> Settings {
        self.settings
    }

    /// The elements.
    pub fn forest(&self) -> &Forest {
        &self.forest
    }

    /// The links.
    pub fn links(&self) -> &Links {
        &self.links
    }

    /// Irradiance coefficients, `forest().stride()` a node, zero at inner nodes.
    pub fn coefficients(&self) -> &[[f64; 3]] {
        &self.irradiance
    }

    /// Counts.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// Whether the promise is kept.
    pub fn is_finished(&self) -> bool {
        self.statistics.finished
    }

    /// Irradiance at side-local coordinates, in the scene's irradiance unit. Not clamped.
    ///
    /// On a common edge of elements, where the piecewise polynomial may jump, the mean of what stands on its sides (of
    /// four points close by).
    pub fn irradiance(&self, side: usize, at: [f64; 2]) -> Rgb {
        let (leaf, x) = self.forest.locate(side, at);
        let cell = &self.forest.node(leaf).cell;
        let triangle = cell.shape == CellShape::Triangle;
        let rim = if triangle { 1.0 - x[0] - x[1] } else { (1.0 - x[0]).min(1.0 - x[1]) };
        if x[0].min(x[1]).min(rim) > EDGE {
            return self.inside(leaf, x);
        }
        let step = 2.0 * EDGE * cell.scale.abs();
        let (mut sum, mut count) = (Rgb::BLACK, 0.0);
        for [s, t] in [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]] {
            let near = [at[0] + s * step, at[1] + t * step];
            let far = if triangle { near[0] + near[1] } else { near[0].max(near[1]) };
            if near[0].min(near[1]) >= 0.0 && far <= 1.0 {
                let (leaf, x) = self.forest.locate(side, near);
                sum += self.inside(leaf, x);
                count += 1.0;
            }
        }
        if count > 0.0 { sum * (1.0 / count) } else { self.inside(leaf, x) }
    }

    /// The polynomial of one leaf.
    pub(crate) fn inside(&self, leaf: NodeId, x: [f64; 2]) -> Rgb {
        let basis = self.forest.basis_of(leaf);
        let mut values = [0.0; 36];
        basis.eval(x, &mut values);
        let own = &self.irradiance[leaf.index() * self.forest.stride()..][..basis.len()];
        own.iter().zip(&values).fold(Rgb::BLACK, |sum, (c, v)| sum + Rgb(*c) * *v)
    }

    /// Radiosity (exitance plus reflected) at side-local coordinates.
    pub fn radiosity(&self, side: usize, at: [f64; 2]) -> Rgb {
        let material = self.scene.material(self.scene.sides[side]);
        material.radiance * std::f64::consts::PI + material.reflectance * self.irradiance(side, at)
    }

    /// Mean irradiance of a side.
    pub fn mean_irradiance(&self, side: usize) -> Rgb {
        let root = self.forest.roots()[side];
        let whole = self.forest.node(root).measure;
        let mut sum = Rgb::BLACK;
        self.each_leaf(|_, root, measure, mean| {
            if root == side {
                sum += mean * (measure / whole);
            }
        });
        sum
    }

    /// Calls `f(leaf index, side, area, mean irradiance)` for every leaf in node order.
    pub fn each_leaf(&self, mut f: impl FnMut(usize, usize, f64, Rgb)) {
        let stride = self.forest.stride();
        for (n, node) in self.forest.nodes().iter().enumerate() {
            if node.first_child == 0 {
                let own = &self.irradiance[n * stride..(n + 1) * stride];
                let mean = self.forest.basis(node.cell.shape).mean(own, [0.0; 3], |a, b, k| (Rgb(a) + Rgb(b) * k).0);
                f(n, node.cell.root as usize, node.measure, Rgb(mean) * f64::from(self.lit[n]));
            }
        }
    }

    /// The point in space at side-local coordinates.
    pub fn point(&self, side: usize, at: [f64; 2]) -> DVec3 {
        let (o, u, v) = self.scene.frame(self.scene.sides[side]);
        o + u * at[0] + v * at[1]
    }
}
