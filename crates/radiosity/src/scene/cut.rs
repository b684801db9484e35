//! Patches cut along the walls that stand on them or run through them, so that no element lies in two rooms.
//!
//! Light on a patch is a polynomial on each element. A floor that runs under a wall from a bright room into a dark one
//! would carry light through with its elements, whatever the rays say. So where other patches touch or cross a patch
//! along lines that divide it, it is cut along these lines before anything is solved.
//!
//! What divides: the contacts that hang together, from outline to outline or in a loop. Of these only chains of some
//! length count ([`CHAIN`], [`LOOP`]): a table's legs stand on a floor too, and cutting it for each of them would cost
//! more than it gives.

use super::polygon::{is_parallelogram, is_thin};
use super::{Patch, Provenance, Shape};
use glam::{DVec2, DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;

/// Chains of contacts from outline to outline count from this share of the patch's length on.
const CHAIN: f64 = 0.1;
/// Loops of contacts that touch no outline count from this share on.
const LOOP: f64 = 0.5;
/// Points closer than this share of the scene's diagonal are one: what files round.
const TOLERANCE: f64 = 1e-6;
/// Most pieces of one patch.
const MOST_PIECES: usize = 256;

/// A contact on a patch: a piece of a line in its plane.
#[derive(Clone, Copy, Debug)]
struct Contact {
    ends: [DVec2; 2],
}

impl Contact {
    fn direction(&self) -> DVec2 {
        (self.ends[1] - self.ends[0]).normalize()
    }

    fn distance(&self, p: DVec2) -> f64 {
        let d = self.ends[1] - self.ends[0];
        let t = ((p - self.ends[0]).dot(d) / d.length_squared()).clamp(0.0, 1.0);
        (self.ends[0] + d * t).distance(p)
    }
}

/// Orthonormal coordinates in the plane of a patch.
struct Plane {
    origin: DVec3,
    axes: [DVec3; 2],
    normal: DVec3,
}

impl Plane {
    fn of(patch: &Patch) -> Self {
        let normal = patch.normal();
        let x = patch.u.normalize();
        Plane { origin: patch.origin, axes: [x, normal.cross(x)], normal }
    }

    fn flat(&self, p: DVec3) -> DVec2 {
        let d = p - self.origin;
        DVec2::new(self.axes[0].dot(d), self.axes[1].dot(d))
    }

    fn space(&self, p: DVec2) -> DVec3 {
        self.origin + self.axes[0] * p.x + self.axes[1] * p.y
    }
}

/// Cuts all patches along the contacts that divide them; how many were cut.
///
/// **Cost** O(n log n) for patches that touch few others.
pub(super) fn cut(patches: Vec<Patch>) -> (Vec<Patch>, usize) {
    let corners: Vec<Vec<DVec3>> = patches.iter().map(Patch::corners).collect();
    let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    for c in corners.iter().flatten() {
        bounds = [bounds[0].min(*c), bounds[1].max(*c)];
    }
    let scale = bounds[0].distance(bounds[1]);
    let index = Index::of(&corners, bounds);
    let mut near = Vec::new();
    let mut count = 0;
    let mut all = Vec::with_capacity(patches.len());
    for (k, patch) in patches.into_iter().enumerate() {
        index.touching(k, &mut near);
        let pieces =
            pieces(&patch, &corners[k], near.iter().map(|&q| corners[q as usize].as_slice()), scale * TOLERANCE);
        if pieces.len() <= 1 {
            all.push(patch);
            continue;
        }
        count += 1;
        all.extend(pieces.iter().flat_map(|piece| parts(piece)).map(|part| sub_patch(&patch, &part)));
    }
    (all, count)
}

/// The pieces of a patch, in space; one or none if nothing divides it.
fn pieces<'a>(
    patch: &Patch,
    corners: &[DVec3],
    others: impl Iterator<Item = &'a [DVec3]>,
    tolerance: f64,
) -> Vec<Vec<DVec3>> {
    let plane = Plane::of(patch);
    let outline: Vec<DVec2> = corners.iter().map(|c| plane.flat(*c)).collect();
    let found: Vec<Contact> = others.filter_map(|q| contact(&plane, &outline, q, tolerance)).collect();
    let contacts = dividing(&outline, found, tolerance);
    let mut pieces = vec![outline];
    for contact in &contacts {
        let mut next = Vec::with_capacity(pieces.len() + 1);
        for piece in pieces {
            match split(&piece, contact, tolerance) {
                Some(halves) if next.len() < MOST_PIECES => next.extend(halves),
                _ => next.push(piece),
            }
        }
        pieces = next;
    }
    pieces.iter().map(|piece| piece.iter().map(|p| plane.space(*p)).collect()).collect()
}

