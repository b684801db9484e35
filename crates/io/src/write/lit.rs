//! From a solution to a lit model: every element cut so finely that vertex colours follow its basis.

mod crisp;

use super::{LitMesh, LitModel, ModelNote, ToneMap};
use ondelette_compress::NodeId;
use ondelette_compress::forest::Node;
use ondelette_numerics::par;
use ondelette_radiosity::probe::Prober;
use ondelette_radiosity::scene::Camera;
use ondelette_radiosity::{DirectLight, Rgb, Solution};
use ondelette_wavelet::cell::{CellBasis, CellShape};
use std::f64::consts::{FRAC_1_PI, PI};

/// Colours from which an exposure is chosen, spread over the surfaces by area.
const TONE_SAMPLES: f64 = 20_000.0;

/// Nodes that a step paints.
const NODES: usize = 1024;
/// ... with direct light gathered anew.
const CRISP_NODES: usize = 128;

/// The model that shows a solution: [`ModelPainter`] at once.
///
/// ```
/// use ondelette_io::write::{glb_bytes, lit_model, scene_tone};
/// use ondelette_radiosity::{Settings, Solver, scene::samples};
/// let solver = Solver::new(samples::facing_squares(1.0), Settings::default())?;
/// let solution = solver.solution();
/// let model = lit_model(&solution, scene_tone(&solution), None);
/// assert_eq!(model.meshes.len(), 2);
/// assert!(glb_bytes(&model).is_ok());
/// # Ok::<(), ondelette_radiosity::SolveError>(())
/// ```
pub fn lit_model(solution: &Solution, tone: ToneMap, camera: Option<Camera>) -> LitModel {
    let mut painter = ModelPainter::new(solution, tone, camera);
    while !painter.step() {}
    painter.into_model()
}

/// Makes the model that shows a solution, some elements a step: one mesh an object, one flat colour a box where the
/// basis is piecewise constant, else colours at the corners of 2 x 2 (order 2) or 4 x 4 quads (higher orders) an
/// element. Where direct light is gathered ([`DirectLight::Gathered`]), it is so at every corner in a penumbra, and
/// elements are cut there until the shadow is shown to what an eye can tell apart, or to a 2,000th of the scene's
/// diagonal.
///
/// Colours are the radiance B / pi that leaves, seen through `tone`; positions are in metres. Each side has triangles
/// of its own, which viewers draw from its front only: the two sides of a patch do not fight for pixels, and one looks
/// into a closed room from outside. Cost O(leaves); the model does not depend on the number of threads.
pub struct ModelPainter<'a> {
    solution: &'a Solution,
    tone: ToneMap,
    camera: Option<Camera>,
    exact: Option<Prober<'a>>,
    meshes: Vec<LitMesh>,
    done: usize,
}

impl<'a> ModelPainter<'a> {
    /// Nothing is painted yet.
    pub fn new(solution: &'a Solution, tone: ToneMap, camera: Option<Camera>) -> Self {
        let mesh = |name: &String| LitMesh { name: name.clone(), ..LitMesh::default() };
        let meshes = solution.scene().objects.iter().map(|o| mesh(&o.name)).collect();
        let is_gathered = solution.settings().direct == DirectLight::Gathered;
        let exact = is_gathered.then(|| Prober::new(solution));
        ModelPainter { solution, tone, camera, exact, meshes, done: 0 }
    }

    /// Paints some more elements; true when all are painted.
    pub fn step(&mut self) -> bool {
        let nodes = self.solution.forest().nodes();
        let most = if self.exact.is_some() { CRISP_NODES } else { NODES };
        let count = most.min(nodes.len() - self.done);
        let from = self.done;
        let painted = par::map(count, |k| self.paint(NodeId((from + k) as u32)));
        for (mesh, painted) in painted.into_iter().flatten() {
            let mesh = &mut self.meshes[mesh];
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(painted.positions);
            mesh.colors.extend(painted.colors);
            mesh.indices.extend(painted.indices.into_iter().map(|i| first + i));
        }
        self.done += count;
        self.done == nodes.len()
    }

    /// Share of the elements that are painted.
    pub fn progress(&self) -> f64 {
        self.done as f64 / self.solution.forest().len().max(1) as f64
    }

