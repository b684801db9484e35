//! One root at a time: the passes of [`crate::transport`] for solvers that relax root by root or leaf by leaf.
//!
//! No node couples with its own root in the operators that these solvers are for, so that relaxing a whole root at once
//! is the same as relaxing its leaves one after the other.

use crate::forest::{Forest, NodeId};
use crate::links::Links;
use crate::transport;
use ondelette_numerics::par;
use std::collections::BTreeSet;

/// The nodes of each root, and the links of each shooter.
#[derive(Clone, Debug)]
pub struct Trees {
    /// Parents before children.
    of_root: Vec<Vec<NodeId>>,
    /// Link indices sorted by shooter, and where each shooter's begin.
    columns: Vec<u32>,
    starts: Vec<u32>,
}

impl Trees {
    /// Sorts nodes by root and links by shooter. Cost linear in both.
    pub fn of(forest: &Forest, links: &Links) -> Self {
        let mut of_root = vec![Vec::new(); forest.roots().len()];
        for (n, node) in forest.nodes().iter().enumerate() {
            of_root[node.cell.root as usize].push(NodeId(n as u32));
        }
        let mut starts = vec![0u32; forest.len() + 1];
        for link in links.as_slice() {
            starts[link.shooter.index() + 1] += 1;
        }
        for n in 0..forest.len() {
            starts[n + 1] += starts[n];
        }
        let mut next = starts.clone();
        let mut columns = vec![0; links.len()];
        for (k, link) in links.as_slice().iter().enumerate() {
            let at = &mut next[link.shooter.index()];
            columns[*at as usize] = k as u32;
            *at += 1;
        }
        Trees { of_root, columns, starts }
    }

    /// The nodes of a root, parents before children.
    pub fn nodes(&self, root: usize) -> &[NodeId] {
        &self.of_root[root]
    }

    /// As [`transport::pull`], for one root.
    pub fn pull<const C: usize>(&self, forest: &Forest, root: usize, values: &mut [[f64; C]]) {
        for &id in self.of_root[root].iter().rev() {
            transport::pull_node(forest, id, values);
        }
    }

    /// What one root receives from pulled `values`: gathered at its nodes, pushed to its leaves, zeros at inner nodes.
    /// Slots of other roots are left alone.
    pub fn receive<const C: usize>(
        &self,
        forest: &Forest,
        links: &Links,
        root: usize,
        values: &[[f64; C]],
        result: &mut [[f64; C]],
    ) {
        let (nodes, stride) = (&self.of_root[root], forest.stride());
        let gathered = par::map(nodes.len(), |k| {
            let mut slots = vec![[0.0; C]; stride];
            for link in links.of(nodes[k]) {
                transport::apply_link(forest, links, link, values, &mut slots);
            }
            slots
        });
        for (id, slots) in nodes.iter().zip(&gathered) {
            result[id.index() * stride..(id.index() + 1) * stride].copy_from_slice(slots);
        }
        for &id in nodes {
            transport::push_node(forest, id, result);
            if !forest.is_leaf(id) {
                result[id.index() * stride..(id.index() + 1) * stride].fill([0.0; C]);
            }
        }
    }

    /// Sends pulled `values` of the given nodes along their links: adds what arrives to the leaves below the receivers.
    /// `result` must be zero at inner nodes, and is so again afterwards. Returns the leaves reached, in order.
    pub fn shoot<const C: usize>(
        &self,
        forest: &Forest,
        links: &Links,
        from: &[NodeId],
        values: &[[f64; C]],
        result: &mut [[f64; C]],
    ) -> Vec<NodeId> {
        let stride = forest.stride();
        let mut touched = BTreeSet::new();
        for id in from {
            let range = self.starts[id.index()] as usize..self.starts[id.index() + 1] as usize;
            for &k in &self.columns[range] {
                let link = &links.as_slice()[k as usize];
                let at = link.receiver.index() * stride;
                transport::apply_link(forest, links, link, values, &mut result[at..at + stride]);
                touched.insert(link.receiver);
            }
        }
        let mut leaves = Vec::new();
        // children come after their parents, so the first is complete
        while let Some(id) = touched.pop_first() {
            if forest.is_leaf(id) {
                leaves.push(id);
                continue;
            }
            transport::push_node(forest, id, result);
            result[id.index() * stride..(id.index() + 1) * stride].fill([0.0; C]);
            touched.extend((0..forest.node(id).cell.shape.arity()).map(|c| forest.child(id, c)));
        }
        leaves
    }
}
