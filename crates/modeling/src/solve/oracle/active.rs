//! The problem on the active functions alone: solved by projected conjugate gradients from where the last set ended.

use super::cover::{Cover, Marks};
use super::hierarchy::{Function, Hierarchy};
use super::values::{ActiveGreen, Numbers, Seen};
use crate::energy::{Hessian, Operator, Scratch};
use crate::solve::border::Border;
use crate::solve::bpx::dense_factor;
use crate::solve::cholesky::{Cholesky, dot, start};
use crate::solve::correct::Correct;
use crate::solve::projected::{Projected, schur};
use crate::system::{Problem, Structure, sight};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// A block of coordinates that no row couples to others, on the functions of the hierarchy.
#[derive(Debug)]
pub(crate) struct Part {
    pub(crate) structure: Structure,
    /// One a functional of the structure.
    pub(crate) seen: Vec<Seen>,
    pub(crate) sides: Vec<Target>,
    /// Rows that the last solution did not keep: the active functions cannot tell them from others.
    pub(crate) left_out: Vec<usize>,
}

/// A right-hand side with its solution so far.
#[derive(Clone, Debug)]
pub(crate) struct Target {
    pub(crate) coordinates: Vec<usize>,
    /// Constraint of each row.
    pub(crate) constraints: Vec<usize>,
    pub(crate) targets: Vec<f64>,
    /// Coordinate by coordinate, functions in order.
    pub(crate) x: Vec<f64>,
    pub(crate) multipliers: Vec<f64>,
}

/// The active set and the problem on it.
pub(crate) struct Active {
    pub(crate) hierarchy: Arc<Hierarchy>,
    pub(crate) functions: Vec<Function>,
    pub(crate) numbers: Numbers,
    pub(crate) parts: Vec<Part>,
    coarse: Arc<Cholesky>,
    /// Trace of the energy of the coarsest B-splines.
    coarse_trace: f64,
    /// The null space of the energy in the coarsest B-splines.
    null: Vec<Vec<f64>>,
    marks: Marks,
    scratch: Scratch,
    pub(crate) iterations: usize,
    /// B-splines of the last cover.
    pub(crate) cover: usize,
}

/// What can be restored.
#[derive(Clone)]
pub(crate) struct Saved {
    functions: Vec<Function>,
    sides: Vec<Vec<Target>>,
    left_out: Vec<Vec<usize>>,
}

/// The energy of a solution, and how well it was iterated.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Solved {
    /// Energy with that of soft rows.
    pub(crate) energy: f64,
    /// Hard rows that are missed.
    pub(crate) unmet: usize,
    /// About the energy that more iterations would save.
    pub(crate) left: f64,
    /// What rounding makes of energies this size, about.
    pub(crate) noise: f64,
}

/// What inactive functions would gain: the energy that each alone would save, about.
pub(crate) struct Gains {
    pub(crate) functions: Vec<(Function, f64)>,
}

/// A row waits for functions of its own while what sets it apart from those before it is less than this share of what
/// the inactive functions would add.
const CROWDED: f64 = 0.2;

/// Rounding of an energy, as a share of the square of the largest coefficient times the trace: of the coarsest
/// B-splines, and of the wavelets, whose coefficients come from sums.
const NOISE: [f64; 2] = [1e-14, 1e-12];

/// Corrections of a side in one solution.
const CORRECTIONS: usize = 8;

