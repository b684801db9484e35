//! Tree bases on cells: intervals, squares (tensor products) and triangles, split into 2 or 4 equal children.
//!
//! What the transport of an operator needs of a tree wavelet basis: the scaling functions of one cell and the two-scale
//! matrices to its children (thesis 4.5.1). Splitting a cell into children and dropping detail is the second form of
//! ProjectKernel (4.5.2), so wavelets themselves never appear here; the one-dimensional tree families have them.
//!
//! Heights are chosen so that a coefficient has the unit of the function: multiwavelets are orthonormal for the *mean*
//! over the cell (the first function is 1), flatlet boxes have height 1. Then for both families, with the same matrices
//! T:
//! * push (a function seen from the children): `child[j] += sum_i T_c[i][j] parent[i]`;
//! * pull (its adjoint): `parent[i] = 1/arity sum_c sum_j T_c[i][j] child_c[j]`.
//!
//! For flatlets the coarser functions are therefore the thesis's *duals*: staircases of polynomials of degree M - 1
//! (Eq. 115's inverse transpose), which is what lets a piecewise constant basis have M vanishing moments.

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
    pub fn descend(self, x: [f64; 2]) -> (usize, [f64; 2]) {
        let c = match self {
            CellShape::Interval => usize::from(x[0] >= 0.5),
            CellShape::Square => usize::from(x[0] >= 0.5) + 2 * usize::from(x[1] >= 0.5),
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

/// Family of a cell basis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CellFamily {
    /// Orthonormal polynomials: tensor Legendre of degree < M in each variable; on triangles of total degree < M.
    Multiwavelet,
    /// M boxes an axis. On triangles there are none: the multiwavelet of that order stands in (see
    /// [`CellBasis::falls_back`]).
    Flatlet,
}

/// Why a basis cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OrderError {
    /// The order asked for.
    pub order: usize,
    /// The highest order of that family.
    pub highest: usize,
}

impl std::fmt::Display for OrderError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "order {} is outside 1..={}", self.order, self.highest)
    }
}

impl std::error::Error for OrderError {}

/// How samples become coefficients: `coefficient[i] = sum_q matrix[i][q] f(points[q])`.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// Local sample points.
    pub points: Vec<[f64; 2]>,
    /// Row-major, one row a function, one column a point.
    pub matrix: Vec<f64>,
}

impl Analysis {
    /// Coefficients of samples taken at the points.
    pub fn coefficients(&self, samples: &[f64]) -> Vec<f64> {
        self.matrix.chunks(self.points.len()).map(|row| row.iter().zip(samples).map(|(a, s)| a * s).sum()).collect()
    }
}

/// The scaling functions of one cell shape and their two-scale matrices.
///
/// ```
/// use ondelette_wavelet::cell::{CellBasis, CellFamily, CellShape};
/// let m2 = CellBasis::new(CellShape::Square, CellFamily::Multiwavelet, 2).unwrap();
/// assert_eq!(m2.len(), 4);
/// // a constant is the first function, on every level
/// let mut child = [0.0; 4];
/// m2.push(3, &[1.0, 0.0, 0.0, 0.0], &mut child, |c, k, p| *c += k * p);
/// assert!((child[0] - 1.0).abs() < 1e-15 && child[1..].iter().all(|c| c.abs() < 1e-15));
/// ```
#[derive(Clone, Debug)]
pub struct CellBasis {
    shape: CellShape,
    family: CellFamily,
    order: usize,
    fell_back: bool,
    /// Degrees in each variable (multiwavelets) or box numbers (flatlets) of each function.
    index: Vec<[u8; 2]>,
    /// One n x n matrix a child, row-major, `T_c[parent][child]`.
    two_scale: Vec<Vec<f64>>,
    /// Inverse Gram matrix of pulled flatlet coefficients; empty for orthonormal bases.
    inverse_gram: Vec<f64>,
    /// `analyses[n - 1]`: the rule of [`CellBasis::analysis`].
    analyses: Vec<Analysis>,
    /// `truncated[p - 1]`: which functions make up the basis of order p.
    truncated: Vec<Vec<u16>>,
}

