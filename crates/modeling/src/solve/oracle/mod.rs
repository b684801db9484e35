//! The adaptive oracle (thesis 7.5): solves in as few wavelets as an energy bound allows.
//!
//! Top-down from the coarsest B-splines. A round solves on the active functions; then functions of negligible
//! coefficient are put to sleep (dormant), and functions that would gain energy wake: near constraints that the active
//! functions cannot meet, and children and neighbours of active functions of some size, the most gainful first. The
//! thesis wakes all children of large coefficients; here the gain of a function decides, the squared residual against
//! it (of unit energy), which is what it would save alone. When the gains promise less than the bound, all dormant
//! functions are asked once more (revival). At last the smallest coefficients are dropped as far as the bound allows.
//!
//! It cannot cycle: a function that was put to sleep twice is never put to sleep again, so every function wakes at most
//! three times, and every round wakes or drops something or is the last of its phase.

mod active;
mod cover;
mod hierarchy;
mod least;
mod offset;
mod values;
mod wake;

use super::dropped::notes;
use super::method::Method;
use super::refine::SolveError;
use super::solution::{Residual, Solution};
use crate::constraint::Demand;
use crate::energy::Operator;
use crate::system::Problem;
use active::{Active, Gains, Saved, Solved};
use hierarchy::{Function, Hierarchy};
use least::Least;
use ondelette_wavelet::Boundary;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// What a round did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Round {
    /// Active functions of a coordinate.
    pub active: usize,
    /// B-splines that the active functions are made of (thesis 7.6).
    pub cover: usize,
    /// Energy of the solution, in domain units, with that of soft constraints.
    pub energy: f64,
    /// Estimated energy above that of all functions together; not known (infinite) while constraints are unmet and in
    /// rounds that drop functions.
    pub excess: f64,
    /// Constraint rows that the active functions cannot meet yet.
    pub unmet: usize,
    /// Iterations so far.
    pub iterations: usize,
    /// A number for the state of the oracle: the active set and all marks. No state comes twice.
    pub state: u64,
}

/// The oracle of one problem, stepped by its caller: between rounds its solution is valid, if unfinished.
///
/// ```
/// use ondelette_modeling::constraint::{Constraint, Demand};
/// use ondelette_modeling::energy::Energy;
/// use ondelette_modeling::solve::Oracle;
/// use ondelette_modeling::system::{Problem, Space};
/// use ondelette_modeling::Axis;
/// use ondelette_wavelet::Boundary;
/// let axis = Axis::new(Boundary::Mirrored, 256, [0.0, 1.0])?;
/// let point = |t: f64, y: f64| Constraint::new(format!("at {t}"), &[t], Demand::Position(vec![Some(y)]));
/// let points = vec![point(0.0, 0.0), point(0.4, 1.0), point(1.0, 0.5)];
/// let problem = Problem::new(Space::curve(axis), 1, Energy::BEND, None, points)?;
/// let solution = Oracle::new(problem, 1e-3)?.run()?;
/// assert!(solution.active().is_some_and(|n| n < 60));
/// assert!(solution.residuals().iter().all(|r| r.miss.abs() < 1e-10));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Oracle {
    problem: Problem,
    h: Arc<Operator>,
    notes: Vec<String>,
    active: Active,
    /// What was taken off each coordinate's targets.
    means: Vec<f64>,
    bound: f64,
    phase: Phase,
    /// Functions that were put to sleep: how often, and whether they sleep now.
    asleep: BTreeMap<Function, (u8, bool)>,
    last: Solved,
    excess: f64,
    /// The least energy, where it must be known, and how much closer iterations must come than they need elsewhere.
    least: Option<Least>,
    /// Its shape, which stands in where rounding keeps the active functions from coming near it.
    full: Option<Solution>,
    instead: bool,
    share: f64,
    converged: bool,
}

enum Phase {
    Grow,
    Drop(Box<Dropping>),
    Done,
}

