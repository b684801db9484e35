//! Numbers with their first and second derivatives by the `N` coefficients of one span (forward differentiation).
//!
//! Newton's method on curvature wants exact second derivatives; written by hand they would be pages.

use std::ops::{Add, Mul, Sub};

/// A value, its gradient, and the lower triangle of its second derivatives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jet<const N: usize> {
    pub(crate) value: f64,
    pub(crate) first: [f64; N],
    pub(crate) second: [[f64; N]; N],
}

impl<const N: usize> Jet<N> {
    pub(crate) const ZERO: Jet<N> = Jet { value: 0.0, first: [0.0; N], second: [[0.0; N]; N] };

    /// A linear function of the coefficients: its value and its gradient.
    pub(crate) fn linear(value: f64, first: [f64; N]) -> Jet<N> {
        Jet { value, first, second: [[0.0; N]; N] }
    }

    /// `f` of this number, by f and its first two derivatives here.
    fn through(&self, value: f64, d1: f64, d2: f64) -> Jet<N> {
        let mut out = Jet { value, ..Jet::ZERO };
        for i in 0..N {
            out.first[i] = d1 * self.first[i];
            for j in 0..=i {
                out.second[i][j] = d1 * self.second[i][j] + d2 * self.first[i] * self.first[j];
            }
        }
        out
    }

    /// One over this number.
    pub(crate) fn recip(&self) -> Jet<N> {
        let r = 1.0 / self.value;
        self.through(r, -r * r, 2.0 * r * r * r)
    }

    /// Its square root.
    pub(crate) fn sqrt(&self) -> Jet<N> {
        let s = self.value.sqrt();
        self.through(s, 0.5 / s, -0.25 / (s * self.value))
    }

    /// Its natural logarithm.
    pub(crate) fn ln(&self) -> Jet<N> {
        let r = 1.0 / self.value;
        self.through(self.value.ln(), r, -r * r)
    }

    /// Times a constant.
    pub(crate) fn times(&self, by: f64) -> Jet<N> {
        self.through(by * self.value, by, 0.0)
    }

    /// Plus a constant.
    pub(crate) fn plus(mut self, c: f64) -> Jet<N> {
        self.value += c;
        self
    }
}

impl<const N: usize> Add for Jet<N> {
    type Output = Jet<N>;
    fn add(mut self, other: Jet<N>) -> Jet<N> {
        self.value += other.value;
        for i in 0..N {
            self.first[i] += other.first[i];
            for j in 0..=i {
                self.second[i][j] += other.second[i][j];
            }
        }
        self
    }
}

impl<const N: usize> Sub for Jet<N> {
    type Output = Jet<N>;
    fn sub(self, other: Jet<N>) -> Jet<N> {
        self + other.times(-1.0)
    }
}

impl<const N: usize> Mul for Jet<N> {
    type Output = Jet<N>;
    fn mul(self, other: Jet<N>) -> Jet<N> {
        let (a, b) = (&self, &other);
        let mut out = Jet { value: a.value * b.value, ..Jet::ZERO };
        for i in 0..N {
            out.first[i] = a.first[i] * b.value + a.value * b.first[i];
            for j in 0..=i {
                out.second[i][j] = a.second[i][j] * b.value
                    + a.first[i] * b.first[j]
                    + a.first[j] * b.first[i]
                    + a.value * b.second[i][j];
            }
        }
        out
    }
}

/// Inner product of two vectors.
pub(crate) fn dot<const N: usize, const K: usize>(a: &[Jet<N>; K], b: &[Jet<N>; K]) -> Jet<N> {
    a.iter().zip(b).fold(Jet::ZERO, |sum, (a, b)| sum + *a * *b)
}
