//! From a scene to the world that a backend is built from.

use std::sync::Arc;

use rayon::prelude::*;

use super::{ObjectShape, Scene, SceneObject};
use crate::prism::{MarchError, Prisms};
use crate::trace::{Object, Placement, Shape, World};

impl Scene {
    /// The world of this scene; object k of the world is object k of the scene. Builds the prisms, in parallel, with
    /// the spread of the camera's pixels for level of detail.
    ///
    /// # Errors
    ///
    /// A march whose step is no positive number, or level of detail without the exact march; what is loaded from a file
    /// never has either.
    pub fn world(&self) -> Result<World, MarchError> {
        let objects: Result<Vec<_>, _> = self.objects.par_iter().map(SceneObject::traced).collect();
        let world = World::new(objects?);
        world.set_spread(self.camera.pixel_spread(self.film.height));
        Ok(world)
    }
}

impl SceneObject {
    fn traced(&self) -> Result<Object, MarchError> {
        let shape = match &self.shape {
            ObjectShape::Displaced(surface, options) => {
                Shape::Displaced(Arc::new(Prisms::new(surface.clone(), *options)?))
            }
            ObjectShape::Plain(mesh) => Shape::Triangles(mesh.clone()),
        };
        Ok(Object {
            shape,
            placement: match &self.instances[..] {
                [] => Placement::World,
                instances => Placement::Instances(instances.to_vec()),
            },
            mask: self.mask,
        })
    }
}
