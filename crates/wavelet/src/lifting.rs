//! Filter banks as short programs of in-place steps on the even and odd samples.
//!
//! A [`Scheme`] is the analysis of one level: split into even and odd samples, run the steps, scale. Its inverse runs
//! them backwards; its transposes are again schemes. Spline schemes are found by the Euclidean algorithm on exact
//! polyphase matrices, Daubechies' by their lattice of rotations.

use crate::coefficient::Scalar;
use crate::exact::{Sequence, SplineFilters, to_f64};

/// One in-place step.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Step<S> {
    /// `target[k] += sum_i taps[i] * other[k + first + i]`; the target is the odd samples or the even ones.
    Lift { odd: bool, first: isize, taps: Vec<S> },
    /// `(e[k], o[k+offset]) -> (e + t o, o - t e)`.
    Rotate { t: S, offset: isize },
    /// The inverse of `Rotate` times `1 + t^2`.
    Unrotate { t: S, offset: isize },
}

/// Steps between the samples and the two halves; see the module.
///
/// Analysis: run `steps`, then `smooth[k] = scale.0 * e[k]`, `detail[k] = scale.1 * o[k + shift]`. Synthesis: the
/// other way round, `e[k] = scale.0 * smooth[k]`, `o[k] = scale.1 * detail[k - shift]`, then `steps`.
#[derive(Clone, Debug)]
pub(crate) struct Scheme<S> {
    pub(crate) steps: Vec<Step<S>>,
    pub(crate) scale: (S, S),
    pub(crate) shift: isize,
}

/// The range of positions, relative to the asked `0..len`, that a step works on: `lo..len + hi`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Reach {
    pub(crate) lo: isize,
    pub(crate) hi: isize,
}

impl Reach {
    fn hull(self, o: Reach) -> Reach {
        Reach { lo: self.lo.min(o.lo), hi: self.hi.max(o.hi) }
    }
    fn moved(self, a: isize, b: isize) -> Reach {
        Reach { lo: self.lo + a, hi: self.hi + b }
    }
}

/// Which positions must be loaded, and which each step must compute, to have the outputs on `0..len`.
#[derive(Clone, Debug)]
pub(crate) struct Needs {
    pub(crate) even: Reach,
    pub(crate) odd: Reach,
    pub(crate) steps: Vec<Reach>,
}

impl<S: Scalar> Scheme<S> {
    /// What must be known to compute `e[0..len]` and `o[shift..len+shift]`.
    pub(crate) fn needs(&self, shift: isize) -> Needs {
        let (mut even, mut odd) = (Reach::default(), Reach { lo: shift, hi: shift });
        let mut steps: Vec<Reach> = Vec::with_capacity(self.steps.len());
        for step in self.steps.iter().rev() {
            match step {
                Step::Lift { odd: target_odd, first, taps } => {
                    let (target, other) = if *target_odd { (odd, &mut even) } else { (even, &mut odd) };
                    *other = other.hull(target.moved(*first, first + taps.len() as isize - 1));
                    steps.push(target);
                }
                Step::Rotate { offset, .. } | Step::Unrotate { offset, .. } => {
                    even = even.hull(odd.moved(-offset, -offset));
                    odd = even.moved(*offset, *offset);
                    steps.push(even);
                }
            }
        }
        steps.reverse();
        Needs { even, odd, steps }
    }

    /// The steps of the inverse, to run after dividing by the scale.
    pub(crate) fn inverse(&self) -> Scheme<S> {
        let one = S::from_f64(1.0);
        let div = |x: S| S::from_f64(1.0 / x.to_f64());
        let mut gain = one;
        let steps = self.steps.iter().rev().map(|s| match s {
            Step::Lift { odd, first, taps } => {
                Step::Lift { odd: *odd, first: *first, taps: taps.iter().map(|&t| -t).collect() }
            }
            Step::Rotate { t, offset } => {
                gain *= one + *t * *t;
                Step::Unrotate { t: *t, offset: *offset }
            }
            Step::Unrotate { t, offset } => {
                gain *= one + *t * *t;
                Step::Rotate { t: *t, offset: *offset }
            }
        });
        let steps = steps.collect();
        let scale = (div(self.scale.0 * gain), div(self.scale.1 * gain));
        Scheme { steps, scale, shift: self.shift }
    }

