//! Indirect light: what arrives at points of an element, by rays that ask where the light comes from.
//!
//! A row of the transport operator is the mean, over directions weighted by the cosine, of the radiosity met. Its
//! samples are drawn once; the light they read is linear in the solution, so the samples *are* the row. An element's
//! functions are fitted to its points by least squares; a constant field comes out exactly constant. Every point has
//! two independent halves of samples, which say how large their scatter is, and whether what the fit leaves over at the
//! points is scatter or shape.

use super::direct;
use super::field::Field;
use super::points::{self, Grain, Marks, Point, strata};
use super::rays::{Ray, Rays};
use super::verdict::Verdict;
use crate::kernel::LightKernel;
use crate::rgb::Rgb;
use ondelette_compress::{Forest, NodeId};
use ondelette_numerics::sobol::Sobol;
use ondelette_numerics::{dense, seed};
use ondelette_wavelet::cell::CellBasis;
use std::ops::Range;

/// Most functions of a basis.
pub(super) const MOST: usize = 36;
/// Points of an element that is not coarse.
const FINE_POINTS: usize = 16;
/// An element that gathers.
#[derive(Clone, Debug)]
pub(super) struct Gather {
    /// Its node.
    pub(super) node: NodeId,
    /// Where it gathers.
    points: Vec<Point>,
    /// Which of them are not inside of something.
    lit: Marks,
    /// Directions drawn at every point, in each half.
    pub(super) drawn: u32,
    /// The first samples of every point, and the others.
    first: Rays,
    others: Rays,
    /// Order of the functions in use.
    pub(super) order: usize,
    /// Values at the points to coefficients of the functions in use, `[function][point]`; empty for a mean.
    fit: Vec<f64>,
}

/// Directions to draw for some points of a gather.
#[derive(Clone, Debug)]
pub(super) struct Draw {
    pub(super) gather: u32,
    pub(super) points: Range<u32>,
    pub(super) directions: Range<u32>,
}

impl Draw {
    /// The part of it that iterations use.
    pub(super) fn early(&self) -> Draw {
        let end = self.directions.end.min(Gather::FIRST).max(self.directions.start);
        Draw { directions: self.directions.start..end, ..self.clone() }
    }

    /// Rays of both halves.
    pub(super) fn rays(&self) -> usize {
        2 * self.points.len() * self.directions.len()
    }
}

impl Gather {
    /// Most points of an element.
    pub(super) const MOST_POINTS: usize = 64;
    /// Directions of a point and half that iterations use; sweeps use all.
    pub(super) const FIRST: u32 = 6;

    /// At a point in each of 16 or 4 equal parts, or in two of these 4, without samples.
    pub(super) fn new(forest: &Forest, node: NodeId, grain: Grain) -> Self {
        let cell = forest.node(node).cell;
        let points = points::at_first(&cell, grain);
        Gather {
            node,
            lit: Marks::default(),
            points,
            drawn: 0,
            first: Default::default(),
            others: Default::default(),
            order: coarsest(forest.basis_of(node)),
            fit: Vec::new(),
        }
    }

    /// Bytes of its arrays, and how many there are.
    pub(super) fn bytes(&self) -> (usize, usize) {
        let parts =
            [size_of_val(&self.points[..]), size_of_val(&self.fit[..]), self.first.bytes(), self.others.bytes()];
        (parts.iter().sum(), parts.iter().filter(|p| **p > 0).count())
    }

