//! The full matrix: every leaf coupled with every leaf, nothing compressed (thesis 3.3, Eq. 86).
//!
//! What classical and Galerkin methods solve, and what compressed links are held against. Rows are coupled in order
//! and straight into the links, so that next to the matrix itself only one batch is in memory.

use crate::couple::{CoupleSettings, couple};
use crate::forest::{Forest, NodeId};
use crate::kernel::Kernel;
use crate::links::{Link, Links};
use ondelette_numerics::par;

/// A full matrix in the making: all pairs of leaves in row order, a batch at a time.
///
/// ```
/// use ondelette_compress::{Assembly, CoupleSettings, Forest, kernel::PointKernel};
/// use ondelette_wavelet::cell::{CellFamily, CellShape};
/// let kernel = PointKernel { function: |_, _, _, _| 1.0, measures: vec![2.0], points: 2 };
/// let mut forest = Forest::new(CellFamily::Multiwavelet, 1).unwrap();
/// let root = forest.add_root(CellShape::Square, 2.0);
/// forest.split(root);
/// let mut matrix = Assembly::of(&forest, 16, 16);
/// while !matrix.step(&kernel, &forest, |_, _| Some(CoupleSettings::EXACT), 100).0 {}
/// assert_eq!(matrix.into_links(&forest).len(), 16);
/// ```
#[derive(Clone, Debug)]
pub struct Assembly {
    leaves: Vec<NodeId>,
    /// Leaves, the first of all, whose rows are stored.
    rows: usize,
    done: usize,
    links: Links,
}

impl Assembly {
    /// All pairs of the forest's present leaves, with memory set aside for `pairs` links of `numbers` numbers in all:
    /// a matrix that outgrows its memory is copied, and takes three times as much for a moment.
    pub fn of(forest: &Forest, pairs: u64, numbers: u64) -> Self {
        Self::of_rows(forest, usize::MAX, pairs, numbers)
    }

    /// The rows of the first leaves alone; those of the others are for [`couple_row`].
    pub fn of_rows(forest: &Forest, rows: usize, pairs: u64, numbers: u64) -> Self {
        let leaves = leaves(forest);
        let rows = rows.min(leaves.len());
        Assembly { leaves, rows, done: 0, links: Links::with_room(pairs as usize, numbers as usize) }
    }

    /// Bytes that a pair of leaves takes whose bases have `receiver` and `shooter` functions.
    pub fn bytes_of_pair(receiver: usize, shooter: usize) -> u64 {
        (size_of::<Link>() + 8 * receiver * shooter) as u64
    }

    /// Number of pairs.
    pub fn len(&self) -> usize {
        self.rows * self.leaves.len()
    }

    /// Whether there is nothing to couple.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of pairs done.
    pub fn done(&self) -> usize {
        self.done
    }

    /// Couples the next pairs, in parallel, up to about `most` units of work (a unit is a few ten microseconds); true
    /// when all are done. Returns also the kernel samples taken. `settings` says how a receiver is coupled with a
    /// shooter, `None` for pairs that are certainly zero. How the work is cut changes no result.
    pub fn step<K: Kernel>(
        &mut self,
        kernel: &K,
        forest: &Forest,
        settings: impl Fn(NodeId, NodeId) -> Option<CoupleSettings> + Sync,
        most: usize,
    ) -> (bool, u64) {
        let (mut count, mut work) = (0, 0);
        while work < PAIRS_A_UNIT * most && self.done + count < self.len() {
            let (r, s) = self.pair(self.done + count);
            work += settings(r, s).map_or(1, |settings| PAIRS_A_UNIT * settings.work(forest.basis_of(r).order()));
            count += 1;
        }
        let made = par::map(count, |i| {
            let (r, s) = self.pair(self.done + i);
            let settings = settings(r, s)?;
            let (receiver, shooter) = (&forest.node(r).cell, &forest.node(s).cell);
            let coupling = couple(kernel, receiver, forest.basis_of(r), shooter, forest.basis_of(s), settings)?;
            Some((r, s, coupling))
        });
        let mut samples = 0;
        for (r, s, coupling) in made.into_iter().flatten() {
            samples += u64::from(coupling.kernel_samples);
            self.links.push(r, s, &coupling);
        }
        self.done += count;
        (self.done == self.len(), samples)
    }

    fn pair(&self, k: usize) -> (NodeId, NodeId) {
        let n = self.leaves.len();
        (self.leaves[k / n], self.leaves[k % n])
    }

    /// The matrix as links between leaves.
    ///
    /// # Panics
    /// If pairs are left to do.
    pub fn into_links(mut self, forest: &Forest) -> Links {
        assert_eq!(self.done, self.len(), "all pairs are coupled before the matrix is used");
        self.links.finish(forest);
        self.links
    }
}

/// The leaves of a forest, in node order: the rows and columns of its full matrix.
pub fn leaves(forest: &Forest) -> Vec<NodeId> {
    (0..forest.len() as u32).map(NodeId).filter(|&id| forest.is_leaf(id)).collect()
}

/// Couples one row of the full matrix and hands every link with its block to `each`, in the order of the shooters;
/// nothing is stored. Returns the kernel samples taken.
pub fn couple_row<K: Kernel>(
    kernel: &K,
    forest: &Forest,
    receiver: NodeId,
    shooters: &[NodeId],
    settings: impl Fn(NodeId, NodeId) -> Option<CoupleSettings>,
    mut each: impl FnMut(&Link, &[f64]),
) -> u64 {
    let (cell, basis) = (&forest.node(receiver).cell, forest.basis_of(receiver));
    let mut samples = 0;
    for &shooter in shooters {
        let Some(settings) = settings(receiver, shooter) else { continue };
        let from = (&forest.node(shooter).cell, forest.basis_of(shooter));
        let Some(coupling) = couple(kernel, cell, basis, from.0, from.1, settings) else { continue };
        samples += u64::from(coupling.kernel_samples);
        each(&Link::of(receiver, shooter, 0, &coupling), &coupling.block);
    }
    samples
}

/// Pairs that are certainly zero cost next to nothing.
const PAIRS_A_UNIT: usize = 200;
