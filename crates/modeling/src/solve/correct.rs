//! One correction of the saddle system: what every solver provides, and the loop refines.

/// Solves `[H A^T; A -G] [dx; dl] = [r1; r2]` (G = 1 / w on soft rows), to a factor or in steps.
pub(crate) trait Correct {
    /// Takes a right-hand side; the correction starts from zero.
    fn begin(&mut self, r1: &[f64], r2: &[f64]);

    /// A bounded piece of work; true when the correction is as good as it was asked to be.
    fn step(&mut self) -> bool;

    /// The correction so far: unknowns and multipliers.
    fn correction(&self) -> (&[f64], &[f64]);

    /// Forgets what the first correction of a right-hand side set the goal by.
    fn restart(&mut self) {}

    /// Iterations of the current correction.
    fn iterations(&self) -> usize {
        0
    }

    /// How many corrections may follow each other, and what share of the last one counts as progress; `met` when all
    /// hard rows are, up to the tolerance.
    fn patience(&self, _met: bool) -> (usize, f64) {
        (30, 0.3)
    }

    /// True where only the constraint residual needs correcting: unknowns are then exact functions of the multipliers.
    fn follows_multipliers(&self) -> bool {
        false
    }
}
