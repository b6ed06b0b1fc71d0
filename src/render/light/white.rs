//! A world that is white all around: what a scene without lights is lit by.

use std::f32::consts::{FRAC_1_PI, PI};

use glam::{Vec2, Vec3};

use super::{InfiniteLight, LightSample};
use crate::render::basis::Basis;
use crate::render::bsdf::cosine_hemisphere;

/// Radiance 1 from everywhere.
#[derive(Clone, Copy, Debug)]
pub struct WhiteWorld;

impl InfiniteLight for WhiteWorld {
    fn radiance(&self, _direction: Vec3) -> Vec3 {
        Vec3::ONE
    }

    /// Cosine-weighted around the normal (Malley's method), so that an unoccluded diffuse surface shows no
    /// noise at all.
    fn sample(&self, normal: Vec3, u: Vec2) -> LightSample {
        let local = cosine_hemisphere(u);
        let direction = Basis::around(normal).to_world(local);
        LightSample::far(direction, Vec3::ONE, local.z * FRAC_1_PI)
    }

    fn brightness(&self) -> f32 {
        4.0 * PI
    }

    fn pdf(&self, normal: Vec3, direction: Vec3) -> f32 {
        normal.dot(direction).max(0.0) * FRAC_1_PI
    }
}
