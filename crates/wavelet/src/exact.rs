//! Exact rationals, Laurent polynomials and the bi-orthogonal B-spline filters derived in them.
//!
//! What flows in: the orders (N, N~) of a spline family. What flows out: the sequences h, g, h~, g~ of Eqs. 15-19 and
//! A.1, as exact rationals. Floats appear only when a finished table is rounded.

pub use num_rational::BigRational;
use num_traits::{One, ToPrimitive, Zero};

/// `p / q`, exactly.
///
/// # Panics
/// If `q` is 0.
pub fn ratio(p: i64, q: i64) -> BigRational {
    BigRational::new(p.into(), q.into())
}

/// The nearest `f64`.
pub fn to_f64(x: &BigRational) -> f64 {
    x.to_f64().unwrap_or(f64::NAN)
}

/// A finite sequence `coef[i]` at the offsets `first + i`: a filter, or a Laurent polynomial.
///
/// Empty means zero; otherwise the first and last entries are not zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Sequence {
    /// Offset of `coef[0]`.
    pub first: isize,
    /// The entries.
    pub coef: Vec<BigRational>,
}

impl Sequence {
    /// The sequence with zeros trimmed at both ends.
    pub fn new(first: isize, coef: Vec<BigRational>) -> Sequence {
        let lead = coef.iter().take_while(|c| c.is_zero()).count();
        let end = coef.len() - coef[lead..].iter().rev().take_while(|c| c.is_zero()).count();
        Sequence { first: first + lead as isize, coef: coef[lead..end].to_vec() }
    }

    /// The zero sequence.
    pub fn zero() -> Sequence {
        Sequence { first: 0, coef: Vec::new() }
    }

    /// True for the zero sequence.
    pub fn is_zero(&self) -> bool {
        self.coef.is_empty()
    }

    /// Offset of the last entry.
    pub fn last(&self) -> isize {
        self.first + self.coef.len() as isize - 1
    }

    /// Entry at an offset (0 outside).
    pub fn at(&self, k: isize) -> BigRational {
        let i = k - self.first;
        if i >= 0 && (i as usize) < self.coef.len() { self.coef[i as usize].clone() } else { BigRational::zero() }
    }

    /// Sum of all entries.
    pub fn sum(&self) -> BigRational {
        self.coef.iter().fold(BigRational::zero(), |a, b| a + b)
    }

    /// Every second entry: `out[j] = self[2 j + parity]`.
    pub fn phase(&self, parity: isize) -> Sequence {
        if self.is_zero() {
            return Sequence::zero();
        }
        let lo = (self.first - parity).div_euclid(2);
        let hi = (self.last() - parity).div_euclid(2) + 1;
        Sequence::new(lo, (lo..=hi).map(|j| self.at(2 * j + parity)).collect())
    }

    /// `out[k] = (-1)^(k+1) self[1-k]`: the wavelet sequence that belongs to a dual scaling sequence.
    pub fn alternate(&self) -> Sequence {
        let coef = (1 - self.last()..=1 - self.first)
            .map(|k| if k.rem_euclid(2) == 1 { self.at(1 - k) } else { -self.at(1 - k) })
            .collect();
        Sequence::new(1 - self.last(), coef)
    }

    /// The sequence rounded to `f64`.
    pub fn to_f64(&self) -> (isize, Vec<f64>) {
        (self.first, self.coef.iter().map(to_f64).collect())
    }
}

impl std::ops::Mul for &Sequence {
    type Output = Sequence;
    fn mul(self, other: &Sequence) -> Sequence {
        if self.is_zero() || other.is_zero() {
            return Sequence::zero();
        }
        let mut coef = vec![BigRational::zero(); self.coef.len() + other.coef.len() - 1];
        for (i, a) in self.coef.iter().enumerate() {
            for (j, b) in other.coef.iter().enumerate() {
                coef[i + j] += a * b;
            }
        }
        Sequence::new(self.first + other.first, coef)
    }
}

impl std::ops::Sub for &Sequence {
    type Output = Sequence;
    fn sub(self, other: &Sequence) -> Sequence {
        if self.is_zero() && other.is_zero() {
            return Sequence::zero();
        }
        let (mut lo, mut hi) = (isize::MAX, isize::MIN);
        for s in [self, other].into_iter().filter(|s| !s.is_zero()) {
            lo = lo.min(s.first);
            hi = hi.max(s.last());
        }
        Sequence::new(lo, (lo..=hi).map(|k| self.at(k) - other.at(k)).collect())
    }
}

