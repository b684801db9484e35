//! The shape of one polygon: its area vector, whether it is a parallelogram, and its triangles if it is not.
//!
//! Tolerances, fixed here for the whole project:
//! * **parallelogram**: the closing defect |c0 - c1 + c2 - c3| may reach [`closing_tolerance`]: a millionth of the
//!   polygon's size plus four single-precision roundings of its largest coordinate (glTF stores `f32`, text files
//!   often print 7 to 9 digits), but never a thousandth of its shortest edge;
//! * **zero area**: thinner than [`THIN`] times its length.

use earcut::Earcut;
use glam::DVec3;

/// A polygon whose area is below `THIN` times the square of its extent has no usable normal and counts as zero area.
pub(super) const THIN: f64 = 1e-7;

/// Twice the area times the normal (Newell's sum; exact for planar polygons, the mean plane for others).
pub(super) fn area_vector(corners: &[DVec3]) -> DVec3 {
    let Some(&first) = corners.first() else { return DVec3::ZERO };
    corners.windows(2).map(|w| (w[0] - first).cross(w[1] - first)).sum()
}

/// Largest distance from the first corner.
fn extent(corners: &[DVec3]) -> f64 {
    corners.iter().map(|c| c.distance(corners[0])).fold(0.0, f64::max)
}

/// Whether the polygon is too thin to be lit.
pub(super) fn is_thin(corners: &[DVec3]) -> bool {
    let size = if corners.is_empty() { 0.0 } else { extent(corners) };
    // Written so that a NaN counts as thin.
    !(corners.len() >= 3 && area_vector(corners).length() > THIN * size * size && size > 0.0)
}

/// How far a quadrilateral with these corners may be from closing as a parallelogram.
pub(super) fn closing_tolerance(quad: &[DVec3; 4]) -> f64 {
    let largest = quad.iter().map(|c| c.abs().max_element()).fold(0.0, f64::max);
    let shortest = (0..4).map(|i| quad[i].distance(quad[(i + 1) % 4])).fold(f64::INFINITY, f64::min);
    (1e-6 * extent(quad) + 4.0 * f64::from(f32::EPSILON) * largest).min(1e-3 * shortest)
}

/// Whether the corners, in order round the polygon, are those of a parallelogram.
pub(super) fn is_parallelogram(quad: &[DVec3; 4]) -> bool {
    let defect = quad[0] - quad[1] + quad[2] - quad[3];
    defect.length() <= closing_tolerance(quad)
}

/// Triangles of a simple polygon, planar or nearly so, as corner indices with the polygon's own orientation.
pub(super) struct Triangulation {
    /// Corner indices.
    pub(super) triangles: Vec<[usize; 3]>,
    /// Whether the triangles cover the polygon: false for outlines that cross themselves.
    pub(super) covers: bool,
}

