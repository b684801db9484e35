//! The open basis: semi-orthogonal cubic B-spline wavelets on an interval with quadruple end knots (A.2).
//!
//! `n` spans carry `n + 3` B-splines, which reproduce every cubic up to the ends. One level coarser, every second knot
//! is dropped (an odd last span stays, short); each wavelet is orthogonal to all coarser B-splines. On uniform knots
//! with at least 16 fine spans the wavelets are those of A.2 (with the corrected g_-1); everywhere else each is the
//! null vector of the orthogonality conditions on the shortest window of consecutive fine coefficients that has one,
//! found exactly. Synthesis is a banded matrix, analysis a banded solve, both in linear time.

use crate::banded::BandedLu;
use crate::coefficient::Scalar;
use crate::exact::{BigRational, ratio, to_f64};
use crate::piecewise::Piecewise;
use crate::rung::Kind;
use crate::sparse::Sparse;
use num_traits::{One, Signed, Zero};

/// How the wavelets of the open basis are scaled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum OpenColumns {
    /// Columns of Euclidean length 1 (condition number of a level 6.6).
    #[default]
    Unit,
    /// The numbers of A.2; window wavelets with largest coefficient 1.
    Printed,
}

/// The breaks (different knots) of an open cubic spline space, in units of the finest span.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OpenKnots {
    breaks: Vec<i64>,
}

impl OpenKnots {
    /// `n` spans of width 1.
    ///
    /// # Panics
    /// If `n` is 0.
    pub fn uniform(n: usize) -> OpenKnots {
        assert!(n > 0, "an open spline needs a span");
        OpenKnots { breaks: (0..=n as i64).collect() }
    }

    /// Number of spans.
    pub fn spans(&self) -> usize {
        self.breaks.len() - 1
    }

    /// The breaks.
    pub fn breaks(&self) -> &[i64] {
        &self.breaks
    }

    /// Every second knot dropped; the last break stays.
    pub fn coarser(&self) -> OpenKnots {
        let n = self.spans();
        OpenKnots { breaks: (0..=n).filter(|i| i % 2 == 0 || *i == n).map(|i| self.breaks[i]).collect() }
    }

    /// Knot `i` of the full sequence, `i` from -3; the ends are repeated four times.
    fn knot(&self, i: isize) -> i64 {
        self.breaks[i.clamp(0, self.spans() as isize) as usize]
    }

    /// B-spline `j` of `spans + 3`, exact.
    ///
    /// # Panics
    /// If there is no such function.
    pub fn function(&self, j: usize) -> Piecewise {
        assert!(j < self.spans() + 3, "function {j} of {}", self.spans() + 3);
        let knots: Vec<i64> = (0..5).map(|k| self.knot(j as isize - 3 + k)).collect();
        Piecewise::bspline(&knots)
    }

    /// Exact Gram matrix of derivatives, row-major: entry `(i, j)` is `int D^a B_i D^a B_j`.
    pub fn gram(&self, derivative: usize) -> Vec<Vec<BigRational>> {
        let functions: Vec<_> =
            (0..self.spans() + 3).map(|j| (0..derivative).fold(self.function(j), |f, _| f.derivative())).collect();
        functions.iter().map(|f| functions.iter().map(|g| f.inner(g)).collect()).collect()
    }

    /// Leading spans as wide as the first.
    fn uniform_spans(&self) -> usize {
        let width = self.breaks[1] - self.breaks[0];
        self.breaks.windows(2).take_while(|w| w[1] - w[0] == width).count()
    }

    /// Coefficients of coarse B-spline `k` in the fine ones: `(first fine index, values)`.
    fn insertion(&self, coarse: &OpenKnots, k: usize) -> (usize, Vec<BigRational>) {
        let f = |i: isize| coarse.knot(k as isize - 3 + i);
        // Fine functions whose support lies in that of the coarse one.
        let mut out = Vec::new();
        let mut first = None;
        for j in (2 * k).saturating_sub(4)..(2 * k + 5).min(self.spans() + 3) {
            let u: Vec<i64> = (1..=3).map(|i| self.knot(j as isize - 3 + i)).collect();
            // The blossom is taken on any fine span inside the support of j, as a span of the coarse knots.
            let span = (0..4)
                .map(|i| (self.knot(j as isize - 3 + i), self.knot(j as isize - 2 + i)))
                .find(|s| s.0 < s.1)
                .map_or(0, |s| s.0);
            let v = blossom(coarse, k, &u, span);
            if !v.is_zero() || first.is_some() {
                first.get_or_insert(j);
                out.push(v);
            }
        }
        while out.last().is_some_and(Zero::is_zero) {
            out.pop();
        }
        debug_assert!(f(0) < f(4));
        (first.unwrap_or(0), out)
    }
}

