//! The energy ledger: what is emitted must be absorbed, lost on black backs, or escape.
//!
//! Absorption at fronts is read from the solution; losses and escapes are counted by rays that leave every side with
//! its radiosity. The two sides of the ledger are independent, so that closing says something.

use crate::kernel::LightKernel;
use crate::rgb::Rgb;
use crate::solution::Solution;
use ondelette_numerics::par;
use ondelette_wavelet::cell::CellShape;
use serde::{Deserialize, Serialize};

/// Powers, in the scene's power unit times (scene units / metre)^2.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    /// Sum over emitters of pi L A.
    pub emitted: Rgb,
    /// Integral over all sides of (1 - rho) E.
    pub absorbed: Rgb,
    /// What reaches backs of one-sided patches: they are black.
    pub lost_on_backs: Rgb,
    /// What leaves the scene.
    pub escaped: Rgb,
    /// Rays counted.
    pub rays: u64,
}

/// Points an axis at which the lit part of an element is looked for.
const LOOKS: u32 = 4;

/// Mean irradiance of an element that is partly inside of something, where it is dark.
fn lit_mean(solution: &Solution, kernel: &LightKernel, leaf: usize, side: usize) -> Rgb {
    let cell = solution.forest().nodes()[leaf].cell;
    let mut sum = Rgb::BLACK;
    for i in 0..LOOKS * LOOKS {
        let at = [i % LOOKS, i / LOOKS].map(|k| (f64::from(k) + 0.5) / f64::from(LOOKS));
        let folded = cell.shape == CellShape::Triangle && at[0] + at[1] > 1.0;
        let at = cell.to_root(if folded { [1.0 - at[0], 1.0 - at[1]] } else { at });
        if !kernel.is_buried(side, solution.point(side, at)) {
            sum += solution.irradiance(side, at);
        }
    }
    sum * (1.0 / f64::from(LOOKS * LOOKS))
}

/// One ray's end: power and what it met.
enum End {
    Front,
    Back,
    Away,
}

impl Ledger {
    /// Counts with about `rays` rays, stratified over power; deterministic. Cost: that many rays.
    ///
    /// ```
    /// use ondelette_radiosity::{ledger::Ledger, scene::samples, Settings, Solver};
    /// let mut solver = Solver::new(samples::facing_squares(1.0), Settings::default()).unwrap();
    /// while solver.step().is_some() {}
    /// let ledger = Ledger::count(&solver.solution(), 100_000);
    /// assert!((ledger.emitted.0[0] - 1.0).abs() < 1e-9);
    /// assert!((ledger.escaped.0[0] - 0.800).abs() < 0.003);
    /// assert!(ledger.closure().abs() < 0.005);
    /// ```
    pub fn count(solution: &Solution, rays: u64) -> Ledger {
        let scene = solution.scene();
        let kernel = LightKernel::new(scene);
        let mut ledger =
            Ledger { emitted: Rgb::BLACK, absorbed: Rgb::BLACK, lost_on_backs: Rgb::BLACK, escaped: Rgb::BLACK, rays };
        // leaves with their shares of the outgoing power
        let mut leaves = Vec::new();
        let mut whole = 0.0;
        solution.each_leaf(|leaf, side, area, mean| {
            let mean = match solution.lit()[leaf] {
                lit if lit >= 1.0 => mean,
                lit if lit > 0.0 => lit_mean(solution, &kernel, leaf, side),
                _ => Rgb::BLACK,
            };
            let material = scene.material(scene.sides[side]);
            let exitance = material.radiance * std::f64::consts::PI;
            ledger.emitted += exitance * area;
            ledger.absorbed += (mean - material.reflectance * mean) * area;
            let power = (exitance + material.reflectance * mean).sum().max(0.0) * area;
            if power > 0.0 {
                whole += power;
                leaves.push((leaf, side, area, power, whole));
            }
        });
        if whole <= 0.0 || rays == 0 {
            return ledger;
        }
        const CHUNK: u64 = 4096;
        let chunks = rays.div_ceil(CHUNK) as usize;
        let counted = par::map(chunks, |chunk| {
            let mut sums = [Rgb::BLACK; 2];
            for i in chunk as u64 * CHUNK..rays.min((chunk as u64 + 1) * CHUNK) {
                let aim = (i as f64 + 0.5) / rays as f64 * whole;
                let (leaf, side, area, power, _) = leaves[leaves.partition_point(|l| l.4 <= aim).min(leaves.len() - 1)];
                // R4 sequence (Roberts 2018): point and direction
                const ALPHA: [f64; 4] =
                    [0.856_674_883_854_502_9, 0.733_891_856_627_126, 0.628_706_721_037_808_6, 0.538_597_257_223_613];
                let u: [f64; 4] = std::array::from_fn(|k| (0.5 + ALPHA[k] * (i + 1) as f64).fract());
                let cell = solution.forest().nodes()[leaf].cell;
                let frame = &kernel.sides()[side];
                let mut local = [u[0], u[1]];
                if frame.shape == CellShape::Triangle && u[0] + u[1] > 1.0 {
                    local = [1.0 - u[0], 1.0 - u[1]];
                }
                let at = cell.to_root(local);
                let from = solution.point(side, at);
                let lit = solution.lit()[leaf];
                let share = area / power * whole / rays as f64;
                if lit < 1.0 && (lit == 0.0 || kernel.is_buried(side, from)) {
                    // what is emitted inside of something stays there
                    sums[0] += scene.material(scene.sides[side]).radiance * (std::f64::consts::PI * share);
                    continue;
                }
                let weight = solution.radiosity(side, at) * share;
                let tangent = frame.edges[0].normalize();
                let bitangent = frame.normal.cross(tangent);
                let (sine, angle) = (u[2].sqrt(), std::f64::consts::TAU * u[3]);
                let direction =
                    (tangent * angle.cos() + bitangent * angle.sin()) * sine + frame.normal * (1.0 - u[2]).sqrt();
                let own = frame.patch;
                if kernel.is_covered(side, from) {
                    // what lies under another face shines on its back
                    sums[0] += weight;
                    continue;
                }
                let end = match kernel.occluders().first_hit(from, direction, |patch, _| patch == own) {
                    None => End::Away,
                    Some(hit) => {
                        let two_sided = kernel.side_of(hit.patch, !hit.front).is_some();
                        if hit.front || two_sided { End::Front } else { End::Back }
                    }
                };
                match end {
                    End::Front => {}
                    End::Back => sums[0] += weight,
                    End::Away => sums[1] += weight,
                }
            }
            sums
        });
        for [backs, away] in counted {
            ledger.lost_on_backs += backs;
            ledger.escaped += away;
        }
        ledger
    }

    /// (absorbed + lost + escaped - emitted) / emitted, channels summed: 0 when the ledger closes, as in the dark.
    pub fn closure(&self) -> f64 {
        let astray = (self.absorbed + self.lost_on_backs + self.escaped - self.emitted).sum();
        if astray == 0.0 { 0.0 } else { astray / self.emitted.sum() }
    }
}
