//! Walls at closed seams ([`surface::Seams`](crate::surface::Seams)): a ray leaves or enters a prism exactly on its sides.
//!
//! Where a stretch of the ray's curve ends on side k, at w, the ray meets the wall there if it is on different sides of the
//! two heights that the wall goes between: g = w |N'| - D for the triangle's own D, and for the other. The march finds as
//! many crossings of S as the signs of g ask for at the ends of the stretch; so with the walls at its ends the number of
//! crossings in a prism has the parity of the *other* heights' signs, which the neighbour, or the base triangle, shares.
//!
//! This is a search of its own beside the march, and runs only for prisms with walls.

use super::Problem;
use super::pieces::{self, Line};
use crate::prism::PrismHit;
use crate::prism::curve::{Curve, End, Stretch, View};
use crate::prism::ray_frame::RayFrame;
use crate::prism::simd::{Lanes, Quad, Task};
use crate::surface::{DisplacedSurface, Ruled};

/// Looks for the first wall of a prism on the ray, or for any.
pub struct Walls<'a> {
    /// The prism, and what is asked.
    pub problem: &'a Problem<'a>,
    pub frame: &'a RayFrame,
    /// Whose walls.
    pub surface: &'a DisplacedSurface,
    /// The base triangle.
    pub prim: u32,
    /// Bit k: side k has a wall.
    pub sides: u32,
}

/// Where the ray passes a side.
struct Passage {
    side: u8,
    w: f64,
    t: f64,
    /// Barycentric coordinates of vertices 1 and 2.
    u: f64,
    v: f64,
}

impl<L: Lanes> Task<L> for Walls<'_> {
    type Output = Option<PrismHit>;

    #[inline(always)]
    fn run(self) -> Option<PrismHit> {
        let Problem { patch, offsets, .. } = *self.problem;
        let reach = offsets[0].abs().max(offsets[1].abs());
        let view = View::<L::Quad>::new(patch, self.frame, reach);
        let mut nearest = None;
        if pieces::is_edge_on(&view, offsets) {
            let (heights, count) = pieces::planes_that_hold(patch, self.frame, offsets);
            for &w in &heights[..count] {
                if let Some(line) = Line::new(patch, self.frame, w) {
                    self.meet(&passage(&line, 0), &mut nearest);
                    self.meet(&passage(&line, 1), &mut nearest);
                }
            }
            return nearest;
        }
        let stretches = view.stretches(offsets);
        for stretch in stretches.as_slice() {
            let ends = stretch.ends.map(|end| self.walled(end));
            if ends == [None; 2] {
                continue;
            }
            let curve = Curve::new(&view, patch, stretch, self.frame);
            for (end, side) in ends.into_iter().enumerate() {
                if let Some(side) = side {
                    let passage = self.end(&curve, &view, stretch, end, side);
                    self.meet(&passage, &mut nearest);
                }
            }
        }
        nearest
    }
}

impl Walls<'_> {
    fn walled(&self, end: End) -> Option<u8> {
        match end {
            End::Side(side) if self.sides >> side & 1 != 0 => Some(side),
            _ => None,
        }
    }

    /// The end of a stretch that is on `side`.
    #[inline(always)]
    fn end<Q: Quad>(
        &self,
        curve: &Curve<Q>,
        view: &View<Q>,
        stretch: &Stretch,
        end: usize,
        side: u8,
    ) -> Passage {
        let w = stretch.w[end];
        let patch = self.problem.patch;
        // Where A vanishes, the ray runs through the flat triangle at w.
        if pieces::is_flat(view, w)
            && let Some(line) = Line::new(patch, self.frame, w)
            && let Some(end) = line.sides.iter().position(|&of| of == side)
        {
            return passage(&line, end);
        }
        // The curve runs in the order of t, the stretch in that of w.
        let s = if curve.w[0] == w { 0.0 } else { 1.0 };
        let [_, _, u, v] = curve.at(s).0.to_array();
        Passage {
            side,
            w,
            t: curve.t(s),
            u,
            v,
        }
    }

    /// Keeps the wall that is passed, if it is one, is in the ray's interval, and is nearer.
    fn meet(&self, passage: &Passage, nearest: &mut Option<PrismHit>) {
        let &Passage { side, w, t, u, v } = passage;
        if self.sides >> side & 1 == 0 || !self.problem.accepts(t) {
            return;
        }
        let Some((index, wall)) = self.surface.wall_on(self.prim, side) else {
            return;
        };
        let ruled = Ruled::new(*self.problem.patch, wall);
        let place = ruled.place(u, v);
        let height = w * ruled.normal(place).length();
        let [other, own] = ruled.heights(place);
        // In units of the map's height, as the march has it.
        let is_above = |d: f64| (height - d) * self.problem.patch.scale > 0.0;
        if is_above(other) == is_above(own) {
            return;
        }
        let hit = PrismHit {
            prim: self.surface.mesh().triangles().len() as u32 + index,
            t: t as f32,
            u: place as f32,
            v: ((height - other) / (own - other)).clamp(0.0, 1.0) as f32,
            ng: ruled.outward(place, w, own > other).as_vec3(),
        };
        if nearest.is_none_or(|best| hit.is_before(&best)) {
            *nearest = Some(hit);
        }
    }
}

/// An end of a line through a flat triangle.
fn passage(line: &Line, end: usize) -> Passage {
    let depth = line.ends[end];
    Passage {
        side: line.sides[end],
        w: line.w,
        t: depth * line.per_depth,
        u: line.start[1] + depth * line.change[1],
        v: line.start[2] + depth * line.change[2],
    }
}