/// The four sequences of a spline family, each relative to fine position `2 k` for the coarse function `k`.
///
/// `phi_k = sum h[m] phi_fine[2k+m]`, `psi_k = sum g[m] phi_fine[2k+m]` (Eqs. 15, 16); `smooth[k] = sum
/// h_dual[m] fine[2k+m]`, `detail[k] = sum g_dual[m] fine[2k+m]` (Eq. 27). The wavelet is centred at `2k + 1`.
#[derive(Clone, Debug)]
pub struct SplineFilters {
    /// Scaling sequence h.
    pub h: Sequence,
    /// Wavelet sequence g.
    pub g: Sequence,
    /// Dual scaling sequence h~.
    pub h_dual: Sequence,
    /// Dual wavelet sequence g~.
    pub g_dual: Sequence,
}

/// `n` over `k`.
pub(crate) fn binomial(n: u32, k: u32) -> BigRational {
    (0..k).fold(BigRational::one(), |b, i| b * ratio(i64::from(n - i), i64::from(i + 1)))
}

/// The Cohen-Daubechies-Feauveau filters whose scaling function is the B-spline of order `n` (degree `n - 1`) and
/// whose wavelet has `n_dual` vanishing moments. `(4, 4)` is A.1 of the thesis.
///
/// `h = 2 ((1+z)/2)^N` and `h~ = ((1+z)/2)^N~ sum_k C(K-1+k, k) y^k` with `y = (2 - z - 1/z)/4`, `K = (N + N~)/2`;
/// `g[k] = (-1)^(k+1) h~[1-k]` and `g~[k] = (-1)^(k+1) h[1-k]`.
///
/// # Panics
/// If `n + n_dual` is odd: no such family.
pub fn spline_filters(n: u32, n_dual: u32) -> SplineFilters {
    assert!((n + n_dual).is_multiple_of(2), "orders {n} and {n_dual} must be both even or both odd");
    let half_power = |n: u32| {
        let scale = (0..n).fold(BigRational::one(), |s, _| s / ratio(2, 1));
        Sequence::new(-(n as isize / 2), (0..=n).map(|k| binomial(n, k) * &scale).collect())
    };
    let mut h = half_power(n);
    h.coef.iter_mut().for_each(|c| *c *= ratio(2, 1));
    let y = Sequence::new(-1, vec![ratio(-1, 4), ratio(1, 2), ratio(-1, 4)]);
    let k_max = (n + n_dual) / 2;
    let mut power = Sequence::new(0, vec![BigRational::one()]);
    let mut p = Sequence::zero();
    for k in 0..k_max {
        let b = Sequence::new(0, vec![-binomial(k_max - 1 + k, k)]);
        p = &p - &(&b * &power);
        power = &power * &y;
    }
    let h_dual = &half_power(n_dual) * &p;
    SplineFilters { g: h_dual.alternate(), g_dual: h.alternate(), h, h_dual }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bicubic_filters_are_those_of_the_thesis() {
        let f = spline_filters(4, 4);
        let over = |d: i64, c: &[i64]| c.iter().map(|&c| ratio(c, d)).collect::<Vec<_>>();
        assert_eq!(f.h, Sequence::new(-2, over(8, &[1, 4, 6, 4, 1])));
        assert_eq!(f.h_dual, Sequence::new(-5, over(256, &[-5, 20, -1, -96, 70, 280, 70, -96, -1, 20, -5])));
        assert_eq!(f.g, Sequence::new(-4, over(256, &[5, 20, 1, -96, -70, 280, -70, -96, 1, 20, 5])));
        assert_eq!(f.g_dual, Sequence::new(-1, over(8, &[1, -4, 6, -4, 1])));
    }

    #[test]
    fn every_family_is_biorthogonal() {
        for (n, nd) in [(1, 1), (2, 2), (3, 3), (4, 4), (4, 6), (6, 12), (5, 7)] {
            let f = spline_filters(n, nd);
            let dot = |a: &Sequence, b: &Sequence, shift: isize| {
                (a.first..=a.last()).fold(BigRational::zero(), |s, m| s + a.at(m) * b.at(m - 2 * shift))
            };
            for shift in -12..=12 {
                let delta = if shift == 0 { BigRational::one() } else { BigRational::zero() };
                assert_eq!(dot(&f.h, &f.h_dual, shift), delta);
                assert_eq!(dot(&f.g, &f.g_dual, shift), delta);
                assert!(dot(&f.g, &f.h_dual, shift).is_zero());
                assert!(dot(&f.h, &f.g_dual, shift).is_zero());
            }
        }
    }
}
