//! The intrinsic functionals of one span, with their derivatives by its four control points.
//!
//! Energy: the integral of squared curvature, by Gauss's rule. Variation: curvature at the knots, linear in arc length
//! between them. (The third derivative of a cubic spline is constant over a span; integrating it would add an error of
//! the square of the span that no curve can avoid, and a circle would not be a minimum.)

use super::Minimum;
use super::jet::{Jet, dot};

/// Points of Gauss's rule a span.
pub(crate) const GAUSS: usize = 4;
/// Where the speed of a span is compared with the wanted one.
pub(crate) const PACES: [f64; 3] = [0.0, 0.5, 1.0];

/// Values of the span's four functions: first and second derivatives, in knot units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) first: [f64; 4],
    pub(crate) second: [f64; 4],
}

/// What is evaluated of a span: its start, middle and end, and the points of Gauss's rule.
#[derive(Clone, Debug)]
pub(crate) struct Places {
    pub(crate) paces: [Place; 3],
    pub(crate) inner: [Place; GAUSS],
    pub(crate) weights: [f64; GAUSS],
}

/// The functional of a span, and how unevenly its speed follows the wanted one: the squared changes of the logarithm of
/// their ratio, from the start to the middle and on to the end. A curve that grows keeps its term.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parts<const N: usize> {
    pub(crate) functional: Jet<N>,
    pub(crate) speed: Jet<N>,
}

/// A derivative of the span at a place: variable `K a + c` is coordinate c of control point a.
fn vector<const N: usize, const K: usize>(points: &[[f64; K]; 4], factors: &[f64; 4]) -> [Jet<N>; K] {
    std::array::from_fn(|c| {
        let mut first = [0.0; N];
        let mut value = 0.0;
        for a in 0..4 {
            first[K * a + c] = factors[a];
            value += factors[a] * points[a][c];
        }
        Jet::linear(value, first)
    })
}

/// Curvature vector: the second derivative across the first, over the square of the speed.
fn curvature<const N: usize, const K: usize>(first: &[Jet<N>; K], second: &[Jet<N>; K]) -> [Jet<N>; K] {
    let by = dot(first, first).recip();
    let along = dot(first, second) * by;
    std::array::from_fn(|c| (second[c] - first[c] * along) * by)
}

/// Both parts of a span; `N` is four times `K`. `wanted` holds the wanted speeds at [`PACES`], in any unit.
pub(crate) fn parts<const N: usize, const K: usize>(
    minimum: Minimum,
    points: &[[f64; K]; 4],
    places: &Places,
    wanted: &[f64; 3],
) -> Parts<N> {
    let firsts: [[Jet<N>; K]; 3] = std::array::from_fn(|i| vector(points, &places.paces[i].first));
    let paces: [Jet<N>; 3] = std::array::from_fn(|i| dot(&firsts[i], &firsts[i]).ln().times(0.5).plus(-wanted[i].ln()));
    let (a, b) = (paces[1] - paces[0], paces[2] - paces[1]);
    let speed = a * a + b * b;
    let (mut length, mut energy) = (Jet::ZERO, Jet::ZERO);
    for (place, w) in places.inner.iter().zip(places.weights) {
        let first: [Jet<N>; K] = vector(points, &place.first);
        let ds = dot(&first, &first).sqrt().times(w);
        match minimum {
            Minimum::Energy => {
                let k = curvature(&first, &vector(points, &place.second));
                energy = energy + dot(&k, &k) * ds;
            }
            Minimum::Variation => length = length + ds,
        }
    }
    if minimum == Minimum::Energy {
        return Parts { functional: energy, speed };
    }
    let [(t0, k0), (t1, k1)]: [([Jet<N>; K], [Jet<N>; K]); 2] = [0, 2].map(|end: usize| {
        let first = &firsts[end];
        let k = curvature(first, &vector(points, &places.paces[end].second));
        let by = dot(first, first).sqrt().recip();
        (std::array::from_fn(|c| first[c] * by), k)
    });
    // The change across the tangent: the first curvature is carried along by the rotation between the tangents.
    let turn = dot(&k0, &t1) * dot(&t0, &t1).plus(1.0).recip();
    let change: [Jet<N>; K] = std::array::from_fn(|c| k1[c] - k0[c] + (t0[c] + t1[c]) * turn);
    Parts { functional: dot(&change, &change) * length.recip(), speed }
}

/// Curvature at a place: signed in the plane, not negative in space.
pub(crate) fn bend<const N: usize, const K: usize>(points: &[[f64; K]; 4], place: &Place) -> Jet<N> {
    let (first, second): ([Jet<N>; K], [Jet<N>; K]) = (vector(points, &place.first), vector(points, &place.second));
    if K == 2 {
        let speed = dot(&first, &first).sqrt();
        return (first[0] * second[1] - first[1] * second[0]) * (speed * speed * speed).recip();
    }
    let k = curvature(&first, &second);
    dot(&k, &k).plus(f64::MIN_POSITIVE).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::Axis;
    use crate::intrinsic::objective::places;
    use ondelette_wavelet::Boundary;

    fn check<const N: usize, const K: usize>(minimum: Minimum, points: [[f64; K]; 4]) {
        let axis = Axis::new(Boundary::Periodic, 8, [0.0, 1.0]).unwrap();
        let (places, wanted) = (places(&axis, 0), [1.1, 0.9, 1.3]);
        let at = |points: &[[f64; K]; 4]| {
            let p: Parts<N> = parts(minimum, points, &places, &wanted);
            p.functional + p.speed + bend(points, &places.inner[1])
        };
        let here = at(&points);
        for i in 0..N {
            let moved = |h: f64| {
                let mut p = points;
                p[i / K][i % K] += h;
                at(&p)
            };
            let (a, b) = (moved(1e-5), moved(-1e-5));
            let size = here.value.abs() + 1.0;
            assert!(((a.value - b.value) / 2e-5 - here.first[i]).abs() < 1e-5 * size, "{minimum:?} {i}");
            for j in 0..=i {
                let by_difference = (a.first[j] - b.first[j]) / 2e-5;
                let size = here.second[i][j].abs() + size;
                assert!((by_difference - here.second[i][j]).abs() < 1e-5 * size, "{minimum:?} {i} {j}");
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        for minimum in [Minimum::Energy, Minimum::Variation] {
            check::<8, 2>(minimum, [[0.0, 0.1], [1.0, 0.4], [1.9, 0.2], [2.7, -0.9]]);
            check::<12, 3>(minimum, [[0.0, 0.1, 0.3], [1.0, 0.4, 0.1], [1.9, 0.2, 0.0], [2.7, -0.9, 0.8]]);
        }
    }

    #[test]
    fn a_regular_polygon_has_no_variation_and_the_energy_of_its_circle() {
        let axis = Axis::new(Boundary::Periodic, 90, [0.0, 1.0]).unwrap();
        let corner = |i: usize| {
            let a = std::f64::consts::TAU * i as f64 / 90.0;
            [3.0 * a.cos(), 3.0 * a.sin()]
        };
        let polygon = [0, 1, 2, 3].map(corner);
        let of = |minimum| parts::<8, 2>(minimum, &polygon, &places(&axis, 0), &[1.0; 3]).functional.value;
        assert!(of(Minimum::Variation) < 1e-24);
        assert!((90.0 * of(Minimum::Energy) - std::f64::consts::TAU / 3.0).abs() < 1e-2);
    }
}
