//! From free splines to uniform shapes: exactly where the knots allow it, else by a fit.

use super::curve::FreeCurve;
use super::knots::{H, Knots};
use super::surface::FreeSurface;
use crate::axis::Axis;
use crate::shape::vector::{V, distance};
use crate::shape::{Curve, ParametricCurve, ParametricSurface, ShapeError, Surface, triples};
use ondelette_wavelet::{Boundary, SplineFamily, SplineSpace};

/// A uniform shape made from a free one.
#[derive(Clone, Debug, PartialEq)]
pub struct Converted<S> {
    /// The shape.
    pub shape: S,
    /// Whether it is the same function (to rounding).
    pub exact: bool,
    /// Largest distance between points of equal place, at 16 and more a span; 0 if exact.
    pub deviation: f64,
}

/// How a fit is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Deviation to be reached, in units of the shape; spans are doubled until it is.
    pub tolerance: f64,
    /// Most spans (in each direction): what is reached with them is returned.
    pub most_spans: usize,
}

impl Default for Fit {
    fn default() -> Fit {
        Fit { tolerance: 1e-3, most_spans: 1024 }
    }
}

/// Spans of a uniform grid that knots are looked for on, for each span between them.
const MOST_GRID: usize = 16;
/// Knots may be off the grid by so much of a span, and neighbours differ by so much of the size of the shape.
const SAME: f64 = 1e-9;

/// The number of equal spans on whose ends all breaks lie, if there is a small one.
fn grid(breaks: &[f64]) -> Option<usize> {
    let (a, b) = (breaks[0], breaks[breaks.len() - 1]);
    let gap = breaks.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
    // the smallest gap may itself be several spans
    (1..=8).find_map(|part| {
        let n = ((b - a) / gap * f64::from(part)).round();
        let on = |x: f64| {
            let u = (x - a) / (b - a) * n;
            (u - u.round()).abs() < SAME * n.max(1.0).sqrt()
        };
        (n >= 1.0 && n <= (MOST_GRID * breaks.len()) as f64 && breaks.iter().all(|&x| on(x))).then_some(n as usize)
    })
}

/// One direction of an exact conversion: the axis, and for each control point its span and knot triple.
struct Plan {
    axis: Axis,
    places: Vec<(usize, [f64; 3])>,
}

/// `same(span, span, t, u, order)`: whether the derivative of that order of the piece on the first span at `t` is that
/// of the piece on the second span at `u`.
fn plan(knots: &Knots, same: impl Fn([usize; 2], [f64; 2], usize) -> bool) -> Option<Plan> {
    if knots.degree() > 3 {
        return None;
    }
    let breaks = knots.breaks();
    let n = grid(&breaks)?;
    let spans = knots.spans();
    let smooth = |a: usize, b: usize, t: f64, u: f64| (0..3).all(|order| same([a, b], [t, u], order));
    for (pair, &t) in spans.windows(2).zip(&breaks[1..]) {
        let held = knots.values().iter().filter(|k| **k == t).count();
        if (knots.degree() < 3 || held > 1) && !smooth(pair[0], pair[1], t, t) {
            return None;
        }
    }
    let domain = knots.domain();
    let closes = n >= 4 && smooth(spans[spans.len() - 1], spans[0], domain[1], domain[0]);
    let boundary = if closes { Boundary::Periodic } else { Boundary::Open };
    let axis = Axis::new(boundary, n, domain).ok()?;
    let width = (domain[1] - domain[0]) / n as f64;
    let places = triples(&axis)
        .map(|u| {
            let middle = u[1].clamp(0.0, n as f64);
            // a little to the right, so that rounding does not choose the span on the left of a knot
            let t = domain[0] + width * (middle + 0.25).min(n as f64 - 0.25);
            (knots.span(t), u.map(|x| domain[0] + width * x))
        })
        .collect();
    Some(Plan { axis, places })
}

/// The spline space of an axis with at least 8 spans.
fn space(axis: &Axis) -> SplineSpace {
    SplineSpace::new(SplineFamily::CUBIC, axis.boundary(), axis.len()).expect("cubic spaces of 8 spans exist")
}

