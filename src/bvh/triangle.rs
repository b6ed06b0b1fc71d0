//! A watertight ray-triangle test.
//!
//! Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013: the corners are
//! sheared so that the ray runs along z, where the three signed areas decide. An area on a shared edge
//! has the same magnitude and opposite sign for both neighbours, so no ray slips between them. Areas
//! that come out zero are decided again in f64, where the products are exact.

use glam::{DVec3, Vec3};

use crate::prism::PrismHit;
use crate::ray::Ray;

/// A ray's shear, computed once for many triangles.
pub(super) struct ShearedRay {
    origin: Vec3,
    /// Axes that become x, y and z; z is the direction's largest.
    axes: [usize; 3],
    shear: Vec3,
}

impl ShearedRay {
    /// Prepares a [valid](Ray::is_valid) ray.
    pub(super) fn new(ray: &Ray) -> Self {
        let d = ray.direction;
        let z = d.abs().max_position();
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if d[z] < 0.0 {
            // Keeps the winding.
            (x, y) = (y, x);
        }
        Self {
            origin: ray.origin,
            axes: [x, y, z],
            shear: Vec3::new(d[x] / d[z], d[y] / d[z], 1.0 / d[z]),
        }
    }

    /// The hit of the triangle `corners`, from either side, with t in the open interval of `ray`, from
    /// which `self` was made. `ng` points to the side from which the corners run counter-clockwise.
    #[inline]
    pub(super) fn intersect(&self, prim: u32, corners: [Vec3; 3], ray: &Ray) -> Option<PrismHit> {
        let [a, b, c] = corners.map(|corner| self.sheared(corner));
        let areas = signed_areas(a, b, c);
        let some_negative = areas.cmplt(Vec3::ZERO).any();
        let some_positive = areas.cmpgt(Vec3::ZERO).any();
        if some_negative && some_positive {
            return None;
        }
        // Zero for a triangle seen edge-on: then b is NaN, and so is t, which no interval holds.
        let b_coords = areas / areas.element_sum();
        let t = b_coords.dot(Vec3::new(a.z, b.z, c.z)) * self.shear.z;
        (ray.tnear < t && t < ray.tfar).then(|| PrismHit {
            prim,
            t,
            u: b_coords.y,
            v: b_coords.z,
            ng: unit_normal(corners),
        })
    }

    #[inline]
    fn sheared(&self, corner: Vec3) -> Vec3 {
        let [x, y, z] = self.axes;
        let p = corner - self.origin;
        Vec3::new(p[x] - self.shear.x * p[z], p[y] - self.shear.y * p[z], p[z])
    }
}

/// Twice the areas opposite to each corner, seen along z.
#[inline]
fn signed_areas(a: Vec3, b: Vec3, c: Vec3) -> Vec3 {
    let areas = Vec3::new(
        c.x * b.y - c.y * b.x,
        a.x * c.y - a.y * c.x,
        b.x * a.y - b.y * a.x,
    );
    if areas.cmpne(Vec3::ZERO).all() {
        return areas;
    }
    let [a, b, c] = [a, b, c].map(|p| p.as_dvec3());
    DVec3::new(
        c.x * b.y - c.y * b.x,
        a.x * c.y - a.y * c.x,
        b.x * a.y - b.y * a.x,
    )
    .as_vec3()
}

/// Unit normal on the counter-clockwise side; in f64, as the cross product of a small triangle
/// underflows f32.
fn unit_normal(corners: [Vec3; 3]) -> Vec3 {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    (b - a).cross(c - a).normalize_or_zero().as_vec3()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const CORNERS: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

    fn hit(ray: &Ray, corners: [Vec3; 3]) -> Option<PrismHit> {
        ShearedRay::new(ray).intersect(0, corners, ray)
    }

    #[test]
    fn u_weighs_corner_1_v_corner_2_and_ng_is_counter_clockwise() {
        for sign in [1.0, -1.0] {
            let ray = Ray::new(Vec3::new(0.25, 0.5, 2.0 * sign), Vec3::Z * -4.0 * sign);
            let hit = hit(&ray, CORNERS).unwrap();
            assert_eq!((hit.t, hit.u, hit.v, hit.ng), (0.5, 0.25, 0.5, Vec3::Z));
        }
    }

    #[test]
    fn the_interval_is_open() {
        let mut ray = Ray::new(Vec3::new(0.25, 0.5, 2.0), -Vec3::Z);
        ray.tfar = 2.0;
        assert!(hit(&ray, CORNERS).is_none());
        ray.tfar = 2.0f32.next_up();
        assert!(hit(&ray, CORNERS).is_some());
        ray.tnear = 2.0;
        assert!(hit(&ray, CORNERS).is_none());
        ray.tnear = 2.0f32.next_down();
        assert!(hit(&ray, CORNERS).is_some());
    }

    #[test]
    fn an_edge_on_triangle_is_not_hit() {
        let ray = Ray::new(Vec3::new(-1.0, 0.25, 0.0), Vec3::X);
        assert!(hit(&ray, CORNERS).is_none());
    }

    fn point() -> impl Strategy<Value = Vec3> {
        [-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0].prop_map(Vec3::from)
    }

    proptest! {
        /// A fan of four triangles around a centre: a ray through the fan hits one of them at least,
        /// wherever it goes, also exactly through the shared edges and the centre.
        #[test]
        fn no_ray_slips_through_a_closed_fan(
            angles in [0.3f32..1.2, 1.8f32..2.8, 3.4f32..4.4, 5.0f32..6.0],
            origin in point(), spoke in 0usize..4, along in 0.0f32..0.5, scale in -6.0f32..6.0,
        ) {
            let scale = 10f32.powf(scale);
            let centre = Vec3::new(0.1, 0.2, 0.3) * scale;
            let rim = angles.map(|a| centre + Vec3::new(a.cos(), a.sin(), 0.1) * scale);
            let target = centre + (rim[spoke] - centre) * along;
            let origin = target + (origin + Vec3::Z * 3.0) * scale;
            let ray = Ray::new(origin, target - origin);
            let hits = (0..4).filter(|&i| hit(&ray, [centre, rim[i], rim[(i + 1) % 4]]).is_some());
            prop_assert!(hits.count() >= 1);
        }

        /// The hit point agrees with the barycentric coordinates.
        #[test]
        fn the_point_on_the_ray_is_the_point_on_the_triangle(
            corners in [point(), point(), point()], origin in point(),
            u in 0.05f32..0.9, share in 0.05f32..0.95,
        ) {
            let v = (1.0 - u) * share;
            let [a, b, c] = corners;
            prop_assume!((b - a).cross(c - a).length() > 0.1);
            let target = a + u * (b - a) + v * (c - a);
            let ray = Ray::new(origin, target - origin);
            prop_assume!((b - a).cross(c - a).normalize().dot(ray.direction).abs() > 0.05);
            let hit = hit(&ray, corners).unwrap();
            prop_assert!((hit.t - 1.0).abs() < 1e-4);
            prop_assert!((hit.u - u).abs() < 1e-4 && (hit.v - v).abs() < 1e-4);
        }
    }
}
