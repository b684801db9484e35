//! Curvature constraints at a given curve: how far they are missed, and rows linear around it for Newton's method.

use super::row::{Row, Term, place};
use super::{Demand, Functional};
use crate::solve::Residual;
use crate::system::Problem;
use faer::{MatRef, Side};

/// A curvature constraint at a given curve.
pub(crate) struct Seen {
    pub(crate) constraint: usize,
    want: f64,
    one: Functional,
    two: Functional,
    d1: Vec<f64>,
    d2: Vec<f64>,
    /// The curvature that rounding alone makes of heights, which may lie far from zero.
    noise: f64,
    /// Curvature and its gradients by the first and second derivative; `None` where the tangent has collapsed.
    found: Option<(f64, Vec<f64>, Vec<f64>)>,
}

/// What holds a curvature constraint.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Force {
    None,
    /// Along its curvature.
    One(f64),
    /// Along both directions across the tangent.
    Two([f64; 2]),
}

impl Force {
    pub(crate) fn size(self) -> f64 {
        match self {
            Force::None => 0.0,
            Force::One(force) => force,
            Force::Two([a, b]) => f64::hypot(a, b),
        }
    }
}

/// Curvature with its gradients by the first and second derivative; `None` where the tangent vanishes.
pub(crate) fn curvature(d1: &[f64], d2: &[f64]) -> Option<(f64, Vec<f64>, Vec<f64>)> {
    // A height over a line is the curve (t, f).
    if let ([f1], [f2]) = (d1, d2) {
        let s = 1.0 + f1 * f1;
        let k = f2 / s.powf(1.5);
        return Some((k, vec![-3.0 * f1 * f2 / s.powf(2.5)], vec![s.powf(-1.5)]));
    }
    let square: f64 = d1.iter().map(|v| v * v).sum();
    let s = square.sqrt();
    if s <= 1e-150 || !s.is_finite() {
        return None;
    }
    if let ([x1, y1], [x2, y2]) = (d1, d2) {
        let (by1, by2) = (vec![*y2, -x2], vec![-y1, *x1]);
        return Some(scaled(d1, x1 * y2 - y1 * x2, by1, by2));
    }
    let v = cross(d1, d2);
    let size = v.iter().map(|v| v * v).sum::<f64>().sqrt();
    // On a straight place any direction across will do.
    let u = if size > 1e-12 * square { v.iter().map(|v| v / size).collect() } else { across(d1) };
    Some(scaled(d1, size, cross(d2, &u), cross(&u, d1)))
}

/// The size of the cross product, or a part of it, and its slopes by both derivatives, as curvature.
fn scaled(d1: &[f64], size: f64, by1: Vec<f64>, by2: Vec<f64>) -> (f64, Vec<f64>, Vec<f64>) {
    let square: f64 = d1.iter().map(|v| v * v).sum();
    let cube = square.sqrt() * square;
    let k = size / cube;
    let first = by1.iter().zip(d1).map(|(b, d)| b / cube - 3.0 * k / square * d).collect();
    (k, first, by2.iter().map(|b| b / cube).collect())
}

