//! The balance: I = K r (D + I) for the rows K that were sampled and the reflectance r.
//!
//! A sweep with all samples says what is left over; the few first samples of every element are a cheap operator, close
//! enough to correct it: what is left over is solved with them, and the next sweep sees how much of it is gone. So the
//! solution is that of all samples, and an iteration reads few.
//!
//! The scatter of the rows goes the same way as light: what one element receives too much, all others receive again
//! after reflection. Where much is reflected, this common part is larger than the scatter itself. It is found by
//! solving for the scatter, with signs drawn at random for the elements, a few times over.

use super::field::{self, Field, Form};
use super::gather::{self, Gather};
use super::plan::UNSOLVED;
use super::verdict::Verdict;
use super::{Phase, RAYS_A_STEP, Sampled, Scratch, positive, stitch};
use crate::solver::Event;
use ondelette_numerics::krylov::{Gmres, norm};
use ondelette_numerics::{par, seed};

/// Krylov vectors kept before a restart.
const RESTART: usize = 30;
/// Samples read in a step of a sweep.
const READS_A_STEP: usize = 1 << 20;
/// Elements that gather in one task.
const GATHERS_A_TASK: usize = 32;
/// Most solves for one set of samples.
const MOST_CORRECTIONS: u32 = 12;
/// Draws of signs for the scatter; so many elements are a sample of their own, and one draw is enough. What the mean
/// absolute value of a sum of so many squares' root lacks is then made up for.
const PATTERNS: u64 = 3;
const MANY: usize = 30_000;
const ONE_FOR_ALL: f64 = 1.155;
/// Where emitters are met by rays, the few that meet them tell less than there is of scatter, by about this factor.
const SELDOM: f64 = 1.15;
/// The part of the scatter that others pass on is wanted to this share of the scatter.
const SPREAD_TOLERANCE: f64 = 0.15;
/// Most Krylov vectors for it.
const SPREAD_STEPS: usize = 12;

/// What a sweep left over is solved to this share of it: the next sweep says what the first samples got wrong, which
/// is more.
const SOLVED: f64 = 0.1;
/// A correction that leaves more than this share of what was left over does not help.
const HELPFUL: f64 = 0.5;
/// What is left over reaches this many times as much as direct light does, where that is less than the worst case of
/// the brightest material everywhere.
const AMPLIFIED: f64 = 3.0;

/// A sweep with all samples.
pub(super) struct Sweep {
    /// What every leaf sends on.
    radiosity: Vec<[f64; 3]>,
    forms: Vec<Form>,
    /// What is gathered, and half the difference of the halves, in [`super::slots::Slots`].
    gathered: Vec<[f64; 3]>,
    apart: Vec<[f64; 3]>,
    done: usize,
}

/// What a sweep left over, on its way.
pub(super) struct Left {
    gmres: Box<Gmres<3>>,
    /// Half the difference of the halves in that sweep.
    apart: Vec<[f64; 3]>,
    /// The residual at which the solve ends, and the most steps.
    wanted: f64,
    most: usize,
}

/// The scatter on its way.
pub(super) struct Spread {
    gmres: Box<Gmres<3>>,
    /// Scatter of each row, and the sum of squares of what others pass on.
    apart: Vec<[f64; 3]>,
    passed: Vec<[f64; 3]>,
    pattern: u64,
    /// What the balance left open.
    unsolved: f64,
    /// Most steps.
    most: usize,
}

impl Sampled {
    /// Begins a sweep of the present solution.
    pub(super) fn start_sweeping(&mut self) {
        let Scratch { values, mut forms } = std::mem::take(&mut self.scratch);
        let mut radiosity = self.direct_light(values);
        let direct = self.integral_of_direct();
        self.add_indirect(&self.indirect, &mut radiosity);
        self.amplification = 1.0 / (1.0 - self.highest_reflectance());
        if self.corrections > 0 && direct > 0.0 {
            let seen = AMPLIFIED * self.integral(&radiosity) / direct;
            self.amplification = self.amplification.min(seen.max(1.0));
        }
        self.reflect(&mut radiosity, true);
        let empty = vec![[0.0; 3]; self.indirect.len()];
        field::bilinear(&self.forest, &radiosity, &mut forms);
        self.phase = Phase::Sweeping(Sweep { radiosity, forms, gathered: empty.clone(), apart: empty, done: 0 });
    }

