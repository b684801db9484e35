//! Exact integrals of products of basis functions, and of their derivatives: mass, stretch and thin-plate matrices.

use crate::exact::{BigRational, ratio, to_f64};
use crate::extension::Extension;
use crate::family::{Boundary, Family, SplineFamily};
use crate::lifting::analysis_filters;
use crate::open::OpenKnots;
use crate::piecewise::Piecewise;
use crate::pyramid::Pyramid;
use crate::rung::Engine;
use crate::sparse::Sparse;
use num_traits::{One, Zero};

/// `T(k) = int D^a phi(t) D^a phi(t - k) dt` for `k = 0 ..= N - 1`, the stencil of uniform B-splines of order N.
///
/// ```
/// use ondelette_wavelet::{exact::ratio, gram::stencil};
/// assert_eq!(stencil(4, 2), [ratio(8, 3), ratio(-3, 2), ratio(0, 1), ratio(1, 6)]);
/// ```
pub fn stencil(order: u32, derivative: usize) -> Vec<BigRational> {
    let knots: Vec<i64> = (0..=i64::from(order)).collect();
    let phi = (0..derivative).fold(Piecewise::bspline(&knots), |f, _| f.derivative());
    let one = BigRational::one();
    (0..i64::from(order)).map(|k| phi.inner(&phi.transformed(&one, &ratio(k, 1)))).collect()
}

/// Entries of a banded Toeplitz matrix on the line, folded onto an interval: the integrals over `[0, n]` of the
/// continued functions.
fn folded(stencil: &[BigRational], len: usize, extension: Extension) -> Vec<(usize, usize, BigRational)> {
    let reach = stencil.len() as isize - 1;
    let n = len as isize;
    // Positions of all copies of a function: i + period m, and mirrored ones.
    let (period, mirrored) = match extension {
        Extension::Periodic => (n, None),
        Extension::Whole => ((2 * (n - 1)).max(1), Some(0)),
        Extension::Half => (2 * n, Some(-1)),
    };
    let on_mirror = |i: isize| extension == Extension::Whole && (i == 0 || i == n - 1);
    let mut out = Vec::new();
    for i in 0..n {
        for j in near(i, reach, n, extension) {
            let mut sum = BigRational::zero();
            let mut copies = vec![i];
            if let Some(c) = mirrored {
                copies.push(c - i);
            }
            for copy in copies {
                // |copy + period m - j| <= reach
                let m0 = (j - reach - copy).div_euclid(period);
                for m in m0..=m0 + 2 * (reach / period + 2) {
                    let d = (copy + period * m - j).abs();
                    if d <= reach {
                        sum += &stencil[d as usize];
                    }
                }
            }
            let halves = u32::from(on_mirror(i)) + u32::from(on_mirror(j));
            let sum = sum / ratio(1 << halves, 1);
            if !sum.is_zero() {
                out.push((i as usize, j as usize, sum));
            }
        }
    }
    out
}

/// Functions that can overlap function `i`.
fn near(i: isize, reach: isize, n: isize, extension: Extension) -> Vec<isize> {
    if n <= 4 * reach + 4 {
        return (0..n).collect();
    }
    let all = i - reach..=i + reach;
    match extension {
        Extension::Periodic => all.map(|j| j.rem_euclid(n)).collect(),
        _ => all.filter(|j| (0..n).contains(j)).collect(),
    }
}

/// The exact energy matrix `int D^a B_i D^a B_j` of a B-spline space with `len` coefficients, in units of its span,
/// as `(row, column, value)`.
///
/// # Panics
/// If the open space is too short, or open is asked for a family other than the cubic one.
pub fn exact_energy(
    family: SplineFamily,
    boundary: Boundary,
    len: usize,
    derivative: usize,
) -> Vec<(usize, usize, BigRational)> {
    let extension = match boundary {
        Boundary::Open => {
            assert!(family == SplineFamily::CUBIC && len >= 4, "the open basis is cubic, with 4 functions or more");
            return open_energy(len - 3, derivative);
        }
        Boundary::Periodic => Extension::Periodic,
        Boundary::Mirrored if family.order() % 2 == 1 => Extension::Half,
        Boundary::Mirrored => Extension::Whole,
    };
    folded(&stencil(family.order(), derivative), len, extension)
}