impl Active {
    /// `None` where the axes have no common pyramid; the coarsest B-splines are active.
    pub(crate) fn new(problem: &Problem, hierarchy: Hierarchy, blocks: Vec<crate::system::Block>) -> Option<Active> {
        let hierarchy = Arc::new(hierarchy);
        let coarsest = Operator::new(&hierarchy.spaces[0], problem.energy(), None);
        let coarse = Arc::new(dense_factor(&coarsest, problem.energy())?);
        let functions: Vec<Function> = hierarchy.coarsest().collect();
        let parts = blocks
            .into_iter()
            .filter(|b| b.structure.rows() > 0)
            .map(|b| {
                let seen = b.structure.functionals.iter().map(|f| Seen::new(&hierarchy, f)).collect();
                let sides = b.sides.into_iter().map(|s| Target {
                    coordinates: s.coordinates,
                    constraints: s.constraints,
                    targets: s.targets,
                    x: vec![0.0; functions.len() * b.structure.k],
                    multipliers: vec![0.0; b.structure.rows()],
                });
                Part { sides: sides.collect(), structure: b.structure, seen, left_out: Vec::new() }
            })
            .collect();
        let mut numbers = Numbers::new(&hierarchy);
        numbers.set(&functions, 0);
        Some(Active {
            marks: Marks::new(&hierarchy),
            null: coarsest.null_space(problem.energy().free_degree()),
            hierarchy,
            functions,
            numbers,
            parts,
            coarse,
            coarse_trace: coarsest.trace(),
            scratch: Scratch::default(),
            iterations: 0,
            cover: 0,
        })
    }

    pub(crate) fn is_active(&self, f: Function) -> bool {
        self.numbers.get(f).is_some()
    }

    /// Number of functions that are always active.
    pub(crate) fn corner(&self) -> usize {
        self.coarse.len()
    }

    /// The sum of a function's squared coefficients over all coordinates.
    pub(crate) fn squares(&self) -> Vec<f64> {
        let n = self.functions.len();
        let mut out = vec![0.0; n];
        for x in self.parts.iter().flat_map(|p| &p.sides).flat_map(|s| s.x.chunks_exact(n)) {
            out.iter_mut().zip(x).for_each(|(o, x)| *o += x * x);
        }
        out
    }

    /// Takes another active set (sorted, with the coarsest B-splines); coefficients of what stays are kept.
    pub(crate) fn replace(&mut self, functions: Vec<Function>) {
        let old = self.functions.len();
        let from: Vec<Option<u32>> = functions.iter().map(|f| self.numbers.get(*f)).collect();
        for side in self.parts.iter_mut().flat_map(|p| &mut p.sides) {
            let of = |x: &[f64]| from.iter().map(|i| i.map_or(0.0, |i| x[i as usize])).collect::<Vec<f64>>();
            side.x = side.x.chunks_exact(old).flat_map(of).collect();
        }
        self.numbers.clear(&self.functions);
        self.numbers.set(&functions, 0);
        self.functions = functions;
    }

    pub(crate) fn save(&self) -> Saved {
        Saved {
            functions: self.functions.clone(),
            sides: self.parts.iter().map(|p| p.sides.clone()).collect(),
            left_out: self.parts.iter().map(|p| p.left_out.clone()).collect(),
        }
    }

    pub(crate) fn restore(&mut self, saved: Saved) {
        self.numbers.clear(&self.functions);
        self.numbers.set(&saved.functions, 0);
        self.functions = saved.functions;
        for ((part, sides), left_out) in self.parts.iter_mut().zip(saved.sides).zip(saved.left_out) {
            part.sides = sides;
            part.left_out = left_out;
        }
    }

