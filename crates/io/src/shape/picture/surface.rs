//! The picture of a surface: a depth buffer, soft light, zebra stripes.

use super::camera::{View, dot};
use super::canvas::{Canvas, Color};
use super::{Mark, Picture};
use ondelette_modeling::shape::Mesh;

/// What to draw besides the surface.
#[derive(Clone, Debug)]
pub struct SurfacePicture {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Stripes of a striped room that mirrors in the surface: breaks and kinks in them are breaks and kinks in
    /// curvature and slope.
    pub zebra: bool,
    /// Constraints.
    pub marks: Vec<Mark>,
    /// Direction of view: azimuth and elevation in degrees.
    pub view: [f64; 2],
}

impl Default for SurfacePicture {
    fn default() -> SurfacePicture {
        SurfacePicture { size: [1200, 900], zebra: false, marks: Vec::new(), view: [-55.0, 32.0] }
    }
}

/// Samples a pixel has in each direction.
const FINE: usize = 2;
const CLAY: [f64; 3] = [0.60, 0.66, 0.74];
const BACK: [f64; 3] = [0.74, 0.62, 0.50];
const POINT: Color = [0.90, 0.45, 0.05];
const DIRECTION: Color = [0.05, 0.52, 0.38];

fn unit(a: [f64; 3]) -> [f64; 3] {
    let n = dot(a, a).sqrt();
    if n > 0.0 { a.map(|x| x / n) } else { [0.0, 0.0, 1.0] }
}

/// Draws a mesh of a surface with its marks.
pub fn surface(mesh: &Mesh, with: &SurfacePicture) -> Picture {
    let [width, height] = with.size.map(|n| n * FINE);
    let marked = with.marks.iter().map(|m| match *m {
        Mark::Point(p) | Mark::Soft(p, _) | Mark::Direction(p, _) => p,
    });
    let view = View::from(with.view[0], with.view[1]);
    let view = view.framing(mesh.points.iter().copied().chain(marked), [width, height], 50.0 * FINE as f64);
    let mut fine = Canvas::new(width, height, [0.0; 3]);
    for y in 0..height {
        let w = y as f32 / height as f32;
        let color = [0.985 - 0.06 * w, 0.985 - 0.055 * w, 0.985 - 0.045 * w];
        fine.pixels[y * width..(y + 1) * width].fill(color);
    }
    let mut depth = vec![f64::NEG_INFINITY; width * height];
    let projected: Vec<[f64; 3]> = mesh.points.iter().map(|p| view.project(*p)).collect();
    for t in &mesh.triangles {
        let corners = t.map(|v| projected[v as usize]);
        let normals = t.map(|v| mesh.normals[v as usize]);
        fill(&mut fine, &mut depth, corners, |w| {
            let n: [f64; 3] = std::array::from_fn(|c| (0..3).map(|k| w[k] * normals[k][c]).sum());
            shade(unit(n), view.back, with.zebra)
        });
    }
    border_lines(mesh, &view, &mut fine, &depth);
    let mut out = Canvas::new(with.size[0], with.size[1], [0.0; 3]);
    for y in 0..out.height {
        for x in 0..out.width {
            let mut sum = [0.0_f32; 3];
            for k in 0..FINE * FINE {
                let p = fine.pixels[(y * FINE + k / FINE) * width + x * FINE + k % FINE];
                sum = std::array::from_fn(|c| sum[c] + p[c] / (FINE * FINE) as f32);
            }
            out.pixels[y * out.width + x] = sum;
        }
    }
    marks(with, &view, &depth, width, &mut out);
    out.finish()
}

