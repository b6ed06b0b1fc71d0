//! What the exact march does with one ray over one base triangle: for figures, for teaching, for whoever wonders.

use glam::DVec2;

use super::block::{Ask, told};
pub use super::block::{BlockTold, CellFate, CellTold, Fate, LeafTold, PartTold};
use super::curve::{Corners, Curve, Cut, View};
use super::exact::Primitive;
use super::judge::Found;
use super::ray_frame::{RayFrame, axes};
use super::simd::{Lanes, Portable, Quad};
use super::{Parts, Prisms};
use crate::ray::Ray;
use crate::surface::Patch;

/// A point of a ray over a base triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    /// Ray parameter.
    pub t: f64,
    /// Where over the map, in texel coordinates: texel i of a row is at i, and cell i between i and i + 1.
    pub texel: DVec2,
    /// How high over it, in the map's heights: on the surface where this is the map's.
    pub height: f64,
}

/// The march of one ray over one base triangle.
#[derive(Clone, Debug, PartialEq)]
pub struct Explanation {
    /// Texel coordinates of the triangle's corners.
    pub corners: [DVec2; 3],
    /// The ray in the triangle's prism, in order of t; empty where it is there more than once, or hardly.
    pub path: Vec<PathPoint>,
    /// The blocks: those whose boxes the ray meets in the order in which it does, then the others.
    pub blocks: Vec<BlockTold>,
    /// Where the ray first meets the surface.
    pub hit: Option<PathPoint>,
}

impl Prisms {
    /// What the exact march does with `ray` over base triangle `triangle`: the march's own functions, at the baseline SIMD level on every machine; a
    /// block's box is tested in the order in which the ray meets them. Without walls. `None` for a triangle that has no blocks (all of it is
    /// decided in f64), and with the uniform march. The ray must be [valid](Ray::is_valid).
    ///
    /// # Panics
    ///
    /// If there is no such triangle.
    pub fn explain(&self, triangle: u32, ray: &Ray) -> Option<Explanation> {
        let Parts::Exact(exact) = &self.parts else {
            return None;
        };
        let patch = self.surface.patch(triangle);
        let record = exact.record(triangle);
        let mut blocks: Vec<_> = exact
            .primitives_of(triangle)
            .filter_map(|index| match exact.primitive(index) {
                Primitive::Block(block) => Some((self.bounds(index).entry(ray), block)),
                Primitive::Whole(_) | Primitive::Walls(_) => None,
            })
            .collect();
        if blocks.is_empty() {
            return None;
        }
        let late = |entry: Option<f64>| entry.unwrap_or(f64::INFINITY);
        blocks.sort_by(|a, b| late(a.0).total_cmp(&late(b.0)));

        let mut ahead = *ray;
        let mut hit = None;
        let blocks = blocks.into_iter().map(|(entry, block)| {
            let fate = match entry {
                None => Fate::Missed,
                Some(t) if t > f64::from(ahead.tfar) => Fate::Behind,
                Some(_) => {
                    let ask = Ask {
                        surface: &self.surface,
                        heights: exact.heights(),
                        record,
                        block,
                        corners: None,
                        any: false,
                    };
                    let (told, found) = told::<Portable>(&ask, &ahead);
                    if let Some(found) = found {
                        ahead.tfar = found.t as f32;
                        hit = Some(found);
                    }
                    return told;
                }
            };
            let texels = block.texels(self.surface.map(), record);
            BlockTold {
                texels: [texels.low, texels.high],
                fate,
                parts: Vec::new(),
                leaves: Vec::new(),
            }
        });
        let blocks = blocks.collect();
        Some(Explanation {
            corners: patch.texels,
            path: path(&patch, record.offsets().map(f64::from), ray).unwrap_or_default(),
            blocks,
            hit: hit.map(|Found { t, u, v }| PathPoint {
                t,
                texel: patch.texel(u, v),
                height: patch.displacement(u, v) / patch.scale + patch.midlevel,
            }),
        })
    }
}

/// The ray over the map, where it is in the prism once.
fn path(patch: &Patch<'_>, range: [f64; 2], ray: &Ray) -> Option<Vec<PathPoint>> {
    /// Parts that it is given in.
    const PARTS: u32 = 256;
    type Q = <Portable as Lanes>::Quad;
    let frame = RayFrame::new(ray, axes(ray));
    let corners = Corners::<Q>::new(patch, frame.axes);
    let view = View::new(&corners, &frame, range[0].abs().max(range[1].abs()));
    let Cut::One(stretch) = view.cut(range) else {
        return None;
    };
    let curve = Curve::new(&view, &patch.texels, &stretch, &frame);
    let point = |k: u32| {
        let s = f64::from(k) / f64::from(PARTS);
        let ([x, y, ..], [t, u, v]) = (curve.at(s).0.to_array(), curve.seen(s));
        PathPoint {
            t,
            texel: DVec2::from(curve.texel_base) + DVec2::new(x, y),
            height: curve.w(s) * patch.normal(u, v).length() / patch.scale + patch.midlevel,
        }
    };
    Some((0..=PARTS).map(point).collect())
}