    pub(super) fn sweep(&mut self, mut sweep: Sweep) -> Event {
        let (mut count, mut reads) = (0, 0);
        let most = if self.streaming { RAYS_A_STEP } else { READS_A_STEP };
        while sweep.done + count < self.gathers.len() && reads < most {
            reads += self.gathers[sweep.done + count].samples();
            count += 1;
        }
        let field = Field::new(&self.forest, &sweep.radiosity, &sweep.forms);
        let gathers = &self.gathers[sweep.done..sweep.done + count];
        let judged = par::map(count, |k| {
            let width = gathers[k].functions(&self.forest).len();
            let (mut out, mut apart) = (vec![[0.0; 3]; width], vec![[0.0; 3]; width]);
            let drawn_again = self.complete(sweep.done + k);
            let verdict = drawn_again.as_ref().unwrap_or(&gathers[k]).judge(&field, &mut out, &mut apart);
            (verdict, out, apart)
        });
        for (k, (verdict, out, apart)) in (sweep.done..).zip(judged) {
            self.verdicts[k] = verdict;
            sweep.gathered[self.slots.range(k)].copy_from_slice(&out);
            sweep.apart[self.slots.range(k)].copy_from_slice(&apart);
        }
        sweep.done += count;
        let event = Event::Gathering { done: sweep.done, total: self.gathers.len() };
        if sweep.done < self.gathers.len() {
            self.phase = Phase::Sweeping(sweep);
        } else {
            self.statistics.iterations += 1;
            self.correct(sweep);
        }
        event
    }

    /// A gathering element with all its samples, if some are not stored: these are drawn again.
    fn complete(&self, k: usize) -> Option<Gather> {
        let gather = &self.gathers[k];
        let draw = gather.missing(k as u32)?;
        Some(gather.completed(gather::cast(&self.kernel, &self.forest, gather, &draw)))
    }

    /// Solves for what a sweep left over, or goes on if that is little.
    fn correct(&mut self, sweep: Sweep) {
        self.scratch = Scratch { values: sweep.radiosity, forms: sweep.forms };
        if self.whole <= 0.0 {
            // lamps that are known may bring nothing
            self.whole = self.integral_of_direct() + self.integral_of_gathered(&sweep.gathered);
        }
        let pairs = sweep.gathered.iter().zip(&self.indirect);
        let residual = pairs.map(|(g, i)| std::array::from_fn(|c| g[c] - i[c])).collect();
        let gmres = Gmres::new(self.indirect.clone(), residual, self.weights());
        let left = self.relative(gmres.residual());
        // the first samples may miss what matters, such as the one bright spot among them
        self.thorough |= self.corrections > 0 && left > HELPFUL * self.left;
        self.left = left;
        if left > self.wanted() && self.corrections < MOST_CORRECTIONS {
            let wanted = (SOLVED * left).max(0.3 * self.wanted());
            let most = self.krylov_vectors(RESTART);
            self.phase = Phase::Solving(Left { gmres: Box::new(gmres), apart: sweep.apart, wanted, most });
            return;
        }
        self.take(sweep.gathered, sweep.apart, left);
    }

    /// Takes what a sweep gathered for the solution; `left` over is what all reflections make no more of than the
    /// amplification.
    fn take(&mut self, gathered: Vec<[f64; 3]>, apart: Vec<[f64; 3]>, left: f64) {
        self.corrections = 0;
        self.statistics.residual = left;
        self.indirect = gathered;
        let passed = vec![[0.0; 3]; self.indirect.len()];
        self.start_spreading(apart, passed, 0, left * self.amplification);
    }

