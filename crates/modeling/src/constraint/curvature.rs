//! Curvature constraints, linear around a given curve: one Newton step's rows.

use super::row::{Row, Term, place};
use super::{Demand, Functional};
use crate::solve::Residual;
use crate::system::Problem;

/// Rows of all curvature constraints, and how far they are missed.
#[derive(Default)]
pub(crate) struct Linearised {
    pub(crate) rows: Vec<Row>,
    pub(crate) misses: Vec<Residual>,
    /// Largest miss, and the size that it is judged by.
    pub(crate) miss: f64,
    pub(crate) size: f64,
    /// Constraints at points where the tangent has collapsed.
    pub(crate) degenerate: Vec<String>,
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
    let cube = s * square;
    let (size, by1, by2) = match (d1, d2) {
        ([x1, y1], [x2, y2]) => (x1 * y2 - y1 * x2, vec![*y2, -x2], vec![-y1, *x1]),
        _ => {
            let cross = |a: &[f64], b: &[f64]| {
                vec![a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
            };
            let v = cross(d1, d2);
            let size = v.iter().map(|v| v * v).sum::<f64>().sqrt();
            // On a straight place any direction across will do.
            let u: Vec<f64> = if size > 1e-12 * square {
                v.iter().map(|v| v / size).collect()
            } else {
                let least = (0..3).min_by(|a, b| d1[*a].abs().total_cmp(&d1[*b].abs())).unwrap_or(0);
                let mut e = [0.0; 3];
                e[least] = 1.0;
                let w = cross(d1, &e);
                let length = w.iter().map(|v| v * v).sum::<f64>().sqrt();
                w.iter().map(|v| v / length).collect()
            };
            (size, cross(d2, &u), cross(&u, d1))
        }
    };
    let k = size / cube;
    let first = by1.iter().zip(d1).map(|(b, d)| b / cube - 3.0 * k / square * d).collect();
    Some((k, first, by2.iter().map(|b| b / cube).collect()))
}

/// The rows around the curve with the given coefficients.
pub(crate) fn rows(problem: &Problem, coefficients: &[Vec<f64>]) -> Linearised {
    let mut out = Linearised { size: 1e-300, ..Linearised::default() };
    for (number, c) in problem.constraints().iter().enumerate() {
        let Demand::Curvature(want) = c.demand else { continue };
        let at = place(&c.at);
        let of = |order: usize| Functional::new(problem.space(), at, [0, order]);
        let (one, two) = (of(1), of(2));
        let d1: Vec<f64> = coefficients.iter().map(|x| one.apply(x)).collect();
        let d2: Vec<f64> = coefficients.iter().map(|x| two.apply(x)).collect();
        let Some((k, by1, by2)) = curvature(&d1, &d2) else {
            out.degenerate.push(c.id.clone());
            out.misses.push(Residual { id: c.id.clone(), soft: false, miss: want.abs() });
            continue;
        };
        out.misses.push(Residual { id: c.id.clone(), soft: false, miss: k - want });
        out.miss = out.miss.max((k - want).abs());
        out.size = out.size.max(want.abs()).max(k.abs());
        let mut terms = Vec::new();
        let mut target = want - k;
        for i in 0..d1.len() {
            terms.push(Term { coordinate: i, functional: one.clone(), factor: by1[i] });
            terms.push(Term { coordinate: i, functional: two.clone(), factor: by2[i] });
            target += by1[i] * d1[i] + by2[i] * d2[i];
        }
        out.rows.extend(Row::new(number, terms, target, None));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::curvature;

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
            }
        }
    }
}
