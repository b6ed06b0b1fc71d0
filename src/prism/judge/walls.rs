//! Walls at closed seams ([`surface::Seams`](crate::surface::Seams)): a ray leaves or enters a prism exactly on its sides.
//!
//! Where a stretch of the ray's curve ends on side k, at w, the ray meets the wall there if it is on different sides of the
//! two heights that the wall goes between: g = w |N'| - D for the triangle's own D, and for the other. The judge finds as
//! many crossings of S as the signs of g ask for at the ends of the stretch; so with the walls at its ends the number of
//! crossings in a prism has the parity of the *other* heights' signs, which the neighbour, or the base triangle, shares.
//!
//! This is a search of its own beside that for S, and runs only for triangles with walls.

use super::Question;
use super::pieces::{self, Line};
use crate::prism::PrismHit;
use crate::prism::curve::{Curve, Cut, End, Stretch, View};
use crate::prism::simd::{Lanes, Quad, Task};
use crate::surface::{DisplacedSurface, Ruled};

/// The first wall of a base triangle on the ray, or any. Bit k of `sides`: side k has a wall.
#[inline(always)]
pub fn walls<L: Lanes>(
    question: &Question<'_>,
    surface: &DisplacedSurface,
    prim: u32,
    sides: u32,
) -> Option<PrismHit> {
    L::outline(Walls {
        question,
        surface,
        prim,
        sides,
    })
}

struct Walls<'a> {
    question: &'a Question<'a>,
    surface: &'a DisplacedSurface,
    prim: u32,
    sides: u32,
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
        let range = self.question.range;
        let view = self.question.view::<L::Quad>();
        let mut nearest = None;
        if pieces::is_edge_on(&view, range) {
            self.edge_on(&mut nearest);
            return nearest;
        }
        match view.cut(range) {
            Cut::One(stretch) => self.along(&view, &stretch, &mut nearest),
            Cut::None => {}
            Cut::Many => {
                for stretch in view.stretches(range).as_slice() {
                    self.along(&view, stretch, &mut nearest);
                }
            }
        }
        nearest
    }
}

impl Walls<'_> {
    /// Both ends of a stretch.
    #[inline(always)]
    fn along<Q: Quad>(&self, view: &View<Q>, stretch: &Stretch, nearest: &mut Option<PrismHit>) {
        let ends = [self.walled(stretch.ends[0]), self.walled(stretch.ends[1])];
        if ends == [None; 2] {
            return;
        }
        let Question { patch, frame, .. } = *self.question;
        let curve = Curve::new(view, &patch.texels, stretch, frame);
        for (end, side) in ends.into_iter().enumerate() {
            if let Some(side) = side {
                self.meet(&self.end(&curve, view, stretch, end, side), nearest);
            }
        }
    }

    /// Both ends of the lines through the flat triangles that hold the ray.
    fn edge_on(&self, nearest: &mut Option<PrismHit>) {
        let Question {
            patch,
            range,
            frame,
            ..
        } = *self.question;
        let (heights, count) = pieces::planes_that_hold(patch, frame, range);
        for &w in &heights[..count] {
            if let Some(line) = Line::new(patch, frame, w) {
                self.meet(&passage(&line, 0), nearest);
                self.meet(&passage(&line, 1), nearest);
            }
        }
    }

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
        let Question { patch, frame, .. } = *self.question;
        // Where A vanishes, the ray runs through the flat triangle at w.
        if pieces::is_flat(view, w)
            && let Some(line) = Line::new(patch, frame, w)
            && let Some(end) = line.sides.iter().position(|&of| of == side)
        {
            return passage(&line, end);
        }
        // The curve runs in the order of t, the stretch in that of w.
        let at = usize::from(curve.w[0] != w);
        let [_, _, u, v] = curve.at(at as f64).0.to_array();
        Passage {
            side,
            w,
            t: curve.ends()[at],
            u,
            v,
        }
    }

    /// Keeps the wall that is passed, if it is one, is in the ray's interval, and is nearer.
    fn meet(&self, passage: &Passage, nearest: &mut Option<PrismHit>) {
        let &Passage { side, w, t, u, v } = passage;
        let Question { patch, .. } = *self.question;
        if self.sides >> side & 1 == 0 || !self.question.accepts(t) {
            return;
        }
        let Some((index, wall)) = self.surface.wall_on(self.prim, side) else {
            return;
        };
        let ruled = Ruled::new(*patch, wall);
        let place = ruled.place(u, v);
        let height = w * ruled.normal(place).length();
        let [other, own] = ruled.heights(place);
        // In units of the map's height, as elsewhere.
        let is_above = |d: f64| (height - d) * patch.scale > 0.0;
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
