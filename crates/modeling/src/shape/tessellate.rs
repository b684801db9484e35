//! Polylines and triangle meshes that stay within a distance of the shape.

use super::geometry::{ParametricCurve, ParametricSurface};
use super::vector::{V, add, cross, sub, unit};

/// Points on a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyline {
    /// Parameters, increasing.
    pub parameters: Vec<f64>,
    /// Points; the last of a closed curve repeats the first.
    pub points: Vec<[f64; 3]>,
}

/// Triangles on a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Vertices along s and t; closed directions are joined by the triangles and repeat no vertex.
    pub shape: [usize; 2],
    /// Parameters s, t of each vertex.
    pub parameters: Vec<[f64; 2]>,
    /// Vertices, row-major.
    pub points: Vec<[f64; 3]>,
    /// Unit normals of the surface; where it has none, the mean of the triangles around.
    pub normals: Vec<[f64; 3]>,
    /// Vertices of each triangle, counter-clockwise seen against the normal.
    pub triangles: Vec<[u32; 3]>,
}

/// Why there is no tessellation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TessellateError {
    /// A tolerance that is not a positive number.
    #[error("tolerance {0}: give a positive distance")]
    Tolerance(f64),
    /// Too many vertices.
    #[error("tolerance {tolerance:e} needs {vertices:.2e} vertices, more than {limit}: allow a larger distance")]
    TooFine {
        /// Distance asked for.
        tolerance: f64,
        /// Vertices that it needs.
        vertices: f64,
        /// Most that are made.
        limit: usize,
    },
}

/// Most vertices of a tessellation.
const MOST: usize = 20_000_000;

fn check(tolerance: f64) -> Result<(), TessellateError> {
    if tolerance > 0.0 && tolerance.is_finite() { Ok(()) } else { Err(TessellateError::Tolerance(tolerance)) }
}

fn limit(tolerance: f64, vertices: f64) -> Result<(), TessellateError> {
    if vertices <= MOST as f64 {
        return Ok(());
    }
    Err(TessellateError::TooFine { tolerance, vertices, limit: MOST })
}

/// Cuts every interval into the given numbers of equal parts.
fn cut(breaks: &[f64], parts: &[f64]) -> Vec<f64> {
    let mut out = vec![breaks[0]];
    for (ends, &n) in breaks.windows(2).zip(parts) {
        out.extend(
            (1..=n as usize)
                .map(|k| if k as f64 == n { ends[1] } else { ends[0] + (ends[1] - ends[0]) * (k as f64 / n) }),
        );
    }
    out
}

pub(super) fn curve<C: ParametricCurve + ?Sized>(curve: &C, tolerance: f64) -> Result<Polyline, TessellateError> {
    check(tolerance)?;
    let breaks = curve.breaks();
    // A chord over h leaves a curve by at most h^2 max|C''| / 8.
    let parts: Vec<f64> = (0..breaks.len() - 1)
        .map(|i| ((breaks[i + 1] - breaks[i]) * (curve.bend(i) / (8.0 * tolerance)).sqrt()).ceil().max(1.0))
        .collect();
    limit(tolerance, parts.iter().sum())?;
    let parameters = cut(&breaks, &parts);
    let mut points: Vec<V> = parameters.iter().map(|&t| curve.jet(t).point).collect();
    if curve.closed() {
        let last = points.len() - 1;
        points[last] = points[0];
    }
    Ok(Polyline { parameters, points })
}

pub(super) fn surface<S: ParametricSurface + ?Sized>(surface: &S, tolerance: f64) -> Result<Mesh, TessellateError> {
    check(tolerance)?;
    let breaks = surface.breaks();
    let spans = [breaks[0].len() - 1, breaks[1].len() - 1];
    // A triangle of a hs x ht cell leaves the surface by at most (hs^2 Mss + 2 hs ht Mst + ht^2 Mtt) / 8; with
    // 2 hs ht <= hs^2 q + ht^2 / q each direction gets half of the tolerance. q: squared ratio of the widths.
    let widths = [0, 1].map(|a| (breaks[a][spans[a]] - breaks[a][0]) / spans[a] as f64);
    let q = widths[1] / widths[0];
    let mut bend = [vec![0.0_f64; spans[0]], vec![0.0_f64; spans[1]]];
    for i in 0..spans[0] {
        for j in 0..spans[1] {
            let [ss, st, tt] = surface.bend(i, j);
            bend[0][i] = bend[0][i].max(ss + q * st);
            bend[1][j] = bend[1][j].max(tt + st / q);
        }
    }
    let parts = [0, 1].map(|a| -> Vec<f64> {
        let parts = |i: usize| (breaks[a][i + 1] - breaks[a][i]) * (bend[a][i] / (4.0 * tolerance)).sqrt();
        (0..spans[a]).map(|i| parts(i).ceil().max(1.0)).collect()
    });
    let total = |a: usize| parts[a].iter().sum::<f64>() + 1.0;
    limit(tolerance, total(0) * total(1))?;
    Ok(grid(surface, [cut(&breaks[0], &parts[0]), cut(&breaks[1], &parts[1])]))
}

pub(super) fn even<S: ParametricSurface + ?Sized>(surface: &S, parts: usize) -> Mesh {
    let breaks = surface.breaks();
    let parts = [0, 1].map(|a| vec![parts as f64; breaks[a].len() - 1]);
    grid(surface, [cut(&breaks[0], &parts[0]), cut(&breaks[1], &parts[1])])
}

/// The mesh over a grid of parameters.
fn grid<S: ParametricSurface + ?Sized>(surface: &S, parameters: [Vec<f64>; 2]) -> Mesh {
    let closed = surface.closed();
    let shape: [usize; 2] = std::array::from_fn(|a| parameters[a].len() - usize::from(closed[a]));
    let mut mesh = Mesh {
        shape,
        parameters: Vec::with_capacity(shape[0] * shape[1]),
        points: Vec::with_capacity(shape[0] * shape[1]),
        normals: Vec::with_capacity(shape[0] * shape[1]),
        triangles: Vec::new(),
    };
    let mut missing = Vec::new();
    for &s in &parameters[0][..shape[0]] {
        for &t in &parameters[1][..shape[1]] {
            let jet = surface.jet(s, t);
            mesh.parameters.push([s, t]);
            mesh.points.push(jet.point);
            mesh.normals.push(jet.normal().unwrap_or_else(|| {
                missing.push(mesh.points.len() - 1);
                [0.0; 3]
            }));
        }
    }
    let at = |i: usize, j: usize| ((i % shape[0]) * shape[1] + j % shape[1]) as u32;
    for i in 0..parameters[0].len() - 1 {
        for j in 0..parameters[1].len() - 1 {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            mesh.triangles.push([a, b, c]);
            mesh.triangles.push([a, c, d]);
        }
    }
    if !missing.is_empty() {
        mend_normals(&mut mesh, &missing);
    }
    mesh
}

/// Gives the vertices without a normal the mean of their triangles, or z.
fn mend_normals(mesh: &mut Mesh, missing: &[usize]) {
    for triangle in &mesh.triangles {
        let corners = triangle.map(|v| v as usize);
        if corners.iter().all(|v| missing.binary_search(v).is_err()) {
            continue;
        }
        let [a, b, c] = corners.map(|v| mesh.points[v]);
        let area = cross(sub(b, a), sub(c, a));
        for v in corners {
            if missing.binary_search(&v).is_ok() {
                mesh.normals[v] = add(mesh.normals[v], area);
            }
        }
    }
    for &v in missing {
        mesh.normals[v] = unit(mesh.normals[v]).unwrap_or([0.0, 0.0, 1.0]);
    }
}
