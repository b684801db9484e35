//! One block of the operator, and what test samples say of its error (thesis 4.5.3: fit on one set, test on another).

use crate::cell::Cell;
use crate::kernel::{Detail, Kernel, Pair};
use ondelette_numerics::seed;
use ondelette_wavelet::cell::CellBasis;

/// The most children a cell has: one test sample a child.
pub const CHILDREN: usize = 4;

/// How exactly to couple a pair.
#[derive(Clone, Copy, Debug)]
pub struct CoupleSettings {
    /// Orders of receiver and shooter; where they are above that of the forest's basis, that.
    pub orders: [u8; 2],
    /// A change of the result (for a unit shooter) that does not matter: higher orders below it are dropped. Negative:
    /// none is.
    pub negligible: f64,
    /// Most mask samples for one receiver point.
    pub samples: usize,
    /// The last look at a pair: more mask samples before they may agree, and the shooter's present detail taken into
    /// account even where nothing masks it.
    pub thorough: bool,
}

impl CoupleSettings {
    /// All orders, no mask samples.
    pub const EXACT: CoupleSettings =
        CoupleSettings { orders: [u8::MAX; 2], negligible: 0.0, samples: 0, thorough: false };

    /// About how long a coupling takes in a basis of this order, in units of a few ten microseconds.
    pub(crate) fn work(&self, order: usize) -> usize {
        order.pow(4) / 4 + self.samples * (order + 2).pow(2) / 64 + 1
    }
}

/// One block with its error measures. Strengths are for a shooter of constant value 1.
#[derive(Clone, Debug)]
pub struct Coupling {
    /// Row-major `[receiver function][shooter function]`, over the truncated bases.
    pub block: Vec<f64>,
    /// Orders of receiver and shooter (4.5.1: M1 inside M2 inside M3).
    pub orders: [u8; 2],
    /// Mean of the result over the receiver.
    pub strength: f64,
    /// Result minus what the block predicts, at one test point in each child of the receiver.
    pub residual: [f64; CHILDREN],
    /// How badly polynomials of this order fit K over the shooter, times strength: multiplies shooter detail.
    pub roughness: f64,
    /// Standard deviation of the masked kernel over the shooter: multiplies shooter detail.
    pub spread: f64,
    /// Standard error of what the mask samples may have missed, times strength.
    pub unseen: f64,
    /// Whether mask samples were taken.
    pub masked: bool,
    /// Samples of the kernel taken.
    pub kernel_samples: u32,
}

