//! The stepped solver: blocks one after another, each refined until it no longer moves.

use super::auto::{self, choose, fits, spare};
use super::banded::{BandGreen, Banded};
use super::bpx::Bpx;
use super::correct::Correct;
use super::curving::Curving;
use super::dropped::{Dropped, notes};
use super::green::Green;
use super::method::{Method, Settings};
use super::multigrid::{CycleGreen, Multigrid};
use super::projected::Projected;
use super::residual::residual;
use super::solution::{Residual, Solution};
use super::sparse::SparseSolver;
use super::spectral::Spectral;
use super::thesis::Squared;
use super::verdict;
use super::wavelet::WaveletGreen;
use crate::constraint::curvature;
use crate::energy::{Operator, Scratch};
use crate::system::{Block, Problem, ProblemError, Structure};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Why a problem cannot be solved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// The constraints contradict each other, or something does not fit.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// The method does not apply.
    #[error("solver {method} does not apply: {why}")]
    Method {
        /// The method asked for.
        method: Method,
        /// What is missing.
        why: &'static str,
    },
    /// A tolerance that is none.
    #[error("tolerance {0}: give a number between 1e-15 and 1")]
    Tolerance(f64),
    /// An answer to a target that is not good enough to move a shape by.
    #[error("the answer to constraint {id} did not converge: try another solver, or a larger tolerance")]
    Response {
        /// Name of the constraint.
        id: String,
    },
    /// Rows that cannot be told apart numerically.
    #[error("constraint {id} cannot be told apart from those before it: move it, or give it a weight")]
    Degenerate {
        /// Its name.
        id: String,
    },
}

/// What a step did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Which right-hand side (block of coordinates).
    pub side: usize,
    /// Corrections finished for it.
    pub corrections: usize,
    /// Iterations so far, all corrections and sides.
    pub iterations: usize,
    /// Largest change of the last finished correction, relative to the largest coefficient.
    pub change: f64,
}

