//! A scene as loaded: plain data, every file read, every value checked.
//!
//! `file -> Scene -> World -> Tracer`; the renderer reads the rest (camera, film, materials, lights) from here.

mod build;
mod error;
mod file;
mod film;
mod fingerprint;
pub mod load;
mod world;

use std::path::PathBuf;
use std::sync::Arc;

use glam::{Affine3A, Vec3};

use crate::image::{ColorImage, EnvironmentImage};
use crate::prism::PrismOptions;
use crate::surface::{BaseMesh, DisplacedSurface, UvTransform, Wrap};

pub use build::{Loaded, MapFile, MeshAndMap};
pub use error::{AssetError, Place, SceneError};
pub(crate) use file::{MAX_SIDE, MAX_SPP, MAX_STOPS, STEP_TEXELS, fits, too_many_pixels};
pub use film::{Adaptive, Aov, AovSet, Film, Filter, FilterShape, ToneCurve, Window};

/// A perspective camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Eye point.
    pub position: Vec3,
    /// Point looked at; differs from `position`.
    pub target: Vec3,
    /// Up direction, not parallel to the view.
    pub up: Vec3,
    /// Vertical field of view, radians, in (0, pi).
    pub fov: f32,
}

/// A colour texture, linear RGB in memory.
#[derive(Clone, Debug)]
pub struct Texture {
    /// The picture.
    pub image: Arc<ColorImage>,
    /// Outside [0, 1].
    pub wrap: Wrap,
    /// Applied to the mesh's texture coordinates.
    pub uv: UvTransform,
}

/// A colour, constant or textured.
#[derive(Clone, Debug)]
pub enum Color {
    /// Linear RGB.
    Constant(Vec3),
    /// From a picture.
    Texture(Texture),
}

/// A first subset of the principled material.
#[derive(Clone, Debug)]
pub struct Material {
    /// For messages.
    pub name: String,
    /// Diffuse albedo, or the reflectance at normal incidence of a metal.
    pub base_color: Color,
    /// 0 dielectric .. 1 metal.
    pub metallic: f32,
    /// 0 mirror .. 1; alpha = roughness^2.
    pub roughness: f32,
    /// Dielectric reflectance at normal incidence is 0.08 * specular.
    pub specular: f32,
}

impl Material {
    /// Whether rays go through. None does yet: all materials of this subset are opaque.
    pub fn is_transmissive(&self) -> bool {
        false
    }
}

/// A source of light.
#[derive(Clone, Debug)]
pub enum Light {
    /// A distant disk of the sun's size.
    Sun {
        /// Unit vector towards the sun.
        direction: Vec3,
        /// 1 is a clear day's sun in the sky model's units.
        strength: f32,
    },
    /// A clear daylight sky.
    Sky {
        /// Unit vector towards the sun.
        sun_direction: Vec3,
        /// 2 (very clear) .. 10 (hazy).
        turbidity: f32,
        /// Multiplier.
        strength: f32,
    },
    /// An equirectangular picture around the scene, +Y up.
    Environment {
        /// The picture.
        image: Arc<EnvironmentImage>,
        /// Radians about +Y.
        rotation: f32,
        /// Multiplier.
        strength: f32,
    },
}

/// What an object is made of.
#[derive(Clone, Debug)]
pub enum ObjectShape {
    /// A displaced mesh and how its prisms are made.
    Displaced(Arc<DisplacedSurface>, PrismOptions),
    /// A plain mesh.
    Plain(Arc<BaseMesh>),
}

/// One mesh of the scene.
#[derive(Clone, Debug)]
pub struct SceneObject {
    /// For messages and reports.
    pub name: String,
    /// The shape; a `transform` in the file is already baked in.
    pub shape: ObjectShape,
    /// Empty: stands once as it is. Else object-to-world transforms.
    pub instances: Vec<Affine3A>,
    /// Ray mask.
    pub mask: u32,
    /// Index into `Scene::materials`.
    pub material: usize,
}

/// A whole scene.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Where it came from, for messages.
    pub path: PathBuf,
    /// The camera.
    pub camera: Camera,
    /// The film.
    pub film: Film,
    /// Meshes.
    pub objects: Vec<SceneObject>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Lights.
    pub lights: Vec<Light>,
}
