//! Exact corrections along the open ends of surfaces, for the multilevel preconditioner.
//!
//! The few B-splines next to an open end are far from independent in the energy of a free edge: their diagonal alone
//! makes the condition number five times what it is inside. A strip of two functions along each open end is a banded
//! matrix, factored and solved exactly; where two strips cross each counts half.

use super::cholesky::{dot, start};
use crate::constraint::Functional;
use crate::energy::Operator;
use crate::system::Space;
use ondelette_wavelet::Boundary;

/// Functions across a strip.
const WIDTH: usize = 2;

/// The strips of one level.
#[derive(Clone, Debug, Default)]
pub(crate) struct Edges {
    strips: Vec<Strip>,
}

#[derive(Clone, Debug)]
struct Strip {
    /// Coefficients in the order of the factor, and the square root of what each counts.
    places: Vec<u32>,
    shares: Vec<f64>,
    /// Entries before the diagonal of a row, and the inverse pivot behind them.
    band: usize,
    rows: Vec<f64>,
    /// Which axis it ends, its first index across, positions along by index, and coefficients in a row of the surface.
    axis: usize,
    first: usize,
    along: Vec<u32>,
    width: usize,
    work: Vec<f64>,
}

impl Edges {
    /// The strips of a surface; none for curves and closed or mirrored axes.
    pub(crate) fn new(space: &Space, h: &Operator) -> Edges {
        let [s, t] = space.axes() else { return Edges::default() };
        let mut ends = Vec::new();
        for (axis, a) in [s, t].into_iter().enumerate() {
            if a.boundary() == Boundary::Open && a.len() > 2 * WIDTH {
                ends.extend([(axis, 0), (axis, a.len() - WIDTH)]);
            }
        }
        let counts = |i: usize, j: usize| -> f64 {
            let inside = |end: &&(usize, usize)| (end.1..end.1 + WIDTH).contains(&[i, j][end.0]);
            ends.iter().filter(inside).count() as f64
        };
        let strips = ends.iter().filter_map(|&(axis, first)| Strip::new(space, h, axis, first, &counts)).collect();
        Edges { strips }
    }

    /// True where nothing is corrected.
    pub(crate) fn is_empty(&self) -> bool {
        self.strips.is_empty()
    }

    /// Sets the inverse diagonal to zero where a strip takes over.
    pub(crate) fn take_over(&self, inverse: &mut [f64]) {
        self.strips.iter().flat_map(|s| &s.places).for_each(|i| inverse[*i as usize] = 0.0);
    }

    /// `g += E r`.
    pub(crate) fn add(&mut self, r: &[f64], g: &mut [f64]) {
        for strip in &mut self.strips {
            strip.work.clear();
            strip.work.extend(strip.places.iter().zip(&strip.shares).map(|(i, q)| q * r[*i as usize]));
            let mut x = std::mem::take(&mut strip.work);
            strip.forward(0, &mut x);
            strip.backward(&mut x);
            for ((i, q), v) in strip.places.iter().zip(&strip.shares).zip(&x) {
                g[*i as usize] += q * v;
            }
            strip.work = x;
        }
    }

    /// Adds E between functionals to a packed lower triangle.
    pub(crate) fn between(&self, functionals: &[Functional], out: &mut [f64]) {
        for strip in &self.strips {
            // Number of the functional, first position, and what is from there on.
            let mut seen: Vec<(usize, usize, Vec<f64>)> = Vec::new();
            for (k, f) in functionals.iter().enumerate() {
                let inside: Vec<(usize, f64)> =
                    f.entries().filter(|e| e.1 != 0.0).filter_map(|(i, v)| strip.position(i).map(|p| (p, v))).collect();
                let Some(first) = inside.iter().map(|e| e.0).min() else { continue };
                let mut x = vec![0.0; strip.places.len() - first];
                inside.iter().for_each(|&(p, v)| x[p - first] += strip.shares[p] * v);
                strip.forward(first, &mut x);
                seen.push((k, first, x));
            }
            for (a, (i, from, x)) in seen.iter().enumerate() {
                for (j, other, y) in &seen[..=a] {
                    let first = *from.max(other);
                    out[start(*i) + j] += dot(&x[first - from..], &y[first - other..]);
                }
            }
        }
    }
}

