//! Transforms of grids: standard and non-standard tensor products of pyramids (2.6), for 1 to 4 axes.

use std::ops::Range;

use crate::axis;
use crate::coefficient::{Coefficient, Scalar, first_not_finite};
use crate::decomposition::{Decomposition, blocks_of};
use crate::picture::{self, Band};
use crate::pyramid::{Pyramid, TransformError, check};
use crate::rung::{Engine, Kind, put_channel, take_channel};
use crate::spare::Spare;

/// How one-dimensional wavelets make functions of several variables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// Products of all functions of each axis (2.6.1); each axis in flat order.
    Standard,
    /// Products of functions of one level (2.6.2). In place: the leading corner is all-smooth, the trailing part of
    /// an axis is its detail.
    NonStandard,
}

/// A transform of grids, row-major, the last axis running fastest.
///
/// ```
/// use ondelette_wavelet::{Boundary, Family, Layout, Pyramid, Tensor};
/// let axis = |n| Pyramid::new("bspline".parse().unwrap(), Boundary::Mirrored, n, 3);
/// let tensor = Tensor::new(vec![axis(33)?, axis(20)?], Layout::NonStandard)?;
/// let picture: Vec<f32> = (0..33 * 20).map(|i| (i % 7) as f32).collect();
/// let mut wavelets = tensor.analyze(&picture)?;
/// wavelets.threshold(1e-3);
/// let back = tensor.synthesize(&wavelets)?;
/// assert!(picture.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-2));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Tensor {
    axes: Vec<Pyramid>,
    layout: Layout,
}

/// Why there is no such transform of grids.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TensorError {
    /// Not 1 to 4 axes.
    #[error("{0} axes; a tensor transform has 1 to 4")]
    Axes(usize),
    /// More values than memory can hold.
    #[error("a grid of {0:?} has more values than memory can hold")]
    Size(Vec<usize>),
    /// Axes of a non-standard transform with different levels.
    #[error("non-standard axes must have equally many levels, got {0:?}; ask for the least of them")]
    Levels(Vec<usize>),
}

impl Tensor {
    /// The transform with the given pyramid on each axis.
    ///
    /// # Errors
    /// Not 1 to 4 axes; axes of a non-standard transform with different numbers of levels; more values than memory can
    /// hold.
    pub fn new(axes: Vec<Pyramid>, layout: Layout) -> Result<Tensor, TensorError> {
        if !(1..=4).contains(&axes.len()) {
            return Err(TensorError::Axes(axes.len()));
        }
        let shape: Vec<_> = axes.iter().map(Pyramid::len).collect();
        let values = shape.iter().try_fold(1_usize, |n, &len| n.checked_mul(len));
        if values.is_none_or(|n| n > isize::MAX as usize / 64) {
            return Err(TensorError::Size(shape));
        }
        let levels: Vec<_> = axes.iter().map(Pyramid::levels).collect();
        if layout == Layout::NonStandard && levels.windows(2).any(|w| w[0] != w[1]) {
            return Err(TensorError::Levels(levels));
        }
        Ok(Tensor { axes, layout })
    }

    /// The pyramid of each axis.
    pub fn axes(&self) -> &[Pyramid] {
        &self.axes
    }

    /// Standard or non-standard.
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// Number of values on each axis.
    pub fn shape(&self) -> Vec<usize> {
        self.axes.iter().map(Pyramid::len).collect()
    }

    /// Number of values.
    pub fn len(&self) -> usize {
        self.axes.iter().map(Pyramid::len).product()
    }

    /// True for a transform without values (there is none).
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Coefficients to the wavelet basis.
    ///
    /// # Errors
    /// Wrong length; a value that is not finite.
    pub fn analyze<C: Coefficient>(&self, grid: &[C]) -> Result<Decomposition<C>, TransformError> {
        self.up(Kind::Coefficients, grid)
    }

    /// Wavelet coefficients to the finest level.
    ///
    /// # Errors
    /// Wrong length; a value that is not finite.
    pub fn synthesize<C: Coefficient>(&self, wavelets: &Decomposition<C>) -> Result<Vec<C>, TransformError> {
        self.down(Kind::Coefficients, wavelets)
    }

    /// Finest to wavelets, for coefficients or basis functions. Linear time.
    ///
    /// # Errors
    /// Wrong length; a value that is not finite.
    pub fn up<C: Coefficient>(&self, kind: Kind, grid: &[C]) -> Result<Decomposition<C>, TransformError> {
        let mut out = vec![C::default(); self.len()];
        self.up_into(kind, grid, &mut out)?;
        Ok(Decomposition::from_parts(self, out))
    }

