//! The iteration of the thesis (7.2.4, 7.3): conjugate gradients or steepest descent on the squared saddle system
//! M^T M, in B-splines or in wavelets. Implicit: M is applied, never formed. For comparison; the square of M is what
//! makes it slow.

use super::cholesky::dot;
use super::correct::Correct;
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
    steepest: bool,
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

impl Squared {
    /// Takes the saddle system of a structure.
    pub(crate) fn new(
        h: Arc<Operator>,
        structure: Arc<Structure>,
        basis: Option<WaveletGreen>,
        steepest: bool,
        tolerance: f64,
        most: usize,
    ) -> Squared {
        let size = h.diagonal().into_iter().fold(0.0, f64::max);
        let l = vec![0.0; structure.rows()];
        // In wavelets of unit energy H has the size 1.
        let scale = if basis.is_some() { 10.0 } else { 10.0 * size };
        Squared {
            h,
            structure,
            basis,
            steepest,
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
        }
    }

    /// `out = M z`, M symmetric: unknowns in the basis, multipliers scaled.
    fn times(&mut self, z: &[f64], out: &mut Vec<f64>) {
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
        let beta = if self.steepest { 0.0 } else { self.gamma / old };
        self.p = p;
        self.p.iter_mut().zip(&s).for_each(|(p, s)| *p = s + beta * *p);
        self.s = s;
        self.q = q;
        self.iterations += 1;
        let done = stuck || dot(&self.r, &self.r) <= self.goal || self.iterations >= self.most;
        if done {
            self.publish();
        }
        done
    }

    fn correction(&self) -> (&[f64], &[f64]) {
        (&self.x, &self.l)
    }

    fn iterations(&self) -> usize {
        self.iterations
    }
}
