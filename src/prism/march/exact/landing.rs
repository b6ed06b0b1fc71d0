//! The hit at a crossing that f32 is certain of, in f64 on S itself.
//!
//! Most hits are in the middle of a cell and of a prism, where signs that f32 vouches for leave nothing to decide: what is asked
//! is where the hit is. Seen along the ray, S(u, v) has two lateral coordinates, and both are 0 at the hit: Newton's method in (u, v)
//! from a guess that is a hundredth of a texel off or less. Depth comes with its last step. What does not land in a few
//! steps, and between the ray parameters where the crossing was seen, is searched by its signs.

use crate::prism::ray_frame::RayFrame;
use crate::surface::Patch;

use super::Found;

/// A crossing as f32 sees it.
#[derive(Clone, Copy)]
pub struct Guess {
    /// Barycentric coordinates of vertices 1 and 2.
    pub uv: [f64; 2],
    /// Ray parameters that it is between.
    pub t: [f64; 2],
    /// Whether the ray comes from above.
    pub above: bool,
}

/// The hit near a guess, with its normal.
#[inline(always)]
pub fn land(patch: &Patch<'_>, frame: &RayFrame, guess: &Guess) -> Option<Found> {
    const MOST_STEPS: usize = 6;
    // Barycentrics, and texels: where the normal is taken.
    const FINE: f64 = 1e-11;
    const FINE_TEXELS: f64 = 1e-10;
    // What the last step, taken from there, may find missing: Newton's error is about the square of its step, so that nothing that
    // single precision sees depends on the guess.
    const BEYOND: f64 = 100.0;
    let ([x, y, z], [shear_x, shear_y]) = (frame.axes, frame.shear);
    let [a, b, c] = patch.texels;
    let texels = ((b - a).abs() + (c - a).abs()).max_element();
    let fine = FINE.min(FINE_TEXELS / texels);
    let [mut u, mut v] = guess.uv;
    let (mut last_step, mut is_there) = (0.0, false);
    for _ in 0..MOST_STEPS {
        let point = patch.point(u, v);
        let (du, dv) = (point.du, point.dv);
        let depth = point.position[z] - frame.origin[2];
        let miss_x = frame.origin[0] + depth * shear_x - point.position[x];
        let miss_y = frame.origin[1] + depth * shear_y - point.position[y];
        let (xu, xv) = (du[x] - shear_x * du[z], dv[x] - shear_x * dv[z]);
        let (yu, yv) = (du[y] - shear_y * du[z], dv[y] - shear_y * dv[z]);
        let inverse = 1.0 / (xu * yv - xv * yu);
        let step_u = (miss_x * yv - miss_y * xv) * inverse;
        let step_v = (miss_y * xu - miss_x * yu) * inverse;
        (u, v) = (u + step_u, v + step_v);
        let step = step_u.abs().max(step_v.abs());
        if is_there && step <= BEYOND * fine {
            let t = (depth + step_u * du[z] + step_v * dv[z]) * frame.per_depth;
            let is_between = t >= guess.t[0] && t <= guess.t[1];
            return is_between.then_some(Found {
                t,
                u,
                v,
                above: guess.above,
                ng: Some(point.ng),
            });
        }
        // What is left is to this step's square as this step is to the square of the last.
        let left = step * (4.0 * (step / last_step).powi(2)).min(1.0);
        (last_step, is_there) = (step, left <= fine);
    }
    None
}
