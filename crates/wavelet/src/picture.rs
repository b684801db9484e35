//! One level of a picture, both axes in one pass.
//!
//! Rows are transformed on their way into the ring of the column sweep (towards finer: on their way out of it), so that
//! every level reads its input once and writes its output once. Bands of rows are independent tasks. The bank (4, 4)
//! runs in tiles whose rings stay in the first cache.

use std::ops::Range;

use crate::axis::{BAND, gain_down, gains_up, half_at, put, run, weigh_in};
use crate::coefficient::Scalar;
use crate::cubic::{Columns, Cubic, Group, Row};
use crate::lifted::{Program, Scratch};
use crate::sweep::Sweep;

/// One level of a picture towards coarser, both axes in one sweep.
///
/// `src` is compact; the all-smooth quarter goes to `coarse` (compact), the rest to its place in `out`, whose rows are
/// `stride` apart: axis-0 smooth rows first, then detail rows, each row smooth then detail.
pub(crate) fn up_picture<S: Scalar>(
    programs: [&Program<S>; 2],
    src: &[S],
    coarse: &mut [S],
    out: &mut [S],
    stride: usize,
) {
    let [col, row] = programs;
    let (r, c) = (col.n, row.n);
    let (rs, rd, cs) = (r.div_ceil(2), r / 2, c.div_ceil(2));
    let sweep = Sweep::new(col, col.scheme.shift);
    let (top, bottom) = out.split_at_mut(rs * stride);
    let mut bottoms = bottom.chunks_mut(BAND * stride);
    let tops = top.chunks_mut(BAND * stride).zip(coarse.chunks_mut(BAND * cs));
    let tasks = tops
        .enumerate()
        .map(|(b, (top, coarse))| (b * BAND, coarse, top, bottoms.next().unwrap_or_default()))
        .collect();
    let work = |(k0, coarse, top, bottom): (usize, &mut [S], &mut [S], &mut [S])| {
        if col.cubic.is_some() && row.cubic.is_some() {
            return tiles_up(programs, src, k0..(k0 + BAND).min(rs), coarse, [top, bottom], stride);
        }
        let mut scratch = Scratch::default();
        let fetch = |odd: bool, k: isize, to: &mut [S]| {
            let p = col.extension.fine(r, 2 * k + isize::from(odd));
            let (s, d) = to.split_at_mut(cs);
            row.up(&src[p * c..][..c], s, d, &mut scratch);
            weigh_in(col, col.extension.fine_ends(), p, r, to);
        };
        sweep.run(k0, (k0 + BAND).min(rs), c, fetch, |k, e, o| {
            let (gs, gd) = gains_up(col, k, rs, rd);
            put(&mut coarse[(k - k0) * cs..][..cs], &e[..cs], gs);
            put(&mut top[(k - k0) * stride + cs..][..c - cs], &e[cs..], gs);
            if k < rd {
                put(&mut bottom[(k - k0) * stride..][..c], o, gd);
            }
        });
    };
    run(src.len(), tasks, work);
}

/// One level of a picture towards finer: the reverse of [`up_picture`].
pub(crate) fn down_picture<S: Scalar>(
    programs: [&Program<S>; 2],
    coarse: &[S],
    details: &[S],
    stride: usize,
    dst: &mut [S],
) {
    let [col, row] = programs;
    let (r, c) = (col.n, row.n);
    let (rs, rd, cs) = (r.div_ceil(2), r / 2, c.div_ceil(2));
    let sweep = Sweep::new(col, 0);
    let tasks = dst.chunks_mut(2 * BAND * c).enumerate().map(|(b, rows)| (b * BAND, rows)).collect();
    let work = |(k0, rows): (usize, &mut [S])| {
        if col.cubic.is_some() && row.cubic.is_some() {
            return tiles_down(programs, coarse, details, stride, k0, rows);
        }
        let mut scratch = Scratch::default();
        let fetch = |odd: bool, k: isize, to: &mut [S]| {
            let (i, by) = half_at(col, odd, k, rs, rd);
            if odd && rd == 0 {
                to.fill(S::default());
            } else if odd {
                put(to, &details[(rs + i) * stride..][..c], by);
            } else {
                put(&mut to[..cs], &coarse[i * cs..][..cs], by);
                put(&mut to[cs..], &details[i * stride + cs..][..c - cs], by);
            }
        };
        let k1 = k0 + (rows.len() / c).div_ceil(2);
        sweep.run(k0, k1, c, fetch, |k, e, o| {
            for (p, from) in [(2 * k, e), (2 * k + 1, o)] {
                if p < r {
                    let to = &mut rows[(p - 2 * k0) * c..][..c];
                    row.down(&from[..cs], &from[cs..], to, &mut scratch);
                    let by = gain_down(col, p);
                    if by != S::from_f64(1.0) {
                        to.iter_mut().for_each(|x| *x *= by);
                    }
                }
            }
        });
    };
    run(coarse.len() * 4, tasks, work);
}

