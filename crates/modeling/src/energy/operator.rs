//! The matrix H of an energy on a space, applied without being formed.

use super::cell::{CellMatrix, Classes};
use super::line::Line;
use super::stencil::Stencil;
use super::twofold::{self, Twofold};
use super::{Energy, Stiffness};
use crate::system::Space;

/// H of E = x^T H x for one coordinate, in domain units.
#[derive(Clone, Debug)]
pub(crate) struct Operator {
    pub(crate) shape: [usize; 2],
    /// One line an axis.
    pub(crate) lines: Vec<Line>,
    /// `(p, q, c)`: c times the squared norm of the p-th derivative in s and q-th in t (curves: p = 0).
    pub(crate) terms: Vec<(usize, usize, f64)>,
    pub(super) kind: Kind,
}

#[derive(Clone, Debug)]
pub(super) enum Kind {
    Uniform,
    /// Curves: the energies multiplied out, and the weighted Gram matrices.
    WeightedLine(Vec<(usize, f64, Stencil)>, Stencil),
    /// Surfaces, cell by cell.
    Cells {
        s: Classes,
        t: Classes,
        matrices: Vec<CellMatrix>,
        factors: Vec<f64>,
    },
}

/// Buffers of [`Operator::apply`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Scratch {
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
}

impl Scratch {
    /// Two buffers of the given length, contents undefined.
    pub(crate) fn pair(&mut self, n: usize) -> (&mut [f64], &mut [f64]) {
        (sized(&mut self.a, n), sized(&mut self.b, n))
    }
}

fn sized(v: &mut Vec<f64>, n: usize) -> &mut [f64] {
    v.resize(n, 0.0);
    &mut v[..n]
}

impl Operator {
    pub(crate) fn new(space: &Space, energy: &Energy, stiffness: Option<&Stiffness>) -> Operator {
        let mut lines: Vec<Line> = Vec::with_capacity(2);
        for axis in space.axes() {
            // Axes alike share the work.
            let known = lines.iter().find(|l| (l.boundary, l.spans) == (axis.boundary(), axis.spans())).cloned();
            lines.push(known.unwrap_or_else(|| Line::new(axis)));
        }
        let weights = [energy.stretch, energy.bend, energy.variation];
        let mut terms = Vec::new();
        let density: Vec<f64> = space.axes().iter().map(crate::axis::Axis::density).collect();
        for (a, w) in weights.into_iter().enumerate().filter(|(_, w)| *w > 0.0) {
            let order = a as i32 + 1;
            if space.is_curve() {
                terms.push((0, a + 1, w * density[0].powi(2 * order - 1)));
                continue;
            }
            for (p, binomial) in
                [[1.0, 1.0, 0.0, 0.0], [1.0, 2.0, 1.0, 0.0], [1.0, 3.0, 3.0, 1.0]][a][..a + 2].iter().enumerate()
            {
                let q = a + 1 - p;
                let scale = density[0].powi(2 * p as i32 - 1) * density[1].powi(2 * q as i32 - 1);
                terms.push((p, q, w * binomial * scale));
            }
        }
        let stiffness = stiffness.filter(|s| !s.is_uniform());
        let kind = match stiffness {
            None => Kind::Uniform,
            Some(map) if space.is_curve() => {
                let line = &lines[0];
                let grams = terms.iter().map(|t| (t.1, t.2, line.weighted_gram(t.1, map.factors()))).collect();
                let mut rows = vec![Vec::new(); line.n];
                for t in &terms {
                    for (r, row) in line.weighted(t.1, map.factors()).to_rows().into_iter().enumerate() {
                        rows[r].extend(row.into_iter().map(|(c, v)| (c, t.2 * v)));
                    }
                }
                Kind::WeightedLine(grams, Stencil::new(line.n, rows))
            }
            Some(map) => {
                let (s, t) = (Classes::new(&lines[0]), Classes::new(&lines[1]));
                let mut matrices = Vec::new();
                for a in &s.classes {
                    for b in &t.classes {
                        matrices.push(CellMatrix::new(a, b, &terms));
                    }
                }
                Kind::Cells { s, t, matrices, factors: map.factors().to_vec() }
            }
        };
        Operator { shape: space.shape(), lines, terms, kind }
    }

    pub(crate) fn len(&self) -> usize {
        self.shape[0] * self.shape[1]
    }

