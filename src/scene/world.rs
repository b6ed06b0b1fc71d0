//! From a scene to the world that a backend is built from.

use std::sync::Arc;

use rayon::prelude::*;

use super::{ObjectShape, Scene};
use crate::prism::Prisms;
use crate::trace::{Object, Placement, Shape, World};

impl Scene {
    /// The world of this scene; object k of the world is object k of the scene. Builds the prisms, in parallel.
    pub fn world(&self) -> World {
        let object = |object: &super::SceneObject| Object {
            shape: match &object.shape {
                ObjectShape::Displaced(surface, march) => {
                    Shape::Displaced(Arc::new(Prisms::new(surface.clone(), *march)))
                }
                ObjectShape::Plain(mesh) => Shape::Triangles(mesh.clone()),
            },
            placement: match &object.instances[..] {
                [] => Placement::World,
                instances => Placement::Instances(instances.to_vec()),
            },
            mask: object.mask,
        };
        World::new(self.objects.par_iter().map(object).collect())
    }
}
