//! SVG paths: every `d` of a file, with the transforms around it; and curves out as exact cubic Bezier paths.
//!
//! Numbers are taken as they stand; SVG's y points down. Files written here of curves whose y points up say so (a
//! mirrored group that readers elsewhere show the right way up, marked with `data-ondelette-y`), so nothing is ever
//! turned over: y of all that is in such a group points up in the picture as others left it, and so does y of what
//! others put beside it.

use super::shortest;
use ondelette_modeling::free::{Fit, FreeCurve, FreePath, Knots};
use std::fmt::Write;

mod path;

/// The paths of an SVG file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SvgPaths {
    /// All sub-paths in file order.
    pub path: FreePath,
    /// Whether y points down, as in SVG files of others.
    pub y_down: bool,
}

/// Largest coordinate that is read: beyond it, single-precision viewers and our own tolerances make no sense.
pub const MOST: f64 = 1e9;

/// An affine map, `[a b c d e f]` as in SVG.
type Matrix = [f64; 6];

const IDENTITY: Matrix = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0];

/// From y down to y up and back.
const MIRROR: Matrix = [1.0, 0.0, 0.0, -1.0, 0.0, 0.0];

fn product(m: &Matrix, n: &Matrix) -> Matrix {
    [
        m[0] * n[0] + m[2] * n[1],
        m[1] * n[0] + m[3] * n[1],
        m[0] * n[2] + m[2] * n[3],
        m[1] * n[2] + m[3] * n[3],
        m[0] * n[4] + m[2] * n[5] + m[4],
        m[1] * n[4] + m[3] * n[5] + m[5],
    ]
}

/// Reads the paths, polylines and polygons of an SVG file. Arcs become cubics within 4e-7 of their radius.
///
/// ```
/// let svg = r#"<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0C0 1 1 1 1 0z"/></svg>"#;
/// let read = ondelette_io::shape::svg::read(svg)?;
/// assert_eq!(read.path.parts.len(), 1);
/// assert_eq!(read.path.parts[0].point(0.5), [0.5, 0.75, 0.0]);
/// # Ok::<(), String>(())
/// ```
///
/// # Errors
/// A sentence: no XML, a path that is none, coordinates that are not finite or beyond [`MOST`], no path at all.
pub fn read(text: &str) -> Result<SvgPaths, String> {
    let options = roxmltree::ParsingOptions { allow_dtd: true, nodes_limit: 1 << 22, ..Default::default() };
    let document = roxmltree::Document::parse_with_options(text, options).map_err(|e| format!("no SVG: {e}"))?;
    let mut out = SvgPaths { path: FreePath::default(), y_down: true };
    let mut ordinary = Vec::new();
    // Document order with the map from the root to each element, without recursion.
    let mut stack = vec![(document.root_element(), IDENTITY, false)];
    while let Some((node, outer, up)) = stack.pop() {
        let name = node.tag_name().name();
        if matches!(name, "defs" | "clipPath" | "mask" | "symbol" | "pattern" | "marker") {
            continue;
        }
        let mut map = outer;
        if let Some(text) = node.attribute("transform") {
            map = product(&outer, &path::transform(text)?);
        }
        // Where others moved the group, or a group around it, the picture is what they moved.
        let turns = !up && node.attribute("data-ondelette-y") == Some("up");
        if turns {
            map = product(&MIRROR, &map);
        }
        let up = up || turns;
        let line = || document.text_pos_at(node.range().start).row;
        let data = match name {
            "path" => node.attribute("d").map(str::to_owned),
            "polyline" => node.attribute("points").map(|p| format!("M{p}")),
            "polygon" => node.attribute("points").map(|p| format!("M{p}z")),
            _ => None,
        };
        if let Some(data) = data {
            let pieces = path::parse(&data).map_err(|e| format!("line {}: {e}", line()))?;
            for piece in pieces {
                out.y_down &= !up;
                ordinary.push(!up);
                out.path.parts.push(curve(&piece, &map).map_err(|e| format!("line {}: {e}", line()))?);
            }
        }
        let children: Vec<_> = node.children().filter(roxmltree::Node::is_element).collect();
        stack.extend(children.into_iter().rev().map(|c| (c, map, up)));
    }
    if !out.y_down {
        // One file has one direction of y.
        for part in out.path.parts.iter_mut().zip(ordinary).filter(|p| p.1).map(|p| p.0) {
            *part = mirrored(part)?;
        }
    }
    if out.path.parts.is_empty() { Err("the file has no path, polyline or polygon".to_owned()) } else { Ok(out) }
}

