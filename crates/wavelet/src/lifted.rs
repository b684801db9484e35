//! One level of a lifted bank on a finite array: the four verbs on contiguous samples.
//!
//! The samples are cut into blocks that stay in the first cache; each is split into even and odd samples with a
//! margin, continued beyond the ends of the array by the [`Extension`], and the steps run in place on the two arrays.

use crate::coefficient::Scalar;
use crate::cubic::{Cubic, Row};
use crate::extension::{Ends, Extension};
use crate::lifting::{Needs, Scheme, run_step};
use crate::rung::Kind;

/// Pairs of samples per block.
const BLOCK: usize = 1024;

/// A bank on `n` fine samples.
#[derive(Clone, Debug)]
pub(crate) struct Lifted {
    pub(crate) n: usize,
    pub(crate) extension: Extension,
    /// The analysis of coefficients.
    pub(crate) scheme: Scheme<f64>,
}

/// One verb of a bank, in one number type, ready to run.
#[derive(Clone, Debug)]
pub(crate) struct Program<S> {
    pub(crate) n: usize,
    pub(crate) extension: Extension,
    pub(crate) scheme: Scheme<S>,
    pub(crate) needs: Needs,
    /// Transposed verbs count samples on a mirror once where the extended sequence counts the others twice.
    pub(crate) weigh: bool,
    /// The fused loops, if the bank has the three steps of (4, 4).
    pub(crate) cubic: Option<Cubic<S>>,
}

impl Lifted {
    /// Towards coarser: analysis, or the transpose of the synthesis.
    pub(crate) fn up<S: Scalar>(&self, kind: Kind) -> Program<S> {
        let scheme = match kind {
            Kind::Coefficients => self.scheme.cast(),
            Kind::Basis => self.scheme.dual().cast(),
        };
        self.program(kind, scheme.shift, scheme, false)
    }

    /// Towards finer: synthesis, or the transpose of the analysis.
    pub(crate) fn down<S: Scalar>(&self, kind: Kind) -> Program<S> {
        let scheme = match kind {
            Kind::Coefficients => self.scheme.inverse().cast(),
            Kind::Basis => self.scheme.dual().inverse().cast(),
        };
        self.program(kind, 0, scheme, true)
    }

    fn program<S: Scalar>(&self, kind: Kind, shift: isize, scheme: Scheme<S>, down: bool) -> Program<S> {
        let needs = scheme.needs(shift);
        let weigh = kind == Kind::Basis && self.extension != Extension::Periodic;
        let cubic = Cubic::recognise(&scheme, down).filter(|_| !weigh && self.extension != Extension::Half);
        Program { n: self.n, extension: self.extension, scheme, needs, weigh, cubic }
    }
}

/// Reused arrays of a program.
#[derive(Debug, Default)]
pub(crate) struct Scratch<S> {
    even: Vec<S>,
    odd: Vec<S>,
}

/// Multiplies the ends that lie on a mirror.
pub(crate) fn scale_ends<S: Scalar>(x: &mut [S], ends: Ends, by: f64) {
    let n = x.len();
    if n == 0 {
        return;
    }
    if ends.first {
        x[0] *= S::from_f64(by);
    }
    if ends.last && (n > 1 || !ends.first) {
        x[n - 1] *= S::from_f64(by);
    }
}

fn weight<S: Scalar>(weigh: bool, ends: Ends, i: usize, n: usize) -> S {
    let on = weigh && ((ends.first && i == 0) || (ends.last && i + 1 == n));
    S::from_f64(if on { 2.0 } else { 1.0 })
}

impl<S: Scalar> Program<S> {
    fn origin(&self) -> isize {
        self.needs.even.lo.min(self.needs.odd.lo)
    }

    fn prepare(&self, scratch: &mut Scratch<S>, pairs: usize) {
        let hi = self.needs.even.hi.max(self.needs.odd.hi);
        let len = pairs + (hi - self.origin()) as usize;
        scratch.even.resize(len, S::default());
        scratch.odd.resize(len, S::default());
    }

    fn steps(&self, scratch: &mut Scratch<S>, pairs: usize) {
        let lo = self.origin();
        for (step, r) in self.scheme.steps.iter().zip(&self.needs.steps) {
            let to = (pairs as isize + r.hi - lo) as usize;
            run_step(step, &mut scratch.even, &mut scratch.odd, (r.lo - lo) as usize, to);
        }
    }

