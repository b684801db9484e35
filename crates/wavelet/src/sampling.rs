//! Between samples of a function and the finest coefficients of a pyramid: the prefilter and its inverse.

use crate::coefficient::Scalar;
use crate::family::{Boundary, Family, SplineFamily};
use crate::pyramid::Pyramid;
use crate::space::{Cyclic, SpaceError, SplineSpace};
use crate::tree::TreeFamily;
use ondelette_numerics::dense::inverse;

/// Prefilter of one axis.
///
/// Splines interpolate at [`SplineSpace::sites`]; boxes (Haar, flatlets) and hats take samples as they are;
/// multiwavelets take the polynomial through the middles of `M` equal parts of every cell.
///
/// ```
/// use ondelette_wavelet::{Boundary, Family, Pyramid, Sampling, SplineFamily};
/// let axis = Pyramid::deepest(Family::Spline(SplineFamily::CUBIC), Boundary::Mirrored, 9)?;
/// let sampling = Sampling::new(&axis)?;
/// let mut data = vec![2.0_f64; 9];
/// sampling.to_coefficients(&mut data, 1);
/// assert!(data.iter().all(|c| (c - 2.0).abs() < 1e-14));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Sampling {
    len: usize,
    rule: Rule,
}

#[derive(Clone, Debug)]
enum Rule {
    Same,
    Spline { sites: Vec<Vec<(usize, f64)>>, solver: Box<Cyclic> },
    Cells { order: usize, values: Vec<f64>, inverse: Vec<f64> },
}

/// Why samples cannot be turned into coefficients.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SamplingError {
    /// The family has no interpolation.
    #[error("{0} has no prefilter for samples: take the samples as coefficients")]
    Family(Family),
    /// The spline space cannot interpolate.
    #[error(transparent)]
    Space(#[from] SpaceError),
}

impl Sampling {
    /// The prefilter for the finest level of a pyramid.
    ///
    /// # Errors
    /// Daubechies' wavelets and CDF 9/7 have none; a space too short to interpolate.
    pub fn new(pyramid: &Pyramid) -> Result<Sampling, SamplingError> {
        let len = pyramid.len();
        let rule = match pyramid.family() {
            Family::Haar | Family::Flatlet(_) | Family::Cdf53 => Rule::Same,
            Family::Spline(SplineFamily::LINEAR) => Rule::Same,
            Family::Spline(_) if len == 1 && pyramid.boundary() != Boundary::Open => Rule::Same,
            Family::Spline(s) => {
                let space = SplineSpace::new(s, pyramid.boundary(), len)?;
                let sites = space.sites().iter().map(|&t| space.basis(t, 0)).collect();
                Rule::Spline { sites, solver: Box::new(space.interpolation()?) }
            }
            Family::Multiwavelet(order) => {
                let family = TreeFamily::multiwavelet(order).map_err(|_| SamplingError::Family(pyramid.family()))?;
                let mut values = vec![0.0; order * order];
                for (i, row) in values.chunks_mut(order).enumerate() {
                    family.smooth_values((i as f64 + 0.5) / order as f64, row);
                }
                Rule::Cells { order, inverse: inverse(&values, order), values }
            }
            family => return Err(SamplingError::Family(family)),
        };
        Ok(Sampling { len, rule })
    }

    /// Samples to coefficients, in place, along the axis of boxes of `len x inner` values.
    ///
    /// # Panics
    /// If the data is not a whole number of such boxes.
    pub fn to_coefficients<S: Scalar>(&self, data: &mut [S], inner: usize) {
        assert!(data.len().is_multiple_of(self.len * inner), "data of another shape");
        for slab in data.chunks_mut(self.len * inner) {
            match &self.rule {
                Rule::Same => {}
                Rule::Spline { solver, .. } => solver.solve(slab, inner),
                Rule::Cells { order, inverse, .. } => cells(slab, *order, inverse, inner),
            }
        }
    }

    /// Coefficients to samples, in place: the reverse of [`Sampling::to_coefficients`].
    ///
    /// # Panics
    /// If the data is not a whole number of boxes of `len x inner` values.
    pub fn to_samples<S: Scalar>(&self, data: &mut [S], inner: usize) {
        assert!(data.len().is_multiple_of(self.len * inner), "data of another shape");
        for slab in data.chunks_mut(self.len * inner) {
            match &self.rule {
                Rule::Same => {}
                Rule::Spline { sites, .. } => {
                    let from = slab.to_vec();
                    for (out, site) in slab.chunks_mut(inner).zip(sites) {
                        out.fill(S::default());
                        for &(i, v) in site {
                            let v = S::from_f64(v);
                            out.iter_mut().zip(&from[i * inner..]).for_each(|(o, &x)| *o += v * x);
                        }
                    }
                }
                Rule::Cells { order, values, .. } => cells(slab, *order, values, inner),
            }
        }
    }
}

/// Multiplies every cell by a small matrix.
fn cells<S: Scalar>(slab: &mut [S], order: usize, matrix: &[f64], inner: usize) {
    for cell in slab.chunks_mut(order * inner) {
        let from = cell.to_vec();
        for (out, row) in cell.chunks_mut(inner).zip(matrix.chunks(order)) {
            out.fill(S::default());
            for (&a, x) in row.iter().zip(from.chunks(inner)) {
                let a = S::from_f64(a);
                out.iter_mut().zip(x).for_each(|(o, &x)| *o += a * x);
            }
        }
    }
}
