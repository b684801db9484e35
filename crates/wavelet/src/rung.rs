//! One step of the ladder: `V_{i+1} = V_i + W_i`, with its four verbs.
//!
//! A [`Rung`] joins `n` fine coefficients to `ceil(n/2)` smooth and `floor(n/2)` detail ones (the open basis: see
//! [`crate::open`]). Its definition is a pair of sparse matrices, synthesis and analysis; its verbs are fast passes.

use crate::coefficient::{Coefficient, Scalar};
use crate::extension::Extension;
use crate::lifted::{Lifted, Scratch};
use crate::lifting::analysis_filters;
use crate::open::Solved;
use crate::sparse::Sparse;
use crate::tree::TreeFamily;

/// What is transformed: coefficients of a function, or the basis functions themselves (equally, dual coefficients).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Coefficients: `coef_xform_up` is the analysis, `coef_xform_down` the synthesis (Eqs. 27, 29).
    Coefficients,
    /// Basis functions: `basis_xform_up` is the transpose of the synthesis, `basis_xform_down` that of the analysis
    /// (Eqs. 15, 16, 19, 50).
    Basis,
}

/// One level of a ladder.
///
/// ```
/// use ondelette_wavelet::{Kind, Rung, TreeFamily};
/// let rung = Rung::tree(&TreeFamily::haar(), 1);
/// let (mut smooth, mut detail) = ([0.0], [0.0]);
/// rung.up(Kind::Coefficients, &[5.0, 3.0], &mut smooth, &mut detail);
/// assert_eq!((smooth, detail), ([4.0], [1.0]));
/// let mut fine = [0.0; 2];
/// rung.down(Kind::Coefficients, &smooth, &detail, &mut fine);
/// assert_eq!(fine, [5.0, 3.0]);
/// ```
#[derive(Clone, Debug)]
pub struct Rung {
    pub(crate) engine: Engine,
}

#[derive(Clone, Debug)]
pub(crate) enum Engine {
    Lifted(Lifted),
    Block(Block),
    Solved(Box<Solved>),
}

/// A tree block repeated over the cells of a level.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    cells: usize,
    order: usize,
    primal: Vec<f64>,
    dual: Vec<f64>,
}

impl Rung {
    /// The rung of a tree family onto `cells` coarse cells.
    pub fn tree(family: &TreeFamily, cells: usize) -> Rung {
        let (order, primal, dual) = (family.order(), family.primal().to_vec(), family.dual().to_vec());
        if family.kind() == crate::tree::TreeKind::Haar {
            let scheme = crate::lifting::haar();
            return Rung::lifted(2 * cells, Extension::Periodic, scheme);
        }
        Rung { engine: Engine::Block(Block { cells, order, primal, dual }) }
    }

    pub(crate) fn lifted(n: usize, extension: Extension, scheme: crate::lifting::Scheme<f64>) -> Rung {
        Rung { engine: Engine::Lifted(Lifted { n, extension, scheme }) }
    }

    /// Number of fine coefficients.
    pub fn fine(&self) -> usize {
        self.smooth() + self.detail()
    }

    /// Number of smooth coefficients.
    pub fn smooth(&self) -> usize {
        match &self.engine {
            Engine::Lifted(l) => l.n.div_ceil(2),
            Engine::Block(b) => b.cells * b.order,
            Engine::Solved(s) => s.smooth(),
        }
    }

    /// Number of detail coefficients.
    pub fn detail(&self) -> usize {
        match &self.engine {
            Engine::Lifted(l) => l.n / 2,
            Engine::Block(b) => b.cells * b.order,
            Engine::Solved(s) => s.detail(),
        }
    }

    /// Towards coarser: fine to smooth and detail. Linear time.
    ///
    /// # Panics
    /// If a length does not fit.
    #[track_caller]
    pub fn up<C: Coefficient>(&self, kind: Kind, fine: &[C], smooth: &mut [C], detail: &mut [C]) {
        self.check(fine.len(), smooth.len(), detail.len());
        self.engine.up(kind, C::flat(fine), C::flat_mut(smooth), C::flat_mut(detail), C::CHANNELS);
    }

