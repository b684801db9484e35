//! Direct manipulation: points and derivatives of the shape are pulled, the least change of control points follows
//! (6.3).

use super::curve_ladder::CurveLadder;
use super::editor::{Editor, finite};
use super::ladder::{EditError, Ladder};
use super::orientation::Orientation;
use crate::axis::Axis;
use crate::basis;
use crate::shape::{Curve, Surface};
use crate::system::sparse_dot;
use ondelette_wavelet::{Boundary, Kind, energy_diagonals, gram};

/// One wish: the shape, or a derivative of it, at a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pull {
    /// Parameters (s, t) in domain units; curves use the first.
    pub at: [f64; 2],
    /// Orders of the derivative; `[0, 0]` is the position.
    pub orders: [usize; 2],
    /// What it shall be; `None` leaves a coordinate alone.
    pub target: [Option<f64>; 3],
}

/// What a pull did.
#[derive(Clone, Debug, PartialEq)]
pub struct Pulled {
    /// Pulls that hold by themselves once those before them hold: they were checked, not used.
    pub redundant: Vec<usize>,
    /// The largest miss of a coordinate that was pulled.
    pub residual: f64,
}

type Factors = [Vec<(usize, f64)>; 2];

/// The least change of the control points of `level`, in the sum of squares, that meets all pulls; wavelets stay
/// (146, solved by the pseudo-inverse). Detail keeps its x, y, z: in turning frames the conditions are not linear.
///
/// ```
/// use ondelette_modeling::{Axis, edit::{CurveLadder, Editor, Pull, least_squares}, shape::Curve};
/// use ondelette_wavelet::Boundary;
/// let axis = Axis::new(Boundary::Open, 16, [0.0, 1.0])?;
/// let curve = Curve::new(axis, 2, (0..19).map(|i| [f64::from(i), 0.0, 0.0]).collect())?;
/// let mut editor = Editor::new(CurveLadder::new(&curve)?);
/// let pull = Pull { at: [0.4, 0.0], orders: [0, 0], target: [None, Some(3.0), None] };
/// least_squares(&mut editor, 2, &[pull])?;
/// assert!((editor.shape()?.point(0.4)[1] - 3.0).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// No such level; numbers that are not finite; parameters outside the domain; [`EditError::Conflict`]. Nothing
/// changes then.
pub fn least_squares<L: Ladder>(editor: &mut Editor<L>, level: usize, pulls: &[Pull]) -> Result<Pulled, EditError> {
    check(pulls, &editor.ladder().axes())?;
    let mut points = editor.control(level)?.to_vec();
    let levels = editor.levels();
    editor.control(levels)?;
    let ladder = editor.ladder();
    let fine = ladder.smooth(levels);
    let (width, fine_width) = (ladder.shape(level)[1], ladder.shape(levels)[1]);
    let now: Vec<[f64; 3]> =
        pulls.iter().map(|p| applied(&ladder.row(levels, p.at, p.orders), fine_width, fine)).collect();
    let rows: Vec<Factors> = pulls.iter().map(|p| ladder.row(level, p.at, p.orders)).collect();
    let pulled = solve(&rows, pulls, &now, |i, j, c, by| points[i * width + j][c] += by)?;
    editor.set_smooth(level, &points, Orientation::Fixed)?;
    Ok(pulled)
}

fn check(pulls: &[Pull], axes: &[Axis]) -> Result<(), EditError> {
    for (pull, p) in pulls.iter().enumerate() {
        finite("a parameter of a pull", &p.at)?;
        for (&value, axis) in p.at.iter().zip(axes).filter(|e| e.1.boundary() != Boundary::Periodic) {
            let [from, to] = axis.domain();
            let slack = 1e-12 * (to - from);
            if !(from - slack..=to + slack).contains(&value) {
                return Err(EditError::Outside { pull, value, from, to });
            }
        }
        for x in p.target.into_iter().flatten() {
            finite("the target of a pull", &[x])?;
        }
    }
    Ok(())
}

