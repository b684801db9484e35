//! Gauss-Legendre rules on [0, 1].

/// Nodes and weights of the `n`-point Gauss-Legendre rule on [0, 1], nodes ascending.
///
/// Exact for polynomials of degree 2n - 1. The weights sum to 1. Newton's method on the Legendre recurrence; cost
/// O(n^2).
///
/// # Panics
/// If `n` is 0.
///
/// ```
/// let (x, w) = ondelette_numerics::gauss::rule(3);
/// let integral: f64 = x.iter().zip(&w).map(|(x, w)| w * x.powi(5)).sum();
/// assert!((integral - 1.0 / 6.0).abs() < 1e-15);
/// ```
pub fn rule(n: usize) -> (Vec<f64>, Vec<f64>) {
    assert!(n > 0, "a Gauss rule needs at least one point");
    let mut nodes = vec![0.0; n];
    let mut weights = vec![0.0; n];
    for i in 0..n {
        let mut x = -(std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut derivative = 1.0;
        for _ in 0..100 {
            let (mut p, mut previous) = (1.0, 0.0);
            for k in 0..n {
                let k = k as f64;
                (p, previous) = (((2.0 * k + 1.0) * x * p - k * previous) / (k + 1.0), p);
            }
            derivative = n as f64 * (x * p - previous) / (x * x - 1.0);
            let step = p / derivative;
            x -= step;
            if step.abs() < 1e-16 {
                break;
            }
        }
        nodes[i] = 0.5 * (1.0 + x);
        weights[i] = 1.0 / ((1.0 - x * x) * derivative * derivative);
    }
    (nodes, weights)
}

/// Collapsed (Duffy) tensor Gauss rule on the triangle s, t >= 0, s + t <= 1; `n * n` points, weights sum to 1.
///
/// Exact for polynomials of total degree 2n - 2.
pub fn triangle_rule(n: usize) -> (Vec<[f64; 2]>, Vec<f64>) {
    let (x, w) = rule(n);
    let mut points = Vec::with_capacity(n * n);
    let mut weights = Vec::with_capacity(n * n);
    for (a, wa) in x.iter().zip(&w) {
        for (b, wb) in x.iter().zip(&w) {
            points.push([*a, b * (1.0 - a)]);
            weights.push(2.0 * wa * wb * (1.0 - a));
        }
    }
    (points, weights)
}

/// Tensor Gauss rule on the unit square; `n * n` points, weights sum to 1. Exact for degree 2n - 1 in each variable.
pub fn square_rule(n: usize) -> (Vec<[f64; 2]>, Vec<f64>) {
    let (x, w) = rule(n);
    let mut points = Vec::with_capacity(n * n);
    let mut weights = Vec::with_capacity(n * n);
    for (a, wa) in x.iter().zip(&w) {
        for (b, wb) in x.iter().zip(&w) {
            points.push([*a, *b]);
            weights.push(wa * wb);
        }
    }
    (points, weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_integrate_what_they_promise() {
        for n in 1..=24 {
            let (x, w) = rule(n);
            for k in 0..2 * n {
                let got: f64 = x.iter().zip(&w).map(|(x, w)| w * x.powi(k as i32)).sum();
                assert!((got - 1.0 / (k as f64 + 1.0)).abs() < 1e-14, "n {n} k {k}");
            }
        }
    }

    #[test]
    fn triangle_rule_integrates_monomials() {
        // integral of s^a t^b over the triangle = a! b! / (a + b + 2)!, times 2 for unit measure
        let f = |n: usize| (1..=n).map(|k| k as f64).product::<f64>();
        for n in 1..=8 {
            let (p, w) = triangle_rule(n);
            for a in 0..=(2 * n - 2) {
                for b in 0..=(2 * n - 2 - a) {
                    let got: f64 = p.iter().zip(&w).map(|(p, w)| w * p[0].powi(a as i32) * p[1].powi(b as i32)).sum();
                    let want = 2.0 * f(a) * f(b) / f(a + b + 2);
                    assert!((got - want).abs() < 1e-14, "n {n} a {a} b {b}");
                }
            }
        }
    }
}
