//! The editor: handles of the do level, pictures of the see level (6.2).

use super::ladder::{EditError, Ladder};
use super::orientation::{Orientation, carried};
use crate::shape::vector::{add, mix, scale};

/// An editing session on one shape.
///
/// Both levels can be set at any time; smooth control points are kept valid on all levels between them, and the partial
/// pyramids run only where they are missing.
///
/// ```
/// use ondelette_modeling::{Axis, edit::{CurveLadder, Editor, Orientation}, shape::Curve};
/// use ondelette_wavelet::Boundary;
/// let axis = Axis::new(Boundary::Open, 16, [0.0, 1.0])?;
/// let curve = Curve::new(axis, 2, (0..19).map(|i| [f64::from(i), f64::from(i % 2), 0.0]).collect())?;
/// let mut editor = Editor::new(CurveLadder::new(&curve)?);
/// editor.set_do_level(2)?;
/// editor.drag([3, 0], [0.0, 5.0, 0.0], Orientation::Fixed)?;
/// let bent = editor.shape()?;
/// // The sweep moved, the small zigzag is still on it.
/// assert!(bent.point(0.5)[1] > 3.0);
/// assert!(bent.points()[9][1] != bent.points()[10][1]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Editor<L> {
    ladder: L,
    /// Coarsest and finest valid smooth level.
    valid: [usize; 2],
    do_level: usize,
    see_level: usize,
}

impl<L: Ladder> Editor<L> {
    /// A session with both levels at the finest.
    pub fn new(ladder: L) -> Editor<L> {
        let levels = ladder.levels();
        Editor { ladder, valid: [0, levels], do_level: levels, see_level: levels }
    }

    /// The finest level.
    pub fn levels(&self) -> usize {
        self.ladder.levels()
    }

    /// The level whose control points are handles.
    pub fn do_level(&self) -> usize {
        self.do_level
    }

    /// The level that is shown.
    pub fn see_level(&self) -> usize {
        self.see_level
    }

    /// Sets the do level.
    ///
    /// # Errors
    /// There is no such level.
    pub fn set_do_level(&mut self, level: usize) -> Result<(), EditError> {
        self.reach(level)?;
        self.do_level = level;
        Ok(())
    }

    /// Sets the see level.
    ///
    /// # Errors
    /// There is no such level.
    pub fn set_see_level(&mut self, level: usize) -> Result<(), EditError> {
        self.reach(level)?;
        self.see_level = level;
        Ok(())
    }

    /// The control polygon (or net, row-major) of a level: the unique smooth version of the shape there.
    ///
    /// # Errors
    /// There is no such level.
    pub fn control(&mut self, level: usize) -> Result<&[[f64; 3]], EditError> {
        self.reach(level)?;
        Ok(self.ladder.smooth(level))
    }

    /// The ladder; its smooth control points are valid between do and see level at least.
    pub fn ladder(&self) -> &L {
        &self.ladder
    }

    /// Makes a smooth level valid.
    fn reach(&mut self, level: usize) -> Result<(), EditError> {
        let levels = self.levels();
        if level > levels {
            return Err(EditError::Level { level: level as f64, levels });
        }
        if level < self.valid[0] {
            self.ladder.coarser(self.valid[0], level);
            self.valid[0] = level;
        }
        if level > self.valid[1] {
            self.ladder.finer(self.valid[1], level);
            self.valid[1] = level;
        }
        Ok(())
    }

    fn place(&self, level: usize, index: [usize; 2]) -> Result<usize, EditError> {
        let shape = self.ladder.shape(level);
        if index[0] >= shape[0] || index[1] >= shape[1] {
            return Err(EditError::Index { index, level, shape });
        }
        Ok(index[0] * shape[1] + index[1])
    }

    /// `manipulate`: moves a control point of the do level (curves: index `[i, 0]`) and carries the change to the see
    /// level; finer detail is kept, oriented as asked.
    ///
    /// # Errors
    /// There is no such control point; a number that is not finite; frames of curves on a surface. Nothing changes
    /// then.
    pub fn drag(&mut self, index: [usize; 2], by: [f64; 3], orientation: Orientation) -> Result<(), EditError> {
        let at = self.place(self.do_level, index)?;
        finite("the displacement", &by)?;
        let mut moved = self.ladder.smooth(self.do_level).to_vec();
        moved[at] = add(moved[at], by);
        self.set_smooth(self.do_level, &moved, orientation)
    }

