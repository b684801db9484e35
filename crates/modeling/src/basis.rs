//! The cubic B-splines of an [`Axis`] that are alive at a parameter, with their derivatives.
//!
//! Numbering, with knots at the integers `0 ..= spans`: mirrored and periodic function `i` is the uniform B-spline with
//! its centre at knot `i` (its neighbours are reflected, or wrapped); open function `i` belongs to the knots
//! `i - 3 ..= i + 1`, clamped to the interval (quadruple end knots).

use crate::axis::Axis;
use ondelette_wavelet::Boundary;

/// The four functions alive on a span: `values[k]` belongs to coefficient `index[k]`.
///
/// On short mirrored or periodic axes an index can appear more than once; its values add.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Taps {
    /// Coefficients, in order of their functions along the axis.
    pub index: [usize; 4],
    /// Values (or derivatives) of their functions.
    pub values: [f64; 4],
}

impl Taps {
    /// The sum of `values[k] * coefficients[index[k]]`.
    ///
    /// # Panics
    /// If an index is outside `coefficients`.
    pub fn apply(&self, coefficients: &[f64]) -> f64 {
        self.index.iter().zip(&self.values).map(|(&i, v)| v * coefficients[i]).sum()
    }

    /// Index and value, pair by pair.
    pub fn iter(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.index.iter().copied().zip(self.values.iter().copied())
    }
}

/// The functions alive at `t` (domain units) with their derivative of order `derivative`, in domain units.
///
/// Constant time. `t` outside the domain is clamped to it (periodic axes wrap); at a knot, and at the end of the
/// domain, the third derivative is that of the span on the right, at the end that of the last span. Derivatives above
/// the third are zero.
///
/// ```
/// use ondelette_modeling::{Axis, basis};
/// use ondelette_wavelet::Boundary;
/// let axis = Axis::new(Boundary::Open, 8, [0.0, 1.0])?;
/// let value: f64 = basis::taps(&axis, 0.3, 0).values.iter().sum();
/// assert!((value - 1.0).abs() < 1e-15);
/// # Ok::<(), ondelette_modeling::AxisError>(())
/// ```
pub fn taps(axis: &Axis, t: f64, derivative: usize) -> Taps {
    let mut taps = knot_taps(axis.boundary(), axis.spans(), axis.to_knots(t), derivative);
    if derivative > 0 {
        let scale = axis.density().powi(derivative as i32);
        taps.values.iter_mut().for_each(|v| *v *= scale);
    }
    taps
}

/// As [`taps`], with the parameter and the derivative in knot units: `u` in `0 ..= spans`.
pub fn knot_taps(boundary: Boundary, spans: usize, u: f64, derivative: usize) -> Taps {
    let n = spans as f64;
    let u = match boundary {
        Boundary::Periodic => u.rem_euclid(n),
        _ => u.clamp(0.0, n),
    };
    // NaN ends in span 0 with NaN values: callers refuse it before.
    let span = (u as usize).min(spans - 1);
    span_taps(boundary, spans, span, u - span as f64, derivative)
}

/// The functions alive on span `span` at `x` in `0 ..= 1` of it, in knot units.
///
/// # Panics
/// If there is no such span.
pub fn span_taps(boundary: Boundary, spans: usize, span: usize, x: f64, derivative: usize) -> Taps {
    assert!(span < spans, "span {span} of {spans}");
    let index = std::array::from_fn(|k| coefficient(boundary, spans, span as isize + k as isize - 1));
    let near_end = boundary == Boundary::Open && (span < 3 || span + 3 >= spans);
    let values = if near_end { open_values(spans, span, x, derivative) } else { uniform_values(x, derivative) };
    Taps { index, values }
}

/// Where function number `i` of the line (centre at knot `i`) is stored.
fn coefficient(boundary: Boundary, spans: usize, i: isize) -> usize {
    let n = spans as isize;
    match boundary {
        Boundary::Open => (i + 1) as usize,
        Boundary::Periodic => i.rem_euclid(n) as usize,
        Boundary::Mirrored => {
            let i = i.rem_euclid(2 * n);
            i.min(2 * n - i) as usize
        }
    }
}

