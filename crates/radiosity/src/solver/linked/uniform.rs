//! Full matrices: elements of one size, all pairs coupled, the size halved until the promise is kept.

use super::guess::{Elements, Guess};
use super::{Event, Linked, Phase, WORK_A_STEP};
use crate::settings::{Decomposition, LinkSettings};
use crate::solver::SolveError;
use ondelette_compress::{Assembly, Magnitudes, Standard, transport};
use ondelette_wavelet::cell::CellShape;
use serde::{Deserialize, Serialize};

/// Bytes that a full matrix may take.
pub(super) const MOST_BYTES: u64 = 2_000_000_000;

/// A full matrix that is too large to be stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[error(
    "the full matrix of {elements} elements takes {:.1} GB, and {:.1} GB are allowed: the methods hierarchical, \
     wavelet and sampled do not store it",
    *.bytes as f64 / 1e9,
    *.most as f64 / 1e9
)]
pub struct MatrixTooLarge {
    /// Elements, rows of the matrix.
    pub elements: u64,
    /// Bytes that it would take.
    pub bytes: u64,
    /// Bytes that it may take.
    pub most: u64,
}

/// How fine the elements of a full matrix are.
pub(super) struct Uniform {
    /// The longest edge of the scene is in 2^level parts.
    level: u32,
    /// Whether that was asked for.
    given: bool,
    /// Which sides see which, row-major `[receiver][shooter]`.
    may_see: Vec<bool>,
    /// The longest edge of each side.
    edges: Vec<f64>,
}

/// A full matrix in the making.
pub(super) struct Weaving {
    assembly: Assembly,
    elements: Elements,
}

impl Uniform {
    /// Splits of each side.
    fn depths(&self, level: u32) -> Vec<u32> {
        let longest = self.edges.iter().copied().fold(0.0, f64::max);
        // parts as long as those of the longest edge count as no longer
        let splits = |edge: &f64| (f64::from(level) + (edge / longest).log2() - 1e-9).ceil().max(0.0) as u32;
        self.edges.iter().map(splits).collect()
    }
}

impl Linked {
    /// Prepares the first full matrix: as fine as asked, else one element a side.
    ///
    /// # Errors
    /// It is too large.
    pub(super) fn start_weaving(&mut self, level: Option<u32>) -> Result<(), SolveError> {
        let sides = self.kernel.sides();
        let n = sides.len();
        let edge = |s: &crate::kernel::SideFrame| {
            let [u, v] = s.edges;
            let third = if s.shape == CellShape::Triangle { (u - v).length() } else { 0.0 };
            u.length().max(v.length()).max(third)
        };
        let uniform = Uniform {
            level: level.unwrap_or(0),
            given: level.is_some(),
            may_see: (0..n * n).map(|k| self.kernel.may_see(k / n, k % n)).collect(),
            edges: sides.iter().map(edge).collect(),
        };
        self.strict = uniform.given;
        let first = uniform.level;
        self.uniform = Some(uniform);
        self.weave_at(first)?;
        Ok(())
    }

    /// Pairs of elements of a level, and the numbers in their blocks.
    fn count_pairs(&self, uniform: &Uniform, depths: &[u32]) -> Result<(u64, u64), MatrixTooLarge> {
        let n = depths.len();
        let functions: Vec<u64> = self.kernel.sides().iter().map(|s| self.forest.basis(s.shape).len() as u64).collect();
        let elements = |side: usize| 4f64.powi(depths[side] as i32);
        let (mut pairs, mut numbers) = (0.0, 0.0);
        for k in (0..n * n).filter(|&k| uniform.may_see[k]) {
            let count = elements(k / n) * elements(k % n);
            pairs += count;
            numbers += count * (functions[k / n] * functions[k % n]) as f64;
        }
        let mut bytes = pairs * Assembly::bytes_of_pair(0, 0) as f64 + 8.0 * numbers;
        if self.settings.links.decomposition == Decomposition::Standard {
            let rows: f64 = (0..n).map(|side| elements(side) * functions[side] as f64).sum();
            bytes += Standard::bytes_of_term() as f64 * rows * rows;
        }
        if bytes > MOST_BYTES as f64 {
            let elements = (0..n).map(elements).sum::<f64>() as u64;
            return Err(MatrixTooLarge { elements, bytes: bytes as u64, most: MOST_BYTES });
        }
        Ok((pairs as u64, numbers as u64))
    }

