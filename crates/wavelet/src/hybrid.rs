//! Hybrid bases (chapter 6): smooth functions of one level, wavelets from there on.

use crate::coefficient::{Coefficient, Scalar};
use crate::pyramid::{Pyramid, TransformError};
use crate::rung::Kind;

/// One function with its smooth and detail coefficients on every level, some of which are valid.
///
/// Editing the smooth coefficients of level `r` and moving finer keeps the finer details: a broad sweep of the curve.
///
/// ```
/// use ondelette_wavelet::{Boundary, Family, Hybrid, Pyramid, SplineFamily};
/// let pyramid = Pyramid::new(Family::Spline(SplineFamily::CUBIC), Boundary::Mirrored, 17, 4)?;
/// let mut curve = Hybrid::new(&pyramid, &[[0.0, 1.0]; 17])?;
/// curve.smooth_mut(2)[1] = [5.0, 1.0];
/// curve.finer(2, 4);
/// assert!(curve.smooth(4)[4][0] > 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Hybrid<C> {
    pyramid: Pyramid,
    smooth: Vec<Vec<C>>,
    detail: Vec<Vec<C>>,
}

impl<C: Coefficient> Hybrid<C> {
    /// All levels of a function given on the finest.
    ///
    /// # Errors
    /// Wrong length; a value that is not finite.
    pub fn new(pyramid: &Pyramid, fine: &[C]) -> Result<Hybrid<C>, TransformError> {
        crate::pyramid::check(C::flat(fine), pyramid.len() * C::CHANNELS)?;
        let levels = pyramid.levels();
        let mut out = Hybrid {
            smooth: (0..=levels).map(|i| vec![C::default(); pyramid.smooth_len(i)]).collect(),
            detail: (0..levels).map(|i| vec![C::default(); pyramid.detail_range(i).len()]).collect(),
            pyramid: pyramid.clone(),
        };
        out.smooth[levels] = scaled(fine, 1.0 / pyramid.heights().smooth(levels));
        out.coarser(levels, 0);
        Ok(out)
    }

    /// The pyramid.
    pub fn pyramid(&self) -> &Pyramid {
        &self.pyramid
    }

    /// Smooth coefficients of level `i` (`0 ..= levels`), array `b` of the thesis.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn smooth(&self, i: usize) -> &[C] {
        &self.smooth[i]
    }

    /// Smooth coefficients of level `i`, to be edited; call [`Hybrid::finer`] or [`Hybrid::coarser`] after it.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn smooth_mut(&mut self, i: usize) -> &mut [C] {
        &mut self.smooth[i]
    }

    /// Detail coefficients of level `i` (`0 .. levels`), array `w` of the thesis.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn detail(&self, i: usize) -> &[C] {
        &self.detail[i]
    }

    /// Detail coefficients of level `i`, to be edited.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn detail_mut(&mut self, i: usize) -> &mut [C] {
        &mut self.detail[i]
    }

    /// `partial_coef_pyrm_up`: from level `from` to the coarser `to`; all smooth levels between become valid.
    ///
    /// # Panics
    /// If a level does not exist.
    pub fn coarser(&mut self, from: usize, to: usize) {
        for i in (to..from).rev() {
            let h = self.pyramid.heights();
            let fine = scaled(&self.smooth[i + 1], h.smooth(i + 1));
            let rung = self.pyramid.rung(i);
            rung.up(Kind::Coefficients, &fine, &mut self.smooth[i], &mut self.detail[i]);
            self.smooth[i] = scaled(&self.smooth[i], 1.0 / h.smooth(i));
            self.detail[i] = scaled(&self.detail[i], 1.0 / h.detail(i));
        }
    }

    /// `partial_coef_pyrm_down`: from level `from` to the finer `to`; all smooth levels between become valid.
    ///
    /// # Panics
    /// If a level does not exist.
    pub fn finer(&mut self, from: usize, to: usize) {
        for i in from..to {
            let h = self.pyramid.heights();
            let (s, d) = (scaled(&self.smooth[i], h.smooth(i)), scaled(&self.detail[i], h.detail(i)));
            self.pyramid.rung(i).down(Kind::Coefficients, &s, &d, &mut self.smooth[i + 1]);
            self.smooth[i + 1] = scaled(&self.smooth[i + 1], 1.0 / h.smooth(i + 1));
        }
    }

    /// The coefficients of the hybrid basis of level `r`, flat: `b_r | w_r | ... | w_{L-1}` (135).
    ///
    /// # Panics
    /// If there is no such level.
    pub fn flat(&self, r: usize) -> Vec<C> {
        let mut out = self.smooth[r].clone();
        self.detail[r..].iter().for_each(|w| out.extend_from_slice(w));
        out
    }
}

fn scaled<C: Coefficient>(x: &[C], by: f64) -> Vec<C> {
    let mut out = x.to_vec();
    if by != 1.0 {
        let by = C::Scalar::from_f64(by);
        C::flat_mut(&mut out).iter_mut().for_each(|v| *v *= by);
    }
    out
}
