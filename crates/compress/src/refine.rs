//! ProjectKernel, second form (thesis 4.5.2): a link that is not good enough becomes links between children.
//!
//! The work of a batch is a list of independent tasks; the forest and the links change only when the batch is
//! committed, so that a batch given up half-way leaves everything as it was.

use crate::cell::Cell;
use crate::couple::{CoupleSettings, Coupling, couple};
use crate::forest::{Forest, NodeId};
use crate::kernel::Kernel;
use crate::links::Links;
use ondelette_numerics::par;

/// Which end of a link to split.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The receiver.
    Receiver,
    /// The shooter.
    Shooter,
}

/// How to change a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// It becomes links to the children of one end.
    Split(End),
    /// Its order at one end rises by one.
    Raise(End),
}

impl Change {
    /// The end that changes.
    pub fn end(self) -> End {
        match self {
            Change::Split(end) | Change::Raise(end) => end,
        }
    }
}

/// One pair to couple: a node or a child of a node (which may not exist yet) at each end.
#[derive(Clone, Copy, Debug)]
pub struct Task {
    receiver: (NodeId, Option<u8>),
    shooter: (NodeId, Option<u8>),
    settings: CoupleSettings,
}

impl Task {
    /// Couples two existing nodes.
    pub fn between(receiver: NodeId, shooter: NodeId, settings: CoupleSettings) -> Self {
        Task { receiver: (receiver, None), shooter: (shooter, None), settings }
    }
}

/// A batch of work in progress.
#[derive(Clone, Debug, Default)]
pub struct Refinement {
    tasks: Vec<Task>,
    /// How many tasks are done, and what came of those that made a link.
    done: usize,
    made: Vec<(u32, Coupling)>,
    removed: Vec<u32>,
}

impl Refinement {
    /// A batch that couples the given pairs.
    pub fn linking(tasks: Vec<Task>) -> Self {
        Refinement { tasks, done: 0, made: Vec::new(), removed: Vec::new() }
    }

    /// A batch that changes the chosen links (by index). The settings are those of the changed link, but for the order
    /// that rises.
    pub fn changing(
        forest: &Forest,
        links: &Links,
        chosen: &[(u32, Change)],
        settings: impl Fn(u32) -> CoupleSettings,
    ) -> Self {
        let mut tasks = Vec::with_capacity(4 * chosen.len());
        for &(k, change) in chosen {
            let link = links.as_slice()[k as usize];
            let mut settings = settings(k);
            let split = match change {
                Change::Split(End::Receiver) => link.receiver,
                Change::Split(End::Shooter) => link.shooter,
                Change::Raise(end) => {
                    let e = usize::from(end == End::Shooter);
                    settings.orders[e] = link.orders[e] + 1;
                    tasks.push(Task::between(link.receiver, link.shooter, settings));
                    continue;
                }
            };
            for c in 0..forest.node(split).cell.shape.arity() as u8 {
                tasks.push(match change.end() {
                    End::Receiver => Task { receiver: (split, Some(c)), shooter: (link.shooter, None), settings },
                    End::Shooter => Task { receiver: (link.receiver, None), shooter: (split, Some(c)), settings },
                });
            }
        }
        Refinement { tasks, done: 0, made: Vec::new(), removed: chosen.iter().map(|c| c.0).collect() }
    }

    /// A batch that couples the chosen links (by index) anew, as they are.
    pub fn renewing(links: &Links, chosen: &[u32], settings: impl Fn(u32) -> CoupleSettings) -> Self {
        let task = |&k: &u32| {
            let link = links.as_slice()[k as usize];
            Task::between(link.receiver, link.shooter, settings(k))
        };
        Refinement { tasks: chosen.iter().map(task).collect(), done: 0, made: Vec::new(), removed: chosen.to_vec() }
    }

    /// Number of tasks.
    pub fn len(&self) -> usize {
        self.tasks.len()
    }

    /// Whether there is nothing to do.
    pub fn is_empty(&self) -> bool {
        self.tasks.is_empty()
    }

    /// Number of tasks done.
    pub fn done(&self) -> usize {
        self.done
    }

    /// Does the next tasks, in parallel, up to about `most` units of work (a unit is a few ten microseconds); true when
    /// all are done. Returns also the kernel samples taken. How the work is cut changes no result.
    pub fn step<K: Kernel>(&mut self, kernel: &K, forest: &Forest, most: usize) -> (bool, u64) {
        let from = self.done;
        let (mut count, mut work) = (0, 0);
        while work < most && from + count < self.tasks.len() {
            let task = &self.tasks[from + count];
            let shape = forest.node(task.receiver.0).cell.shape;
            work += task.settings.work(forest.basis_of_order(shape, task.settings.orders[0]).order());
            count += 1;
        }
        let cell = |(id, child): (NodeId, Option<u8>)| -> Cell {
            let cell = forest.node(id).cell;
            child.map_or(cell, |c| cell.child(usize::from(c)))
        };
        let tasks = &self.tasks;
        let fresh = par::map(count, |i| {
            let task = tasks[from + i];
            let (r, s) = (cell(task.receiver), cell(task.shooter));
            let [p, q] = task.settings.orders;
            let bases = [forest.basis_of_order(r.shape, p), forest.basis_of_order(s.shape, q)];
            couple(kernel, &r, bases[0], &s, bases[1], task.settings)
        });
        let samples = fresh.iter().flatten().map(|c| u64::from(c.kernel_samples)).sum();
        let made = fresh.into_iter().enumerate().filter_map(|(i, c)| c.map(|c| ((from + i) as u32, c)));
        self.made.extend(made);
        self.done += count;
        (self.done == self.tasks.len(), samples)
    }

    /// Applies the batch: splits nodes, removes the old links, adds the new ones. Returns the nodes that were split, in
    /// order, so that the caller can push its values to their children.
    ///
    /// # Panics
    /// If tasks are left to do.
    pub fn commit(self, forest: &mut Forest, links: &mut Links) -> Vec<NodeId> {
        assert_eq!(self.done, self.tasks.len(), "all tasks are done before a batch is committed");
        let mut split = Vec::new();
        let mut resolve = |forest: &mut Forest, (id, child): (NodeId, Option<u8>)| match child {
            None => id,
            Some(c) => {
                if forest.is_leaf(id) {
                    forest.split(id);
                    split.push(id);
                }
                forest.child(id, usize::from(c))
            }
        };
        let mut added = Vec::with_capacity(self.made.len());
        let mut made = self.made.into_iter().peekable();
        for (k, task) in self.tasks.iter().enumerate() {
            // children are made for every task, whether it became a link or not: the tree must not depend on blocks
            let receiver = resolve(forest, task.receiver);
            let shooter = resolve(forest, task.shooter);
            if let Some((_, coupling)) = made.next_if(|(index, _)| *index as usize == k) {
                added.push((receiver, shooter, coupling));
            }
        }
        let mut removed = vec![false; links.len()];
        self.removed.iter().for_each(|&k| removed[k as usize] = true);
        links.replace(forest, &removed, added);
        split
    }
}
