//! The picture of a curve.

use super::camera::View;
use super::canvas::{Canvas, P};
use super::{Mark, Picture};
use ondelette_modeling::shape::ParametricCurve;

/// What to draw besides the curves.
#[derive(Clone, Debug)]
pub struct CurvePicture {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Curvature comb: quills as long as the curvature, and the line over them.
    pub comb: bool,
    /// Control points, joined by a faint line.
    pub control: Vec<[f64; 3]>,
    /// Whether the last control point is joined to the first.
    pub control_closed: bool,
    /// Constraints.
    pub marks: Vec<Mark>,
    /// Whether y points down.
    pub y_down: bool,
}

impl Default for CurvePicture {
    fn default() -> CurvePicture {
        CurvePicture {
            size: [1200, 900],
            comb: false,
            control: Vec::new(),
            control_closed: false,
            marks: Vec::new(),
            y_down: false,
        }
    }
}

const PAPER: [f32; 3] = [0.992, 0.99, 0.985];
const INK: [f32; 3] = [0.09, 0.17, 0.33];
const FAINT: [f32; 3] = [0.62, 0.64, 0.68];
const POINT: [f32; 3] = [0.90, 0.45, 0.05];
const DIRECTION: [f32; 3] = [0.05, 0.52, 0.38];
const QUILL: [f32; 3] = [0.68, 0.25, 0.55];

/// Angle that a curve may turn between quills of its comb.
const TURN: f64 = 0.05;

/// Draws curves: flat ones from above, others from a corner.
pub fn curve(curves: &[&dyn ParametricCurve], with: &CurvePicture) -> Picture {
    let mut canvas = Canvas::new(with.size[0], with.size[1], PAPER);
    let fine: Vec<Vec<(f64, [f64; 3])>> = curves.iter().map(|c| samples(*c)).collect();
    let flat = fine.iter().flatten().all(|p| p.1[2] == 0.0);
    let view = if flat { View::flat(with.y_down) } else { View::from(-60.0, 25.0) };
    let marked = with.marks.iter().map(|m| match *m {
        Mark::Point(p) | Mark::Soft(p, _) | Mark::Direction(p, _) => p,
    });
    let shown = || fine.iter().flatten().map(|p| p.1).chain(marked.clone());
    let combs = if with.comb { combs(curves, &fine) } else { Vec::new() };
    let tips = combs.iter().flatten().flat_map(|q| [q.0, q.1]);
    let view = view.framing(shown().chain(tips).chain(with.control.iter().copied()), with.size, 60.0);
    let at = |p: [f64; 3]| view.flat_point(p);
    let mut control: Vec<P> = with.control.iter().map(|p| at(*p)).collect();
    if with.control_closed
        && let Some(&first) = control.first()
    {
        control.push(first);
    }
    canvas.line(&control, 1.2, FAINT, 0.7);
    // dots that would touch each other say nothing
    let crowded = control.windows(2).filter(|w| (w[0][0] - w[1][0]).hypot(w[0][1] - w[1][1]) < 9.0).count();
    // nor do those that lie on the curve
    let drawn: Vec<P> = fine.iter().flatten().map(|p| at(p.1)).collect();
    let apart = |p: &P| drawn.iter().all(|q| (p[0] - q[0]).hypot(p[1] - q[1]) > 7.0);
    if 2 * crowded <= control.len() && 2 * control.iter().filter(|p| apart(p)).count() > control.len() {
        control.iter().for_each(|p| canvas.disc(*p, 2.6, FAINT));
    }
    for comb in &combs {
        let lines: Vec<P> = comb.iter().map(|q| at(q.1)).collect();
        for (k, q) in comb.iter().enumerate() {
            if k % 4 == 0 {
                canvas.line(&[at(q.0), at(q.1)], 1.0, QUILL, 0.45);
            }
        }
        canvas.line(&lines, 1.4, QUILL, 0.9);
    }
    for points in &fine {
        let line: Vec<P> = points.iter().map(|p| at(p.1)).collect();
        canvas.line(&line, 2.8, INK, 1.0);
    }
    for mark in &with.marks {
        match *mark {
            Mark::Direction(p, d) => {
                let size = d.iter().map(|x| x * x).sum::<f64>().sqrt();
                if size > 0.0 {
                    let tip = std::array::from_fn(|c| p[c] + d[c] / size * 52.0 / view.scale);
                    canvas.arrow(at(p), at(tip), 2.2, DIRECTION);
                }
            }
            Mark::Soft(p, q) => {
                canvas.line(&[at(p), at(q)], 1.4, POINT, 0.8);
                canvas.ring(at(p), 5.0, 1.8, POINT);
            }
            Mark::Point(_) => {}
        }
    }
    for mark in &with.marks {
        if let Mark::Point(p) = *mark {
            canvas.disc(at(p), 7.0, PAPER);
            canvas.disc(at(p), 5.5, POINT);
        }
    }
    canvas.finish()
}

