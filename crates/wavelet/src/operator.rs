//! Linear operators in wavelet bases (4.4): the standard form, and the non-standard form with pull, gather and push.
//!
//! An operator on functions of `d` variables is a tensor with `2 d` axes: rows (receivers) first, columns (shooters)
//! last. Both forms hold it in wavelets of both sides; small entries can be dropped.

use crate::pyramid::{TransformError, check};
use crate::rung::Kind;
use crate::tensor::{Layout, Tensor, TensorError, for_rows};

/// How the row side is expanded; columns are always transformed as basis functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expansion {
    /// Rows as basis functions too (100): `M = W^-T K W^-1`, the result is pushed with W^T. Maps coefficients to dual
    /// coefficients.
    Symmetric,
    /// Rows as coefficients (99): `M = W K W^-1`, the result is pushed with W^-1. Maps coefficients to coefficients.
    Galerkin,
}

impl Expansion {
    fn rows(self) -> Kind {
        match self {
            Expansion::Symmetric => Kind::Basis,
            Expansion::Galerkin => Kind::Coefficients,
        }
    }
}

/// Why an operator cannot be transformed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OperatorError {
    /// The domain has too many axes, or axes that do not fit each other.
    #[error(transparent)]
    Domain(#[from] TensorError),
    /// The domain is not non-standard, or has more than two axes.
    #[error("the domain of an operator is a non-standard tensor of 1 or 2 unscaled axes")]
    Layout,
    /// The matrix does not fit, or is not finite.
    #[error("operator matrix: {0}")]
    Matrix(#[from] TransformError),
}

/// An operator in standard form: one sparse matrix between the flat wavelet bases of both sides (4.4.1).
#[derive(Clone, Debug)]
pub struct StandardOperator {
    domain: Tensor,
    expansion: Expansion,
    /// Entries `(row, column, value)` in the layout of the domain, row-major.
    entries: Vec<(u32, u32, f64)>,
}

/// An operator in non-standard form (4.4.2): blocks that couple functions of one level only.
///
/// ```
/// use ondelette_wavelet::{Boundary, Expansion, Family, Layout, NonStandardOperator, Pyramid, Tensor};
/// let axis = Pyramid::deepest(Family::Haar, Boundary::Periodic, 4)?;
/// let domain = Tensor::new(vec![axis], Layout::NonStandard)?;
/// let matrix: Vec<f64> = (0..16).map(|i| 1.0 / (1.0 + i as f64)).collect();
/// let operator = NonStandardOperator::new(&domain, &matrix, Expansion::Symmetric)?;
/// let y = operator.apply(&[1.0, 0.0, 0.0, 0.0])?;
/// assert!((y[1] - matrix[4]).abs() < 1e-14);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct NonStandardOperator {
    domain: Tensor,
    expansion: Expansion,
    levels: Vec<LevelBlocks>,
}

/// The entries of one level: rows and columns are all functions of the level, smooth then detail along each axis, in a
/// compact row-major box of the domain. Smooth-smooth entries exist on level 0 only.
#[derive(Clone, Debug, Default)]
struct LevelBlocks {
    entries: Vec<(u32, u32, f64)>,
}

/// Coefficients of one level, smooth and detail functions of all types in one compact box (smooth first on each axis).
/// For one axis: `b` then `w`.
pub type LevelBox = Vec<f64>;

fn domain_axes(domain: &Tensor) -> Result<(), OperatorError> {
    let plain = domain.axes().iter().all(|a| (0..=a.levels()).all(|i| a.heights().smooth(i) == 1.0));
    let fits = domain.layout() == Layout::NonStandard && domain.axes().len() <= 2 && plain;
    if fits { Ok(()) } else { Err(OperatorError::Layout) }
}

