//! The bank of the thesis (4, 4), three symmetric steps, fused: the hottest loops of the library.
//!
//! Analysis is `e += a (o + o)`, `o += b (e + e)`, `e += c (o + o) + d (o + o)`; synthesis runs the three backwards.
//! Rows run from the samples to both halves in three short loops in the first cache; columns run all three steps in one
//! loop over four pairs of rows. Both give the numbers of the general path up to rounding.

use crate::coefficient::Scalar;
use crate::lifting::{Scheme, Step};

/// Samples that a row needs before its first pair and after its last (analysis).
const BEFORE: usize = 5;
const AFTER: usize = 4;

/// Pairs of a row worked on at a time, so that all arrays stay in the first cache.
pub(crate) fn block<S>() -> usize {
    4096 / size_of::<S>()
}

/// The taps of the three steps, with the gains of both halves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cubic<S> {
    a: S,
    b: S,
    c: S,
    d: S,
    gain_s: S,
    gain_d: S,
}

/// The pattern of steps; `reach` is the first offset of each.
fn taps<S: Scalar>(step: &Step<S>, odd: bool, first: isize, n: usize) -> Option<(S, S)> {
    match step {
        Step::Lift { odd: o, first: f, taps } if *o == odd && *f == first && taps.len() == n => {
            let symmetric = taps.iter().zip(taps.iter().rev()).all(|(a, b)| a == b);
            symmetric.then(|| (taps[0], taps[n / 2]))
        }
        _ => None,
    }
}

impl<S: Scalar> Cubic<S> {
    /// Recognises the analysis (or, with `down`, the synthesis).
    pub(crate) fn recognise(scheme: &Scheme<S>, down: bool) -> Option<Cubic<S>> {
        let [first, second, third] = &scheme.steps[..] else { return None };
        let (outer, inner) = if down { (third, first) } else { (first, third) };
        let (a, _) = taps(outer, false, -1, 2)?;
        let (b, _) = taps(second, true, 0, 2)?;
        let (c, d) = taps(inner, false, -2, 4)?;
        (scheme.shift == 0).then_some(Cubic { a, b, c, d, gain_s: scheme.scale.0, gain_d: scheme.scale.1 })
    }

    /// Analysis of a row: `seg` holds the samples `2 k0 - 5 ..= 2 k1 + 3` for the pairs `k0..k1` of the outputs.
    fn row_up(&self, seg: &[S], smooth: &mut [S], detail: &mut [S], s1: &mut Vec<S>, d1: &mut Vec<S>) {
        let len = smooth.len();
        s1.resize(len + 4, S::default());
        d1.resize(len + 4, S::default());
        let (s1, d1) = (&mut s1[..len + 4], &mut d1[..len + 4]);
        let (a, b, c, d, gs, gd) = (self.a, self.b, self.c, self.d, self.gain_s, self.gain_d);
        let now = seg.chunks_exact(2);
        let next = seg[2..].chunks_exact(2);
        // The last pair reads one sample of `next` only; it is done apart.
        for (((s, o), x), y) in s1[..len + 3].iter_mut().zip(d1[..len + 3].iter_mut()).zip(now).zip(next) {
            *s = x[1] + a * (x[0] + y[0]);
            *o = y[0];
        }
        let last = &seg[2 * (len + 3)..];
        s1[len + 3] = last[1] + a * (last[0] + last[2]);
        let step = |o: &mut [S], s: &[S]| {
            for ((o, x), y) in o.iter_mut().zip(s).zip(&s[1..]) {
                *o += b * (*x + *y);
            }
        };
        step(&mut d1[..2], s1);
        step(&mut d1[2 + len..3 + len], &s1[2 + len..]);
        let nd = detail.len();
        for (((o, x), y), t) in d1[2..2 + nd].iter_mut().zip(&s1[2..2 + nd]).zip(&s1[3..3 + nd]).zip(detail.iter_mut())
        {
            let v = *o + b * (*x + *y);
            *o = v;
            *t = gd * v;
        }
        step(&mut d1[2 + nd..2 + len], &s1[2 + nd..]);
        let (p0, p1, p2, p3) = (&d1[..len], &d1[1..len + 1], &d1[2..len + 2], &d1[3..len + 3]);
        for (((((s, x), p0), p1), p2), p3) in smooth.iter_mut().zip(&s1[2..len + 2]).zip(p0).zip(p1).zip(p2).zip(p3) {
            *s = gs * (*x + c * (*p0 + *p3) + d * (*p1 + *p2));
        }
    }

