//! Where direct light is gathered from the lamps whenever it is read ([`crate::DirectLight::Gathered`]), and what its
//! error counts there: leaves whose functions miss too much of it are in a penumbra. Who plans elements and who reads
//! them both ask here.

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
/// Fewest and most rays to the lamps for a point that is read.
const LEAST_RAYS: f64 = 16.0;
const MOST_RAYS: f64 = 4096.0;

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

    /// Whether the leaf is in a penumbra, and better read from the lamps, with the rays that there are for that, than
    /// from what was fitted with `lamp_rays` a point.
    pub(super) fn is_marked(self, allowed: f64, lamp_rays: f64) -> bool {
        let fitted = self.misfit + self.scatter;
        fitted > allowed && self.read(lamp_rays) < fitted
    }

    /// What counts of it where direct light is gathered: of a marked leaf, what reflected light brings back, and the
    /// scatter of what is read, as far as it is too much. Beside it the scatter that it always has.
    pub(super) fn gathered(self, allowed: f64, lamp_rays: f64) -> (Self, f64) {
        if !self.is_marked(allowed, lamp_rays) {
            return (self, 0.0);
        }
        let (read, usual) = (self.read(lamp_rays), READ * allowed);
        let too_much = if read > usual { read } else { 0.0 };
        let usual = if self.scatter > 0.0 { usual } else { 0.0 };
        (Missed { misfit: PASSED_ON * self.misfit, scatter: (PASSED_ON * self.scatter).hypot(too_much) }, usual)
    }

    /// Least scatter of a point that is read.
    fn read(self, lamp_rays: f64) -> f64 {
        self.of_one_ray(lamp_rays) / MOST_RAYS.sqrt()
    }

    /// Rays of a point that is read to all lamps which it may see past many things, and which may bring so much: from
    /// that, or from how `lamp_rays` scattered on the leaf.
    pub(super) fn rays(self, may_bring: f64, allowed: f64, lamp_rays: f64) -> f64 {
        let one = self.of_one_ray(lamp_rays).min(SEEN_OR_NOT * may_bring);
        let rays = (one / (READ * allowed)).powi(2);
        // in the dark nothing is allowed and nothing comes: 0 / 0
        if rays > LEAST_RAYS { rays.min(MOST_RAYS) } else { LEAST_RAYS }
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
