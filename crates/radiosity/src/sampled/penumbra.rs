//! Where direct light is gathered from the lamps whenever it is read ([`crate::DirectLight::Gathered`]), and what its
//! error counts there: leaves whose functions miss too much of it are in a penumbra. Who plans elements and who reads
//! them both ask here.

use super::plan::MOST_LAMP_RAYS;
use crate::rgb::Rgb;

/// A leaf is in a penumbra when its direct light misses this share of the promised error times the mean irradiance.
const MARKED: f64 = 0.25;
/// Share of what the functions of such a leaf miss that counts: what is too bright here and too dark there nearly
/// cancels in the light that is reflected to somewhere else.
const PASSED_ON: f64 = 0.1;
/// Scatter of what is read, where rays decide what is seen of a lamp: a share of what a leaf may miss unmarked.
const READ: f64 = 0.6;
/// Scatter at a point over that of a function fitted to the points of a leaf: four points to a function.
const POINT_TO_LEAF: f64 = 2.0;
/// Scatter of whether a lamp is seen, at most.
const SEEN_OR_NOT: f64 = 0.5;
/// Fewest rays to the lamps for a point that is read.
const LEAST_RAYS: f64 = 16.0;

/// What the direct light of a leaf misses, channels summed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Missed {
    /// Mean absolute value of what its functions cannot say.
    pub(super) misfit: f64,
    /// Root mean square scatter, where rays decide what is seen.
    pub(super) scatter: f64,
}

impl Missed {
    /// That of a leaf, from what is known of it for unit exitance of each group of lamps.
    pub(super) fn of(groups: &[(u32, Rgb)], misfit: &[f32], scatter: &[f32]) -> Self {
        let (mut sum, mut square) = (0.0, 0.0);
        for ((_, exitance), (misfit, scatter)) in groups.iter().zip(misfit.iter().zip(scatter)) {
            sum += exitance.sum() * f64::from(*misfit);
            square += (exitance.sum() * f64::from(*scatter)).powi(2);
        }
        Missed { misfit: sum, scatter: square.sqrt() }
    }

    /// Whether the leaf is in a penumbra.
    pub(super) fn is_marked(self, allowed: f64) -> bool {
        self.misfit + self.scatter > allowed
    }

    /// What counts of it where direct light is gathered: of a marked leaf, what reflected light brings back. Beside it
    /// the scatter of what is read, which nothing that is done to the leaf brings down.
    pub(super) fn gathered(self, allowed: f64, lamp_rays: f64) -> (Self, f64) {
        if !self.is_marked(allowed) {
            return (self, 0.0);
        }
        let at_least = self.of_one_ray(lamp_rays) / MOST_LAMP_RAYS.sqrt();
        let read = if self.scatter > 0.0 { at_least.max(READ * allowed) } else { 0.0 };
        (Missed { misfit: PASSED_ON * self.misfit, scatter: PASSED_ON * self.scatter }, read)
    }

    /// Rays of a point that is read to all lamps which it may see past many things, and which may bring so much: from
    /// that, or from how `lamp_rays` scattered on the leaf.
    pub(super) fn rays(self, may_bring: f64, allowed: f64, lamp_rays: f64) -> f64 {
        let one = self.of_one_ray(lamp_rays).min(SEEN_OR_NOT * may_bring);
        let rays = (one / (READ * allowed)).powi(2);
        // in the dark nothing is allowed and nothing comes: 0 / 0
        if rays > LEAST_RAYS { rays.min(MOST_LAMP_RAYS) } else { LEAST_RAYS }
    }

    /// Scatter that one ray of a point would have.
    fn of_one_ray(self, lamp_rays: f64) -> f64 {
        POINT_TO_LEAF * self.scatter * lamp_rays.sqrt()
    }
}

/// What a leaf may miss without being in a penumbra, for a promised error and a mean irradiance.
pub(super) fn allowed(error: f64, mean: f64) -> f64 {
    MARKED * error * mean
}