fn applied(row: &Factors, width: usize, points: &[[f64; 3]]) -> [f64; 3] {
    let mut out = [0.0; 3];
    for &(i, a) in &row[0] {
        for &(j, b) in &row[1] {
            for c in 0..3 {
                out[c] += a * b * points[i * width + j][c];
            }
        }
    }
    out
}

/// Minimum-norm change with A change = target - now, coordinate by coordinate; `apply(i, j, coordinate, change)`.
fn solve(
    rows: &[Factors],
    pulls: &[Pull],
    now: &[[f64; 3]],
    mut apply: impl FnMut(usize, usize, usize, f64),
) -> Result<Pulled, EditError> {
    let mut pulled = Pulled { redundant: Vec::new(), residual: 0.0 };
    let mut factors: Vec<(Vec<usize>, Pivoted)> = Vec::new();
    let mut changes = Vec::new();
    for c in 0..3 {
        let used: Vec<usize> = (0..pulls.len()).filter(|&k| pulls[k].target[c].is_some()).collect();
        if used.is_empty() {
            continue;
        }
        let at = factors.iter().position(|f| f.0 == used).unwrap_or_else(|| {
            let gram = |a: usize, b: usize| sparse_dot(&rows[a][0], &rows[b][0]) * sparse_dot(&rows[a][1], &rows[b][1]);
            factors.push((used.clone(), Pivoted::new(&used, gram)));
            factors.len() - 1
        });
        let factor = &factors[at].1;
        let wish: Vec<f64> = used.iter().map(|&k| pulls[k].target[c].unwrap_or(0.0) - now[k][c]).collect();
        let (multipliers, misses) = factor.solve(&wish);
        let size = used.iter().map(|&k| now[k][c].abs().max(pulls[k].target[c].unwrap_or(0.0).abs()));
        let size = size.fold(1e-300, f64::max);
        // Who contradicts is a pull that was left out for those before it, or else the last that was not.
        let is_missed = |r: &usize| misses[*r].is_nan() || misses[*r].abs() > 1e-9 * size;
        let last = factor.kept.last().copied().filter(|_| factor.kept.iter().any(is_missed));
        if let Some(r) = factor.dropped.iter().copied().find(is_missed).or(last) {
            let miss = misses.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            return Err(EditError::Conflict { pull: used[r], miss });
        }
        pulled.residual = misses.iter().fold(pulled.residual, |m, v| m.max(v.abs()));
        pulled.redundant.extend(factor.dropped.iter().map(|&k| used[k]));
        changes.push((c, used, multipliers));
    }
    for (c, used, multipliers) in changes {
        for (&k, &m) in used.iter().zip(&multipliers).filter(|e| *e.1 != 0.0) {
            for &(i, a) in &rows[k][0] {
                for &(j, b) in &rows[k][1] {
                    apply(i, j, c, m * a * b);
                }
            }
        }
    }
    pulled.redundant.sort_unstable();
    pulled.redundant.dedup();
    Ok(pulled)
}

/// Cholesky factors of a Gram matrix, row by row in the given order; rows that depend on those before are dropped.
struct Pivoted {
    n: usize,
    gram: Vec<f64>,
    kept: Vec<usize>,
    dropped: Vec<usize>,
    /// Lower triangle over the kept rows.
    lower: Vec<Vec<f64>>,
}

