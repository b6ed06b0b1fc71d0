//! What the exact march does with one ray over one base triangle: for figures, for teaching, for whoever wonders.

use glam::DVec2;

use super::block::{Ask, told};
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

/// What became of a block, a part or a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// The ray surely passes it by, or it is surely outside the triangle or the ray's interval.
    Missed,
    /// The march looked into it.
    Entered,
    /// All of it was decided in f64.
    Judged,
    /// It begins behind the hit.
    Behind,
}

/// What f32 says of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellFate {
    /// The ray surely passes it by, or it is surely outside the triangle or the ray's interval.
    Missed,
    /// The ray surely meets it once, if it is inside the triangle there.
    Hit,
    /// Decided in f64.
    Judged,
}

/// A part of a block (16x8 cells), or a leaf (8x4): held against the ray by its range of heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartTold {
    /// Lowest and highest texel coordinates.
    pub texels: [DVec2; 2],
    /// The smallest and the largest height of the map there.
    pub heights: [f64; 2],
    /// What became of it.
    pub fate: Fate,
}

/// A cell whose widened box holds the ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellTold {
    /// Across and up, from the leaf's first cell.
    pub cell: [usize; 2],
    /// What became of it, in the ray's interval as it was when its leaf was begun.
    pub fate: CellFate,
}

/// A leaf.
#[derive(Clone, Debug, PartialEq)]
pub struct LeafTold {
    /// Where it is.
    pub part: PartTold,
    /// If it was entered: its displaced texels as the ray sees them, five rows of nine. World units across the ray, which is at (0, 0); N' in the
    /// middle of the block is along the first axis.
    pub vertices: Vec<DVec2>,
    /// If it was entered: the cells whose widened boxes hold the ray. All others are missed.
    pub cells: Vec<CellTold>,
}

impl LeafTold {
    pub(super) fn unseen(part: PartTold) -> Self {
        Self {
            part,
            vertices: Vec::new(),
            cells: Vec::new(),
        }
    }
}

/// A block of the base triangle.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockTold {
    /// Lowest and highest texel coordinates.
    pub texels: [DVec2; 2],
    /// What became of it.
    pub fate: Fate,
    /// If it was entered: its parts.
    pub parts: Vec<PartTold>,
    /// The leaves of the parts that were entered: missed ones first, then the others in the order in which they were taken.
    pub leaves: Vec<LeafTold>,
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
