//! A ray's own frame: its main axis, and the two lateral axes sheared along the ray.
//!
//! The main axis is the coordinate axis along which the direction is largest (Woop, Benthin, Wald, "Watertight
//! Ray/Triangle Intersection", JCGT 2(1), 2013). Moved by minus the shear times its depth, every point of the ray has
//! lateral coordinates 0; so a point's projection depends on the point and the ray alone, and two prisms see
//! the same digits of a vertex that they share.

use super::simd::Lanes;
use crate::ray::Ray;

/// The main axis of a ray, last, and the two others: a cyclic permutation of x, y, z.
#[inline(always)]
pub fn axes(ray: &Ray) -> [usize; 3] {
    let [x, y, z] = ray.direction.abs().to_array();
    if z >= x && z >= y {
        [0, 1, 2]
    } else if y >= x {
        [2, 0, 1]
    } else {
        [1, 2, 0]
    }
}

/// What the set-up needs of a ray, in f64.
#[derive(Clone, Copy, Debug)]
pub struct RayFrame {
    /// Lateral axes, then the main axis.
    pub axes: [usize; 3],
    /// Origin along these axes.
    pub origin: [f64; 3],
    /// Movement along the lateral axes per unit along the main axis, within [-1, 1].
    pub shear: [f64; 2],
    /// Ray parameter per unit along the main axis.
    pub per_depth: f64,
}

impl RayFrame {
    /// `ray` must be [valid](Ray::is_valid), `axes` its.
    #[inline(always)]
    pub fn new(ray: &Ray, axes @ [x, y, z]: [usize; 3]) -> Self {
        let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
        let per_depth = 1.0 / f64::from(direction[z]);
        Self {
            axes,
            origin: [origin[x].into(), origin[y].into(), origin[z].into()],
            shear: [
                f64::from(direction[x]) * per_depth,
                f64::from(direction[y]) * per_depth,
            ],
            per_depth,
        }
    }
}

/// The same in f32, for culling: one ray in all lanes, or eight that have the same axes.
pub struct RayLanes<L> {
    /// Origin along the axes.
    pub origin: [L; 3],
    /// Movement along the lateral axes per unit along the main axis.
    pub shear: [L; 2],
    /// Ray parameter per unit along the main axis.
    pub per_depth: L,
    /// tnear and tfar.
    pub interval: [L; 2],
}

/// Directions beyond this and its inverse would overflow ray parameters in f32.
const LONGEST: f32 = 1e12;

impl<L: Lanes> RayLanes<L> {
    /// One ray in all lanes.
    #[inline(always)]
    pub fn splat(ray: &Ray, [x, y, z]: [usize; 3]) -> Self {
        let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
        Self {
            origin: [
                L::splat(origin[x]),
                L::splat(origin[y]),
                L::splat(origin[z]),
            ],
            ..Self::directed(
                [
                    L::splat(direction[x]),
                    L::splat(direction[y]),
                    L::splat(direction[z]),
                ],
                [L::splat(ray.tnear), L::splat(ray.tfar)],
            )
        }
    }

    /// With its origin still to come.
    #[inline(always)]
    fn directed([x, y, z]: [L; 3], [tnear, tfar]: [L; 2]) -> Self {
        let per_depth = L::splat(1.0) / z;
        // All of space where ray parameters would overflow.
        let length = z.abs();
        let usual = (L::splat(LONGEST) - length).min(length - L::splat(1.0 / LONGEST));
        Self {
            origin: [x, y, z],
            shear: [x * per_depth, y * per_depth],
            per_depth: usual.select_negative(L::splat(1.0), per_depth),
            interval: [
                usual.select_negative(L::splat(f32::NEG_INFINITY), tnear),
                usual.select_negative(L::splat(f32::INFINITY), tfar),
            ],
        }
    }
}