    /// Wavelets to finest, for coefficients or basis functions. Linear time.
    ///
    /// # Errors
    /// Wrong length; a value that is not finite.
    pub fn down<C: Coefficient>(&self, kind: Kind, wavelets: &Decomposition<C>) -> Result<Vec<C>, TransformError> {
        let mut out = vec![C::default(); self.len()];
        self.down_into(kind, wavelets.values(), &mut out)?;
        Ok(out)
    }

    /// [`Tensor::up`] into a given slice, in the layout of [`Decomposition::values`].
    ///
    /// # Errors
    /// Wrong length; a value that is not finite (what `out` holds then means nothing).
    pub fn up_into<C: Coefficient>(&self, kind: Kind, grid: &[C], out: &mut [C]) -> Result<(), TransformError> {
        self.up_with(kind, grid, out, &mut Workspace::default())
    }

    /// [`Tensor::up_into`] with memory of an earlier call: saves the page faults of fresh memory, which for large
    /// grids cost as much as the arithmetic.
    ///
    /// # Errors
    /// Wrong length; a value that is not finite.
    pub fn up_with<C: Coefficient>(
        &self,
        kind: Kind,
        grid: &[C],
        out: &mut [C],
        work: &mut Workspace<C::Scalar>,
    ) -> Result<(), TransformError> {
        let n = self.len() * C::CHANNELS;
        self.check_len(C::flat(grid), n)?;
        self.check_len(C::flat(out), n)?;
        // In overlapping bases every sample reaches the coarsest smooth coefficients, and a value that is not finite
        // leaves none of them finite on its way: looking there saves a pass over the input.
        let lazy = self.overlaps();
        if !lazy {
            check(C::flat(grid), n)?;
        }
        self.by_channel(grid, out, |from, to| {
            match self.layout {
                Layout::Standard => self.standard_up(kind, from, to),
                Layout::NonStandard => self.nonstandard_up(kind, from, to, work),
            }
            self.scale(kind, to, false);
        });
        if lazy {
            let mut finite = true;
            let corner: Vec<_> = self.axes.iter().map(|a| 0..a.smooth_len(0)).collect();
            for_rows(&self.shape(), &corner, |row| {
                finite &= C::flat(&out[row]).iter().all(|v| v.to_f64().is_finite());
            });
            if !finite {
                // Finite input that overflowed is no error.
                check(C::flat(grid), n)?;
            }
        }
        Ok(())
    }

    /// [`Tensor::down`] into a given slice.
    ///
    /// # Errors
    /// Wrong length; a value that is not finite.
    pub fn down_into<C: Coefficient>(&self, kind: Kind, wavelets: &[C], out: &mut [C]) -> Result<(), TransformError> {
        self.down_with(kind, wavelets, out, &mut Workspace::default())
    }

    /// [`Tensor::down_into`] with memory of an earlier call.
    ///
    /// # Errors
    /// Wrong length; a value that is not finite.
    pub fn down_with<C: Coefficient>(
        &self,
        kind: Kind,
        wavelets: &[C],
        out: &mut [C],
        work: &mut Workspace<C::Scalar>,
    ) -> Result<(), TransformError> {
        let n = self.len() * C::CHANNELS;
        self.check_len(C::flat(wavelets), n)?;
        self.check_len(C::flat(out), n)?;
        // A coefficient that is not finite leaves none of the samples finite that its function reaches, and those are
        // two neighbours at least: every other row of the result tells.
        let lazy = self.overlaps() && self.axes.len() > 1;
        if !lazy {
            check(C::flat(wavelets), n)?;
        }
        let plain = self.axes.iter().all(|a| (0..=a.levels()).all(|i| a.heights().smooth(i) == 1.0));
        let plain = plain && self.axes.iter().all(|a| (0..a.levels()).all(|i| a.heights().detail(i) == 1.0));
        self.by_channel(wavelets, out, |from, to| {
            let mut unscaled;
            let from = if plain {
                from
            } else {
                unscaled = from.to_vec();
                self.scale(kind, &mut unscaled, true);
                &unscaled
            };
            match self.layout {
                Layout::Standard => self.standard_down(kind, from, to),
                Layout::NonStandard => self.nonstandard_down(kind, from, to, work),
            }
        });
        if lazy {
            let width = self.axes[self.axes.len() - 1].len();
            let mut rows = C::flat(out).chunks(width * C::CHANNELS).step_by(2);
            if rows.any(|row| first_not_finite(row).is_some()) {
                // Finite coefficients that overflowed are no error.
                check(C::flat(wavelets), n)?;
            }
        }
        Ok(())
    }

    /// Whether values that are not finite show in the result, so that the input needs no pass of its own.
    fn overlaps(&self) -> bool {
        self.axes.iter().all(|a| a.levels() > 0 && matches!(a.rung(0).engine, Engine::Lifted(_)))
    }

    fn check_len<S>(&self, x: &[S], want: usize) -> Result<(), TransformError> {
        if x.len() == want { Ok(()) } else { Err(TransformError::Length { got: x.len(), want }) }
    }

