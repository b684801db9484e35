//! The functions that the oracle chooses from: products of scaling functions and wavelets of one level, of unit energy.

use crate::energy::{Classes, Energy, Operator, SpanClass};
use crate::solve::wavelet::{diagonals, pyramids};
use crate::system::Space;
use ondelette_wavelet::Sparse;

/// A function of the hierarchy: one column of the synthesis matrix an axis.
///
/// `rise` 0: a product of the coarsest B-splines (columns count them); `rise` r + 1: made of the B-splines of level
/// r + 1, columns of the step from level r, scaling functions first, at least one of the two a wavelet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Function {
    pub(crate) rise: u8,
    pub(crate) s: u32,
    pub(crate) t: u32,
}

/// One level of one axis. The axis that curves do not have is one function on one cell.
#[derive(Clone, Debug)]
pub(crate) struct AxisLevel {
    pub(crate) n: usize,
    pub(crate) spans: usize,
    /// B-splines alive on each span.
    pub(crate) alive: Vec<Vec<u32>>,
    pub(crate) classes: Vec<SpanClass>,
    pub(crate) class_of: Vec<usize>,
}

/// The step of one axis from a level to the next finer one.
#[derive(Clone, Debug)]
pub(crate) struct Rise {
    /// Columns below this are scaling functions, the others wavelets.
    pub(crate) smooth: usize,
    /// Fine B-splines by columns.
    pub(crate) rows: Sparse,
    pub(crate) columns: Sparse,
    /// Coarse spans that a column's support touches.
    pub(crate) cells: Vec<Vec<u32>>,
    /// The coarse span that a column sits on.
    pub(crate) centre: Vec<u32>,
    /// Columns that sit on a coarse span.
    pub(crate) seated: Vec<Vec<u32>>,
    /// Per column, energies of the derivatives.
    energies: [Vec<f64>; 4],
}

/// All levels of both axes.
#[derive(Clone, Debug)]
pub(crate) struct Hierarchy {
    /// Finest last.
    pub(crate) spaces: Vec<Space>,
    pub(crate) levels: Vec<[AxisLevel; 2]>,
    pub(crate) rises: Vec<[Rise; 2]>,
    /// Matrix of a cell by level and pair of classes, in B-splines alive on it (16, of curves 4).
    pub(crate) cells: Vec<Vec<Vec<f64>>>,
    terms: Vec<(usize, usize, f64)>,
}

impl AxisLevel {
    fn missing() -> AxisLevel {
        let mut class = SpanClass { to_differences: [[0.0; 4]; 4], energy: [[[0.0; 4]; 4]; 4] };
        (0..4).for_each(|i| class.to_differences[i][i] = 1.0);
        class.energy[0][0][0] = 1.0;
        AxisLevel { n: 1, spans: 1, alive: vec![vec![0]], classes: vec![class], class_of: vec![0] }
    }
}

impl Rise {
    fn new(rows: Sparse, smooth: usize, coarse: &AxisLevel, fine: &AxisLevel, energies: [Vec<f64>; 4]) -> Rise {
        let columns = rows.transposed();
        let mut spans: Vec<Vec<u32>> = vec![Vec::new(); fine.n];
        for (span, alive) in fine.alive.iter().enumerate() {
            alive.iter().for_each(|f| spans[*f as usize].push(span as u32));
        }
        // The axis that curves do not have is not halved.
        let halve = |span: u32| if coarse.spans == fine.spans { span } else { span / 2 };
        let mut cells = Vec::with_capacity(columns.rows());
        let mut centre = Vec::with_capacity(columns.rows());
        let mut seated = vec![Vec::new(); coarse.spans];
        for c in 0..columns.rows() {
            let column = columns.row(c);
            let mut under: Vec<u32> =
                column.iter().flat_map(|(f, _)| spans[*f].iter().map(|span| halve(*span))).collect();
            under.sort_unstable();
            under.dedup();
            let highest =
                column.iter().fold((0, 0.0), |m: (usize, f64), e| if e.1.abs() > m.1 { (e.0, e.1.abs()) } else { m });
            let near = &spans[highest.0];
            let seat = near.get(near.len() / 2).map_or(0, |span| halve(*span));
            seated[seat as usize].push(c as u32);
            cells.push(under);
            centre.push(seat);
        }
        Rise { smooth, rows, columns, cells, centre, seated, energies }
    }
}

