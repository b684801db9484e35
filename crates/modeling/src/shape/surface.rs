//! Uniform bicubic tensor B-spline surfaces.

use super::curve::{MOST_POINTS, ShapeError, checked, finer, open_axis};
use super::geometry::{ParametricSurface, SurfaceJet, ball};
use super::span;
use super::vector::{V, length};
use crate::axis::Axis;
use crate::basis::{self, Taps};
use ondelette_wavelet::Boundary;

/// A uniform bicubic B-spline surface of 1 (heights over the domain), 2 or 3 coordinates, with an own boundary and
/// number of spans in each direction.
///
/// ```
/// use ondelette_modeling::{Axis, shape::Surface};
/// use ondelette_wavelet::Boundary;
/// let s = Axis::new(Boundary::Open, 3, [0.0, 1.0])?;
/// let t = Axis::new(Boundary::Periodic, 8, [0.0, 1.0])?;
/// let heights = (0..6 * 8).map(|i| [f64::from(i / 8), 0.0, 0.0]).collect();
/// let field = Surface::new([s, t], 1, heights)?;
/// assert!((field.point(1.0, 0.3)[0] - 5.0).abs() < 1e-14);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    axes: [Axis; 2],
    dim: usize,
    points: Vec<[f64; 3]>,
}

impl Surface {
    /// The surface with the given control points, row-major: index `i * axes[1].len() + j`, `i` along s, `j` along t.
    ///
    /// # Errors
    /// [`ShapeError`].
    pub fn new(axes: [Axis; 2], dim: usize, points: Vec<[f64; 3]>) -> Result<Surface, ShapeError> {
        let want = axes[0].len().saturating_mul(axes[1].len());
        Ok(Surface { axes, dim, points: checked(dim, want, points)? })
    }

    /// The axes of s and t.
    pub fn axes(&self) -> &[Axis; 2] {
        &self.axes
    }

    /// Number of control points along s and along t.
    pub fn shape(&self) -> [usize; 2] {
        self.axes.map(|a| a.len())
    }

    /// Number of coordinates.
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// Control points, row-major; coordinates past [`Surface::dim`] are 0.
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// The value at `s, t` (domain units): for one coordinate the height alone.
    pub fn point(&self, s: f64, t: f64) -> [f64; 3] {
        self.derivative([s, t], [0, 0])
    }

    /// The mixed derivative of the given orders at `at` (s, t), in domain units.
    pub fn derivative(&self, at: [f64; 2], orders: [usize; 2]) -> [f64; 3] {
        let rows = [0, 1].map(|a| self.row(a, at[a], orders[a]));
        self.combine(&rows[0], &rows[1])
    }

    fn row(&self, axis: usize, t: f64, order: usize) -> Taps {
        basis::taps(&self.axes[axis], t, order)
    }

    fn combine(&self, s: &Taps, t: &Taps) -> V {
        let width = self.axes[1].len();
        let mut out = [0.0; 3];
        for (&i, &a) in s.index.iter().zip(&s.values) {
            let inner = span::combine(t, &self.points[i * width..][..width]);
            for c in 0..3 {
                out[c] += a * inner[c];
            }
        }
        out
    }

    /// The same surface with `2^levels` times as many spans in each direction. Linear time.
    ///
    /// # Errors
    /// [`ShapeError::TooFine`].
    pub fn refined(&self, levels: [usize; 2]) -> Result<Surface, ShapeError> {
        let axes = [finer(&self.axes[0], levels[0])?, finer(&self.axes[1], levels[1])?];
        let points = axes[0].len() as f64 * axes[1].len() as f64;
        if points > MOST_POINTS as f64 {
            return Err(ShapeError::TooFine { levels: levels[0].max(levels[1]), points, limit: MOST_POINTS });
        }
        let rows = [0, 1].map(|a| span::refining(&self.axes[a], &axes[a]));
        Ok(self.along(axes, &rows))
    }

    /// The same surface in the open basis in both directions.
    pub fn opened(&self) -> Surface {
        let axes = self.axes.map(|a| open_axis(&a).unwrap_or(a));
        if axes == self.axes {
            return self.clone();
        }
        let rows = [0, 1].map(|a| span::refining(&self.axes[a], &axes[a]));
        self.along(axes, &rows)
    }

    /// The surface in space that [`ParametricSurface`] sees, in the open basis: for one coordinate the graph
    /// (s, t, height), exactly.
    pub fn in_space(&self) -> Surface {
        let mut out = self.opened();
        if self.dim == 1 {
            out.dim = 3;
            let sites = out.axes.map(|a| span::greville(&a).into_iter().map(|u| a.from_knots(u)).collect::<Vec<_>>());
            let width = sites[1].len();
            for (k, p) in out.points.iter_mut().enumerate() {
                *p = [sites[0][k / width], sites[1][k % width], p[0]];
            }
        }
        out
    }