/// Cuts ears off the polygon as seen along the largest component of its normal.
///
/// **Cost** O(n log n) for usual outlines.
pub(super) fn triangulate(corners: &[DVec3]) -> Triangulation {
    if corners.len() == 3 {
        return Triangulation { triangles: vec![[0, 1, 2]], covers: true };
    }
    let normal = area_vector(corners);
    let size = normal.abs();
    // Drop the dominant axis; the two others in the order that keeps counter-clockwise as seen from the front.
    let flat = |c: DVec3| -> [f64; 2] {
        let c = c - corners[0];
        let [a, b, up] = if size.x >= size.y && size.x >= size.z {
            [c.y, c.z, normal.x]
        } else if size.y >= size.z {
            [c.z, c.x, normal.y]
        } else {
            [c.x, c.y, normal.z]
        };
        if up >= 0.0 { [a, b] } else { [b, a] }
    };
    let points: Vec<[f64; 2]> = corners.iter().map(|&c| flat(c)).collect();
    let mut indices: Vec<usize> = Vec::new();
    Earcut::new().earcut(points.iter().copied(), &[], &mut indices);
    let doubled = |t: &[usize; 3]| {
        let [a, b, c] = t.map(|i| points[i]);
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let mut covered = 0.0;
    let mut triangles = Vec::with_capacity(indices.len() / 3);
    for t in indices.chunks_exact(3) {
        let mut triangle = [t[0], t[1], t[2]];
        if doubled(&triangle) < 0.0 {
            triangle.swap(1, 2);
        }
        covered += doubled(&triangle);
        triangles.push(triangle);
    }
    let whole = size.max_element();
    Triangulation { triangles, covers: (covered - whole).abs() <= 1e-6 * whole }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(points: &[[f64; 3]]) -> Vec<DVec3> {
        points.iter().map(|&p| DVec3::from(p)).collect()
    }

    /// An L in each of the three planes, both ways round: if the projection lost the orientation, fronts would be
    /// lit from behind; if ears were cut wrongly, the notch would be covered.
    #[test]
    fn concave_polygons_keep_area_and_orientation_in_every_plane() {
        let l = [[0., 0.], [3., 0.], [3., 1.], [1., 1.], [1., 2.], [0., 2.]];
        for axis in 0..3 {
            for turned in [false, true] {
                let mut corners: Vec<DVec3> = l
                    .iter()
                    .map(|p| {
                        let mut c = [0.25; 3];
                        c[(axis + 1) % 3] = p[0];
                        c[(axis + 2) % 3] = p[1];
                        DVec3::from(c)
                    })
                    .collect();
                if turned {
                    corners.reverse();
                }
                let whole = area_vector(&corners);
                let cut = triangulate(&corners);
                assert!(cut.covers);
                assert_eq!(cut.triangles.len(), 4);
                let mut sum = DVec3::ZERO;
                for t in &cut.triangles {
                    let part = area_vector(&t.map(|i| corners[i]));
                    assert!(part.dot(whole) > 0.0, "a triangle faces the other way");
                    sum += part;
                }
                assert!((sum - whole).length() < 1e-12, "{sum} for {whole}");
                assert!((whole.length() - 8.0).abs() < 1e-12);
            }
        }
    }

    /// A star that crosses itself must be reported, or its light would be counted twice in silence.
    #[test]
    fn outlines_that_cross_themselves_are_reported() {
        let star: Vec<DVec3> = (0..5)
            .map(|i| {
                let angle = f64::from(i) * 2.0 * std::f64::consts::TAU / 5.0;
                DVec3::new(angle.cos(), angle.sin(), 0.0)
            })
            .collect();
        assert!(!triangulate(&star).covers);
    }

    /// Single-precision corners of a turned, shifted rectangle stay a parallelogram; a visible taper does not.
    #[test]
    fn rounding_passes_and_tapers_do_not() {
        let turned = |x: f64, y: f64| {
            let (s, c) = 0.7_f64.sin_cos();
            DVec3::new(12.0 + c * x - s * y, -7.0, 3.0 + s * x + c * y)
        };
        let rounded = [turned(0., 0.), turned(0.0237, 0.), turned(0.0237, 0.0113), turned(0., 0.0113)]
            .map(|p| p.as_vec3().as_dvec3());
        assert!(rounded[0] - rounded[1] + rounded[2] - rounded[3] != DVec3::ZERO, "rounding must show");
        assert!(is_parallelogram(&rounded));
        let taper = [turned(0., 0.), turned(1., 0.), turned(0.9999, 1.), turned(0., 1.)];
        assert!(!is_parallelogram(&taper));
    }

    /// Needles have no normal: they must not become patches.
    #[test]
    fn needles_are_thin() {
        assert!(is_thin(&at(&[[0., 0., 0.], [1., 0., 0.], [2., 0., 0.]])));
        assert!(is_thin(&at(&[[0., 0., 0.], [1., 0., 0.], [0.5, 1e-9, 0.]])));
        assert!(is_thin(&at(&[[0., 0., 0.], [0., 0., 0.], [0., 0., 0.]])));
        assert!(!is_thin(&at(&[[0., 0., 0.], [1., 0., 0.], [0.5, 1e-4, 0.]])));
    }
}
