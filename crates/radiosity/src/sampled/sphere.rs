//! Directions to a triangle, evenly over the solid angle that it fills (Arvo 1995, "Stratified Sampling of Spherical
//! Triangles").

use glam::DVec3;

/// Up to this radius over distance a triangle is sampled by area instead: the density hardly varies, and is known.
const FLAT: f64 = 0.25;

/// And below this solid angle: it is edge-on, and its angles are rounding.
const SLIVER: f64 = 1e-6;

/// A triangle as seen from a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone {
    corners: [DVec3; 3],
    /// Solid angle in steradians; about, where it is sampled by area.
    pub(super) solid_angle: f64,
    /// Angle at the first corner, and cosine of the side from it to the second; none where it is sampled by area.
    angles: Option<[f64; 2]>,
}

impl Cone {
    /// The triangle with these corners relative to the point.
    pub(super) fn new(corners: [DVec3; 3]) -> Cone {
        let [a, b, c] = corners;
        let centre = (a + b + c) / 3.0;
        let distance = centre.length();
        if corners.iter().all(|p| p.distance_squared(centre) < (FLAT * distance).powi(2)) {
            let solid_angle = 0.5 * (b - a).cross(c - a).dot(centre).abs() / (distance * distance * distance);
            return Cone { corners, solid_angle, angles: None };
        }
        let [a, b, c] = corners.map(|p| p.normalize_or_zero());
        // van Oosterom and Strackee 1983
        let volume = a.dot(b.cross(c)).abs();
        let solid_angle = 2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        let angle = |p: DVec3, q: DVec3, r: DVec3| {
            let (u, v) = (p.cross(q), p.cross(r));
            u.cross(v).length().atan2(u.dot(v))
        };
        Cone { corners, solid_angle, angles: Some([angle(a, b, c), a.dot(b)]) }
    }

    /// The direction (of any length) for a point of the unit square, and its density per steradian.
    pub(super) fn direction(&self, [s, t]: [f64; 2]) -> (DVec3, f64) {
        let [a, b, c] = self.corners;
        let Some([alpha, cos_c]) = self.angles.filter(|_| self.solid_angle > SLIVER) else {
            let root = s.sqrt();
            let d = a + (b - a) * (root * (1.0 - t)) + (c - a) * (root * t);
            let twice = (b - a).cross(c - a);
            // area per solid angle: r^3 / height
            let r = d.length();
            return (d, r * r * r / (0.5 * twice.dot(d).abs()));
        };
        let [a, b, c] = [a, b, c].map(|p| p.normalize_or_zero());
        let across = |p: DVec3, q: DVec3| (p - q * p.dot(q)).normalize_or_zero();
        let (sin_alpha, cos_alpha) = alpha.sin_cos();
        let (sin, cos) = (s * self.solid_angle - alpha).sin_cos();
        let (u, v) = (cos - cos_alpha, sin + sin_alpha * cos_c);
        let below = (v * sin + u * cos) * sin_alpha;
        let q = if below == 0.0 { 1.0 } else { (((v * cos - u * sin) * cos_alpha - v) / below).clamp(-1.0, 1.0) };
        let on_side = a * q + across(c, a) * (1.0 - q * q).max(0.0).sqrt();
        let z = 1.0 - t * (1.0 - on_side.dot(b));
        (b * z + across(on_side, b) * (1.0 - z * z).max(0.0).sqrt(), 1.0 / self.solid_angle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ondelette_numerics::sobol::Sobol;

    #[test]
    fn irradiance_by_directions_is_lamberts() {
        use crate::form_factor::{Polygon, point_to_polygon};
        // around the zenith, grazing, and so far that the flat rule takes over
        for corners in [
            [[1.0, 0.0, 0.1], [0.0, 1.0, 0.1], [-1.0, -1.0, 0.3]],
            [[3.0, 0.2, 0.4], [4.0, 2.0, 2.0], [2.0, 1.0, 0.5]],
            [[30.0, 0.2, 40.0], [30.5, 0.2, 40.0], [30.0, 0.9, 41.0]],
        ] {
            let corners = corners.map(DVec3::from_array);
            let cone = Cone::new(corners);
            let n = 1 << 14;
            let mut sum = 0.0;
            for i in 0..n {
                let (d, density) = cone.direction(Sobol::of(7).point(i));
                sum += d.normalize().z / (density * std::f64::consts::PI);
            }
            let found = sum / f64::from(n);
            let exact = [0, 2].map(|i| {
                let turned = [corners[i], corners[1], corners[2 - i]];
                point_to_polygon(DVec3::ZERO, DVec3::Z, &Polygon::new(&turned))
            });
            let exact = exact[0].max(exact[1]);
            assert!((found / exact - 1.0).abs() < 2e-3, "{corners:?}: {found} for {exact}");
        }
    }
}
