//! What becomes of rows that follow from others: what is said of them, and who is asked about them later.

use crate::system::{Problem, Redundant};
use std::collections::BTreeSet;

/// Constraints with rows that were left out.
pub(super) struct Dropped {
    /// Because they follow from others.
    pub(super) followers: Vec<usize>,
    /// Though they are missed, which the notes say.
    pub(super) missed: Vec<usize>,
    /// Those that take part, the left out and those they follow from.
    pub(super) tied: BTreeSet<usize>,
}

impl Dropped {
    pub(super) fn new(redundant: &[Redundant]) -> Dropped {
        let sorted = |missed: bool| -> Vec<usize> {
            let of = redundant.iter().filter(|r| r.miss.is_some() == missed).map(|r| r.constraint);
            of.collect::<BTreeSet<usize>>().into_iter().collect()
        };
        let tied = redundant.iter().flat_map(|r| r.others.iter().copied().chain([r.constraint])).collect();
        Dropped { followers: sorted(false), missed: sorted(true), tied }
    }
}

/// What is said of redundant rows.
pub(crate) fn notes(problem: &Problem, redundant: &[Redundant]) -> Vec<String> {
    let name = |c: &usize| problem.constraints()[*c].id.clone();
    let of = |r: &Redundant| {
        let others: Vec<String> = r.others.iter().take(8).map(name).collect();
        let (own, others) = (name(&r.constraint), others.join(", "));
        match r.miss {
            None => format!("constraint {own} follows from {others}: redundant"),
            Some(miss) => format!("constraint {own} cannot be told from {others}: left out, missed by {miss:.1e}"),
        }
    };
    redundant.iter().map(of).collect()
}
