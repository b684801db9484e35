//! What the samples of a gathering element say of themselves: how they scatter, and what its functions cannot say.

/// Directions that a usual element is as good as, before any is drawn.
const FIRST_LOOK: f64 = 4.0;

/// What the samples of an element say of themselves.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Verdict {
    /// Root mean square over the element of half the difference of the halves, channels summed: the scatter of their
    /// mean.
    pub(super) scatter: f64,
    /// The same at the points, before the fit.
    pub(super) noise: f64,
    /// The same of one direction.
    pub(super) per_direction: f64,
    /// Mean product of what both halves' fits leave over at the points: on average the square of what the functions
    /// cannot say.
    pub(super) misfit: f64,
    /// Standard deviation of [`Verdict::misfit`].
    pub(super) certainty: f64,
    /// Scatter of the fit over noise at the points, as expected.
    pub(super) share: f64,
}

impl Verdict {
    /// Adds what few samples leave open: as if [`FIRST_LOOK`] directions had had the `usual` square of the noise of
    /// one.
    pub(super) fn doubt(&mut self, usual: f64, drawn: f64) {
        let more = usual * FIRST_LOOK / (drawn.max(1.0) * (drawn + FIRST_LOOK));
        self.noise = self.noise.hypot(more.sqrt());
        self.scatter = self.scatter.hypot(self.share * more.sqrt());
    }
}
