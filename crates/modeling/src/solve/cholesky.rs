//! Dense Cholesky factors, row by row.
//!
//! Row k needs rows 0..k only, and every inner product is summed in one fixed order: a factor that grew a row at a time
//! has the bits of one made at once.

/// A lower triangular factor, packed: row k starts at k (k + 1) / 2.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cholesky {
    n: usize,
    rows: Vec<f64>,
}

/// Where row `k` of a packed triangle starts.
pub(crate) fn start(k: usize) -> usize {
    k * (k + 1) / 2
}

/// Inner product in the one order that all factors use.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut acc = [0.0; 4];
    let (ca, cb) = (a.chunks_exact(4), b.chunks_exact(4));
    let (ra, rb) = (ca.remainder(), cb.remainder());
    for (x, y) in ca.zip(cb) {
        for l in 0..4 {
            acc[l] += x[l] * y[l];
        }
    }
    let tail: f64 = ra.iter().zip(rb).map(|(x, y)| x * y).sum();
    (acc[0] + acc[1]) + (acc[2] + acc[3]) + tail
}

/// Four inner products with `b`, each in the order of [`dot`].
fn dot4(a: [&[f64]; 4], b: &[f64]) -> [f64; 4] {
    let n = b.len();
    let whole = n / 4 * 4;
    let mut acc = [[0.0; 4]; 4];
    let [a0, a1, a2, a3] = a.map(|a| a[..n].chunks_exact(4));
    for ((((y, x0), x1), x2), x3) in b.chunks_exact(4).zip(a0).zip(a1).zip(a2).zip(a3) {
        for l in 0..4 {
            acc[0][l] += x0[l] * y[l];
            acc[1][l] += x1[l] * y[l];
            acc[2][l] += x2[l] * y[l];
            acc[3][l] += x3[l] * y[l];
        }
    }
    std::array::from_fn(|r| {
        let tail: f64 = a[r][whole..n].iter().zip(&b[whole..]).map(|(x, y)| x * y).sum();
        (acc[r][0] + acc[r][1]) + (acc[r][2] + acc[r][3]) + tail
    })
}

impl Cholesky {
    /// The factor of a packed symmetric matrix; the number of the first row without a positive pivot, if any.
    pub(crate) fn new(matrix: &[f64], n: usize) -> Result<Cholesky, usize> {
        let mut out = Cholesky::default();
        out.extend(matrix, n)?;
        Ok(out)
    }

    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.n
    }

    /// Grows to the first `n` rows of a packed matrix, whose leading rows it is already the factor of.
    pub(crate) fn extend(&mut self, matrix: &[f64], n: usize) -> Result<(), usize> {
        self.rows.reserve(start(n).saturating_sub(self.rows.len()));
        while self.n < n {
            let k = self.n;
            let many = (n - k).min(4);
            self.rows.extend_from_slice(&matrix[start(k)..start(k + many)]);
            let (done, new) = self.rows.split_at_mut(start(k));
            let mut part: [&mut [f64]; 4] = Default::default();
            let mut rest = new;
            for (r, p) in part.iter_mut().enumerate().take(many) {
                let (row, after) = rest.split_at_mut(k + r + 1);
                *p = row;
                rest = after;
            }
            for j in 0..k {
                let other = &done[start(j)..start(j + 1)];
                let pivot = other[j];
                if many == 4 {
                    let d = dot4([&*part[0], &*part[1], &*part[2], &*part[3]], &other[..j]);
                    for r in 0..4 {
                        part[r][j] = (part[r][j] - d[r]) / pivot;
                    }
                } else {
                    for p in part.iter_mut().take(many) {
                        p[j] = (p[j] - dot(&p[..j], &other[..j])) / pivot;
                    }
                }
            }
            for r in 0..many {
                for j in 0..=r {
                    let at = k + j;
                    let d = dot(&part[r][..at], &part[j][..at]);
                    if j < r {
                        part[r][at] = (part[r][at] - d) / part[j][at];
                    } else {
                        let square = part[r][at] - d;
                        if !(square > 0.0 && square.is_finite()) {
                            self.rows.truncate(start(k + r));
                            self.n = k + r;
                            return Err(k + r);
                        }
                        part[r][at] = square.sqrt();
                    }
                }
            }
            self.n = k + many;
        }
        Ok(())
    }

    /// Appends a row of the factor: what [`Cholesky::forward`] made of the products with the rows before, and a pivot
    /// that is known better than by their difference.
    pub(crate) fn push(&mut self, row: &[f64], pivot: f64) {
        debug_assert_eq!(row.len(), self.n);
        self.rows.extend_from_slice(row);
        self.rows.push(pivot);
        self.n += 1;
    }

    /// Forgets all rows from `n` on.
    pub(crate) fn truncate(&mut self, n: usize) {
        if n < self.n {
            self.rows.truncate(start(n));
            self.n = n;
        }
    }

    /// `x = L^-1 x`.
    pub(crate) fn forward(&self, x: &mut [f64]) {
        for k in 0..self.n {
            let row = &self.rows[start(k)..start(k + 1)];
            x[k] = (x[k] - dot(&row[..k], &x[..k])) / row[k];
        }
    }

    /// `x = L^-T x`.
    pub(crate) fn backward(&self, x: &mut [f64]) {
        for k in (0..self.n).rev() {
            let row = &self.rows[start(k)..start(k + 1)];
            let v = x[k] / row[k];
            x[k] = v;
            x[..k].iter_mut().zip(row).for_each(|(x, l)| *x -= v * l);
        }
    }

    /// The square of the last pivot over the diagonal entry it came from would be `pivot(k)^2 / matrix[k][k]`.
    pub(crate) fn pivot(&self, k: usize) -> f64 {
        self.rows[start(k) + k]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ondelette_numerics::seed;

    fn matrix(n: usize) -> Vec<f64> {
        let g: Vec<f64> = (0..n * n).map(|i| seed::unit(i as u64) - 0.5).collect();
        let mut out = Vec::new();
        for i in 0..n {
            for j in 0..=i {
                let shift = if i == j { 0.1 } else { 0.0 };
                out.push(dot(&g[i * n..][..n], &g[j * n..][..n]) + shift);
            }
        }
        out
    }

    #[test]
    fn growing_row_by_row_gives_the_bits_of_one_factorisation() {
        let m = matrix(23);
        let whole = Cholesky::new(&m, 23).unwrap();
        let mut grown = Cholesky::default();
        for n in [1, 2, 7, 8, 13, 23] {
            grown.extend(&m, n).unwrap();
        }
        assert_eq!(whole.rows, grown.rows);
        grown.truncate(5);
        grown.extend(&m, 23).unwrap();
        assert_eq!(whole.rows, grown.rows);
    }

    #[test]
    fn it_solves() {
        let n = 19;
        let m = matrix(n);
        let l = Cholesky::new(&m, n).unwrap();
        let at = |i: usize, j: usize| if i >= j { m[start(i) + j] } else { m[start(j) + i] };
        let want: Vec<f64> = (0..n).map(|i| i as f64 - 4.0).collect();
        let mut x: Vec<f64> = (0..n).map(|i| (0..n).map(|j| at(i, j) * want[j]).sum()).collect();
        l.forward(&mut x);
        l.backward(&mut x);
        assert!(x.iter().zip(&want).all(|(a, b)| (a - b).abs() < 1e-9));
    }
}
