//! The row loops of the bank (4, 4).
//!
//! A row is a stream of pairs: a few numbers hold what the next pair needs of those before, so that each sample is read
//! once. Pairs whose neighbours lie outside the row take them through an index; all others run in vector loops.

use super::Cubic;
use crate::coefficient::Scalar;

/// Pairs of a row worked on at a time, so that all arrays stay in the first cache.
fn block<S>() -> usize {
    4096 / size_of::<S>()
}

/// What an analysis needs of the pairs before pair `k`: odd sample `k - 1`, first steps `k - 1` and `k - 2`, details
/// `k - 2`, `k - 3` and `k - 4`.
#[derive(Clone, Copy, Default)]
struct Past<S> {
    odd: S,
    lifted: [S; 2],
    detail: [S; 3],
}

/// A bank along a row. The gains are part of the taps; a bank without gains (`GAIN` false) is two products cheaper.
///
/// Analysis: `l = e + a (o + o)`, `detail = g o + b (l + l)`, `smooth = h l + c (detail + detail) + d (...)`.
/// Synthesis: `e = h smooth + c (detail + detail) + d (...)`, `o = g detail + b (e + e)`, then `e + a (o + o)`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row<S, const GAIN: bool> {
    a: S,
    b: S,
    c: S,
    d: S,
    g: S,
    h: S,
}

impl<S: Scalar, const GAIN: bool> Row<S, GAIN> {
    /// The analysis along a row.
    pub(crate) fn up(bank: &Cubic<S>) -> Row<S, GAIN> {
        let (h, g) = Self::gains(bank);
        let ratio = S::from_f64(h.to_f64() / g.to_f64());
        Row { a: bank.a, b: bank.b * g, c: bank.c * ratio, d: bank.d * ratio, g, h }
    }

    /// The synthesis along a row.
    pub(crate) fn down(bank: &Cubic<S>) -> Row<S, GAIN> {
        let (h, g) = Self::gains(bank);
        Row { a: bank.a, b: bank.b, c: bank.c * g, d: bank.d * g, g, h }
    }

    fn gains(bank: &Cubic<S>) -> (S, S) {
        if GAIN { (bank.gain_s, bank.gain_d) } else { (S::from_f64(1.0), S::from_f64(1.0)) }
    }

    #[inline]
    fn g(&self, x: S) -> S {
        if GAIN { self.g * x } else { x }
    }

    #[inline]
    fn h(&self, x: S) -> S {
        if GAIN { self.h * x } else { x }
    }

    /// Pair `k` comes in; detail `k - 1` and smooth coefficient `k - 2` go out.
    #[inline]
    fn advance(&self, past: &mut Past<S>, even: S, odd: S) -> (S, S) {
        let ([l1, l2], [d1, d2, d3]) = (past.lifted, past.detail);
        let lifted = even + self.a * (past.odd + odd);
        let detail = self.g(past.odd) + self.b * (l1 + lifted);
        let smooth = self.h(l2) + self.c * (d3 + detail) + self.d * (d2 + d1);
        *past = Past { odd, lifted: [lifted, l1], detail: [detail, d1, d2] };
        (detail, smooth)
    }

    /// Analysis of the pairs from `k0` on, as many as `smooth` is long; `detail` may be one shorter. `fine` maps any
    /// position to an index of `x`; `scratch` is memory to reuse.
    pub(crate) fn analyze(
        &self,
        x: &[S],
        k0: usize,
        (smooth, detail): (&mut [S], &mut [S]),
        scratch: &mut Vec<S>,
        fine: impl Fn(isize) -> usize,
    ) {
        let (ns, nd) = (smooth.len(), detail.len());
        let at = |p: isize| x[fine(p)];
        let mut past = Past { odd: at(2 * k0 as isize - 5), ..Past::default() };
        // Time counts from two pairs before `k0`: at time `t` detail `t - 3` and smooth coefficient `t - 4` go out.
        let one = |t: usize, past: &mut Past<S>, smooth: &mut [S], detail: &mut [S]| {
            let p = 2 * (k0 + t) as isize - 4;
            let (d, s) = self.advance(past, at(p), at(p + 1));
            if let Some(out) = t.checked_sub(3).and_then(|i| detail.get_mut(i)) {
                *out = d;
            }
            if let Some(out) = t.checked_sub(4).and_then(|i| smooth.get_mut(i)) {
                *out = s;
            }
        };
        let all = ns + 4;
        let head = all.min(6);
        for t in 0..head {
            one(t, &mut past, smooth, detail);
        }
        // Until here the pair lies in `x` and its detail in `detail`.
        let inside = (nd + 3).min((x.len() / 2 + 2).saturating_sub(k0)).clamp(head, all);
        for t in (head..inside).step_by(block::<S>()) {
            let end = (t + block::<S>()).min(inside);
            let pairs = &x[2 * (k0 + t) - 4..2 * (k0 + end) - 4];
            self.analyze_block(pairs, &mut past, &mut smooth[t - 4..end - 4], &mut detail[t - 6..end - 3], scratch);
        }
        for t in inside..all {
            one(t, &mut past, smooth, detail);
        }
    }

