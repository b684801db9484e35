//! Panels of curves as SVG.

use std::fmt::Write as _;

/// Points of a curve, from left to right.
pub(crate) type Curve = Vec<(f64, f64)>;

const COLOURS: [&str; 6] = ["#0b6e99", "#c8553d", "#588157", "#7b4b94", "#b08900", "#5f6b73"];
const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 120.0;
const GAP: f64 = 40.0;

struct Stroke {
    points: Curve,
    colour: &'static str,
    width: f64,
}

/// One panel: a title, curves, dots, and vertical lines.
pub(crate) struct Panel {
    title: String,
    strokes: Vec<Stroke>,
    dots: Curve,
    marks: Vec<f64>,
}

impl Panel {
    /// An empty panel.
    pub(crate) fn new(title: impl Into<String>) -> Panel {
        Panel { title: title.into(), strokes: Vec::new(), dots: Vec::new(), marks: Vec::new() }
    }

    /// Curves of one kind, told apart by colour.
    pub(crate) fn thin(mut self, curves: impl IntoIterator<Item = Curve>) -> Panel {
        let first = self.strokes.len();
        let stroke = |(i, points)| Stroke { points, colour: COLOURS[(first + i) % COLOURS.len()], width: 1.6 };
        self.strokes.extend(curves.into_iter().enumerate().map(stroke));
        self
    }

    /// Curves that stand back.
    pub(crate) fn faint(mut self, curves: impl IntoIterator<Item = Curve>) -> Panel {
        self.strokes.extend(curves.into_iter().map(|points| Stroke { points, colour: "#a9b4bb", width: 1.3 }));
        self
    }

    /// The curve that the panel is about.
    pub(crate) fn bold(mut self, points: Curve) -> Panel {
        self.strokes.push(Stroke { points, colour: "#111", width: 2.6 });
        self
    }

    /// Coefficients.
    pub(crate) fn dots(mut self, dots: Curve) -> Panel {
        self.dots = dots;
        self
    }

    /// Ends of an interval.
    pub(crate) fn marks(mut self, marks: &[f64]) -> Panel {
        self.marks = marks.to_vec();
        self
    }

    fn draw(&self, left: f64, top: f64, width: f64, out: &mut String) -> std::fmt::Result {
        let points = || self.strokes.iter().flat_map(|s| &s.points).chain(&self.dots);
        let range = |f: fn(&(f64, f64)) -> f64| {
            points().map(f).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
        };
        let ((x0, x1), (y0, y1)) = (range(|p| p.0), range(|p| p.1));
        let (y0, y1) = (y0.min(0.0), y1.max(y0 + 1e-9));
        let place =
            |p: &(f64, f64)| (left + (p.0 - x0) / (x1 - x0) * width, top + HEIGHT - (p.1 - y0) / (y1 - y0) * HEIGHT);
        writeln!(out, "<text x=\"{left:.0}\" y=\"{:.0}\" fill=\"#333\">{}</text>", top - 9.0, self.title)?;
        writeln!(out, "<path d=\"M{left:.1} {:.1}h{width:.1}\" stroke=\"#ccc\"/>", place(&(x0, 0.0)).1)?;
        for &mark in &self.marks {
            let x = place(&(mark, 0.0)).0;
            writeln!(out, "<path d=\"M{x:.1} {top:.1}v{HEIGHT}\" stroke=\"#999\" stroke-dasharray=\"3 3\"/>")?;
        }
        for stroke in &self.strokes {
            let mut d = String::new();
            for (i, p) in stroke.points.iter().enumerate() {
                let (x, y) = place(p);
                write!(d, "{}{x:.1} {y:.1}", if i == 0 { "M" } else { "L" })?;
            }
            let Stroke { colour, width, .. } = stroke;
            let join = "stroke-linejoin=\"round\"";
            writeln!(out, "<path d=\"{d}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" {join}/>")?;
        }
        for p in &self.dots {
            let (x, y) = place(p);
            writeln!(out, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.8\" fill=\"#c8553d\"/>")?;
        }
        Ok(())
    }
}

/// Panels in rows of `columns`, each scaled to its own curves.
pub(crate) fn svg(panels: &[Panel], columns: usize) -> Result<String, std::fmt::Error> {
    let total = panels.len().div_ceil(columns) as f64 * (HEIGHT + GAP) + 12.0;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {total}\" font-family=\"sans-serif\" \
         font-size=\"14\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    let width = (WIDTH - 24.0 * columns as f64) / columns as f64;
    for (i, panel) in panels.iter().enumerate() {
        let left = 12.0 + (i % columns) as f64 * (width + 24.0);
        panel.draw(left, 30.0 + (i / columns) as f64 * (HEIGHT + GAP), width, &mut out)?;
    }
    Ok(out + "</svg>\n")
}
