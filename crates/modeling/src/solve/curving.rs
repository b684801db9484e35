//! Curvature constraints by sequential quadratic programs: each is a problem of linear rows around the shape so far,
//! solved like any other; half steps where the whole one does more harm than good.
//!
//! The energy alone is not enough of a second derivative: the forces of the curvature constraints bend with the shape,
//! and where they stiffen it they are added as soft rows. (Where they soften it they are left out, so that every
//! program has a least; a step then is shorter than Newton's, never longer.) Merit is half the energy plus the misses
//! times more than the forces, an exact penalty, compared with the worst of the last few shapes (Grippo, Lampariello
//! and Lucidi 1986) because curved constraints make good whole steps look bad.

use super::auto::fits;
use super::refine::{SolveError, Solver, Stage, fresh_sides};
use crate::constraint::curvature::{self, Force};
use crate::constraint::{Demand, Row};
use crate::energy::Hessian;
use crate::system::ProblemError;
use std::sync::Arc;

/// The shape that the current program is linear around, and what is remembered of those before it.
#[derive(Debug, Default)]
pub(super) struct Curving {
    pub(super) from: Vec<Vec<f64>>,
    /// Energies and misses of the last shapes, the newest last.
    last: Vec<(f64, Vec<f64>)>,
    /// Price of a miss, constraint by constraint.
    price: Vec<f64>,
    /// True for constraints without which the shape would be bent less where they are.
    held: Vec<bool>,
    /// Soft rows of the problem.
    soft: Vec<Row>,
    /// The last way, if it was gone in one whole step.
    way: Option<Vec<Vec<f64>>>,
}

/// Programs after which curvature constraints are given up.
const PROGRAMS: usize = 300;

/// Halvings of a step.
const HALVINGS: i32 = 30;

/// Shapes whose merit is remembered.
const REMEMBERED: usize = 4;

/// Share of the promised gain that a step must bring.
const SHARE: f64 = 1e-4;

/// Whole steps that one may stand for.
const FAR: f64 = 100.0;

/// A longer step than this is worth a try.
const LITTLE: f64 = 1.5;

/// Soft rows of curvature that are less than this share of the energy's stiffness are left out.
const FAINT: f64 = 1e-12;

/// A miss costs this many times the force that holds it.
const DEAR: f64 = 1.5;

/// Where two whole steps go the same way, the second a share of the first: how many of the second to the end of the
/// row (Aitken).
fn farther(before: &[Vec<f64>], now: &[Vec<f64>]) -> Option<f64> {
    let dot = |a: &[Vec<f64>], b: &[Vec<f64>]| -> f64 {
        a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a * b).sum()
    };
    let (square, product, next) = (dot(before, before), dot(before, now), dot(now, now));
    let share = product / square;
    let straight = product >= 0.95 * (square * next).sqrt();
    (straight && share > 0.3 && share < 1.0).then(|| (1.0 / (1.0 - share)).min(FAR))
}

impl Solver {
    /// After a linear solution: prepares the next program, if there are curvature constraints that need one. Notes from
    /// `said` on are about that solution, and go with it.
    pub(super) fn curve(&mut self, said: usize) -> Result<bool, SolveError> {
        if !self.problem.constraints().iter().any(|c| matches!(c.demand, Demand::Curvature(_))) {
            return Ok(false);
        }
        let to = self.stacked();
        let finite = to.iter().flatten().all(|v| v.is_finite());
        let Some(mut curving) = self.curving.take() else {
            if !self.converged || !finite {
                return Ok(false);
            }
            let soft: Vec<Row> = self.problem.rows().into_iter().filter(|r| r.give > 0.0).collect();
            let misses = self.misses(&to);
            if misses.as_ref().is_none_or(|m| self.are_met(m, &to)) {
                self.judge_curvature();
                return Ok(false);
            }
            let energy = self.energy(&to, &soft);
            let price = vec![0.0; misses.as_ref().map_or(0, Vec::len)];
            let last = vec![(energy, misses.unwrap_or_default())];
            let held = curvature::look(&self.problem, &to).iter().map(curvature::Seen::is_less).collect();
            return self.program(Curving { from: to, last, price, held, soft, way: None });
        };
        if !self.converged || !finite {
            self.notes.truncate(said);
            return Ok(self.give_up(&curving.from));
        }
        let size = to.iter().flatten().fold(0.0, |m: f64, v| m.max(v.abs()));
        let pairs = to.iter().flatten().zip(curving.from.iter().flatten());
        let step = pairs.fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        if step <= self.settings.tolerance * size && self.misses(&to).is_some_and(|m| self.are_met(&m, &to)) {
            self.judge_curvature();
            return Ok(false);
        }
        if self.newton >= PROGRAMS || !self.advance_shape(&mut curving, &to) {
            return Ok(self.give_up(&curving.from));
        }
        self.program(curving)
    }