    /// The functions in use.
    pub(super) fn functions<'a>(&self, forest: &'a Forest) -> &'a [u16] {
        forest.basis_of(self.node).truncated(self.order)
    }

    /// If it has no point outside of things among the known ones, and the others, which are new, are inside as well,
    /// moves these to corners that stick out, if any do.
    pub(super) fn stick_out(&mut self, kernel: &LightKernel, forest: &Forest, known: u32) {
        let cell = &forest.node(self.node).cell;
        let element = kernel.element(cell);
        let is_buried = |point: &Point| kernel.is_buried(cell.root as usize, element.point(point.at));
        let (_, fresh) = self.points.split_at_mut(known as usize);
        if self.lit.count() > 0 || !fresh.iter().all(is_buried) {
            return;
        }
        let corners = direct::open_corners(kernel, cell);
        for (point, corner) in fresh.iter_mut().zip(corners.iter().cycle()) {
            point.at = *corner;
        }
    }

    /// Whether none of its points is inside of something.
    pub(super) fn is_whole(&self) -> bool {
        self.lit.count() == self.points.len()
    }

    /// Of known parts: the first samples, and the others; with functions up to an order.
    pub(super) fn of_parts(
        (node, order): (NodeId, usize),
        (points, lit): (Vec<Point>, Marks),
        drawn: u32,
        [first, others]: [Rays; 2],
    ) -> Self {
        Gather { node, points, lit, drawn, first, others, order, fit: Vec::new() }
    }

    /// Its samples, as [`Gather::of_parts`] takes them.
    pub(super) fn parts(&self) -> [&Rays; 2] {
        [&self.first, &self.others]
    }

    /// Its points, and whether they are not inside of something.
    pub(super) fn marked_points(&self) -> impl Iterator<Item = (&Point, bool)> {
        self.points.iter().enumerate().map(|(p, point)| (point, self.lit.has(p)))
    }

    /// Samples of both halves, stored or not.
    pub(super) fn samples(&self) -> usize {
        2 * self.points.len() * self.drawn as usize
    }

    /// As if all its samples were stored, with those that are not in `cast`.
    pub(super) fn completed(&self, cast: Cast) -> Gather {
        Gather { others: Rays::of_halves(cast.rays), ..self.clone() }
    }

    /// Points.
    pub(super) fn points(&self) -> u32 {
        self.points.len() as u32
    }

    /// Directions from none to `directions` at every point.
    pub(super) fn all(gather: usize, points: u32, directions: Range<u32>) -> Draw {
        Draw { gather: gather as u32, points: 0..points, directions }
    }

    /// Samples beyond the first that are not stored.
    pub(super) fn missing(&self, gather: u32) -> Option<Draw> {
        let stored = !self.others.is_empty() || self.drawn <= Self::FIRST;
        let all = Draw { gather, points: 0..self.points(), directions: Self::FIRST..self.drawn };
        if stored { None } else { Some(all) }
    }

    /// Forgets the samples beyond the first.
    pub(super) fn forget_others(&mut self) {
        self.others = Rays::default();
    }

    /// Takes drawn samples.
    pub(super) fn take(&mut self, draw: &Draw, cast: Cast) {
        for (p, open) in draw.points.clone().zip(cast.open) {
            if open {
                self.lit.add(p as usize);
            }
        }
        let early = (Self::FIRST.saturating_sub(draw.directions.start) as usize).min(draw.directions.len());
        let each = cast.rays[0].len() / draw.points.len().max(1);
        // more directions of all points, or all directions of new ones
        let known = if draw.directions.start > 0 { draw.points.end } else { draw.points.start } as usize;
        let points = self.points.len();
        let fresh = |half: usize, p: usize| match p.checked_sub(draw.points.start as usize) {
            Some(k) if k < draw.points.len() => &cast.rays[half][k * each..(k + 1) * each],
            _ => &[],
        };
        self.first.join(known, points, |half, p| &fresh(half, p)[..early.min(fresh(half, p).len())]);
        self.others.join(known, points, |half, p| &fresh(half, p)[early.min(fresh(half, p).len())..]);
        self.drawn = self.drawn.max(draw.directions.end);
    }

    /// Chooses the functions to fit: at most what the points determine.
    pub(super) fn prepare(&mut self, basis: &CellBasis) {
        // points inside of something are dark, and no part of the fit
        let points = self.lit.count();
        if points == 0 {
            self.order = coarsest(basis);
            self.fit = vec![0.0; basis.truncated(self.order).len() * self.points.len()];
            return;
        }
        self.fit = Vec::new();
        self.order = order_of(basis, points);
        let index = basis.truncated(self.order);
        let n = index.len();
        if n == 1 {
            return;
        }
        let mut values = vec![0.0; self.points.len() * n];
        let mut all = [0.0; MOST];
        for ((p, point), row) in self.points.iter().enumerate().zip(values.chunks_mut(n)) {
            if self.lit.has(p) {
                basis.eval(point.at, &mut all);
                row.iter_mut().zip(index).for_each(|(v, &i)| *v = all[usize::from(i)]);
            }
        }
        // about the mean: (G + e) d = b - G m, so that constants are exact however few the points
        let share = 1.0 / points as f64;
        let mut gram = vec![0.0; n * n];
        for row in values.chunks(n) {
            for i in 0..n {
                for j in 0..n {
                    gram[i * n + j] += share * row[i] * row[j];
                }
            }
        }
        let one = |i: usize| if !basis.is_nested() || i == 0 { 1.0 } else { 0.0 };
        let constant: Vec<f64> = (0..n).map(|i| (0..n).map(|j| gram[i * n + j] * one(j)).sum()).collect();
        (0..n).for_each(|i| gram[i * n + i] += 1e-4);
        let inverse = dense::inverse(&gram, n);
        self.fit.reserve_exact(n * self.points.len());
        for i in 0..n {
            let row = &inverse[i * n..(i + 1) * n];
            let rest = one(i) - row.iter().zip(&constant).map(|(a, b)| a * b).sum::<f64>();
            for (p, value) in values.chunks(n).enumerate() {
                let whole = row.iter().zip(value).map(|(a, b)| a * b).sum::<f64>() + rest;
                self.fit.push(if self.lit.has(p) { share * whole } else { 0.0 });
            }
        }
    }

    /// Follows rays whose leaf was split since.
    pub(super) fn relocate(&mut self, forest: &Forest) {
        self.first.relocate(forest);
        self.others.relocate(forest);
    }

    /// Hands its points and samples to gathers of the children of its node; these get more points, too, for which
    /// samples are still to be drawn: their first index is returned beside each child.
    pub(super) fn split(&self, forest: &Forest) -> Vec<(Gather, u32)> {
        let shape = forest.node(self.node).cell.shape;
        let places: Vec<(usize, [f64; 2])> = self.points.iter().map(|point| shape.descend(point.at)).collect();
        let child = |c: usize| {
            let chosen: Vec<usize> = (0..places.len()).filter(|&p| places[p].0 == c).collect();
            let points = chosen.iter().map(|&p| Point { at: places[p].1, ..self.points[p] }).collect();
            let lit = chosen.iter().map(|&p| self.lit.has(p)).collect();
            let parts = [&self.first, &self.others].map(|rays| rays.of(&chosen, places.len()));
            let node = (forest.child(self.node, c), self.order);
            let mut child = Gather::of_parts(node, (points, lit), self.drawn, parts);
            let known = child.points();
            child.add_points(forest, 1);
            (child, known)
        };
        (0..shape.arity()).map(child).collect()
    }

    /// Whether it has so few points that more of them are worth more than smaller elements.
    pub(super) fn is_coarse(&self, basis: &CellBasis) -> bool {
        self.order < basis.order() && self.is_whole() && self.points.len() < FINE_POINTS
    }

    /// Adds a point in each of the parts that `levels` splits make, without samples.
    pub(super) fn add_points(&mut self, forest: &Forest, levels: u32) {
        let cell = forest.node(self.node).cell;
        self.points.extend(strata(cell.shape, levels, seed::combine(cell.key, 0x6578_7472)));
    }

    /// Values at the points from one half of the samples.
    fn values(&self, radiosity: &Field<'_>, half: usize, all: bool, out: &mut [[f64; 3]]) {
        let points = self.points.len();
        let directions = if all { self.drawn } else { self.drawn.min(Self::FIRST) };
        let share = 1.0 / f64::from(directions.max(1));
        for (p, out) in out.iter_mut().enumerate() {
            let mut sum = [0.0; 3];
            let mut add = |rays: &[Ray]| {
                for ray in rays {
                    let b = radiosity.met(ray);
                    (0..3).for_each(|c| sum[c] += b[c]);
                }
            };
            add(self.first.at(half, p, points));
            if all {
                add(self.others.at(half, p, points));
            }
            *out = sum.map(|s| s * share);
        }
    }

    /// Coefficients in use that fit values at the points, added to `out` with a factor.
    fn add_fit(&self, values: &[[f64; 3]], factor: f64, out: &mut [[f64; 3]]) {
        if self.fit.is_empty() {
            let share = factor / self.lit.count().max(1) as f64;
            for (_, v) in values.iter().enumerate().filter(|(p, _)| self.lit.has(*p)) {
                (0..3).for_each(|c| out[0][c] += share * v[c]);
            }
            return;
        }
        for (row, to) in self.fit.chunks(values.len()).zip(out) {
            for (k, v) in row.iter().zip(values) {
                (0..3).for_each(|c| to[c] += factor * k * v[c]);
            }
        }
    }

    /// What the first samples gather, or all, as coefficients.
    pub(super) fn gather(&self, radiosity: &Field<'_>, all: bool, out: &mut [[f64; 3]]) {
        let mut values = [[0.0; 3]; Gather::MOST_POINTS];
        let values = &mut values[..self.points.len()];
        for half in 0..2 {
            self.values(radiosity, half, all, values);
            self.add_fit(values, 0.5, out);
        }
    }

    /// What all samples gather, as coefficients: the mean of the halves, half their difference, and what they say of
    /// themselves.
    pub(super) fn judge(&self, radiosity: &Field<'_>, out: &mut [[f64; 3]], apart: &mut [[f64; 3]]) -> Verdict {
        let basis = radiosity.forest.basis_of(self.node);
        let index = basis.truncated(self.order);
        let n = index.len();
        let points = self.points.len();
        let mut values = [[[0.0; 3]; Gather::MOST_POINTS]; 2];
        let mut fits = [[[0.0; 3]; MOST]; 2];
        for half in 0..2 {
            let own = &mut values[half][..points];
            self.values(radiosity, half, true, own);
            self.add_fit(own, 1.0, &mut fits[half][..n]);
        }
        for i in 0..n {
            for c in 0..3 {
                out[i][c] = 0.5 * (fits[0][i][c] + fits[1][i][c]);
                apart[i][c] = 0.5 * (fits[0][i][c] - fits[1][i][c]);
            }
        }
        let mut noise = [0.0; 3];
        let mut misfit = 0.0;
        let mut functions = [0.0; MOST];
        let points = self.lit.count();
        for (p, point) in self.points.iter().enumerate().filter(|(p, _)| self.lit.has(*p)) {
            basis.eval(point.at, &mut functions);
            let mut product = 0.0;
            for c in 0..3 {
                noise[c] += (0.5 * (values[0][p][c] - values[1][p][c])).powi(2);
                let left = |h: usize| {
                    let fitted: f64 = fits[h].iter().zip(index).map(|(f, &i)| f[c] * functions[usize::from(i)]).sum();
                    values[h][p][c] - fitted
                };
                let both = left(0) * left(1);
                // roots of channels are added: their errors go together
                product += both.signum() * both.abs().sqrt();
            }
            misfit += product * product.abs();
        }
        // the fit took its share of the degrees of freedom
        let left = points.saturating_sub(n);
        misfit = if left > 0 { misfit / left as f64 } else { 0.0 };
        let noise: f64 = noise.iter().map(|s| (s / points.max(1) as f64).sqrt()).sum();
        // the product of two scattered numbers, the mean of `left` of them
        let certainty = 2.0 * noise * noise / (left.max(1) as f64).sqrt();
        let per_direction = noise * f64::from(self.drawn.max(1)).sqrt();
        Verdict {
            scatter: 0.0,
            noise,
            per_direction,
            misfit,
            certainty,
            share: (n as f64 / points.max(1) as f64).sqrt(),
        }
    }
}

