//! The words every room shares: a ray, eight of them, and an axis-aligned box.

mod cone;
mod packet;

use glam::Vec3;

pub use cone::{Cone, Footprint};
pub use packet::{RayPacket, lanes_of};

/// A ray `origin + t * direction` for `t` in (`tnear`, `tfar`).
///
/// `direction` need not be normalised: `t` is in units of its length, as Embree has it.
// Word for word Embree's RTCRay but for its flags, so that a hit test reads it where Embree left it.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start point, world units.
    pub origin: Vec3,
    /// Start of the open parameter interval, at least 0.
    pub tnear: f32,
    /// Direction, any non-zero length.
    pub direction: Vec3,
    /// 0 to 1, for what moves; beyond that it counts as the nearer end, and NaN as 0.
    pub time: f32,
    /// End of the open parameter interval; may be infinite.
    pub tfar: f32,
    /// A geometry is seen when `mask & geometry.mask != 0`.
    pub mask: u32,
    /// Random key of this ray: two rays with the same key march with the same thin-feature jitter.
    /// The renderer makes it from (pixel, sample, dimension, seed). Travels in Embree's ray id.
    pub key: u32,
}

impl Ray {
    /// A ray over (0, infinity) that sees every geometry.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self {
            origin,
            direction,
            tnear: 0.0,
            tfar: f32::INFINITY,
            time: 0.0,
            mask: u32::MAX,
            key: 0,
        }
    }

    /// The point at parameter `t`.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.direction
    }

    /// False for a zero, NaN or infinite direction, a NaN or infinite origin, or a NaN interval: no
    /// backend is asked about such a ray, it hits nothing.
    pub fn is_valid(&self) -> bool {
        self.origin.is_finite()
            && self.direction.is_finite()
            && self.direction != Vec3::ZERO
            && self.tnear >= 0.0
            && self.tfar >= self.tnear
    }
}

/// A time as it counts: the nearer end of [0, 1] for what is beyond, 0 for NaN.
#[inline(always)]
pub(crate) fn time_within(time: f32) -> f32 {
    if time > 0.0 { time.min(1.0) } else { 0.0 }
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest corner.
    pub min: Vec3,
    /// Largest corner.
    pub max: Vec3,
}

impl Aabb {
    /// The box of nothing: `min` is +infinity and `max` -infinity.
    pub const EMPTY: Self = Self {
        min: Vec3::splat(f32::INFINITY),
        max: Vec3::splat(f32::NEG_INFINITY),
    };

    /// The smallest box over `self` and `p`.
    pub fn including(self, p: Vec3) -> Self {
        Self {
            min: self.min.min(p),
            max: self.max.max(p),
        }
    }

    /// The smallest box over both.
    pub fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// True when it holds at least one point.
    pub fn is_valid(&self) -> bool {
        self.min.cmple(self.max).all()
    }

    /// Length of the diagonal; 0 for an empty box.
    pub fn diagonal(&self) -> f32 {
        if self.is_valid() {
            (self.max - self.min).length()
        } else {
            0.0
        }
    }

    /// Grown outward by `ulps` units in the last place of its largest coordinate, so that f32
    /// rounding in a backend's box test never loses what lies on its faces.
    pub fn padded(self, ulps: f32) -> Self {
        let reach = self.min.abs().max(self.max.abs()).max_element();
        let pad = Vec3::splat(reach * ulps * f32::EPSILON);
        Self {
            min: self.min - pad,
            max: self.max + pad,
        }
    }
}
