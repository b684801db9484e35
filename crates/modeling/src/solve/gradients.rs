//! Conjugate gradients with a V-cycle as preconditioner, and how far they came.
//!
//! The residual in the cycle's norm says little about the energy that is left where the cycle is a poor inverse: next
//! to data that hardly any energy smooths, it is far below one on all that the data do not see. The steps themselves
//! know how poor: they are Lanczos's, and the least eigenvalue of their tridiagonal matrix (a Ritz value) comes down to
//! that of cycle times matrix, which is the ratio of the two norms at worst.

use super::cholesky::dot;
use super::cycle::Cycle;

/// Rounds of iterations, each from the true residual.
const ROUNDS: usize = 6;

/// Rounds go this much below what is asked, so that rounding does not ask for another.
const BELOW: f64 = 0.1;

/// The tridiagonal matrix of Lanczos's method, from the steps of conjugate gradients.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lanczos {
    diagonal: Vec<f64>,
    /// Squares of the entries beside it.
    beside: Vec<f64>,
    last: Option<(f64, f64)>,
}

impl Lanczos {
    /// A step of length `alpha`, after which the squared residual is `beta` times what it was.
    pub(crate) fn push(&mut self, alpha: f64, beta: f64) {
        let (a, b) = self.last.map_or((0.0, 0.0), |(alpha, beta)| (beta / alpha, beta / alpha / alpha));
        self.diagonal.push(1.0 / alpha + a);
        if self.last.is_some() {
            self.beside.push(b);
        }
        self.last = Some((alpha, beta));
    }

    /// True where all eigenvalues are above `x` (Sturm).
    fn is_above(&self, x: f64) -> bool {
        let mut pivot = 1.0;
        (0..self.diagonal.len()).all(|i| {
            let beside = if i > 0 { self.beside[i - 1] / pivot } else { 0.0 };
            pivot = self.diagonal[i] - x - beside;
            pivot > 0.0
        })
    }

    /// The least eigenvalue within 5 percent; 1, what a cycle aims at, where it is not below.
    pub(crate) fn least(&self) -> f64 {
        let (mut low, mut high) = (-80.0_f64, 0.0_f64);
        if self.is_above(1.0) {
            return 1.0;
        }
        while high - low > 0.05 {
            let middle = 0.5 * (low + high);
            if self.is_above(middle.exp()) { low = middle } else { high = middle }
        }
        low.exp()
    }
}

/// What a round of iterations aims at.
enum Aim {
    /// A share of the right-hand side, in the cycle's norm.
    Relative(f64),
    /// An energy above the least.
    Energy(f64),
}

impl Cycle {
    /// Conjugate gradients on (H + data) x = b from the given x, to a relative residual (in the cycle's norm). False
    /// where `most` iterations, or the digits of the numbers, do not suffice.
    pub(crate) fn conjugate_gradients(&mut self, b: &[f64], x: &mut [f64], tolerance: f64, most: usize) -> bool {
        if self.is_direct() {
            self.cycle(b, x);
            return true;
        }
        self.iterate(b, x, &Aim::Relative(tolerance), most, &mut 1.0).0
    }

    /// The same, and then on until the energy above the least is within what `goal` allows for an x: by the true
    /// residual and the least eigenvalue that the steps have met. Where rounding does not let it, `slack` times as much
    /// will do; false where that is not reached.
    pub(crate) fn settle(
        &mut self,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
        most: usize,
        goal: &dyn Fn(&[f64]) -> f64,
        slack: f64,
    ) -> bool {
        let mut least = 1.0;
        let mut aim = Aim::Relative(tolerance);
        let mut iterations = 0;
        let (mut r, mut z) = (vec![0.0; b.len()], vec![0.0; b.len()]);
        // What is left, the best so far.
        let (mut before, mut best) = (f64::INFINITY, x.to_vec());
        for _ in 0..ROUNDS {
            iterations += if self.is_direct() {
                self.correct(b, x, &mut r, &mut z);
                1
            } else {
                self.iterate(b, x, &aim, most - iterations, &mut least).1
            };
            self.apply(x, &mut r);
            r.iter_mut().zip(b).for_each(|(r, b)| *r = b - *r);
            self.cycle(&r, &mut z);
            let (left, goal) = (dot(&r, &z) / least, goal(x));
            if left <= goal {
                return true;
            }
            let stuck = left.is_nan() || left > 0.5 * before;
            if left < before {
                (before, best) = (left, x.to_vec());
            }
            if iterations >= most || stuck {
                break;
            }
            aim = Aim::Energy(BELOW * goal);
        }
        // Rounds that rounding spoils make it worse.
        x.copy_from_slice(&best);
        before <= slack * goal(x)
    }

    /// One solution by the factor, of what is missing.
    fn correct(&mut self, b: &[f64], x: &mut [f64], r: &mut [f64], z: &mut [f64]) {
        self.apply(x, r);
        r.iter_mut().zip(b).for_each(|(r, b)| *r = b - *r);
        self.cycle(r, z);
        x.iter_mut().zip(&*z).for_each(|(x, z)| *x += z);
    }

    /// Whether the aim was reached, and in how many iterations; `least` follows the least Ritz value.
    fn iterate(&mut self, b: &[f64], x: &mut [f64], aim: &Aim, most: usize, least: &mut f64) -> (bool, usize) {
        let n = b.len();
        let (mut r, mut z, mut p, mut hp) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let whole = match aim {
            Aim::Relative(_) => {
                self.cycle(b, &mut z);
                dot(b, &z)
            }
            Aim::Energy(_) => 0.0,
        };
        self.apply(x, &mut hp);
        r.iter_mut().zip(b).zip(&hp).for_each(|((r, b), h)| *r = b - h);
        self.cycle(&r, &mut z);
        let mut rz = dot(&r, &z);
        p.copy_from_slice(&z);
        let mut steps = Lanczos::default();
        let mut iterations = 0;
        let mut reached = false;
        let goal = |least: f64| match aim {
            Aim::Relative(tolerance) => whole * tolerance * tolerance,
            Aim::Energy(energy) => energy * least,
        };
        while !rz.is_nan() {
            if rz <= goal(*least) {
                // Known only now, when it matters.
                *least = least.min(steps.least());
                reached = rz <= goal(*least);
            }
            if reached || iterations == most {
                break;
            }
            self.apply(&p, &mut hp);
            let curvature = dot(&p, &hp);
            if curvature <= 0.0 || !curvature.is_finite() {
                break;
            }
            let alpha = rz / curvature;
            x.iter_mut().zip(&p).for_each(|(x, p)| *x += alpha * p);
            r.iter_mut().zip(&hp).for_each(|(r, h)| *r -= alpha * h);
            self.cycle(&r, &mut z);
            let old = rz;
            rz = dot(&r, &z);
            let beta = rz / old;
            steps.push(alpha, beta);
            p.iter_mut().zip(&z).for_each(|(p, z)| *p = z + beta * *p);
            iterations += 1;
        }
        *least = least.min(steps.least());
        (reached, iterations)
    }
}