/// Uniform cubic B-splines on one span: the four segments of equation (7), last one first.
fn uniform_values(x: f64, derivative: usize) -> [f64; 4] {
    let y = 1.0 - x;
    match derivative {
        0 => [
            y * y * y / 6.0,
            (4.0 - 6.0 * x * x + 3.0 * x * x * x) / 6.0,
            (4.0 - 6.0 * y * y + 3.0 * y * y * y) / 6.0,
            x * x * x / 6.0,
        ],
        1 => [-0.5 * y * y, x * (1.5 * x - 2.0), y * (2.0 - 1.5 * y), 0.5 * x * x],
        2 => [y, 3.0 * x - 2.0, 3.0 * y - 2.0, x],
        3 => [-1.0, 3.0, -3.0, 1.0],
        _ => [0.0; 4],
    }
}

/// The recursion of Cox and de Boor on clamped knots, differentiated.
fn open_values(spans: usize, span: usize, x: f64, derivative: usize) -> [f64; 4] {
    if derivative > 3 {
        return [0.0; 4];
    }
    let knot = |i: isize| (span as isize + i).clamp(0, spans as isize) as f64 - span as f64;
    let degree = 3 - derivative;
    // The functions of degree d alive on the span belong to the knots k - d ..= k + 1 for k = 0 ..= d.
    let mut values = [1.0, 0.0, 0.0, 0.0];
    for d in 1..=3_usize {
        let old = values;
        values = [0.0; 4];
        for k in 0..d {
            // Function k of degree d - 1 spans the knots k - d + 1 and k + 1.
            let (left, right) = (knot(k as isize + 1 - d as isize), knot(k as isize + 1));
            let part = old[k] / (right - left);
            if d <= degree {
                values[k] += (right - x) * part;
                values[k + 1] += (x - left) * part;
            } else {
                // D N_k = d (N_{k-1} / width - ...): the derivative of the step from degree d - 1 to d.
                values[k] -= d as f64 * part;
                values[k + 1] += d as f64 * part;
            }
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use ondelette_wavelet::{SplineFamily, SplineSpace};

    #[test]
    fn the_functions_are_those_of_the_wavelet_crate() {
        for (boundary, least) in [(Boundary::Open, 1), (Boundary::Mirrored, 1), (Boundary::Periodic, 4)] {
            for spans in (least..9).chain([16, 33]) {
                let axis = Axis::new(boundary, spans, [0.0, spans as f64]).unwrap();
                let space = SplineSpace::new(SplineFamily::CUBIC, boundary, axis.len()).unwrap();
                for step in 0..=7 * spans {
                    let u = step as f64 / 7.0;
                    // At knots the crates may take the third derivative from different sides.
                    let most = if step % 7 == 0 { 2 } else { 3 };
                    for derivative in 0..=most {
                        let mut got = vec![0.0; axis.len()];
                        taps(&axis, u, derivative).iter().for_each(|(i, v)| got[i] += v);
                        let mut want = vec![0.0; axis.len()];
                        space.basis(u, derivative).into_iter().for_each(|(i, v)| want[i] += v);
                        for (i, (g, w)) in got.iter().zip(&want).enumerate() {
                            assert!(
                                (g - w).abs() < 1e-13,
                                "{boundary:?} {spans} spans, u {u}, d {derivative}, {i}: {g} {w}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn derivatives_are_in_domain_units() {
        let (a, b) = (-2.0, 1.0);
        let axis = Axis::new(Boundary::Open, 10, [a, b]).unwrap();
        // The coefficients of f(t) = t are Greville's abscissae.
        let space = SplineSpace::new(SplineFamily::CUBIC, Boundary::Open, axis.len()).unwrap();
        let x: Vec<f64> = space.sites().iter().map(|&u| axis.from_knots(u)).collect();
        for t in [a, -1.7, 0.0, 0.33, b] {
            assert!((taps(&axis, t, 0).apply(&x) - t).abs() < 1e-14);
            assert!((taps(&axis, t, 1).apply(&x) - 1.0).abs() < 1e-13);
            assert!(taps(&axis, t, 2).apply(&x).abs() < 1e-11);
        }
    }

    #[test]
    fn parameters_outside_are_clamped_or_wrapped() {
        let open = Axis::new(Boundary::Open, 5, [0.0, 1.0]).unwrap();
        assert_eq!(taps(&open, 7.0, 0), taps(&open, 1.0, 0));
        let loops = Axis::new(Boundary::Periodic, 8, [0.0, 1.0]).unwrap();
        assert_eq!(taps(&loops, 1.25, 1), taps(&loops, 0.25, 1));
    }
}
