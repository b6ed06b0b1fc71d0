//! Lights of mesh files, in photometric units and in the space of the file.

use glam::{Affine3A, Vec3};

use super::placing::{self, Broken};
use crate::scene::Light;

/// A light of a mesh file (KHR_lights_punctual).
#[derive(Clone, Debug, PartialEq)]
pub struct FileLight {
    /// What messages call it.
    pub name: String,
    /// How it shines.
    pub kind: FileLightKind,
    /// Linear RGB, at least 0: lux of parallel light, else candela.
    pub intensity: Vec3,
}

/// How a light shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FileLightKind {
    /// Parallel light.
    Directional {
        /// Unit vector in which it goes.
        direction: Vec3,
    },
    /// Into all directions.
    Point {
        /// Where.
        position: Vec3,
        /// Where it has faded out, above 0; infinite for light as it is.
        range: f32,
    },
    /// Into a cone.
    Spot {
        /// Where.
        position: Vec3,
        /// Unit vector along the cone's axis, away from the light.
        direction: Vec3,
        /// As of a point.
        range: f32,
        /// Half angle where it is gone, radians, up to pi / 2.
        outer: f32,
        /// Half angle within which it is full, at least 0 and below `outer`.
        inner: f32,
    },
}

impl FileLight {
    /// The light moved by `transform`, with its intensity such that what is moved along is as bright as before.
    ///
    /// # Errors
    ///
    /// Places, directions and intensities beyond what is traced.
    pub fn placed(&self, transform: &Affine3A) -> Result<Self, Broken> {
        let scale = placing::scale(transform);
        let place = |position| placing::point(transform, position);
        let turn = |direction| placing::direction(transform, direction);
        let squared = match self.kind {
            FileLightKind::Directional { .. } => 1.0,
            FileLightKind::Point { .. } | FileLightKind::Spot { .. } => scale * scale,
        };
        let intensity = (self.intensity.as_dvec3() * squared).as_vec3();
        if !intensity.is_finite() {
            return Err(Broken(format!("its intensity is {intensity}")));
        }
        let reach = |range: f32| (f64::from(range) * scale) as f32;
        let kind = match self.kind {
            FileLightKind::Directional { direction } => FileLightKind::Directional {
                direction: turn(direction)?,
            },
            FileLightKind::Point { position, range } => FileLightKind::Point {
                position: place(position)?,
                range: reach(range),
            },
            FileLightKind::Spot {
                position,
                direction,
                range,
                outer,
                inner,
            } => FileLightKind::Spot {
                position: place(position)?,
                direction: turn(direction)?,
                range: reach(range),
                outer,
                inner,
            },
        };
        Ok(Self {
            name: self.name.clone(),
            kind,
            intensity,
        })
    }

    /// Lux on surfaces around `at` that face it, whose mean square distance from there is `spread`.
    pub fn illuminance(&self, at: Vec3, spread: f64) -> f64 {
        let most = f64::from(self.intensity.max_element());
        match self.kind {
            FileLightKind::Directional { .. } => most,
            FileLightKind::Point { position, .. } | FileLightKind::Spot { position, .. } => {
                let squared = position.as_dvec3().distance_squared(at.as_dvec3()) + spread;
                if squared > 0.0 { most / squared } else { most }
            }
        }
    }

    /// The light of the scene, where one candela or lux is `scale` of its units.
    pub fn light(&self, scale: f32) -> Light {
        let intensity = self.intensity * scale;
        match self.kind {
            FileLightKind::Directional { direction } => Light::Directional {
                direction: -direction,
                irradiance: intensity,
            },
            FileLightKind::Point { position, range } => Light::Point {
                position,
                intensity,
                range,
            },
            FileLightKind::Spot {
                position,
                direction,
                range,
                outer,
                inner,
            } => {
                let [cos_outer, cos_inner] = Light::cone(outer, inner);
                Light::Spot {
                    position,
                    direction,
                    cos_outer,
                    cos_inner,
                    intensity,
                    range,
                }
            }
        }
    }
}