    /// Towards finer: smooth and detail to fine. Linear time.
    ///
    /// # Panics
    /// If a length does not fit.
    #[track_caller]
    pub fn down<C: Coefficient>(&self, kind: Kind, smooth: &[C], detail: &[C], fine: &mut [C]) {
        self.check(fine.len(), smooth.len(), detail.len());
        self.engine.down(kind, C::flat(smooth), C::flat(detail), C::flat_mut(fine), C::CHANNELS);
    }

    /// The synthesis matrix: `fine = S [smooth; detail]`, the definition of the rung.
    pub fn synthesis(&self) -> Sparse {
        match &self.engine {
            Engine::Lifted(l) => l.synthesis_matrix(),
            Engine::Block(b) => b.matrix(&b.primal),
            Engine::Solved(s) => s.synthesis_matrix(),
        }
    }

    /// The analysis matrix `[smooth; detail] = A fine`, the inverse of [`Rung::synthesis`]; `None` where it is not
    /// sparse (the semi-orthogonal basis, whose analysis solves a banded system).
    pub fn analysis(&self) -> Option<Sparse> {
        match &self.engine {
            Engine::Lifted(l) => Some(l.analysis_matrix()),
            Engine::Block(b) => Some(b.matrix(&b.dual).transposed()),
            Engine::Solved(_) => None,
        }
    }

    #[track_caller]
    fn check(&self, fine: usize, smooth: usize, detail: usize) {
        let own = (self.fine(), self.smooth(), self.detail());
        assert!(
            own == (fine, smooth, detail),
            "rung of (fine, smooth, detail) {own:?} got {:?}",
            (fine, smooth, detail)
        );
    }
}

impl Engine {
    /// [`Rung::up`] on `channels` interleaved numbers.
    pub(crate) fn up<S: Scalar>(&self, kind: Kind, fine: &[S], smooth: &mut [S], detail: &mut [S], channels: usize) {
        match self {
            Engine::Lifted(l) if channels == 1 => l.up(kind).up(fine, smooth, detail, &mut Scratch::default()),
            Engine::Lifted(l) => {
                let program = l.up(kind);
                let mut scratch = Scratch::default();
                let [mut plane, mut halves] = [(); 2].map(|()| vec![S::default(); l.n]);
                let (s, d) = halves.split_at_mut(smooth.len() / channels);
                for c in 0..channels {
                    take_channel(fine, &mut plane, c, channels);
                    program.up(&plane, s, d, &mut scratch);
                    put_channel(s, smooth, c, channels);
                    put_channel(d, detail, c, channels);
                }
            }
            Engine::Block(b) => b.up(kind, fine, smooth, detail, channels),
            Engine::Solved(b) => b.up(kind, fine, smooth, detail, channels),
        }
    }

    /// [`Rung::down`] on `channels` interleaved numbers.
    pub(crate) fn down<S: Scalar>(&self, kind: Kind, smooth: &[S], detail: &[S], fine: &mut [S], channels: usize) {
        match self {
            Engine::Lifted(l) if channels == 1 => l.down(kind).down(smooth, detail, fine, &mut Scratch::default()),
            Engine::Lifted(l) => {
                let program = l.down(kind);
                let mut scratch = Scratch::default();
                let [mut plane, mut halves] = [(); 2].map(|()| vec![S::default(); l.n]);
                let (s, d) = halves.split_at_mut(smooth.len() / channels);
                for c in 0..channels {
                    take_channel(smooth, s, c, channels);
                    take_channel(detail, d, c, channels);
                    program.down(s, d, &mut plane, &mut scratch);
                    put_channel(&plane, fine, c, channels);
                }
            }
            Engine::Block(b) => b.down(kind, smooth, detail, fine, channels),
            Engine::Solved(b) => b.down(kind, smooth, detail, fine, channels),
        }
    }
}

/// Copies one channel of interleaved values into an array of its own.
pub(crate) fn take_channel<S: Scalar>(from: &[S], to: &mut [S], channel: usize, channels: usize) {
    for (t, f) in to.iter_mut().zip(from.chunks_exact(channels)) {
        *t = f[channel];
    }
}

/// The inverse of [`take_channel`].
pub(crate) fn put_channel<S: Scalar>(from: &[S], to: &mut [S], channel: usize, channels: usize) {
    for (f, t) in from.iter().zip(to.chunks_exact_mut(channels)) {
        t[channel] = *f;
    }
}

