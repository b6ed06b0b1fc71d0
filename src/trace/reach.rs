//! How far rays may come from, and how far objects may stand: one rule for every backend.
//!
//! A tree is asked about rays within [`MAX_COORDINATE`], also about those that an instance takes into its object's space, where the
//! same ray may start at coordinates many times as large. So a world with instances takes rays from as far only as all of
//! them bring within the limit: known when the world is built, and one comparison per ray.

use glam::{Affine3A, DVec3, Mat3};
use thiserror::Error;

use super::Hit;
use crate::ray::{MAX_COORDINATE, Ray, RayPacket};

/// The most by which an instance's transform may make lengths larger, or smaller.
pub const MAX_STRETCH: f32 = 1e12;

/// Times the size of the world's largest coordinate from which rays must be able to come.
pub(super) const SURROUNDINGS: f32 = 16.0;

/// Parts of the sum of sizes of its terms that a determinant in f32 is off by, and more.
const DETERMINANT_ERROR: f64 = 4e-7;

/// Why an instance cannot stand under a transform.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum TransformError {
    /// NaN, infinite, or so nearly flat that single precision knows no inverse.
    #[error(
        "the transform has the determinant {determinant:e}; expected finite numbers, and an inverse that single precision can hold"
    )]
    Singular {
        /// Of the 3x3 part.
        determinant: f32,
    },
    /// Beyond [`MAX_STRETCH`].
    #[error("the transform multiplies lengths by {found:e}; expected 1e-12 to {MAX_STRETCH:e}")]
    Stretch {
        /// The factor.
        found: f32,
    },
    /// The translation is so far, or the inverse so large, that no ray of the world is within [`MAX_COORDINATE`] of the object's space.
    #[error(
        "the transform multiplies lengths by as little as {smallest:e} and moves by {translation:e}; expected a translation within \
         +-{MAX_COORDINATE:e} in the object's own space"
    )]
    TooFar {
        /// The largest component of the translation.
        translation: f32,
        /// The smallest factor.
        smallest: f32,
    },
}

/// Which rays a world can be asked about: all that are [valid](Ray::is_valid), of those from as far as its instances allow. Others hit nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayReach {
    origin: f32,
    /// No coordinate of the world is larger; infinite where that is not known.
    size: f32,
}

/// Times the size of the world from which rays are brought near it: a box test's t has no digits left for the world from much farther.
const FAR: f32 = 4096.0;

impl Default for RayReach {
    /// That of a world without instances.
    fn default() -> Self {
        Self {
            origin: MAX_COORDINATE,
            size: f32::INFINITY,
        }
    }
}

impl RayReach {
    /// The largest coordinate that the origin of a ray may have, of either sign.
    pub fn origin(&self) -> f32 {
        self.origin
    }

    /// Whether a backend is asked about the ray; else it hits nothing.
    #[inline(always)]
    pub fn admits(&self, ray: &Ray) -> bool {
        ray.is_valid_from(self.origin)
    }

    /// [`admits`](Self::admits) for every lane: bit i tells of lane i.
    #[inline]
    pub fn admitted(&self, rays: &RayPacket) -> u8 {
        rays.valid_from(self.origin)
    }

    /// What is left of it where an object stands under `to_world`, too.
    ///
    /// # Errors
    ///
    /// A transform that no backend takes.
    pub fn through(self, to_world: &Affine3A) -> Result<Self, TransformError> {
        self.through_to(to_world, MAX_COORDINATE)
    }

    /// What is left of it where an object in world space takes rays from within `largest` only.
    pub(super) fn up_to(self, largest: f32) -> Self {
        Self {
            origin: self.origin.min(largest),
            ..self
        }
    }

    /// The same for a world whose largest coordinate is known.
    pub(super) fn around(self, size: f32) -> Self {
        Self { size, ..self }
    }

    /// Coordinates of origins from which rays are brought near the world.
    #[inline(always)]
    pub(crate) fn far(&self) -> f32 {
        FAR * self.size
    }

    /// [`through`](Self::through), and rays of at most this largest coordinate in the object's space.
    pub(super) fn through_to(
        self,
        to_world: &Affine3A,
        largest: f32,
    ) -> Result<Self, TransformError> {
        let matrix = Mat3::from(to_world.matrix3).as_dmat3();
        let translation = to_world.translation.abs().max_element();
        let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(DVec3::abs);
        let determinant = matrix.determinant();
        let [x, y, z] = columns;
        let cofactors = [[y, z], [z, x], [x, y]].map(|[a, b]| products(a, b));
        // What f32 may make of the determinant at least, whoever computes it, and in which order.
        let least = determinant.abs() - DETERMINANT_ERROR * x.dot(cofactors[0]);
        if !(least > 0.0 && to_world.is_finite()) {
            return Err(TransformError::Singular {
                determinant: determinant as f32,
            });
        }
        // Bounds of the largest coordinates that the largest coordinate of a vector becomes, there and back.
        let forth = (x + y + z).max_element();
        let back = cofactors
            .map(|row| row.element_sum() / least)
            .into_iter()
            .fold(0.0, f64::max);
        for found in [forth, back.recip()] {
            if !(1.0 / f64::from(MAX_STRETCH)..=f64::from(MAX_STRETCH)).contains(&found) {
                return Err(TransformError::Stretch {
                    found: found as f32,
                });
            }
        }
        let origin = (f64::from(largest) / back) as f32 - translation;
        if origin > 0.0 {
            Ok(self.up_to(origin))
        } else {
            Err(TransformError::TooFar {
                translation,
                smallest: back.recip() as f32,
            })
        }
    }
}

