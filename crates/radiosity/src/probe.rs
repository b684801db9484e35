//! Reading a solution at points: on its surfaces, or gathered at free points.
//!
//! Where the settings say [`DirectLight::Gathered`], direct light at a point in a penumbra is that of the lamps with
//! exact visibility, and shadows are crisp at any density of points.

use crate::kernel::LightKernel;
use crate::rgb::Rgb;
use crate::sampled::ExactDirect;
use crate::settings::DirectLight;
use crate::solution::Solution;
use glam::DVec3;
use ondelette_compress::NodeId;
use ondelette_numerics::seed;

/// Finds surfaces under points, and gathers irradiance at free points.
pub struct Prober<'a> {
    solution: &'a Solution,
    kernel: LightKernel,
    /// Radiosity means of all nodes, for gathering.
    means: Vec<Rgb>,
    exact: Option<ExactDirect>,
}

/// A point belongs to a surface within this share of the scene's diagonal.
pub const REACH: f64 = 1e-5;
/// ... if its normal and the surface's enclose less than 60 degrees.
const FACING: f64 = 0.5;
/// A gathered element is small enough when its radius is this share of its distance.
const SMALL: f64 = 0.25;

impl<'a> Prober<'a> {
    /// Prepares a solution, to be read as its settings say; as it was fitted, if it was stopped before there was
    /// anything to gather direct light by. Cost: building its ray structure.
    pub fn new(solution: &'a Solution) -> Self {
        let mut prober = Self::fitted(solution);
        if solution.settings().direct == DirectLight::Gathered {
            prober.exact = ExactDirect::new(solution, &prober.kernel);
        }
        prober
    }

    /// Prepares a solution, to be read in a given way. `None` if direct light is to be gathered and the solution did
    /// not keep what that takes.
    pub fn reading(solution: &'a Solution, direct: DirectLight) -> Option<Self> {
        let mut prober = Self::fitted(solution);
        if direct == DirectLight::Gathered {
            prober.exact = Some(ExactDirect::new(solution, &prober.kernel)?);
        }
        Some(prober)
    }

    fn fitted(solution: &'a Solution) -> Self {
        let forest = solution.forest();
        let mut means = vec![Rgb::BLACK; forest.len()];
        solution.each_leaf(|leaf, side, _, mean| {
            let material = solution.scene().material(solution.scene().sides[side]);
            means[leaf] = material.radiance * std::f64::consts::PI + material.reflectance * mean;
        });
        for n in (0..forest.len()).rev() {
            let id = NodeId(n as u32);
            if !forest.is_leaf(id) {
                let arity = forest.node(id).cell.shape.arity();
                for c in 0..arity {
                    let child = means[forest.child(id, c).index()];
                    means[n] += child * (1.0 / arity as f64);
                }
            }
        }
        Prober { solution, kernel: LightKernel::new(solution.scene()), means, exact: None }
    }

    /// The side under a point whose normal faces the same way, and the side-local coordinates there.
    ///
    /// The nearest side within [`REACH`] of the scene's diagonal; ties, at edges, go to the lower side; what another
    /// side covers is not looked at.
    pub fn find(&self, point: DVec3, normal: DVec3) -> Option<(usize, [f64; 2])> {
        let reach = REACH * self.solution.scene().diagonal();
        let normal = normal.normalize_or_zero();
        let mut best: Option<(f64, usize, [f64; 2])> = None;
        for patch in self.kernel.occluders().near(point, reach) {
            for back in [false, true] {
                let Some(side) = self.kernel.side_of(patch, back) else { continue };
                let frame = &self.kernel.sides()[side];
                if frame.normal.dot(normal) < FACING {
                    continue;
                }
                let at = frame.closest(point);
                let foot = frame.origin + frame.edges[0] * at[0] + frame.edges[1] * at[1];
                if self.kernel.is_covered(side, foot) {
                    continue;
                }
                let distance = foot.distance(point);
                // closer than a thousandth of the reach counts as touching: rounding must not decide ties
                let distance = if distance < 1e-3 * reach { 0.0 } else { distance };
                let better = best.is_none_or(|(d, s, _)| distance < d || (distance == d && side < s));
                if distance <= reach && better {
                    best = Some((distance, side, at));
                }
            }
        }
        best.map(|(_, side, at)| (side, at))
    }

