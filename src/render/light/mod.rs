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
mod white;

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

pub use environment::Environment;
pub use sky::Sky;
pub use sun::Sun;
pub use white::WhiteWorld;

use super::RenderInput;
use crate::ray::Ray;
use crate::scene::Light;
use crate::surface::SurfacePoint;
use crate::trace::Hit;
use cumulative::Cumulative;
use mesh::MeshLights;
use point::{Cone, DirectionalLight, PointLight};
use shape::{FlatLight, SphereLight};

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
    infinite: Vec<Infinite>,
    local: Vec<Local>,
    meshes: Option<MeshLights<'a>>,
    choice: Cumulative,
    /// Whether each point is lit by all of them, or by one.
    all: bool,
}

impl<'a> Lights<'a> {
    /// The lights of `input`, ready to be sampled: all at each point, or one that is chosen by its power. A scene
    /// without any is lit by a white world of radiance 1.
    ///
    /// A sun is seen through the air of the first sky, or through clear air.
    pub fn new(input: &RenderInput<'a>, all: bool) -> Self {
        let meshes = MeshLights::new(input);
        let air = input.lights.iter().find_map(|light| match light {
            Light::Sky { turbidity, .. } => Some(*turbidity),
            _ => None,
        });
        let (mut infinite, mut local) = (Vec::new(), Vec::new());
        for light in input.lights {
            match one(light, air.unwrap_or(CLEAR)) {
                Prepared::Infinite(light) => infinite.push(light),
                Prepared::Local(light) => local.push(light),
            }
        }
        if input.lights.is_empty() && meshes.is_none() {
            infinite.push(Infinite::White(WhiteWorld));
        }
        let radius = 0.5 * input.tracer.bounds().diagonal();
        // What a light from afar sends through the disk that the scene shows it.
        let disk = if radius.is_finite() && radius > 0.0 {
            PI * radius * radius
        } else {
            1.0
        };
        let powers: Vec<f64> = infinite
            .iter()
            .map(|light| disk * light.brightness())
            .chain(local.iter().map(|light| light.power()))
            .chain(meshes.iter().map(MeshLights::power))
            .map(f64::from)
            .collect();
        Self {
            infinite,
            local,
            meshes,
            choice: Cumulative::new(powers.into_iter()),
            all,
        }
    }

    /// How many samples light a point.
    pub fn samples(&self) -> usize {
        if self.all { self.count() } else { 1 }
    }

    fn count(&self) -> usize {
        self.infinite.len() + self.local.len() + usize::from(self.meshes.is_some())
    }

    /// The sample of number `index` of a point's [`samples`](Self::samples); `u` is uniform in [0, 1)^2.
    pub fn sample(&self, index: usize, receiver: &Receiver, mut u: Vec2) -> LightSample {
        let index = if self.all {
            index
        } else {
            let (index, rest) = self.choice.choose(u.x);
            u.x = rest;
            index
        };
        let mut sample = self.of(index, receiver, u);
        sample.pdf *= self.chance(index);
        sample
    }

    fn of(&self, index: usize, receiver: &Receiver, u: Vec2) -> LightSample {
        if let Some(light) = self.infinite.get(index) {
            return light.sample(receiver.normal, u);
        }
        match (self.local.get(index - self.infinite.len()), &self.meshes) {
            (Some(light), _) => light.sample(receiver.position, u),
            (None, Some(meshes)) => meshes.sample(receiver.position, u),
            (None, None) => LightSample::NONE,
        }
    }

    fn chance(&self, index: usize) -> f32 {
        if self.all {
            1.0
        } else {
            self.choice.probability(index)
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
        if reach == f32::INFINITY {
            for (index, light) in self.infinite.iter().enumerate() {
                let radiance = light.radiance(ray.direction);
                if radiance != Vec3::ZERO {
                    let pdf = receiver.map_or(0.0, |r| light.pdf(r.normal, ray.direction));
                    found(reach, radiance, self.chance(index) * pdf);
                }
            }
        }
        for (index, light) in self.local.iter().enumerate() {
            if let Some((t, radiance)) = light.meet(ray.origin, ray.direction)
                && t < reach
            {
                let pdf = receiver.map_or(0.0, |r| light.pdf(r.position, ray.direction));
                found(t, radiance, self.chance(self.infinite.len() + index) * pdf);
            }
        }
    }

    /// The density per steradian with which [`sample`](Self::sample) finds a shining surface from `receiver`.
    pub fn surface_pdf(&self, hit: &Hit, point: &SurfacePoint, receiver: &Receiver) -> f32 {
        let pdf = |meshes: &MeshLights| meshes.pdf(hit, point, receiver.position);
        self.meshes.as_ref().map_or(0.0, pdf) * self.chance(self.count() - 1)
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

/// A light ready to be sampled.
enum Prepared {
    Infinite(Infinite),
    Local(Local),
}

fn one(light: &Light, air: f32) -> Prepared {
    match *light {
        Light::Sun {
            direction,
            strength,
        } => Prepared::Infinite(Infinite::Sun(Sun::new(direction, air, strength))),
        Light::Sky {
            sun_direction,
            turbidity,
            strength,
        } => Prepared::Infinite(Infinite::Sky(Sky::new(sun_direction, turbidity, strength))),
        Light::Environment {
            ref image,
            rotation,
            strength,
        } => Prepared::Infinite(Infinite::Environment(Environment::new(
            image.clone(),
            rotation,
            strength,
        ))),
        Light::Directional {
            direction,
            irradiance,
        } => Prepared::Infinite(Infinite::Directional(DirectionalLight {
            direction,
            irradiance,
        })),
        Light::Sphere {
            center,
            radius,
            radiance,
        } => Prepared::Local(Local::Sphere(SphereLight {
            center,
            radius,
            radiance,
        })),
        Light::Disk {
            center,
            normal,
            radius,
            radiance,
        } => Prepared::Local(Local::Flat(FlatLight::disk(
            center, normal, radius, radiance,
        ))),
        Light::Rectangle {
            corner,
            edges,
            radiance,
        } => Prepared::Local(Local::Flat(FlatLight::rectangle(corner, edges, radiance))),
        Light::Point {
            position,
            intensity,
            range,
        } => Prepared::Local(Local::Point(PointLight {
            position,
            intensity,
            range,
            cone: None,
        })),
        Light::Spot {
            position,
            direction,
            cos_outer,
            cos_inner,
            intensity,
            range,
        } => Prepared::Local(Local::Point(PointLight {
            position,
            intensity,
            range,
            cone: Some(Cone {
                axis: direction,
                cos_outer,
                cos_inner,
            }),
        })),
    }
}

#[cfg(test)]
mod tests;
