//! What an editor needs of a shape on all its levels.

use super::orientation::Turn;
use crate::axis::Axis;
use crate::shape::ShapeError;
use ondelette_wavelet::{PyramidError, TransformError};

/// Why an edit is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EditError {
    /// The shape has no levels.
    #[error(transparent)]
    Pyramid(PyramidError),
    /// Values that are not finite.
    #[error(transparent)]
    Transform(#[from] TransformError),
    /// The edited shape is not one.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// There is no such level.
    #[error("level {level}: this shape has levels 0 to {levels}")]
    Level {
        /// Level asked for.
        level: f64,
        /// The finest.
        levels: usize,
    },
    /// There is no such control point.
    #[error("control point {index:?}: level {level} has {shape:?} of them, counted from 0")]
    Index {
        /// Index asked for.
        index: [usize; 2],
        /// Level.
        level: usize,
        /// How many there are along s and t (curves: along t, and 1).
        shape: [usize; 2],
    },
    /// A number that is not finite.
    #[error("{what} is {value}: give finite numbers")]
    NotFinite {
        /// What it was for.
        what: &'static str,
        /// What it is.
        value: f64,
    },
    /// A pull outside the domain.
    #[error("pull {pull}: parameter {value} is outside the domain [{from}, {to}]")]
    Outside {
        /// Index of the pull.
        pull: usize,
        /// The parameter.
        value: f64,
        /// Start of the domain.
        from: f64,
        /// End of the domain.
        to: f64,
    },
    /// Pulls that cannot hold together.
    #[error(
        "pull {pull} contradicts those before it: the functions of this level that reach it are already held \
         (it misses by {miss:e}); edit on a finer level or drop one"
    )]
    Conflict {
        /// Index of the pull.
        pull: usize,
        /// How far it would be missed.
        miss: f64,
    },
    /// The delta method needs a coarse uniform axis.
    #[error("{spans} spans cannot be halved {times} times: the delta method needs a uniform coarse basis")]
    NotUniform {
        /// Spans of the finest level.
        spans: usize,
        /// Levels between.
        times: usize,
    },
    /// Frames of curves on a surface.
    #[error("tangent, normal and binormal are frames of curves; a surface's detail is fixed or turns")]
    FrenetSurface,
}

/// One shape in all its hybrid bases (6.2): smooth control points and detail by level, of which some are valid.
///
/// Level 0 is the coarsest. Invariant of the thesis: details are valid on every level from the finest down to the
/// coarsest valid smooth level. [`Ladder::coarser`] and [`Ladder::finer`] are the partial pyramids.
pub trait Ladder: Clone {
    /// What the ladder is of.
    type Shape;

    /// The axes of the finest level: one, or those of s and t.
    fn axes(&self) -> Vec<Axis>;

    /// The finest level.
    fn levels(&self) -> usize;

    /// Control points of a level along s and t; curves have 1 along t.
    fn shape(&self, level: usize) -> [usize; 2];

    /// Parameters of the control points of a level, by direction (Greville abscissae), in domain units.
    fn sites(&self, level: usize) -> [Vec<f64>; 2];

    /// Smooth control points of a level, row-major: its control polygon or net.
    fn smooth(&self, level: usize) -> &[[f64; 3]];

    /// Smooth control points of a level, to be changed.
    fn smooth_mut(&mut self, level: usize) -> &mut [[f64; 3]];

    /// `partial_coef_pyrm_up`: smooth levels from `from - 1` down to `to` and their details become valid.
    fn coarser(&mut self, from: usize, to: usize);

    /// `partial_coef_pyrm_down`: smooth levels from `from + 1` up to `to` become valid.
    fn finer(&mut self, from: usize, to: usize);

    /// Control points of a level on a finer one: the same function, without detail.
    fn prolong(&self, from: usize, to: usize, points: &[[f64; 3]]) -> Vec<[f64; 3]>;

    /// How control points of a level make the one at `index` of the next finer level, as factors by direction.
    fn parents(&self, level: usize, index: [usize; 2]) -> [Vec<(usize, f64)>; 2];

    /// The functions of a level alive at a parameter, with derivatives of the given orders, as factors by direction.
    fn row(&self, level: usize, at: [f64; 2], orders: [usize; 2]) -> [Vec<(usize, f64)>; 2];

    /// The shape with the given control points on the finest level.
    ///
    /// # Errors
    /// A control point that is not finite.
    fn build(&self, finest: Vec<[f64; 3]>) -> Result<Self::Shape, EditError>;

    /// How a smooth shape turned at the control points of a level; both are given on the finest level.
    fn turns(&self, level: usize, old: &[[f64; 3]], new: &[[f64; 3]]) -> Vec<Turn>;

    /// Replaces the finest control points; only the finest level is valid then.
    ///
    /// # Panics
    /// If their number does not fit.
    fn replace(&mut self, finest: &[[f64; 3]]) {
        let levels = self.levels();
        self.smooth_mut(levels).copy_from_slice(finest);
    }

    /// Thesis frames (6.2.1): moves from `from` to the finest level with every wavelet kept in the tangent, normal,
    /// binormal frame of the smooth curve below it, which `old` holds as it was (by level, from `from` on).
    ///
    /// # Errors
    /// [`EditError::FrenetSurface`] on surfaces.
    fn finer_in_frames(&mut self, from: usize, old: &[Vec<[f64; 3]>]) -> Result<(), EditError>;
}