    /// True where the stiffness is the same everywhere.
    pub(crate) fn is_uniform(&self) -> bool {
        matches!(self.kind, Kind::Uniform)
    }

    /// `y = H x`; of uniform surfaces by tables of entries, which is fast.
    pub(crate) fn apply(&self, x: &[f64], y: &mut [f64], scratch: &mut Scratch) {
        match &self.kind {
            Kind::Cells { .. } => self.by_cells(x, y),
            // Long curves need the differences.
            _ if self.lines.len() == 1 => self.apply_exactly(x, y, scratch),
            Kind::WeightedLine(..) => {}
            Kind::Uniform => {
                let (a, b) = (sized(&mut scratch.a, x.len()), sized(&mut scratch.b, x.len()));
                y.fill(0.0);
                for p in 0..4 {
                    let mut any = false;
                    for &(_, q, c) in self.terms.iter().filter(|t| t.0 == p) {
                        self.lines[1].energy[q].along(x, b);
                        if any {
                            a.iter_mut().zip(&*b).for_each(|(a, b)| *a += c * b);
                        } else {
                            a.iter_mut().zip(&*b).for_each(|(a, b)| *a = c * b);
                        }
                        any = true;
                    }
                    if any {
                        self.lines[0].energy[p].across(a, y, self.shape[1], false);
                    }
                }
            }
        }
    }

    /// `y = H x` by differences: the null space is exact.
    pub(crate) fn apply_exactly(&self, x: &[f64], y: &mut [f64], scratch: &mut Scratch) {
        match &self.kind {
            Kind::Cells { .. } => self.by_cells(x, y),
            Kind::WeightedLine(grams, _) => {
                y.fill(0.0);
                let line = &self.lines[0];
                for (q, c, gram) in grams {
                    let d = sized(&mut scratch.a, line.differences[*q].rows);
                    let e = sized(&mut scratch.b, line.differences[*q].rows);
                    line.differences[*q].along(x, d);
                    gram.along(d, e);
                    let out = sized(&mut scratch.c, y.len());
                    line.transposed[*q].along(e, out);
                    y.iter_mut().zip(&*out).for_each(|(y, o)| *y += c * o);
                }
            }
            Kind::Uniform => {
                y.fill(0.0);
                for &(p, q, c) in &self.terms {
                    self.differences(p, q, x, scratch);
                    // scratch.a holds D x; back through both Gram matrices and transposes
                    let t = &self.lines[self.lines.len() - 1];
                    let (m, n) = (t.differences[q].rows, self.shape[1]);
                    let rows = scratch.a.len() / m;
                    let b = sized(&mut scratch.b, rows * m);
                    t.gram[q].along(&scratch.a, b);
                    let a = sized(&mut scratch.a, rows * n);
                    t.transposed[q].along(b, a);
                    if let [s, _] = &self.lines[..] {
                        let b = sized(&mut scratch.b, rows * n);
                        s.gram[p].across(a, b, n, true);
                        let a = sized(&mut scratch.a, self.len());
                        s.transposed[p].across(b, a, n, true);
                    }
                    y.iter_mut().zip(&scratch.a).for_each(|(y, o)| *y += c * o);
                }
            }
        }
    }

    /// `H x` of a curve with twice the precision; `None` for surfaces.
    pub(crate) fn apply_twofold(&self, x: &[f64]) -> Option<Vec<Twofold>> {
        let [line] = &self.lines[..] else { return None };
        let x: Vec<Twofold> = x.iter().map(|x| (*x, 0.0)).collect();
        let mut out = vec![(0.0, 0.0); x.len()];
        for (i, &(_, q, c)) in self.terms.iter().enumerate() {
            let gram = match &self.kind {
                Kind::WeightedLine(grams, _) => &grams[i].2,
                _ => &line.gram[q],
            };
            let d = gram.along_twofold(&line.differences[q].along_twofold(&x));
            for (o, v) in out.iter_mut().zip(line.transposed[q].along_twofold(&d)) {
                *o = twofold::add(*o, twofold::scale(v, c));
            }
        }
        Some(out)
    }

