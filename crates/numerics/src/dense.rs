//! Small dense matrices.

/// Inverse of a small regular matrix, row-major `n x n`, by Gauss-Jordan elimination with row pivots. O(n^3).
pub fn inverse(matrix: &[f64], n: usize) -> Vec<f64> {
    let mut a = matrix.to_vec();
    let mut out: Vec<f64> = (0..n * n).map(|i| if i / n == i % n { 1.0 } else { 0.0 }).collect();
    for c in 0..n {
        let p = (c..n).max_by(|&x, &y| a[x * n + c].abs().total_cmp(&a[y * n + c].abs())).unwrap_or(c);
        for k in 0..n {
            a.swap(c * n + k, p * n + k);
            out.swap(c * n + k, p * n + k);
        }
        let d = a[c * n + c];
        for k in 0..n {
            a[c * n + k] /= d;
            out[c * n + k] /= d;
        }
        for r in (0..n).filter(|&r| r != c) {
            let f = a[r * n + c];
            for k in 0..n {
                a[r * n + k] -= f * a[c * n + k];
                out[r * n + k] -= f * out[c * n + k];
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zero_on_the_diagonal_is_no_obstacle() {
        // [[0, 2], [4, 1]]^-1 = [[-1/8, 1/4], [1/2, 0]]
        assert_eq!(inverse(&[0.0, 2.0, 4.0, 1.0], 2), [-0.125, 0.25, 0.5, 0.0]);
    }
}