/// Pairs of columns worked on at a time, so that the rows of a group stay in the second cache. Long runs along a row
/// matter more than the first cache: memory is read and written in streams.
fn tile<S>() -> usize {
    65536 / size_of::<S>()
}

/// Columns `range` of rows `k ..= k + 3` of a buffer with the given stride, counted from row `start`; rows outside
/// `band` come from `nowhere`.
fn four_rows<'a, S>(
    rows: &'a mut [S],
    stride: usize,
    columns: Range<usize>,
    k: isize,
    band: &Range<usize>,
    nowhere: &'a mut [Vec<S>; 4],
) -> [&'a mut [S]; 4] {
    let mut out = nowhere.each_mut().map(|r| &mut r[..columns.len()]);
    let first = (k - band.start as isize).max(0);
    let last = (k + 4).min(band.end as isize) - band.start as isize;
    if last > first {
        let rows = rows[first as usize * stride..].chunks_mut(stride).take((last - first) as usize);
        for (row, out) in rows.zip(&mut out[(first - (k - band.start as isize)) as usize..]) {
            *out = &mut row[columns.clone()];
        }
    }
    out
}

/// A band of [`up_picture`] for the bank (4, 4): smooth rows `band` and the detail rows of the same pairs.
fn tiles_up<S: Scalar>(
    [col, row]: [&Program<S>; 2],
    src: &[S],
    band: Range<usize>,
    coarse: &mut [S],
    [top, bottom]: [&mut [S]; 2],
    stride: usize,
) {
    let (Some(down_columns), Some(bank)) = (col.cubic, row.cubic) else { return };
    // Columns multiply by the gains of both axes.
    let along_row = Row::<S, false>::up(&bank);
    let [smooth_columns, detail_columns] = bank.gains().map(|g| down_columns.amplified(g));
    let (r, c) = (col.n, row.n);
    let (cs, cd, rd) = (c.div_ceil(2), c / 2, r / 2);
    let details = band.start..band.end.min(rd);
    let p = tile::<S>().min(cs);
    let mut scratch = Vec::new();
    let mut columns = Columns::new(2 * cs);
    let mut raw: [Vec<S>; 8] = std::array::from_fn(|_| vec![S::default(); 2 * p]);
    let mut nowhere: [[Vec<S>; 4]; 4] = std::array::from_fn(|_| std::array::from_fn(|_| vec![S::default(); p]));
    let mut load = |y: isize, p0: usize, (ws, wd): (usize, usize), to: &mut [S]| {
        let x = &src[col.extension.fine(r, y) * c..][..c];
        let (s, d) = to[..ws + wd].split_at_mut(ws);
        along_row.analyze(x, p0, (s, d), &mut scratch, |q| row.extension.fine(c, q));
    };
    let start = band.start as isize - 2;
    for k in (start..band.end as isize + 2).step_by(4) {
        for p0 in (0..cs).step_by(p) {
            let (ws, wd) = (p.min(cs - p0), p.min(cd.saturating_sub(p0)));
            let from = 2 * p0;
            if k == start {
                load(2 * k - 1, p0, (ws, wd), columns.previous_odd(from, ws + wd));
            }
            for (i, to) in raw.iter_mut().enumerate() {
                load(2 * k + i as isize, p0, (ws, wd), to);
            }
            let pairs = |from: usize, len: usize| {
                let row = |i: usize| &raw[i][from..from + len];
                ([row(0), row(2), row(4), row(6)], [row(1), row(3), row(5), row(7)])
            };
            let [n0, n1, n2, n3] = &mut nowhere;
            let (even, odd) = pairs(0, ws);
            let out = Group {
                first: four_rows(coarse, cs, p0..p0 + ws, k - 2, &band, n0),
                second: four_rows(bottom, stride, p0..p0 + ws, k - 1, &details, n1),
            };
            columns.up(&smooth_columns, from, even, odd, out);
            let (even, odd) = pairs(ws, wd);
            let place = cs + p0.min(cd)..cs + p0.min(cd) + wd;
            let out = Group {
                first: four_rows(top, stride, place.clone(), k - 2, &band, n2),
                second: four_rows(bottom, stride, place, k - 1, &details, n3),
            };
            columns.up(&detail_columns, from + ws, even, odd, out);
        }
    }
}

