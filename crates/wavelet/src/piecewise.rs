//! Exact piecewise polynomials: scaling functions, wavelets, and everything integrated from them.

use crate::exact::{BigRational, binomial, ratio, to_f64};
use num_traits::{One, Zero};

/// A piecewise polynomial with rational breaks and coefficients, zero outside its support.
///
/// Piece `i` lives on `[breaks[i], breaks[i+1])` in powers of `t - breaks[i]`.
///
/// ```
/// use ondelette_wavelet::Piecewise;
/// let hat = Piecewise::bspline(&[0, 1, 2]);
/// assert_eq!(hat.eval(0.25), 0.25);
/// assert_eq!(hat.inner(&hat), ondelette_wavelet::exact::ratio(2, 3));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Piecewise {
    breaks: Vec<BigRational>,
    pieces: Vec<Vec<BigRational>>,
    float: Vec<(f64, Vec<f64>)>,
}

fn shifted(poly: &[BigRational], by: &BigRational) -> Vec<BigRational> {
    // p(x + by) in powers of x.
    let mut out = vec![BigRational::zero(); poly.len()];
    for (k, a) in poly.iter().enumerate() {
        let mut power = BigRational::one();
        for j in (0..=k).rev() {
            out[j] += a * binomial(k as u32, j as u32) * &power;
            power *= by;
        }
    }
    out
}

impl Piecewise {
    /// From breaks (increasing) and pieces (one fewer).
    ///
    /// # Panics
    /// If the counts do not fit or the breaks do not increase.
    pub fn new(breaks: Vec<BigRational>, pieces: Vec<Vec<BigRational>>) -> Piecewise {
        assert!(breaks.len() == pieces.len() + 1 || (breaks.is_empty() && pieces.is_empty()), "one piece per span");
        assert!(breaks.windows(2).all(|w| w[0] < w[1]), "breaks must increase");
        let float = breaks.iter().zip(&pieces).map(|(b, p)| (to_f64(b), p.iter().map(to_f64).collect())).collect();
        Piecewise { breaks, pieces, float }
    }

    /// The zero function.
    pub fn zero() -> Piecewise {
        Piecewise::new(Vec::new(), Vec::new())
    }

    /// The B-spline with the given non-decreasing integer knots, one more than its order (Eq. 6, right indices).
    ///
    /// # Panics
    /// With fewer than two knots, or all knots equal.
    pub fn bspline(knots: &[i64]) -> Piecewise {
        assert!(knots.len() >= 2 && knots[0] < knots[knots.len() - 1], "a B-spline needs two different knots");
        let mut breaks = knots.to_vec();
        breaks.dedup();
        let pieces = breaks
            .windows(2)
            .map(|span| {
                // de Boor's recursion on this span, in powers of u = t - span[0].
                let mut level: Vec<Vec<BigRational>> =
                    knots.windows(2).map(|k| if k == span { vec![BigRational::one()] } else { Vec::new() }).collect();
                // With repeated knots a span can only equal the last of its copies, which is the right one.
                for d in 1..knots.len() - 1 {
                    level = (0..knots.len() - 1 - d)
                        .map(|i| {
                            let mut out = vec![BigRational::zero(); d + 1];
                            let mut add = |poly: &[BigRational], c0: BigRational, c1: BigRational| {
                                for (k, a) in poly.iter().enumerate() {
                                    out[k] += a * &c0;
                                    out[k + 1] += a * &c1;
                                }
                            };
                            let (a, b) = (knots[i], knots[i + d]);
                            if b > a {
                                add(&level[i], ratio(span[0] - a, b - a), ratio(1, b - a));
                            }
                            let (a, b) = (knots[i + 1], knots[i + d + 1]);
                            if b > a {
                                add(&level[i + 1], ratio(b - span[0], b - a), ratio(-1, b - a));
                            }
                            out
                        })
                        .collect();
                }
                level.swap_remove(0)
            })
            .collect();
        Piecewise::new(breaks.iter().map(|&b| ratio(b, 1)).collect(), pieces)
    }

    /// Where the function can be non-zero, `None` for the zero function.
    pub fn support(&self) -> Option<(f64, f64)> {
        Some((to_f64(self.breaks.first()?), to_f64(self.breaks.last()?)))
    }

    /// Breaks of the pieces.
    pub fn breaks(&self) -> &[BigRational] {
        &self.breaks
    }

    /// Coefficients of the pieces in powers of the distance to their left break.
    pub fn pieces(&self) -> &[Vec<BigRational>] {
        &self.pieces
    }

    /// Value at `t`; from the right at a break, from the left at the end of the support.
    pub fn eval(&self, t: f64) -> f64 {
        let Some((first, last)) = self.support() else { return 0.0 };
        if !(first..=last).contains(&t) {
            return 0.0;
        }
        let i = self.float.partition_point(|p| p.0 <= t) - 1;
        let (start, poly) = &self.float[i];
        poly.iter().rev().fold(0.0, |v, c| v * (t - start) + c)
    }