    /// Runs `f` on each channel as an array of its own.
    fn by_channel<C: Coefficient>(&self, from: &[C], to: &mut [C], mut f: impl FnMut(&[C::Scalar], &mut [C::Scalar])) {
        if C::CHANNELS == 1 {
            return f(C::flat(from), C::flat_mut(to));
        }
        let mut plane = vec![C::Scalar::default(); from.len()];
        let mut done = plane.clone();
        for c in 0..C::CHANNELS {
            take_channel(C::flat(from), &mut plane, c, C::CHANNELS);
            f(&plane, &mut done);
            put_channel(&done, C::flat_mut(to), c, C::CHANNELS);
        }
    }

    fn standard_up<S: Scalar>(&self, kind: Kind, from: &[S], to: &mut [S]) {
        to.copy_from_slice(from);
        let mut inner = self.len();
        for pyramid in &self.axes {
            let n = pyramid.len();
            inner /= n;
            for slab in to.chunks_mut(n * inner) {
                let mut now = slab.to_vec();
                for i in (0..pyramid.levels()).rev() {
                    let rung = pyramid.rung(i);
                    let mut next = vec![S::default(); rung.fine() * inner];
                    axis::up(rung, kind, &now, &mut next, inner);
                    let split = rung.smooth() * inner;
                    slab[split..next.len()].copy_from_slice(&next[split..]);
                    next.truncate(split);
                    now = next;
                }
                slab[..now.len()].copy_from_slice(&now);
            }
        }
    }

    fn standard_down<S: Scalar>(&self, kind: Kind, from: &[S], to: &mut [S]) {
        to.copy_from_slice(from);
        let mut inner = self.len();
        for pyramid in &self.axes {
            let n = pyramid.len();
            inner /= n;
            for slab in to.chunks_mut(n * inner) {
                for i in 0..pyramid.levels() {
                    let rung = pyramid.rung(i);
                    let len = rung.fine() * inner;
                    let now = slab[..len].to_vec();
                    axis::down(rung, kind, &now, &mut slab[..len], inner);
                }
            }
        }
    }

    fn levels(&self) -> usize {
        self.axes[0].levels()
    }

    fn level_shape(&self, level: usize) -> Vec<usize> {
        self.axes.iter().map(|a| a.smooth_len(level)).collect()
    }

    fn nonstandard_up<S: Scalar>(&self, kind: Kind, from: &[S], to: &mut [S], work: &mut Workspace<S>) {
        let shape = self.shape();
        let levels = self.levels();
        if levels == 0 {
            return to.copy_from_slice(from);
        }
        for level in (0..levels).rev() {
            let coarse_shape = self.level_shape(level);
            let (now, coarse) = work.turns.pair(levels - level, coarse_shape.iter().product());
            let now = if level + 1 == levels { from } else { now };
            let engines = self.axes.iter().map(|a| &a.rung(level).engine).collect::<Vec<_>>();
            if let [axis] = &self.axes[..] {
                let rung = axis.rung(level);
                rung.engine.up(kind, &now[..rung.fine()], coarse, &mut to[rung.smooth()..rung.fine()], 1);
            } else if let [Engine::Lifted(a), Engine::Lifted(b)] = engines[..] {
                picture::up_picture([&a.up(kind), &b.up(kind)], now, coarse, to, shape[1], &work.bands);
            } else {
                let fine_shape = self.level_shape(level + 1);
                let len: usize = fine_shape.iter().product();
                let all = self.split_level(level, &vec![kind; self.axes.len()], now[..len].to_vec());
                copy_box(&all, &fine_shape, to, &shape, &fine_shape);
                copy_box(&all, &fine_shape, coarse, &coarse_shape, &coarse_shape);
            }
            if level == 0 {
                copy_box(coarse, &coarse_shape, to, &shape, &coarse_shape);
            }
        }
    }

    fn nonstandard_down<S: Scalar>(&self, kind: Kind, from: &[S], to: &mut [S], work: &mut Workspace<S>) {
        let shape = self.shape();
        let levels = self.levels();
        if levels == 0 {
            return to.copy_from_slice(from);
        }
        let coarse_shape = self.level_shape(0);
        let (_, coarse) = work.turns.pair(levels, coarse_shape.iter().product());
        copy_box(from, &shape, coarse, &coarse_shape, &coarse_shape);
        for level in 0..levels {
            let fine_shape = self.level_shape(level + 1);
            let coarse_shape = self.level_shape(level);
            let last = level + 1 == levels;
            // The pair of the level above: what it calls its output is read here.
            let (coarse, fine) =
                work.turns.pair(levels - level - 1, if last { 0 } else { fine_shape.iter().product() });
            let fine = if last { &mut *to } else { fine };
            let coarse = &coarse[..coarse_shape.iter().product()];
            let engines = self.axes.iter().map(|a| &a.rung(level).engine).collect::<Vec<_>>();
            if let [axis] = &self.axes[..] {
                let rung = axis.rung(level);
                rung.engine.down(kind, coarse, &from[rung.smooth()..rung.fine()], fine, 1);
            } else if let [Engine::Lifted(a), Engine::Lifted(b)] = engines[..] {
                picture::down_picture([&a.down(kind), &b.down(kind)], coarse, from, shape[1], fine, &work.bands);
            } else {
                copy_box(from, &shape, fine, &fine_shape, &fine_shape);
                copy_box(coarse, &coarse_shape, fine, &fine_shape, &coarse_shape);
                let done = self.merge_level(level, &vec![kind; self.axes.len()], fine.to_vec());
                fine.copy_from_slice(&done);
            }
        }
    }

