//! The pyramid: a ladder of rungs on one axis, with the scaling of its functions.
//!
//! What flows in: the coefficients of a function on the finest level. What flows out: the same function in the wavelet
//! basis, flat as `b | w_0 | w_1 | ... | w_{L-1}` (coarsest first); and back; and the same for basis functions.

use std::ops::Range;

use crate::coefficient::{Coefficient, Scalar, first_not_finite};
use crate::extension::Extension;
use crate::family::{Boundary, Climb, Family, FamilyError};
use crate::open::{OpenColumns, OpenKnots, Solved};
use crate::rung::{Engine, Kind, Rung};
use crate::scaling::{Heights, Scaling};

/// A pyramid on one axis.
///
/// ```
/// use ondelette_wavelet::{Boundary, Family, Pyramid, SplineFamily};
/// let family = Family::Spline(SplineFamily::CUBIC);
/// let pyramid = Pyramid::deepest(family, Boundary::Mirrored, 9)?;
/// assert_eq!((pyramid.levels(), pyramid.smooth_len(0)), (3, 2));
/// let x: Vec<f64> = (0..9).map(|i| f64::from(i * i)).collect();
/// let flat = pyramid.analyze(&x)?;
/// let back = pyramid.synthesize(&flat)?;
/// assert!(x.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-12));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Pyramid {
    family: Family,
    boundary: Boundary,
    /// `rungs[i]` joins level `i` and level `i + 1`.
    rungs: Vec<Rung>,
    len: usize,
    heights: Heights,
}

/// Why there is no such pyramid.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PyramidError {
    /// Unknown family, or a pair of family and boundary that does not exist.
    #[error(transparent)]
    Family(#[from] FamilyError),
    /// No space of this length.
    #[error("{family} with {boundary} boundary has no space of {len} coefficients; {fits}")]
    Length {
        /// Family asked for.
        family: Family,
        /// Boundary asked for.
        boundary: Boundary,
        /// Length asked for.
        len: usize,
        /// What would fit.
        fits: String,
    },
    /// More levels than the length allows.
    #[error(
        "{levels} levels are too many for {len} coefficients of {family} with {boundary} boundary: at most {most}{fits}"
    )]
    Levels {
        /// Family asked for.
        family: Family,
        /// Boundary asked for.
        boundary: Boundary,
        /// Length asked for.
        len: usize,
        /// Levels asked for.
        levels: usize,
        /// Levels that the length allows.
        most: usize,
        /// Lengths that would fit, or nothing.
        fits: String,
    },
}

/// Why data cannot be transformed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TransformError {
    /// The wrong number of values.
    #[error("{got} values for a transform of {want}")]
    Length {
        /// Values given.
        got: usize,
        /// Values needed.
        want: usize,
    },
    /// A value that is NaN or infinite.
    #[error("value {index} is {value}; a transform needs finite numbers, remove or replace it first")]
    NotFinite {
        /// Its index in the flat input.
        index: usize,
        /// What it is.
        value: f64,
    },
}

/// Refuses slices of the wrong length and values that are not finite.
pub(crate) fn check<S: Scalar>(x: &[S], want: usize) -> Result<(), TransformError> {
    if x.len() != want {
        return Err(TransformError::Length { got: x.len(), want });
    }
    match first_not_finite(x) {
        Some(index) => Err(TransformError::NotFinite { index, value: x[index].to_f64() }),
        None => Ok(()),
    }
}

/// Longest axis: no memory holds more, and all sums of indices stay far from overflow.
const MAX_LEN: usize = 1 << 40;

/// Levels that `len` coefficients allow.
///
/// Mirrored: until two coefficients are left (even filters: one). Periodic and tree families: while the length divides
/// by two (cells for trees). Open: until one span is left.
///
/// # Errors
/// The pair of family and boundary does not exist, or has no space of that length.
pub fn levels_allowed(family: Family, boundary: Boundary, len: usize) -> Result<usize, PyramidError> {
    family.check(boundary)?;
    let length = |fits: String| Err(PyramidError::Length { family, boundary, len, fits });
    let halvings = |n: usize| n.next_power_of_two().trailing_zeros() as usize;
    let cell = family.cell();
    if len == 0 {
        return length("an axis needs coefficients".to_owned());
    }
    if len > MAX_LEN {
        return length(format!("at most {MAX_LEN}"));
    }
    if !len.is_multiple_of(cell) {
        return length(format!("{} and {} would fit", len / cell * cell, len.next_multiple_of(cell)));
    }
    let even_filter = matches!(family, Family::Spline(s) if s.order() % 2 == 1);
    Ok(match boundary {
        Boundary::Open if len < 4 => return length("at least 4 (one span)".to_owned()),
        Boundary::Open => halvings(len - 3),
        Boundary::Mirrored if matches!(family, Family::Spline(_) | Family::Cdf53 | Family::Cdf97) => {
            halvings(if even_filter { len } else { (len - 1).max(1) })
        }
        _ => (len / cell).trailing_zeros() as usize,
    })
}

