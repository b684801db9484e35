//! The radiosity kernel between two sides: cos cos / (pi r^2), and visibility as its mask (thesis Eq. 76, 4.5.3, 4.5.4).
//!
//! The zeroth moment over a source is always Lambert's closed form, so that a closed scene's rows sum to 1 at every
//! receiver point, near or far. Higher moments are quadratures over pieces graded towards the receiver point, each piece
//! weighted by its own closed form. Receiver points are Gauss points: no rule on *both* sides converges for touching
//! patches (two unit squares at a right angle: +8 % at 2 to 4 points an axis, at any scale), this one does.

use crate::form_factor::{Polygon, point_to_polygon};
use crate::occluder::{Occluders, Shaft};
use crate::scene::{Scene, Shape};
use glam::DVec3;
use ondelette_compress::{Cell, Forest, Kernel, Masked, NodeId, Pair};
use ondelette_numerics::seed;
use ondelette_wavelet::cell::{CellBasis, CellShape};
use std::sync::atomic::{AtomicU64, Ordering};

/// One side as a kernel sees it.
#[derive(Clone, Copy, Debug)]
pub struct SideFrame {
    /// Corner.
    pub origin: DVec3,
    /// Edges; their cross product points to the side's front.
    pub edges: [DVec3; 2],
    /// Unit normal.
    pub normal: DVec3,
    /// Area of the side.
    pub area: f64,
    /// Patch that this side belongs to.
    pub patch: u32,
    /// Whether it ever sends light out: it emits or reflects.
    pub shoots: bool,
    /// Square or triangle.
    pub shape: CellShape,
}

/// All sides of a scene and what blocks light between them.
pub struct LightKernel {
    sides: Vec<SideFrame>,
    occluders: Occluders,
    /// Front and back side of each patch.
    of_patch: Vec<[Option<u32>; 2]>,
    rays: AtomicU64,
    /// The radiosity of the last solve.
    present: Option<Present>,
}

/// Radiosity as last solved (channels summed), by which masks are weighted.
struct Present {
    forest: Forest,
    /// Coefficients of all nodes, pulled.
    values: Vec<[f64; 1]>,
}

impl Present {
    /// Radiosity at root coordinates.
    fn at(&self, root: u32, x: [f64; 2]) -> f64 {
        let (leaf, local) = self.forest.locate(root as usize, x);
        self.value(leaf, local)
    }

    fn value(&self, id: NodeId, local: [f64; 2]) -> f64 {
        let basis = self.forest.basis_of(id);
        let mut values = [0.0; MOST_FUNCTIONS];
        basis.eval(local, &mut values);
        let own = &self.values[id.index() * self.forest.stride()..][..basis.len()];
        own.iter().zip(&values).map(|(c, v)| c[0] * v).sum()
    }

    /// The node of a cell, if it has detail below it.
    fn inner_node(&self, cell: &Cell) -> Option<NodeId> {
        let centre = cell.to_root(match cell.shape {
            CellShape::Triangle => [1.0 / 3.0; 2],
            _ => [0.5; 2],
        });
        let mut id = self.forest.roots()[cell.root as usize];
        let mut x = centre;
        while self.forest.node(id).cell.depth < cell.depth {
            if self.forest.is_leaf(id) {
                return None;
            }
            let (c, local) = cell.shape.descend(x);
            (id, x) = (self.forest.child(id, c), local);
        }
        (!self.forest.is_leaf(id)).then_some(id)
    }
}

impl SideFrame {
    /// Side-local coordinates of the point of the side that is closest to `point`.
    pub fn closest(&self, point: DVec3) -> [f64; 2] {
        let [u, v] = self.edges;
        let d = point - self.origin;
        let n = u.cross(v);
        let inverse = 1.0 / n.length_squared();
        let [s, t] = [v.cross(n).dot(d) * inverse, n.cross(u).dot(d) * inverse];
        let triangle = self.shape == CellShape::Triangle;
        let inside = s >= 0.0 && t >= 0.0 && if triangle { s + t <= 1.0 } else { s <= 1.0 && t <= 1.0 };
        if inside {
            return [s, t];
        }
        // the closest point of each edge, in local coordinates
        let edges: &[[[f64; 2]; 2]] = if triangle {
            &[[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [0.0, 1.0]], [[0.0, 1.0], [0.0, 0.0]]]
        } else {
            &[[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [1.0, 1.0]], [[1.0, 1.0], [0.0, 1.0]], [[0.0, 1.0], [0.0, 0.0]]]
        };
        let place = |x: [f64; 2]| self.origin + u * x[0] + v * x[1];
        let mut best = ([0.0; 2], f64::INFINITY);
        for [a, b] in edges {
            let (p, q) = (place(*a), place(*b));
            let k = ((point - p).dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
            let at = [a[0] + k * (b[0] - a[0]), a[1] + k * (b[1] - a[1])];
            let distance = place(at).distance(point);
            if distance < best.1 {
                best = (at, distance);
            }
        }
        best.0
    }
}

/// A cell in space.
#[derive(Clone, Copy, Debug)]
pub struct Element {
    origin: DVec3,
    edges: [DVec3; 2],
    normal: DVec3,
    area: f64,
    shape: CellShape,
}

impl Element {
    /// The point with the given local coordinates.
    pub fn point(&self, x: [f64; 2]) -> DVec3 {
        self.origin + self.edges[0] * x[0] + self.edges[1] * x[1]
    }