impl CellBasis {
    /// Highest multiwavelet order.
    pub const MAX_MULTIWAVELET: usize = 6;
    /// Most Gauss points an axis of [`CellBasis::analysis`].
    pub const MAX_POINTS: usize = 10;
    /// Highest flatlet order.
    pub const MAX_FLATLET: usize = 4;

    /// The basis of one family and order. All matrices are derived by exact quadrature; cost O(functions^3).
    ///
    /// # Errors
    /// [`OrderError`] for order 0 or above [`Self::MAX_MULTIWAVELET`] / [`Self::MAX_FLATLET`].
    pub fn new(shape: CellShape, family: CellFamily, order: usize) -> Result<Self, OrderError> {
        let highest = match family {
            CellFamily::Multiwavelet => Self::MAX_MULTIWAVELET,
            CellFamily::Flatlet => Self::MAX_FLATLET,
        };
        if order == 0 || order > highest {
            return Err(OrderError { order, highest });
        }
        let fell_back = family == CellFamily::Flatlet && shape == CellShape::Triangle && order > 1;
        let family = if shape == CellShape::Triangle { CellFamily::Multiwavelet } else { family };
        let m = order as u8;
        let index: Vec<[u8; 2]> = match shape {
            CellShape::Interval => (0..m).map(|a| [a, 0]).collect(),
            CellShape::Square => (0..m).flat_map(|a| (0..m).map(move |b| [a, b])).collect(),
            // by total degree, so that lower orders are leading parts
            CellShape::Triangle => (0..m).flat_map(|d| (0..=d).map(move |b| [d - b, b])).collect(),
        };
        let mut basis = CellBasis {
            shape,
            family,
            order,
            fell_back,
            index,
            two_scale: Vec::new(),
            inverse_gram: Vec::new(),
            analyses: Vec::new(),
            truncated: Vec::new(),
        };
        basis.two_scale = (0..shape.arity()).map(|c| basis.two_scale_matrix(c)).collect();
        if !basis.is_nested() {
            basis.inverse_gram = basis.make_inverse_gram();
        }
        basis.analyses = (1..=Self::MAX_POINTS).map(|n| basis.make_analysis(n)).collect();
        basis.truncated = (1..=order)
            .map(|p| {
                let keep = |k: &[u8; 2]| match shape {
                    CellShape::Triangle => usize::from(k[0] + k[1]) < p,
                    _ => usize::from(k[0]) < p && usize::from(k[1]) < p,
                };
                (0..basis.index.len() as u16).filter(|&i| keep(&basis.index[i as usize])).collect()
            })
            .collect();
        Ok(basis)
    }

    /// Number of functions.
    pub fn len(&self) -> usize {
        self.index.len()
    }

    /// Never: a basis has at least one function.
    pub fn is_empty(&self) -> bool {
        self.index.is_empty()
    }

    /// Shape of the cell.
    pub fn shape(&self) -> CellShape {
        self.shape
    }

    /// Family in use (on triangles always multiwavelets).
    pub fn family(&self) -> CellFamily {
        self.family
    }

    /// Order M.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Whether flatlets were asked for on a shape that has none, and multiwavelets stand in.
    pub fn falls_back(&self) -> bool {
        self.fell_back
    }

    /// Whether lower orders are parts of this basis (multiwavelets: M1 in M2 in M3).
    pub fn is_nested(&self) -> bool {
        self.family == CellFamily::Multiwavelet
    }

    /// The functions that make up the basis of order `p` <= M.
    ///
    /// # Panics
    /// If `p` is 0 or above the order, or not the full order for flatlets, which are not nested.
    pub fn truncated(&self, p: usize) -> &[u16] {
        assert!(p == self.order || self.is_nested(), "flatlets of order {} hold no flatlets of order {p}", self.order);
        &self.truncated[p - 1]
    }