    /// The model; what is not painted yet is missing in it.
    pub fn into_model(self) -> LitModel {
        let scene = self.solution.scene();
        let note = ModelNote {
            quantity: format!("{} that leaves, radiosity / pi", scene.quantity.radiance_name()),
            unit: scene.quantity.radiance_unit().into(),
            exposure: self.tone.exposure,
            white: self.tone.white,
        };
        let metres = scene.unit.metres;
        let camera = self.camera.map(|c| Camera { eye: c.eye * metres, at: c.at * metres, ..c });
        LitModel { meshes: self.meshes, note, camera }
    }

    /// One node's triangles and the mesh that they belong to, if it is a leaf.
    fn paint(&self, id: NodeId) -> Option<(usize, Painted)> {
        let node = self.solution.forest().node(id);
        if node.first_child != 0 {
            return None;
        }
        let leaf = Leaf::new(self.solution, self.tone, id, node);
        let scene = self.solution.scene();
        let object = scene.patches[scene.sides[leaf.side].patch as usize].provenance.object as usize;
        let crisp = self.exact.as_ref().filter(|prober| prober.is_penumbra(id));
        Some((object, crisp.map_or_else(|| leaf.paint(), |prober| crisp::paint(&leaf, prober))))
    }
}

/// The tone curve for a lit model: from the radiance of all surfaces, spread by area.
pub fn scene_tone(solution: &Solution) -> ToneMap {
    let scene = solution.scene();
    let mut whole = 0.0;
    solution.each_leaf(|_, _, area, _| whole += area);
    let (mut pixels, mut sum) = (Vec::new(), 0.0);
    solution.each_leaf(|_, side, area, mean| {
        let material = scene.material(scene.sides[side]);
        let radiance = material.radiance + material.reflectance * mean * FRAC_1_PI;
        sum += area;
        let until = (sum / whole * TONE_SAMPLES).round() as usize;
        pixels.resize(until.max(pixels.len()), radiance.0.map(|c| c as f32));
    });
    ToneMap::auto(&pixels)
}

/// Triangles of one leaf.
#[derive(Default)]
struct Painted {
    positions: Vec<[f32; 3]>,
    colors: Vec<[f32; 3]>,
    indices: Vec<u32>,
}

/// One leaf with what its colours need.
struct Leaf<'a> {
    solution: &'a Solution,
    tone: ToneMap,
    id: NodeId,
    node: &'a Node,
    side: usize,
    basis: &'a CellBasis,
    coefficients: &'a [[f64; 3]],
}

impl<'a> Leaf<'a> {
    fn new(solution: &'a Solution, tone: ToneMap, id: NodeId, node: &'a Node) -> Self {
        let side = node.cell.root as usize;
        let basis = solution.forest().basis(node.cell.shape);
        let start = id.index() * solution.forest().stride();
        let coefficients = &solution.coefficients()[start..start + basis.len()];
        Leaf { solution, tone, id, node, side, basis, coefficients }
    }

    /// Where a local point is, in metres.
    fn position(&self, at: [f64; 2]) -> [f32; 3] {
        let point = self.solution.point(self.side, self.node.cell.to_root(at)) * self.solution.scene().unit.metres;
        point.to_array().map(|c| c as f32)
    }

    /// The displayed colour of a surface with this irradiance.
    fn color(&self, irradiance: Rgb) -> [f32; 3] {
        let scene = self.solution.scene();
        let material = scene.material(scene.sides[self.side]);
        let radiance = material.radiance + material.reflectance * irradiance * (1.0 / PI);
        self.tone.display(radiance.0.map(|c| c as f32))
    }

    /// Irradiance at a local point of this leaf (and not of a neighbour that shares the point).
    fn irradiance(&self, at: [f64; 2], values: &mut Vec<f64>) -> Rgb {
        values.resize(self.basis.len(), 0.0);
        self.basis.eval(at, values);
        self.coefficients.iter().zip(&*values).fold(Rgb::BLACK, |sum, (c, v)| sum + Rgb(*c) * *v)
    }