    /// Replaces the smooth control points of a level and carries the change to the see level.
    ///
    /// # Errors
    /// As [`Editor::drag`].
    ///
    /// # Panics
    /// If their number does not fit.
    pub fn set_smooth(&mut self, level: usize, points: &[[f64; 3]], orientation: Orientation) -> Result<(), EditError> {
        self.reach(level)?;
        points.iter().try_for_each(|p| finite("a control point", p))?;
        let levels = self.levels();
        match orientation {
            Orientation::Fixed => {
                self.ladder.smooth_mut(level).copy_from_slice(points);
                self.valid = [level; 2];
            }
            Orientation::Frenet => {
                self.reach(levels)?;
                let old: Vec<_> = (level..levels).map(|i| self.ladder.smooth(i).to_vec()).collect();
                let mut ladder = self.ladder.clone();
                ladder.smooth_mut(level).copy_from_slice(points);
                ladder.finer_in_frames(level, &old)?;
                self.ladder = ladder;
                self.valid = [level, levels];
            }
            Orientation::Turning => {
                self.reach(levels)?;
                let old = self.ladder.prolong(level, levels, self.ladder.smooth(level));
                let new = self.ladder.prolong(level, levels, points);
                let turns = self.ladder.turns(levels, &old, &new);
                let fine = carried(self.ladder.smooth(levels), &old, &new, &turns);
                self.ladder.replace(&fine);
                self.valid = [levels; 2];
            }
        }
        self.reach(self.see_level)?;
        self.reach(self.do_level)
    }

    /// The full shape.
    ///
    /// # Errors
    /// It left the finite numbers.
    pub fn shape(&mut self) -> Result<L::Shape, EditError> {
        let levels = self.levels();
        self.reach(levels)?;
        self.ladder.build(self.ladder.smooth(levels).to_vec())
    }

    /// The shape at the see level: its smooth version there, on the finest knots.
    ///
    /// # Errors
    /// It left the finite numbers.
    pub fn seen(&mut self) -> Result<L::Shape, EditError> {
        self.seen_at(self.see_level as f64)
    }

    /// The shape at a fractional level: between the smooth versions of the levels beside it, linearly (Finkelstein and
    /// Salesin 1994).
    ///
    /// # Errors
    /// A level outside 0 to the finest, or not a number.
    pub fn seen_at(&mut self, level: f64) -> Result<L::Shape, EditError> {
        let (upper, points) = self.fractional(level)?;
        let levels = self.levels();
        self.ladder.build(self.ladder.prolong(upper, levels, &points))
    }

    /// Control points at a fractional level, as an array of the level above it: `(that level, control points)`.
    ///
    /// # Errors
    /// A level outside 0 to the finest, or not a number.
    pub fn fractional(&mut self, level: f64) -> Result<(usize, Vec<[f64; 3]>), EditError> {
        let (lower, part) = self.split(level)?;
        if part == 0.0 {
            self.reach(lower)?;
            return Ok((lower, self.ladder.smooth(lower).to_vec()));
        }
        self.reach(lower)?;
        self.reach(lower + 1)?;
        let below = self.ladder.prolong(lower, lower + 1, self.ladder.smooth(lower));
        let above = self.ladder.smooth(lower + 1);
        Ok((lower + 1, below.iter().zip(above).map(|(&b, &a)| mix(b, a, part)).collect()))
    }

    fn split(&self, level: f64) -> Result<(usize, f64), EditError> {
        let levels = self.levels();
        if !(level >= 0.0 && level <= levels as f64) {
            return Err(EditError::Level { level, levels });
        }
        Ok((level as usize, level - level.floor()))
    }

    /// Moves a control point of a fractional level `r + m` (an index of the array of level `r + 1`, see
    /// [`Editor::fractional`]): `m` of the way as a hump of level `r + 1`, the rest by the least change of level `r`
    /// that moves this control point as far. At whole levels this is [`Editor::drag`].
    ///
    /// # Errors
    /// As [`Editor::drag`], and a level outside 0 to the finest.
    pub fn drag_at(
        &mut self,
        level: f64,
        index: [usize; 2],
        by: [f64; 3],
        orientation: Orientation,
    ) -> Result<(), EditError> {
        let (lower, part) = self.split(level)?;
        finite("the displacement", &by)?;
        if part == 0.0 {
            let before = self.do_level;
            self.set_do_level(lower)?;
            let done = self.drag(index, by, orientation);
            self.do_level = before;
            self.reach(before)?;
            return done;
        }
        let upper = lower + 1;
        let at = self.place(upper, index)?;
        self.reach(lower)?;
        self.reach(upper)?;
        let [along_s, along_t] = self.ladder.parents(lower, index);
        let width = self.ladder.shape(lower)[1];
        let pairs = along_s.iter().flat_map(|&(i, a)| along_t.iter().map(move |&(j, b)| (i * width + j, a * b)));
        let weights: Vec<(usize, f64)> = pairs.collect();
        let norm: f64 = weights.iter().map(|w| w.1 * w.1).sum();
        let mut below = vec![[0.0; 3]; self.ladder.smooth(lower).len()];
        if norm > 0.0 {
            weights.iter().for_each(|&(i, w)| below[i] = scale(by, (1.0 - part) * w / norm));
        }
        let mut change = self.ladder.prolong(lower, upper, &below);
        change[at] = add(change[at], scale(by, if norm > 0.0 { part } else { 1.0 }));
        let moved: Vec<_> = self.ladder.smooth(upper).iter().zip(&change).map(|(&p, &d)| add(p, d)).collect();
        self.set_smooth(upper, &moved, orientation)
    }
}

pub(super) fn finite(what: &'static str, values: &[f64]) -> Result<(), EditError> {
    match values.iter().find(|v| !v.is_finite()) {
        Some(&value) => Err(EditError::NotFinite { what, value }),
        None => Ok(()),
    }
}
