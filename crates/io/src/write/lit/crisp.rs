//! Triangles for a leaf in a penumbra: cells halved where colours between their corners would be seen to be wrong, with
//! direct light gathered anew at every corner. Where cells of different sizes meet, the larger takes over the corners
//! of the smaller, so that no seam opens.

use super::{Leaf, Painted};
use ondelette_compress::Cell;
use ondelette_radiosity::probe::Prober;
use ondelette_wavelet::cell::CellShape;
use std::collections::{BTreeMap, BTreeSet};

/// Shortest edge of a cell, as a share of the scene's diagonal.
const FINEST: f64 = 1.0 / 2048.0;
/// Cells longer than this are halved unseen: a thin shadow could pass between their corners.
const COARSEST: f64 = 1.0 / 128.0;
/// Most halvings of a leaf.
const DEEPEST: u32 = 10;
/// Parts of a leaf's edge in which corners, middles and centres of all cells are whole numbers.
const GRID: f64 = 3.0 * (1 << (DEEPEST + 1)) as f64;
/// Difference of colours that is seen, in square roots of displayed light: about three of 256 steps.
const SEEN: f32 = 0.012;
/// Corners are looked at from this much inside the leaf: an edge of a surface lies in the plane of the next one.
const INSET: f64 = 1e-4;

/// A place in a leaf, in parts of its edge.
type Place = [i32; 2];

fn place(x: [f64; 2]) -> Place {
    x.map(|x| (x * GRID).round() as i32)
}

fn corners(shape: CellShape) -> &'static [[f64; 2]] {
    match shape {
        CellShape::Triangle => &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
        _ => &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
    }
}

fn mean(places: &[Place]) -> Place {
    let n = places.len() as i32;
    [0, 1].map(|c| places.iter().map(|p| p[c]).sum::<i32>() / n)
}

struct Cutter<'a> {
    leaf: &'a Leaf<'a>,
    prober: &'a Prober<'a>,
    /// Halvings that every cell gets, and that a cell may get.
    depths: [u32; 2],
    colors: BTreeMap<Place, [f32; 3]>,
    cells: Vec<Cell>,
}

pub(super) fn paint(leaf: &Leaf<'_>, prober: &Prober<'_>) -> Painted {
    let shape = leaf.node.cell.shape;
    let at = |x: [f64; 2]| leaf.solution.point(leaf.side, leaf.node.cell.to_root(x));
    let around = corners(shape);
    let edge = |k: usize| at(around[k]).distance(at(around[(k + 1) % around.len()]));
    let longest = (0..around.len()).map(edge).fold(0.0, f64::max) / leaf.solution.scene().diagonal();
    let halvings = |length: f64| (longest / length).log2().ceil().clamp(1.0, f64::from(DEEPEST)) as u32;
    let depths = [halvings(COARSEST), halvings(FINEST)];
    let mut cutter = Cutter { leaf, prober, depths, colors: BTreeMap::new(), cells: Vec::new() };
    cutter.cut(Cell::root(0, shape));
    cutter.into_triangles()
}

impl Cutter<'_> {
    /// The displayed colour at a place.
    fn color(&mut self, at: Place) -> [f32; 3] {
        if let Some(color) = self.colors.get(&at) {
            return *color;
        }
        let around = corners(self.leaf.node.cell.shape);
        let centre = [0, 1].map(|c| around.iter().map(|x| x[c]).sum::<f64>() / around.len() as f64);
        let x = [0, 1].map(|c| centre[c] + (1.0 - INSET) * (f64::from(at[c]) / GRID - centre[c]));
        let color = self.leaf.color(self.prober.irradiance_on(self.leaf.id, x));
        self.colors.insert(at, color);
        color
    }

    fn cut(&mut self, cell: Cell) {
        let [least, most] = self.depths;
        if cell.depth < least || (cell.depth < most && self.is_uneven(&cell)) {
            (0..cell.shape.arity()).for_each(|c| self.cut(cell.child(c)));
        } else {
            self.cells.push(cell);
        }
    }

    /// Whether a colour at the middle of an edge, or of the cell, is seen to differ from what its corners say.
    fn is_uneven(&mut self, cell: &Cell) -> bool {
        let around: Vec<Place> = corners(cell.shape).iter().map(|x| place(cell.to_root(*x))).collect();
        let n = around.len();
        let mut groups: Vec<Vec<Place>> = (0..n).map(|k| vec![around[k], around[(k + 1) % n]]).collect();
        groups.push(around);
        groups.iter().any(|group| {
            let there = self.color(mean(group));
            let between = group.iter().fold([0.0; 3], |sum: [f32; 3], p| {
                let color = self.color(*p);
                [0, 1, 2].map(|c| sum[c] + color[c] / group.len() as f32)
            });
            (0..3).any(|c| (there[c].sqrt() - between[c].sqrt()).abs() > SEEN)
        })
    }

    /// A fan around the middle of every cell that has smaller neighbours; plain cells else.
    fn into_triangles(mut self) -> Painted {
        let cells = std::mem::take(&mut self.cells);
        let outlines: Vec<Vec<Place>> =
            cells.iter().map(|cell| corners(cell.shape).iter().map(|x| place(cell.to_root(*x))).collect()).collect();
        let known: BTreeSet<Place> = outlines.iter().flatten().copied().collect();
        let mut painted = Painted::default();
        let mut numbers: BTreeMap<Place, u32> = BTreeMap::new();
        for outline in outlines {
            let n = outline.len();
            let mut rim = Vec::with_capacity(n);
            (0..n).for_each(|k| follow(&known, outline[k], outline[(k + 1) % n], &mut rim));
            let is_plain = rim.len() == n;
            let middle = mean(&outline);
            let mut vertex = |at: Place| {
                *numbers.entry(at).or_insert_with(|| {
                    painted.positions.push(self.leaf.position(at.map(|p| f64::from(p) / GRID)));
                    painted.colors.push(self.color(at));
                    painted.positions.len() as u32 - 1
                })
            };
            let rim: Vec<u32> = rim.into_iter().map(&mut vertex).collect();
            if is_plain {
                (1..n - 1).for_each(|k| painted.indices.extend([rim[0], rim[k], rim[k + 1]]));
            } else {
                let middle = vertex(middle);
                (0..rim.len()).for_each(|k| painted.indices.extend([middle, rim[k], rim[(k + 1) % rim.len()]]));
            }
        }
        painted
    }
}

/// Appends the corners from `a` on to, but without, `b`.
fn follow(known: &BTreeSet<Place>, a: Place, b: Place, rim: &mut Vec<Place>) {
    let middle = mean(&[a, b]);
    let halves = (0..2).all(|c| (a[c] + b[c]) % 2 == 0) && middle != a;
    if halves && known.contains(&middle) {
        follow(known, a, middle, rim);
        follow(known, middle, b, rim);
    } else {
        rim.push(a);
    }
}
