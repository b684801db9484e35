//! Solving E = K (M + rho E) on the links as they are.
//!
//! Gmres, Jacobi and Gauss-Seidel sweep over all links; Southwell and progressive shooting keep what is unshot. There
//! the radiosity B that was shot so far is implicit: E = K B holds throughout, and U = M + rho E - B is what is left to
//! shoot. A shot from a set S of elements adds U on S to B, hence K U to E and rho K U to U, and clears U on S.
//! All orders are fixed, and ties go to the lower index: the result does not depend on the number of threads.

use super::memory::CAPPED_RESTART;
use super::{Event, Linked};
use crate::rgb::Rgb;
use crate::settings::Iteration;
use ondelette_compress::{NodeId, Trees};
use ondelette_numerics::krylov::Gmres;

/// Krylov vectors kept before a restart.
const RESTART: usize = 60;
/// Sweeps, and shots of each element, after which a solve is given up.
const MOST_SWEEPS: u64 = 20_000;
/// Shots an event.
const SHOTS_A_STEP: usize = 64;

/// A solve in progress.
pub(super) enum Balance {
    Gmres(Box<Gmres<3>>),
    Sweeps(Sweeps),
    Shots(Box<Shots>),
}

/// Jacobi or Gauss-Seidel.
pub(super) struct Sweeps {
    /// For Gauss-Seidel.
    trees: Option<Trees>,
    weights: Vec<f64>,
    /// Relative size of the last change.
    residual: f64,
    done: u64,
}

/// Southwell or progressive shooting.
pub(super) struct Shots {
    trees: Trees,
    /// U at the leaves, and its power a node.
    unshot: Vec<[f64; 3]>,
    power: Vec<f64>,
    /// Radiosity on its way, and irradiance that arrives: zeros between two shots.
    leaving: Vec<[f64; 3]>,
    arriving: Vec<[f64; 3]>,
    done: u64,
}

impl Linked {
    /// Starts a solve from the irradiance as it is.
    pub(super) fn start_solving(&mut self) {
        // residual = K (M + rho E) - E
        let mut values = self.radiosity(&self.irradiance, true);
        let mut residual = vec![[0.0; 3]; values.len()];
        self.transport(&mut values, &mut residual);
        self.statistics.iterations += 1;
        for (r, e) in residual.iter_mut().zip(&self.irradiance) {
            for c in 0..3 {
                r[c] -= e[c];
            }
        }
        // E is at least what the present radiosity brings, and that is the residual plus E
        let brought: f64 = self.leaf_sum(|slot| Rgb(residual[slot]) + Rgb(self.irradiance[slot]));
        let known: f64 = self.leaf_sum(|slot| Rgb(self.irradiance[slot]));
        self.whole = brought.max(known);
        self.phase = super::Phase::Solving(match self.settings.links.iteration {
            Iteration::Gmres => {
                Balance::Gmres(Box::new(Gmres::new(self.irradiance.clone(), residual, self.slot_weights())))
            }
            Iteration::Jacobi => Balance::Sweeps(self.sweeps(residual, None)),
            Iteration::GaussSeidel => {
                let trees = Trees::of(&self.forest, &self.links);
                Balance::Sweeps(self.sweeps(residual, Some(trees)))
            }
            Iteration::Southwell | Iteration::Shooting => Balance::Shots(Box::new(self.shots(residual))),
        });
    }

    /// Sweeps whose first is the one that gave the residual.
    fn sweeps(&mut self, residual: Vec<[f64; 3]>, trees: Option<Trees>) -> Sweeps {
        let weights = self.slot_weights();
        let size = self.relative_size(&weights, residual.iter().copied());
        self.add(&residual);
        Sweeps { trees, weights, residual: size, done: 1 }
    }

    fn add(&mut self, change: &[[f64; 3]]) {
        for (e, d) in self.irradiance.iter_mut().zip(change) {
            for c in 0..3 {
                e[c] += d[c];
            }
        }
    }

    /// Lamps that shine on nothing yet have all of their power unshot; after that, B is what the last solve ended with.
    fn shots(&mut self, residual: Vec<[f64; 3]>) -> Shots {
        let stride = self.forest.stride();
        let dark = self.irradiance.iter().all(|e| *e == [0.0; 3]);
        let unshot = if dark {
            self.radiosity(&self.irradiance, true)
        } else {
            self.add(&residual);
            self.radiosity(&residual, false)
        };
        let zeros = vec![[0.0; 3]; unshot.len()];
        let power = unshot.chunks(stride).enumerate().map(|(n, u)| self.power(n, u)).collect();
        let trees = Trees::of(&self.forest, &self.links);
        Shots { trees, unshot, power, leaving: zeros.clone(), arriving: zeros, done: 0 }
    }

