//! Low-discrepancy points of the plane: Sobol's sequence, scrambled after Owen.
//!
//! The scrambling is a hash of the digits above each digit (Laine and Karras 2011), so that a point is a function of
//! its index and a key, and the first 2^k points of any key are stratified in every dyadic sense. Without it the first
//! coordinate is the index with its binary digits in reverse order, and the second is Pascal's triangle modulo 2 times
//! that (the matrix of the polynomial x + 1).

use crate::seed;

/// Flips every digit of a number by a hash of the digits below it, and reverses them.
fn scramble(mut x: u32, key: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(key);
    x = x.wrapping_mul((key >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

/// Pascal's triangle modulo 2 times the digits of a number, the lowest first: in digits reversed, x + 1's matrix.
fn pascal(mut x: u32) -> u32 {
    x ^= (x & 0xaaaa_aaaa) >> 1;
    x ^= (x & 0xcccc_cccc) >> 2;
    x ^= (x & 0xf0f0_f0f0) >> 4;
    x ^= (x & 0xff00_ff00) >> 8;
    x ^ (x >> 16)
}

/// The sequence that a key scrambles.
///
/// ```
/// use ondelette_numerics::sobol::Sobol;
/// // of the first 16 points one falls into each 16th of either axis
/// let sequence = Sobol::of(7);
/// for d in 0..2 {
///     let mut seen = [false; 16];
///     (0..16).for_each(|i| seen[(sequence.point(i)[d] * 16.0) as usize] = true);
///     assert!(seen.iter().all(|s| *s));
/// }
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Sobol {
    keys: [u32; 2],
}

impl Sobol {
    /// The sequence of a key.
    pub fn of(key: u64) -> Self {
        Sobol { keys: [seed::mix(key) as u32, seed::mix(key.wrapping_add(1)) as u32] }
    }

    /// A point of it, in [0, 1)^2. Cost: some ten instructions.
    pub fn point(&self, index: u32) -> [f64; 2] {
        let digits = [index, pascal(index)];
        std::array::from_fn(|d| f64::from(scramble(digits[d], self.keys[d])) * (1.0 / 4_294_967_296.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_of_axes_is_stratified() {
        // elementary intervals: 64 points put one into each cell of 8 x 8 in the plane of the first two axes
        for key in 0..8 {
            let mut seen = [0; 64];
            (0..64).for_each(|i| {
                let p = Sobol::of(key).point(i);
                seen[(p[0] * 8.0) as usize * 8 + (p[1] * 8.0) as usize] += 1;
            });
            assert_eq!(seen, [1; 64]);
        }
    }

    #[test]
    fn a_smooth_integral_converges_faster_than_by_chance() {
        let f = |p: [f64; 2]| p.iter().map(|x| (std::f64::consts::PI * x).sin()).product::<f64>();
        let exact = (2.0 / std::f64::consts::PI).powi(2);
        let error = |n: u32| {
            let square: f64 = (0..32)
                .map(|key| ((0..n).map(|i| f(Sobol::of(key).point(i))).sum::<f64>() / f64::from(n) - exact).powi(2))
                .sum();
            (square / 32.0).sqrt()
        };
        // chance: 0.2 / sqrt(1024) = 0.006
        assert!(error(1024) < 5e-4, "{}", error(1024));
    }
}