    /// T_c of child `c`, row-major `[parent][child]`.
    pub fn two_scale(&self, c: usize) -> &[f64] {
        &self.two_scale[c]
    }

    /// Values of all functions at the local point `x`, into `out[..len]`.
    pub fn eval(&self, x: [f64; 2], out: &mut [f64]) {
        match (self.shape, self.family) {
            (CellShape::Triangle, _) => {
                let s = scaled_legendre(x);
                for i in 0..self.order {
                    let t = jacobi(2 * i + 1, 2.0 * x[1] - 1.0);
                    for j in 0..self.order - i {
                        let degree = i + j;
                        let norm = (((2 * i + 1) * (degree + 1)) as f64).sqrt();
                        out[degree * (degree + 1) / 2 + j] = norm * s[i] * t[j];
                    }
                }
            }
            (shape, CellFamily::Multiwavelet) => {
                let s = legendre(x[0]);
                let t = if shape == CellShape::Square { legendre(x[1]) } else { [1.0; Self::MAX_MULTIWAVELET] };
                for (o, k) in out.iter_mut().zip(&self.index) {
                    *o = s[usize::from(k[0])] * t[usize::from(k[1])];
                }
            }
            (shape, CellFamily::Flatlet) => {
                let last = self.order - 1;
                let place = |x: f64| ((x * self.order as f64).max(0.0) as usize).min(last) as u8;
                let at = [place(x[0]), if shape == CellShape::Square { place(x[1]) } else { 0 }];
                for (o, k) in out.iter_mut().zip(&self.index) {
                    *o = if *k == at { 1.0 } else { 0.0 };
                }
            }
        }
    }

    /// Points and a matrix that turn samples into coefficients.
    ///
    /// Multiwavelets: projection by the rule with `n` >= M points an axis (n = M interpolates). Flatlets: box means by
    /// `n` points an axis in every box. `n` is taken as at least 1 (M) and at most [`Self::MAX_POINTS`].
    pub fn analysis(&self, n: usize) -> &Analysis {
        let least = if self.family == CellFamily::Multiwavelet { self.order } else { 1 };
        &self.analyses[n.clamp(least, Self::MAX_POINTS) - 1]
    }

    fn make_analysis(&self, n: usize) -> Analysis {
        let functions = self.len();
        match self.family {
            CellFamily::Multiwavelet => {
                let (points, weights) = self.shape.rule(n.max(self.order));
                let mut analysis = vec![0.0; functions * points.len()];
                let mut values = vec![0.0; functions];
                for (q, (x, w)) in points.iter().zip(&weights).enumerate() {
                    self.eval(*x, &mut values);
                    for i in 0..functions {
                        analysis[i * points.len() + q] = w * values[i];
                    }
                }
                Analysis { points, matrix: analysis }
            }
            CellFamily::Flatlet => {
                let (local, weights) = self.shape.rule(n);
                let (per_box, width) = (local.len(), 1.0 / self.order as f64);
                let mut points = Vec::with_capacity(functions * per_box);
                let mut analysis = vec![0.0; functions * functions * per_box];
                for (i, k) in self.index.iter().enumerate() {
                    for (q, x) in local.iter().enumerate() {
                        points.push([(f64::from(k[0]) + x[0]) * width, (f64::from(k[1]) + x[1]) * width]);
                        analysis[i * functions * per_box + i * per_box + q] = weights[q];
                    }
                }
                Analysis { points, matrix: analysis }
            }
        }
    }

    /// Box `i` of a flatlet basis as (offset, side) in local coordinates; `None` for multiwavelets.
    pub fn box_of(&self, i: usize) -> Option<([f64; 2], f64)> {
        let width = 1.0 / self.order as f64;
        match self.family {
            CellFamily::Multiwavelet => None,
            CellFamily::Flatlet => {
                Some(([f64::from(self.index[i][0]) * width, f64::from(self.index[i][1]) * width], width))
            }
        }
    }

