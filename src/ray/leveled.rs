//! Directions of any length, brought near length 1, and origins from very far brought near.
//!
//! A tree's box test divides by the direction's components. Embree takes those below 1e-18 for +1e-18, and loses boxes
//! where all of them are as small; what is large or small overflows through an instance. Rays along such directions are traced along one
//! that a power of two makes 1 to 2 in its largest component, and t is counted back. From thousands of times the world's size a box test tells
//! boxes apart no more: such rays start anew before the world.

use std::ops::RangeInclusive;

use super::Ray;
#[cfg(feature = "embree")]
use super::RayPacket;

/// The largest components that are left as they are: with an instance that stretches by
/// [`MAX_STRETCH`](crate::trace::MAX_STRETCH) they stay within 1e-15 to 1e15.
const LEVEL: RangeInclusive<f32> = 1.0 / 1024.0..=1024.0;

/// A ray, and how its t are counted back.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Leveled {
    pub ray: Ray,
    factor: f64,
    /// Where it starts, by the level ray's parameter from the original's origin.
    start: f64,
    /// The interval as it was.
    tnear: f32,
    tfar: f32,
}

impl Ray {
    /// Whether the direction is near length 1, and no coordinate of the origin beyond `far`.
    #[inline(always)]
    pub(crate) fn is_level(&self, far: f32) -> bool {
        LEVEL.contains(&self.direction.abs().max_element())
            && self.origin.abs().max_element() <= far
    }

    /// This [valid](Self::is_valid) ray along a direction whose largest component is 1 to 2, from where it is about to enter a world whose
    /// coordinates are within `size`.
    pub(crate) fn leveled(&self, size: f32) -> Leveled {
        let direction = self.direction.as_dvec3();
        // Exact: of 1e-45 this is 2^-149, of 1.8e18 2^60.
        let length = 2f64.powi(exponent(direction.abs().max_element()));
        let (origin, level) = (self.origin.as_dvec3(), direction / length);
        // Nothing is nearer to where it passes the middle: the world's corners are at 1.8 times its size. The rest is for rounding.
        let middle = -origin.dot(level) / level.length_squared();
        let start = (middle - 4.0 * f64::from(size) - 1e-15 * middle.abs()).max(0.0);
        let along = |t: f32| (f64::from(t) * length - start) as f32;
        Leveled {
            ray: Self {
                origin: (origin + start * level).as_vec3(),
                direction: level.as_vec3(),
                tnear: along(self.tnear).max(0.0),
                // A t that no f32 holds is no hit.
                tfar: along(self.tfar.min(f32::MAX)).max(0.0),
                ..*self
            },
            factor: length.recip(),
            start,
            tnear: self.tnear,
            tfar: self.tfar,
        }
    }
}

impl Leveled {
    /// The original's t for one of this ray; `None` where rounding takes it out of the interval.
    pub fn original_t(&self, t: f32) -> Option<f32> {
        let t = ((f64::from(t) + self.start) * self.factor) as f32;
        (self.tnear < t && t < self.tfar).then_some(t)
    }
}

#[cfg(feature = "embree")]
impl RayPacket {
    /// [`Ray::is_level`] of every lane, in its bit.
    #[inline]
    pub(crate) fn level(&self, far: f32) -> u8 {
        let largest = |[x, y, z]: &[[f32; Self::LANES]; 3], lane: usize| {
            x[lane].abs().max(y[lane].abs()).max(z[lane].abs())
        };
        (0..Self::LANES).fold(0, |bits, lane| {
            let is_level = LEVEL.contains(&largest(&self.direction, lane))
                & (largest(&self.origin, lane) <= far);
            bits | u8::from(is_level) << lane
        })
    }
}

/// e for which a normal number is 2^e to 2^(e+1).
fn exponent(x: f64) -> i32 {
    // 11 bits fit.
    (x.to_bits() >> 52 & 0x7ff) as i32 - 1023
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::ray::MAX_COORDINATE;

    #[test]
    fn level_rays_are_the_same_lines() {
        for power in -149..=60 {
            let length = 2f64.powi(power) as f32;
            let direction = Vec3::new(0.25, -1.0, 0.5) * length;
            let ray = Ray {
                tnear: 0.5,
                tfar: 3.0,
                ..Ray::new(Vec3::X, direction)
            };
            let leveled = ray.leveled(1.0);
            let level = leveled.ray.direction.abs().max_element();
            assert!((1.0..2.0).contains(&level), "2^{power}: {level}");
            assert!(leveled.ray.is_level(1.0) && leveled.ray.is_valid());
            if power > -146 {
                assert_eq!(leveled.ray.direction * length, direction);
            }
            // What f32 can hold of the interval is kept to the bit.
            if (-120..120).contains(&power) {
                assert_eq!(leveled.ray.tnear, 0.5 * length);
                assert_eq!(leveled.original_t(2.0 * length), Some(2.0));
                assert_eq!(leveled.original_t(3.0 * length), None);
            }
        }
        assert!(
            Ray::new(Vec3::ZERO, Vec3::splat(MAX_COORDINATE))
                .leveled(1.0)
                .ray
                .is_valid()
        );
    }

    #[test]
    fn rays_from_very_far_start_before_the_world() {
        let ray = Ray {
            tnear: 3.0,
            ..Ray::new(Vec3::new(0.5, 1e12, 0.0), 4.0 * Vec3::NEG_Y)
        };
        assert!(!ray.is_level(4096.0));
        let leveled = ray.leveled(2.0);
        assert!(leveled.ray.origin.distance(Vec3::new(0.5, 8.0, 0.0)) < 0.01);
        assert_eq!((leveled.ray.tnear, leveled.ray.tfar), (0.0, f32::INFINITY));
        assert_eq!(leveled.original_t(8.0), Some(2.5e11));
        // Not beyond its own end, nor behind its origin.
        let short = Ray { tfar: 5.0, ..ray }.leveled(2.0);
        assert_eq!(short.ray.tfar, 0.0);
        let away = Ray::new(Vec3::new(0.5, 1e12, 0.0), Vec3::Y).leveled(2.0);
        assert_eq!(away.ray.origin, Vec3::new(0.5, 1e12, 0.0));
    }

    #[test]
    fn hits_whose_t_overflows_are_none() {
        let ray = Ray::new(Vec3::ZERO, Vec3::X * f32::from_bits(1));
        assert_eq!(ray.leveled(1.0).original_t(1.0), None);
        assert!(ray.leveled(1.0).original_t(1e-8).is_some());
    }

    #[cfg(feature = "embree")]
    #[test]
    fn lanes_are_level_as_their_rays_are() {
        let lengths = [1e-45, 1e-4, 1e-3, 1.0, 1000.0, 1024.0, 1025.0, 1.8e18];
        let rays = lengths.map(|x| Ray::new(Vec3::ONE, Vec3::new(0.0, -x, 0.1 * x)));
        let level = RayPacket::from_rays(&rays).level(1.0);
        for (lane, ray) in rays.iter().enumerate() {
            assert_eq!(level >> lane & 1 == 1, ray.is_level(1.0), "{ray:?}");
        }
        assert_eq!(level, 0b0011_1100);
    }
}