    /// Divides the sides to a level and begins to couple all pairs.
    fn weave_at(&mut self, level: u32) -> Result<(), MatrixTooLarge> {
        let Some(mut uniform) = self.uniform.take() else { return Ok(()) };
        uniform.level = level;
        let depths = uniform.depths(level);
        let counted = self.count_pairs(&uniform, &depths);
        self.uniform = Some(uniform);
        let (pairs, numbers) = counted?;
        self.links = ondelette_compress::Links::new();
        let mut split = Vec::new();
        let mut n = 0;
        while let Some(node) = self.forest.nodes().get(n).copied() {
            let id = ondelette_compress::NodeId(n as u32);
            if node.first_child == 0 && node.cell.depth < depths[node.cell.root as usize] {
                self.forest.split(id);
                split.push(id);
            }
            n += 1;
        }
        self.inherit(split);
        let elements = Elements::of(&self.kernel, &self.forest, self.relative_radiosity(), self.settings.error);
        let assembly = Assembly::of(&self.forest, pairs, numbers);
        self.phase = Phase::Weaving(Weaving { assembly, elements });
        Ok(())
    }

    /// Mean radiosity of each node over the mean irradiance, channels summed; before the first solve, a guess.
    fn relative_radiosity(&self) -> Vec<f64> {
        let mut irradiance = self.mean_irradiance().sum();
        let mut values = self.radiosity(&self.irradiance, true);
        if irradiance <= 0.0 {
            irradiance = Guess::of(&self.scene, &self.kernel, self.settings.error).irradiance();
            let stride = self.forest.stride();
            let even = vec![[irradiance / 3.0; 3]; stride];
            for (n, slots) in values.chunks_mut(stride).enumerate() {
                self.reflect(n, &even, true, slots);
            }
        }
        transport::pull(&self.forest, &mut values);
        let magnitudes = Magnitudes::of(&self.forest, &values, false);
        magnitudes.mean.iter().map(|m| m.iter().sum::<f64>().abs() / irradiance).collect()
    }

    /// Couples some pairs of a full matrix.
    pub(super) fn weave(&mut self, mut weaving: Weaving) -> Event {
        let Some(uniform) = &self.uniform else { return self.judge() };
        let (elements, sides) = (&weaving.elements, self.kernel.sides().len());
        let settings = |r, s| {
            let seen = uniform.may_see[elements.root(r) * sides + elements.root(s)];
            seen.then(|| elements.settings(r, s))
        };
        let (finished, samples) = weaving.assembly.step(&self.kernel, &self.forest, settings, WORK_A_STEP);
        self.statistics.kernel_samples += samples;
        self.statistics.rays = self.kernel.rays_cast();
        let event = Event::Linking { done: weaving.assembly.done(), total: weaving.assembly.len() };
        if finished {
            self.links = weaving.assembly.into_links(&self.forest);
            self.start_solving();
        } else {
            self.phase = Phase::Weaving(weaving);
        }
        event
    }

    /// Halves the elements of a full matrix, or says why not.
    pub(super) fn halve_elements(&mut self) {
        let Some(uniform) = &self.uniform else { return };
        let next = uniform.level + 1;
        let wanted = !uniform.given && next <= u32::from(LinkSettings::FINEST);
        self.stalled = true;
        self.phase = Phase::Finished;
        if wanted {
            match self.weave_at(next) {
                Ok(()) => self.stalled = false,
                Err(too_large) => self.statistics.too_large = Some(too_large),
            }
        }
    }
}
