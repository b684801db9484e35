//! Places where a surface runs into the inside of something: a floor under a box, a wall behind a cupboard.
//!
//! They are dark and nobody sees them. A function fitted across the foot of a box would smear the dark out of it, so
//! such places are left out of fits, and are dark whatever the fit says.

use super::LightKernel;
use crate::occluder::Hit;
use glam::DVec3;
use ondelette_numerics::sobol;

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
        let tangent = frame.edges[0].normalize();
        let bitangent = frame.normal.cross(tangent);
        let [a, b] = disc(u);
        tangent * a + bitangent * b + frame.normal * (1.0 - a * a - b * b).max(0.0).sqrt()
    }

    /// Whether a point of a side is inside of something: it sees only black backs. Some rays, often one.
    pub fn is_buried(&self, side: usize, x: DVec3) -> bool {
        (0..DIRECTIONS).all(|i| {
            let [u, v, ..] = sobol::point(0x6275_7269, i);
            self.first_hit_from(side, x, self.direction(side, [u, v])).is_some_and(|hit| self.is_back(&hit))
        })
    }
}

/// The unit square onto the unit disc, area by area, neighbours to neighbours (Shirley and Chiu 1997).
fn disc(p: [f64; 2]) -> [f64; 2] {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
    let [a, b] = p.map(|x| 2.0 * x - 1.0);
    if a == 0.0 && b == 0.0 {
        return [0.0; 2];
    }
    let (r, angle) = if a.abs() > b.abs() { (a, FRAC_PI_4 * (b / a)) } else { (b, FRAC_PI_2 - FRAC_PI_4 * (a / b)) };
    [r * angle.cos(), r * angle.sin()]
}
