//! The emitters as a receiver sees them: which of them matter to an element, what may stand between, and what they
//! bring to a point.

use super::kept::Kept;
use super::sphere::Cone;
use crate::form_factor::{Polygon, point_to_polygon};
use crate::kernel::{Element, LightKernel};
use crate::occluder::Shaft;
use crate::rgb::Rgb;
use crate::scene::Scene;
use crate::visible::View;
use glam::DVec3;
use ondelette_compress::Cell;
use ondelette_numerics::seed;
use ondelette_numerics::sobol::Sobol;
use ondelette_wavelet::cell::CellShape;

/// Emitters up to which each is a lamp of its own; fainter ones are met by rays.
pub(super) const MOST_LAMPS: usize = 4096;
/// Emitting materials up to which each is known apart; the lamps of fainter ones are met by rays, too.
pub(super) const MOST_GROUPS: usize = 32;
/// Among many things light has features finer than the points of an element can tell: what they say of its error is low
/// by about this factor (against independent paths in furnished rooms), and by more below an error of `CLEAR`, since
/// what they miss falls more slowly than what they see.
const DOUBT: f64 = 1.35;
const CLEAR: f64 = 0.03;
const FINER: f64 = 0.3;
/// Blockers up to which the visible part of a lamp is cut out exactly; beyond, rays decide.
const MOST_BLOCKERS: usize = 24;
/// Blockers from which a lamp counts as behind many things.
const CROWD: usize = 8;
/// Share of a lamp below which its visible part counts as a crack.
const SLIVER: f64 = 2e-6;
/// Share of an element's light from which a lamp is worth a look at what stands before it: in units of the promised
/// error, and its limits.
const WORTHY: f64 = 0.8;
const WORTHY_LIMITS: [f64; 2] = [0.04, 0.15];
/// The same share for a point that is read.
const WORTHY_AT_A_POINT: f64 = 0.005;
/// So many looks at lamps that may bring most are taken in any case: what is bright may be hidden. Looks that find
/// nothing in the way are free.
const LOOKED_AT: usize = 4;

/// One emitting side.
#[derive(Clone, Debug)]
pub(super) struct Lamp {
    /// Its side.
    pub(super) side: usize,
    patch: u32,
    /// Index into [`Lamps::groups`].
    group: usize,
    /// Exitance, channels summed.
    power: f64,
    element: Element,
    polygon: Polygon,
    centre: DVec3,
    radius: f64,
}

/// All lamps, strongest first, in groups that share a material.
#[derive(Clone, Debug)]
pub(super) struct Lamps {
    lamps: Vec<Lamp>,
    /// Exitance of each group, and its material.
    pub(super) groups: Vec<(u32, Rgb)>,
    /// Whether a side is a lamp (else its emission is met by rays).
    is_lamp: Vec<bool>,
    /// Share of an element's light from which a lamp is worth a look at what stands before it.
    worthy: f64,
    /// How much lower than the error among many things the points of an element tell it, about.
    pub(super) doubt: f64,
}

impl Lamp {
    fn new(scene: &Scene, kernel: &LightKernel, side: usize, group: usize, groups: &[(u32, Rgb)]) -> Self {
        let element = kernel.element(&Cell::root(side as u32, kernel.sides()[side].shape));
        let (centre, radius) = element.ball();
        let (polygon, power) = (element.polygon(), groups[group].1.sum());
        Lamp { side, patch: scene.sides[side].patch, group, power, element, polygon, centre, radius }
    }
}

/// A lamp whose visible part is cut out exactly, and the patches that may stand before it.
#[derive(Clone, Debug)]
struct Sight {
    lamp: u32,
    patches: Vec<u32>,
}

/// A lamp behind so much that rays decide what is seen of it, and its share of the rays of a point.
pub(super) type Crowded = (u32, f32);

/// The sums of their shares, one by one.
pub(super) fn sums(crowded: &[Crowded]) -> Vec<f64> {
    let mut sum = 0.0;
    let add = |c: &Crowded| {
        sum += f64::from(c.1);
        sum
    };
    crowded.iter().map(add).collect()
}

