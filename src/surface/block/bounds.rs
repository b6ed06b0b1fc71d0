//! Boxes of blocks, also of such that move.
//!
//! A backend that knows motion, as Embree, has a box per primitive and time step and takes the linear interpolation of both boxes of a
//! segment at the times between. Here f goes from 0 to 1 over a segment, and x^k, k = 0 and 1, is what x is at its ends. At a place b that
//! stays, n_i is the unit vector along l_i = (1-f) n_i^0 + f n_i^1. For any c > 0, N' = sum b_i n_i is c M with
//!
//! ```text
//! M = L + E,   L = sum b_i l_i = (1-f) N'^0 + f N'^1,   E = sum b_i (1/c - |l_i|) n_i
//! ```
//!
//! With 1/c midway between the least and the largest |l_i|, |E| is at most half their difference. |l_i|^2 = 1 - f (1-f) |n_i^1 - n_i^0|^2, so
//! the difference is largest at f = 1/2: twice `off`, of second order in how far the normals turn, and nothing where all turn by the
//! same angle. L is in the hull of N' at the polygon's corners at both ends, the m_j below: none of them is a unit vector. So |M| is at
//! most the largest |m_j| and `off`, and at least what any direction has of it: the least m_j . e, less `off`. With e along the mean of the
//! m_j that is short by the second order of how far they spread.
//!
//! A coordinate a of S = P + D M/|M| is then between two bounds at each end of the segment, each linear in between:
//!
//! - S = P + w L + w E where w = D/|M| is in one interval for all of the segment. P_a + w L_a is linear in f, and at both ends linear in b and
//!   in w: between its least and its largest value at the polygon's corners and the ends of the interval. |w| `off` is added.
//! - M_a is within `off` of the interval of the m_j,a, which makes an interval of M_a/|M|, within [-1, 1], and with that of D one of
//!   D M_a/|M|; it is added to the least and the largest P_a at either end. This one is looser by how much the normals spread, but good for
//!   any normals.
//!
//! Of each coordinate and side the one is taken that is tighter in the middle of the segment, the same at both ends. A step's box is the union
//! of those of the segments that it ends. A surface that stands is a segment with the same at both ends.

use glam::DVec3;

use super::{Polygon, TexelBox};
use crate::ray::Aabb;
use crate::surface::{MovingSurface, Patch};

/// By how much N' may be off its definition where vertex normals are rounded to f32, at steps or between.
const NORMALS: f64 = 1e-6;

/// The same of vertices, of the largest coordinate.
const VERTICES: f64 = 1e-7;

/// The least and the largest.
type Interval = [f64; 2];

impl MovingSurface {
    /// A box for the part of S over a base triangle where texel coordinates are in `block` and D is in `range`, at a time step. Between two
    /// steps that part is in the linear interpolation of their boxes. `None` at all steps where the triangle has nothing there.
    ///
    /// # Panics
    ///
    /// If there is no such triangle or step.
    pub(crate) fn block_bounds(
        &self,
        prim: u32,
        block: &TexelBox,
        range: [f64; 2],
        step: usize,
    ) -> Option<Aabb> {
        let last = self.time_steps() - 1;
        let at = |step| self.surface().patch_over(prim, self.corners_of(step, prim));
        let here = at(step);
        let polygon = Polygon::of(&here, &block.widened(here.texels));
        if polygon.is_empty() {
            return None;
        }
        let before = step.checked_sub(1).map(at);
        let after = (step < last).then(|| at(step + 1));
        // Ends in their order: what is chosen is the same, to the bit, seen from either.
        let ending = before.map(|before| at_ends(&polygon, [&before, &here], range)[1]);
        let starting = at_ends(&polygon, [&here, after.as_ref().unwrap_or(&here)], range)[0];
        Some(ending.map_or(starting, |ending| ending.union(starting)))
    }
}

