//! A ray's own frame: its main axis, and the two lateral axes sheared along the ray.
//!
//! The main axis is the coordinate axis along which the direction is largest (Woop, Benthin, Wald, "Watertight
//! Ray/Triangle Intersection", JCGT 2(1), 2013). Moved by minus the shear times its depth, every point of the ray has
//! lateral coordinates 0; so a point's projection depends on the point and the ray alone, and two prisms see
//! the same digits of a vertex that they share.

mod packet;

use super::simd::Lanes;
use crate::ray::Ray;
pub use packet::{Beam, RayFrames, share_axes};

/// The main axis of a ray, last, and the two others: a cyclic permutation of x, y, z.
#[inline(always)]
pub fn axes(ray: &Ray) -> [usize; 3] {
    let [x, y, z] = ray.direction.abs().to_array();
    if z >= x && z >= y {
        [0, 1, 2]
    } else if y >= x {
        [2, 0, 1]
    } else {
        [1, 2, 0]
    }
}

/// What the set-up needs of a ray, in f64.
#[derive(Clone, Copy, Debug)]
pub struct RayFrame {
    /// Lateral axes, then the main axis.
    pub axes: [usize; 3],
    /// Origin along these axes.
    pub origin: [f64; 3],
    /// Movement along the lateral axes per unit along the main axis, within [-1, 1].
    pub shear: [f64; 2],
    /// Ray parameter per unit along the main axis.
    pub per_depth: f64,
}

impl RayFrame {
    /// `ray` must be [valid](Ray::is_valid), `axes` its.
    #[inline(always)]
    pub fn new(ray: &Ray, axes @ [x, y, z]: [usize; 3]) -> Self {
        let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
        let (shear, per_depth) = slant([direction[x], direction[y], direction[z]]);
        Self {
            axes,
            origin: [origin[x].into(), origin[y].into(), origin[z].into()],
            shear,
            per_depth,
        }
    }
}

/// The shear of a direction, main axis last, and its ray parameter per unit along that.
#[inline(always)]
fn slant([x, y, z]: [f32; 3]) -> ([f64; 2], f64) {
    let per_depth = 1.0 / f64::from(z);
    (
        [f64::from(x) * per_depth, f64::from(y) * per_depth],
        per_depth,
    )
}

/// The same in f32, from a point of the ray near what is looked at, so that no digits go to the way there.
pub struct Anchored {
    /// Lateral axes, then the main axis.
    pub axes: [usize; 3],
    /// The anchor along the main axis.
    pub depth: f32,
    /// The anchor along the lateral axes: rounded, and what rounding left.
    pub near: [f32; 2],
    pub rest: [f32; 2],
    /// Movement along the lateral axes per unit along the main axis.
    pub shear: [f32; 2],
    /// Ray parameter per unit along the main axis.
    pub per_depth: f32,
    /// Ray parameter at the anchor.
    pub time: f64,
    /// tnear and tfar from there, not narrower.
    pub interval: [f32; 2],
    /// Whether ray parameters are within f32's range; where not, `interval` is all of space.
    pub is_usual: bool,
}

/// The same in lanes: one ray in all of them, or each its own. All have the same axes.
pub struct RayLanes<L> {
    pub depth: L,
    pub near: [L; 2],
    pub rest: [L; 2],
    pub shear: [L; 2],
    pub per_depth: L,
    pub interval: [L; 2],
}

impl Anchored {
    /// In all lanes.
    #[inline(always)]
    pub fn splat<L: Lanes>(&self) -> RayLanes<L> {
        RayLanes {
            depth: L::splat(self.depth),
            near: splat2(self.near),
            rest: splat2(self.rest),
            shear: splat2(self.shear),
            per_depth: L::splat(self.per_depth),
            interval: splat2(self.interval),
        }
    }
}

#[inline(always)]
fn splat2<L: Lanes>([a, b]: [f32; 2]) -> [L; 2] {
    [L::splat(a), L::splat(b)]
}

/// Directions beyond this and its inverse would overflow ray parameters in f32.
const LONGEST: f64 = 1e12;

/// Whether ray parameters are within f32's range. Without a branch, so that eight are asked at once.
#[inline(always)]
fn is_usual(per_depth: f64) -> bool {
    let length = per_depth.abs();
    (length < LONGEST) & (length > 1.0 / LONGEST)
}

/// A ray's point at some depth: see [`Anchored`].
struct Anchor {
    near: [f32; 2],
    rest: [f32; 2],
    time: f64,
}

impl Anchor {
    #[inline(always)]
    fn new([x, y, z]: [f64; 3], shear: [f64; 2], per_depth: f64, depth: f32) -> Self {
        let beyond = f64::from(depth) - z;
        let (x, y) = (x + beyond * shear[0], y + beyond * shear[1]);
        let near = [x as f32, y as f32];
        Self {
            near,
            rest: [
                (x - f64::from(near[0])) as f32,
                (y - f64::from(near[1])) as f32,
            ],
            time: beyond * per_depth,
        }
    }
}

impl RayFrame {
    /// The frame from the ray's point at `depth` along the main axis.
    #[inline(always)]
    pub fn anchored(&self, depth: f32, ray: &Ray) -> Anchored {
        let Anchor { near, rest, time } =
            Anchor::new(self.origin, self.shear, self.per_depth, depth);
        let is_usual = is_usual(self.per_depth);
        Anchored {
            axes: self.axes,
            depth,
            near,
            rest,
            shear: [self.shear[0] as f32, self.shear[1] as f32],
            per_depth: if is_usual { self.per_depth as f32 } else { 1.0 },
            time,
            interval: if is_usual {
                [before(ray.tnear, time), behind(ray.tfar, time)]
            } else {
                [f32::NEG_INFINITY, f32::INFINITY]
            },
            is_usual,
        }
    }
}

/// A ray parameter from another, not farther.
#[inline(always)]
fn before(t: f32, time: f64) -> f32 {
    let t = (f64::from(t) - time) as f32;
    t - t.abs() * f32::EPSILON
}

/// The same, not nearer.
#[inline(always)]
fn behind(t: f32, time: f64) -> f32 {
    let t = (f64::from(t) - time) as f32;
    t + t.abs() * f32::EPSILON
}
