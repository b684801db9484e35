//! Values of refinable functions without closed form: the cascade.

use crate::family::{Boundary, Climb, Family};
use crate::lifting::analysis_filters;

/// Values of the scaling function and the wavelet at `t = k / 2^levels` over their support, exact up to rounding:
/// `phi(t) = sum h[k] phi(2t - k)` from the values at the integers, `psi(t) = sum g[k] phi(2t - k)` (Eqs. 15, 16).
///
/// For Daubechies' families and CDF 9/7, whose functions are no polynomials; `None` for the others (splines are exact
/// piecewise polynomials, see [`crate::SplineFamily::scaling_function`]). Cost: linear in the number of values.
///
/// ```
/// use ondelette_wavelet::{Family, cascade};
/// let (phi, _) = cascade(Family::Daubechies(4), 0).unwrap();
/// assert!((phi[1] - (1.0 + 3.0_f64.sqrt()) / 2.0).abs() < 1e-14);
/// ```
pub fn cascade(family: Family, levels: u32) -> Option<(Vec<f64>, Vec<f64>)> {
    if !matches!(family, Family::Daubechies(_) | Family::Cdf97) {
        return None;
    }
    let Ok(Climb::Lifted(scheme, _)) = family.climb(Boundary::Periodic) else { return None };
    let [(_, h), (_, g)] = analysis_filters(&scheme.dual());
    let n = h.len();
    // At the integers: the eigenvector of phi(i) = sum h[2i - j] phi(j) for eigenvalue 1, with sum 1. The other
    // eigenvalues are 1/2 and smaller, so the power method converges by bits.
    let mut phi = vec![0.0; n];
    phi[1..n - 1].fill(1.0 / (n - 2).max(1) as f64);
    for _ in 0..80 {
        let tap = |k: isize| usize::try_from(k).ok().and_then(|k| h.get(k)).copied().unwrap_or(0.0);
        let next: Vec<f64> =
            (0..n as isize).map(|i| phi.iter().enumerate().map(|(j, v)| tap(2 * i - j as isize) * v).sum()).collect();
        let sum: f64 = next.iter().sum();
        phi = next.into_iter().map(|v| v / sum).collect();
    }
    // Each level doubles the resolution: phi(m / 2^(l+1)) = sum h[k] phi(m / 2^l - k).
    let refine = |values: &[f64], taps: &[f64], per_unit: usize| -> Vec<f64> {
        let spans = (values.len() - 1) / per_unit;
        let out = (spans + taps.len() - 1) * per_unit + 1;
        (0..out)
            .map(|m| {
                taps.iter()
                    .enumerate()
                    .filter(|(k, _)| m >= k * per_unit)
                    .map(|(k, c)| c * values.get(m - k * per_unit).copied().unwrap_or(0.0))
                    .sum()
            })
            .collect()
    };
    let mut per_unit = 1;
    for _ in 0..levels {
        phi = refine(&phi, &h, per_unit);
        per_unit *= 2;
        phi.truncate((n - 1) * per_unit + 1);
    }
    // psi needs phi at half the spacing of the asked values: one level coarser, read at every value.
    let psi = refine(&phi, &g, per_unit);
    let psi = psi.into_iter().step_by(2).collect();
    Some((phi, psi))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scaling_functions_sum_to_one_and_wavelets_to_zero() {
        for family in [Family::Daubechies(4), Family::Daubechies(10), Family::Daubechies(20), Family::Cdf97] {
            let levels = 4;
            let (phi, psi) = cascade(family, levels).unwrap();
            let per_unit = 1 << levels;
            for start in 0..per_unit {
                let sum: f64 = phi.iter().skip(start).step_by(per_unit).sum();
                assert!((sum - 1.0).abs() < 1e-11, "{family} at {start}: {sum}");
            }
            assert!((psi.iter().sum::<f64>() / per_unit as f64).abs() < 1e-10, "{family}");
        }
        assert!(cascade(Family::Haar, 3).is_none());
    }
}
