//! What a solver's factors are kept for: other targets of the same constraints, and the answer to one of them.

use super::dropped::{Dropped, notes};
use super::refine::{SolveError, Solver, Stage, fresh_sides};
use crate::constraint::Demand;
use crate::system::Problem;

impl Solver {
    /// Takes other targets for the same constraints, keeping all factors; the next steps solve for them.
    ///
    /// # Errors
    /// The problem differs in more than targets ([`SolveError::Method`] says so), or its constraints conflict.
    pub fn retarget(&mut self, problem: Problem) -> Result<(), SolveError> {
        let (blocks, redundant) = problem.blocks(problem.rows())?;
        let same = blocks.len() == self.blocks.len()
            && self.newton == 0
            && blocks.iter().zip(&self.blocks).all(|(new, (old, block))| {
                new.structure.terms == old.terms
                    && new.structure.give == old.give
                    && new.structure.functionals == old.functionals
                    && new.sides.len() == block.sides.len()
            })
            && problem.space() == self.problem.space()
            && problem.energy() == self.problem.energy()
            && problem.stiffness() == self.problem.stiffness();
        if !same {
            return Err(SolveError::Method {
                method: self.method,
                why: "the problem differs in more than its targets",
            });
        }
        self.sides = fresh_sides(&blocks);
        for ((_, old), new) in self.blocks.iter_mut().zip(blocks) {
            *old = new;
        }
        // What was said was about the old targets.
        self.dropped = Dropped::new(&redundant);
        self.notes = notes(&problem, &redundant);
        self.problem = problem;
        self.at = (0, 0);
        self.stage = Stage::Residual;
        self.iterations = 0;
        self.converged = true;
        Ok(())
    }

    /// The Green column of a row: how the coefficients answer to one unit of the target that a constraint has for one
    /// coordinate (a position or a derivative), coordinate by coordinate.
    ///
    /// Costs one solution with the factors at hand. `None` where the constraint has no row of its own there: free
    /// coordinates, redundant rows, normals, images; and where a curvature is asked for.
    ///
    /// # Errors
    /// [`SolveError::Degenerate`]; [`SolveError::Response`] where the method does not reach its tolerance.
    pub fn response(
        &mut self,
        constraint: &str,
        coordinate: usize,
    ) -> Result<Option<Vec<(usize, Vec<f64>)>>, SolveError> {
        let Some(number) = self.problem.constraints().iter().position(|c| c.id == constraint) else { return Ok(None) };
        // Where a curvature is asked for, shapes are not linear in the targets, even if no program was needed.
        if self.problem.constraints().iter().any(|c| matches!(c.demand, Demand::Curvature(_))) {
            return Ok(None);
        }
        let Some((b, s, r)) = self.row_of(number, coordinate) else { return Ok(None) };
        let kept = (self.at, self.stage, self.iterations, self.converged);
        // A spare method, or the limit of iterations, leaves its marks on everything.
        let fresh = self.blocks.iter().map(|(_, block)| fresh_sides(std::slice::from_ref(block)).remove(0)).collect();
        let (sides, said) = (std::mem::replace(&mut self.sides, fresh), self.notes.len());
        let zero = {
            let structure = &self.blocks[b].0;
            let mut targets = vec![0.0; structure.rows()];
            targets[r] = 1.0 / structure.lengths[r];
            targets
        };
        let side = &mut self.blocks[b].1.sides[s];
        let targets = std::mem::replace(&mut side.targets, zero);
        self.at = (b, s);
        self.converged = true;
        self.stage = Stage::Residual;
        // The limit of iterations is one a solution.
        self.iterations = 0;
        let mut outcome = Ok(());
        while self.at == (b, s) && self.stage != Stage::Finished {
            let method = self.method;
            if let Err(e) = self.advance() {
                outcome = Err(e);
                break;
            }
            if self.method != method {
                // The spare begins with the first side, but only this one is wanted.
                self.at = (b, s);
            }
        }
        let column = std::mem::take(&mut self.sides[b][s]);
        let good = self.converged;
        self.sides = sides;
        self.notes.truncate(said);
        self.blocks[b].1.sides[s].targets = targets;
        (self.at, self.stage, self.iterations, self.converged) = kept;
        outcome?;
        if !good {
            return Err(SolveError::Response { id: constraint.to_owned() });
        }
        let n = self.problem.space().len();
        let of = |(i, c): (usize, &usize)| (*c, column.x[i * n..][..n].to_vec());
        Ok(Some(self.blocks[b].1.sides[s].coordinates.iter().enumerate().map(of).collect()))
    }

    /// Block, side and row of the target that a constraint has for a coordinate.
    fn row_of(&self, number: usize, coordinate: usize) -> Option<(usize, usize, usize)> {
        self.blocks.iter().enumerate().find_map(|(b, (structure, block))| {
            block.sides.iter().enumerate().find_map(|(s, side)| {
                let local = side.coordinates.iter().position(|c| *c == coordinate)?;
                let own = |r: &usize| side.constraints[*r] == number && structure.terms[*r][0].0 == local;
                (0..side.constraints.len()).find(own).map(|r| (b, s, r))
            })
        })
    }
}