/// The order of the functions that so many points determine.
pub(super) fn order_of(basis: &CellBasis, points: usize) -> usize {
    if !basis.is_nested() {
        return basis.order();
    }
    // through as many points functions would swing between them, nothing would say how wrong they are, and the balance
    // might not converge
    let spare = |p: usize| [0.0, 1.0, 1.5, 2.0][p.min(3)];
    let fits = |p: usize| basis.truncated(p).len() as f64 * spare(p) <= points as f64;
    (1..=basis.order()).rev().find(|&p| fits(p)).unwrap_or(1)
}

/// The lowest order of functions that a basis has by themselves.
pub(super) fn coarsest(basis: &CellBasis) -> usize {
    if basis.is_nested() { 1 } else { basis.order() }
}

/// Mean over an element of the function with these coefficients.
pub(super) fn mean_of(basis: &CellBasis, coefficients: &[[f64; 3]]) -> [f64; 3] {
    basis.mean(coefficients, [0.0; 3], |a, b, k| (Rgb(a) + Rgb(b) * k).0)
}

/// Root mean square over an element of the function with these coefficients, channels summed.
pub(super) fn size_of(basis: &CellBasis, coefficients: &[[f64; 3]]) -> f64 {
    let mut square = [0.0; 3];
    for own in coefficients {
        (0..3).for_each(|c| square[c] += own[c] * own[c]);
    }
    let scale = if basis.is_nested() { 1.0 } else { 1.0 / basis.len() as f64 };
    square.iter().map(|s| (s * scale).sqrt()).sum()
}

