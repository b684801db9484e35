//! What blocks light: rays and shafts against all patches, through a bounding volume hierarchy (crate obvhs).
//!
//! The hierarchy only finds candidates, in f32 boxes grown by a margin; every hit is decided in f64 on the exact patch.
//! It lives in coordinates in which the scene has diagonal 1 and its centre at 0, so that no unit of length is better
//! than another.
//! A patch blocks from both sides. Self-hits are excluded by patch index, not by moving the ray.

use crate::scene::{Patch, Scene, Shape};
use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::cwbvh::CwBvh;
use obvhs::ray::{Ray, RayHit};
use obvhs::{Boundable, BvhBuildParams};

/// A patch ready for intersection.
#[derive(Clone, Copy, Debug)]
struct Facet {
    normal: DVec3,
    origin: DVec3,
    /// Rows that turn a point of the plane into (s, t).
    to_s: DVec3,
    to_t: DVec3,
    /// How far s, t and, on triangles, s + t may lie outside.
    edge: [f64; 3],
    triangle: bool,
}

/// Edges count as part of a patch, and so does a rim of this share of the scene's diagonal: neighbours leave no gap
/// between them, even if single precision or the digits of a text file have moved their corners apart.
const EDGE: f64 = 1e-7;

impl Facet {
    /// A patch with a rim of the given width.
    fn of(patch: &Patch, rim: f64) -> Self {
        let normal = patch.u.cross(patch.v);
        let inverse = 1.0 / normal.length_squared();
        let (to_s, to_t) = (patch.v.cross(normal) * inverse, normal.cross(patch.u) * inverse);
        Facet {
            normal: normal.normalize(),
            origin: patch.origin,
            to_s,
            to_t,
            // a needle's rim is not wider than the needle
            edge: [to_s, to_t, to_s + to_t].map(|d| (rim * d.length()).min(0.5)),
            triangle: patch.shape == Shape::Triangle,
        }
    }

    /// Parameter along the segment a + t (b - a) of the crossing with the patch.
    fn crossing(&self, a: DVec3, d: DVec3) -> Option<f64> {
        let slope = self.normal.dot(d);
        if slope == 0.0 {
            return None;
        }
        let t = self.normal.dot(self.origin - a) / slope;
        self.holds(a + d * t - self.origin).then_some(t)
    }

    /// Whether a point of the plane, seen from the corner, lies on the patch or its rim.
    #[inline]
    fn holds(&self, p: DVec3) -> bool {
        let (u, v) = (self.to_s.dot(p), self.to_t.dot(p));
        let [rim_u, rim_v, rim_sum] = self.edge;
        let far = if self.triangle { u + v <= 1.0 + rim_sum } else { (u <= 1.0 + rim_u) & (v <= 1.0 + rim_v) };
        (u >= -rim_u) & (v >= -rim_v) & far
    }
}

struct Bounded(Aabb);

impl Boundable for Bounded {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// Where a ray meets a patch first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index into [`Scene::patches`].
    pub patch: u32,
    /// Distance in units of the direction's length.
    pub t: f64,
    /// Patch parameters (s, t) of the point.
    pub at: [f64; 2],
    /// Whether the ray arrived at the front.
    pub front: bool,
}

/// All patches of a scene, for rays and shafts.
pub struct Occluders {
    facets: Vec<Facet>,
    corners: Vec<Vec<DVec3>>,
    wide: CwBvh,
    binary: Bvh2,
    centre: DVec3,
    scale: f64,
    /// Distances below this, in diagonals, are rounding of coordinates.
    rounding: f64,
}

/// Segments end this share of their length before they reach what they aim at.
const RELATIVE_EPSILON: f64 = 1e-6;
/// A ray meets nothing closer than this, in diagonals.
const LEAST: f64 = 1e-11;
/// Hits closer than this, in diagonals, are at the same place.
const TIE: f64 = 1e-9;
/// Margin of the boxes, in units of the scene's diagonal: above the rounding of f32 rays.
const MARGIN: f32 = 1e-6;
/// The wide hierarchy overlooks boxes that end before t = 1e-4, so its rays start this much earlier.
const RUN_UP: f64 = 2e-4;

fn narrow(v: DVec3) -> Vec3A {
    Vec3A::new(v.x as f32, v.y as f32, v.z as f32)
}