    /// Corners counter-clockwise from the front.
    pub fn polygon(&self) -> Polygon {
        let (o, [u, v]) = (self.origin, self.edges);
        match self.shape {
            CellShape::Triangle => Polygon::new(&[o, o + u, o + v]),
            _ => Polygon::new(&[o, o + u, o + u + v, o + v]),
        }
    }

    /// The part with local coordinates offset + scale * x.
    fn part(&self, offset: [f64; 2], scale: f64) -> Element {
        Element {
            origin: self.point(offset),
            edges: [self.edges[0] * scale, self.edges[1] * scale],
            area: self.area * scale * scale,
            ..*self
        }
    }

    /// Unit normal of the front.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Centre and radius of a ball around it.
    pub fn ball(&self) -> (DVec3, f64) {
        let [u, v] = self.edges;
        match self.shape {
            CellShape::Triangle => {
                let c = (u + v) / 3.0;
                (self.origin + c, c.length().max((u - c).length()).max((v - c).length()))
            }
            _ => (self.origin + (u + v) * 0.5, 0.5 * (u + v).length().max((u - v).length())),
        }
    }
}

impl LightKernel {
    /// Prepares a scene.
    pub fn new(scene: &Scene) -> Self {
        let sides = scene
            .sides
            .iter()
            .map(|&side| {
                let (origin, u, v) = scene.frame(side);
                let patch = &scene.patches[side.patch as usize];
                let material = scene.material(side);
                SideFrame {
                    origin,
                    edges: [u, v],
                    normal: u.cross(v).normalize(),
                    area: patch.area(),
                    patch: side.patch,
                    shoots: material.radiance.max() > 0.0 || material.reflectance.max() > 0.0,
                    shape: match patch.shape {
                        Shape::Parallelogram => CellShape::Square,
                        Shape::Triangle => CellShape::Triangle,
                    },
                }
            })
            .collect();
        let mut of_patch = vec![[None; 2]; scene.patches.len()];
        for (i, side) in scene.sides.iter().enumerate() {
            of_patch[side.patch as usize][usize::from(side.back)] = Some(i as u32);
        }
        LightKernel { sides, occluders: Occluders::new(scene), of_patch, rays: AtomicU64::new(0), present: None }
    }

    /// The sides, in scene order.
    pub fn sides(&self) -> &[SideFrame] {
        &self.sides
    }

    /// What blocks light.
    pub fn occluders(&self) -> &Occluders {
        &self.occluders
    }

    /// Tells the kernel what the sides shoot at present: coefficients of all nodes of `forest`, pulled, channels summed.
    pub fn set_present(&mut self, forest: Forest, values: Vec<[f64; 1]>) {
        self.present = Some(Present { forest, values });
    }

    /// The front or back side of a patch, if it has one.
    pub fn side_of(&self, patch: u32, back: bool) -> Option<usize> {
        self.of_patch[patch as usize][usize::from(back)].map(|s| s as usize)
    }

    /// Form factor from a free point to an element, and the share of it that is visible.
    pub fn visible_factor(&self, x: DVec3, n: DVec3, shooter: &Cell, key: u64) -> (f64, f64) {
        let element = self.element(shooter);
        let factor = point_to_polygon(x, n, &element.polygon().clipped(x, n));
        if factor <= 0.0 {
            return (0.0, 0.0);
        }
        let patch = self.sides[shooter.root as usize].patch;
        let (mut open, mut whole) = (0.0, 0.0);
        for y in sequence(key, element.shape, 0..FREE_RAYS) {
            let point = element.point(y);
            let weight = density(x, n, point, element.normal);
            if weight > 0.0 {
                whole += weight;
                if !self.occluders.blocked(x, point, [patch, patch]) {
                    open += weight;
                }
            }
        }
        (factor, if whole > 0.0 { open / whole } else { 0.0 })
    }

