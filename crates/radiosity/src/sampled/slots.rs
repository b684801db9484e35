//! Where the gathered light of each element stands in one long vector: only functions in use have a place.

use super::gather::Gather;
use ondelette_compress::Forest;
use std::ops::Range;

/// Places of the coefficients of every gathering element, in order.
#[derive(Clone, Debug, Default)]
pub(super) struct Slots(Vec<u32>);

impl Slots {
    /// Of these elements with the functions that they use now.
    pub(super) fn of(forest: &Forest, gathers: &[Gather]) -> Self {
        let mut end = 0;
        let mut ends = Vec::with_capacity(gathers.len() + 1);
        ends.push(0);
        for gather in gathers {
            end += gather.functions(forest).len() as u32;
            ends.push(end);
        }
        Slots(ends)
    }

    /// Coefficients of all.
    pub(super) fn len(&self) -> usize {
        self.0.last().map_or(0, |&end| end as usize)
    }

    /// Those of an element.
    pub(super) fn range(&self, k: usize) -> Range<usize> {
        self.0[k] as usize..self.0[k + 1] as usize
    }

    /// Cuts a vector into those of `count` elements at a time: the first of them, and their coefficients.
    pub(super) fn chunks<'a, T>(&self, count: usize, mut vector: &'a mut [T]) -> Vec<(usize, &'a mut [T])> {
        let elements = self.0.len().saturating_sub(1);
        let mut chunks = Vec::with_capacity(elements.div_ceil(count));
        for first in (0..elements).step_by(count) {
            let end = (first + count).min(elements);
            let (own, rest) = vector.split_at_mut((self.0[end] - self.0[first]) as usize);
            chunks.push((first, own));
            vector = rest;
        }
        chunks
    }
}
