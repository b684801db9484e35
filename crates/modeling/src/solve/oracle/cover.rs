//! The minimal B-spline cover of a set of functions (thesis 7.6), and the energy on it.
//!
//! Cells of level r under a function of the next rise are split in four; what is not split is a leaf. B-splines of a
//! level are kept where they are alive on one of its cells, so that a shape is known, on every leaf, by the B-splines
//! of the leaf's level: those represented by finer ones everywhere drop out of the sums. Work and memory grow with the
//! number of leaves, not with the size of the finest level.

use super::hierarchy::{Function, Hierarchy};
use crate::energy::{Hessian, Scratch};
use std::sync::Arc;

/// Marks of full size, made once and left clean by whoever uses them.
#[derive(Debug)]
pub(crate) struct Marks {
    split: Vec<Vec<bool>>,
    place: Vec<Vec<u32>>,
}

const NONE: u32 = u32::MAX;

impl Marks {
    pub(crate) fn new(h: &Hierarchy) -> Marks {
        Marks {
            split: h.levels.iter().map(|[s, t]| vec![false; s.spans * t.spans]).collect(),
            place: h.levels.iter().map(|[s, t]| vec![NONE; s.n * t.n]).collect(),
        }
    }
}

/// Rows of entries, end to end.
#[derive(Clone, Debug)]
struct Entries {
    starts: Vec<u32>,
    at: Vec<u32>,
    values: Vec<f64>,
}

impl Entries {
    fn new() -> Entries {
        Entries { starts: vec![0], at: Vec::new(), values: Vec::new() }
    }

    fn end(&mut self) {
        self.starts.push(self.at.len() as u32);
    }

    fn rows(&self) -> impl Iterator<Item = impl Iterator<Item = (usize, f64)> + '_> + '_ {
        self.starts.windows(2).map(|w| {
            let range = w[0] as usize..w[1] as usize;
            self.at[range.clone()].iter().zip(&self.values[range]).map(|(i, v)| (*i as usize, *v))
        })
    }
}

#[derive(Clone, Debug)]
struct Level {
    /// Where this level's B-splines start among all.
    from: usize,
    /// Each of them by those of the level below; none on level 0.
    lift: Entries,
    /// The functions made of this level's B-splines (numbers), and of which.
    members: Vec<u32>,
    made_of: Entries,
    /// Matrix and B-splines of each leaf, `width` a leaf.
    kinds: Vec<u32>,
    leaves: Vec<u32>,
}

/// The cover of a list of functions, with the energy matrix between them.
#[derive(Clone, Debug)]
pub(crate) struct Cover {
    levels: Vec<Level>,
    functions: usize,
    splines: usize,
    width: usize,
    hierarchy: Arc<Hierarchy>,
}

impl Cover {
    /// The cover of functions, numbered in the order given.
    pub(crate) fn new(h: &Arc<Hierarchy>, functions: &[Function], marks: &mut Marks) -> Cover {
        let split = split_cells(h, functions, marks);
        let width = if h.spaces[0].is_curve() { 4 } else { 16 };
        let mut levels: Vec<Level> = Vec::with_capacity(h.levels.len());
        let mut lists: Vec<Vec<u32>> = Vec::with_capacity(h.levels.len());
        let mut from = 0;
        let mut members: Vec<Vec<u32>> = vec![Vec::new(); h.levels.len()];
        functions.iter().enumerate().for_each(|(i, f)| members[usize::from(f.rise)].push(i as u32));
        for (r, [s, t]) in h.levels.iter().enumerate() {
            let mut list: Vec<u32> = Vec::new();
            let (mut kinds, mut leaves) = (Vec::new(), Vec::new());
            let place = &mut marks.place[r];
            let is_split = &marks.split[r];
            let mut visit = |i: usize, j: usize| {
                let mut local = [0_u32; 16];
                for (a, row) in s.alive[i].iter().enumerate() {
                    for (b, column) in t.alive[j].iter().enumerate() {
                        let at = *row as usize * t.n + *column as usize;
                        if place[at] == NONE {
                            place[at] = list.len() as u32;
                            list.push(at as u32);
                        }
                        local[a * 4 + b] = place[at];
                    }
                }
                if !is_split[i * t.spans + j] {
                    kinds.push((s.class_of[i] * t.classes.len() + t.class_of[j]) as u32);
                    leaves.extend_from_slice(&local[..width]);
                }
            };
            if r == 0 {
                (0..s.spans).for_each(|i| (0..t.spans).for_each(|j| visit(i, j)));
            } else {
                let coarse = &h.levels[r - 1];
                let ways = if coarse[0].spans == s.spans { 1 } else { 2 };
                for cell in &split[r - 1] {
                    let (i, j) = (*cell as usize / coarse[1].spans, *cell as usize % coarse[1].spans);
                    for a in 0..ways {
                        (0..2).for_each(|b| visit(ways * i + a, 2 * j + b));
                    }
                }
            }
            let mut lift = Entries::new();
            if r > 0 {
                let [rs, rt] = &h.rises[r - 1];
                let below = h.levels[r - 1][1].n;
                for at in &list {
                    for &(a, v) in rs.rows.row(*at as usize / t.n).iter().filter(|e| e.0 < rs.smooth) {
                        for &(b, w) in rt.rows.row(*at as usize % t.n).iter().filter(|e| e.0 < rt.smooth) {
                            lift.at.push(marks.place[r - 1][a * below + b]);
                            lift.values.push(v * w);
                        }
                    }
                    lift.end();
                }
            }
            let mut made_of = Entries::new();
            for f in members[r].iter().map(|i| functions[*i as usize]) {
                match r.checked_sub(1) {
                    None => {
                        made_of.at.push(marks.place[0][f.s as usize * t.n + f.t as usize]);
                        made_of.values.push(1.0);
                    }
                    Some(below) => {
                        let height = h.height(f);
                        let [rs, rt] = &h.rises[below];
                        for &(a, v) in rs.columns.row(f.s as usize) {
                            for &(b, w) in rt.columns.row(f.t as usize) {
                                made_of.at.push(marks.place[r][a * t.n + b]);
                                made_of.values.push(height * v * w);
                            }
                        }
                    }
                }
                made_of.end();
            }
            let many = list.len();
            levels.push(Level { from, lift, members: std::mem::take(&mut members[r]), made_of, kinds, leaves });
            from += many;
            lists.push(list);
        }
        for (list, place) in lists.iter().zip(&mut marks.place) {
            list.iter().for_each(|at| place[*at as usize] = NONE);
        }
        for (list, flags) in split.iter().zip(&mut marks.split) {
            list.iter().for_each(|cell| flags[*cell as usize] = false);
        }
        Cover { levels, functions: functions.len(), splines: from, width, hierarchy: h.clone() }
    }