/// Columns of a tile as runs of consecutive columns of their source: `(place in the tile, first source column, count)`.
fn runs(positions: Range<isize>, index: impl Fn(isize) -> usize) -> Vec<(usize, usize, usize)> {
    let mut out: Vec<(usize, usize, usize)> = Vec::new();
    for (place, position) in positions.enumerate() {
        let at = index(position);
        match out.last_mut() {
            Some(run) if run.1 + run.2 == at => run.2 += 1,
            _ => out.push((place, at, 1)),
        }
    }
    out
}

/// A band of [`down_picture`] for the bank (4, 4): `rows` from pair `k0` on.
fn tiles_down<S: Scalar>(
    [col, row]: [&Program<S>; 2],
    coarse: &[S],
    details: &[S],
    stride: usize,
    k0: usize,
    rows: &mut [S],
) {
    let (Some(down_columns), Some(bank)) = (col.cubic, row.cubic) else { return };
    let along_row = Row::<S, false>::down(&bank);
    let [smooth_columns, detail_columns] = bank.gains().map(|g| down_columns.amplified(g));
    let (r, c) = (col.n, row.n);
    let (rs, cs) = (r.div_ceil(2), c.div_ceil(2));
    let k1 = k0 + (rows.len() / c).div_ceil(2);
    let p = tile::<S>().min(cs);
    // Margins of a row: one smooth coefficient before and after, three details before and two after.
    let width = 2 * p + 7;
    let tiles: Vec<_> = (0..cs)
        .step_by(p)
        .map(|p0| {
            let p1 = (p0 + p).min(cs);
            let smooth = runs(p0 as isize - 1..p1 as isize + 1, |q| row.extension.smooth(c, q));
            let detail = runs(p0 as isize - 3..p1 as isize + 2, |q| row.extension.detail(c, q).0);
            (p0, p1, smooth, detail)
        })
        .collect();
    let mut columns = Columns::new(tiles.len() * width);
    let mut even: [Vec<S>; 4] = std::array::from_fn(|_| vec![S::default(); width]);
    let mut odd = even.clone();
    for k in (k0 as isize - 1..k1 as isize + 1).step_by(4) {
        let smooth_rows: [usize; 4] = std::array::from_fn(|i| col.extension.smooth(r, k + i as isize));
        let detail_rows: [usize; 7] =
            std::array::from_fn(|i| (rs + col.extension.detail(r, k - 2 + i as isize).0) * stride);
        for (t, (p0, p1, smooth_runs, detail_runs)) in tiles.iter().enumerate() {
            let ws = p1 - p0 + 2;
            let mut run = |bank: &Cubic<S>, place: usize, n: usize, smooth: [&[S]; 4], detail: [&[S]; 7]| {
                let out = Group {
                    first: even.each_mut().map(|r| &mut r[place..place + n]),
                    second: odd.each_mut().map(|r| &mut r[place..place + n]),
                };
                columns.down(bank, t * width + place, smooth, detail, out);
            };
            for &(place, at, n) in smooth_runs {
                let smooth = smooth_rows.map(|y| &coarse[y * cs + at..][..n]);
                run(&smooth_columns, place, n, smooth, detail_rows.map(|y| &details[y + at..][..n]));
            }
            for &(place, at, n) in detail_runs {
                let smooth = smooth_rows.map(|y| &details[y * stride + cs + at..][..n]);
                run(&detail_columns, ws + place, n, smooth, detail_rows.map(|y| &details[y + cs + at..][..n]));
            }
            for (i, (even, odd)) in even.iter().zip(&odd).enumerate() {
                let pair = k - 1 + i as isize;
                if pair < k0 as isize || pair >= k1 as isize {
                    continue;
                }
                for (y, from) in [(2 * pair as usize, even), (2 * pair as usize + 1, odd)] {
                    if y < r {
                        let to = &mut rows[(y - 2 * k0) * c..][2 * p0..(2 * p1).min(c)];
                        along_row.synthesize(&from[..ws], &from[ws..], to);
                    }
                }
            }
        }
    }
}