/// The lamps as an element sees them.
#[derive(Clone, Debug, Default)]
pub(super) struct Seen {
    exact: Vec<Sight>,
    pub(super) crowded: Vec<Crowded>,
    /// Light that all lamps together would bring if nothing stood between, channels summed: what shares are shares of.
    pub(super) whole: f64,
}

impl Seen {
    /// Whether there is none.
    pub(super) fn is_empty(&self) -> bool {
        self.exact.is_empty() && self.crowded.is_empty()
    }

    /// Whether something may stand in the way of one.
    pub(super) fn is_masked(&self) -> bool {
        !self.crowded.is_empty() || self.exact.iter().any(|s| !s.patches.is_empty())
    }

    /// Whether one is behind many things, even if they can be named.
    pub(super) fn is_crowded(&self) -> bool {
        !self.crowded.is_empty() || self.exact.iter().any(|s| s.patches.len() > CROWD)
    }

    /// Counted bytes.
    pub(super) fn bytes(&self) -> usize {
        let patches: usize = self.exact.iter().map(|s| size_of_val(&s.patches[..])).sum();
        size_of_val(&self.exact[..]) + size_of_val(&self.crowded[..]) + patches
    }

    /// Work at a point to cut lamps out exactly, in rays about.
    pub(super) fn work(&self) -> f64 {
        let one = |s: &Sight| if s.patches.is_empty() { 0.5 } else { 2.0 + 0.5 * s.patches.len() as f64 };
        self.exact.iter().map(one).sum()
    }
}

impl Lamps {
    /// The emitters of a scene; `error` is promised.
    pub(super) fn of(scene: &Scene, kernel: &LightKernel, error: f64) -> Self {
        let groups = strongest(scene);
        let group_of = |side: usize| {
            let material = scene.patches[scene.sides[side].patch as usize].material;
            groups.iter().position(|g| g.0 == material)
        };
        let mut lamps: Vec<Lamp> = (0..scene.sides.len())
            .filter_map(|side| Some(Lamp::new(scene, kernel, side, group_of(side)?, &groups)))
            .collect();
        let strength = |l: &Lamp| l.power * l.element.area();
        lamps.sort_by(|a, b| strength(b).total_cmp(&strength(a)).then(a.side.cmp(&b.side)));
        lamps.truncate(MOST_LAMPS);
        Lamps::with(scene, groups, lamps, error)
    }

    /// The emitters that a solution knew, as they are now.
    pub(super) fn restore(scene: &Scene, kernel: &LightKernel, error: f64, kept: &Kept) -> Self {
        let groups: Vec<(u32, Rgb)> = kept.groups.iter().map(|&m| (m, exitance(scene, m as usize))).collect();
        let lamp = |&side: &u32| {
            let material = scene.patches[scene.sides[side as usize].patch as usize].material;
            let group = groups.iter().position(|g| g.0 == material)?;
            Some(Lamp::new(scene, kernel, side as usize, group, &groups))
        };
        let lamps = kept.lamps.iter().filter_map(lamp).collect();
        let mut restored = Lamps::with(scene, groups, lamps, error);
        restored.repaint(scene);
        restored
    }

    fn with(scene: &Scene, groups: Vec<(u32, Rgb)>, lamps: Vec<Lamp>, error: f64) -> Self {
        let mut is_lamp = vec![false; scene.sides.len()];
        lamps.iter().for_each(|l| is_lamp[l.side] = true);
        let mut lamps = Lamps { lamps, groups, is_lamp, worthy: 0.0, doubt: 1.0 };
        lamps.promise(error);
        lamps
    }

    /// The same to be seen from single points, where nothing but rays makes up for a lamp that is not cut out.
    pub(super) fn for_points(self) -> Self {
        Lamps { worthy: WORTHY_AT_A_POINT, ..self }
    }

