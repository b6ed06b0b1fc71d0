//! Prisms seen along rays, in f32 lanes: eight of a cluster along one ray, or one along eight. Which of them the ray may
//! meet, and along which part of their ranges of w.
//!
//! Seen along the ray a prism is the triangle with corners p_i(w) = a_i + w e_i for every w of its range, and the ray
//! is the origin. Side i of that triangle has the area Q_i(w) = p_i+1(w) x p_i+2(w), a quadratic in w that its three
//! Bernstein coefficients over the range enclose. The ray misses the prism where one side's area is negative on all of
//! the range and another's (or the same) positive on all of it: whichever way the triangle turns, the ray is outside.
//!
//! **Never too strict.** Coordinates are relative to the [anchor](Anchored): a projected coordinate is the difference of two
//! f32 numbers and a product with the shear, each rounded once. With u = 2^-24, R the largest projected coordinate, d
//! the largest depth from the anchor, m the largest shear (at most 1) and W the largest |w|, it is off by at most u (3R + 5md) for a, 5u W for
//! w e and u R for their sum: c = u (4R + 5md + 5W). With X and Y the largest projected coordinates along each axis, a cross product of two
//! is off by 2c (X + Y) and its own roundings of less than 6.5u X Y. The slack is the sum. Depths are off by at most u (2d + W)
//! at both ends of the range, and by 6u W more between them, where w is rounded.

use super::cluster::PrismLanes;
use super::ray_frame::{Beam, RayLanes};
use super::simd::Lanes;

/// Prisms as rays see them.
pub struct Sight<L> {
    /// Smallest and largest w.
    pub offsets: [L; 2],
    /// Depth of every corner from the anchor, and of its normal, along the main axis.
    pub depths: [L; 3],
    pub slopes: [L; 3],
    /// By side: Bernstein coefficients of its area over the range of w.
    pub areas: [[L; 3]; 3],
    /// How far these are off at most.
    pub off: L,
    /// The largest projected coordinate along each axis, and how far any is off at most.
    pub widest: [L; 2],
    pub coordinate_off: L,
    /// How far a depth is, at any w, and w at most.
    pub depth_off: L,
    pub reach: L,
    /// Depths between which all of a prism lies.
    pub nearest: L,
    pub farthest: L,
}

impl<L: Lanes> Sight<L> {
    /// The prisms seen along the rays, each lane's along its, and the lanes whose prism the ray may meet.
    #[inline(always)]
    pub fn new(prisms: &PrismLanes<L>, ray: &RayLanes<L>) -> (Self, u32) {
        let seen = Projection::new(prisms, ray);
        let areas = seen.areas();
        let met = seen.met(&areas, seen.off);
        let Projection {
            depths,
            slopes,
            widest,
            coordinate_off,
            off,
            depth_off,
            reach,
            nearest,
            farthest,
            ..
        } = seen;
        let (t0, t1) = (nearest * ray.per_depth, farthest * ray.per_depth);
        let slack = depth_off * ray.per_depth.abs() * L::splat(2.0);
        let [tnear, tfar] = ray.interval;
        let too_early = (t0.max(t1) + slack - tnear).sign_mask();
        let too_late = (tfar - (t0.min(t1) - slack)).sign_mask();
        let sight = Self {
            offsets: prisms.offsets,
            depths,
            slopes,
            areas,
            off,
            widest,
            coordinate_off,
            depth_off,
            reach,
            nearest,
            farthest,
        };
        (sight, met & !too_early & !too_late)
    }
}

/// The lanes whose prisms any ray of a beam may meet, and depths from the anchor between which these lie.
#[inline(always)]
pub fn met_by_beam<L: Lanes>(prisms: &PrismLanes<L>, beam: &Beam) -> (u32, [L; 2]) {
    let seen = Projection::new(prisms, &beam.axis());
    // Another ray sees a corner at depth z moved by d + z e, |d| and |e| at most the beam's spread. Then p x q changes by
    // d x (q - p) where both are moved by as much, and by less than |p| |z' - z| |e| where not.
    let deepest = seen.nearest.abs().max(seen.farthest.abs());
    let [near_x, near_y] = [L::splat(beam.near_spread[0]), L::splat(beam.near_spread[1])];
    let [turn_x, turn_y] = [
        L::splat(beam.shear_spread[0]),
        L::splat(beam.shear_spread[1]),
    ];
    let (moved_x, moved_y) = (
        deepest.mul_add(turn_x, near_x),
        deepest.mul_add(turn_y, near_y),
    );
    let farthest_off = seen.widest[0].max(seen.widest[1]) + moved_x.max(moved_y);
    let turned = farthest_off * (seen.farthest - seen.nearest) * (turn_x + turn_y);
    let slack = moved_x.mul_add(seen.extent(1), moved_y.mul_add(seen.extent(0), turned));
    let off = seen.off + slack * L::splat(1.001);
    let met = seen.met(&seen.areas(), off);
    (met, [seen.nearest, seen.farthest])
}

