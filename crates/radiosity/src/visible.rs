//! What of a lamp a point sees: the lamp's polygon minus the shadows of what stands before it, in closed form.
//!
//! Seen from one point, polygons are cones, and the part of one convex cone outside another is at most as many convex
//! cones as the other has edges. So the visible part of a flat source behind flat blockers is a list of convex pieces
//! on the source's plane, cut by planes through the point: no projection, no division, no sampling. Lambert's formula
//! summed over the pieces is the exact irradiance, as sharp as the shadow itself (Atherton and Weiler 1978 for the
//! subtraction; Nishita and Nakamae 1983 for the irradiance).
//!
//! **Exact or sampled.** Each blocker adds a few pieces. Up to [`View::MOST_PIECES`] the answer is exact; blockers that
//! come after that are kept aside, and the share of every piece that they leave open is taken from
//! [`View::LATE_SAMPLES`] fixed points. Either way the answer is a function of the input alone.
//!
//! Shadows are grown by the `tolerance`, measured at the source: two blockers that share an edge, meet in a T, or leave
//! a crack below the tolerance let nothing through, exactly nothing.

use crate::form_factor::cone_factor;
use glam::DVec3;

/// The view from a point to one flat source: aimed once, blocked by any number of polygons, then read.
///
/// Holds the memory that it works in: make one a thread, and aim it again and again; then nothing is allocated.
///
/// ```
/// use glam::DVec3;
/// use ondelette_radiosity::visible::View;
/// let corners = [[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]];
/// let square = |half: f64, z: f64| corners.map(|[x, y]| DVec3::new(half * x, half * y, z));
/// let mut view = View::new(1e-9);
/// // a unit square one unit above, seen from under its centre: Howell B-3
/// assert!(view.aim(DVec3::ZERO, DVec3::Z, &square(0.5, 1.0)));
/// let whole = view.irradiance();
/// assert!((whole - 0.239456470460774).abs() < 1e-14);
/// // a square of a quarter of its side midway hides the middle quarter of its area
/// view.block(&square(0.125, 0.5));
/// let rim = view.irradiance();
/// view.aim(DVec3::ZERO, DVec3::Z, &square(0.25, 1.0));
/// assert!((rim - (whole - view.irradiance())).abs() < 1e-8);
/// // which is all that there is of this smaller source
/// view.block(&square(0.125, 0.5));
/// assert_eq!(view.irradiance(), 0.0);
/// ```
#[derive(Clone, Debug)]
pub struct View {
    tolerance: f64,
    point: DVec3,
    normal: DVec3,
    /// Normal of the source's front, and the distance of the point from its plane.
    source_normal: DVec3,
    height: f64,
    /// The source above the horizon, relative to the point, and the inward normals of the planes through the point and
    /// its edges; these are empty until they are asked for.
    source: Vec<DVec3>,
    outline: Vec<DVec3>,
    pieces: Pieces,
    next: Pieces,
    /// The blocker at hand: corners relative to the point, and the inward normals of the planes of its edges.
    cone: Vec<DVec3>,
    planes: Vec<DVec3>,
    /// Working memory of a cut.
    heights: Vec<f64>,
    inside: Vec<DVec3>,
    rest: Vec<DVec3>,
    /// Planes of the blockers that came too late to be exact.
    late: Pieces,
}

/// Convex polygons, one after the other in one array.
#[derive(Clone, Debug, Default)]
struct Pieces {
    corners: Vec<DVec3>,
    ends: Vec<usize>,
}

impl Pieces {
    fn clear(&mut self) {
        self.corners.clear();
        self.ends.clear();
    }

    fn push(&mut self, corners: &[DVec3]) {
        self.corners.extend_from_slice(corners);
        self.ends.push(self.corners.len());
    }

    fn get(&self, k: usize) -> &[DVec3] {
        let from = if k == 0 { 0 } else { self.ends[k - 1] };
        &self.corners[from..self.ends[k]]
    }

    fn iter(&self) -> impl Iterator<Item = &[DVec3]> {
        (0..self.ends.len()).map(|k| self.get(k))
    }

    fn truncate(&mut self, pieces: usize) {
        self.ends.truncate(pieces);
        self.corners.truncate(self.ends.last().copied().unwrap_or(0));
    }
}