    /// Visibility rays cast so far: a sum, the same in whatever order the threads add to it.
    pub fn rays_cast(&self) -> u64 {
        self.rays.load(Ordering::Relaxed)
    }

    /// Whether two whole sides face each other: a part of each lies in front of the other, and the shooter ever shoots.
    pub fn may_see(&self, receiver: usize, shooter: usize) -> bool {
        let (r, s) = (&self.sides[receiver], &self.sides[shooter]);
        let tolerance = self.occluders.tolerance();
        let in_front = |a: &SideFrame, b: &SideFrame| {
            let [u, v] = b.edges;
            let corners = [b.origin, b.origin + u, b.origin + v, b.origin + u + v];
            let count = if b.shape == CellShape::Triangle { 3 } else { 4 };
            corners[..count].iter().any(|c| a.normal.dot(*c - a.origin) > tolerance)
        };
        receiver != shooter && s.shoots && in_front(r, s) && in_front(s, r)
    }

    /// A cell of a side in space.
    pub fn element(&self, cell: &Cell) -> Element {
        let side = &self.sides[cell.root as usize];
        let whole =
            Element { origin: side.origin, edges: side.edges, normal: side.normal, area: side.area, shape: side.shape };
        whole.part(cell.origin, cell.scale)
    }

    /// Irradiance moments at a free point: `moments[j]` = integral of K(x, y) phi_j(y) dy over the element, unoccluded.
    pub fn moments_at(&self, x: DVec3, n: DVec3, shooter: &Element, basis: &CellBasis, moments: &mut [f64]) {
        moments.fill(0.0);
        if shooter.normal.dot(x - shooter.origin) <= 0.0 {
            return;
        }
        if !basis.is_nested() {
            // boxes: each in closed form
            for (j, m) in moments.iter_mut().enumerate().take(basis.len()) {
                if let Some((offset, scale)) = basis.box_of(j) {
                    *m = point_to_polygon(x, n, &shooter.part(offset, scale).polygon().clipped(x, n));
                }
            }
            return;
        }
        let whole = point_to_polygon(x, n, &shooter.polygon().clipped(x, n));
        if whole > 0.0 && basis.len() > 1 {
            pieces(x, n, shooter, &mut |piece| piece.add_moments(x, n, shooter, basis, moments));
        }
        moments[0] = whole;
    }
}

/// Most functions of a basis.
const MOST_FUNCTIONS: usize = CellBasis::MAX_MULTIWAVELET * CellBasis::MAX_MULTIWAVELET;
/// Pieces closer than this many radii are split.
const NEAR: f64 = 1.5;
/// Deepest grading: pieces of 1/1024 of the source.
const DEEPEST: u32 = 10;

/// A part of a source, offset + scale * local, with its form factor from a point in closed form.
#[derive(Clone, Copy, Debug)]
struct Piece {
    offset: [f64; 2],
    scale: f64,
    exact: f64,
}

/// Splits a source towards the point x until every piece is small against its distance, and calls `each` on those that
/// are seen, in a fixed order.
fn pieces(x: DVec3, n: DVec3, shooter: &Element, each: &mut dyn FnMut(Piece)) {
    descend(x, n, shooter, [0.0; 2], 1.0, 0, each);
}

fn descend(
    x: DVec3,
    n: DVec3,
    shooter: &Element,
    offset: [f64; 2],
    scale: f64,
    depth: u32,
    each: &mut dyn FnMut(Piece),
) {
    let element = shooter.part(offset, scale);
    let (centre, radius) = element.ball();
    if n.dot(centre - x) < -radius {
        return;
    }
    if depth < DEEPEST && (centre - x).length() < (1.0 + NEAR) * radius {
        for c in 0..4 {
            let (o, sign) = element.shape.child(c);
            let child = [offset[0] + scale * o[0], offset[1] + scale * o[1]];
            descend(x, n, shooter, child, 0.5 * sign * scale, depth + 1, each);
        }
        return;
    }
    let exact = point_to_polygon(x, n, &element.polygon().clipped(x, n));
    if exact > 0.0 {
        each(Piece { offset, scale, exact });
    }
}

impl Piece {
    /// The source's local coordinates of a point of the piece.
    fn to_source(&self, y: [f64; 2]) -> [f64; 2] {
        [self.offset[0] + self.scale * y[0], self.offset[1] + self.scale * y[1]]
    }

