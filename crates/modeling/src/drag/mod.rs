//! Dragging: every constraint of a solved shape moves by one vector addition.
//!
//! The shape is linear in the targets, so the answer to a unit of one target (a Green column) is kept and added in
//! multiples; no column goes stale while the set of constraints stays. Columns are built when a constraint is grabbed
//! and dropped, oldest first, to stay within a budget. Adding or removing a constraint solves anew, in the order of the
//! constraints: the result has the bits of a cold solution. Undo restores what was saved.

use crate::constraint::{Constraint, Demand};
use crate::solve::{Settings, SolveError, Solver};
use crate::system::Problem;
use std::collections::BTreeSet;

/// A solved shape whose constraints can be dragged.
///
/// ```
/// use ondelette_modeling::constraint::{Constraint, Demand};
/// use ondelette_modeling::drag::Handles;
/// use ondelette_modeling::energy::Energy;
/// use ondelette_modeling::solve::Settings;
/// use ondelette_modeling::system::{Problem, Space};
/// use ondelette_modeling::Axis;
/// use ondelette_wavelet::Boundary;
/// let axis = Axis::new(Boundary::Open, 16, [0.0, 1.0])?;
/// let point = |id: &str, t: f64, y: f64| Constraint::new(id, &[t], Demand::Position(vec![Some(y)]));
/// let points = vec![point("a", 0.0, 0.0), point("b", 0.5, 1.0), point("c", 1.0, 0.0)];
/// let problem = Problem::new(Space::curve(axis), 1, Energy::BEND, None, points)?;
/// let mut handles = Handles::new(problem, Settings::default(), 1 << 20)?;
/// handles.drag("a", &[Some(0.25)])?;
/// assert!((handles.coefficients()[0][0] - 0.25).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Handles {
    problem: Problem,
    settings: Settings,
    solver: Solver,
    coefficients: Vec<Vec<f64>>,
    columns: Vec<Column>,
    budget: usize,
    saved: Vec<(Problem, Vec<Vec<f64>>)>,
    /// Constraints that share redundant rows: their targets are checked at every move.
    tied: BTreeSet<String>,
}

/// Coordinate and coefficients, one a coordinate that answers.
type Response = Vec<(usize, Vec<f64>)>;

struct Column {
    id: String,
    /// The answer to each coordinate's target; `None` where it is free or redundant.
    parts: Vec<Option<Response>>,
}

impl Column {
    fn bytes(&self) -> usize {
        self.parts.iter().flatten().flatten().map(|p| 8 * p.1.len()).sum()
    }
}

/// Why nothing can be dragged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DragError {
    /// No constraint of that name.
    #[error("no constraint is called {0}")]
    Name(String),
    /// A constraint without linear targets, or one that follows from others.
    #[error(
        "constraint {0} has no target to drag: it follows from others, is a normal or an image, or a curvature is set"
    )]
    Fixed(String),
    /// Targets of another shape.
    #[error("constraint {0}: give as many targets as it has coordinates, free ones as before, all finite")]
    Targets(String),
    /// Solving failed.
    #[error(transparent)]
    Solve(#[from] SolveError),
}

impl Handles {
    /// Solves a problem; columns may take up to `budget` bytes (at least one constraint's are always kept).
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn new(problem: Problem, settings: Settings, budget: usize) -> Result<Handles, SolveError> {
        let (solver, coefficients) = cold(&problem, settings)?;
        let tied = solver.tied();
        Ok(Handles { problem, settings, solver, coefficients, columns: Vec::new(), budget, saved: Vec::new(), tied })
    }

    /// The coefficients, coordinate by coordinate.
    pub fn coefficients(&self) -> &[Vec<f64>] {
        &self.coefficients
    }

    /// The problem with its present targets.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }

    /// Bytes that columns take now.
    pub fn bytes(&self) -> usize {
        self.columns.iter().map(Column::bytes).sum()
    }

    /// Builds the columns of a constraint, one solution with the factors at hand a coordinate; nothing where it has
    /// them.
    ///
    /// # Errors
    /// [`DragError`].
    pub fn grab(&mut self, id: &str) -> Result<(), DragError> {
        if self.columns.iter().any(|c| c.id == id) {
            return Ok(());
        }
        let targets = self.targets(id)?;
        let mut parts = Vec::with_capacity(targets.len());
        for (coordinate, target) in targets.iter().enumerate() {
            parts.push(if target.is_some() { self.solver.response(id, coordinate)? } else { None });
        }
        if parts.iter().all(Option::is_none) {
            return Err(DragError::Fixed(id.to_owned()));
        }
        self.columns.push(Column { id: id.to_owned(), parts });
        while self.bytes() > self.budget && self.columns.len() > 1 {
            self.columns.remove(0);
        }
        Ok(())
    }

