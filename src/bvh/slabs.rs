//! A ray against the eight boxes of a CWBVH node, never losing one.
//!
//! obvhs's own node test clips the ray at an absolute t of 1e-4 and steepens direction components
//! below 1.2e-7. Both are fair for unit directions and wrong for ours: an instance scales the
//! direction, and t is in units of its length. So the traversal is obvhs's and the box test is here.
//!
//! A plane of a box is at p + q e per axis (p the node's corner, e a power of two, q a byte). Its ray
//! parameter is computed as q s + a with s = e / d and a = (p - o) / d. With unit roundoff u, s is off
//! by at most u relative, a by 3u, and the last product and sum add u each, so the sum is off by at most
//! 4u (255 |s| + |a|). Twice 3u of (256 |s| + |a|) is taken off the near and added to the far planes.

use glam::{Vec3, Vec4};
use obvhs::cwbvh::node::{CwBvhNode, extract_byte64};

use crate::ray::Ray;

/// A direction component this much smaller than the largest is taken for this much smaller: along it
/// the ray moves by less than an f32 can tell, and the reciprocal stays finite.
const LEAST_SLOPE: f32 = 1e-20;

/// What of a ray the box test needs.
pub(super) struct NodeRay {
    origin: Vec3,
    inverse: Vec3,
    backward: [bool; 3],
    tnear: f32,
}

impl NodeRay {
    /// Prepares a [valid](Ray::is_valid) ray.
    pub(super) fn new(ray: &Ray) -> Self {
        let d = ray.direction;
        let least = d.abs().max_element() * LEAST_SLOPE;
        let inverse = d.map(|c| 1.0 / c.abs().max(least).copysign(c));
        Self {
            origin: ray.origin,
            inverse,
            backward: inverse.to_array().map(|c| c < 0.0),
            tnear: ray.tnear,
        }
    }

    /// The node's children whose boxes the ray meets within [tnear, `tfar`], as obvhs's traversal wants
    /// them: inner children in the high byte in order of the ray's octant, primitives below.
    #[inline(always)]
    pub(super) fn hits(&self, node: &CwBvhNode, octant: u32, tfar: f32) -> u32 {
        let mut met = self.boxes_met(node, tfar);
        let (bits, indices) = node.get_child_and_index_bits(octant);
        let mut hits = 0;
        while met != 0 {
            let child = met.trailing_zeros() as usize;
            met &= met - 1;
            hits |= extract_byte64(bits, child) << extract_byte64(indices, child);
        }
        hits
    }

    /// One bit per child slot; an empty slot may be set too.
    ///
    /// Where a direction is so short that its reciprocal overflows, planes become NaN: they then bound
    /// nothing, so the box counts as met.
    #[inline(always)]
    fn boxes_met(&self, node: &CwBvhNode, tfar: f32) -> u32 {
        let s = Vec3::from(node.compute_extent()) * self.inverse;
        let a = (node.p - self.origin) * self.inverse;
        let error = 3.0 * f32::EPSILON * (256.0 * s.abs() + a.abs());
        let (a_near, a_far) = (a - error, a + error);

        let mut near = [Vec4::splat(self.tnear); 2];
        let mut far = [Vec4::splat(tfar); 2];
        let planes = [
            (&node.child_min_x, &node.child_max_x),
            (&node.child_min_y, &node.child_max_y),
            (&node.child_min_z, &node.child_max_z),
        ];
        for (axis, (low, high)) in planes.into_iter().enumerate() {
            let (first, second) = if self.backward[axis] {
                (high, low)
            } else {
                (low, high)
            };
            let (first, second) = (widen(first), widen(second));
            for half in 0..2 {
                near[half] = (first[half] * s[axis] + a_near[axis]).max(near[half]);
                far[half] = (second[half] * s[axis] + a_far[axis]).min(far[half]);
            }
        }
        let missed = |half: usize| near[half].cmpgt(far[half]).bitmask();
        !(missed(0) | (missed(1) << 4)) & 0xff
    }
}

