//! The same steps across rows: a rolling pass over a ring of rows, one read and one write.
//!
//! At time `t` the pair of rows `t` enters the ring; step `i` runs on pair `t - lag[i]`, where the lags are the least
//! that give every step the rows it would see if the steps ran one after the other; finished pairs leave.

use crate::coefficient::Scalar;
use crate::lifted::Program;
use crate::lifting::{Step, lift_rows, rotate};

/// Columns worked on at a time, so that the rows of one strip stay in the first cache.
const STRIP: usize = 1024;

/// Lags and ring sizes of one program.
pub(crate) struct Sweep<'a, S> {
    program: &'a Program<S>,
    out_shift: isize,
    lags: Vec<isize>,
    emit_lag: isize,
    depth: [usize; 2],
}

/// What a step touches at its position: `(odd, lowest offset, highest offset)`.
type Touch = (bool, isize, isize);

fn touches<S>(step: &Step<S>) -> (Vec<Touch>, Vec<Touch>) {
    match step {
        Step::Lift { odd, first, taps } => {
            let last = first + taps.len() as isize - 1;
            (vec![(*odd, 0, 0)], vec![(!odd, *first, last), (*odd, 0, 0)])
        }
        Step::Rotate { offset, .. } | Step::Unrotate { offset, .. } => {
            let both = vec![(false, 0, 0), (true, *offset, *offset)];
            (both.clone(), both)
        }
    }
}

impl<'a, S: Scalar> Sweep<'a, S> {
    /// Plans the pass. `out_shift`: the odd row that leaves with even row `k` is `k + out_shift`.
    pub(crate) fn new(program: &'a Program<S>, out_shift: isize) -> Sweep<'a, S> {
        let steps: Vec<_> = program.scheme.steps.iter().map(touches).collect();
        let mut lags: Vec<isize> = Vec::new();
        for (i, (writes, reads)) in steps.iter().enumerate() {
            // Rows enter at lag 0.
            let mut lag = reads.iter().map(|r| r.2).max().unwrap_or(0).max(0);
            for (p, (earlier_writes, earlier_reads)) in steps[..i].iter().enumerate() {
                for w in earlier_writes {
                    for r in reads.iter().filter(|r| r.0 == w.0) {
                        lag = lag.max(lags[p] + r.2 - w.1);
                    }
                }
                for r in earlier_reads {
                    for w in writes.iter().filter(|w| w.0 == r.0) {
                        lag = lag.max(lags[p] + w.1 - r.1);
                    }
                }
            }
            lags.push(lag);
        }
        let mut emit_lag = out_shift.max(0);
        for ((writes, _), lag) in steps.iter().zip(&lags) {
            for w in writes {
                let leaves = if w.0 { out_shift } else { 0 };
                emit_lag = emit_lag.max(lag + leaves - w.1);
            }
        }
        let mut depth = [emit_lag, emit_lag - out_shift];
        for ((_, reads), lag) in steps.iter().zip(&lags) {
            for r in reads {
                let d = &mut depth[usize::from(r.0)];
                *d = (*d).max(lag - r.1);
            }
        }
        Sweep { program, out_shift, lags, emit_lag, depth: depth.map(|d| d as usize + 1) }
    }

    /// Runs pairs `k0..k1` of rows of width `width`.
    ///
    /// `fetch(odd, k, row)` writes the even or odd row at position `k` (which may lie outside the array);
    /// `emit(k, even, odd)` receives the finished rows in order.
    pub(crate) fn run(
        &self,
        k0: usize,
        k1: usize,
        width: usize,
        rings: &mut Rings<S>,
        mut fetch: impl FnMut(bool, isize, &mut [S]),
        mut emit: impl FnMut(usize, &[S], &[S]),
    ) {
        let needs = &self.program.needs;
        let (a, b) = (k0 as isize, k1 as isize);
        let [even, odd] = &mut rings.0;
        let mut even = Ring::new(even, self.depth[0], width);
        let mut odd = Ring::new(odd, self.depth[1], width);
        for t in a + needs.even.lo.min(needs.odd.lo)..b + self.emit_lag {
            if (a + needs.even.lo..b + needs.even.hi).contains(&t) {
                fetch(false, t, even.row_mut(t));
            }
            if (a + needs.odd.lo..b + needs.odd.hi).contains(&t) {
                fetch(true, t, odd.row_mut(t));
            }
            for x0 in (0..width).step_by(STRIP) {
                let x = x0..(x0 + STRIP).min(width);
                for ((step, lag), reach) in self.program.scheme.steps.iter().zip(&self.lags).zip(&needs.steps) {
                    let k = t - lag;
                    if k < a + reach.lo || k >= b + reach.hi {
                        continue;
                    }
                    run_rows(step, &mut even, &mut odd, k, x.clone());
                }
            }
            let k = t - self.emit_lag;
            if (a..b).contains(&k) {
                emit(k as usize, even.row(k), odd.row(k + self.out_shift));
            }
        }
    }
}

fn run_rows<'a, S: Scalar>(
    step: &Step<S>,
    even: &mut Ring<'a, S>,
    odd: &mut Ring<'a, S>,
    k: isize,
    x: std::ops::Range<usize>,
) {
    match step {
        Step::Lift { odd: target_odd, first, taps } => {
            let (target, other) = if *target_odd { (odd, &*even) } else { (even, &*odd) };
            let target = &mut target.row_mut(k)[x.clone()];
            let row = |i: usize| &other.row(k + first + i as isize)[x.clone()];
            match taps.len() {
                1 => lift_rows(target, &[row(0)], taps),
                2 => lift_rows(target, &[row(0), row(1)], taps),
                4 => lift_rows(target, &[row(0), row(1), row(2), row(3)], taps),
                n => {
                    for i in 0..n {
                        lift_rows(target, &[row(i)], &taps[i..=i]);
                    }
                }
            }
        }
        Step::Rotate { t, offset } => {
            rotate(&mut even.row_mut(k)[x.clone()], &mut odd.row_mut(k + offset)[x], *t);
        }
        Step::Unrotate { t, offset } => {
            rotate(&mut even.row_mut(k)[x.clone()], &mut odd.row_mut(k + offset)[x], -*t);
        }
    }
}

/// Memory of the rings of even and odd rows.
#[derive(Debug, Default)]
pub(crate) struct Rings<S>([Vec<S>; 2]);

/// The last `depth` rows; rows are padded off power-of-two strides.
struct Ring<'a, S> {
    depth: isize,
    stride: usize,
    width: usize,
    data: &'a mut [S],
}

impl<'a, S: Scalar> Ring<'a, S> {
    fn new(memory: &'a mut Vec<S>, depth: usize, width: usize) -> Ring<'a, S> {
        let stride = width + 16;
        memory.clear();
        memory.resize(depth * stride, S::default());
        Ring { depth: depth as isize, stride, width, data: memory }
    }

    fn at(&self, k: isize) -> usize {
        k.rem_euclid(self.depth) as usize * self.stride
    }

    fn row(&self, k: isize) -> &[S] {
        &self.data[self.at(k)..][..self.width]
    }

    fn row_mut(&mut self, k: isize) -> &mut [S] {
        let at = self.at(k);
        &mut self.data[at..][..self.width]
    }
}
