//! The first look: direct light and one reflection.
//!
//! A point seen by the camera is lit by one shadow ray per light. If its reflection matters, one reflection
//! ray is traced; what that hits is lit directly and reflects nothing further. The glossy lobe is then estimated
//! twice, by the lights' densities and by its own, and both are weighted by the power heuristic (Veach and
//! Guibas, "Optimally Combining Sampling Techniques for Monte Carlo Rendering", SIGGRAPH 1995): a mirror shows
//! the sun as sharply as rough metal shows its glare, and neither is counted twice.

use glam::Vec3;

use super::super::film::{CameraSample, FirstHit};
use super::super::light::{InfiniteLight, prepare};
use super::super::material::Bsdf;
use super::super::offset::RayOffset;
use super::super::sampler::{Dimension, Purpose, Sampler};
use super::super::shading::ShadedPoint;
use super::super::{RenderInput, Surfaces};
use super::{Integrator, RayCounts};
use crate::ray::Ray;
use crate::scene::Material;
use crate::surface::SurfacePoint;
use crate::trace::{Hit, Tracer};

/// Direct light and one reflection.
pub struct Beauty<'a> {
    tracer: &'a dyn Tracer,
    surfaces: &'a dyn Surfaces,
    materials: &'a [Material],
    object_materials: &'a [usize],
    lights: Vec<Box<dyn InfiniteLight>>,
    offset: RayOffset,
}

impl<'a> Beauty<'a> {
    /// Prepares the lights of `input`.
    pub fn new(input: &RenderInput<'a>) -> Self {
        Self {
            tracer: input.tracer,
            surfaces: input.surfaces,
            materials: input.materials,
            object_materials: input.object_materials,
            lights: prepare(input.lights),
            offset: RayOffset::for_scene(input.tracer.bounds().diagonal()),
        }
    }

    /// The surface at a hit, and how it scatters.
    fn surface(&self, hit: &Hit) -> (SurfacePoint, Bsdf) {
        let point = self.surfaces.point(hit);
        let material = &self.materials[self.object_materials[self.surfaces.object(hit)]];
        (point, Bsdf::new(material, point.texcoord))
    }

    /// A ray that leaves `point` upwards.
    fn ray_from(&self, point: &ShadedPoint, direction: Vec3, key: u32) -> Ray {
        let origin = self.offset.apply(point.position, point.geometric_normal);
        Ray {
            key,
            ..Ray::new(origin, direction)
        }
    }

    /// Light that comes straight from the lights. `shared` tells that the glossy lobe is also estimated by a
    /// reflection ray.
    fn direct(
        &self,
        point: &ShadedPoint,
        depth: u32,
        shared: bool,
        sampler: &Sampler,
        rays: &mut RayCounts,
    ) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for (index, light) in self.lights.iter().enumerate() {
            let dimension = Dimension::new(depth, Purpose::Light(index as u32));
            let sample = light.sample(point.shading_normal(), sampler.point(dimension));
            if sample.pdf <= 0.0 {
                continue;
            }
            let Some(f) = point.scattering(sample.direction) else {
                continue;
            };
            let part = if shared {
                power_heuristic(sample.pdf, f.specular_pdf)
            } else {
                1.0
            };
            let light = (f.diffuse + part * f.specular) * sample.radiance / sample.pdf;
            if light == Vec3::ZERO {
                continue;
            }
            let ray = self.ray_from(point, sample.direction, sampler.ray_key(dimension));
            rays.shadow += 1;
            if !self.tracer.occluded(&ray) {
                sum += light;
            }
        }
        sum
    }

    /// Light that comes by the glossy lobe: from a surface, or the lobe's own share of the lights.
    fn reflection(&self, point: &ShadedPoint, sampler: &Sampler, rays: &mut RayCounts) -> Vec3 {
        let dimension = Dimension::new(0, Purpose::Reflection);
        let Some(sample) = point.sample_specular(sampler.point(dimension)) else {
            return Vec3::ZERO;
        };
        let ray = self.ray_from(point, sample.direction, sampler.ray_key(dimension));
        rays.reflection += 1;
        let arriving = match self.tracer.intersect(&ray) {
            Some(hit) => {
                let (surface, bsdf) = self.surface(&hit);
                let seen = ShadedPoint::new(&surface, -ray.direction, bsdf.seen_in_reflection());
                self.direct(&seen, 1, false, sampler, rays)
            }
            None => self
                .lights
                .iter()
                .map(|light| {
                    let other = light.pdf(point.shading_normal(), ray.direction);
                    power_heuristic(sample.pdf, other) * light.radiance(ray.direction)
                })
                .sum(),
        };
        sample.weight * arriving
    }
}

impl Integrator for Beauty<'_> {
    fn sample(&self, camera_ray: &Ray, sampler: &Sampler, rays: &mut RayCounts) -> CameraSample {
        rays.camera += 1;
        let Some(hit) = self.tracer.intersect(camera_ray) else {
            let lights = self.lights.iter();
            let radiance = lights.map(|light| light.radiance(camera_ray.direction));
            return CameraSample::background(radiance.sum());
        };
        let (surface, bsdf) = self.surface(&hit);
        let point = ShadedPoint::new(&surface, -camera_ray.direction, bsdf);
        let reflects = point.reflects();
        let mut radiance = self.direct(&point, 0, reflects, sampler, rays);
        if reflects {
            radiance += self.reflection(&point, sampler, rays);
        }
        CameraSample {
            radiance,
            first: Some(FirstHit {
                albedo: bsdf.albedo(),
                normal: surface.shading_normal,
                position: surface.position,
                texcoord: surface.texcoord,
                displacement: surface.displacement,
                object: self.surfaces.object(&hit),
                prim: hit.prim,
            }),
        }
    }
}

/// The weight of a sample drawn with density `own` where another technique has density `other`.
fn power_heuristic(own: f32, other: f32) -> f32 {
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_weights_of_a_direction_sum_to_one() {
        for (a, b) in [(1.0, 2.0), (1e10, 0.1), (3.0, 0.0), (1e-20, 1e20)] {
            let sum = power_heuristic(a, b) + if b > 0.0 { power_heuristic(b, a) } else { 0.0 };
            assert!((sum - 1.0).abs() < 1e-6);
        }
    }
}
