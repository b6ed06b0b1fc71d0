//! A ray's own frame: its main axis, and the two lateral axes sheared along the ray.
//!
//! The main axis is the coordinate axis along which the direction is largest (Woop, Benthin, Wald, "Watertight
//! Ray/Triangle Intersection", JCGT 2(1), 2013). Moved by minus the shear times its depth, every point of the ray has
//! lateral coordinates 0; so a point's projection depends on the point and the ray alone, and two prisms see
//! the same digits of a vertex that they share.

use glam::DVec3;

use super::simd::{LANES, Lanes};
use crate::ray::Ray;

/// What is computed once per ray.
#[derive(Clone, Copy, Debug)]
pub struct RayFrame {
    /// Lateral axes, then the main axis: a cyclic permutation of x, y, z.
    pub axes: [usize; 3],
    /// Origin along these axes.
    pub origin: [f64; 3],
    /// Movement along the lateral axes per unit along the main axis, within [-1, 1].
    pub shear: [f64; 2],
    /// Ray parameter per unit along the main axis.
    pub per_depth: f64,
    /// The ray's open interval.
    pub interval: [f32; 2],
}

impl RayFrame {
    /// `ray` must be [valid](Ray::is_valid).
    #[inline(always)]
    pub fn new(ray: &Ray) -> Self {
        let [x, y, z] = ray.direction.abs().to_array();
        let axes = if z >= x && z >= y {
            [0, 1, 2]
        } else if y >= x {
            [2, 0, 1]
        } else {
            [1, 2, 0]
        };
        let direction = along(ray.direction.as_dvec3(), axes);
        let per_depth = 1.0 / direction[2];
        Self {
            axes,
            origin: along(ray.origin.as_dvec3(), axes),
            shear: [direction[0] * per_depth, direction[1] * per_depth],
            per_depth,
            interval: [ray.tnear, ray.tfar],
        }
    }

    /// The ray in all lanes, for [`Pairs`](super::cull::Pairs): origin, shear, ray parameter per depth, interval.
    #[inline(always)]
    pub fn splat<L: Lanes>(&self) -> ([L; 3], [L; 2], L, [L; 2]) {
        let (per_depth, [tnear, tfar]) = self.for_culling();
        let ([x, y, z], [sx, sy]) = (self.origin, self.shear);
        (
            [L::splat(x as f32), L::splat(y as f32), L::splat(z as f32)],
            [L::splat(sx as f32), L::splat(sy as f32)],
            L::splat(per_depth),
            [L::splat(tnear), L::splat(tfar)],
        )
    }

    /// Eight rays as lanes, all of which have the axes of the first.
    #[inline(always)]
    pub fn lanes<L: Lanes>(frames: &[Self; LANES]) -> ([L; 3], [L; 2], L, [L; 2]) {
        let of = |f: &dyn Fn(&Self) -> f32| L::from_array(std::array::from_fn(|l| f(&frames[l])));
        (
            std::array::from_fn(|k| of(&|r| r.origin[k] as f32)),
            std::array::from_fn(|k| of(&|r| r.shear[k] as f32)),
            of(&|r| r.for_culling().0),
            std::array::from_fn(|k| of(&|r| r.for_culling().1[k])),
        )
    }

    /// Ray parameter per depth and the interval, both in f32; all of space where a direction is so long or so short that
    /// they would overflow.
    #[inline(always)]
    fn for_culling(&self) -> (f32, [f32; 2]) {
        const LONGEST: f64 = 1e12;
        if self.per_depth.abs() > LONGEST || self.per_depth.abs() < 1.0 / LONGEST {
            return (1.0, [f32::NEG_INFINITY, f32::INFINITY]);
        }
        (self.per_depth as f32, self.interval)
    }
}

#[inline(always)]
fn along(v: DVec3, [x, y, z]: [usize; 3]) -> [f64; 3] {
    [v[x], v[y], v[z]]
}
