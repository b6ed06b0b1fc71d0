//! A block seen along a ray.
//!
//! Moved along the ray to the plane through the ray's origin (sheared, not turned: the main axis is the one along which the direction is
//! largest), every point has two lateral coordinates, and the ray's own are 0. Lateral coordinates and the ray parameter t are linear in space, so P and N'
//! are affine functions of texel coordinates in them too. The lateral axes are turned so that N' at the block's middle is along the
//! first: the range of heights is seen along one axis only.
//!
//! Texel coordinates (s, t) are from the block's middle, ray parameters from there as well. The ray's way to the block is in
//! f64, so that what rounding leaves depends on the block's size and not on the distance.

use super::middle::{Axis, Middle};
use super::{ROUNDING, Record};
use crate::prism::ray_frame::RayFrame;
use crate::prism::simd::Lanes;
use crate::ray::Ray;

/// See the module.
pub struct View<'m> {
    /// Lateral axes.
    pub x: Axis,
    pub y: Axis,
    /// Ray parameter.
    pub z: Axis,
    /// In space.
    pub middle: &'m Middle,
    /// By how much roundings may move a point sideways, and along the ray.
    pub noise: f32,
    pub depth_noise: f32,
    /// Lateral coordinates of a vector are at most this times its length.
    pub shear: f32,
    /// Lengths along the ray in ray parameters.
    pub per_length: f32,
    /// Ray parameter of the block's middle.
    pub t0: f64,
    /// tnear and tfar from there, not narrower; all of space where `is_usual` is false.
    pub interval: [f32; 2],
    /// The same, not wider: what is between is in the interval also when its ray parameter is rounded. Empty where `is_usual` is false.
    pub inner: [f32; 2],
    is_usual: bool,
    /// Whether f32 will do.
    pub is_sound: bool,
}

/// Directions beyond this and its inverse would overflow ray parameters in f32.
const LONGEST: f64 = 1e12;

/// Beyond this products would overflow.
const LARGEST: f32 = 1e15;

/// Below this products of the sides of texels would lose digits, or vanish.
const SMALLEST: f32 = 1e-12;

impl<'m> View<'m> {
    /// Of use where [`is_sound`](Self::is_sound).
    #[inline(always)]
    pub fn new<L: Lanes>(record: &Record, middle: &'m Middle, frame: &RayFrame, ray: &Ray) -> Self {
        let [ds, dt] = middle.from();
        let [ax, ay, az] = frame.axes;
        let (wx, wy, wz) = (record.along(ax), record.along(ay), record.along(az));

        // P at the middle, in f64.
        let (s, t) = (f64::from(ds), f64::from(dt));
        let from = |w: &[f32; 8], origin: f64| {
            (f64::from(w[0]) - origin) + (s * f64::from(w[1]) + t * f64::from(w[2]))
        };
        let depth = from(wz, frame.origin[2]);
        let u0 = (from(wx, frame.origin[0]) - frame.shear[0] * depth) as f32;
        let v0 = (from(wy, frame.origin[1]) - frame.shear[1] * depth) as f32;
        let t0 = depth * frame.per_depth;
        let is_usual = {
            let length = frame.per_depth.abs();
            length < LONGEST && length > 1.0 / LONGEST
        };
        let per_depth = if is_usual {
            frame.per_depth as f32
        } else {
            1.0
        };
        let all = [f32::NEG_INFINITY, f32::INFINITY];
        let (interval, inner) = if is_usual {
            (
                [before(ray.tnear, t0), behind(ray.tfar, t0)],
                [after(ray.tnear, t0), -after(-ray.tfar, -t0)],
            )
        } else {
            (all, [all[1], all[0]])
        };

        // The six vectors side by side, from the side.
        let shear = [frame.shear[0] as f32, frame.shear[1] as f32];
        let lz = L::from_array(*wz);
        let u = lz.neg_mul_add(L::splat(shear[0]), L::from_array(*wx));
        let v = lz.neg_mul_add(L::splat(shear[1]), L::from_array(*wy));
        let (ua, va) = (u.to_array(), v.to_array());
        let (nu, nv) = (middle.axis(&ua).n.c, middle.axis(&va).n.c);
        let length = (nu * nu + nv * nv).sqrt();
        let (cos, sin) = if length > 1e-30 {
            let inverse = 1.0 / length;
            (nu * inverse, nv * inverse)
        } else {
            (1.0, 0.0)
        };
        let x = u.mul_add(L::splat(cos), v * L::splat(sin)).to_array();
        let y = u.neg_mul_add(L::splat(sin), v * L::splat(cos)).to_array();
        let size = u0.abs() + v0.abs() + middle.size;
        Self {
            x: middle.axis(&x).from(u0 * cos + v0 * sin, 1.0),
            y: middle.axis(&y).from(v0 * cos - u0 * sin, 1.0),
            z: middle.axis(wz).from(0.0, per_depth),
            noise: rounding(size),
            depth_noise: per_depth.abs() * rounding(middle.size),
            shear: (1.0 + shear[0] * shear[0] + shear[1] * shear[1]).sqrt() * (1.0 + 1e-6),
            per_length: per_depth.abs(),
            t0,
            interval,
            inner,
            is_sound: middle.is_tame()
                && size < LARGEST
                && middle.size > SMALLEST
                && t0.abs() < 1e30,
            is_usual,
            middle,
        }
    }

    /// Ends the interval at `t`.
    #[inline(always)]
    pub fn end_at(&mut self, t: f32) {
        if self.is_usual {
            self.interval[1] = behind(t, self.t0);
            self.inner[1] = -after(-t, -self.t0);
        }
    }
}

/// What roundings may move a point of S that vectors of this length in all lead to: few enough follow one another.
#[inline(always)]
pub fn rounding(size: f32) -> f32 {
    32.0 * ROUNDING * size
}

/// A ray parameter from another, not farther.
#[inline(always)]
fn before(t: f32, t0: f64) -> f32 {
    let t = (f64::from(t) - t0) as f32;
    t - t.abs() * f32::EPSILON
}

/// The same, farther by what rounding a ray parameter moves it.
#[inline(always)]
fn after(t: f32, t0: f64) -> f32 {
    // From infinity what rounding moves would be no number.
    let from = f64::from(t.max(f32::MIN)) - t0;
    (from + 2.0 * f64::from(f32::EPSILON) * (from.abs() + t0.abs())) as f32
}

/// The same, not nearer.
#[inline(always)]
fn behind(t: f32, t0: f64) -> f32 {
    let t = (f64::from(t) - t0) as f32;
    t + t.abs() * f32::EPSILON
}
