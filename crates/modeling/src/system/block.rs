//! Blocks of coordinates that no row couples, as sparse rows.

use super::dependence::{Dependence, dependent};
use super::{Problem, ProblemError};
use crate::constraint::{Functional, Row};
use std::collections::BTreeMap;

/// What blocks with the same rows share: everything but the targets.
#[derive(Clone, Debug)]
pub(crate) struct Structure {
    /// Coefficients of one coordinate.
    pub(crate) n: usize,
    /// Coordinates of the block; unknowns are stacked, coordinate by coordinate.
    pub(crate) k: usize,
    /// Different functionals of all rows.
    pub(crate) functionals: Vec<Functional>,
    /// Per row: `(coordinate, functional, factor)`.
    pub(crate) terms: Vec<Vec<(usize, usize, f64)>>,
    /// 1 / weight of soft rows, 0 of hard ones.
    pub(crate) give: Vec<f64>,
    /// Lengths of the rows before they were divided.
    pub(crate) lengths: Vec<f64>,
    starts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

/// A right-hand side of a structure.
#[derive(Clone, Debug)]
pub(crate) struct Side {
    /// Coordinates of the problem that the block's stand for.
    pub(crate) coordinates: Vec<usize>,
    /// Constraint of each row.
    pub(crate) constraints: Vec<usize>,
    pub(crate) targets: Vec<f64>,
}

/// Coordinates with the same structure.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    pub(crate) structure: Structure,
    pub(crate) sides: Vec<Side>,
}

/// Sums that ought to cancel leave less than this share of what is summed.
const CANCELLED: f64 = 1e-14;

/// What a row sees of a shape of no energy, an entry of `A Z`: nothing where that is only the rounding of a sum of
/// terms of this size. (Slopes and images do not see constants; solvers scale up what is small everywhere.)
pub(crate) fn sight(value: f64, size: f64) -> f64 {
    if value.abs() <= CANCELLED * size { 0.0 } else { value }
}

impl Structure {
    fn new(n: usize, k: usize, rows: &[Row], local: &dyn Fn(usize) -> usize) -> Structure {
        let mut out = Structure {
            n,
            k,
            functionals: Vec::new(),
            terms: Vec::new(),
            give: rows.iter().map(|r| r.give).collect(),
            lengths: rows.iter().map(|r| r.length).collect(),
            starts: vec![0],
            columns: Vec::new(),
            values: Vec::new(),
        };
        let mut known = std::collections::BTreeMap::new();
        for row in rows {
            let mut terms = Vec::with_capacity(row.terms.len());
            for t in &row.terms {
                let f = &t.functional;
                let key = (f.at.map(f64::to_bits), f.derivative);
                let at = *known.entry(key).or_insert_with(|| {
                    out.functionals.push(f.clone());
                    out.functionals.len() - 1
                });
                terms.push((local(t.coordinate), at, t.factor));
            }
            out.push(merged(row.entries().map(|(c, i, v)| ((local(c) * n + i) as u32, v)).collect()));
            out.terms.push(terms);
        }
        out
    }

    fn push(&mut self, entries: Vec<(u32, f64)>) {
        let entries = entries.into_iter().filter(|e| e.1 != 0.0);
        for (column, value) in entries {
            self.columns.push(column);
            self.values.push(value);
        }
        self.starts.push(self.columns.len());
    }

    /// The rows `kept` over `n` other unknowns a coordinate, on which the functionals have the values of `lists`.
    pub(crate) fn over(&self, n: usize, lists: &[Vec<(u32, f64)>], kept: &[usize]) -> Structure {
        let of = |all: &[f64]| kept.iter().map(|r| all[*r]).collect();
        let mut out = Structure {
            n,
            k: self.k,
            functionals: self.functionals.clone(),
            terms: kept.iter().map(|r| self.terms[*r].clone()).collect(),
            give: of(&self.give),
            lengths: of(&self.lengths),
            starts: vec![0],
            columns: Vec::new(),
            values: Vec::new(),
        };
        for r in kept {
            let part =
                |&(c, f, by): &(usize, usize, f64)| lists[f].iter().map(move |(i, v)| ((c * n) as u32 + i, by * v));
            out.push(merged(self.terms[*r].iter().flat_map(part).collect()));
        }
        out
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.terms.len()
    }

    /// Number of unknowns.
    pub(crate) fn unknowns(&self) -> usize {
        self.n * self.k
    }

    /// Entries of a row: columns and values.
    pub(crate) fn row(&self, r: usize) -> (&[u32], &[f64]) {
        let range = self.starts[r]..self.starts[r + 1];
        (&self.columns[range.clone()], &self.values[range])
    }

    /// `A x` of one row.
    pub(crate) fn apply_row(&self, r: usize, x: &[f64]) -> f64 {
        let (columns, values) = self.row(r);
        columns.iter().zip(values).map(|(c, v)| v * x[*c as usize]).sum()
    }

