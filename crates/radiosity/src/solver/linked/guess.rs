//! How many rays a pair deserves before its light is known.

use super::COARSE_RAYS;
use crate::kernel::{LightKernel, SideFrame};
use crate::scene::Scene;
use glam::DVec3;
use ondelette_compress::{CoupleSettings, Forest, NodeId};

/// Most rays of a receiver point.
const MOST_RAYS: usize = 1024;

/// What can be said of the light before anything is linked: it spreads evenly.
pub(super) struct Guess {
    irradiance: f64,
    error: f64,
}

impl Guess {
    pub(super) fn of(scene: &Scene, kernel: &LightKernel, error: f64) -> Self {
        let (mut power, mut absorbing) = (0.0, 0.0);
        for (side, frame) in scene.sides.iter().zip(kernel.sides()) {
            let material = scene.material(*side);
            power += material.radiance.sum() * std::f64::consts::PI * frame.area;
            absorbing += (1.0 - material.reflectance.sum() / 3.0) * frame.area;
        }
        Guess { irradiance: power / absorbing, error }
    }

    /// Few mask samples for pairs that can hardly matter, more for those that may.
    pub(super) fn settings(
        &self,
        scene: &Scene,
        kernel: &LightKernel,
        receiver: usize,
        shooter: usize,
    ) -> CoupleSettings {
        let (r, s) = (&kernel.sides()[receiver], &kernel.sides()[shooter]);
        let material = scene.material(scene.sides[shooter]);
        let shot = material.radiance.sum() * std::f64::consts::PI + material.reflectance.sum() / 3.0 * self.irradiance;
        let middle = |f: &SideFrame| f.origin + (f.edges[0] + f.edges[1]) * 0.5;
        let spread = std::f64::consts::PI * middle(r).distance_squared(middle(s));
        let share = s.area / (spread + s.area) * shot / self.irradiance;
        let samples = rays_for(share, self.error, 1).min(COARSE_RAYS);
        CoupleSettings { samples, ..CoupleSettings::EXACT }
    }

    /// Irradiance, all channels summed, if the light spread evenly.
    pub(super) fn irradiance(&self) -> f64 {
        self.irradiance
    }
}

/// What is known of every element when a full matrix is coupled.
#[derive(Clone)]
pub(super) struct Elements {
    centres: Vec<DVec3>,
    areas: Vec<f64>,
    roots: Vec<u32>,
    /// Mean radiosity, channels summed, relative to the mean irradiance.
    shot: Vec<f64>,
    error: f64,
}

impl Elements {
    /// `shot`: mean radiosity of each node, relative to the mean irradiance; `error`: the promise.
    pub(super) fn of(kernel: &LightKernel, forest: &Forest, shot: Vec<f64>, error: f64) -> Self {
        let nodes = forest.nodes();
        Elements {
            centres: nodes.iter().map(|n| kernel.element(&n.cell).ball().0).collect(),
            areas: nodes.iter().map(|n| n.measure).collect(),
            roots: nodes.iter().map(|n| n.cell.root).collect(),
            shot,
            error,
        }
    }

    /// The side of an element.
    pub(super) fn root(&self, id: NodeId) -> usize {
        self.roots[id.index()] as usize
    }

    /// How to couple a pair of elements.
    pub(super) fn settings(&self, receiver: NodeId, shooter: NodeId) -> CoupleSettings {
        let (r, s) = (receiver.index(), shooter.index());
        let spread = std::f64::consts::PI * self.centres[r].distance_squared(self.centres[s]);
        let share = self.areas[s] / (spread + self.areas[s]) * self.shot[s];
        CoupleSettings { samples: rays_for(share, self.error, 4), ..CoupleSettings::EXACT }
    }
}

/// Rays for one receiver point of a link that brings this share of the mean irradiance: so many that their error, of
/// some twenty such links together, stays below the promise (stratified rays err like n^-3/4).
pub(super) fn rays_for(share: f64, error: f64, least: usize) -> usize {
    let rays = (4.0 * share / error).powf(4.0 / 3.0);
    if rays.is_nan() { least } else { rays.clamp(least as f64, MOST_RAYS as f64) as usize }
}
