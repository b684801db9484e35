//! Coplanar faces that face the same way: a carpet on a floor, a panel on a wall, a decal.
//!
//! No ray separates them, so the order of the file decides: of two such faces the later one covers the earlier, which
//! is dark there and sends nothing out. Without this rule both would receive, and both reflect, the same light.

use super::SideFrame;
use crate::form_factor::Polygon;
use crate::occluder::Occluders;
use glam::DVec3;

/// Directions closer than this are the same (1 minus cosine).
const PARALLEL: f64 = 1e-9;
/// Overlaps smaller than this share of the covered side are neighbours that touch.
const TOUCHING: f64 = 1e-6;

/// For each side, the later sides that cover parts of it. Cost O(n log n) for scattered patches.
pub(super) fn covers(sides: &[SideFrame], of_patch: &[[Option<u32>; 2]], occluders: &Occluders) -> Vec<Vec<u32>> {
    let tolerance = occluders.tolerance();
    sides
        .iter()
        .map(|side| {
            let [u, v] = side.edges;
            let radius = 0.5 * (u.length() + v.length());
            let middle = side.origin + (u + v) * 0.5;
            let near = occluders.near(middle, radius);
            let later = near.into_iter().filter(|&p| p > side.patch).flat_map(|p| of_patch[p as usize]).flatten();
            let covering = later.filter(|&other| {
                let top = &sides[other as usize];
                top.normal.dot(side.normal) > 1.0 - PARALLEL
                    && side.normal.dot(top.origin - side.origin).abs() <= tolerance
                    && overlap(side, top) > TOUCHING * side.area
            });
            covering.collect()
        })
        .collect()
}

/// Area of the overlap of two coplanar sides.
fn overlap(a: &SideFrame, b: &SideFrame) -> f64 {
    let mut part = Polygon::new(&a.corners());
    let corners = b.corners();
    for i in 0..corners.len() {
        let (p, q) = (corners[i], corners[(i + 1) % corners.len()]);
        part = part.clipped(p, b.normal.cross(q - p));
    }
    let c = part.corners();
    let fan = |i: usize| (c[i] - c[0]).cross(c[i + 1] - c[0]);
    0.5 * (1..c.len().saturating_sub(1)).map(fan).sum::<DVec3>().length()
}
