//! Direct light: each element's light from the lamps, fitted at points where it is known exactly.
//!
//! Where nothing stands between, the light is smooth: interpolation at Gauss points, judged at test points. Where
//! something may, it has edges: least squares over a fine grid, judged by its own residuals.

use super::lamps::{self, Crowded, Lamps, Seen, on_cell};
use super::plan::{FLOOR, MEAN_OF_SCATTER};
use crate::kernel::LightKernel;
use crate::visible::View;
use ondelette_compress::{Cell, Forest};
use ondelette_numerics::{dense, seed};
use ondelette_wavelet::cell::{CellBasis, CellShape};

/// Direct light of one element.
#[derive(Clone, Debug, Default)]
pub(super) struct Fit {
    /// For unit exitance of each group of lamps, `[group][function]`.
    pub(super) coefficients: Vec<f64>,
    /// Mean absolute value of what the functions cannot say, for unit exitance of each group.
    pub(super) misfit: Vec<f32>,
    /// Root mean square scatter of the fit, where rays decided what is seen, likewise.
    pub(super) scatter: Vec<f32>,
    /// Share of the element that is not inside of something.
    pub(super) lit: f64,
    /// Whether lamps stand behind many things, so that its errors are told with a doubt.
    pub(super) crowded: bool,
    /// Work that it took, in rays about: what was cut out exactly, and rays.
    pub(super) work: [f64; 2],
    /// What a fit with more rays need not find out again, if there is anything for rays to find.
    pub(super) known: Option<Known>,
}

/// A fit to samples on a grid, by least squares.
#[derive(Clone, Debug)]
struct Grid {
    points: Vec<[f64; 2]>,
    /// Functions at the points, `[point][function]`.
    values: Vec<f64>,
    /// Samples to coefficients, `[function][point]`.
    matrix: Vec<f64>,
}

impl Grid {
    /// The grid of a basis: four parts an axis, or two a function and axis, with a point at random in each, so that no
    /// pattern of shadows can be in step with it.
    fn of(basis: &CellBasis, key: u64) -> Self {
        let per_axis = (2 * basis.order()).max(4);
        let step = 1.0 / per_axis as f64;
        let mut points = Vec::new();
        let mut place = |corner: [f64; 2], sign: f64| {
            let key = seed::combine(key, points.len() as u64);
            let mut at = [seed::unit(seed::combine(key, 1)), seed::unit(seed::combine(key, 2))];
            if basis.shape() == CellShape::Triangle {
                at = on_cell(CellShape::Triangle, at);
            }
            points.push([0, 1].map(|i| corner[i] + sign * step * at[i]));
        };
        for j in 0..per_axis {
            for i in 0..per_axis {
                if basis.shape() == CellShape::Square {
                    place([i as f64 * step, j as f64 * step], 1.0);
                    continue;
                }
                // small triangles, upright and turned
                if i + j < per_axis {
                    place([i as f64 * step, j as f64 * step], 1.0);
                }
                if i + j + 1 < per_axis {
                    place([(i + 1) as f64 * step, (j + 1) as f64 * step], -1.0);
                }
            }
        }
        let n = basis.len();
        let mut values = vec![0.0; points.len() * n];
        for (x, row) in points.iter().zip(values.chunks_mut(n)) {
            basis.eval(*x, row);
        }
        let mut gram = vec![0.0; n * n];
        for row in values.chunks(n) {
            for i in 0..n {
                for j in 0..n {
                    gram[i * n + j] += row[i] * row[j];
                }
            }
        }
        let inverse = dense::inverse(&gram, n);
        let mut matrix = vec![0.0; n * points.len()];
        for i in 0..n {
            for (q, row) in values.chunks(n).enumerate() {
                matrix[i * points.len() + q] = (0..n).map(|j| inverse[i * n + j] * row[j]).sum();
            }
        }
        Grid { points, values, matrix }
    }

    /// Coefficients of the constant 1.
    fn one(&self) -> impl Iterator<Item = f64> {
        self.matrix.chunks(self.points.len()).map(|row| row.iter().sum())
    }