impl Pivoted {
    fn new(used: &[usize], entry: impl Fn(usize, usize) -> f64) -> Pivoted {
        let n = used.len();
        let mut gram = vec![0.0; n * n];
        for a in 0..n {
            for b in 0..=a {
                let v = entry(used[a], used[b]);
                gram[a * n + b] = v;
                gram[b * n + a] = v;
            }
        }
        let mut out = Pivoted { n, gram, kept: Vec::new(), dropped: Vec::new(), lower: Vec::new() };
        for k in 0..n {
            let mut row: Vec<f64> = Vec::with_capacity(out.kept.len() + 1);
            for (r, &j) in out.kept.iter().enumerate() {
                let dot: f64 = row.iter().zip(&out.lower[r]).map(|(a, b)| a * b).sum();
                row.push((out.gram[k * n + j] - dot) / out.lower[r][r]);
            }
            let own = out.gram[k * n + k];
            let rest = own - row.iter().map(|x| x * x).sum::<f64>();
            if rest > 1e-13 * own && own > 0.0 {
                row.push(rest.sqrt());
                out.kept.push(k);
                out.lower.push(row);
            } else {
                out.dropped.push(k);
            }
        }
        out
    }

    /// Multipliers of all rows (0 for dropped ones) and what each row then misses.
    fn solve(&self, wish: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut x = vec![0.0; self.n];
        let mut misses = wish.to_vec();
        // the second round takes the rounding of the first away
        for _ in 0..2 {
            let mut y: Vec<f64> = Vec::with_capacity(self.kept.len());
            for (r, &k) in self.kept.iter().enumerate() {
                let dot: f64 = y.iter().zip(&self.lower[r]).map(|(a, b)| a * b).sum();
                y.push((misses[k] - dot) / self.lower[r][r]);
            }
            for r in (0..y.len()).rev() {
                y[r] /= self.lower[r][r];
                let v = y[r];
                for q in 0..r {
                    y[q] -= self.lower[r][q] * v;
                }
            }
            self.kept.iter().zip(&y).for_each(|(&k, v)| x[k] += v);
            misses = (0..self.n)
                .map(|i| wish[i] - self.gram[i * self.n..][..self.n].iter().zip(&x).map(|(a, b)| a * b).sum::<f64>())
                .collect();
        }
        (x, misses)
    }
}

/// The axis with `2^times` fewer spans.
fn coarse(axis: &Axis, times: usize) -> Result<Axis, EditError> {
    let refused = EditError::NotUniform { spans: axis.spans(), times };
    let unit = 1_usize.checked_shl(times as u32).ok_or(refused.clone())?;
    if !axis.spans().is_multiple_of(unit) {
        return Err(refused);
    }
    Axis::new(axis.boundary(), axis.spans() / unit, axis.domain()).map_err(|_| refused)
}

/// The delta method (147, 148): the least change, itself a curve with `2^times` fewer spans, that meets all pulls. The
/// same answer as [`least_squares`] `times` levels below the finest, without wavelets.
///
/// # Errors
/// Spans that cannot be halved as often; otherwise as [`least_squares`].
pub fn delta_curve(curve: &Curve, times: usize, pulls: &[Pull]) -> Result<(Curve, Pulled), EditError> {
    check(pulls, &[*curve.axis()])?;
    let axis = coarse(curve.axis(), times)?;
    let mut change = vec![[0.0; 3]; axis.len()];
    let now: Vec<_> = pulls.iter().map(|p| curve.derivative(p.at[0], p.orders[0])).collect();
    let rows: Vec<Factors> = pulls.iter().map(|p| [row(&axis, p.at[0], p.orders[0]), vec![(0, 1.0)]]).collect();
    let pulled = solve(&rows, pulls, &now, |i, _, c, by| change[i][c] += by)?;
    let delta = Curve::new(axis, curve.dim(), change)?.refined(times)?;
    let sum = curve.points().iter().zip(delta.points()).map(|(a, b)| std::array::from_fn(|c| a[c] + b[c]));
    Ok((Curve::new(*curve.axis(), curve.dim(), sum.collect())?, pulled))
}