    /// Synthesis of a row: `s` holds the smooth coefficients `k0 - 1 ..= k1`, `d` the details `k0 - 3 ..= k1 + 1`, for
    /// the pairs `k0..k1` of `fine`, whose last pair may lack its odd sample.
    fn row_down(&self, s: &[S], d: &[S], fine: &mut [S], e1: &mut Vec<S>, o1: &mut Vec<S>) {
        let len = fine.len().div_ceil(2);
        e1.resize(len + 2, S::default());
        o1.resize(len + 2, S::default());
        let (e1, o1) = (&mut e1[..len + 2], &mut o1[..len + 1]);
        let (a, b, gs, gd) = (self.a, self.b, self.gain_s, self.gain_d);
        let (cg, dg) = (self.c * gd, self.d * gd);
        let n = len + 2;
        let (d0, d1, d2, d3) = (&d[..n], &d[1..n + 1], &d[2..n + 2], &d[3..n + 3]);
        for (((((e, s), p0), p1), p2), p3) in e1.iter_mut().zip(&s[..n]).zip(d0).zip(d1).zip(d2).zip(d3) {
            *e = gs * *s + cg * (*p0 + *p3) + dg * (*p1 + *p2);
        }
        for (((o, p), x), y) in o1.iter_mut().zip(&d[2..]).zip(&e1[..len + 1]).zip(&e1[1..]) {
            *o = gd * *p + b * (*x + *y);
        }
        let mut pairs = fine.chunks_exact_mut(2);
        for (((pair, e), o), p) in (&mut pairs).zip(&e1[1..]).zip(&o1[..len]).zip(&o1[1..]) {
            pair[0] = *e + a * (*o + *p);
            pair[1] = *p;
        }
        if let [last] = pairs.into_remainder() {
            *last = e1[len] + a * (o1[len - 1] + o1[len]);
        }
    }

    /// [`Cubic::row_down`] on coefficients that already hold their margins: `s` one before and one after, `d` three
    /// before and two after.
    pub(crate) fn row_down_from(&self, s: &[S], d: &[S], out: &mut [S], buffers: &mut Buffers<S>) {
        let block = block::<S>();
        for (b, out) in out.chunks_mut(2 * block).enumerate() {
            self.row_down(&s[b * block..], &d[b * block..], out, &mut buffers.s1, &mut buffers.d1);
        }
    }

    /// Runs pairs of a row from `k0` on, as many as `smooth` is long; `fine` maps any position to an index of `x`.
    pub(crate) fn up(
        &self,
        x: &[S],
        k0: usize,
        (smooth, detail): (&mut [S], &mut [S]),
        buffers: &mut Buffers<S>,
        fine: impl Fn(isize) -> usize,
    ) {
        let block = block::<S>();
        let nd = detail.len();
        for (b, smooth) in smooth.chunks_mut(block).enumerate() {
            let from = b * block;
            self.block_up(x, k0 + from, (smooth, &mut detail[from.min(nd)..(from + block).min(nd)]), buffers, &fine);
        }
    }

    fn block_up(
        &self,
        x: &[S],
        k0: usize,
        (smooth, detail): (&mut [S], &mut [S]),
        buffers: &mut Buffers<S>,
        fine: impl Fn(isize) -> usize,
    ) {
        let len = smooth.len();
        let from = 2 * k0 as isize - BEFORE as isize;
        let count = 2 * len + BEFORE + AFTER;
        let Buffers { s1, d1, seg, .. } = buffers;
        if from >= 0 && from as usize + count <= x.len() {
            self.row_up(&x[from as usize..][..count], smooth, detail, s1, d1);
        } else {
            extend(seg, x, from, count, fine);
            self.row_up(seg, smooth, detail, s1, d1);
        }
    }

    /// Runs the pairs of `out` from `k0` on, at most a block; `smooth` and `detail` map any position to an index.
    pub(crate) fn down(
        &self,
        s: &[S],
        d: &[S],
        k0: usize,
        out: &mut [S],
        buffers: &mut Buffers<S>,
        (smooth, detail): (impl Fn(isize) -> usize, impl Fn(isize) -> usize),
    ) {
        let len = out.len().div_ceil(2);
        let k = k0 as isize;
        let Buffers { s1, d1, seg, seg2 } = buffers;
        if k >= 3 && k0 + len < s.len() && k0 + len + 1 < d.len() {
            self.row_down(&s[k0 - 1..][..len + 2], &d[k0 - 3..][..len + 5], out, s1, d1);
        } else {
            extend(seg, s, k - 1, len + 2, smooth);
            extend(seg2, d, k - 3, len + 5, detail);
            self.row_down(seg, seg2, out, s1, d1);
        }
    }
}