    /// Iterates on the active functions until the squared residual is below `goal`, `most` iterations a side at most.
    ///
    /// # Errors
    /// The constraint whose row has no pivot.
    pub(crate) fn solve(&mut self, goal: f64, most: usize) -> Result<Solved, usize> {
        let n = self.functions.len();
        let cover = Arc::new(Cover::new(&self.hierarchy, &self.functions, &mut self.marks));
        self.cover = cover.splines();
        let null: Vec<Vec<f64>> = self.null.iter().map(|z| [&z[..], &vec![0.0; n - z.len()]].concat()).collect();
        let null = Arc::new(null);
        let corner = self.corner();
        let mut out = Solved::default();
        for part in &mut self.parts {
            let all = &part.structure;
            let lists: Vec<Vec<(u32, f64)>> =
                part.seen.iter().map(|seen| seen.on(&self.hierarchy, &self.numbers)).collect();
            let mut green = ActiveGreen { coarse: self.coarse.clone(), lists };
            let s = schur(all, &mut green);
            let every: Vec<usize> = (0..all.rows()).collect();
            let full = all.over(n, &green.lists, &every);
            let y: Vec<Vec<f64>> = (0..all.k)
                .flat_map(|c| null.iter().map(move |z| (c, z)))
                .map(|(c, z)| {
                    let mut x = vec![0.0; n * all.k];
                    x[c * n..][..n].copy_from_slice(z);
                    let most = z.iter().fold(0.0, |m: f64, z| m.max(z.abs()));
                    let value = |r: &usize| {
                        let size = all.terms[*r].iter().filter(|t| t.0 == c).flat_map(|t| {
                            let coarse = green.lists[t.1].iter().filter(|e| (e.0 as usize) < corner);
                            coarse.map(|e| (t.2 * e.1).abs())
                        });
                        sight(full.apply_row(*r, &x), size.sum::<f64>() * most)
                    };
                    every.iter().map(value).collect()
                })
                .collect();
            let (hierarchy, numbers) = (&self.hierarchy, &self.numbers);
            // What the inactive functions would add to a row's square.
            let missing: Vec<f64> = part.seen.iter().map(|seen| seen.missing(hierarchy, numbers)).collect();
            let least = |r: &usize| {
                let own = all.terms[*r].iter().map(|t| t.2 * t.2 * missing[t.1]).sum::<f64>();
                if all.give[*r] > 0.0 { 0.0 } else { CROWDED * own }
            };
            let kept = Border::independent(&s, &y, &every.iter().map(least).collect::<Vec<f64>>());
            part.left_out = every.iter().copied().filter(|r| kept.binary_search(r).is_err()).collect();
            let at = |a: usize, b: usize| s[start(kept[a]) + kept[b]];
            let s: Vec<f64> =
                (0..kept.len()).flat_map(|i| (0..=i).map(move |j| (i, j))).map(|(i, j)| at(i, j)).collect();
            let y = y.iter().map(|y| kept.iter().map(|r| y[*r]).collect()).collect();
            let border = Border::new(s, kept.len(), y)
                .map_err(|row| part.sides.first().map_or(0, |s| s.constraints[kept[row]]))?;
            let structure = Arc::new(all.over(n, &green.lists, &kept));
            let mut solver = Projected::bordered(
                cover.clone(),
                structure.clone(),
                Box::new(green),
                null.clone(),
                border,
                1e-14,
                most,
            );
            for side in &mut part.sides {
                let mut multipliers: Vec<f64> = kept.iter().map(|r| side.multipliers[*r]).collect();
                // Crowded rows may need more than one correction to be met in full.
                let size = side.targets.iter().fold(0.0, |m: f64, b| m.max(b.abs()));
                let before = side.x.clone();
                let mut left = 0.0;
                for correction in 0..CORRECTIONS {
                    let miss = |(i, r): (usize, &usize)| {
                        side.targets[*r] - structure.apply_row(i, &side.x) + structure.give[i] * multipliers[i]
                    };
                    let r2: Vec<f64> = kept.iter().enumerate().map(miss).collect();
                    if correction > 0 && r2.iter().all(|r| r.abs() <= 1e-13 * size) {
                        break;
                    }
                    let mut r1 = vec![0.0; n * all.k];
                    for (x, y) in side.x.chunks_exact(n).zip(r1.chunks_exact_mut(n)) {
                        cover.times(x, y, &mut self.scratch);
                    }
                    structure.add_transposed(&multipliers, 1.0, &mut r1);
                    r1.iter_mut().for_each(|r| *r = -*r);
                    solver.aim(goal);
                    solver.begin(&r1, &r2);
                    while !solver.step() {}
                    self.iterations += solver.iterations();
                    left = solver.left();
                    let (dx, dl) = solver.correction();
                    side.x.iter_mut().zip(dx).for_each(|(x, d)| *x += d);
                    multipliers.iter_mut().zip(dl).for_each(|(l, d)| *l += d);
                }
                out.left += left;
                // Rows that rounding cannot tell from others leave nothing to go by: back, and they wait like the rest.
                let unclear = |(i, r): &(usize, &usize)| {
                    let miss = side.targets[**r] - structure.apply_row(*i, &side.x);
                    all.give[**r] == 0.0 && (miss.is_nan() || miss.abs() > 1e-8 * size)
                };
                let unclear: Vec<usize> = kept.iter().enumerate().filter(unclear).map(|(_, r)| *r).collect();
                if !unclear.is_empty() {
                    side.x = before;
                    multipliers.fill(0.0);
                    part.left_out.extend(unclear);
                    part.left_out.sort_unstable();
                    part.left_out.dedup();
                }
                side.multipliers.fill(0.0);
                kept.iter().zip(&multipliers).for_each(|(r, l)| side.multipliers[*r] = *l);
                // Wavelets are of unit energy; the coarsest B-splines have heights for coefficients.
                for x in side.x.chunks_exact(n) {
                    let most = |x: &[f64]| x.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
                    let (corner_most, rest) = (most(&x[..corner]), most(&x[corner..]));
                    out.noise += NOISE[0] * corner_most * corner_most * self.coarse_trace;
                    out.noise += NOISE[1] * rest * rest * (n - corner) as f64;
                }
                let mut hx = vec![0.0; n];
                for x in side.x.chunks_exact(n) {
                    cover.times(x, &mut hx, &mut self.scratch);
                    out.energy += dot(x, &hx);
                }
                for r in 0..all.rows() {
                    let miss = full.apply_row(r, &side.x) - side.targets[r];
                    if all.give[r] > 0.0 {
                        out.energy += miss * miss / all.give[r];
                    } else if miss.abs() > 1e-9 * size && part.left_out.binary_search(&r).is_ok() {
                        out.unmet += 1;
                    }
                }
            }
        }
        Ok(out)
    }

