//! From a scene to the world that a backend is built from.

use std::sync::Arc;

use rayon::prelude::*;

use super::{Integrator, ObjectShape, Scene, SceneObject, View};
use crate::prism::{MarchError, Prisms};
use crate::trace::{Object, Placement, Shape, World};

impl Scene {
    /// The world of this scene; object k of the world is object k of the scene. Builds the prisms, in parallel, with
    /// the spread of the camera's pixels for level of detail. For the [cost view](View::Cost) they [count their
    /// steps](Prisms::counting_steps).
    ///
    /// # Errors
    ///
    /// A march whose step is no positive number, or level of detail without the exact march; what is loaded from a file
    /// never has either.
    pub fn world(&self) -> Result<World, MarchError> {
        let counted = self.integrator == Integrator::View(View::Cost);
        let objects = self.objects.par_iter().map(|o| o.traced(counted));
        let world = World::new(objects.collect::<Result<_, _>>()?);
        world.set_spread(self.camera.pixel_spread(self.film.height));
        Ok(world)
    }
}

impl SceneObject {
    fn traced(&self, counted: bool) -> Result<Object, MarchError> {
        let shape = match &self.shape {
            ObjectShape::Displaced(surface, options) => {
                let prisms = Prisms::new(surface.clone(), *options)?;
                Shape::Displaced(Arc::new(if counted {
                    prisms.counting_steps()
                } else {
                    prisms
                }))
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
