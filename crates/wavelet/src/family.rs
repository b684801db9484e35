//! Which basis: the families by name, and what happens at the ends of an axis.

use std::fmt;
use std::str::FromStr;

use crate::exact::spline_filters;
use crate::extension::Extension;
use crate::lifting::{Scheme, cdf97, daubechies, factor};
use crate::tables::DAUBECHIES_LATTICE;
use crate::tree::TreeFamily;

/// A wavelet family.
///
/// ```
/// use ondelette_wavelet::{Family, SplineFamily};
/// assert_eq!("bspline".parse(), Ok(Family::Spline(SplineFamily::CUBIC)));
/// assert_eq!(Family::Daubechies(4).to_string(), "d4");
/// assert!("d5".parse::<Family>().is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Family {
    /// Boxes and their differences (2.2).
    Haar,
    /// Orthonormal multiwavelets of order 1 to 6.
    Multiwavelet(usize),
    /// Flatlets of order 1 to 4.
    Flatlet(usize),
    /// B-splines; with [`Boundary::Open`] the semi-orthogonal cubic ones of A.2.
    Spline(SplineFamily),
    /// Daubechies' orthogonal wavelets of 4, 6, ... 20 taps, minimum phase.
    Daubechies(usize),
    /// The 5/3 bank of JPEG 2000, the same as [`SplineFamily::LINEAR`].
    Cdf53,
    /// The 9/7 bank of JPEG 2000.
    Cdf97,
}

/// A bi-orthogonal B-spline family (N, N~): spline order N, N~ vanishing moments of the wavelet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SplineFamily {
    order: u32,
    dual: u32,
}

impl SplineFamily {
    /// (2, 2): hats.
    pub const LINEAR: SplineFamily = SplineFamily { order: 2, dual: 2 };
    /// (3, 3): quadratic B-splines.
    pub const QUADRATIC: SplineFamily = SplineFamily { order: 3, dual: 3 };
    /// (4, 4): the cubic B-splines of A.1.
    pub const CUBIC: SplineFamily = SplineFamily { order: 4, dual: 4 };
    /// (4, 6): cubic B-splines with a longer, stable dual.
    pub const CUBIC6: SplineFamily = SplineFamily { order: 4, dual: 6 };
    /// (6, 12): quintic B-splines.
    pub const QUINTIC: SplineFamily = SplineFamily { order: 6, dual: 12 };
    /// All of them.
    pub const ALL: [SplineFamily; 5] = [Self::LINEAR, Self::QUADRATIC, Self::CUBIC, Self::CUBIC6, Self::QUINTIC];

    /// Order N of the spline; its degree is one less.
    pub fn order(self) -> u32 {
        self.order
    }

    /// Vanishing moments N~ of the wavelet inside the interval.
    pub fn vanishing_moments(self) -> u32 {
        self.dual
    }

    /// The exact filters.
    pub fn filters(self) -> crate::exact::SplineFilters {
        spline_filters(self.order, self.dual)
    }
}

/// What happens at the ends of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Boundary {
    /// Functions are mirrored at the ends (2.3.2): zero end slope, one vanishing moment at the ends.
    Mirrored,
    /// Quadruple end knots and boundary wavelets (A.2): every cubic is in the space.
    Open,
    /// The axis is a loop.
    Periodic,
}

/// A name that is no family or boundary, or a pair that does not exist.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FamilyError {
    /// Unknown family name.
    #[error(
        "no wavelet family {0:?}; there are bspline, bspline22, bspline33, bspline46, bspline612, haar, d4 d6 .. d20, \
         cdf53, cdf97, m1..m6, f1..f4"
    )]
    Unknown(String),
    /// Unknown boundary name.
    #[error("no boundary {0:?}; there are mirror, open and periodic")]
    UnknownBoundary(String),
    /// The pair does not exist.
    #[error("{family} has no {boundary} boundary; possible with {family}: {possible}")]
    Meaningless {
        /// Family asked for.
        family: Family,
        /// Boundary asked for.
        boundary: Boundary,
        /// What that family can do.
        possible: &'static str,
    },
}

