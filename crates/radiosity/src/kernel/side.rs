//! One side of a patch as the kernel sees it.

use glam::DVec3;
use ondelette_wavelet::cell::CellShape;

/// One side as a kernel sees it.
#[derive(Clone, Copy, Debug)]
pub struct SideFrame {
    /// Corner.
    pub origin: DVec3,
    /// Edges; their cross product points to the side's front.
    pub edges: [DVec3; 2],
    /// Unit normal.
    pub normal: DVec3,
    /// Unit vectors that make a right-handed frame with the normal; the first lies along the first edge.
    pub tangents: [DVec3; 2],
    /// Area of the side.
    pub area: f64,
    /// Patch that this side belongs to.
    pub patch: u32,
    /// Whether it ever sends light out: it emits or reflects.
    pub shoots: bool,
    /// Square or triangle.
    pub shape: CellShape,
}

impl SideFrame {
    /// Corners counter-clockwise from the front.
    pub fn corners(&self) -> Vec<DVec3> {
        let (o, [u, v]) = (self.origin, self.edges);
        if self.shape == CellShape::Triangle { vec![o, o + u, o + v] } else { vec![o, o + u, o + u + v, o + v] }
    }

    /// Whether the projection of a point on the side's plane lies on the side.
    pub fn holds(&self, point: DVec3) -> bool {
        let [s, t] = self.local(point);
        let far = if self.shape == CellShape::Triangle { s + t } else { s.max(t) };
        s >= 0.0 && t >= 0.0 && far <= 1.0
    }

    /// Side-local coordinates of the projection of a point on the side's plane.
    fn local(&self, point: DVec3) -> [f64; 2] {
        let [u, v] = self.edges;
        let d = point - self.origin;
        let n = u.cross(v);
        let inverse = 1.0 / n.length_squared();
        [v.cross(n).dot(d) * inverse, n.cross(u).dot(d) * inverse]
    }

    /// Side-local coordinates of the point of the side that is closest to `point`.
    pub fn closest(&self, point: DVec3) -> [f64; 2] {
        if self.holds(point) {
            return self.local(point);
        }
        let [u, v] = self.edges;
        let triangle = self.shape == CellShape::Triangle;
        // the closest point of each edge, in local coordinates
        let edges: &[[[f64; 2]; 2]] = if triangle {
            &[[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [0.0, 1.0]], [[0.0, 1.0], [0.0, 0.0]]]
        } else {
            &[[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [1.0, 1.0]], [[1.0, 1.0], [0.0, 1.0]], [[0.0, 1.0], [0.0, 0.0]]]
        };
        let place = |x: [f64; 2]| self.origin + u * x[0] + v * x[1];
        let mut best = ([0.0; 2], f64::INFINITY);
        for [a, b] in edges {
            let (p, q) = (place(*a), place(*b));
            let k = ((point - p).dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
            let at = [a[0] + k * (b[0] - a[0]), a[1] + k * (b[1] - a[1])];
            let distance = place(at).distance(point);
            if distance < best.1 {
                best = (at, distance);
            }
        }
        best.0
    }
}
