//! A band of rows of a picture for the bank (4, 4), both axes in one pass.

use std::ops::Range;

use super::{Columns, Cubic, Group, Row};
use crate::coefficient::Scalar;
use crate::lifted::Program;

/// Memory of one band: what columns keep, eight rows at work, rows that nobody asked for, and the scratch of a row.
#[derive(Debug, Default)]
pub(crate) struct Band<S> {
    columns: Columns<S>,
    rows: [Vec<S>; 8],
    nowhere: [[Vec<S>; 4]; 4],
    scratch: Vec<S>,
}

/// Makes rows at least `len` long.
pub(super) fn widen<'a, S: Scalar>(rows: impl Iterator<Item = &'a mut Vec<S>>, len: usize) {
    rows.filter(|r| r.len() < len).for_each(|r| r.resize(len, S::default()));
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

impl<S: Scalar> Band<S> {
    /// Analysis of both axes: smooth rows `band` and the detail rows of the same pairs.
    pub(crate) fn up(
        &mut self,
        [down_columns, along_row]: [Cubic<S>; 2],
        [col, row]: [&Program<S>; 2],
        src: &[S],
        band: Range<usize>,
        coarse: &mut [S],
        [top, bottom]: [&mut [S]; 2],
        stride: usize,
    ) {
        // Columns multiply by the gains of both axes.
        let [smooth_columns, detail_columns] = along_row.gains().map(|g| down_columns.amplified(g));
        let along_row = Row::<S, false>::up(&along_row);
        let (r, c) = (col.n, row.n);
        let (cs, cd, rd) = (c.div_ceil(2), c / 2, r / 2);
        let details = band.start..band.end.min(rd);
        let p = tile::<S>().min(cs);
        let Band { columns, rows: raw, nowhere, scratch } = self;
        columns.widen(2 * cs);
        widen(raw.iter_mut(), 2 * p);
        widen(nowhere.iter_mut().flatten(), p);
        let mut load = |y: isize, p0: usize, (ws, wd): (usize, usize), to: &mut [S]| {
            let x = &src[col.extension.fine(r, y) * c..][..c];
            let (s, d) = to[..ws + wd].split_at_mut(ws);
            along_row.analyze(x, p0, (s, d), scratch, |q| row.extension.fine(c, q));
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
                let [n0, n1, n2, n3] = &mut *nowhere;
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

    /// Synthesis of both axes: `dst` from pair `k0` on.
    pub(crate) fn down(
        &mut self,
        [down_columns, along_row]: [Cubic<S>; 2],
        [col, row]: [&Program<S>; 2],
        coarse: &[S],
        details: &[S],
        stride: usize,
        k0: usize,
        dst: &mut [S],
    ) {
        let [smooth_columns, detail_columns] = along_row.gains().map(|g| down_columns.amplified(g));
        let along_row = Row::<S, false>::down(&along_row);
        let (r, c) = (col.n, row.n);
        let (rs, cs) = (r.div_ceil(2), c.div_ceil(2));
        let k1 = k0 + (dst.len() / c).div_ceil(2);
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
        let Band { columns, rows: pairs, .. } = self;
        columns.widen(tiles.len() * width);
        widen(pairs.iter_mut(), width);
        for k in (k0 as isize - 1..k1 as isize + 1).step_by(4) {
            let smooth_rows: [usize; 4] = std::array::from_fn(|i| col.extension.smooth(r, k + i as isize));
            let detail_rows: [usize; 7] =
                std::array::from_fn(|i| (rs + col.extension.detail(r, k - 2 + i as isize).0) * stride);
            for (t, (p0, p1, smooth_runs, detail_runs)) in tiles.iter().enumerate() {
                let ws = p1 - p0 + 2;
                let mut run = |bank: &Cubic<S>, place: usize, n: usize, smooth: [&[S]; 4], detail: [&[S]; 7]| {
                    let [e0, o0, e1, o1, e2, o2, e3, o3] = pairs.each_mut().map(|r| &mut r[place..place + n]);
                    let out = Group { first: [e0, e1, e2, e3], second: [o0, o1, o2, o3] };
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
                for (i, from) in pairs.iter().enumerate() {
                    let y = 2 * (k - 1 - k0 as isize) + i as isize;
                    let Some(to) = usize::try_from(y).ok().and_then(|y| dst.get_mut(y * c..(y + 1) * c)) else {
                        continue;
                    };
                    along_row.synthesize(&from[..ws], &from[ws..], &mut to[2 * p0..(2 * p1).min(c)]);
                }
            }
        }
    }
}