    /// Mean over the cell of the function with coefficients `c`.
    pub fn mean<C: Copy>(&self, c: &[C], zero: C, add: impl Fn(C, C, f64) -> C) -> C {
        match self.family {
            CellFamily::Multiwavelet => c[0],
            CellFamily::Flatlet => {
                let k = 1.0 / self.len() as f64;
                c[..self.len()].iter().fold(zero, |sum, &v| add(sum, v, k))
            }
        }
    }

    /// Mean square of the projection that pulled coefficients stand for.
    ///
    /// Orthonormal bases: the sum of squares. Pulled flatlet coefficients are means against the dual staircases, so
    /// their Gram matrix comes in (of the staircases one level down, where they differ most from boxes).
    pub fn projected_square(&self, pulled: impl Iterator<Item = f64>) -> f64 {
        if self.inverse_gram.is_empty() {
            return pulled.map(|c| c * c).sum();
        }
        let c: Vec<f64> = pulled.collect();
        let n = c.len();
        (0..n).map(|i| c[i] * (0..n).map(|j| self.inverse_gram[i * n + j] * c[j]).sum::<f64>()).sum()
    }

    /// Adds a parent's function to the coefficients of child `c`; `add(child, factor, parent)` does one term.
    pub fn push<C: Copy>(&self, c: usize, parent: &[C], child: &mut [C], add: impl Fn(&mut C, f64, C)) {
        let n = self.len();
        let matrix = &self.two_scale[c];
        for i in 0..n {
            for j in 0..n {
                add(&mut child[j], matrix[i * n + j], parent[i]);
            }
        }
    }

    /// Adds child `c`'s share to the coefficients of its parent (includes the factor 1/arity).
    pub fn pull<C: Copy>(&self, c: usize, child: &[C], parent: &mut [C], add: impl Fn(&mut C, f64, C)) {
        let n = self.len();
        let share = 1.0 / self.shape.arity() as f64;
        let matrix = &self.two_scale[c];
        for i in 0..n {
            for j in 0..n {
                add(&mut parent[i], share * matrix[i * n + j], child[j]);
            }
        }
    }

    /// A pulled coefficient is the mean of the function times the staircase of height n T_c\[i\]\[k\] on box k of child
    /// c (n boxes a cell); this inverts the Gram matrix n/arity sum_c T_c T_c^T of these staircases.
    fn make_inverse_gram(&self) -> Vec<f64> {
        let n = self.len();
        let mut gram = vec![0.0; n * n];
        for t in &self.two_scale {
            for i in 0..n {
                for j in 0..n {
                    let dot: f64 = (0..n).map(|k| t[i * n + k] * t[j * n + k]).sum();
                    gram[i * n + j] += dot * n as f64 / self.two_scale.len() as f64;
                }
            }
        }
        invert(&gram, n)
    }

    fn two_scale_matrix(&self, c: usize) -> Vec<f64> {
        let n = self.len();
        let (offset, sign) = self.shape.child(c);
        match self.family {
            CellFamily::Multiwavelet => {
                let (points, weights) = self.shape.rule(self.order + 1);
                let mut matrix = vec![0.0; n * n];
                let (mut parent, mut child) = (vec![0.0; n], vec![0.0; n]);
                for (x, w) in points.iter().zip(&weights) {
                    self.eval([offset[0] + 0.5 * sign * x[0], offset[1] + 0.5 * sign * x[1]], &mut parent);
                    self.eval(*x, &mut child);
                    for i in 0..n {
                        for j in 0..n {
                            matrix[i * n + j] += w * parent[i] * child[j];
                        }
                    }
                }
                matrix
            }
            CellFamily::Flatlet => {
                let axis = |half: usize| flatlet_axis(self.order, half);
                let s = axis(usize::from(offset[0] > 0.0));
                let t = if self.shape == CellShape::Square { axis(usize::from(offset[1] > 0.0)) } else { vec![1.0] };
                let m = self.order;
                let mut matrix = Vec::with_capacity(n * n);
                for i in &self.index {
                    for j in &self.index {
                        let [a, b] = i.map(usize::from);
                        let [c, d] = j.map(usize::from);
                        matrix.push(s[a * m + c] * t[if t.len() == 1 { 0 } else { b * m + d }]);
                    }
                }
                matrix
            }
        }
    }
}