/// [`delta_curve`] for surfaces, with `2^times` fewer spans in each direction.
///
/// # Errors
/// As [`delta_curve`].
pub fn delta_surface(surface: &Surface, times: [usize; 2], pulls: &[Pull]) -> Result<(Surface, Pulled), EditError> {
    check(pulls, surface.axes())?;
    let axes = [coarse(&surface.axes()[0], times[0])?, coarse(&surface.axes()[1], times[1])?];
    let width = axes[1].len();
    let mut change = vec![[0.0; 3]; axes[0].len() * width];
    let now: Vec<_> = pulls.iter().map(|p| surface.derivative(p.at, p.orders)).collect();
    let rows: Vec<Factors> = pulls.iter().map(|p| [0, 1].map(|a| row(&axes[a], p.at[a], p.orders[a]))).collect();
    let pulled = solve(&rows, pulls, &now, |i, j, c, by| change[i * width + j][c] += by)?;
    let delta = Surface::new(axes, surface.dim(), change)?.refined(times)?;
    let sum = surface.points().iter().zip(delta.points()).map(|(a, b)| std::array::from_fn(|c| a[c] + b[c]));
    Ok((Surface::new(*surface.axes(), surface.dim(), sum.collect())?, pulled))
}

/// The functions alive at `t`, each once, in order.
fn row(axis: &Axis, t: f64, order: usize) -> Vec<(usize, f64)> {
    let mut out: Vec<(usize, f64)> = Vec::with_capacity(4);
    for (i, v) in basis::taps(axis, t, order).iter() {
        match out.iter_mut().find(|e| e.0 == i) {
            Some(e) => e.1 += v,
            None => out.push((i, v)),
        }
    }
    out.sort_unstable_by_key(|e| e.0);
    out
}

/// Pentland's shortcut, for comparison only: the bending energy in the wavelet basis with everything off its diagonal
/// dropped, minimised under the pulls. The thesis shows (6.3) why this is least squares in disguise: what is dropped is
/// not small. Smoother than least squares on the finest level, far from the least energy.
///
/// # Errors
/// As [`least_squares`].
pub fn pentland(curve: &Curve, pulls: &[Pull]) -> Result<(Curve, Pulled), EditError> {
    check(pulls, &[*curve.axis()])?;
    let ladder = CurveLadder::new(curve)?;
    let pyramid = ladder.axis().pyramid();
    let energy = gram::energy(pyramid, 2).unwrap_or_else(|| gram::mass(pyramid));
    let diagonals = energy_diagonals(pyramid, &energy);
    let mut diagonal = diagonals.smooth[0].clone();
    diagonals.detail.iter().for_each(|d| diagonal.extend_from_slice(d));
    // Straight lines cost nothing: a small cost keeps the coarsest functions determined.
    let least = diagonal.iter().copied().filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
    let floor = if least.is_finite() { 1e-3 * least } else { 1.0 };
    let weight: Vec<f64> = diagonal.iter().map(|d| d.max(floor).sqrt().recip()).collect();
    let rows: Vec<Factors> = pulls
        .iter()
        .map(|p| {
            let mut fine = vec![0.0; pyramid.len()];
            basis::taps(curve.axis(), p.at[0], p.orders[0]).iter().for_each(|(i, v)| fine[i] += v);
            let flat = pyramid.up(Kind::Basis, &fine)?;
            let scaled = flat.iter().zip(&weight).map(|(a, w)| a * w).enumerate();
            Ok([scaled.filter(|e| e.1 != 0.0).collect(), vec![(0, 1.0)]])
        })
        .collect::<Result<_, EditError>>()?;
    let now: Vec<_> = pulls.iter().map(|p| curve.derivative(p.at[0], p.orders[0])).collect();
    let mut change = vec![[0.0; 3]; pyramid.len()];
    let pulled = solve(&rows, pulls, &now, |i, _, c, by| change[i][c] += by * weight[i])?;
    let delta = pyramid.synthesize(&change)?;
    let sum = curve.points().iter().zip(&delta).map(|(a, b)| std::array::from_fn(|c| a[c] + b[c]));
    Ok((Curve::new(*curve.axis(), curve.dim(), sum.collect())?, pulled))
}