    /// Moves the target of a constraint: one vector addition a coordinate. Where other constraints follow from it (a
    /// second one at the same place), their targets must still be met, which costs a search for them a move.
    ///
    /// # Errors
    /// [`DragError`]; nothing has changed then.
    pub fn drag(&mut self, id: &str, to: &[Option<f64>]) -> Result<(), DragError> {
        let from = self.targets(id)?;
        let fits = from.len() == to.len()
            && from.iter().zip(to).all(|(a, b)| a.is_some() == b.is_some() && b.is_none_or(f64::is_finite));
        if !fits {
            return Err(DragError::Targets(id.to_owned()));
        }
        self.grab(id)?;
        let Some(column) = self.columns.iter().find(|c| c.id == id) else { return Ok(()) };
        let moves = from.iter().zip(to).map(|(a, b)| b.unwrap_or(0.0) - a.unwrap_or(0.0));
        let moves: Vec<(f64, &Option<Response>)> = moves.zip(&column.parts).filter(|m| m.0 != 0.0).collect();
        if moves.iter().any(|m| m.1.is_none()) {
            return Err(DragError::Fixed(id.to_owned()));
        }
        let constraints = self.problem.constraints().iter().map(|c| {
            let mut c = c.clone();
            if c.id == id {
                match &mut c.demand {
                    Demand::Position(v) | Demand::Derivative(_, v) => *v = to.to_vec(),
                    _ => {}
                }
            }
            c
        });
        let problem = self.posed(constraints.collect())?;
        if self.tied.contains(id) {
            problem.blocks(problem.rows()).map_err(SolveError::Problem)?;
        }
        for (by, part) in moves {
            for (coordinate, response) in part.iter().flatten() {
                self.coefficients[*coordinate].iter_mut().zip(response).for_each(|(x, r)| *x += by * r);
            }
        }
        self.problem = problem;
        Ok(())
    }

    /// Adds a constraint behind the others and solves anew.
    ///
    /// # Errors
    /// [`DragError::Solve`]; nothing has changed then.
    pub fn add(&mut self, constraint: Constraint) -> Result<(), DragError> {
        let mut all = self.problem.constraints().to_vec();
        all.push(constraint);
        self.replace(all)
    }

    /// Removes a constraint and solves anew.
    ///
    /// # Errors
    /// [`DragError::Name`], [`DragError::Solve`]; nothing has changed then.
    pub fn remove(&mut self, id: &str) -> Result<(), DragError> {
        let mut all = self.problem.constraints().to_vec();
        let at = all.iter().position(|c| c.id == id).ok_or_else(|| DragError::Name(id.to_owned()))?;
        all.remove(at);
        self.replace(all)
    }

    /// Saves the present state for [`Handles::undo`].
    pub fn save(&mut self) {
        self.saved.push((self.problem.clone(), self.coefficients.clone()));
    }

    /// Restores the last saved state, bit by bit; false when there is none.
    ///
    /// # Errors
    /// [`DragError::Solve`] if the factors of the saved constraints cannot be made again.
    pub fn undo(&mut self) -> Result<bool, DragError> {
        let Some((problem, coefficients)) = self.saved.pop() else { return Ok(false) };
        let (old, new) = (self.problem.constraints(), problem.constraints());
        if old.len() != new.len() || !old.iter().zip(new).all(|(a, b)| differ_in_targets_only(a, b)) {
            self.solver = Solver::new(problem.clone(), self.settings)?;
            self.columns.clear();
            self.tied = self.solver.tied();
        }
        self.problem = problem;
        self.coefficients = coefficients;
        Ok(true)
    }

    fn targets(&self, id: &str) -> Result<Vec<Option<f64>>, DragError> {
        let constraint = self.problem.constraints().iter().find(|c| c.id == id);
        match &constraint.ok_or_else(|| DragError::Name(id.to_owned()))?.demand {
            Demand::Position(v) | Demand::Derivative(_, v) => Ok(v.clone()),
            _ => Err(DragError::Fixed(id.to_owned())),
        }
    }

    fn posed(&self, constraints: Vec<Constraint>) -> Result<Problem, SolveError> {
        let p = &self.problem;
        Ok(Problem::new(p.space().clone(), p.coordinates(), *p.energy(), p.stiffness().cloned(), constraints)?)
    }

    fn replace(&mut self, constraints: Vec<Constraint>) -> Result<(), DragError> {
        let problem = self.posed(constraints)?;
        (self.solver, self.coefficients) = cold(&problem, self.settings)?;
        self.problem = problem;
        self.columns.clear();
        self.tied = self.solver.tied();
        Ok(())
    }
}

fn cold(problem: &Problem, settings: Settings) -> Result<(Solver, Vec<Vec<f64>>), SolveError> {
    let mut solver = Solver::new(problem.clone(), settings)?;
    solver.finish()?;
    let coefficients = solver.coefficients();
    Ok((solver, coefficients))
}

/// True where factors and columns of one serve the other: the same place, weight and kind of demand, with the same
/// coordinates left free.
fn differ_in_targets_only(a: &Constraint, b: &Constraint) -> bool {
    let free = |v: &[Option<f64>], w: &[Option<f64>]| v.iter().map(Option::is_some).eq(w.iter().map(Option::is_some));
    let demands = match (&a.demand, &b.demand) {
        (Demand::Position(v), Demand::Position(w)) => free(v, w),
        (Demand::Derivative(i, v), Demand::Derivative(k, w)) => i == k && free(v, w),
        (v, w) => v == w,
    };
    demands && a.id == b.id && a.at == b.at && a.weight == b.weight
}
