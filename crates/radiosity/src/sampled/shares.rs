//! How the promise is shared out among the kinds of error, so that keeping it costs least.

/// One kind of error: how large it is, what that took, and how it falls.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kind {
    /// Its size now.
    pub(super) error: f64,
    /// Work that it took to have it so low, in rays.
    pub(super) cost: f64,
    /// To divide it by x costs x to this power as much.
    pub(super) power: f64,
}

/// The size that each kind should have, so that the root of the sum of squares is `total` and the work least: no kind
/// grows, and where p cost (error / e)^p is spent on size e, the squares e^2 are in proportion to it (Lagrange).
pub(super) fn shares<const N: usize>(kinds: [Kind; N], total: f64) -> [f64; N] {
    let of = |factor: f64| {
        kinds.map(|k| {
            let spent = k.power * k.cost.max(f64::MIN_POSITIVE) * k.error.powf(k.power);
            (factor * spent).powf(1.0 / (2.0 + k.power)).min(k.error)
        })
    };
    let square = |shares: [f64; N]| shares.iter().map(|e| e * e).sum::<f64>();
    if square(kinds.map(|k| k.error)) <= total * total {
        return kinds.map(|k| k.error);
    }
    of(turning_point(|factor| square(of(factor)) >= total * total)[0])
}

/// Where a condition on a positive factor turns from false to true: the largest factor found for which it is false, and
/// the least for which it is true. Factors span many decades, so the search halves their logarithm.
pub(super) fn turning_point(is_enough: impl Fn(f64) -> bool) -> [f64; 2] {
    let (mut low, mut high) = (-700.0, 700.0);
    for _ in 0..48 {
        let middle = 0.5 * (low + high);
        if is_enough(f64::exp(middle)) { high = middle } else { low = middle }
    }
    [low, high].map(f64::exp)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_cheap_is_brought_down_and_what_is_dear_takes_the_share() {
        let kinds = [(2.0, 100.0, 1.0), (3.0, 1e6, 1.4), (1e-3, 1e6, 1.0), (0.0, 0.0, 2.0)]
            .map(|(error, cost, power)| Kind { error, cost, power });
        let found = shares(kinds, 1.0);
        assert!((found.iter().map(|e| e * e).sum::<f64>() - 1.0).abs() < 1e-9, "{found:?}");
        assert!(found[0] < 0.1 && found[1] > 0.95 && found[2] == 1e-3 && found[3] == 0.0, "{found:?}");
        // no other way of sharing is cheaper
        let cost =
            |e: [f64; 2]| -> f64 { (0..2).map(|i| kinds[i].cost * (kinds[i].error / e[i]).powf(kinds[i].power)).sum() };
        let least = cost([found[0], found[1]]);
        for turn in [-0.02, 0.02] {
            let (sine, cosine) = f64::sin_cos(turn);
            let other = [found[0] * cosine - found[1] * sine, found[0] * sine + found[1] * cosine];
            assert!(other[0] <= 0.0 || cost(other) > least, "{other:?}");
        }
    }

    #[test]
    fn what_is_good_enough_is_left_alone() {
        let kinds = [0.3, 0.4].map(|error| Kind { error, cost: 1.0, power: 1.0 });
        assert_eq!(shares(kinds, 1.0), [0.3, 0.4]);
    }
}