    /// Moves along the way to `to` as far as the merit allows; false where no step is good.
    fn advance_shape(&self, curving: &mut Curving, to: &[Vec<f64>]) -> bool {
        for (price, force) in curving.price.iter_mut().zip(self.forces()) {
            let least = DEAR * force.size().abs();
            *price = least.max(0.5 * (*price + least));
        }
        let way: Vec<Vec<f64>> =
            to.iter().zip(&curving.from).map(|(t, f)| t.iter().zip(f).map(|(t, f)| t - f).collect()).collect();
        let Some((start, misses)) = curving.last.last() else { return false };
        // The energy along the way is a parabola.
        let (end, square) = (self.energy(to, &curving.soft), self.square(&way, &curving.soft));
        let cost = |misses: &[f64]| -> f64 { misses.iter().zip(&curving.price).map(|(m, p)| p * m.abs()).sum() };
        let merit = |(energy, misses): &(f64, Vec<f64>)| 0.5 * energy + cost(misses);
        let worst = curving.last.iter().map(merit).fold(f64::NEG_INFINITY, f64::max);
        let slope = 0.5 * (end - start - square) - cost(misses);
        let noise = 1e-12 * worst.abs();
        let place = |by: f64| {
            let between = |(f, w): (&Vec<f64>, &Vec<f64>)| f.iter().zip(w).map(|(f, w)| f + by * w).collect();
            let shape: Vec<Vec<f64>> = curving.from.iter().zip(&way).map(between).collect();
            let energy = start + by * (end - start - square) + by * by * square;
            self.misses(&shape).map(|misses| (shape, (energy, misses)))
        };
        let good = |halving: i32| {
            let by = 0.5_f64.powi(halving);
            let there = place(by)?;
            (merit(&there.1) <= worst + SHARE * by * slope.min(0.0) + noise).then_some((there, by == 1.0))
        };
        let Some(((mut shape, mut here), whole)) = (0..HALVINGS).find_map(good) else { return false };
        let mut kept = None;
        if whole {
            let far = curving.way.take().and_then(|before| farther(&before, &way)).unwrap_or(0.0);
            let steps = (0..HALVINGS).map(|halving| far * 0.5_f64.powi(halving)).take_while(|by| *by > LITTLE);
            let better = |there: &(Vec<Vec<f64>>, (f64, Vec<f64>))| merit(&there.1) <= merit(&here) + noise;
            match steps.filter_map(place).find(better) {
                Some(there) => (shape, here) = there,
                None => kept = Some(way),
            }
        }
        curving.way = kept;
        curving.from = shape;
        curving.last.push(here);
        let many = curving.last.len().saturating_sub(REMEMBERED);
        curving.last.drain(..many);
        true
    }