fn open_energy(spans: usize, derivative: usize) -> Vec<(usize, usize, BigRational)> {
    // Only the three functions at each end differ; the matrix of few spans has all entries.
    let small = spans.min(12);
    let exact = OpenKnots::uniform(small).gram(derivative);
    let n = spans + 3;
    let mut out = Vec::new();
    for i in 0..n {
        for j in i.saturating_sub(3)..(i + 4).min(n) {
            let (a, b) = if i.min(j) < 6 || spans == small {
                (i, j)
            } else if i.max(j) + 6 >= n {
                (i + small - spans, j + small - spans)
            } else {
                (6, 6 + i.abs_diff(j))
            };
            if !exact[a][b].is_zero() {
                out.push((i, j, exact[a][b].clone()));
            }
        }
    }
    out
}

/// The energy matrix of the finest functions of a B-spline pyramid, rounded; `None` for families without derivatives.
pub fn energy(pyramid: &Pyramid, derivative: usize) -> Option<Sparse> {
    let family = match pyramid.family() {
        Family::Spline(s) => s,
        Family::Cdf53 => SplineFamily::LINEAR,
        _ => return None,
    };
    let n = pyramid.len();
    let exact = exact_energy(family, pyramid.boundary(), n, derivative);
    Some(Sparse::from_triplets(n, n, exact.into_iter().map(|(i, j, v)| (i, j, to_f64(&v))).collect()))
}

/// The mass (Gram) matrix of the finest functions of any pyramid.
pub fn mass(pyramid: &Pyramid) -> Sparse {
    if let Some(m) = energy(pyramid, 0) {
        return m;
    }
    let n = pyramid.len();
    match (pyramid.family(), pyramid.levels()) {
        (Family::Cdf97, levels) if levels > 0 => {
            let Engine::Lifted(l) = &pyramid.rung(levels - 1).engine else { return Sparse::identity(n) };
            let exact: Vec<BigRational> = autocorrelation(&analysis_filters(&l.scheme.dual())[0].1)
                .into_iter()
                .map(|x| BigRational::from_float(x).unwrap_or_else(BigRational::zero))
                .collect();
            let folded = folded(&exact, n, l.extension);
            Sparse::from_triplets(n, n, folded.into_iter().map(|(i, j, v)| (i, j, to_f64(&v))).collect())
        }
        // Boxes, orthonormal polynomials and orthogonal wavelets.
        _ => Sparse::identity(n),
    }
}

/// `T(k) = int phi(t) phi(t-k)` of a refinable function, the fixed point of `T(k) = 1/2 sum h_m h_n T(2k + m - n)`.
fn autocorrelation(h: &[f64]) -> Vec<f64> {
    let n = h.len() as isize;
    let square: Vec<f64> = (1 - n..n)
        .map(|d| (0..n).filter(|m| (0..n).contains(&(m - d))).map(|m| h[m as usize] * h[(m - d) as usize]).sum())
        .collect();
    let mut t = vec![0.0; n as usize];
    t[0] = 1.0;
    for _ in 0..200 {
        let at = |k: isize| t.get(k.unsigned_abs()).copied().unwrap_or(0.0);
        let next: Vec<f64> =
            (0..n).map(|k| (1 - n..n).map(|d| 0.5 * square[(d + n - 1) as usize] * at(2 * k + d)).sum()).collect();
        t = next;
    }
    // Unit integral: sum over all k is 1.
    let sum: f64 = t[0] + 2.0 * t[1..].iter().sum::<f64>();
    t.iter().map(|x| x / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cascade_gives_the_exact_gram_of_splines() {
        let h: Vec<f64> = SplineFamily::CUBIC.filters().h.to_f64().1;
        for (a, b) in autocorrelation(&h).iter().zip(stencil(4, 0)) {
            assert!((a - to_f64(&b)).abs() < 1e-14);
        }
    }

    #[test]
    fn masses_integrate_one() {
        // The functions of each space sum to one, so all entries of the mass matrix sum to the length of the interval.
        for (boundary, len, spans) in
            [(Boundary::Mirrored, 9, 8), (Boundary::Periodic, 8, 8), (Boundary::Open, 11, 8), (Boundary::Open, 33, 30)]
        {
            let all = exact_energy(SplineFamily::CUBIC, boundary, len, 0);
            assert_eq!(all.into_iter().fold(BigRational::zero(), |s, e| s + e.2), ratio(spans, 1));
        }
        let quadratic = exact_energy(SplineFamily::QUADRATIC, Boundary::Mirrored, 7, 0);
        assert_eq!(quadratic.into_iter().fold(BigRational::zero(), |s, e| s + e.2), ratio(7, 1));
    }
}