/// A chain of cubics as a free curve, a unit of parameter each.
fn curve(points: &[[f64; 2]], m: &Matrix) -> Result<FreeCurve, String> {
    let mapped: Vec<[f64; 3]> =
        points.iter().map(|p| [m[0] * p[0] + m[2] * p[1] + m[4], m[1] * p[0] + m[3] * p[1] + m[5], 0.0]).collect();
    if let Some(p) = mapped.iter().flatten().find(|x| !(x.is_finite() && x.abs() <= MOST)) {
        return Err(format!("the coordinate {p} is not a finite number below {MOST:e}"));
    }
    let breaks: Vec<f64> = (0..=points.len() / 3).map(|i| i as f64).collect();
    let knots = Knots::bezier(3, &breaks).map_err(|e| e.to_string())?;
    FreeCurve::new(2, knots, mapped, None).map_err(|e| e.to_string())
}

/// The same curve with y the other way.
fn mirrored(of: &FreeCurve) -> Result<FreeCurve, String> {
    let points = of.points().iter().map(|p| [p[0], -p[1], p[2]]).collect();
    FreeCurve::new(2, of.knots().clone(), points, None).map_err(|e| e.to_string())
}

/// The `d` of a path: each span of each part as one cubic, exact for degree 3 and below without weights; others by a
/// fit within `tolerance`. Closed parts end in `Z`.
///
/// # Errors
/// A fit that is not finite.
pub fn path_data(path: &FreePath, tolerance: f64) -> Result<String, String> {
    let mut out = String::new();
    for part in &path.parts {
        let fitted;
        let part = if part.knots().degree() > 3 || part.weights().is_some() {
            let fit = part.to_uniform(&Fit { tolerance, most_spans: 4096 }).map_err(|e| e.to_string())?;
            fitted = FreeCurve::from(&fit.shape);
            &fitted
        } else {
            part
        };
        let (closed, spans) = (part.is_closed(), part.knots().spans());
        let mut first = None;
        for (k, &span) in spans.iter().enumerate() {
            let mut b = cubic(&part.bezier(span).0);
            let first = *first.get_or_insert(b[0]);
            if closed && k + 1 == spans.len() {
                b[3] = first;
            }
            let pair = |p: [f64; 3]| format!("{},{}", shortest(p[0]), shortest(p[1]));
            // Writing to a String does not fail.
            let _ = match k {
                0 => write!(out, "M{} C", pair(b[0])),
                _ => write!(out, " "),
            };
            let _ = write!(out, "{} {} {}", pair(b[1]), pair(b[2]), pair(b[3]));
        }
        out.push_str(if closed { "Z " } else { " " });
    }
    Ok(out.trim_end().to_owned())
}

/// Bezier points of degree 1 to 3 as a cubic.
fn cubic(b: &[[f64; 3]]) -> [[f64; 3]; 4] {
    let mix = |p: [f64; 3], q: [f64; 3], w: f64| std::array::from_fn(|c| (1.0 - w) * p[c] + w * q[c]);
    match b {
        [p, q] => [*p, mix(*p, *q, 1.0 / 3.0), mix(*p, *q, 2.0 / 3.0), *q],
        [p, q, r] => [*p, mix(*p, *q, 2.0 / 3.0), mix(*r, *q, 2.0 / 3.0), *r],
        [p, q, r, s] => [*p, *q, *r, *s],
        _ => [[0.0; 3]; 4],
    }
}

/// A whole SVG file of one path, framed with a margin.
///
/// # Errors
/// As [`path_data`].
pub fn write(path: &FreePath, y_down: bool, tolerance: f64) -> Result<String, String> {
    let data = path_data(path, tolerance)?;
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for p in path.parts.iter().flat_map(FreeCurve::points) {
        for c in 0..2 {
            low[c] = low[c].min(p[c]);
            high[c] = high[c].max(p[c]);
        }
    }
    if !(low[0].is_finite() && high[1].is_finite()) {
        return Err("there is no curve to write".to_owned());
    }
    let size = (high[0] - low[0]).max(high[1] - low[1]).max(1e-12);
    let margin = 0.05 * size;
    let (top, group) = if y_down {
        (low[1], String::new())
    } else {
        (-high[1], r#" transform="scale(1,-1)" data-ondelette-y="up""#.to_owned())
    };
    let number = |x: f64| format!("{}", (x / size * 1e6).round() / 1e6 * size);
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{} {} {} {}\">\n<g{group}>\n<path d=\"{data}\" \
         fill=\"none\" stroke=\"black\" stroke-width=\"{}\"/>\n</g>\n</svg>\n",
        number(low[0] - margin),
        number(top - margin),
        number(high[0] - low[0] + 2.0 * margin),
        number(high[1] - low[1] + 2.0 * margin),
        number(0.004 * size),
    ))
}