/// Dropping by bisection.
struct Dropping {
    /// What is kept if nothing more can be dropped, and its solution.
    kept: Saved,
    solved: Solved,
    /// The functions that may go, smallest coefficients first.
    order: Vec<Function>,
    /// How many of them are dispensable; how many are not; how many are tried next.
    good: usize,
    bad: usize,
    next: usize,
    trials: usize,
    /// Energy and excess at the end of growth.
    grown: (f64, f64),
    /// The energy that may not be passed.
    most: f64,
}

/// Energy above the optimum, over the sum of the gains: measured on random problems; see the tests.
const REACH: f64 = 4.0;
/// Share of the bound at which growth ends; the rest is for dropping.
const GROWTH: f64 = 0.2;
/// Share of what is left of the bound that dropping may use.
const MARGIN: f64 = 0.9;
/// Share of the gains that a round takes.
const BULK: f64 = 0.8;
/// Iterations of the first round, which has no energy to go by, and of any other.
const ITERATIONS: [usize; 2] = [100, 5000];
/// Goals a solution may have, one after the other.
const GOALS: usize = 4;
/// The closest that iterations come, as a share of what is needed for square cells.
const CLOSEST: f64 = 1e-8;
/// Share of the bound that iterations may leave.
const SETTLED: f64 = 0.1;
/// Energies below the least by more than this share of the bound are not to be trusted.
const BELOW: f64 = 0.01;
/// Control points a constraint from which on the oracle is faster than all wavelets, without open axes and with one:
/// `cargo bench --bench oracle`.
const PAYS: [f64; 2] = [3000.0, 100.0];
/// Energies below this share of what rounding may make of them are zero.
const NOTHING: f64 = 1e-8;
/// Trials of dropping.
const TRIALS: usize = 6;

impl Oracle {
    /// Prepares an oracle that ends when the energy is within `bound` times itself of the least (an estimate from the
    /// gains of the next functions, not a proof). Only mirrored, periodic or open axes whose spans halve often enough,
    /// uniform stiffness, no curvature.
    ///
    /// # Errors
    /// [`SolveError`]; [`SolveError::Tolerance`] for bounds outside 1e-12 to 1.
    pub fn new(problem: Problem, bound: f64) -> Result<Oracle, SolveError> {
        if !(1e-12..=1.0).contains(&bound) {
            return Err(SolveError::Tolerance(bound));
        }
        let unfit = |why| SolveError::Method { method: Method::Wavelet, why };
        if problem.stiffness().is_some_and(|s| !s.is_uniform()) {
            return Err(unfit("an adaptive set of wavelets needs uniform stiffness"));
        }
        if problem.constraints().iter().any(|c| matches!(c.demand, Demand::Curvature(_))) {
            return Err(unfit("an adaptive set of wavelets takes no curvature constraints"));
        }
        let (mut blocks, redundant) = problem.blocks(problem.rows())?;
        let means = offset::take_off(&mut blocks, problem.coordinates());
        let h = Arc::new(Operator::new(problem.space(), problem.energy(), None));
        let none = || unfit("the axes have no common pyramid");
        let hierarchy = Hierarchy::new(problem.space(), problem.energy(), &h).ok_or_else(none)?;
        let notes = notes(&problem, &redundant);
        let active = Active::new(&problem, hierarchy, blocks).ok_or_else(none)?;
        Ok(Oracle {
            problem,
            h,
            notes,
            active,
            means,
            bound,
            phase: Phase::Grow,
            asleep: BTreeMap::new(),
            last: Solved::default(),
            excess: f64::INFINITY,
            least: None,
            full: None,
            instead: false,
            share: 1.0,
            converged: false,
        })
    }

