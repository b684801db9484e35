//! The radiosity kernel between two sides: cos cos / (pi r^2), and visibility as its mask (thesis Eq. 76, 4.5.3,
//! 4.5.4).
//!
//! The zeroth moment over a source is always Lambert's closed form, so that a closed scene's rows sum to 1 at every
//! receiver point, near or far. Higher moments are quadratures over pieces graded towards the receiver point, each
//! piece weighted by its own closed form. Receiver points are Gauss points: no rule on *both* sides converges for
//! touching patches (two unit squares at a right angle: +8 % at 2 to 4 points an axis, at any scale), this one does.
//!
//! [`SideFrame`] and [`Element`] (where things are) -> pieces (a source split towards a point) -> pairs (moments and
//! masks) -> [`LightKernel`] (what the links are made of).

mod buried;
mod cover;
mod element;
mod pair;
mod piece;
mod present;
mod side;

pub use element::Element;
pub use pair::LightPair;
pub use side::SideFrame;

use crate::form_factor::point_to_polygon;
use crate::occluder::{Occluders, Shaft};
use crate::scene::{Scene, Shape};
use glam::DVec3;
use ondelette_compress::{Cell, Forest, Kernel};
use ondelette_numerics::seed;
use ondelette_wavelet::cell::{CellBasis, CellShape};
use piece::pieces;
use present::Present;
use std::sync::atomic::{AtomicU64, Ordering};

/// Most functions of a basis.
const MOST_FUNCTIONS: usize = CellBasis::MAX_MULTIWAVELET * CellBasis::MAX_MULTIWAVELET;

/// All sides of a scene and what blocks light between them.
pub struct LightKernel {
    sides: Vec<SideFrame>,
    occluders: Occluders,
    /// Front and back side of each patch.
    of_patch: Vec<[Option<u32>; 2]>,
    /// For each side, the later sides that cover parts of it.
    covers: Vec<Vec<u32>>,
    rays: AtomicU64,
    /// The radiosity of the last solve.
    present: Option<Present>,
}

/// Rays from a free point to one element.
const FREE_RAYS: usize = 16;

impl LightKernel {
    /// Prepares a scene.
    pub fn new(scene: &Scene) -> Self {
        let sides: Vec<SideFrame> = scene
            .sides
            .iter()
            .map(|&side| {
                let (origin, u, v) = scene.frame(side);
                let patch = &scene.patches[side.patch as usize];
                let material = scene.material(side);
                let (normal, along) = (u.cross(v).normalize(), u.normalize());
                SideFrame {
                    origin,
                    edges: [u, v],
                    normal,
                    tangents: [along, normal.cross(along)],
                    area: patch.area(),
                    patch: side.patch,
                    shoots: material.sends_light(),
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
        let occluders = Occluders::new(scene);
        let covers = cover::covers(&sides, &of_patch, &occluders);
        LightKernel { sides, occluders, covers, of_patch, rays: AtomicU64::new(0), present: None }
    }

    /// Bytes of sides, patches and ray structure.
    pub fn bytes(&self) -> u64 {
        let covers: usize = self.covers.iter().map(|c| size_of_val(c) + size_of_val(&**c)).sum();
        let own = size_of_val(&*self.sides) + size_of_val(&*self.of_patch) + covers;
        own as u64 + self.occluders.bytes()
    }

    /// The sides, in scene order.
    pub fn sides(&self) -> &[SideFrame] {
        &self.sides
    }

    /// What blocks light.
    pub fn occluders(&self) -> &Occluders {
        &self.occluders
    }

    /// Tells the kernel what the sides shoot at present: coefficients of all nodes of `forest`, pulled, channels
    /// summed.
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
                let covered = self.is_covered(shooter.root as usize, point);
                if !covered && !self.occluders.blocked(x, point, [patch, patch]) {
                    open += weight;
                }
            }
        }
        (factor, if whole > 0.0 { open / whole } else { 0.0 })
    }

    /// Whether a later, coplanar side that faces the same way covers a point of a side.
    pub fn is_covered(&self, side: usize, point: DVec3) -> bool {
        self.covers[side].iter().any(|&top| self.sides[top as usize].holds(point))
    }

    /// The later, coplanar sides that cover parts of a side.
    pub fn covers_of(&self, side: usize) -> &[u32] {
        &self.covers[side]
    }

    /// Whether anything covers a part of a side.
    pub fn has_covers(&self, side: usize) -> bool {
        !self.covers[side].is_empty()
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
        if self.occluders.hides(a.corners(), b.corners(), patches) {
            return None;
        }
        let shaft = Shaft::between(a.corners(), r.normal, b.corners(), s.normal, tolerance);
        let is_free = self.occluders.candidates(&shaft, patches, 0).is_empty();
        let covered = |cell: &Cell| !self.covers[cell.root as usize].is_empty();
        let masked = !is_free || covered(receiver) || covered(shooter);
        let node = self.present.as_ref().and_then(|p| p.inner_node(shooter));
        let sides = [receiver.root as usize, shooter.root as usize];
        Some(LightPair { kernel: self, receiver: r, shooter: s, sides, cell: *shooter, node, patches, masked })
    }
}

/// Low-discrepancy points of a cell: the R2 sequence (Roberts 2018), shifted by a key.
fn sequence(key: u64, shape: CellShape, range: std::ops::Range<usize>) -> impl Iterator<Item = [f64; 2]> {
    const ALPHA: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
    let shift = [seed::unit(key), seed::unit(seed::combine(key, 1))];
    range.map(move |i| {
        let y: [f64; 2] = std::array::from_fn(|k| (shift[k] + ALPHA[k] * (i + 1) as f64).fract());
        if shape == CellShape::Triangle && y[0] + y[1] > 1.0 { [1.0 - y[0], 1.0 - y[1]] } else { y }
    })
}
