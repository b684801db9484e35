//! The choice of smoothing: a search for the weight and the stiffening that predict left-out points best.

use super::FitError;

/// Steps of the logarithms of weight and stiffening, from wide to narrow.
pub(super) const STEPS: [[f64; 2]; 3] = [[1.0, 0.5], [0.5, 0.25], [0.25, 0.12]];

/// Where a search begins: weight over `unit`, and stiffening.
pub(super) const BEGIN: [f64; 2] = [1e-8, 10.0];

/// A search along both logarithms in turns and their diagonals, with the given steps, from a weight (over `unit`) and a
/// stiffening; a given one stays. `value` judges a pair. Returns both, and what they were judged.
pub(super) fn search(
    unit: f64,
    [weight, stiffening]: [Option<f64>; 2],
    begin: [f64; 2],
    steps: &[[f64; 2]],
    value: &mut dyn FnMut(f64, f64) -> Result<f64, FitError>,
) -> Result<(f64, f64, f64), FitError> {
    let mut at =
        [weight.map_or(begin[0].log10(), |w| (w / unit).log10()), stiffening.unwrap_or(begin[1]).max(1e-3).log10()];
    let mut value = |at: [f64; 2]| value(10.0_f64.powf(at[0]) * unit, stiffening.unwrap_or(10.0_f64.powf(at[1])));
    let free = [weight.is_none(), stiffening.is_none()];
    let mut best = value(at)?;
    for step in steps {
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
                    // What is given may lie anywhere.
                    let outside = [!(-16.0..=2.0).contains(&next[0]), !(-1.0..=2.5).contains(&next[1])];
                    if free[0] && outside[0] || free[1] && outside[1] {
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