/// Samples dense enough for a picture: 24 and more a piece, in all at least 600.
fn samples(curve: &dyn ParametricCurve) -> Vec<(f64, [f64; 3])> {
    let breaks = curve.breaks();
    let each = (600 / (breaks.len() - 1)).clamp(8, 400);
    let mut out = vec![(breaks[0], curve.jet(breaks[0]).point)];
    for w in breaks.windows(2) {
        for k in 1..=each {
            let t = w[0] + (w[1] - w[0]) * k as f64 / each as f64;
            out.push((t, curve.jet(t).point));
        }
    }
    out
}

/// Foot and tip of quills, against the curvature vector, the longest a fifth of the size of the drawing.
fn combs(curves: &[&dyn ParametricCurve], fine: &[Vec<(f64, [f64; 3])>]) -> Vec<Vec<([f64; 3], [f64; 3])>> {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for (_, p) in fine.iter().flatten() {
        for c in 0..3 {
            low[c] = low[c].min(p[c]);
            high[c] = high[c].max(p[c]);
        }
    }
    let size = (0..3).map(|c| (high[c] - low[c]).powi(2)).sum::<f64>().sqrt();
    let quills: Vec<Vec<([f64; 3], [f64; 3])>> = curves
        .iter()
        .zip(fine)
        .map(|(curve, points)| {
            let step = (points.len() / 480).max(1);
            let ends = points.len().saturating_sub(1);
            // Evenly, and wherever the curve has turned by a few degrees: noses would look like polygons.
            let mut last = [0.0; 3];
            let chosen = points.iter().enumerate().filter(|&(i, (_, p))| {
                let near = points[(i + 1).min(ends)].1;
                let chord: [f64; 3] = std::array::from_fn(|c| near[c] - p[c]);
                let length = chord.iter().map(|x| x * x).sum::<f64>().sqrt();
                let chord = chord.map(|x| if length > 0.0 { x / length } else { 0.0 });
                let turned = chord.iter().zip(&last).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt() > TURN;
                let take = i % step == 0 || i == ends || turned;
                if take {
                    last = chord;
                }
                take
            });
            chosen.filter_map(|(_, (t, p))| curve.jet(*t).curvature_vector().map(|k| (*p, k))).collect()
        })
        .collect();
    // A sharp nose should not flatten everything else: the scale is set by the 95th percentile.
    let mut sizes: Vec<f64> = quills.iter().flatten().map(|q| q.1.iter().map(|x| x * x).sum::<f64>().sqrt()).collect();
    sizes.sort_by(f64::total_cmp);
    let usual = sizes.get(sizes.len() * 95 / 100).copied().unwrap_or(0.0);
    let by = if usual > 0.0 { 0.16 * size / usual } else { 0.0 };
    let most = 0.35 * size;
    let tip = |p: [f64; 3], k: [f64; 3]| {
        let length = k.iter().map(|x| x * x).sum::<f64>().sqrt() * by;
        let by = if length > most { by * most / length } else { by };
        std::array::from_fn(|c| p[c] - by * k[c])
    };
    quills.into_iter().map(|q| q.into_iter().map(|(p, k)| (p, tip(p, k))).collect()).collect()
}
