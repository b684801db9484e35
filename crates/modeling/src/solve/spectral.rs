//! The direct solver of mirrored and periodic axes with uniform stiffness: H is diagonal in cosines and waves.
//!
//! Entries of the inverse between two functionals come from one table of the inverse's values at whole knots: the two
//! functions are shifts of one B-spline, so that only sums and differences of their places matter.

use super::cosine::{Buffers, Cosine, transpose};
use super::green::{Green, Inverse};
use crate::constraint::Functional;
use crate::energy::Operator;
use ondelette_wavelet::Boundary;

/// The inverse of H off its null space, by transforms.
#[derive(Clone, Debug)]
pub(crate) struct Spectral {
    shape: [usize; 2],
    /// One an axis, the last axis last.
    axes: Vec<Cosine>,
    boundary: Vec<(Boundary, usize)>,
    /// 1 / eigenvalue with all constants of the transforms, columns first (transposed grid); 0 in the null space.
    inverse: Vec<f64>,
    /// Values of the inverse, `stride` a row, three more on each side.
    table: Vec<f64>,
    stride: usize,
    work: Vec<f64>,
    buffers: Buffers,
}

/// The symbol of the Gram matrix of B-splines of degree `d` at an angle.
fn gram_symbol(d: usize, angle: f64) -> f64 {
    let c = |k: f64| (k * angle).cos();
    match d {
        0 => 1.0,
        1 => (2.0 + c(1.0)) / 3.0,
        2 => (33.0 + 26.0 * c(1.0) + c(2.0)) / 60.0,
        _ => (1208.0 + 1191.0 * c(1.0) + 120.0 * c(2.0) + c(3.0)) / 2520.0,
    }
}

/// The symbol of the energy of the a-th derivative.
fn symbol(a: usize, angle: f64) -> f64 {
    let s = (angle / 2.0).sin();
    (4.0 * s * s).powi(a as i32) * gram_symbol(3 - a, angle)
}

impl Spectral {
    /// `None` with an open axis or varying stiffness.
    pub(crate) fn new(h: &Operator) -> Option<Spectral> {
        if !h.is_uniform() || h.lines.iter().any(|l| l.boundary == Boundary::Open) {
            return None;
        }
        let boundary: Vec<(Boundary, usize)> = h.lines.iter().map(|l| (l.boundary, l.spans)).collect();
        let axes: Vec<Cosine> = boundary.iter().map(|b| Cosine::new(b.0, b.1)).collect();
        let shape = h.shape;
        let t = &axes[axes.len() - 1];
        let symbols = |axis: &Cosine, n: usize| -> Vec<[f64; 4]> {
            (0..n).map(|k| std::array::from_fn(|a| symbol(a, axis.angle(k)))).collect()
        };
        let in_t = symbols(t, shape[1]);
        let in_s = if axes.len() == 2 { symbols(&axes[0], shape[0]) } else { vec![[1.0, 0.0, 0.0, 0.0]] };
        let constant: f64 = axes.iter().map(|a| 1.0 / a.square()).product();
        let mut inverse = vec![0.0; shape[0] * shape[1]];
        for (l, b) in in_t.iter().enumerate() {
            for (k, a) in in_s.iter().enumerate() {
                let value: f64 = h.terms.iter().map(|&(p, q, c)| c * a[p] * b[q]).sum();
                if (k, l) != (0, 0) {
                    inverse[l * shape[0] + k] = constant / value;
                }
            }
        }
        let mut out = Spectral {
            shape,
            axes,
            boundary,
            inverse,
            table: Vec::new(),
            stride: 0,
            work: Vec::new(),
            buffers: Buffers::default(),
        };
        out.tabulate();
        Some(out)
    }

    /// The table: transforms of the inverse eigenvalues, continued evenly.
    fn tabulate(&mut self) {
        let [ns, nt] = self.shape;
        let mut g = self.inverse.clone();
        // For the values at differences alone each mirrored axis counts half (sum and difference share a mode).
        let mirrored = self.boundary.iter().filter(|b| b.0 == Boundary::Mirrored).count() as i32;
        g.iter_mut().for_each(|v| *v *= 0.5_f64.powi(mirrored));
        let mut rows = vec![0.0; g.len()];
        if let [s, _] = &self.axes[..] {
            s.rows(&mut g, &mut self.buffers);
        }
        transpose(&g, nt, &mut rows);
        self.axes[self.axes.len() - 1].rows(&mut rows, &mut self.buffers);
        let reach = |axis: usize| self.boundary[axis].1;
        let fold = |d: isize, axis: usize| -> usize {
            let (b, spans) = self.boundary[axis];
            let n = spans as isize;
            let d = d.abs();
            match b {
                Boundary::Mirrored => {
                    let d = d % (2 * n);
                    d.min(2 * n - d) as usize
                }
                _ => (d % n) as usize,
            }
        };
        let last = self.axes.len() - 1;
        let height = if last == 1 { reach(0) + 7 } else { 1 };
        self.stride = reach(last) + 8;
        let mut table = vec![0.0; height * self.stride];
        for (i, row) in table.chunks_exact_mut(self.stride).enumerate() {
            let from = if last == 1 { fold(i as isize - 3, 0) } else { 0 };
            for (j, v) in row.iter_mut().enumerate().take(reach(last) + 7) {
                *v = rows[from * nt + fold(j as isize - 3, last)];
            }
        }
        debug_assert_eq!(rows.len(), ns * nt);
        self.table = table;
    }