    /// True where the oracle is expected to be faster than all wavelets together to a tolerance of 1e-8: surfaces with
    /// at least 3000 control points a constraint row of a coordinate, 100 where an axis is open; measured from 32 to
    /// 512 spans. Elsewhere it only reduces data. Curves never: their wavelets are few; nor surfaces whose cells are
    /// far from square: there the least energy is found in full, to compare with.
    pub fn pays(problem: &Problem) -> bool {
        let rows = problem.rows().len() as f64 / problem.coordinates() as f64;
        let open = problem.space().axes().iter().any(|a| a.boundary() == Boundary::Open);
        let square = least::cells_are_square(problem.space());
        square && !problem.space().is_curve() && rows * PAYS[usize::from(open)] <= problem.space().len() as f64
    }

    /// Does one round; `None` when there is nothing left to do.
    ///
    /// # Errors
    /// [`SolveError::Degenerate`]: rows that not even all functions tell apart.
    pub fn step(&mut self) -> Result<Option<Round>, SolveError> {
        match std::mem::replace(&mut self.phase, Phase::Done) {
            Phase::Grow => self.grow()?,
            Phase::Drop(dropping) => self.drop(dropping)?,
            Phase::Done => return Ok(None),
        }
        Ok(Some(Round {
            active: self.active.functions.len(),
            cover: self.active.cover,
            energy: self.last.energy,
            excess: self.excess,
            unmet: self.last.unmet,
            iterations: self.active.iterations,
            state: self.state(),
        }))
    }

    /// Steps to the end.
    ///
    /// # Errors
    /// As [`Oracle::step`].
    pub fn run(mut self) -> Result<Solution, SolveError> {
        while self.step()?.is_some() {}
        Ok(self.solution())
    }

    /// Solves on the active functions to an energy error of about `share` of the bound.
    fn solve(&mut self, share: f64) -> Result<(), SolveError> {
        let known = |energy: f64| energy > 0.0 && energy.is_finite();
        if !known(self.last.energy) {
            let first = self.active.solve(f64::MIN_POSITIVE, ITERATIONS[0]);
            self.last = first.map_err(|constraint| self.degenerate(constraint))?;
        }
        // The energy, and with it the goal, is not known before.
        for _ in 0..GOALS {
            let goal = share * self.share * self.allowed();
            if !(goal > 0.0 && goal.is_finite()) {
                break;
            }
            self.last = self.active.solve(goal, ITERATIONS[1]).map_err(|constraint| self.degenerate(constraint))?;
            if self.is_settled() {
                break;
            }
        }
        Ok(())
    }

    /// The energy that the solution may have above the least; rounding at least.
    fn allowed(&self) -> f64 {
        (self.bound * self.last.energy).max(self.noise())
    }

    /// What rounding makes of energies this size; what is far from the least shape is no measure of it.
    fn noise(&self) -> f64 {
        let most = self.least.map_or(f64::INFINITY, |l| self.active.rounding(l.energy, l.height));
        self.last.noise.min(most)
    }

    /// The energy of what there is: where the least is known, as it will be written.
    fn energy(&self) -> f64 {
        if self.least.is_some() { self.written() } else { self.last.energy }
    }

    fn written(&self) -> f64 {
        self.active.written(&self.h, self.problem.coordinates())
    }

    /// The energy above the least that may be promised: rounding is an excuse only for energies that are nothing else.
    fn promised(&self) -> f64 {
        let energy = self.least.map_or(self.last.energy, |l| l.energy);
        if energy <= NOTHING * self.noise() { self.allowed() } else { self.bound * energy }
    }

    /// True where more iterations would change next to nothing.
    fn is_settled(&self) -> bool {
        self.last.left <= SETTLED * self.allowed()
    }

    fn degenerate(&self, constraint: usize) -> SolveError {
        SolveError::Degenerate { id: self.problem.constraints()[constraint].id.clone() }
    }

