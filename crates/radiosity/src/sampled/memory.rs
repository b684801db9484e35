//! Memory that obeys: what elements and samples take is counted, and samples that do not fit are drawn again whenever
//! they are read.
//!
//! The first samples of every element, which iterations read over and over, always stay. The others are read once a
//! sweep; a sweep of all samples costs their rays then, and finds the same. Fits of direct light begin anew under a
//! cap, with other rays: another answer that keeps the same promise.

use super::direct::Known;
use super::gather::{Draw, Gather};
use super::points::Point;
use super::rays::{Ray, Rays};
use super::{Phase, Sampled};
use crate::solver::SolveError;
use ondelette_compress::forest::Node;

/// Working arrays of one number a function and channel, beside the lasting ones.
const WORKING_ARRAYS: usize = 6;

impl Sampled {
    /// Caps the counted bytes.
    pub(crate) fn limit_memory(&mut self, cap: u64) -> Result<(), SolveError> {
        let least = self.bytes() + self.first_bytes();
        if least > cap {
            return Err(SolveError::Memory { cap, least });
        }
        self.cap = Some(cap);
        Ok(())
    }

    /// Bytes of elements, points and samples, and of the arrays that a sweep works in.
    pub(crate) fn bytes(&self) -> u64 {
        let (groups, stride) = (self.lamps.groups.len(), self.forest.stride());
        let coefficients = stride * size_of::<[f64; 3]>();
        let node = size_of::<Node>()
            + groups * (stride * size_of::<f64>() + 2 * size_of::<f32>())
            + 2 * size_of::<f32>()
            + (1 + WORKING_ARRAYS) * coefficients;
        let gathers: usize = self.gathers.iter().map(|g| g.bytes() + (1 + WORKING_ARRAYS) * coefficients).sum();
        let known: usize = self.known.iter().flatten().map(Known::bytes).sum();
        (self.forest.len() * (node + size_of::<Option<Known>>()) + known + gathers) as u64
    }

    /// Bytes of scene and rays.
    pub(crate) fn scene_bytes(&self) -> u64 {
        self.scene.bytes() + self.kernel.bytes()
    }

    /// Bytes of the first samples of all points, drawn or not.
    fn first_bytes(&self) -> u64 {
        let points: u64 = self.gathers.iter().map(|g| u64::from(g.points())).sum();
        points * 2 * u64::from(Gather::FIRST) * size_of::<Ray>() as u64
    }

    /// Looks whether planned samples fit; if not, no more than the first of every element are stored from now on.
    /// Whether even these do not fit.
    pub(super) fn make_room(&mut self, draws: &[Draw]) -> bool {
        let Some(cap) = self.cap else { return false };
        let now = self.bytes();
        let more: u64 = draws.iter().map(|d| (d.rays() * size_of::<Ray>()) as u64).sum();
        if now + more <= cap {
            return false;
        }
        if !self.streaming {
            self.streaming = true;
            self.gathers.iter_mut().for_each(Gather::forget_others);
        }
        let early: u64 = draws.iter().map(|d| (d.early().rays() * size_of::<Ray>()) as u64).sum();
        self.bytes() + early > cap
    }

    /// Ends where it is: the cap leaves no room for more.
    pub(super) fn stop_for_memory(&mut self) {
        self.stalled = true;
        self.phase = Phase::Finished;
    }
}

impl Gather {
    /// Counted bytes.
    fn bytes(&self) -> usize {
        let samples: usize = self.parts().map(Rays::bytes).iter().sum();
        size_of::<Gather>() + samples + self.points() as usize * (size_of::<Point>() + 1 + 4 * size_of::<f64>())
    }
}
