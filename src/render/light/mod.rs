//! Where light comes from. Every light of this room is infinitely far away: the sun's disk, the sky, an HDR
//! picture all around, or a white world when a scene has none.

mod color;
mod environment;
mod latlong;
mod sky;
mod sphere_distribution;
mod sun;
mod white;

use glam::{Vec2, Vec3};

pub use environment::Environment;
pub use sky::Sky;
pub use sun::Sun;
pub use white::WhiteWorld;

use crate::scene::Light;

/// Luminance, in kcd/m^2, of radiance 1: about that of a white wall in full sun, so that daylight exposes
/// well at exposure 0.
const KILOCANDELA_PER_UNIT: f32 = 25.0;

/// Turbidity of a sun without a sky.
const CLEAR: f32 = 3.0;

/// A direction that a light was sampled in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit vector towards the light.
    pub direction: Vec3,
    /// Radiance from there, linear RGB.
    pub radiance: Vec3,
    /// Density of this direction per steradian, positive; 0 for a sample to be ignored.
    pub pdf: f32,
}

/// A light infinitely far away.
pub trait InfiniteLight: Send + Sync {
    /// Radiance that arrives from the unit vector `direction`.
    fn radiance(&self, direction: Vec3) -> Vec3;

    /// A direction for the uniform point `u`, to light a surface with the unit normal `normal`.
    ///
    /// Every direction above the surface with any radiance has a positive density.
    fn sample(&self, normal: Vec3, u: Vec2) -> LightSample;

    /// The density per steradian with which [`sample`](Self::sample) finds `direction`.
    fn pdf(&self, normal: Vec3, direction: Vec3) -> f32;
}

/// The lights of a scene, ready to be sampled; a white world of radiance 1 if it has none.
///
/// A sun is seen through the air of the first sky, or through clear air.
pub fn prepare(lights: &[Light]) -> Vec<Box<dyn InfiniteLight>> {
    if lights.is_empty() {
        return vec![Box::new(WhiteWorld)];
    }
    let air = lights
        .iter()
        .find_map(|light| match light {
            Light::Sky { turbidity, .. } => Some(*turbidity),
            _ => None,
        })
        .unwrap_or(CLEAR);
    lights.iter().map(|light| one(light, air)).collect()
}

fn one(light: &Light, air: f32) -> Box<dyn InfiniteLight> {
    match light {
        Light::Sun {
            direction,
            strength,
        } => Box::new(Sun::new(*direction, air, *strength)),
        Light::Sky {
            sun_direction,
            turbidity,
            strength,
        } => Box::new(Sky::new(*sun_direction, *turbidity, *strength)),
        Light::Environment {
            image,
            rotation,
            strength,
        } => Box::new(Environment::new(image.clone(), *rotation, *strength)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_without_lights_is_white() {
        let lights = prepare(&[]);
        assert_eq!(lights.len(), 1);
        assert_eq!(lights[0].radiance(Vec3::NEG_Y), Vec3::ONE);
    }

    /// The law of every light: the mean of radiance * cos / pdf over samples is the irradiance that a fine
    /// grid of directions finds, and the density of a sample is what `pdf` says, but for samples on the
    /// border of two cells.
    #[test]
    fn sampled_irradiance_is_the_integral_of_radiance() {
        let direction = Vec3::new(0.3, 0.8, 0.1).normalize();
        let sky = Sky::new(direction, 4.0, 1.0);
        let normal = Vec3::new(0.2, 0.9, -0.3).normalize();
        let grid = 600;
        let mut expected = Vec3::ZERO;
        for row in 0..grid {
            for column in 0..2 * grid {
                let uv = Vec2::new(column as f32 + 0.5, row as f32 + 0.5) / grid as f32;
                let theta = std::f32::consts::PI * uv.y;
                let d = latlong::direction(Vec2::new(0.5 * uv.x, theta.cos()));
                let solid_angle = (std::f32::consts::PI / grid as f32).powi(2) * theta.sin();
                expected += sky.radiance(d) * d.dot(normal).max(0.0) * solid_angle;
            }
        }
        let n = 40_000;
        let mut sum = Vec3::ZERO;
        let mut on_borders = 0;
        for i in 0..n {
            let u = Vec2::new(i as f32 / n as f32, (i as f32 * 0.618_034).fract());
            let s = sky.sample(normal, u);
            on_borders += u32::from((s.pdf - sky.pdf(normal, s.direction)).abs() > 1e-3 * s.pdf);
            sum += s.radiance * s.direction.dot(normal).max(0.0) / s.pdf;
        }
        assert!(on_borders < n / 500, "{on_borders}");
        let measured = sum / n as f32;
        assert!(
            (measured / expected - 1.0).abs().max_element() < 0.01,
            "{measured} {expected}"
        );
    }
}
