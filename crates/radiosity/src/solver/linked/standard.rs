//! The standard decomposition of a full matrix, thresholded, and the light solved again on what is kept.

use super::{Event, Linked, Phase};
use crate::solution::Terms;
use ondelette_compress::Standard;

/// Share of the promise that dropped terms may take.
pub(super) const SHARE: f64 = 0.1;

impl Linked {
    /// Decomposes the matrix that keeps the promise and starts to solve on the terms that are left.
    ///
    /// By Cauchy and Schwarz the mean over the area of |change E| is at most its norm over the root of the area, and
    /// that norm at most the Hilbert-Schmidt norm of what is dropped times the norm of the radiosity; reflections
    /// multiply the change by at most 1 / (1 - rho).
    pub(super) fn decompose(&mut self) -> Event {
        let mean = self.mean_irradiance().sum();
        let radiosity = self.radiosity(&self.irradiance, true);
        let stride = self.forest.stride();
        let mut squares = [0.0; 3];
        for (n, slots) in radiosity.chunks(stride).enumerate() {
            for v in slots {
                for c in 0..3 {
                    squares[c] += self.forest.nodes()[n].measure * v[c] * v[c];
                }
            }
        }
        let norm: f64 = squares.map(f64::sqrt).iter().sum();
        let allowed =
            SHARE * self.settings.error * (1.0 - self.highest_reflectance()) * mean * self.counted_area.sqrt();
        let budget = if norm > 0.0 { allowed / norm } else { 0.0 };
        if let Some((standard, terms)) = Standard::of(&self.forest, &self.links, budget) {
            self.standard = Some(standard);
            self.statistics.terms =
                Some(Terms { full: terms.full, standard: terms.standard, nonstandard: terms.nonstandard });
        }
        self.start_solving();
        Event::Solved { error: self.error, links: self.links.len(), elements: self.forest.leaves() }
    }

    /// After a balance on the decomposed matrix: its error is that of the matrix, and the share of what was dropped.
    pub(super) fn conclude(&mut self) -> Event {
        self.error += SHARE * self.settings.error;
        self.phase = Phase::Finished;
        Event::Solved { error: self.error, links: self.links.len(), elements: self.forest.leaves() }
    }
}
