//! From noisy thirds to a verdict.

use crate::Found;
use ondelette_numerics::{par, seed};
use ondelette_radiosity::Rgb;

/// What the check says about the promise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// The whole interval is within the promise.
    Kept,
    /// The whole interval is above it.
    Broken,
    /// The promise lies in the interval: more points are needed, about so many; none if no affordable number would do.
    Inconclusive(Option<u64>),
}

/// The error of one surface, or of many small ones with too few points each.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// The side; none for small ones taken together by their brightness.
    pub side: Option<u32>,
    /// Points on it.
    pub points: usize,
    /// Its share of the counted area.
    pub share: f64,
    /// Mean irradiance of the check, channels summed.
    pub mean: f64,
    /// Root mean square error over the mean irradiance of the **whole** scene; noise can make it 0.
    pub rms: f64,
    /// One standard deviation of the square of `rms`.
    pub spread: f64,
}

/// The outcome of a check. All errors are relative to the mean irradiance, as `--error` is.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Points done.
    pub points: usize,
    /// Points asked for.
    pub wanted: usize,
    /// Paths at each point, all thirds together.
    pub paths: u32,
    /// The promise.
    pub promised: f64,
    /// The error: an upper estimate of the mean absolute error, from mean squares.
    pub measured: f64,
    /// Where the measured error lies with 95 % confidence (bootstrap over the points).
    pub interval: [f64; 2],
    /// The mean absolute error is at least this, with 97.5 % confidence.
    pub at_least: f64,
    /// Mean of solution minus truth, and one standard deviation of it.
    pub bias: [f64; 2],
    /// Mean irradiance of the check.
    pub mean: Rgb,
    /// The verdict.
    pub verdict: Verdict,
    /// Surfaces, those that add most to the error first.
    pub groups: Vec<Group>,
}

/// Points that a surface needs for a figure of its own.
const LEAST: usize = 24;
/// Times that the points are drawn anew.
const DRAWS: usize = 1000;
/// An error stands out if its square is this many times the noise's.
const OUTSTANDING: f64 = 6.0;
/// More points than this would decide, but nobody waits for them.
const AFFORDABLE: f64 = 1e8;

/// A point, ready to be summed.
struct Term {
    /// The weight, and the square of the error over the weight: means over the three ways to choose the third that
    /// weighs the product of the two others. Per channel, apart for where the error stands out and where it does not.
    weight: [f64; 6],
    weighed: [f64; 6],
    /// Unbiased lower estimate of |E - s|, channels summed: the sign from two thirds, the size from the third.
    least: f64,
    /// Mean of the thirds, channels summed.
    value: f64,
}

pub(crate) fn judge(found: &[Found], promised: f64, wanted: usize, paths: u32) -> Report {
    let n = found.len() as f64;
    let group_of = groups(found);
    let terms = terms(found, &group_of);
    let all = || 0..terms.len();
    let measured = upper(&terms, all());
    let draws = par::map(DRAWS, |d| {
        let draw = || all().map(|k| (seed::unit(seed::combine(d as u64, k as u64)) * n) as usize);
        (upper(&terms, draw()), lower(&terms, draw()))
    });
    let quantile = |mut values: Vec<f64>, p: f64| {
        values.sort_by(f64::total_cmp);
        values[((values.len() - 1) as f64 * p).round() as usize]
    };
    let uppers: Vec<f64> = draws.iter().map(|d| d.0).collect();
    let lowers: Vec<f64> = draws.iter().map(|d| d.1).collect();
    let interval = [quantile(uppers.clone(), 0.025), quantile(uppers, 0.975)];

    let mean = found.iter().fold(Rgb::BLACK, |sum, f| sum + f.mean()) * (1.0 / n.max(1.0));
    let whole = mean.sum();
    let relative = |x: f64| if whole > 0.0 { x / whole } else { 0.0 };
    let excess = |f: &Found| f.solution.sum() - f.mean().sum();
    let (bias, bias_spread) = moments(found.iter().map(excess));
    Report {
        points: found.len(),
        wanted,
        paths,
        promised,
        measured,
        interval,
        at_least: quantile(lowers, 0.025).max(0.0),
        bias: [relative(bias), relative(bias_spread)],
        mean,
        verdict: verdict(promised, measured, interval, n),
        groups: summary(found, &group_of, whole),
    }
}

fn verdict(promised: f64, measured: f64, [low, high]: [f64; 2], points: f64) -> Verdict {
    if points == 0.0 {
        return Verdict::Inconclusive(None);
    }
    if high <= promised {
        return Verdict::Kept;
    }
    if low > promised {
        return Verdict::Broken;
    }
    // squares of errors are means over points: their interval shrinks with the root of the number
    let [square, low, high, wanted] = [measured, low, high, promised].map(|x| x * x);
    let half = (high - square).max(square - low);
    let needed = 1.3 * points * (half / (square - wanted)).powi(2);
    let rounded = |x: f64| {
        let digit = 10f64.powf(x.log10().floor());
        ((x / digit).ceil() * digit) as u64
    };
    Verdict::Inconclusive((needed <= AFFORDABLE).then(|| rounded(needed.max(2.0 * points))))
}

