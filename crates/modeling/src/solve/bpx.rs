//! The multilevel preconditioner of Bramble, Pasciak and Xu: diagonals on every level, strips along open ends and the
//! coarsest level exactly.

use super::cholesky::{Cholesky, dot, start};
use super::edges::Edges;
use super::green::{Green, Inverse};
use super::transfer::Transfer;
use crate::constraint::Functional;
use crate::energy::{Energy, Operator, Stiffness};
use crate::system::Space;

/// P = sum over levels of `R D^-1 R^T`, with the coarsest level solved exactly.
#[derive(Clone, Debug)]
pub(crate) struct Bpx {
    /// Finest first.
    levels: Vec<Level>,
    transfers: Vec<Transfer>,
    coarsest: Space,
    coarse: Cholesky,
    residuals: Vec<Vec<f64>>,
    work: Vec<f64>,
    lift: Vec<f64>,
}

#[derive(Clone, Debug)]
struct Level {
    space: Space,
    /// Inverse diagonal; 0 where a strip takes over.
    inverse: Vec<f64>,
    edges: Edges,
}

/// Coefficients at which a level is the coarsest.
const FEW: usize = 25;

/// Coefficients of the coarsest level for which a dense factor is made.
pub(crate) const MOST: usize = 1040;

/// The coarsest level of a space: it has few coefficients, or spans that cannot be halved.
pub(crate) fn coarsest(space: &Space) -> Space {
    let mut now = space.clone();
    while let Some(coarser) = now.coarser().filter(|_| now.len() > FEW) {
        now = coarser;
    }
    now
}

impl Bpx {
    /// `None` where no coarse level is small enough for a dense factor.
    pub(crate) fn new(space: &Space, energy: &Energy, stiffness: Option<&Stiffness>, h: &Operator) -> Option<Bpx> {
        let mut levels = Vec::new();
        let mut transfers = Vec::new();
        let (mut now, mut map) = (space.clone(), stiffness.cloned());
        let mut operator = h.clone();
        while let Some(coarser) = now.coarser() {
            if now.len() <= FEW {
                break;
            }
            let mut inverse: Vec<f64> = operator.diagonal().into_iter().map(|d| 1.0 / d).collect();
            let edges = Edges::new(&now, &operator);
            edges.take_over(&mut inverse);
            levels.push(Level { space: now, inverse, edges });
            transfers.push(Transfer::new(&coarser));
            let cells: Vec<usize> = coarser.axes().iter().map(crate::axis::Axis::spans).collect();
            map = map.map(|m| m.coarser(if cells.len() == 2 { [cells[0], cells[1]] } else { [1, cells[0]] }));
            operator = Operator::new(&coarser, energy, map.as_ref());
            now = coarser;
        }
        if now.len() > MOST {
            return None;
        }
        let coarse = dense_factor(&operator, energy)?;
        let residuals = levels.iter().map(|l| vec![0.0; l.space.len()]).collect();
        Some(Bpx { levels, transfers, coarsest: now, coarse, residuals, work: Vec::new(), lift: Vec::new() })
    }
}

/// The factor of H with its null space made stiff.
pub(crate) fn dense_factor(h: &Operator, energy: &Energy) -> Option<Cholesky> {
    let n = h.len();
    let mut packed = vec![0.0; start(n)];
    h.entries(|r, c, v| packed[start(r) + c] += v);
    let size = (0..n).map(|i| packed[start(i) + i]).fold(0.0, f64::max);
    for z in h.null_space(energy.free_degree()) {
        let by = size / dot(&z, &z);
        for i in 0..n {
            for j in 0..=i {
                packed[start(i) + j] += by * z[i] * z[j];
            }
        }
    }
    Cholesky::new(&packed, n).ok()
}

impl Green for Bpx {
    fn apply(&mut self, r: &[f64], g: &mut [f64]) {
        let many = self.levels.len();
        for i in 0..many {
            let mut next =
                if i + 1 < many { std::mem::take(&mut self.residuals[i + 1]) } else { std::mem::take(&mut self.lift) };
            next.resize(if i + 1 < many { self.levels[i + 1].space.len() } else { self.coarsest.len() }, 0.0);
            let fine = if i == 0 { r } else { &self.residuals[i] };
            self.transfers[i].restrict(fine, &mut next, &mut self.work);
            if i + 1 < many {
                self.residuals[i + 1] = next;
            } else {
                self.lift = next;
            }
        }
        if many == 0 {
            g.copy_from_slice(r);
            self.coarse.forward(g);
            self.coarse.backward(g);
            return;
        }
        self.coarse.forward(&mut self.lift);
        self.coarse.backward(&mut self.lift);
        for i in (0..many).rev() {
            if i == 0 {
                self.transfers[0].refine(&self.lift, g, &mut self.work);
                for ((g, r), d) in g.iter_mut().zip(r).zip(&self.levels[0].inverse) {
                    *g += r * d;
                }
                self.levels[0].edges.add(r, g);
            } else {
                let mut out = std::mem::take(&mut self.residuals[i]);
                let mut fine = vec![0.0; out.len()];
                self.transfers[i].refine(&self.lift, &mut fine, &mut self.work);
                for ((f, r), d) in fine.iter_mut().zip(&out).zip(&self.levels[i].inverse) {
                    *f += r * d;
                }
                self.levels[i].edges.add(&out, &mut fine);
                std::mem::swap(&mut self.lift, &mut fine);
                out.truncate(self.levels[i].space.len());
                self.residuals[i] = out;
            }
        }
    }

    fn between(&mut self, functionals: &[Functional]) -> Vec<f64> {
        let m = functionals.len();
        let mut offset = 0;
        // Each functional in the frame of all levels: sorted places with values that already hold sqrt(D^-1).
        let mut sparse: Vec<Vec<(u32, f64)>> = vec![Vec::new(); m];
        for level in &self.levels {
            for (f, out) in functionals.iter().zip(&mut sparse) {
                for (i, v) in f.on(&level.space).entries().filter(|e| e.1 != 0.0 && level.inverse[e.0] != 0.0) {
                    out.push(((offset + i) as u32, v * level.inverse[i].sqrt()));
                }
            }
            offset += level.space.len();
        }
        let dense: Vec<Vec<f64>> = functionals
            .iter()
            .map(|f| {
                let mut a = vec![0.0; self.coarsest.len()];
                f.on(&self.coarsest).entries().for_each(|(i, v)| a[i] += v);
                self.coarse.forward(&mut a);
                a
            })
            .collect();
        let mut place = vec![0.0; offset];
        let mut out = Vec::with_capacity(start(m));
        for i in 0..m {
            sparse[i].iter().for_each(|&(at, v)| place[at as usize] += v);
            for j in 0..=i {
                let near: f64 = sparse[j].iter().map(|&(at, v)| v * place[at as usize]).sum();
                out.push(near + dot(&dense[i], &dense[j]));
            }
            sparse[i].iter().for_each(|&(at, _)| place[at as usize] = 0.0);
        }
        for level in &self.levels {
            if !level.edges.is_empty() {
                let there: Vec<Functional> = functionals.iter().map(|f| f.on(&level.space)).collect();
                level.edges.between(&there, &mut out);
            }
        }
        out
    }

    fn inverse(&self) -> Inverse {
        if self.levels.is_empty() { Inverse::Exact } else { Inverse::Approximate }
    }
}