    /// Samples to coefficients by the `lit` points alone; what they leave open is pulled to their mean.
    fn part(&self, lit: &[bool], n: usize) -> Vec<f64> {
        let count = self.points.len();
        let alive = lit.iter().filter(|l| **l).count();
        let share = 1.0 / alive as f64;
        let mut gram = vec![0.0; n * n];
        for (row, _) in self.values.chunks(n).zip(lit).filter(|(_, lit)| **lit) {
            for i in 0..n {
                for j in 0..n {
                    gram[i * n + j] += share * row[i] * row[j];
                }
            }
        }
        // coefficients of the constant 1, and what it leaves
        let one: Vec<f64> = self.one().collect();
        let constant: Vec<f64> = (0..n).map(|i| (0..n).map(|j| gram[i * n + j] * one[j]).sum()).collect();
        (0..n).for_each(|i| gram[i * n + i] += 1e-4);
        let inverse = dense::inverse(&gram, n);
        let mut matrix = vec![0.0; n * count];
        for i in 0..n {
            let inverse = &inverse[i * n..(i + 1) * n];
            let rest = one[i] - inverse.iter().zip(&constant).map(|(a, b)| a * b).sum::<f64>();
            for (q, row) in self.values.chunks(n).enumerate().filter(|(q, _)| lit[*q]) {
                let fitted = inverse.iter().zip(row).map(|(a, b)| a * b).sum::<f64>();
                matrix[i * count + q] = share * (fitted + rest);
            }
        }
        matrix
    }
}

/// The corners of a cell, a little way in.
fn corners(shape: CellShape) -> &'static [[f64; 2]] {
    match shape {
        CellShape::Triangle => &[[0.01, 0.01], [0.98, 0.01], [0.01, 0.98]],
        _ => &[[0.01, 0.01], [0.99, 0.01], [0.01, 0.99], [0.99, 0.99]],
    }
}

/// The corners of a cell that are not inside of something.
pub(super) fn open_corners(kernel: &LightKernel, cell: &Cell) -> Vec<[f64; 2]> {
    let element = kernel.element(cell);
    let open = |x: &&[f64; 2]| !kernel.is_buried(cell.root as usize, element.point(**x));
    corners(cell.shape).iter().filter(open).copied().collect()
}

/// Share of an element that is not inside of something, from how many of its points and corners are not: where all
/// points are alike, a corner that is not is worth a part of a point.
/// Beside it the corners that are not, if they were looked at.
fn share_of(kernel: &LightKernel, cell: &Cell, open: usize, points: usize) -> (f64, Vec<[f64; 2]>) {
    if open != 0 && open != points {
        return (open as f64 / points as f64, Vec::new());
    }
    let (corner, tips) = (0.25 / points as f64, open_corners(kernel, cell));
    let closed = corners(cell.shape).len() - tips.len();
    (if open == 0 { corner * tips.len() as f64 } else { 1.0 - corner * closed as f64 }, tips)
}

/// A misfit below this many of its standard deviations is taken for scatter.
const SIGNIFICANT: f64 = 1.0;

/// Share of a dark element that a lit corner speaks for: half of what lies between the outer points and the rim.
const BESIDE: f64 = 1.0 / 16.0;

/// Where this share of all light, or less, can come to an element, the lamps left to rays have so much of the rays.
const DIM: f64 = 0.1;

/// What a fit found out on an element, for fits with more rays to go on from.
#[derive(Clone, Debug)]
pub(super) struct Known {
    /// The groups of which it found anything; the others bring nothing.
    groups: Box<[u8]>,
    /// What is cut out exactly, at the points of the grid, and what rays found, of both halves: `[group][point]`.
    found: Box<[[f32; 3]]>,
    /// What is left to rays, how many of a point there were, and what shares are shares of: see [`Seen::whole`].
    crowded: Box<[Crowded]>,
    rays: f64,
    whole: f64,
    /// How often rays were drawn.
    batches: u32,
}