    /// Its triangles as the basis functions have them.
    fn paint(&self) -> Painted {
        let mut painted = Painted::default();
        let mut values = Vec::new();
        let mut vertex = |painted: &mut Painted, place: [f64; 2], color: [f64; 2]| {
            painted.positions.push(self.position(place));
            painted.colors.push(self.color(self.irradiance(color, &mut values)));
            painted.positions.len() as u32 - 1
        };
        let boxes = self.basis.box_of(0).is_some() || self.basis.order() == 1;
        let cuts = match self.basis.order() {
            order if boxes => order,
            2 => 2,
            _ => 4,
        };
        let step = 1.0 / cuts as f64;
        match (self.node.cell.shape, boxes) {
            (CellShape::Triangle, true) => {
                let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|x| vertex(&mut painted, x, [1.0 / 3.0; 2]));
                painted.indices.extend(corners);
            }
            (_, true) => {
                for (i, j) in (0..cuts).flat_map(|j| (0..cuts).map(move |i| (i, j))) {
                    let at = |a: f64, b: f64| [(i as f64 + a) * step, (j as f64 + b) * step];
                    let corners = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
                    let [a, b, c, d] = corners.map(|x| vertex(&mut painted, x, at(0.5, 0.5)));
                    painted.indices.extend([a, b, c, a, c, d]);
                }
            }
            (shape, false) => {
                let width = |row: usize| if shape == CellShape::Triangle { cuts - row } else { cuts };
                let mut rows: Vec<u32> = Vec::with_capacity(cuts + 1);
                for j in 0..=cuts {
                    rows.push(painted.positions.len() as u32);
                    for i in 0..=width(j) {
                        let at = [i as f64 * step, j as f64 * step];
                        vertex(&mut painted, at, at);
                    }
                }
                for (j, pair) in rows.windows(2).enumerate() {
                    for i in 0..width(j) as u32 {
                        let (a, d) = (pair[0] + i, pair[1] + i);
                        painted.indices.extend([a, a + 1, d]);
                        if shape != CellShape::Triangle || (i as usize) + 1 < width(j) {
                            painted.indices.extend([a + 1, d + 1, d]);
                        }
                    }
                }
            }
        }
        painted
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use ondelette_radiosity::scene::samples;
    use ondelette_radiosity::{Scene, Settings, Solver};

    fn solve(scene: Scene, basis: &str) -> Solution {
        let mut solver =
            Solver::new(scene, Settings { basis: basis.parse().unwrap(), error: 0.1, ..Settings::default() }).unwrap();
        while solver.step().is_some() {}
        solver.solution()
    }