    /// One level on a compact box, every axis smooth then detail; kinds by axis.
    pub(crate) fn split_level<S: Scalar>(&self, level: usize, kinds: &[Kind], mut now: Vec<S>) -> Vec<S> {
        let shape = self.level_shape(level + 1);
        let mut inner: usize = shape.iter().product();
        let mut next = vec![S::default(); now.len()];
        for (a, pyramid) in self.axes.iter().enumerate() {
            inner /= shape[a];
            axis::up(pyramid.rung(level), kinds[a], &now, &mut next, inner);
            std::mem::swap(&mut now, &mut next);
        }
        now
    }

    /// The reverse of [`Tensor::split_level`].
    pub(crate) fn merge_level<S: Scalar>(&self, level: usize, kinds: &[Kind], mut now: Vec<S>) -> Vec<S> {
        let shape = self.level_shape(level + 1);
        let mut inner: usize = shape.iter().product();
        let mut next = vec![S::default(); now.len()];
        for (a, pyramid) in self.axes.iter().enumerate() {
            inner /= shape[a];
            axis::down(pyramid.rung(level), kinds[a], &now, &mut next, inner);
            std::mem::swap(&mut now, &mut next);
        }
        now
    }

    fn scale<S: Scalar>(&self, kind: Kind, values: &mut [S], undo: bool) {
        let grow = (kind == Kind::Basis) != undo;
        let shape = self.shape();
        for block in blocks_of(self) {
            let height: f64 = self.axes.iter().zip(&block.parts).map(|(a, p)| p.height(a)).product();
            if height != 1.0 {
                let by = S::from_f64(if grow { height } else { 1.0 / height });
                for_rows(&shape, &block.ranges, |row| values[row].iter_mut().for_each(|x| *x *= by));
            }
        }
    }
}

/// Memory that transforms can share; see [`Tensor::up_with`].
#[derive(Clone, Debug, Default)]
pub struct Workspace<S> {
    /// The smooth coefficients of every other level.
    turns: Turns<S>,
    bands: Spare<Band<S>>,
}

#[derive(Clone, Debug, Default)]
struct Turns<S>([Vec<S>; 2]);

impl<S: Scalar> Turns<S> {
    /// The array of the level before `turn`, and that of `turn` with `len` values.
    fn pair(&mut self, turn: usize, len: usize) -> (&[S], &mut [S]) {
        let [a, b] = &mut self.0;
        let (before, now) = if turn % 2 == 1 { (a, b) } else { (b, a) };
        if now.len() < len {
            now.resize(len, S::default());
        }
        (before, &mut now[..len])
    }
}

/// Runs `f` on the index range of every row of a sub-box.
pub(crate) fn for_rows(shape: &[usize], ranges: &[Range<usize>], mut f: impl FnMut(Range<usize>)) {
    if ranges.iter().any(|r| r.is_empty()) {
        return;
    }
    let last = shape.len() - 1;
    let mut at: Vec<usize> = ranges.iter().map(|r| r.start).collect();
    loop {
        let start = at.iter().zip(shape).fold(0, |i, (a, n)| i * n + a);
        f(start..start + ranges[last].len());
        let mut axis = last;
        loop {
            if axis == 0 {
                return;
            }
            axis -= 1;
            at[axis] += 1;
            if at[axis] < ranges[axis].end {
                break;
            }
            at[axis] = ranges[axis].start;
        }
    }
}

/// Copies the leading `extent` corner of one box to that of another.
pub(crate) fn copy_box<C: Copy>(from: &[C], from_shape: &[usize], to: &mut [C], to_shape: &[usize], extent: &[usize]) {
    let ranges: Vec<_> = extent.iter().map(|&n| 0..n).collect();
    let mut sources = Vec::new();
    for_rows(from_shape, &ranges, |r| sources.push(r));
    let mut sources = sources.into_iter();
    for_rows(to_shape, &ranges, |r| {
        if let Some(s) = sources.next() {
            to[r].copy_from_slice(&from[s]);
        }
    });
}
