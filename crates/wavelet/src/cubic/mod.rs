//! The bank of the thesis (4, 4), three symmetric steps, fused: the hottest loops of the library.
//!
//! Analysis is `e += a (o + o)`, `o += b (e + e)`, `e += c (o + o) + d (o + o)`; synthesis runs the three backwards.
//! [`Row`] streams along a row, `Columns` down a picture, [`Band`] joins them. All give the numbers of the general path
//! up to rounding.

mod band;
mod columns;
mod rows;

use crate::coefficient::Scalar;
use crate::lifting::{Scheme, Step};

pub(crate) use band::Band;
use columns::{Columns, Group};
pub(crate) use rows::Row;

/// The taps of the three steps, with the gains of both halves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cubic<S> {
    a: S,
    b: S,
    c: S,
    d: S,
    gain_s: S,
    gain_d: S,
}

/// Outer and inner tap of a symmetric step that begins at offset `first`.
fn taps<S: Scalar>(step: &Step<S>, odd: bool, first: isize, n: usize) -> Option<(S, S)> {
    match step {
        Step::Lift { odd: o, first: f, taps } if *o == odd && *f == first && taps.len() == n => {
            let symmetric = taps.iter().zip(taps.iter().rev()).all(|(a, b)| a == b);
            symmetric.then(|| (taps[0], taps[n / 2]))
        }
        _ => None,
    }
}

impl<S: Scalar> Cubic<S> {
    /// Recognises the analysis (or, with `down`, the synthesis).
    pub(crate) fn recognise(scheme: &Scheme<S>, down: bool) -> Option<Cubic<S>> {
        let [first, second, third] = &scheme.steps[..] else { return None };
        let (outer, inner) = if down { (third, first) } else { (first, third) };
        let (a, _) = taps(outer, false, -1, 2)?;
        let (b, _) = taps(second, true, 0, 2)?;
        let (c, d) = taps(inner, false, -2, 4)?;
        (scheme.shift == 0).then_some(Cubic { a, b, c, d, gain_s: scheme.scale.0, gain_d: scheme.scale.1 })
    }

    /// What smooth and detail coefficients are multiplied by.
    pub(crate) fn gains(&self) -> [S; 2] {
        [self.gain_s, self.gain_d]
    }

    /// The same bank with both gains multiplied.
    pub(crate) fn amplified(self, by: S) -> Cubic<S> {
        Cubic { gain_s: self.gain_s * by, gain_d: self.gain_d * by, ..self }
    }
}
