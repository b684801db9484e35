//! The tangent, normal, binormal frame of a curve (6.2.1), in which detail follows the broad sweep.

/// An orthonormal frame. The normal is tangent x binormal as printed in (143), minus the principal normal, so the frame
/// (tangent, normal, binormal) is left-handed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Unit tangent (141).
    pub tangent: [f64; 3],
    /// Tangent x binormal (143).
    pub normal: [f64; 3],
    /// Unit binormal (142).
    pub binormal: [f64; 3],
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit(a: [f64; 3]) -> Option<[f64; 3]> {
    let n = dot(a, a).sqrt();
    (n.is_finite() && n > 0.0).then(|| a.map(|x| x / n))
}

impl Frame {
    /// The frame at a point with the given first and second derivative; `None` where they are zero or parallel (to
    /// 1e-12 of their lengths), as at mirrored ends and on straight pieces.
    ///
    /// ```
    /// use ondelette_wavelet::Frame;
    /// let frame = Frame::new([2.0, 0.0, 0.0], [0.0, 3.0, 0.0]).unwrap();
    /// assert_eq!(frame.binormal, [0.0, 0.0, 1.0]);
    /// assert_eq!(frame.from_frame(frame.to_frame([1.0, 2.0, 3.0])), [1.0, 2.0, 3.0]);
    /// assert!(Frame::new([1.0, 0.0, 0.0], [2.0, 0.0, 0.0]).is_none());
    /// ```
    pub fn new(first: [f64; 3], second: [f64; 3]) -> Option<Frame> {
        let tangent = unit(first)?;
        let area = cross(tangent, unit(second)?);
        if dot(area, area) < 1e-24 {
            return None;
        }
        let binormal = unit(area)?;
        Some(Frame { tangent, normal: cross(tangent, binormal), binormal })
    }

    /// Coordinates (tangent, normal, binormal) of a vector.
    pub fn to_frame(&self, v: [f64; 3]) -> [f64; 3] {
        [dot(self.tangent, v), dot(self.normal, v), dot(self.binormal, v)]
    }

    /// The vector with the given coordinates.
    pub fn from_frame(&self, c: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| c[0] * self.tangent[i] + c[1] * self.normal[i] + c[2] * self.binormal[i])
    }
}
