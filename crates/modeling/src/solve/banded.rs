//! The direct solver of curves: a banded factor of H with the rows' own squares added, and a dense one of the
//! multipliers.
//!
//! Rows of one coordinate and one place lie inside the band of H. With rho times their squares added (soft rows: their
//! weight) H has no null space, the matrix of the multipliers is close to 1 / rho, and near neighbours do no harm.
//! Periodic curves have three border unknowns.

use super::cholesky::{Cholesky, dot, start};
use super::correct::Correct;
use super::green::{Green, Inverse};
use crate::constraint::Functional;
use crate::energy::Operator;
use crate::system::Structure;
use std::sync::Arc;

const BAND: usize = 3;

/// Rows that see less than this share of a shape apart from others do not see it.
const UNSEEN: f64 = 1e-13;

/// A Cholesky factor of a matrix of half bandwidth 3, cyclic or not.
#[derive(Clone, Debug)]
pub(crate) struct BandFactor {
    /// Unknowns of the band; the others are the border.
    n: usize,
    /// Row i: entries of columns i - 3 .. i, then the inverse pivot.
    rows: Vec<[f64; 4]>,
    /// Rows of the border in the band's factor.
    border: Vec<Vec<f64>>,
    corner: Cholesky,
}

impl BandFactor {
    /// Factors a matrix given by the lower triangle; `None` where it is not positive definite.
    pub(crate) fn new(size: usize, cyclic: bool, entries: &[(usize, usize, f64)]) -> Option<BandFactor> {
        // Short cyclic axes are all border.
        let edge = if !cyclic {
            0
        } else if size > 2 * BAND + 2 {
            BAND
        } else {
            size
        };
        let n = size - edge;
        let mut rows = vec![[0.0; 4]; n];
        let mut border = vec![vec![0.0; n]; edge];
        let mut corner = vec![0.0; start(edge)];
        for &(r, c, v) in entries {
            match (r < n, c < n) {
                (true, true) => rows[r][c + BAND - r] += v,
                (false, true) => border[r - n][c] += v,
                _ => corner[start(r - n) + c - n] += v,
            }
        }
        let scale = rows.iter().fold(0.0, |m: f64, r| m.max(r[3]));
        for i in 0..n {
            for j in i.saturating_sub(BAND)..=i {
                let mut sum = rows[i][j + BAND - i];
                for k in i.saturating_sub(BAND).max(j.saturating_sub(BAND))..j {
                    sum -= rows[i][k + BAND - i] * rows[j][k + BAND - j];
                }
                if j < i {
                    rows[i][j + BAND - i] = sum * rows[j][3];
                } else {
                    if sum <= 1e-15 * scale || sum.is_nan() {
                        return None;
                    }
                    rows[i][3] = 1.0 / sum.sqrt();
                }
            }
        }
        let mut out = BandFactor { n, rows, border: Vec::new(), corner: Cholesky::default() };
        for b in &mut border {
            out.forward_band(b, 1);
        }
        for i in 0..edge {
            for j in 0..=i {
                corner[start(i) + j] -= dot(&border[i], &border[j]);
            }
        }
        out.corner = Cholesky::new(&corner, edge).ok()?;
        out.border = border;
        Some(out)
    }

    fn forward_band(&self, x: &mut [f64], width: usize) {
        for i in 0..self.n {
            let row = &self.rows[i];
            let (before, now) = x.split_at_mut(i * width);
            let now = &mut now[..width];
            for j in i.saturating_sub(BAND)..i {
                let l = row[j + BAND - i];
                let from = &before[j * width..][..width];
                now.iter_mut().zip(from).for_each(|(x, f)| *x -= l * f);
            }
            now.iter_mut().for_each(|x| *x *= row[3]);
        }
    }

