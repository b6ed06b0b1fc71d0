//! The f64 half of the exact march: on which side of S the ray is, and where it changes sides.
//!
//! g(s) = w |N'(b)| - D(b), in units of the map's height, is positive above the surface. Fast paths report points of the
//! curve in order, with what they know of g there; where they do not know, g is evaluated. Two points on different
//! sides have a root between them, and only such a root is a hit: as many per prism as the signs at its ends ask for,
//! give or take pairs.

use crate::prism::curve::{Curve, quadratic};
use crate::prism::simd::{Lanes, Quad, Task};
use crate::surface::Patch;

use super::{Found, Problem};

/// What has been seen along a prism's curve so far.
pub struct Signs<'a> {
    problem: &'a Problem<'a>,
    /// The side of the last point.
    above: Option<bool>,
    /// Where it was, on the present curve.
    last: f64,
    nearest: Option<Found>,
    done: bool,
}

/// g and its derivative by s.
struct Height {
    g: f64,
    slope: f64,
    /// Texels per unit of s.
    speed: f64,
}

impl<'a> Signs<'a> {
    pub fn new(problem: &'a Problem<'a>) -> Self {
        Self {
            problem,
            above: None,
            last: 0.0,
            nearest: None,
            done: false,
        }
    }

    /// The nearest crossing that was accepted.
    pub fn nearest(&self) -> Option<Found> {
        self.nearest
    }

    /// Whether nothing behind is wanted.
    #[inline(always)]
    pub fn is_done(&self) -> bool {
        self.done
    }

    /// A new curve begins where the last one ended.
    #[inline(always)]
    pub fn begin(&mut self) {
        self.last = 0.0;
    }

    /// The point at s, of which it may be known whether it is above; `guess` is where a crossing before it would be.
    #[inline(always)]
    pub fn point<L: Lanes>(
        &mut self,
        curve: &Curve<L::Quad>,
        s: f64,
        known: Option<bool>,
        guess: f64,
        certain: bool,
    ) {
        let above = match known {
            Some(above) => above,
            None => L::outline(IsAbove {
                problem: self.problem,
                curve,
                s,
            }),
        };
        let before = self.above.replace(above);
        let last = std::mem::replace(&mut self.last, s);
        if before.is_none_or(|before| before == above) {
            return;
        }
        if certain && self.problem.any {
            // Somewhere in the ray's interval: no one asks where.
            self.nearest = Some(Found { t: 0.0, u: 0.0, v: 0.0 });
            self.done = true;
            return;
        }
        let found = L::outline(Crossing {
            problem: self.problem,
            curve,
            bracket: [last, s],
            guess,
            above: !above,
        });
        if !self.problem.accepts(found.t) {
            return;
        }
        if self.nearest.is_none_or(|n| found.t < n.t) {
            self.nearest = Some(found);
        }
        self.done = self.problem.is_ordered() || self.problem.any;
    }
}

#[inline(always)]
fn height<Q: Quad>(patch: &Patch<'_>, curve: &Curve<Q>, s: f64) -> Height {
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
    (c[2] + c[2]).mul_add(s, c[1])
}

struct IsAbove<'a, Q> {
    problem: &'a Problem<'a>,
    curve: &'a Curve<Q>,
    s: f64,
}

impl<L: Lanes<Quad = Q>, Q: Quad> Task<L> for IsAbove<'_, Q> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        height(&self.problem.patch(), self.curve, self.s).g > 0.0
    }
}

struct Crossing<'a, Q> {
    problem: &'a Problem<'a>,
    curve: &'a Curve<Q>,
    bracket: [f64; 2],
    guess: f64,
    above: bool,
}

impl<L: Lanes<Quad = Q>, Q: Quad> Task<L> for Crossing<'_, Q> {
    type Output = Found;

    #[inline(always)]
    fn run(self) -> Found {
        crossing(
            &self.problem.patch(),
            self.curve,
            self.bracket,
            self.guess,
            self.above,
        )
    }
}

/// The root between `from`, which is on the side `above`, and `to`, which is not: Newton's method, kept inside the
/// bracket.
#[inline(always)]
fn crossing<Q: Quad>(
    patch: &Patch<'_>,
    curve: &Curve<Q>,
    [mut from, mut to]: [f64; 2],
    guess: f64,
    above: bool,
) -> Found {
    // Newton's error is about the square of its step, in texels: what is left after a step of this length is below what
    // f32 tells apart.
    const FINE: f64 = 1.0 / 2048.0;
    const MOST_STEPS: usize = 60;
    let mut s = if guess >= from && guess <= to {
        guess
    } else {
        0.5 * (from + to)
    };
    for _ in 0..MOST_STEPS {
        let at = height(patch, curve, s);
        if (at.g > 0.0) == above {
            from = s;
        } else {
            to = s;
        }
        let step = at.g / at.slope;
        let newton = s - step;
        if !(newton >= from && newton <= to) {
            s = 0.5 * (from + to);
            continue;
        }
        s = newton;
        if step.abs() * at.speed.max(1.0) <= FINE || to - from <= f64::EPSILON {
            break;
        }
    }
    let (place, depth) = curve.at(s);
    let ([_, _, u, v], [_, z, zn, _]) = (place.to_array(), depth.to_array());
    Found {
        t: (z + curve.w(s) * zn) * curve.per_depth,
        u,
        v,
    }
}