/// Blossom at `u` of coarse B-spline `k` (as a cubic) on the coarse span that holds `at`: de Boor's algorithm.
fn blossom(coarse: &OpenKnots, k: usize, u: &[i64], at: i64) -> BigRational {
    let span = (0..coarse.spans()).rev().find(|&i| coarse.breaks[i] <= at).unwrap_or(0) as isize;
    // Coefficients of the four functions alive on the span: indices span .. span + 3.
    let mut d: Vec<BigRational> = (0..4).map(|i| ratio(i64::from(span + i == k as isize), 1)).collect();
    for (r, &x) in u.iter().enumerate() {
        for i in (r + 1..4).rev() {
            // Function index span + i has knots starting at span + i - 3.
            let lo = coarse.knot(span + i as isize - 3);
            let hi = coarse.knot(span + i as isize - r as isize);
            let a = ratio(x - lo, hi - lo);
            d[i] = (BigRational::one() - &a) * &d[i - 1] + &a * &d[i];
        }
    }
    d.swap_remove(3)
}

/// A wavelet: first fine index and coefficients.
type Column = (usize, Vec<f64>);

fn rounded(exact: &[BigRational]) -> Vec<f64> {
    exact.iter().map(to_f64).collect()
}

/// Away from the ends of uniform knots. The numerators are exact, so this is the nearest f64 of each entry.
fn interior_wavelet() -> Vec<f64> {
    [-1, 124, -1677, 7904, -18482, 24264, -18482, 7904, -1677, 124, -1].map(|c| f64::from(c) / 40320.0).to_vec()
}

/// The boundary columns g_-3, g_-2, g_-1 of A.2, with the corrected g_-1.
pub fn boundary_wavelets() -> [Vec<BigRational>; 3] {
    let column = |d: i64, c: &[i64], tail: &[i64]| -> Vec<BigRational> {
        let head = c.iter().map(|&c| ratio(c, d));
        head.chain(tail.iter().map(|&t| ratio(t, 1))).map(|x| x / ratio(40320, 1)).collect()
    };
    let a = [1_136_914_560, -1_655_323_200, 1_321_223_960, -633_094_403, 229_000_092, -46_819_570];
    // Fourth entry -498772701/27877 = -3491408907/195139.
    let b = [-2_387_315_040, 2_141_121_840, 878_161_880, -3_491_408_907, 4_726_413_628, -3_606_490_941];
    let c = [123_066_720, -2_226_000, 188_427_680, -2_293_928_091, 10_796_884_084, -25_245_914_869];
    [
        column(27_877, &a, &[124, -1]),
        column(195_139, &b, &[7904, -1677, 124, -1]),
        column(1_365_973, &c, &[24264, -18482, 7904, -1677, 124, -1]),
    ]
}

/// The wavelets between `fine` and its coarser knots.
fn wavelets(fine: &OpenKnots) -> Vec<Column> {
    let n = fine.spans();
    let coarse = fine.coarser();
    let uniform = fine.uniform_spans();
    if uniform == n && n.is_multiple_of(2) && n >= 16 {
        let boundary = boundary_wavelets().map(|g| rounded(&g));
        let mut out: Vec<Column> = boundary.clone().map(|g| (0, g)).to_vec();
        out.extend((0..n / 2 - 6).map(|j| (2 * j + 3, interior_wavelet())));
        let right = boundary.map(|mut g| {
            g.reverse();
            (n + 3 - g.len(), g)
        });
        out.extend(right.into_iter().rev());
        return out;
    }
    // dim of the wavelets supported on the fine functions s.. : functions minus conditions.
    let total = n + 3;
    let span_of = |x: i64| coarse.breaks.partition_point(|&b| b <= x).clamp(1, coarse.spans()) - 1;
    let conditions = |s: usize, c: usize| {
        let (from, to) = (fine.knot(s as isize - 3), fine.knot((s + c) as isize));
        let last = coarse.breaks.partition_point(|&b| b < to).max(1) - 1;
        (span_of(from), last.min(coarse.spans() - 1) + 3)
    };
    let free = |s: usize, c: usize| {
        let (a, b) = conditions(s, c);
        (c + a).saturating_sub(b + 1)
    };
    let free_from = |s: usize| if s < total { free(s, total - s) } else { 0 };
    let mut out = Vec::new();
    for s in 0..total {
        if free_from(s) == free_from(s + 1) {
            continue;
        }
        // Interior of uniform knots: the known wavelet.
        if s >= 3 && s % 2 == 1 && s + 14 <= n && s + 11 <= uniform {
            out.push((s, interior_wavelet()));
            continue;
        }
        let c = (1..=total - s).find(|&c| free(s, c) == 1).unwrap_or(total - s);
        let (a, b) = conditions(s, c);
        let functions: Vec<_> = (s..s + c).map(|j| fine.function(j)).collect();
        let rows = (a..=b)
            .map(|k| {
                let coarse = coarse.function(k);
                functions.iter().map(|f| f.inner(&coarse)).collect()
            })
            .collect();
        out.push((s, rounded(&null_vector(rows, c))));
    }
    out
}

