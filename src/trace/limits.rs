//! Whether a world can be traced: boxes and transforms within what backends take.

use glam::{Affine3A, Vec3};
use thiserror::Error;

use super::reach::SURROUNDINGS;
use super::{Object, Placement, RayReach, Shape, TransformError, World};
use crate::prism::Prisms;
use crate::ray::{Aabb, MAX_COORDINATE};
use crate::surface::Patch;

/// Why no backend can trace a world.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum WorldError {
    /// A primitive's box is inverted, not finite or too far out.
    #[error(
        "primitive {prim} spans {:?} to {:?}; expected coordinates within +-{MAX_COORDINATE:e}",
        bounds.min.to_array(), bounds.max.to_array()
    )]
    Bounds {
        /// Index of the object.
        object: usize,
        /// Primitive of the object.
        prim: u32,
        /// What was found.
        bounds: Aabb,
    },
    /// An instance's transform has no inverse, or is too extreme.
    #[error("instance {instance}: {source}")]
    Transform {
        /// Index of the object.
        object: usize,
        /// Index of the transform.
        instance: usize,
        /// Why.
        source: TransformError,
    },
    /// An instance stands too far out, or its transform makes the object too large.
    #[error(
        "instance {instance} spans {:?} to {:?}; expected coordinates within +-{MAX_COORDINATE:e}",
        bounds.min.to_array(), bounds.max.to_array()
    )]
    Placed {
        /// Index of the object.
        object: usize,
        /// Index of the transform.
        instance: usize,
        /// What was found.
        bounds: Aabb,
    },
    /// Rays from the world's own surroundings would be beyond what one of its parts takes.
    #[error(
        "{} takes rays from within +-{reach:e} only, and the scene reaches to {world:e}; expected a sixteenth of that at most",
        part(*instance)
    )]
    Surroundings {
        /// Index of the object.
        object: usize,
        /// Index of the transform, of one that makes so small that the world is beyond [`MAX_COORDINATE`] in the object's space; none for
        /// undisplaced triangles so large that their arithmetic overflows.
        instance: Option<usize>,
        /// From where rays could come.
        reach: f32,
        /// The largest coordinate of the world.
        world: f32,
    },
}

fn part(instance: Option<usize>) -> String {
    match instance {
        Some(instance) => format!("instance {instance}"),
        None => "a mesh of its size without displacement".into(),
    }
}

impl WorldError {
    /// Index of the object that is to blame.
    pub fn object(&self) -> usize {
        match *self {
            Self::Bounds { object, .. }
            | Self::Transform { object, .. }
            | Self::Placed { object, .. }
            | Self::Surroundings { object, .. } => object,
        }
    }
}

impl World {
    /// Checks that backends can trace the world, and tells the rays that they can be asked about. Every backend does so when it is built.
    ///
    /// # Errors
    ///
    /// The first object or instance whose box or transform is beyond what trees take.
    pub fn ray_reach(&self) -> Result<RayReach, WorldError> {
        let mut parts = Parts::default();
        for (object, described) in self.objects().iter().enumerate() {
            parts.add(object, described)?;
        }
        let (reach, world) = (parts.reach.origin(), parts.size);
        // Far out there is less around, and nobody to blame.
        if reach < (SURROUNDINGS * world).min(0.5 * MAX_COORDINATE) {
            let (object, instance) = parts.tightest;
            return Err(WorldError::Surroundings {
                object,
                instance,
                reach,
                world,
            });
        }
        Ok(parts.reach.around(world))
    }
}

/// What is known of the objects so far.
#[derive(Default)]
struct Parts {
    reach: RayReach,
    /// The object, and its instance, that leaves the least.
    tightest: (usize, Option<usize>),
    /// The largest coordinate.
    size: f32,
}

impl Parts {
    fn add(&mut self, object: usize, described: &Object) -> Result<(), WorldError> {
        let own = own_bounds(&described.shape).map_err(|(prim, bounds)| WorldError::Bounds {
            object,
            prim,
            bounds,
        })?;
        let largest = match &described.shape {
            Shape::Displaced(_) => MAX_COORDINATE,
            Shape::Triangles(_) => triangle_reach(own),
        };
        let Placement::Instances(transforms) = &described.placement else {
            self.narrow(self.reach.up_to(largest), own, (object, None));
            return Ok(());
        };
        for (instance, transform) in transforms.iter().enumerate() {
            let reach = self.reach.through_to(transform, largest);
            let reach = reach.map_err(|source| WorldError::Transform {
                object,
                instance,
                source,
            })?;
            let bounds = placed(own, transform);
            if !bounds.is_traceable() {
                return Err(WorldError::Placed {
                    object,
                    instance,
                    bounds,
                });
            }
            self.narrow(reach, bounds, (object, Some(instance)));
        }
        Ok(())
    }

    fn narrow(&mut self, reach: RayReach, bounds: Aabb, part: (usize, Option<usize>)) {
        if reach != self.reach {
            (self.reach, self.tightest) = (reach, part);
        }
        self.size = self.size.max(bounds.reach());
    }
}

/// From how far rays may come to undisplaced triangles of a mesh within this box: Embree takes t from 2 (v - o) . Ng, which is at
/// most 12 (|v| + |o|) e^2 for edges up to e.
fn triangle_reach(bounds: Aabb) -> f32 {
    const LARGEST: f32 = f32::MAX / 13.0;
    let edge = (bounds.max - bounds.min).max_element();
    (LARGEST / edge / edge - bounds.reach()).clamp(0.0, MAX_COORDINATE)
}

/// The box over a shape in its own space, or the first primitive whose box no backend takes.
fn own_bounds(shape: &Shape) -> Result<Aabb, (u32, Aabb)> {
    let base = shape.mesh().bounds();
    let Shape::Displaced(prisms) = shape else {
        // A mesh is within the limit.
        return Ok(base);
    };
    let displaced = furthest(prisms);
    let around = |by: f32| Aabb {
        min: base.min - by,
        max: base.max + by,
    };
    // Prisms hold the offsets of opposed normals, too: far from all limits there is no need to ask each.
    if !around(displaced * (2.0 / Patch::LEAST_NORMAL as f32)).is_traceable() {
        for prim in 0..prisms.len() as u32 {
            let bounds = prisms.bounds(prim);
            if !bounds.is_traceable() {
                return Err((prim, bounds));
            }
        }
    }
    Ok(around(displaced))
}

/// The largest |D| that there is on a map, or that prisms have room for.
fn furthest(prisms: &Prisms) -> f32 {
    let displacement = prisms.surface().displacement();
    let (low, high) = prisms.heights();
    [low, high]
        .map(|h| displacement.of(h).abs())
        .into_iter()
        .fold(0.0, f32::max)
}

/// The box over a transformed box.
pub(crate) fn placed(bounds: Aabb, to_world: &Affine3A) -> Aabb {
    let corner = |i: usize| {
        let pick = |axis: usize| {
            if i & (1 << axis) == 0 {
                bounds.min[axis]
            } else {
                bounds.max[axis]
            }
        };
        to_world.transform_point3(Vec3::from_array([0, 1, 2].map(pick)))
    };
    (0..8).map(corner).fold(Aabb::EMPTY, Aabb::including)
}
