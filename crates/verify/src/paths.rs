//! Irradiance at a point by backward paths: unbiased, without limits, without the solver.
//!
//! Light that comes straight from lamps is taken at every corner of a path from a random point on a random lamp; all
//! else from a random direction. Paths end by Russian roulette with the reflectance, so that a path's weight never
//! grows. Nothing is clamped. All that is shared with the solver is the scene and the rays.

use crate::lamps::Lamps;
use crate::stream::{Stream, cosine_direction};
use glam::DVec3;
use ondelette_numerics::seed;
use ondelette_radiosity::occluder::Occluders;
use ondelette_radiosity::scene::{Shape, Side};
use ondelette_radiosity::{Rgb, Scene};

/// A scene to walk through.
pub(crate) struct Tracer {
    occluders: Occluders,
    sides: Vec<Surface>,
    /// Front and back side of each patch.
    of_patch: Vec<[Option<u32>; 2]>,
    lamps: Lamps,
    /// The side of each lamp.
    lamp_sides: Vec<u32>,
}

/// One side.
struct Surface {
    patch: u32,
    origin: DVec3,
    edges: [DVec3; 2],
    normal: DVec3,
    triangle: bool,
    reflectance: Rgb,
    /// Sides of later patches in the same plane that face the same way and are near: where they overlap, they cover.
    covers: Vec<u32>,
}

impl Surface {
    fn of(scene: &Scene, side: Side) -> Self {
        let (origin, u, v) = scene.frame(side);
        Surface {
            patch: side.patch,
            origin,
            edges: [u, v],
            normal: u.cross(v).normalize(),
            triangle: scene.patches[side.patch as usize].shape == Shape::Triangle,
            reflectance: scene.material(side).reflectance,
            covers: Vec::new(),
        }
    }

    fn point(&self, [s, t]: [f64; 2]) -> DVec3 {
        self.origin + self.edges[0] * s + self.edges[1] * t
    }

    /// Whether a point of its plane lies on it.
    fn holds(&self, point: DVec3) -> bool {
        let [u, v] = self.edges;
        let (d, n) = (point - self.origin, u.cross(v));
        let scale = n.length_squared();
        let (s, t) = (v.cross(n).dot(d) / scale, n.cross(u).dot(d) / scale);
        s >= 0.0 && t >= 0.0 && if self.triangle { s + t <= 1.0 } else { s.max(t) <= 1.0 }
    }
}

/// Two sides closer in direction than this (1 minus cosine) may be one plane.
const PARALLEL: f64 = 1e-9;

impl Tracer {
    pub(crate) fn new(scene: &Scene) -> Self {
        let occluders = Occluders::new(scene);
        let mut sides: Vec<Surface> = scene.sides.iter().map(|&side| Surface::of(scene, side)).collect();
        let mut of_patch = vec![[None; 2]; scene.patches.len()];
        for (i, side) in (0u32..).zip(&scene.sides) {
            of_patch[side.patch as usize][usize::from(side.back)] = Some(i);
        }
        for i in 0..sides.len() {
            let own = &sides[i];
            let [u, v] = own.edges;
            let near = occluders.near(own.point([0.5; 2]), 0.5 * (u.length() + v.length()));
            let later = near.into_iter().filter(|&p| p > own.patch).flat_map(|p| of_patch[p as usize]).flatten();
            let covers = later.filter(|&k| {
                let other = &sides[k as usize];
                other.normal.dot(own.normal) > 1.0 - PARALLEL
                    && own.normal.dot(other.origin - own.origin).abs() <= occluders.tolerance()
            });
            sides[i].covers = covers.collect();
        }
        let (lamps, lamp_sides) = Lamps::of(scene);
        Tracer { occluders, sides, of_patch, lamps, lamp_sides }
    }

    fn is_covered(&self, side: u32, point: DVec3) -> bool {
        self.sides[side as usize].covers.iter().any(|&k| self.sides[k as usize].holds(point))
    }

    /// An unbiased estimate of the irradiance at a point of a side from `steps * steps` paths, a function of the key.
    pub(crate) fn irradiance(&self, side: u32, at: [f64; 2], steps: u32, key: u64) -> Rgb {
        let point = self.sides[side as usize].point(at);
        if self.is_covered(side, point) {
            return Rgb::BLACK;
        }
        let paths = steps * steps;
        let cell = 1.0 / f64::from(steps);
        let mut sum = Rgb::BLACK;
        let mut shifts = Stream::new(seed::combine(key, u64::from(u32::MAX)));
        let shift = [shifts.next(), shifts.next(), shifts.next()];
        for k in 0..paths {
            let mut stream = Stream::new(seed::combine(key, u64::from(k)));
            // a path a cell of the square: stratified in its first direction, and in its first lamp
            let (i, j) = (f64::from(k % steps), f64::from(k / steps));
            let first = [(i + stream.next()) * cell, (j + stream.next()) * cell];
            // which lamp and where on it: each stratified; turned round by a random shift, or the pairing of the strata
            // would be a bias
            let turned = k.wrapping_mul(LAMP_STRIDE) % paths;
            let strata = [
                (f64::from(k) + stream.next()) / f64::from(paths),
                (f64::from(turned % steps) + stream.next()) * cell,
                (f64::from(turned / steps) + stream.next()) * cell,
            ];
            let lamp = std::array::from_fn(|c| (strata[c] + shift[c]).fract());
            sum += self.direct(side, point, lamp);
            sum += self.reflected(side, point, first, &mut stream);
        }
        sum * (1.0 / f64::from(paths))
    }

    /// What one lamp sample brings to a point.
    fn direct(&self, side: u32, point: DVec3, [choice, s, t]: [f64; 3]) -> Rgb {
        let own = &self.sides[side as usize];
        let Some(sample) = self.lamps.sample(point, own.normal, choice, [s, t]) else { return Rgb::BLACK };
        let open = !self.is_covered(self.lamp_sides[sample.lamp as usize], sample.point)
            && !self.occluders.blocked(point, sample.point, [own.patch, sample.patch]);
        if open { sample.brings } else { Rgb::BLACK }
    }

    /// What one path of reflections brings to a point; emission is left to [`Tracer::direct`].
    fn reflected(&self, mut side: u32, mut point: DVec3, first: [f64; 2], stream: &mut Stream) -> Rgb {
        let (mut sum, mut weight) = (Rgb::BLACK, Rgb::grey(1.0));
        let mut draw = first;
        loop {
            let own = &self.sides[side as usize];
            let direction = cosine_direction(own.normal, draw);
            let Some(hit) = self.occluders.first_hit(point, direction, |patch, _| patch == own.patch) else {
                return sum;
            };
            let Some(next) = self.of_patch[hit.patch as usize][usize::from(!hit.front)] else { return sum };
            let surface = &self.sides[next as usize];
            let survival = surface.reflectance.max();
            if survival <= 0.0 || stream.next() >= survival {
                return sum;
            }
            weight = weight * surface.reflectance * (1.0 / survival);
            // the hit's parameters are the patch's: on a back the edges change places
            let at = if hit.front { hit.at } else { [hit.at[1], hit.at[0]] };
            (side, point) = (next, surface.point(at));
            sum += weight * self.direct(side, point, [stream.next(), stream.next(), stream.next()]);
            draw = [stream.next(), stream.next()];
        }
    }
}

/// A stride without small factors, for an order of cells that is not theirs.
const LAMP_STRIDE: u32 = 7919;
