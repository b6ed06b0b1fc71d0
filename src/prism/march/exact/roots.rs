//! Roots of g on a curve, and what they are found by, in f64: where the curve crosses texel lines, where g turns.

use crate::prism::curve::{Curve, quadratic};
use crate::prism::simd::Quad;
use crate::surface::Patch;

use super::Found;
use super::span::CLOSE;

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
    let texel = glam::DVec2::new(x + curve.texel_base[0], y + curve.texel_base[1]);
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

/// Lines x or y = k that are met between two points about one texel apart.
const MOST_LINES: usize = 2;

/// Where a curve crosses texel lines, in order, and its end: the surface has its crests on texel lines.
pub struct Breaks {
    /// A curve crosses a line twice at most.
    pub all: [f64; 4 * MOST_LINES + 1],
    pub count: usize,
}

impl Breaks {
    #[inline(always)]
    pub fn new<Q: Quad>(curve: &Curve<Q>, [from, to]: [f64; 2]) -> Self {
        // A curve may leave the box of two points by its distance from their chord.
        const BEYOND: f64 = CLOSE as f64;
        let mut breaks = Self {
            all: [to; 4 * MOST_LINES + 1],
            count: 1,
        };
        let [p0, p1, p2] = [
            curve.place[0].to_array(),
            curve.place[1].to_array(),
            curve.place[2].to_array(),
        ];
        let [a0, a1, a2] = curve.area();
        for axis in 0..2 {
            let (c0, c1, c2) = (p0[axis], p1[axis], p2[axis]);
            let x = |s: f64| (c0 + s * (c1 + s * c2)) / (a0 + s * (a1 + s * a2));
            let (a, b) = (x(from), x(to));
            let first = (a.min(b) - BEYOND).ceil();
            let last = (a.max(b) + BEYOND).floor();
            for k in 0..MOST_LINES {
                let line = first + k as f64;
                if line <= last {
                    // X = line A.
                    breaks.cut([c0 - line * a0, c1 - line * a1, c2 - line * a2], from);
                }
            }
        }
        breaks
    }

    /// Takes in the roots of a quadratic that are behind `from` and before the end.
    #[inline(always)]
    fn cut(&mut self, [c0, c1, c2]: [f64; 3], from: f64) {
        let discriminant = c1 * c1 - 4.0 * c0 * c2;
        // The root of a negative one is no number, and is not taken in.
        let q = -0.5 * (c1 + discriminant.sqrt().copysign(c1));
        for root in [q / c2, c0 / q] {
            let mut k = self.count - 1;
            if !(root > from && root < self.all[k]) {
                continue;
            }
            self.all[k + 1] = self.all[k];
            self.count += 1;
            while k > 0 && self.all[k - 1] > root {
                self.all[k] = self.all[k - 1];
                k -= 1;
            }
            self.all[k] = root;
        }
    }
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
    let [t, u, v] = curve.seen(s);
    Found {
        t,
        u,
        v,
        above,
        ng: None,
    }
}
