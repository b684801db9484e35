//! What the functionals of the constraints see of the functions of a hierarchy.

use super::hierarchy::{Function, Hierarchy};
use crate::constraint::Functional;
use crate::solve::cholesky::{Cholesky, dot, start};
use crate::solve::green::{Green, Inverse};
use crate::system::merged;
use std::sync::Arc;

/// Numbers of the functions in use, by rise and columns; the others have none.
#[derive(Debug)]
pub(crate) struct Numbers(Vec<Vec<u32>>, Vec<usize>);

const NONE: u32 = u32::MAX;

impl Numbers {
    pub(crate) fn new(h: &Hierarchy) -> Numbers {
        let shapes: Vec<[usize; 2]> = (0..h.levels.len()).map(|rise| h.shape(rise)).collect();
        Numbers(shapes.iter().map(|s| vec![NONE; s[0] * s[1]]).collect(), shapes.iter().map(|s| s[1]).collect())
    }

    fn at(&self, f: Function) -> usize {
        f.s as usize * self.1[usize::from(f.rise)] + f.t as usize
    }

    pub(crate) fn get(&self, f: Function) -> Option<u32> {
        let n = self.0[usize::from(f.rise)][self.at(f)];
        (n != NONE).then_some(n)
    }

    /// Numbers functions in order, from `from`.
    pub(crate) fn set(&mut self, functions: &[Function], from: usize) {
        for (i, f) in functions.iter().enumerate() {
            let at = self.at(*f);
            self.0[usize::from(f.rise)][at] = (from + i) as u32;
        }
    }

    pub(crate) fn clear(&mut self, functions: &[Function]) {
        for f in functions {
            let at = self.at(*f);
            self.0[usize::from(f.rise)][at] = NONE;
        }
    }
}

/// A functional on the columns of each rise and axis.
#[derive(Clone, Debug)]
pub(crate) struct Seen(Vec<[Vec<(u32, f64)>; 2]>);

impl Seen {
    pub(crate) fn new(h: &Hierarchy, f: &Functional) -> Seen {
        let mut out = Vec::with_capacity(h.levels.len());
        for (level, space) in h.spaces.iter().enumerate() {
            let there = f.on(space);
            out.push(std::array::from_fn(|side| {
                let taps = there.taps[side].iter().filter(|e| e.1 != 0.0);
                merged(match level.checked_sub(1) {
                    None => taps.map(|(i, v)| (i as u32, v)).collect(),
                    Some(r) => {
                        let rows = &h.rises[r][side].rows;
                        taps.flat_map(|(i, v)| rows.row(i).iter().map(move |&(c, s)| (c as u32, v * s))).collect()
                    }
                })
            }));
        }
        Seen(out)
    }

    /// Every function that is not zero at the functional, with its value.
    pub(crate) fn all<'a>(&'a self, h: &'a Hierarchy) -> impl Iterator<Item = (Function, f64)> + 'a {
        self.0.iter().enumerate().flat_map(move |(rise, [s, t])| {
            s.iter().flat_map(move |&(i, v)| {
                t.iter()
                    .filter(move |(j, _)| rise == 0 || !h.is_smooth(rise - 1, i, *j))
                    .map(move |&(j, w)| (Function { rise: rise as u8, s: i, t: j }, v * w))
            })
        })
    }

    /// The sum of the squared values of functions without a number.
    pub(crate) fn missing(&self, h: &Hierarchy, numbers: &Numbers) -> f64 {
        let inactive = self.all(h).filter(|e| numbers.get(e.0).is_none());
        inactive.map(|(f, v)| (v * h.height(f)).powi(2)).sum()
    }

    /// The values on numbered functions, by number.
    pub(crate) fn on(&self, h: &Hierarchy, numbers: &Numbers) -> Vec<(u32, f64)> {
        let known = |(f, v): (Function, f64)| numbers.get(f).map(|n| (n, v * h.height(f)));
        let mut out: Vec<(u32, f64)> = self.all(h).filter_map(known).collect();
        out.sort_unstable_by_key(|e| e.0);
        out
    }
}

/// The preconditioner of the active functions: of unit energy each, the coarsest B-splines exactly.
pub(crate) struct ActiveGreen {
    pub(crate) coarse: Arc<Cholesky>,
    /// The functionals of the structure, in its order, on the active functions.
    pub(crate) lists: Vec<Vec<(u32, f64)>>,
}

impl Green for ActiveGreen {
    fn apply(&mut self, r: &[f64], g: &mut [f64]) {
        g.copy_from_slice(r);
        let corner = &mut g[..self.coarse.len()];
        self.coarse.forward(corner);
        self.coarse.backward(corner);
    }

    fn between(&mut self, functionals: &[Functional]) -> Vec<f64> {
        let corner = self.coarse.len();
        let size = self.lists.iter().flatten().map(|e| e.0 as usize + 1).max().unwrap_or(0);
        let dense: Vec<Vec<f64>> = self
            .lists
            .iter()
            .map(|list| {
                let mut a = vec![0.0; corner];
                list.iter().filter(|e| (e.0 as usize) < corner).for_each(|e| a[e.0 as usize] = e.1);
                self.coarse.forward(&mut a);
                a
            })
            .collect();
        let mut place = vec![0.0; size];
        let fine = |i: usize| self.lists[i].iter().filter(move |e| e.0 as usize >= corner);
        let mut out = Vec::with_capacity(start(functionals.len()));
        for i in 0..functionals.len() {
            fine(i).for_each(|e| place[e.0 as usize] = e.1);
            for j in 0..=i {
                let near: f64 = fine(j).map(|e| e.1 * place[e.0 as usize]).sum();
                out.push(near + dot(&dense[i], &dense[j]));
            }
            fine(i).for_each(|e| place[e.0 as usize] = 0.0);
        }
        out
    }

    fn inverse(&self) -> Inverse {
        Inverse::Approximate
    }
}