    /// The differences of order (p, q) into `scratch.a`.
    fn differences(&self, p: usize, q: usize, x: &[f64], scratch: &mut Scratch) {
        let t = &self.lines[self.lines.len() - 1];
        let m = t.differences[q].rows;
        match &self.lines[..] {
            [s, _] => {
                let b = sized(&mut scratch.b, self.shape[0] * m);
                t.differences[q].along(x, b);
                let a = sized(&mut scratch.a, s.differences[p].rows * m);
                s.differences[p].across(b, a, m, true);
            }
            _ => t.differences[q].along(x, sized(&mut scratch.a, m)),
        }
    }

    /// x^T H x, from differences.
    pub(crate) fn energy(&self, x: &[f64]) -> f64 {
        let mut scratch = Scratch::default();
        match &self.kind {
            Kind::Cells { s, t, matrices, factors } => {
                let mut sum = 0.0;
                self.each_cell(s, t, |cell, m, local| sum += factors[cell] * matrices[m].energy(&gathered(x, local)));
                sum
            }
            Kind::WeightedLine(grams, _) => {
                let line = &self.lines[0];
                let mut sum = 0.0;
                for (q, c, gram) in grams {
                    let mut d = vec![0.0; line.differences[*q].rows];
                    let mut e = d.clone();
                    line.differences[*q].along(x, &mut d);
                    gram.along(&d, &mut e);
                    sum += c * d.iter().zip(&e).map(|(a, b)| a * b).sum::<f64>();
                }
                sum
            }
            Kind::Uniform => {
                let mut sum = 0.0;
                for &(p, q, c) in &self.terms {
                    self.differences(p, q, x, &mut scratch);
                    let t = &self.lines[self.lines.len() - 1];
                    let m = t.differences[q].rows;
                    let mut b = vec![0.0; scratch.a.len()];
                    t.gram[q].along(&scratch.a, &mut b);
                    if let [s, _] = &self.lines[..] {
                        let mut e = vec![0.0; b.len()];
                        s.gram[p].across(&b, &mut e, m, true);
                        b = e;
                    }
                    sum += c * b.iter().zip(&scratch.a).map(|(a, b)| a * b).sum::<f64>();
                }
                sum
            }
        }
    }

    pub(super) fn each_cell(&self, s: &Classes, t: &Classes, mut f: impl FnMut(usize, usize, &[usize; 16])) {
        let width = self.shape[1];
        let mut cell = 0;
        for (is, cs) in s.index.iter().zip(&s.of) {
            for (it, ct) in t.index.iter().zip(&t.of) {
                let local = std::array::from_fn(|k| is[k / 4] * width + it[k % 4]);
                f(cell, cs * t.classes.len() + ct, &local);
                cell += 1;
            }
        }
    }

    fn by_cells(&self, x: &[f64], y: &mut [f64]) {
        let Kind::Cells { s, t, matrices, factors } = &self.kind else { return };
        y.fill(0.0);
        self.each_cell(s, t, |cell, m, local| {
            let out = matrices[m].apply(&gathered(x, local));
            for (i, v) in local.iter().zip(out) {
                y[*i] += factors[cell] * v;
            }
        });
    }

    /// A basis of the functions that cost nothing, coefficient by coefficient: polynomials of total degree below
    /// `degree` that the boundaries allow.
    pub(crate) fn null_space(&self, degree: usize) -> Vec<Vec<f64>> {
        match &self.lines[..] {
            [t] => t.polynomials(degree),
            [s, t] => {
                let (ps, pt) = (s.polynomials(degree), t.polynomials(degree));
                let mut out = Vec::new();
                for (a, p) in ps.iter().enumerate() {
                    for q in pt.iter().take(degree - a) {
                        out.push(p.iter().flat_map(|x| q.iter().map(move |y| x * y)).collect());
                    }
                }
                out
            }
            _ => Vec::new(),
        }
    }
}