    pub(super) fn solve(&mut self, mut left: Left) -> Event {
        let gmres = &mut left.gmres;
        let (now, wanted) = (self.relative(gmres.residual()), left.wanted);
        let direction = gmres.direction().filter(|_| now > wanted && gmres.steps() < left.most);
        let Some(direction) = direction else {
            self.corrections += 1;
            self.indirect = gmres.solution();
            self.start_sweeping();
            return Event::Iterated { iterations: self.statistics.iterations, residual: now, wanted };
        };
        let product = self.apply(direction);
        self.statistics.iterations += 1;
        if gmres.steps() == 0 {
            // the light that was gathered contains the residual: what it lacks is what others reflect of that, which
            // is less, for light that scatters evens out
            let lengths = gmres.residual();
            let passed = direction.iter().zip(&product).map(|(x, p)| std::array::from_fn(|c| x[c] - p[c]));
            let passed: Vec<[f64; 3]> = passed.collect();
            let passed = norm(&self.weights(), &passed);
            let lacking = self.relative(std::array::from_fn(|c| lengths[c] * passed[c]));
            if lacking <= self.wanted() && self.corrections > 0 {
                let gathered = self.indirect.iter().zip(direction);
                let gathered = gathered.map(|(i, x)| std::array::from_fn(|c| i[c] + lengths[c] * x[c])).collect();
                self.take(gathered, left.apart, lacking);
                return Event::Iterated { iterations: self.statistics.iterations, residual: lacking, wanted };
            }
        }
        gmres.supply(product);
        let residual = self.relative(gmres.residual());
        self.phase = Phase::Solving(left);
        Event::Iterated { iterations: self.statistics.iterations, residual, wanted }
    }

    /// x - K r x with the first samples.
    fn apply(&mut self, x: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut product = self.pass_on(x);
        for (p, x) in product.iter_mut().zip(x) {
            (0..3).for_each(|c| p[c] = x[c] - p[c]);
        }
        product
    }

    /// K r x with the first samples, or with all where these do not help.
    fn pass_on(&mut self, x: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let Scratch { mut values, mut forms } = std::mem::take(&mut self.scratch);
        values.clear();
        values.resize(self.forest.len() * self.forest.stride(), [0.0; 3]);
        self.add_indirect(x, &mut values);
        self.reflect(&mut values, false);
        field::bilinear(&self.forest, &values, &mut forms);
        let field = Field::new(&self.forest, &values, &forms);
        let mut out = vec![[0.0; 3]; self.slots.len()];
        par::for_each(self.slots.chunks(GATHERS_A_TASK, &mut out), |(first, mut rest)| {
            for (k, gather) in (first..).zip(&self.gathers[first..]) {
                let (own, others) = rest.split_at_mut(gather.functions(&self.forest).len().min(rest.len()));
                if own.is_empty() {
                    break;
                }
                if self.thorough {
                    self.complete(k).as_ref().unwrap_or(gather).gather(&field, true, own);
                } else {
                    gather.gather(&field, false, own);
                }
                rest = others;
            }
        });
        self.scratch = Scratch { values, forms };
        out
    }

    /// Begins with a pattern of signs for the scatter.
    fn start_spreading(&mut self, apart: Vec<[f64; 3]>, passed: Vec<[f64; 3]>, pattern: u64, unsolved: f64) {
        let mut signed = apart.clone();
        for (k, gather) in self.gathers.iter().enumerate() {
            let key = self.forest.node(gather.node).cell.key;
            if seed::unit(seed::combine(key, pattern)) < 0.5 {
                signed[self.slots.range(k)].iter_mut().flatten().for_each(|v| *v = -*v);
            }
        }
        let right = self.pass_on(&signed);
        self.statistics.iterations += 1;
        let start = vec![[0.0; 3]; right.len()];
        let most = self.krylov_vectors(SPREAD_STEPS);
        let gmres = Box::new(Gmres::new(start, right, self.weights()));
        self.phase = Phase::Spreading(Spread { gmres, apart, passed, pattern, unsolved, most });
    }

