//! The one interface both backends implement, and the world they are built from.

mod edit;
mod limits;
mod offset;
mod reach;
mod settling;
mod world;

use glam::Vec3;

use crate::ray::{Aabb, Ray, RayPacket, lanes_of};
pub use edit::Edited;
pub(crate) use edit::grown;
pub use limits::WorldError;
pub(crate) use limits::placed;
pub use offset::RayOffset;
pub use reach::{MAX_STRETCH, RayReach, TransformError};
pub use settling::{Follow, Maker, Settling};
pub use world::{Object, PlacedObject, Placement, Resolved, Shape, World};

/// Instance levels a hit can hold: one, as Debian's Embree is built.
pub const MAX_INSTANCE_LEVELS: usize = 1;

/// "No geometry" and "no instance", as Embree's `RTC_INVALID_GEOMETRY_ID`.
pub const INVALID_ID: u32 = u32::MAX;

/// A ray's first intersection, as Embree reports it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter along the unnormalised direction.
    pub t: f32,
    /// Barycentric coordinate of vertex 1.
    pub u: f32,
    /// Barycentric coordinate of vertex 2.
    pub v: f32,
    /// Base triangle; or a wall, on which u and v mean something else: see [`PrismHit`](crate::prism::PrismHit).
    pub prim: u32,
    /// Geometry within its scene: for instanced objects always 0, else the index into [`World::top_level`].
    pub geom: u32,
    /// Instance stack, outermost first: index into [`World::top_level`]; [`INVALID_ID`] ends it.
    pub inst: [u32; MAX_INSTANCE_LEVELS],
    /// Unit geometric normal in the object's own space.
    pub ng: Vec3,
}

/// The nearest point of a scene, as Embree's point query reports where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// From the point that was asked about, world units.
    pub distance: f32,
    /// World space.
    pub point: Vec3,
    /// Barycentric coordinate of vertex 1.
    pub u: f32,
    /// Barycentric coordinate of vertex 2.
    pub v: f32,
    /// Base triangle.
    pub prim: u32,
    /// As [`Hit::geom`].
    pub geom: u32,
    /// As [`Hit::inst`].
    pub inst: [u32; MAX_INSTANCE_LEVELS],
}

impl Hit {
    /// Index into [`World::top_level`].
    pub fn top(&self) -> u32 {
        if self.inst[0] == INVALID_ID {
            self.geom
        } else {
            self.inst[0]
        }
    }
}

/// Something that traces rays through a [`World`].
///
/// Rays that are not [valid](Ray::is_valid), or beyond the [reach](World::ray_reach) of the world, hit nothing.
pub trait Tracer: Sync {
    /// The first hit with t in (tnear, tfar).
    fn intersect(&self, ray: &Ray) -> Option<Hit>;

    /// Whether there is any hit with t in (tnear, tfar).
    fn occluded(&self, ray: &Ray) -> bool;

    /// [`intersect`](Self::intersect) for every lane: none for empty ones. Meant for rays that go the same way from
    /// about the same place, as those of neighbouring pixels; for rays that part, single ones may be faster.
    fn intersect8(&self, rays: &RayPacket) -> [Option<Hit>; RayPacket::LANES] {
        std::array::from_fn(|lane| self.intersect(&rays.ray(lane)))
    }

    /// [`occluded`](Self::occluded) for every lane: bit i tells of lane i, and is 0 for an empty one.
    fn occluded8(&self, rays: &RayPacket) -> u8 {
        let occluded = |lane: &usize| self.occluded(&rays.ray(*lane));
        lanes_of(u8::MAX)
            .filter(occluded)
            .fold(0, |bits, lane| bits | 1 << lane)
    }

    /// The box over everything.
    fn bounds(&self) -> Aabb;

    /// Bytes of acceleration structure (the common part that any method needs).
    fn bvh_bytes(&self) -> usize;

    /// Name and version for reports, like `embree 4.3.3` or `obvhs`.
    fn name(&self) -> String;
}
