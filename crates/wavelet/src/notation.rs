//! The thesis's index procedures, for code and tables that count as A.1 does.
//!
//! Everywhere else indices start at 0: B-spline `p` is the thesis's `j = p - 2`, wavelet `p` its `j = p - 3`.

use crate::extension::Extension;

/// `bs_index` of A.1: the stored B-spline of mirrored index `j` on a level with `2^level` spans, both counted from -2.
///
/// ```
/// use ondelette_wavelet::notation::{bs_index, wave_index};
/// assert_eq!((bs_index(3, -3), bs_index(3, 7)), (-1, 5));
/// assert_eq!(wave_index(3, -4), -3);
/// ```
///
/// # Panics
/// If the level is above 60.
pub fn bs_index(level: u32, j: i64) -> i64 {
    assert!(level <= 60, "level {level} is above 60");
    Extension::Whole.fine((1 << level) + 1, j as isize + 2) as i64 - 2
}

/// `wave_index` of A.1: the stored wavelet of mirrored index `j` on a level with `2^level` wavelets, counted from -3.
///
/// # Panics
/// If the level is above 60.
pub fn wave_index(level: u32, j: i64) -> i64 {
    assert!(level <= 60, "level {level} is above 60");
    Extension::Half.fine(1 << level, j as isize + 3) as i64 - 3
}