    pub(super) fn spread(&mut self, mut spread: Spread) -> Event {
        let size = |v: [f64; 3]| v.iter().sum::<f64>();
        let scatter = size(norm(&self.weights(), &spread.apart));
        let open = size(spread.gmres.residual()) > SPREAD_TOLERANCE * scatter && spread.gmres.steps() < spread.most;
        if let Some(direction) = spread.gmres.direction().filter(|_| open) {
            let product = self.apply(direction);
            spread.gmres.supply(product);
            self.statistics.iterations += 1;
            let (iterations, residual) = (self.statistics.iterations, self.statistics.residual);
            self.phase = Phase::Spreading(spread);
            return Event::Iterated { iterations, residual, wanted: residual };
        }
        for (sum, v) in spread.passed.iter_mut().zip(spread.gmres.solution()) {
            (0..3).for_each(|c| sum[c] += v[c] * v[c]);
        }
        let (patterns, factor) = if self.gathers.len() > MANY { (1, ONE_FOR_ALL) } else { (PATTERNS, 1.0) };
        if spread.pattern + 1 < patterns {
            self.start_spreading(spread.apart, spread.passed, spread.pattern + 1, spread.unsolved);
            let (iterations, residual) = (self.statistics.iterations, self.statistics.residual);
            return Event::Iterated { iterations, residual, wanted: residual };
        }
        let root = |s: f64| factor * (s / patterns as f64).sqrt();
        let passed: Vec<[f64; 3]> = spread.passed.iter().map(|s| s.map(root)).collect();
        self.settle(&spread.apart, &passed);
        self.judge(spread.unsolved)
    }

    /// What all this says of each element: the field that is shown, and its scatter.
    fn settle(&mut self, apart: &[[f64; 3]], passed: &[[f64; 3]]) {
        let noise = |k: usize| self.verdicts[k].noise.hypot(self.verdicts[k].misfit.max(0.0).sqrt());
        let fields: [&[[f64; 3]]; 2] = [&self.indirect, apart];
        let values = std::mem::take(&mut self.scratch.values);
        let mut irradiance = self.direct_light(values);
        let mut scatter = Vec::with_capacity(self.gathers.len());
        let gathers = (&self.gathers[..], &self.slots);
        stitch::stitched(&self.forest, gathers, fields, noise, |k, functions, [smooth, apart]| {
            let node = self.gathers[k].node;
            self.add_at(node, functions, smooth, &mut irradiance);
            scatter.push(gather::size_of(self.forest.basis_of(node), apart));
        });
        self.push_to_leaves(&mut irradiance);
        // elements that met nothing bright may just have missed it: they are as uncertain as others were at first
        let (mut area, mut square) = (0.0, 0.0);
        for (gather, verdict) in self.gathers.iter().zip(&self.verdicts) {
            let measure = self.forest.node(gather.node).measure;
            area += measure;
            square += measure * verdict.per_direction.powi(2);
        }
        let usual = if area > 0.0 { square / area } else { 0.0 };
        let seldom = if self.lamps.are_all(&self.scene) { 1.0 } else { SELDOM };
        for (k, verdict) in self.verdicts.iter_mut().enumerate() {
            let basis = self.forest.basis_of(self.gathers[k].node);
            let passed = gather::size_of(basis, &passed[self.slots.range(k)]);
            let (scatter, square) = (seldom * scatter[k].hypot(passed), seldom * seldom);
            let (misfit, certainty) = (square * verdict.misfit, square * verdict.certainty);
            *verdict = Verdict { scatter, misfit, certainty, ..*verdict };
            verdict.doubt(usual, f64::from(self.gathers[k].drawn));
        }
        positive::keep_positive(&self.forest, &mut irradiance);
        self.scratch.values = std::mem::replace(&mut self.irradiance, irradiance);
    }

    /// Weights of the coefficients of the gathers in inner products: counted areas.
    fn weights(&self) -> Vec<f64> {
        let mut weights = vec![0.0; self.slots.len()];
        for (k, gather) in self.gathers.iter().enumerate() {
            let node = self.forest.node(gather.node);
            let basis = self.forest.basis_of(gather.node);
            if self.counts(node.cell.root) {
                let share = if basis.is_nested() { node.measure } else { node.measure / basis.len() as f64 };
                weights[self.slots.range(k)].fill(share);
            }
        }
        weights
    }

    fn highest_reflectance(&self) -> f64 {
        self.scene.materials.iter().map(|m| m.reflectance.max()).fold(0.0, f64::max)
    }

    /// Residual at which a solve ends: no finer than the present error needs, which is refined anyway.
    fn wanted(&self) -> f64 {
        UNSOLVED * self.precision / self.amplification
    }

    /// Residual relative to the whole irradiance.
    fn relative(&self, residual: [f64; 3]) -> f64 {
        let r = residual.iter().sum::<f64>() * self.counted_area.sqrt();
        if self.whole > 0.0 { r / self.whole } else { 0.0 }
    }
}
