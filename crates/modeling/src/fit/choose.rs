//! The choice of smoothing: a search for the weight and the stiffening that predict left-out points best.

use super::FitError;

/// A search along both logarithms in turns and their diagonals, with halved steps, from 1e-8 `unit` and 10; a given one
/// stays. `value` judges a weight and a stiffening. Returns both, and what they were judged.
pub(super) fn search(
    unit: f64,
    weight: Option<f64>,
    stiffening: Option<f64>,
    value: &mut dyn FnMut(f64, f64) -> Result<f64, FitError>,
) -> Result<(f64, f64, f64), FitError> {
    let mut at = [weight.map_or(-8.0, |w| (w / unit).log10()), stiffening.map_or(1.0, |s| s.max(1e-3).log10())];
    let mut value = |at: [f64; 2]| value(10.0_f64.powf(at[0]) * unit, stiffening.unwrap_or(10.0_f64.powf(at[1])));
    let free = [weight.is_none(), stiffening.is_none()];
    let mut best = value(at)?;
    for step in [[1.0, 0.5], [0.5, 0.25], [0.25, 0.12]] {
        // Along the axes and both diagonals, as long as it helps.
        let mut moved = true;
        while moved {
            moved = false;
            for (a, b) in [(-1.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] {
                if (a != 0.0 && !free[0]) || (b != 0.0 && !free[1]) {
                    continue;
                }
                loop {
                    let next = [at[0] + a * step[0], at[1] + b * step[1]];
                    if !(-16.0..=2.0).contains(&next[0]) || !(-1.0..=2.5).contains(&next[1]) {
                        break;
                    }
                    let got = value(next)?;
                    if got >= best {
                        break;
                    }
                    (best, at, moved) = (got, next, true);
                }
            }
        }
    }
    let weight = weight.unwrap_or(10.0_f64.powf(at[0]) * unit);
    Ok((weight, stiffening.unwrap_or(10.0_f64.powf(at[1])), best))
}
