//! Orthogonal polynomials on the unit interval and the triangle, all degrees below [`ORDERS`] at once.

/// One more than the highest degree: the highest order of a multiwavelet basis.
pub(crate) const ORDERS: usize = crate::tree::TreeFamily::MAX_MULTIWAVELET;

/// sqrt(2k+1) P_k(2x - 1), orthonormal on [0, 1].
pub(crate) fn legendre(x: f64) -> [f64; ORDERS] {
    let z = 2.0 * x - 1.0;
    let mut p = [1.0; ORDERS];
    p[1] = z;
    for k in 1..ORDERS - 1 {
        let f = k as f64;
        p[k + 1] = ((2.0 * f + 1.0) * z * p[k] - f * p[k - 1]) / (f + 1.0);
    }
    for (k, p) in p.iter_mut().enumerate() {
        *p *= ((2 * k + 1) as f64).sqrt();
    }
    p
}

/// (1-t)^k P_k(z / (1-t)) with z = 2s + t - 1: the s part of the orthonormal polynomials on the triangle
/// (Dubiner 1991), by a recurrence that never divides.
pub(crate) fn scaled_legendre(x: [f64; 2]) -> [f64; ORDERS] {
    let (z, r) = (2.0 * x[0] + x[1] - 1.0, 1.0 - x[1]);
    let mut q = [1.0; ORDERS];
    q[1] = z;
    for k in 1..ORDERS - 1 {
        let f = k as f64;
        q[k + 1] = ((2.0 * f + 1.0) * z * q[k] - f * r * r * q[k - 1]) / (f + 1.0);
    }
    q
}

/// Jacobi polynomials P_n^(a,0)(y).
pub(crate) fn jacobi(a: usize, y: f64) -> [f64; ORDERS] {
    let a = a as f64;
    let mut p = [1.0; ORDERS];
    p[1] = 0.5 * (a + (a + 2.0) * y);
    for k in 2..ORDERS {
        let n = k as f64;
        let m = 2.0 * n + a;
        let forward = (m - 1.0) * (m * (m - 2.0) * y + a * a) * p[k - 1];
        let back = 2.0 * (n + a - 1.0) * (n - 1.0) * m * p[k - 2];
        p[k] = (forward - back) / (2.0 * n * (n + a) * (m - 2.0));
    }
    p
}
