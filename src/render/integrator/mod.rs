//! What a camera ray brings home. One integrator so far; the next ones stand beside it.

mod beauty;

pub use beauty::Beauty;

use super::film::CameraSample;
use super::sampler::Sampler;
use crate::ray::Ray;

/// Rays traced, by type.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// From the camera.
    pub camera: u64,
    /// Towards a light.
    pub shadow: u64,
    /// Off a surface.
    pub reflection: u64,
}

impl RayCounts {
    /// All rays.
    pub fn total(&self) -> u64 {
        self.camera + self.shadow + self.reflection
    }
}

impl std::ops::AddAssign for RayCounts {
    fn add_assign(&mut self, other: Self) {
        self.camera += other.camera;
        self.shadow += other.shadow;
        self.reflection += other.reflection;
    }
}

/// Estimates the radiance that arrives along a camera ray.
pub trait Integrator: Sync {
    /// One estimate, and what the ray met first. `sampler` is its only randomness; the rays it traces are added to `rays`.
    fn sample(&self, camera_ray: &Ray, sampler: &Sampler, rays: &mut RayCounts) -> CameraSample;
}