/// The group of each point: its side, if that has points enough; small sides are grouped by the solution's brightness.
fn groups(found: &[Found]) -> Vec<usize> {
    let sides = found.iter().map(|f| f.side as usize + 1).max().unwrap_or(0);
    let mut counts = vec![0; sides];
    for f in found {
        counts[f.side as usize] += 1;
    }
    let mut small: Vec<usize> = (0..found.len()).filter(|&k| counts[found[k].side as usize] < LEAST).collect();
    small.sort_by(|&a, &b| found[a].solution.sum().total_cmp(&found[b].solution.sum()).then(a.cmp(&b)));
    let mut group_of: Vec<usize> = found.iter().map(|f| f.side as usize).collect();
    let last = (small.len() / LEAST).max(1) - 1;
    for (rank, k) in small.into_iter().enumerate() {
        group_of[k] = sides + (rank / LEAST).min(last);
    }
    group_of
}

/// By Cauchy and Schwarz, with any weight w > 0, mean |d| <= root of (mean w) (mean d^2 / w), and equal for w = |d|. So
/// one third c weighs the product of the two others, by w^2 = (c - s)^2 + sigma^2, with sigma the noise of a third on
/// this surface. Where c - s stands out of the noise, w is about |d| and the bound about equal, even if errors are
/// concentrated in a few places; the rest is bounded by itself, about as a root mean square. Since c knows nothing of a
/// and b, none of this makes a bias. (sigma is taken from every other point, so that no point weighs itself.)
fn terms(found: &[Found], group_of: &[usize]) -> Vec<Term> {
    let groups = group_of.iter().max().map_or(0, |g| g + 1);
    let mut noise = vec![[[0.0; 4]; 2]; groups];
    for (k, f) in found.iter().enumerate() {
        let sum = &mut noise[group_of[k]][k % 2];
        sum[3] += 1.0;
        for (c, s) in sum[..3].iter_mut().enumerate() {
            let [x, y, z] = f.thirds.map(|t| t.0[c]);
            *s += ((x - y).powi(2) + (y - z).powi(2) + (z - x).powi(2)) / 6.0;
        }
    }
    let term = |(k, f): (usize, &Found)| {
        let sums = noise[group_of[k]][(k + 1) % 2];
        let (mut weight, mut weighed, mut least) = ([0.0; 6], [0.0; 6], 0.0);
        for c in 0..3 {
            let sigma2 = if sums[3] > 0.0 { sums[c] / sums[3] } else { 0.0 };
            let error = f.thirds.map(|t| t.0[c] - f.solution.0[c]);
            for turn in 0..3 {
                let [a, b, c_error] = [0, 1, 2].map(|i| error[(turn + i) % 3]);
                let w = (c_error * c_error + sigma2).sqrt();
                let part = if c_error * c_error > OUTSTANDING * sigma2 { c } else { 3 + c };
                weight[part] += w / 3.0;
                // a weight of 0: neither light nor error
                weighed[part] += if w > 0.0 { a * b / w / 3.0 } else { 0.0 };
                least += (a + b).signum() * c_error / 3.0;
            }
        }
        Term { weight, weighed, least, value: f.mean().sum() }
    };
    found.iter().enumerate().map(term).collect()
}

/// Upper estimate of the mean absolute error over some points, relative to their mean irradiance.
fn upper(terms: &[Term], points: impl Iterator<Item = usize>) -> f64 {
    let (mut weights, mut squares, mut value) = ([0.0; 6], [0.0; 6], 0.0);
    for k in points {
        let term = &terms[k];
        value += term.value;
        for c in 0..6 {
            weights[c] += term.weight[c];
            squares[c] += term.weighed[c];
        }
    }
    let sum: f64 = (0..6).map(|c| (weights[c] * squares[c]).max(0.0).sqrt()).sum();
    share(sum, value)
}

/// Lower estimate: the mean of sign(a + b - 2 s) (c - s) is at most |E - s|, as that of the sign is between -1 and 1.
fn lower(terms: &[Term], points: impl Iterator<Item = usize>) -> f64 {
    let (mut sum, mut value) = (0.0, 0.0);
    for k in points {
        sum += terms[k].least;
        value += terms[k].value;
    }
    share(sum, value)
}

/// An error over the light there is; in the dark, any error at all is infinite.
fn share(error: f64, light: f64) -> f64 {
    if light > 0.0 {
        error / light
    } else if error > 0.0 {
        f64::INFINITY
    } else {
        0.0
    }
}

/// Mean, and the standard deviation of the mean.
fn moments(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for v in values {
        n += 1.0;
        sum += v;
        squares += v * v;
    }
    if n < 2.0 {
        return (sum, 0.0);
    }
    let mean = sum / n;
    (mean, ((squares / n - mean * mean).max(0.0) / (n - 1.0)).sqrt())
}

