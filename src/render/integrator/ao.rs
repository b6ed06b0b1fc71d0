//! Ambient occlusion: how open a place is.

use glam::Vec3;

use super::super::RenderInput;
use super::super::basis::Basis;
use super::super::bsdf::cosine_hemisphere;
use super::super::film::CameraSample;
use super::super::sampler::{Dimension, Purpose, Sampler};
use super::stage::Stage;
use super::{CameraRay, Integrator, RayCounts};
use crate::ray::Ray;

/// One ray per sample over the hemisphere of the smooth normal, weighted by the cosine; white where it meets nothing
/// within a distance. The background is white.
pub struct Ao<'a> {
    stage: Stage<'a>,
    distance: f32,
}

impl<'a> Ao<'a> {
    /// Rays of this length, world units.
    pub fn new(input: &RenderInput<'a>, distance: f32) -> Self {
        Self {
            stage: Stage::new(input),
            distance,
        }
    }
}

impl Integrator for Ao<'_> {
    fn sample(&self, camera: &CameraRay, sampler: &Sampler, rays: &mut RayCounts) -> CameraSample {
        rays.camera += 1;
        let Some(met) = self.stage.met_first(camera) else {
            return CameraSample::background(Vec3::ONE);
        };
        let point = self.stage.shade(&camera.ray, &met, 1.0, 0.0);
        let dimension = Dimension::new(0, Purpose::Bounce);
        let local = cosine_hemisphere(sampler.point(dimension));
        let direction = Basis::around(point.shading_normal()).to_world(local);
        let mut open = 0.0;
        if point.geometric_normal.dot(direction) > 0.0 {
            let key = sampler.ray_key(dimension);
            let ray = Ray {
                tfar: self.distance,
                ..self.stage.ray_from(&met.point, direction, key)
            };
            rays.shadow += 1;
            open = self.stage.visibility(ray);
        }
        CameraSample {
            radiance: Vec3::splat(open),
            first: Some(self.stage.first_hit(&met, &point)),
            cost: 0,
        }
    }
}