/// The boxes at both ends of a segment.
fn at_ends(polygon: &Polygon, ends: [&Patch<'_>; 2], range: Interval) -> [Aabb; 2] {
    let normals = Normals::new(polygon, ends);
    let joint = ends.map(|patch| normals.with_positions(polygon, patch, range));
    let apart = ends.map(|patch| normals.beside_positions(polygon, patch, range));
    let sum = |boxes: &[[DVec3; 2]; 2], side: usize| boxes[0][side] + boxes[1][side];
    // Not where an end of the joint ones is infinite, or no number.
    let low_is_joint = sum(&joint, 0).cmpgt(sum(&apart, 0));
    let high_is_joint = sum(&joint, 1).cmplt(sum(&apart, 1));
    [0, 1].map(|end| {
        let (joint, apart) = (joint[end], apart[end]);
        let [a, b, c] = ends[end].vertices.map(DVec3::abs);
        let slack = VERTICES * a.max(b).max(c).max_element();
        let low = DVec3::select(low_is_joint, joint[0], apart[0]) - slack;
        let high = DVec3::select(high_is_joint, joint[1], apart[1]) + slack;
        Aabb {
            min: low.as_vec3().map(f32::next_down),
            max: high.as_vec3().map(f32::next_up),
        }
    })
}

/// What is known of M over a segment.
struct Normals {
    off: f64,
    /// M, by axis.
    along: [DVec3; 2],
    /// 1/|M|.
    inverse_length: Interval,
}

impl Normals {
    fn new(polygon: &Polygon, ends: [&Patch<'_>; 2]) -> Self {
        let normals = || {
            let of = |patch| {
                polygon
                    .places()
                    .map(move |b| Patch::normal(patch, b.x, b.y))
            };
            ends.into_iter().flat_map(of)
        };
        let off = off(ends);
        let towards = normals().sum::<DVec3>().normalize_or_zero();
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let [low, high] = normals().fold(none, including);
        let least = normals().fold(f64::INFINITY, |least, m| least.min(m.dot(towards))) - off;
        let most = normals().fold(0.0, |most: f64, m| most.max(m.length())) + off;
        let longest = if least > Patch::LEAST_NORMAL {
            least.recip()
        } else {
            f64::MAX
        };
        Self {
            off,
            along: [low - off, high + off],
            inverse_length: [most.recip(), longest],
        }
    }

    /// Where x/|M| may lie for x in an interval.
    fn over_length(&self, [low, high]: Interval) -> Interval {
        let [short, long] = self.inverse_length;
        [
            low * if low < 0.0 { long } else { short },
            high * if high > 0.0 { long } else { short },
        ]
    }

    /// The bounds of P + w M at an end of the segment.
    fn with_positions(&self, polygon: &Polygon, patch: &Patch<'_>, range: Interval) -> [DVec3; 2] {
        let offsets = self.over_length(range);
        let points = polygon.places().flat_map(|b| {
            let (p, m) = (patch.base(b.x, b.y), patch.normal(b.x, b.y));
            offsets.map(|w| p + w * m)
        });
        let [low, high] = points.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], including);
        let reach = self.off * offsets[0].abs().max(offsets[1].abs());
        [low - reach, high + reach]
    }

    /// Those of P with the interval of D M/|M|.
    fn beside_positions(
        &self,
        polygon: &Polygon,
        patch: &Patch<'_>,
        range: Interval,
    ) -> [DVec3; 2] {
        let points = polygon.places().map(|b| patch.base(b.x, b.y));
        let mut bounds = points.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], including);
        for axis in 0..3 {
            let unit = self.over_length(self.along.map(|m| m[axis]));
            let unit = unit.map(|x| x.clamp(-1.0, 1.0));
            let products = range.map(|d| unit.map(|n| d * n));
            let [a, b, c, d] = [
                products[0][0],
                products[0][1],
                products[1][0],
                products[1][1],
            ];
            bounds[0][axis] += a.min(b).min(c.min(d));
            bounds[1][axis] += a.max(b).max(c.max(d));
        }
        bounds
    }
}

fn including([low, high]: [DVec3; 2], p: DVec3) -> [DVec3; 2] {
    [low.min(p), high.max(p)]
}

/// The most that |E| is over a segment, with what rounding adds.
fn off([before, after]: [&Patch<'_>; 2]) -> f64 {
    // |l_i| at f = 1/2.
    let [a, b, c] = [0, 1, 2].map(|i| {
        let turned = before.normals[i].distance_squared(after.normals[i]);
        (1.0 - 0.25 * turned).max(0.0).sqrt()
    });
    0.5 * (a.max(b).max(c) - a.min(b).min(c)) + NORMALS
}
