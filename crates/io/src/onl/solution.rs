//! A [`Solution`] as chunks of an `.onl` file, and back: everything that a chunk says is checked before it is used.

use super::kept;
use super::{ChunkFile, ChunkWriter, OnlError};
use crate::write::WriteError;
use bytemuck::{Pod, Zeroable};
use ondelette_compress::links::Link;
use ondelette_compress::{Forest, Links, NodeId};
use ondelette_radiosity::scene::Shape;
use ondelette_radiosity::{Scene, Settings, Solution, Statistics};
use ondelette_wavelet::cell::CellShape;
use std::path::Path;
use std::sync::Arc;

/// Deeper splits are not read: local coordinates end there. The solver stops far above.
const DEEPEST: u32 = 48;

/// A link as stored; its block follows that of the link before.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct LinkRecord {
    receiver: u32,
    shooter: u32,
    orders: [u8; 2],
    masked: u8,
    zero: u8,
    residual: [f32; 4],
    strength: f32,
    roughness: f32,
    unseen: f32,
    spread: f32,
}

/// Writes a solution, finished or not, as the `.onl` file `path`, whole or not at all.
///
/// # Errors
/// As [`crate::write::AtomicFile::create`] and [`crate::write::AtomicFile::commit`].
pub fn write_solution(path: &Path, solution: &Solution) -> Result<(), WriteError> {
    chunks(solution).write(path)
}

/// The bytes of [`write_solution`]'s file: a function of the solution alone, no clock, thread count or path.
///
/// ```
/// use ondelette_io::onl::{ChunkFile, solution_bytes, solution_of};
/// use ondelette_radiosity::{Settings, Solver, scene::samples};
/// let mut solver = Solver::new(samples::facing_squares(1.0), Settings::default())?;
/// while solver.step().is_some() {}
/// let bytes = solution_bytes(&solver.solution());
/// let back = solution_of(&ChunkFile::from_bytes("memory".as_ref(), bytes.clone())?)?;
/// assert!(back.is_finished());
/// assert_eq!(solution_bytes(&back), bytes);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solution_bytes(solution: &Solution) -> Vec<u8> {
    chunks(solution).to_bytes()
}

/// Reads the solution file `path`.
///
/// # Errors
/// As [`ChunkFile::read`] and [`solution_of`].
pub fn read_solution(path: &Path) -> Result<Solution, OnlError> {
    solution_of(&ChunkFile::read(path)?)
}

fn chunks(solution: &Solution) -> ChunkWriter<'_> {
    let forest = solution.forest();
    let links: Vec<LinkRecord> = solution
        .links()
        .as_slice()
        .iter()
        .map(|l| LinkRecord {
            receiver: l.receiver.0,
            shooter: l.shooter.0,
            orders: l.orders,
            masked: u8::from(l.masked),
            zero: 0,
            residual: l.residual,
            strength: l.strength,
            roughness: l.roughness,
            unseen: l.unseen,
            spread: l.spread,
        })
        .collect();
    let mut writer = ChunkWriter::new();
    let encodable = "structures of plain fields and sequences have a postcard encoding";
    writer.add_struct("scene", &**solution.scene()).expect(encodable);
    writer.add_struct("settings", &solution.settings()).expect(encodable);
    writer.add_struct("counts", solution.statistics()).expect(encodable);
    writer.add_bytes("splits", bytemuck::cast_slice(&splits(forest)).to_vec());
    writer.add_array("coeffs", solution.coefficients().as_flattened());
    if solution.lit().iter().any(|l| *l != 1.0) {
        writer.add_array("lit", solution.lit());
    }
    if !solution.errors().is_empty() {
        writer.add_array("errors", solution.errors());
    }
    writer.add_bytes("links", bytemuck::cast_slice(&links).to_vec());
    writer.add_array("blocks", solution.links().blocks());
    if let Some(samples) = solution.kept() {
        kept::add(&mut writer, samples);
    }
    writer
}

/// The nodes that were split, in the order of their children.
fn splits(forest: &Forest) -> Vec<u32> {
    let nodes = forest.nodes();
    let mut parents = Vec::new();
    let mut n = forest.roots().len();
    while let Some(node) = nodes.get(n) {
        parents.push(node.parent.0);
        n += node.cell.shape.arity();
    }
    parents
}

