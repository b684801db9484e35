//! A parallel view that frames a box.

/// Maps points of space to pixels and depth.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    right: [f64; 3],
    up: [f64; 3],
    /// Towards the eye.
    pub(super) back: [f64; 3],
    middle: [f64; 3],
    /// Pixels per unit.
    pub(super) scale: f64,
    center: [f64; 2],
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl View {
    /// The plane seen from above, y up or down.
    pub(super) fn flat(y_down: bool) -> View {
        let up = if y_down { [0.0, -1.0, 0.0] } else { [0.0, 1.0, 0.0] };
        View { right: [1.0, 0.0, 0.0], up, back: [0.0, 0.0, 1.0], ..View::from(0.0, 0.0) }
    }

    /// A view from an azimuth and an elevation in degrees, z up.
    pub(super) fn from(azimuth: f64, elevation: f64) -> View {
        let ((sa, ca), (se, ce)) = (azimuth.to_radians().sin_cos(), elevation.to_radians().sin_cos());
        View {
            right: [-sa, ca, 0.0],
            up: [-ca * se, -sa * se, ce],
            back: [ca * ce, sa * ce, se],
            middle: [0.0; 3],
            scale: 1.0,
            center: [0.0; 2],
        }
    }

    /// The view that shows all points with a margin.
    pub(super) fn framing(mut self, points: impl Iterator<Item = [f64; 3]>, size: [usize; 2], margin: f64) -> View {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in points {
            for (c, axis) in [self.right, self.up, self.back].into_iter().enumerate() {
                let x = dot(axis, p);
                low[c] = low[c].min(x);
                high[c] = high[c].max(x);
            }
        }
        let mid: [f64; 3] = std::array::from_fn(|c| 0.5 * (low[c] + high[c]));
        let mid = mid.map(|x| if x.is_finite() { x } else { 0.0 });
        self.middle = std::array::from_fn(|c| self.right[c] * mid[0] + self.up[c] * mid[1] + self.back[c] * mid[2]);
        let fit = |c: usize, n: usize| (n as f64 - 2.0 * margin) / (high[c] - low[c]).max(1e-300);
        self.scale = fit(0, size[0]).min(fit(1, size[1])).clamp(1e-300, 1e300);
        self.center = [0.5 * size[0] as f64, 0.5 * size[1] as f64];
        self
    }

    /// Column, row, and depth towards the eye.
    pub(super) fn project(&self, p: [f64; 3]) -> [f64; 3] {
        let d = std::array::from_fn(|c| p[c] - self.middle[c]);
        [
            self.center[0] + self.scale * dot(self.right, d),
            self.center[1] - self.scale * dot(self.up, d),
            self.scale * dot(self.back, d),
        ]
    }

    pub(super) fn flat_point(&self, p: [f64; 3]) -> [f64; 2] {
        let [x, y, _] = self.project(p);
        [x, y]
    }
}