    /// The sum of the entries' sizes of one row and coordinate, before any cancel.
    pub(crate) fn size(&self, r: usize, c: usize) -> f64 {
        let own = self.terms[r].iter().filter(|t| t.0 == c);
        own.map(|(_, f, by)| self.functionals[*f].entries().map(|(_, v)| (by * v).abs()).sum::<f64>()).sum()
    }

    /// What each row sees of a shape of no energy in coordinate `c`: a column of `A Z`, see [`sight`].
    pub(crate) fn sight(&self, c: usize, shape: &[f64]) -> Vec<f64> {
        let most = shape.iter().fold(0.0, |m: f64, z| m.max(z.abs()));
        let of = |r: usize| {
            let own = self.terms[r].iter().filter(|t| t.0 == c);
            let value: f64 = own.map(|t| t.2 * self.functionals[t.1].apply(shape)).sum();
            sight(value, self.size(r, c) * most)
        };
        (0..self.rows()).map(of).collect()
    }

    /// `y = A x`.
    pub(crate) fn apply(&self, x: &[f64], y: &mut [f64]) {
        for (r, y) in y.iter_mut().enumerate() {
            *y = self.apply_row(r, x);
        }
    }

    /// `x += by A^T y`.
    pub(crate) fn add_transposed(&self, y: &[f64], by: f64, x: &mut [f64]) {
        for (r, y) in y.iter().enumerate() {
            let (columns, values) = self.row(r);
            let y = by * y;
            columns.iter().zip(values).for_each(|(c, v)| x[*c as usize] += y * v);
        }
    }

    /// True where every row has one term: no row couples anything.
    pub(crate) fn is_separable(&self) -> bool {
        self.terms.iter().all(|t| t.len() == 1)
    }
}

/// Rows of length 1 ask for the same if their targets differ by less than this share of the larger one.
const SAME: f64 = 1e-9;

/// Targets are rounded to this share of the size of the shape.
const ROUNDING: f64 = 1e-12;

/// Shapes below this share of the longest side of their domain are zero for all that anyone can tell.
const NOTHING: f64 = 1e-3;

/// Targets are nothing but rounding up to this share of the size of a shape of nothing but zeros.
const RUBBLE: f64 = 5e-13;

/// Rows that take part with less than this are not named.
const NAMED: f64 = 1e-7;

/// Rows that follow from others and were left out.
pub(crate) struct Redundant {
    pub(crate) constraint: usize,
    pub(crate) others: Vec<usize>,
    /// How far it is missed, where that is more than rounding: rows too near to others to be told apart.
    pub(crate) miss: Option<f64>,
}

impl Redundant {
    /// One a constraint, in order of the first row of each, with the worst miss of its coordinates.
    fn by_constraint(rows: Vec<Redundant>) -> Vec<Redundant> {
        let mut out: Vec<Redundant> = Vec::new();
        let mut places = BTreeMap::new();
        for row in rows {
            let place = *places.entry(row.constraint).or_insert(out.len());
            let Some(known) = out.get_mut(place) else {
                out.push(row);
                continue;
            };
            known.others.extend(row.others);
            known.others.sort_unstable();
            known.others.dedup();
            known.miss = match (known.miss, row.miss) {
                (Some(a), Some(b)) => Some(a.max(b)),
                (a, b) => a.or(b),
            };
        }
        out
    }
}

impl Problem {
    /// All linear rows.
    pub(crate) fn rows(&self) -> Vec<Row> {
        let mut rows = Vec::new();
        for (number, c) in self.constraints.iter().enumerate() {
            c.rows(&self.space, number, &mut rows);
        }
        rows
    }

    /// Cuts rows into blocks; drops redundant rows.
    ///
    /// # Errors
    /// [`ProblemError::Conflict`].
    pub(crate) fn blocks(&self, rows: Vec<Row>) -> Result<(Vec<Block>, Vec<Redundant>), ProblemError> {
        let n = self.space.len();
        let scale = self.scale(&rows);
        // Union of coordinates that share a row.
        let mut group: Vec<usize> = (0..self.coordinates).collect();
        for row in &rows {
            let first = group[row.terms[0].coordinate];
            for t in &row.terms {
                let old = group[t.coordinate];
                group.iter_mut().filter(|g| **g == old).for_each(|g| *g = first);
            }
        }
        let mut sorted: Vec<Vec<Row>> = vec![Vec::new(); self.coordinates];
        for row in rows {
            sorted[group[row.terms[0].coordinate]].push(row);
        }
        let mut blocks: Vec<(Vec<Row>, Block)> = Vec::new();
        let mut redundant = Vec::new();
        for (g, rows) in sorted.into_iter().enumerate() {
            let coordinates: Vec<usize> = (0..self.coordinates).filter(|c| group[*c] == g).collect();
            if coordinates.is_empty() {
                continue;
            }
            let side = |rows: &[Row], coordinates: Vec<usize>| Side {
                coordinates,
                constraints: rows.iter().map(|r| r.constraint).collect(),
                targets: rows.iter().map(|r| r.target).collect(),
            };
            // The same rows on another coordinate?
            if coordinates.len() == 1
                && let Some((first, block)) =
                    blocks.iter_mut().find(|(first, b)| b.structure.k == 1 && same(first, &rows))
            {
                let _ = first;
                let kept: Vec<Row> = self.independent(&rows, scale, &mut redundant, &coordinates)?;
                block.sides.push(side(&kept, coordinates));
                continue;
            }
            let kept = self.independent(&rows, scale, &mut redundant, &coordinates)?;
            let of = |c: usize| coordinates.iter().position(|x| *x == c).unwrap_or(0);
            let structure = Structure::new(n, coordinates.len(), &kept, &of);
            let sides = vec![side(&kept, coordinates.clone())];
            blocks.push((rows, Block { structure, sides }));
        }
        Ok((blocks.into_iter().map(|b| b.1).collect(), Redundant::by_constraint(redundant)))
    }

