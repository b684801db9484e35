use super::*;

#[test]
fn the_square_of_a_projection_is_that_of_what_the_basis_reproduces() {
    // polynomials of degree < M, as box means of the children, are reproduced: their squares survive the pull
    for order in 1..=4 {
        let b = CellBasis::new(CellShape::Interval, CellFamily::Flatlet, order).unwrap();
        let parent: Vec<f64> = (0..order).map(|i| 1.0 + (i as f64).powi(order as i32 - 1)).collect();
        let mut pulled = vec![0.0; order];
        let mut square = 0.0;
        for c in 0..2 {
            let mut child = vec![0.0; order];
            b.push(c, &parent, &mut child, |a, k, p| *a += k * p);
            square += child.iter().map(|v| v * v).sum::<f64>() / (2 * order) as f64;
            b.pull(c, &child, &mut pulled, |a, k, p| *a += k * p);
        }
        let got = b.projected_square(pulled.into_iter());
        assert!((got / square - 1.0).abs() < 1e-12, "order {order}: {got} instead of {square}");
    }
}

fn all() -> Vec<CellBasis> {
    let mut bases = Vec::new();
    for shape in [CellShape::Interval, CellShape::Square, CellShape::Triangle] {
        for order in 1..=6 {
            bases.push(CellBasis::new(shape, CellFamily::Multiwavelet, order).unwrap());
        }
        for order in 1..=4 {
            bases.push(CellBasis::new(shape, CellFamily::Flatlet, order).unwrap());
        }
    }
    bases
}

#[test]
fn multiwavelets_are_orthonormal_and_refine_exactly() {
    for b in all().iter().filter(|b| b.family() == CellFamily::Multiwavelet) {
        let n = b.len();
        let (points, weights) = b.shape().rule(b.order() + 1);
        let mut gram = vec![0.0; n * n];
        let mut v = vec![0.0; n];
        for (x, w) in points.iter().zip(&weights) {
            b.eval(*x, &mut v);
            for i in 0..n {
                for j in 0..n {
                    gram[i * n + j] += w * v[i] * v[j];
                }
            }
        }
        for i in 0..n {
            for j in 0..n {
                let want = if i == j { 1.0 } else { 0.0 };
                assert!((gram[i * n + j] - want).abs() < 1e-13, "{:?} {} gram {i} {j}", b.shape(), b.order());
            }
        }
        // a parent's function, read in a child, has the parent's value
        let parent: Vec<f64> = (0..n).map(|i| 1.0 / (i as f64 + 1.3)).collect();
        for x in b.shape().test_points() {
            let (c, local) = b.shape().descend(x);
            let mut child = vec![0.0; n];
            b.push(c, &parent, &mut child, |a, k, p| *a += k * p);
            let value = |c: &[f64], x: [f64; 2]| {
                let mut v = vec![0.0; n];
                b.eval(x, &mut v);
                v.iter().zip(c).map(|(v, c)| v * c).sum::<f64>()
            };
            assert!((value(&parent, x) - value(&child, local)).abs() < 1e-13, "{:?} {}", b.shape(), b.order());
        }
    }
}

#[test]
fn pull_undoes_push() {
    for b in all() {
        let n = b.len();
        let parent: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).cos()).collect();
        let mut back = vec![0.0; n];
        for c in 0..b.shape().arity() {
            let mut child = vec![0.0; n];
            b.push(c, &parent, &mut child, |a, k, p| *a += k * p);
            b.pull(c, &child, &mut back, |a, k, p| *a += k * p);
        }
        // for flatlets push and pull are adjoint, and a push of one level is undone by box means, not by pull
        if b.family() == CellFamily::Multiwavelet {
            for i in 0..n {
                assert!((parent[i] - back[i]).abs() < 1e-10, "{:?} {} {i}", b.shape(), b.order());
            }
        }
    }
}

#[test]
fn flatlet_duals_are_the_inverse_transpose_of_eq_115() {
    // thesis Eq. (115) inverse transpose: first rows (5 3 1 -1)/8 and (-1 1 3 5)/8; heights here are twice that
    let f2 = CellBasis::new(CellShape::Interval, CellFamily::Flatlet, 2).unwrap();
    assert_eq!(f2.two_scale(0), [1.25, 0.75, -0.25, 0.25]);
    assert_eq!(f2.two_scale(1), [0.25, -0.25, 0.75, 1.25]);
    let f3 = CellBasis::new(CellShape::Interval, CellFamily::Flatlet, 3).unwrap();
    for (got, want) in f3.two_scale(0).iter().zip([11.0, 5.0, 1.0, -4.0, 4.0, 8.0, 1.0, -1.0, -1.0]) {
        assert!((got - want / 8.0).abs() < 1e-15, "{got} {want}");
    }
}

#[test]
fn flatlets_reproduce_the_means_of_polynomials() {
    for order in 1..=4 {
        let b = CellBasis::new(CellShape::Square, CellFamily::Flatlet, order).unwrap();
        let f = |x: [f64; 2]| (0..order).map(|k| (x[0] - 0.3).powi(k as i32) * (1.0 + x[1]).powi(k as i32)).sum();
        let project = |map: &dyn Fn([f64; 2]) -> [f64; 2]| {
            let f: &dyn Fn([f64; 2]) -> f64 = &f;
            let samples: Vec<f64> = b.analysis(4).points.iter().map(|x| f(map(*x))).collect();
            b.analysis(4).coefficients(&samples)
        };
        let parent: Vec<f64> = project(&|x| x);
        for c in 0..4 {
            let (o, _) = b.shape().child(c);
            let want: Vec<f64> = project(&|x| [o[0] + 0.5 * x[0], o[1] + 0.5 * x[1]]);
            let mut child = vec![0.0; b.len()];
            b.push(c, &parent, &mut child, |a, k, p| *a += k * p);
            for (got, want) in child.iter().zip(&want) {
                assert!((got - want).abs() < 1e-12, "order {order}: {got} {want}");
            }
        }
    }
}

#[test]
fn lower_orders_are_parts_of_higher_ones() {
    for shape in [CellShape::Square, CellShape::Triangle] {
        let m3 = CellBasis::new(shape, CellFamily::Multiwavelet, 3).unwrap();
        let m2 = CellBasis::new(shape, CellFamily::Multiwavelet, 2).unwrap();
        let x = [0.21, 0.34];
        let (mut high, mut low) = (vec![0.0; m3.len()], vec![0.0; m2.len()]);
        m3.eval(x, &mut high);
        m2.eval(x, &mut low);
        for (i, &k) in m3.truncated(2).iter().enumerate() {
            assert!((high[k as usize] - low[i]).abs() < 1e-13);
        }
    }
}

#[test]
fn orders_outside_the_family_are_refused() {
    assert_eq!(
        CellBasis::new(CellShape::Square, CellFamily::Flatlet, 5).unwrap_err(),
        OrderError { family: "flatlet", order: 5, limit: 4 }
    );
    assert!(CellBasis::new(CellShape::Square, CellFamily::Multiwavelet, 0).is_err());
}