/// `to[i] = x[index(from + i)]`.
fn extend<S: Scalar>(to: &mut Vec<S>, x: &[S], from: isize, count: usize, index: impl Fn(isize) -> usize) {
    to.clear();
    let n = x.len() as isize;
    let end = from + count as isize;
    let lo = from.max(0).min(end);
    let hi = end.min(n).max(lo);
    let outside = |p: isize| if x.is_empty() { S::default() } else { x[index(p)] };
    to.extend((from..lo).map(outside));
    to.extend_from_slice(&x[lo as usize..hi as usize]);
    to.extend((hi..end).map(outside));
}

/// Reused arrays of the row loops.
#[derive(Default)]
pub(crate) struct Buffers<S> {
    s1: Vec<S>,
    d1: Vec<S>,
    seg: Vec<S>,
    seg2: Vec<S>,
}

/// What the column loops keep from one group of four pairs of rows to the next, for all columns of a picture.
pub(crate) struct Columns<S> {
    cubic: Cubic<S>,
    state: [Vec<S>; 6],
}

/// Rows of a group: smooth and detail rows towards coarser, even and odd rows towards finer.
pub(crate) struct Group<'a, S> {
    pub(crate) first: [&'a mut [S]; 4],
    pub(crate) second: [&'a mut [S]; 4],
}

impl<S: Scalar> Columns<S> {
    pub(crate) fn new(cubic: Cubic<S>, width: usize) -> Columns<S> {
        Columns { cubic, state: std::array::from_fn(|_| vec![S::default(); width]) }
    }

    /// Before the first group: the odd row that precedes it, columns `from..`.
    pub(crate) fn previous_odd(&mut self, from: usize, len: usize) -> &mut [S] {
        &mut self.state[5][from..from + len]
    }

    /// Even and odd rows `k ..= k + 3` come in; smooth rows `k - 2 ..= k + 1` and detail rows `k - 1 ..= k + 2` go out.
    /// Columns `from..` of the state.
    pub(crate) fn up(&mut self, from: usize, even: [&[S]; 4], odd: [&[S]; 4], out: Group<'_, S>) {
        let to = from + even[0].len();
        let [s1, s2, d1, d2, d3, p] = self.state.each_mut().map(|r| &mut r[from..to]);
        let ([e0, e1, e2, e3], [o0, o1, o2, o3]) = (even, odd);
        let Group { first: [q0, q1, q2, q3], second: [t0, t1, t2, t3] } = out;
        let k = &self.cubic;
        up4(k, e0, e1, e2, e3, o0, o1, o2, o3, s1, s2, d1, d2, d3, p, q0, q1, q2, q3, t0, t1, t2, t3);
    }

    /// Smooth rows `k ..= k + 3` and detail rows `k - 2 ..= k + 4` come in; pairs `k - 1 ..= k + 2` go out.
    pub(crate) fn down(&mut self, from: usize, smooth: [&[S]; 4], detail: [&[S]; 7], out: Group<'_, S>) {
        let to = from + smooth[0].len();
        let [e, o, ..] = self.state.each_mut().map(|r| &mut r[from..to]);
        let ([s0, s1, s2, s3], [d0, d1, d2, d3, d4, d5, d6]) = (smooth, detail);
        let Group { first: [x0, x1, x2, x3], second: [y0, y1, y2, y3] } = out;
        let k = &self.cubic;
        down4(k, s0, s1, s2, s3, d0, d1, d2, d3, d4, d5, d6, e, o, x0, x1, x2, x3, y0, y1, y2, y3);
    }
}

/// The loop of [`Columns::up`].
#[inline(never)]
#[expect(clippy::too_many_arguments, reason = "rows as arguments of their own are known not to overlap")]
fn up4<S: Scalar>(
    k: &Cubic<S>,
    e0: &[S],
    e1: &[S],
    e2: &[S],
    e3: &[S],
    o0: &[S],
    o1: &[S],
    o2: &[S],
    o3: &[S],
    s1: &mut [S],
    s2: &mut [S],
    d1: &mut [S],
    d2: &mut [S],
    d3: &mut [S],
    p: &mut [S],
    q0: &mut [S],
    q1: &mut [S],
    q2: &mut [S],
    q3: &mut [S],
    t0: &mut [S],
    t1: &mut [S],
    t2: &mut [S],
    t3: &mut [S],
) {
    let Cubic { a, b, c, d, gain_s, gain_d } = *k;
    let n = e0.len();
    let (e0, e1, e2, e3) = (&e0[..n], &e1[..n], &e2[..n], &e3[..n]);
    let (o0, o1, o2, o3, p) = (&o0[..n], &o1[..n], &o2[..n], &o3[..n], &mut p[..n]);
    let (s1, s2, d1, d2, d3) = (&mut s1[..n], &mut s2[..n], &mut d1[..n], &mut d2[..n], &mut d3[..n]);
    let (q0, q1, q2, q3) = (&mut q0[..n], &mut q1[..n], &mut q2[..n], &mut q3[..n]);
    let (t0, t1, t2, t3) = (&mut t0[..n], &mut t1[..n], &mut t2[..n], &mut t3[..n]);
    for i in 0..n {
        let (x0, x1, x2, x3) = (o0[i], o1[i], o2[i], o3[i]);
        let a0 = e0[i] + a * (p[i] + x0);
        let b0 = p[i] + b * (s1[i] + a0);
        t0[i] = gain_d * b0;
        q0[i] = gain_s * (s2[i] + c * (d3[i] + b0) + d * (d2[i] + d1[i]));
        let a1 = e1[i] + a * (x0 + x1);
        let b1 = x0 + b * (a0 + a1);
        t1[i] = gain_d * b1;
        q1[i] = gain_s * (s1[i] + c * (d2[i] + b1) + d * (d1[i] + b0));
        let a2 = e2[i] + a * (x1 + x2);
        let b2 = x1 + b * (a1 + a2);
        t2[i] = gain_d * b2;
        q2[i] = gain_s * (a0 + c * (d1[i] + b2) + d * (b0 + b1));
        let a3 = e3[i] + a * (x2 + x3);
        let b3 = x2 + b * (a2 + a3);
        t3[i] = gain_d * b3;
        q3[i] = gain_s * (a1 + c * (b0 + b3) + d * (b1 + b2));
        (s1[i], s2[i]) = (a3, a2);
        (d1[i], d2[i], d3[i]) = (b3, b2, b1);
        p[i] = x3;
    }
}

/// The loop of [`Columns::down`].
#[inline(never)]
#[expect(clippy::too_many_arguments, reason = "rows as arguments of their own are known not to overlap")]
fn down4<S: Scalar>(
    k: &Cubic<S>,
    s0: &[S],
    s1: &[S],
    s2: &[S],
    s3: &[S],
    d0: &[S],
    d1: &[S],
    d2: &[S],
    d3: &[S],
    d4: &[S],
    d5: &[S],
    d6: &[S],
    e: &mut [S],
    o: &mut [S],
    x0: &mut [S],
    x1: &mut [S],
    x2: &mut [S],
    x3: &mut [S],
    y0: &mut [S],
    y1: &mut [S],
    y2: &mut [S],
    y3: &mut [S],
) {
    let Cubic { a, b, c, d, gain_s, gain_d } = *k;
    let (c, d) = (c * gain_d, d * gain_d);
    let n = s0.len();
    let (s0, s1, s2, s3) = (&s0[..n], &s1[..n], &s2[..n], &s3[..n]);
    let (d0, d1, d2, d3, d4, d5, d6) = (&d0[..n], &d1[..n], &d2[..n], &d3[..n], &d4[..n], &d5[..n], &d6[..n]);
    let (e, o) = (&mut e[..n], &mut o[..n]);
    let (x0, x1, x2, x3) = (&mut x0[..n], &mut x1[..n], &mut x2[..n], &mut x3[..n]);
    let (y0, y1, y2, y3) = (&mut y0[..n], &mut y1[..n], &mut y2[..n], &mut y3[..n]);
    for i in 0..n {
        let (v1, v2, v3, v4, v5) = (d1[i], d2[i], d3[i], d4[i], d5[i]);
        let e0 = gain_s * s0[i] + c * (d0[i] + v3) + d * (v1 + v2);
        let o0 = gain_d * v1 + b * (e[i] + e0);
        x0[i] = e[i] + a * (o[i] + o0);
        y0[i] = o0;
        let e1 = gain_s * s1[i] + c * (v1 + v4) + d * (v2 + v3);
        let o1 = gain_d * v2 + b * (e0 + e1);
        x1[i] = e0 + a * (o0 + o1);
        y1[i] = o1;
        let e2 = gain_s * s2[i] + c * (v2 + v5) + d * (v3 + v4);
        let o2 = gain_d * v3 + b * (e1 + e2);
        x2[i] = e1 + a * (o1 + o2);
        y2[i] = o2;
        let e3 = gain_s * s3[i] + c * (v3 + d6[i]) + d * (v4 + v5);
        let o3 = gain_d * v4 + b * (e2 + e3);
        x3[i] = e2 + a * (o2 + o3);
        y3[i] = o3;
        (e[i], o[i]) = (e3, o3);
    }
}
