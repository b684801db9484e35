//! Arithmetic of points and vectors in space.

pub(crate) type V = [f64; 3];

pub(crate) fn add(a: V, b: V) -> V {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(crate) fn sub(a: V, b: V) -> V {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn scale(a: V, by: f64) -> V {
    a.map(|x| x * by)
}

pub(crate) fn mix(a: V, b: V, w: f64) -> V {
    std::array::from_fn(|i| (1.0 - w) * a[i] + w * b[i])
}

pub(crate) fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: V, b: V) -> V {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn length(a: V) -> f64 {
    dot(a, a).sqrt()
}

pub(crate) fn distance(a: V, b: V) -> f64 {
    length(sub(a, b))
}

/// The unit vector; `None` if the length is zero or not finite.
pub(crate) fn unit(a: V) -> Option<V> {
    let n = length(a);
    (n.is_finite() && n > 0.0).then(|| scale(a, 1.0 / n))
}
