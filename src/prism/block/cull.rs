//! Parts of a block held against the ray, eight at a time.

use super::middle::{Affine, Axis, Heights};
use super::view::View;
use crate::prism::simd::Lanes;

/// Eight parts of a block of the same size.
pub struct Parts<L> {
    /// Their middles, in texels from the block's.
    pub s: L,
    pub t: L,
    /// Half their cells across and up.
    pub half: [f32; 2],
    /// The smallest and largest texel of each, as stored.
    pub range: [L; 2],
}

/// The range of w = D/|N'| over parts: the middle's, and how far another's may be from it.
pub struct Offsets<L> {
    w: L,
    reach: L,
    farthest: L,
}

impl<L: Lanes> Offsets<L> {
    /// `k` is 1/|N'| to first order, `k_off` what that is off by.
    #[inline(always)]
    pub fn new(parts: &Parts<L>, heights: &Heights, k: &Affine<f32>, k_off: f32) -> Self {
        let [low, high] = parts.range;
        let (scale, half) = (L::splat(heights.scale), L::splat(0.5));
        let middle = ((low + high) * half).mul_add(scale, L::splat(heights.offset));
        let around = ((high - low) * half * scale).abs();
        let most = middle.abs() + around;
        let k_off = L::splat(k_off + k.reach(parts.half));
        let k = k.lanes(parts.s, parts.t);
        let w = middle * k;
        let reach = around.mul_add(k.abs(), most * k_off);
        Self {
            w,
            reach,
            farthest: w.abs() + reach,
        }
    }

    /// P + w N' along an axis: the middle, and how far from it S may be anywhere over a part.
    #[inline(always)]
    pub fn along(&self, parts: &Parts<L>, axis: &Axis, noise: f32) -> [L; 2] {
        let n = axis.n.lanes(parts.s, parts.t);
        let c = self.w.mul_add(n, axis.p.lanes(parts.s, parts.t));
        let flat = L::splat(axis.p.reach(parts.half) + noise);
        let bent = self
            .farthest
            .mul_add(L::splat(axis.n.reach(parts.half)), flat);
        [c, self.reach.mul_add(n.abs(), bent)]
    }
}

/// What is above 0 only where a part is surely outside the triangle.
#[inline(always)]
pub fn beyond<L: Lanes>(parts: &Parts<L>, [b1, b2]: &[Affine<f32>; 2]) -> L {
    let [x, y] = parts.half;
    let far = x * (b1.s + b2.s).abs() + y * (b1.t + b2.t).abs();
    let reach = [b1.reach(parts.half), b2.reach(parts.half), far + 1.0];
    let (b1, b2) = (b1.lanes(parts.s, parts.t), b2.lanes(parts.s, parts.t));
    let inside = (b1 + L::splat(reach[0])).min(b2 + L::splat(reach[1]));
    // Digits of f32 barycentrics over a few thousand texels.
    const SLACK: f32 = 1e-3;
    L::splat(-SLACK) - inside.min(L::splat(reach[2]) - (b1 + b2))
}

/// The lanes that are above 0, or no number.
#[inline(always)]
pub fn above<L: Lanes>(x: L) -> u32 {
    (L::splat(0.0) - x).sign_mask()
}

/// The parts that the ray may meet, and the ray parameter before which it does not.
#[inline(always)]
pub fn met<L: Lanes>(view: &View<'_>, heights: &Heights, parts: &Parts<L>) -> (u32, L) {
    let offsets = Offsets::new(parts, heights, &view.middle.k, view.middle.k_off);
    let [x, off_x] = offsets.along(parts, &view.x, view.noise);
    let [y, off_y] = offsets.along(parts, &view.y, view.noise);
    let [z, off_z] = offsets.along(parts, &view.z, view.depth_noise);
    let beside = (x.abs() - off_x).max(y.abs() - off_y);
    let begins = z - off_z;
    let behind = begins - L::splat(view.interval[1]);
    let before = L::splat(view.interval[0]) - (z + off_z);
    let out = beside
        .max(behind)
        .max(before)
        .max(beyond(parts, &view.middle.b));
    (!above(out) & 0xff, begins)
}
