//! Spline spaces as functions: evaluation, exact pieces, interpolation and projection.

use crate::banded::BandedLu;
use crate::coefficient::{Coefficient, Scalar};
use crate::exact::{BigRational, ratio};
use crate::extension::Extension;
use crate::family::{Boundary, SplineFamily};
use crate::gram::exact_energy;
use crate::open::OpenKnots;
use crate::piecewise::Piecewise;
use num_traits::One;

impl SplineFamily {
    /// The scaling function phi: the B-spline of this order on `[0, N]`.
    pub fn scaling_function(self) -> Piecewise {
        Piecewise::bspline(&(0..=i64::from(self.order())).collect::<Vec<_>>())
    }

    /// The wavelet psi in units of the *finer* level, as in section 2.3.1: `psi(t) = sum_k g_k phi(t - k)`, starting at
    /// `t = 0`. For the cubic family it lives on `[0, 14]` and is symmetric about 7.
    pub fn wavelet(self) -> Piecewise {
        let g = self.filters().g;
        let (phi, one) = (self.scaling_function(), BigRational::one());
        let term = |(k, c): (usize, &BigRational)| (c.clone(), phi.transformed(&one, &ratio(k as i64, 1)));
        Piecewise::combine(&g.coef.iter().enumerate().map(term).collect::<Vec<_>>())
    }
}

/// A space of splines with unit spans on one axis: what finest-level coefficients mean.
///
/// ```
/// use ondelette_wavelet::{Boundary, SplineFamily, SplineSpace};
/// let space = SplineSpace::new(SplineFamily::CUBIC, Boundary::Open, 8)?;
/// // Every cubic is in the open space.
/// let cubic = |t: f64| t * t * t - 2.0 * t;
/// let samples: Vec<f64> = space.sites().iter().map(|&t| cubic(t)).collect();
/// let c = space.interpolate(&samples)?;
/// assert!((space.eval(&c, 2.7, 0) - cubic(2.7)).abs() < 1e-12);
/// # Ok::<(), ondelette_wavelet::SpaceError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SplineSpace {
    family: SplineFamily,
    boundary: Boundary,
    len: usize,
    /// Values of the scaling function and its derivatives, by piece.
    derivatives: Vec<Piecewise>,
}

/// Why there is no such space, or a function cannot be found in it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpaceError {
    /// Open is cubic only, with at least 4 coefficients; others need one.
    #[error("no space of {len} coefficients of order {order} with {boundary} boundary; open is cubic with 4 or more")]
    None {
        /// Coefficients asked for.
        len: usize,
        /// Spline order.
        order: u32,
        /// Boundary.
        boundary: Boundary,
    },
    /// The wrong number of samples.
    #[error("{got} samples for {want} interpolation sites")]
    Samples {
        /// Samples given.
        got: usize,
        /// Sites.
        want: usize,
    },
    /// The interpolation conditions do not determine the function.
    #[error("interpolation at the sites of this space has no unique solution")]
    Singular,
}

impl SplineSpace {
    /// The space with `len` coefficients.
    ///
    /// # Errors
    /// [`SpaceError::None`].
    pub fn new(family: SplineFamily, boundary: Boundary, len: usize) -> Result<SplineSpace, SpaceError> {
        let fits = match boundary {
            Boundary::Open => family == SplineFamily::CUBIC && len >= 4,
            Boundary::Periodic => len >= 1,
            Boundary::Mirrored => len > usize::from(family.order().is_multiple_of(2)),
        };
        if !fits {
            return Err(SpaceError::None { len, order: family.order(), boundary });
        }
        let mut derivatives = vec![family.scaling_function()];
        for d in 0..family.order() as usize - 1 {
            derivatives.push(derivatives[d].derivative());
        }
        Ok(SplineSpace { family, boundary, len, derivatives })
    }

    /// Number of coefficients.
    pub fn len(&self) -> usize {
        self.len
    }

    /// True without coefficients (there is no such space).
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Number of spans: the parameter runs over `[0, spans]`.
    pub fn spans(&self) -> usize {
        match self.boundary {
            Boundary::Open => self.len - 3,
            Boundary::Mirrored if self.family.order().is_multiple_of(2) => self.len - 1,
            _ => self.len,
        }
    }

    fn extension(&self) -> Extension {
        match self.boundary {
            Boundary::Periodic => Extension::Periodic,
            _ if self.family.order() % 2 == 1 => Extension::Half,
            _ => Extension::Whole,
        }
    }