/// The line along which a polygon touches or crosses the inside of an outline.
fn contact(plane: &Plane, outline: &[DVec2], polygon: &[DVec3], tolerance: f64) -> Option<Contact> {
    let heights: Vec<f64> = polygon
        .iter()
        .map(|p| plane.normal.dot(*p - plane.origin))
        .map(|h| if h.abs() <= tolerance { 0.0 } else { h })
        .collect();
    let all = |f: fn(f64) -> bool| heights.iter().all(|h| f(*h));
    if all(|h| h > 0.0) || all(|h| h < 0.0) || all(|h| h == 0.0) {
        return None;
    }
    let mut ends = Vec::with_capacity(2);
    for i in 0..polygon.len() {
        let j = (i + 1) % polygon.len();
        let (p, q) = (polygon[i], polygon[j]);
        if heights[i] == 0.0 {
            ends.push(plane.flat(p));
        } else if heights[i] * heights[j] < 0.0 {
            ends.push(plane.flat(p + (q - p) * (heights[i] / (heights[i] - heights[j]))));
        }
    }
    let &[a, b] = ends.as_slice() else { return None };
    // the part of it within the outline
    let d = b - a;
    if d.length() <= tolerance {
        return None;
    }
    let (mut from, mut to, mut depth) = (0.0f64, 1.0f64, f64::INFINITY);
    for i in 0..outline.len() {
        let (p, q) = (outline[i], outline[(i + 1) % outline.len()]);
        let inward = (q - p).perp().normalize();
        let (ha, hb) = (inward.dot(a - p), inward.dot(b - p));
        if ha.max(hb) <= tolerance {
            return None;
        }
        depth = depth.min(ha.max(hb));
        if ha < 0.0 {
            from = from.max(ha / (ha - hb));
        } else if hb < 0.0 {
            to = to.min(ha / (ha - hb));
        }
    }
    ((to - from) * d.length() > 2.0 * tolerance && depth > tolerance)
        .then(|| Contact { ends: [a + d * from, a + d * to] })
}

/// Those contacts that divide the outline, the longest first. Cost O(m log m) for m short contacts.
fn dividing(outline: &[DVec2], contacts: Vec<Contact>, tolerance: f64) -> Vec<Contact> {
    let near = 4.0 * tolerance;
    let edges: Vec<Contact> =
        (0..outline.len()).map(|i| Contact { ends: [outline[i], outline[(i + 1) % outline.len()]] }).collect();
    let rim = |p: DVec2| edges.iter().any(|e| e.distance(p) <= near);
    let touching = touching(&contacts, near);
    // spurs, with an end that touches nothing, divide nothing
    let mut alive = vec![true; contacts.len()];
    let mut changed = true;
    while changed {
        changed = false;
        for (k, contact) in contacts.iter().enumerate() {
            let held = |p: DVec2| rim(p) || touching[k].iter().any(|&j| alive[j] && contacts[j].distance(p) <= near);
            if alive[k] && !contact.ends.iter().all(|p| held(*p)) {
                alive[k] = false;
                changed = true;
            }
        }
    }
    // contacts that hang together, and whether they reach far enough
    let size = extent(outline);
    let mut kept = Vec::new();
    for first in 0..contacts.len() {
        let (mut chain, mut stack) = (Vec::new(), vec![first]);
        while let Some(k) = stack.pop() {
            if std::mem::replace(&mut alive[k], false) {
                chain.push(k);
                stack.extend(&touching[k]);
            }
        }
        let ends: Vec<DVec2> = chain.iter().flat_map(|&k| contacts[k].ends).collect();
        let least = if ends.iter().any(|p| rim(*p)) { CHAIN } else { LOOP };
        if extent(&ends) >= least * size {
            kept.extend(chain.iter().map(|&k| contacts[k]));
        }
    }
    let length = |c: &Contact| c.ends[0].distance(c.ends[1]);
    kept.sort_by(|a, b| length(b).total_cmp(&length(a)));
    kept
}

