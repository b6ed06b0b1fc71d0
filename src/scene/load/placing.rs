//! Points and directions under transforms, as those of lights and cameras must be.

use glam::{Affine3A, Vec3};
use thiserror::Error;

use crate::ray::MAX_COORDINATE;

/// What is wrong with where a light or a camera stands; part of a message.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{0}")]
pub struct Broken(pub String);

/// By how much lengths grow, in the mean.
pub(super) fn scale(transform: &Affine3A) -> f64 {
    let m = transform.matrix3;
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.as_dvec3());
    x.dot(y.cross(z)).abs().cbrt()
}

/// A point that rays can come from.
pub(super) fn point(transform: &Affine3A, point: Vec3) -> Result<Vec3, Broken> {
    let p = transform.transform_point3(point);
    // Not by the largest: NaN is none.
    let fits = p.abs().cmple(Vec3::splat(MAX_COORDINATE)).all();
    fits.then_some(p).ok_or_else(|| {
        Broken(format!(
            "it is at {p}; expected coordinates within +-{MAX_COORDINATE:e}"
        ))
    })
}

/// A unit vector.
pub(super) fn direction(transform: &Affine3A, direction: Vec3) -> Result<Vec3, Broken> {
    let d = transform.transform_vector3(direction);
    // Of moderate size first: the square of a long one is no f32.
    let unit = (d / d.abs().max_element()).try_normalize();
    unit.ok_or_else(|| {
        Broken(format!(
            "its direction is {d}; is it scaled to nothing where it stands?"
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_place_or_direction_is_refused() {
        let flat = Affine3A::from_scale(Vec3::new(1.0, 1.0, 0.0));
        assert!(direction(&flat, Vec3::NEG_Z).is_err());
        assert_eq!(direction(&flat, 3.0 * Vec3::Y), Ok(Vec3::Y));
        for factor in [1e-30, 1e30] {
            let long = Affine3A::from_scale(Vec3::splat(factor));
            assert_eq!(direction(&long, Vec3::NEG_Z), Ok(Vec3::NEG_Z));
        }
        for far in [f32::NAN, f32::INFINITY, -1e19] {
            assert!(point(&Affine3A::from_translation(Vec3::splat(far)), Vec3::X).is_err());
        }
        assert!((scale(&Affine3A::from_scale(Vec3::new(-1.0, 2.0, 4.0))) - 2.0).abs() < 1e-12);
    }
}
