//! The column loops of the bank (4, 4): all three steps at once over four pairs of rows.

use super::Cubic;
use crate::coefficient::Scalar;

/// Cuts rows to one length, so that the loop over them checks no bounds.
macro_rules! cut {
    ($n:ident: mut $($row:ident)*) => {
        $(let $row = &mut $row[..$n];)*
    };
    ($n:ident: $($row:ident)*) => {
        $(let $row = &$row[..$n];)*
    };
}

/// What the column loops keep from one group of four pairs of rows to the next, for all columns of a picture.
#[derive(Debug, Default)]
pub(crate) struct Columns<S> {
    state: [Vec<S>; 6],
}

/// Rows of a group: smooth and detail rows towards coarser, even and odd rows towards finer.
pub(crate) struct Group<'a, S> {
    pub(crate) first: [&'a mut [S]; 4],
    pub(crate) second: [&'a mut [S]; 4],
}

impl<S: Scalar> Columns<S> {
    /// Makes room for `width` columns.
    pub(crate) fn widen(&mut self, width: usize) {
        super::band::widen(self.state.iter_mut(), width);
    }

    /// Before the first group: the odd row that precedes it, columns `from..`.
    pub(crate) fn previous_odd(&mut self, from: usize, len: usize) -> &mut [S] {
        &mut self.state[5][from..from + len]
    }

    /// Even and odd rows `k ..= k + 3` come in; smooth rows `k - 2 ..= k + 1` and detail rows `k - 1 ..= k + 2` go out.
    /// Columns `from..` of the state.
    pub(crate) fn up(&mut self, k: &Cubic<S>, from: usize, even: [&[S]; 4], odd: [&[S]; 4], out: Group<'_, S>) {
        let to = from + even[0].len();
        let [s1, s2, d1, d2, d3, p] = self.state.each_mut().map(|r| &mut r[from..to]);
        let ([e0, e1, e2, e3], [o0, o1, o2, o3]) = (even, odd);
        let Group { first: [q0, q1, q2, q3], second: [t0, t1, t2, t3] } = out;
        up4(k, e0, e1, e2, e3, o0, o1, o2, o3, s1, s2, d1, d2, d3, p, q0, q1, q2, q3, t0, t1, t2, t3);
    }

    /// Smooth rows `k ..= k + 3` and detail rows `k - 2 ..= k + 4` come in; pairs `k - 1 ..= k + 2` go out.
    pub(crate) fn down(&mut self, k: &Cubic<S>, from: usize, smooth: [&[S]; 4], detail: [&[S]; 7], out: Group<'_, S>) {
        let to = from + smooth[0].len();
        let [e, o, ..] = self.state.each_mut().map(|r| &mut r[from..to]);
        let ([s0, s1, s2, s3], [d0, d1, d2, d3, d4, d5, d6]) = (smooth, detail);
        let Group { first: [x0, x1, x2, x3], second: [y0, y1, y2, y3] } = out;
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
    cut!(n: e0 e1 e2 e3 o0 o1 o2 o3);
    cut!(n: mut s1 s2 d1 d2 d3 p q0 q1 q2 q3 t0 t1 t2 t3);
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
    cut!(n: s0 s1 s2 s3 d0 d1 d2 d3 d4 d5 d6);
    cut!(n: mut e o x0 x1 x2 x3 y0 y1 y2 y3);
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