/// Couples a receiver with a shooter; `None` where the kernel is certainly zero.
///
/// Cost: about (n + 1)^2 + 4 moment evaluations for n receiver points an axis, and as many mask evaluations if masked.
pub fn couple<K: Kernel>(
    kernel: &K,
    receiver: &Cell,
    receiver_basis: &CellBasis,
    shooter: &Cell,
    shooter_basis: &CellBasis,
    settings: CoupleSettings,
) -> Option<Coupling> {
    let pair = kernel.pair(receiver, shooter)?;
    let (nr, ns) = (receiver_basis.len(), shooter_basis.len());
    let analysis = receiver_basis.analysis(pair.receiver_points(receiver_basis.order()));
    let points = &analysis.points;
    let key = seed::combine(receiver.key, shooter.key.rotate_left(17));
    let masked = pair.is_masked();

    // samples of the result: masked moments at the fit points and at the test points
    let tests = receiver.shape.test_points();
    let places: Vec<[f64; 2]> = points.iter().chain(&tests).copied().collect();
    let mut moments = vec![0.0; places.len() * ns];
    for (x, row) in places.iter().zip(moments.chunks_mut(ns)) {
        pair.moments(*x, shooter_basis, row);
    }
    let nothing = moments.iter().all(|m| *m == 0.0);
    let mut seen = MaskSums::default();
    let mut mask_samples = 0;
    if masked {
        let smooth = moments.clone();
        // all points with few samples first; only where they disagree is the pair worth the rest. A point must not
        // decide for itself: stopping when its first samples agree would bias the mask towards 0 and 1.
        // The last look has more first samples: pairs of which nothing was seen are never refined.
        mask_samples = settings.samples.min(if settings.thorough { 2 * FIRST_SAMPLES } else { FIRST_SAMPLES });
        seen = MaskSums::take(&pair, &places, shooter_basis, &mut moments, mask_samples, key);
        if seen.is_mixed() && settings.samples > mask_samples {
            moments = smooth;
            mask_samples = settings.samples;
            seen = MaskSums::take(&pair, &places, shooter_basis, &mut moments, mask_samples, key);
        }
    } else if settings.thorough {
        for x in &places {
            let Detail { actual, projected } = pair.detail(*x, shooter_basis);
            seen.actual += actual;
            seen.projected += projected;
        }
    }
    let correction = seen.correction();
    if correction != 1.0 {
        moments.iter_mut().for_each(|m| *m *= correction);
    }

    let mut block = vec![0.0; nr * ns];
    for (i, weights) in analysis.matrix.chunks(points.len()).enumerate() {
        for (q, w) in weights.iter().enumerate() {
            if *w != 0.0 {
                for j in 0..ns {
                    block[i * ns + j] += w * moments[q * ns + j];
                }
            }
        }
    }

    // what is dropped is dropped before the block is put to the test
    let orders = truncate(&mut block, receiver_basis, shooter_basis, settings.negligible);

    // the block's answer to a shooter of constant value 1
    let constant: Vec<f64> = (0..nr).map(|i| total(shooter_basis, &block[i * ns..(i + 1) * ns])).collect();
    let strength = receiver_basis.mean(&constant, 0.0, |a, b, k| a + b * k);
    let mut residual = [0.0; CHILDREN];
    let mut values = vec![0.0; nr];
    for (t, x) in tests.iter().enumerate() {
        receiver_basis.eval(*x, &mut values);
        let predicted: f64 = values.iter().zip(&constant).map(|(v, c)| v * c).sum();
        let q = points.len() + t;
        residual[t] = total(shooter_basis, &moments[q * ns..(q + 1) * ns]) - predicted;
    }

    let unseen = if seen.smooth > 0.0 {
        // binomial error of a mask seen by N samples in all, with one pretended sample of the other kind
        let n = seen.points * mask_samples as f64;
        let p = ((seen.open / seen.smooth) * n + 0.5) / (n + 1.0);
        (p * (1.0 - p) / n).sqrt() * seen.smooth / seen.points
    } else if nothing {
        // all samples fell where the kernel is zero; they stand for all but one in that many
        pair.largest() / places.len() as f64
    } else {
        0.0
    };
    // detail of the shooter meets the misfit of K, and the mask's own variation over the shooter
    let spread = seen.spread / places.len() as f64;
    let roughness = roughness(&pair, receiver, shooter, shooter_basis) * strength;
    let rows = receiver_basis.truncated(usize::from(orders[0]));
    let columns = shooter_basis.truncated(usize::from(orders[1]));
    let entry = |(i, j): (u16, u16)| block[usize::from(i) * ns + usize::from(j)];
    Some(Coupling {
        block: rows.iter().flat_map(|&i| columns.iter().map(move |&j| (i, j))).map(entry).collect(),
        orders,
        strength,
        residual,
        roughness,
        spread,
        unseen,
        masked,
        kernel_samples: (places.len() * ns) as u32,
    })
}

/// Mask samples of a point that decide whether a pair needs more.
const FIRST_SAMPLES: usize = 16;

/// Sums over the receiver points of a masked pair, each weighted with what the point would receive unmasked.
#[derive(Default)]
struct MaskSums {
    /// Of the mask.
    open: f64,
    /// Of 1.
    smooth: f64,
    /// Of the mask's standard deviation over the shooter.
    spread: f64,
    /// Of what arrives at present, and of what would arrive from the shooter's projection.
    actual: f64,
    projected: f64,
    /// Number of points that would receive anything.
    points: f64,
}

