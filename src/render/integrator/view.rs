//! Views: looks at something that is not light.

use glam::Vec3;

use super::super::RenderInput;
use super::super::film::CameraSample;
use super::super::sampler::Sampler;
use super::super::shading::ShadedPoint;
use super::stage::{Met, Stage};
use super::{CameraRay, Integrator, RayCounts};
use crate::prism::count_steps;
use crate::ray::Ray;
use crate::scene::View;

/// Steps that the cost view shows in red.
const RED_STEPS: f32 = 12.0;

/// One view.
pub struct Look<'a> {
    stage: Stage<'a>,
    view: View,
    diagonal: f32,
}

impl<'a> Look<'a> {
    /// The view of `input`.
    pub fn new(input: &RenderInput<'a>, view: View) -> Self {
        Self {
            stage: Stage::new(input),
            view,
            diagonal: input.tracer.bounds().diagonal().max(f32::MIN_POSITIVE),
        }
    }

    /// Steps of the march along `ray` as far as `t`, where it first hits. A ray that ends there meets nothing, so that
    /// the count is the same in whatever order a backend visits the prisms.
    fn cost(&self, ray: &Ray, t: f32) -> u32 {
        let ray = Ray { tfar: t, ..*ray };
        let (_, steps) = count_steps(|| self.stage.tracer.intersect(&ray));
        u32::try_from(steps).unwrap_or(u32::MAX)
    }

    fn show(&self, met: &Met, shaded: &ShadedPoint, cost: u32) -> Vec3 {
        let point = &met.point;
        let signed = |n: Vec3| 0.5 * (n + Vec3::ONE);
        match self.view {
            View::Normal => signed(point.shading_normal),
            View::Geometric => signed(point.geometric_normal),
            View::Uv => (point.texcoord - point.texcoord.floor()).extend(0.0),
            View::Depth => Vec3::splat(met.hit.t / self.diagonal),
            View::Albedo => shaded.bsdf().albedo(),
            View::Displacement => {
                let part = 0.5 * (100.0 * point.displacement / self.diagonal).clamp(-1.0, 1.0);
                Vec3::new(0.5 + part, 0.5 - part.abs(), 0.5 - part)
            }
            View::Prim => color_of(met.hit.prim ^ met.hit.top().rotate_left(20)),
            View::Cost => heat(cost),
        }
    }
}

impl Integrator for Look<'_> {
    fn sample(&self, camera: &CameraRay, _: &Sampler, rays: &mut RayCounts) -> CameraSample {
        rays.camera += 1;
        let met = self.stage.met_first(camera);
        let cost = match self.view {
            View::Cost => self.cost(&camera.ray, met.map_or(camera.ray.tfar, |met| met.hit.t)),
            _ => 0,
        };
        let Some(met) = met else {
            return CameraSample {
                cost,
                ..CameraSample::background(heat(cost))
            };
        };
        let point = self.stage.shade(&camera.ray, &met, met.material.ior, 0.0);
        CameraSample {
            radiance: self.show(&met, &point, cost),
            first: Some(self.stage.first_hit(&met, &point)),
            cost,
        }
    }
}

/// A colour that differs from a neighbour's: the bits of a multiplicative hash.
fn color_of(id: u32) -> Vec3 {
    let bits = id.wrapping_add(1).wrapping_mul(0x9e37_79b9);
    let bits = bits ^ bits >> 15;
    Vec3::from([0, 8, 16].map(|shift| 0.15 + 0.8 * (bits >> shift & 0xff) as f32 / 255.0))
}

/// Black, blue, red, yellow, white at 0, 1/3, 1, 7/3 and 5 times [`RED_STEPS`].
fn heat(steps: u32) -> Vec3 {
    const STOPS: [Vec3; 5] = [
        Vec3::ZERO,
        Vec3::new(0.05, 0.1, 0.6),
        Vec3::new(0.8, 0.1, 0.1),
        Vec3::new(1.0, 0.8, 0.1),
        Vec3::ONE,
    ];
    // Each part covers twice the range of the one before.
    let at = (1.0 + 3.0 * steps as f32 / RED_STEPS).log2().min(4.0);
    let stop = (at as usize).min(3);
    STOPS[stop].lerp(STOPS[stop + 1], at - stop as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heat_rises() {
        let mut last = -1.0;
        for steps in 0..100 {
            let sum = heat(steps).element_sum();
            assert!(sum >= last, "{steps}");
            last = sum;
        }
        assert_eq!(heat(0), Vec3::ZERO);
        assert_eq!([heat(60), heat(u32::MAX)], [Vec3::ONE; 2]);
    }

    #[test]
    fn neighbouring_prims_have_other_colours() {
        for id in 0..1000 {
            assert!(color_of(id).distance(color_of(id + 1)) > 0.05, "{id}");
        }
    }
}