    /// A round of growth: solve, put to sleep, wake.
    fn grow(&mut self) -> Result<(), SolveError> {
        self.solve(0.01)?;
        self.excess = f64::INFINITY;
        if self.last.unmet > 0 {
            let woken = self.nearby();
            if woken.is_empty() {
                self.notes.push("rows that not even all functions can meet are left out".to_owned());
                self.converged = false;
                return Ok(());
            }
            self.change(&[], woken);
            self.phase = Phase::Grow;
            return Ok(());
        }
        if self.least.is_none() && !least::cells_are_square(self.problem.space()) {
            // Nothing to compare with: the shape meets its rows, but nobody knows how near the least it is.
            match least::energy(&self.problem) {
                Ok((least, full)) => (self.least, self.full) = (Some(least), Some(full)),
                Err(why) => {
                    self.notes.push(why);
                    return Ok(());
                }
            }
        }
        let allowed = self.allowed();
        let squares = self.active.squares();
        let mut gains = self.active.gains(self.candidates(&squares, allowed));
        let sum = |gains: &Gains| gains.functions.iter().map(|g| g.1).sum::<f64>();
        if REACH * sum(&gains) <= GROWTH * allowed {
            let pulls = self.active.pulls(&gains).functions.into_iter();
            gains.functions.extend(pulls.filter(|g| !self.asleep.get(&g.0).is_some_and(|s| s.1)));
        }
        let sum = sum(&gains);
        let mut gains = gains.functions;
        gains.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let energy = self.energy();
        self.excess = self.least.map_or(REACH * sum + self.last.left, |least| energy - least.energy);
        if self.excess.is_nan() {
            self.excess = f64::INFINITY;
        }
        if self.least.is_some() && self.excess > (GROWTH * allowed).max(REACH * sum) && self.share > CLOSEST {
            // Nobody would gain what is left: it is the iteration's.
            self.share *= 0.01;
            return self.grow();
        }
        let small = self.negligible(&squares, 0.01 * allowed);
        if self.excess > GROWTH * allowed {
            let mut left = BULK * sum;
            let few = gains.iter().take_while(|g| {
                let take = left > 0.0;
                left -= g.1;
                take && g.1 > 0.0
            });
            let woken: Vec<Function> = few.map(|g| g.0).collect();
            if !woken.is_empty() {
                self.change(&small, woken);
                self.phase = Phase::Grow;
                return Ok(());
            }
        }
        if self.asleep.values().any(|s| s.1) {
            // Revival: the dormant are asked once more, and who is not wanted stays where it is.
            self.asleep.values_mut().for_each(|s| s.1 = false);
            self.phase = Phase::Grow;
            return Ok(());
        }
        let below = (BELOW * allowed).max(self.noise());
        let promised = self.promised();
        let is_real = energy >= -below && self.last.energy >= -below && self.written() <= energy + promised + below;
        // Less than the least is rounding's, of the one or the other.
        self.converged = is_real && self.excess <= promised;
        self.excess = self.excess.max(0.0);
        if !self.converged
            && let Some(least) = self.least
        {
            self.notes.push("rounding keeps wavelets of such long cells apart: this is the full solution".to_owned());
            (self.instead, self.converged, self.excess, self.last.energy) = (true, true, 0.0, least.energy);
            return Ok(());
        }
        if !self.converged {
            let why = if is_real {
                "the active functions do not come as near to the least energy as was asked"
            } else {
                "rounding has taken the energy of the active functions: ask for a full solution"
            };
            self.notes.push(why.to_owned());
            return Ok(());
        }
        let corner = self.active.corner();
        let mut order: Vec<(f64, Function)> =
            squares.iter().copied().zip(self.active.functions.iter().copied()).skip(corner).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let budget = MARGIN * (promised - self.excess).max(0.0);
        // Coefficients of functions of unit energy: the sum of their squares is about the energy that dropping costs.
        let count = |most: f64| {
            let mut sum = 0.0;
            let within = |o: &&(f64, Function)| {
                sum += o.0;
                sum <= most
            };
            order.iter().take_while(within).count()
        };
        let (next, bad) = (count(0.5 * budget), count(8.0 * budget) + 1);
        self.phase = Phase::Drop(Box::new(Dropping {
            kept: self.active.save(),
            solved: self.last,
            order: order.into_iter().map(|o| o.1).collect(),
            good: 0,
            bad,
            next: next.max(1),
            trials: 0,
            grown: (energy, self.excess),
            most: energy + budget,
        }));
        Ok(())
    }