/// A cross product of non-negative vectors with all its differences made sums: a bound for what rounding leaves of it.
fn products(a: DVec3, b: DVec3) -> DVec3 {
    DVec3::new(
        a.y * b.z + a.z * b.y,
        a.z * b.x + a.x * b.z,
        a.x * b.y + a.y * b.x,
    )
}

impl RayReach {
    /// The first hit of `ray`; `ask` is asked about rays with a direction near length 1 only, from not too far.
    #[inline(always)]
    pub(crate) fn intersect(&self, ray: &Ray, ask: impl Fn(&Ray) -> Option<Hit>) -> Option<Hit> {
        if !self.admits(ray) {
            return None;
        }
        if ray.is_level(self.far()) {
            ask(ray)
        } else {
            intersect_leveled(ray, self.size, &ask)
        }
    }

    /// Whether there is any hit. A ray with another direction is asked for its first hit: that counts by its own t.
    #[inline(always)]
    pub(crate) fn occluded(
        &self,
        ray: &Ray,
        ask: impl Fn(&Ray) -> bool,
        first: impl Fn(&Ray) -> Option<Hit>,
    ) -> bool {
        self.admits(ray)
            && if ray.is_level(self.far()) {
                ask(ray)
            } else {
                intersect_leveled(ray, self.size, &first).is_some()
            }
    }
}

#[cold]
fn intersect_leveled(ray: &Ray, size: f32, ask: &dyn Fn(&Ray) -> Option<Hit>) -> Option<Hit> {
    let leveled = ray.leveled(size);
    let hit = ask(&leveled.ray)?;
    let t = leveled.original_t(hit.t)?;
    Some(Hit { t, ..hit })
}

#[cfg(test)]
mod tests {
    use glam::{Quat, Vec3};
    use proptest::prelude::*;

    use super::*;

    fn through(transform: Affine3A) -> Result<RayReach, TransformError> {
        RayReach::default().through(&transform)
    }

    fn number(exponents: std::ops::Range<f32>) -> impl Strategy<Value = f32> {
        (exponents, any::<bool>()).prop_map(|(e, minus)| {
            let x = 10f32.powf(e);
            if minus { -x } else { x }
        })
    }

    fn vec3(exponents: std::ops::Range<f32>) -> impl Strategy<Value = Vec3> {
        [
            number(exponents.clone()),
            number(exponents.clone()),
            number(exponents),
        ]
        .prop_map(Vec3::from)
    }

    proptest! {
        /// What is admitted stays within the limit in the object's space, as a backend computes that.
        #[test]
        fn admitted_rays_are_valid_in_the_objects_space(
            scale in vec3(-14.0..14.0), turn in vec3(-2.0..1.0), translation in vec3(-45.0..20.0),
            origin in vec3(-1.0..0.0), direction in vec3(-45.0..18.0),
        ) {
            let turned = Quat::from_scaled_axis(turn);
            let transform = Affine3A::from_scale_rotation_translation(scale, turned, translation);
            let Ok(reach) = through(transform) else { return Ok(()) };
            let ray = Ray::new(origin * reach.origin(), direction);
            prop_assert!(reach.admits(&ray));
            let ray = ray.leveled(f32::INFINITY).ray;
            let inverse = transform.inverse();
            let local = Ray {
                origin: inverse.transform_point3(ray.origin),
                direction: inverse.transform_vector3(ray.direction),
                ..ray
            };
            prop_assert!(local.is_valid_from(1.01 * MAX_COORDINATE), "{local:?}");
            let length = local.direction.abs().max_element();
            prop_assert!((1e-14..1e15).contains(&length), "{local:?}");
        }
    }

    #[test]
    fn a_place_in_the_world_leaves_the_whole_reach() {
        let moved = Affine3A::from_translation(Vec3::splat(1e5));
        assert!(through(moved).unwrap().origin() >= 0.999 * MAX_COORDINATE);
        let small = Affine3A::from_scale(Vec3::splat(1e-3));
        let reach = through(small).unwrap().origin();
        assert!((1.7e15..1.81e15).contains(&reach), "{reach}");
        let both = through(small).and_then(|reach| reach.through(&moved));
        assert!((1.7e15..1.81e15).contains(&both.unwrap().origin()));
    }

    #[test]
    fn extreme_transforms_are_refused() {
        let scaled = |x: f32| through(Affine3A::from_scale(Vec3::splat(x)));
        for x in [1e-30, 1e-19, 0.9e-12, 1.1e12, 1e19, 1e30] {
            let stretch = matches!(scaled(x), Err(TransformError::Stretch { .. }));
            assert!(stretch, "{x}: {:?}", scaled(x));
        }
        for x in [1.1e-12, -1e-6, 1.0, 0.9e12] {
            assert!(scaled(x).is_ok(), "{x}: {:?}", scaled(x));
        }
        for x in [0.0, f32::NAN, f32::INFINITY] {
            let singular = matches!(scaled(x), Err(TransformError::Singular { .. }));
            assert!(singular, "{x}: {:?}", scaled(x));
        }
        let far = Affine3A::from_translation(Vec3::X * 1e19);
        assert!(matches!(through(far), Err(TransformError::TooFar { .. })));
        // Flat along no axis of either space: f32 finds any determinant.
        let flat = Affine3A::from_scale(Vec3::new(1.0, 1e-9, 1.0));
        let turn = Affine3A::from_quat(Quat::from_rotation_z(0.7));
        let askew = through(turn * flat * turn);
        assert!(matches!(askew, Err(TransformError::Singular { .. })));
        assert!(through(flat).is_ok() && through(turn * flat).is_ok());
    }
}
