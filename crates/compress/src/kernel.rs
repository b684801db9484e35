//! What is compressed: a kernel K(x, y) times a mask between a receiver cell and a shooter cell.
//!
//! The *smooth part* K is what polynomials approximate; the *mask* in [0, 1] is whatever switches it on and off. They
//! are kept apart so that a jump of the mask is never fitted by a polynomial of the shooter, and so that a kernel can
//! say for certain where the mask is 1 (no samples needed) or 0 (no link at all).

use crate::cell::Cell;
use ondelette_wavelet::cell::CellBasis;

/// A kernel over pairs of cells.
pub trait Kernel: Sync {
    /// What is prepared once for a pair of cells.
    type Pair<'a>: Pair
    where
        Self: 'a;

    /// The pair, or `None` where the kernel (mask included) is certainly zero on it.
    fn pair(&self, receiver: &Cell, shooter: &Cell) -> Option<Self::Pair<'_>>;
}

/// The kernel between one receiver cell and one shooter cell. Points are local to their cell.
pub trait Pair {
    /// K(x, y), without the mask.
    fn sample(&self, x: [f64; 2], y: [f64; 2]) -> f64;

    /// `moments[j]` = integral of K(x, y) phi_j(y) dy over the shooter (in its measure), without the mask.
    fn moments(&self, x: [f64; 2], basis: &CellBasis, moments: &mut [f64]);

    /// Gauss points an axis on the receiver that integrate the smooth part well, for a basis of this order.
    fn receiver_points(&self, order: usize) -> usize {
        order + 1
    }

    /// Whether the mask may differ from 1.
    fn is_masked(&self) -> bool {
        false
    }

    /// Turns the moments seen from x into masked moments, by about `samples` samples of the mask drawn from `key`.
    fn mask(&self, _x: [f64; 2], _basis: &CellBasis, _moments: &mut [f64], _samples: usize, _key: u64) -> Masked {
        Masked { mean: 1.0, detail: Detail::default() }
    }

    /// About the largest integral of K(x, y) dy over the shooter, for any x of the receiver: what may have been missed
    /// where every sample is 0 although the kernel is not certain to be.
    fn largest(&self) -> f64 {
        0.0
    }

    /// What arrives at x from the shooter's present function and from its projection, unmasked; zeros where unknown.
    fn detail(&self, _x: [f64; 2], _basis: &CellBasis) -> Detail {
        Detail::default()
    }
}

/// What mask samples at one receiver point found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Masked {
    /// Mean of the mask over the shooter, weighted with the kernel.
    pub mean: f64,
    /// What arrives through the mask.
    pub detail: Detail,
}

/// What arrives from a shooter as it shoots at present, where the kernel knows that; else zeros.
///
/// The ratio corrects a block for detail of the shooter that goes with kernel or mask: what is hidden from here is
/// often what is dark, and blocks that only know the shooter's own coefficients miss it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Detail {
    /// From the shooter's function in all its detail.
    pub actual: f64,
    /// From the function's projection on the basis of the shooter's own cell.
    pub projected: f64,
}

/// A kernel given by a plain function of root coordinates and roots, integrated by Gauss rules: for tests, and for
/// kernels that are smooth wherever they are linked.
pub struct PointKernel<F> {
    /// K(receiver root, x, shooter root, y) in root coordinates.
    pub function: F,
    /// Measure of each root domain.
    pub measures: Vec<f64>,
    /// Gauss points an axis on both sides.
    pub points: usize,
}

/// A pair of a [`PointKernel`].
pub struct PointPair<'a, F> {
    kernel: &'a PointKernel<F>,
    receiver: Cell,
    shooter: Cell,
}

impl<F: Fn(u32, [f64; 2], u32, [f64; 2]) -> f64 + Sync> Kernel for PointKernel<F> {
    type Pair<'a>
        = PointPair<'a, F>
    where
        Self: 'a;

    fn pair(&self, receiver: &Cell, shooter: &Cell) -> Option<PointPair<'_, F>> {
        Some(PointPair { kernel: self, receiver: *receiver, shooter: *shooter })
    }
}

impl<F: Fn(u32, [f64; 2], u32, [f64; 2]) -> f64 + Sync> Pair for PointPair<'_, F> {
    fn sample(&self, x: [f64; 2], y: [f64; 2]) -> f64 {
        let (r, s) = (&self.receiver, &self.shooter);
        (self.kernel.function)(r.root, r.to_root(x), s.root, s.to_root(y))
    }

    fn moments(&self, x: [f64; 2], basis: &CellBasis, moments: &mut [f64]) {
        let measure = self.kernel.measures[self.shooter.root as usize] * self.shooter.share();
        let analysis = basis.analysis(self.kernel.points);
        // the analysis rule of a flatlet basis is a box mean; a moment is the integral over that box
        let scale = if basis.is_nested() { measure } else { measure / basis.len() as f64 };
        let samples: Vec<f64> = analysis.points.iter().map(|y| self.sample(x, *y)).collect();
        for (m, c) in moments.iter_mut().zip(analysis.coefficients(&samples)) {
            *m = scale * c;
        }
    }

    fn receiver_points(&self, _order: usize) -> usize {
        self.kernel.points
    }
}