fn close(a: H, b: H, size: f64) -> bool {
    a.iter().zip(b).take(3).all(|(x, y)| (x - y).abs() <= SAME * size)
}

fn size_of(points: &[V]) -> f64 {
    points.iter().fold(1e-300, |m, &p| m.max(distance(p, points[0])))
}

impl FreeCurve {
    /// The uniform cubic curve that is the same function, if there is one: no weights, degree at most 3, knots on a
    /// uniform grid, second derivatives that agree across knots. Periodic if they also agree across the ends.
    pub fn exactly_uniform(&self) -> Option<Curve> {
        if self.weights().is_some() {
            return None;
        }
        let knots = self.knots();
        let size = size_of(self.points());
        let [a, b] = knots.domain();
        let unit = knots.spans().len() as f64 / (b - a);
        let plan = plan(knots, |spans, at, order| {
            let [p, q] = [0, 1].map(|k| knots.derivative(spans[k], at[k], order, |i| self.control(i)));
            close(p, q, size * unit.powi(order as i32))
        })?;
        let point = |&(span, u): &(usize, [f64; 3])| {
            let h = knots.cubic_blossom(span, u, |i| self.control(i));
            [h[0], h[1], h[2]]
        };
        Curve::new(plan.axis, self.dim(), plan.places.iter().map(point).collect()).ok()
    }

    /// A uniform curve: exact if possible, else through points at equal steps of arc length, with as many spans as the
    /// deviation asks for.
    ///
    /// # Errors
    /// [`ShapeError`]: the points leave the finite numbers.
    pub fn to_uniform(&self, fit: &Fit) -> Result<Converted<Curve>, ShapeError> {
        if let Some(shape) = self.exactly_uniform() {
            return Ok(Converted { shape, exact: true, deviation: 0.0 });
        }
        let closed = self.is_closed();
        let boundary = if closed { Boundary::Periodic } else { Boundary::Open };
        let mut spans = self.knots().spans().len().clamp(8, fit.most_spans.max(8));
        loop {
            let ruler = Ruler::new(self, spans * 16);
            let axis = Axis::new(boundary, spans, self.knots().domain())?;
            let space = space(&axis);
            let samples: Vec<V> = space.sites().iter().map(|u| self.point(ruler.at(u / spans as f64))).collect();
            let shape = Curve::new(axis, self.dim(), space.interpolate(&samples).unwrap_or(samples))?;
            let deviation = (0..=spans * 16)
                .map(|k| {
                    let f = k as f64 / (spans * 16) as f64;
                    distance(self.point(ruler.at(f)), shape.point(axis.from_knots(f * spans as f64)))
                })
                .fold(0.0, f64::max);
            if deviation <= fit.tolerance || spans * 2 > fit.most_spans {
                return Ok(Converted { shape, exact: false, deviation });
            }
            spans *= 2;
        }
    }
}

/// Parameters by arc length.
struct Ruler {
    parameters: Vec<f64>,
    /// Length up to each parameter, as a part of the whole.
    parts: Vec<f64>,
}

impl Ruler {
    fn new(curve: &FreeCurve, samples: usize) -> Ruler {
        let breaks = curve.breaks();
        let each = samples.div_ceil(breaks.len() - 1).max(4);
        let mut parameters = vec![breaks[0]];
        for w in breaks.windows(2) {
            parameters.extend((1..=each).map(|k| w[0] + (w[1] - w[0]) * k as f64 / each as f64));
        }
        let mut sum = 0.0;
        let mut parts = vec![0.0];
        let mut last = curve.point(breaks[0]);
        for &t in &parameters[1..] {
            let p = curve.point(t);
            sum += distance(p, last);
            last = p;
            parts.push(sum);
        }
        let (total, steps) = (sum, parts.len() - 1);
        for (k, p) in parts.iter_mut().enumerate() {
            // a curve of no length runs evenly
            *p = if total > 0.0 { *p / total } else { k as f64 / steps as f64 };
        }
        Ruler { parameters, parts }
    }