    /// The derivative, piece by piece.
    pub fn derivative(&self) -> Piecewise {
        let derive = |p: &Vec<BigRational>| p.iter().enumerate().skip(1).map(|(k, a)| a * ratio(k as i64, 1)).collect();
        Piecewise::new(self.breaks.clone(), self.pieces.iter().map(derive).collect())
    }

    /// `f(scale t - shift)`, `scale > 0`.
    ///
    /// # Panics
    /// If `scale` is not positive.
    pub fn transformed(&self, scale: &BigRational, shift: &BigRational) -> Piecewise {
        let breaks = self.breaks.iter().map(|b| (b + shift) / scale).collect();
        let pieces = self.pieces.iter().map(|p| {
            let mut power = BigRational::one();
            p.iter()
                .map(|a| {
                    let out = a * &power;
                    power *= scale;
                    out
                })
                .collect()
        });
        Piecewise::new(breaks, pieces.collect())
    }

    /// The sum of scaled functions.
    pub fn combine(terms: &[(BigRational, Piecewise)]) -> Piecewise {
        let mut breaks: Vec<BigRational> = terms.iter().flat_map(|t| t.1.breaks.iter().cloned()).collect();
        breaks.sort();
        breaks.dedup();
        let spans = breaks.len().saturating_sub(1);
        let mut pieces: Vec<Vec<BigRational>> = vec![Vec::new(); spans];
        for (a, f) in terms {
            for (piece, start) in pieces.iter_mut().zip(&breaks) {
                let local = f.local(start);
                if piece.len() < local.len() {
                    piece.resize(local.len(), BigRational::zero());
                }
                piece.iter_mut().zip(&local).for_each(|(p, l)| *p += a * l);
            }
        }
        Piecewise::new(if spans == 0 { Vec::new() } else { breaks }, pieces)
    }

    /// The polynomial on the piece that holds `start`, in powers of `t - start`.
    fn local(&self, start: &BigRational) -> Vec<BigRational> {
        let i = self.breaks.partition_point(|b| b <= start);
        if i == 0 || i > self.pieces.len() {
            return Vec::new();
        }
        shifted(&self.pieces[i - 1], &(start - &self.breaks[i - 1]))
    }

    /// Exact integral over the support.
    pub fn integral(&self) -> BigRational {
        self.moment(0)
    }

    /// Exact moment `int t^k f(t) dt`.
    pub fn moment(&self, k: u32) -> BigRational {
        let (Some(first), Some(last)) = (self.breaks.first(), self.breaks.last()) else { return BigRational::zero() };
        let mut power = vec![BigRational::zero(); k as usize + 1];
        power[k as usize] = BigRational::one();
        let monomial = Piecewise::new(vec![first.clone(), last.clone()], vec![shifted(&power, first)]);
        self.inner(&monomial)
    }

    /// Exact inner product `int f g dt`.
    pub fn inner(&self, other: &Piecewise) -> BigRational {
        let mut breaks: Vec<&BigRational> = self.breaks.iter().chain(&other.breaks).collect();
        breaks.sort();
        breaks.dedup();
        let mut sum = BigRational::zero();
        for span in breaks.windows(2) {
            let (p, q) = (self.local(span[0]), other.local(span[0]));
            let width = span[1] - span[0];
            let mut product = vec![BigRational::zero(); (p.len() + q.len()).saturating_sub(1)];
            for (i, a) in p.iter().enumerate() {
                for (j, b) in q.iter().enumerate() {
                    product[i + j] += a * b;
                }
            }
            let mut power = width.clone();
            for (k, c) in product.iter().enumerate() {
                sum += c * &power / ratio(k as i64 + 1, 1);
                power *= &width;
            }
        }
        sum
    }

    /// L2 norm.
    pub fn norm(&self) -> f64 {
        to_f64(&self.inner(self)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubic_segments_are_those_of_equation_7() {
        let phi = Piecewise::bspline(&[0, 1, 2, 3, 4]);
        let sixth = |c: [i64; 4]| c.map(|c| ratio(c, 6)).to_vec();
        assert_eq!(
            phi.pieces(),
            [sixth([0, 0, 0, 1]), sixth([1, 3, 3, -3]), sixth([4, 0, -6, 3]), sixth([1, -3, 3, -1])]
        );
        assert_eq!(phi.integral(), ratio(1, 1));
        assert_eq!(phi.moment(1), ratio(2, 1));
        assert_eq!(phi.inner(&phi), ratio(151, 315));
    }

    #[test]
    fn repeated_knots_make_the_end_functions() {
        let first = Piecewise::bspline(&[0, 0, 0, 0, 1]);
        assert_eq!(first.eval(0.0), 1.0);
        assert_eq!(first.inner(&first), ratio(1, 7));
        let last = Piecewise::bspline(&[0, 1, 1, 1, 1]);
        assert_eq!(last.eval(1.0), 1.0);
        assert_eq!(last.eval(1.0 + 1e-9), 0.0);
        let two_halves = Piecewise::combine(&[(ratio(1, 2), first.clone()), (ratio(1, 2), first.clone())]);
        assert_eq!(two_halves.pieces(), first.pieces());
    }
}
