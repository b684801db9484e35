//! Tree families: bases whose functions never cross a cell boundary (Haar, multiwavelets, flatlets).
//!
//! One `2M x 2M` block joins the `M` smooth and `M` detail functions of a cell to the `M` functions of each of its two
//! halves. The block is derived by Gram-Schmidt in exact rationals: multiwavelets (Eq. 114 and Alpert's construction)
//! from the polynomials projected on the halves, flatlets (Eq. 115) from polynomials averaged over `2M` boxes.

use crate::exact::{BigRational, binomial, ratio, to_f64};
use crate::polynomials::legendre;
use num_traits::{One, Signed, Zero};

/// What the functions of a cell are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TreeKind {
    /// One box; the wavelet is `(1, -1)` (Eq. 9).
    Haar,
    /// Orthonormal Legendre polynomials of degree below `M`.
    Multiwavelet,
    /// `M` boxes of equal width.
    Flatlet,
}

/// A tree family: its two-scale block and the inverse, exact and as `f64`.
///
/// ```
/// use ondelette_wavelet::TreeFamily;
/// let f2 = TreeFamily::flatlet(2)?;
/// assert_eq!(&f2.primal()[8..12], [-1.0, 3.0, -3.0, 1.0]);
/// assert!(TreeFamily::multiwavelet(7).is_err());
/// # Ok::<(), ondelette_wavelet::OrderError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct TreeFamily {
    kind: TreeKind,
    order: usize,
    primal: Vec<f64>,
    dual: Vec<f64>,
}

/// An order outside what a tree family offers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{family} order {order}: choose 1 to {limit}")]
pub struct OrderError {
    /// The family asked for.
    pub family: &'static str,
    /// The order asked for.
    pub order: usize,
    /// The highest order there is.
    pub limit: usize,
}

impl TreeFamily {
    /// Highest multiwavelet order.
    pub const MAX_MULTIWAVELET: usize = 6;
    /// Highest flatlet order.
    pub const MAX_FLATLET: usize = 4;

    /// The Haar basis: `phi = (1, 1)`, `psi = (1, -1)` (Eq. 9).
    pub fn haar() -> TreeFamily {
        let primal = vec![1.0, 1.0, 1.0, -1.0];
        TreeFamily { kind: TreeKind::Haar, order: 1, primal, dual: vec![0.5, 0.5, 0.5, -0.5] }
    }

    /// The multiwavelets `M_order`, orthonormal; `psi^1 .. psi^M` have `M .. 2M-1` vanishing moments and their last
    /// entry is positive.
    ///
    /// # Errors
    /// Order 0 or above [`TreeFamily::MAX_MULTIWAVELET`].
    pub fn multiwavelet(order: usize) -> Result<TreeFamily, OrderError> {
        if !(1..=Self::MAX_MULTIWAVELET).contains(&order) {
            return Err(OrderError { family: "multiwavelet", order, limit: Self::MAX_MULTIWAVELET });
        }
        let primal = multiwavelet_squares(order).iter().flatten().map(signed_root).collect::<Vec<_>>();
        Ok(TreeFamily { kind: TreeKind::Multiwavelet, order, dual: primal.clone(), primal })
    }

    /// The flatlets `F_order` with the integer rows of the thesis; the dual block is the inverse transpose.
    ///
    /// # Errors
    /// Order 0 or above [`TreeFamily::MAX_FLATLET`].
    pub fn flatlet(order: usize) -> Result<TreeFamily, OrderError> {
        if !(1..=Self::MAX_FLATLET).contains(&order) {
            return Err(OrderError { family: "flatlet", order, limit: Self::MAX_FLATLET });
        }
        let rows = flatlet_rows(order);
        let float = |rows: &[Vec<BigRational>]| rows.iter().flatten().map(to_f64).collect();
        let dual = inverse_transpose(&rows);
        Ok(TreeFamily { kind: TreeKind::Flatlet, order, primal: float(&rows), dual: float(&dual) })
    }

    /// Which family this is.
    pub fn kind(&self) -> TreeKind {
        self.kind
    }

    /// Functions per cell, `M`.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Vanishing moments of the wavelets with the fewest.
    pub fn vanishing_moments(&self) -> usize {
        self.order
    }