impl Known {
    /// The groups of which anything was found, and what.
    fn found(cut: &[f64], found: &[[f64; 2]], points: usize) -> (Box<[u8]>, Box<[[f32; 3]]>) {
        let both = |k: usize| [cut[k] as f32, found[k][0] as f32, found[k][1] as f32];
        let own = |g: usize| (g * points..(g + 1) * points).map(both);
        let groups: Box<[u8]> =
            (0..cut.len() / points).filter(|g| own(*g).any(|v| v != [0.0; 3])).map(|g| g as u8).collect();
        let found = groups.iter().flat_map(|g| own(usize::from(*g))).collect();
        (groups, found)
    }

    /// What was cut out and found, of so many groups and points.
    fn values(&self, groups: usize, points: usize) -> (Vec<f64>, Vec<[f64; 2]>) {
        let (mut cut, mut found) = (vec![0.0; groups * points], vec![[0.0; 2]; groups * points]);
        for (g, own) in self.groups.iter().zip(self.found.chunks(points)) {
            for (k, [c, a, b]) in (usize::from(*g) * points..).zip(own) {
                (cut[k], found[k]) = (f64::from(*c), [f64::from(*a), f64::from(*b)]);
            }
        }
        (cut, found)
    }

    /// Counted bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.groups) + size_of_val(&*self.found) + size_of_val(&*self.crowded)
    }
}

