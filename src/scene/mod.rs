//! A scene as loaded: plain data, every file read, every value checked.
//!
//! `file -> Scene -> World -> Tracer`; the renderer reads the rest (camera, film, materials, lights) from here.

mod build;
mod camera;
mod error;
mod file;
mod film;
mod fingerprint;
mod integrator;
mod light;
pub mod load;
pub mod lookdev;
mod material;
mod world;

use std::path::PathBuf;
use std::sync::Arc;

use glam::Affine3A;

use crate::prism::PrismOptions;
use crate::surface::{BaseMesh, DisplacedSurface};

pub use build::{Loaded, MapFile, MeshAndMap, Subdivided};
pub use camera::{Camera, Lens, Projection};
pub use error::{AssetError, Place, SceneError, UntraceableError};
pub(crate) use file::{MAX_SIDE, MAX_SPP, MAX_STOPS, STEP_TEXELS, fits, too_many_pixels};
pub use film::{Adaptive, Aov, AovSet, Film, Filter, FilterShape, ToneCurve, Window};
pub use integrator::{Integrator, PathLimits, View};
pub use light::Light;
pub use material::{Color, Coordinates, Detail, Material, Scalar, ScalarTexture, Texture};

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
    /// What is computed for a camera ray.
    pub integrator: Integrator,
}
