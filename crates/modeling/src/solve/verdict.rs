//! The last word of every solution: each hard row is looked at once more, and missed ones are named.

use super::refine::{SideState, Solver};
use crate::constraint::{Demand, curvature};
use crate::system::{Block, Problem, Structure};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A row of length 1 may be missed by this share of the size of the shape, whatever the tolerance.
const MISSED: f64 = 1e-9;

/// Forces whose sum is more than this share of their sizes are not in balance.
const UNBALANCED: f64 = 1e-4;

/// Missed constraints that are named.
const NAMED: usize = 8;

/// The size of the shape, about: the largest target of its linear rows, as [`Problem`] has it for conflicts.
pub(crate) fn scale(problem: &Problem, blocks: &[(Arc<Structure>, Block)]) -> f64 {
    problem.size(largest(problem, blocks))
}

/// The largest target of the linear rows.
pub(crate) fn largest(problem: &Problem, blocks: &[(Arc<Structure>, Block)]) -> f64 {
    let linear = |c: usize| !matches!(problem.constraints()[c].demand, Demand::Curvature(_));
    let mut most = 0.0;
    for side in blocks.iter().flat_map(|b| &b.1.sides) {
        for (target, c) in side.targets.iter().zip(&side.constraints) {
            if target.abs() > most && linear(*c) {
                most = target.abs();
            }
        }
    }
    most
}

/// What a row of length 1 may be missed by.
pub(crate) fn allowed(tolerance: f64, scale: f64) -> f64 {
    tolerance.max(MISSED) * scale
}

/// The largest miss of a hard row, of length 1, of one side. NaN counts as infinite.
pub(crate) fn worst(structure: &Structure, targets: &[f64], side: &SideState) -> f64 {
    let mut worst = 0.0_f64;
    for r in (0..structure.rows()).filter(|r| structure.give[*r] == 0.0) {
        let miss = (targets[r] - structure.apply_row(r, &side.x)).abs();
        worst = if miss.is_nan() { f64::INFINITY } else { worst.max(miss) };
    }
    worst
}

impl Solver {
    /// Looks at every hard row of the linear problem: a missed one is named and ends convergence. Curvature has its
    /// own test.
    pub(super) fn judge(&mut self) {
        let scale = scale(&self.problem, &self.blocks);
        let allowed = allowed(self.settings.tolerance, scale);
        let within = |((structure, block), states): (&(Arc<Structure>, Block), &Vec<SideState>)| {
            block.sides.iter().zip(states).all(|(side, state)| worst(structure, &side.targets, state) <= allowed)
        };
        let met = self.blocks.iter().zip(&self.sides).all(within);
        if self.converged && !self.is_balanced(scale) {
            self.notes.push("constraints weigh too little beside the energy to hold the shape".to_owned());
            self.converged = false;
        }
        if met && self.dropped.followers.is_empty() {
            return;
        }
        // By name: rows that were left out because they follow from others are looked at as well.
        let coefficients = self.coefficients();
        let mut missed: BTreeMap<usize, f64> = BTreeMap::new();
        let mut miss_of = |constraint: usize, miss: f64| {
            let most = missed.entry(constraint).or_insert(miss);
            *most = most.max(miss);
        };
        let noted = |c: &usize| self.dropped.missed.binary_search(c).is_ok();
        for row in self.problem.rows().iter().filter(|r| r.give == 0.0 && !noted(&r.constraint)) {
            let value: f64 = row.entries().map(|(c, i, v)| v * coefficients[c][i]).sum();
            let miss = (value - row.target).abs();
            // What follows from others follows up to their rounding.
            let follows = self.dropped.followers.binary_search(&row.constraint).is_ok();
            if miss.is_nan() || miss > if follows { 1e2 * allowed } else { allowed } {
                miss_of(row.constraint, miss * row.length);
            }
        }
        // Of constraints that are said to be missed some rows may have been kept.
        for ((structure, block), states) in self.blocks.iter().zip(&self.sides) {
            for (side, state) in block.sides.iter().zip(states) {
                for (r, c) in side.constraints.iter().enumerate().filter(|(_, c)| noted(c)) {
                    let miss = (side.targets[r] - structure.apply_row(r, &state.x)).abs();
                    if structure.give[r] == 0.0 && (miss.is_nan() || miss > allowed) {
                        miss_of(*c, miss * structure.lengths[r]);
                    }
                }
            }
        }
        let missed: Vec<(usize, f64)> = missed.into_iter().collect();
        if missed.is_empty() {
            self.converged &= met;
            return;
        }
        self.converged = false;
        self.name(missed);
    }

    /// False where soft rows alone hold a shape, and their forces move one that costs no energy: rounding has lost
    /// them beside the energy.
    fn is_balanced(&self, scale: f64) -> bool {
        let soft = |structure: &Structure| structure.rows() > 0 && structure.give.iter().all(|g| *g > 0.0);
        if !self.blocks.iter().any(|b| soft(&b.0)) {
            return true;
        }
        let null = self.h.null_space(self.problem.energy().free_degree());
        let rounding = allowed(self.settings.tolerance, scale);
        for ((structure, block), states) in self.blocks.iter().zip(&self.sides).filter(|b| soft(&b.0.0)) {
            for (c, z) in (0..structure.k).flat_map(|c| null.iter().map(move |z| (c, z))) {
                let seen = structure.sight(c, z).into_iter().zip(&structure.give);
                let seen: Vec<f64> = seen.map(|(seen, give)| seen / give).collect();
                for (side, state) in block.sides.iter().zip(states) {
                    let (mut sum, mut least) = (0.0, 0.0);
                    for (r, by) in seen.iter().enumerate() {
                        let miss = side.targets[r] - structure.apply_row(r, &state.x);
                        sum += miss * by;
                        least += by.abs() * (UNBALANCED * miss.abs() + rounding);
                    }
                    if f64::abs(sum) > least {
                        return false;
                    }
                }
            }
        }
        true
    }

    /// One note a missed constraint.
    pub(super) fn name(&mut self, missed: Vec<(usize, f64)>) {
        let more = missed.len().saturating_sub(NAMED);
        for (constraint, miss) in missed.into_iter().take(NAMED) {
            let id = &self.problem.constraints()[constraint].id;
            self.notes.push(format!("constraint {id} is missed by {miss:.1e}"));
        }
        if more > 0 {
            self.notes.push(format!("{more} more constraints are missed"));
        }
    }

    /// The last word on curvature: what is missed is named.
    pub(super) fn judge_curvature(&mut self) {
        let coefficients = self.coefficients();
        let seen = curvature::look(&self.problem, &coefficients);
        let allowed = self.settings.tolerance.max(MISSED);
        let usual = curvature::usual(&self.problem, &coefficients);
        let mut missed = Vec::new();
        for s in &seen {
            match s.miss() {
                None => {
                    let id = &self.problem.constraints()[s.constraint].id;
                    self.notes.push(format!(
                        "constraint {id}: the tangent has collapsed, so there is no curvature to ask for"
                    ));
                    self.converged = false;
                }
                Some(miss) if miss.abs() <= s.allowed(allowed, usual) => {}
                Some(miss) => missed.push((s.constraint, miss.abs())),
            }
        }
        if !missed.is_empty() {
            self.converged = false;
            self.name(missed);
        }
    }
}