/// Fits the light of the lamps on a cell; a point sends about `rays` to all lamps together that it may see past many
/// things. `known` is what an earlier fit of the same cell found.
pub(super) fn fit(
    kernel: &LightKernel,
    lamps: &Lamps,
    forest: &Forest,
    cell: &Cell,
    (rays, known): (f64, Option<&Known>),
) -> Fit {
    let groups = lamps.groups.len();
    let basis = forest.basis(cell.shape);
    let n = basis.len();
    let seen = if known.is_some() { Seen::default() } else { lamps.seen_by(kernel, cell) };
    let (crowded, whole) = known.map_or((&seen.crowded[..], seen.whole), |k| (&k.crowded, k.whole));
    let sums = lamps::sums(crowded);
    let element = kernel.element(cell);
    let is_buried = |x: [f64; 2]| kernel.is_buried(cell.root as usize, element.point(x));
    let zero = vec![0.0; groups];
    if known.is_none() && seen.is_empty() {
        let grid = Grid::of(basis, cell.key);
        let points = grid.points.len() as f64;
        let open = grid.points.iter().filter(|x| !is_buried(**x)).count();
        let (lit, _) = share_of(kernel, cell, open, grid.points.len());
        let coefficients = vec![0.0; groups * n];
        return Fit { coefficients, misfit: zero.clone(), scatter: zero, lit, work: [points, 0.0], ..Fit::default() };
    }
    // a fit that goes on knows the lamps at its points only
    let once_more = || known.map(|_| lamps.seen_by(kernel, cell));
    let mut view = View::new(kernel.occluders().tolerance());
    // at points, `[group][point]`
    let exact = |view: &mut View, seen: &Seen, points: &mut dyn Iterator<Item = [f64; 2]>, count: usize| {
        let mut values = vec![0.0; groups * count];
        let mut out = vec![0.0; groups];
        for (q, local) in points.enumerate() {
            let x = element.point(local);
            out.fill(0.0);
            if !kernel.is_covered(cell.root as usize, x) {
                lamps.exact(kernel, view, seen, (x, element.normal()), &mut out);
            }
            (0..groups).for_each(|g| values[g * count + q] = out[g]);
        }
        values
    };
    // what rays find there, of both halves; those that were drawn count, too
    let batch = known.map_or(0, |k| k.batches);
    let by_rays = |points: &[[f64; 2]], rays: f64, before: Option<(f64, Vec<[f64; 2]>)>| {
        let batch = if before.is_some() { batch } else { 0 };
        let (drawn, mut values) = before.unwrap_or_else(|| (0.0, vec![[0.0; 2]; groups * points.len()]));
        let fresh = (rays - drawn).max(0.0);
        if fresh == 0.0 {
            return values;
        }
        values.iter_mut().flatten().for_each(|v| *v *= drawn / rays);
        let mut out = vec![[0.0; 2]; groups];
        for (q, local) in points.iter().enumerate().filter(|_| !crowded.is_empty()) {
            let x = element.point(*local);
            if kernel.is_covered(cell.root as usize, x) {
                continue;
            }
            out.fill([0.0; 2]);
            let key = seed::combine(seed::combine(cell.key, q as u64), u64::from(batch));
            lamps.by_rays(kernel, (crowded, &sums, fresh), (cell.root as usize, x, element.normal()), key, &mut out);
            for (g, out) in out.iter().enumerate() {
                (0..2).for_each(|h| values[g * points.len() + q][h] += out[h] * (fresh / rays));
            }
        }
        values
    };
    let (mut misfit, mut scatter) = (Vec::with_capacity(groups), Vec::with_capacity(groups));
    let mut coefficients = Vec::with_capacity(groups * n);
    if known.is_none() && !seen.is_masked() && !kernel.has_covers(cell.root as usize) {
        let analysis = basis.analysis(basis.order());
        let tests = cell.shape.test_points();
        let fitted = analysis.points.len();
        let count = fitted + tests.len();
        let values = exact(&mut view, &seen, &mut analysis.points.iter().chain(&tests).copied(), count);
        let mut functions = [0.0; 36];
        for values in values.chunks(count) {
            let own = analysis.coefficients(&values[..fitted]);
            let mut missed = 0.0;
            for (x, value) in tests.iter().zip(&values[fitted..]) {
                basis.eval(*x, &mut functions);
                let predicted: f64 = own.iter().zip(&functions).map(|(c, f)| c * f).sum();
                missed += (value - predicted).abs();
            }
            misfit.push((missed / tests.len() as f64) as f32);
            coefficients.extend(own);
        }
        let work = [seen.work() * count as f64, 0.0];
        return Fit { coefficients, misfit, scatter: zero, lit: 1.0, work, ..Fit::default() };
    }
    let grid = Grid::of(basis, cell.key);
    let count = grid.points.len();
    let (cut, before) = match known.map(|k| (k.rays, k.values(groups, count))) {
        Some((rays, (cut, found))) => (cut, Some((rays, found))),
        None => (exact(&mut view, &seen, &mut grid.points.iter().copied(), count), None),
    };
    // where those that are cut out are hidden, the rays go by what the others may bring
    let open: f64 =
        lamps.groups.iter().zip(cut.chunks(count)).map(|(g, cut)| g.1.sum() * cut.iter().sum::<f64>()).sum();
    let left = sums.last().copied().unwrap_or(0.0);
    let bright = left + if whole > 0.0 { open / (count as f64 * whole) } else { 0.0 };
    let rays = if left > 0.0 { rays * (DIM / bright).max(1.0) } else { rays };
    let found = by_rays(&grid.points, rays, before);
    let values: Vec<[f64; 2]> = found.iter().zip(&cut).map(|(found, cut)| found.map(|f| f + cut)).collect();
    let fresh = rays - known.map_or(0.0, |k| k.rays);
    let work = [seen.work(), crowded.iter().map(|c| fresh * f64::from(c.1)).sum()].map(|w: f64| w * count as f64);
    let is_crowded = seen.is_crowded() || !crowded.is_empty();
    let doubt = if is_crowded { lamps.doubt } else { 1.0 };
    let known = (!crowded.is_empty()).then(|| {
        let (groups, found) = Known::found(&cut, &found, count);
        Known { groups, found, crowded: crowded.into(), rays, whole, batches: batch + 1 }
    });
    // where no lamp shines it may be dark inside of something
    let dark = |q: usize| (0..groups).all(|g| values[g * count + q] == [0.0; 2]) && is_buried(grid.points[q]);
    let lit: Vec<bool> = (0..count).map(|q| !dark(q)).collect();
    let alive = lit.iter().filter(|l| **l).count();
    let (share, tips) = share_of(kernel, cell, alive, count);
    if alive == 0 {
        // all that sticks out is a corner or two
        let once_more = once_more();
        let seen = once_more.as_ref().unwrap_or(&seen);
        let (cut, found) = (exact(&mut view, seen, &mut tips.iter().copied(), tips.len()), by_rays(&tips, rays, None));
        let values: Vec<f64> = found.iter().zip(&cut).map(|(f, cut)| 0.5 * (f[0] + f[1]) + cut).collect();
        for values in values.chunks(tips.len().max(1)).take(groups) {
            let mean = values.iter().sum::<f64>() / tips.len() as f64;
            coefficients.extend(grid.one().map(|one| one * mean));
        }
        coefficients.resize(groups * n, 0.0);
        return Fit { coefficients, misfit: zero.clone(), scatter: zero, lit: share, work, ..Fit::default() };
    }
    // what rays may have failed to find, and the groups to which there are too few to tell shape from scatter
    let (overlooked, sent) = lamps.overlooked(crowded, whole, rays * count as f64);
    let overlooked: Vec<f32> = overlooked.into_iter().map(|o| o as f32).collect();
    let sparse: Vec<bool> = sent.iter().map(|r| *r > 0.0 && *r < 2.0 * count as f64).collect();
    if values.iter().all(|v| *v == [0.0; 2]) {
        // in shadow, but for what may stick out of it between the points and the rim
        let (rim, once_more) = (corners(cell.shape), once_more());
        let seen = once_more.as_ref().unwrap_or(&seen);
        let (cut, found) = (exact(&mut view, seen, &mut rim.iter().copied(), rim.len()), by_rays(rim, rays, None));
        let rim_values = |g: usize| (0..rim.len()).map(move |q| g * rim.len() + q);
        let beside = |g: usize| rim_values(g).map(|k| 0.5 * (found[k][0] + found[k][1]) + cut[k]).sum::<f64>();
        let misfit = (0..groups).map(|g| (BESIDE * beside(g)) as f32).collect();
        let coefficients = vec![0.0; groups * n];
        return Fit { coefficients, misfit, scatter: overlooked, lit: share, work, known, crowded: false };
    }
    let part = if alive == count { None } else { Some(grid.part(&lit, n)) };
    let matrix = part.as_ref().unwrap_or(&grid.matrix);
    let freedom = alive.saturating_sub(n).max(1) as f64;
    let alive = alive as f64;
    for (g, values) in values.chunks(count).enumerate() {
        let own: Vec<[f64; 2]> = matrix
            .chunks(count)
            .map(|row| row.iter().zip(values).fold([0.0; 2], |sum, (m, v)| [sum[0] + m * v[0], sum[1] + m * v[1]]))
            .collect();
        let (mut missed, mut product, mut noise) = (0.0, 0.0, 0.0);
        for (row, value) in grid.values.chunks(n).zip(values).zip(&lit).filter(|(_, lit)| **lit).map(|(both, _)| both) {
            let left = [0, 1].map(|h| value[h] - row.iter().zip(&own).map(|(r, c)| r * c[h]).sum::<f64>());
            missed += left[0].abs();
            product += left[0] * left[1];
            noise += (0.5 * (value[0] - value[1])).powi(2);
        }
        coefficients.extend(own.iter().map(|c| 0.5 * (c[0] + c[1])));
        // n functions took n degrees of freedom
        let square = noise / alive;
        // mean square of what the functions cannot say, and its standard deviation
        let (said, certainty) = (product / freedom, 2.0 * square / freedom.sqrt());
        let root = MEAN_OF_ROOT * said.max(0.0).sqrt();
        let mut scattered = (square * n as f64 / alive).sqrt();
        let found = if square == 0.0 {
            missed / (alive * freedom).sqrt()
        } else if said > SIGNIFICANT * certainty && !sparse[g] {
            root
        } else {
            // what scatter may hide, less what it would pretend: more rays tell
            scattered = scattered.hypot((root - FLOOR * certainty.sqrt()).max(0.0) / MEAN_OF_SCATTER);
            0.0
        };
        misfit.push((doubt * found) as f32);
        scatter.push(((doubt * scattered) as f32).hypot(overlooked[g]));
    }
    Fit { coefficients, misfit, scatter, lit: share, work, known, crowded: is_crowded }
}

/// Mean absolute value of a misfit, over its root mean square, about.
const MEAN_OF_ROOT: f64 = 0.7;