    /// Fine samples to the two halves.
    pub(crate) fn up(&self, fine: &[S], smooth: &mut [S], detail: &mut [S], scratch: &mut Scratch<S>) {
        debug_assert_eq!(fine.len(), self.n);
        let (ns, nd) = (smooth.len(), detail.len());
        if let Some(bank) = &self.cubic {
            let index = |p| self.extension.fine(self.n, p);
            return Row::<S, true>::up(bank).analyze(fine, 0, (smooth, detail), &mut scratch.even, index);
        }
        let lo = self.origin();
        let (gain_s, gain_d) = self.scheme.scale;
        for k0 in (0..ns).step_by(BLOCK) {
            let len = BLOCK.min(ns - k0);
            self.prepare(scratch, len);
            self.load_fine(fine, k0 as isize + lo, &mut scratch.even, &mut scratch.odd);
            self.steps(scratch, len);
            let e = &scratch.even[-lo as usize..][..len];
            for (s, e) in smooth[k0..k0 + len].iter_mut().zip(e) {
                *s = gain_s * *e;
            }
            let len = len.min(nd.saturating_sub(k0));
            let o = &scratch.odd[(self.scheme.shift - lo) as usize..][..len];
            for (d, o) in detail[k0.min(nd)..].iter_mut().zip(o) {
                *d = gain_d * *o;
            }
        }
        if self.weigh {
            scale_ends(smooth, self.extension.smooth_ends(self.n), 0.5);
            scale_ends(detail, self.extension.detail_ends(self.n), 0.5);
        }
    }

    /// The two halves to fine samples.
    pub(crate) fn down(&self, smooth: &[S], detail: &[S], fine: &mut [S], scratch: &mut Scratch<S>) {
        debug_assert_eq!(fine.len(), self.n);
        let ns = smooth.len();
        if let Some(bank) = &self.cubic {
            let index = (|k| self.extension.smooth(self.n, k), |k| self.extension.detail(self.n, k).0);
            return Row::<S, true>::down(bank).synthesize_row(smooth, detail, fine, index);
        }
        let lo = self.origin();
        for k0 in (0..ns).step_by(BLOCK) {
            let len = BLOCK.min(ns - k0);
            self.prepare(scratch, len);
            self.load_halves(smooth, detail, k0 as isize + lo, scratch);
            self.steps(scratch, len);
            let from = -lo as usize;
            let (e, o) = (&scratch.even[from..from + len], &scratch.odd[from..from + len]);
            let out = &mut fine[2 * k0..(2 * (k0 + len)).min(self.n)];
            let mut pairs = out.chunks_exact_mut(2);
            for ((pair, e), o) in (&mut pairs).zip(e).zip(o) {
                pair[0] = *e;
                pair[1] = *o;
            }
            if let [last] = pairs.into_remainder() {
                *last = e[len - 1];
            }
        }
        if self.weigh {
            scale_ends(fine, self.extension.fine_ends(), 0.5);
        }
    }

    /// Even and odd fine samples of the pairs from `k0` on.
    fn load_fine(&self, fine: &[S], k0: isize, even: &mut [S], odd: &mut [S]) {
        let n = self.n as isize;
        let ends = self.extension.fine_ends();
        let len = even.len() as isize;
        // Pairs that lie inside the array, without its first and last sample.
        let from = (1 - k0).clamp(0, len);
        let to = ((n - 2).div_euclid(2) - k0).clamp(from, len);
        let one = |p: isize| {
            let i = self.extension.fine(self.n, p);
            weight::<S>(self.weigh, ends, i, self.n) * fine[i]
        };
        for i in (0..from).chain(to..len) {
            even[i as usize] = one(2 * (k0 + i));
            odd[i as usize] = one(2 * (k0 + i) + 1);
        }
        let (from, to) = (from as usize, to as usize);
        if to > from {
            let at = (2 * (k0 + from as isize)) as usize;
            let pairs = fine[at..at + 2 * (to - from)].chunks_exact(2);
            for ((pair, e), o) in pairs.zip(&mut even[from..to]).zip(&mut odd[from..to]) {
                *e = pair[0];
                *o = pair[1];
            }
        }
    }

    /// Scaled smooth coefficients as even samples, scaled details as odd ones, from pair `k0` on.
    fn load_halves(&self, smooth: &[S], detail: &[S], k0: isize, scratch: &mut Scratch<S>) {
        let (ns, nd) = (smooth.len(), detail.len());
        let ends = self.extension.smooth_ends(self.n);
        load_half(&mut scratch.even, k0, smooth, self.scheme.scale.0, |k| {
            let i = self.extension.smooth(self.n, k);
            weight::<S>(self.weigh, ends, i, ns) * smooth[i]
        });
        let ends = self.extension.detail_ends(self.n);
        load_half(&mut scratch.odd, k0 - self.scheme.shift, detail, self.scheme.scale.1, |k| {
            let (i, sign) = self.extension.detail(self.n, k);
            weight::<S>(self.weigh, ends, i, nd) * S::from_f64(sign) * detail[i]
        });
    }
}

/// `to[i] = gain * from[k0 + i]`, by `outside` at the ends of `from` and beyond.
fn load_half<S: Scalar>(to: &mut [S], k0: isize, from: &[S], gain: S, outside: impl Fn(isize) -> S) {
    let len = to.len() as isize;
    let lo = (1 - k0).clamp(0, len);
    let hi = (from.len() as isize - 1 - k0).clamp(lo, len);
    for i in (0..lo).chain(hi..len) {
        to[i as usize] = gain * outside(k0 + i);
    }
    if hi > lo {
        let at = (k0 + lo) as usize;
        for (t, x) in to[lo as usize..hi as usize].iter_mut().zip(&from[at..]) {
            *t = gain * *x;
        }
    }
}
