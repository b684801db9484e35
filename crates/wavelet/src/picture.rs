//! One level of a picture, both axes in one pass.
//!
//! Rows are transformed on their way into the ring of the column sweep (towards finer: on their way out of it), so that
//! every level reads its input once and writes its output once. Bands of rows are independent tasks; the bank (4, 4)
//! has loops of its own for them.

use crate::axis::{BAND, gain_down, gains_up, half_at, put, run, weigh_in};
use crate::coefficient::Scalar;
use crate::cubic;
use crate::lifted::{Program, Scratch};
use crate::spare::Spare;
use crate::sweep::{Rings, Sweep};

/// Memory of one band.
#[derive(Debug, Default)]
pub(crate) struct Band<S> {
    scratch: Scratch<S>,
    rings: Rings<S>,
    cubic: cubic::Band<S>,
}

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
    spare: &Spare<Band<S>>,
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
        let mut band = spare.take();
        let Band { scratch, rings, cubic } = &mut *band;
        if let [Some(down_columns), Some(along_row)] = [col.cubic, row.cubic] {
            let banks = [down_columns, along_row];
            return cubic.up(banks, programs, src, k0..(k0 + BAND).min(rs), coarse, [top, bottom], stride);
        }
        let fetch = |odd: bool, k: isize, to: &mut [S]| {
            let p = col.extension.fine(r, 2 * k + isize::from(odd));
            let (s, d) = to.split_at_mut(cs);
            row.up(&src[p * c..][..c], s, d, scratch);
            weigh_in(col, col.extension.fine_ends(), p, r, to);
        };
        sweep.run(k0, (k0 + BAND).min(rs), c, rings, fetch, |k, e, o| {
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
    spare: &Spare<Band<S>>,
) {
    let [col, row] = programs;
    let (r, c) = (col.n, row.n);
    let (rs, rd, cs) = (r.div_ceil(2), r / 2, c.div_ceil(2));
    let sweep = Sweep::new(col, 0);
    let tasks = dst.chunks_mut(2 * BAND * c).enumerate().map(|(b, rows)| (b * BAND, rows)).collect();
    let work = |(k0, rows): (usize, &mut [S])| {
        let mut band = spare.take();
        let Band { scratch, rings, cubic } = &mut *band;
        if let [Some(down_columns), Some(along_row)] = [col.cubic, row.cubic] {
            return cubic.down([down_columns, along_row], programs, coarse, details, stride, k0, rows);
        }
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
        sweep.run(k0, k1, c, rings, fetch, |k, e, o| {
            for (p, from) in [(2 * k, e), (2 * k + 1, o)] {
                if p < r {
                    let to = &mut rows[(p - 2 * k0) * c..][..c];
                    row.down(&from[..cs], &from[cs..], to, scratch);
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
