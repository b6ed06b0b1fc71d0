//! Eight prisms of a cluster seen along one ray, in f32 lanes: which of them the ray may meet, and along which part of
//! their ranges of w.
//!
//! Seen along the ray a prism is the triangle with corners p_i(w) = a_i + w e_i for every w of its range, and the ray
//! is the origin. Side i of that triangle has the area Q_i(w) = p_i+1(w) x p_i+2(w), a quadratic in w that its three
//! Bernstein coefficients over the range enclose. The ray misses the prism where one side's area is negative on all of
//! the range and another's (or the same) positive on all of it: whichever way the triangle turns, the ray is outside.
//!
//! **Never too strict.** Coordinates are relative to the [anchor](Anchored): a projected coordinate is the difference of two
//! f32 numbers and a product with the shear, each rounded once. With u = 2^-24, R the largest projected coordinate, d
//! the largest depth from the anchor, m the largest shear (at most 1) and W the largest |w|, it is off by at most u (3R + 4md) for a, 2.5u W for
//! w e and u R for their sum: c = 4u (R + md) + 2.5u W. A cross product of two is off by 4 R c and its own roundings of
//! less than 6u R^2. The slack is the sum. Depths are off by at most u (2d + W) at both ends of the range, and by 6u W more between
//! them, where w is rounded.

use super::cluster::Cluster;
use super::ray_frame::Anchored;
use super::simd::Lanes;

/// A cluster as a ray sees it.
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
    /// How far a depth is, at any w, and w at most.
    pub depth_off: L,
    pub reach: L,
    /// Depths between which all of a prism lies.
    pub nearest: L,
    pub farthest: L,
}

impl<L: Lanes> Sight<L> {
    /// The cluster seen along a ray, and the lanes whose prisms the ray may meet.
    #[inline(always)]
    pub fn new(cluster: &Cluster, ray: &Anchored) -> (Self, u32) {
        let zero = L::splat(0.0);
        let (vertices, normals, offsets) = cluster.lanes::<L>(ray.axes);
        let [low, high] = offsets;
        // Projected corners at both ends of the range.
        let mut at_low = [[zero; 2]; 3];
        let mut at_high = [[zero; 2]; 3];
        let (mut depths, mut slopes) = ([zero; 3], [zero; 3]);
        let (mut widest, mut deepest) = (zero, zero);
        let (mut nearest, mut farthest) = (L::splat(f32::INFINITY), L::splat(f32::NEG_INFINITY));
        for k in 0..3 {
            let depth = vertices[k][2] - L::splat(ray.depth);
            let slope = normals[k][2];
            deepest = deepest.max(depth.abs());
            let (d0, d1) = (low.mul_add(slope, depth), high.mul_add(slope, depth));
            nearest = nearest.min(d0.min(d1));
            farthest = farthest.max(d0.max(d1));
            for axis in 0..2 {
                let shear = L::splat(ray.shear[axis]);
                let from_anchor =
                    vertices[k][axis] - L::splat(ray.near[axis]) - L::splat(ray.rest[axis]);
                let a = depth.neg_mul_add(shear, from_anchor);
                let e = slope.neg_mul_add(shear, normals[k][axis]);
                let (p, q) = (low.mul_add(e, a), high.mul_add(e, a));
                widest = widest.max(p.abs().max(q.abs())).max(a.abs());
                (at_low[k][axis], at_high[k][axis]) = (p, q);
            }
            (depths[k], slopes[k]) = (depth, slope);
        }
        let reach = low.abs().max(high.abs());
        let unit = L::splat(f32::EPSILON);
        let shear = L::splat(ray.shear[0].abs().max(ray.shear[1].abs()));
        let lateral = shear.mul_add(deepest, widest) * L::splat(2.0);
        let coordinate = reach.mul_add(L::splat(1.25), lateral) * unit;
        let depth_off = reach.mul_add(L::splat(3.5), deepest) * unit;
        let off = widest * (coordinate * L::splat(4.5) + widest * unit * L::splat(3.0));
        let areas = [
            bernstein([at_low[1], at_low[2]], [at_high[1], at_high[2]]),
            bernstein([at_low[2], at_low[0]], [at_high[2], at_high[0]]),
            bernstein([at_low[0], at_low[1]], [at_high[0], at_high[1]]),
        ];
        let inside = most(areas[0]).min(most(areas[1])).min(most(areas[2]));
        let outside = least(areas[0]).max(least(areas[1])).max(least(areas[2]));
        let counter_clockwise = !(inside + off).sign_mask();
        let clockwise = !(off - outside).sign_mask();

        let per_depth = L::splat(ray.per_depth);
        let (t0, t1) = (nearest * per_depth, farthest * per_depth);
        let slack = depth_off * per_depth.abs() * L::splat(2.0);
        let [tnear, tfar] = ray.interval;
        let too_early = (t0.max(t1) + slack - L::splat(tnear)).sign_mask();
        let too_late = (L::splat(tfar) - (t0.min(t1) - slack)).sign_mask();
        let met = (counter_clockwise | clockwise) & !too_early & !too_late;
        let sight = Self {
            offsets,
            depths,
            slopes,
            areas,
            off,
            depth_off,
            reach,
            nearest,
            farthest,
        };
        (sight, met)
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
