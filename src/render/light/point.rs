//! Lights without an extent: point, spot and directional. Only sampling the light itself finds them.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::color::luminance;
use super::{InfiniteLight, LightSample, LocalLight};

/// A point that shines into a cone, or all around.
#[derive(Clone, Copy, Debug)]
pub struct PointLight {
    /// Where.
    pub position: Vec3,
    /// Radiant intensity, at most.
    pub intensity: Vec3,
    /// Where it has faded out; may be infinite.
    pub range: f32,
    /// None shines all around.
    pub cone: Option<Cone>,
}

/// Where a spot shines: full within `cos_inner` of the axis, gone at `cos_outer`, smooth between.
#[derive(Clone, Copy, Debug)]
pub struct Cone {
    /// Unit vector, away from the light.
    pub axis: Vec3,
    /// Cosine of the half angle where it is gone.
    pub cos_outer: f32,
    /// Cosine of the half angle within which it is full; above `cos_outer`.
    pub cos_inner: f32,
}

impl Cone {
    fn falloff(&self, direction: Vec3) -> f32 {
        let cos = self.axis.dot(direction);
        let x = ((cos - self.cos_outer) / (self.cos_inner - self.cos_outer)).clamp(0.0, 1.0);
        x * x * (3.0 - 2.0 * x)
    }
}

impl PointLight {
    /// What `range` leaves at a distance: KHR_lights_punctual, Range Property.
    fn window(&self, distance: f32) -> f32 {
        (1.0 - (distance / self.range).powi(4)).max(0.0)
    }
}

impl LocalLight for PointLight {
    fn sample(&self, position: Vec3, _u: Vec2) -> LightSample {
        let to = self.position - position;
        let distance = to.length();
        if distance == 0.0 {
            return LightSample::NONE;
        }
        let direction = to / distance;
        let cone = self.cone.map_or(1.0, |cone| cone.falloff(-direction));
        let falloff = cone * self.window(distance);
        LightSample {
            direction,
            distance,
            radiance: self.intensity * (falloff / (distance * distance)),
            pdf: if falloff > 0.0 { 1.0 } else { 0.0 },
            is_delta: true,
        }
    }

    fn pdf(&self, _position: Vec3, _direction: Vec3) -> f32 {
        0.0
    }

    fn meet(&self, _origin: Vec3, _direction: Vec3) -> Option<(f32, Vec3)> {
        None
    }

    fn power(&self) -> f32 {
        let solid_angle = self.cone.map_or(4.0 * PI, |c| {
            TAU * (1.0 - 0.5 * (c.cos_outer + c.cos_inner))
        });
        solid_angle * luminance(self.intensity)
    }
}

/// Parallel light.
#[derive(Clone, Copy, Debug)]
pub struct DirectionalLight {
    /// Unit vector towards the light.
    pub direction: Vec3,
    /// Irradiance of a surface that faces it.
    pub irradiance: Vec3,
}

impl InfiniteLight for DirectionalLight {
    fn radiance(&self, _direction: Vec3) -> Vec3 {
        Vec3::ZERO
    }

    fn sample(&self, _normal: Vec3, _u: Vec2) -> LightSample {
        LightSample {
            is_delta: true,
            ..LightSample::far(self.direction, self.irradiance, 1.0)
        }
    }

    fn pdf(&self, _normal: Vec3, _direction: Vec3) -> f32 {
        0.0
    }

    fn brightness(&self) -> f32 {
        luminance(self.irradiance)
    }
}
