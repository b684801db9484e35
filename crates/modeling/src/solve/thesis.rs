//! The iterations of the thesis (7.2.1, 7.3, 7.4.1): conjugate gradients, steepest descent or Gauss-Seidel on the
//! squared saddle system M^T M, in B-splines or in wavelets. Implicit: M is applied by transforms and stencils;
//! explicit: its entries are formed. For comparison; the square of M is what makes it slow.

use super::cholesky::dot;
use super::correct::Correct;
use super::method::Iteration;
use super::wavelet::WaveletGreen;
use crate::energy::{Operator, Scratch};
use crate::system::Structure;
use std::sync::Arc;

/// The solver of one structure.
pub(crate) struct Squared {
    h: Arc<Operator>,
    structure: Arc<Structure>,
    /// Wavelets, if they are the unknowns.
    basis: Option<WaveletGreen>,
    iteration: Iteration,
    /// The columns of M with their squared lengths, where they are formed.
    columns: Option<Vec<Column>>,
    /// What rows are multiplied by, against H: the thesis does not state it.
    scale: f64,
    tolerance: f64,
    most: usize,
    z: Vec<f64>,
    r: Vec<f64>,
    s: Vec<f64>,
    p: Vec<f64>,
    q: Vec<f64>,
    gamma: f64,
    goal: f64,
    iterations: usize,
    x: Vec<f64>,
    l: Vec<f64>,
    scratch: Scratch,
}

/// Entries of a column of M, and the sum of their squares.
struct Column {
    entries: Vec<(u32, f64)>,
    square: f64,
}

/// Unknowns for which M is formed at most: in wavelets it has up to their square of entries.
const EXPLICIT: usize = 5000;

impl Squared {
    /// Takes the saddle system of a structure; `how` iterates, and on a formed matrix or not. `None` where the matrix
    /// would be too large to form.
    pub(crate) fn new(
        h: Arc<Operator>,
        structure: Arc<Structure>,
        basis: Option<WaveletGreen>,
        how: (Iteration, bool),
        tolerance: f64,
        most: usize,
    ) -> Option<Squared> {
        let explicit = how.1 || how.0 == Iteration::GaussSeidel;
        let all = structure.unknowns() + structure.rows();
        if explicit && all > EXPLICIT {
            return None;
        }
        let size = h.diagonal().into_iter().fold(0.0, f64::max);
        let l = vec![0.0; structure.rows()];
        // In wavelets of unit energy H has the size 1.
        let scale = if basis.is_some() { 10.0 } else { 10.0 * size };
        let mut out = Squared {
            h,
            structure,
            basis,
            iteration: how.0,
            columns: None,
            scale,
            tolerance,
            most,
            z: Vec::new(),
            r: Vec::new(),
            s: Vec::new(),
            p: Vec::new(),
            q: Vec::new(),
            gamma: 0.0,
            goal: 0.0,
            iterations: 0,
            x: Vec::new(),
            l,
            scratch: Scratch::default(),
        };
        if explicit {
            let mut unit = vec![0.0; all];
            let mut column = Vec::new();
            let mut columns = Vec::with_capacity(all);
            for i in 0..all {
                unit[i] = 1.0;
                out.times(&unit, &mut column);
                unit[i] = 0.0;
                // Transforms leave rounding where functions do not meet.
                let least = 1e-15 * column.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
                let entries = column.iter().enumerate().filter(|e| e.1.abs() > least);
                columns.push(Column {
                    entries: entries.map(|(r, v)| (r as u32, *v)).collect(),
                    square: dot(&column, &column),
                });
            }
            out.columns = Some(columns);
        }
        Some(out)
    }