/// The null vector of a matrix with one, largest entry 1.
fn null_vector(mut rows: Vec<Vec<BigRational>>, n: usize) -> Vec<BigRational> {
    let mut pivots = Vec::new();
    let mut r = 0;
    for c in 0..n {
        let Some(p) = (r..rows.len()).find(|&i| !rows[i][c].is_zero()) else { continue };
        rows.swap(r, p);
        let d = rows[r][c].clone();
        rows[r].iter_mut().for_each(|x| *x /= &d);
        let lead = rows[r].clone();
        for (i, row) in rows.iter_mut().enumerate() {
            if i != r && !row[c].is_zero() {
                let f = row[c].clone();
                row.iter_mut().zip(&lead).for_each(|(x, l)| *x -= &f * l);
            }
        }
        pivots.push(c);
        r += 1;
    }
    let free = (0..n).find(|c| !pivots.contains(c)).unwrap_or(n - 1);
    let mut x = vec![BigRational::zero(); n];
    x[free] = BigRational::one();
    for (i, &c) in pivots.iter().enumerate() {
        x[c] = -rows[i][free].clone();
    }
    let largest = x.iter().max_by_key(|v| v.abs()).cloned().unwrap_or_else(BigRational::one);
    x.iter_mut().for_each(|v| *v /= &largest);
    x
}

/// One level of the open basis.
#[derive(Clone, Debug)]
pub(crate) struct Solved {
    smooth: usize,
    detail: usize,
    /// Synthesis and its transpose; columns smooth then detail.
    synthesis: Sparse,
    transposed: Sparse,
    /// Factors of the synthesis with its columns in the order of their middles.
    lu: BandedLu,
    /// `order[i]`: the column at place `i` of the factored matrix.
    order: Vec<usize>,
}

impl Solved {
    /// The level between `fine` and its coarser knots.
    pub(crate) fn new(fine: &OpenKnots, columns: OpenColumns) -> Solved {
        let coarse = fine.coarser();
        let (n, m) = (fine.spans() + 3, coarse.spans() + 3);
        let mut all: Vec<(usize, Vec<f64>)> = Vec::with_capacity(n);
        let inner = [1.0, 4.0, 6.0, 4.0, 1.0].map(|x| x / 8.0).to_vec();
        let uniform = fine.uniform_spans();
        for k in 0..m {
            let plain = k >= 3 && 2 * k + 3 <= uniform;
            if plain {
                all.push((2 * k - 3, inner.clone()));
            } else {
                let (first, c) = fine.insertion(&coarse, k);
                all.push((first, rounded(&c)));
            }
        }
        for (first, mut c) in wavelets(fine) {
            if columns == OpenColumns::Unit {
                let norm = c.iter().map(|x| x * x).sum::<f64>().sqrt();
                c.iter_mut().for_each(|x| *x /= norm);
            }
            all.push((first, c));
        }
        let triplets = all
            .iter()
            .enumerate()
            .flat_map(|(k, (first, c))| c.iter().enumerate().map(move |(i, &v)| (first + i, k, v)))
            .collect();
        let synthesis = Sparse::from_triplets(n, n, triplets);
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by_key(|&k| 2 * all[k].0 + all[k].1.len());
        let mut place = vec![0; n];
        order.iter().enumerate().for_each(|(i, &k)| place[k] = i);
        let rows: Vec<Vec<_>> =
            (0..n).map(|r| synthesis.row(r).iter().map(|&(c, v)| (place[c], v)).collect()).collect();
        let lu = BandedLu::new(&rows).expect("coarse splines and wavelets span the fine splines");
        Solved { smooth: m, detail: n - m, transposed: synthesis.transposed(), synthesis, lu, order }
    }

    pub(crate) fn smooth(&self) -> usize {
        self.smooth
    }

    pub(crate) fn detail(&self) -> usize {
        self.detail
    }

    pub(crate) fn synthesis_matrix(&self) -> Sparse {
        self.synthesis.clone()
    }

    pub(crate) fn up<S: Scalar>(&self, kind: Kind, fine: &[S], smooth: &mut [S], detail: &mut [S], channels: usize) {
        let split = self.smooth * channels;
        match kind {
            Kind::Coefficients => {
                let mut x = fine.to_vec();
                self.lu.solve(&mut x, channels);
                for (value, &k) in x.chunks_exact(channels).zip(&self.order) {
                    let at = k * channels;
                    let out = if at < split { &mut smooth[at..] } else { &mut detail[at - split..] };
                    out[..channels].copy_from_slice(value);
                }
            }
            Kind::Basis => {
                let mut x = vec![S::default(); fine.len()];
                self.transposed.times_into(fine, &mut x, channels);
                smooth.copy_from_slice(&x[..split]);
                detail.copy_from_slice(&x[split..]);
            }
        }
    }

    pub(crate) fn down<S: Scalar>(&self, kind: Kind, smooth: &[S], detail: &[S], fine: &mut [S], channels: usize) {
        let both = [smooth, detail].concat();
        match kind {
            Kind::Coefficients => self.synthesis.times_into(&both, fine, channels),
            Kind::Basis => {
                for (out, &k) in fine.chunks_exact_mut(channels).zip(&self.order) {
                    out.copy_from_slice(&both[k * channels..(k + 1) * channels]);
                }
                self.lu.solve_transposed(fine, channels);
            }
        }
    }
}
