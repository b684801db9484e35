//! Memory that obeys: what elements and samples take is counted, and samples that do not fit are drawn again whenever
//! they are read.
//!
//! The first samples of every element, which iterations read over and over, always stay. The others are read once a
//! sweep; a sweep of all samples costs their rays then, and finds the same. Fits of direct light begin anew under a
//! cap, with other rays: another answer that keeps the same promise.

use super::direct::Known;
use super::field::Form;
use super::gather::{Draw, Gather};
use super::rays::Ray;
use super::verdict::Verdict;
use super::{FIRST_DIRECTIONS, Phase, Sampled};
use crate::solver::SolveError;
use ondelette_compress::forest::Node;

/// Arrays of a number a leaf's function and channel: the light, and what is read in a sweep.
const LEAF_ARRAYS: usize = 2;
/// Krylov vectors that a solve has at least.
const LEAST_KRYLOV: usize = 4;
/// Vectors of the gathered light at a time: the solution, what is added up, and the least of a solve.
const WORKING_VECTORS: u64 = 8 + LEAST_KRYLOV as u64;
/// What the allocator adds to each of the arrays of a gathering element.
const BESIDE_AN_ARRAY: usize = 16;
/// Share of what is allowed that is counted on: between arrays that grow, some is lost.
const COUNTED: f64 = 0.95;

impl Sampled {
    /// Caps the counted bytes.
    pub(crate) fn limit_memory(&mut self, cap: u64) -> Result<(), SolveError> {
        // what fits found out has no place under a cap
        self.known = Vec::new();
        let least = ((self.bytes() + self.first_bytes()) as f64 / COUNTED) as u64;
        if least > cap {
            return Err(SolveError::Memory { cap, least });
        }
        self.cap = Some((COUNTED * cap as f64) as u64);
        Ok(())
    }

    /// Bytes of elements, points and samples, and of the arrays that a sweep works in.
    pub(crate) fn bytes(&self) -> u64 {
        let (groups, stride) = (self.lamps.groups.len(), self.forest.stride());
        let node = size_of::<Node>()
            + groups * (stride + 2) * size_of::<f32>()
            + size_of::<[f32; 2]>()
            + LEAF_ARRAYS * stride * size_of::<[f64; 3]>()
            + size_of::<Form>();
        let beside = size_of::<Gather>() + size_of::<Verdict>() + size_of::<u32>();
        let gather = |g: &Gather| {
            let (bytes, arrays) = g.bytes();
            beside + bytes + arrays * BESIDE_AN_ARRAY
        };
        let gathers: usize = self.gathers.iter().map(gather).sum();
        let known: usize = self.known.iter().flatten().map(Known::bytes).sum();
        let known = known + size_of_val(&self.known[..]);
        (self.forest.len() * node + known + gathers) as u64 + WORKING_VECTORS * self.bytes_a_vector()
    }

    /// Bytes of one number a function in use of the gathering elements, and channel.
    fn bytes_a_vector(&self) -> u64 {
        (self.slots.len() * size_of::<[f64; 3]>()) as u64
    }

    /// Krylov vectors that half of what room there is holds, at most `most`; a few are always counted.
    pub(super) fn krylov_vectors(&self, most: usize) -> usize {
        let Some(cap) = self.cap else { return most };
        let room = cap.saturating_sub(self.bytes()) / (2 * self.bytes_a_vector().max(1));
        most.min(LEAST_KRYLOV + room as usize)
    }

    /// Bytes of scene and rays.
    pub(crate) fn scene_bytes(&self) -> u64 {
        self.scene.bytes() + self.kernel.bytes()
    }

    /// Bytes of the first samples of all points, drawn or not.
    fn first_bytes(&self) -> u64 {
        let points: u64 = self.gathers.iter().map(|g| u64::from(g.points())).sum();
        points * 2 * u64::from(FIRST_DIRECTIONS) * size_of::<Ray>() as u64
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
