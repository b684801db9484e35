//! From a solution to a lit model: every element cut so finely that vertex colours follow its basis.

use super::{LitMesh, LitModel, ModelNote, ToneMap};
use ondelette_compress::NodeId;
use ondelette_compress::forest::Node;
use ondelette_radiosity::scene::Camera;
use ondelette_radiosity::{Rgb, Solution};
use ondelette_wavelet::cell::{CellBasis, CellShape};
use std::f64::consts::{FRAC_1_PI, PI};

/// Colours from which an exposure is chosen, spread over the surfaces by area.
const TONE_SAMPLES: f64 = 20_000.0;

/// The model that shows a solution: one mesh an object, one flat colour a box where the basis is piecewise constant,
/// else colours at the corners of 2 x 2 (order 2) or 4 x 4 quads (higher orders) an element.
///
/// Colours are the radiance B / pi that leaves, seen through `tone`; positions are in metres. Each side has triangles
/// of its own, which viewers draw from its front only: the two sides of a patch do not fight for pixels, and one looks
/// into a closed room from outside. Cost O(leaves).
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
    let scene = solution.scene();
    let metres = scene.unit.metres;
    let mut meshes: Vec<LitMesh> =
        scene.objects.iter().map(|o| LitMesh { name: o.name.clone(), ..LitMesh::default() }).collect();
    let mut values = Vec::new();
    for (n, node) in solution.forest().nodes().iter().enumerate() {
        if node.first_child != 0 {
            continue;
        }
        let leaf = Leaf::new(solution, NodeId(n as u32), node);
        let mesh = &mut meshes[scene.patches[leaf.patch].provenance.object as usize];
        let mut vertex = |mesh: &mut LitMesh, place: [f64; 2], colour: [f64; 2]| {
            let point = solution.point(leaf.side, leaf.node.cell.to_root(place)) * metres;
            mesh.positions.push(point.to_array().map(|c| c as f32));
            mesh.colors.push(tone.display(leaf.radiance(colour, &mut values).0.map(|c| c as f32)));
            mesh.positions.len() as u32 - 1
        };
        let boxes = leaf.basis.box_of(0).is_some() || leaf.basis.order() == 1;
        let cuts = match leaf.basis.order() {
            order if boxes => order,
            2 => 2,
            _ => 4,
        };
        let step = 1.0 / cuts as f64;
        match (node.cell.shape, boxes) {
            (CellShape::Triangle, true) => {
                let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|x| vertex(mesh, x, [1.0 / 3.0; 2]));
                mesh.indices.extend(corners);
            }
            (_, true) => {
                for (i, j) in (0..cuts).flat_map(|j| (0..cuts).map(move |i| (i, j))) {
                    let at = |a: f64, b: f64| [(i as f64 + a) * step, (j as f64 + b) * step];
                    let corners = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
                    let [a, b, c, d] = corners.map(|x| vertex(mesh, x, at(0.5, 0.5)));
                    mesh.indices.extend([a, b, c, a, c, d]);
                }
            }
            (shape, false) => {
                let width = |row: usize| if shape == CellShape::Triangle { cuts - row } else { cuts };
                let mut rows: Vec<u32> = Vec::with_capacity(cuts + 1);
                for j in 0..=cuts {
                    rows.push(mesh.positions.len() as u32);
                    for i in 0..=width(j) {
                        let at = [i as f64 * step, j as f64 * step];
                        vertex(mesh, at, at);
                    }
                }
                for (j, pair) in rows.windows(2).enumerate() {
                    for i in 0..width(j) as u32 {
                        let (a, d) = (pair[0] + i, pair[1] + i);
                        mesh.indices.extend([a, a + 1, d]);
                        if shape != CellShape::Triangle || (i as usize) + 1 < width(j) {
                            mesh.indices.extend([a + 1, d + 1, d]);
                        }
                    }
                }
            }
        }
    }
    let note = ModelNote {
        quantity: format!("{} that leaves, radiosity / pi", scene.quantity.radiance_name()),
        unit: scene.quantity.radiance_unit().into(),
        exposure: tone.exposure,
        white: tone.white,
    };
    let camera = camera.map(|c| Camera { eye: c.eye * metres, at: c.at * metres, ..c });
    LitModel { meshes, note, camera }
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

/// One leaf with what its colours need.
struct Leaf<'a> {
    solution: &'a Solution,
    node: &'a Node,
    side: usize,
    patch: usize,
    basis: &'a CellBasis,
    coefficients: &'a [[f64; 3]],
}

impl<'a> Leaf<'a> {
    fn new(solution: &'a Solution, id: NodeId, node: &'a Node) -> Self {
        let side = node.cell.root as usize;
        let basis = solution.forest().basis(node.cell.shape);
        let start = id.index() * solution.forest().stride();
        let coefficients = &solution.coefficients()[start..start + basis.len()];
        let patch = solution.scene().sides[side].patch as usize;
        Leaf { solution, node, side, patch, basis, coefficients }
    }

    /// Radiance that leaves, at a local point of this leaf (and not of a neighbour that shares the point).
    fn radiance(&self, at: [f64; 2], values: &mut Vec<f64>) -> Rgb {
        values.resize(self.basis.len(), 0.0);
        self.basis.eval(at, values);
        let irradiance = self.coefficients.iter().zip(&*values).fold(Rgb::BLACK, |sum, (c, v)| sum + Rgb(*c) * *v);
        let scene = self.solution.scene();
        let material = scene.material(scene.sides[self.side]);
        material.radiance + material.reflectance * irradiance * (1.0 / PI)
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
}