/// Eight bytes as floats.
#[inline(always)]
fn widen(bytes: &[u8; 8]) -> [Vec4; 2] {
    let f = bytes.map(f32::from);
    [Vec4::from_slice(&f[..4]), Vec4::from_slice(&f[4..])]
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;
    use crate::bvh::quantise::quantise;
    use crate::ray::Aabb;

    /// A leaf node of one child box inside a larger one.
    fn node(child: Aabb, parent: Aabb) -> CwBvhNode {
        let mut node = CwBvhNode::default();
        node.child_meta[0] = 0b0010_0000;
        let mut boxes = [Aabb::EMPTY; 8];
        boxes[0] = child;
        quantise(&mut node, &boxes, parent);
        node
    }

    fn met(ray: &Ray, child: Aabb, parent: Aabb) -> bool {
        NodeRay::new(ray).boxes_met(&node(child, parent), ray.tfar) & 1 != 0
    }

    fn vec3(range: std::ops::Range<f32>) -> impl Strategy<Value = Vec3> {
        [range.clone(), range.clone(), range].prop_map(Vec3::from)
    }

    proptest! {
        /// Whatever the scales of scene, box and direction: a ray to a point of the box meets the box.
        #[test]
        fn a_ray_to_a_point_of_the_box_meets_it(
            place in vec3(-1.0..1.0), scene in -3.0f32..6.0,
            size in vec3(-8.0..0.0), at in vec3(0.0..1.0),
            origin in vec3(-2.0..2.0), length in -12.0f32..12.0,
            flat in 0usize..8,
        ) {
            let scene = 10f32.powf(scene);
            let corner = place * scene;
            let size = size.map(|e| scene * 10f32.powf(e));
            let child = Aabb { min: corner, max: corner + size };
            let parent = child.including(Vec3::splat(-scene)).including(Vec3::splat(2.0 * scene));
            let point = (child.min + at * (child.max - child.min)).min(child.max);
            let mut origin = origin * scene;
            for axis in 0..3 {
                if flat & (1 << axis) != 0 {
                    origin[axis] = point[axis];
                }
            }
            let length = 10f32.powf(length);
            let ray = Ray::new(origin, (point - origin) * length);
            prop_assume!(ray.is_valid());
            prop_assert!(met(&ray, child, parent));
        }
    }

    #[test]
    fn limits_are_kept_in_units_of_the_direction() {
        let child = Aabb {
            min: Vec3::ONE,
            max: Vec3::splat(2.0),
        };
        let parent = child.including(Vec3::ZERO);
        let mut ray = Ray::new(Vec3::ZERO, Vec3::splat(1e6));
        assert!(met(&ray, child, parent));
        ray.tfar = 0.9e-6;
        assert!(!met(&ray, child, parent));
        ray.tfar = 1.0e-6;
        assert!(met(&ray, child, parent));
        ray.tfar = f32::INFINITY;
        ray.tnear = 2.1e-6;
        assert!(!met(&ray, child, parent));
    }

    #[test]
    fn an_axis_parallel_ray_beside_the_box_misses() {
        let child = Aabb {
            min: Vec3::ONE,
            max: Vec3::splat(2.0),
        };
        let parent = child.including(Vec3::ZERO);
        for (x, inside) in [
            (0.9, false),
            (1.0, true),
            (1.5, true),
            (2.0, true),
            (2.1, false),
        ] {
            for z in [0.0, -0.0] {
                let ray = Ray::new(Vec3::new(x, 1.5, 0.0), Vec3::new(z, z, 1.0));
                assert_eq!(met(&ray, child, parent), inside, "x = {x}");
            }
        }
    }

    #[test]
    fn an_overflowing_reciprocal_loses_nothing() {
        let child = Aabb {
            min: Vec3::ONE,
            max: Vec3::splat(2.0),
        };
        let parent = child.including(Vec3::ZERO);
        let ray = Ray::new(Vec3::ZERO, Vec3::splat(1e-40));
        assert!(met(&ray, child, parent));
    }
}