    /// What each of some inactive functions would gain.
    pub(crate) fn gains(&mut self, candidates: Vec<Function>) -> Gains {
        let n = self.functions.len();
        let all: Vec<Function> = self.functions.iter().chain(&candidates).copied().collect();
        let cover = Cover::new(&self.hierarchy, &all, &mut self.marks);
        self.numbers.set(&candidates, n);
        let mut gains = vec![0.0; candidates.len()];
        let (mut x, mut y) = (vec![0.0; all.len()], vec![0.0; all.len()]);
        for part in &self.parts {
            let lists: Vec<Vec<(u32, f64)>> =
                part.seen.iter().map(|seen| seen.on(&self.hierarchy, &self.numbers)).collect();
            for side in &part.sides {
                for (c, own) in side.x.chunks_exact(n).enumerate() {
                    x[..n].copy_from_slice(own);
                    cover.times(&x, &mut y, &mut self.scratch);
                    for (r, l) in side.multipliers.iter().enumerate().filter(|l| *l.1 != 0.0) {
                        for &(_, f, by) in part.structure.terms[r].iter().filter(|t| t.0 == c) {
                            lists[f].iter().for_each(|(i, v)| y[*i as usize] += l * by * v);
                        }
                    }
                    gains.iter_mut().zip(&y[n..]).for_each(|(g, y)| *g += y * y);
                }
            }
        }
        self.numbers.clear(&candidates);
        Gains { functions: candidates.into_iter().zip(gains).collect() }
    }

