//! Where the unknowns live: the B-spline coefficients of a curve or of a tensor surface.

use crate::axis::Axis;

/// The scalar spline space of a curve (one axis) or of a tensor surface (two).
///
/// Coefficients of surfaces are row-major: `x[i * nt + j]`, axis 0 = s, axis 1 = t.
///
/// ```
/// use ondelette_modeling::{Axis, system::Space};
/// use ondelette_wavelet::Boundary;
/// let s = Axis::new(Boundary::Open, 8, [0.0, 1.0])?;
/// let t = Axis::new(Boundary::Periodic, 16, [0.0, 1.0])?;
/// assert_eq!(Space::curve(t).len(), 16);
/// assert_eq!(Space::surface(s, t).len(), 11 * 16);
/// # Ok::<(), ondelette_modeling::AxisError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Space {
    axes: Vec<Axis>,
}

impl Space {
    /// The space of curves over an axis.
    pub fn curve(axis: Axis) -> Space {
        Space { axes: vec![axis] }
    }

    /// The space of surfaces over `s` times `t`.
    pub fn surface(s: Axis, t: Axis) -> Space {
        Space { axes: vec![s, t] }
    }

    /// One axis or two.
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// True for curves.
    pub fn is_curve(&self) -> bool {
        self.axes.len() == 1
    }

    /// Number of coefficients of one coordinate.
    #[allow(clippy::len_without_is_empty, reason = "a space is never empty")]
    pub fn len(&self) -> usize {
        self.axes.iter().map(Axis::len).product()
    }

    /// Number of cells: spans, or spans times spans.
    pub fn cells(&self) -> usize {
        self.axes.iter().map(Axis::spans).product()
    }

    /// Rows and columns of the coefficients; a curve is one row.
    pub(crate) fn shape(&self) -> [usize; 2] {
        match &self.axes[..] {
            [t] => [1, t.len()],
            [s, t] => [s.len(), t.len()],
            _ => [0, 0],
        }
    }

    /// The space on half as many spans, where both axes allow it.
    pub(crate) fn coarser(&self) -> Option<Space> {
        let half =
            |a: &Axis| a.spans().is_multiple_of(2).then(|| Axis::new(a.boundary(), a.spans() / 2, a.domain()).ok());
        let axes = self.axes.iter().map(|a| half(a).flatten()).collect::<Option<Vec<Axis>>>()?;
        Some(Space { axes })
    }
}