/// For each contact those others that it touches.
fn touching(contacts: &[Contact], near: f64) -> Vec<Vec<usize>> {
    let touches = |a: &Contact, b: &Contact| {
        a.ends.iter().any(|p| b.distance(*p) <= near) || b.ends.iter().any(|p| a.distance(*p) <= near)
    };
    let low = |k: usize| contacts[k].ends[0].x.min(contacts[k].ends[1].x);
    let high = |k: usize| contacts[k].ends[0].x.max(contacts[k].ends[1].x);
    let mut order: Vec<usize> = (0..contacts.len()).collect();
    order.sort_by(|&a, &b| low(a).total_cmp(&low(b)));
    let mut all = vec![Vec::new(); contacts.len()];
    for (i, &a) in order.iter().enumerate() {
        for &b in order[i + 1..].iter().take_while(|&&b| low(b) <= high(a) + near) {
            if touches(&contacts[a], &contacts[b]) {
                all[a].push(b);
                all[b].push(a);
            }
        }
    }
    all
}

/// Twice the largest distance from the middle: the diagonal of a rectangle, however it is turned.
fn extent(points: &[DVec2]) -> f64 {
    let middle = points.iter().sum::<DVec2>() / points.len().max(1) as f64;
    2.0 * points.iter().map(|p| p.distance(middle)).fold(0.0, f64::max)
}

/// The two halves of a piece beside the line of a contact, if the contact runs through it.
fn split(piece: &[DVec2], contact: &Contact, tolerance: f64) -> Option<[Vec<DVec2>; 2]> {
    let (along, across) = (contact.direction(), contact.direction().perp());
    let start = contact.ends[0];
    let heights: Vec<f64> =
        piece.iter().map(|p| across.dot(*p - start)).map(|h| if h.abs() <= tolerance { 0.0 } else { h }).collect();
    if !heights.iter().any(|h| *h > 0.0) || !heights.iter().any(|h| *h < 0.0) {
        return None;
    }
    let (mut left, mut right, mut chord) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..piece.len() {
        let j = (i + 1) % piece.len();
        if heights[i] >= 0.0 {
            left.push(piece[i]);
        }
        if heights[i] <= 0.0 {
            right.push(piece[i]);
        }
        let at = if heights[i] == 0.0 {
            Some(piece[i])
        } else if heights[i] * heights[j] < 0.0 {
            let at = piece[i] + (piece[j] - piece[i]) * (heights[i] / (heights[i] - heights[j]));
            left.push(at);
            right.push(at);
            Some(at)
        } else {
            None
        };
        chord.extend(at.map(|p| along.dot(p - start)));
    }
    let (low, high) = chord.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), c| (l.min(*c), h.max(*c)));
    let length = contact.ends[0].distance(contact.ends[1]);
    let shared = high.min(length) - low.max(0.0);
    (shared > 4.0 * tolerance).then_some([left, right])
}

/// Parallelograms and triangles of a convex polygon.
fn parts(piece: &[DVec3]) -> Vec<Vec<DVec3>> {
    if <&[DVec3; 4]>::try_from(piece).is_ok_and(is_parallelogram) {
        return vec![piece.to_vec()];
    }
    (1..piece.len() - 1).map(|i| vec![piece[0], piece[i], piece[i + 1]]).filter(|t| !is_thin(t)).collect()
}