/// Fixed points of a piece where late blockers are looked for.
const LATE_SAMPLES: usize = 16;

impl View {
    /// Pieces up to which the visible part is exact.
    pub const MOST_PIECES: usize = 192;
    /// Points of each piece at which blockers beyond [`View::MOST_PIECES`] are looked for.
    pub const LATE_SAMPLES: usize = LATE_SAMPLES;

    /// A view that counts points closer than `tolerance` as one (in scene units, finite, not negative; see
    /// [`crate::occluder::Occluders::tolerance`]).
    pub fn new(tolerance: f64) -> Self {
        View {
            tolerance: if tolerance >= 0.0 { tolerance } else { 0.0 },
            point: DVec3::ZERO,
            normal: DVec3::Z,
            source_normal: DVec3::Z,
            height: 0.0,
            source: Vec::new(),
            outline: Vec::new(),
            pieces: Pieces::default(),
            next: Pieces::default(),
            cone: Vec::new(),
            planes: Vec::new(),
            heights: Vec::new(),
            inside: Vec::new(),
            rest: Vec::new(),
            late: Pieces::default(),
        }
    }

    /// Looks from `point`, whose unit normal is `normal`, at a convex `source` (corners counter-clockwise from its
    /// front), and forgets all blockers. Whether any of it is above the point's horizon and shows its front.
    ///
    /// **Cost** some 20 ns.
    pub fn aim(&mut self, point: DVec3, normal: DVec3, source: &[DVec3]) -> bool {
        self.pieces.clear();
        self.late.clear();
        self.outline.clear();
        self.point = point;
        self.normal = normal;
        let Some(&first) = source.first() else { return false };
        let area = area_vector(source);
        self.source_normal = area / area.length();
        self.height = self.source_normal.dot(point - first);
        // a source without area has a normal that is not a number, and is not seen either
        if self.height.is_nan() || self.height <= self.tolerance {
            return false;
        }
        self.cone.clear();
        self.cone.extend(source.iter().map(|c| *c - point));
        clip(&mut self.cone, &mut self.rest, normal, 0.0, self.tolerance);
        if self.cone.len() < 3 {
            return false;
        }
        self.pieces.push(&self.cone);
        self.source.clone_from(&self.cone);
        true
    }

    /// Takes away what the convex polygon `blocker` (corners in order, either way round) hides: the shadow of its part
    /// above the point's horizon and on this side of the source. The source's and the point's own surfaces, and what
    /// lies in the same plane, hide nothing.
    ///
    /// **Cost** some 100 ns for one piece, in proportion to the pieces.
    pub fn block(&mut self, blocker: &[DVec3]) {
        if self.pieces.ends.is_empty() {
            return;
        }
        let (n, point, tolerance) = (self.normal, self.point, self.tolerance);
        self.cone.clear();
        self.cone.extend(blocker.iter().map(|c| *c - point));
        if self.is_beside() {
            return;
        }
        clip(&mut self.cone, &mut self.rest, n, 0.0, tolerance);
        clip(&mut self.cone, &mut self.rest, self.source_normal, self.height, tolerance);
        self.subtract();
    }

    /// Takes away a convex polygon in the plane of the source that covers it, such as a panel on a lamp.
    pub fn cover(&mut self, cover: &[DVec3]) {
        let (n, point) = (self.normal, self.point);
        self.cone.clear();
        self.cone.extend(cover.iter().map(|c| *c - point));
        clip(&mut self.cone, &mut self.rest, n, 0.0, self.tolerance);
        self.subtract();
    }

    /// Irradiance that a source of unit radiosity brings to the point: Lambert's closed form, summed over the visible
    /// parts.
    ///
    /// **Cost** some 20 ns a corner.
    pub fn irradiance(&self) -> f64 {
        self.pieces.iter().map(|piece| cone_factor(self.normal, piece) * self.open_share(piece)).sum()
    }

    /// Whether all of the source that is above the horizon is hidden.
    pub fn is_hidden(&self) -> bool {
        self.pieces.ends.is_empty()
    }

    /// Whether every blocker was taken exactly (see the module).
    pub fn is_exact(&self) -> bool {
        self.late.ends.is_empty()
    }

