//! Which functions may wake, and which may go to sleep.

use super::Oracle;
use super::hierarchy::Function;
use std::collections::{BTreeMap, BTreeSet};

/// Active functions whose squared coefficient is this share of the allowed energy, divided by their number, have
/// children and neighbours.
const COUNTS: f64 = 0.05;
/// How often a function may be put to sleep.
const SLEEPS: u8 = 2;
/// Functions that a round wakes for an unmet row.
const NEARBY: usize = 4;

impl Oracle {
    /// Functions that may wake: near active ones whose squared coefficients count, on the same level and the next.
    pub(super) fn candidates(&self, squares: &[f64], allowed: f64) -> Vec<Function> {
        let h = &self.active.hierarchy;
        let enough = COUNTS * allowed / squares.len() as f64;
        // Seats (coarse cells) by rise.
        let mut seats: Vec<BTreeSet<(u32, u32)>> = vec![BTreeSet::new(); h.rises.len()];
        let around = |level: usize, side: usize, seat: u32| -> std::ops::RangeInclusive<u32> {
            let last = h.levels[level][side].spans as u32 - 1;
            seat.saturating_sub(1)..=(seat + 1).min(last)
        };
        for (f, square) in self.active.functions.iter().zip(squares) {
            let Some(r) = usize::from(f.rise).checked_sub(1) else { continue };
            if *square < enough {
                continue;
            }
            let (i, j) = (h.rises[r][0].centre[f.s as usize], h.rises[r][1].centre[f.t as usize]);
            for a in around(r, 0, i) {
                seats[r].extend(around(r, 1, j).map(|b| (a, b)));
            }
            if let Some(finer) = seats.get_mut(r + 1) {
                let halves = if h.levels[r + 1][0].spans > h.levels[r][0].spans { 2 } else { 1 };
                for a in 0..halves {
                    finer.extend((0..2).map(|b| (halves * i + a, 2 * j + b)));
                }
            }
        }
        let [s, t] = &h.levels[0];
        seats[0].extend((0..s.spans as u32).flat_map(|a| (0..t.spans as u32).map(move |b| (a, b))));
        let mut out = Vec::new();
        for (r, seats) in seats.iter().enumerate() {
            let [rs, rt] = &h.rises[r];
            for (a, b) in seats {
                for i in &rs.seated[*a as usize] {
                    for j in rt.seated[*b as usize].iter().filter(|j| !h.is_smooth(r, *i, **j)) {
                        let f = Function { rise: r as u8 + 1, s: *i, t: *j };
                        if !self.active.is_active(f) && !self.asleep.get(&f).is_some_and(|s| s.1) {
                            out.push(f);
                        }
                    }
                }
            }
        }
        out
    }

    /// Active functions that hardly count and have not been put to sleep too often.
    pub(super) fn negligible(&self, squares: &[f64], allowed: f64) -> Vec<Function> {
        let (corner, few) = (self.active.corner(), allowed / squares.len() as f64);
        let all = self.active.functions.iter().zip(squares).skip(corner);
        let small = all.filter(|(f, square)| **square < few && self.asleep.get(f).is_none_or(|s| s.0 < SLEEPS));
        small.map(|(f, _)| *f).collect()
    }

    /// The inactive functions that see the unmet constraints best, a few a row.
    pub(super) fn nearby(&self) -> Vec<Function> {
        let h = &self.active.hierarchy;
        let mut out = BTreeSet::new();
        for part in &self.active.parts {
            for row in &part.left_out {
                let mut seen: BTreeMap<Function, f64> = BTreeMap::new();
                for &(_, f, by) in &part.structure.terms[*row] {
                    for (f, v) in part.seen[f].all(h).filter(|e| !self.active.is_active(e.0)) {
                        *seen.entry(f).or_default() += (by * v * h.height(f)).powi(2);
                    }
                }
                let mut seen: Vec<(Function, f64)> = seen.into_iter().filter(|e| e.1 > 0.0).collect();
                seen.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
                out.extend(seen.into_iter().take(NEARBY).map(|e| e.0));
            }
        }
        out.into_iter().collect()
    }
}
