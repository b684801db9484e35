//! Links and elements of a solution as two tables.

use super::{Cell, CsvWriter, WriteError};
use ondelette_compress::NodeId;
use ondelette_radiosity::Solution;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

/// Columns of the table of links.
const LINKS: [&str; 13] = [
    "receiver",
    "receiver_side",
    "receiver_object",
    "receiver_level",
    "shooter",
    "shooter_side",
    "shooter_object",
    "shooter_level",
    "receiver_order",
    "shooter_order",
    "strength",
    "visibility",
    "max_residual",
];

/// Columns of the table of elements.
const ELEMENTS: [&str; 14] = [
    "element",
    "side",
    "object",
    "level",
    "area",
    "x",
    "y",
    "z",
    "irradiance_r",
    "irradiance_g",
    "irradiance_b",
    "radiosity_r",
    "radiosity_g",
    "radiosity_b",
];

/// Where [`write_tables`] puts the elements when the links go to `path`: `NAME.csv` -> `NAME.elements.csv`.
///
/// ```
/// let beside = ondelette_io::write::elements_path("out/room.csv".as_ref());
/// assert_eq!(beside, std::path::Path::new("out/room.elements.csv"));
/// ```
pub fn elements_path(path: &Path) -> PathBuf {
    path.with_extension("elements.csv")
}

/// Writes the links as the table `path` and the leaf elements as the table [`elements_path`]`(path)`.
///
/// Links, one a row: nodes, sides, objects and levels at both ends, orders, `strength` (the part of a unit radiosity of
/// the shooter that arrives, as mean irradiance), `visibility` (`full` or `sampled`), the largest residual of its
/// tests.
/// Elements, one a row: node, side, object, level, area in scene units squared, centre, mean irradiance and radiosity.
///
/// # Errors
/// A file cannot be written; until both are complete, neither appears.
pub fn write_tables(path: &Path, solution: &Solution) -> Result<(), WriteError> {
    let (scene, forest) = (solution.scene(), solution.forest());
    let object = |side: usize| {
        let patch = &scene.patches[scene.sides[side].patch as usize];
        scene.objects[patch.provenance.object as usize].name.as_str()
    };
    let mut links = CsvWriter::create(path, &LINKS)?;
    let mut elements = CsvWriter::create(&elements_path(path), &ELEMENTS)?;
    let number = |n: u32| Cell::Number(f64::from(n));
    for link in solution.links().as_slice() {
        let end = |id: NodeId| {
            let cell = &forest.node(id).cell;
            [number(id.0), number(cell.root), Cell::Text(object(cell.root as usize)), number(cell.depth)]
        };
        let [r, s] = [end(link.receiver), end(link.shooter)];
        let residual = link.residual.iter().fold(0.0f32, |most, d| most.max(d.abs()));
        links.row_of(&[
            r[0],
            r[1],
            r[2],
            r[3],
            s[0],
            s[1],
            s[2],
            s[3],
            number(link.orders[0].into()),
            number(link.orders[1].into()),
            Cell::Number(link.strength.into()),
            Cell::Text(if link.masked { "sampled" } else { "full" }),
            Cell::Number(residual.into()),
        ])?;
    }
    let mut outcome = Ok(());
    solution.each_leaf(|leaf, side, area, mean| {
        if outcome.is_err() {
            return;
        }
        let cell = &forest.nodes()[leaf].cell;
        let material = scene.material(scene.sides[side]);
        let radiosity = material.radiance * PI + material.reflectance * mean;
        let centre = solution.point(side, cell.to_root(cell.shape.centre()));
        let head = [Cell::Number(leaf as f64), number(cell.root), Cell::Text(object(side)), number(cell.depth)];
        let numbers = [area, centre.x, centre.y, centre.z].into_iter().chain(mean.0).chain(radiosity.0);
        let row: Vec<Cell<'_>> = head.into_iter().chain(numbers.map(Cell::Number)).collect();
        outcome = elements.row_of(&row);
    });
    outcome?;
    elements.finish()?;
    links.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ondelette_radiosity::{Settings, Solver, scene::samples};

    #[test]
    fn the_tables_hold_every_link_and_every_leaf() {
        let settings = Settings { error: 0.05, ..Settings::default() };
        let mut solver = Solver::new(samples::cube(0.5, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]), settings).unwrap();
        while solver.step().is_some() {}
        let solution = solver.solution();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cube.csv");
        write_tables(&path, &solution).unwrap();
        let rows = |path: &Path| -> Vec<Vec<String>> {
            let text = std::fs::read_to_string(path).unwrap();
            text.lines().map(|l| l.split(',').map(String::from).collect()).collect()
        };
        let links = rows(&path);
        assert_eq!(links[0], LINKS);
        assert_eq!(links.len() - 1, solution.links().len());
        let elements = rows(&elements_path(&path));
        assert_eq!(elements[0], ELEMENTS);
        assert_eq!(elements.len() - 1, solution.forest().leaves());
        let area: f64 = elements[1..].iter().map(|row| row[4].parse::<f64>().unwrap()).sum();
        assert!((area - 6.0).abs() < 1e-12, "{area}");
        assert_eq!(elements[1][2], "o0");
        // the floor emits exitance 1 and reflects half
        let number = |k: usize| elements[1][k].parse::<f64>().unwrap();
        assert!((number(11) - 1.0 - 0.5 * number(8)).abs() < 1e-12);
    }
}