    /// Number of visible parts.
    pub fn len(&self) -> usize {
        self.pieces.ends.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.pieces.ends.is_empty()
    }

    /// The visible parts: convex polygons on the source's plane, corners **relative to the point**, in a fixed order.
    /// Where [`View::is_exact`] is false, blockers that came late are not cut out of them.
    pub fn parts(&self) -> impl Iterator<Item = &[DVec3]> {
        self.pieces.iter()
    }

    /// Whether `self.cone` lies beside the source, beyond one of its edges.
    fn is_beside(&mut self) -> bool {
        if self.outline.is_empty() {
            let centre: DVec3 = self.source.iter().sum();
            let mut a = self.source[self.source.len() - 1];
            for &b in &self.source {
                let n = a.cross(b);
                self.outline.push(if n.dot(centre) < 0.0 { -n } else { n });
                a = b;
            }
        }
        self.outline.iter().any(|plane| self.cone.iter().all(|p| plane.dot(*p) <= 0.0))
    }

    /// Takes `self.cone` out of every piece.
    fn subtract(&mut self) {
        if self.pieces.ends.is_empty() || !self.find_planes() {
            return;
        }
        if self.pieces.ends.len() > Self::MOST_PIECES {
            self.late.push(&self.planes);
            return;
        }
        self.next.clear();
        for k in 0..self.pieces.ends.len() {
            let piece = self.pieces.get(k);
            let before = self.next.ends.len();
            self.inside.clear();
            self.inside.extend_from_slice(piece);
            for plane in &self.planes {
                let (mut out, mut within) = (false, false);
                self.heights.clear();
                for p in &self.inside {
                    let h = plane.dot(*p) + self.tolerance;
                    out |= h < 0.0;
                    within |= h > 0.0;
                    self.heights.push(h);
                }
                if !within {
                    // no part of the piece is hidden: what was cut off belongs to it after all
                    self.next.truncate(before);
                    self.inside.clear();
                    break;
                }
                if out {
                    self.rest.clear();
                    split(&self.inside, &self.heights, &mut self.next.corners, &mut self.rest);
                    self.next.ends.push(self.next.corners.len());
                    std::mem::swap(&mut self.inside, &mut self.rest);
                }
            }
            if self.inside.is_empty() {
                self.next.push(piece);
            }
        }
        std::mem::swap(&mut self.pieces, &mut self.next);
    }

    /// The planes through the point and the edges of `self.cone`, normals inwards; false if it has no width from there.
    fn find_planes(&mut self) -> bool {
        self.planes.clear();
        let Some(&first) = self.cone.first() else { return false };
        let area = area_vector(&self.cone);
        let volume = area.dot(first);
        // the point lies in the blocker's plane: it is seen edge-on
        if volume.is_nan() || volume.abs() <= self.tolerance * area.length() {
            return false;
        }
        let sign = volume.signum();
        let mut a = self.cone[self.cone.len() - 1];
        for &b in &self.cone {
            let n = a.cross(b);
            let length = n.length();
            // corners that are one point make no plane
            if length > 1e-14 * (a.length_squared() + b.length_squared()) {
                self.planes.push(n * (sign / length));
            }
            a = b;
        }
        self.planes.len() >= 3
    }

    /// The share of a piece that late blockers leave open.
    fn open_share(&self, piece: &[DVec3]) -> f64 {
        if self.late.ends.is_empty() {
            return 1.0;
        }
        let hidden = |y: DVec3| self.late.iter().any(|planes| planes.iter().all(|p| p.dot(y) > -self.tolerance));
        let (mut open, mut whole) = (0.0, 0.0);
        let (corner, fans) = (piece[0], piece.len() - 2);
        for i in 0..LATE_SAMPLES.max(fans) {
            let [u, v] = [piece[i % fans + 1] - corner, piece[i % fans + 2] - corner];
            let y = corner + spread(i, u, v);
            let weight = u.cross(v).length() * self.normal.dot(y).max(0.0) / y.length_squared().powi(2);
            whole += weight;
            open += if hidden(y) { 0.0 } else { weight };
        }
        if whole > 0.0 { open / whole } else { 0.0 }
    }
}

