//! The wavelets of a cell: what its children's functions add to its own.

use super::basis::CellBasis;
use super::shape::CellShape;
use crate::tree::TreeFamily;

impl CellBasis {
    /// The wavelets of a cell in the functions of its children, `(arity - 1) n x arity n`, row-major; column `c n + j`
    /// is function `j` of child `c`. Orthonormal among themselves and to the scaling functions, in coefficients
    /// multiplied by the root of the measure of their cell, for which the scaling functions have the rows
    /// `T_c / sqrt(arity)`.
    /// `None` for flatlets, which are not orthogonal.
    ///
    /// Intervals: the multiwavelets psi^1 .. psi^M. Squares: products of these and the scaling functions, but for those
    /// of scaling functions alone. Triangles: unit vectors made orthonormal to all before (Gram and Schmidt, the one
    /// that keeps most of its length first). Cost O((arity n)^3).
    ///
    /// ```
    /// use ondelette_wavelet::cell::{CellBasis, CellFamily, CellShape};
    /// let haar = CellBasis::new(CellShape::Square, CellFamily::Multiwavelet, 1).unwrap();
    /// let detail = haar.detail().unwrap();
    /// assert_eq!(detail.len(), 3 * 4);
    /// // a constant has no detail
    /// assert!(detail.chunks(4).all(|row| row.iter().sum::<f64>().abs() < 1e-15));
    /// ```
    pub fn detail(&self) -> Option<Vec<f64>> {
        if !self.is_nested() {
            return None;
        }
        let axis = TreeFamily::multiwavelet(self.order).ok()?;
        let (m, block) = (self.order, axis.primal());
        match self.shape {
            CellShape::Interval => Some(block[2 * m * m..].to_vec()),
            CellShape::Square => {
                let products = (0..4 * m * m).map(|k| (k / (2 * m), k % (2 * m))).filter(|(p, q)| *p >= m || *q >= m);
                let entry = |p: usize, q: usize, child: usize, i: usize, j: usize| {
                    block[p * 2 * m + (child & 1) * m + i] * block[q * 2 * m + (child >> 1) * m + j]
                };
                let row = |(p, q)| {
                    let columns = (0..4).flat_map(move |c| (0..m * m).map(move |k| (c, k)));
                    columns.map(move |(c, k)| entry(p, q, c, k / m, k % m)).collect::<Vec<f64>>()
                };
                Some(products.flat_map(row).collect())
            }
            CellShape::Triangle => Some(self.completed()),
        }
    }

    /// An orthonormal basis of what is orthogonal to the scaling functions.
    fn completed(&self) -> Vec<f64> {
        let (n, arity) = (self.len(), self.shape.arity());
        let wide = arity * n;
        let scale = 1.0 / (arity as f64).sqrt();
        let mut rows: Vec<Vec<f64>> =
            (0..n).map(|i| (0..wide).map(|k| scale * self.two_scale[k / n][i * n + k % n]).collect()).collect();
        let mut left: Vec<Vec<f64>> =
            (0..wide).map(|k| (0..wide).map(|l| if k == l { 1.0 } else { 0.0 }).collect()).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let reduce = |v: &mut Vec<f64>, by: &[f64]| {
            let k = dot(v, by);
            v.iter_mut().zip(by).for_each(|(v, b)| *v -= k * b);
        };
        for row in &rows {
            left.iter_mut().for_each(|v| reduce(v, row));
        }
        while rows.len() < wide {
            let longest = (1..left.len()).fold(0, |a, b| {
                // ties, up to rounding, to the first
                if dot(&left[b], &left[b]) > dot(&left[a], &left[a]) + 1e-12 { b } else { a }
            });
            let mut row = left.swap_remove(longest);
            rows.iter().for_each(|r| reduce(&mut row, r));
            let norm = dot(&row, &row).sqrt();
            row.iter_mut().for_each(|v| *v /= norm);
            left.iter_mut().for_each(|v| reduce(v, &row));
            rows.push(row);
        }
        rows.split_off(n).concat()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::CellFamily;

    #[test]
    fn scaling_functions_and_wavelets_are_an_orthonormal_basis_of_the_children() {
        for shape in [CellShape::Interval, CellShape::Square, CellShape::Triangle] {
            for order in 1..=4 {
                let basis = CellBasis::new(shape, CellFamily::Multiwavelet, order).unwrap();
                let (n, arity) = (basis.len(), shape.arity());
                let scale = 1.0 / (arity as f64).sqrt();
                let smooth = |i: usize| (0..arity * n).map(move |k| (i, k));
                let mut rows: Vec<f64> =
                    (0..n).flat_map(smooth).map(|(i, k)| scale * basis.two_scale(k / n)[i * n + k % n]).collect();
                rows.extend(basis.detail().unwrap());
                let rows: Vec<&[f64]> = rows.chunks(arity * n).collect();
                assert_eq!(rows.len(), arity * n);
                for (i, a) in rows.iter().enumerate() {
                    for (j, b) in rows.iter().enumerate() {
                        let dot: f64 = a.iter().zip(*b).map(|(a, b)| a * b).sum();
                        let want = if i == j { 1.0 } else { 0.0 };
                        assert!((dot - want).abs() < 1e-12, "{shape:?} order {order}: rows {i} and {j}: {dot}");
                    }
                }
            }
        }
        assert!(CellBasis::new(CellShape::Square, CellFamily::Flatlet, 2).unwrap().detail().is_none());
    }
}