    /// B-splines of the cover that are alive on a leaf of their level.
    pub(crate) fn splines(&self) -> usize {
        let mut alive = 0;
        for (r, level) in self.levels.iter().enumerate() {
            let end = self.levels.get(r + 1).map_or(self.splines, |l| l.from);
            let mut seen = vec![false; end - level.from];
            level.leaves.iter().for_each(|i| seen[*i as usize] = true);
            alive += seen.iter().filter(|s| **s).count();
        }
        alive
    }
}

/// Lists of split cells by level; the marks are left set.
fn split_cells(h: &Hierarchy, functions: &[Function], marks: &mut Marks) -> Vec<Vec<u32>> {
    let mut split: Vec<Vec<u32>> = vec![Vec::new(); h.levels.len()];
    for f in functions.iter().filter(|f| f.rise > 0) {
        let r = usize::from(f.rise) - 1;
        let [s, t] = &h.rises[r];
        let across = h.levels[r][1].spans;
        for i in &s.cells[f.s as usize] {
            for j in &t.cells[f.t as usize] {
                let cell = *i as usize * across + *j as usize;
                if !marks.split[r][cell] {
                    marks.split[r][cell] = true;
                    split[r].push(cell as u32);
                }
            }
        }
    }
    // A cell is there only if its parent is split.
    for r in (1..h.levels.len()).rev() {
        let (fine, coarse) = (&h.levels[r], &h.levels[r - 1]);
        for k in 0..split[r].len() {
            let (i, j) = (split[r][k] as usize / fine[1].spans, split[r][k] as usize % fine[1].spans);
            let i = if fine[0].spans == coarse[0].spans { i } else { i / 2 };
            let parent = i * coarse[1].spans + j / 2;
            if !marks.split[r - 1][parent] {
                marks.split[r - 1][parent] = true;
                split[r - 1].push(parent as u32);
            }
        }
    }
    split.iter_mut().for_each(|list| list.sort_unstable());
    split
}

/// `y += M x` on the B-splines of the leaves.
fn by_leaves<const WIDTH: usize>(level: &Level, matrices: &[Vec<f64>], x: &[f64], y: &mut [f64]) {
    for (kind, leaf) in level.kinds.iter().zip(level.leaves.chunks_exact(WIDTH)) {
        let matrix = &matrices[*kind as usize];
        let mut sums = [0.0; WIDTH];
        // symmetric: columns are rows
        for (i, row) in leaf.iter().zip(matrix.chunks_exact(WIDTH)) {
            let v = x[*i as usize];
            for (s, m) in sums.iter_mut().zip(row) {
                *s += v * m;
            }
        }
        for (i, s) in leaf.iter().zip(sums) {
            y[*i as usize] += s;
        }
    }
}

impl Hessian for Cover {
    fn times(&self, x: &[f64], y: &mut [f64], scratch: &mut Scratch) {
        let (c, d) = scratch.pair(self.splines);
        c.fill(0.0);
        d.fill(0.0);
        for (r, level) in self.levels.iter().enumerate() {
            let (below, own) = c.split_at_mut(level.from);
            if r > 0 {
                let below = &below[self.levels[r - 1].from..];
                for (o, row) in own.iter_mut().zip(level.lift.rows()) {
                    *o = row.map(|(i, v)| v * below[i]).sum();
                }
            }
            for (member, row) in level.members.iter().zip(level.made_of.rows()) {
                let by = x[*member as usize];
                if by != 0.0 {
                    row.for_each(|(i, v)| own[i] += by * v);
                }
            }
            let d = &mut d[level.from..];
            match self.width {
                4 => by_leaves::<4>(level, &self.hierarchy.cells[r], own, d),
                _ => by_leaves::<16>(level, &self.hierarchy.cells[r], own, d),
            }
        }
        for (r, level) in self.levels.iter().enumerate().rev() {
            let (below, own) = d.split_at_mut(level.from);
            for (member, row) in level.members.iter().zip(level.made_of.rows()) {
                y[*member as usize] = row.map(|(i, v)| v * own[i]).sum();
            }
            if r > 0 {
                let below = &mut below[self.levels[r - 1].from..];
                for (o, row) in own.iter().zip(level.lift.rows()) {
                    row.for_each(|(i, v)| below[i] += v * o);
                }
            }
        }
    }

    fn trace(&self) -> f64 {
        self.functions as f64
    }

    fn is_surface(&self) -> bool {
        self.width == 16
    }
}