    /// The block, row-major `2M x 2M`: row `r` writes coarse function `r` (smooth first, then detail) in the fine
    /// functions of the left half, then the right half. This is `basis_xform_up` of one cell; its transpose is
    /// `coef_xform_down`.
    pub fn primal(&self) -> &[f64] {
        &self.primal
    }

    /// The inverse transpose of [`TreeFamily::primal`], same shape: row `r` writes dual function `r` in the fine duals.
    /// This is `coef_xform_up` of one cell; its transpose is `basis_xform_down`.
    pub fn dual(&self) -> &[f64] {
        &self.dual
    }

    /// Values of the `M` smooth functions of a cell at `x` in `[0, 1]` (0 outside). The functions of a cell of width
    /// `h` are these in `x = (t - start) / h`, for multiwavelets divided by `sqrt(h)` so that they stay orthonormal.
    ///
    /// # Panics
    /// If `out` has not `M` entries.
    pub fn smooth_values(&self, x: f64, out: &mut [f64]) {
        assert_eq!(out.len(), self.order, "one value per function");
        out.fill(0.0);
        if !(0.0..=1.0).contains(&x) {
            return;
        }
        match self.kind {
            TreeKind::Haar => out[0] = 1.0,
            TreeKind::Flatlet => out[((x * self.order as f64) as usize).min(self.order - 1)] = 1.0,
            TreeKind::Multiwavelet => out.copy_from_slice(&legendre(x)[..self.order]),
        }
    }
}

/// A signed square: `sign * sqrt(square)`, `(-1, 3/8)` is `-sqrt(3/8)`.
pub type SignedSquare = (i8, BigRational);

fn signed_root(s: &SignedSquare) -> f64 {
    f64::from(s.0) * to_f64(&s.1).sqrt()
}

/// Gram-Schmidt with weights, in order; rows are not normalised.
fn gram_schmidt(rows: Vec<Vec<BigRational>>, weights: &[BigRational]) -> Vec<Vec<BigRational>> {
    let dot = |a: &[BigRational], b: &[BigRational]| {
        a.iter().zip(b).zip(weights).fold(BigRational::zero(), |s, ((a, b), w)| s + a * b * w)
    };
    let mut done: Vec<Vec<BigRational>> = Vec::new();
    for mut row in rows {
        for d in &done {
            let f = dot(&row, d) / dot(d, d);
            row.iter_mut().zip(d).for_each(|(x, d)| *x -= &f * d);
        }
        done.push(row);
    }
    done
}

/// The multiwavelet block as signed squares of its entries, exact.
pub fn multiwavelet_squares(order: usize) -> Vec<Vec<SignedSquare>> {
    // Coordinates: Legendre polynomials P_m on each half, whose squared norms are (1/2) / (2m+1).
    let weights: Vec<_> = (0..2 * order).map(|i| ratio(1, 2 * (2 * (i % order) as i64 + 1))).collect();
    // x^k on the half [c/2, (c+1)/2] is ((u + 1)/4 + c/2)^k with u in [-1, 1].
    let project = |k: u32| {
        let mut row = Vec::new();
        for c in 0..2_i64 {
            let shift = ratio(1 + 2 * c, 4);
            let mono: Vec<_> = (0..=k).map(|j| binomial(k, j) * pow(&ratio(1, 4), j) * pow(&shift, k - j)).collect();
            row.extend((0..order as u32).map(|m| {
                // <u^j, P_m> (2m+1)/2
                let inner = mono.iter().enumerate().map(|(j, a)| a * monomial_legendre(j as u32, m));
                inner.fold(BigRational::zero(), |s, x| s + x) * ratio(2 * i64::from(m) + 1, 2)
            }));
        }
        row
    };
    let rows = gram_schmidt((0..2 * order as u32).map(project).collect(), &weights);
    rows.iter()
        .map(|row| {
            let norm = row.iter().zip(&weights).fold(BigRational::zero(), |s, (x, w)| s + x * x * w);
            let last = row.iter().rev().find(|x| !x.is_zero()).is_some_and(|x| x.is_positive());
            row.iter()
                .zip(&weights)
                .map(|(x, w)| {
                    let sign = if x.is_zero() {
                        0
                    } else if x.is_positive() == last {
                        1
                    } else {
                        -1
                    };
                    (sign, x * x * w / &norm)
                })
                .collect()
        })
        .collect()
}

