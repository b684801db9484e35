//! Pictures straight from the basis functions: one ray a sample, the radiance that the solution has where it arrives.
//!
//! Camera rays alone look through the backs of one-sided patches, so that a closed room can be seen from outside.

use crate::kernel::LightKernel;
use crate::probe::Prober;
use crate::rgb::Rgb;
use crate::scene::{Camera, Scene};
use crate::settings::DirectLight;
use crate::solution::Solution;
use glam::DVec3;
use ondelette_numerics::par;

/// Samples of a pixel an axis.
const SAMPLES: usize = 3;
/// Samples on the diagonal of a pixel: where direct light is gathered and these differ by no more than this share, on
/// one surface, they speak for the others.
const DIAGONAL: [usize; 3] = [0, 4, 8];
const EVEN: f64 = 0.02;
/// Rows of a step.
const ROWS: usize = 8;

/// Renders band by band.
pub struct Renderer<'a> {
    solution: &'a Solution,
    prober: Option<Prober<'a>>,
    kernel: LightKernel,
    lens: Lens,
    size: [usize; 2],
    pixels: Vec<[f32; 3]>,
}

struct Lens {
    eye: DVec3,
    forward: DVec3,
    right: DVec3,
    up: DVec3,
}

impl Lens {
    fn new(camera: &Camera, aspect: f64) -> Self {
        let forward = (camera.at - camera.eye).normalize_or(DVec3::NEG_Z);
        let mut right = forward.cross(camera.up);
        if right.length() < 1e-9 {
            right = forward.any_orthogonal_vector();
        }
        let right = right.normalize();
        let up = right.cross(forward);
        let half = (0.5 * camera.fov.to_radians()).tan();
        Lens { eye: camera.eye, forward, right: right * (half * aspect), up: up * half }
    }

    /// Direction through (x, y) in [-1, 1]^2, y up.
    fn direction(&self, x: f64, y: f64) -> DVec3 {
        self.forward + self.right * x + self.up * y
    }
}

impl<'a> Renderer<'a> {
    /// Prepares a picture of `width` x `height` pixels, of the solution as its settings say that it is read.
    pub fn new(solution: &'a Solution, camera: &Camera, width: usize, height: usize) -> Self {
        let kernel = LightKernel::new(solution.scene());
        let is_gathered = solution.settings().direct == DirectLight::Gathered;
        let prober = is_gathered.then(|| Prober::new(solution));
        let lens = Lens::new(camera, width as f64 / height.max(1) as f64);
        Renderer { solution, prober, kernel, lens, size: [width, height], pixels: Vec::with_capacity(width * height) }
    }

    /// Renders the next band of rows; true when the picture is complete.
    pub fn step(&mut self) -> bool {
        let [width, height] = self.size;
        let from = self.pixels.len().checked_div(width).unwrap_or(height);
        let rows = ROWS.min(height - from);
        let band = par::map(rows * width, |i| self.pixel(i % width, from + i / width));
        self.pixels.extend(band);
        from + rows >= height
    }

    /// Share of the rows done.
    pub fn progress(&self) -> f64 {
        self.pixels.len() as f64 / (self.size[0] * self.size[1]).max(1) as f64
    }

    /// Radiance of each pixel, rows from the top; shorter than the picture until all steps are done.
    pub fn into_pixels(self) -> Vec<[f32; 3]> {
        self.pixels
    }

    fn pixel(&self, column: usize, row: usize) -> [f32; 3] {
        let [width, height] = self.size.map(|n| n as f64);
        let seen: [Option<(usize, [f64; 2])>; SAMPLES * SAMPLES] = std::array::from_fn(|k| {
            let offset = |k: usize| (k as f64 + 0.5) / SAMPLES as f64;
            let x = 2.0 * (column as f64 + offset(k % SAMPLES)) / width - 1.0;
            let y = 1.0 - 2.0 * (row as f64 + offset(k / SAMPLES)) / height;
            self.surface(self.lens.direction(x, y))
        });
        let mean = |radiances: &[Rgb]| {
            let sum = radiances.iter().fold(Rgb::BLACK, |sum, r| sum + *r);
            (sum * (1.0 / radiances.len() as f64)).0.map(|c| c as f32)
        };
        let is_one_surface = seen.iter().all(|s| s.map(|s| s.0) == seen[0].map(|s| s.0));
        if self.prober.is_some() && is_one_surface {
            let some = DIAGONAL.map(|k| self.radiance(seen[k]));
            let [low, high] = [f64::min, f64::max].map(|f| some.map(|r| r.sum()).into_iter().reduce(f).unwrap_or(0.0));
            if high - low <= EVEN * high {
                return mean(&some);
            }
        }
        mean(&seen.map(|at| self.radiance(at)))
    }