/// sqrt(2k+1) P_k(2x - 1), orthonormal on [0, 1].
fn legendre(x: f64) -> [f64; CellBasis::MAX_MULTIWAVELET] {
    let z = 2.0 * x - 1.0;
    let mut p = [1.0; CellBasis::MAX_MULTIWAVELET];
    p[1] = z;
    for k in 1..CellBasis::MAX_MULTIWAVELET - 1 {
        let f = k as f64;
        p[k + 1] = ((2.0 * f + 1.0) * z * p[k] - f * p[k - 1]) / (f + 1.0);
    }
    for (k, p) in p.iter_mut().enumerate() {
        *p *= ((2 * k + 1) as f64).sqrt();
    }
    p
}

/// (1-t)^k P_k(z / (1-t)) with z = 2s + t - 1: the s part of the orthonormal polynomials on the triangle
/// (Dubiner 1991), by a recurrence that never divides.
fn scaled_legendre(x: [f64; 2]) -> [f64; CellBasis::MAX_MULTIWAVELET] {
    let (z, r) = (2.0 * x[0] + x[1] - 1.0, 1.0 - x[1]);
    let mut q = [1.0; CellBasis::MAX_MULTIWAVELET];
    q[1] = z;
    for k in 1..CellBasis::MAX_MULTIWAVELET - 1 {
        let f = k as f64;
        q[k + 1] = ((2.0 * f + 1.0) * z * q[k] - f * r * r * q[k - 1]) / (f + 1.0);
    }
    q
}

/// Jacobi polynomials P_n^(a,0)(y).
fn jacobi(a: usize, y: f64) -> [f64; CellBasis::MAX_MULTIWAVELET] {
    let a = a as f64;
    let mut p = [1.0; CellBasis::MAX_MULTIWAVELET];
    p[1] = 0.5 * (a + (a + 2.0) * y);
    for k in 2..CellBasis::MAX_MULTIWAVELET {
        let n = k as f64;
        let m = 2.0 * n + a;
        let forward = (m - 1.0) * (m * (m - 2.0) * y + a * a) * p[k - 1];
        let back = 2.0 * (n + a - 1.0) * (n - 1.0) * m * p[k - 2];
        p[k] = (forward - back) / (2.0 * n * (n + a) * (m - 2.0));
    }
    p
}

/// One axis of the flatlets' dual two-scale relation: the polynomial of degree M - 1 with mean 1 on box `i` and 0 on
/// the other boxes, averaged over the M boxes of one half. Row-major `[i][j]`. Exact: differences of a Lagrange
/// primitive.
fn flatlet_axis(m: usize, half: usize) -> Vec<f64> {
    // P(x) = integral from 0 to x (in units of one box); P(k) = number of unit boxes passed of box i
    let lagrange = |i: usize, x: f64| -> f64 {
        (0..=m)
            .filter(|&k| k > i)
            .map(|k| (0..=m).filter(|&l| l != k).map(|l| (x - l as f64) / (k as f64 - l as f64)).product::<f64>())
            .sum()
    };
    let mut matrix = Vec::with_capacity(m * m);
    for i in 0..m {
        for j in 0..m {
            let from = 0.5 * (j + half * m) as f64;
            matrix.push(2.0 * (lagrange(i, from + 0.5) - lagrange(i, from)));
        }
    }
    matrix
}