    fn at(&self, part: f64) -> f64 {
        let i = self.parts.partition_point(|&p| p < part).clamp(1, self.parts.len() - 1);
        let (a, b) = (self.parts[i - 1], self.parts[i]);
        let w = if b > a { ((part - a) / (b - a)).clamp(0.0, 1.0) } else { 1.0 };
        (1.0 - w) * self.parameters[i - 1] + w * self.parameters[i]
    }
}

impl FreeSurface {
    /// The uniform bicubic surface that is the same function, if there is one; see [`FreeCurve::exactly_uniform`].
    pub fn exactly_uniform(&self) -> Option<Surface> {
        if self.weights().is_some() {
            return None;
        }
        let size = size_of(self.points());
        let mut plans = Vec::with_capacity(2);
        for direction in 0..2 {
            let knots = &self.knots()[direction];
            let lines = self.knots()[1 - direction].points();
            let [a, b] = knots.domain();
            let unit = knots.spans().len() as f64 / (b - a);
            plans.push(plan(knots, |spans, at, order| {
                (0..lines).all(|line| {
                    let control = |i: usize| if direction == 0 { self.control(i, line) } else { self.control(line, i) };
                    let [p, q] = [0, 1].map(|k| knots.derivative(spans[k], at[k], order, control));
                    close(p, q, size * unit.powi(order as i32))
                })
            })?);
        }
        let mut points = Vec::with_capacity(plans[0].places.len() * plans[1].places.len());
        for &(span_s, u) in &plans[0].places {
            for &(span_t, v) in &plans[1].places {
                let h = self.knots()[0]
                    .cubic_blossom(span_s, u, |i| self.knots()[1].cubic_blossom(span_t, v, |j| self.control(i, j)));
                points.push([h[0], h[1], h[2]]);
            }
        }
        Surface::new([plans[0].axis, plans[1].axis], 3, points).ok()
    }

    /// A uniform surface: exact if possible, else through points at equal steps of the parameters, with as many spans
    /// as the deviation asks for.
    ///
    /// # Errors
    /// [`ShapeError`]: the points leave the finite numbers.
    pub fn to_uniform(&self, fit: &Fit) -> Result<Converted<Surface>, ShapeError> {
        if let Some(shape) = self.exactly_uniform() {
            return Ok(Converted { shape, exact: true, deviation: 0.0 });
        }
        let domain = self.domain();
        let mut spans = [0, 1].map(|a| self.knots()[a].spans().len().clamp(8, fit.most_spans.max(8)));
        loop {
            let axes =
                [Axis::new(Boundary::Open, spans[0], domain[0])?, Axis::new(Boundary::Open, spans[1], domain[1])?];
            let [along_s, along_t] = axes.map(|a| space(&a));
            let (ss, ts) = (along_s.sites(), along_t.sites());
            let mut half = Vec::with_capacity(ss.len() * ts.len());
            for &s in &ss {
                let s = axes[0].from_knots(s);
                let row: Vec<V> = ts.iter().map(|&t| self.point(s, axes[1].from_knots(t))).collect();
                half.extend(along_t.interpolate(&row).unwrap_or(row));
            }
            let mut points = vec![[0.0; 3]; half.len()];
            for j in 0..ts.len() {
                let column: Vec<V> = (0..ss.len()).map(|i| half[i * ts.len() + j]).collect();
                let column = along_s.interpolate(&column).unwrap_or(column);
                column.into_iter().enumerate().for_each(|(i, p)| points[i * ts.len() + j] = p);
            }
            let shape = Surface::new(axes, 3, points)?;
            let mut deviation: f64 = 0.0;
            for i in 0..=spans[0] * 4 {
                let s = axes[0].from_knots(i as f64 / 4.0);
                for j in 0..=spans[1] * 4 {
                    let t = axes[1].from_knots(j as f64 / 4.0);
                    deviation = deviation.max(distance(self.point(s, t), shape.point(s, t)));
                }
            }
            if deviation <= fit.tolerance || spans.iter().any(|n| n * 2 > fit.most_spans) {
                return Ok(Converted { shape, exact: false, deviation });
            }
            spans = spans.map(|n| n * 2);
        }
    }
}
