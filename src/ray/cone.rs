//! The cone around a ray: how much of a surface one pixel sees.

use glam::Vec3;

use super::Ray;

/// How wide the bundle of rays is for which one ray stands.
///
/// Akenine-Möller et al., "Texture Level of Detail Strategies for Real-Time Ray Tracing", Ray Tracing Gems, chapter 20, 2019:
/// two numbers instead of Igehy's ray differentials ("Tracing Ray Differentials", SIGGRAPH 1999).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cone {
    /// Width at the ray's origin, world units.
    pub width: f32,
    /// Growth of the width per unit of length: the angle, in radians, between the cone's sides.
    pub spread: f32,
}

impl Cone {
    /// The cone of a camera ray: a point at the eye.
    pub fn from_eye(spread: f32) -> Self {
        Self { width: 0.0, spread }
    }

    /// The width at parameter `t` of `ray`, world units.
    pub fn width_at(&self, ray: &Ray, t: f32) -> f32 {
        self.width + self.spread * t * ray.direction.length()
    }

    /// The cone of a ray that goes on from where `ray` has met something flat at `t`.
    pub fn continued(&self, ray: &Ray, t: f32) -> Self {
        Self {
            width: self.width_at(ray, t),
            ..*self
        }
    }

    /// What it sees at parameter `t` of `ray`.
    pub fn footprint(&self, ray: &Ray, t: f32) -> Footprint {
        Footprint {
            direction: ray.direction,
            width: self.width_at(ray, t),
        }
    }
}

/// What a cone sees where it meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Along the ray, any length but 0.
    pub direction: Vec3,
    /// Across the ray.
    pub width: f32,
}