    /// Takes over a promise; the factor by which doubt grows.
    pub(super) fn promise(&mut self, error: f64) -> f64 {
        self.worthy = (WORTHY * error).clamp(WORTHY_LIMITS[0], WORTHY_LIMITS[1]);
        let doubt = DOUBT * (1.0 + FINER * (CLEAR / error - 1.0)).clamp(1.0, 2.0);
        doubt / std::mem::replace(&mut self.doubt, doubt)
    }

    /// Takes over what materials emit now. A lamp that is off keeps a little power in the choice of what is looked at;
    /// what rays overlook of it then counts as its error once it is switched on again.
    pub(super) fn repaint(&mut self, scene: &Scene) {
        for (material, own) in &mut self.groups {
            *own = exitance(scene, *material as usize);
        }
        let strongest = self.groups.iter().map(|g| g.1.sum()).fold(0.0, f64::max);
        for lamp in &mut self.lamps {
            lamp.power = self.groups[lamp.group].1.sum().max(1e-6 * strongest).max(f64::MIN_POSITIVE);
        }
    }

    /// Their sides, in order.
    pub(super) fn sides(&self) -> impl Iterator<Item = u32> {
        self.lamps.iter().map(|l| l.side as u32)
    }

    /// Number of lamps.
    pub(super) fn len(&self) -> usize {
        self.lamps.len()
    }

    /// Whether every receiver counts this side's emission as that of a lamp.
    pub(super) fn is_lamp(&self, side: usize) -> bool {
        self.is_lamp[side]
    }

    /// Whether no side shines but lamps.
    pub(super) fn are_all(&self, scene: &Scene) -> bool {
        (0..scene.sides.len()).all(|i| self.is_lamp[i] || scene.material(scene.sides[i]).radiance.sum() == 0.0)
    }

    /// The lamps that an element may see, and what may stand between.
    pub(super) fn seen_by(&self, kernel: &LightKernel, cell: &Cell) -> Seen {
        let element = kernel.element(cell);
        let polygon = element.polygon();
        let (centre, radius) = element.ball();
        let tolerance = kernel.occluders().tolerance();
        let own = kernel.sides()[cell.root as usize].patch;
        let (n, mut whole) = (element.normal(), 0.0);
        let mut facing = Vec::new();
        for (k, lamp) in self.lamps.iter().enumerate() {
            if lamp.side == cell.root as usize {
                continue;
            }
            let m = lamp.element.normal();
            let apart = lamp.centre - centre;
            if n.dot(apart) < -lamp.radius || m.dot(apart) > radius {
                continue;
            }
            let above =
                |n: DVec3, o: DVec3, polygon: &Polygon| polygon.corners().iter().any(|c| n.dot(*c - o) > tolerance);
            if !above(n, polygon.corners()[0], &lamp.polygon) || !above(m, lamp.polygon.corners()[0], &polygon) {
                continue;
            }
            // about what it may bring, with the cosines that the element's extent allows
            let distance = apart.length();
            let slack = radius + lamp.radius;
            let cosine = |c: f64| ((c + slack) / (distance + slack)).min(1.0);
            let [a, b] = [cosine(n.dot(apart)), cosine(-m.dot(apart))];
            let far = (distance - radius).max(0.0);
            let area = lamp.element.area();
            let potential = lamp.power * a * b * area / (std::f64::consts::PI * far * far + area);
            whole += potential;
            facing.push((k, potential));
        }
        if whole <= 0.0 {
            return Seen::default();
        }
        let mut seen = Seen { whole, ..Seen::default() };
        facing.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut looks = 0;
        for (k, potential) in facing {
            let share = potential / whole;
            let lamp = &self.lamps[k];
            if share < self.worthy && looks >= LOOKED_AT {
                seen.crowded.push((k as u32, share as f32));
                continue;
            }
            let (a, b) = (polygon.corners(), lamp.polygon.corners());
            if kernel.occluders().hides(a, b, [own, lamp.patch]) {
                continue;
            }
            looks += 1;
            let shaft = Shaft::between(a, n, b, lamp.element.normal(), tolerance);
            let patches = kernel.occluders().candidates(&shaft, [own, lamp.patch], MOST_BLOCKERS);
            if patches.len() > MOST_BLOCKERS {
                seen.crowded.push((k as u32, share as f32));
            } else {
                looks -= usize::from(patches.is_empty());
                seen.exact.push(Sight { lamp: k as u32, patches });
            }
        }
        seen
    }

