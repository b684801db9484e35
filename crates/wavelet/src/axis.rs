//! One rung along one axis of a box.
//!
//! A box is `outer x n x inner`, row-major. Rows (`inner = 1`) run block by block, other axes as sweeps over rows.
//! Bands of rows are independent tasks.

use crate::coefficient::Scalar;
use crate::extension::Ends;
use crate::lifted::{Program, Scratch};
use crate::rung::{Engine, Kind, Rung};
use crate::sweep::{Rings, Sweep};
use ondelette_numerics::par;

/// Pairs of rows per task.
pub(crate) const BAND: usize = 256;
/// Values below which threads cost more than they give.
const SMALL: usize = 1 << 15;

pub(crate) fn run<T: Send>(work: usize, tasks: Vec<T>, f: impl Fn(T) + Sync) {
    if work < SMALL || tasks.len() < 2 { tasks.into_iter().for_each(f) } else { par::for_each(tasks, f) }
}

pub(crate) fn on_mirror(ends: Ends, i: usize, n: usize) -> bool {
    (ends.first && i == 0) || (ends.last && i + 1 == n)
}

/// `to = by * from`.
pub(crate) fn put<S: Scalar>(to: &mut [S], from: &[S], by: S) {
    for (t, f) in to.iter_mut().zip(from) {
        *t = by * *f;
    }
}

/// `n x inner` values cut for a band of rows: smooth rows from `k0` on, detail rows from `k0` on.
struct Halves<'a, S> {
    slab: usize,
    k0: usize,
    k1: usize,
    smooth: &'a mut [S],
    detail: &'a mut [S],
}

/// Cuts `outer` slabs of `ns + nd` rows of width `inner` into bands of both halves.
fn bands<S>(dst: &mut [S], ns: usize, nd: usize, inner: usize) -> Vec<Halves<'_, S>> {
    let mut out = Vec::new();
    for (slab, rows) in dst.chunks_mut((ns + nd) * inner).enumerate() {
        let (smooth, detail) = rows.split_at_mut(ns * inner);
        let mut details = detail.chunks_mut(BAND * inner);
        for (b, smooth) in smooth.chunks_mut(BAND * inner).enumerate() {
            let k0 = b * BAND;
            out.push(Halves { slab, k0, k1: (k0 + BAND).min(ns), smooth, detail: details.next().unwrap_or_default() });
        }
    }
    out
}

/// Towards coarser along the middle axis; both boxes are compact, the result is smooth then detail.
pub(crate) fn up<S: Scalar>(rung: &Rung, kind: Kind, src: &[S], dst: &mut [S], inner: usize) {
    let (n, ns, nd) = (rung.fine(), rung.smooth(), rung.detail());
    let slab = n * inner;
    match &rung.engine {
        Engine::Lifted(l) if inner == 1 => {
            let program = l.up(kind);
            let rows = (SMALL / n).max(1);
            let tasks = src.chunks(rows * n).zip(dst.chunks_mut(rows * n)).collect();
            run(src.len(), tasks, |(src, dst): (&[S], &mut [S])| {
                let mut scratch = Scratch::default();
                for (src, dst) in src.chunks(n).zip(dst.chunks_mut(n)) {
                    let (s, d) = dst.split_at_mut(ns);
                    program.up(src, s, d, &mut scratch);
                }
            });
        }
        Engine::Lifted(l) => {
            let program = l.up(kind);
            let sweep = Sweep::new(&program, program.scheme.shift);
            run(src.len(), bands(dst, ns, nd, inner), |h: Halves<'_, S>| {
                let src = &src[h.slab * slab..][..slab];
                let fetch = |odd: bool, k: isize, row: &mut [S]| {
                    let p = program.extension.fine(n, 2 * k + isize::from(odd));
                    row.copy_from_slice(&src[p * inner..][..inner]);
                    weigh_in(&program, program.extension.fine_ends(), p, n, row);
                };
                let (k0, smooth, detail) = (h.k0, h.smooth, h.detail);
                sweep.run(k0, h.k1, inner, &mut Rings::default(), fetch, |k, e, o| {
                    let (gs, gd) = gains_up(&program, k, ns, nd);
                    put(&mut smooth[(k - k0) * inner..][..inner], e, gs);
                    if k < nd {
                        put(&mut detail[(k - k0) * inner..][..inner], o, gd);
                    }
                });
            });
        }
        Engine::Block(_) | Engine::Solved(_) => {
            let tasks = src.chunks(slab).zip(dst.chunks_mut(slab)).collect();
            run(src.len(), tasks, |(src, dst): (&[S], &mut [S])| {
                let (s, d) = dst.split_at_mut(ns * inner);
                rung.engine.up(kind, src, s, d, inner);
            });
        }
    }
}

