//! The links: all blocks of the compressed operator, sorted by receiver, then shooter.

use crate::couple::{CHILDREN, Coupling};
use crate::forest::{Forest, NodeId};

/// One link: the block between two nodes, and its error measures (see [`Coupling`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Node that receives.
    pub receiver: NodeId,
    /// Node that shoots.
    pub shooter: NodeId,
    /// Orders at receiver and shooter.
    pub orders: [u8; 2],
    /// Whether mask samples were taken.
    pub masked: bool,
    /// Where its block starts in [`Links::blocks`].
    pub block: u64,
    /// Result minus prediction in each child of the receiver.
    pub residual: [f32; CHILDREN],
    /// Mean result for a unit shooter.
    pub strength: f32,
    /// Factor of the shooter's detail.
    pub roughness: f32,
    /// Factor of the shooter's detail where the mask varies over the shooter.
    pub spread: f32,
    /// Standard error of unseen mask.
    pub unseen: f32,
}

impl Link {
    pub(crate) fn of(receiver: NodeId, shooter: NodeId, block: u64, c: &Coupling) -> Self {
        Link {
            receiver,
            shooter,
            orders: c.orders,
            masked: c.masked,
            block,
            residual: c.residual.map(|r| r as f32),
            strength: c.strength as f32,
            roughness: c.roughness as f32,
            spread: c.spread as f32,
            unseen: c.unseen as f32,
        }
    }
}

/// All links.
#[derive(Clone, Debug, Default)]
pub struct Links {
    links: Vec<Link>,
    blocks: Vec<f64>,
    starts: Vec<u32>,
}

impl Links {
    /// No links.
    pub fn new() -> Self {
        Self::default()
    }

    /// Restores links that were stored; they must be sorted and their blocks in place.
    ///
    /// # Errors
    /// A sentence when an index is out of range or the order is broken.
    pub fn restore(forest: &Forest, links: Vec<Link>, blocks: Vec<f64>) -> Result<Self, String> {
        let nodes = forest.len() as u32;
        for (k, l) in links.iter().enumerate() {
            if l.receiver.0 >= nodes || l.shooter.0 >= nodes {
                return Err(format!("link {k} joins nodes {} and {} of {nodes}", l.receiver.0, l.shooter.0));
            }
            let bases = [forest.basis_of(l.receiver), forest.basis_of(l.shooter)];
            for (basis, order) in bases.iter().zip(l.orders) {
                let order = usize::from(order);
                if order == 0 || order > basis.order() || (!basis.is_nested() && order != basis.order()) {
                    return Err(format!("link {k} has order {order} in a basis of order {}", basis.order()));
                }
            }
            let size =
                bases[0].truncated(usize::from(l.orders[0])).len() * bases[1].truncated(usize::from(l.orders[1])).len();
            if l.block.checked_add(size as u64).is_none_or(|end| end > blocks.len() as u64) {
                return Err(format!("link {k} has its block beyond the stored {}", blocks.len()));
            }
            if k > 0 && (links[k - 1].receiver, links[k - 1].shooter) >= (l.receiver, l.shooter) {
                return Err(format!("link {k} is out of order"));
            }
        }
        let mut all = Links { links, blocks, starts: Vec::new() };
        all.index(forest.len());
        Ok(all)
    }

    /// The links, sorted by receiver, then shooter.
    pub fn as_slice(&self) -> &[Link] {
        &self.links
    }

    /// All blocks, one after the other.
    pub fn blocks(&self) -> &[f64] {
        &self.blocks
    }

    /// Bytes that links and blocks take.
    pub fn bytes(&self) -> u64 {
        (size_of_val(&*self.links) + size_of_val(&*self.blocks) + size_of_val(&*self.starts)) as u64
    }

    /// Number of links.
    pub fn len(&self) -> usize {
        self.links.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.links.is_empty()
    }

    /// The links of one receiver.
    pub fn of(&self, receiver: NodeId) -> &[Link] {
        match self.starts.get(receiver.index()..receiver.index() + 2) {
            Some(range) => &self.links[range[0] as usize..range[1] as usize],
            None => &[],
        }
    }

    /// No links, and memory for as many.
    pub(crate) fn with_room(links: usize, numbers: usize) -> Self {
        Links { links: Vec::with_capacity(links), blocks: Vec::with_capacity(numbers), starts: Vec::new() }
    }

    /// Adds a link that comes after all others; [`Links::finish`] makes it found.
    pub(crate) fn push(&mut self, receiver: NodeId, shooter: NodeId, coupling: &Coupling) {
        debug_assert!(self.links.last().is_none_or(|l| (l.receiver, l.shooter) < (receiver, shooter)));
        self.links.push(Link::of(receiver, shooter, self.blocks.len() as u64, coupling));
        self.blocks.extend_from_slice(&coupling.block);
    }

    /// Makes pushed links found.
    pub(crate) fn finish(&mut self, forest: &Forest) {
        self.index(forest.len());
    }

    /// Removes the links whose index is marked and adds new ones, in order. Cost linear in the links kept.
    ///
    /// # Panics
    /// If `removed` is shorter than the number of links.
    pub fn replace(&mut self, forest: &Forest, removed: &[bool], added: Vec<(NodeId, NodeId, Coupling)>) {
        let mut added = added;
        added.sort_by_key(|(receiver, shooter, _)| (*receiver, *shooter));
        let size = |l: &Link| {
            let n = |id, order: u8| forest.basis_of(id).truncated(usize::from(order)).len();
            n(l.receiver, l.orders[0]) * n(l.shooter, l.orders[1])
        };
        let mut links = Vec::with_capacity(self.links.len() + added.len());
        let mut blocks = Vec::with_capacity(self.blocks.len());
        let mut kept = self.links.iter().zip(removed).filter(|(_, gone)| !**gone).map(|(l, _)| *l).peekable();
        let mut fresh = added.into_iter().peekable();
        // both lists are sorted: one merge
        loop {
            let old = kept.peek().map(|l| (l.receiver, l.shooter));
            let new = fresh.peek().map(|(r, s, _)| (*r, *s));
            let start = blocks.len() as u64;
            match (old, new) {
                (None, None) => break,
                (Some(o), n) if n.is_none_or(|n| o <= n) => {
                    let Some(mut link) = kept.next() else { break };
                    blocks.extend_from_slice(&self.blocks[link.block as usize..link.block as usize + size(&link)]);
                    link.block = start;
                    links.push(link);
                }
                _ => {
                    let Some((receiver, shooter, c)) = fresh.next() else { break };
                    blocks.extend_from_slice(&c.block);
                    links.push(Link::of(receiver, shooter, start, &c));
                }
            }
        }
        self.links = links;
        self.blocks = blocks;
        self.index(forest.len());
    }

    fn index(&mut self, nodes: usize) {
        self.starts = vec![0; nodes + 1];
        for l in &self.links {
            self.starts[l.receiver.index() + 1] += 1;
        }
        for n in 0..nodes {
            self.starts[n + 1] += self.starts[n];
        }
    }
}
