//! A stepping GMRES for several channels that share one operator but not its coefficients.

/// GMRES (Saad and Schultz 1986) for A x = b, one Arnoldi step at a time, `C` independent systems at once.
///
/// The caller applies A: it takes [`Gmres::direction`], multiplies, and hands the product to [`Gmres::supply`]. Inner
/// products are weighted sums; all sums run in index order. Memory: one vector a step.
///
/// ```
/// use ondelette_numerics::krylov::Gmres;
/// let a = [[4.0, 1.0], [2.0, 3.0]];
/// let times = |v: &[[f64; 1]]| -> Vec<[f64; 1]> { a.iter().map(|r| [r[0] * v[0][0] + r[1] * v[1][0]]).collect() };
/// let mut solver = Gmres::new(vec![[0.0]; 2], vec![[1.0], [2.0]], vec![1.0; 2]);
/// while let Some(direction) = solver.direction() {
///     let product = times(direction);
///     solver.supply(product);
/// }
/// let x = solver.solution();
/// assert!((x[0][0] - 0.1).abs() < 1e-14 && (x[1][0] - 0.6).abs() < 1e-14);
/// ```
#[derive(Clone, Debug)]
pub struct Gmres<const C: usize> {
    start: Vec<[f64; C]>,
    weights: Vec<f64>,
    basis: Vec<Vec<[f64; C]>>,
    /// Per channel: columns of the triangular factor, the rotations, the rotated right-hand side.
    factor: Vec<Vec<[f64; C]>>,
    rotations: Vec<[(f64, f64); C]>,
    right: Vec<[f64; C]>,
    done: bool,
}

/// Weighted 2-norm, a channel: that of [`Gmres`].
///
/// # Panics
/// If the lengths differ.
///
/// ```
/// assert_eq!(ondelette_numerics::krylov::norm(&[1.0, 4.0], &[[3.0], [2.0]]), [5.0]);
/// ```
pub fn norm<const C: usize>(weights: &[f64], vector: &[[f64; C]]) -> [f64; C] {
    assert_eq!(weights.len(), vector.len());
    dot(weights, vector, vector).map(f64::sqrt)
}

impl<const C: usize> Gmres<C> {
    /// Starts from `start`, with `residual` = b - A start.
    ///
    /// # Panics
    /// If the lengths differ.
    pub fn new(start: Vec<[f64; C]>, residual: Vec<[f64; C]>, weights: Vec<f64>) -> Self {
        assert_eq!(start.len(), residual.len());
        assert_eq!(start.len(), weights.len());
        let norm = norm(&weights, &residual);
        let mut solver = Gmres {
            start,
            weights,
            basis: Vec::new(),
            factor: Vec::new(),
            rotations: Vec::new(),
            right: vec![norm],
            done: norm.iter().all(|n| *n == 0.0),
        };
        solver.basis.push(scaled(residual, norm));
        solver
    }

    /// The vector to multiply by A next; `None` when the solution is exact.
    pub fn direction(&self) -> Option<&[[f64; C]]> {
        if self.done { None } else { self.basis.last().map(Vec::as_slice) }
    }

    /// Number of products supplied.
    pub fn steps(&self) -> usize {
        self.factor.len()
    }

    /// Weighted 2-norm of the residual, a channel.
    pub fn residual(&self) -> [f64; C] {
        self.right.last().map_or([0.0; C], |r| r.map(f64::abs))
    }

    /// Takes A times [`Gmres::direction`].
    pub fn supply(&mut self, mut product: Vec<[f64; C]>) {
        let k = self.factor.len();
        let before = dot(&self.weights, &product, &product).map(f64::sqrt);
        let mut column = vec![[0.0; C]; k + 2];
        // modified Gram-Schmidt, twice
        for _ in 0..2 {
            for (i, v) in self.basis.iter().enumerate() {
                let h = dot(&self.weights, &product, v);
                for (p, v) in product.iter_mut().zip(v) {
                    for c in 0..C {
                        p[c] -= h[c] * v[c];
                    }
                }
                for c in 0..C {
                    column[i][c] += h[c];
                }
            }
        }
        let mut norm = dot(&self.weights, &product, &product).map(f64::sqrt);
        for c in 0..C {
            // what is left is rounding: this channel's Krylov space is exhausted
            if norm[c] <= EXHAUSTED * before[c] {
                norm[c] = 0.0;
            }
        }
        column[k + 1] = norm;
        let mut rotation = [(1.0, 0.0); C];
        let mut next = [0.0; C];
        let mut finished = true;
        for c in 0..C {
            for (i, r) in self.rotations.iter().enumerate() {
                let (cos, sin) = r[c];
                let (a, b) = (column[i][c], column[i + 1][c]);
                column[i][c] = cos * a + sin * b;
                column[i + 1][c] = cos * b - sin * a;
            }
            let (a, b) = (column[k][c], column[k + 1][c]);
            let r = a.hypot(b);
            if r > 0.0 {
                rotation[c] = (a / r, b / r);
            }
            column[k][c] = r;
            let g = self.right[k][c];
            self.right[k][c] = rotation[c].0 * g;
            next[c] = -rotation[c].1 * g;
            finished &= next[c].abs() <= f64::MIN_POSITIVE || norm[c] == 0.0;
        }
        self.rotations.push(rotation);
        self.factor.push(column);
        self.right.push(next);
        self.done = finished || norm.iter().all(|n| *n == 0.0);
        self.basis.push(scaled(product, norm));
    }

