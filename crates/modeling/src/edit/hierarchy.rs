//! Hierarchical B-splines (Forsey and Bartels 1988), for comparison: what wavelets extend.

use super::editor::finite;
use super::ladder::{EditError, Ladder};
use super::orientation::Orientation;
use crate::shape::vector::{add, sub};

/// A shape as a sum of B-splines of all levels: offsets of control points, level by level.
///
/// A coarse edit carries finer offsets along, but a fine edit means nothing to coarser levels: the same shape has many
/// representations, and which one depends on how it was made (6.2). Compare [`super::Editor`].
#[derive(Clone, Debug)]
pub struct Hierarchy<L> {
    ladder: L,
    /// Level 0: control points; finer levels: offsets from the refined level below.
    offsets: Vec<Vec<[f64; 3]>>,
}

impl<L: Ladder> Hierarchy<L> {
    /// The hierarchy that begins with the coarsest level of a shape (all levels of `ladder` valid) and keeps the rest
    /// as offsets: one of its many representations.
    pub fn new(ladder: L) -> Hierarchy<L> {
        let mut offsets = vec![ladder.smooth(0).to_vec()];
        for level in 0..ladder.levels() {
            let below = ladder.prolong(level, level + 1, ladder.smooth(level));
            offsets.push(ladder.smooth(level + 1).iter().zip(below).map(|(&a, b)| sub(a, b)).collect());
        }
        Hierarchy { ladder, offsets }
    }

    /// Control points of a level: the sum of everything up to it.
    ///
    /// # Errors
    /// There is no such level.
    pub fn control(&self, level: usize) -> Result<Vec<[f64; 3]>, EditError> {
        let levels = self.ladder.levels();
        if level > levels {
            return Err(EditError::Level { level: level as f64, levels });
        }
        let up = |points: Vec<[f64; 3]>, i: usize| -> Vec<[f64; 3]> {
            let refined = self.ladder.prolong(i, i + 1, &points);
            refined.into_iter().zip(&self.offsets[i + 1]).map(|(a, &b)| add(a, b)).collect()
        };
        Ok((0..level).fold(self.offsets[0].clone(), up))
    }

    /// Moves a control point of a level; offsets of finer levels are carried along, fixed or turning.
    ///
    /// # Errors
    /// There is no such control point; a number that is not finite; [`Orientation::Frenet`], which is for wavelets.
    pub fn drag(
        &mut self,
        level: usize,
        index: [usize; 2],
        by: [f64; 3],
        orientation: Orientation,
    ) -> Result<(), EditError> {
        finite("the displacement", &by)?;
        let levels = self.ladder.levels();
        let old = self.control(level)?;
        let shape = self.ladder.shape(level);
        if index[0] >= shape[0] || index[1] >= shape[1] {
            return Err(EditError::Index { index, level, shape });
        }
        if orientation == Orientation::Frenet {
            return Err(EditError::FrenetSurface);
        }
        let at = index[0] * shape[1] + index[1];
        let mut parents = (old.clone(), old);
        parents.1[at] = add(parents.1[at], by);
        self.offsets[level][at] = add(self.offsets[level][at], by);
        if orientation == Orientation::Fixed {
            return Ok(());
        }
        for i in level..levels {
            let fine = [&parents.0, &parents.1].map(|p| self.ladder.prolong(i, levels, p));
            let turns = self.ladder.turns(i + 1, &fine[0], &fine[1]);
            let [before, after] = [&parents.0, &parents.1].map(|p| self.ladder.prolong(i, i + 1, p));
            let sum = |base: Vec<[f64; 3]>, offsets: &[[f64; 3]]| -> Vec<[f64; 3]> {
                base.into_iter().zip(offsets).map(|(a, &b)| add(a, b)).collect()
            };
            let before = sum(before, &self.offsets[i + 1]);
            self.offsets[i + 1].iter_mut().zip(&turns).for_each(|(o, turn)| *o = turn.apply(*o));
            let after = sum(after, &self.offsets[i + 1]);
            parents = (before, after);
        }
        Ok(())
    }

    /// The shape.
    ///
    /// # Errors
    /// It left the finite numbers.
    pub fn shape(&self) -> Result<L::Shape, EditError> {
        self.ladder.build(self.control(self.ladder.levels())?)
    }
}