    fn along(&self, axes: [Axis; 2], rows: &[Vec<Taps>; 2]) -> Surface {
        Surface { axes, dim: self.dim, points: combine_grid(&self.points, self.axes[1].len(), rows) }
    }

    /// Bezier points of patch `i, j`, row-major by s. One coordinate gives heights alone.
    ///
    /// # Panics
    /// If there is no such patch.
    pub fn bezier(&self, i: usize, j: usize) -> [[[f64; 3]; 4]; 4] {
        let (rows, columns) = (span::bezier(&self.axes[0], i), span::bezier(&self.axes[1], j));
        rows.map(|r| columns.map(|c| self.combine(&r, &c)))
    }

    /// Bezier points of patch `i, j` in space: of the graph (s, t, height) if there is one coordinate.
    ///
    /// # Panics
    /// If there is no such patch.
    pub fn bezier_in_space(&self, i: usize, j: usize) -> [[[f64; 3]; 4]; 4] {
        let mut b = self.bezier(i, j);
        if self.dim == 1 {
            for (k, row) in b.iter_mut().enumerate() {
                let s = self.axes[0].from_knots(i as f64 + k as f64 / 3.0);
                for (l, p) in row.iter_mut().enumerate() {
                    *p = [s, self.axes[1].from_knots(j as f64 + l as f64 / 3.0), p[0]];
                }
            }
        }
        b
    }

    /// Whether a direction closes in space: periodic, and not the domain of a height field.
    fn closes(&self, axis: usize) -> bool {
        self.axes[axis].boundary() == Boundary::Periodic && self.dim > 1
    }
}

/// Applies rows along both directions of a row-major grid.
pub(crate) fn combine_grid(points: &[V], width: usize, rows: &[Vec<Taps>; 2]) -> Vec<V> {
    let mut half = Vec::with_capacity(points.len() / width * rows[1].len());
    for line in points.chunks(width) {
        half.extend(rows[1].iter().map(|r| span::combine(r, line)));
    }
    let width = rows[1].len();
    let mut out = Vec::with_capacity(rows[0].len() * width);
    for row in &rows[0] {
        out.extend((0..width).map(|j| {
            let mut sum = [0.0; 3];
            for (&i, &w) in row.index.iter().zip(&row.values) {
                let p = half[i * width + j];
                for c in 0..3 {
                    sum[c] += w * p[c];
                }
            }
            sum
        }));
    }
    out
}

impl ParametricSurface for Surface {
    fn domain(&self) -> [[f64; 2]; 2] {
        self.axes.map(|a| a.domain())
    }

    fn breaks(&self) -> [Vec<f64>; 2] {
        self.axes.map(|a| (0..=a.spans()).map(|i| a.from_knots(i as f64)).collect())
    }

    fn closed(&self) -> [bool; 2] {
        [self.closes(0), self.closes(1)]
    }

    fn jet(&self, s: f64, t: f64) -> SurfaceJet {
        let rows = [0, 1].map(|a| [0, 1, 2].map(|order| self.row(a, [s, t][a], order)));
        let of = |a: usize, b: usize| self.combine(&rows[0][a], &rows[1][b]);
        let mut jet =
            SurfaceJet { point: of(0, 0), first: [of(1, 0), of(0, 1)], second: [of(2, 0), of(1, 1), of(0, 2)] };
        if self.dim == 1 {
            jet.point = [s, t, jet.point[0]];
            jet.first = [[1.0, 0.0, jet.first[0][0]], [0.0, 1.0, jet.first[1][0]]];
            jet.second = jet.second.map(|d| [0.0, 0.0, d[0]]);
        }
        jet
    }

    fn ball(&self, i: usize, j: usize) -> ([f64; 3], f64) {
        ball(self.bezier_in_space(i, j).as_flattened())
    }

    fn bend(&self, i: usize, j: usize) -> [f64; 3] {
        let b = self.bezier_in_space(i, j);
        let [ds, dt] = self.axes.map(|a| a.density());
        let mut out = [0.0_f64; 3];
        let bound = |slot: &mut f64, v: V, by: f64| *slot = slot.max(length(v) * by);
        for k in 0..4 {
            for l in 0..4 {
                let d = |f: &dyn Fn(usize) -> f64| -> V { std::array::from_fn(f) };
                if k < 2 {
                    let v = d(&|c| b[k][l][c] - 2.0 * b[k + 1][l][c] + b[k + 2][l][c]);
                    bound(&mut out[0], v, 6.0 * ds * ds);
                }
                if k < 3 && l < 3 {
                    let v = d(&|c| b[k][l][c] - b[k + 1][l][c] - b[k][l + 1][c] + b[k + 1][l + 1][c]);
                    bound(&mut out[1], v, 9.0 * ds * dt);
                }
                if l < 2 {
                    let v = d(&|c| b[k][l][c] - 2.0 * b[k][l + 1][c] + b[k][l + 2][c]);
                    bound(&mut out[2], v, 6.0 * dt * dt);
                }
            }
        }
        out
    }
}