/// Fills a triangle where it is nearest; `color` gets barycentric weights.
fn fill(canvas: &mut Canvas, depth: &mut [f64], c: [[f64; 3]; 3], color: impl Fn([f64; 3]) -> Color) {
    let cross = |a: [f64; 3], b: [f64; 3], p: [f64; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
    let area = cross(c[0], c[1], [c[2][0], c[2][1]]);
    if area.is_nan() || area.abs() <= 1e-12 {
        return;
    }
    let bound = |k: usize, f: fn(f64, f64) -> f64| f(f(c[0][k], c[1][k]), c[2][k]);
    let side = |x: f64, n: usize| x.clamp(0.0, n as f64) as usize;
    for y in side(bound(1, f64::min).floor(), canvas.height)..side(bound(1, f64::max).ceil() + 1.0, canvas.height) {
        for x in side(bound(0, f64::min).floor(), canvas.width)..side(bound(0, f64::max).ceil() + 1.0, canvas.width) {
            let p = [x as f64 + 0.5, y as f64 + 0.5];
            let w = [cross(c[1], c[2], p) / area, cross(c[2], c[0], p) / area, cross(c[0], c[1], p) / area];
            // a hair outside, so that neighbours leave no seam
            if w.iter().any(|w| *w < -1e-9) {
                continue;
            }
            let z = w[0] * c[0][2] + w[1] * c[1][2] + w[2] * c[2][2];
            let at = y * canvas.width + x;
            if z > depth[at] {
                depth[at] = z;
                canvas.pixels[at] = color(w);
            }
        }
    }
}

/// Light on a surface with this normal, seen from `eye`; the two sides differ.
fn shade(normal: [f64; 3], eye: [f64; 3], zebra: bool) -> Color {
    let front = dot(normal, eye) >= 0.0;
    let n = if front { normal } else { normal.map(|x| -x) };
    let facing = dot(n, eye).max(0.0);
    if zebra {
        // the direction that mirrors into the eye, and its angle about a level axis across the view
        let r: [f64; 3] = std::array::from_fn(|c| 2.0 * facing * n[c] - eye[c]);
        let across = unit([-eye[1], eye[0], 0.0]);
        let along = [-across[1], across[0], 0.0];
        let angle = dot(r, along).atan2(r[2]);
        let wave = (angle * 14.0).sin();
        let stripe = 0.5 + 0.5 * (wave * 6.0).clamp(-1.0, 1.0);
        let light = (0.16 + 0.80 * stripe) * (0.55 + 0.45 * facing);
        let tint = if front { [1.0, 1.0, 1.0] } else { [1.0, 0.93, 0.84] };
        return tint.map(|t: f64| (t * light) as f32);
    }
    let lamp = |from: [f64; 3]| dot(n, unit(from)).max(0.0);
    let (key, fill) = (lamp([eye[0] - 0.9 * eye[1] + 0.2, eye[1] + 0.9 * eye[0], 1.3]), lamp([-1.0, -0.6, 0.5]));
    let gleam: [f64; 3] = std::array::from_fn(|c| 2.0 * facing * n[c] - eye[c]);
    let gleam = dot(gleam, unit([eye[0] - 0.5 * eye[1], eye[1] + 0.5 * eye[0], 1.4])).max(0.0).powi(24);
    let base = if front { CLAY } else { BACK };
    let light = 0.24 + 0.72 * key + 0.14 * fill;
    base.map(|c| (c * light + 0.16 * gleam).powf(1.0 / 1.25) as f32)
}

/// Draws the rims of the surface where nothing is in front of them.
fn border_lines(mesh: &Mesh, view: &View, canvas: &mut Canvas, depth: &[f64]) {
    let [n, m] = mesh.shape;
    // a closed direction joins its ends: there is no rim across it
    let joined = |a: usize, b: usize| mesh.triangles.iter().any(|t| t.contains(&(a as u32)) && t.contains(&(b as u32)));
    let (closed_s, closed_t) = (n > 2 && joined(0, (n - 1) * m), m > 2 && joined(0, m - 1));
    let mut rims: Vec<Vec<usize>> = Vec::new();
    if !closed_s {
        rims.push((0..m).collect());
        rims.push(((n - 1) * m..n * m).collect());
    }
    if !closed_t {
        rims.push((0..n).map(|i| i * m).collect());
        rims.push((0..n).map(|i| i * m + m - 1).collect());
    }
    let (width, height) = (canvas.width, canvas.height);
    let bias = 0.004 * width as f64;
    for rim in rims {
        let seen = |p: [f64; 3]| {
            let (x, y) = (p[0] as usize, p[1] as usize);
            x < width && y < height && p[2] >= depth[y * width + x] - bias
        };
        let mut run = Vec::new();
        for v in rim {
            let p = view.project(mesh.points[v]);
            if seen(p) {
                run.push([p[0], p[1]]);
            } else {
                canvas.line(&std::mem::take(&mut run), 2.2, [0.16, 0.19, 0.25], 0.85);
            }
        }
        canvas.line(&run, 2.2, [0.16, 0.19, 0.25], 0.85);
    }
}

fn marks(with: &SurfacePicture, view: &View, depth: &[f64], width: usize, out: &mut Canvas) {
    let fine = FINE as f64;
    let bias = 0.006 * width as f64;
    let place = |p: [f64; 3]| {
        let [x, y, z] = view.project(p);
        let (i, j) = (x.max(0.0) as usize, y.max(0.0) as usize);
        let hidden = i < width && j * width + i < depth.len() && z < depth[j * width + i] - bias;
        ([x / fine, y / fine], hidden)
    };
    for mark in &with.marks {
        match *mark {
            Mark::Direction(p, d) => {
                let size = dot(d, d).sqrt();
                if size > 0.0 && !place(p).1 {
                    let tip = std::array::from_fn(|c| p[c] + d[c] / size * 50.0 * fine / view.scale);
                    out.arrow(place(p).0, place(tip).0, 2.0, DIRECTION);
                }
            }
            Mark::Soft(p, q) => {
                out.line(&[place(p).0, place(q).0], 1.3, POINT, 0.8);
                out.ring(place(p).0, 4.0, 1.5, POINT);
            }
            Mark::Point(p) => {
                let (at, hidden) = place(p);
                if hidden {
                    // behind the surface: a faint ring says that it is there
                    out.ring(at, 4.0, 1.2, [0.78, 0.70, 0.62]);
                } else {
                    out.disc(at, 6.0, [1.0; 3]);
                    out.disc(at, 4.6, POINT);
                }
            }
        }
    }
}