fn widen(v: Vec3A) -> DVec3 {
    DVec3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

impl Occluders {
    /// Bytes of patches and hierarchies.
    pub fn bytes(&self) -> u64 {
        // and what the allocator adds to each
        let corners: usize = self.corners.iter().map(|c| size_of_val(c) + size_of_val(&**c) + 16).sum();
        let wide = size_of_val(&*self.wide.nodes) + size_of_val(&*self.wide.primitive_indices);
        let binary = &self.binary;
        let indices = [&binary.primitive_indices, &binary.primitives_to_nodes, &binary.parents];
        let binary = size_of_val(&*binary.nodes) + indices.map(|i| size_of_val(&**i)).iter().sum::<usize>();
        (size_of_val(&*self.facets) + corners + wide + binary) as u64
    }

    /// Builds the hierarchy. Cost O(n log n).
    pub fn new(scene: &Scene) -> Self {
        let scale = scene.diagonal();
        let centre = 0.5 * (scene.bounds[0] + scene.bounds[1]);
        let farthest = scene.bounds[0].abs().max(scene.bounds[1].abs()).max_element();
        let rounding = (16.0 * f64::EPSILON * farthest / scale).max(LEAST);
        let corners: Vec<Vec<DVec3>> = scene.patches.iter().map(Patch::corners).collect();
        let boxes: Vec<Bounded> = corners
            .iter()
            .map(|c| {
                let low = c.iter().fold(DVec3::INFINITY, |a, b| a.min(*b));
                let high = c.iter().fold(DVec3::NEG_INFINITY, |a, b| a.max(*b));
                let unit = |v: DVec3| narrow((v - centre) / scale);
                Bounded(Aabb::new(unit(low) - MARGIN, unit(high) + MARGIN))
            })
            .collect();
        let mut spent = std::time::Duration::ZERO;
        let params = BvhBuildParams { pre_split: false, ..BvhBuildParams::very_slow_build() };
        Occluders {
            facets: scene.patches.iter().map(|patch| Facet::of(patch, EDGE * scale)).collect(),
            corners,
            wide: obvhs::cwbvh::builder::build_cwbvh(&boxes, params, &mut spent),
            binary: obvhs::bvh2::builder::build_bvh2(&boxes, params, &mut spent),
            centre,
            scale,
            rounding,
        }
    }

    /// The ray from + t direction in the hierarchy's coordinates, with its run-up; t is `RUN_UP` larger there.
    fn ray(&self, from: DVec3, direction: DVec3, most: f32) -> Ray {
        let d = direction / self.scale;
        Ray::new(narrow((from - self.centre) / self.scale - d * RUN_UP), narrow(d), 0.0, most)
    }

    /// Box of a node in scene coordinates.
    fn world(&self, aabb: &Aabb) -> (DVec3, DVec3) {
        (widen(aabb.min) * self.scale + self.centre, widen(aabb.max) * self.scale + self.centre)
    }

    /// Length below which two points count as one: 1e-7 of the scene's diagonal.
    pub fn tolerance(&self) -> f64 {
        1e-7 * self.scale
    }

    /// Corners of a patch, counter-clockwise from its front.
    pub fn corners(&self, patch: u32) -> &[DVec3] {
        &self.corners[patch as usize]
    }

    /// Whether anything but the two given patches lies between two points.
    pub fn blocked(&self, from: DVec3, to: DVec3, except: [u32; 2]) -> bool {
        let d = to - from;
        let ray = self.ray(from, d, 1.001);
        !self.wide.ray_traverse_miss(ray, |_, id| {
            let patch = self.wide.primitive_indices[id];
            if patch == except[0] || patch == except[1] {
                return f32::INFINITY;
            }
            match self.facets[patch as usize].crossing(from, d) {
                Some(t) if t > RELATIVE_EPSILON && t < 1.0 - RELATIVE_EPSILON => 0.5,
                _ => f32::INFINITY,
            }
        })
    }

    /// The first patch along a ray, leaving out what `skips(patch, hit from the front)` says (where the ray starts;
    /// backs that cameras look through).
    pub fn first_hit(&self, from: DVec3, direction: DVec3, skips: impl Fn(u32, bool) -> bool) -> Option<Hit> {
        // one diagonal long, so that t is in diagonals inside the hierarchy
        let stretch = self.scale / direction.length();
        let ray = self.ray(from, direction * stretch, f32::INFINITY);
        // where the ray starts is skipped by name, so this only has to beat rounding
        let least = self.rounding * stretch;
        let (tie, shrink) = (TIE * stretch, 1.0 / stretch);
        let mut nearest: Option<(f64, bool, u32)> = None;
        let mut hit = RayHit::none();
        self.wide.ray_traverse(ray, &mut hit, |_, id| {
            let patch = self.wide.primitive_indices[id];
            let facet = &self.facets[patch as usize];
            let slope = facet.normal.dot(direction);
            let front = slope < 0.0;
            if slope == 0.0 || skips(patch, front) {
                return f32::INFINITY;
            }
            let from_corner = from - facet.origin;
            let t = -facet.normal.dot(from_corner) / slope;
            // of two faces at the same place the one whose front is met counts, then the later one, which covers the
            // earlier, whatever the order of traversal
            let better = |(best, best_front, at): (f64, bool, u32)| {
                let tie = (t - best).abs() <= tie;
                if tie { (front, patch) > (best_front, at) } else { t < best }
            };
            if t <= least || !nearest.is_none_or(better) || !facet.holds(from_corner + direction * t) {
                return f32::INFINITY;
            }
            nearest = Some((t, front, patch));
            // a little farther than it is, so that rounding to f32 hides nothing in front of it
            ((t * shrink + RUN_UP) * (1.0 + 1e-6)) as f32
        });
        let (t, front, patch) = nearest?;
        let facet = &self.facets[patch as usize];
        let p = from + direction * t - facet.origin;
        let at = [facet.to_s.dot(p).clamp(0.0, 1.0), facet.to_t.dot(p).clamp(0.0, 1.0)];
        Some(Hit { patch, t, at, front })
    }

    /// All patches whose boxes come within `radius` of a point, ascending.
    pub fn near(&self, point: DVec3, radius: f64) -> Vec<u32> {
        let mut found = Vec::new();
        let mut stack = if self.binary.nodes.is_empty() { Vec::new() } else { vec![0u32] };
        while let Some(n) = stack.pop() {
            let node = &self.binary.nodes[n as usize];
            let (low, high) = self.world(&node.aabb);
            let nearest = point.clamp(low, high);
            if nearest.distance(point) > radius {
                continue;
            }
            if node.prim_count == 0 {
                stack.push(node.first_index);
                stack.push(node.first_index + 1);
            } else {
                let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
                found.extend_from_slice(&self.binary.primitive_indices[range]);
            }
        }
        found.sort_unstable();
        found
    }

    /// Patches that may reach into the shaft, without the two given ones: all of them, or more than `most`.
    pub fn candidates(&self, shaft: &Shaft, except: [u32; 2], most: usize) -> Vec<u32> {
        let mut found = Vec::new();
        if self.binary.nodes.is_empty() {
            return found;
        }
        let mut stack = vec![0u32];
        while let Some(n) = stack.pop().filter(|_| found.len() <= most) {
            let node = &self.binary.nodes[n as usize];
            let (low, high) = self.world(&node.aabb);
            if shaft.misses_box(low, high) {
                continue;
            }
            if node.prim_count == 0 {
                stack.push(node.first_index);
                stack.push(node.first_index + 1);
                continue;
            }
            for k in node.first_index..node.first_index + node.prim_count {
                let patch = self.binary.primitive_indices[k as usize];
                if patch != except[0] && patch != except[1] && !shaft.misses_polygon(&self.corners[patch as usize]) {
                    found.push(patch);
                }
            }
        }
        found
    }

    /// Whether one patch, not among the given ones, hides one convex polygon from another all by itself: it crosses
    /// every segment between their corners. Then it crosses that between their middles, so that one ray finds it.
    pub fn hides(&self, from: &[DVec3], to: &[DVec3], except: [u32; 2]) -> bool {
        let middle = |polygon: &[DVec3]| polygon.iter().sum::<DVec3>() / polygon.len() as f64;
        let within = |t: f64| t > RELATIVE_EPSILON && t < 1.0 - RELATIVE_EPSILON;
        let a = middle(from);
        !self.wide.ray_traverse_miss(self.ray(a, middle(to) - a, 1.001), |_, id| {
            let patch = self.wide.primitive_indices[id];
            let facet = &self.facets[patch as usize];
            let crosses = |a: DVec3, b: DVec3| facet.crossing(a, b - a).is_some_and(within);
            let hides = || from.iter().all(|&a| to.iter().all(|&b| crosses(a, b)));
            if !except.contains(&patch) && hides() { 0.5 } else { f32::INFINITY }
        })
    }
}

/// The convex hull of two convex polygons, as half-spaces (Haines and Wallace 1991, with exact planes).
pub struct Shaft {
    planes: Vec<(DVec3, f64)>,
    tolerance: f64,
}

impl Shaft {
    /// The shaft between two polygons, each seen from its front; space behind either plane is left out.
    pub fn between(a: &[DVec3], a_normal: DVec3, b: &[DVec3], b_normal: DVec3, tolerance: f64) -> Self {
        let mut planes = Vec::with_capacity(16);
        // a point p is outside where n . p > d
        planes.push((-a_normal, -a_normal.dot(a[0])));
        planes.push((-b_normal, -b_normal.dot(b[0])));
        for (edges, apexes) in [(a, b), (b, a)] {
            for i in 0..edges.len() {
                let (p, q) = (edges[i], edges[(i + 1) % edges.len()]);
                for &apex in apexes {
                    let n = (q - p).cross(apex - p);
                    let length = n.length();
                    if length <= 1e-12 * (q - p).length() * (apex - p).length() {
                        continue;
                    }
                    let n = n / length;
                    let d = n.dot(p);
                    let heights = || a.iter().chain(b).map(|c| n.dot(*c) - d);
                    if heights().all(|h| h <= tolerance) {
                        planes.push((n, d));
                    } else if heights().all(|h| h >= -tolerance) {
                        planes.push((-n, -d));
                    }
                }
            }
        }
        Shaft { planes, tolerance }
    }

    fn misses_box(&self, low: DVec3, high: DVec3) -> bool {
        self.planes.iter().any(|(n, d)| {
            let nearest = DVec3::new(
                if n.x > 0.0 { low.x } else { high.x },
                if n.y > 0.0 { low.y } else { high.y },
                if n.z > 0.0 { low.z } else { high.z },
            );
            n.dot(nearest) >= *d - self.tolerance
        })
    }

    fn misses_polygon(&self, corners: &[DVec3]) -> bool {
        self.planes.iter().any(|(n, d)| corners.iter().all(|c| n.dot(*c) >= *d - self.tolerance))
    }
}