    /// The best solution so far.
    pub fn solution(&self) -> Vec<[f64; C]> {
        let n = self.factor.len();
        let mut y = vec![[0.0; C]; n];
        for i in (0..n).rev() {
            for c in 0..C {
                let mut sum = self.right[i][c];
                for j in i + 1..n {
                    sum -= self.factor[j][i][c] * y[j][c];
                }
                let pivot = self.factor[i][i][c];
                let largest = self.factor[..n].iter().enumerate().map(|(j, f)| f[j][c]).fold(0.0, f64::max);
                y[i][c] = if pivot > EXHAUSTED * largest { sum / pivot } else { 0.0 };
            }
        }
        let mut x = self.start.clone();
        for (v, y) in self.basis.iter().zip(&y) {
            for (x, v) in x.iter_mut().zip(v) {
                for c in 0..C {
                    x[c] += y[c] * v[c];
                }
            }
        }
        x
    }
}

/// A vector that orthogonalisation has shrunk by this factor is rounding noise.
const EXHAUSTED: f64 = 1e-13;

fn dot<const C: usize>(w: &[f64], a: &[[f64; C]], b: &[[f64; C]]) -> [f64; C] {
    let mut sum = [0.0; C];
    for ((w, a), b) in w.iter().zip(a).zip(b) {
        for c in 0..C {
            sum[c] += w * a[c] * b[c];
        }
    }
    sum
}

fn scaled<const C: usize>(mut v: Vec<[f64; C]>, norm: [f64; C]) -> Vec<[f64; C]> {
    let inverse = norm.map(|n| if n > 0.0 { 1.0 / n } else { 0.0 });
    v.iter_mut().for_each(|v| (0..C).for_each(|c| v[c] *= inverse[c]));
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_channels_with_different_matrices_converge_to_their_own_solutions() {
        let n = 12;
        let entry = |c: usize, i: usize, j: usize| {
            let shift = if i == j { 1.0 } else { 0.0 };
            shift - [0.5, 0.9][c] * (1.0 + ((i * 7 + j * 3) % 5) as f64) / 36.0
        };
        let times = |v: &[[f64; 2]]| -> Vec<[f64; 2]> {
            (0..n).map(|i| std::array::from_fn(|c| (0..n).map(|j| entry(c, i, j) * v[j][c]).sum())).collect()
        };
        let truth: Vec<[f64; 2]> = (0..n).map(|i| [i as f64, 1.0 - i as f64 * 0.3]).collect();
        let b = times(&truth);
        let start: Vec<[f64; 2]> = vec![[1.0, -1.0]; n];
        let residual: Vec<[f64; 2]> = times(&start).iter().zip(&b).map(|(a, b)| [b[0] - a[0], b[1] - a[1]]).collect();
        let mut solver = Gmres::new(start, residual, vec![0.5; n]);
        for _ in 0..n {
            let Some(direction) = solver.direction() else { break };
            let product = times(direction);
            solver.supply(product);
        }
        for (x, t) in solver.solution().iter().zip(&truth) {
            assert!((x[0] - t[0]).abs() < 1e-9 && (x[1] - t[1]).abs() < 1e-9, "{x:?} {t:?}");
        }
        assert!(solver.residual().iter().all(|r| *r < 1e-9));
    }

    #[test]
    fn a_channel_that_is_done_early_waits_for_the_other() {
        // channel 0 is solved after one step (A = identity), channel 1 needs all of them
        let n = 5;
        let entry = |c: usize, i: usize, j: usize| match c {
            0 => f64::from(u8::from(i == j)),
            _ => f64::from(u8::from(i == j)) + 0.1 * ((3 * i + 5 * j) % 7) as f64,
        };
        let times = |v: &[[f64; 2]]| -> Vec<[f64; 2]> {
            (0..n).map(|i| std::array::from_fn(|c| (0..n).map(|j| entry(c, i, j) * v[j][c]).sum())).collect()
        };
        let truth: Vec<[f64; 2]> = (0..n).map(|i| [i as f64 - 1.5, 2.0 - i as f64]).collect();
        let mut solver = Gmres::new(vec![[0.0; 2]; n], times(&truth), vec![1.0; n]);
        for _ in 0..3 * n {
            let Some(direction) = solver.direction() else { break };
            let product = times(direction);
            solver.supply(product);
        }
        for (x, t) in solver.solution().iter().zip(&truth) {
            assert!((x[0] - t[0]).abs() < 1e-9 && (x[1] - t[1]).abs() < 1e-9, "{x:?} {t:?}");
        }
    }

    #[test]
    fn a_zero_right_hand_side_is_already_solved() {
        let solver = Gmres::new(vec![[0.0]; 3], vec![[0.0]; 3], vec![1.0; 3]);
        assert!(solver.direction().is_none());
        assert_eq!(solver.solution(), vec![[0.0]; 3]);
    }
}