/// The i-th of a well-spread sequence of points of a triangle with edges u and v (R2, Roberts 2018).
fn spread(i: usize, u: DVec3, v: DVec3) -> DVec3 {
    let at = |alpha: f64| (0.5 + alpha * (i + 1) as f64).fract();
    let (s, t) = (at(0.754_877_666_246_692_8), at(0.569_840_290_998_053_3));
    if s + t > 1.0 { u * (1.0 - s) + v * (1.0 - t) } else { u * s + v * t }
}

/// Twice the area times the normal.
fn area_vector(corners: &[DVec3]) -> DVec3 {
    (1..corners.len().saturating_sub(1)).map(|i| (corners[i] - corners[0]).cross(corners[i + 1] - corners[0])).sum()
}

/// Keeps the part of a convex polygon where normal . p + offset is positive. Corners within the tolerance of that plane
/// are moved onto it, so that a wall on a floor leaves no slit; a polygon that is nowhere above it by more disappears.
fn clip(polygon: &mut Vec<DVec3>, spare: &mut Vec<DVec3>, normal: DVec3, offset: f64, tolerance: f64) {
    let (mut above, mut below) = (false, false);
    for p in polygon.iter_mut() {
        let h = normal.dot(*p) + offset;
        if h.abs() <= tolerance {
            *p -= normal * h;
        } else {
            above |= h > 0.0;
            below |= h < 0.0;
        }
    }
    if !above {
        polygon.clear();
    }
    if !above || !below {
        return;
    }
    spare.clear();
    let height = |p: DVec3| normal.dot(p) + offset;
    let mut a = polygon[polygon.len() - 1];
    let mut ha = height(a);
    for &b in polygon.iter() {
        let hb = height(b);
        if (ha > tolerance && hb < -tolerance) || (ha < -tolerance && hb > tolerance) {
            spare.push(a + (b - a) * (ha / (ha - hb)));
        }
        // moved corners are at 0 but for rounding
        if hb >= -tolerance {
            spare.push(b);
        }
        (a, ha) = (b, hb);
    }
    std::mem::swap(polygon, spare);
}

/// Cuts a convex polygon where the heights of its corners change sign; appends the part below and the part above 0.
fn split(polygon: &[DVec3], heights: &[f64], below: &mut Vec<DVec3>, above: &mut Vec<DVec3>) {
    let last = polygon.len() - 1;
    let (mut a, mut ha) = (polygon[last], heights[last]);
    for (&b, &hb) in polygon.iter().zip(heights) {
        if (ha > 0.0) != (hb > 0.0) {
            let cut = a + (b - a) * (ha / (ha - hb));
            below.push(cut);
            above.push(cut);
        }
        if hb > 0.0 {
            above.push(b);
        } else {
            below.push(b);
        }
        (a, ha) = (b, hb);
    }
}

/// The parts of a source that a point sees past some blockers, in scene coordinates; see [`View`] for the meaning, and
/// for the way that allocates nothing.
pub fn visible_parts(x: DVec3, n: DVec3, source: &[DVec3], blockers: &[&[DVec3]], tolerance: f64) -> Vec<Vec<DVec3>> {
    let view = seen(x, n, source, blockers, tolerance);
    view.parts().map(|part| part.iter().map(|p| *p + x).collect()).collect()
}

/// Irradiance at a point with unit normal `n` from a source of unit radiosity past some blockers; see [`View`].
///
/// ```
/// use glam::DVec3;
/// use ondelette_radiosity::visible::irradiance_from;
/// let lamp = [[0., 1.], [1., 1.], [1., 0.], [0., 0.]].map(|[x, y]| DVec3::new(x, y, 1.0));
/// let e = irradiance_from(DVec3::ZERO, DVec3::Z, &lamp, &[], 1e-9);
/// assert!((e - 0.138531605994893).abs() < 1e-14); // Howell B-3
/// ```
pub fn irradiance_from(x: DVec3, n: DVec3, source: &[DVec3], blockers: &[&[DVec3]], tolerance: f64) -> f64 {
    seen(x, n, source, blockers, tolerance).irradiance()
}

fn seen(x: DVec3, n: DVec3, source: &[DVec3], blockers: &[&[DVec3]], tolerance: f64) -> View {
    let mut view = View::new(tolerance);
    view.aim(x, n, source);
    blockers.iter().for_each(|b| view.block(b));
    view
}
