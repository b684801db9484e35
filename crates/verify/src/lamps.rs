//! A point on a lamp, chosen at random: which lamp by a tree of powers and distances, where on it by solid angle.

use glam::DVec3;
use ondelette_radiosity::scene::Shape;
use ondelette_radiosity::{Rgb, Scene};
use std::f64::consts::PI;

/// One emitting side.
struct Lamp {
    patch: u32,
    origin: DVec3,
    edges: [DVec3; 2],
    normal: DVec3,
    triangle: bool,
    area: f64,
    exitance: Rgb,
    low: DVec3,
    high: DVec3,
    power: f64,
}

/// A node of the tree: a box of lamps.
struct Node {
    low: DVec3,
    high: DVec3,
    power: f64,
    area: f64,
    /// Children, or none for the one lamp of a leaf.
    children: Option<[u32; 2]>,
    lamp: u32,
}

/// All lamps of a scene (Conty Estevez and Kulla 2018, in their simplest form).
pub(crate) struct Lamps {
    lamps: Vec<Lamp>,
    nodes: Vec<Node>,
}

/// Light on its way from a lamp: where it starts, and what it brings if nothing is in between, divided by the
/// probability of that choice.
pub(crate) struct Sample {
    /// Which lamp.
    pub(crate) lamp: u32,
    /// Its patch.
    pub(crate) patch: u32,
    pub(crate) point: DVec3,
    pub(crate) brings: Rgb,
}

/// Lamps closer than this many of their widths are sampled by solid angle; by area, the others would do no better.
const CLOSE: f64 = 3.0;

impl Lamps {
    /// The lamps, and the side of each.
    pub(crate) fn of(scene: &Scene) -> (Self, Vec<u32>) {
        let (mut lamps, mut sides) = (Vec::new(), Vec::new());
        for (i, &side) in (0u32..).zip(&scene.sides) {
            let exitance = scene.material(side).radiance * PI;
            if exitance.sum() <= 0.0 {
                continue;
            }
            let patch = &scene.patches[side.patch as usize];
            let (origin, u, v) = scene.frame(side);
            let corners = patch.corners();
            sides.push(i);
            lamps.push(Lamp {
                patch: side.patch,
                origin,
                edges: [u, v],
                normal: u.cross(v).normalize(),
                triangle: patch.shape == Shape::Triangle,
                area: patch.area(),
                exitance,
                low: corners.iter().fold(DVec3::INFINITY, |a, b| a.min(*b)),
                high: corners.iter().fold(DVec3::NEG_INFINITY, |a, b| a.max(*b)),
                power: exitance.sum() * patch.area(),
            });
        }
        let mut tree = Lamps { lamps, nodes: Vec::new() };
        let mut order: Vec<u32> = (0..tree.lamps.len() as u32).collect();
        if !order.is_empty() {
            tree.grow(&mut order);
        }
        (tree, sides)
    }

    /// Appends the node of some lamps, and those below it; its index.
    fn grow(&mut self, order: &mut [u32]) -> u32 {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (mut power, mut area) = (0.0, 0.0);
        for &k in order.iter() {
            let lamp = &self.lamps[k as usize];
            (low, high) = (low.min(lamp.low), high.max(lamp.high));
            (power, area) = (power + lamp.power, area + lamp.area);
        }
        let index = self.nodes.len();
        self.nodes.push(Node { low, high, power, area, children: None, lamp: order[0] });
        if order.len() > 1 {
            let size = high - low;
            let axis = if size.x >= size.y.max(size.z) {
                DVec3::X
            } else if size.y >= size.z {
                DVec3::Y
            } else {
                DVec3::Z
            };
            let lamps = &self.lamps;
            let centre = |k: &u32| axis.dot(lamps[*k as usize].low + lamps[*k as usize].high);
            order.sort_by(|a, b| centre(a).total_cmp(&centre(b)).then(a.cmp(b)));
            let (left, right) = order.split_at_mut(order.len() / 2);
            let children = [self.grow(left), self.grow(right)];
            self.nodes[index].children = Some(children);
        }
        index as u32
    }

    /// A lamp for a point, and the probability of the choice; `u` in [0, 1) is used up and what is left of it, again in
    /// [0, 1), given back. None if no lamp can bring anything, or if the choice fell among such.
    fn pick(&self, x: DVec3, n: DVec3, mut u: f64) -> Option<(u32, f64, f64)> {
        let mut node = self.nodes.first()?;
        let mut probability = 1.0;
        while let Some(children) = node.children {
            let [a, b] = children.map(|c| &self.nodes[c as usize]);
            let [wa, wb] = [self.importance(a, x, n), self.importance(b, x, n)];
            let whole = wa + wb;
            if whole <= 0.0 {
                return None;
            }
            let share = wa / whole;
            // strictly below: a share of 0 is never chosen
            if u < share {
                (node, probability, u) = (a, probability * share, u / share);
            } else {
                (node, probability, u) = (b, probability * (1.0 - share), (u - share) / (1.0 - share));
            }
        }
        Some((node.lamp, probability, u.clamp(0.0, 1.0 - 1e-16)))
    }

