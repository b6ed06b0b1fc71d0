//! A world that is white all around: what a scene without lights is lit by.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::{Vec2, Vec3};

use super::{InfiniteLight, LightSample};
use crate::render::basis::Basis;

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
        let (sin, cos) = (TAU * u.x).sin_cos();
        let radius = u.y.sqrt();
        let height = (1.0 - u.y).sqrt();
        LightSample {
            direction: Basis::around(normal).to_world(Vec3::new(
                radius * cos,
                radius * sin,
                height,
            )),
            radiance: Vec3::ONE,
            pdf: height * FRAC_1_PI,
        }
    }

    fn pdf(&self, normal: Vec3, direction: Vec3) -> f32 {
        normal.dot(direction).max(0.0) * FRAC_1_PI
    }
}
