//! The trees of cells: an arena whose children are contiguous and whose parents come before their children.

use crate::cell::Cell;
use ondelette_wavelet::cell::{CellBasis, CellFamily, CellShape, OrderError};
use std::sync::Arc;

/// Index of a node of a [`Forest`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub u32);

impl NodeId {
    /// As an array index.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// One node: a cell, its children and its measure.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// The cell.
    pub cell: Cell,
    /// First child; the others follow. 0 marks a leaf (node 0 is a root and nobody's child).
    pub first_child: u32,
    /// Parent; the node itself for a root.
    pub parent: NodeId,
    /// Measure of the cell in the units of its root's measure (length, area).
    pub measure: f64,
}

/// One tree of cells over each root domain, and the basis on each shape.
///
/// Coefficients of all nodes live in one array with [`Forest::stride`] slots a node, so that node `n` owns
/// `n * stride .. (n + 1) * stride` (the slots after its basis's length stay zero).
///
/// ```
/// use ondelette_compress::Forest;
/// use ondelette_wavelet::cell::{CellFamily, CellShape};
/// let mut forest = Forest::new(CellFamily::Multiwavelet, 2).unwrap();
/// let root = forest.add_root(CellShape::Square, 6.0);
/// let first = forest.split(root);
/// assert_eq!(forest.len(), 5);
/// assert_eq!(forest.node(first).measure, 1.5);
/// assert_eq!(forest.stride(), 4);
/// ```
#[derive(Clone, Debug)]
pub struct Forest {
    nodes: Vec<Node>,
    roots: Vec<NodeId>,
    bases: [CellBasis; 3],
    /// The same of all lower orders that the family nests, lowest first.
    lower: Arc<Vec<[CellBasis; 3]>>,
    stride: usize,
}

impl Forest {
    /// An empty forest whose nodes carry the given basis.
    ///
    /// # Errors
    /// The family has no such order.
    pub fn new(family: CellFamily, order: usize) -> Result<Self, OrderError> {
        let bases = |order| -> Result<[CellBasis; 3], OrderError> {
            Ok([
                CellBasis::new(CellShape::Interval, family, order)?,
                CellBasis::new(CellShape::Square, family, order)?,
                CellBasis::new(CellShape::Triangle, family, order)?,
            ])
        };
        let nested = if family == CellFamily::Multiwavelet { order } else { 1 };
        let lower = (1..nested).map(bases).collect::<Result<_, _>>()?;
        Ok(Forest { nodes: Vec::new(), roots: Vec::new(), bases: bases(order)?, lower: Arc::new(lower), stride: order })
    }

    /// Adds a root domain of the given shape and measure; roots are numbered in order.
    pub fn add_root(&mut self, shape: CellShape, measure: f64) -> NodeId {
        let id = NodeId(self.nodes.len() as u32);
        let cell = Cell::root(self.roots.len() as u32, shape);
        self.nodes.push(Node { cell, first_child: 0, parent: id, measure });
        self.roots.push(id);
        self.stride = self.stride.max(self.basis(shape).len());
        id
    }

    /// Makes room for so many more nodes, and no more.
    pub fn reserve(&mut self, nodes: usize) {
        self.nodes.reserve_exact(nodes);
    }

    /// First child of a node, made (with its siblings) if it was a leaf.
    ///
    /// # Panics
    /// When the forest would exceed 2^32 nodes.
    pub fn split(&mut self, id: NodeId) -> NodeId {
        let node = self.nodes[id.index()];
        if node.first_child != 0 {
            return NodeId(node.first_child);
        }
        let arity = node.cell.shape.arity();
        let first = u32::try_from(self.nodes.len()).expect("fewer than 2^32 nodes");
        for c in 0..arity {
            self.nodes.push(Node {
                cell: node.cell.child(c),
                first_child: 0,
                parent: id,
                measure: node.measure / arity as f64,
            });
        }
        self.nodes[id.index()].first_child = first;
        NodeId(first)
    }

    /// A node.
    pub fn node(&self, id: NodeId) -> &Node {
        &self.nodes[id.index()]
    }

    /// All nodes, parents before children.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// The roots, in the order of [`Forest::add_root`].
    pub fn roots(&self) -> &[NodeId] {
        &self.roots
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether there is no root yet.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Whether a node has no children.
    pub fn is_leaf(&self, id: NodeId) -> bool {
        self.nodes[id.index()].first_child == 0
    }

    /// Child `c` of an inner node.
    pub fn child(&self, id: NodeId, c: usize) -> NodeId {
        debug_assert!(!self.is_leaf(id));
        NodeId(self.nodes[id.index()].first_child + c as u32)
    }

    /// Number of leaves.
    pub fn leaves(&self) -> usize {
        self.nodes.iter().filter(|n| n.first_child == 0).count()
    }

    /// Basis on cells of one shape.
    pub fn basis(&self, shape: CellShape) -> &CellBasis {
        &self.bases[place(shape)]
    }

    /// The part of the basis that makes up this order; all of it for flatlets, which are not nested, and for orders
    /// above its own.
    pub fn basis_of_order(&self, shape: CellShape, order: u8) -> &CellBasis {
        self.lower.get(usize::from(order.max(1)) - 1).map_or(self.basis(shape), |bases| &bases[place(shape)])
    }

    /// Basis of a node.
    pub fn basis_of(&self, id: NodeId) -> &CellBasis {
        self.basis(self.node(id).cell.shape)
    }

    /// Coefficient slots a node.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// The leaf over the root-local point `x`, and the point in its coordinates. Cost O(depth).
    pub fn locate(&self, root: usize, x: [f64; 2]) -> (NodeId, [f64; 2]) {
        self.locate_below(self.roots[root], x)
    }

    /// The same, from any node and a point in that node's coordinates.
    pub fn locate_below(&self, mut id: NodeId, mut x: [f64; 2]) -> (NodeId, [f64; 2]) {
        let shape = self.node(id).cell.shape;
        loop {
            let first = self.nodes[id.index()].first_child;
            if first == 0 {
                return (id, x);
            }
            let (c, local) = shape.descend(x);
            (id, x) = (NodeId(first + c as u32), local);
        }
    }
}

fn place(shape: CellShape) -> usize {
    match shape {
        CellShape::Interval => 0,
        CellShape::Square => 1,
        CellShape::Triangle => 2,
    }
}