    /// The size of the shape, about: the largest target of any coordinate (rows have length 1, so that all are in units
    /// of coefficients). Heights of zero beside others come from sums that cancel. A shape of nothing but zeros has
    /// only its domain to go by.
    fn scale(&self, rows: &[Row]) -> f64 {
        self.size(rows.iter().fold(0.0, |m: f64, r| m.max(r.target.abs())))
    }

    /// The size of a shape whose largest target is this: that of its domain where it is nothing but rounding.
    pub(crate) fn size(&self, largest: f64) -> f64 {
        if largest > RUBBLE * self.least_scale() { largest } else { self.least_scale() }
    }

    /// The size of a shape of nothing but zeros.
    pub(crate) fn least_scale(&self) -> f64 {
        let side = |a: &crate::axis::Axis| a.domain()[1] - a.domain()[0];
        NOTHING * self.space.axes().iter().map(side).fold(0.0, f64::max)
    }

    /// The rows without those that follow from others; `scale` as [`Problem::scale`] says.
    fn independent(
        &self,
        rows: &[Row],
        scale: f64,
        redundant: &mut Vec<Redundant>,
        coordinates: &[usize],
    ) -> Result<Vec<Row>, ProblemError> {
        let of = |c: usize| coordinates.iter().position(|x| *x == c).unwrap_or(0);
        let found: Vec<Dependence> = dependent(rows, self.space.len(), &of);
        if found.is_empty() {
            return Ok(rows.to_vec());
        }
        let mut drop = vec![false; rows.len()];
        for d in found {
            let row = &rows[d.row];
            let size = d.parts.iter().fold(row.target.abs(), |m, (r, c)| m.max((c * rows[*r].target).abs()));
            let miss = row.target - d.parts.iter().map(|(r, c)| c * rows[*r].target).sum::<f64>();
            let named = d.parts.iter().filter(|(_, c)| c.abs() > NAMED);
            let mut others: Vec<usize> = named.map(|(r, _)| rows[*r].constraint).collect();
            others.sort_unstable();
            others.dedup();
            let blurred = d.distance.max(ROUNDING) * scale;
            if miss.abs() > (SAME * size).max(blurred) {
                let names: Vec<&str> = others.iter().take(8).map(|c| self.constraints[*c].id.as_str()).collect();
                return Err(ProblemError::Conflict {
                    id: self.constraints[row.constraint].id.clone(),
                    others: names.join(", "),
                    miss: miss.abs() * row.length,
                });
            }
            drop[d.row] = true;
            let miss = Some(miss.abs() * row.length).filter(|_| miss.abs() > SAME * size.max(scale));
            redundant.push(Redundant { constraint: row.constraint, others, miss });
        }
        Ok(rows.iter().zip(drop).filter(|(_, d)| !d).map(|(r, _)| r.clone()).collect())
    }
}

/// Entries sorted by column, those of one column added.
pub(crate) fn merged<I: Copy + Ord>(mut entries: Vec<(I, f64)>) -> Vec<(I, f64)> {
    entries.sort_by_key(|e| e.0);
    entries.dedup_by(|later, first| {
        let same = later.0 == first.0;
        if same {
            first.1 += later.1;
        }
        same
    });
    entries
}

/// True where the rows differ in nothing but targets and the coordinate they belong to.
fn same(a: &[Row], b: &[Row]) -> bool {
    a.len() == b.len()
        && a.iter().zip(b).all(|(a, b)| {
            a.give.to_bits() == b.give.to_bits()
                && a.terms.len() == b.terms.len()
                && a.terms.iter().zip(&b.terms).all(|(s, t)| {
                    s.functional.at == t.functional.at
                        && s.functional.derivative == t.functional.derivative
                        && s.factor.to_bits() == t.factor.to_bits()
                })
        })
}
