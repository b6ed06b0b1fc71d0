//! What a camera ray brings home: one file per integrator.

mod ao;
mod bodies;
mod path;
mod stage;
mod view;

use super::RenderInput;
use super::bsdf::Bounce;
use super::film::CameraSample;
use super::light::LightTables;
use super::material;
use super::sampler::Sampler;
use crate::ray::Ray;
use crate::scene;
use crate::trace::Hit;

/// Rays traced, by type.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// From the camera.
    pub camera: u64,
    /// Towards a light.
    pub shadow: u64,
    /// On from a diffuse surface.
    pub diffuse: u64,
    /// Off a coat, a metal or a dielectric.
    pub reflection: u64,
    /// Through a dielectric, or back inside it.
    pub refraction: u64,
}

impl RayCounts {
    /// All rays.
    pub fn total(&self) -> u64 {
        self.camera + self.shadow + self.diffuse + self.reflection + self.refraction
    }
}

impl RayCounts {
    /// A ray that goes on from a surface.
    fn count(&mut self, bounce: Bounce) {
        let kind = match bounce {
            Bounce::Diffuse => &mut self.diffuse,
            Bounce::Glossy => &mut self.reflection,
            Bounce::Transmission => &mut self.refraction,
        };
        *kind += 1;
    }
}

impl std::ops::AddAssign for RayCounts {
    fn add_assign(&mut self, other: Self) {
        self.camera += other.camera;
        self.shadow += other.shadow;
        self.diffuse += other.diffuse;
        self.reflection += other.reflection;
        self.refraction += other.refraction;
    }
}

/// A ray from the camera, and its first hit.
#[derive(Clone, Copy, Debug)]
pub struct CameraRay {
    /// The ray.
    pub ray: Ray,
    /// What it meets first.
    pub hit: Option<Hit>,
}

/// Estimates the radiance that arrives along a camera ray.
pub trait Integrator: Sync {
    /// One estimate, and what the ray met first. `sampler` is its only randomness; this ray and the others that are traced are added to
    /// `rays`.
    fn sample(&self, camera: &CameraRay, sampler: &Sampler, rays: &mut RayCounts) -> CameraSample;
}

/// The opaque object that the camera is inside of, where no light can be.
pub fn enclosing_object(input: &RenderInput) -> Option<usize> {
    let is_dark = matches!(
        input.integrator,
        scene::Integrator::Path(_) | scene::Integrator::Beauty
    ) && input.lights.iter().all(scene::Light::is_distant)
        && !input.materials.iter().any(scene::Material::is_emissive);
    stage::Stage::new(input).enclosing_object(input.camera.position, !is_dark)
}

/// The integrator that a scene asks for, and the tables that it looks things up in. They depend on neither camera nor film.
pub enum Prepared {
    /// Paths.
    Path(path::Options, LightTables),
    /// Ambient occlusion up to this distance.
    Ao(f32),
    /// A view.
    View(scene::View),
}

impl Prepared {
    /// Makes the tables for `input`.
    pub fn new(input: &RenderInput) -> Self {
        let path = |options: path::Options| {
            material::make_tables(input.materials);
            Self::Path(options, options.tables(input))
        };
        match *input.integrator {
            scene::Integrator::Path(limits) => path(path::Options::global(limits)),
            scene::Integrator::Beauty => path(path::Options::beauty()),
            scene::Integrator::Ao { distance } => Self::Ao(distance),
            scene::Integrator::View(view) => Self::View(view),
        }
    }

    /// The integrator for `input`, which differs from that of [`Prepared::new`] in tracer, camera and film at most.
    pub fn integrator<'a>(&'a self, input: &RenderInput<'a>) -> Box<dyn Integrator + 'a> {
        match self {
            Self::Path(options, tables) => Box::new(path::Path::new(input, tables, *options)),
            Self::Ao(distance) => Box::new(ao::Ao::new(input, *distance)),
            Self::View(view) => Box::new(view::Look::new(input, *view)),
        }
    }
}

#[cfg(all(test, feature = "bvh"))]
mod tests;