/// Towards finer along the middle axis: the reverse of [`up`].
pub(crate) fn down<S: Scalar>(rung: &Rung, kind: Kind, src: &[S], dst: &mut [S], inner: usize) {
    let (n, ns, nd) = (rung.fine(), rung.smooth(), rung.detail());
    let slab = n * inner;
    match &rung.engine {
        Engine::Lifted(l) if inner == 1 => {
            let program = l.down(kind);
            let rows = (SMALL / n).max(1);
            let tasks = src.chunks(rows * n).zip(dst.chunks_mut(rows * n)).collect();
            run(src.len(), tasks, |(src, dst): (&[S], &mut [S])| {
                let mut scratch = Scratch::default();
                for (src, dst) in src.chunks(n).zip(dst.chunks_mut(n)) {
                    let (s, d) = src.split_at(ns);
                    program.down(s, d, dst, &mut scratch);
                }
            });
        }
        Engine::Lifted(l) => {
            let program = l.down(kind);
            let sweep = Sweep::new(&program, 0);
            let mut tasks = Vec::new();
            for (i, rows) in dst.chunks_mut(slab).enumerate() {
                for (b, rows) in rows.chunks_mut(2 * BAND * inner).enumerate() {
                    tasks.push((i, b * BAND, rows));
                }
            }
            run(src.len(), tasks, |(i, k0, rows): (usize, usize, &mut [S])| {
                let (smooth, detail) = src[i * slab..][..slab].split_at(ns * inner);
                let fetch = |odd: bool, k: isize, row: &mut [S]| {
                    let (i, by) = half_at(&program, odd, k, ns, nd);
                    let from = if odd { detail } else { smooth };
                    if nd == 0 && odd { row.fill(S::default()) } else { put(row, &from[i * inner..][..inner], by) }
                };
                let k1 = k0 + (rows.len() / inner).div_ceil(2);
                sweep.run(k0, k1, inner, &mut Rings::default(), fetch, |k, e, o| {
                    for (p, row) in [(2 * k, e), (2 * k + 1, o)] {
                        if p < n {
                            put(&mut rows[(p - 2 * k0) * inner..][..inner], row, gain_down(&program, p));
                        }
                    }
                });
            });
        }
        Engine::Block(_) | Engine::Solved(_) => {
            let tasks = src.chunks(slab).zip(dst.chunks_mut(slab)).collect();
            run(src.len(), tasks, |(src, dst): (&[S], &mut [S])| {
                let (s, d) = src.split_at(ns * inner);
                rung.engine.down(kind, s, d, dst, inner);
            });
        }
    }
}

pub(crate) fn weigh_in<S: Scalar>(program: &Program<S>, ends: Ends, i: usize, n: usize, row: &mut [S]) {
    if program.weigh && on_mirror(ends, i, n) {
        let two = S::from_f64(2.0);
        row.iter_mut().for_each(|x| *x *= two);
    }
}

/// What smooth row `k` and detail row `k` are multiplied by as they leave.
pub(crate) fn gains_up<S: Scalar>(program: &Program<S>, k: usize, ns: usize, nd: usize) -> (S, S) {
    let half = |on: bool| S::from_f64(if program.weigh && on { 0.5 } else { 1.0 });
    let (e, n) = (program.extension, program.n);
    let (s, d) = program.scheme.scale;
    (s * half(on_mirror(e.smooth_ends(n), k, ns)), d * half(on_mirror(e.detail_ends(n), k, nd)))
}

pub(crate) fn gain_down<S: Scalar>(program: &Program<S>, p: usize) -> S {
    let on = program.weigh && on_mirror(program.extension.fine_ends(), p, program.n);
    S::from_f64(if on { 0.5 } else { 1.0 })
}

/// Row and factor of the smooth or detail coefficient at even or odd position `k`.
pub(crate) fn half_at<S: Scalar>(program: &Program<S>, odd: bool, k: isize, ns: usize, nd: usize) -> (usize, S) {
    let (e, n) = (program.extension, program.n);
    let double = |on: bool| if program.weigh && on { 2.0 } else { 1.0 };
    if odd {
        let (i, sign) = e.detail(n, k - program.scheme.shift);
        (i, program.scheme.scale.1 * S::from_f64(sign * double(on_mirror(e.detail_ends(n), i, nd))))
    } else {
        let i = e.smooth(n, k);
        (i, program.scheme.scale.0 * S::from_f64(double(on_mirror(e.smooth_ends(n), i, ns))))
    }
}