    /// The functions alive at `t` with their derivative of the given order: `(index, value)`; an index can appear more
    /// than once in short spaces. `t` outside the interval is clamped (loops wrap); at the right end the derivative is
    /// the limit from the left.
    pub fn basis(&self, t: f64, derivative: usize) -> Vec<(usize, f64)> {
        let n = self.spans();
        let order = self.family.order() as isize;
        let t = if self.boundary == Boundary::Periodic { t.rem_euclid(n as f64) } else { t.clamp(0.0, n as f64) };
        let span = (t as usize).min(n - 1);
        if self.boundary == Boundary::Open {
            return open_basis(n, span, t, derivative);
        }
        let Some(phi) = self.derivatives.get(derivative) else { return Vec::new() };
        // Function p is centred at t = p (even order) or p + 1/2: its support starts at p - floor(N/2).
        let half = order / 2;
        (0..order)
            .map(|piece| {
                let p = span as isize - piece + half;
                let poly = &phi.pieces()[piece as usize];
                let u = t - span as f64;
                let value = poly.iter().rev().fold(0.0, |v, c| v * u + crate::exact::to_f64(c));
                (self.extension().fine(self.len, p), value)
            })
            .collect()
    }

    /// The function with the given coefficients at `t`, or a derivative of it.
    ///
    /// # Panics
    /// If the number of coefficients does not fit.
    #[track_caller]
    pub fn eval<C: Coefficient>(&self, coefficients: &[C], t: f64, derivative: usize) -> C {
        assert_eq!(coefficients.len(), self.len, "coefficients of another space");
        let mut out = C::default();
        for (i, v) in self.basis(t, derivative) {
            let v = C::Scalar::from_f64(v);
            let from = C::flat(std::slice::from_ref(&coefficients[i]));
            for (o, &x) in C::flat_mut(std::slice::from_mut(&mut out)).iter_mut().zip(from) {
                *o += v * x;
            }
        }
        out
    }

    /// Where samples are taken: knots (even orders), middles of spans (odd orders), and for the open space the means
    /// of three consecutive knots (Greville's abscissae), as many as there are coefficients.
    pub fn sites(&self) -> Vec<f64> {
        let n = self.spans();
        if self.boundary == Boundary::Open {
            let knot = |i: isize| i.clamp(0, n as isize) as f64;
            return (0..self.len as isize).map(|j| (knot(j - 2) + knot(j - 1) + knot(j)) / 3.0).collect();
        }
        let shift = if self.family.order() % 2 == 1 { 0.5 } else { 0.0 };
        (0..self.len).map(|i| i as f64 + shift).collect()
    }

    /// The coefficients of the function through the given samples at [`SplineSpace::sites`]. Linear time.
    ///
    /// # Errors
    /// The wrong number of samples.
    pub fn interpolate<C: Coefficient>(&self, samples: &[C]) -> Result<Vec<C>, SpaceError> {
        if samples.len() != self.len {
            return Err(SpaceError::Samples { got: samples.len(), want: self.len });
        }
        let mut out = samples.to_vec();
        self.interpolation()?.solve(C::flat_mut(&mut out), C::CHANNELS);
        Ok(out)
    }

    pub(crate) fn interpolation(&self) -> Result<Cyclic, SpaceError> {
        let rows = self.sites().iter().map(|&t| self.basis(t, 0)).collect();
        Cyclic::new(rows).ok_or(SpaceError::Singular)
    }

    /// The best approximation of a function in the mean square, by Gauss rules on every span (exact for polynomials
    /// up to degree `2 points - N`).
    ///
    /// # Errors
    /// Never for a space that exists, short of rounding.
    pub fn project(&self, points: usize, f: impl Fn(f64) -> f64) -> Result<Vec<f64>, SpaceError> {
        let (nodes, weights) = ondelette_numerics::gauss::rule(points);
        let mut right = vec![0.0; self.len];
        for span in 0..self.spans() {
            for (x, w) in nodes.iter().zip(&weights) {
                let t = span as f64 + x;
                let value = f(t) * w;
                self.basis(t, 0).into_iter().for_each(|(i, v)| right[i] += v * value);
            }
        }
        let mut rows = vec![Vec::new(); self.len];
        for (i, j, v) in exact_energy(self.family, self.boundary, self.len, 0) {
            rows[i].push((j, crate::exact::to_f64(&v)));
        }
        Cyclic::new(rows).ok_or(SpaceError::Singular)?.solve(&mut right, 1);
        Ok(right)
    }

    /// Function `i`, restricted to the interval, as exact pieces.
    ///
    /// # Panics
    /// If there is no such function.
    pub fn function(&self, i: usize) -> Piecewise {
        assert!(i < self.len, "function {i} of {}", self.len);
        let n = self.spans() as i64;
        if self.boundary == Boundary::Open {
            return OpenKnots::uniform(self.len - 3).function(i);
        }
        let order = i64::from(self.family.order());
        let phi = &self.derivatives[0];
        let mut terms = Vec::new();
        for start in -order + 1..n {
            // Function p starts at p - floor(N/2).
            if self.extension().fine(self.len, (start + order / 2) as isize) == i {
                terms.push((BigRational::one(), phi.transformed(&BigRational::one(), &ratio(start, 1))));
            }
        }
        let sum = Piecewise::combine(&terms);
        let inside: Vec<_> = (0..sum.pieces().len())
            .filter(|&k| sum.breaks()[k] >= ratio(0, 1) && sum.breaks()[k + 1] <= ratio(n, 1))
            .collect();
        let breaks = inside.iter().map(|&k| sum.breaks()[k].clone());
        let last = inside.last().map(|&k| sum.breaks()[k + 1].clone());
        let pieces = inside.iter().map(|&k| sum.pieces()[k].clone()).collect();
        Piecewise::new(breaks.chain(last).collect(), pieces)
    }
}