impl Pyramid {
    /// A pyramid of `levels` levels on `len` finest coefficients.
    ///
    /// # Errors
    /// See [`PyramidError`]: a pair that does not exist, a length that has no space, too many levels.
    pub fn new(family: Family, boundary: Boundary, len: usize, levels: usize) -> Result<Pyramid, PyramidError> {
        let most = levels_allowed(family, boundary, len)?;
        if levels > most {
            let fits = match boundary {
                Boundary::Mirrored | Boundary::Open if family.cell() == 1 && family != Family::Haar => String::new(),
                _ if levels < 40 => {
                    let unit = family.cell() << levels;
                    let (below, above) = (len / unit * unit, len.next_multiple_of(unit));
                    if below > 0 {
                        format!("; {below} or {above} coefficients would fit")
                    } else {
                        format!("; {above} coefficients would fit")
                    }
                }
                _ => String::new(),
            };
            return Err(PyramidError::Levels { family, boundary, len, levels, most, fits });
        }
        Self::with_columns(family, boundary, len, levels, OpenColumns::Unit)
    }

    /// The pyramid with as many levels as the length allows.
    ///
    /// # Errors
    /// As [`Pyramid::new`].
    pub fn deepest(family: Family, boundary: Boundary, len: usize) -> Result<Pyramid, PyramidError> {
        Self::new(family, boundary, len, levels_allowed(family, boundary, len)?)
    }

    /// The open basis with its wavelets scaled as asked; see [`OpenColumns`].
    ///
    /// # Errors
    /// As [`Pyramid::new`].
    pub fn open(len: usize, levels: usize, columns: OpenColumns) -> Result<Pyramid, PyramidError> {
        let family = Family::Spline(crate::family::SplineFamily::CUBIC);
        Self::new(family, Boundary::Open, len, levels)?;
        Self::with_columns(family, Boundary::Open, len, levels, columns)
    }

    fn with_columns(
        family: Family,
        boundary: Boundary,
        len: usize,
        levels: usize,
        columns: OpenColumns,
    ) -> Result<Pyramid, PyramidError> {
        let mut rungs = Vec::with_capacity(levels);
        match family.climb(boundary)? {
            Climb::Tree(tree) => {
                let cells = len / tree.order();
                rungs.extend((1..=levels).map(|l| Rung::tree(&tree, cells >> l)));
            }
            Climb::Lifted(scheme, extension) => {
                let mut n = len;
                for _ in 0..levels {
                    rungs.push(Rung::lifted(n, extension, scheme.clone()));
                    n = Extension::split(n).0;
                }
            }
            Climb::Open => {
                let mut knots = OpenKnots::uniform(len - 3);
                for _ in 0..levels {
                    rungs.push(Rung { engine: Engine::Solved(Box::new(Solved::new(&knots, columns))) });
                    knots = knots.coarser();
                }
            }
        }
        rungs.reverse();
        let heights = Heights::new(levels, Scaling::Unnormalized);
        Ok(Pyramid { family, boundary, rungs, len, heights })
    }

    /// The same pyramid with other function heights.
    ///
    /// # Panics
    /// If the heights are for another number of levels.
    pub fn scaled(mut self, heights: Heights) -> Pyramid {
        assert_eq!(heights.levels(), self.levels(), "heights for another number of levels");
        self.heights = heights;
        self
    }

    /// The same pyramid with a scaling of section 2.3.3 or appendix C.
    pub fn with_scaling(self, scaling: Scaling) -> Pyramid {
        let heights = Heights::new(self.levels(), scaling);
        self.scaled(heights)
    }

    /// The family.
    pub fn family(&self) -> Family {
        self.family
    }

    /// The boundary.
    pub fn boundary(&self) -> Boundary {
        self.boundary
    }

    /// Number of levels `L`.
    pub fn levels(&self) -> usize {
        self.rungs.len()
    }

    /// Number of finest coefficients.
    pub fn len(&self) -> usize {
        self.len
    }

