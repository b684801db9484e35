//! Memory that obeys: what elements and samples take is counted, and samples that do not fit are drawn again whenever
//! they are read.
//!
//! The first samples of every element, which iterations read over and over, always stay. The others are read once a
//! sweep; a sweep of all samples costs their rays then, and finds the same. Fits of direct light begin anew under a
//! cap, with other rays: another answer that keeps the same promise.

use super::Sampled;
use super::direct::Known;
use super::field::Form;
use super::gather::{self, Draw, Gather};
use super::points::Point;
use super::rays::Ray;
use super::verdict::Verdict;
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
/// What a gathering element takes beside its arrays.
const BESIDE_A_GATHER: usize = size_of::<Gather>() + size_of::<Verdict>() + size_of::<u32>();
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
        let gather = |g: &Gather| {
            let (bytes, arrays) = g.bytes();
            BESIDE_A_GATHER + bytes + arrays * BESIDE_AN_ARRAY
        };
        let gathers: usize = self.gathers.iter().map(gather).sum();
        let known: usize = self.known.iter().flatten().map(Known::bytes).sum();
        let known = known + size_of_val(&self.known[..]);
        let nodes = self.forest.len() as u64 * self.bytes_a_node();
        nodes + (known + gathers) as u64 + WORKING_VECTORS * self.bytes_a_vector()
    }

    /// Bytes of a node's light.
    pub(super) fn bytes_a_node(&self) -> u64 {
        let (groups, stride) = (self.lamps.groups.len(), self.forest.stride());
        let bytes = size_of::<Node>()
            + groups * (stride + 2) * size_of::<f32>()
            + size_of::<[f32; 2]>()
            + size_of::<bool>()
            + LEAF_ARRAYS * stride * size_of::<[f64; 3]>()
            + size_of::<Form>();
        bytes as u64
    }

    /// Bytes that so many new points take beside those of a gathering element, with their first samples, and of the
    /// functions that may come with them.
    pub(super) fn bytes_of_points(&self, k: usize, points: u64) -> u64 {
        let gather = &self.gathers[k];
        let basis = self.forest.basis_of(gather.node);
        let samples = 2 * u64::from(Gather::FIRST) * size_of::<Ray>() as u64;
        let all = points + u64::from(gather.points());
        let functions = basis.truncated(gather::order_of(basis, all as usize)).len() as u64;
        let fit = if functions > 1 { all * functions * size_of::<f64>() as u64 } else { 0 };
        let more = functions.saturating_sub(gather.functions(&self.forest).len() as u64);
        let vectors = WORKING_VECTORS * more * size_of::<[f64; 3]>() as u64;
        points * (size_of::<Point>() as u64 + samples) + fit + vectors + BESIDE_AN_ARRAY as u64
    }

    /// Bytes that a split of a gathering element into so many children takes, likewise; each has four new points.
    pub(super) fn bytes_of_children(&self, k: usize, children: usize) -> u64 {
        let own = self.gathers[k].functions(&self.forest).len() as u64;
        let own = WORKING_VECTORS * own * size_of::<[f64; 3]>() as u64 + 3 * BESIDE_AN_ARRAY as u64;
        let one = self.bytes_a_node() + BESIDE_A_GATHER as u64 + self.bytes_of_points(k, 4) + own;
        children as u64 * one
    }

    /// How many of these costs a share of the room that is left pays for. Samples other than the first give way first;
    /// if that is not enough, memory is full.
    pub(super) fn affordable(&mut self, costs: Vec<u64>, share: f64) -> usize {
        let Some(cap) = self.cap else { return costs.len() };
        let total: u64 = costs.iter().sum();
        if self.bytes() + total > cap {
            self.stream();
        }
        let room = (share * cap.saturating_sub(self.bytes()) as f64) as u64;
        if total <= room {
            return costs.len();
        }
        self.full = true;
        let mut sum = 0;
        let fits = |cost: &&u64| {
            sum += **cost;
            sum <= room
        };
        costs.iter().take_while(fits).count()
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

    /// Bytes of the first samples of all points, drawn or not, and of the functions that come with them.
    fn first_bytes(&self) -> u64 {
        let samples = 2 * u64::from(Gather::FIRST) * size_of::<Ray>() as u64;
        (0..self.gathers.len())
            .map(|k| self.bytes_of_points(k, 0) + u64::from(self.gathers[k].points()) * samples)
            .sum()
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
        self.stream();
        let early: u64 = draws.iter().map(|d| (d.early().rays() * size_of::<Ray>()) as u64).sum();
        self.bytes() + early > cap
    }

    /// From now on no more than the first samples are stored.
    fn stream(&mut self) {
        if !self.streaming {
            self.streaming = true;
            self.gathers.iter_mut().for_each(Gather::forget_others);
        }
    }
}
