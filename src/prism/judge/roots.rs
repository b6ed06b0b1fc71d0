//! Roots of g on a part of a curve that is within one cell.
//!
//! g(s) = w |N'(b)| - D(b), in units of the map's height, is positive above the surface.

use glam::DVec2;

use crate::prism::curve::{Curve, quadratic};
use crate::prism::simd::Quad;
use crate::surface::Patch;

use super::Found;
/// g and its derivative by s.
pub struct Height {
    pub g: f64,
    slope: f64,
    /// Texels per unit of s.
    speed: f64,
}

#[inline(always)]
pub fn height<Q: Quad>(patch: &Patch<'_>, curve: &Curve<Q>, s: f64) -> Height {
    let at = Q::splat(s);
    let (place, place_change) = (quadratic(&curve.place, at), slope(&curve.place, at));
    let (depth, depth_change) = (quadratic(&curve.depth, at), slope(&curve.depth, at));
    let inverse = Q::splat(1.0) / depth.broadcast::<0>();
    let place = place * inverse;
    // (n / A)' = (n' - (n / A) A') / A.
    let change = (place_change - place * depth_change.broadcast::<0>()) * inverse;
    let ([x, y, u, v], [dx, dy, du, dv]) = (place.to_array(), change.to_array());
    let w = curve.w(s);

    let (n1, n2) = (
        patch.normals[1] - patch.normals[0],
        patch.normals[2] - patch.normals[0],
    );
    let normal = patch.normals[0] + u * n1 + v * n2;
    let length = normal.length();
    let stretch = normal.dot(du * n1 + dv * n2) / length;
    let texel = DVec2::new(x + curve.texel_base[0], y + curve.texel_base[1]);
    let sample = patch.map.sample(texel);
    let per_height = 1.0 / patch.scale;
    Height {
        g: w * length * per_height + patch.midlevel - sample.height,
        slope: (curve.w[1] * length + w * stretch) * per_height
            - (sample.gradient.x * dx + sample.gradient.y * dy),
        speed: dx.abs().max(dy.abs()),
    }
}

/// The derivative of a quadratic.
#[inline(always)]
fn slope<Q: Quad>(c: &[Q; 3], s: Q) -> Q {
    (c[2] + c[2]) * s + c[1]
}

/// A point between two that are on the same side of S, and in one cell, that is on the other: goes to where the slope of g
/// is 0, by the false position between ends where |g| falls and where it rises.
#[inline(always)]
pub fn dip<Q: Quad>(
    patch: &Patch<'_>,
    curve: &Curve<Q>,
    [from, to]: [f64; 2],
    above: bool,
) -> Option<f64> {
    const MOST_STEPS: usize = 8;
    let sign = if above { 1.0 } else { -1.0 };
    // A hair inside: beyond the ends are other cells.
    let hair = 1e-9 * (to - from);
    let (mut a, mut b) = (from + hair, to - hair);
    let mut falls = sign * height(patch, curve, a).slope;
    let mut rises = sign * height(patch, curve, b).slope;
    if !(falls < 0.0 && rises > 0.0) {
        return None;
    }
    for _ in 0..MOST_STEPS {
        let s = a + (b - a) * (falls / (falls - rises));
        let at = height(patch, curve, s);
        if sign * at.g <= 0.0 {
            return Some(s);
        }
        let slope = sign * at.slope;
        // No lower than a parabola through here: too high to matter.
        let lowest = sign * at.g - slope.abs() * (b - a);
        if lowest > 0.0 || slope == 0.0 {
            return None;
        }
        if slope < 0.0 {
            (a, falls) = (s, slope);
        } else {
            (b, rises) = (s, slope);
        }
    }
    None
}

/// The root between `from`, which is on the side `above`, and `to`, which is not: Newton's method, kept inside the
/// bracket.
#[inline(always)]
pub fn crossing<Q: Quad>(
    patch: &Patch<'_>,
    curve: &Curve<Q>,
    [mut from, mut to]: [f64; 2],
    guess: f64,
    above: bool,
) -> Found {
    // Newton's error is about the square of its step, in texels.
    const FINE: f64 = 1e-7;
    const MOST_STEPS: usize = 60;
    let mut s = if guess >= from && guess <= to {
        guess
    } else {
        0.5 * (from + to)
    };
    let mut last_step = to - from;
    for _ in 0..MOST_STEPS {
        let at = height(patch, curve, s);
        if (at.g > 0.0) == above {
            from = s;
        } else {
            to = s;
        }
        let step = at.g / at.slope;
        let newton = s - step;
        // Over the edges between texel cells Newton's method may go to and fro for ever.
        if !(newton >= from && newton <= to && 2.0 * step.abs() <= last_step) {
            last_step = 0.5 * (to - from);
            s = from + last_step;
            if last_step <= f64::EPSILON {
                break;
            }
            continue;
        }
        s = newton;
        last_step = step.abs();
        if step.abs() * at.speed.max(1.0) <= FINE || to - from <= f64::EPSILON {
            break;
        }
    }
    Found::at(curve, s)
}