    /// Area of a leaf times the root mean square of the function with these coefficients, channels summed.
    fn power(&self, n: usize, slots: &[[f64; 3]]) -> f64 {
        let node = &self.forest.nodes()[n];
        if node.first_child != 0 {
            return 0.0;
        }
        let basis = self.forest.basis(node.cell.shape);
        let share = if basis.is_nested() { 1.0 } else { 1.0 / basis.len() as f64 };
        let mut square = [0.0; 3];
        for v in &slots[..basis.len()] {
            for c in 0..3 {
                square[c] += share * v[c] * v[c];
            }
        }
        node.measure * square.map(f64::sqrt).iter().sum::<f64>()
    }

    /// By Cauchy and Schwarz the integral of |r| is at most the root of the area times the norm of r; over the light in
    /// the scene.
    fn relative_size(&self, weights: &[f64], values: impl Iterator<Item = [f64; 3]>) -> f64 {
        let mut square = [0.0; 3];
        for (w, v) in weights.iter().zip(values) {
            for c in 0..3 {
                square[c] += w * v[c] * v[c];
            }
        }
        self.relative(square.map(f64::sqrt))
    }

    fn relative(&self, norms: [f64; 3]) -> f64 {
        let size = norms.iter().sum::<f64>() * self.counted_area.sqrt();
        if self.whole > 0.0 { size / self.whole } else { 0.0 }
    }

    /// The residual at which this solve ends: that which a first, coarse balance needs, or that of the promise.
    pub(super) fn wanted(&self) -> f64 {
        let tolerance =
            if self.strict { self.settings.error } else { self.settings.error.max(0.3 * self.error.min(0.3)) };
        0.1 * tolerance * (1.0 - self.highest_reflectance())
    }

    /// One sweep, or some shots; at the end of the solve, a judgement.
    pub(super) fn iterate(&mut self, balance: Balance) -> Event {
        match balance {
            Balance::Gmres(gmres) => self.krylov(gmres),
            Balance::Sweeps(sweeps) => self.sweep(sweeps),
            Balance::Shots(shots) => self.shoot(shots),
        }
    }

    fn krylov(&mut self, mut gmres: Box<Gmres<3>>) -> Event {
        let wanted = self.wanted();
        let now = self.relative(gmres.residual());
        let direction = if now <= wanted { None } else { gmres.direction() };
        let Some(direction) = direction else {
            self.irradiance = gmres.solution();
            return self.end_solve(now);
        };
        let mut values = self.radiosity(direction, false);
        let mut product = vec![[0.0; 3]; values.len()];
        self.transport(&mut values, &mut product);
        for (p, d) in product.iter_mut().zip(direction) {
            for c in 0..3 {
                p[c] = d[c] - p[c];
            }
        }
        gmres.supply(product);
        self.statistics.iterations += 1;
        let residual = self.relative(gmres.residual());
        let restart = if self.cap.is_some() { CAPPED_RESTART } else { RESTART };
        if gmres.steps() >= restart {
            self.irradiance = gmres.solution();
            self.start_solving();
        } else {
            self.phase = super::Phase::Solving(Balance::Gmres(gmres));
        }
        Event::Iterated { iterations: self.statistics.iterations, residual, wanted }
    }

    fn sweep(&mut self, mut sweeps: Sweeps) -> Event {
        let wanted = self.wanted();
        if sweeps.residual <= wanted || sweeps.done >= MOST_SWEEPS {
            return self.end_solve(sweeps.residual);
        }
        let before = self.irradiance.clone();
        let mut values = self.radiosity(&self.irradiance, true);
        if let Some(trees) = &sweeps.trees {
            let stride = self.forest.stride();
            (0..self.forest.roots().len()).for_each(|root| trees.pull(&self.forest, root, &mut values));
            for root in 0..self.forest.roots().len() {
                trees.receive(&self.forest, &self.links, root, &values, &mut self.irradiance);
                for id in trees.nodes(root) {
                    let slots = id.index() * stride..(id.index() + 1) * stride;
                    self.reflect(id.index(), &self.irradiance[slots.clone()], true, &mut values[slots]);
                }
                trees.pull(&self.forest, root, &mut values);
            }
        } else {
            let mut result = vec![[0.0; 3]; values.len()];
            self.transport(&mut values, &mut result);
            self.irradiance = result;
        }
        self.statistics.iterations += 1;
        sweeps.done += 1;
        let change = self.irradiance.iter().zip(&before).map(|(a, b)| std::array::from_fn(|c| a[c] - b[c]));
        sweeps.residual = self.relative_size(&sweeps.weights, change);
        let event = Event::Iterated { iterations: self.statistics.iterations, residual: sweeps.residual, wanted };
        self.phase = super::Phase::Solving(Balance::Sweeps(sweeps));
        event
    }