/// The patch of a triangle or parallelogram that is part of a patch.
fn sub_patch(whole: &Patch, corners: &[DVec3]) -> Patch {
    let (origin, u) = (corners[0], corners[1] - corners[0]);
    let v = corners[corners.len() - 1] - corners[0];
    let n = whole.u.cross(whole.v);
    let local = |p: DVec3| {
        let d = p - whole.origin;
        let scale = n.length_squared();
        [whole.v.cross(n).dot(d) / scale, n.cross(whole.u).dot(d) / scale]
    };
    let places = [origin, origin + u, origin + v, origin + u + v].map(local);
    let texture = |uv: &Option<[[f64; 2]; 4]>| {
        uv.map(|[a, b, c, d]| {
            places.map(|[s, t]| {
                [0, 1].map(|k| {
                    let plane = a[k] + s * (b[k] - a[k]) + t * (c[k] - a[k]);
                    if whole.shape == Shape::Triangle { plane } else { plane + s * t * (a[k] - b[k] - c[k] + d[k]) }
                })
            })
        })
    };
    Patch {
        shape: if corners.len() == 4 { Shape::Parallelogram } else { Shape::Triangle },
        origin,
        u,
        v,
        material: whole.material,
        provenance: Provenance {
            object: whole.provenance.object,
            faces: whole.provenance.faces.clone(),
            uv0: texture(&whole.provenance.uv0),
            uv1: texture(&whole.provenance.uv1),
        },
    }
}

/// Which patches' boxes touch.
struct Index {
    boxes: Vec<Aabb>,
    tree: Bvh2,
}

impl Index {
    fn of(corners: &[Vec<DVec3>], [low, high]: [DVec3; 2]) -> Self {
        let (centre, scale) = (0.5 * (low + high), low.distance(high).max(f64::MIN_POSITIVE));
        let narrow = |v: DVec3| Vec3A::new(v.x as f32, v.y as f32, v.z as f32);
        let boxes: Vec<Aabb> = corners
            .iter()
            .map(|c| {
                let low = c.iter().fold(DVec3::INFINITY, |a, b| a.min(*b));
                let high = c.iter().fold(DVec3::NEG_INFINITY, |a, b| a.max(*b));
                Aabb::new(narrow((low - centre) / scale) - 2e-6, narrow((high - centre) / scale) + 2e-6)
            })
            .collect();
        let mut spent = std::time::Duration::ZERO;
        let tree = obvhs::bvh2::builder::build_bvh2(
            &boxes,
            BvhBuildParams { pre_split: false, ..BvhBuildParams::fast_build() },
            &mut spent,
        );
        Index { boxes, tree }
    }

    /// The other boxes that touch a box, ascending.
    fn touching(&self, k: usize, found: &mut Vec<u32>) {
        found.clear();
        let own = &self.boxes[k];
        let mut stack = if self.tree.nodes.is_empty() { Vec::new() } else { vec![0u32] };
        while let Some(n) = stack.pop() {
            let node = &self.tree.nodes[n as usize];
            if !own.intersect_aabb(&node.aabb) {
                continue;
            }
            if node.prim_count == 0 {
                stack.extend([node.first_index, node.first_index + 1]);
                continue;
            }
            let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
            let inside = self.tree.primitive_indices[range].iter().copied();
            found.extend(inside.filter(|&q| q as usize != k && own.intersect_aabb(&self.boxes[q as usize])));
        }
        found.sort_unstable();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quad(corners: [[f64; 3]; 4]) -> Patch {
        let [o, a, _, b] = corners.map(DVec3::from);
        let uv = [[0.0, 0.0], [1.0, 0.0], [0.0, 2.0], [1.0, 2.0]];
        let provenance = Provenance { object: 0, faces: vec![3], uv0: Some(uv), uv1: None };
        Patch { shape: Shape::Parallelogram, origin: o, u: a - o, v: b - o, material: 0, provenance }
    }

    fn floor() -> Patch {
        quad([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]])
    }

    /// An upright wall over the line from a to b.
    fn upright(a: [f64; 2], b: [f64; 2]) -> Patch {
        quad([[a[0], a[1], 0.0], [b[0], b[1], 0.0], [b[0], b[1], 1.0], [a[0], a[1], 1.0]])
    }

    fn outline(points: &[[f64; 2]]) -> Vec<Patch> {
        (0..points.len()).map(|i| upright(points[i], points[(i + 1) % points.len()])).collect()
    }

