//! Random numbers of one path: a key and a count, so that no order of evaluation can change them.

use glam::DVec3;
use ondelette_numerics::seed;

/// A stream of numbers in [0, 1).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stream {
    key: u64,
}

impl Stream {
    pub(crate) fn new(key: u64) -> Self {
        Stream { key }
    }

    pub(crate) fn next(&mut self) -> f64 {
        // any odd step visits all keys; the mixing is in `unit`
        self.key = self.key.wrapping_add(0xd134_2543_de82_ef95);
        seed::unit(self.key)
    }
}

/// A direction about the unit vector `n` with a density of cos / pi, from two numbers in [0, 1).
pub(crate) fn cosine_direction(n: DVec3, [u, v]: [f64; 2]) -> DVec3 {
    let (a, b) = n.any_orthonormal_pair();
    let (r, angle) = (u.sqrt(), std::f64::consts::TAU * v);
    a * (r * angle.cos()) + b * (r * angle.sin()) + n * (1.0 - u).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of cos under a density of cos / pi is 2 / 3, that of the tangents 0.
    #[test]
    fn directions_follow_the_cosine() {
        let n = DVec3::new(1.0, -2.0, 0.5).normalize();
        let mut stream = Stream::new(1);
        let count = 100_000;
        let sum: DVec3 = (0..count).map(|_| cosine_direction(n, [stream.next(), stream.next()])).sum();
        let mean = sum / f64::from(count);
        assert!((mean - n * (2.0 / 3.0)).length() < 5e-3, "{mean}");
    }
}