/// A solver that is stepped by its caller; between two steps its solution is valid, if unfinished.
///
/// ```
/// use ondelette_modeling::constraint::{Constraint, Demand};
/// use ondelette_modeling::energy::Energy;
/// use ondelette_modeling::solve::{Settings, Solver};
/// use ondelette_modeling::system::{Problem, Space};
/// use ondelette_modeling::Axis;
/// use ondelette_wavelet::Boundary;
/// let axis = Axis::new(Boundary::Open, 16, [0.0, 1.0])?;
/// let point = |t: f64, y: f64| Constraint::new(format!("at {t}"), &[t], Demand::Position(vec![Some(y)]));
/// let points = vec![point(0.0, 0.0), point(0.5, 1.0), point(1.0, 0.0)];
/// let problem = Problem::new(Space::curve(axis), 1, Energy::BEND, None, points)?;
/// let mut solver = Solver::new(problem, Settings::default())?;
/// while solver.step().is_some() {}
/// let solution = solver.solution();
/// assert!(solution.residuals().iter().all(|r| r.miss.abs() < 1e-12));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Solver {
    pub(super) problem: Problem,
    pub(super) settings: Settings,
    pub(super) method: Method,
    pub(super) why: &'static str,
    /// What a choice by rule gives way to if it does not converge.
    pub(super) spare: Option<(Method, &'static str)>,
    pub(super) h: Arc<Operator>,
    pub(super) blocks: Vec<(Arc<Structure>, Block)>,
    pub(super) notes: Vec<String>,
    /// How many of them were there before anything was solved.
    known: usize,
    pub(super) dropped: Dropped,
    /// One a block, kept for other targets.
    pub(super) correctors: Vec<Option<Box<dyn Correct>>>,
    pub(super) at: (usize, usize),
    /// Unknowns and multipliers of every side, block by block.
    pub(super) sides: Vec<Vec<SideState>>,
    pub(super) stage: Stage,
    pub(super) iterations: usize,
    scratch: Scratch,
    pub(super) converged: bool,
    /// Programs posed for curvature constraints.
    pub(super) newton: usize,
    pub(super) curving: Option<Curving>,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct SideState {
    pub(crate) x: Vec<f64>,
    pub(crate) multipliers: Vec<f64>,
    pub(super) corrections: usize,
    pub(super) change: f64,
    pub(super) miss: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    Residual,
    Correct,
    Finished,
}

impl Solver {
    /// Prepares a solver: blocks, the method's rule, redundant rows. The factors are made in the first step.
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn new(problem: Problem, settings: Settings) -> Result<Solver, SolveError> {
        if !(1e-15..=1.0).contains(&settings.tolerance) {
            return Err(SolveError::Tolerance(settings.tolerance));
        }
        let rows = problem.rows();
        let (blocks, redundant) = problem.blocks(rows)?;
        let h = Arc::new(Operator::new(problem.space(), problem.energy(), problem.stiffness()));
        let (method, why) = choose(&problem, &h, settings.method)?;
        blocks.iter().try_for_each(|b| fits(&b.structure, method))?;
        let spare = if settings.method == Method::Auto { spare(&problem, method) } else { None };
        let dropped = Dropped::new(&redundant);
        let notes = notes(&problem, &redundant);
        let sides = fresh_sides(&blocks);
        let blocks: Vec<(Arc<Structure>, Block)> =
            blocks.into_iter().map(|b| (Arc::new(b.structure.clone()), b)).collect();
        Ok(Solver {
            problem,
            settings,
            method,
            why,
            spare,
            h,
            correctors: (0..blocks.len()).map(|_| None).collect(),
            blocks,
            known: notes.len(),
            notes,
            dropped,
            at: (0, 0),
            sides,
            stage: Stage::Residual,
            iterations: 0,
            scratch: Scratch::default(),
            converged: true,
            newton: 0,
            curving: None,
        })
    }

    /// The method in use (never [`Method::Auto`]).
    pub fn method(&self) -> Method {
        self.method
    }

    /// Does one bounded piece of work; `None` when there is nothing left to do.
    ///
    /// A failed factor (rows that cannot be told apart) ends the solver with a note and without convergence; see
    /// [`Solver::run`] for the error.
    pub fn step(&mut self) -> Option<Step> {
        match self.advance() {
            Ok(step) => step,
            Err(e) => {
                self.notes.push(e.to_string());
                self.converged = false;
                self.stage = Stage::Finished;
                None
            }
        }
    }

    /// Steps to the end.
    ///
    /// # Errors
    /// [`SolveError::Degenerate`].
    pub fn run(mut self) -> Result<Solution, SolveError> {
        self.finish()?;
        Ok(self.solution())
    }

    /// Steps to the end and stays.
    ///
    /// # Errors
    /// [`SolveError::Degenerate`].
    pub fn finish(&mut self) -> Result<(), SolveError> {
        while self.advance()?.is_some() {}
        Ok(())
    }

    pub(super) fn advance(&mut self) -> Result<Option<Step>, SolveError> {
        if self.stage == Stage::Finished {
            return Ok(None);
        }
        let (b, s) = self.at;
        if b >= self.blocks.len() {
            let said = self.notes.len();
            self.judge();
            if self.curve(said)? {
                return self.advance();
            }
            self.stage = Stage::Finished;
            self.explain("rounding keeps the shape from settling: constraints or weights differ too much in size");
            return Ok(None);
        }
        if self.blocks[b].0.rows() == 0 {
            // Nothing is asked: zero is the smoothest.
            self.at = (b + 1, 0);
            return self.advance();
        }
        if self.correctors[b].is_none() {
            match self.corrector_of(b) {
                Ok(corrector) => self.correctors[b] = Some(corrector),
                Err(_) if self.give_way() => return self.advance(),
                Err(e) => return Err(e),
            }
        }
        let Some(corrector) = self.correctors[b].as_mut() else { return Ok(None) };
        if self.stage == Stage::Residual {
            if self.sides[b][s].corrections == 0 {
                corrector.restart();
            }
            let exact = corrector.follows_multipliers();
            let (r1, r2) = residual(&self.h, &self.blocks[b], s, &self.sides[b][s], exact, &mut self.scratch);
            corrector.begin(&r1, &r2);
            self.stage = Stage::Correct;
        }
        let before = corrector.iterations();
        let done = corrector.step();
        self.iterations += corrector.iterations().saturating_sub(before);
        let stop = self.iterations >= self.settings.most_iterations;
        if done || stop {
            self.finish_correction(stop);
        }
        let side = &self.sides[b][s];
        let number = self.sides[..b].iter().map(Vec::len).sum::<usize>() + s;
        Ok(Some(Step { side: number, corrections: side.corrections, iterations: self.iterations, change: side.change }))
    }

    /// Adds a finished correction; decides whether another is worth it.
    fn finish_correction(&mut self, stop: bool) {
        let (b, s) = self.at;
        let Some(corrector) = self.correctors[b].as_ref() else { return };
        let (dx, dl) = corrector.correction();
        let finite = dx.iter().all(|v| v.is_finite());
        let allowed = verdict::allowed(self.settings.tolerance, verdict::scale(&self.problem, &self.blocks));
        // A coordinate that is zero beside others has only their size to be judged by.
        let least = 1e-6 * verdict::largest(&self.problem, &self.blocks);
        let (structure, block) = &self.blocks[b];
        let targets = &block.sides[s].targets;
        let side = &mut self.sides[b][s];
        let max = |v: &[f64]| v.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        if finite {
            side.x.iter_mut().zip(dx).for_each(|(x, d)| *x += d);
            side.multipliers.iter_mut().zip(dl).for_each(|(l, d)| *l += d);
        }
        let size = max(&side.x).max(least).max(f64::MIN_POSITIVE);
        let change = if finite { max(dx) / size } else { f64::INFINITY };
        let met = verdict::worst(structure, targets, side) <= allowed;
        let (most, progress) = corrector.patience(met || self.spare.is_some());
        let mut miss = 0.0_f64;
        for r in 0..structure.rows() {
            let soft = structure.give[r] * side.multipliers[r];
            miss = miss.max((targets[r] - structure.apply_row(r, &side.x) + soft).abs() * structure.lengths[r]);
        }
        // The energy of a long curve feels errors far below those of its coefficients.
        let goal = self.settings.tolerance * if self.h.lines.len() == 1 { 1e-4 } else { 1.0 };
        let enough = !self.settings.refine || change <= goal && miss <= 2e-14 * size.max(max(targets));
        let stalled = side.corrections > 0 && change > progress * side.change && miss > progress * side.miss;
        side.corrections += 1;
        let last = side.corrections >= most || !finite || stop;
        let settled = change <= 100.0 * self.settings.tolerance && stalled;
        let settled = met && (change <= self.settings.tolerance || settled);
        if (last || stalled) && !enough && !settled {
            if !stop && self.give_way() {
                return;
            }
            self.converged = false;
        }
        let side = &mut self.sides[b][s];
        side.change = change;
        side.miss = miss;
        self.stage = Stage::Residual;
        if enough || stalled || last {
            if s + 1 < self.sides[b].len() {
                self.at = (b, s + 1);
            } else {
                self.at = (b + 1, 0);
            }
        }
        if stop {
            self.stage = Stage::Finished;
            if let Some(curving) = self.curving.take() {
                self.give_up(&curving.from);
                return;
            }
            // Sides that had no turn are zero.
            self.converged &= self.at.0 >= self.blocks.len();
            self.judge();
            self.judge_curvature();
            self.explain("the iterations allowed did not suffice");
        }
    }

    /// Nothing ends without convergence and without a word.
    fn explain(&mut self, why: &str) {
        if !self.converged && self.notes.len() <= self.known {
            self.notes.push(why.to_owned());
        }
    }

    /// Names of the constraints that take part in redundant rows: what holds one holds the others.
    pub(crate) fn tied(&self) -> BTreeSet<String> {
        self.dropped.tied.iter().map(|c| self.problem.constraints()[*c].id.clone()).collect()
    }

    /// The coefficients so far, coordinate by coordinate; while curvature is being met, those of the last whole step.
    pub fn coefficients(&self) -> Vec<Vec<f64>> {
        match &self.curving {
            Some(curving) => curving.from.clone(),
            None => self.stacked(),
        }
    }

    /// The coefficients of all sides.
    pub(super) fn stacked(&self) -> Vec<Vec<f64>> {
        let n = self.problem.space().len();
        let mut coefficients = vec![vec![0.0; n]; self.problem.coordinates()];
        for ((_, block), sides) in self.blocks.iter().zip(&self.sides) {
            for (side, state) in block.sides.iter().zip(sides) {
                for (i, c) in side.coordinates.iter().enumerate() {
                    coefficients[*c].copy_from_slice(&state.x[i * n..][..n]);
                }
            }
        }
        coefficients
    }

    fn corrector_of(&mut self, b: usize) -> Result<Box<dyn Correct>, SolveError> {
        let structure = self.blocks[b].0.clone();
        let problem = &self.problem;
        let unfit = |why: &'static str| SolveError::Method { method: self.method, why };
        let degenerate = |row: usize| {
            let constraint = self.blocks[b].1.sides[0].constraints[row];
            SolveError::Degenerate { id: problem.constraints()[constraint].id.clone() }
        };
        let (space, energy, map) = (problem.space(), problem.energy(), problem.stiffness());
        let most = self.settings.most_iterations;
        let green: Box<dyn Green> = match self.method {
            Method::Spectral => {
                Box::new(Spectral::new(&self.h).ok_or_else(|| unfit("it needs mirrored or periodic axes"))?)
            }
            Method::Banded => {
                if let Some(banded) = Banded::new(&self.h, structure.clone(), energy.free_degree()) {
                    return Ok(Box::new(banded));
                }
                let green = BandGreen::new(&self.h, energy.free_degree());
                Box::new(green.ok_or_else(|| unfit("it is for curves"))?)
            }
            Method::Cholesky => {
                let solver = SparseSolver::new(&self.h, structure, energy.free_degree());
                let why = "weights are too large beside the energy, which is little on a long domain";
                return Ok(Box::new(solver.ok_or_else(|| unfit(why))?));
            }
            Method::Multigrid if structure.rows() <= auto::CYCLES || space.is_curve() => {
                let green = CycleGreen::new(space, energy, map, &self.h);
                Box::new(green.ok_or_else(|| unfit("the spans do not halve often enough"))?)
            }
            Method::Multigrid => {
                let solver = Multigrid::new(space, energy, map, &self.h, structure, 1e-3, most);
                return Ok(Box::new(solver.ok_or_else(|| unfit("the spans do not halve often enough"))?));
            }
            Method::ThesisWavelet | Method::ThesisBspline => {
                let basis = (self.method == Method::ThesisWavelet)
                    .then(|| WaveletGreen::new(space, energy, &self.h, self.settings.scaling))
                    .map(|basis| basis.ok_or_else(|| unfit("the axes have no common pyramid")))
                    .transpose()?;
                let tolerance = self.settings.tolerance * 1e-3;
                let (iteration, explicit) = (self.settings.iteration, self.settings.explicit);
                let solver = Squared::new(self.h.clone(), structure, basis, (iteration, explicit), tolerance, most);
                return Ok(Box::new(solver.ok_or_else(|| unfit("explicit matrices are for up to 5000 unknowns"))?));
            }
            Method::Wavelet => {
                let green = WaveletGreen::new(space, energy, &self.h, self.settings.scaling);
                Box::new(green.ok_or_else(|| unfit("the axes have no common pyramid"))?)
            }
            _ => Box::new(
                Bpx::new(space, energy, map, &self.h)
                    .ok_or_else(|| unfit("the spans do not halve often enough: use cholesky"))?,
            ),
        };
        let null = Arc::new(self.h.null_space(problem.energy().free_degree()));
        let inner = self.settings.tolerance.max(1e-12) * 0.1;
        let projected = Projected::new(self.h.clone(), structure, green, null, inner, most);
        projected.map(|p| Box::new(p) as Box<dyn Correct>).map_err(degenerate)
    }

    /// The solution so far.
    pub fn solution(&self) -> Solution {
        let problem = &self.problem;
        let coefficients = self.coefficients();
        let mut residuals = Residual::all(problem, &problem.rows(), &coefficients);
        residuals.extend(curvature::misses(problem, &coefficients));
        let asked = self.blocks.iter().any(|b| b.0.rows() > 0);
        let begun = !asked || self.newton > 0 || self.sides.iter().flatten().any(|s| s.corrections > 0);
        let solution = Solution::new(
            problem.space().clone(),
            coefficients,
            self.h.clone(),
            residuals,
            (self.method, self.why),
            self.iterations,
            self.converged && self.stage == Stage::Finished,
            self.notes.clone(),
        );
        solution.begun_if(begun)
    }
}

pub(crate) fn fresh_sides(blocks: &[Block]) -> Vec<Vec<SideState>> {
    let of = |b: &Block| {
        let one = |_| SideState {
            x: vec![0.0; b.structure.unknowns()],
            multipliers: vec![0.0; b.structure.rows()],
            change: f64::INFINITY,
            miss: f64::INFINITY,
            ..SideState::default()
        };
        b.sides.iter().map(one).collect()
    };
    blocks.iter().map(of).collect()
}