    /// The scheme of the dual bank: its analysis is the transpose of this scheme's synthesis.
    pub(crate) fn dual(&self) -> Scheme<S> {
        let mut gain = S::from_f64(1.0);
        let steps = self
            .steps
            .iter()
            .map(|s| match s {
                Step::Lift { odd, first, taps } => Step::Lift {
                    odd: !odd,
                    first: -(first + taps.len() as isize - 1),
                    taps: taps.iter().rev().map(|&t| -t).collect(),
                },
                // A rotation is orthogonal up to its length.
                Step::Rotate { t, offset } | Step::Unrotate { t, offset } => {
                    gain *= S::from_f64(1.0) + *t * *t;
                    s.clone().with_angle(*t, *offset)
                }
            })
            .collect();
        let div = |x: S| S::from_f64(1.0 / (x * gain).to_f64());
        Scheme { steps, scale: (div(self.scale.0), div(self.scale.1)), shift: self.shift }
    }

    /// The same program in another number type.
    pub(crate) fn cast<T: Scalar>(&self) -> Scheme<T> {
        let c = |x: S| T::from_f64(x.to_f64());
        let steps = self.steps.iter().map(|s| match s {
            Step::Lift { odd, first, taps } => {
                Step::Lift { odd: *odd, first: *first, taps: taps.iter().map(|&t| c(t)).collect() }
            }
            Step::Rotate { t, offset } => Step::Rotate { t: c(*t), offset: *offset },
            Step::Unrotate { t, offset } => Step::Unrotate { t: c(*t), offset: *offset },
        });
        Scheme { steps: steps.collect(), scale: (c(self.scale.0), c(self.scale.1)), shift: self.shift }
    }
}

impl<S> Step<S> {
    fn with_angle(self, t: S, offset: isize) -> Step<S> {
        match self {
            Step::Unrotate { .. } => Step::Unrotate { t, offset },
            _ => Step::Rotate { t, offset },
        }
    }
}

/// Laurent division: `a = q b + r` with fewer terms in `r` than in `b`, terms cancelled at both ends in turn.
fn divide(a: &Sequence, b: &Sequence) -> (Sequence, Sequence) {
    let (mut q, mut r) = (Sequence::zero(), a.clone());
    let mut low = true;
    while !r.is_zero() && r.coef.len() >= b.coef.len() {
        let term = if low {
            Sequence::new(r.first - b.first, vec![&r.coef[0] / &b.coef[0]])
        } else {
            Sequence::new(r.last() - b.last(), vec![&r.coef[r.coef.len() - 1] / &b.coef[b.coef.len() - 1]])
        };
        r = &r - &(&term * b);
        q = &q - &Sequence::new(term.first, term.coef.iter().map(|c| -c.clone()).collect());
        low = !low;
    }
    (q, r)
}

/// Factors the analysis bank of a spline family into lifting steps, exactly.
pub(crate) fn factor(f: &SplineFilters) -> Scheme<f64> {
    let phases = |s: &Sequence| (s.phase(0), s.phase(1));
    let (mut he, mut ho) = phases(&f.h_dual);
    let (mut ge, mut go) = phases(&f.g_dual);
    let mut steps = Vec::new();
    let lift = |odd: bool, q: &Sequence| {
        let (first, taps) = q.to_f64();
        Step::Lift { odd, first, taps }
    };
    while !ge.is_zero() {
        if go.coef.len() >= ge.coef.len() {
            let (q, r) = divide(&go, &ge);
            steps.push(lift(false, &q));
            ho = &ho - &(&he * &q);
            go = r;
        } else {
            let (q, r) = divide(&ge, &go);
            steps.push(lift(true, &q));
            he = &he - &(&ho * &q);
            ge = r;
        }
    }
    // d = go o with go a constant; the bank is invertible, so he is a constant too.
    debug_assert!(go.coef.len() == 1 && go.first == 0 && he.coef.len() == 1 && he.first == 0);
    if !ho.is_zero() {
        let (q, _) = divide(&ho, &he);
        steps.push(lift(false, &q));
    }
    Scheme { steps, scale: (to_f64(&he.coef[0]), to_f64(&go.coef[0])), shift: 0 }
}

/// The Haar bank of Eq. 11: pairwise mean, and half the difference.
pub(crate) fn haar() -> Scheme<f64> {
    let steps = vec![
        Step::Lift { odd: true, first: 0, taps: vec![-1.0] },
        Step::Lift { odd: false, first: 0, taps: vec![0.5] },
    ];
    Scheme { steps, scale: (1.0, -0.5), shift: 0 }
}

/// The CDF 9/7 bank, scaled as in JPEG 2000: constants have gain 1, the Nyquist frequency gain 2 in the detail.
pub(crate) fn cdf97() -> Scheme<f64> {
    const K: f64 = 1.149_604_398_860_241_2;
    let lift = |odd: bool, t: f64| Step::Lift { odd, first: if odd { 0 } else { -1 }, taps: vec![t, t] };
    let steps = vec![
        lift(true, -1.586_134_342_059_923_6),
        lift(false, -0.052_980_118_572_961_414),
        lift(true, 0.882_911_075_530_933_3),
        lift(false, 0.443_506_852_043_971_15),
    ];
    // Gains of the plain program on constants (even) and on (-1)^k (odd), divided out.
    let root = std::f64::consts::SQRT_2;
    Scheme { steps, scale: (K / root, root / K), shift: 0 }
}