    /// Poses the program around the shape of `curving`.
    fn program(&mut self, curving: Curving) -> Result<bool, SolveError> {
        let forces = self.forces();
        let mut rows = self.problem.rows();
        let linear = rows.len();
        let usual = curvature::usual(&self.problem, &curving.from);
        let seen = curvature::look(&self.problem, &curving.from);
        for ((seen, force), held) in seen.iter().zip(forces).zip(&curving.held) {
            seen.rows(force, usual, *held, &mut rows);
        }
        // What bends next to nothing only makes factors worse.
        let most = self.h.trace() / self.problem.space().len() as f64 * FAINT;
        let mut number = 0;
        rows.retain(|r| {
            number += 1;
            number <= linear || r.give * most <= 1.0
        });
        let blocks = match self.problem.blocks(rows) {
            Ok((blocks, _)) => blocks,
            // What contradicts the rows here need not do so elsewhere, but there is no way to go on.
            Err(ProblemError::Conflict { id, others, .. }) => {
                self.notes.push(format!("constraint {id} contradicts {others}: remove one of them"));
                return Ok(self.give_up(&curving.from));
            }
            Err(e) => {
                self.notes.push(e.to_string());
                return Ok(self.give_up(&curving.from));
            }
        };
        // Rows of curvature couple coordinates that had a matrix each.
        if let Err(e) = blocks.iter().try_for_each(|b| fits(&b.structure, self.method)) {
            self.notes.push(e.to_string());
            return Ok(self.give_up(&curving.from));
        }
        self.newton += 1;
        self.curving = Some(curving);
        self.sides = fresh_sides(&blocks);
        self.blocks = blocks.into_iter().map(|b| (Arc::new(b.structure.clone()), b)).collect();
        self.correctors = (0..self.blocks.len()).map(|_| None).collect();
        self.at = (0, 0);
        self.stage = Stage::Residual;
        Ok(true)
    }

    /// Back to the last good shape, which meets all but curvature; says what is missed.
    pub(super) fn give_up(&mut self, shape: &[Vec<f64>]) -> bool {
        let n = self.problem.space().len();
        for ((_, block), sides) in self.blocks.iter().zip(&mut self.sides) {
            for (side, state) in block.sides.iter().zip(sides) {
                for (i, c) in side.coordinates.iter().enumerate() {
                    state.x[i * n..][..n].copy_from_slice(&shape[*c]);
                }
            }
        }
        self.converged = false;
        if self.newton > 0 {
            self.notes.push(format!("curvature: {} steps did not settle", self.newton));
        }
        self.judge_curvature();
        false
    }

    /// What holds each curvature constraint, by the last solution: about straight places in space have two rows.
    fn forces(&self) -> Vec<Force> {
        let is_curvature = |c: &usize| matches!(self.problem.constraints()[*c].demand, Demand::Curvature(_));
        let numbers: Vec<usize> = (0..self.problem.constraints().len()).filter(is_curvature).collect();
        let mut forces = vec![Force::None; numbers.len()];
        for ((structure, block), states) in self.blocks.iter().zip(&self.sides) {
            for (side, state) in block.sides.iter().zip(states) {
                for (r, c) in side.constraints.iter().enumerate().filter(|(r, _)| structure.give[*r] == 0.0) {
                    if let Ok(at) = numbers.binary_search(c) {
                        let force = state.multipliers[r] / structure.lengths[r];
                        forces[at] = match forces[at] {
                            Force::One(first) => Force::Two([first, force]),
                            _ => Force::One(force),
                        };
                    }
                }
            }
        }
        forces
    }

    /// The misses of curvature; `None` where there is none.
    fn misses(&self, shape: &[Vec<f64>]) -> Option<Vec<f64>> {
        curvature::look(&self.problem, shape).iter().map(curvature::Seen::miss).collect()
    }

    fn are_met(&self, misses: &[f64], shape: &[Vec<f64>]) -> bool {
        let usual = curvature::usual(&self.problem, shape);
        let seen = curvature::look(&self.problem, shape);
        let most = self.settings.tolerance.max(1e-12);
        misses.iter().zip(seen).all(|(m, s)| m.abs() <= s.allowed(most, usual))
    }

    /// Energy with that of the soft rows.
    fn energy(&self, shape: &[Vec<f64>], soft: &[Row]) -> f64 {
        let miss = |r: &Row| r.entries().map(|(c, i, v)| v * shape[c][i]).sum::<f64>() - r.target;
        let rows: f64 = soft.iter().map(|r| miss(r).powi(2) / r.give).sum();
        shape.iter().map(|x| self.h.energy(x)).sum::<f64>() + rows
    }

    /// The same of a change of shape: its part of second order.
    fn square(&self, change: &[Vec<f64>], soft: &[Row]) -> f64 {
        let value = |r: &Row| r.entries().map(|(c, i, v)| v * change[c][i]).sum::<f64>();
        let rows: f64 = soft.iter().map(|r| value(r).powi(2) / r.give).sum();
        change.iter().map(|x| self.h.energy(x)).sum::<f64>() + rows
    }
}
