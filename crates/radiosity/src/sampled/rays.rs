//! Where the samples of rows arrive, eight bytes each: they are the bulk of what a solver holds.

use ondelette_compress::{Forest, NodeId};

/// One sample of a row: where on a leaf it arrives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ray {
    /// Leaf coordinates of its end, in steps of which the children of a leaf have twice as many: no split moves it.
    to: [u16; 2],
    /// The leaf met.
    leaf: u32,
}

impl Ray {
    /// A ray that meets nothing, or a black back.
    pub(super) const NOWHERE: Ray = Ray { to: [0; 2], leaf: Self::NO_LEAF };
    /// The leaf of such a ray.
    pub(super) const NO_LEAF: u32 = u32::MAX;

    pub(super) fn new(leaf: u32, to: [f64; 2]) -> Self {
        Ray { to: to.map(|x| (x * f64::from(u16::MAX) + 0.5) as u16), leaf }
    }

    /// Leaf coordinates of its end.
    pub(super) fn to(&self) -> [f64; 2] {
        self.to.map(|k| f64::from(k) * (1.0 / f64::from(u16::MAX)))
    }

    /// The leaf met, or [`Ray::NO_LEAF`].
    pub(super) fn leaf(&self) -> u32 {
        self.leaf
    }
}

/// Samples of some points, as many of each, in two halves: `[half][point][direction]`.
#[derive(Clone, Debug, Default)]
pub(super) struct Rays(Box<[Ray]>);

impl Rays {
    /// From both halves, `[point][direction]`.
    pub(super) fn of_halves([mut a, b]: [Vec<Ray>; 2]) -> Self {
        a.extend(b);
        Rays(a.into())
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Counted bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.0)
    }

    /// One half.
    pub(super) fn half(&self, half: usize) -> &[Ray] {
        let count = self.0.len() / 2;
        &self.0[half * count..(half + 1) * count]
    }

    /// Those of one of `points` points.
    pub(super) fn at(&self, half: usize, point: usize, points: usize) -> &[Ray] {
        let each = self.0.len() / (2 * points.max(1));
        &self.0[(half * points + point) * each..][..each]
    }

    /// Of `known` points, those of the `chosen` ones.
    pub(super) fn of(&self, chosen: &[usize], known: usize) -> Rays {
        let one = |half: usize| chosen.iter().flat_map(move |&p| self.at(half, p, known));
        Rays((0..2).flat_map(one).copied().collect())
    }

    /// Adds `fresh(half, point)` to what there is of `known` points; now there are `points`.
    pub(super) fn join<'a>(&mut self, known: usize, points: usize, fresh: impl Fn(usize, usize) -> &'a [Ray]) {
        let more: usize =
            (0..2).flat_map(|half| (0..points).map(move |p| (half, p))).map(|(h, p)| fresh(h, p).len()).sum();
        // not a byte more than is counted
        let mut all = Vec::with_capacity(self.0.len() + more);
        for half in 0..2 {
            for p in 0..points {
                if p < known {
                    all.extend_from_slice(self.at(half, p, known));
                }
                all.extend_from_slice(fresh(half, p));
            }
        }
        self.0 = all.into();
    }

    /// Follows rays whose leaf was split since.
    pub(super) fn relocate(&mut self, forest: &Forest) {
        for ray in self.0.iter_mut().filter(|ray| ray.leaf != Ray::NO_LEAF) {
            let id = NodeId(ray.leaf);
            if !forest.is_leaf(id) {
                let (leaf, x) = forest.locate_below(id, ray.to());
                *ray = Ray::new(leaf.0, x);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fresh_samples_join_those_of_their_point() {
        let ray = |leaf: u32| Ray::new(leaf, [0.25, 1.0]);
        let block: Vec<Vec<Ray>> = (0..12).map(|k| vec![ray(k), ray(100 + k)]).collect();
        let mut rays = Rays::default();
        rays.join(0, 2, |half, p| &block[2 * half + p]);
        rays.join(2, 2, |half, p| &block[4 + 2 * half + p][..1]);
        let leaves = |rays: &[Ray]| rays.iter().map(Ray::leaf).collect::<Vec<_>>();
        assert_eq!(leaves(rays.at(0, 1, 2)), [1, 101, 5]);
        assert_eq!(leaves(rays.at(1, 0, 2)), [2, 102, 6]);
        // a new point has all directions
        let all = [ray(7), ray(8), ray(9)];
        rays.join(2, 3, |_, p| if p == 2 { &all } else { &[] });
        assert_eq!(leaves(rays.at(1, 2, 3)), [7, 8, 9]);
        assert_eq!(leaves(rays.of(&[1, 2], 3).half(1)), [3, 103, 7, 7, 8, 9]);
        assert_eq!(rays.bytes(), 18 * 8);
    }

    #[test]
    fn splits_leave_ends_where_they_are() {
        let mut forest = Forest::new(ondelette_wavelet::cell::CellFamily::Multiwavelet, 2).unwrap();
        forest.add_root(ondelette_wavelet::cell::CellShape::Square, 1.0);
        let root = forest.roots()[0];
        let mut rays = Rays::of_halves([vec![Ray::new(root.0, [0.3, 0.8])], vec![Ray::NOWHERE]]);
        let before = rays.half(0)[0].to();
        let mut id = root;
        for _ in 0..5 {
            forest.split(id);
            rays.relocate(&forest);
            id = NodeId(rays.half(0)[0].leaf());
        }
        let now = forest.node(id).cell.to_root(rays.half(0)[0].to());
        assert!((0..2).all(|i| (now[i] - before[i]).abs() < 1e-12), "{now:?} {before:?}");
        assert_eq!(rays.half(1), [Ray::NOWHERE]);
    }
}
