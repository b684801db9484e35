//! Heights of the functions on each level: the scalings of section 2.3.3 and appendix C.

use crate::pyramid::Pyramid;
use crate::sparse::Sparse;

/// How much taller functions are on each coarser level: `phi_{i,j}(t) = sigma^(L-i) phi(2^(i-L) t - j)`.
///
/// ```
/// use ondelette_wavelet::Scaling;
/// assert_eq!(Scaling::Energy { derivative: 2, dimension: 1 }.sigma(), 2.0_f64.powf(1.5));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scaling {
    /// All functions equally tall (35), (170).
    Unnormalized,
    /// Wavelets of equal L2 norm, sigma = 1/sqrt2 (38), (169).
    L2,
    /// Twice as tall on each coarser level, sigma = 2 (160), (171), (195).
    Anti,
    /// The scaling that keeps the energy `int (D^a f)^2` of wavelets constant in `d` dimensions, per axis:
    /// sigma = 2^(a/d - 1/2) (192); 2^(3/2) for thin-plate curves (193), 2^(1/2) for thin-plate surfaces (194).
    Energy {
        /// Order `a` of the derivative.
        derivative: u32,
        /// Dimension `d` of the domain.
        dimension: u32,
    },
    /// Any other factor.
    Sigma(f64),
}

impl Scaling {
    /// The height factor per coarser level.
    pub fn sigma(self) -> f64 {
        match self {
            Scaling::Unnormalized => 1.0,
            Scaling::L2 => std::f64::consts::FRAC_1_SQRT_2,
            Scaling::Anti => 2.0,
            Scaling::Energy { derivative, dimension } => {
                2.0_f64.powf(f64::from(derivative) / f64::from(dimension) - 0.5)
            }
            Scaling::Sigma(s) => s,
        }
    }
}

/// The height of the functions of each level, one number for the smooth and one for the detail functions.
///
/// Coefficients are divided by the height of their function, dual coefficients multiplied, so one diagonal per level
/// converts between any two scalings.
#[derive(Clone, Debug, PartialEq)]
pub struct Heights {
    smooth: Vec<f64>,
    detail: Vec<f64>,
}

impl Heights {
    /// The heights of a scaling on `levels` levels.
    pub fn new(levels: usize, scaling: Scaling) -> Heights {
        let sigma = scaling.sigma();
        let smooth: Vec<f64> = (0..=levels).map(|i| sigma.powi((levels - i) as i32)).collect();
        Heights { detail: smooth[..levels].to_vec(), smooth }
    }

    /// Heights that give the middle function of every level unit energy `f^T H f`; `energy` is the symmetric matrix H
    /// on the finest level. Levels whose middle function has no energy (constants) keep height 1. Heights are relative
    /// to the unscaled functions, whatever the scaling of `pyramid`.
    ///
    /// # Panics
    /// If the matrix does not fit the finest level.
    pub fn unit_diagonal(pyramid: &Pyramid, energy: &Sparse) -> Heights {
        let levels = pyramid.levels();
        let invert = |v: &[f64]| {
            let e = v.get(v.len() / 2).copied().unwrap_or(0.0);
            if e > 1e-14 { 1.0 / e.sqrt() } else { 1.0 }
        };
        let mut heights = Heights { smooth: vec![1.0; levels + 1], detail: vec![1.0; levels] };
        let diagonals = energy_diagonals(pyramid, energy);
        for (i, d) in diagonals.detail.iter().enumerate() {
            heights.detail[i] = invert(d);
        }
        for (i, s) in diagonals.smooth.iter().enumerate() {
            heights.smooth[i] = invert(s);
        }
        heights
    }

    /// Number of levels.
    pub fn levels(&self) -> usize {
        self.detail.len()
    }

    /// Height of the smooth functions of level `i` (`0 ..= levels`).
    ///
    /// # Panics
    /// If there is no such level.
    pub fn smooth(&self, i: usize) -> f64 {
        self.smooth[i]
    }

    /// Height of the wavelets of level `i`.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn detail(&self, i: usize) -> f64 {
        self.detail[i]
    }
}

/// Energies `f^T H f` of single functions, unscaled: smooth ones of every level and wavelets of every level.
#[derive(Clone, Debug, PartialEq)]
pub struct EnergyDiagonals {
    /// `smooth[i][j]`: level `i` in `0 ..= levels`.
    pub smooth: Vec<Vec<f64>>,
    /// `detail[i][j]`: level `i` in `0 .. levels`.
    pub detail: Vec<Vec<f64>>,
}

/// Energies of all functions of a pyramid, for a banded energy in linear time: `H_i = S^T H_{i+1} S` level by level.
///
/// # Panics
/// If the matrix does not fit the finest level.
pub fn energy_diagonals(pyramid: &Pyramid, energy: &Sparse) -> EnergyDiagonals {
    assert_eq!((energy.rows(), energy.cols()), (pyramid.len(), pyramid.len()), "energy on another space");
    let levels = pyramid.levels();
    let mut out = EnergyDiagonals { smooth: vec![Vec::new(); levels + 1], detail: vec![Vec::new(); levels] };
    let mut h = energy.clone();
    out.smooth[levels] = diagonal(&h);
    for i in (0..levels).rev() {
        let rung = pyramid.rung(i);
        let synthesis = rung.synthesis();
        let (smooth, detail) = (synthesis.columns(0, rung.smooth()), synthesis.columns(rung.smooth(), rung.fine()));
        // diag(D^T H D) without forming the product's off-diagonal.
        let hd = h.product(&detail).transposed();
        let dt = detail.transposed();
        out.detail[i] = (0..rung.detail()).map(|j| dot(dt.row(j), hd.row(j))).collect();
        h = smooth.transposed().product(&h.product(&smooth));
        out.smooth[i] = diagonal(&h);
    }
    out
}

fn diagonal(m: &Sparse) -> Vec<f64> {
    (0..m.rows()).map(|r| m.row(r).iter().find(|e| e.0 == r).map_or(0.0, |e| e.1)).collect()
}

fn dot(a: &[(usize, f64)], b: &[(usize, f64)]) -> f64 {
    let mut b = b.iter().peekable();
    let mut sum = 0.0;
    for &(c, v) in a {
        while b.next_if(|e| e.0 < c).is_some() {}
        if let Some(e) = b.peek()
            && e.0 == c
        {
            sum += v * e.1;
        }
    }
    sum
}
