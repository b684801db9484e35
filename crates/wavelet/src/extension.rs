//! How a finite array continues beyond its ends: the `bs_index` and `wave_index` of A.1, for any length.

/// Continuation of the fine samples of one level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Extension {
    /// `x[p + n] = x[p]`, n even.
    Periodic,
    /// Mirrored about the first and the last sample (odd filters).
    Whole,
    /// Mirrored half a sample outside the first and the last sample (even filters).
    Half,
}

/// Which ends of an array lie on a mirror, where the extended sequence does not repeat the sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Ends {
    pub(crate) first: bool,
    pub(crate) last: bool,
}

impl Extension {
    /// Smooth and detail counts of `n` fine samples.
    pub(crate) fn split(n: usize) -> (usize, usize) {
        (n.div_ceil(2), n / 2)
    }

    /// Array index of the fine sample at any position.
    #[inline]
    pub(crate) fn fine(self, n: usize, p: isize) -> usize {
        let len = n as isize;
        let m = match self {
            Extension::Periodic => p.rem_euclid(len),
            Extension::Whole => {
                let period = (2 * (len - 1)).max(1);
                let m = p.rem_euclid(period);
                if m >= len { period - m } else { m }
            }
            Extension::Half => {
                let m = p.rem_euclid(2 * len);
                if m >= len { 2 * len - 1 - m } else { m }
            }
        };
        m as usize
    }

    /// Array index of the smooth coefficient at any position; `n` counts the fine samples.
    #[inline]
    pub(crate) fn smooth(self, n: usize, k: isize) -> usize {
        match self {
            Extension::Periodic => k.rem_euclid(n as isize / 2) as usize,
            Extension::Whole => self.fine(n, 2 * k) / 2,
            Extension::Half => {
                let m = k.rem_euclid(n as isize) as usize;
                if m < n.div_ceil(2) { m } else { n - 1 - m }
            }
        }
    }

    /// Array index and sign of the detail coefficient at any position; `n` counts the fine samples.
    #[inline]
    pub(crate) fn detail(self, n: usize, k: isize) -> (usize, f64) {
        match self {
            Extension::Periodic => (k.rem_euclid(n as isize / 2) as usize, 1.0),
            Extension::Whole => (self.fine(n, 2 * k + 1) / 2, 1.0),
            Extension::Half => {
                // Antisymmetric: the wavelets of even filters change sign in the mirror.
                let m = k.rem_euclid(n as isize) as usize;
                if m < n / 2 {
                    (m, 1.0)
                } else if n % 2 == 1 && m == n / 2 {
                    (0, 0.0)
                } else {
                    (n - 1 - m, -1.0)
                }
            }
        }
    }

    /// The fine ends that lie on a mirror.
    pub(crate) fn fine_ends(self) -> Ends {
        let on = self == Extension::Whole;
        Ends { first: on, last: on }
    }

    /// The smooth ends that lie on a mirror.
    pub(crate) fn smooth_ends(self, n: usize) -> Ends {
        match self {
            Extension::Periodic => Ends { first: false, last: false },
            Extension::Whole => Ends { first: true, last: n % 2 == 1 },
            Extension::Half => Ends { first: false, last: n % 2 == 1 },
        }
    }

    /// The detail ends that lie on a mirror.
    pub(crate) fn detail_ends(self, n: usize) -> Ends {
        Ends { first: false, last: self == Extension::Whole && n.is_multiple_of(2) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_and_detail_continue_as_the_fine_samples_do() {
        // Whole-sample mirrors keep the parity, so both halves must follow the interleaved fine positions.
        for n in 2..12 {
            for k in -30..30_isize {
                assert_eq!(2 * Extension::Whole.smooth(n, k), Extension::Whole.fine(n, 2 * k));
                assert_eq!(2 * Extension::Whole.detail(n, k).0 + 1, Extension::Whole.fine(n, 2 * k + 1));
            }
        }
    }
}
