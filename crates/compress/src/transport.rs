//! Pull, gather, push (thesis 4.4.2): applying the compressed operator in time linear in nodes and links.
//!
//! Values are `[f64; C]` (C channels that share the operator), in the layout of [`Forest`]: `stride` slots a node.

use crate::forest::{Forest, NodeId};
use crate::links::{Link, Links};
use ondelette_numerics::par;
use ondelette_wavelet::cell::CellBasis;

fn add<const C: usize>(to: &mut [f64; C], k: f64, from: [f64; C]) {
    for c in 0..C {
        to[c] += k * from[c];
    }
}

/// Fills the inner nodes from the leaves: every node gets the projection of the function below it.
///
/// # Panics
/// If `values` has not `forest.len() * forest.stride()` entries.
pub fn pull<const C: usize>(forest: &Forest, values: &mut [[f64; C]]) {
    let stride = forest.stride();
    assert_eq!(values.len(), forest.len() * stride);
    for n in (0..forest.len()).rev() {
        pull_node(forest, NodeId(n as u32), values);
    }
}

/// Fills one inner node from its children; leaves are left as they are.
pub fn pull_node<const C: usize>(forest: &Forest, id: NodeId, values: &mut [[f64; C]]) {
    if let Some((basis, parent, children)) = family(forest, id, values) {
        parent.fill([0.0; C]);
        children.enumerate().for_each(|(c, child)| basis.pull(c, child, parent, add));
    }
}

/// Adds the functions of all inner nodes to the leaves below them; inner nodes are left as they are.
pub fn push<const C: usize>(forest: &Forest, values: &mut [[f64; C]]) {
    let stride = forest.stride();
    assert_eq!(values.len(), forest.len() * stride);
    for n in 0..forest.len() {
        push_node(forest, NodeId(n as u32), values);
    }
}

/// Adds one inner node's function to its children.
pub fn push_node<const C: usize>(forest: &Forest, id: NodeId, values: &mut [[f64; C]]) {
    if let Some((basis, parent, children)) = family(forest, id, values) {
        children.enumerate().for_each(|(c, child)| basis.push(c, parent, child, add));
    }
}

/// The basis of an inner node, its coefficients and those of each child; `None` for a leaf.
fn family<'a, const C: usize>(
    forest: &'a Forest,
    id: NodeId,
    values: &'a mut [[f64; C]],
) -> Option<(&'a CellBasis, &'a mut [[f64; C]], impl Iterator<Item = &'a mut [[f64; C]]>)> {
    if forest.is_leaf(id) {
        return None;
    }
    let (own, stride, basis) = (id.index(), forest.stride(), forest.basis_of(id));
    // parents come before their children, and these lie side by side
    let (head, tail) = values.split_at_mut((own + 1) * stride);
    let first = (forest.child(id, 0).index() - own - 1) * stride;
    let children = tail[first..].chunks_mut(stride).take(basis.shape().arity());
    let len = basis.len();
    Some((basis, &mut head[own * stride..own * stride + len], children.map(move |child| &mut child[..len])))
}

/// `result` = all links applied to `values`: every node gets what its own links bring. Parallel over receivers.
pub fn gather<const C: usize>(forest: &Forest, links: &Links, values: &[[f64; C]], result: &mut [[f64; C]]) {
    let stride = forest.stride();
    assert_eq!(values.len(), forest.len() * stride);
    assert_eq!(result.len(), values.len());
    const NODES: usize = 64;
    par::for_each_chunk(result, NODES * stride, |chunk, slots| {
        for (k, node) in slots.chunks_mut(stride).enumerate() {
            node.fill([0.0; C]);
            let id = NodeId((chunk * NODES + k) as u32);
            for link in links.of(id) {
                apply_link(forest, links, link, values, node);
            }
        }
    });
}

/// Adds what one link brings to the slots of its receiver.
pub fn apply_link<const C: usize>(
    forest: &Forest,
    links: &Links,
    link: &Link,
    values: &[[f64; C]],
    node: &mut [[f64; C]],
) {
    apply_block(forest, link, &links.blocks()[link.block as usize..], values, node);
}

/// The same for a link whose block stands at the start of `block`, wherever that is.
pub fn apply_block<const C: usize>(
    forest: &Forest,
    link: &Link,
    block: &[f64],
    values: &[[f64; C]],
    node: &mut [[f64; C]],
) {
    let rows = forest.basis_of(link.receiver).truncated(usize::from(link.orders[0]));
    let columns = forest.basis_of(link.shooter).truncated(usize::from(link.orders[1]));
    let from = link.shooter.index() * forest.stride();
    let block = &block[..rows.len() * columns.len()];
    for (&i, row) in rows.iter().zip(block.chunks(columns.len())) {
        let mut sum = [0.0; C];
        for (&j, k) in columns.iter().zip(row) {
            add(&mut sum, *k, values[from + j as usize]);
        }
        add(&mut node[i as usize], 1.0, sum);
    }
}

/// The whole operator: pull, gather, push. Inner nodes of `values` are overwritten by their pulls; the answer is at the
/// leaves of `result`, with inner nodes set to zero.
pub fn apply<const C: usize>(forest: &Forest, links: &Links, values: &mut [[f64; C]], result: &mut [[f64; C]]) {
    pull(forest, values);
    gather(forest, links, values, result);
    push(forest, result);
    let stride = forest.stride();
    for (n, node) in forest.nodes().iter().enumerate() {
        if node.first_child != 0 {
            result[n * stride..(n + 1) * stride].fill([0.0; C]);
        }
    }
}