fn cross(a: &[f64], b: &[f64]) -> Vec<f64> {
    vec![a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// A direction across a tangent in space.
fn across(d1: &[f64]) -> Vec<f64> {
    let least = (0..3).min_by(|a, b| d1[*a].abs().total_cmp(&d1[*b].abs())).unwrap_or(0);
    let mut e = [0.0; 3];
    e[least] = 1.0;
    let w = cross(d1, &e);
    let length = w.iter().map(|v| v * v).sum::<f64>().sqrt();
    w.iter().map(|v| v / length).collect()
}

/// Both parts of the curvature vector in space, along two directions across the tangent: they vanish with it, and are
/// smooth there, where its size has a kink.
fn parts(d1: &[f64], d2: &[f64]) -> [(f64, Vec<f64>, Vec<f64>); 2] {
    let u = across(d1);
    let w = cross(d1, &u);
    let length = w.iter().map(|v| v * v).sum::<f64>().sqrt();
    let v = cross(d1, d2);
    [u, w.iter().map(|w| w / length).collect()].map(|u: Vec<f64>| {
        let size = v.iter().zip(&u).map(|(v, u)| v * u).sum();
        scaled(d1, size, cross(d2, &u), cross(&u, d1))
    })
}

/// The matrix of second derivatives of curvature by first and second derivative, row by row.
fn second(d1: &[f64], d2: &[f64]) -> Vec<f64> {
    let n = d1.len();
    let mut out = vec![0.0; 4 * n * n];
    if let ([f1], [f2]) = (d1, d2) {
        let s = 1.0 + f1 * f1;
        let mixed = -3.0 * f1 * s.powf(-2.5);
        return vec![f2 * (15.0 * f1 * f1 * s.powf(-3.5) - 3.0 * s.powf(-2.5)), mixed, mixed, 0.0];
    }
    let at = |i: usize, j: usize| 2 * n * i + j;
    let square: f64 = d1.iter().map(|v| v * v).sum();
    let cube = square * square.sqrt();
    // Curvature is size / cube, size that of the cross product.
    let pad = |v: &[f64]| [v[0], v[1], v.get(2).copied().unwrap_or(0.0)];
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let v = cross(pad(d1), pad(d2));
    let length = dot(v, v).sqrt();
    let (size, u) = match n {
        2 => (v[2], [0.0, 0.0, 1.0]),
        _ if length > 1e-12 * square => (length, v.map(|v| v / length)),
        // On a straight place the direction is anybody's guess, and so is how it turns.
        _ => return out,
    };
    let unit = |i: usize| std::array::from_fn(|k| if k == i % n { 1.0 } else { 0.0 });
    // What the cross product changes by, along each variable.
    let change = |i: usize| if i < n { cross(unit(i), pad(d2)) } else { cross(pad(d1), unit(i)) };
    let first = |i: usize| dot(u, change(i));
    let by = |i: usize| if i < n { d1[i] } else { 0.0 };
    for i in 0..2 * n {
        for j in 0..2 * n {
            let mut sum = match (i < n, j < n) {
                (true, false) => dot(u, cross(unit(i), unit(j))),
                (false, true) => dot(u, cross(unit(j), unit(i))),
                _ => 0.0,
            };
            if n == 3 {
                sum += (dot(change(i), change(j)) - first(i) * first(j)) / size;
            }
            let bent = sum - 3.0 / square * (first(i) * by(j) + by(i) * first(j));
            let straight = if i == j && i < n { 3.0 / square } else { 0.0 };
            out[at(i, j)] = (bent + size * (15.0 * by(i) * by(j) / square / square - straight)) / cube;
        }
    }
    out
}

impl Seen {
    /// Curvature minus what is wanted; `None` where there is none.
    pub(crate) fn miss(&self) -> Option<f64> {
        self.found.as_ref().map(|f| f.0 - self.want).filter(|m| m.is_finite())
    }

    /// True where there is less curvature than is wanted.
    pub(crate) fn is_less(&self) -> bool {
        self.found.as_ref().is_some_and(|f| f.0.abs() < self.want.abs())
    }

    /// The miss that is as good as none, with a share of the curvature wanted, or of the [`usual`] one of the shape.
    pub(crate) fn allowed(&self, share: f64, usual: f64) -> f64 {
        (share * self.want.abs().max(usual)).max(self.noise)
    }

    /// The hard row around this curve, and soft ones that hold the derivatives where `force` times the curvature bends
    /// upwards: the part of Newton's matrix that may be added to the energy without losing its least. Next to straight
    /// beside the [`usual`] curvature of the shape, in space: two hard rows; `held` where it would bend less.
    pub(crate) fn rows(&self, force: Force, usual: f64, held: bool, out: &mut Vec<Row>) {
        let Some((k, by1, by2)) = &self.found else { return };
        let n = self.d1.len();
        let terms = |first: &[f64], second: &[f64]| {
            let one = |i: usize| Term { coordinate: i, functional: self.one.clone(), factor: first[i] };
            let two = |i: usize| Term { coordinate: i, functional: self.two.clone(), factor: second[i] };
            (0..n).flat_map(|i| [one(i), two(i)]).collect::<Vec<Term>>()
        };
        let value = |first: &[f64], second: &[f64]| -> f64 {
            (0..n).map(|i| first[i] * self.d1[i] + second[i] * self.d2[i]).sum()
        };
        if n == 3 && self.want.abs() <= STRAIGHT * usual {
            // It bends the way it is pulled; at first, the way it is bent. What would bend less if it was let is pulled
            // back the other way, and keeps its own.
            let both = parts(&self.d1, &self.d2);
            let bent = [both[0].0, both[1].0];
            let pull = match force {
                Force::Two(pull) if !held => pull,
                _ => bent,
            };
            let size = f64::hypot(pull[0], pull[1]);
            for ((k, by1, by2), pull) in both.into_iter().zip(pull) {
                let toward = if size > 0.0 { pull / size } else { std::f64::consts::FRAC_1_SQRT_2 };
                let target = self.want * toward - k + value(&by1, &by2);
                out.extend(Row::new(self.constraint, terms(&by1, &by2), target, None));
            }
            return;
        }
        out.extend(Row::new(self.constraint, terms(by1, by2), self.want - k + value(by1, by2), None));
        let force = force.size();
        if force == 0.0 {
            return;
        }
        let matrix: Vec<f64> = second(&self.d1, &self.d2).into_iter().map(|v| force * v).collect();
        // The units of both derivatives differ by that of the parameter.
        let unit = |i: usize| if i < n { 1.0 } else { self.stretch() };
        let m = 2 * n;
        let scaled: Vec<f64> = (0..m * m).map(|e| matrix[e] * unit(e / m) * unit(e % m)).collect();
        let Ok(eigen) = MatRef::from_column_major_slice(&scaled, m, m).self_adjoint_eigen(Side::Lower) else { return };
        let most = (0..m).map(|j| eigen.S()[j].abs()).fold(0.0, f64::max);
        for j in (0..m).filter(|j| eigen.S()[*j] > 1e-9 * most) {
            let factor: Vec<f64> = (0..m).map(|i| eigen.U()[(i, j)] / unit(i)).collect();
            let (first, second) = factor.split_at(n);
            let target = value(first, second);
            out.extend(Row::new(self.constraint, terms(first, second), target, Some(eigen.S()[j])));
        }
    }

    /// A second derivative, of the first ones' size, over a first.
    fn stretch(&self) -> f64 {
        length_of(&self.two) / length_of(&self.one).max(f64::MIN_POSITIVE)
    }
}

fn length_of(f: &Functional) -> f64 {
    f.entries().map(|(_, v)| v * v).sum::<f64>().sqrt()
}

/// Places in space with less than this share of the usual curvature are about straight: its size has a kink there,
/// which one row around it knows nothing of.
const STRAIGHT: f64 = 2e-5;

/// A first derivative that is this share of what coefficients of the shape's size could give is none.
const COLLAPSED: f64 = 1e-13;

/// Sums of coefficients are rounded to this share of the sum of their sizes.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// All curvature constraints at the curve with the given coefficients.
pub(crate) fn look(problem: &Problem, coefficients: &[Vec<f64>]) -> Vec<Seen> {
    let mut out = Vec::new();
    // Tangents of nothing but rounding have no direction.
    let size = coefficients.iter().flatten().fold(problem.least_scale(), |m: f64, v| m.max(v.abs()));
    for (constraint, c) in problem.constraints().iter().enumerate() {
        let Demand::Curvature(want) = c.demand else { continue };
        let at = place(&c.at);
        let of = |order: usize| Functional::new(problem.space(), at, [0, order]);
        let (one, two) = (of(1), of(2));
        let d1: Vec<f64> = coefficients.iter().map(|x| one.apply(x)).collect();
        let d2: Vec<f64> = coefficients.iter().map(|x| two.apply(x)).collect();
        let speed = d1.iter().map(|v| v * v).sum::<f64>().sqrt();
        let collapsed = d1.len() > 1 && speed <= COLLAPSED * size * length_of(&one);
        let found = curvature(&d1, &d2).filter(|_| !collapsed);
        // That of the derivatives, as far as curvature feels them: of a second one little where the graph is steep.
        let noise = match (coefficients, &found) {
            ([x], Some((_, by1, by2))) => {
                let of = |f: &Functional| f.entries().map(|(i, v)| (v * x[i]).abs()).sum::<f64>();
                ROUNDING * (by1[0].abs() * of(&one) + by2[0].abs() * of(&two))
            }
            _ => 0.0,
        };
        out.push(Seen { constraint, want, one, two, d1, d2, noise, found });
    }
    out
}

/// The misses of all curvature constraints: what was wanted, where there is no curvature.
pub(crate) fn misses(problem: &Problem, coefficients: &[Vec<f64>]) -> Vec<Residual> {
    let of = |s: Seen| {
        let id = problem.constraints()[s.constraint].id.clone();
        Residual { id, soft: false, miss: s.miss().unwrap_or(s.want.abs()) }
    };
    look(problem, coefficients).into_iter().map(of).collect()
}

/// The curvature that the shape would have if it was bent evenly, about: one over the length of the polygon of its
/// coefficients; of a height that of its graph, and less where the graph is flat.
pub(crate) fn usual(problem: &Problem, coefficients: &[Vec<f64>]) -> f64 {
    let axis = &problem.space().axes()[0];
    let run = if coefficients.len() == 1 { 1.0 / axis.density() } else { 0.0 };
    let n = coefficients.first().map_or(0, Vec::len);
    let step = |i: usize| -> f64 {
        let square: f64 = coefficients.iter().map(|x| (x[i + 1] - x[i]).powi(2)).sum();
        (square + run * run).sqrt()
    };
    let even = 1.0 / (0..n.saturating_sub(1)).map(step).sum::<f64>();
    let [height] = coefficients else { return even };
    let side = axis.domain()[1] - axis.domain()[0];
    let (low, high) = range(height);
    even.min((high - low) / side / side)
}

fn range(of: &[f64]) -> (f64, f64) {
    of.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)))
}

