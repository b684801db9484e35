//! Whether a solution keeps its promise: an independent Monte Carlo check of its irradiance.
//!
//! At random points, spread evenly over the area that the promise counts, backward paths estimate the true irradiance
//! E by independent parts. Of two parts a and b, whatever their noise, (a - s)(b - s) has the mean (E - s)^2: the mean
//! over the points is an unbiased mean square error of the solution's value s. The root of it bounds the mean absolute
//! error, which is what `--error` promises, from above; closely, when a third part says where errors are (`estimate`).
//!
//! The paths share the scene and the rays with the solver, and nothing else: no kernel, no oracle, no closed form.

mod estimate;
mod lamps;
mod paths;
mod stream;

pub use estimate::{Group, Report, Verdict};

use ondelette_numerics::{par, seed};
use ondelette_radiosity::scene::{Shape, Side};
use ondelette_radiosity::{Rgb, Scene};
use paths::Tracer;

/// Why there is nothing to verify.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VerifyError {
    /// Too few points say nothing, too many do not end.
    #[error(
        "{0} points make no sense: give between {least} and {most}",
        least = Verifier::POINTS.0,
        most = Verifier::POINTS.1
    )]
    Points(u64),
    /// Only lamps that reflect nothing.
    #[error("the scene '{0}' has no surface that the promise counts: all of them only emit")]
    NothingCounted(String),
}

/// A point of the check and what was found there.
#[derive(Clone, Copy, Debug)]
struct Found {
    side: u32,
    /// The solution's irradiance, and three independent estimates of the true one.
    solution: Rgb,
    thirds: [Rgb; 3],
}

impl Found {
    /// The best estimate.
    fn mean(&self) -> Rgb {
        (self.thirds[0] + self.thirds[1] + self.thirds[2]) * (1.0 / 3.0)
    }
}

/// Checks a solution step by step; [`Verifier::report`] is valid after any step.
///
/// ```
/// use ondelette_radiosity::{Settings, Solver, scene::samples};
/// use ondelette_verify::{Verdict, Verifier};
/// let settings = Settings { error: 0.05, ..Settings::default() };
/// let mut solver = Solver::new(samples::facing_squares(1.0), settings).unwrap();
/// while solver.step().is_some() {}
/// let solution = solver.into_solution();
/// let mut verifier = Verifier::new(solution.scene(), settings.error, 500).unwrap();
/// while verifier.step(|side, at| solution.irradiance(side, at)) {}
/// assert_eq!(verifier.report().verdict, Verdict::Kept);
/// ```
pub struct Verifier {
    tracer: Tracer,
    /// Counted sides with the area up to and with each.
    sides: Vec<(u32, f64)>,
    triangles: Vec<bool>,
    area: f64,
    promised: f64,
    points: usize,
    /// Paths of one third are the square of this.
    steps: u32,
    /// Points of one step.
    batch: usize,
    found: Vec<Found>,
}

/// Fewest and most points of one step, and the rays that it has about: some ten milliseconds of work in usual rooms.
const BATCH: (f64, f64) = (4.0, 32.0);
const RAYS: f64 = 4e6;
/// Paths of a third times the square of the promise: so many that 2,000 points decide about most errors.
const PATHS: f64 = 2.0;
/// Fewest and most of the square root of a third's paths.
const STEPS: (u32, u32) = (4, 160);
/// What tells the points' random numbers from the paths'.
const STREAM: u64 = 0x706f_696e_7473;
/// The golden ratio: steps of it fill an interval evenly, wherever one stops.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

impl Verifier {
    /// Fewest and most points.
    pub const POINTS: (u64, u64) = (100, 1_000_000);

    /// Prepares a check of solutions of `scene` against a promise (a fraction, see
    /// [`ondelette_radiosity::Settings::error`]) at so many points. The points and paths are the same every time.
    ///
    /// **Cost** that of a ray structure; then a few hundred rays a point and step, more for tighter promises.
    ///
    /// # Errors
    /// See [`VerifyError`].
    pub fn new(scene: &Scene, promised: f64, points: u64) -> Result<Self, VerifyError> {
        if !(Self::POINTS.0..=Self::POINTS.1).contains(&points) {
            return Err(VerifyError::Points(points));
        }
        let mut sides = Vec::new();
        let mut area = 0.0;
        for (i, &side) in (0u32..).zip(&scene.sides) {
            if !scene.material(side).is_pure_emitter() {
                area += scene.patches[side.patch as usize].area();
                sides.push((i, area));
            }
        }
        if sides.is_empty() {
            return Err(VerifyError::NothingCounted(scene.name.clone()));
        }
        let shape = |side: &Side| scene.patches[side.patch as usize].shape;
        let steps = (PATHS.sqrt() / promised.max(1e-9)).ceil().clamp(f64::from(STEPS.0), f64::from(STEPS.1));
        let reflected = scene.materials.iter().map(|m| m.reflectance.max()).fold(0.0, f64::max);
        let rays = 3.0 * steps * steps / (1.0 - reflected).max(1e-3);
        Ok(Verifier {
            tracer: Tracer::new(scene),
            sides,
            triangles: scene.sides.iter().map(|s| shape(s) == Shape::Triangle).collect(),
            area,
            promised,
            points: points as usize,
            steps: steps as u32,
            batch: (RAYS / rays).clamp(BATCH.0, BATCH.1) as usize,
            found: Vec::new(),
        })
    }

    /// Traces the next points; false when none was left. `irradiance` is what is checked, the same at each step: E at
    /// side-local coordinates of a side of the scene.
    pub fn step(&mut self, irradiance: impl Fn(usize, [f64; 2]) -> Rgb + Sync) -> bool {
        let from = self.found.len();
        let count = self.batch.min(self.points - from);
        let next = par::map(count, |k| self.look(&irradiance, (from + k) as u64));
        self.found.extend(next);
        count > 0
    }

    /// Points done and points in all.
    pub fn progress(&self) -> (usize, usize) {
        (self.found.len(), self.points)
    }

    /// What the points so far say.
    ///
    /// **Cost** some hundred passes over the points.
    pub fn report(&self) -> Report {
        estimate::judge(&self.found, self.promised, self.points, 3 * self.steps * self.steps)
    }

    fn look(&self, irradiance: impl Fn(usize, [f64; 2]) -> Rgb, k: u64) -> Found {
        let unit = |n| seed::unit(seed::combine(seed::combine(STREAM, k), n));
        // whatever number of points is done, they are spread evenly over the area
        let at = (GOLDEN * (k + 1) as f64 + unit(0) / self.points as f64).fract() * self.area;
        let index = self.sides.partition_point(|(_, end)| *end <= at).min(self.sides.len() - 1);
        let side = self.sides[index].0;
        let [mut s, mut t] = [unit(1), unit(2)];
        if self.triangles[side as usize] && s + t > 1.0 {
            (s, t) = (1.0 - s, 1.0 - t);
        }
        let third = |n| self.tracer.irradiance(side, [s, t], self.steps, seed::combine(k, n));
        Found { side, solution: irradiance(side as usize, [s, t]), thirds: [third(3), third(4), third(5)] }
    }
}
