//! The radiosity of the last solve, by which masks are weighted.

use super::MOST_FUNCTIONS;
use ondelette_compress::{Cell, Forest, NodeId};
use ondelette_wavelet::cell::CellShape;

/// Radiosity as last solved (channels summed), by which masks are weighted.
pub(super) struct Present {
    pub(super) forest: Forest,
    /// Coefficients of all nodes, pulled.
    pub(super) values: Vec<[f64; 1]>,
}

impl Present {
    /// Radiosity at root coordinates.
    pub(super) fn at(&self, root: u32, x: [f64; 2]) -> f64 {
        let (leaf, local) = self.forest.locate(root as usize, x);
        self.value(leaf, local, self.forest.basis_of(leaf).order())
    }

    /// Value of what a node knows up to an order.
    pub(super) fn value(&self, id: NodeId, local: [f64; 2], order: usize) -> f64 {
        let basis = self.forest.basis_of(id);
        let mut values = [0.0; MOST_FUNCTIONS];
        basis.eval(local, &mut values);
        let own = &self.values[id.index() * self.forest.stride()..][..basis.len()];
        basis.truncated(order).iter().map(|&j| own[usize::from(j)][0] * values[usize::from(j)]).sum()
    }

    /// The node of a cell, if it has detail below it.
    pub(super) fn inner_node(&self, cell: &Cell) -> Option<NodeId> {
        let centre = cell.to_root(match cell.shape {
            CellShape::Triangle => [1.0 / 3.0; 2],
            _ => [0.5; 2],
        });
        let mut id = self.forest.roots()[cell.root as usize];
        let mut x = centre;
        while self.forest.node(id).cell.depth < cell.depth {
            if self.forest.is_leaf(id) {
                return None;
            }
            let (c, local) = cell.shape.descend(x);
            (id, x) = (self.forest.child(id, c), local);
        }
        (!self.forest.is_leaf(id)).then_some(id)
    }
}
