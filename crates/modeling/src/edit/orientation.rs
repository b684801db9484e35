//! How detail follows the sweep of the shape below it.

use crate::shape::vector::{V, add, cross, dot, scale, sub, unit};

/// What happens to the directions of detail when the smooth shape below it is bent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Orientation {
    /// Detail keeps its x, y, z.
    #[default]
    Fixed,
    /// Every wavelet coefficient keeps its coordinates in the tangent, normal, binormal frame (6.2.1). Wave-shaped
    /// detail wiggles then, as the thesis found; curves only.
    Frenet,
    /// Detail, as control point offsets (humps, not waves), turns by the smallest rotation that takes the old tangent
    /// to the new one; on surfaces, with tangent and normal. It does not wiggle, and where the smooth shape did not
    /// turn nothing changes. The detail is analysed anew afterwards, so the control points of the do level can come
    /// out slightly off where the handle was dropped.
    Turning,
}

/// A rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    rows: [[f64; 3]; 3],
}

impl Turn {
    /// No rotation.
    pub const NONE: Turn = Turn { rows: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] };

    /// The smallest rotation from the direction of `a` to that of `b`; none if either is zero. Half turns are made
    /// about z if `planar`.
    pub fn between(a: [f64; 3], b: [f64; 3], planar: bool) -> Turn {
        let (Some(u), Some(v)) = (unit(a), unit(b)) else { return Turn::NONE };
        if u == v {
            return Turn::NONE;
        }
        let (axis, cos) = (cross(u, v), dot(u, v));
        if cos > -1.0 + 1e-12 {
            let k = 1.0 / (1.0 + cos);
            return Turn::of(|x| add(add(scale(x, cos), cross(axis, x)), scale(axis, k * dot(axis, x))));
        }
        let across = if planar || u[2].abs() < 0.5 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
        let across = unit(sub(across, scale(u, dot(across, u)))).unwrap_or([0.0, 1.0, 0.0]);
        // half a turn about `across`
        Turn::of(|x| sub(scale(across, 2.0 * dot(across, x)), x))
    }

    /// The rotation from the frame (first tangent, normal) of one surface to that of another; none without frames.
    pub(super) fn of_surfaces(old: [V; 2], new: [V; 2]) -> Turn {
        let (Some(a), Some(b)) = (frame(old), frame(new)) else { return Turn::NONE };
        if a == b {
            return Turn::NONE;
        }
        Turn::of(|x| {
            let c = a.map(|e| dot(e, x));
            add(add(scale(b[0], c[0]), scale(b[1], c[1])), scale(b[2], c[2]))
        })
    }

    fn of(map: impl Fn(V) -> V) -> Turn {
        let columns = Turn::NONE.rows.map(map);
        Turn { rows: std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i])) }
    }

    /// A vector, turned.
    pub fn apply(&self, v: [f64; 3]) -> [f64; 3] {
        if *self == Turn::NONE {
            return v;
        }
        self.rows.map(|r| dot(r, v))
    }
}

/// An orthonormal frame from the two tangents of a surface: symmetric in both, so that neither direction is preferred.
fn frame(tangents: [V; 2]) -> Option<[V; 3]> {
    let [s, t] = [unit(tangents[0])?, unit(tangents[1])?];
    let normal = cross(s, t);
    if dot(normal, normal) < 1e-24 {
        return None;
    }
    let normal = unit(normal)?;
    let middle = unit(add(s, t))?;
    Some([middle, cross(normal, middle), normal])
}

/// Turns what `fine` differs from `old` by, and puts it on `new`.
pub(super) fn carried(fine: &[V], old: &[V], new: &[V], turns: &[Turn]) -> Vec<V> {
    let with = |((f, o), (n, turn)): ((&V, &V), (&V, &Turn))| {
        if n == o && *turn == Turn::NONE { *f } else { add(*n, turn.apply(sub(*f, *o))) }
    };
    fine.iter().zip(old).zip(new.iter().zip(turns)).map(with).collect()
}