    fn trapezium() -> Scene {
        let floor = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [2.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
        let lamp = [[0.0, 1.0, 1.0], [3.0, 1.0, 1.0], [3.0, 0.0, 1.0], [0.0, 0.0, 1.0]];
        let light = Rgb::grey(FRAC_1_PI);
        samples::quads("trapezium", &[(floor, Rgb::grey(0.5), Rgb::BLACK), (lamp, Rgb::BLACK, light)])
    }

    #[test]
    fn the_triangles_cover_every_side_once_and_face_its_front() {
        for basis in ["haar", "m2", "m3", "f1", "f2", "f3"] {
            let solution = solve(trapezium(), basis);
            let model = lit_model(&solution, scene_tone(&solution), None);
            for (mesh, (area, normal)) in model.meshes.iter().zip([(2.0, Vec3::Z), (3.0, Vec3::NEG_Z)]) {
                let mut sum = 0.0;
                for t in mesh.indices.chunks_exact(3) {
                    let [a, b, c] = [0, 1, 2].map(|k| Vec3::from(mesh.positions[t[k] as usize]));
                    let twice = (b - a).cross(c - a);
                    assert!(twice.dot(normal) > 0.0, "{basis}: a triangle of {} is turned round", mesh.name);
                    sum += 0.5 * twice.length();
                }
                assert!((sum - area).abs() < 1e-4, "{basis}: {} of {area} covered on {}", sum, mesh.name);
                assert!(!mesh.double_sided && mesh.colors.len() == mesh.positions.len());
            }
        }
    }

    #[test]
    fn colours_are_the_radiance_under_the_tone_curve() {
        let mut solver =
            Solver::new(samples::cube(0.5, [1.0; 6]), Settings { error: 0.01, ..Settings::default() }).unwrap();
        while solver.step().is_some() {}
        let solution = solver.solution();
        let tone = ToneMap { exposure: 1.0, white: 1.0 };
        let model = lit_model(&solution, tone, None);
        // a furnace: B = 1 / (1 - 0.5) = 2 everywhere, whatever the element
        for colour in model.meshes.iter().flat_map(|m| &m.colors).flatten() {
            assert!((f64::from(*colour) - 2.0 * FRAC_1_PI).abs() < 0.02, "{colour}");
        }
        assert!(model.note.quantity.contains("radiance") && model.note.unit == "W/(m^2 sr)");
    }

    /// A room of grey walls with a box under a small lamp.
    fn shadow() -> Scene {
        let p = |i: u32, o: [f64; 3], s: f64| [0, 1, 2].map(|k| o[k] + s * f64::from(i >> k & 1));
        let walls = [[0, 1, 3, 2], [6, 7, 5, 4], [0, 2, 6, 4], [3, 1, 5, 7], [1, 0, 4, 5], [2, 3, 7, 6]];
        let grey = Rgb::grey(0.6);
        let room = walls.iter().map(|w| (w.map(|i| p(i, [0.0; 3], 1.0)), grey, Rgb::BLACK));
        let turned = |w: &[u32; 4]| [w[3], w[2], w[1], w[0]].map(|i| p(i, [0.35, 0.3, 0.0], 0.35));
        let block = walls[1..].iter().map(|w| (turned(w), grey, Rgb::BLACK));
        let lamp = [[0.4, 0.4, 0.99], [0.4, 0.6, 0.99], [0.6, 0.6, 0.99], [0.6, 0.4, 0.99]];
        let lamp = (lamp, Rgb::BLACK, Rgb::grey(10.0));
        samples::quads("shadow", &room.chain(block).chain([lamp]).collect::<Vec<_>>())
    }

    fn kept(error: f64, direct: DirectLight) -> Solution {
        let mut solver = Solver::new(shadow(), Settings { error, direct, ..Settings::default() }).unwrap();
        while solver.step().is_some() {}
        solver.into_kept()
    }

    /// The colour that a viewer shows at a point of the plane z = 0, and how many triangles claim it.
    fn shown(mesh: &LitMesh, at: Vec3) -> (f32, usize) {
        let (mut color, mut count) = (0.0, 0);
        for t in mesh.indices.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|k| Vec3::from(mesh.positions[t[k] as usize]));
            let twice = (b - a).cross(c - a).z;
            let [u, v, w] = [(b, c), (c, a), (a, b)].map(|(p, q)| (p - at).cross(q - at).z / twice);
            if u.min(v).min(w) > 0.0 {
                let red = |k: usize| mesh.colors[t[k] as usize][0];
                (color, count) = (u * red(0) + v * red(1) + w * red(2), count + 1);
            }
        }
        (color, count)
    }

    #[test]
    fn shadows_gathered_anew_are_sharp_between_vertices() {
        let [fitted, coarse] = [DirectLight::Fitted, DirectLight::Gathered].map(|direct| kept(0.1, direct));
        let fine = kept(0.01, DirectLight::Gathered);
        let tone = scene_tone(&fine);
        let exact = [&coarse, &fine].map(Prober::new);
        let models = [&fitted, &coarse].map(|solution| lit_model(solution, tone, None));
        let area = |mesh: &LitMesh| {
            let twice = |t: &[u32]| {
                let [a, b, c] = [0, 1, 2].map(|k| Vec3::from(mesh.positions[t[k] as usize]));
                (b - a).cross(c - a).z
            };
            mesh.indices.chunks_exact(3).map(twice).sum::<f32>() / 2.0
        };
        // root mean square on a line across the shadow of the box on the floor
        let miss = |model: &LitModel, truth: &Prober<'_>| {
            let floor = &model.meshes[0];
            assert!((area(floor) - 1.0).abs() < 1e-4, "{}", area(floor));
            let square = |k: u32| {
                let at = [0.02 + 0.96 * (f64::from(k) + 0.3137) / 300.0, 0.7137];
                let radiance = truth.radiosity(0, at).0.map(|b| (b / PI) as f32);
                let (color, claims) = shown(floor, Vec3::new(at[0] as f32, at[1] as f32, 0.0));
                assert_eq!(claims, 1, "{at:?}");
                (color - tone.display(radiance)[0]).powi(2)
            };
            ((0..300).map(square).sum::<f32>() / 300.0).sqrt()
        };
        let [own, true_light] = exact.each_ref().map(|truth| models.each_ref().map(|model| miss(model, truth)));
        // as good as looking at every point; what is left to the truth is reflected light
        assert!(own[1] < 0.5 * own[0], "{own:?}");
        assert!(true_light[1] < 0.8 * true_light[0], "{true_light:?}");
        let one = par::with_threads(1, || lit_model(&coarse, tone, None)).unwrap();
        for (a, b) in one.meshes.iter().zip(&models[1].meshes) {
            assert!(a.colors == b.colors && a.positions == b.positions && a.indices == b.indices);
        }
    }
}
