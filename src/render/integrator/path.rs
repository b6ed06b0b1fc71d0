//! Path tracing: light is sampled at every point (next-event estimation), and paths go on by the material.
//!
//! Both techniques find the same light; the power heuristic weighs them (Veach and Guibas, "Optimally Combining
//! Sampling Techniques for Monte Carlo Rendering", SIGGRAPH 1995). A kind of bounce whose limit is reached is lit by
//! sampling lights alone, with full weight, so a limit cuts paths and never direct light. The paper's first look
//! (`beauty`) is such a set of limits: no diffuse bounce, one reflection, refraction.

use glam::Vec3;

use super::super::RenderInput;
use super::super::bsdf::{Allowed, Bounce, SMOOTHEST_WHEN_LAST};
use super::super::film::{CameraSample, FirstHit};
use super::super::light::{LightTables, Lights, Receiver};
use super::super::material;
use super::super::sampler::{Dimension, Purpose, Sampler};
use super::super::shading::ShadedPoint;
use super::bodies::Bodies;
use super::stage::{Met, Stage};
use super::{CameraRay, Integrator, RayCounts};
use crate::ray::{Cone, Ray};
use crate::scene::{Material, PathLimits};
use crate::trace::Hit;

/// Most surfaces along a path, holes and hidden boundaries included.
const MOST_CROSSINGS: u32 = 1024;

/// Glossy bounces that return less than this part of light are not traced in the first look.
const NEGLIGIBLE_GLOSS: f32 = 0.01;

/// Roulette lets a path live at most with this probability, so that every path ends.
const LONGEST_LIFE: f32 = 0.95;

/// The weights of a light sample and of a material sample, by the densities of both for the same direction.
pub type Heuristic = fn(light: f32, material: f32) -> [f32; 2];

/// How paths are made.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    limits: PathLimits,
    /// Every light is sampled at every point, and dull reflections are left to that.
    preview: bool,
    /// How both techniques are weighed.
    heuristic: Heuristic,
}

impl Options {
    /// Global illumination.
    pub fn global(limits: PathLimits) -> Self {
        Self {
            limits,
            preview: false,
            heuristic: power_heuristic,
        }
    }

    /// The paper's first look: primary, shadow, reflection and refraction rays.
    pub fn beauty() -> Self {
        Self {
            limits: PathLimits {
                diffuse: 0,
                glossy: 1,
                transmission: 16,
                roulette: u32::MAX,
            },
            preview: true,
            heuristic: power_heuristic,
        }
    }

    /// The lights of `input` for such paths.
    pub fn tables(&self, input: &RenderInput) -> LightTables {
        LightTables::new(input, self.preview)
    }

    /// The same with other weights.
    #[cfg(all(test, feature = "bvh"))]
    pub fn weighed(self, heuristic: Heuristic) -> Self {
        Self { heuristic, ..self }
    }
}

/// The path tracer.
pub struct Path<'a> {
    stage: Stage<'a>,
    lights: Lights<'a>,
    materials: &'a [Material],
    options: Options,
    /// The bodies that the camera is in.
    around_camera: Bodies,
}

/// A path on its way.
struct Walk<'s, 'r> {
    ray: Ray,
    /// Its first hit, where that is known already.
    known: Option<Option<Hit>>,
    /// Around it.
    cone: Cone,
    /// Radiance found so far, and what more of it counts.
    radiance: Vec3,
    throughput: Vec3,
    /// Product of the squared relative indices: radiance in glass is larger than what leaves it.
    index_scale: f32,
    bodies: Bodies,
    /// The point that the ray left and the density it was drawn with; none for the camera and smooth interfaces.
    departure: Option<(Receiver, f32)>,
    bounces: Bounces,
    /// Surfaces met.
    crossings: u32,
    /// The first of them that was neither a hole nor a hidden boundary.
    first: Option<FirstHit>,
    sampler: &'s Sampler,
    rays: &'r mut RayCounts,
}

/// Bounces so far, by their kind.
#[derive(Clone, Copy, Debug, Default)]
struct Bounces {
    diffuse: u32,
    glossy: u32,
    transmission: u32,
}

impl<'a> Path<'a> {
    /// Paths through `input`, whose lights `tables` are [made of](Options::tables).
    pub fn new(input: &RenderInput<'a>, tables: &'a LightTables, options: Options) -> Self {
        let stage = Stage::new(input);
        Self {
            stage,
            lights: Lights::new(tables, input),
            materials: input.materials,
            options,
            around_camera: stage.bodies_at(input.camera.position),
        }
    }