    /// What inactive functions at the constraints would gain if they saw nothing but the pull of the multipliers: right
    /// for those well below the leaves, where the shape is a polynomial that their moments do not see.
    pub(crate) fn pulls(&self, but: &Gains) -> Gains {
        let asked: BTreeSet<Function> = but.functions.iter().map(|g| g.0).collect();
        let mut gains: BTreeMap<Function, f64> = BTreeMap::new();
        for part in &self.parts {
            for side in &part.sides {
                for c in 0..part.structure.k {
                    let mut pulls: BTreeMap<Function, f64> = BTreeMap::new();
                    for (r, l) in side.multipliers.iter().enumerate().filter(|l| *l.1 != 0.0) {
                        for &(_, f, by) in part.structure.terms[r].iter().filter(|t| t.0 == c) {
                            for (f, v) in part.seen[f].all(&self.hierarchy).filter(|e| !self.is_active(e.0)) {
                                *pulls.entry(f).or_default() += l * by * v;
                            }
                        }
                    }
                    for (f, pull) in pulls.into_iter().filter(|p| !asked.contains(&p.0)) {
                        *gains.entry(f).or_default() += (pull * self.hierarchy.height(f)).powi(2);
                    }
                }
            }
        }
        Gains { functions: gains.into_iter().collect() }
    }

    /// The energy of the coefficients as they are written, with that of soft rows, by the operator of all of them: that
    /// of the functions may have lost it to rounding.
    pub(crate) fn written(&self, h: &Operator, coordinates: usize) -> f64 {
        let all = self.coefficients(coordinates);
        let mut energy = all.iter().map(|x| h.energy(x)).sum::<f64>();
        for part in &self.parts {
            for side in &part.sides {
                let x: Vec<f64> = side.coordinates.iter().flat_map(|c| all[*c].iter().copied()).collect();
                for (r, give) in part.structure.give.iter().enumerate().filter(|g| *g.1 > 0.0) {
                    energy += (part.structure.apply_row(r, &x) - side.targets[r]).powi(2) / give;
                }
            }
        }
        energy
    }

    /// What rounding makes of the energy of a good solution of such an energy and height.
    pub(crate) fn rounding(&self, energy: f64, height: f64) -> f64 {
        NOISE[0] * height * height * self.coarse_trace + NOISE[1] * energy * self.functions.len() as f64
    }

    /// The B-spline coefficients of the finest level, of every coordinate; the one thing of full size.
    pub(crate) fn coefficients(&self, coordinates: usize) -> Vec<Vec<f64>> {
        let h = &self.hierarchy;
        let finest = h.spaces.last().map_or(0, crate::system::Space::len);
        let n = self.functions.len();
        let mut out = vec![vec![0.0; finest]; coordinates];
        let mut work = Vec::new();
        for side in self.parts.iter().flat_map(|p| &p.sides) {
            for (c, x) in side.coordinates.iter().zip(side.x.chunks_exact(n)) {
                let mut now = vec![0.0; h.spaces[0].len()];
                let mut at = 0;
                for (rise, [_, t]) in h.levels.iter().enumerate() {
                    if rise > 0 {
                        let mut fine = vec![0.0; h.spaces[rise].len()];
                        crate::solve::transfer::Transfer::new(&h.spaces[rise - 1]).refine(&now, &mut fine, &mut work);
                        now = fine;
                    }
                    while let Some(f) = self.functions.get(at).filter(|f| usize::from(f.rise) == rise) {
                        if rise == 0 {
                            now[f.s as usize * t.n + f.t as usize] += x[at];
                        } else {
                            let [rs, rt] = &h.rises[rise - 1];
                            let by = x[at] * h.height(*f);
                            for &(i, v) in rs.columns.row(f.s as usize) {
                                for &(j, w) in rt.columns.row(f.t as usize) {
                                    now[i * t.n + j] += by * v * w;
                                }
                            }
                        }
                        at += 1;
                    }
                }
                out[*c] = now;
            }
        }
        out
    }
}