/// Inverse of a small, well conditioned symmetric matrix (Gauss-Jordan).
fn invert(matrix: &[f64], n: usize) -> Vec<f64> {
    let mut a = matrix.to_vec();
    let mut inverse: Vec<f64> = (0..n * n).map(|k| if k / n == k % n { 1.0 } else { 0.0 }).collect();
    for k in 0..n {
        let pivot = 1.0 / a[k * n + k];
        for j in 0..n {
            a[k * n + j] *= pivot;
            inverse[k * n + j] *= pivot;
        }
        for i in (0..n).filter(|&i| i != k) {
            let factor = a[i * n + k];
            for j in 0..n {
                a[i * n + j] -= factor * a[k * n + j];
                inverse[i * n + j] -= factor * inverse[k * n + j];
            }
        }
    }
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_square_of_a_projection_is_that_of_what_the_basis_reproduces() {
        // polynomials of degree < M, as box means of the children, are reproduced: their squares survive the pull
        for order in 1..=4 {
            let b = CellBasis::new(CellShape::Interval, CellFamily::Flatlet, order).unwrap();
            let parent: Vec<f64> = (0..order).map(|i| 1.0 + (i as f64).powi(order as i32 - 1)).collect();
            let mut pulled = vec![0.0; order];
            let mut square = 0.0;
            for c in 0..2 {
                let mut child = vec![0.0; order];
                b.push(c, &parent, &mut child, |a, k, p| *a += k * p);
                square += child.iter().map(|v| v * v).sum::<f64>() / (2 * order) as f64;
                b.pull(c, &child, &mut pulled, |a, k, p| *a += k * p);
            }
            let got = b.projected_square(pulled.into_iter());
            assert!((got / square - 1.0).abs() < 1e-12, "order {order}: {got} instead of {square}");
        }
    }

    fn all() -> Vec<CellBasis> {
        let mut bases = Vec::new();
        for shape in [CellShape::Interval, CellShape::Square, CellShape::Triangle] {
            for order in 1..=6 {
                bases.push(CellBasis::new(shape, CellFamily::Multiwavelet, order).unwrap());
            }
            for order in 1..=4 {
                bases.push(CellBasis::new(shape, CellFamily::Flatlet, order).unwrap());
            }
        }
        bases
    }

    #[test]
    fn multiwavelets_are_orthonormal_and_refine_exactly() {
        for b in all().iter().filter(|b| b.family() == CellFamily::Multiwavelet) {
            let n = b.len();
            let (points, weights) = b.shape().rule(b.order() + 1);
            let mut gram = vec![0.0; n * n];
            let mut v = vec![0.0; n];
            for (x, w) in points.iter().zip(&weights) {
                b.eval(*x, &mut v);
                for i in 0..n {
                    for j in 0..n {
                        gram[i * n + j] += w * v[i] * v[j];
                    }
                }
            }
            for i in 0..n {
                for j in 0..n {
                    let want = if i == j { 1.0 } else { 0.0 };
                    assert!((gram[i * n + j] - want).abs() < 1e-13, "{:?} {} gram {i} {j}", b.shape(), b.order());
                }
            }
            // a parent's function, read in a child, has the parent's value
            let parent: Vec<f64> = (0..n).map(|i| 1.0 / (i as f64 + 1.3)).collect();
            for x in b.shape().test_points() {
                let (c, local) = b.shape().descend(x);
                let mut child = vec![0.0; n];
                b.push(c, &parent, &mut child, |a, k, p| *a += k * p);
                let value = |c: &[f64], x: [f64; 2]| {
                    let mut v = vec![0.0; n];
                    b.eval(x, &mut v);
                    v.iter().zip(c).map(|(v, c)| v * c).sum::<f64>()
                };
                assert!((value(&parent, x) - value(&child, local)).abs() < 1e-13, "{:?} {}", b.shape(), b.order());
            }
        }
    }

    #[test]
    fn pull_undoes_push() {
        for b in all() {
            let n = b.len();
            let parent: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).cos()).collect();
            let mut back = vec![0.0; n];
            for c in 0..b.shape().arity() {
                let mut child = vec![0.0; n];
                b.push(c, &parent, &mut child, |a, k, p| *a += k * p);
                b.pull(c, &child, &mut back, |a, k, p| *a += k * p);
            }
            // for flatlets push and pull are adjoint, and a push of one level is undone by box means, not by pull
            if b.family() == CellFamily::Multiwavelet {
                for i in 0..n {
                    assert!((parent[i] - back[i]).abs() < 1e-10, "{:?} {} {i}", b.shape(), b.order());
                }
            }
        }
    }

    #[test]
    fn flatlet_duals_are_the_inverse_transpose_of_eq_115() {
        // thesis Eq. (115) inverse transpose: first rows (5 3 1 -1)/8 and (-1 1 3 5)/8; heights here are twice that
        let f2 = CellBasis::new(CellShape::Interval, CellFamily::Flatlet, 2).unwrap();
        assert_eq!(f2.two_scale(0), [1.25, 0.75, -0.25, 0.25]);
        assert_eq!(f2.two_scale(1), [0.25, -0.25, 0.75, 1.25]);
        let f3 = CellBasis::new(CellShape::Interval, CellFamily::Flatlet, 3).unwrap();
        for (got, want) in f3.two_scale(0).iter().zip([11.0, 5.0, 1.0, -4.0, 4.0, 8.0, 1.0, -1.0, -1.0]) {
            assert!((got - want / 8.0).abs() < 1e-15, "{got} {want}");
        }
    }

    #[test]
    fn flatlets_reproduce_the_means_of_polynomials() {
        for order in 1..=4 {
            let b = CellBasis::new(CellShape::Square, CellFamily::Flatlet, order).unwrap();
            let f = |x: [f64; 2]| (0..order).map(|k| (x[0] - 0.3).powi(k as i32) * (1.0 + x[1]).powi(k as i32)).sum();
            let project = |map: &dyn Fn([f64; 2]) -> [f64; 2]| {
                let f: &dyn Fn([f64; 2]) -> f64 = &f;
                let samples: Vec<f64> = b.analysis(4).points.iter().map(|x| f(map(*x))).collect();
                b.analysis(4).coefficients(&samples)
            };
            let parent: Vec<f64> = project(&|x| x);
            for c in 0..4 {
                let (o, _) = b.shape().child(c);
                let want: Vec<f64> = project(&|x| [o[0] + 0.5 * x[0], o[1] + 0.5 * x[1]]);
                let mut child = vec![0.0; b.len()];
                b.push(c, &parent, &mut child, |a, k, p| *a += k * p);
                for (got, want) in child.iter().zip(&want) {
                    assert!((got - want).abs() < 1e-12, "order {order}: {got} {want}");
                }
            }
        }
    }

    #[test]
    fn lower_orders_are_parts_of_higher_ones() {
        for shape in [CellShape::Square, CellShape::Triangle] {
            let m3 = CellBasis::new(shape, CellFamily::Multiwavelet, 3).unwrap();
            let m2 = CellBasis::new(shape, CellFamily::Multiwavelet, 2).unwrap();
            let x = [0.21, 0.34];
            let (mut high, mut low) = (vec![0.0; m3.len()], vec![0.0; m2.len()]);
            m3.eval(x, &mut high);
            m2.eval(x, &mut low);
            for (i, &k) in m3.truncated(2).iter().enumerate() {
                assert!((high[k as usize] - low[i]).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn orders_outside_the_family_are_refused() {
        assert_eq!(
            CellBasis::new(CellShape::Square, CellFamily::Flatlet, 5).unwrap_err(),
            OrderError { order: 5, highest: 4 }
        );
        assert!(CellBasis::new(CellShape::Square, CellFamily::Multiwavelet, 0).is_err());
    }
}