/// Prisms projected along rays.
struct Projection<L> {
    /// Projected corners at both ends of the range of w.
    at_low: [[L; 2]; 3],
    at_high: [[L; 2]; 3],
    depths: [L; 3],
    slopes: [L; 3],
    /// The largest projected coordinates, and how far any is off.
    widest: [L; 2],
    coordinate_off: L,
    off: L,
    depth_off: L,
    reach: L,
    nearest: L,
    farthest: L,
}

impl<L: Lanes> Projection<L> {
    #[inline(always)]
    fn new(prisms: &PrismLanes<L>, ray: &RayLanes<L>) -> Self {
        let zero = L::splat(0.0);
        let PrismLanes {
            vertices, normals, ..
        } = prisms;
        let [low, high] = prisms.offsets;
        let mut at_low = [[zero; 2]; 3];
        let mut at_high = [[zero; 2]; 3];
        let (mut depths, mut slopes) = ([zero; 3], [zero; 3]);
        let (mut widest, mut deepest) = ([zero; 2], zero);
        let (mut nearest, mut farthest) = (L::splat(f32::INFINITY), L::splat(f32::NEG_INFINITY));
        for k in 0..3 {
            let depth = vertices[k][2] - ray.depth;
            let slope = normals[k][2];
            deepest = deepest.max(depth.abs());
            let (d0, d1) = (low.mul_add(slope, depth), high.mul_add(slope, depth));
            nearest = nearest.min(d0.min(d1));
            farthest = farthest.max(d0.max(d1));
            for axis in 0..2 {
                let shear = ray.shear[axis];
                let from_anchor = vertices[k][axis] - ray.near[axis] - ray.rest[axis];
                let a = depth.neg_mul_add(shear, from_anchor);
                let e = slope.neg_mul_add(shear, normals[k][axis]);
                let (p, q) = (low.mul_add(e, a), high.mul_add(e, a));
                widest[axis] = widest[axis].max(p.abs().max(q.abs())).max(a.abs());
                (at_low[k][axis], at_high[k][axis]) = (p, q);
            }
            (depths[k], slopes[k]) = (depth, slope);
        }
        let reach = low.abs().max(high.abs());
        let unit = L::splat(f32::EPSILON);
        let shear = ray.shear[0].abs().max(ray.shear[1].abs());
        let [x, y] = widest;
        let sheared = shear.mul_add(deepest, reach) * L::splat(2.5 * 1.001);
        let coordinate_off = x.max(y).mul_add(L::splat(2.0 * 1.001), sheared) * unit;
        let rounding = x * y * unit * L::splat(3.25 * 1.001);
        Self {
            at_low,
            at_high,
            depths,
            slopes,
            widest,
            coordinate_off,
            off: (x + y).mul_add(coordinate_off * L::splat(2.0 * 1.001), rounding),
            depth_off: reach.mul_add(L::splat(3.5), deepest) * unit,
            reach,
            nearest,
            farthest,
        }
    }

    #[inline(always)]
    fn areas(&self) -> [[L; 3]; 3] {
        let [l0, l1, l2] = self.at_low;
        let [h0, h1, h2] = self.at_high;
        [
            bernstein([l1, l2], [h1, h2]),
            bernstein([l2, l0], [h2, h0]),
            bernstein([l0, l1], [h0, h1]),
        ]
    }

    /// How far apart corners are along an axis, at most.
    #[inline(always)]
    fn extent(&self, axis: usize) -> L {
        let [l0, l1, l2] = self.at_low;
        let [h0, h1, h2] = self.at_high;
        let (low, high) = (
            [l0[axis], l1[axis], l2[axis]],
            [h0[axis], h1[axis], h2[axis]],
        );
        most(low).max(most(high)) - least(low).min(least(high))
    }

    /// The lanes that are not surely missed, where areas are off by no more than `off`.
    #[inline(always)]
    fn met(&self, areas: &[[L; 3]; 3], off: L) -> u32 {
        let inside = most(areas[0]).min(most(areas[1])).min(most(areas[2]));
        let outside = least(areas[0]).max(least(areas[1])).max(least(areas[2]));
        let counter_clockwise = !(inside + off).sign_mask();
        let clockwise = !(off - outside).sign_mask();
        counter_clockwise | clockwise
    }
}

/// Coefficients of p(w) x q(w), p and q linear, over the range between both ends.
#[inline(always)]
fn bernstein<L: Lanes>([p0, q0]: [[L; 2]; 2], [p1, q1]: [[L; 2]; 2]) -> [L; 3] {
    // Twice the middle one.
    let middle = p1[1].neg_mul_add(q0[0], p1[0].mul_add(q0[1], cross(p0, q1)));
    [cross(p0, q0), middle * L::splat(0.5), cross(p1, q1)]
}

#[inline(always)]
fn most<L: Lanes>([a, b, c]: [L; 3]) -> L {
    a.max(b).max(c)
}

#[inline(always)]
fn least<L: Lanes>([a, b, c]: [L; 3]) -> L {
    a.min(b).min(c)
}

#[inline(always)]
fn cross<L: Lanes>(p: [L; 2], q: [L; 2]) -> L {
    p[1].neg_mul_add(q[0], p[0] * q[1])
}
