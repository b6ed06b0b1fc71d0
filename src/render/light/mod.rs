//! Where light comes from: far away (sun, sky, an HDR picture, parallel light, or a white world when a scene has
//! none), from shapes and points in the scene, and from surfaces that shine.

mod color;
mod cumulative;
mod environment;
mod latlong;
mod mesh;
mod point;
mod shape;
mod sky;
mod sphere_distribution;
mod sun;
mod tables;
mod white;

use glam::{Vec2, Vec3};

pub use environment::Environment;
pub use sky::Sky;
pub use sun::Sun;
pub use tables::LightTables;
pub use white::WhiteWorld;

use super::RenderInput;
use crate::ray::Ray;
use crate::surface::SurfacePoint;
use crate::trace::Hit;
use mesh::MeshLights;
use point::{DirectionalLight, PointLight};
use shape::{FlatLight, SphereLight};

/// Luminance, in kcd/m^2, of radiance 1: about that of a white wall in full sun, so that daylight exposes
/// well at exposure 0.
const KILOCANDELA_PER_UNIT: f32 = 25.0;

/// A direction that a light was sampled in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit vector towards the light.
    pub direction: Vec3,
    /// How far it is; infinite for lights outside the scene.
    pub distance: f32,
    /// Radiance from there, linear RGB; for a light without extent the irradiance of a surface that faces it.
    pub radiance: Vec3,
    /// Density of this direction per steradian, positive; 0 for a sample to be ignored.
    pub pdf: f32,
    /// Whether no other way than sampling the light finds this direction; `pdf` then is a probability.
    pub is_delta: bool,
}

impl LightSample {
    /// To be ignored.
    const NONE: Self = Self {
        direction: Vec3::Y,
        distance: 0.0,
        radiance: Vec3::ZERO,
        pdf: 0.0,
        is_delta: false,
    };

    /// From outside the scene.
    fn far(direction: Vec3, radiance: Vec3, pdf: f32) -> Self {
        Self {
            direction,
            distance: f32::INFINITY,
            radiance,
            pdf,
            is_delta: false,
        }
    }
}

/// A light infinitely far away.
pub trait InfiniteLight {
    /// Radiance that arrives from the unit vector `direction`.
    fn radiance(&self, direction: Vec3) -> Vec3;

    /// A direction for the uniform point `u`, to light a surface with the unit normal `normal`.
    ///
    /// Every direction above the surface with any radiance has a positive density.
    fn sample(&self, normal: Vec3, u: Vec2) -> LightSample;

    /// Luminance integrated over all directions.
    fn brightness(&self) -> f32;

    /// The density per steradian with which [`sample`](Self::sample) finds `direction`.
    fn pdf(&self, normal: Vec3, direction: Vec3) -> f32;
}

/// A light at some place in the scene.
trait LocalLight {
    /// A direction for the uniform point `u`, to light `position`.
    fn sample(&self, position: Vec3, u: Vec2) -> LightSample;

    /// The density per steradian with which [`sample`](Self::sample) finds `direction` from `position`.
    fn pdf(&self, position: Vec3, direction: Vec3) -> f32;

    /// Where a ray meets it, and the radiance it brings home.
    fn meet(&self, origin: Vec3, direction: Vec3) -> Option<(f32, Vec3)>;

    /// Radiant power, by luminance.
    fn power(&self) -> f32;
}

/// A point that is lit.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// Where.
    pub position: Vec3,
    /// Unit normal on the side that is lit.
    pub normal: Vec3,
}

/// All lights of a scene.
pub struct Lights<'a> {
    tables: &'a LightTables,
    meshes: Option<MeshLights<'a>>,
}

impl<'a> Lights<'a> {
    /// Those that `tables` were made of, which are in `input`.
    pub fn new(tables: &'a LightTables, input: &RenderInput<'a>) -> Self {
        let meshes = tables.meshes.as_ref();
        Self {
            meshes: meshes.map(|meshes| MeshLights::new(meshes, input)),
            tables,
        }
    }

    /// How many samples light a point.
    pub fn samples(&self) -> usize {
        if self.tables.all {
            self.tables.count()
        } else {
            1
        }
    }

    /// The sample of number `index` of a point's [`samples`](Self::samples); `u` is uniform in [0, 1)^2.
    pub fn sample(&self, index: usize, receiver: &Receiver, mut u: Vec2) -> LightSample {
        let index = if self.tables.all {
            index
        } else {
            let (index, rest) = self.tables.choice.choose(u.x);
            u.x = rest;
            index
        };
        let mut sample = self.of(index, receiver, u);
        sample.pdf *= self.tables.chance(index);
        sample
    }

