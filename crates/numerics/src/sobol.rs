//! Low-discrepancy points in four dimensions: Sobol's sequence, scrambled after Owen.
//!
//! The scrambling is a hash of the digits above each digit (Laine and Karras 2011), so that a point is a function of
//! its index and a key, and the first 2^k points of any key are stratified in every dyadic sense.

/// Direction numbers of the first four dimensions (Joe and Kuo 2008: polynomials 1, x + 1, x^2 + x + 1, x^3 + x + 1).
const DIRECTIONS: [[u32; 32]; 4] = [
    directions(0, 0, [1, 0, 0]),
    directions(1, 0, [1, 0, 0]),
    directions(2, 1, [1, 3, 0]),
    directions(3, 1, [1, 3, 1]),
];

/// The direction numbers of a primitive polynomial: degree, inner coefficients, first odd integers.
const fn directions(degree: usize, inner: u32, first: [u32; 3]) -> [u32; 32] {
    let mut v = [0; 32];
    let mut i = 0;
    while i < 32 {
        if degree == 0 {
            v[i] = 1 << (31 - i);
        } else if i < degree {
            v[i] = first[i] << (31 - i);
        } else {
            v[i] = v[i - degree] ^ (v[i - degree] >> degree);
            let mut k = 1;
            while k < degree {
                if (inner >> (degree - 1 - k)) & 1 == 1 {
                    v[i] ^= v[i - k];
                }
                k += 1;
            }
        }
        i += 1;
    }
    v
}

/// Flips every digit by a hash of the digits above it.
fn scramble(x: u32, key: u32) -> u32 {
    let mut x = x.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(key);
    x = x.wrapping_mul((key >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

/// Point `index` of the sequence that `key` scrambles, in [0, 1)^4. Cost: a few ten instructions.
///
/// ```
/// use ondelette_numerics::sobol::point;
/// // of the first 16 points one falls into each 16th of every axis
/// for d in 0..4 {
///     let mut seen = [false; 16];
///     (0..16).for_each(|i| seen[(point(7, i)[d] * 16.0) as usize] = true);
///     assert!(seen.iter().all(|s| *s));
/// }
/// ```
pub fn point(key: u64, index: u32) -> [f64; 4] {
    std::array::from_fn(|d| {
        let mut x = 0;
        let mut rest = index;
        while rest != 0 {
            x ^= DIRECTIONS[d][rest.trailing_zeros() as usize];
            rest &= rest - 1;
        }
        let key = crate::seed::mix(key.wrapping_add(d as u64)) as u32;
        f64::from(scramble(x, key)) * (1.0 / 4_294_967_296.0)
    })
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
                let p = point(key, i);
                seen[(p[0] * 8.0) as usize * 8 + (p[1] * 8.0) as usize] += 1;
            });
            assert_eq!(seen, [1; 64]);
        }
    }

    #[test]
    fn a_smooth_integral_converges_faster_than_by_chance() {
        let f = |p: [f64; 4]| p.iter().map(|x| (std::f64::consts::PI * x).sin()).product::<f64>();
        let exact = (2.0 / std::f64::consts::PI).powi(4);
        let error = |n: u32| {
            let square: f64 =
                (0..32).map(|key| ((0..n).map(|i| f(point(key, i))).sum::<f64>() / f64::from(n) - exact).powi(2)).sum();
            (square / 32.0).sqrt()
        };
        // chance: 0.2 / sqrt(1024) = 0.006
        assert!(error(1024) < 5e-4, "{}", error(1024));
    }
}
