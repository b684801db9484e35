//! The scaling functions of one cell.

use super::analysis::Analysis;
use super::shape::CellShape;
use crate::polynomials::{ORDERS, jacobi, legendre, scaled_legendre};
use crate::tree::{OrderError, TreeFamily};

/// Family of a cell basis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CellFamily {
    /// Orthonormal polynomials: tensor Legendre of degree < M in each variable; on triangles of total degree < M.
    Multiwavelet,
    /// M boxes an axis. On triangles there are none: the multiwavelet of that order stands in (see
    /// [`CellBasis::falls_back`]).
    Flatlet,
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
    pub(super) shape: CellShape,
    pub(super) family: CellFamily,
    pub(super) order: usize,
    fell_back: bool,
    /// Degrees in each variable (multiwavelets) or box numbers (flatlets) of each function.
    pub(super) index: Vec<[u8; 2]>,
    /// One n x n matrix a child, row-major, `T_c[parent][child]`.
    pub(super) two_scale: Vec<Vec<f64>>,
    /// Inverse Gram matrix of pulled flatlet coefficients; empty for orthonormal bases.
    inverse_gram: Vec<f64>,
    /// `analyses[n - 1]`: the rule of [`CellBasis::analysis`].
    analyses: Vec<Analysis>,
    /// `truncated[p - 1]`: which functions make up the basis of order p.
    truncated: Vec<Vec<u16>>,
}

impl CellBasis {
    /// Highest multiwavelet order.
    pub const MAX_MULTIWAVELET: usize = TreeFamily::MAX_MULTIWAVELET;
    /// Most Gauss points an axis of [`CellBasis::analysis`].
    pub const MAX_POINTS: usize = 10;
    /// Highest flatlet order.
    pub const MAX_FLATLET: usize = TreeFamily::MAX_FLATLET;

    /// The basis of one family and order. All matrices are derived by exact quadrature; cost O(functions^3).
    ///
    /// # Errors
    /// [`OrderError`] for order 0 or above [`Self::MAX_MULTIWAVELET`] / [`Self::MAX_FLATLET`].
    pub fn new(shape: CellShape, family: CellFamily, order: usize) -> Result<Self, OrderError> {
        let (name, limit) = match family {
            CellFamily::Multiwavelet => ("multiwavelet", Self::MAX_MULTIWAVELET),
            CellFamily::Flatlet => ("flatlet", Self::MAX_FLATLET),
        };
        if !(1..=limit).contains(&order) {
            return Err(OrderError { family: name, order, limit });
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
    ///
    /// # Panics
    /// If `out` is shorter than the basis.
    pub fn eval(&self, x: [f64; 2], out: &mut [f64]) {
        let out = &mut out[..self.len()];
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
                let t = if shape == CellShape::Square { legendre(x[1]) } else { [1.0; ORDERS] };
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
}
