//! A cell of a side, placed in space.

use crate::form_factor::Polygon;
use glam::DVec3;
use ondelette_wavelet::cell::CellShape;

/// A cell in space.
#[derive(Clone, Copy, Debug)]
pub struct Element {
    pub(super) origin: DVec3,
    pub(super) edges: [DVec3; 2],
    pub(super) normal: DVec3,
    pub(super) area: f64,
    pub(super) shape: CellShape,
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
    pub(super) fn part(&self, offset: [f64; 2], scale: f64) -> Element {
        Element {
            origin: self.point(offset),
            edges: [self.edges[0] * scale, self.edges[1] * scale],
            area: self.area * scale * scale,
            ..*self
        }
    }

    /// Area.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// Square or triangle.
    pub fn shape(&self) -> CellShape {
        self.shape
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