    /// The parts of the floor under some walls.
    fn parts_of_floor(walls: Vec<Patch>) -> Vec<Patch> {
        let walls_count = walls.len();
        let (all, _) = cut(std::iter::once(floor()).chain(walls).collect());
        let parts: Vec<Patch> = all[..all.len() - walls_count].to_vec();
        let area: f64 = parts.iter().map(Patch::area).sum();
        assert!((area - 16.0).abs() < 1e-9 && parts.iter().all(|p| p.normal().dot(DVec3::Z) > 0.999_999), "{area}");
        parts
    }

    #[test]
    fn a_wall_across_makes_two_parallelograms_with_their_textures() {
        let parts = parts_of_floor(vec![upright([1.0, 0.0], [1.0, 4.0])]);
        assert_eq!(parts.len(), 2);
        for part in &parts {
            assert_eq!((part.shape, &part.provenance.faces), (Shape::Parallelogram, &vec![3]));
            let uv = part.provenance.uv0.unwrap();
            let places = [part.origin, part.origin + part.u, part.origin + part.v, part.origin + part.u + part.v];
            for (at, place) in uv.iter().zip(places) {
                assert!((at[0] - place.x / 4.0).abs() < 1e-12 && (at[1] - place.y / 2.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn what_divides_nothing_cuts_nothing() {
        let leg = outline(&[[1.0, 1.0], [1.05, 1.0], [1.05, 1.05], [1.0, 1.05]]);
        let leg_at_the_wall = outline(&[[0.0, 1.0], [0.05, 1.0], [0.05, 1.05], [0.0, 1.05]]);
        let spur = vec![upright([0.0, 2.0], [3.0, 2.0])];
        let along = vec![upright([0.0, 0.0], [4.0, 0.0])];
        let above: Vec<Patch> = vec![quad([[0.0, 2.0, 0.1], [4.0, 2.0, 0.1], [4.0, 2.0, 1.0], [0.0, 2.0, 1.0]])];
        let carpet = vec![quad([[1.0, 1.0, 0.0], [3.0, 1.0, 0.0], [3.0, 3.0, 0.0], [1.0, 3.0, 0.0]])];
        for walls in [leg, leg_at_the_wall, spur, along, above, carpet] {
            assert_eq!(parts_of_floor(walls).len(), 1);
        }
    }

    #[test]
    fn chains_and_loops_of_size_are_cut_out() {
        let corner = vec![upright([1.5, 0.0], [1.5, 2.0]), upright([1.5, 2.0], [0.0, 2.0])];
        assert_eq!(parts_of_floor(corner).len(), 3);
        let hall = outline(&[[0.5, 0.5], [3.0, 0.5], [3.0, 3.5], [0.5, 3.5]]);
        assert_eq!(parts_of_floor(hall).len(), 5);
        // a slanting wall leaves general quadrilaterals, which become triangles
        let slanting = parts_of_floor(vec![upright([1.0, 0.0], [2.0, 4.0])]);
        assert!(slanting.len() == 4 && slanting.iter().all(|p| p.shape == Shape::Triangle), "{}", slanting.len());
    }

    #[test]
    fn patches_that_cross_cut_each_other() {
        let upright = quad([[2.0, -1.0, -1.0], [2.0, 5.0, -1.0], [2.0, 5.0, 1.0], [2.0, -1.0, 1.0]]);
        let (all, count) = cut(vec![floor(), upright]);
        // the wall sticks out on both sides of the floor: the floor is divided, the wall is not
        assert_eq!((all.len(), count), (3, 1));
        let wide = quad([[2.0, 1.0, -1.0], [2.0, 3.0, -1.0], [2.0, 3.0, 1.0], [2.0, 1.0, 1.0]]);
        let (all, count) = cut(vec![floor(), wide]);
        assert_eq!((all.len(), count), (3, 1));
    }

    #[test]
    fn many_scattered_patches_are_left_alone() {
        let grid: Vec<Patch> = (0..400)
            .map(|k| {
                let (x, y) = (f64::from(k % 20), f64::from(k / 20));
                quad([[x, y, 0.0], [x + 1.0, y, 0.0], [x + 1.0, y + 1.0, 0.0], [x, y + 1.0, 0.0]])
            })
            .collect();
        let (all, count) = cut(grid.clone());
        assert_eq!((all == grid, count), (true, 0));
    }
}