impl FromStr for Family {
    type Err = FamilyError;
    fn from_str(name: &str) -> Result<Family, FamilyError> {
        let unknown = || FamilyError::Unknown(name.to_owned());
        Ok(match name {
            "haar" => Family::Haar,
            "bspline" | "bspline44" => Family::Spline(SplineFamily::CUBIC),
            "bspline22" => Family::Spline(SplineFamily::LINEAR),
            "bspline33" => Family::Spline(SplineFamily::QUADRATIC),
            "bspline46" => Family::Spline(SplineFamily::CUBIC6),
            "bspline612" => Family::Spline(SplineFamily::QUINTIC),
            "cdf53" => Family::Cdf53,
            "cdf97" => Family::Cdf97,
            _ => {
                let number = name.get(1..).and_then(|n| n.parse::<usize>().ok()).ok_or_else(unknown)?;
                match (name.as_bytes()[0], number) {
                    (b'd', 4..=20) if number % 2 == 0 => Family::Daubechies(number),
                    (b'm', 1..=TreeFamily::MAX_MULTIWAVELET) => Family::Multiwavelet(number),
                    (b'f', 1..=TreeFamily::MAX_FLATLET) => Family::Flatlet(number),
                    _ => return Err(unknown()),
                }
            }
        })
    }
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Family::Haar => f.write_str("haar"),
            Family::Multiwavelet(m) => write!(f, "m{m}"),
            Family::Flatlet(m) => write!(f, "f{m}"),
            Family::Spline(SplineFamily::CUBIC) => f.write_str("bspline"),
            Family::Spline(s) => write!(f, "bspline{}{}", s.order, s.dual),
            Family::Daubechies(n) => write!(f, "d{n}"),
            Family::Cdf53 => f.write_str("cdf53"),
            Family::Cdf97 => f.write_str("cdf97"),
        }
    }
}

impl FromStr for Boundary {
    type Err = FamilyError;
    fn from_str(name: &str) -> Result<Boundary, FamilyError> {
        match name {
            "mirror" => Ok(Boundary::Mirrored),
            "open" => Ok(Boundary::Open),
            "periodic" => Ok(Boundary::Periodic),
            _ => Err(FamilyError::UnknownBoundary(name.to_owned())),
        }
    }
}

impl fmt::Display for Boundary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Boundary::Mirrored => "mirror",
            Boundary::Open => "open",
            Boundary::Periodic => "periodic",
        })
    }
}

/// How a family climbs on an axis.
pub(crate) enum Climb {
    Tree(TreeFamily),
    Lifted(Scheme<f64>, Extension),
    Open,
}

impl Family {
    /// The boundary used when none is asked for: mirrored where it exists, else periodic. Tree families have no
    /// boundary question; they count as periodic.
    pub fn default_boundary(self) -> Boundary {
        match self {
            Family::Spline(_) | Family::Cdf53 | Family::Cdf97 => Boundary::Mirrored,
            _ => Boundary::Periodic,
        }
    }

    /// Functions of a cell for tree families (`M`), 1 otherwise.
    pub fn cell(self) -> usize {
        match self {
            Family::Multiwavelet(m) | Family::Flatlet(m) => m,
            _ => 1,
        }
    }

    /// Checks that the pair exists.
    ///
    /// # Errors
    /// [`FamilyError::Meaningless`] with what is possible: `open` belongs to `bspline`, Daubechies' wavelets are
    /// periodic only (no exact-length symmetric extension exists for them).
    pub fn check(self, boundary: Boundary) -> Result<(), FamilyError> {
        let possible = match self {
            Family::Spline(SplineFamily::CUBIC) => return Ok(()),
            Family::Daubechies(_) if boundary == Boundary::Periodic => return Ok(()),
            Family::Daubechies(_) => "periodic",
            _ if boundary != Boundary::Open => return Ok(()),
            Family::Haar | Family::Multiwavelet(_) | Family::Flatlet(_) => {
                "periodic or mirror (the same: no function crosses a cell); open belongs to bspline"
            }
            _ => "mirror or periodic; open belongs to bspline",
        };
        Err(FamilyError::Meaningless { family: self, boundary, possible })
    }

    pub(crate) fn climb(self, boundary: Boundary) -> Result<Climb, FamilyError> {
        self.check(boundary)?;
        let order = |r: Result<TreeFamily, _>| r.map_err(|_| FamilyError::Unknown(self.to_string()));
        let whole = if boundary == Boundary::Periodic { Extension::Periodic } else { Extension::Whole };
        Ok(match self {
            Family::Haar => Climb::Tree(TreeFamily::haar()),
            Family::Multiwavelet(m) => Climb::Tree(order(TreeFamily::multiwavelet(m))?),
            Family::Flatlet(m) => Climb::Tree(order(TreeFamily::flatlet(m))?),
            Family::Spline(_) if boundary == Boundary::Open => Climb::Open,
            Family::Spline(s) => {
                let half = s.order % 2 == 1 && boundary == Boundary::Mirrored;
                Climb::Lifted(factor(&s.filters()), if half { Extension::Half } else { whole })
            }
            Family::Cdf53 => Climb::Lifted(factor(&SplineFamily::LINEAR.filters()), whole),
            Family::Cdf97 => Climb::Lifted(cdf97(), whole),
            Family::Daubechies(n) => {
                let table = (n % 2 == 0).then(|| DAUBECHIES_LATTICE.get((n / 2).wrapping_sub(2))).flatten();
                let angles = table.ok_or_else(|| FamilyError::Unknown(self.to_string()))?;
                Climb::Lifted(daubechies(angles), Extension::Periodic)
            }
        })
    }
}