/// The solution that an `.onl` file holds.
///
/// # Errors
/// A chunk is missing, or says what cannot be: the message names it. Checksums do not help against a file made up on
/// purpose, so indices, counts and numbers are all checked; no file makes this function panic.
pub fn solution_of(file: &ChunkFile) -> Result<Solution, OnlError> {
    let scene: Scene = file.structure("scene")?;
    scene.check().map_err(|reason| file.content("scene", reason))?;
    let settings: Settings = file.structure("settings")?;
    let settings = settings.validated().map_err(|e| file.content("settings", e.to_string()))?;
    let statistics: Statistics = file.structure("counts")?;
    if !(statistics.residual >= 0.0 && statistics.estimated_error >= 0.0) {
        return Err(file.content("counts", "the residual or the estimated error is no number from 0 up"));
    }
    let (forest, coefficients) = forest_of(file, &scene, settings)?;
    let links = links_of(file, &forest)?;
    let samples = if kept::has(file) { Some(Arc::new(kept::read(file, &scene, &forest)?)) } else { None };
    let nodes = forest.len();
    let mut solution = Solution::new(Arc::new(scene), settings, forest, links, coefficients, statistics);
    if let Some(samples) = samples {
        solution = solution.with_kept(samples);
    }
    if file.has("errors") {
        let errors = file.finite_f64("errors")?;
        if errors.len() != solution.scene().sides.len() || errors.iter().any(|e| *e < 0.0) {
            return Err(file.content("errors", "not one error from 0 up for each side"));
        }
        solution = solution.with_errors(errors);
    }
    if !file.has("lit") {
        return Ok(solution);
    }
    let lit: Vec<f32> = file.array("lit")?;
    if lit.len() != nodes || !lit.iter().all(|l| (0.0..=1.0).contains(l)) {
        return Err(file.content("lit", format!("not {nodes} shares between 0 and 1")));
    }
    Ok(solution.with_lit(lit))
}

fn forest_of(file: &ChunkFile, scene: &Scene, settings: Settings) -> Result<(Forest, Vec<[f64; 3]>), OnlError> {
    let mut forest = Forest::new(settings.basis.family(), usize::from(settings.basis.order))
        .map_err(|e| file.content("settings", e.to_string()))?;
    for side in &scene.sides {
        let patch = &scene.patches[side.patch as usize];
        let shape = match patch.shape {
            Shape::Parallelogram => CellShape::Square,
            Shape::Triangle => CellShape::Triangle,
        };
        forest.add_root(shape, patch.area());
    }
    let splits: Vec<u32> = file.array("splits")?;
    let coefficients = file.finite_f64("coeffs")?;
    // patches have four children each; counted before the forest grows, so that its size is bounded by the file's
    let nodes = forest.len() + 4 * splits.len();
    if u32::try_from(nodes).is_err() || coefficients.len() != 3 * nodes * forest.stride() {
        let reason = format!(
            "{} numbers do not make 3 x {} coefficients for {nodes} nodes",
            coefficients.len(),
            forest.stride()
        );
        return Err(file.content("coeffs", reason));
    }
    for (k, &parent) in splits.iter().enumerate() {
        let wrong = |what: &str| file.content("splits", format!("split {k}: node {parent} {what}"));
        let id = NodeId(parent);
        if id.index() >= forest.len() {
            return Err(wrong("is not there"));
        }
        if !forest.is_leaf(id) {
            return Err(wrong("was split before"));
        }
        if forest.node(id).cell.depth >= DEEPEST {
            return Err(wrong("is too deep to be split"));
        }
        forest.split(id);
    }
    let coefficients: Vec<[f64; 3]> = bytemuck::cast_slice(&coefficients).to_vec();
    for (n, own) in coefficients.chunks_exact(forest.stride()).enumerate() {
        let id = NodeId(n as u32);
        let used = if forest.is_leaf(id) { forest.basis_of(id).len() } else { 0 };
        if own[used..].iter().flatten().any(|c| c.to_bits() != 0) {
            return Err(file.content("coeffs", format!("node {n} has a coefficient without a function")));
        }
    }
    Ok((forest, coefficients))
}

fn links_of(file: &ChunkFile, forest: &Forest) -> Result<Links, OnlError> {
    let records: Vec<LinkRecord> = file.array("links")?;
    let blocks = file.finite_f64("blocks")?;
    let mut links = Vec::with_capacity(records.len());
    let mut end = 0u64;
    for (k, r) in records.iter().enumerate() {
        let wrong = |what: &str| file.content("links", format!("link {k} {what}"));
        if r.masked > 1 || r.zero != 0 {
            return Err(wrong("has an unknown flag"));
        }
        let measures = r.residual.iter().chain([&r.strength, &r.roughness, &r.unseen, &r.spread]);
        if measures.clone().any(|m| !m.is_finite()) {
            return Err(wrong("has an error measure that is not finite"));
        }
        links.push(Link {
            receiver: NodeId(r.receiver),
            shooter: NodeId(r.shooter),
            orders: r.orders,
            masked: r.masked == 1,
            block: end,
            residual: r.residual,
            strength: r.strength,
            roughness: r.roughness,
            unseen: r.unseen,
            spread: r.spread,
        });
        let mut size = 1;
        for (node, order) in [(r.receiver, r.orders[0]), (r.shooter, r.orders[1])] {
            let (node, order) = (NodeId(node), usize::from(order));
            if node.index() >= forest.len() {
                return Err(wrong(&format!("joins node {} of {}", node.0, forest.len())));
            }
            let basis = forest.basis_of(node);
            if order == 0 || order > basis.order() || (!basis.is_nested() && order != basis.order()) {
                return Err(wrong(&format!("has order {order} in a basis of order {}", basis.order())));
            }
            size *= basis.truncated(order).len() as u64;
        }
        end += size;
    }
    if end != blocks.len() as u64 {
        return Err(file.content("blocks", format!("{} numbers where the links have {end}", blocks.len())));
    }
    Links::restore(forest, links, blocks).map_err(|reason| file.content("links", reason))
}
