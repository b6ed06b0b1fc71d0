//! What bounds arcs.
//!
//! **The bound.** For r = n/A on [0, 1], n and A quadratic: A >= A_min = min(A(0), A(1)) - max(a2, 0)/4;
//! |r'| <= R = max of the Bernstein coefficients of n'A - nA' over A_min^2; r'' A = n'' - a2'' r - 2 r'A', so
//! |r''|/2 <= M = (|n2 - a2 r(0)| + R (|a2| + max|A'|)) / A_min; a chord of length ds is left by at most M ds^2/4.
//! For h = w k with k = |N'(b(s))|, convex in b: |k'| <= K1 = |n1-n0| R_u + |n2-n0| R_v,
//! |k''|/2 <= K2 = |n1-n0| M_u + |n2-n0| M_v + K1^2/(2 k_min), so |h''|/2 <= |w| K2 + |dw| K1.
//! To these come the roundings of the f32 evaluation, at most 8 units of the sum of magnitudes that each value is made of,
//! and of the set-up.
//!
//! **The set-up.** [Seen](crate::prism::sight) corners are off by at most c along each axis, so sum b_i p_i is not 0 but e, |e| at
//! most c sum |b_i|. That moves b_i by e x (edge opposite) / A, at most 2c (X + Y) sum |b_i| / A with X and Y the largest |p| along
//! each axis; and as these movements add up to 0, sum b_i x_i by no more than max x_i - min x_i times that. On an arc sum |b_i| is
//! below 1.13. Beside that Q_i is off by q = u (4.5 X Y + 25 M), u = 2^-24: by products and sums of the corners, and, with M the
//! largest |Q| over the range of w, by what cuts out the arc; and sum b_i x_i by sum |x_i - x| q / A <= 2q (max x_i - min x_i) / A.
//! Where a ray grazes the prism A is small beside X Y, but not beside M.

use super::{Arcs, Rows3, Units};
use crate::prism::simd::Lanes;

/// An f32 value is within this many units in the last place of the magnitudes it was computed from.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// Eight arcs in registers.
pub struct Lanewise<L> {
    pub x: [L; 3],
    pub y: [L; 3],
    pub u: [L; 3],
    pub v: [L; 3],
    pub area: [L; 3],
    pub height: [L; 2],
    pub spread: [L; 3],
    pub time: [L; 4],
    pub w: [L; 2],
}

/// What the set-up of arcs left uncertain.
pub struct Uncertain<L> {
    /// Numerators of barycentrics: these are off by twice as much over A.
    pub area: L,
    /// Extents of a prism in texels, and in ray parameters.
    pub texels: L,
    pub time: L,
    /// Ray parameters beside that.
    pub time_off: L,
    /// Heights, for w.
    pub height: L,
}

