//! The first look: direct light and one reflection.
//!
//! A point seen by the camera is lit by one shadow ray per light. If its reflection matters, one reflection
//! ray is traced; what that hits is lit directly and reflects nothing further. The glossy lobe is then estimated
//! twice, by the lights' densities and by its own, and both are weighted by the power heuristic (Veach and
//! Guibas, "Optimally Combining Sampling Techniques for Monte Carlo Rendering", SIGGRAPH 1995): a mirror shows
//! the sun as sharply as rough metal shows its glare, and neither is counted twice.

use glam::Vec3;

use super::super::light::{InfiniteLight, prepare};
use super::super::material::Bsdf;
use super::super::sampler::{Dimension, Purpose, Sampler};
use super::super::shading::ShadedPoint;
use super::super::{RenderInput, Surfaces};
use super::{Integrator, RayCounts};
use crate::ray::{Cone, Ray};
use crate::scene::Material;
use crate::trace::{Hit, RayOffset, Tracer};

/// Direct light and one reflection.
pub struct Beauty<'a> {
    tracer: &'a dyn Tracer,
    surfaces: &'a dyn Surfaces,
    materials: &'a [Material],
    object_materials: &'a [usize],
    lights: Vec<Box<dyn InfiniteLight>>,
    offset: RayOffset,
    /// Of camera rays.
    cone: Cone,
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
            cone: Cone::from_eye(input.camera.pixel_spread(input.film.height)),
        }
    }

    /// The hit of `ray`, ready for shading. `adapt` may change its material.
    fn shaded(&self, ray: &Ray, cone: &Cone, hit: &Hit, adapt: fn(Bsdf) -> Bsdf) -> ShadedPoint {
        let point = self.surfaces.point(hit, ray, cone);
        let material = &self.materials[self.object_materials[self.surfaces.object(hit)]];
        let bsdf = adapt(Bsdf::new(material, point.texcoord));
        ShadedPoint::new(&point, -ray.direction, bsdf)
    }

    /// A ray that leaves `point` upwards.
    fn ray_from(&self, point: &ShadedPoint, direction: Vec3, key: u32) -> Ray {
        let normal = point.geometric_normal;
        let start = point.position + point.tolerance * normal;
        let origin = self.offset.apply(start, normal);
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
    /// `cone` is the reflected ray's.
    fn reflection(
        &self,
        point: &ShadedPoint,
        cone: &Cone,
        sampler: &Sampler,
        rays: &mut RayCounts,
    ) -> Vec3 {
        let dimension = Dimension::new(0, Purpose::Reflection);
        let Some(sample) = point.sample_specular(sampler.point(dimension)) else {
            return Vec3::ZERO;
        };
        let ray = self.ray_from(point, sample.direction, sampler.ray_key(dimension));
        rays.reflection += 1;
        let arriving = match self.tracer.intersect(&ray) {
            Some(hit) => {
                let seen = self.shaded(&ray, cone, &hit, Bsdf::seen_in_reflection);
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
    fn radiance(&self, camera_ray: &Ray, sampler: &Sampler, rays: &mut RayCounts) -> Vec3 {
        rays.camera += 1;
        let Some(hit) = self.tracer.intersect(camera_ray) else {
            return self
                .lights
                .iter()
                .map(|light| light.radiance(camera_ray.direction))
                .sum();
        };
        let point = self.shaded(camera_ray, &self.cone, &hit, |bsdf| bsdf);
        let reflects = point.reflects();
        let direct = self.direct(&point, 0, reflects, sampler, rays);
        if !reflects {
            return direct;
        }
        let cone = self.cone.continued(camera_ray, hit.t);
        direct + self.reflection(&point, &cone, sampler, rays)
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
