//! Counter-based random numbers: a value is a function of its key, so no order of evaluation can change it.

/// Mixes a key into 64 well-spread bits (the finaliser of SplitMix64, Steele, Lea and Flood 2014).
pub fn mix(key: u64) -> u64 {
    let mut z = key.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Combines two keys into one.
pub fn combine(a: u64, b: u64) -> u64 {
    mix(a ^ mix(b))
}

/// A number in [0, 1) from a key.
///
/// ```
/// use ondelette_numerics::seed::{combine, unit};
/// let x = unit(combine(3, 4));
/// assert!((0.0..1.0).contains(&x) && x == unit(combine(3, 4)));
/// ```
pub fn unit(key: u64) -> f64 {
    (mix(key) >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}
