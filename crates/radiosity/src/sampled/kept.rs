//! What a solution keeps of its samples, so that it can be lit anew or refined without drawing them again.
//!
//! The samples of a row say where light comes from, not how much: another emission or reflectance changes nothing in
//! them. Direct light is kept for unit exitance of every emitting material.

use super::gather::{self, Gather};
use super::lamps::{Lamps, MOST_GROUPS, MOST_LAMPS};
use super::plan::MOST_LAMP_RAYS;
use super::points::Point;
use super::rays::{Ray, Rays};
use super::{Phase, Sampled, counted_area, plan};
use crate::kernel::LightKernel;
use crate::scene::{Paint, PaintError, Scene};
use crate::settings::DirectLight;
use crate::solution::Solution;
use ondelette_compress::{Forest, NodeId};
use ondelette_wavelet::cell::CellShape;
use std::collections::BTreeSet;
use std::sync::Arc;

/// The samples behind a solution, as flat arrays: see [`Kept::check`] for what fits what.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Kept {
    /// Materials whose lamps are known apart.
    pub groups: Vec<u32>,
    /// Sides that are lamps, strongest first.
    pub lamps: Vec<u32>,
    /// Direct light for unit exitance, `[node][group][function]`.
    pub direct: Vec<f64>,
    /// Mean absolute misfit of it, `[node][group]`.
    pub misfit: Vec<f32>,
    /// Root mean square scatter of it, likewise.
    pub scatter: Vec<f32>,
    /// Rays a point to lamps behind many things, a number a node.
    pub lamp_rays: Vec<f32>,
    /// Whether errors of a node are among many things, and grow with a finer promise: 0 or 1.
    pub crowded: Vec<u8>,
    /// Of each gathering element: node, points, directions drawn, samples of the first half (those that iterations use,
    /// the others) and of the second.
    pub gathers: Vec<[u32; 7]>,
    /// Element coordinates of the points, element by element.
    pub places: Vec<[f64; 2]>,
    /// Keys of their directions.
    pub keys: Vec<u64>,
    /// Whether they are not inside of something: 0 or 1.
    pub open: Vec<u8>,
    /// Where samples arrive: leaf coordinates, by element, half, first and others.
    pub ends: Vec<[f32; 2]>,
    /// The leaf met, or 2^32 - 1 for none.
    pub leaves: Vec<u32>,
    /// The point that each starts from, counted in its element.
    pub starts: Vec<u8>,
}

impl Kept {
    /// Whether there are samples to go on from, and not direct light alone.
    pub fn has_samples(&self) -> bool {
        !self.gathers.is_empty()
    }

    /// Direct light alone: what reading it exactly needs, for [`DirectLight::Gathered`](crate::DirectLight).
    #[must_use]
    pub fn without_samples(&self) -> Self {
        Kept {
            groups: self.groups.clone(),
            lamps: self.lamps.clone(),
            direct: self.direct.clone(),
            misfit: self.misfit.clone(),
            scatter: self.scatter.clone(),
            lamp_rays: self.lamp_rays.clone(),
            crowded: self.crowded.clone(),
            ..Kept::default()
        }
    }