    /// Adds the moments 1.. of the piece: its closed form times the kernel-weighted means of the basis functions.
    fn add_moments(&self, x: DVec3, n: DVec3, shooter: &Element, basis: &CellBasis, moments: &mut [f64]) {
        let rule = basis.analysis(basis.order() + 1);
        let mut values = [0.0; MOST_FUNCTIONS];
        let mut sums = [0.0; MOST_FUNCTIONS];
        let mut whole = 0.0;
        // the first row of a nested basis's analysis is the quadrature rule itself
        for (y, w) in rule.points.iter().zip(&rule.matrix) {
            let y = self.to_source(*y);
            let k = w * density(x, n, shooter.point(y), shooter.normal);
            if k > 0.0 {
                whole += k;
                basis.eval(y, &mut values);
                for j in 1..basis.len() {
                    sums[j] += k * values[j];
                }
            }
        }
        if whole > 0.0 {
            for j in 1..basis.len() {
                moments[j] += self.exact * sums[j] / whole;
            }
        } else {
            basis.eval(self.to_source([1.0 / 3.0; 2]), &mut values);
            for j in 1..basis.len() {
                moments[j] += self.exact * values[j];
            }
        }
    }
}

/// cos cos / (pi r^2), 0 where either point lies behind the other's plane.
pub fn density(x: DVec3, n: DVec3, y: DVec3, m: DVec3) -> f64 {
    let d = y - x;
    let (a, b) = (n.dot(d), -m.dot(d));
    if a <= 0.0 || b <= 0.0 {
        return 0.0;
    }
    let r2 = d.length_squared();
    a * b / (std::f64::consts::PI * r2 * r2)
}

impl Kernel for LightKernel {
    type Pair<'a> = LightPair<'a>;

    fn pair(&self, receiver: &Cell, shooter: &Cell) -> Option<LightPair<'_>> {
        if receiver.root == shooter.root || !self.sides[shooter.root as usize].shoots {
            return None;
        }
        let (r, s) = (self.element(receiver), self.element(shooter));
        let tolerance = self.occluders.tolerance();
        let in_front = |e: &Element, other: &Element| {
            other.polygon().corners().iter().any(|c| e.normal.dot(*c - e.origin) > tolerance)
        };
        if !in_front(&r, &s) || !in_front(&s, &r) {
            return None;
        }
        let patches = [self.sides[receiver.root as usize].patch, self.sides[shooter.root as usize].patch];
        let (a, b) = (r.polygon(), s.polygon());
        let shaft = Shaft::between(a.corners(), r.normal, b.corners(), s.normal, tolerance);
        let candidates = self.occluders.candidates(&shaft, patches);
        if candidates.iter().any(|&p| self.occluders.hides(p, a.corners(), b.corners())) {
            return None;
        }
        let masked = !candidates.is_empty();
        let node = if masked { self.present.as_ref().and_then(|p| p.inner_node(shooter)) } else { None };
        Some(LightPair { kernel: self, receiver: r, shooter: s, cell: *shooter, node, patches, masked })
    }
}

/// A receiver and a shooter element that face each other.
pub struct LightPair<'a> {
    kernel: &'a LightKernel,
    receiver: Element,
    shooter: Element,
    /// The shooter's cell, and its node in the present solution if that has detail below it.
    cell: Cell,
    node: Option<NodeId>,
    patches: [u32; 2],
    masked: bool,
}

impl Pair for LightPair<'_> {
    fn sample(&self, x: [f64; 2], y: [f64; 2]) -> f64 {
        density(self.receiver.point(x), self.receiver.normal, self.shooter.point(y), self.shooter.normal)
    }

    fn moments(&self, x: [f64; 2], basis: &CellBasis, moments: &mut [f64]) {
        self.kernel.moments_at(self.receiver.point(x), self.receiver.normal, &self.shooter, basis, moments);
    }

    fn receiver_points(&self, order: usize) -> usize {
        let (a, ra) = self.receiver.ball();
        let (b, rb) = self.shooter.ball();
        let gap = (a - b).length() - ra - rb;
        if gap < 0.25 * ra {
            (order + 2).max(4)
        } else if gap < ra {
            order + 1
        } else {
            order.max(2)
        }
    }

    fn is_masked(&self) -> bool {
        self.masked
    }

    fn mask(&self, x: [f64; 2], basis: &CellBasis, moments: &mut [f64], samples: usize, key: u64) -> Masked {
        let from = self.receiver.point(x);
        let mut seen = Seen::default();
        self.cast(from, samples, key, basis, &mut seen);
        let mask = if seen.whole > 0.0 { seen.open / seen.whole } else { 0.0 };
        // exact moments times the mean mask, plus the sampled covariance of mask and basis function
        let unmasked = if basis.is_nested() { moments[0] } else { moments[..basis.len()].iter().sum() };
        for (j, m) in moments.iter_mut().enumerate().take(basis.len()) {
            *m *= mask;
            if mask > 0.0 && mask < 1.0 {
                *m += unmasked * (seen.open_moments[j] - mask * seen.whole_moments[j]) / seen.whole;
            }
        }
        let scale = if seen.whole > 0.0 { unmasked / seen.whole } else { 0.0 };
        Masked { mean: mask, actual: scale * seen.actual, projected: scale * seen.projected }
    }
}

