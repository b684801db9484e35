//! `ondelette edit`: handles of any level of a shape.

use super::shape_input::{self, Loaded};
use super::shape_output::Outgoing;
use super::{Outcome, Refusal};
use crate::plan::shape::EditPlan;
use ondelette_io::shape::{Document, Geometry};
use ondelette_modeling::edit::{CurveLadder, EditError, Editor, Ladder, Pull, SurfaceLadder, least_squares};
use std::fmt::Display;

pub(crate) fn run(plan: &EditPlan) -> Result<Outcome, Refusal> {
    let Loaded { mut document, splines, place } = shape_input::read(&plan.shape, plan.part)?;
    plan.out.check_kind(matches!(document.geometry, Geometry::Curve(_)))?;
    let (geometry, control) = match &document.geometry {
        Geometry::Curve(c) => {
            let ladder = CurveLadder::new(c).map_err(said)?;
            let (curve, control) = edited(plan, ladder, c.dim(), 1, &mut document.edit_levels)?;
            (Geometry::Curve(curve), Some(control))
        }
        Geometry::Surface(s) => {
            let ladder = SurfaceLadder::new(s).map_err(said)?;
            (Geometry::Surface(edited(plan, ladder, s.dim(), 2, &mut document.edit_levels)?.0), None)
        }
        Geometry::None => return Err(Refusal::new("there is no shape to edit")),
    };
    let document = Document { geometry, ..document };
    let around = (!splines.curves.is_empty() || !splines.surfaces.is_empty()).then_some((&splines, place));
    Outgoing { document: &document, around, marks: Vec::new(), control, grid: None }.write(&plan.out)?;
    Ok(Outcome::Done)
}

fn said(e: impl Display) -> Refusal {
    Refusal::new(e.to_string())
}

/// All edits of the plan on one ladder; notes the do level and the see level. The shape, and the control points that
/// were at hand.
fn edited<L: Ladder>(
    plan: &EditPlan,
    ladder: L,
    dim: usize,
    axes: usize,
    levels: &mut Option<[f64; 2]>,
) -> Result<(L::Shape, Vec<[f64; 3]>), Refusal> {
    let mut editor = Editor::new(ladder);
    let finest = editor.levels() as f64;
    let level = plan.level.unwrap_or(finest);
    if level > finest {
        return Err(said(EditError::Level { level, levels: editor.levels() }));
    }
    for (index, by, pair) in &plan.moves {
        if *pair != (axes == 2) {
            let want = if axes == 2 { "i,j" } else { "i" };
            return Err(Refusal::new(format!("--move {}: an index of this shape is {want}", index[0])));
        }
        editor.drag_at(level, *index, coordinates("--move", by, dim)?, plan.detail).map_err(said)?;
    }
    if !plan.pulls.is_empty() {
        if level.fract() != 0.0 {
            return Err(Refusal::new(format!("--pull works on whole levels, not on {level}")));
        }
        let mut pulls = Vec::new();
        for (at, to) in &plan.pulls {
            if at.len() != axes {
                return Err(Refusal::new(format!("--pull: {} parameters, this shape has {axes}", at.len())));
            }
            if to.len() != dim {
                return Err(Refusal::new(format!("--pull: {} coordinates, this shape has {dim}", to.len())));
            }
            let place = std::array::from_fn(|k| at.get(k).copied().unwrap_or(0.0));
            let target = std::array::from_fn(|k| to.get(k).copied().flatten());
            pulls.push(Pull { at: place, orders: [0, 0], target });
        }
        least_squares(&mut editor, level as usize, &pulls).map_err(said)?;
    }
    let see = plan.see.unwrap_or(finest);
    *levels = Some([level, see]);
    let control = editor.fractional(level).map_err(said)?.1;
    Ok((editor.seen_at(see).map_err(said)?, control))
}

/// As many numbers as the shape has coordinates; further ones must be 0.
fn coordinates(flag: &str, given: &[f64], dim: usize) -> Result<[f64; 3], Refusal> {
    if given.len() > 3 || given.len() < dim || given[dim..].iter().any(|x| *x != 0.0) {
        return Err(Refusal::new(format!("{flag}: {} numbers, this shape has {dim} coordinates", given.len())));
    }
    Ok(std::array::from_fn(|k| if k < dim { given[k] } else { 0.0 }))
}
