//! Three colour channels of a radiometric or photometric quantity.

use serde::{Deserialize, Serialize};
use std::ops::{Add, AddAssign, Mul, Sub};

/// Linear red, green and blue of one quantity (its unit is stated where it is used).
///
/// ```
/// use ondelette_radiosity::Rgb;
/// let warm = Rgb::new(1.0, 0.5, 0.25) * 2.0;
/// assert_eq!(warm.sum(), 3.5);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rgb(pub [f64; 3]);

impl Rgb {
    /// All channels zero.
    pub const BLACK: Rgb = Rgb([0.0; 3]);

    /// From three channels.
    pub const fn new(r: f64, g: f64, b: f64) -> Self {
        Rgb([r, g, b])
    }

    /// The same value in every channel.
    pub const fn grey(value: f64) -> Self {
        Rgb([value; 3])
    }

    /// Sum over channels: the measure in which errors and energies are counted.
    pub fn sum(self) -> f64 {
        self.0[0] + self.0[1] + self.0[2]
    }

    /// Largest channel.
    pub fn max(self) -> f64 {
        self.0[0].max(self.0[1]).max(self.0[2])
    }

    /// Whether every channel is finite.
    pub fn is_finite(self) -> bool {
        self.0.iter().all(|c| c.is_finite())
    }

    /// Channel by channel.
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Rgb(self.0.map(f))
    }
}

impl Add for Rgb {
    type Output = Rgb;
    fn add(self, o: Rgb) -> Rgb {
        Rgb([self.0[0] + o.0[0], self.0[1] + o.0[1], self.0[2] + o.0[2]])
    }
}

impl Sub for Rgb {
    type Output = Rgb;
    fn sub(self, o: Rgb) -> Rgb {
        Rgb([self.0[0] - o.0[0], self.0[1] - o.0[1], self.0[2] - o.0[2]])
    }
}

impl AddAssign for Rgb {
    fn add_assign(&mut self, o: Rgb) {
        *self = *self + o;
    }
}

impl Mul<f64> for Rgb {
    type Output = Rgb;
    fn mul(self, k: f64) -> Rgb {
        Rgb([self.0[0] * k, self.0[1] * k, self.0[2] * k])
    }
}

/// Channel by channel: reflectance times irradiance.
impl Mul for Rgb {
    type Output = Rgb;
    fn mul(self, o: Rgb) -> Rgb {
        Rgb([self.0[0] * o.0[0], self.0[1] * o.0[1], self.0[2] * o.0[2]])
    }
}