#[cfg(test)]
mod tests {
    use super::{curvature, second};

    #[test]
    fn gradients_are_those_of_differences() {
        for (d1, d2) in
            [(vec![0.4], vec![-1.3]), (vec![0.7, -1.1], vec![2.0, 0.3]), (vec![0.7, -1.1, 0.2], vec![2.0, 0.3, -0.9])]
        {
            let (_, g1, g2) = curvature(&d1, &d2).unwrap();
            for i in 0..d1.len() {
                let h = 1e-6;
                let at = |a: f64, b: f64| {
                    let (mut p, mut q) = (d1.clone(), d2.clone());
                    p[i] += a;
                    q[i] += b;
                    curvature(&p, &q).unwrap().0
                };
                assert!(((at(h, 0.0) - at(-h, 0.0)) / (2.0 * h) - g1[i]).abs() < 1e-7);
                assert!(((at(0.0, h) - at(0.0, -h)) / (2.0 * h) - g2[i]).abs() < 1e-7);
                let n = d1.len();
                let slopes = |a: f64, b: f64| {
                    let (mut p, mut q) = (d1.clone(), d2.clone());
                    p[i] += a;
                    q[i] += b;
                    let (_, g1, g2) = curvature(&p, &q).unwrap();
                    [g1, g2].concat()
                };
                let matrix = second(&d1, &d2);
                for (row, [more, less]) in
                    [(i, [slopes(h, 0.0), slopes(-h, 0.0)]), (n + i, [slopes(0.0, h), slopes(0.0, -h)])]
                {
                    for j in 0..2 * n {
                        let want = (more[j] - less[j]) / (2.0 * h);
                        assert!((matrix[2 * n * row + j] - want).abs() < 1e-6, "{n} {row} {j}");
                    }
                }
            }
        }
    }
}