    /// What may be missed of each group, for unit exitance, where rays to lamps behind many things met nothing: a root
    /// mean square. Half of such lamps are taken to be hidden altogether, and of the others any part to be seen; after
    /// N rays that failed the square of the visible part is on average 2 / ((N + 2)^2 (N + 3)). `rays` go to all lamps
    /// together, which without anything between would bring `whole`. Beside it how many of them go to each group.
    pub(super) fn overlooked(&self, crowded: &[Crowded], whole: f64, rays: f64) -> (Vec<f64>, Vec<f64>) {
        let (mut squares, mut sent) = (vec![0.0; self.groups.len()], vec![0.0; self.groups.len()]);
        for &(k, share) in crowded {
            let lamp = &self.lamps[k as usize];
            let (share, power) = (f64::from(share), lamp.power);
            let failed = rays * share;
            let part = 2.0 / ((failed + 2.0).powi(2) * (failed + 3.0));
            squares[lamp.group] += (share * whole / power).powi(2) * part;
            sent[lamp.group] += failed;
        }
        (squares.into_iter().map(f64::sqrt).collect(), sent)
    }

    /// Adds to `out[group]` the irradiance that lamps which are cut out exactly bring to a point of a side with a
    /// normal, for unit exitance.
    pub(super) fn exact(
        &self,
        kernel: &LightKernel,
        view: &mut View,
        seen: &Seen,
        (x, n): (DVec3, DVec3),
        out: &mut [f64],
    ) {
        let occluders = kernel.occluders();
        for sight in &seen.exact {
            let lamp = &self.lamps[sight.lamp as usize];
            if lamp.element.normal().dot(x - lamp.centre) <= 0.0 {
                continue;
            }
            let covers = kernel.covers_of(lamp.side);
            if sight.patches.is_empty() && covers.is_empty() {
                out[lamp.group] += point_to_polygon(x, n, &lamp.polygon.clipped(x, n));
                continue;
            }
            if !view.aim(x, n, lamp.polygon.corners()) {
                continue;
            }
            for &cover in covers {
                view.cover(&kernel.sides()[cover as usize].corners());
            }
            for &p in &sight.patches {
                view.block(occluders.corners(p));
            }
            // what is left of a lamp behind a wall of pieces are the cracks between them
            let open = view.irradiance();
            if open > SLIVER * point_to_polygon(x, n, &lamp.polygon.clipped(x, n)) {
                out[lamp.group] += open;
            }
        }
    }

    /// Adds to `out[group]` what lamps behind many things bring to a point of a side with a normal, for unit exitance:
    /// twice, independently. On average `rays` go to all of them together. `sums` are those of their shares.
    pub(super) fn by_rays(
        &self,
        kernel: &LightKernel,
        (crowded, sums, rays): (&[Crowded], &[f64], f64),
        (side, x, n): (usize, DVec3, DVec3),
        key: u64,
        out: &mut [[f64; 2]],
    ) {
        // whole numbers of rays that add up as planned: none for most of the faint lamps, which are leapt over
        let start = [0, 1].map(|half| seed::unit(seed::combine(key, half)));
        let whole = |half: usize, sum: f64| (start[half] + 0.5 * rays * sum) as u32;
        let mut sent = [0; 2];
        let mut k = 0;
        loop {
            k += sums[k..].partition_point(|&sum| [0, 1].map(|half| whole(half, sum)) == sent);
            let Some(&(lamp, share)) = crowded.get(k) else { return };
            let lamp = &self.lamps[lamp as usize];
            let is_behind = lamp.element.normal().dot(x - lamp.centre) <= 0.0;
            let mut clipped = None;
            for half in 0..2 {
                let count = whole(half, sums[k]) - std::mem::replace(&mut sent[half], whole(half, sums[k]));
                if count == 0 || is_behind {
                    continue;
                }
                let polygon = clipped.get_or_insert_with(|| lamp.polygon.clipped(x, n));
                let key = seed::combine(seed::combine(key, half as u64), lamp.side as u64);
                let brings = self.sampled(kernel, lamp, polygon, side, (x, n), (key, count));
                out[lamp.group][half] += brings / (0.5 * rays * f64::from(share)).min(1.0);
            }
            k += 1;
        }
    }

