//! Where an element gathers: at a point at random in each of some equal parts, so that a mean over them has no bias.

use super::lamps::on_cell;
use ondelette_compress::Cell;
use ondelette_numerics::seed;
use ondelette_wavelet::cell::CellShape;

/// A point that gathers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    /// Element coordinates.
    pub(super) at: [f64; 2],
    /// Key of its directions.
    pub(super) key: u64,
}

/// Which of up to 64 points are marked.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Marks(u64);

impl Marks {
    /// Whether a point is.
    pub(super) fn has(self, point: usize) -> bool {
        self.0 >> point & 1 == 1
    }

    /// Marks one.
    pub(super) fn add(&mut self, point: usize) {
        self.0 |= 1 << point;
    }

    /// How many are.
    pub(super) fn count(self) -> usize {
        self.0.count_ones() as usize
    }
}

impl FromIterator<bool> for Marks {
    fn from_iter<I: IntoIterator<Item = bool>>(marks: I) -> Self {
        let mut all = Marks::default();
        marks.into_iter().enumerate().filter(|(_, marked)| *marked).for_each(|(p, _)| all.add(p));
        all
    }
}

/// How many points an element gathers at, at first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Grain {
    Fine,
    Coarse,
    Tiny,
}

/// The points of an element: in each of 16 or 4 equal parts, or in two of these 4.
pub(super) fn at_first(cell: &Cell, grain: Grain) -> Vec<Point> {
    let key = seed::combine(cell.key, 0x6761_7468);
    let mut points = strata(cell.shape, if grain == Grain::Fine { 2 } else { 1 }, key);
    if grain == Grain::Tiny {
        let first = (seed::unit(key) * points.len() as f64) as usize;
        points.rotate_left(first);
        let second = 1 + (seed::unit(seed::combine(key, 0)) * (points.len() - 1) as f64) as usize;
        points.swap(1, second);
        points.truncate(2);
    }
    points
}

/// A point at random in each of the parts that `levels` splits of a cell make: a mean over them has no bias.
pub(super) fn strata(shape: CellShape, levels: u32, key: u64) -> Vec<Point> {
    let parts = shape.arity().pow(levels);
    let place = |k: usize| {
        let key = seed::combine(key, k as u64);
        let mut at = on_cell(shape, [seed::unit(seed::combine(key, 1)), seed::unit(seed::combine(key, 2))]);
        let mut path = k;
        for _ in 0..levels {
            let (o, sign) = shape.child(path % shape.arity());
            path /= shape.arity();
            at = [o[0] + 0.5 * sign * at[0], o[1] + 0.5 * sign * at[1]];
        }
        Point { at, key }
    };
    (0..parts).map(place).collect()
}
