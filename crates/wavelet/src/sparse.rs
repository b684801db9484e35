//! Sparse matrices: the definition of a transform, which the fast passes are tested against.

use crate::coefficient::{Coefficient, Scalar};

/// A sparse matrix, stored by rows with columns in order.
///
/// ```
/// use ondelette_wavelet::Sparse;
/// let a = Sparse::from_triplets(2, 3, vec![(0, 0, 1.0), (1, 2, 2.0), (1, 2, 0.5)]);
/// assert_eq!(a.times(&[1.0, 1.0, 4.0]), [1.0, 10.0]);
/// assert_eq!(a.transposed().times(&[1.0, 2.0]), [1.0, 0.0, 5.0]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Sparse {
    rows: usize,
    cols: usize,
    start: Vec<usize>,
    entries: Vec<(usize, f64)>,
}

impl Sparse {
    /// The matrix with the given entries `(row, column, value)`; entries at the same place add up.
    ///
    /// # Panics
    /// If an index lies outside.
    pub fn from_triplets(rows: usize, cols: usize, mut triplets: Vec<(usize, usize, f64)>) -> Sparse {
        triplets.sort_by_key(|t| (t.0, t.1));
        let mut out = Sparse { rows, cols, start: vec![0; rows + 1], entries: Vec::with_capacity(triplets.len()) };
        let mut last = None;
        for (r, c, v) in triplets {
            assert!(r < rows && c < cols, "entry ({r}, {c}) outside a {rows} x {cols} matrix");
            if last == Some((r, c)) {
                let end = out.entries.len() - 1;
                out.entries[end].1 += v;
            } else {
                out.entries.push((c, v));
                out.start[r + 1] += 1;
                last = Some((r, c));
            }
        }
        for r in 0..rows {
            out.start[r + 1] += out.start[r];
        }
        out
    }

    /// The identity.
    pub fn identity(n: usize) -> Sparse {
        Sparse::from_triplets(n, n, (0..n).map(|i| (i, i, 1.0)).collect())
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn cols(&self) -> usize {
        self.cols
    }

    /// Number of stored entries.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// True if no entry is stored.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The entries `(column, value)` of a row, columns in order.
    pub fn row(&self, r: usize) -> &[(usize, f64)] {
        &self.entries[self.start[r]..self.start[r + 1]]
    }

    /// `A x`. Cost: one multiplication an entry and channel.
    ///
    /// # Panics
    /// If `x` has not as many entries as the matrix has columns.
    pub fn times<C: Coefficient>(&self, x: &[C]) -> Vec<C> {
        let mut y = vec![C::default(); self.rows];
        self.times_into(C::flat(x), C::flat_mut(&mut y), C::CHANNELS);
        y
    }

    /// `y = A x` for `channels` interleaved vectors.
    pub(crate) fn times_into<S: Scalar>(&self, x: &[S], y: &mut [S], channels: usize) {
        assert_eq!(x.len(), self.cols * channels, "vector does not fit a {} x {} matrix", self.rows, self.cols);
        for (r, out) in y.chunks_mut(channels).enumerate() {
            out.fill(S::default());
            for &(c, v) in self.row(r) {
                let v = S::from_f64(v);
                for (o, &x) in out.iter_mut().zip(&x[c * channels..]) {
                    *o += v * x;
                }
            }
        }
    }

    /// The transpose.
    pub fn transposed(&self) -> Sparse {
        let triplets = (0..self.rows).flat_map(|r| self.row(r).iter().map(move |&(c, v)| (c, r, v))).collect();
        Sparse::from_triplets(self.cols, self.rows, triplets)
    }

    /// The product `A B`.
    ///
    /// # Panics
    /// If the inner sizes differ.
    pub fn product(&self, other: &Sparse) -> Sparse {
        assert_eq!(self.cols, other.rows, "inner sizes of a product differ");
        let mut dense = vec![0.0; other.cols];
        let mut seen = vec![false; other.cols];
        let mut out = Sparse { rows: self.rows, cols: other.cols, start: vec![0], entries: Vec::new() };
        let mut touched = Vec::new();
        for r in 0..self.rows {
            for &(m, a) in self.row(r) {
                for &(c, b) in other.row(m) {
                    if !seen[c] {
                        seen[c] = true;
                        touched.push(c);
                    }
                    dense[c] += a * b;
                }
            }
            touched.sort_unstable();
            for &c in &touched {
                out.entries.push((c, dense[c]));
                dense[c] = 0.0;
                seen[c] = false;
            }
            touched.clear();
            out.start.push(out.entries.len());
        }
        out
    }

    /// The columns `from..to` as a matrix of their own.
    pub fn columns(&self, from: usize, to: usize) -> Sparse {
        let mut out = Sparse { rows: self.rows, cols: to - from, start: vec![0], entries: Vec::new() };
        for r in 0..self.rows {
            out.entries.extend(self.row(r).iter().filter(|e| (from..to).contains(&e.0)).map(|e| (e.0 - from, e.1)));
            out.start.push(out.entries.len());
        }
        out
    }

    /// The matrix with every entry multiplied.
    pub fn scaled(mut self, by: f64) -> Sparse {
        self.entries.iter_mut().for_each(|e| e.1 *= by);
        self
    }

    /// All entries, row-major.
    pub fn to_dense(&self) -> Vec<f64> {
        let mut out = vec![0.0; self.rows * self.cols];
        for r in 0..self.rows {
            for &(c, v) in self.row(r) {
                out[r * self.cols + c] = v;
            }
        }
        out
    }
}
