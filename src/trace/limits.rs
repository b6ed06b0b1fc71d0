//! Whether a world can be traced: boxes and transforms within what backends take.

use glam::{Affine3A, Vec3};
use thiserror::Error;

use super::reach::SURROUNDINGS;
use super::{Placement, RayReach, Shape, TransformError, World};
use crate::prism::Prisms;
use crate::ray::{Aabb, MAX_COORDINATE};
use crate::surface::Patch;

/// Why no backend can trace a world.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum WorldError {
    /// A primitive's box is inverted, not finite or too far out.
    #[error(
        "primitive {prim} spans {} to {}; expected coordinates within +-{MAX_COORDINATE:e}",
        bounds.min, bounds.max
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
        "instance {instance} spans {} to {}; expected coordinates within +-{MAX_COORDINATE:e}",
        bounds.min, bounds.max
    )]
    Placed {
        /// Index of the object.
        object: usize,
        /// Index of the transform.
        instance: usize,
        /// What was found.
        bounds: Aabb,
    },
    /// Rays from the world's own surroundings would be beyond [`MAX_COORDINATE`] in the space of an instance.
    #[error(
        "instance {instance} is so small that in its own space only what is within +-{reach:e} is within +-{MAX_COORDINATE:e}, and \
         the scene reaches to {world:e}; expected at most a sixteenth"
    )]
    Surroundings {
        /// Index of the object.
        object: usize,
        /// Index of the transform.
        instance: usize,
        /// From where rays could come.
        reach: f32,
        /// The largest coordinate of the world.
        world: f32,
    },
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
        let mut size = 0f32;
        let mut all = RayReach::default();
        // The instance that leaves the least.
        let mut tightest = (0, 0);
        for (object, described) in self.objects().iter().enumerate() {
            let own =
                own_bounds(&described.shape).map_err(|(prim, bounds)| WorldError::Bounds {
                    object,
                    prim,
                    bounds,
                })?;
            let Placement::Instances(transforms) = &described.placement else {
                size = size.max(own.reach());
                continue;
            };
            for (instance, transform) in transforms.iter().enumerate() {
                let reach = all
                    .through(transform)
                    .map_err(|source| WorldError::Transform {
                        object,
                        instance,
                        source,
                    })?;
                if reach != all {
                    (all, tightest) = (reach, (object, instance));
                }
                let bounds = placed(own, transform);
                if !bounds.is_traceable() {
                    return Err(WorldError::Placed {
                        object,
                        instance,
                        bounds,
                    });
                }
                size = size.max(bounds.reach());
            }
        }
        if all.origin() < (SURROUNDINGS * size).min(0.5 * MAX_COORDINATE) {
            let (object, instance) = tightest;
            return Err(WorldError::Surroundings {
                object,
                instance,
                reach: all.origin(),
                world: size,
            });
        }
        Ok(all)
    }
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
