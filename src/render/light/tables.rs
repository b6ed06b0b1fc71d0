//! A scene's lights made ready, once for any number of views of it.

use std::f32::consts::PI;

use super::cumulative::Cumulative;
use super::mesh::MeshTables;
use super::point::{Cone, DirectionalLight, PointLight};
use super::shape::{FlatLight, SphereLight};
use super::{Environment, Infinite, InfiniteLight, Local, LocalLight, Sky, Sun, WhiteWorld};
use crate::render::RenderInput;
use crate::scene::Light;

/// Turbidity of a sun without a sky.
const CLEAR: f32 = 3.0;

/// What there is to know of the lights of a scene before any of them is asked. It depends on neither camera nor film.
pub struct LightTables {
    pub(super) infinite: Vec<Infinite>,
    pub(super) local: Vec<Local>,
    pub(super) meshes: Option<MeshTables>,
    /// Among all of these, in this order, meshes as one.
    pub(super) choice: Cumulative,
    /// Whether each point is lit by all of them, or by one.
    pub(super) all: bool,
}

impl LightTables {
    /// The lights of `input`, ready to be sampled: all at each point, or one that is chosen by its power. A scene
    /// without any is lit by a white world of radiance 1.
    ///
    /// A sun is seen through the air of the first sky, or through clear air.
    pub fn new(input: &RenderInput, all: bool) -> Self {
        let meshes = MeshTables::new(input);
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
            .chain(meshes.iter().map(MeshTables::power))
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

    /// Number of lights.
    pub(super) fn count(&self) -> usize {
        self.infinite.len() + self.local.len() + usize::from(self.meshes.is_some())
    }

    /// Of a light to be chosen; 1 where all light each point.
    pub(super) fn chance(&self, index: usize) -> f32 {
        if self.all {
            1.0
        } else {
            self.choice.probability(index)
        }
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
