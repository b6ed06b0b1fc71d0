//! What is traced, before any backend: objects, and where they stand.

use std::sync::Arc;

use glam::Affine3A;

use super::{Hit, INVALID_ID};
use crate::prism::Prisms;
use crate::surface::{BaseMesh, SurfacePoint};

/// One traceable shape.
#[derive(Clone)]
pub enum Shape {
    /// Prisms around a displaced surface.
    Displaced(Arc<Prisms>),
    /// An undisplaced mesh as ordinary triangles.
    Triangles(Arc<BaseMesh>),
}

/// Where an object stands.
#[derive(Clone, Debug)]
pub enum Placement {
    /// Once, in world space as it is.
    World,
    /// Once per transform (object to world), through an instance.
    Instances(Vec<Affine3A>),
}

/// A shape, where it stands, and which rays see it.
#[derive(Clone)]
pub struct Object {
    /// The shape.
    pub shape: Shape,
    /// Where.
    pub placement: Placement,
    /// A ray sees the object when `ray.mask & mask != 0`.
    pub mask: u32,
}

/// Everything that is traced.
#[derive(Clone, Default)]
pub struct World {
    objects: Vec<Object>,
    /// (object, index of its transform), in the order of top-level ids.
    top_level: Vec<(u32, Option<u32>)>,
}

/// What a hit hit.
#[derive(Clone, Copy, Debug)]
pub struct Resolved<'w> {
    /// Index into [`World::objects`].
    pub object: usize,
    /// Object to world, if instanced.
    pub transform: Option<&'w Affine3A>,
}

impl World {
    /// A world of these objects. Top-level ids count the objects in order, an instanced object once per transform.
    pub fn new(objects: Vec<Object>) -> Self {
        let mut top_level = Vec::new();
        for (index, object) in objects.iter().enumerate() {
            match &object.placement {
                Placement::World => top_level.push((index as u32, None)),
                Placement::Instances(t) => {
                    top_level.extend((0..t.len() as u32).map(|k| (index as u32, Some(k))));
                }
            }
        }
        Self { objects, top_level }
    }

    /// The objects.
    pub fn objects(&self) -> &[Object] {
        &self.objects
    }

    /// (object, index of its transform), in the order of top-level ids.
    pub fn top_level(&self) -> &[(u32, Option<u32>)] {
        &self.top_level
    }

    /// Which object a hit is on, and through which instance.
    pub fn resolve(&self, hit: &Hit) -> Resolved<'_> {
        let top = if hit.inst[0] == INVALID_ID {
            hit.geom
        } else {
            hit.inst[0]
        };
        let (object, instance) = self.top_level[top as usize];
        let object = object as usize;
        let transform = match (&self.objects[object].placement, instance) {
            (Placement::Instances(t), Some(k)) => Some(&t[k as usize]),
            _ => None,
        };
        Resolved { object, transform }
    }

    /// All a shader wants to know of a hit, in world space.
    pub fn surface_point(&self, hit: &Hit) -> SurfacePoint {
        let _ = hit;
        todo!()
    }
}