    fn of(&self, index: usize, receiver: &Receiver, u: Vec2) -> LightSample {
        let LightTables {
            infinite, local, ..
        } = self.tables;
        if let Some(light) = infinite.get(index) {
            return light.sample(receiver.normal, u);
        }
        match (local.get(index - infinite.len()), &self.meshes) {
            (Some(light), _) => light.sample(receiver.position, u),
            (None, Some(meshes)) => meshes.sample(receiver.position, u),
            (None, None) => LightSample::NONE,
        }
    }

    /// All that `ray` meets of lights before `reach`, but for shining surfaces: `found` is told the distance, the
    /// radiance, and the density per steradian with which [`sample`](Self::sample) finds it from `receiver`.
    pub fn meet(
        &self,
        ray: &Ray,
        reach: f32,
        receiver: Option<&Receiver>,
        mut found: impl FnMut(f32, Vec3, f32),
    ) {
        let tables = self.tables;
        if reach == f32::INFINITY {
            for (index, light) in tables.infinite.iter().enumerate() {
                let radiance = light.radiance(ray.direction);
                if radiance != Vec3::ZERO {
                    let pdf = receiver.map_or(0.0, |r| light.pdf(r.normal, ray.direction));
                    found(reach, radiance, tables.chance(index) * pdf);
                }
            }
        }
        for (index, light) in tables.local.iter().enumerate() {
            if let Some((t, radiance)) = light.meet(ray.origin, ray.direction)
                && t < reach
            {
                let pdf = receiver.map_or(0.0, |r| light.pdf(r.position, ray.direction));
                let index = tables.infinite.len() + index;
                found(t, radiance, tables.chance(index) * pdf);
            }
        }
    }

    /// The density per steradian with which [`sample`](Self::sample) finds a shining surface from `receiver`.
    pub fn surface_pdf(&self, hit: &Hit, point: &SurfacePoint, receiver: &Receiver) -> f32 {
        let pdf = |meshes: &MeshLights| meshes.pdf(hit, point, receiver.position);
        self.meshes.as_ref().map_or(0.0, pdf) * self.tables.chance(self.tables.count() - 1)
    }
}

/// The lights infinitely far away: a match instead of a table of functions, since every sample asks one.
enum Infinite {
    Sun(Sun),
    Sky(Sky),
    Environment(Environment),
    Directional(DirectionalLight),
    White(WhiteWorld),
}

/// The lights at some place.
enum Local {
    Sphere(SphereLight),
    Flat(FlatLight),
    Point(PointLight),
}

/// What a light of any kind answers.
macro_rules! ask {
    ($self:ident, $kind:ident: $($variant:ident)*, $light:ident => $answer:expr) => {
        match $self {
            $($kind::$variant($light) => $answer,)*
        }
    };
}

macro_rules! ask_infinite {
    ($self:ident, $light:ident => $answer:expr) => {
        ask!($self, Infinite: Sun Sky Environment Directional White, $light => $answer)
    };
}

macro_rules! ask_local {
    ($self:ident, $light:ident => $answer:expr) => {
        ask!($self, Local: Sphere Flat Point, $light => $answer)
    };
}

impl InfiniteLight for Infinite {
    fn radiance(&self, direction: Vec3) -> Vec3 {
        ask_infinite!(self, light => light.radiance(direction))
    }

    fn sample(&self, normal: Vec3, u: Vec2) -> LightSample {
        ask_infinite!(self, light => light.sample(normal, u))
    }

    fn brightness(&self) -> f32 {
        ask_infinite!(self, light => light.brightness())
    }

    fn pdf(&self, normal: Vec3, direction: Vec3) -> f32 {
        ask_infinite!(self, light => light.pdf(normal, direction))
    }
}

impl LocalLight for Local {
    fn sample(&self, position: Vec3, u: Vec2) -> LightSample {
        ask_local!(self, light => light.sample(position, u))
    }

    fn pdf(&self, position: Vec3, direction: Vec3) -> f32 {
        ask_local!(self, light => light.pdf(position, direction))
    }

    fn meet(&self, origin: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
        ask_local!(self, light => light.meet(origin, direction))
    }

    fn power(&self) -> f32 {
        ask_local!(self, light => light.power())
    }
}

#[cfg(test)]
mod tests;