    /// What a node may bring, roughly; 0 only if it is nothing. From its nearest point, as long lamps are close to some
    /// of what they light: by their middles, a strip that gives nearly all light nearby would hardly ever be chosen.
    fn importance(&self, node: &Node, x: DVec3, n: DVec3) -> f64 {
        let middle = 0.5 * (node.low + node.high) - x;
        let height = n.dot(middle) + n.abs().dot(0.5 * (node.high - node.low));
        if height <= 0.0 {
            return 0.0;
        }
        let square = x.clamp(node.low, node.high).distance_squared(x);
        let cosine = |above: f64| if above * above < square { above / square.sqrt() } else { 1.0 };
        let mut cosines = cosine(height);
        if node.children.is_none() {
            let lamp = &self.lamps[node.lamp as usize];
            let behind = lamp.normal.dot(x - lamp.origin);
            if behind <= 0.0 {
                return 0.0;
            }
            cosines *= cosine(behind).max(1e-3);
        }
        node.power * cosines / node.area.max(PI * square)
    }

    /// A point on some lamp, for a point with a unit normal, from three numbers in [0, 1).
    pub(crate) fn sample(&self, x: DVec3, n: DVec3, choice: f64, at: [f64; 2]) -> Option<Sample> {
        let (k, probability, rest) = self.pick(x, n, choice)?;
        let lamp = &self.lamps[k as usize];
        let (point, brings) = lamp.sample(x, n, rest, at)?;
        let scaled = lamp.exitance * (brings / probability);
        Some(Sample { lamp: k, patch: lamp.patch, point, brings: scaled })
    }
}

impl Lamp {
    /// A point on the lamp and cos cos / (pi r^2) there over the density of the choice.
    fn sample(&self, x: DVec3, n: DVec3, choice: f64, [s, t]: [f64; 2]) -> Option<(DVec3, f64)> {
        let [u, v] = self.edges;
        let o = self.origin;
        let height = self.normal.dot(x - o);
        if height <= 0.0 {
            return None;
        }
        let centre = o + (u + v) * if self.triangle { 1.0 / 3.0 } else { 0.5 };
        if centre.distance_squared(x) < CLOSE * CLOSE * self.area.max(u.length_squared()).max(v.length_squared())
            && let Some((direction, solid)) = self.by_solid_angle(x, choice, [s, t])
        {
            let fall = -self.normal.dot(direction);
            let cosine = n.dot(direction);
            if fall <= 0.0 || cosine <= 0.0 {
                return None;
            }
            return Some((x + direction * (height / fall), cosine * solid / PI));
        }
        let (s, t) = if self.triangle && s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
        let point = o + u * s + v * t;
        let d = point - x;
        let (near, far) = (n.dot(d), -self.normal.dot(d));
        let r2 = d.length_squared();
        (near > 0.0 && far > 0.0).then(|| (point, near * far * self.area / (PI * r2 * r2)))
    }

    /// A direction uniform over the solid angle of the lamp, and that angle.
    fn by_solid_angle(&self, x: DVec3, choice: f64, at: [f64; 2]) -> Option<(DVec3, f64)> {
        let [u, v] = self.edges;
        let corner = |p: DVec3| (p - x).normalize();
        let (a, b, c) = (corner(self.origin), corner(self.origin + u), corner(self.origin + v));
        let first = Spherical::new(a, b, c)?;
        if self.triangle {
            return Some((first.sample(at), first.angle));
        }
        let second = Spherical::new(corner(self.origin + u + v), c, b)?;
        let whole = first.angle + second.angle;
        let triangle = if choice * whole < first.angle { first } else { second };
        Some((triangle.sample(at), whole))
    }
}

/// A spherical triangle, sampled uniformly (Arvo 1995).
struct Spherical {
    a: DVec3,
    b: DVec3,
    c: DVec3,
    alpha: f64,
    angle: f64,
}

/// Solid angles below this are left to sampling by area: the difference of their angles would be rounding.
const SMALLEST: f64 = 1e-4;

impl Spherical {
    fn new(a: DVec3, b: DVec3, c: DVec3) -> Option<Self> {
        // van Oosterom and Strackee 1983
        let denominator = 1.0 + a.dot(b) + b.dot(c) + c.dot(a);
        let angle = 2.0 * a.dot(b.cross(c)).abs().atan2(denominator);
        let (ab, ac) = (a.cross(b), a.cross(c));
        let alpha = ab.cross(ac).length().atan2(ab.dot(ac));
        (angle > SMALLEST && alpha > SMALLEST).then_some(Spherical { a, b, c, alpha, angle })
    }

