//! The entries of the energy matrix, for factors and diagonals.

use super::cell::CellMatrix;
use super::line::Line;
use super::operator::{Kind, Operator};

impl Operator {
    /// All entries of the lower triangle (row >= column), each position possibly more than once.
    pub(crate) fn entries(&self, mut put: impl FnMut(usize, usize, f64)) {
        match &self.kind {
            Kind::Cells { s, t, matrices, factors } => {
                let dense: Vec<Vec<f64>> = matrices.iter().map(CellMatrix::dense).collect();
                self.each_cell(s, t, |cell, m, local| {
                    for (a, i) in local.iter().enumerate() {
                        for (b, j) in local.iter().enumerate() {
                            if i >= j {
                                put(*i, *j, factors[cell] * dense[m][a * 16 + b]);
                            }
                        }
                    }
                });
            }
            Kind::WeightedLine(_, h) => {
                for (r, row) in h.to_rows().into_iter().enumerate() {
                    row.into_iter().filter(|e| e.0 <= r).for_each(|(c, v)| put(r, c, v));
                }
            }
            Kind::Uniform if self.lines.len() == 1 => {
                for &(_, q, c) in &self.terms {
                    for (r, row) in self.lines[0].energy[q].to_rows().into_iter().enumerate() {
                        row.into_iter().filter(|e| e.0 <= r).for_each(|(k, v)| put(r, k, c * v));
                    }
                }
            }
            Kind::Uniform => {
                let width = self.shape[1];
                for &(p, q, c) in &self.terms {
                    let (s, t) = (self.lines[0].energy[p].to_rows(), self.lines[1].energy[q].to_rows());
                    for (i, si) in s.iter().enumerate() {
                        for (k, a) in si.iter().filter(|e| e.0 <= i) {
                            for (j, tj) in t.iter().enumerate() {
                                for (l, b) in tj {
                                    let (row, col) = (i * width + j, k * width + l);
                                    if row >= col {
                                        put(row, col, c * a * b);
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }

    /// The entries between some coefficients, each unordered pair once or in parts: `position` says what a coefficient
    /// is called, if it belongs to them.
    pub(crate) fn among(
        &self,
        some: &[u32],
        position: &dyn Fn(usize) -> Option<usize>,
        put: &mut dyn FnMut(usize, usize, f64),
    ) {
        let (Kind::Uniform, [s, t]) = (&self.kind, &self.lines[..]) else {
            self.entries(|r, c, v| {
                if let (Some(r), Some(c)) = (position(r), position(c)) {
                    put(r, c, v);
                }
            });
            return;
        };
        let width = self.shape[1];
        for &(p, q, c) in &self.terms {
            let (rows, columns) = (s.energy[p].to_rows(), t.energy[q].to_rows());
            for i in some.iter().map(|i| *i as usize) {
                let Some(r) = position(i) else { continue };
                for &(k, a) in &rows[i / width] {
                    for &(l, b) in &columns[i % width] {
                        let j = k * width + l;
                        if j <= i
                            && let Some(column) = position(j)
                        {
                            put(r, column, c * a * b);
                        }
                    }
                }
            }
        }
    }

    /// The diagonal of H.
    pub(crate) fn diagonal(&self) -> Vec<f64> {
        let mut out = vec![0.0; self.len()];
        if let (Kind::Uniform, [s, t]) = (&self.kind, &self.lines[..]) {
            let of = |line: &Line, a: usize| -> Vec<f64> {
                let rows = line.energy[a].to_rows();
                rows.iter().enumerate().map(|(r, row)| row.iter().filter(|e| e.0 == r).map(|e| e.1).sum()).collect()
            };
            for &(p, q, c) in &self.terms {
                let (ds, dt) = (of(s, p), of(t, q));
                for (row, a) in out.chunks_exact_mut(self.shape[1]).zip(&ds) {
                    row.iter_mut().zip(&dt).for_each(|(o, b)| *o += c * a * b);
                }
            }
        } else {
            self.entries(|r, c, v| {
                if r == c {
                    out[r] += v;
                }
            });
        }
        out
    }
}
