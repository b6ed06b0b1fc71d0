//! The words every room shares: a ray, eight of them, and an axis-aligned box.

mod cone;
mod leveled;
mod packet;

use glam::Vec3;

pub use cone::{Cone, Footprint};
pub use packet::{RayPacket, lanes_of};

/// The largest coordinate of an origin, a direction, a scene or a point that is asked about, of either sign.
///
/// Embree takes no more (its `FLT_LARGE`, 1.844e18, whose square is an f32 still) and ends the program where it is built with
/// assertions, as Debian's is. So nothing beyond reaches a backend, neither Embree nor the other: such a ray hits nothing, and such a
/// scene is an error.
pub const MAX_COORDINATE: f32 = 1.8e18;

/// What is left of [`MAX_COORDINATE`] and Embree's own limit for boxes that are padded against rounding.
const PADDED_COORDINATE: f32 = 1.84e18;

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

    /// False for a zero direction, an origin or direction that is NaN or beyond [`MAX_COORDINATE`], or a NaN interval: no
    /// backend is asked about such a ray, it hits nothing.
    pub fn is_valid(&self) -> bool {
        self.is_valid_from(MAX_COORDINATE)
    }

    /// [`is_valid`](Self::is_valid) with another largest coordinate of the origin, of at most [`MAX_COORDINATE`].
    #[inline(always)]
    pub(crate) fn is_valid_from(&self, reach: f32) -> bool {
        let within = |v: Vec3, reach: f32| v.abs().cmple(Vec3::splat(reach)).all();
        within(self.origin, reach)
            && within(self.direction, MAX_COORDINATE)
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

    /// Where a ray enters the box within its interval.
    pub(crate) fn entry(&self, ray: &Ray) -> Option<f64> {
        let (mut enters, mut leaves) = (f64::from(ray.tnear), f64::from(ray.tfar));
        for axis in 0..3 {
            let (origin, direction) = (f64::from(ray.origin[axis]), f64::from(ray.direction[axis]));
            let [low, high] = [self.min[axis], self.max[axis]].map(|p| f64::from(p) - origin);
            if direction == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
                continue;
            }
            let (a, b) = (low / direction, high / direction);
            enters = enters.max(a.min(b));
            leaves = leaves.min(a.max(b));
        }
        (enters <= leaves).then_some(enters)
    }

    /// The smallest box over both.
    pub fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// What both hold; not [valid](Self::is_valid) if that is nothing.
    pub fn intersection(self, other: Self) -> Self {
        Self {
            min: self.min.max(other.min),
            max: self.max.min(other.max),
        }
    }

    /// The eight corners.
    pub fn corners(self) -> [Vec3; 8] {
        let Self { min, max } = self;
        std::array::from_fn(|i| {
            let pick = |bit: usize, low: f32, high: f32| if i & bit == 0 { low } else { high };
            Vec3::new(
                pick(1, min.x, max.x),
                pick(2, min.y, max.y),
                pick(4, min.z, max.z),
            )
        })
    }

    /// True when it holds at least one point.
    pub fn is_valid(&self) -> bool {
        self.min.cmple(self.max).all()
    }

    /// The largest size of a coordinate; infinite for an empty box.
    pub fn reach(&self) -> f32 {
        self.min.abs().max(self.max.abs()).max_element()
    }

    /// Whether a backend takes the box: ordered, and within [`MAX_COORDINATE`] but for a little padding.
    pub fn is_traceable(&self) -> bool {
        // NaN is in no order.
        self.is_valid() && self.reach() <= PADDED_COORDINATE
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
        let pad = Vec3::splat(self.reach() * ulps * f32::EPSILON);
        Self {
            min: self.min - pad,
            max: self.max + pad,
        }
    }
}