    /// Whether all of this fits a scene and its forest.
    ///
    /// # Errors
    /// A sentence about the first thing that does not.
    pub fn check(&self, scene: &Scene, forest: &Forest) -> Result<(), String> {
        let (nodes, groups) = (forest.len(), self.groups.len());
        let length = |name: &str, found: usize, wanted: usize| {
            if found == wanted { Ok(()) } else { Err(format!("{found} {name} where {wanted} belong")) }
        };
        length("numbers of direct light", self.direct.len(), nodes * groups * forest.stride())?;
        length("misfits", self.misfit.len(), nodes * groups)?;
        length("scatters", self.scatter.len(), nodes * groups)?;
        length("numbers of rays", self.lamp_rays.len(), nodes)?;
        length("marks of crowds", self.crowded.len(), nodes)?;
        if self.crowded.iter().any(|c| *c > 1) {
            return Err("a mark of a crowd other than 0 and 1".into());
        }
        let all = |values: &[f32]| values.iter().all(|v| v.is_finite() && *v >= 0.0);
        if !all(&self.misfit) || !all(&self.scatter) || !all(&self.lamp_rays) {
            return Err("an error or a number of rays that is negative or no number".into());
        }
        if self.lamp_rays.iter().any(|r| *r < 1.0 || f64::from(*r) > MOST_LAMP_RAYS) {
            return Err(format!("less than one ray, or more than {MOST_LAMP_RAYS}, to the lamps at a point"));
        }
        if !self.direct.iter().all(|v| v.is_finite()) {
            return Err("direct light that is no number".into());
        }
        if self.groups.iter().any(|&m| m as usize >= scene.materials.len()) {
            return Err("a lamp's material that the scene does not have".into());
        }
        let is_distinct = |all: &[u32]| all.iter().collect::<BTreeSet<_>>().len() == all.len();
        if self.groups.len() > MOST_GROUPS || self.lamps.len() > MOST_LAMPS {
            return Err(format!("more than {MOST_GROUPS} materials of lamps, or {MOST_LAMPS} lamps"));
        }
        if !is_distinct(&self.groups) || !is_distinct(&self.lamps) {
            return Err("a lamp, or the material of lamps, named twice".into());
        }
        for &side in &self.lamps {
            let known = scene
                .sides
                .get(side as usize)
                .is_some_and(|s| self.groups.contains(&scene.patches[s.patch as usize].material));
            if !known {
                return Err(format!("side {side} as a lamp, whose material is none of a lamp"));
            }
        }
        let (mut points, mut samples) = (0, 0);
        let mut covered = vec![false; nodes];
        for (k, record) in self.gathers.iter().enumerate() {
            let [node, count, drawn, halves @ ..] = *record;
            let wrong = |what: &str| Err(format!("gathering element {k} {what}"));
            if node as usize >= nodes || std::mem::replace(&mut covered[node as usize], true) {
                return wrong("stands at a node that is not there or has one");
            }
            if count == 0 || count as usize > Gather::MOST_POINTS {
                return wrong(&format!("has {count} points"));
            }
            // every point has all directions; those beyond the first may be left to be drawn again
            let [first, others] = [drawn.min(Gather::FIRST), drawn.saturating_sub(Gather::FIRST)];
            let right = |stored: u32| halves == [count * first, stored, count * first, stored];
            if drawn > plan::MOST_DIRECTIONS as u32 || !(right(0) || right(count * others)) {
                return wrong(&format!("has samples {halves:?} of {drawn} directions at {count} points"));
            }
            points += u64::from(count);
            for half in halves.map(u64::from) {
                let range = samples as usize..(samples + half) as usize;
                let mut each = vec![0; count as usize];
                let starts = self.starts.get(range).unwrap_or(&[]);
                let counted = starts.iter().all(|&s| each.get_mut(usize::from(s)).map(|n| *n += 1).is_some());
                if !counted || each.iter().any(|n| n * u64::from(count) != half) {
                    return wrong("has samples that start from no point, or not as many from each");
                }
                samples += half;
            }
        }
        length("points", self.places.len(), points as usize)?;
        length("keys", self.keys.len(), points as usize)?;
        length("marks of points", self.open.len(), points as usize)?;
        length("ends", self.ends.len(), samples as usize)?;
        length("leaves", self.leaves.len(), samples as usize)?;
        length("starts", self.starts.len(), samples as usize)?;
        if self.places.iter().flatten().any(|x| !(0.0..=1.0).contains(x)) || self.open.iter().any(|o| *o > 1) {
            return Err("a point outside of its element".into());
        }
        if self.ends.iter().flatten().any(|x| !(-1.0..=2.0).contains(x)) {
            return Err("a sample that ends outside of its leaf".into());
        }
        let is_end = |l: u32| l == Ray::NO_LEAF || (l as usize) < nodes && forest.is_leaf(NodeId(l));
        if !self.leaves.iter().all(|&l| is_end(l)) {
            return Err("a sample that ends at no leaf".into());
        }
        if !self.has_samples() {
            return Ok(());
        }
        // every leaf is below one gathering element and no more
        for (n, node) in forest.nodes().iter().enumerate().filter(|(_, node)| node.first_child == 0) {
            let (mut above, mut id) = (0, n);
            loop {
                above += usize::from(covered[id]);
                let parent = forest.nodes()[id].parent.index();
                if forest.nodes()[id].cell.depth == 0 || parent >= id {
                    break;
                }
                id = parent;
            }
            if above != 1 {
                return Err(format!("{above} gathering elements over leaf {n} of side {}", node.cell.root));
            }
        }
        Ok(())
    }
}

impl Sampled {
    /// Direct light alone: none if it was stopped where elements are not fitted yet. Its arrays are moved out.
    pub(super) fn keep_direct(&mut self) -> Option<Kept> {
        (!self.is_growing()).then(|| Kept {
            groups: self.lamps.groups.iter().map(|g| g.0).collect(),
            lamps: self.lamps.sides().collect(),
            direct: std::mem::take(&mut self.direct).into_iter().map(f64::from).collect(),
            misfit: std::mem::take(&mut self.misfit),
            scatter: std::mem::take(&mut self.scatter),
            lamp_rays: std::mem::take(&mut self.rays),
            crowded: std::mem::take(&mut self.crowded).into_iter().map(u8::from).collect(),
            ..Kept::default()
        })
    }

    /// The end, with the samples: none if it was stopped where elements are not fitted yet.
    pub(crate) fn into_kept(mut self) -> Solution {
        let Some(mut kept) = self.keep_direct() else { return self.without_samples() };
        for gather in std::mem::take(&mut self.gathers) {
            gather.store(&mut kept);
        }
        self.without_samples().with_kept(Arc::new(kept))
    }