    /// `out = M z`, M symmetric: unknowns in the basis, multipliers scaled.
    fn times(&mut self, z: &[f64], out: &mut Vec<f64>) {
        if let Some(columns) = &self.columns {
            out.clear();
            out.resize(z.len(), 0.0);
            for (column, z) in columns.iter().zip(z).filter(|c| *c.1 != 0.0) {
                column.entries.iter().for_each(|(r, v)| out[*r as usize] += z * v);
            }
            return;
        }
        let (n, all) = (self.structure.n, self.structure.unknowns());
        let (w, l) = z.split_at(all);
        let x = self.to_splines(w);
        let mut y = vec![0.0; all];
        for (x, y) in x.chunks_exact(n).zip(y.chunks_exact_mut(n)) {
            self.h.apply(x, y, &mut self.scratch);
        }
        self.structure.add_transposed(l, self.scale, &mut y);
        let y = self.out_of_splines(&y);
        out.clear();
        out.extend(y);
        for (r, l) in l.iter().enumerate() {
            let soft = self.structure.give[r] * self.scale * self.scale * l;
            out.push(self.scale * self.structure.apply_row(r, &x) - soft);
        }
    }

    fn to_splines(&self, w: &[f64]) -> Vec<f64> {
        match &self.basis {
            Some(b) => w.chunks_exact(self.structure.n).flat_map(|w| b.synthesis(w)).collect(),
            None => w.to_vec(),
        }
    }

    fn out_of_splines(&self, y: &[f64]) -> Vec<f64> {
        match &self.basis {
            Some(b) => y.chunks_exact(self.structure.n).flat_map(|y| b.synthesis_transposed(y)).collect(),
            None => y.to_vec(),
        }
    }

    /// A sweep of Gauss-Seidel on M^T M: each unknown in turn makes the residual orthogonal to its column.
    fn sweep(&mut self) -> bool {
        for (column, z) in self.columns.iter().flatten().zip(&mut self.z).filter(|c| c.0.square > 0.0) {
            let product: f64 = column.entries.iter().map(|(r, v)| v * self.r[*r as usize]).sum();
            let by = product / column.square;
            *z += by;
            column.entries.iter().for_each(|(r, v)| self.r[*r as usize] -= by * v);
        }
        self.iterations += 1;
        self.ended(false)
    }

    fn ended(&mut self, stuck: bool) -> bool {
        let done = stuck || dot(&self.r, &self.r) <= self.goal || self.iterations >= self.most;
        if done {
            self.publish();
        }
        done
    }

    fn publish(&mut self) {
        let all = self.structure.unknowns();
        self.x = self.to_splines(&self.z[..all]);
        self.l = self.z[all..].iter().map(|l| l * self.scale).collect();
    }
}

impl Correct for Squared {
    fn begin(&mut self, r1: &[f64], r2: &[f64]) {
        self.r = self.out_of_splines(r1);
        self.r.extend(r2.iter().map(|r| r * self.scale));
        self.z = vec![0.0; self.r.len()];
        let r = std::mem::take(&mut self.r);
        let mut s = std::mem::take(&mut self.s);
        self.times(&r, &mut s);
        self.r = r;
        self.gamma = dot(&s, &s);
        self.goal = dot(&self.r, &self.r) * self.tolerance * self.tolerance;
        self.p.clone_from(&s);
        self.s = s;
        self.iterations = 0;
    }

    fn step(&mut self) -> bool {
        if self.iteration == Iteration::GaussSeidel {
            return self.sweep();
        }
        let p = std::mem::take(&mut self.p);
        let mut q = std::mem::take(&mut self.q);
        self.times(&p, &mut q);
        let curvature = dot(&q, &q);
        let stuck = curvature <= 0.0 || curvature.is_nan() || self.gamma == 0.0;
        if !stuck {
            let alpha = self.gamma / curvature;
            self.z.iter_mut().zip(&p).for_each(|(z, p)| *z += alpha * p);
            self.r.iter_mut().zip(&q).for_each(|(r, q)| *r -= alpha * q);
        }
        let r = std::mem::take(&mut self.r);
        let mut s = std::mem::take(&mut self.s);
        self.times(&r, &mut s);
        self.r = r;
        let old = self.gamma;
        self.gamma = dot(&s, &s);
        let beta = if self.iteration == Iteration::SteepestDescent { 0.0 } else { self.gamma / old };
        self.p = p;
        self.p.iter_mut().zip(&s).for_each(|(p, s)| *p = s + beta * *p);
        self.s = s;
        self.q = q;
        self.iterations += 1;
        self.ended(stuck)
    }

    fn correction(&self) -> (&[f64], &[f64]) {
        (&self.x, &self.l)
    }

    fn iterations(&self) -> usize {
        self.iterations
    }
}