    /// `x = L^-1 x` for `width` right-hand sides, row by row.
    pub(crate) fn forward(&self, x: &mut [f64], width: usize) {
        self.forward_band(x, width);
        let edge = self.border.len();
        if edge == 0 {
            return;
        }
        let (band, tail) = x.split_at_mut(self.n * width);
        for w in 0..width {
            let mut rest: Vec<f64> = (0..edge).map(|i| tail[i * width + w]).collect();
            for (r, b) in rest.iter_mut().zip(&self.border) {
                *r -= b.iter().enumerate().map(|(i, b)| b * band[i * width + w]).sum::<f64>();
            }
            self.corner.forward(&mut rest);
            rest.iter().enumerate().for_each(|(i, r)| tail[i * width + w] = *r);
        }
    }

    /// `x = L^-T x`.
    pub(crate) fn backward(&self, x: &mut [f64]) {
        let (band, tail) = x.split_at_mut(self.n);
        self.corner.backward(tail);
        for (b, t) in self.border.iter().zip(&*tail) {
            band.iter_mut().zip(b).for_each(|(x, b)| *x -= b * t);
        }
        for i in (0..self.n).rev() {
            let row = &self.rows[i];
            band[i] *= row[3];
            let v = band[i];
            for j in i.saturating_sub(BAND)..i {
                band[j] -= row[j + BAND - i] * v;
            }
        }
    }
}

/// H alone, with its null space held at a few coefficients: an exact inverse for any rows.
#[derive(Clone, Debug)]
pub(crate) struct BandGreen {
    factor: BandFactor,
}

impl BandGreen {
    /// `None` for surfaces.
    pub(crate) fn new(h: &Operator, free: usize) -> Option<BandGreen> {
        let [line] = &h.lines[..] else { return None };
        let cyclic = line.boundary == ondelette_wavelet::Boundary::Periodic;
        let mut entries = Vec::new();
        h.entries(|r, c, v| entries.push((r, c, v)));
        let size = entries.iter().filter(|e| e.0 == e.1).fold(0.0, |m: f64, e| m.max(e.2));
        let null = h.null_space(free).len();
        for i in 0..null {
            let at = if null > 1 { i * (line.n - 1) / (null - 1) } else { 0 };
            entries.push((at, at, size));
        }
        BandFactor::new(line.n, cyclic, &entries).map(|factor| BandGreen { factor })
    }
}

impl Green for BandGreen {
    fn apply(&mut self, r: &[f64], g: &mut [f64]) {
        g.copy_from_slice(r);
        self.factor.forward(g, 1);
        self.factor.backward(g);
    }

    fn between(&mut self, functionals: &[Functional]) -> Vec<f64> {
        let size = self.factor.n + self.factor.border.len();
        let columns: Vec<Vec<f64>> = functionals
            .iter()
            .map(|f| {
                let mut a = vec![0.0; size];
                f.entries().for_each(|(i, v)| a[i] += v);
                self.factor.forward(&mut a, 1);
                a
            })
            .collect();
        let mut out = Vec::with_capacity(start(functionals.len()));
        for (i, a) in columns.iter().enumerate() {
            out.extend(columns[..=i].iter().map(|b| dot(a, b)));
        }
        out
    }

    fn inverse(&self) -> Inverse {
        Inverse::Exact
    }
}

/// True where the rows of one coordinate see all of the null space: what they see of its shapes, made orthogonal, is
/// more than rounding. (A factor would not tell: its last pivots are rounding, above zero or below.)
fn holds(structure: &Structure, null: Vec<Vec<f64>>) -> bool {
    let mut seen: Vec<Vec<f64>> = Vec::new();
    null.iter().all(|z| {
        let mut y = structure.sight(0, z);
        let size = dot(&y, &y).sqrt();
        for _ in 0..2 {
            for q in &seen {
                let by = dot(q, &y);
                y.iter_mut().zip(q).for_each(|(y, q)| *y -= by * q);
            }
        }
        let rest = dot(&y, &y).sqrt();
        y.iter_mut().for_each(|y| *y /= rest);
        seen.push(y);
        rest > UNSEEN * size
    })
}

/// The solver of one coordinate whose rows each have one place.
pub(crate) struct Banded {
    structure: Arc<Structure>,
    factor: BandFactor,
    hard: Vec<usize>,
    rho: f64,
    /// L^-1 A^T of the hard rows, unknown by unknown.
    columns: Vec<f64>,
    multipliers: Cholesky,
    x: Vec<f64>,
    l: Vec<f64>,
}