impl Lifted {
    /// Analysis by its filters and the continued index, entry by entry.
    fn analysis_matrix(&self) -> Sparse {
        let [h, g] = analysis_filters(&self.scheme);
        let (ns, nd) = Extension::split(self.n);
        let mut out = Vec::new();
        for k in 0..ns + nd {
            let ((first, taps), at) = if k < ns { (&h, k) } else { (&g, k - ns) };
            for (m, &v) in taps.iter().enumerate() {
                out.push((k, self.extension.fine(self.n, 2 * at as isize + first + m as isize), v));
            }
        }
        Sparse::from_triplets(self.n, self.n, out)
    }

    /// Synthesis by its filters and the continued indices of both halves.
    fn synthesis_matrix(&self) -> Sparse {
        let [h, g] = analysis_filters(&self.scheme.dual());
        let (ns, _) = Extension::split(self.n);
        let mut out = Vec::new();
        for p in 0..self.n {
            let p_ = p as isize;
            for (detail, (first, taps)) in [(false, &h), (true, &g)] {
                let last = first + taps.len() as isize - 1;
                for k in (p_ - last).div_euclid(2)..=(p_ - first).div_euclid(2) {
                    let m = p_ - 2 * k - first;
                    if m < 0 || m >= taps.len() as isize {
                        continue;
                    }
                    if detail {
                        let (i, sign) = self.extension.detail(self.n, k);
                        if sign != 0.0 {
                            out.push((p, ns + i, sign * taps[m as usize]));
                        }
                    } else {
                        out.push((p, self.extension.smooth(self.n, k), taps[m as usize]));
                    }
                }
            }
        }
        Sparse::from_triplets(self.n, self.n, out)
    }
}

impl Block {
    fn block<S: Scalar>(&self, primal: bool) -> Vec<S> {
        if primal { &self.primal } else { &self.dual }.iter().map(|&x| S::from_f64(x)).collect()
    }

    pub(crate) fn up<S: Scalar>(&self, kind: Kind, fine: &[S], smooth: &mut [S], detail: &mut [S], channels: usize) {
        let (m, width) = (self.order, 2 * self.order);
        let matrix: Vec<S> = self.block(kind == Kind::Basis);
        let cell = m * channels;
        let halves = smooth.chunks_exact_mut(cell).zip(detail.chunks_exact_mut(cell));
        for (fine, (s, d)) in fine.chunks_exact(2 * cell).zip(halves) {
            for (r, out) in s.chunks_exact_mut(channels).chain(d.chunks_exact_mut(channels)).enumerate() {
                out.fill(S::default());
                for (&a, x) in matrix[r * width..].iter().zip(fine.chunks_exact(channels)) {
                    out.iter_mut().zip(x).for_each(|(o, &x)| *o += a * x);
                }
            }
        }
    }

    pub(crate) fn down<S: Scalar>(&self, kind: Kind, smooth: &[S], detail: &[S], fine: &mut [S], channels: usize) {
        let (m, width) = (self.order, 2 * self.order);
        let matrix: Vec<S> = self.block(kind == Kind::Coefficients);
        let cell = m * channels;
        let halves = smooth.chunks_exact(cell).zip(detail.chunks_exact(cell));
        for (fine, (s, d)) in fine.chunks_exact_mut(2 * cell).zip(halves) {
            fine.fill(S::default());
            for (r, x) in s.chunks_exact(channels).chain(d.chunks_exact(channels)).enumerate() {
                for (&a, out) in matrix[r * width..].iter().zip(fine.chunks_exact_mut(channels)) {
                    out.iter_mut().zip(x).for_each(|(o, &x)| *o += a * x);
                }
            }
        }
    }

    /// The transpose of `block` over all cells, coarse functions as columns: smooth first, then detail.
    fn matrix(&self, block: &[f64]) -> Sparse {
        let (m, width) = (self.order, 2 * self.order);
        let mut out = Vec::new();
        for cell in 0..self.cells {
            for r in 0..width {
                let col = if r < m { cell * m + r } else { self.cells * m + cell * m + r - m };
                for c in 0..width {
                    out.push((cell * width + c, col, block[r * width + c]));
                }
            }
        }
        Sparse::from_triplets(self.cells * width, self.cells * width, out)
    }
}
