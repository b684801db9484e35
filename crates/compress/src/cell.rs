//! A dyadic piece of a root domain.

use ondelette_numerics::seed;
use ondelette_wavelet::cell::CellShape;

/// A cell: which root domain, and the map from local to root coordinates, `origin + scale * x`.
///
/// ```
/// use ondelette_compress::Cell;
/// use ondelette_wavelet::cell::CellShape;
/// let corner = Cell::root(7, CellShape::Square).child(3).child(0);
/// assert_eq!(corner.to_root([1.0, 1.0]), [0.75, 0.75]);
/// assert_eq!(corner.depth, 2);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Index of the root domain.
    pub root: u32,
    /// Shape, the same as the root's.
    pub shape: CellShape,
    /// Number of splits from the root.
    pub depth: u32,
    /// Root coordinates of the local origin.
    pub origin: [f64; 2],
    /// Root length of a local unit; negative in turned triangles.
    pub scale: f64,
    /// A hash of root and path, for counter-based random numbers.
    pub key: u64,
}

impl Cell {
    /// The whole root domain.
    pub fn root(root: u32, shape: CellShape) -> Self {
        Cell { root, shape, depth: 0, origin: [0.0; 2], scale: 1.0, key: seed::mix(u64::from(root)) }
    }

    /// Child `c` (see [`CellShape::child`]).
    pub fn child(&self, c: usize) -> Self {
        let (offset, sign) = self.shape.child(c);
        Cell {
            depth: self.depth + 1,
            origin: self.to_root(offset),
            scale: 0.5 * sign * self.scale,
            key: seed::combine(self.key, c as u64 + 1),
            ..*self
        }
    }

    /// Root coordinates of a local point.
    pub fn to_root(&self, x: [f64; 2]) -> [f64; 2] {
        [self.origin[0] + self.scale * x[0], self.origin[1] + self.scale * x[1]]
    }

    /// Share of the root's measure.
    pub fn share(&self) -> f64 {
        match self.shape {
            CellShape::Interval => self.scale.abs(),
            CellShape::Square | CellShape::Triangle => self.scale * self.scale,
        }
    }
}
