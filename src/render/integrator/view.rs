//! Views: looks at something that is not light.

use std::time::Instant;

use glam::Vec3;

use super::super::RenderInput;
use super::super::film::CameraSample;
use super::super::sampler::Sampler;
use super::super::shading::ShadedPoint;
use super::stage::{Met, Stage};
use super::{Integrator, RayCounts};
use crate::ray::Ray;
use crate::scene::View;

/// Traces of one ray for its cost; the quickest counts, since others may have been interrupted.
const TRIALS: usize = 3;

/// The cost view's scale: black at none, red at about one, white at many times this, microseconds.
const COST_UNIT: f32 = 4.0;

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

    /// Wall-clock microseconds of tracing `ray` to its first hit.
    fn cost(&self, ray: &Ray) -> f32 {
        let trial = |_| {
            let start = Instant::now();
            std::hint::black_box(self.stage.tracer.intersect(ray));
            start.elapsed().as_secs_f32() * 1e6
        };
        (0..TRIALS).map(trial).fold(f32::INFINITY, f32::min)
    }

    fn show(&self, ray: &Ray, met: &Met, shaded: &ShadedPoint) -> Vec3 {
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
            View::Cost => heat(self.cost(ray) / COST_UNIT),
        }
    }
}

impl Integrator for Look<'_> {
    fn sample(&self, camera_ray: &Ray, _: &Sampler, rays: &mut RayCounts) -> CameraSample {
        rays.camera += 1;
        let Some(met) = self.stage.meet(camera_ray, &self.stage.cone) else {
            return CameraSample::background(match self.view {
                View::Cost => heat(self.cost(camera_ray) / COST_UNIT),
                _ => Vec3::ZERO,
            });
        };
        let point = self.stage.shade(camera_ray, &met, met.material.ior, 0.0);
        CameraSample {
            radiance: self.show(camera_ray, &met, &point),
            first: Some(self.stage.first_hit(&met, &point)),
        }
    }
}

/// A colour that differs from a neighbour's: the bits of a multiplicative hash.
fn color_of(id: u32) -> Vec3 {
    let bits = id.wrapping_add(1).wrapping_mul(0x9e37_79b9);
    let bits = bits ^ bits >> 15;
    Vec3::from([0, 8, 16].map(|shift| 0.15 + 0.8 * (bits >> shift & 0xff) as f32 / 255.0))
}

/// Black, blue, red, yellow, white for 0, and on by doubling from 1/4.
fn heat(x: f32) -> Vec3 {
    const STOPS: [Vec3; 5] = [
        Vec3::ZERO,
        Vec3::new(0.05, 0.1, 0.6),
        Vec3::new(0.8, 0.1, 0.1),
        Vec3::new(1.0, 0.8, 0.1),
        Vec3::ONE,
    ];
    // 0, 1/3, 1, 7/3, 5: each step covers twice the range of the one before.
    let at = ((1.0 + 3.0 * x.max(0.0)).log2()).min(4.0);
    let stop = (at as usize).min(3);
    STOPS[stop].lerp(STOPS[stop + 1], at - stop as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heat_rises() {
        let mut last = -1.0;
        for i in 0..100 {
            let sum = heat(0.1 * i as f32).element_sum();
            assert!(sum >= last, "{i}");
            last = sum;
        }
        assert_eq!((heat(0.0), heat(5.0)), (Vec3::ZERO, Vec3::ONE));
    }

    #[test]
    fn neighbouring_prims_have_other_colours() {
        for id in 0..1000 {
            assert!(color_of(id).distance(color_of(id + 1)) > 0.05, "{id}");
        }
    }
}