fn gathered(x: &[f64], local: &[usize; 16]) -> [f64; 16] {
    std::array::from_fn(|k| x[local[k]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::Axis;
    use ondelette_numerics::seed;
    use ondelette_wavelet::Boundary;

    fn noise(n: usize, key: u64) -> Vec<f64> {
        (0..n).map(|i| seed::unit(seed::combine(key, i as u64)) - 0.5).collect()
    }

    fn spaces() -> Vec<Space> {
        let axis = |b, n| Axis::new(b, n, [0.0, 2.5]).unwrap();
        let mut out: Vec<Space> = Vec::new();
        for b in [Boundary::Open, Boundary::Mirrored, Boundary::Periodic] {
            out.push(Space::curve(axis(b, 13)));
            for c in [Boundary::Open, Boundary::Mirrored, Boundary::Periodic] {
                out.push(Space::surface(axis(b, 6), axis(c, 9)));
            }
        }
        out
    }

    #[test]
    fn all_forms_of_the_operator_agree_with_the_integral() {
        let energy = Energy::new(0.7, 0.4, 0.3).unwrap();
        for space in spaces() {
            // A map of ones but for rounding takes the weighted path.
            let map = Stiffness::new(space.cells(), vec![1.0 + 1e-15; space.cells()]).unwrap();
            let x = noise(space.len(), 7);
            let want = quadrature(&space, &energy, &x);
            for operator in [Operator::new(&space, &energy, None), Operator::new(&space, &energy, Some(&map))] {
                let mut s = Scratch::default();
                let (mut fast, mut exact) = (vec![0.0; x.len()], vec![0.0; x.len()]);
                operator.apply(&x, &mut fast, &mut s);
                operator.apply_exactly(&x, &mut exact, &mut s);
                let mut listed = vec![0.0; x.len()];
                operator.entries(|r, c, v| {
                    listed[r] += v * x[c];
                    if r != c {
                        listed[c] += v * x[r];
                    }
                });
                let size = fast.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
                for i in 0..x.len() {
                    assert!((fast[i] - exact[i]).abs() < 1e-12 * size && (fast[i] - listed[i]).abs() < 1e-12 * size);
                }
                let xhx: f64 = x.iter().zip(&exact).map(|(a, b)| a * b).sum();
                assert!((operator.energy(&x) / want - 1.0).abs() < 1e-12 && (xhx / want - 1.0).abs() < 1e-12);
            }
        }
    }

    /// The integral by Gauss rules from basis values.
    fn quadrature(space: &Space, energy: &Energy, x: &[f64]) -> f64 {
        let (nodes, weights) = ondelette_numerics::gauss::rule(4);
        let axes = space.axes();
        let points = |a: &Axis| -> Vec<(f64, f64)> {
            let h = 1.0 / a.density();
            (0..a.spans())
                .flat_map(|i| nodes.iter().zip(&weights).map(move |(x, w)| (i as f64 + x, w * h)).collect::<Vec<_>>())
                .map(|(u, w)| (a.from_knots(u), w))
                .collect()
        };
        let mut sum = 0.0;
        let w = [energy.stretch, energy.bend, energy.variation];
        if let [t] = axes {
            for (p, wp) in points(t) {
                for a in 0..3 {
                    sum += w[a] * wp * crate::basis::taps(t, p, a + 1).apply(x).powi(2);
                }
            }
            return sum;
        }
        let n = axes[1].len();
        for (ps, ws) in points(&axes[0]) {
            for (pt, wt) in points(&axes[1]) {
                let d = |p: usize, q: usize| -> f64 {
                    let (s, t) = (crate::basis::taps(&axes[0], ps, p), crate::basis::taps(&axes[1], pt, q));
                    s.iter().map(|(i, v)| v * t.apply(&x[i * n..][..n])).sum()
                };
                let e1 = d(1, 0).powi(2) + d(0, 1).powi(2);
                let e2 = d(2, 0).powi(2) + 2.0 * d(1, 1).powi(2) + d(0, 2).powi(2);
                let e3 = d(3, 0).powi(2) + 3.0 * d(2, 1).powi(2) + 3.0 * d(1, 2).powi(2) + d(0, 3).powi(2);
                sum += ws * wt * (w[0] * e1 + w[1] * e2 + w[2] * e3);
            }
        }
        sum
    }

    #[test]
    fn null_spaces_cost_nothing_with_any_stiffness() {
        for space in spaces() {
            let map = Stiffness::new(space.cells(), noise(space.cells(), 3).iter().map(|x| x + 0.6).collect()).unwrap();
            for energy in [
                Energy::new(1.0, 1.0, 0.0).unwrap(),
                Energy::BEND,
                Energy::new(0.0, 1.0, 2.0).unwrap(),
                Energy::new(0.0, 0.0, 1.0).unwrap(),
            ] {
                for stiffness in [None, Some(&map)] {
                    let operator = Operator::new(&space, &energy, stiffness);
                    for z in operator.null_space(energy.free_degree()) {
                        assert!(operator.energy(&z) < 1e-24, "{space:?} {energy:?}");
                    }
                }
            }
        }
    }
}
