//! What a basis function is multiplied by: a number, a point or a colour.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Mul, MulAssign, Neg, Sub};

/// The two number types the transforms run in.
///
/// `f64` is the default of the library; `f32` halves the memory traffic and is enough for pictures.
pub trait Scalar:
    Copy
    + Default
    + Debug
    + PartialOrd
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + MulAssign
    + 'static
{
    /// The nearest value.
    fn from_f64(x: f64) -> Self;
    /// The value, exactly.
    fn to_f64(self) -> f64;
}

impl Scalar for f64 {
    #[inline]
    fn from_f64(x: f64) -> f64 {
        x
    }
    #[inline]
    fn to_f64(self) -> f64 {
        self
    }
}

impl Scalar for f32 {
    #[inline]
    fn from_f64(x: f64) -> f32 {
        x as f32
    }
    #[inline]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

/// Anything a basis function can be multiplied by: `f64`, `f32`, points and colours (`[f64; 3]`, `[f32; 4]`, ...).
///
/// A slice of coefficients is a flat slice of scalars with `CHANNELS` numbers each.
///
/// ```
/// use ondelette_wavelet::Coefficient;
/// assert_eq!(<[f32; 3]>::CHANNELS, 3);
/// assert_eq!(Coefficient::flat(&[[1.0, 2.0], [3.0, 4.0]]), [1.0, 2.0, 3.0, 4.0]);
/// ```
pub trait Coefficient: Copy + Default + Debug + Send + Sync + 'static {
    /// The number type inside.
    type Scalar: Scalar;
    /// Numbers in one coefficient.
    const CHANNELS: usize;
    /// The numbers of a slice of coefficients.
    fn flat(slice: &[Self]) -> &[Self::Scalar];
    /// The numbers of a slice of coefficients, to be written.
    fn flat_mut(slice: &mut [Self]) -> &mut [Self::Scalar];
}

macro_rules! coefficient {
    ($($t:ty),*) => {$(
        impl Coefficient for $t {
            type Scalar = $t;
            const CHANNELS: usize = 1;
            fn flat(slice: &[$t]) -> &[$t] {
                slice
            }
            fn flat_mut(slice: &mut [$t]) -> &mut [$t] {
                slice
            }
        }
        impl<const N: usize> Coefficient for [$t; N]
        where
            [$t; N]: Default,
        {
            type Scalar = $t;
            const CHANNELS: usize = N;
            fn flat(slice: &[[$t; N]]) -> &[$t] {
                slice.as_flattened()
            }
            fn flat_mut(slice: &mut [[$t; N]]) -> &mut [$t] {
                slice.as_flattened_mut()
            }
        }
    )*};
}
coefficient!(f32, f64);

/// Index of the first number that is NaN or infinite.
pub(crate) fn first_not_finite<S: Scalar>(x: &[S]) -> Option<usize> {
    // x * 0 is 0 for finite x and NaN otherwise; lanes add up independently so that the loop vectorises.
    const BLOCK: usize = 4096;
    const LANES: usize = 16;
    let zero = S::default();
    for (b, block) in x.chunks(BLOCK).enumerate() {
        let mut sum = [zero; LANES];
        let mut lanes = block.chunks_exact(LANES);
        for chunk in &mut lanes {
            for (s, &v) in sum.iter_mut().zip(chunk) {
                *s += v * zero;
            }
        }
        let rest = lanes.remainder().iter().all(|&v| v * zero == zero);
        if !rest || sum.iter().any(|s| *s != zero) {
            return block.iter().position(|v| !v.to_f64().is_finite()).map(|i| b * BLOCK + i);
        }
    }
    None
}
