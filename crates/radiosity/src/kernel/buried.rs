//! Places where a surface runs into the inside of something: a floor under a box, a wall behind a cupboard.
//!
//! They are dark and nobody sees them. A function fitted across the foot of a box would smear the dark out of it, so
//! such places are left out of fits, and are dark whatever the fit says.

use super::LightKernel;
use crate::occluder::Hit;
use glam::DVec3;
use ondelette_numerics::sobol::Sobol;
use std::f64::consts::FRAC_PI_4;

/// Directions that must all meet a back.
const DIRECTIONS: u32 = 64;

impl LightKernel {
    /// What the ray from a point of a side meets first, other than its own patch.
    pub fn first_hit_from(&self, side: usize, x: DVec3, direction: DVec3) -> Option<Hit> {
        let own = self.sides[side].patch;
        self.occluders.first_hit(x, direction, |patch, _| patch == own)
    }

    /// Whether a hit is on a black back.
    pub fn is_back(&self, hit: &Hit) -> bool {
        self.side_of(hit.patch, !hit.front).is_none()
    }

    /// A direction about a side's normal, with density proportional to the cosine, from a point of the unit square.
    pub fn direction(&self, side: usize, u: [f64; 2]) -> DVec3 {
        let frame = &self.sides[side];
        let [tangent, bitangent] = frame.tangents;
        let [a, b] = disc(u);
        tangent * a + bitangent * b + frame.normal * (1.0 - a * a - b * b).max(0.0).sqrt()
    }

    /// Whether a point of a side is inside of something: it sees only black backs. Some rays, often one.
    pub fn is_buried(&self, side: usize, x: DVec3) -> bool {
        let sequence = Sobol::of(0x6275_7269);
        (0..DIRECTIONS).all(|i| {
            let direction = self.direction(side, sequence.point(i));
            self.first_hit_from(side, x, direction).is_some_and(|hit| self.is_back(&hit))
        })
    }
}

/// The unit square onto the unit disc, area by area, neighbours to neighbours (Shirley and Chiu 1997).
fn disc(p: [f64; 2]) -> [f64; 2] {
    let [a, b] = p.map(|x| 2.0 * x - 1.0);
    let turned = a.abs() <= b.abs();
    let (r, other) = if turned { (b, a) } else { (a, b) };
    let angle = if r == 0.0 { 0.0 } else { FRAC_PI_4 * (other / r) };
    // Taylor's series: up to pi / 4 they are good to 1e-9 and 1e-10, and the same on every machine
    let q = angle * angle;
    let sine = angle * (1.0 + q * (-1.0 / 6.0 + q * (1.0 / 120.0 + q * (-1.0 / 5040.0 + q / 362_880.0))));
    let cosine = 1.0 + q * (-0.5 + q * (1.0 / 24.0 + q * (-1.0 / 720.0 + q * (1.0 / 40_320.0 - q / 3_628_800.0))));
    if turned { [r * sine, r * cosine] } else { [r * cosine, r * sine] }
}