    /// True for a pyramid without coefficients (there is none).
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Number of spans of the finest level: the length (periodic, trees), less 1 (mirrored), less 3 (open). Mirrored
    /// families of odd order (`bspline33`) have as many spans as coefficients.
    pub fn spans(&self) -> usize {
        match (self.boundary, self.family) {
            (Boundary::Open, _) => self.len - 3,
            (Boundary::Mirrored, Family::Spline(s)) if s.order() % 2 == 0 => self.len - 1,
            (Boundary::Mirrored, Family::Cdf53 | Family::Cdf97) => self.len - 1,
            _ => self.len / self.family.cell(),
        }
    }

    /// The rung between level `i` and level `i + 1`.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn rung(&self, i: usize) -> &Rung {
        &self.rungs[i]
    }

    /// Number of smooth coefficients on level `i` (`0 ..= levels`).
    ///
    /// # Panics
    /// If there is no such level.
    pub fn smooth_len(&self, i: usize) -> usize {
        assert!(i <= self.levels(), "level {i} of {}", self.levels());
        self.rungs.get(i).map_or(self.len, Rung::smooth)
    }

    /// Where the details of level `i` lie in flat order.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn detail_range(&self, i: usize) -> Range<usize> {
        assert!(i < self.levels(), "detail level {i} of {}", self.levels());
        self.rungs[i].smooth()..self.rungs[i].fine()
    }

    /// Heights of the functions by level.
    pub fn heights(&self) -> &Heights {
        &self.heights
    }

    /// Finest to flat: `coef_pyrm_up` = W, or `basis_pyrm_up` = W^-T. Linear time.
    ///
    /// # Errors
    /// Wrong length; a value that is not finite.
    pub fn up<C: Coefficient>(&self, kind: Kind, fine: &[C]) -> Result<Vec<C>, TransformError> {
        check(C::flat(fine), self.len * C::CHANNELS)?;
        let mut out = vec![C::default(); self.len];
        let mut now = fine.to_vec();
        for rung in self.rungs.iter().rev() {
            let mut smooth = vec![C::default(); rung.smooth()];
            rung.up(kind, &now, &mut smooth, &mut out[rung.smooth()..rung.fine()]);
            now = smooth;
        }
        out[..now.len()].copy_from_slice(&now);
        self.scale(kind, &mut out, false);
        Ok(out)
    }

    /// Flat to finest: `coef_pyrm_down` = W^-1, or `basis_pyrm_down` = W^T. Linear time.
    ///
    /// # Errors
    /// Wrong length; a value that is not finite.
    pub fn down<C: Coefficient>(&self, kind: Kind, flat: &[C]) -> Result<Vec<C>, TransformError> {
        check(C::flat(flat), self.len * C::CHANNELS)?;
        let mut flat = flat.to_vec();
        self.scale(kind, &mut flat, true);
        let mut now = flat[..self.smooth_len(0)].to_vec();
        for rung in &self.rungs {
            let mut fine = vec![C::default(); rung.fine()];
            rung.down(kind, &now, &flat[rung.smooth()..rung.fine()], &mut fine);
            now = fine;
        }
        Ok(now)
    }

    /// Coefficients to the wavelet basis, [`Pyramid::up`] of [`Kind::Coefficients`].
    ///
    /// # Errors
    /// As [`Pyramid::up`].
    pub fn analyze<C: Coefficient>(&self, fine: &[C]) -> Result<Vec<C>, TransformError> {
        self.up(Kind::Coefficients, fine)
    }

    /// Wavelet coefficients to the finest level, [`Pyramid::down`] of [`Kind::Coefficients`].
    ///
    /// # Errors
    /// As [`Pyramid::down`].
    pub fn synthesize<C: Coefficient>(&self, flat: &[C]) -> Result<Vec<C>, TransformError> {
        self.down(Kind::Coefficients, flat)
    }

    fn scale<C: Coefficient>(&self, kind: Kind, flat: &mut [C], undo: bool) {
        let grow = (kind == Kind::Basis) != undo;
        let mut apply = |range: Range<usize>, height: f64| {
            if height != 1.0 {
                let by = C::Scalar::from_f64(if grow { height } else { 1.0 / height });
                C::flat_mut(&mut flat[range]).iter_mut().for_each(|x| *x *= by);
            }
        };
        apply(0..self.smooth_len(0), self.heights.smooth(0));
        for i in 0..self.levels() {
            apply(self.detail_range(i), self.heights.detail(i));
        }
    }
}