impl MaskSums {
    fn take<P: Pair>(
        pair: &P,
        places: &[[f64; 2]],
        basis: &CellBasis,
        moments: &mut [f64],
        samples: usize,
        key: u64,
    ) -> Self {
        let mut sums = MaskSums::default();
        for (q, (x, row)) in places.iter().zip(moments.chunks_mut(basis.len())).enumerate() {
            let whole = total(basis, row);
            if whole > 0.0 {
                let mask = pair.mask(*x, basis, row, samples, seed::combine(key, q as u64));
                sums.open += mask.mean * whole;
                sums.smooth += whole;
                sums.spread += whole * (mask.mean * (1.0 - mask.mean)).max(0.0).sqrt();
                sums.actual += mask.detail.actual;
                sums.projected += mask.detail.projected;
                sums.points += 1.0;
            }
        }
        sums
    }

    /// How much more (or less) arrives than the shooter's projection says; 1 where nothing is known.
    fn correction(&self) -> f64 {
        if self.actual > 0.0 && self.projected > 0.0 { (self.actual / self.projected).clamp(0.5, 2.0) } else { 1.0 }
    }

    fn is_mixed(&self) -> bool {
        self.open > 0.0 && self.open < self.smooth * (1.0 - 1e-9)
    }
}

/// What a shooter of constant value 1 contributes, from its moments.
fn total(basis: &CellBasis, moments: &[f64]) -> f64 {
    if basis.is_nested() { moments[0] } else { moments.iter().sum() }
}

/// Relative misfit over the shooter of the polynomial that interpolates K at Gauss points, at test points.
fn roughness<P: Pair>(pair: &P, receiver: &Cell, shooter: &Cell, basis: &CellBasis) -> f64 {
    let centre = match receiver.shape {
        ondelette_wavelet::cell::CellShape::Triangle => [1.0 / 3.0, 1.0 / 3.0],
        _ => [0.5, 0.5],
    };
    let fit = basis.analysis(basis.order());
    let samples: Vec<f64> = fit.points.iter().map(|y| pair.sample(centre, *y)).collect();
    let coefficients = fit.coefficients(&samples);
    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
    if mean.abs() < f64::MIN_POSITIVE {
        return 1.0;
    }
    let mut values = vec![0.0; basis.len()];
    let tests = shooter.shape.test_points();
    let misfit: f64 = tests
        .iter()
        .map(|y| {
            basis.eval(*y, &mut values);
            let predicted: f64 = values.iter().zip(&coefficients).map(|(v, c)| v * c).sum();
            (pair.sample(centre, *y) - predicted).abs()
        })
        .sum::<f64>()
        / tests.len() as f64;
    (misfit / mean.abs()).min(10.0)
}

/// Sets to zero what belongs to orders that do not matter, and says which orders are left at either end.
fn truncate(block: &mut [f64], receiver: &CellBasis, shooter: &CellBasis, negligible: f64) -> [u8; 2] {
    let ns = shooter.len();
    let kept = |rows: &[u16], columns: &[u16], k: usize| {
        rows.contains(&((k / ns) as u16)) && columns.contains(&((k % ns) as u16))
    };
    let dropped = |block: &[f64], rows: &[u16], columns: &[u16]| -> f64 {
        (0..block.len()).filter(|&k| !kept(rows, columns, k)).map(|k| block[k].abs()).sum()
    };
    let lowest = |basis: &CellBasis| if basis.is_nested() { 1 } else { basis.order() };
    let all = shooter.truncated(shooter.order());
    let small = |p: &usize| dropped(block, receiver.truncated(*p), all) <= negligible;
    let p = (lowest(receiver)..receiver.order()).find(small).unwrap_or(receiver.order());
    let rows = receiver.truncated(p);
    let small = |q: &usize| dropped(block, rows, shooter.truncated(*q)) <= negligible;
    let q = (lowest(shooter)..shooter.order()).find(small).unwrap_or(shooter.order());
    let columns = shooter.truncated(q);
    for k in 0..block.len() {
        if !kept(rows, columns, k) {
            block[k] = 0.0;
        }
    }
    [p as u8, q as u8]
}
