//! Reference domains of cells and how they split.

use ondelette_numerics::gauss;

/// Shape of a cell's reference domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CellShape {
    /// [0, 1]; the second coordinate is ignored. Two children.
    Interval,
    /// The unit square. Four children, child 2 b + a at offset (a/2, b/2).
    Square,
    /// s, t >= 0, s + t <= 1. Four children: at the three corners o, s, t, then the central one, turned by half a turn.
    Triangle,
}

impl CellShape {
    /// Number of children.
    pub fn arity(self) -> usize {
        match self {
            CellShape::Interval => 2,
            CellShape::Square | CellShape::Triangle => 4,
        }
    }

    /// Child `c` as (offset, sign): a child's local point x lies at `offset + sign * x / 2` of its parent.
    pub fn child(self, c: usize) -> ([f64; 2], f64) {
        match (self, c) {
            (CellShape::Interval, _) => ([0.5 * c as f64, 0.0], 1.0),
            (CellShape::Square, _) => ([0.5 * (c & 1) as f64, 0.5 * (c >> 1) as f64], 1.0),
            (CellShape::Triangle, 0) => ([0.0, 0.0], 1.0),
            (CellShape::Triangle, 1) => ([0.5, 0.0], 1.0),
            (CellShape::Triangle, 2) => ([0.0, 0.5], 1.0),
            (CellShape::Triangle, _) => ([0.5, 0.5], -1.0),
        }
    }

    /// The child that holds the local point `x`, and the point in that child's coordinates.
    #[inline]
    pub fn descend(self, x: [f64; 2]) -> (usize, [f64; 2]) {
        let c = match self {
            CellShape::Interval => usize::from(x[0] >= 0.5),
            CellShape::Square => {
                let [i, j] = x.map(|x| usize::from(x >= 0.5));
                return (i + 2 * j, [2.0 * x[0] - i as f64, 2.0 * x[1] - j as f64]);
            }
            CellShape::Triangle => {
                if x[0] >= 0.5 {
                    1
                } else if x[1] >= 0.5 {
                    2
                } else if x[0] + x[1] <= 0.5 {
                    0
                } else {
                    3
                }
            }
        };
        let (o, sign) = self.child(c);
        (c, [2.0 * sign * (x[0] - o[0]), 2.0 * sign * (x[1] - o[1])])
    }

    /// The centre of mass.
    pub fn centre(self) -> [f64; 2] {
        match self {
            CellShape::Interval => [0.5, 0.0],
            CellShape::Square => [0.5; 2],
            CellShape::Triangle => [1.0 / 3.0; 2],
        }
    }

    /// Gauss rule with `n` points an axis; weights sum to 1.
    pub fn rule(self, n: usize) -> (Vec<[f64; 2]>, Vec<f64>) {
        match self {
            CellShape::Interval => {
                let (x, w) = gauss::rule(n);
                (x.into_iter().map(|x| [x, 0.0]).collect(), w)
            }
            CellShape::Square => gauss::square_rule(n),
            CellShape::Triangle => gauss::triangle_rule(n),
        }
    }

    /// One point in each child, off every Gauss node and off every symmetry axis: where a polynomial fit is put to the
    /// test.
    pub fn test_points(self) -> Vec<[f64; 2]> {
        match self {
            CellShape::Interval => vec![[0.06, 0.0], [0.60, 0.0]],
            CellShape::Square => vec![[0.06, 0.40], [0.60, 0.06], [0.40, 0.94], [0.94, 0.60]],
            CellShape::Triangle => vec![[0.04, 0.20], [0.75, 0.04], [0.20, 0.76], [0.42, 0.38]],
        }
    }
}