fn pow(x: &BigRational, n: u32) -> BigRational {
    (0..n).fold(BigRational::one(), |p, _| p * x)
}

/// `int_{-1}^{1} u^j P_m(u) du`.
fn monomial_legendre(j: u32, m: u32) -> BigRational {
    // P_m = 2^-m sum_k (-1)^k C(m,k) C(2m-2k,m) u^(m-2k)
    let mut sum = BigRational::zero();
    for k in 0..=m / 2 {
        let power = j + m - 2 * k;
        if power.is_multiple_of(2) {
            let c = binomial(m, k) * binomial(2 * m - 2 * k, m) * ratio(2, i64::from(power) + 1);
            sum = if k % 2 == 0 { sum + c } else { sum - c };
        }
    }
    sum * pow(&ratio(1, 2), m)
}

/// The rows of the flatlet block: wide boxes, then the discrete orthogonal polynomials of degree `2M-1` down to `M`.
pub fn flatlet_rows(order: usize) -> Vec<Vec<BigRational>> {
    let n = 2 * order;
    let mut rows: Vec<Vec<BigRational>> =
        (0..order).map(|r| (0..n).map(|c| ratio(i64::from(c / 2 == r), 1)).collect()).collect();
    let powers = (0..n as u32).map(|k| (0..n).map(|c| pow(&ratio(2 * c as i64 + 1 - n as i64, 1), k)).collect());
    let weights = vec![BigRational::one(); n];
    for poly in gram_schmidt(powers.collect(), &weights).into_iter().skip(order).rev() {
        // Smallest integers; the last one positive, but for the two rows that the thesis prints the other way.
        let first = poly.iter().find(|x| !x.is_zero()).cloned().unwrap_or_else(BigRational::one);
        let scaled: Vec<_> = poly.iter().map(|x| x / &first).collect();
        let lcm = scaled.iter().fold(BigRational::one(), |l, x| {
            let product = &l * x;
            l * BigRational::from(product.denom().clone())
        });
        let mut row: Vec<_> = scaled.iter().map(|x| x * &lcm).collect();
        let gcd = row.iter().fold(BigRational::zero(), |g, x| gcd(g, x.abs()));
        let printed_negative = order == 1 || (order == 2 && rows.len() == 3);
        let negative = row[n - 1].is_negative() != printed_negative;
        row.iter_mut().for_each(|x| {
            *x = &*x / &gcd;
            if negative {
                *x = -&*x;
            }
        });
        rows.push(row);
    }
    rows
}

fn gcd(mut a: BigRational, mut b: BigRational) -> BigRational {
    while !b.is_zero() {
        (a, b) = (b.clone(), &a - (&a / &b).floor() * &b);
    }
    a
}

/// The inverse transpose of a small square matrix, exactly.
///
/// # Panics
/// If the matrix is singular.
pub fn inverse_transpose(rows: &[Vec<BigRational>]) -> Vec<Vec<BigRational>> {
    let n = rows.len();
    let mut a = rows.to_vec();
    let mut inv: Vec<Vec<_>> = (0..n).map(|i| (0..n).map(|j| ratio(i64::from(i == j), 1)).collect()).collect();
    for c in 0..n {
        let p = (c..n).find(|&r| !a[r][c].is_zero()).expect("matrix is regular");
        a.swap(c, p);
        inv.swap(c, p);
        let d = a[c][c].clone();
        a[c].iter_mut().chain(inv[c].iter_mut()).for_each(|x| *x /= &d);
        for r in (0..n).filter(|&r| r != c) {
            let f = a[r][c].clone();
            if !f.is_zero() {
                for k in 0..n {
                    let (x, y) = (&f * &a[c][k], &f * &inv[c][k]);
                    a[r][k] -= x;
                    inv[r][k] -= y;
                }
            }
        }
    }
    (0..n).map(|i| (0..n).map(|j| inv[j][i].clone()).collect()).collect()
}
