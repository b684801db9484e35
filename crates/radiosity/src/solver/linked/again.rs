//! Going on from a solution whose links are known: other emissions and reflectances, without a ray.

use super::{Linked, Phase, counted_area};
use crate::kernel::LightKernel;
use crate::scene::{Paint, PaintError};
use crate::settings::Settings;
use crate::solution::Solution;
use std::sync::Arc;

impl Linked {
    /// Goes on from the links of a solution; `None` if it has none.
    pub(crate) fn resume(solution: &Solution) -> Option<Self> {
        if solution.links().is_empty() {
            return None;
        }
        let scene = solution.scene().clone();
        let kernel = LightKernel::new(&scene);
        let mut engine = Linked {
            links: solution.links().clone(),
            statistics: solution.statistics().clone(),
            rays_before: solution.statistics().rays,
            resumed: true,
            ..Self::at_the_start(scene, solution.settings(), kernel, solution.forest().clone())
        };
        if engine.settings.is_uniform() {
            engine.uniform = Some(engine.uniform_as_it_is());
        }
        engine.begin_again();
        Some(engine)
    }

    pub(crate) fn settings(&self) -> Settings {
        self.settings
    }

    /// Paints materials, and begins the balance again.
    ///
    /// # Errors
    /// Paint that does not fit, and light from sides that were black before: nothing links it.
    pub(crate) fn paint(&mut self, paints: &[Paint]) -> Result<(), PaintError> {
        let painted = self.scene.painted(paints)?;
        for (side, frame) in painted.sides.iter().zip(self.kernel.sides()) {
            let material = painted.material(*side);
            if !frame.shoots && material.sends_light() {
                return Err(PaintError::Unlinked { name: material.name.clone() });
            }
        }
        self.scene = Arc::new(painted);
        self.begin_again();
        Ok(())
    }

    /// Promises another error.
    pub(crate) fn promise(&mut self, error: f64) {
        self.settings.error = error;
        self.begin_again();
    }

    fn begin_again(&mut self) {
        self.counted_area = counted_area(&self.scene, &self.kernel);
        (self.stalled, self.error) = (false, f64::INFINITY);
        // the links are what a finished solve had: nothing to look at again before the light is known
        (self.strict, self.renewed) = (true, true);
        // from the dark: the same light, whatever was balanced before
        self.irradiance.fill([0.0; 3]);
        self.phase = Phase::Beginning;
    }
}