    /// One step: to the next surface, its light, and on. False where the path ends.
    fn step(&self, walk: &mut Walk) -> bool {
        let met = match walk.known.take() {
            Some(hit) => hit.map(|hit| self.stage.met(hit, &walk.ray, &walk.cone)),
            None => self.stage.meet(&walk.ray, &walk.cone),
        };
        let reach = met.map_or(f32::INFINITY, |m| m.hit.t);
        self.meet_lights(walk, reach);
        let Some(met) = met else {
            return false;
        };
        walk.throughput *= walk.bodies.transmittance(self.materials, reach);
        walk.crossings += 1;
        if self.stage.slips(&met, walk.crossings, walk.sampler) {
            self.pass(walk, &met);
            return true;
        }
        let mut eta = 1.0;
        let mut beyond = walk.bodies;
        if met.material.is_transmissive() {
            let crossing = walk
                .bodies
                .cross(self.materials, met.index, met.from_outside);
            beyond = crossing.beyond;
            let Some(there) = crossing.eta else {
                walk.bodies = beyond;
                self.pass(walk, &met);
                return true;
            };
            eta = there;
        }
        self.emission(walk, &met);
        let (point, allowed) = self.shade(walk, &met, eta);
        if walk.first.is_none() {
            walk.first = Some(self.stage.first_hit(&met, &point));
        }
        self.direct(walk, &met, &point, allowed);
        self.go_on(walk, &met, &point, allowed, beyond)
    }

    /// Goes straight on.
    fn pass(&self, walk: &mut Walk, met: &Met) {
        walk.cone = walk.cone.continued(&walk.ray, met.hit.t);
        walk.ray = self.stage.beyond(&walk.ray, met);
    }

    /// Lights that the ray meets on its way.
    fn meet_lights(&self, walk: &mut Walk, reach: f32) {
        let receiver = walk.departure.as_ref().map(|(receiver, _)| receiver);
        let mut sum = Vec3::ZERO;
        self.lights
            .meet(&walk.ray, reach, receiver, |t, radiance, pdf| {
                let weight = self.arriving_weight(walk.departure.as_ref(), pdf);
                sum += weight * radiance * walk.bodies.transmittance(self.materials, t);
            });
        walk.radiance += walk.throughput * sum;
    }

    /// The weight of light that the last ray found by itself, where sampling lights has density `pdf`.
    fn arriving_weight(&self, departure: Option<&(Receiver, f32)>, pdf: f32) -> f32 {
        departure.map_or(1.0, |&(_, own)| (self.options.heuristic)(pdf, own)[1])
    }

    fn emission(&self, walk: &mut Walk, met: &Met) {
        let emitted = material::emission(met.material, &met.point);
        if emitted != Vec3::ZERO {
            let pdf = walk.departure.as_ref().map_or(0.0, |(receiver, _)| {
                self.lights.surface_pdf(&met.hit, &met.point, receiver)
            });
            walk.radiance +=
                walk.throughput * emitted * self.arriving_weight(walk.departure.as_ref(), pdf);
        }
    }

    /// The surface, and the bounces that the path may still make there.
    fn shade(&self, walk: &Walk, met: &Met, eta: f32) -> (ShadedPoint, Allowed) {
        let limits = &self.options.limits;
        let mut allowed = Allowed {
            diffuse: walk.bounces.diffuse < limits.diffuse,
            glossy: walk.bounces.glossy < limits.glossy,
            transmission: walk.bounces.transmission < limits.transmission,
        };
        // A mirror lit by sampling lights alone would be noise: it is blurred.
        let least_alpha = if allowed.glossy {
            0.0
        } else {
            SMOOTHEST_WHEN_LAST
        };
        let point = self.stage.shade(&walk.ray, met, eta, least_alpha);
        if self.options.preview && point.bsdf().gloss() < NEGLIGIBLE_GLOSS {
            allowed.glossy = false;
        }
        (point, allowed)
    }