/// The figures of each group, the largest share of the error first.
fn summary(found: &[Found], group_of: &[usize], whole: f64) -> Vec<Group> {
    let groups = group_of.iter().max().map_or(0, |g| g + 1);
    let mut members: Vec<Vec<&Found>> = vec![Vec::new(); groups];
    for (f, &g) in found.iter().zip(group_of) {
        members[g].push(f);
    }
    let sides = found.iter().map(|f| f.side as usize + 1).max().unwrap_or(0);
    let mut all: Vec<Group> = members
        .into_iter()
        .enumerate()
        .filter(|(_, points)| !points.is_empty())
        .map(|(g, points)| {
            let error = |f: &&Found| {
                let [a, b, c] = f.thirds.map(|t| t - f.solution);
                (a * b + b * c + c * a).sum() / 3.0
            };
            // three channels' squares: their sum over the square of the sum of the means, as for a grey scene
            let (square, spread) = moments(points.iter().map(|f| 3.0 * error(f)));
            let light: f64 = points.iter().map(|f| f.mean().sum()).sum();
            let scale = if whole > 0.0 { 1.0 / (whole * whole) } else { 0.0 };
            Group {
                side: (g < sides).then_some(g as u32),
                points: points.len(),
                share: points.len() as f64 / found.len() as f64,
                mean: light / points.len() as f64,
                rms: (square * scale).max(0.0).sqrt(),
                spread: spread * scale,
            }
        })
        .collect();
    all.sort_by(|a, b| (b.share * b.rms).total_cmp(&(a.share * a.rms)));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on three sides with relative errors of known size and sign, seen through noise many times as large.
    fn noisy(error: f64, noise: f64, points: usize) -> Vec<Found> {
        (0..points)
            .map(|k| {
                let draw = |n: u64| 12f64.sqrt() * (seed::unit(seed::combine(k as u64, n)) - 0.5);
                let side = (k % 3) as u32;
                let truth = 1.0 + f64::from(side);
                let sign = if seed::unit(seed::combine(k as u64, 9)) < 0.5 { -1.0 } else { 1.0 };
                let third = |n| Rgb::grey(truth * (1.0 + noise * draw(n)));
                Found {
                    side,
                    solution: Rgb::grey(truth * (1.0 + sign * error)),
                    thirds: [third(1), third(2), third(3)],
                }
            })
            .collect()
    }

    #[test]
    fn errors_far_below_the_noise_are_measured_without_bias() {
        for (error, noise) in [(0.0, 0.05), (0.02, 0.05), (0.02, 0.002), (0.05, 0.1)] {
            let report = judge(&noisy(error, noise, 4000), 0.01, 4000, 2);
            let [low, high] = report.interval;
            // an upper estimate: a third's noise may add to it, in the square
            let least = error - 1e-9..(error * error + noise * noise).sqrt();
            assert!(least.contains(&low) || low < error, "{error} {noise}: {} in {low} .. {high}", report.measured);
            assert!(error <= high, "{error} {noise}: {} in {low} .. {high}", report.measured);
            // the square's noise over the root of 4000, four times: the width of an interval
            let wide = (high * high - low * low) / (noise * (noise + 2.0 * error));
            assert!(wide < 0.12 && report.at_least <= error, "{error} {noise}: {low} {high} {}", report.at_least);
        }
    }

    /// One point in fifty is off by as much as there is light, the others are right: the root mean square is seven
    /// times the mean error, and says nothing.
    #[test]
    fn concentrated_errors_are_not_blown_up() {
        let mut found = noisy(0.0, 0.03, 4000);
        for f in found.iter_mut().step_by(50) {
            f.solution = f.solution * 2.0;
        }
        let report = judge(&found, 0.03, 4000, 3);
        assert!((0.018..0.03).contains(&report.measured), "{}", report.measured);
        assert!(report.at_least > 0.01 && report.at_least < 0.021, "{}", report.at_least);
    }

    #[test]
    fn verdicts_follow_the_interval() {
        let of = |error, promised, points| judge(&noisy(error, 0.05, points), promised, points, 2).verdict;
        assert_eq!(of(0.005, 0.015, 4000), Verdict::Kept);
        assert_eq!(of(0.03, 0.015, 4000), Verdict::Broken);
        let Verdict::Inconclusive(Some(points)) = of(0.02, 0.01, 200) else { panic!("not enough points to decide") };
        assert!((400..10_000).contains(&points), "{points}");
        assert_eq!(of(0.02, 0.01, 5 * points as usize), Verdict::Broken);
    }

    #[test]
    fn no_points_decide_nothing_and_the_dark_has_no_error() {
        let report = judge(&[], 0.01, 100, 2);
        assert_eq!((report.verdict, report.points), (Verdict::Inconclusive(None), 0));
        let dark = Found { side: 0, solution: Rgb::BLACK, thirds: [Rgb::BLACK; 3] };
        let report = judge(&[dark; 100], 0.01, 100, 2);
        assert_eq!((report.measured, report.verdict), (0.0, Verdict::Kept));
    }

    #[test]
    fn the_lower_estimate_is_close_when_there_is_little_noise() {
        let report = judge(&noisy(0.02, 0.002, 1000), 0.01, 1000, 2);
        assert!(report.at_least > 0.019 && report.at_least <= 0.0201, "{}", report.at_least);
    }
}