    /// [`Row::advance`] over many pairs. `detail` begins three details before the first that goes out.
    fn analyze_block(&self, pairs: &[S], past: &mut Past<S>, smooth: &mut [S], detail: &mut [S], scratch: &mut Vec<S>) {
        let n = smooth.len();
        scratch.resize(n + 2, S::default());
        let lifted = &mut scratch[..n + 2];
        [lifted[1], lifted[0]] = past.lifted;
        let (mut odd, mut before) = (past.odd, past.lifted[0]);
        for ((l, out), pair) in lifted[2..].iter_mut().zip(&mut detail[3..]).zip(pairs.chunks_exact(2)) {
            let now = pair[0] + self.a * (odd + pair[1]);
            *out = self.g(odd) + self.b * (before + now);
            *l = now;
            (odd, before) = (pair[1], now);
        }
        let (d0, d1, d2, d3) = (&detail[..n], &detail[1..n + 1], &detail[2..n + 2], &detail[3..n + 3]);
        for (((((out, l), d0), d1), d2), d3) in smooth.iter_mut().zip(&lifted[..n]).zip(d0).zip(d1).zip(d2).zip(d3) {
            *out = self.h(*l) + self.c * (*d0 + *d3) + self.d * (*d1 + *d2);
        }
        *past = Past { odd, lifted: [lifted[n + 1], lifted[n]], detail: [detail[n + 2], detail[n + 1], detail[n]] };
    }

    /// Synthesis of the pairs of `out`, whose last may lack its odd sample. `s` holds the smooth coefficients from one
    /// before the first pair to one behind the last, `d` the details from three before to two behind.
    pub(crate) fn synthesize(&self, s: &[S], d: &[S], out: &mut [S]) {
        let n = out.len().div_ceil(2);
        if n == 0 {
            return;
        }
        let even = |i: usize| self.h(s[i]) + self.c * (d[i] + d[i + 3]) + self.d * (d[i + 1] + d[i + 2]);
        let odd = |i: usize| self.g(d[i + 2]) + self.b * (even(i) + even(i + 1));
        if let [last] = out.chunks_exact_mut(2).into_remainder() {
            *last = even(n) + self.a * (odd(n - 1) + odd(n));
        }
        let (mut e, mut o) = (even(1), odd(0));
        let (s, d0, d1, d2, d3) = (&s[2..n + 2], &d[2..n + 2], &d[3..n + 3], &d[4..n + 4], &d[5..n + 5]);
        for (((((pair, s), d0), d1), d2), d3) in out.chunks_exact_mut(2).zip(s).zip(d0).zip(d1).zip(d2).zip(d3) {
            let even = self.h(*s) + self.c * (*d0 + *d3) + self.d * (*d1 + *d2);
            let odd = self.g(*d1) + self.b * (e + even);
            pair[0] = e + self.a * (o + odd);
            pair[1] = odd;
            (e, o) = (even, odd);
        }
    }

    /// [`Row::synthesize`] of a whole row; the indices continue `s` and `d` beyond their ends.
    pub(crate) fn synthesize_row(
        &self,
        s: &[S],
        d: &[S],
        out: &mut [S],
        (smooth, detail): (impl Fn(isize) -> usize, impl Fn(isize) -> usize),
    ) {
        const EDGE: usize = 8;
        let pairs = out.len().div_ceil(2);
        let inside = s.len().saturating_sub(1).min(d.len().saturating_sub(2)).max(3);
        let edge = |k0: usize, out: &mut [S]| {
            for (i, out) in out.chunks_mut(2 * EDGE).enumerate() {
                let k = (k0 + i * EDGE) as isize;
                let s: [S; EDGE + 2] = std::array::from_fn(|i| s[smooth(k - 1 + i as isize)]);
                let d: [S; EDGE + 5] = std::array::from_fn(|i| d[detail(k - 3 + i as isize)]);
                self.synthesize(&s, &d, out);
            }
        };
        let (first, rest) = out.split_at_mut(if pairs > 3 { 6 } else { out.len() });
        edge(0, first);
        let (middle, last) = rest.split_at_mut((2 * (inside - 3)).min(rest.len()));
        self.synthesize(&s[2.min(s.len())..], d, middle);
        edge(inside, last);
    }
}