    /// The side that is seen in a direction, and where.
    fn surface(&self, direction: DVec3) -> Option<(usize, [f64; 2])> {
        let kernel = &self.kernel;
        let through = |patch, front: bool| kernel.side_of(patch, !front).is_none();
        let hit = kernel.occluders().first_hit(self.lens.eye, direction, through)?;
        let side = kernel.side_of(hit.patch, !hit.front)?;
        Some((side, if hit.front { hit.at } else { [hit.at[1], hit.at[0]] }))
    }

    fn radiance(&self, seen: Option<(usize, [f64; 2])>) -> Rgb {
        let Some((side, at)) = seen else { return Rgb::BLACK };
        let radiosity = match &self.prober {
            Some(prober) => prober.radiosity(side, at),
            None => self.solution.radiosity(side, at),
        };
        radiosity.map(|b| (b / std::f64::consts::PI).max(0.0))
    }
}

/// A whole picture at once: radiance of each pixel, rows from the top.
///
/// ```
/// use ondelette_radiosity::{scene::samples, view, Settings, Solver};
/// let mut solver = Solver::new(samples::cube(0.5, [0.5; 6]), Settings::default()).unwrap();
/// while solver.step().is_some() {}
/// let solution = solver.solution();
/// let camera = view::frame_from_inside(solution.scene());
/// // a white furnace looks the same everywhere: B = 0.5 / (1 - 0.5) = 1
/// for pixel in view::render(&solution, &camera, 8, 6) {
///     assert!((pixel[0] - std::f32::consts::FRAC_1_PI).abs() < 1e-3);
/// }
/// ```
pub fn render(solution: &Solution, camera: &Camera, width: usize, height: usize) -> Vec<[f32; 3]> {
    let mut renderer = Renderer::new(solution, camera, width, height);
    while !renderer.step() {}
    renderer.into_pixels()
}

/// A camera that frames the scene from inside: of a few places near the walls, corners and the middle, the one that
/// sees the most of the scene's fronts. Up is +Y where the file states its conventions (glTF), else the shortest
/// extent.
pub fn frame_from_inside(scene: &Scene) -> Camera {
    let [low, high] = scene.bounds;
    let size = high - low;
    let axis = if scene.unit.stated || (size.y <= size.x && size.y <= size.z) {
        1
    } else if size.z <= size.x {
        2
    } else {
        0
    };
    let up = [DVec3::X, DVec3::Y, DVec3::Z][axis];
    let kernel = LightKernel::new(scene);
    let middle = 0.5 * (low + high);
    let horizontal: Vec<usize> = (0..3).filter(|&a| a != axis).collect();
    let mut best: Option<(f64, Camera)> = None;
    for height in [0.5, 0.75, 0.3] {
        for a in [0.06, 0.5, 0.94] {
            for b in [0.06, 0.5, 0.94] {
                let mut eye = middle;
                eye[horizontal[0]] = low[horizontal[0]] + a * size[horizontal[0]];
                eye[horizontal[1]] = low[horizontal[1]] + b * size[horizontal[1]];
                eye[axis] = low[axis] + height * size[axis];
                let mut at = middle;
                at[axis] = low[axis] + 0.45 * size[axis];
                // straight up or down there is no up
                let across = (eye - at).reject_from(up).length();
                if across < 0.05 * size.length() {
                    at[horizontal[0]] = high[horizontal[0]];
                }
                let camera = Camera { eye, at, up, fov: 70.0 };
                let score = view_score(&kernel, scene, &camera);
                if best.is_none_or(|(s, _)| score > s) {
                    best = Some((score, camera));
                }
            }
        }
    }
    best.map_or(Camera { eye: low, at: high, up, fov: 70.0 }, |b| b.1)
}

/// How much a camera sees: fronts at a good distance count, backs and empty space do not.
fn view_score(kernel: &LightKernel, scene: &Scene, camera: &Camera) -> f64 {
    let lens = Lens::new(camera, 4.0 / 3.0);
    let mut score = 0.0;
    for i in 0..16 {
        for j in 0..12 {
            let (x, y) = ((f64::from(i) + 0.5) / 8.0 - 1.0, (f64::from(j) + 0.5) / 6.0 - 1.0);
            let direction = lens.direction(x, y).normalize();
            if let Some(hit) = kernel.occluders().first_hit(camera.eye, direction, |_, _| false)
                && kernel.side_of(hit.patch, !hit.front).is_some()
            {
                score += (hit.t / scene.diagonal()).sqrt();
            }
        }
    }
    score
}