impl<L: Lanes> Lanewise<L> {
    /// With their bounds: see the module's documentation.
    #[inline(always)]
    pub fn bounded(&self, units: &Units, uncertain: &Uncertain<L>) -> Arcs {
        let zero = L::splat(0.0);
        let [a0, a1, a2] = self.area;
        let end = a0 + a1 + a2;
        let least = a0.min(end) - a2.max(zero) * L::splat(0.25) - uncertain.area * L::splat(3.0);
        let inverse = L::splat(1.0) / least;
        // Of the bounds themselves: f32 is good for more than four digits here.
        let generous = L::splat(1.000_1);
        let shared = Shared {
            area: self.area,
            per_start: L::splat(1.0) / a0,
            inverse,
            squared: inverse * inverse * generous,
            steepest: a2.abs() + a1.abs().max((a1 + a2 + a2).abs()),
            magnitude: a0.abs() + a1.abs() + a2.abs(),
        };
        let (x, y) = (shared.bounds(self.x), shared.bounds(self.y));
        let (u, v) = (shared.bounds(self.u), shared.bounds(self.v));
        let inside_off = uncertain.area * inverse * L::splat(2.0);
        let reach = x.slope.max(y.slope);
        let rounding = x.rounding.max(y.rounding)
            + inside_off * uncertain.texels
            + reach * L::splat(f32::EPSILON);

        let [s01, s02, s12] = self.spread;
        let widest = s01.max(s02).max(s12);
        let (turn1, turn2) = (s01.sqrt(), s02.sqrt());
        // At least the largest 1/|N'|: |N'|^2 = 1 - sum b_i b_j spread_ij.
        let shortest = (L::splat(1.0) - widest * L::splat(1.0 / 3.0)).max(L::splat(1e-6));
        let stretch = L::splat(1.000_01) / shortest.sqrt();
        let turn = turn1.mul_add(u.slope, turn2 * v.slope);
        let turn_bend =
            turn1.mul_add(u.bend, turn2 * v.bend) + turn * turn * stretch * L::splat(0.5);
        let [h0, h1] = self.height;
        let highest = h0.abs().max((h0 + h1).abs());
        let height_bend = highest.mul_add(turn_bend, h1.abs() * turn);
        let highest = highest * stretch;
        let unsure = turn1.mul_add(u.rounding + inside_off, turn2 * (v.rounding + inside_off));
        let height_rounding = highest.mul_add(
            unsure,
            (highest + L::splat(units.midlevel.abs())) * L::splat(ROUNDING),
        ) + uncertain.height * stretch;

        let [c0, c1, c2, c3] = self.time;
        let last = c0 + c1 + c2 + c3;
        let magnitude = c0.abs() + c1.abs() + c2.abs() + c3.abs();
        let time_off = magnitude * inverse * L::splat(8.0 * ROUNDING)
            + inside_off * uncertain.time
            + uncertain.time_off;
        Arcs {
            x: stored(self.x),
            y: stored(self.y),
            u: stored(self.u),
            v: stored(self.v),
            area: stored(self.area),
            w: [self.w[0].to_array(), self.w[1].to_array()],
            height: [h0.to_array(), h1.to_array()],
            spread: stored(self.spread),
            time: [c0.to_array(), c1.to_array(), c2.to_array(), c3.to_array()],
            ends: [(c0 * shared.per_start).to_array(), (last / end).to_array()],
            time_off: time_off.to_array(),
            inside_off: (inside_off + L::splat(4.0 * ROUNDING)).to_array(),
            reach: reach.to_array(),
            bend: (x.bend.max(y.bend) * L::splat(0.25)).to_array(),
            height_bend: (height_bend * L::splat(0.25 * 1.000_1)).to_array(),
            rounding: rounding.to_array(),
            height_rounding: height_rounding.to_array(),
        }
    }
}

/// What the ratios over one A have in common.
struct Shared<L> {
    area: [L; 3],
    /// 1 / A(0), 1 / A_min, and the square of that.
    per_start: L,
    inverse: L,
    squared: L,
    /// |a2| + max|A'|.
    steepest: L,
    magnitude: L,
}

/// Bounds of a ratio.
struct Bounds<L> {
    /// |r'|.
    slope: L,
    /// |r''| / 2.
    bend: L,
    rounding: L,
}

impl<L: Lanes> Shared<L> {
    #[inline(always)]
    fn bounds(&self, [n0, n1, n2]: [L; 3]) -> Bounds<L> {
        let [a0, a1, a2] = self.area;
        let d1 = n0.neg_mul_add(a1, n1 * a0);
        let d2 = n0.neg_mul_add(a2, n2 * a0);
        let middle = d1 + d2;
        let last = middle + d2 + n1.neg_mul_add(a2, n2 * a1);
        let slope = d1.abs().max(middle.abs()).max(last.abs()) * self.squared;
        let start = n0 * self.per_start;
        let bend = slope.mul_add(self.steepest, start.neg_mul_add(a2, n2).abs()) * self.inverse;
        let largest = (start.abs() + slope) * self.magnitude;
        let magnitude = n0.abs() + n1.abs() + n2.abs() + largest;
        Bounds {
            slope,
            bend,
            rounding: magnitude * self.inverse * L::splat(ROUNDING),
        }
    }
}

#[inline(always)]
fn stored<L: Lanes>([a, b, c]: [L; 3]) -> Rows3 {
    [a.to_array(), b.to_array(), c.to_array()]
}