impl StandardOperator {
    /// Transforms a dense matrix, row-major, of the operator on the finest functions.
    ///
    /// # Errors
    /// A domain that is no non-standard tensor of 1 or 2 axes; a matrix that does not fit it or is not finite.
    pub fn new(domain: &Tensor, matrix: &[f64], expansion: Expansion) -> Result<StandardOperator, OperatorError> {
        domain_axes(domain)?;
        let n = domain.len();
        check(matrix, n * n)?;
        let flat = Tensor::new(domain.axes().to_vec(), Layout::Standard)?;
        // Columns: every row of the matrix is a function of the shooters.
        let mut half = vec![0.0; n * n];
        for (row, out) in matrix.chunks(n).zip(half.chunks_mut(n)) {
            flat.up_into(Kind::Basis, row, out)?;
        }
        let mut entries = Vec::new();
        let (mut column, mut out) = (vec![0.0; n], vec![0.0; n]);
        for j in 0..n {
            column.iter_mut().enumerate().for_each(|(i, x)| *x = half[i * n + j]);
            flat.up_into(expansion.rows(), &column, &mut out)?;
            entries.extend(out.iter().enumerate().filter(|e| *e.1 != 0.0).map(|(i, &v)| (i as u32, j as u32, v)));
        }
        entries.sort_unstable_by_key(|e| (e.0, e.1));
        Ok(StandardOperator { domain: flat, expansion, entries })
    }

    /// Number of stored entries.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// True if nothing is stored.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Drops all entries below `tolerance` in magnitude.
    pub fn compress(&mut self, tolerance: f64) {
        self.entries.retain(|e| e.2.abs() >= tolerance);
    }

    /// `K b`: transform, multiply, transform back (113).
    ///
    /// # Errors
    /// Wrong length; a value that is not finite.
    pub fn apply(&self, b: &[f64]) -> Result<Vec<f64>, TransformError> {
        let pulled = self.domain.up(Kind::Coefficients, b)?;
        let mut gathered = vec![0.0; b.len()];
        for &(i, j, v) in &self.entries {
            gathered[i as usize] += v * pulled.values()[j as usize];
        }
        let mut out = vec![0.0; b.len()];
        let down = self.expansion.rows();
        self.domain.down_into(down, &gathered, &mut out)?;
        Ok(out)
    }
}

impl NonStandardOperator {
    /// Transforms a dense matrix, row-major, of the operator on the finest functions.
    ///
    /// # Errors
    /// A domain that is no non-standard tensor of 1 or 2 axes; a matrix that does not fit it or is not finite.
    pub fn new(domain: &Tensor, matrix: &[f64], expansion: Expansion) -> Result<NonStandardOperator, OperatorError> {
        domain_axes(domain)?;
        let n = domain.len();
        check(matrix, n * n)?;
        let d = domain.axes().len();
        let both = Tensor::new([domain.axes(), domain.axes()].concat(), Layout::NonStandard)?;
        let kinds = [vec![expansion.rows(); d], vec![Kind::Basis; d]].concat();
        let depth = domain.axes()[0].levels();
        let mut levels = vec![LevelBlocks::default(); depth];
        let mut now = matrix.to_vec();
        for level in (0..depth).rev() {
            now = both.split_level(level, &kinds, now);
            let fine: Vec<usize> = domain.axes().iter().map(|a| a.smooth_len(level + 1)).collect();
            let coarse: Vec<usize> = domain.axes().iter().map(|a| a.smooth_len(level)).collect();
            let columns: usize = fine.iter().product();
            let smooth: Vec<bool> = (0..columns).map(|i| is_smooth(i, &fine, &coarse)).collect();
            let mut next = Vec::with_capacity(coarse.iter().product::<usize>().pow(2));
            for (at, &v) in now.iter().enumerate() {
                let (i, j) = (at / columns, at % columns);
                let all_smooth = smooth[i] && smooth[j];
                if all_smooth {
                    next.push(v);
                }
                if v != 0.0 && (!all_smooth || level == 0) {
                    levels[level].entries.push((i as u32, j as u32, v));
                }
            }
            now = next;
        }
        if depth == 0 {
            // Nothing to transform: one level of smooth functions only.
            let entries = matrix.iter().enumerate().filter(|e| *e.1 != 0.0);
            let entries = entries.map(|(at, &v)| ((at / n) as u32, (at % n) as u32, v)).collect();
            levels.push(LevelBlocks { entries });
        }
        Ok(NonStandardOperator { domain: domain.clone(), expansion, levels })
    }