    /// Goes on from a solution that kept its samples; `None` if it has none.
    pub(crate) fn resume(solution: &Solution) -> Option<Self> {
        let kept = solution.kept().filter(|kept| kept.has_samples())?;
        let (scene, forest) = (solution.scene().clone(), solution.forest().clone());
        let kernel = LightKernel::new(&scene);
        let lamps = Lamps::restore(&scene, &kernel, solution.settings().error, kept);
        let mut rays = 0;
        let mut points = 0;
        let order = gather::coarsest(forest.basis(CellShape::Square));
        let gathers: Vec<Gather> =
            kept.gathers.iter().map(|record| Gather::restore((kept, order), record, &mut points, &mut rays)).collect();
        let streaming = kept.gathers.iter().any(|g| g[2] > Gather::FIRST && g[4] == 0);
        let mut sampled = Sampled {
            direct: kept.direct.iter().map(|d| *d as f32).collect(),
            misfit: kept.misfit.clone(),
            scatter: kept.scatter.clone(),
            rays: kept.lamp_rays.clone(),
            crowded: kept.crowded.iter().map(|c| *c == 1).collect(),
            lit: solution.lit().to_vec(),
            irradiance: solution.coefficients().to_vec(),
            streaming,
            statistics: solution.statistics().clone(),
            ..Self::at_the_start(scene, solution.settings(), kernel, lamps, forest, gathers)
        };
        sampled.prepare();
        sampled.begin_again();
        Some(sampled)
    }

    /// Paints materials, and begins the balance again.
    pub(crate) fn paint(&mut self, paints: &[Paint]) -> Result<(), PaintError> {
        let scene = self.scene.painted(paints)?;
        self.lamps.repaint(&scene);
        // the shares of the lamps are others now
        self.known.fill(None);
        self.scene = Arc::new(scene);
        self.begin_again();
        Ok(())
    }

    /// Promises another error.
    pub(crate) fn promise(&mut self, error: f64) {
        self.settings.error = error;
        // what was measured with another doubt than the new promise calls for
        let more = self.lamps.promise(error) as f32;
        let groups = self.lamps.groups.len().max(1);
        for errors in [&mut self.misfit, &mut self.scatter] {
            let crowded = errors.chunks_mut(groups).zip(&self.crowded).filter(|(_, crowded)| **crowded);
            crowded.for_each(|(errors, _)| errors.iter_mut().for_each(|e| *e *= more));
        }
        self.begin_again();
    }

    /// Lets direct light be read in another way.
    pub(crate) fn read_direct(&mut self, direct: DirectLight) {
        self.settings.direct = direct;
        self.begin_again();
    }

    /// Whether there are elements or points about which nothing is known yet.
    fn is_growing(&self) -> bool {
        matches!(self.phase, Phase::Fitting { .. } | Phase::Casting { .. })
    }

    fn begin_again(&mut self) {
        while self.is_growing() {
            self.step();
        }
        self.counted_area = counted_area(&self.scene, &self.kernel);
        (self.aim, self.rounds, self.corrections, self.thorough) = (plan::AIM, 0, 0, false);
        self.full = false;
        (self.refitted, self.stalled, self.error, self.whole) = (false, false, f64::INFINITY, 0.0);
        // the samples may be as good as they need be: nothing more is left over by the balance
        self.precision = plan::FINELY * self.settings.error;
        // from the dark: the same light, whatever was balanced before
        self.indirect.fill([0.0; 3]);
        self.start_sweeping();
    }
}

impl Gather {
    /// Appends itself to what is kept.
    fn store(self, kept: &mut Kept) {
        let points = self.points() as usize;
        let [first, others] = self.parts();
        let parts = [first.half(0), others.half(0), first.half(1), others.half(1)];
        let [a, b, c, d] = parts.map(|rays| rays.len() as u32);
        kept.gathers.push([self.node.0, self.points(), self.drawn, a, b, c, d]);
        for (point, open) in self.marked_points() {
            kept.places.push(point.at);
            kept.keys.push(point.key);
            kept.open.push(u8::from(open));
        }
        for rays in parts.into_iter().filter(|rays| !rays.is_empty()) {
            for (k, ray) in rays.iter().enumerate() {
                kept.ends.push(ray.to().map(|x| x as f32));
                kept.leaves.push(ray.leaf());
                kept.starts.push((k / (rays.len() / points)) as u8);
            }
        }
    }

    /// The element of a record, whose points and samples begin at `point` and `sample`, which move on.
    fn restore((kept, order): (&Kept, usize), record: &[u32; 7], point: &mut usize, sample: &mut usize) -> Gather {
        let [node, count, drawn, halves @ ..] = *record;
        let own = *point..*point + count as usize;
        *point = own.end;
        let points = own.clone().map(|p| Point { at: kept.places[p], key: kept.keys[p] }).collect();
        let open = kept.open[own].iter().map(|o| *o == 1).collect();
        let [a, b, c, d] = halves.map(|count| -> Vec<Ray> {
            let mut own: Vec<usize> = (*sample..*sample + count as usize).collect();
            *sample += count as usize;
            own.sort_by_key(|k| kept.starts[*k]);
            own.into_iter().map(|k| Ray::new(kept.leaves[k], kept.ends[k].map(f64::from))).collect()
        });
        let parts = [[a, c], [b, d]].map(Rays::of_halves);
        Gather::of_parts((NodeId(node), order), (points, open), drawn, parts)
    }
}