/// de Boor's recursion on an open span: the four functions alive and a derivative of them.
fn open_basis(n: usize, span: usize, t: f64, derivative: usize) -> Vec<(usize, f64)> {
    let knot = |i: isize| i.clamp(0, n as isize) as f64;
    let s = span as isize;
    let degree = 3;
    if derivative > degree {
        return (0..4).map(|i| (span + i, 0.0)).collect();
    }
    // Values of the functions of degree 3 - derivative, then differences back up.
    let mut values = vec![1.0];
    for d in 1..=degree - derivative {
        let mut next = vec![0.0; d + 1];
        for (k, v) in values.iter().enumerate() {
            let i = s - d as isize + 1 + k as isize;
            let (a, b) = (knot(i), knot(i + d as isize));
            let w = (t - a) / (b - a);
            next[k] += (1.0 - w) * v;
            next[k + 1] += w * v;
        }
        values = next;
    }
    for d in degree - derivative + 1..=degree {
        let mut next = vec![0.0; d + 1];
        for (k, v) in values.iter().enumerate() {
            let i = s - d as isize + 1 + k as isize;
            let w = d as f64 / (knot(i + d as isize) - knot(i));
            next[k] -= w * v;
            next[k + 1] += w * v;
        }
        values = next;
    }
    values.into_iter().enumerate().map(|(k, v)| (span + k, v)).collect()
}

/// A banded matrix with corners (periodic spaces), solved by a band and a small dense correction.
#[derive(Clone, Debug)]
pub(crate) struct Cyclic {
    band: BandedLu,
    /// Corner entries `(row, column, value)`, the solved columns of their rows, and the inverse of the small system.
    corners: Vec<(usize, usize, f64)>,
    columns: Vec<Vec<f64>>,
    small: Vec<Vec<f64>>,
}

impl Cyclic {
    fn new(rows: Vec<Vec<(usize, f64)>>) -> Option<Cyclic> {
        let n = rows.len();
        let mut corners = Vec::new();
        let mut band = vec![Vec::new(); n];
        for (i, row) in rows.into_iter().enumerate() {
            for (j, v) in row {
                if v == 0.0 {
                    continue;
                }
                if n > 16 && i.abs_diff(j) > n / 2 {
                    corners.push((i, j, v));
                } else if let Some(e) = band[i].iter_mut().find(|e: &&mut (usize, f64)| e.0 == j) {
                    e.1 += v;
                } else {
                    band[i].push((j, v));
                }
            }
        }
        let band = BandedLu::new(&band)?;
        // Woodbury: (B + sum u_r v_r^T)^-1 with u_r = value e_row, v_r = e_column.
        let columns: Vec<Vec<f64>> = corners
            .iter()
            .map(|&(i, _, v)| {
                let mut u = vec![0.0; n];
                u[i] = v;
                band.solve(&mut u, 1);
                u
            })
            .collect();
        let m = corners.len();
        let mut small: Vec<Vec<f64>> = (0..m)
            .map(|r| {
                let mut row: Vec<f64> =
                    (0..m).map(|c| columns[c][corners[r].1] + f64::from(u8::from(r == c))).collect();
                row.extend((0..m).map(|c| f64::from(u8::from(r == c))));
                row
            })
            .collect();
        for c in 0..m {
            let p = (c..m).max_by(|&a, &b| small[a][c].abs().total_cmp(&small[b][c].abs()))?;
            small.swap(c, p);
            let d = small[c][c];
            if d.abs() < 1e-13 {
                return None;
            }
            small[c].iter_mut().for_each(|x| *x /= d);
            let lead = small[c].clone();
            for (r, row) in small.iter_mut().enumerate() {
                let f = row[c];
                if r != c && f != 0.0 {
                    row.iter_mut().zip(&lead).for_each(|(x, l)| *x -= f * l);
                }
            }
        }
        let small = small.into_iter().map(|row| row[m..].to_vec()).collect();
        Some(Cyclic { band, corners, columns, small })
    }

    /// Solves in place for `channels` interleaved right-hand sides.
    pub(crate) fn solve<S: Scalar>(&self, x: &mut [S], channels: usize) {
        self.band.solve(x, channels);
        if self.corners.is_empty() {
            return;
        }
        for k in 0..channels {
            let at: Vec<f64> = self.corners.iter().map(|c| x[c.1 * channels + k].to_f64()).collect();
            for (row, column) in self.small.iter().zip(&self.columns) {
                let w: f64 = row.iter().zip(&at).map(|(a, b)| a * b).sum();
                for (i, c) in column.iter().enumerate() {
                    x[i * channels + k] += S::from_f64(-w * c);
                }
            }
        }
    }
}