    /// Irradiance at side-local coordinates, exactly 0 inside of things: [`Solution::irradiance`] with a look around on
    /// elements that are only partly lit.
    pub fn irradiance(&self, side: usize, at: [f64; 2]) -> Rgb {
        let (leaf, x) = self.solution.forest().locate(side, at);
        if self.is_inside(leaf, side, at) {
            return Rgb::BLACK;
        }
        match &self.exact {
            Some(exact) if exact.is_marked(leaf) => exact.irradiance(self.solution, &self.kernel, leaf, x),
            _ => self.solution.irradiance(side, at),
        }
    }

    /// Whether direct light is gathered on a leaf: it is to be, and the leaf's functions miss too much of it.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn is_penumbra(&self, leaf: NodeId) -> bool {
        self.exact.as_ref().is_some_and(|exact| exact.is_marked(leaf))
    }

    /// Irradiance on one leaf at a local point of its cell, also on its edges, where [`Prober::irradiance`] looks
    /// at the neighbours too. Inside of things it is the leaf's function, not 0: what is interpolated between
    /// points on either side of their foot would be dark in front of it.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn irradiance_on(&self, leaf: NodeId, x: [f64; 2]) -> Rgb {
        let cell = &self.solution.forest().node(leaf).cell;
        let lit = |_: &&ExactDirect| !self.is_inside(leaf, cell.root as usize, cell.to_root(x));
        match self.exact.as_ref().filter(|exact| exact.is_marked(leaf)).filter(lit) {
            Some(exact) => exact.irradiance(self.solution, &self.kernel, leaf, x),
            None => self.solution.inside(leaf, x),
        }
    }

    /// Whether a point of a side, on this leaf, is inside of something.
    fn is_inside(&self, leaf: NodeId, side: usize, at: [f64; 2]) -> bool {
        let lit = self.solution.lit()[leaf.index()];
        lit < 1.0 && self.kernel.is_buried(side, self.solution.point(side, at))
    }

    /// Radiosity (exitance plus reflected) at side-local coordinates.
    pub fn radiosity(&self, side: usize, at: [f64; 2]) -> Rgb {
        let material = self.solution.scene().material(self.solution.scene().sides[side]);
        material.radiance * std::f64::consts::PI + material.reflectance * self.irradiance(side, at)
    }

    /// Irradiance at a free point with a unit normal, gathered from the solved scene: elements in closed form, their
    /// visibility by rays keyed by point and element.
    pub fn gather(&self, point: DVec3, normal: DVec3) -> Rgb {
        let normal = normal.normalize_or_zero();
        let key = seed::combine(point.x.to_bits(), seed::combine(point.y.to_bits(), point.z.to_bits()));
        let mut sum = Rgb::BLACK;
        for &root in self.solution.forest().roots() {
            self.gather_from(root, point, normal, key, &mut sum);
        }
        sum
    }

    fn gather_from(&self, id: NodeId, point: DVec3, normal: DVec3, key: u64, sum: &mut Rgb) {
        let forest = self.solution.forest();
        let node = forest.node(id);
        let radiosity = self.means[id.index()];
        if radiosity.max() <= 0.0 {
            return;
        }
        let element = self.kernel.element(&node.cell);
        let (centre, radius) = element.ball();
        if normal.dot(centre - point) < -radius || element.normal().dot(point - centre) <= 0.0 {
            return;
        }
        let distance = centre.distance(point);
        if !forest.is_leaf(id) && radius > SMALL * distance {
            for c in 0..node.cell.shape.arity() {
                self.gather_from(forest.child(id, c), point, normal, key, sum);
            }
            return;
        }
        let (factor, open) = self.kernel.visible_factor(point, normal, &node.cell, seed::combine(key, node.cell.key));
        *sum += radiosity * (factor * open);
    }
}
