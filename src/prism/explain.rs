//! What the exact march does with one ray in one prism: for figures, for teaching, for whoever wonders.

use glam::DVec2;

use super::march::exact;
use super::ray_frame::{RayFrame, axes};
use super::simd::Portable;
use super::{Parts, Prisms};
use crate::ray::Ray;

/// A point of a ray's curve through a prism.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvePoint {
    /// Ray parameter.
    pub t: f64,
    /// Where over the map, in texel coordinates.
    pub texel: DVec2,
    /// How high over it, in the map's heights: on the surface where this is the map's.
    pub height: f64,
}

/// What became of a child of a span.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// Wholly above or below the surface's range, or outside the ray's interval: done with.
    Skipped,
    /// Cut again.
    Cut,
    /// Walked texel cell by texel cell.
    Walked,
    /// Neither skipped nor looked at further: it begins behind the hit.
    Behind,
}

/// A child of a span: a part of the curve that was held against the map's pyramid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpanChild {
    /// How often the span that it is a part of was cut from another.
    pub depth: u32,
    /// Ray parameters of its ends.
    pub t: [f64; 2],
    /// The smallest and largest height of the pyramid's entry.
    pub heights: [f64; 2],
    /// What became of it.
    pub fate: Fate,
}

/// The march of one ray through one prism.
#[derive(Clone, Debug, PartialEq)]
pub struct Explanation {
    /// The ray's curve, in order of t.
    pub curve: Vec<CurvePoint>,
    /// All children of all spans, in the order in which they were looked at.
    pub children: Vec<SpanChild>,
    /// Ray parameter of the hit.
    pub hit: Option<f64>,
}

impl Prisms {
    /// What the exact march does with `ray` in the prism over base triangle `prim`: the march's own functions, at the baseline SIMD level on
    /// every machine, without level of detail. `None` where the ray is not inside exactly once, or nearly edge-on, and with the uniform
    /// march. The ray must be [valid](Ray::is_valid).
    pub fn explain(&self, prim: u32, ray: &Ray) -> Option<Explanation> {
        let Parts::Exact(exact) = &self.parts else {
            return None;
        };
        let mut lanes = exact
            .clusters
            .iter()
            .enumerate()
            .flat_map(|(index, cluster)| (0..exact.len(index)).map(move |lane| (cluster, lane)));
        let (cluster, lane) = lanes.find(|(cluster, lane)| cluster.prim(*lane) == prim)?;
        let problem = exact::Problem {
            spread: 0.0,
            ..self.problem(cluster, lane, [ray.tnear, ray.tfar], false)
        };
        exact::explain::<Portable>(&problem, &RayFrame::new(ray, axes(ray)))
    }
}