impl Hierarchy {
    /// `None` where the axes have no common pyramid.
    pub(crate) fn new(space: &Space, energy: &Energy, h: &Operator) -> Option<Hierarchy> {
        let (mut spaces, pyramids) = pyramids(space)?;
        let diagonals = diagonals(&pyramids, h);
        spaces.reverse();
        let operators: Vec<Operator> = spaces.iter().map(|s| Operator::new(s, energy, None)).collect();
        let level = |operator: &Operator| -> [AxisLevel; 2] {
            let of = |line| {
                let Classes { classes, of, index } = Classes::new(line);
                let alive = index.iter().map(|i| i.iter().map(|i| *i as u32).collect()).collect();
                AxisLevel { n: line.n, spans: line.spans, alive, classes, class_of: of }
            };
            match &operator.lines[..] {
                [t] => [AxisLevel::missing(), of(t)],
                lines => [of(&lines[0]), of(&lines[lines.len() - 1])],
            }
        };
        let levels: Vec<[AxisLevel; 2]> = operators.iter().map(level).collect();
        let mut rises = Vec::new();
        for i in 0..spaces.len() - 1 {
            let of = |axis: usize, side: usize| {
                let rung = pyramids[axis].rung(i);
                let energies = std::array::from_fn(|a| {
                    let d = &diagonals[axis][a];
                    d.smooth[i].iter().chain(&d.detail[i]).copied().collect()
                });
                Rise::new(rung.synthesis(), rung.smooth(), &levels[i][side], &levels[i + 1][side], energies)
            };
            rises.push(if spaces[i].is_curve() {
                let none = || vec![0.0];
                let energies = [vec![1.0], none(), none(), none()];
                [Rise::new(Sparse::identity(1), 1, &levels[i][0], &levels[i + 1][0], energies), of(0, 1)]
            } else {
                [of(0, 0), of(1, 1)]
            });
        }
        let cells = levels.iter().zip(&operators).map(|([s, t], operator)| {
            let width = if s.n == 1 { 4 } else { 16 };
            let mut matrices = Vec::new();
            for a in &s.classes {
                for b in &t.classes {
                    let dense = crate::energy::CellMatrix::new(a, b, &operator.terms).dense();
                    matrices.push((0..width * width).map(|k| dense[k / width * 16 + k % width]).collect());
                }
            }
            matrices
        });
        let cells = cells.collect();
        let terms = operators.last()?.terms.clone();
        Some(Hierarchy { spaces, levels, rises, cells, terms })
    }

    /// The products of the coarsest B-splines: always active.
    pub(crate) fn coarsest(&self) -> impl Iterator<Item = Function> + '_ {
        let [s, t] = &self.levels[0];
        (0..s.n as u32).flat_map(|s| (0..t.n as u32).map(move |t| Function { rise: 0, s, t }))
    }

    /// Rows and columns of the functions of a rise (0: the coarsest B-splines).
    pub(crate) fn shape(&self, rise: usize) -> [usize; 2] {
        match rise.checked_sub(1) {
            None => [self.levels[0][0].n, self.levels[0][1].n],
            Some(r) => [self.rises[r][0].columns.rows(), self.rises[r][1].columns.rows()],
        }
    }

    /// 1 / square root of a function's energy; 1 for the coarsest B-splines.
    pub(crate) fn height(&self, f: Function) -> f64 {
        let Some(r) = usize::from(f.rise).checked_sub(1) else { return 1.0 };
        let [s, t] = &self.rises[r];
        let of = |&(p, q, c): &(usize, usize, f64)| c * s.energies[p][f.s as usize] * t.energies[q][f.t as usize];
        self.terms.iter().map(of).sum::<f64>().sqrt().recip()
    }

    /// True where both columns are scaling functions: no function of this rise.
    pub(crate) fn is_smooth(&self, r: usize, s: u32, t: u32) -> bool {
        (s as usize) < self.rises[r][0].smooth && (t as usize) < self.rises[r][1].smooth
    }
}
