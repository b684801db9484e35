//! Pairs of coplanar triangles that make a parallelogram become one patch.
//!
//! Exporters cut every rectangle in two; light on a rectangle wants one element tree, not two that meet at a diagonal
//! that is not there. Two triangles may merge when they belong to one object and one material, run along a shared
//! edge in opposite directions (so they face the same way), agree in texture coordinates along it, and their union
//! closes as a parallelogram.

use super::polygon::is_parallelogram;
use glam::DVec3;
use std::collections::HashMap;

/// A triangle waiting for its partner.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// Corners.
    pub(super) corners: [DVec3; 3],
    /// Texture coordinates of both sets at the corners.
    pub(super) uv: [Option<[[f64; 2]; 3]>; 2],
    /// Object and material: only equal ones merge.
    pub(super) group: (u32, u32),
    /// Face of the file.
    pub(super) face: u32,
}

/// Two pieces that make a parallelogram: which corner of the first starts the shared edge, and which corner of the
/// second lies opposite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pair {
    /// The earlier piece and the corner at which its shared edge starts.
    pub(super) first: (u32, usize),
    /// The later piece and its corner off the shared edge.
    pub(super) second: (u32, usize),
}

/// Triangles on one directed edge beyond this many are not tried (a fan of thousands of sheets on one edge would
/// otherwise cost the square of their number).
const SHEETS: usize = 4;

/// Finds pairs greedily, most rectangular first, then in file order.
///
/// **Cost** O(n log n) in the number of pieces.
pub(super) fn pairs(pieces: &[Piece]) -> Vec<Pair> {
    type Edge = ((u32, u32), [u64; 3], [u64; 3]);
    let edge = |p: &Piece, i: usize| -> Edge { (p.group, bits(p.corners[i]), bits(p.corners[(i + 1) % 3])) };
    let mut sheets: HashMap<Edge, Vec<(u32, usize)>> = HashMap::with_capacity(3 * pieces.len());
    let mut found: Vec<(u32, Pair)> = Vec::new();
    for (n, piece) in (0u32..).zip(pieces) {
        for i in 0..3 {
            let (group, a, b) = edge(piece, i);
            for &(m, j) in sheets.get(&(group, b, a)).map_or(&[][..], |v| v) {
                let other = &pieces[m as usize];
                if let Some(skew) = fit(other, j, piece, i) {
                    found.push((skew, Pair { first: (m, j), second: (n, (i + 2) % 3) }));
                }
            }
        }
        for i in 0..3 {
            let list = sheets.entry(edge(piece, i)).or_default();
            if list.len() < SHEETS {
                list.push((n, i));
            }
        }
    }
    found.sort_by_key(|(skew, pair)| (*skew, pair.first, pair.second));
    let mut taken = vec![false; pieces.len()];
    let mut kept = Vec::new();
    for (_, pair) in found {
        let (a, b) = (pair.first.0 as usize, pair.second.0 as usize);
        if !taken[a] && !taken[b] {
            taken[a] = true;
            taken[b] = true;
            kept.push(pair);
        }
    }
    kept.sort_by_key(|pair| pair.first);
    kept
}

/// Whether the pieces merge across edge `j` of `p` and edge `i` of `q`; if so, how far from a rectangle the result is
/// (|cosine| of its angle in thousandths, so that rounding does not decide the order).
fn fit(p: &Piece, j: usize, q: &Piece, i: usize) -> Option<u32> {
    let at = |k: usize| k % 3;
    for set in 0..2 {
        match (&p.uv[set], &q.uv[set]) {
            (None, None) => {}
            (Some(u), Some(w)) if u[j] == w[at(i + 1)] && u[at(j + 1)] == w[i] => {}
            _ => return None,
        }
    }
    let quad = [p.corners[j], q.corners[at(i + 2)], p.corners[at(j + 1)], p.corners[at(j + 2)]];
    if !is_parallelogram(&quad) {
        return None;
    }
    let (u, v) = (quad[1] - quad[0], quad[3] - quad[0]);
    let cosine = u.dot(v).abs() / (u.length() * v.length());
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cosine in thousandths fits")]
    Some((1000.0 * cosine).round() as u32)
}

/// Exact identity of a corner (zero has one sign).
pub(super) fn bits(c: DVec3) -> [u64; 3] {
    [c.x, c.y, c.z].map(|x| if x == 0.0 { 0 } else { x.to_bits() })
}
