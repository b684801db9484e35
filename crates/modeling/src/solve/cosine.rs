//! Cosine and Hartley transforms of grids: what diagonalises the energies of mirrored and periodic axes.
//!
//! Mirrored axes of n spans: `y_k = sum' x_j cos(pi j k / n)`, first and last term halved (DCT-I). Periodic axes:
//! `y_k = sum x_j (cos + sin)(2 pi j k / n)`. Two rows travel through one complex transform of length n.

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};
use std::sync::Arc;

use ondelette_wavelet::Boundary;

/// The transform of one axis.
#[derive(Clone)]
pub(crate) struct Cosine {
    boundary: Boundary,
    spans: usize,
    n: usize,
    fft: Arc<dyn Fft<f64>>,
    /// sin and cos of pi j / n.
    sines: Vec<(f64, f64)>,
}

impl std::fmt::Debug for Cosine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Cosine").field("boundary", &self.boundary).field("spans", &self.spans).finish_non_exhaustive()
    }
}

/// Buffers of a transform.
#[derive(Clone, Debug, Default)]
pub(crate) struct Buffers {
    line: Vec<Complex<f64>>,
    scratch: Vec<Complex<f64>>,
}

impl Cosine {
    /// # Panics
    /// On open axes, which have no such transform.
    pub(crate) fn new(boundary: Boundary, spans: usize) -> Cosine {
        assert!(boundary != Boundary::Open, "open axes have no cosine transform");
        let mirrored = boundary == Boundary::Mirrored;
        // Mirrored axes with an odd number of spans take the even continuation as it is.
        let length = if mirrored && spans % 2 == 1 { 2 * spans } else { spans };
        let n = if mirrored { spans + 1 } else { spans };
        let sines = (0..=spans).map(|j| (std::f64::consts::PI * j as f64 / spans as f64).sin_cos()).collect();
        Cosine { boundary, spans, n, fft: FftPlanner::new().plan_fft_forward(length), sines }
    }

    /// What applying the transform twice multiplies by (mirrored: after doubling the ends in between as `ends` does).
    pub(crate) fn square(&self) -> f64 {
        if self.boundary == Boundary::Mirrored { self.spans as f64 / 2.0 } else { self.spans as f64 }
    }

    /// 2 at the ends of mirrored axes, else 1.
    pub(crate) fn ends(&self, j: usize) -> f64 {
        if self.boundary == Boundary::Mirrored && (j == 0 || j + 1 == self.n) { 2.0 } else { 1.0 }
    }

    /// Angle of mode `k`.
    pub(crate) fn angle(&self, k: usize) -> f64 {
        let step = if self.boundary == Boundary::Mirrored { 1.0 } else { 2.0 };
        std::f64::consts::PI * step * k as f64 / self.spans as f64
    }

    /// Transforms every row of `n` values in place.
    pub(crate) fn rows(&self, data: &mut [f64], buffers: &mut Buffers) {
        buffers.line.resize(self.fft.len(), Complex::default());
        buffers.scratch.resize(self.fft.get_inplace_scratch_len(), Complex::default());
        for pair in data.chunks_mut(2 * self.n) {
            if pair.len() == 2 * self.n {
                let (a, b) = pair.split_at_mut(self.n);
                self.pair(a, b, buffers);
            } else {
                let mut zero = vec![0.0; self.n];
                self.pair(pair, &mut zero, buffers);
            }
        }
    }

    fn pair(&self, a: &mut [f64], b: &mut [f64], buffers: &mut Buffers) {
        let n = self.spans;
        let line = &mut buffers.line[..];
        let fft = |line: &mut [Complex<f64>], scratch: &mut [Complex<f64>]| {
            self.fft.process_with_scratch(line, scratch);
        };
        if self.boundary == Boundary::Periodic {
            for (z, (x, y)) in line.iter_mut().zip(a.iter().zip(b.iter())) {
                *z = Complex::new(*x, *y);
            }
            fft(line, &mut buffers.scratch);
            for k in 0..n {
                let (p, q) = (line[k], line[(n - k) % n].conj());
                // spectra of a and b; Hartley = real - imaginary part
                let (sum, difference) = (p + q, p - q);
                a[k] = 0.5 * (sum.re - sum.im);
                b[k] = 0.5 * (difference.im + difference.re);
            }
            return;
        }
        if line.len() == 2 * n {
            for j in 0..2 * n {
                let i = j.min(2 * n - j);
                line[j] = Complex::new(a[i], b[i]);
            }
            fft(line, &mut buffers.scratch);
            for k in 0..=n {
                a[k] = 0.5 * line[k].re;
                b[k] = 0.5 * line[k].im;
            }
            return;
        }
        // Even n: half the length, by the splitting of Numerical Recipes 12.4 (cosft1).
        let (mut first_a, mut first_b) = (0.5 * (a[0] - a[n]), 0.5 * (b[0] - b[n]));
        line[0] = Complex::new(0.5 * (a[0] + a[n]), 0.5 * (b[0] + b[n]));
        for j in 1..n {
            let (sin, cos) = self.sines[j];
            let (x, y) = (a[j], b[j]);
            let (u, v) = (a[n - j], b[n - j]);
            line[j] = Complex::new(0.5 * (x + u) - sin * (x - u), 0.5 * (y + v) - sin * (y - v));
            first_a += x * cos;
            first_b += y * cos;
        }
        fft(line, &mut buffers.scratch);
        let half = n / 2;
        a[1] = first_a;
        b[1] = first_b;
        for k in 0..=half {
            let (p, q) = (line[k], line[(n - k) % n].conj());
            let (sum, difference) = (p + q, p - q);
            // spectrum of a: sum / 2; of b: difference / 2i
            a[2 * k] = 0.5 * sum.re;
            b[2 * k] = 0.5 * difference.im;
            if k > 0 && k < half {
                a[2 * k + 1] = a[2 * k - 1] - 0.5 * sum.im;
                b[2 * k + 1] = b[2 * k - 1] + 0.5 * difference.re;
            }
        }
    }
}

/// `out[j][i] = x[i][j]` for `rows` rows, in square blocks.
pub(crate) fn transpose(x: &[f64], rows: usize, out: &mut [f64]) {
    const B: usize = 16;
    let cols = x.len() / rows;
    for i0 in (0..rows).step_by(B) {
        for j0 in (0..cols).step_by(B) {
            for i in i0..(i0 + B).min(rows) {
                for j in j0..(j0 + B).min(cols) {
                    out[j * rows + i] = x[i * cols + j];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transforms_are_the_sums_they_stand_for() {
        for boundary in [Boundary::Mirrored, Boundary::Periodic] {
            for spans in [1, 2, 3, 4, 5, 8, 13, 16, 30] {
                let c = Cosine::new(boundary, spans);
                let n = c.n;
                for rows in [1, 2, 3] {
                    let x: Vec<f64> =
                        (0..rows * n).map(|i| ondelette_numerics::seed::unit(i as u64 + 5) - 0.5).collect();
                    let mut y = x.clone();
                    c.rows(&mut y, &mut Buffers::default());
                    for r in 0..rows {
                        for k in 0..n {
                            let want: f64 = (0..n)
                                .map(|j| {
                                    let angle = c.angle(k) * j as f64;
                                    let wave = match boundary {
                                        Boundary::Mirrored => angle.cos() / c.ends(j),
                                        _ => angle.cos() + angle.sin(),
                                    };
                                    x[r * n + j] * wave
                                })
                                .sum();
                            assert!((y[r * n + k] - want).abs() < 1e-12, "{boundary:?} {spans} {r} {k}");
                        }
                    }
                }
            }
        }
    }
}