impl Banded {
    /// `None` where rows couple places or coordinates, or leave part of the null space free; then [`BandGreen`] serves.
    pub(crate) fn new(h: &Operator, structure: Arc<Structure>, free: usize) -> Option<Banded> {
        let [line] = &h.lines[..] else { return None };
        if structure.k != 1 || !structure.is_separable() || !holds(&structure, h.null_space(free)) {
            return None;
        }
        let cyclic = line.boundary == ondelette_wavelet::Boundary::Periodic;
        let mut entries = Vec::new();
        h.entries(|r, c, v| entries.push((r, c, v)));
        let rho = entries.iter().filter(|e| e.0 == e.1).fold(0.0, |m: f64, e| m.max(e.2));
        let hard: Vec<usize> = (0..structure.rows()).filter(|r| structure.give[*r] == 0.0).collect();
        for r in 0..structure.rows() {
            let weight = if structure.give[r] > 0.0 { 1.0 / structure.give[r] } else { rho };
            let (columns, values) = structure.row(r);
            for (c, v) in columns.iter().zip(values) {
                for (d, w) in columns.iter().zip(values).filter(|e| e.0 <= c) {
                    entries.push((*c as usize, *d as usize, weight * v * w));
                }
            }
        }
        let factor = BandFactor::new(line.n, cyclic, &entries)?;
        let m = hard.len();
        let mut columns = vec![0.0; line.n * m];
        for (i, r) in hard.iter().enumerate() {
            let (index, values) = structure.row(*r);
            index.iter().zip(values).for_each(|(c, v)| columns[*c as usize * m + i] += v);
        }
        factor.forward(&mut columns, m);
        let mut square = vec![0.0; m * m];
        for row in columns.chunks_exact(m.max(1)) {
            for (i, v) in row.iter().enumerate() {
                if *v != 0.0 {
                    square[i * m..][..=i].iter_mut().zip(row).for_each(|(s, w)| *s += v * w);
                }
            }
        }
        let packed: Vec<f64> = (0..m).flat_map(|i| square[i * m..][..=i].to_vec()).collect();
        let multipliers = Cholesky::new(&packed, m).ok()?;
        Some(Banded {
            l: vec![0.0; structure.rows()],
            structure,
            factor,
            hard,
            rho,
            columns,
            multipliers,
            x: Vec::new(),
        })
    }
}

impl Correct for Banded {
    fn begin(&mut self, r1: &[f64], r2: &[f64]) {
        let m = self.hard.len();
        self.x.clear();
        self.x.extend_from_slice(r1);
        let forces: Vec<f64> =
            r2.iter().zip(&self.structure.give).map(|(r, g)| if *g > 0.0 { r / g } else { self.rho * r }).collect();
        self.structure.add_transposed(&forces, 1.0, &mut self.x);
        self.factor.forward(&mut self.x, 1);
        let mut v: Vec<f64> = self.hard.iter().map(|r| -r2[*r]).collect();
        for (x, row) in self.x.iter().zip(self.columns.chunks_exact(m.max(1))) {
            v.iter_mut().zip(row).for_each(|(v, c)| *v += x * c);
        }
        self.multipliers.forward(&mut v);
        self.multipliers.backward(&mut v);
        for (x, row) in self.x.iter_mut().zip(self.columns.chunks_exact(m.max(1))) {
            *x -= dot(row, &v);
        }
        self.factor.backward(&mut self.x);
        self.hard.iter().zip(&v).for_each(|(r, v)| self.l[*r] = *v);
        for r in 0..r2.len() {
            let g = self.structure.give[r];
            if g > 0.0 {
                self.l[r] = (self.structure.apply_row(r, &self.x) - r2[r]) / g;
            }
        }
    }

    fn step(&mut self) -> bool {
        true
    }

    fn correction(&self) -> (&[f64], &[f64]) {
        (&self.x, &self.l)
    }
}
