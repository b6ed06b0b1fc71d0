//! Where a ray that leaves a surface starts: a little off it, so that it does not meet it again.
//!
//! Source: Wächter and Binder, "A Fast and Robust Method for Avoiding Self-Intersection", Ray Tracing Gems,
//! chapter 6, 2019: step a fixed number of representable numbers along the geometric normal, and a fixed length where
//! coordinates are too near 0 for that. Two changes: more steps, because a hit on a displaced surface is the
//! root of an iteration and not an intersection in closed form; and the fixed length follows the scene's
//! size, because a scene in millimetres must not lose its grooves.

use glam::Vec3;

/// Representable numbers stepped per coordinate; the article has 256 for plain triangles.
const ULPS: f32 = 512.0;

/// The smallest step as a part of the scene's diagonal.
const SMALLEST: f32 = 1.0 / (1 << 18) as f32;

/// How far rays that leave the surfaces of one scene start off them.
///
/// Shadow rays, reflections, refractions and paths start at a hit. The hit's position is rounded, so that a ray from there may begin
/// on either side of the surface; from a point moved by this it begins on the side that is wanted. The step is 512 units in the
/// last place of every coordinate (about 6e-5 of it), in the direction of the geometric normal, and at least 4e-6 of the scene's
/// diagonal; tests/reintersection.rs holds it to neither meeting the surface again nor slipping through, at scales from 1e-4 to 1e4.
///
/// The ray then needs no `tnear` of its own, and no direction is favoured.
///
/// ```
/// use glam::Vec3;
/// use prismarch::ray::Ray;
/// use prismarch::trace::{Hit, RayOffset, Tracer, World};
///
/// /// Whether the point that `seen` hit is lit from `to_light`.
/// fn is_lit(world: &World, tracer: &dyn Tracer, seen: &Ray, hit: &Hit, to_light: Vec3) -> bool {
///     let offset = RayOffset::for_scene(tracer.bounds().diagonal()); // once per scene
///     let point = world.surface_point(hit); // in world space, whatever the instance
///     let normal = point.geometric_normal;
///     // Shadow rays start on the side that was seen. A refracted ray starts on the other one.
///     let normal = if normal.dot(seen.direction) < 0.0 { normal } else { -normal };
///     let ray = Ray::new(offset.apply(point.position, normal), to_light);
///     normal.dot(to_light) > 0.0 && !tracer.occluded(&ray)
/// }
/// ```
#[derive(Clone, Copy, Debug)]
pub struct RayOffset {
    /// Step length of small coordinates.
    step: f32,
    /// Coordinates below this are small: here both steps are about the same.
    small: f32,
}

impl RayOffset {
    /// For a scene whose bounding box has this diagonal, in world units: `tracer.bounds().diagonal()`.
    pub fn for_scene(diagonal: f32) -> Self {
        let step = if diagonal.is_finite() {
            diagonal * SMALLEST
        } else {
            0.0
        };
        Self {
            step,
            small: step / (ULPS * f32::EPSILON),
        }
    }

    /// The start of a ray that leaves `position` on the side that the unit `normal` points to.
    ///
    /// `normal` must be the true geometric normal in world space, flipped to the ray's side: a shading normal may point into the
    /// surface.
    pub fn apply(&self, position: Vec3, normal: Vec3) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|axis| {
            self.coordinate(position[axis], normal[axis])
        }))
    }

    fn coordinate(&self, p: f32, n: f32) -> f32 {
        if p.abs() < self.small {
            return p + self.step * n;
        }
        // Bits of a float are ordered by magnitude: away from 0 is up for either sign.
        let outward = (ULPS * n) as i32;
        let steps = if p < 0.0 { -outward } else { outward };
        f32::from_bits(p.to_bits().wrapping_add_signed(steps))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moves_to_the_normal_side_at_every_magnitude() {
        for exponent in -20..20 {
            let size = 2.0_f32.powi(exponent);
            let offset = RayOffset::for_scene(4.0 * size);
            for position in [Vec3::splat(size), Vec3::new(-size, 0.0, size), Vec3::ZERO] {
                for normal in [Vec3::X, Vec3::NEG_Y, Vec3::new(0.6, -0.64, 0.48)] {
                    let moved = offset.apply(position, normal) - position;
                    assert!(moved.dot(normal) > 0.0, "{position} {normal}");
                    assert!(moved.length() < 2e-4 * size, "{position} {normal}");
                }
            }
        }
    }

    #[test]
    fn an_empty_scene_needs_no_offset() {
        let offset = RayOffset::for_scene(0.0);
        assert!(offset.apply(Vec3::ZERO, Vec3::Y).is_finite());
    }
}