    /// Number of stored entries.
    pub fn len(&self) -> usize {
        self.levels.iter().map(|l| l.entries.len()).sum()
    }

    /// True if nothing is stored.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The entries `(row, column, value)` of a level; indices count the compact box of the level, smooth then detail
    /// along each axis.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn entries(&self, level: usize) -> &[(u32, u32, f64)] {
        &self.levels[level].entries
    }

    /// Drops all entries below `tolerance` in magnitude.
    pub fn compress(&mut self, tolerance: f64) {
        for level in &mut self.levels {
            level.entries.retain(|e| e.2.abs() >= tolerance);
        }
    }

    /// Pull: the coefficients of all functions of every level (106). Linear time.
    ///
    /// # Errors
    /// Wrong length; a value that is not finite.
    pub fn pull(&self, b: &[f64]) -> Result<Vec<LevelBox>, TransformError> {
        check(b, self.domain.len())?;
        let d = self.domain.axes().len();
        let mut out = vec![LevelBox::new(); self.depth()];
        let mut now = b.to_vec();
        for level in (0..self.depth()).rev() {
            now = self.domain.split_level(level, &vec![Kind::Coefficients; d], now);
            out[level] = now;
            now = self.smooth_part(level, &out[level]);
        }
        if self.depth() == 0 {
            out.push(now);
        }
        Ok(out)
    }

    /// Gather: every level times its entries (105).
    ///
    /// # Panics
    /// If the boxes do not come from [`NonStandardOperator::pull`].
    pub fn gather(&self, pulled: &[LevelBox]) -> Vec<LevelBox> {
        self.levels
            .iter()
            .zip(pulled)
            .map(|(level, b)| {
                let mut out = vec![0.0; b.len()];
                for &(i, j, v) in &level.entries {
                    out[i as usize] += v * b[j as usize];
                }
                out
            })
            .collect()
    }

    /// Push: the sum of the functions of all levels, on the finest (dual_push, with the smooth part of every level
    /// added inside its loop). Linear time.
    ///
    /// # Panics
    /// If the boxes do not come from [`NonStandardOperator::gather`].
    pub fn push(&self, gathered: &[LevelBox]) -> Vec<f64> {
        let d = self.domain.axes().len();
        let mut now: Option<Vec<f64>> = None;
        for (level, own) in gathered.iter().enumerate() {
            let mut both = own.clone();
            if let Some(coarser) = now {
                self.for_smooth_rows(level, |at, rows| {
                    let n = rows.len();
                    both[rows].iter_mut().zip(&coarser[at..at + n]).for_each(|(x, c)| *x += c);
                });
            }
            if self.depth() == 0 {
                return both;
            }
            now = Some(self.domain.merge_level(level, &vec![self.expansion.rows(); d], both));
        }
        now.unwrap_or_default()
    }

    /// `K b` by pull, gather and push.
    ///
    /// # Errors
    /// Wrong length; a value that is not finite.
    pub fn apply(&self, b: &[f64]) -> Result<Vec<f64>, TransformError> {
        Ok(self.push(&self.gather(&self.pull(b)?)))
    }

    fn depth(&self) -> usize {
        self.domain.axes()[0].levels()
    }

    fn for_smooth_rows(&self, level: usize, mut f: impl FnMut(usize, std::ops::Range<usize>)) {
        let fine: Vec<usize> = self.domain.axes().iter().map(|a| a.smooth_len(level + 1)).collect();
        let coarse: Vec<_> = self.domain.axes().iter().map(|a| 0..a.smooth_len(level)).collect();
        let mut at = 0;
        for_rows(&fine, &coarse, |rows| {
            let n = rows.len();
            f(at, rows);
            at += n;
        });
    }

    fn smooth_part(&self, level: usize, all: &[f64]) -> Vec<f64> {
        let mut out = Vec::new();
        self.for_smooth_rows(level, |_, rows| out.extend_from_slice(&all[rows]));
        out
    }
}

fn is_smooth(mut at: usize, fine: &[usize], coarse: &[usize]) -> bool {
    fine.iter().zip(coarse).rev().all(|(n, s)| {
        let i = at % n;
        at /= n;
        i < *s
    })
}
