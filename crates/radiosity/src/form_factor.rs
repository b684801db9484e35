//! Closed forms for flat sources: Lambert's polygon formula, clipped to the horizon.

use glam::DVec3;

/// A convex polygon with few corners, on the stack.
#[derive(Clone, Copy, Debug)]
pub struct Polygon {
    corners: [DVec3; Polygon::MAX],
    len: usize,
}

impl Polygon {
    /// Most corners: a quadrilateral clipped by several planes.
    pub(crate) const MAX: usize = 10;

    /// From corners in order.
    ///
    /// # Panics
    /// If there are more than 10.
    pub fn new(corners: &[DVec3]) -> Self {
        let mut polygon = Polygon { corners: [DVec3::ZERO; Self::MAX], len: corners.len() };
        polygon.corners[..corners.len()].copy_from_slice(corners);
        polygon
    }

    /// The corners.
    pub fn corners(&self) -> &[DVec3] {
        &self.corners[..self.len]
    }

    /// The part where `normal . (p - point)` > 0 (Sutherland-Hodgman).
    pub fn clipped(&self, point: DVec3, normal: DVec3) -> Polygon {
        let height = |p: DVec3| normal.dot(p - point);
        let mut out = Polygon { corners: [DVec3::ZERO; Self::MAX], len: 0 };
        let mut push = |p: DVec3| {
            if out.len < Self::MAX {
                out.corners[out.len] = p;
                out.len += 1;
            }
        };
        for i in 0..self.len {
            let (a, b) = (self.corners[i], self.corners[(i + 1) % self.len]);
            let (ha, hb) = (height(a), height(b));
            if ha > 0.0 {
                push(a);
            }
            if (ha > 0.0) != (hb > 0.0) {
                push(a + (b - a) * (ha / (ha - hb)));
            }
        }
        out
    }
}

/// Form factor from a differential element at `x` with unit normal `n` to a polygon in front of it: the irradiance that
/// a source of unit radiosity on the polygon brings (Lambert 1760; Gortler 3.1).
///
/// `polygon` must lie in the half-space n . (p - x) >= 0 (see [`Polygon::clipped`]) and show its front to x, corners
/// counter-clockwise seen from x's side. Exact for any size and distance; 0 for fewer than three corners.
///
/// ```
/// use glam::DVec3;
/// use ondelette_radiosity::form_factor::{point_to_polygon, Polygon};
/// // a unit square one unit above, the element under its centre: Howell B-3
/// let above = [[0.5, 0.5], [0.5, -0.5], [-0.5, -0.5], [-0.5, 0.5]].map(|[x, y]| DVec3::new(x, y, 1.0));
/// let f = point_to_polygon(DVec3::ZERO, DVec3::Z, &Polygon::new(&above));
/// assert!((f - 0.239456470460774).abs() < 1e-14);
/// ```
pub fn point_to_polygon(x: DVec3, n: DVec3, polygon: &Polygon) -> f64 {
    let mut relative = polygon.corners;
    relative[..polygon.len].iter_mut().for_each(|c| *c -= x);
    cone_factor(n, &relative[..polygon.len])
}

/// The same for corners relative to the point.
pub(crate) fn cone_factor(n: DVec3, corners: &[DVec3]) -> f64 {
    if corners.len() < 3 {
        return 0.0;
    }
    let mut sum = 0.0;
    let mut a = corners[corners.len() - 1];
    for &b in corners {
        let cross = a.cross(b);
        let sine = cross.length();
        if sine > 0.0 {
            sum += sine.atan2(a.dot(b)) / sine * cross.dot(n);
        }
        a = b;
    }
    // seen from x a front-facing polygon runs clockwise
    (-sum / std::f64::consts::TAU).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(o: DVec3, u: DVec3, v: DVec3) -> Polygon {
        Polygon::new(&[o, o + u, o + u + v, o + v])
    }

    #[test]
    fn corner_and_perpendicular_elements_match_howell() {
        // B-3 under the corner of a unit square at distance 1, B-4 perpendicular
        let above = square(DVec3::new(0.0, 0.0, 1.0), DVec3::Y, DVec3::X);
        assert!((point_to_polygon(DVec3::ZERO, DVec3::Z, &above) - 0.138531605994893).abs() < 1e-14);
        let beside = square(DVec3::new(0.0, 1.0, 0.0), DVec3::X, DVec3::Z);
        let f = point_to_polygon(DVec3::ZERO, DVec3::Z, &beside);
        assert!((f - 0.0557341970025535).abs() < 1e-14, "{f}");
    }

    #[test]
    fn a_closed_cube_sums_to_one_from_any_wall_point() {
        let (o, x, y, z) = (DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z);
        // inward faces other than the floor
        let faces = [square(z, y, x), square(o, y, z), square(x, z, y), square(o, z, x), square(y, x, z)];
        for p in [DVec3::new(0.5, 0.5, 0.0), DVec3::new(1e-6, 0.3, 0.0), DVec3::new(0.999999, 1e-9, 0.0)] {
            let sum: f64 = faces.iter().map(|f| point_to_polygon(p, z, &f.clipped(p, z))).sum();
            assert!((sum - 1.0).abs() < 1e-9, "{p} {sum}");
        }
    }

    #[test]
    fn what_lies_under_the_horizon_does_not_count() {
        // a wall that reaches below the element's plane: only its upper half is seen
        let wall = square(DVec3::new(0.0, 1.0, -1.0), DVec3::X, DVec3::Z * 2.0);
        let n = DVec3::Z;
        let f = point_to_polygon(DVec3::ZERO, n, &wall.clipped(DVec3::ZERO, n));
        assert!((f - 0.0557341970025535).abs() < 1e-14, "{f}");
    }
}