    /// What the visible part of a lamp brings to a point, by rays to its part above the horizon, evenly over the solid
    /// angle.
    fn sampled(
        &self,
        kernel: &LightKernel,
        lamp: &Lamp,
        polygon: &Polygon,
        side: usize,
        (x, n): (DVec3, DVec3),
        (key, rays): (u64, u32),
    ) -> f64 {
        let corners = polygon.corners();
        let mut cones = [None; Polygon::MAX];
        let mut whole = 0.0;
        for (i, slot) in (1..corners.len().saturating_sub(1)).zip(&mut cones) {
            let cone = Cone::new([corners[0] - x, corners[i] - x, corners[i + 1] - x]);
            whole += cone.solid_angle;
            *slot = Some((cone, whole));
        }
        let Some((last, _)) = cones.iter().flatten().last().copied().filter(|_| whole > 0.0) else { return 0.0 };
        let patches = [kernel.sides()[side].patch, lamp.patch];
        let m = lamp.element.normal();
        let sequence = Sobol::of(key);
        let mut sum = 0.0;
        for i in 0..rays {
            let [s, t] = sequence.point(i);
            let at = s * whole;
            let chosen = cones.iter().flatten().find(|c| at < c.1);
            let (cone, end) = chosen.copied().unwrap_or((last, whole));
            let s = ((at - (end - cone.solid_angle)) / cone.solid_angle).clamp(0.0, 1.0);
            let (direction, density) = cone.direction([s, t]);
            let towards = m.dot(direction);
            let cosine = n.dot(direction) / direction.length();
            // edge-on, and below the horizon by rounding
            if towards >= 0.0 || cosine.is_nan() || cosine <= 0.0 {
                continue;
            }
            let point = x + direction * (m.dot(corners[0] - x) / towards);
            if !kernel.is_covered(lamp.side, point) && !kernel.occluders().blocked(x, point, patches) {
                sum += cosine * whole / (density * cone.solid_angle);
            }
        }
        sum / (std::f64::consts::PI * f64::from(rays))
    }
}

fn exitance(scene: &Scene, material: usize) -> Rgb {
    scene.materials[material].radiance * std::f64::consts::PI
}

/// The emitting materials that give off most, with their exitances, in the order of materials.
fn strongest(scene: &Scene) -> Vec<(u32, Rgb)> {
    let mut areas = vec![0.0; scene.materials.len()];
    for side in &scene.sides {
        let patch = &scene.patches[side.patch as usize];
        areas[patch.material as usize] += patch.area();
    }
    let mut found: Vec<usize> = (0..areas.len()).filter(|&m| exitance(scene, m).sum() > 0.0).collect();
    found.sort_by(|&a, &b| {
        let power = |m: usize| exitance(scene, m).sum() * areas[m];
        power(b).total_cmp(&power(a)).then(a.cmp(&b))
    });
    found.truncate(MOST_GROUPS);
    found.sort_unstable();
    found.into_iter().map(|m| (m as u32, exitance(scene, m))).collect()
}

/// A point of the unit square, folded onto a cell's domain.
pub(super) fn on_cell(shape: CellShape, y: [f64; 2]) -> [f64; 2] {
    if shape == CellShape::Triangle && y[0] + y[1] > 1.0 { [1.0 - y[0], 1.0 - y[1]] } else { y }
}