    fn shoot(&mut self, mut shots: Box<Shots>) -> Event {
        let wanted = self.wanted();
        let most = MOST_SWEEPS * self.forest.len() as u64;
        let whole = self.whole;
        let left = |shots: &Shots| if whole > 0.0 { shots.power.iter().sum::<f64>() / whole } else { 0.0 };
        let (mut now, mut count) = (left(&shots), 0);
        while now > wanted && count < SHOTS_A_STEP && shots.done < most {
            let from = self.brightest(&shots);
            self.shoot_from(&mut shots, &from);
            (now, count) = (left(&shots), count + 1);
        }
        if now <= wanted || shots.done >= most {
            return self.end_solve(now);
        }
        let event = Event::Iterated { iterations: self.statistics.iterations, residual: now, wanted };
        self.phase = super::Phase::Solving(Balance::Shots(shots));
        event
    }

    /// The leaf with the most unshot power, or all leaves of the side that has most.
    fn brightest(&self, shots: &Shots) -> Vec<NodeId> {
        let largest = |powers: &[f64]| (1..powers.len()).fold(0, |a, b| if powers[b] > powers[a] { b } else { a });
        if self.settings.links.iteration == Iteration::Southwell {
            return vec![NodeId(largest(&shots.power) as u32)];
        }
        let mut sides = vec![0.0; self.forest.roots().len()];
        for (node, power) in self.forest.nodes().iter().zip(&shots.power) {
            sides[node.cell.root as usize] += power;
        }
        let nodes = shots.trees.nodes(largest(&sides)).iter();
        nodes.copied().filter(|&id| self.forest.is_leaf(id)).collect()
    }

    fn shoot_from(&mut self, shots: &mut Shots, leaves: &[NodeId]) {
        let stride = self.forest.stride();
        let slots = |id: NodeId| id.index() * stride..(id.index() + 1) * stride;
        // the unshot radiosity at the leaves, and its projections on all nodes above them
        let mut senders = Vec::new();
        for &leaf in leaves {
            shots.leaving[slots(leaf)].copy_from_slice(&shots.unshot[slots(leaf)]);
            shots.unshot[slots(leaf)].fill([0.0; 3]);
            shots.power[leaf.index()] = 0.0;
            let mut id = leaf;
            senders.push(id);
            while self.forest.node(id).parent != id {
                id = self.forest.node(id).parent;
                senders.push(id);
            }
        }
        senders.sort_unstable();
        senders.dedup();
        for &id in senders.iter().rev() {
            ondelette_compress::transport::pull_node(&self.forest, id, &mut shots.leaving);
        }
        let reached = shots.trees.shoot(&self.forest, &self.links, &senders, &shots.leaving, &mut shots.arriving);
        for id in reached {
            let mut reflected = vec![[0.0; 3]; stride];
            self.reflect(id.index(), &shots.arriving[slots(id)], false, &mut reflected);
            for (k, slot) in slots(id).enumerate() {
                for c in 0..3 {
                    self.irradiance[slot][c] += shots.arriving[slot][c];
                    shots.unshot[slot][c] += reflected[k][c];
                }
                shots.arriving[slot] = [0.0; 3];
            }
            shots.power[id.index()] = self.power(id.index(), &shots.unshot[slots(id)]);
        }
        senders.into_iter().for_each(|id| shots.leaving[slots(id)].fill([0.0; 3]));
        shots.done += 1;
        self.statistics.shots += 1;
    }

    /// One plain sweep, so that sides that the norm leaves out get what the others send them; then the judgement.
    fn end_solve(&mut self, residual: f64) -> Event {
        let mut values = self.radiosity(&self.irradiance, true);
        let mut result = vec![[0.0; 3]; values.len()];
        self.transport(&mut values, &mut result);
        self.irradiance = result;
        self.statistics.iterations += 1;
        self.statistics.residual = residual;
        self.statistics.rays = self.rays_before + self.kernel.rays_cast();
        if self.standard.is_some() { self.conclude() } else { self.judge() }
    }
}