    /// A trial of dropping; the last one leaves the best set.
    fn drop(&mut self, mut d: Box<Dropping>) -> Result<(), SolveError> {
        let over = d.next <= d.good || d.next >= d.bad || d.next > d.order.len();
        if !over {
            let gone: BTreeSet<Function> = d.order[..d.next].iter().copied().collect();
            let rest = self.active.functions.iter().filter(|f| !gone.contains(f)).copied().collect();
            self.active.replace(rest);
            self.solve(1e-3)?;
            d.trials += 1;
            if self.last.unmet == 0 && self.energy() <= d.most {
                d.good = d.next;
                (d.kept, d.solved) = (self.active.save(), self.last);
            } else {
                d.bad = d.next;
                self.active.restore(d.kept.clone());
                self.last = d.solved;
            }
            d.next = usize::midpoint(d.good, d.bad);
        }
        self.excess = (d.grown.1 + self.energy() - d.grown.0).max(0.0);
        let close = d.bad - d.good <= 1 + d.order.len() / 100;
        if !over && d.trials < TRIALS && !close {
            self.phase = Phase::Drop(d);
        }
        Ok(())
    }

    /// Puts functions to sleep and wakes others.
    fn change(&mut self, sleep: &[Function], wake: Vec<Function>) {
        for f in sleep {
            let marks = self.asleep.entry(*f).or_default();
            *marks = (marks.0 + 1, true);
        }
        for f in &wake {
            if let Some(marks) = self.asleep.get_mut(f) {
                marks.1 = false;
            }
        }
        let gone: BTreeSet<&Function> = sleep.iter().collect();
        let mut functions: Vec<Function> =
            self.active.functions.iter().filter(|f| !gone.contains(f)).copied().chain(wake).collect();
        functions.sort_unstable();
        self.active.replace(functions);
    }

    fn state(&self) -> u64 {
        // FNV-1a over everything that the next round depends on besides the numbers.
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        let mut put = |v: u64| hash = (hash ^ v).wrapping_mul(0x0100_0000_01b3);
        let number = |f: &Function| u64::from(f.rise) << 56 | u64::from(f.s) << 28 | u64::from(f.t);
        self.active.functions.iter().for_each(|f| put(number(f)));
        for (f, marks) in &self.asleep {
            put(number(f));
            put(u64::from(marks.0) * 2 + u64::from(marks.1));
        }
        match &self.phase {
            Phase::Grow => put(1),
            Phase::Drop(d) => [2, d.good as u64, d.bad as u64].into_iter().for_each(put),
            Phase::Done => put(3),
        }
        hash
    }

    /// The solution so far; its coefficients are those of the finest B-splines.
    pub fn solution(&self) -> Solution {
        let problem = &self.problem;
        let mut coefficients = self.active.coefficients(problem.coordinates());
        if let Some(full) = self.full.as_ref().filter(|_| self.instead) {
            return Solution::new(
                problem.space().clone(),
                full.coefficients().to_vec(),
                self.h.clone(),
                full.residuals().to_vec(),
                full.method(),
                self.active.iterations + full.iterations(),
                self.converged,
                self.notes.clone(),
            )
            .adapted(problem.space().len(), self.excess);
        }
        for (x, mean) in coefficients.iter_mut().zip(&self.means).filter(|e| *e.1 != 0.0) {
            x.iter_mut().for_each(|x| *x += mean);
        }
        let residuals = Residual::all(problem, &problem.rows(), &coefficients);
        let why = "asked for: an adaptive set of wavelets";
        Solution::new(
            problem.space().clone(),
            coefficients,
            self.h.clone(),
            residuals,
            (Method::Wavelet, why),
            self.active.iterations,
            self.converged && matches!(self.phase, Phase::Done),
            self.notes.clone(),
        )
        .adapted(self.active.functions.len(), self.excess)
    }
}
