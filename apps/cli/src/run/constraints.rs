//! The constraints of a document as the library takes them.

use super::design::space;
use ondelette_io::shape::{ConstraintSpec, Document};
use ondelette_modeling::constraint::{Constraint, Demand, along};
use ondelette_modeling::system::Space;

/// The constraints of a document, and the coordinates that they speak of.
pub(super) fn constraints(document: &Document) -> Result<(Vec<Constraint>, usize), String> {
    if document.constraints.is_empty() {
        return Err("there are no constraints: nothing holds the shape anywhere".to_owned());
    }
    let space = space(&document.axes);
    let mut constraints = Vec::new();
    for spec in &document.constraints {
        constraints.extend(demands(spec, &space)?);
    }
    Ok((constraints, coordinates(&document.constraints)?))
}

/// A constraint that asks for nothing.
fn bare() -> ConstraintSpec {
    ConstraintSpec {
        id: None,
        at: Vec::new(),
        curve: None,
        image: None,
        position: None,
        tangent: None,
        ds: None,
        dt: None,
        normal: None,
        curvature: None,
        weight: None,
    }
}

/// Number of coordinates that the constraints speak of.
fn coordinates(constraints: &[ConstraintSpec]) -> Result<usize, String> {
    let mut found: Option<(usize, &str)> = None;
    for spec in constraints {
        let id = spec.id.as_deref().unwrap_or_default();
        let lengths = [&spec.position, &spec.tangent, &spec.ds, &spec.dt].into_iter().flatten().map(Vec::len);
        let rail = spec.curve.as_ref().and_then(|c| c.position.first()).map(Vec::len);
        let others = [spec.normal.as_ref().map(Vec::len), spec.image.as_ref().map(|i| i.factors.len()), rail];
        for n in lengths.chain(others.into_iter().flatten()) {
            match found {
                Some((m, first)) if m != n => {
                    return Err(format!("constraint {id} has {n} coordinates, constraint {first} {m}"));
                }
                _ => found = Some((n, id)),
            }
        }
    }
    found.map(|f| f.0).ok_or_else(|| "no constraint says where the shape is: give positions".to_owned())
}

/// The demands of one constraint; the first bears its id, others say what they are.
fn demands(spec: &ConstraintSpec, space: &Space) -> Result<Vec<Constraint>, String> {
    let id = spec.id.clone().unwrap_or_default();
    if let Some(w) = spec.weight.filter(|w| *w > 0.0 && !(1.0 / w).is_finite()) {
        return Err(format!("constraint {id}: weight {w:e} is as good as none: leave the constraint out"));
    }
    if let Some(rail) = &spec.curve {
        let bare = ConstraintSpec { id: spec.id.clone(), curve: spec.curve.clone(), weight: spec.weight, ..bare() };
        if bare != *spec {
            return Err(format!("constraint {id}: a curve stands alone, with its own at and position"));
        }
        let mut sampled = along(&id, space, &rail.at, &rail.position, rail.samples).map_err(|e| e.to_string())?;
        sampled.iter_mut().for_each(|c| c.weight = spec.weight);
        return Ok(sampled);
    }
    if spec.at.is_empty() {
        return Err(format!("constraint {id}: at is missing: a parameter, or [s, t]"));
    }
    let mut found: Vec<(&str, Demand)> = Vec::new();
    if let Some(p) = &spec.position {
        found.push(("position", Demand::Position(p.clone())));
    }
    let derivatives = [("tangent", &spec.tangent, 0), ("ds", &spec.ds, 0), ("dt", &spec.dt, 1)];
    for (name, value, axis) in derivatives {
        if let Some(d) = value {
            let fits = if name == "tangent" { spec.at.len() == 1 } else { spec.at.len() == 2 };
            if !fits {
                return Err(format!(
                    "constraint {id}: {name} is for {}",
                    if name == "tangent" { "curves" } else { "surfaces" }
                ));
            }
            found.push((name, Demand::Derivative(axis, d.clone())));
        }
    }
    if let Some(n) = &spec.normal {
        found.push(("normal", Demand::Normal(n.clone())));
    }
    if let Some(k) = spec.curvature {
        found.push(("curvature", Demand::Curvature(k)));
    }
    if let Some(i) = &spec.image {
        let offset = i.offset.clone().unwrap_or_else(|| vec![0.0; i.factors.len()]);
        found.push(("image", Demand::Image { of: i.of.clone(), factors: i.factors.clone(), offset }));
    }
    if found.is_empty() {
        return Err(format!(
            "constraint {id} asks for nothing: position, tangent, ds, dt, normal, curvature, curve or image"
        ));
    }
    let single = found.len() == 1;
    let name = |i: usize, what: &str| if single || i == 0 { id.clone() } else { format!("{id}.{what}") };
    let make = |(i, (what, demand)): (usize, (&str, Demand))| {
        let mut c = Constraint::new(name(i, what), &spec.at, demand);
        c.weight = spec.weight;
        c
    };
    Ok(found.into_iter().enumerate().map(make).collect())
}