/// Daubechies' bank of `2 p` taps from its lattice; see [`crate::tables::DAUBECHIES_LATTICE`].
pub(crate) fn daubechies(angles: &[f64]) -> Scheme<f64> {
    let steps =
        angles.iter().enumerate().map(|(i, &t)| Step::Rotate { t: if i == 0 { t } else { -t }, offset: i as isize });
    let steps: Vec<_> = steps.collect();
    // Orthogonal up to its length, which is divided out; 1/sqrt2 makes the smooth half a mean, as in Eq. 11.
    let length: f64 = angles.iter().map(|t| 1.0 + t * t).product::<f64>().sqrt();
    let scale = std::f64::consts::FRAC_1_SQRT_2 / length;
    Scheme { steps, scale: (scale, -scale), shift: angles.len() as isize - 1 }
}

/// The filters of an analysis scheme on the line: `(h~, g~)` as `(first, taps)` relative to fine position `2 k`.
pub(crate) fn analysis_filters(scheme: &Scheme<f64>) -> [(isize, Vec<f64>); 2] {
    let needs = scheme.needs(scheme.shift);
    let lo = needs.even.lo.min(needs.odd.lo);
    let n = (1 + needs.even.hi.max(needs.odd.hi) - lo) as usize;
    let mut out = [(2 * lo, vec![0.0; 2 * n]), (2 * lo, vec![0.0; 2 * n])];
    for at in 0..2 * n {
        let (mut e, mut o) = (vec![0.0; n], vec![0.0; n]);
        if at % 2 == 0 {
            e[at / 2] = 1.0
        } else {
            o[at / 2] = 1.0
        }
        for (step, r) in scheme.steps.iter().zip(&needs.steps) {
            run_step(step, &mut e, &mut o, (r.lo - lo) as usize, (1 + r.hi - lo) as usize);
        }
        out[0].1[at] = scheme.scale.0 * e[-lo as usize];
        out[1].1[at] = scheme.scale.1 * o[(scheme.shift - lo) as usize];
    }
    out.map(|(first, taps)| {
        let lead = taps.iter().take_while(|t| **t == 0.0).count();
        let end = taps.len() - taps.iter().rev().take_while(|t| **t == 0.0).count();
        (first + lead as isize, taps[lead..end].to_vec())
    })
}

/// Runs one step on positions `from..to` of whole arrays.
pub(crate) fn run_step<S: Scalar>(step: &Step<S>, e: &mut [S], o: &mut [S], from: usize, to: usize) {
    match step {
        Step::Lift { odd, first, taps } => {
            let (target, other) = if *odd { (o, &*e) } else { (e, &*o) };
            let start = (from as isize + first) as usize;
            let n = to - from;
            lift(&mut target[from..to], &other[start..start + n + taps.len() - 1], taps);
        }
        Step::Rotate { t, offset } => {
            let o = &mut o[(from as isize + offset) as usize..(to as isize + offset) as usize];
            rotate(&mut e[from..to], o, *t);
        }
        Step::Unrotate { t, offset } => {
            let o = &mut o[(from as isize + offset) as usize..(to as isize + offset) as usize];
            rotate(&mut e[from..to], o, -*t);
        }
    }
}

/// `(e, o) -> (e + t o, o - t e)`, elementwise.
#[inline]
pub(crate) fn rotate<S: Scalar>(e: &mut [S], o: &mut [S], t: S) {
    for (e, o) in e.iter_mut().zip(o) {
        (*e, *o) = (*e + t * *o, *o - t * *e);
    }
}

/// `target[k] += sum_i taps[i] * other[k + i]`, with `other` longer by `taps.len() - 1`.
#[inline]
fn lift<S: Scalar>(target: &mut [S], other: &[S], taps: &[S]) {
    let n = target.len();
    match *taps {
        [a] => {
            for (t, x) in target.iter_mut().zip(&other[..n]) {
                *t += a * *x;
            }
        }
        [a, b] if a == b => {
            for ((t, x), y) in target.iter_mut().zip(&other[..n]).zip(&other[1..]) {
                *t += a * (*x + *y);
            }
        }
        [a, b] => {
            for ((t, x), y) in target.iter_mut().zip(&other[..n]).zip(&other[1..]) {
                *t += a * *x + b * *y;
            }
        }
        [a, b, c, d] if a == d && b == c => {
            let (x0, x1, x2, x3) = (&other[..n], &other[1..n + 1], &other[2..n + 2], &other[3..n + 3]);
            for ((((t, x0), x1), x2), x3) in target.iter_mut().zip(x0).zip(x1).zip(x2).zip(x3) {
                *t += a * (*x0 + *x3) + b * (*x1 + *x2);
            }
        }
        _ => {
            for (i, &a) in taps.iter().enumerate() {
                for (t, x) in target.iter_mut().zip(&other[i..i + n]) {
                    *t += a * *x;
                }
            }
        }
    }
}

