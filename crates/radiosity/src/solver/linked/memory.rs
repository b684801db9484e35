//! Memory that obeys, with links: what links and elements take is counted.
//!
//! Rows of a full matrix that do not fit are open: coupled anew, by the same numbers, whenever a sweep or the estimate
//! reads them, so that the light is the same to the last bit and only time grows. Links that adapt are not coupled
//! beyond the cap: the solution stays valid and says that it is unfinished.

use super::guess::Elements;
use super::uniform::Uniform;
use super::{Linked, Phase};
use crate::settings::Decomposition;
use crate::solver::SolveError;
use ondelette_compress::assembly::couple_row;
use ondelette_compress::forest::Node;
use ondelette_compress::{Assembly, CoupleSettings, Link, NodeId, transport};
use ondelette_numerics::par;

/// Krylov vectors kept before a restart where memory is capped.
pub(super) const CAPPED_RESTART: usize = 16;
/// Arrays of coefficients that a sweep or the estimate works in, beside Krylov vectors.
const WORKING_ARRAYS: usize = 8;
/// Bytes a node that the estimate works in.
const ESTIMATE: usize = 400;

/// The rows of a full matrix that are not stored.
pub(super) struct OpenRows {
    leaves: Vec<NodeId>,
    /// The first such row, as an index of leaves.
    first: usize,
    elements: Elements,
}

impl Linked {
    /// Caps the counted bytes of a solver that has not begun.
    ///
    /// # Errors
    /// Not even the first links fit.
    pub(crate) fn limit_memory(&mut self, cap: u64) -> Result<(), SolveError> {
        self.cap = Some(cap);
        match &self.phase {
            Phase::Weaving(_) => self.start_weaving(self.settings.links.subdivision.map(u32::from)),
            Phase::Linking(batch) => {
                let least = self.bytes() + batch.len() as u64 * self.bytes_of_link();
                if least > cap { Err(SolveError::Memory { cap, least }) } else { Ok(()) }
            }
            _ => Ok(()),
        }
    }

    /// Counted bytes of elements, links and working arrays.
    pub(crate) fn bytes(&self) -> u64 {
        self.links.bytes() + self.bytes_of_elements(self.forest.len() as u64)
    }

    /// Bytes of scene and rays.
    pub(crate) fn scene_bytes(&self) -> u64 {
        self.scene.bytes() + self.kernel.bytes()
    }

    /// Bytes that so many nodes take, with what is worked in.
    pub(super) fn bytes_of_elements(&self, nodes: u64) -> u64 {
        let coefficients = self.forest.stride() * size_of::<[f64; 3]>();
        let node = 2 * size_of::<Node>() + ESTIMATE + (WORKING_ARRAYS + CAPPED_RESTART) * coefficients;
        nodes * node as u64
    }

    /// Bytes that a link takes at most, with the copy that a refinement makes.
    fn bytes_of_link(&self) -> u64 {
        let functions = self.forest.stride();
        2 * Assembly::bytes_of_pair(functions, functions)
    }

    /// How many links may be changed, each into four links and as many elements.
    pub(super) fn room_for_changes(&self) -> usize {
        let Some(cap) = self.cap else { return usize::MAX };
        // those that there are get copied too
        let room = cap.saturating_sub(self.bytes() + self.links.bytes());
        (room / (4 * (self.bytes_of_link() + self.bytes_of_elements(1)))) as usize
    }

    /// Whether rows of a full matrix may stay open: only sweeps over all of it can do with that.
    pub(super) fn may_open_rows(&self) -> bool {
        let links = self.settings.links;
        self.cap.is_some() && !links.iteration.is_local() && links.decomposition == Decomposition::Nonstandard
    }

    /// Opens the rows from one on.
    pub(super) fn open_rows(&mut self, leaves: Vec<NodeId>, first: usize, elements: Elements) {
        self.open = (first < leaves.len()).then_some(OpenRows { leaves, first, elements });
    }

    /// Hands the links of an open row to `each`; nothing if there is no such row.
    fn couple_open(&self, open: &OpenRows, uniform: &Uniform, row: NodeId, each: impl FnMut(&Link, &[f64])) {
        let settings = |r: NodeId, s: NodeId| -> Option<CoupleSettings> {
            uniform.sees(open.elements.root(r), open.elements.root(s)).then(|| open.elements.settings(r, s))
        };
        couple_row(&self.kernel, &self.forest, row, &open.leaves, settings, each);
    }

    /// What the links of a node are, stored or not.
    pub(super) fn row(&self, id: NodeId, each: &mut dyn FnMut(&Link)) {
        match (&self.open, &self.uniform) {
            (Some(open), Some(uniform)) if open.leaves[open.first..].binary_search(&id).is_ok() => {
                self.couple_open(open, uniform, id, |link, _| each(link));
            }
            _ => self.links.of(id).iter().for_each(each),
        }
    }

    /// Adds what open rows receive from pulled `values`.
    pub(super) fn receive_openly(&self, values: &[[f64; 3]], result: &mut [[f64; 3]]) {
        let (Some(open), Some(uniform)) = (&self.open, &self.uniform) else { return };
        let (rows, stride) = (&open.leaves[open.first..], self.forest.stride());
        let received = par::map(rows.len(), |k| {
            let mut slots = vec![[0.0; 3]; stride];
            self.couple_open(open, uniform, rows[k], |link, block| {
                transport::apply_block(&self.forest, link, block, values, &mut slots);
            });
            slots
        });
        for (row, slots) in rows.iter().zip(received) {
            result[row.index() * stride..(row.index() + 1) * stride].copy_from_slice(&slots);
        }
    }
}
