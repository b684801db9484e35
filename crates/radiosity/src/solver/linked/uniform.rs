//! Full matrices: elements of one size, all pairs coupled, the size halved until the promise is kept.

use super::guess::{Elements, Guess};
use super::{Event, Linked, Phase, WORK_A_STEP};
use crate::settings::{Decomposition, LinkSettings};
use crate::solver::SolveError;
use ondelette_compress::assembly::leaves;
use ondelette_compress::{Assembly, Magnitudes, NodeId, Standard, transport};
use ondelette_wavelet::cell::CellShape;
use serde::{Deserialize, Serialize};

/// Bytes that a full matrix may take.
pub(super) const MOST_BYTES: u64 = 2_000_000_000;

/// A full matrix that is too large to be stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[error(
    "the full matrix of {elements} elements takes {}, and {} are allowed: with a cap of memory (--memory) and the \
     solvers gmres or jacobi, rows that do not fit are coupled anew in every sweep; the methods hierarchical, wavelet \
     and sampled store no full matrix",
    size(*.bytes),
    size(*.most)
)]
pub struct MatrixTooLarge {
    /// Elements, rows of the matrix.
    pub elements: u64,
    /// Bytes that it would take.
    pub bytes: u64,
    /// Bytes that it may take.
    pub most: u64,
}

/// Bytes for people.
fn size(bytes: u64) -> String {
    if bytes < 100_000_000 { format!("{:.1} MB", bytes as f64 / 1e6) } else { format!("{:.1} GB", bytes as f64 / 1e9) }
}

/// What a full matrix takes.
struct Count {
    elements: u64,
    pairs: u64,
    numbers: u64,
    bytes: u64,
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
    /// Whether a side may receive from another.
    pub(super) fn sees(&self, receiver: usize, shooter: usize) -> bool {
        self.may_see[receiver * self.edges.len() + shooter]
    }

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
        let uniform = self.uniform_at(level);
        self.strict = uniform.given;
        let first = uniform.level;
        self.uniform = Some(uniform);
        self.weave_at(first)?;
        Ok(())
    }

    fn uniform_at(&self, level: Option<u32>) -> Uniform {
        let sides = self.kernel.sides();
        let n = sides.len();
        let edge = |s: &crate::kernel::SideFrame| {
            let [u, v] = s.edges;
            let third = if s.shape == CellShape::Triangle { (u - v).length() } else { 0.0 };
            u.length().max(v.length()).max(third)
        };
        Uniform {
            level: level.unwrap_or(0),
            given: level.is_some(),
            may_see: (0..n * n).map(|k| self.kernel.may_see(k / n, k % n)).collect(),
            edges: sides.iter().map(edge).collect(),
        }
    }

    /// How fine the elements are that there are.
    pub(super) fn uniform_as_it_is(&self) -> Uniform {
        let mut uniform = self.uniform_at(self.settings.links.subdivision.map(u32::from));
        let longest = (1..uniform.edges.len()).fold(0, |a, b| if uniform.edges[b] > uniform.edges[a] { b } else { a });
        let (leaf, _) = self.forest.locate(longest, [0.25, 0.25]);
        uniform.level = self.forest.node(leaf).cell.depth;
        uniform
    }

    /// Pairs of elements of a level, and the numbers in their blocks.
    fn count_pairs(&self, uniform: &Uniform, depths: &[u32]) -> Count {
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
        let all = (0..n).map(elements).sum::<f64>();
        Count { elements: all as u64, pairs: pairs as u64, numbers: numbers as u64, bytes: bytes as u64 }
    }

    /// How many rows of the matrix of the present elements fit into so many bytes, and their pairs and numbers.
    fn rows_that_fit(&self, uniform: &Uniform, leaves: &[NodeId], room: u64) -> (usize, u64, u64) {
        let n = uniform.edges.len();
        let mut elements = vec![0u64; n];
        leaves.iter().for_each(|id| elements[self.forest.node(*id).cell.root as usize] += 1);
        let functions: Vec<u64> = self.kernel.sides().iter().map(|s| self.forest.basis(s.shape).len() as u64).collect();
        let row = |r: usize| {
            let seen = (0..n).filter(|&s| uniform.sees(r, s));
            seen.fold((0, 0), |(p, q), s| (p + elements[s], q + elements[s] * functions[r] * functions[s]))
        };
        let rows: Vec<(u64, u64)> = (0..n).map(row).collect();
        let (mut pairs, mut numbers) = (0, 0);
        let fit = leaves.iter().take_while(|id| {
            let (p, q) = rows[self.forest.node(**id).cell.root as usize];
            let fits = (pairs + p) * Assembly::bytes_of_pair(0, 0) + 8 * (numbers + q) <= room;
            if fits {
                (pairs, numbers) = (pairs + p, numbers + q);
            }
            fits
        });
        (fit.count(), pairs, numbers)
    }

    /// Divides the sides to a level and begins to couple all pairs.
    fn weave_at(&mut self, level: u32) -> Result<(), MatrixTooLarge> {
        let Some(mut uniform) = self.uniform.take() else { return Ok(()) };
        uniform.level = level;
        let depths = uniform.depths(level);
        let count = self.count_pairs(&uniform, &depths);
        self.uniform = Some(uniform);
        let most = self.cap.unwrap_or(MOST_BYTES);
        // the elements themselves are counted where a cap is to be obeyed
        let others = self.cap.map_or(0, |_| self.bytes_of_elements(count.elements.saturating_mul(4) / 3));
        let whole = others.saturating_add(count.bytes) <= most;
        if !whole && (!self.may_open_rows() || others > most) {
            let bytes = others.saturating_add(count.bytes);
            return Err(MatrixTooLarge { elements: count.elements, bytes, most });
        }
        (self.links, self.open) = (ondelette_compress::Links::new(), None);
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
        let assembly = match &self.uniform {
            Some(uniform) if !whole => {
                let leaves = leaves(&self.forest);
                let (rows, pairs, numbers) = self.rows_that_fit(uniform, &leaves, most - others);
                self.open_rows(leaves, rows, elements.clone());
                Assembly::of_rows(&self.forest, rows, pairs, numbers)
            }
            _ => Assembly::of(&self.forest, count.pairs, count.numbers),
        };
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
        let elements = &weaving.elements;
        let settings = |r, s| uniform.sees(elements.root(r), elements.root(s)).then(|| elements.settings(r, s));
        let (finished, samples) = weaving.assembly.step(&self.kernel, &self.forest, settings, WORK_A_STEP);
        self.statistics.kernel_samples += samples;
        self.statistics.rays = self.rays_before + self.kernel.rays_cast();
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