/// The same step across rows: `target[x] += sum_i taps[i] * rows[i][x]`.
#[inline]
pub(crate) fn lift_rows<S: Scalar>(target: &mut [S], rows: &[&[S]], taps: &[S]) {
    match (rows, taps) {
        ([x], [a]) => {
            for (t, x) in target.iter_mut().zip(*x) {
                *t += *a * *x;
            }
        }
        ([x, y], [a, b]) if a == b => {
            for ((t, x), y) in target.iter_mut().zip(*x).zip(*y) {
                *t += *a * (*x + *y);
            }
        }
        ([x, y], [a, b]) => {
            for ((t, x), y) in target.iter_mut().zip(*x).zip(*y) {
                *t += *a * *x + *b * *y;
            }
        }
        ([x0, x1, x2, x3], [a, b, c, d]) if a == d && b == c => {
            for ((((t, x0), x1), x2), x3) in target.iter_mut().zip(*x0).zip(*x1).zip(*x2).zip(*x3) {
                *t += *a * (*x0 + *x3) + *b * (*x1 + *x2);
            }
        }
        _ => {
            for (x, &a) in rows.iter().zip(taps) {
                for (t, x) in target.iter_mut().zip(*x) {
                    *t += a * *x;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::spline_filters;

    fn close(a: &(isize, Vec<f64>), b: &(isize, Vec<f64>)) {
        let lo = a.0.min(b.0);
        let hi = (a.0 + a.1.len() as isize).max(b.0 + b.1.len() as isize);
        let at = |s: &(isize, Vec<f64>), k: isize| {
            if k >= s.0 && k < s.0 + s.1.len() as isize { s.1[(k - s.0) as usize] } else { 0.0 }
        };
        for k in lo..hi {
            assert!((at(a, k) - at(b, k)).abs() < 1e-14, "at {k}: {a:?} {b:?}");
        }
    }

    #[test]
    fn lifting_programs_expand_to_the_exact_filters() {
        for (n, nd) in [(2, 2), (3, 3), (4, 4), (4, 6), (6, 12)] {
            let f = spline_filters(n, nd);
            let scheme = factor(&f);
            let [h, g] = analysis_filters(&scheme);
            close(&h, &f.h_dual.to_f64());
            close(&g, &f.g_dual.to_f64());
            let [h, g] = analysis_filters(&scheme.dual());
            close(&h, &f.h.to_f64());
            close(&g, &f.g.to_f64());
        }
        assert_eq!(factor(&spline_filters(4, 4)).steps.len(), 3);
    }

    #[test]
    fn daubechies_and_cdf97_have_their_vanishing_moments() {
        for angles in crate::tables::DAUBECHIES_LATTICE {
            let p = angles.len();
            let [(first, h), (gfirst, g)] = analysis_filters(&daubechies(angles));
            assert_eq!((first, h.len(), gfirst, g.len()), (0, 2 * p, 0, 2 * p));
            for (m, x) in g.iter().enumerate() {
                let sign = if m % 2 == 0 { 1.0 } else { -1.0 };
                assert!((x - sign * h[2 * p - 1 - m]).abs() < 1e-15);
            }
            assert!((h.iter().sum::<f64>() - 1.0).abs() < 1e-14);
            for q in 0..p as i32 {
                // About the middle, in units of the half length, so that powers stay below 1.
                let c = p as f64 - 0.5;
                let moment: f64 = g.iter().enumerate().map(|(m, x)| x * ((m as f64 - c) / c).powi(q)).sum();
                assert!(moment.abs() < 2e-15, "D{} moment {q}: {moment:e}", 2 * p);
            }
        }
        let [(_, h), (first, g)] = analysis_filters(&cdf97());
        assert_eq!((h.len(), g.len()), (9, 7));
        assert!((h.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        let nyquist: f64 = g.iter().enumerate().map(|(m, x)| if m % 2 == 0 { -x } else { *x }).sum();
        assert!((nyquist.abs() - 2.0).abs() < 1e-14 && g[3] > 0.0, "{nyquist} {first}");
        for q in 0..4 {
            let moment: f64 = g.iter().enumerate().map(|(m, x)| x * (m as f64 - 3.0).powi(q)).sum();
            assert!(moment.abs() < 1e-14, "{q} {moment:e}");
        }
    }
}
