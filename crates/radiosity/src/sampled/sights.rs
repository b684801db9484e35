//! The lamps as the points of a solution see them, remembered from point to point: of a leaf, or of a part of it where
//! too much stands before the lamps that the whole leaf sees.

use super::lamps::{Lamps, Seen, sums};
use crate::kernel::LightKernel;
use ondelette_compress::Cell;
use std::borrow::Cow;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Bytes that are remembered; what has no place there is found out at every point.
const REMEMBERED: usize = 128 << 20;
/// With more rays than these, a part of the leaf is looked from instead: less stands before the lamps that it sees.
const MANY_RAYS: f64 = 200.0;
/// Splits of a leaf that may be tried for it.
const DEEPER: u32 = 4;

/// What is seen from a cell, and with how many rays to the lamps that are left to rays.
#[derive(Clone, Debug)]
pub(super) struct Sight {
    pub(super) seen: Seen,
    /// Sums of the shares of these lamps.
    pub(super) sums: Vec<f64>,
    pub(super) rays: f64,
}

/// A sight, and those of the cell's parts.
#[derive(Debug)]
struct Node {
    sight: Sight,
    parts: OnceLock<Box<[OnceLock<Node>]>>,
}

/// The sights of all leaves.
#[derive(Debug)]
pub(super) struct Sights {
    leaves: Vec<OnceLock<Node>>,
    bytes: AtomicUsize,
}

impl Sights {
    /// None yet, of so many nodes of a forest.
    pub(super) fn new(nodes: usize) -> Self {
        Sights { leaves: (0..nodes).map(|_| OnceLock::new()).collect(), bytes: AtomicUsize::new(0) }
    }

    /// What is seen about the local point `x` of a leaf. `rays` says how many rays lamps call for that may bring so
    /// much. The same whatever is remembered.
    pub(super) fn about(
        &self,
        (lamps, kernel): (&Lamps, &LightKernel),
        (leaf, cell): (usize, &Cell),
        mut x: [f64; 2],
        rays: impl Fn(f64) -> f64,
    ) -> Cow<'_, Sight> {
        let mut place = Some(&self.leaves[leaf]);
        let mut part = *cell;
        loop {
            let look = || {
                let seen = lamps.seen_by(kernel, &part);
                let sums = sums(&seen.crowded);
                let rays = rays(seen.whole * sums.last().copied().unwrap_or(0.0));
                Sight { seen, sums, rays }
            };
            let (sight, node) = match place {
                Some(place) => match self.remember(place, look) {
                    Ok(node) => (Cow::Borrowed(&node.sight), Some(node)),
                    Err(sight) => (Cow::Owned(sight), None),
                },
                None => (Cow::Owned(look()), None),
            };
            let is_clear = sight.seen.crowded.is_empty() || sight.rays <= MANY_RAYS;
            if is_clear || part.depth >= cell.depth + DEEPER {
                return sight;
            }
            let (c, y) = part.shape.descend(x);
            (part, x) = (part.child(c), y);
            let empty = || (0..part.shape.arity()).map(|_| OnceLock::new()).collect();
            place = node.map(|node| &node.parts.get_or_init(empty)[c]);
        }
    }

    /// What a place remembers, or shall if there is room.
    fn remember<'a>(&self, place: &'a OnceLock<Node>, look: impl FnOnce() -> Sight) -> Result<&'a Node, Sight> {
        if let Some(node) = place.get() {
            return Ok(node);
        }
        let sight = look();
        let bytes = size_of::<Node>() + sight.seen.bytes() + size_of_val(&sight.sums[..]);
        if self.bytes.fetch_add(bytes, Ordering::Relaxed) > REMEMBERED {
            return Err(sight);
        }
        Ok(place.get_or_init(|| Node { sight, parts: OnceLock::new() }))
    }
}