/// Drawn samples.
#[derive(Clone, Debug)]
pub(super) struct Cast {
    /// Of each half, point by point.
    rays: [Vec<Ray>; 2],
    /// Which of the points are not inside of something.
    open: Vec<bool>,
}

/// Draws samples for both halves.
pub(super) fn cast(kernel: &LightKernel, forest: &Forest, gather: &Gather, draw: &Draw) -> Cast {
    let cell = forest.node(gather.node).cell;
    let side = cell.root as usize;
    let element = kernel.element(&cell);
    let covers = kernel.has_covers(side);
    let mut rays = [0, 1].map(|_| Vec::with_capacity(draw.rays() / 2));
    let mut open = Vec::with_capacity(draw.points.len());
    for p in draw.points.clone() {
        let point = &gather.points[p as usize];
        let x = element.point(point.at);
        let covered = covers && kernel.is_covered(side, x);
        let mut only_backs = !covered;
        for (rays, half) in rays.iter_mut().zip([0u64, 1]) {
            let sequence = Sobol::of(seed::combine(point.key, half));
            for index in draw.directions.clone() {
                if covered {
                    rays.push(Ray::NOWHERE);
                    continue;
                }
                let hit = kernel.first_hit_from(side, x, kernel.direction(side, sequence.point(index)));
                let met = hit.and_then(|hit| Some((hit, kernel.side_of(hit.patch, !hit.front)?)));
                only_backs &= hit.is_some() && met.is_none();
                rays.push(match met {
                    None => Ray::NOWHERE,
                    Some((hit, met)) => {
                        let at = if hit.front { hit.at } else { [hit.at[1], hit.at[0]] };
                        let (leaf, to) = forest.locate(met, at);
                        Ray::new(leaf.0, to)
                    }
                });
            }
        }
        open.push(!only_backs || !kernel.is_buried(side, x));
    }
    Cast { rays, open }
}