/// Rays from a free point to one element.
const FREE_RAYS: usize = 16;

/// Low-discrepancy points of a cell: the R2 sequence (Roberts 2018), shifted by a key.
fn sequence(key: u64, shape: CellShape, range: std::ops::Range<usize>) -> impl Iterator<Item = [f64; 2]> {
    const ALPHA: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
    let shift = [seed::unit(key), seed::unit(seed::combine(key, 1))];
    range.map(move |i| {
        let y: [f64; 2] = std::array::from_fn(|k| (shift[k] + ALPHA[k] * (i + 1) as f64).fract());
        if shape == CellShape::Triangle && y[0] + y[1] > 1.0 { [1.0 - y[0], 1.0 - y[1]] } else { y }
    })
}

/// Kernel-weighted sums over rays: of those that arrive, and of all; plain and times each basis function.
struct Seen {
    open: f64,
    whole: f64,
    open_moments: [f64; MOST_FUNCTIONS],
    whole_moments: [f64; MOST_FUNCTIONS],
    /// Of what arrives, times the present radiosity, and times its projection.
    actual: f64,
    projected: f64,
}

impl Default for Seen {
    fn default() -> Self {
        Seen {
            open: 0.0,
            whole: 0.0,
            open_moments: [0.0; MOST_FUNCTIONS],
            whole_moments: [0.0; MOST_FUNCTIONS],
            actual: 0.0,
            projected: 0.0,
        }
    }
}

impl LightPair<'_> {
    /// Casts about `samples` rays, shared among the pieces of the source by their form factors: where the kernel is
    /// concentrated, near a common edge say, a plain sample of the source would miss most of what arrives.
    fn cast(&self, x: DVec3, samples: usize, key: u64, basis: &CellBasis, seen: &mut Seen) {
        let n = self.receiver.normal;
        let mut parts = Vec::new();
        pieces(x, n, &self.shooter, &mut |piece| parts.push(piece));
        let whole: f64 = parts.iter().map(|p| p.exact).sum();
        let mut rays = 0;
        let mut values = [0.0; MOST_FUNCTIONS];
        let mut used = 0.0;
        for (k, piece) in parts.iter().enumerate() {
            // rounded so that the counts add up to about `samples`, at least one a piece
            let before = (used / whole * samples as f64).round() as usize;
            used += piece.exact;
            let count = ((used / whole * samples as f64).round() as usize).saturating_sub(before).max(1);
            let mut sum = Seen::default();
            for y in sequence(seed::combine(key, k as u64), self.shooter.shape, 0..count) {
                let y = piece.to_source(y);
                let point = self.shooter.point(y);
                let weight = density(x, n, point, self.shooter.normal);
                if weight <= 0.0 {
                    continue;
                }
                rays += 1;
                let open = !self.kernel.occluders.blocked(x, point, self.patches);
                basis.eval(y, &mut values);
                sum.add(weight, open, &values[..basis.len()]);
                if open && let (Some(node), Some(present)) = (self.node, &self.kernel.present) {
                    sum.actual += weight * present.at(self.cell.root, self.cell.to_root(y));
                    sum.projected += weight * present.value(node, y);
                }
            }
            if sum.whole > 0.0 {
                seen.merge(&sum, piece.exact / sum.whole, basis.len());
            }
        }
        self.kernel.rays.fetch_add(rays, Ordering::Relaxed);
    }
}

impl Seen {
    fn add(&mut self, weight: f64, open: bool, values: &[f64]) {
        let through = if open { weight } else { 0.0 };
        self.whole += weight;
        self.open += through;
        for (j, v) in values.iter().enumerate() {
            self.whole_moments[j] += weight * v;
            self.open_moments[j] += through * v;
        }
    }

    fn merge(&mut self, part: &Seen, factor: f64, functions: usize) {
        self.whole += factor * part.whole;
        self.open += factor * part.open;
        self.actual += factor * part.actual;
        self.projected += factor * part.projected;
        for j in 0..functions {
            self.whole_moments[j] += factor * part.whole_moments[j];
            self.open_moments[j] += factor * part.open_moments[j];
        }
    }
}
