//! From a scene to the world that a backend is built from.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use super::{Integrator, ObjectShape, Scene, SceneObject, UntraceableError, View};
use crate::prism::{MarchError, Prisms};
use crate::trace::{Object, Placement, Shape, World};

impl Scene {
    /// The world of this scene; object k of the world is object k of the scene. Builds the prisms, in parallel, with
    /// the spread of the camera's pixels for level of detail. For the [cost view](View::Cost) they [count their
    /// steps](Prisms::counting_steps).
    ///
    /// # Errors
    ///
    /// An object that [no backend can trace](World::ray_reach); a march whose step is no positive number, or level of detail without the
    /// exact march: what is loaded from a file never has either of these.
    pub fn world(&self) -> Result<World, UntraceableError> {
        let counted = self.integrator == Integrator::View(View::Cost);
        let objects = self.objects.par_iter().map(|o| o.traced(counted));
        let world = World::new(objects.collect::<Result<_, _>>()?);
        world
            .ray_reach()
            .map_err(|source| UntraceableError::Object {
                path: self.path.clone(),
                object: self.objects[source.object()].name.clone(),
                source,
            })?;
        world.set_spread(self.camera.pixel_spread(self.film.width, self.film.height));
        Ok(world)
    }

    /// Fails if rays from the camera are beyond the reach of this scene's `world`, so that the picture would be empty.
    ///
    /// # Errors
    ///
    /// The camera's place.
    pub fn check_camera(&self, world: &World) -> Result<(), UntraceableError> {
        let reach = world.ray_reach().unwrap_or_default().origin();
        let position = self.camera.position;
        if position.abs().cmple(Vec3::splat(reach)).all() {
            return Ok(());
        }
        Err(UntraceableError::Camera {
            path: self.path.clone(),
            position,
            reach,
        })
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