    /// Light that comes straight from the lights.
    fn direct(&self, walk: &mut Walk, met: &Met, point: &ShadedPoint, allowed: Allowed) {
        let receiver = point.receiver();
        let depth = walk.bounces.total();
        let mut sum = Vec3::ZERO;
        for index in 0..self.lights.samples() {
            let dimension = Dimension::new(depth, Purpose::Light(index as u32));
            let u = walk.sampler.point(dimension);
            let sample = self.lights.sample(index, &receiver, u);
            if sample.pdf <= 0.0 {
                continue;
            }
            let Some(f) = point.scattering(sample.direction, allowed) else {
                continue;
            };
            let bounced = f.part(allowed);
            let weight = if sample.is_delta {
                1.0
            } else {
                (self.options.heuristic)(sample.pdf, f.pdf)[0]
            };
            let light = (f.total() - bounced + weight * bounced) * sample.radiance / sample.pdf;
            if light == Vec3::ZERO {
                continue;
            }
            let ray = Ray {
                tfar: sample.distance * (1.0 - 1e-4),
                ..self.stage.ray_from(
                    &met.point,
                    sample.direction,
                    walk.sampler.ray_key(dimension),
                )
            };
            walk.rays.shadow += 1;
            let absorbed = walk.bodies.transmittance(self.materials, sample.distance);
            sum += light * absorbed * self.stage.visibility(ray);
        }
        walk.radiance += walk.throughput * sum;
    }

    /// The next ray; false where there is none.
    fn go_on(
        &self,
        walk: &mut Walk,
        met: &Met,
        point: &ShadedPoint,
        allowed: Allowed,
        beyond: Bodies,
    ) -> bool {
        let depth = walk.bounces.total();
        let [lobe, dimension] = [Purpose::Lobe, Purpose::Bounce].map(|p| Dimension::new(depth, p));
        let choice = walk.sampler.point(lobe);
        let u = walk.sampler.point(dimension);
        let Some(next) = point.sample(choice.x, u, allowed) else {
            return false;
        };
        if next.weight == Vec3::ZERO {
            return false;
        }
        walk.throughput *= next.weight;
        walk.bounces.add(next.bounce);
        if point.geometric_normal.dot(next.direction) < 0.0 {
            walk.bodies = beyond;
            walk.index_scale *= point.bsdf().eta().powi(2);
        }
        if walk.bounces.total() > self.options.limits.roulette {
            let life = (walk.throughput.max_element() * walk.index_scale).min(LONGEST_LIFE);
            if choice.y >= life {
                return false;
            }
            walk.throughput /= life;
        }
        walk.departure = next.pdf.map(|pdf| (point.receiver(), pdf));
        let key = walk.sampler.ray_key(dimension);
        walk.cone = walk.cone.continued(&walk.ray, met.hit.t);
        walk.ray = self.stage.ray_from(&met.point, next.direction, key);
        walk.rays.count(next.bounce);
        true
    }
}

impl Integrator for Path<'_> {
    fn sample(&self, camera: &CameraRay, sampler: &Sampler, rays: &mut RayCounts) -> CameraSample {
        rays.camera += 1;
        let mut walk = Walk {
            ray: camera.ray,
            known: Some(camera.hit),
            cone: self.stage.cone,
            radiance: Vec3::ZERO,
            throughput: Vec3::ONE,
            index_scale: 1.0,
            bodies: self.around_camera,
            departure: None,
            bounces: Bounces::default(),
            crossings: 0,
            first: None,
            sampler,
            rays,
        };
        while walk.crossings < MOST_CROSSINGS && self.step(&mut walk) {}
        CameraSample {
            radiance: walk.radiance,
            first: walk.first,
            cost: 0,
        }
    }
}

impl Bounces {
    fn total(self) -> u32 {
        self.diffuse + self.glossy + self.transmission
    }

    fn add(&mut self, bounce: Bounce) {
        match bounce {
            Bounce::Diffuse => self.diffuse += 1,
            Bounce::Glossy => self.glossy += 1,
            Bounce::Transmission => self.transmission += 1,
        }
    }
}

#[cfg(test)]
impl Path<'_> {
    /// A camera ray of this path's scene.
    pub fn camera_ray(&self, ray: Ray) -> CameraRay {
        CameraRay {
            ray,
            hit: self.stage.tracer.intersect(&ray),
        }
    }
}

/// Veach and Guibas' power heuristic with exponent 2.
fn power_heuristic(light: f32, material: f32) -> [f32; 2] {
    let weight = |own: f32, other: f32| {
        let ratio = other / own;
        1.0 / (1.0 + ratio * ratio)
    };
    [weight(light, material), weight(material, light)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_weights_of_a_direction_sum_to_one() {
        for (a, b) in [
            (1.0, 2.0),
            (1e10, 0.1),
            (3.0, 0.0),
            (0.0, 3.0),
            (1e-20, 1e20),
        ] {
            let [light, material] = power_heuristic(a, b);
            assert!((light + material - 1.0).abs() < 1e-6);
        }
    }
}
