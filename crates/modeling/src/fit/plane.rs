//! Planes through scattered heights: what bending does not cost.
//!
//! They are taken off before a fit that only bends, and put on again, so that a plane is met to its rounding whatever
//! the domain. Points on a line say nothing about the tilt across it.

use super::surface::eval;
use crate::energy::{Energy, Operator};
use crate::solve::cholesky::dot;
use crate::system::Space;

/// Points whose width is at most this share of their length are on a line: what they say about the tilt across it is
/// lost in rounding, where no stretch holds it.
const THIN: f64 = 1e-6;

/// True for points on a line, or all in one place: then bending alone leaves planes free.
pub(super) fn is_line(points: &[[f64; 2]]) -> bool {
    let Some(from) = points.first() else { return true };
    let off = |p: &[f64; 2]| [p[0] - from[0], p[1] - from[1]];
    let length = |d: [f64; 2]| d[0].hypot(d[1]);
    let far = points.iter().map(off).fold([0.0; 2], |most, d| if length(d) > length(most) { d } else { most });
    let unit = far.map(|d| d / length(far));
    length(far) == 0.0 || points.iter().map(off).all(|d| (unit[0] * d[1] - unit[1] * d[0]).abs() <= THIN * length(far))
}

/// Takes the plane nearest to the values off them; its coefficients.
pub(super) fn take_off(space: &Space, points: &[[f64; 2]], values: &mut [f64]) -> Vec<f64> {
    let null = Operator::new(space, &Energy::BEND, None).null_space(Energy::BEND.free_degree());
    // Heights of the planes at the points, made orthogonal (twice, for rounding), and their coefficients.
    let mut made: Vec<(Vec<f64>, Vec<f64>)> = Vec::new();
    let mut plane = vec![0.0; space.len()];
    for mut z in null {
        let mut y: Vec<f64> = points.iter().map(|p| eval(space, &z, *p)).collect();
        for _ in 0..2 {
            for (q, c) in &made {
                let by = dot(q, &y);
                y.iter_mut().zip(q).for_each(|(y, q)| *y -= by * q);
                z.iter_mut().zip(c).for_each(|(z, c)| *z -= by * c);
            }
        }
        let size = dot(&y, &y).sqrt();
        if size > 0.0 {
            y.iter_mut().chain(&mut z).for_each(|v| *v /= size);
            made.push((y, z));
        }
    }
    for _ in 0..2 {
        for (q, c) in &made {
            let by = dot(q, values);
            plane.iter_mut().zip(c).for_each(|(p, c)| *p += by * c);
        }
        let now: Vec<f64> = made.iter().map(|(q, _)| dot(q, values)).collect();
        for ((q, _), by) in made.iter().zip(now) {
            values.iter_mut().zip(q).for_each(|(v, q)| *v -= by * q);
        }
    }
    plane
}

#[cfg(test)]
mod tests {
    use super::is_line;

    #[test]
    fn a_line_is_known_whichever_way_it_runs() {
        let along = |d: [f64; 2]| -> Vec<[f64; 2]> { [0.0, 0.3, 0.7, 1.0].map(|t| d.map(|d| 5.0 + t * d)).to_vec() };
        for d in [[1.0, 0.0], [0.0, 1.0], [1.0, 0.5], [1e-3, 1e3], [0.0, 0.0]] {
            assert!(is_line(&along(d)), "{d:?}");
        }
        let mut wide = along([1.0, 0.5]);
        wide[1][0] += 1e-4;
        assert!(!is_line(&wide));
    }
}