    /// Place of a functional on the continued line: first tap's knot, and the four values.
    fn place(&self, f: &Functional, axis: usize) -> (isize, [f64; 4]) {
        let side = if self.axes.len() == 2 { axis } else { 1 };
        (f.first(side), f.taps[side].values)
    }
}

/// Seven factors around a place of the table, folded into the axis; the eighth is 0.
type Window = (usize, [f64; 8]);

fn windows(a: (isize, [f64; 4]), b: (isize, [f64; 4]), axis: (Boundary, usize), out: &mut [Window; 2]) -> usize {
    let n = axis.1 as isize;
    let mut difference = [0.0; 8];
    let mut sum = [0.0; 8];
    for i in 0..4 {
        for k in 0..4 {
            difference[3 + i - k] += a.1[i] * b.1[k];
            sum[i + k] += a.1[i] * b.1[k];
        }
    }
    // The inverse is even around 0, and around n on mirrored axes; differences never pass n.
    let folded = |mut centre: isize, mut v: [f64; 8]| -> Window {
        while centre < 0 || centre > n {
            centre = if centre < 0 { -centre } else { 2 * n - centre };
            v[..7].reverse();
        }
        (centre as usize, v)
    };
    out[0] = folded(a.0 - b.0, difference);
    if axis.0 == Boundary::Mirrored {
        out[1] = folded(a.0 + b.0 + 3, sum);
        2
    } else {
        1
    }
}

impl Green for Spectral {
    fn apply(&mut self, r: &[f64], g: &mut [f64]) {
        let [ns, nt] = self.shape;
        let t = &self.axes[self.axes.len() - 1];
        g.copy_from_slice(r);
        for row in g.chunks_exact_mut(nt) {
            row[0] *= t.ends(0);
            row[nt - 1] *= t.ends(nt - 1);
        }
        if let [s, t] = &self.axes[..] {
            for end in [0, ns - 1] {
                let by = s.ends(end);
                g[end * nt..][..nt].iter_mut().for_each(|v| *v *= by);
            }
            self.work.resize(g.len(), 0.0);
            t.rows(g, &mut self.buffers);
            transpose(g, ns, &mut self.work);
            s.rows(&mut self.work, &mut self.buffers);
            self.work.iter_mut().zip(&self.inverse).for_each(|(v, i)| *v *= i);
            s.rows(&mut self.work, &mut self.buffers);
            transpose(&self.work, nt, g);
            t.rows(g, &mut self.buffers);
        } else {
            t.rows(g, &mut self.buffers);
            g.iter_mut().zip(&self.inverse).for_each(|(v, i)| *v *= i);
            t.rows(g, &mut self.buffers);
        }
    }

    fn between(&mut self, functionals: &[Functional]) -> Vec<f64> {
        let m = functionals.len();
        let last = self.axes.len() - 1;
        let places: Vec<[(isize, [f64; 4]); 2]> =
            functionals.iter().map(|f| [self.place(f, 0), self.place(f, last)]).collect();
        let mut out = Vec::with_capacity(m * (m + 1) / 2);
        let mut in_s: [Window; 2] = [(0, [0.0; 8]); 2];
        let mut in_t = in_s;
        for (i, a) in places.iter().enumerate() {
            for b in &places[..=i] {
                let many_t = windows(a[1], b[1], self.boundary[last], &mut in_t);
                let mut acc = [0.0; 8];
                if last == 0 {
                    for w in &in_t[..many_t] {
                        fused(&self.table[w.0..w.0 + 8], 1.0, &w.1, &mut acc);
                    }
                } else {
                    let many_s = windows(a[0], b[0], self.boundary[0], &mut in_s);
                    for u in &in_s[..many_s] {
                        for w in &in_t[..many_t] {
                            let mut sums = [0.0; 8];
                            for (k, by) in u.1[..7].iter().enumerate() {
                                let row = &self.table[(u.0 + k) * self.stride + w.0..][..8];
                                for l in 0..8 {
                                    sums[l] += by * row[l];
                                }
                            }
                            fused(&sums, 1.0, &w.1, &mut acc);
                        }
                    }
                }
                out.push(((acc[0] + acc[1]) + (acc[2] + acc[3])) + ((acc[4] + acc[5]) + acc[6]));
            }
        }
        out
    }

    fn inverse(&self) -> Inverse {
        Inverse::Exact
    }
}

fn fused(row: &[f64], by: f64, factors: &[f64; 8], acc: &mut [f64; 8]) {
    for l in 0..8 {
        acc[l] += by * row[l] * factors[l];
    }
}