impl Strip {
    /// `None` where the strip has no factor.
    fn new(
        space: &Space,
        h: &Operator,
        axis: usize,
        first: usize,
        counts: &dyn Fn(usize, usize) -> f64,
    ) -> Option<Strip> {
        let other = &space.axes()[1 - axis];
        let n = other.len();
        // Closed strips are folded, so that neighbours across the seam stay near.
        let closed = other.boundary() == Boundary::Periodic;
        let along: Vec<u32> = (0..n as u32)
            .map(|j| match (closed, 2 * j < n as u32) {
                (false, _) => j,
                (true, true) => 2 * j,
                (true, false) => 2 * (n as u32 - 1 - j) + 1,
            })
            .collect();
        let width = space.shape()[1];
        let size = WIDTH * n;
        let (mut places, mut shares) = (vec![0; size], vec![0.0; size]);
        for (j, position) in along.iter().enumerate() {
            for k in 0..WIDTH {
                let (row, column) = if axis == 0 { (first + k, j) } else { (j, first + k) };
                let at = *position as usize * WIDTH + k;
                places[at] = (row * width + column) as u32;
                shares[at] = counts(row, column).recip().sqrt();
            }
        }
        let mut out = Strip { places, shares, band: 0, rows: Vec::new(), axis, first, along, width, work: Vec::new() };
        let mut entries: Vec<(usize, usize, f64)> = Vec::new();
        h.among(&out.places, &|i| out.position(i), &mut |r, c, v| entries.push((r.max(c), r.min(c), v)));
        let band = entries.iter().map(|e| e.0 - e.1).max()?;
        let stride = band + 1;
        let mut rows = vec![0.0; size * stride];
        entries.iter().for_each(|&(r, c, v)| rows[r * stride + c + band - r] += v);
        for i in 0..size {
            for j in i.saturating_sub(band)..=i {
                let from = i.saturating_sub(band).max(j.saturating_sub(band));
                let (a, b) = (i * stride + band - i, j * stride + band - j);
                let sum = rows[a + j] - (from..j).map(|k| rows[a + k] * rows[b + k]).sum::<f64>();
                rows[a + j] = if j < i {
                    sum * rows[b + j]
                } else if sum > 0.0 && sum.is_finite() {
                    sum.sqrt().recip()
                } else {
                    return None;
                };
            }
        }
        (out.band, out.rows) = (band, rows);
        Some(out)
    }

    /// The position of a coefficient of the surface in the strip.
    fn position(&self, i: usize) -> Option<usize> {
        let (row, column) = (i / self.width, i % self.width);
        let (across, along) = if self.axis == 0 { (row, column) } else { (column, row) };
        let k = across.checked_sub(self.first).filter(|k| *k < WIDTH)?;
        Some(self.along[along] as usize * WIDTH + k)
    }

    /// `x = L^-1 x` from position `first` on; zeros before it.
    fn forward(&self, first: usize, x: &mut [f64]) {
        let (band, stride) = (self.band, self.band + 1);
        for i in 0..x.len() {
            let row = &self.rows[(first + i) * stride..][..stride];
            let reach = i.min(band);
            let sum: f64 = row[band - reach..band].iter().zip(&x[i - reach..i]).map(|(l, x)| l * x).sum();
            x[i] = (x[i] - sum) * row[band];
        }
    }

    /// `x = L^-T x`.
    fn backward(&self, x: &mut [f64]) {
        let (band, stride) = (self.band, self.band + 1);
        for i in (0..x.len()).rev() {
            let row = &self.rows[i * stride..][..stride];
            let v = x[i] * row[band];
            x[i] = v;
            let reach = i.min(band);
            x[i - reach..i].iter_mut().zip(&row[band - reach..band]).for_each(|(x, l)| *x -= l * v);
        }
    }
}
