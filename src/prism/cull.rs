//! Which prisms a ray may meet at all: eight rays against one prism, or one ray against eight, in f32 lanes.
//!
//! Seen along the ray a prism is the triangle with corners p_i(w) = a_i + w e_i for every w of its range, and the ray
//! is the origin. Side i of that triangle has the area Q_i(w) = p_i+1(w) x p_i+2(w), a quadratic in w that its three
//! Bernstein coefficients over the range enclose. The ray misses the prism where one side's area is negative on all of
//! the range and another's (or the same) positive on all of it: whichever way the triangle turns, the ray is outside.
//!
//! **Never too strict.** Differences of the inputs are rounded once each (the inputs are exact), so a projected coordinate is
//! off by at most 6 u (depth + R + ...) with u = 2^-23, R the largest projected coordinate; a cross product of two by four
//! times R times that, and its own two roundings. The slack below is that sum, rounded up.

use super::ray_frame::RayLanes;
use super::simd::Lanes;

/// Eight (ray, prism) pairs.
pub struct Pairs<L> {
    /// Corner k's coordinates along the ray's two lateral axes and its main axis.
    pub vertices: [[L; 3]; 3],
    /// Corner k's normal, the same way.
    pub normals: [[L; 3]; 3],
    /// Smallest and largest w.
    pub offsets: [L; 2],
    /// The ray, along the same axes.
    pub ray: RayLanes<L>,
}

impl<L: Lanes> Pairs<L> {
    /// Bit k: whether pair k may meet.
    #[inline(always)]
    pub fn may_meet(&self) -> u32 {
        let zero = L::splat(0.0);
        let [low, high] = self.offsets;
        let reach_w = low.abs().max(high.abs());
        // Projected corners at both ends of the range, and how far they are along the ray.
        let mut at_low = [[zero; 2]; 3];
        let mut at_high = [[zero; 2]; 3];
        let (mut widest, mut deepest) = (zero, zero);
        let (mut nearest, mut farthest) = (L::splat(f32::INFINITY), L::splat(f32::NEG_INFINITY));
        for k in 0..3 {
            let depth = self.vertices[k][2] - self.ray.origin[2];
            let slope = self.normals[k][2];
            deepest = deepest.max(depth.abs());
            let (d0, d1) = (low.mul_add(slope, depth), high.mul_add(slope, depth));
            nearest = nearest.min(d0.min(d1));
            farthest = farthest.max(d0.max(d1));
            for axis in 0..2 {
                let shear = zero - self.ray.shear[axis];
                let a = depth.mul_add(shear, self.vertices[k][axis] - self.ray.origin[axis]);
                let e = slope.mul_add(shear, self.normals[k][axis]);
                widest = widest.max(a.abs());
                at_low[k][axis] = low.mul_add(e, a);
                at_high[k][axis] = high.mul_add(e, a);
            }
        }
        // |e| <= 2, since |n| = 1 and |shear| <= 1.
        let widest = reach_w.mul_add(L::splat(2.0), widest);
        let unit = L::splat(f32::EPSILON);
        let coordinate = (deepest + widest + reach_w) * unit * L::splat(4.0);
        let slack = widest * (coordinate * L::splat(5.0) + widest * unit * L::splat(3.0));
        let (mut inside, mut outside) = (L::splat(f32::INFINITY), L::splat(f32::NEG_INFINITY));
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let first = cross(at_low[i], at_low[j]);
            let last = cross(at_high[i], at_high[j]);
            let middle = (cross(at_low[i], at_high[j]) + cross(at_high[i], at_low[j])) * L::splat(0.5);
            inside = inside.min(first.max(last).max(middle));
            outside = outside.max(first.min(last).min(middle));
        }
        let counter_clockwise = !(inside + slack).sign_mask();
        let clockwise = !(slack - outside).sign_mask();

        let (t0, t1) = (nearest * self.ray.per_depth, farthest * self.ray.per_depth);
        let slack = coordinate * self.ray.per_depth.abs() * L::splat(2.0);
        let [tnear, tfar] = self.ray.interval;
        let too_early = (t0.max(t1) + slack - tnear).sign_mask();
        let too_late = (tfar - (t0.min(t1) - slack)).sign_mask();
        (counter_clockwise | clockwise) & !too_early & !too_late
    }
}

#[inline(always)]
fn cross<L: Lanes>(p: [L; 2], q: [L; 2]) -> L {
    p[0] * q[1] - p[1] * q[0]
}
