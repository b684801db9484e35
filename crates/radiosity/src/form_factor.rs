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
    let mut before = a.length_squared();
    for &b in corners {
        let square = b.length_squared();
        sum += angle_over_sine(a, b, before * square) * a.cross(b).dot(n);
        (a, before) = (b, square);
    }
    // seen from x a front-facing polygon runs clockwise
    (-sum / std::f64::consts::TAU).max(0.0)
}

/// The angle between two vectors over the length of their cross product; `squares` is the product of their squares.
///
/// With t the tangent of half the angle and l the product of the lengths it is `atan(t) (1 + t^2) / (t l)`, a smooth
/// function of `t^2 = (l - a . b) / (l + a . b)`: up to 45 degrees a polynomial (Chebyshev interpolation, 1e-16 off).
fn angle_over_sine(a: DVec3, b: DVec3, squares: f64) -> f64 {
    let (product, dot) = (squares.sqrt(), a.dot(b));
    let u = (product - dot) / (product + dot);
    if u >= UP_TO || u.is_nan() {
        // wide angles, and vectors that are none
        let sine = a.cross(b).length();
        return if sine > 0.0 { sine.atan2(dot) / sine } else { 0.0 };
    }
    let pair = |k: usize| ANGLE[k] + ANGLE[k + 1] * u;
    let [u2, u4] = [u * u, u * u * (u * u)];
    let [low, high] = [pair(0) + pair(2) * u2, pair(4) + pair(6) * u2];
    (low + high * u4 + pair(8) * (u4 * u4)) / product
}

/// The square of the tangent of half of 45 degrees.
const UP_TO: f64 = 0.1715;
/// Coefficients of `atan(t) (1 + t^2) / t` in powers of `t^2`.
const ANGLE: [f64; 10] = [
    1.0,
    0.666_666_666_666_540_5,
    -0.133_333_333_308_974_68,
    0.057_142_855_313_400_31,
    -0.031_745_961_696_723_55,
    0.020_200_471_250_655_63,
    -0.013_964_988_089_117_098,
    0.010_077_221_240_844_873,
    -0.006_893_952_977_887_092,
    0.003_213_035_656_738_916,
];

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
    fn angles_over_sines_are_right_to_the_last_digits() {
        for k in 0..=2000 {
            let angle = f64::from(k) * 1e-3;
            let (a, b) = (DVec3::new(3.0, 0.0, 0.0), DVec3::new(0.0, angle.sin(), angle.cos()) * 0.7);
            let b = DVec3::new(b.z, b.y, 0.0);
            let expected = if k == 0 { 1.0 } else { angle / angle.sin() } / 2.1;
            let found = angle_over_sine(a, b, a.length_squared() * b.length_squared());
            assert!((found - expected).abs() <= 1e-15 * expected, "{angle}: {found} for {expected}");
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