    fn sample(&self, [s, t]: [f64; 2]) -> DVec3 {
        let &Spherical { a, b, c, alpha, angle } = self;
        // the triangle a, b, c' with the area s * angle, c' on the edge from a to c
        let (sine, cosine) = (s * angle - alpha).sin_cos();
        let (sa, ca) = alpha.sin_cos();
        let u = cosine - ca;
        let v = sine + sa * a.dot(b);
        let below = (v * sine + u * cosine) * sa;
        let q = if below == 0.0 { 1.0 } else { (((v * cosine - u * sine) * ca - v) / below).clamp(-1.0, 1.0) };
        let across = |of: DVec3, to: DVec3| (of - to * of.dot(to)).normalize_or_zero();
        let corner = a * q + across(c, a) * (1.0 - q * q).sqrt();
        let z = 1.0 - t * (1.0 - corner.dot(b));
        b * z + across(corner, b) * (1.0 - z * z).max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::Stream;
    use ondelette_radiosity::form_factor::{Polygon, point_to_polygon};
    use ondelette_radiosity::scene::samples;

    /// The mean of many samples is Lambert's closed form, near (by solid angle) and far (by area), for one lamp and
    /// for many.
    #[test]
    fn samples_bring_what_the_closed_form_says() {
        let white = Rgb::grey(std::f64::consts::FRAC_1_PI);
        let mut faces = vec![];
        for k in 0..7 {
            let (x, y, z) = (f64::from(k % 3) * 0.7, f64::from(k / 3) * 0.9, 0.2 + 0.3 * f64::from(k));
            let corners = [[x, y + 0.5, z], [x + 0.4, y + 0.5, z], [x + 0.4, y, z + 0.1], [x, y, z + 0.1]];
            faces.push((corners, Rgb::BLACK, white));
        }
        for count in [1, 7] {
            let scene = samples::quads("lamps", &faces[..count]);
            let (lamps, sides) = Lamps::of(&scene);
            assert_eq!(sides.len(), count);
            for (x, n) in [
                (DVec3::new(0.1, 0.2, 0.0), DVec3::Z),
                (DVec3::new(3.0, 0.4, 0.0), DVec3::new(-1.0, 0.0, 0.5).normalize()),
                (DVec3::new(0.39, 0.1, 0.21), DVec3::new(0.3, 0.1, 1.0).normalize()),
            ] {
                let mut want = 0.0;
                for patch in &scene.patches {
                    if patch.normal().dot(x - patch.origin) > 0.0 {
                        want += point_to_polygon(x, n, &Polygon::new(&patch.corners()).clipped(x, n));
                    }
                }
                let mut stream = Stream::new(3);
                let (mut sum, mut squares) = (0.0, 0.0);
                let samples = 200_000;
                for _ in 0..samples {
                    let draw = [stream.next(), stream.next(), stream.next()];
                    let got = lamps.sample(x, n, draw[0], [draw[1], draw[2]]).map_or(0.0, |s| s.brings.0[0]);
                    sum += got;
                    squares += got * got;
                }
                let mean = sum / f64::from(samples);
                let sigma = ((squares / f64::from(samples) - mean * mean) / f64::from(samples)).sqrt();
                assert!((mean - want).abs() <= 4.0 * sigma + 1e-12, "{x}: {mean} +- {sigma} instead of {want}");
                assert!(sigma < 0.02 * want, "{x}: {sigma} of {want}");
            }
        }
    }

    /// A strip of light right beside a point gives it most of its light, and most samples go there, however far away
    /// the middle of the strip is.
    #[test]
    fn long_lamps_are_chosen_where_they_are_close() {
        let white = Rgb::grey(std::f64::consts::FRAC_1_PI);
        let strip = [[2.0, -2.0, 0.0], [2.0, -2.0, 0.002], [2.0, 2.0, 0.002], [2.0, 2.0, 0.0]];
        let panel = [[-0.25, 0.25, 2.5], [0.25, 0.25, 2.5], [0.25, -0.25, 2.5], [-0.25, -0.25, 2.5]];
        let scene = samples::quads("strip", &[(strip, Rgb::BLACK, white), (panel, Rgb::BLACK, white)]);
        let (lamps, _) = Lamps::of(&scene);
        let picked = |x: f64| {
            let at = DVec3::new(x, 0.2, 0.0);
            let picks = (0..1000).filter_map(|k| lamps.pick(at, DVec3::Z, (f64::from(k) + 0.5) / 1000.0));
            picks.filter(|p| lamps.lamps[p.0 as usize].low.x > 1.0).count()
        };
        assert!(picked(1.995) > 500 && picked(0.0) < 500, "{} {}", picked(1.995), picked(0.0));
    }
}
