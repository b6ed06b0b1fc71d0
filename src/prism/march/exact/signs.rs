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
    /// Spans that may still be looked at.
    patience: u32,
}

/// Spans that one ray may look at in one prism, some 10^8 texels: reached only where texture coordinates repeat a map
/// millions of times over a triangle. What is behind is not looked for, so that no ray hangs.
const MOST_SPANS: u32 = 1 << 20;

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
            patience: MOST_SPANS,
        }
    }

    /// The nearest crossing that was accepted.
    pub fn nearest(&self) -> Option<Found> {
        self.nearest
    }

    /// Whether no point has been reported yet.
    #[inline(always)]
    pub fn is_fresh(&self) -> bool {
        self.above.is_none()
    }

    /// The side of the last point.
    #[inline(always)]
    pub fn is_above(&self) -> Option<bool> {
        self.above
    }

    /// Whether nothing behind is wanted.
    #[inline(always)]
    pub fn is_done(&self) -> bool {
        self.done
    }

    /// Counts a span; ends the search where there were too many.
    #[inline(always)]
    pub fn count_span(&mut self) {
        self.patience = self.patience.saturating_sub(1);
        self.done |= self.patience == 0;
    }

    /// A new curve begins where the last one ended.
    #[inline(always)]
    pub fn begin(&mut self) {
        self.last = 0.0;
    }

    /// Where a point is exactly, and whether it is above S.
    #[inline(always)]
    pub fn look<L: Lanes>(&self, curve: &Curve<L::Quad>, s: f64, side: Side) -> (f64, bool) {
        match side {
            Side::Above => (s, true),
            Side::Below => (s, false),
            Side::Unknown(line) => L::outline(Look {
                problem: self.problem,
                curve,
                s,
                line,
            }),
        }
    }

    /// A point between two that are on the same side of S, and within one cell, that is on the other.
    #[inline(always)]
    pub fn dip<L: Lanes>(
        &self,
        curve: &Curve<L::Quad>,
        ends: [f64; 2],
        lines: [Option<TexelLine>; 2],
        above: bool,
    ) -> Option<f64> {
        L::outline(Dip {
            problem: self.problem,
            curve,
            ends,
            lines,
            above,
        })
    }

    /// Whether a crossing between two points whose sides are certain is all that is asked.
    #[inline(always)]
    pub fn any_will_do(&self) -> bool {
        self.problem.any && self.problem.is_ordered()
    }

    /// Ends the search with a crossing of which no one asks where it is.
    #[inline(always)]
    pub fn found_any(&mut self) {
        self.nearest = Some(Found {
            t: 0.0,
            u: 0.0,
            v: 0.0,
            above: true,
        });
        self.done = true;
    }

    /// Ends the search at a crossing, or without one where that is outside the ray's interval.
    #[inline(always)]
    pub fn end_with(&mut self, found: Found) {
        if self.problem.accepts(found.t) {
            self.nearest = Some(found);
        }
        self.done = true;
    }

    /// The next point. `guess` is where a crossing since the last one would be.
    #[inline(always)]
    pub fn point<L: Lanes>(&mut self, curve: &Curve<L::Quad>, (s, above): (f64, bool), guess: f64) {
        // At a corner of the grid two lanes begin at once, and the shorter one may come second.
        if self.done || (s <= self.last && self.above.is_some()) {
            return;
        }
        let before = self.above.replace(above);
        let last = std::mem::replace(&mut self.last, s);
        if before.is_none_or(|before| before == above) {
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

/// On which side of S a point is, as far as a fast path knows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Side {
    Above,
    Below,
    /// To be looked at; where the curve is to be exactly on a texel line first.
    Unknown(Option<TexelLine>),
}

impl Side {
    /// By the sign of f.
    #[inline(always)]
    pub fn of(f: f32) -> Self {
        if f > 0.0 { Self::Above } else { Self::Below }
    }
}

/// The line x or y = `at`, relative to the curve's texel base. The surface has its crests on such lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TexelLine {
    /// 0 for x, 1 for y.
    pub axis: usize,
    pub at: f64,
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

struct Look<'a, Q> {
    problem: &'a Problem<'a>,
    curve: &'a Curve<Q>,
    s: f64,
    line: Option<TexelLine>,
}

impl<L: Lanes<Quad = Q>, Q: Quad> Task<L> for Look<'_, Q> {
    type Output = (f64, bool);

    #[inline(always)]
    fn run(self) -> (f64, bool) {
        let s = match self.line {
            Some(line) => on_line(self.curve, self.s, line),
            None => self.s,
        };
        let g = height(&self.problem.patch(), self.curve, s).g;
        (s, g > 0.0)
    }
}

/// Where the curve crosses a texel line, near s: two steps of Newton's method.
#[inline(always)]
fn on_line<Q: Quad>(curve: &Curve<Q>, near: f64, line: TexelLine) -> f64 {
    let mut s = near;
    for _ in 0..2 {
        let at = Q::splat(s);
        let inverse = Q::splat(1.0) / quadratic(&curve.depth, at).broadcast::<0>();
        let place = quadratic(&curve.place, at) * inverse;
        let turn = slope(&curve.depth, at).broadcast::<0>();
        let change = (slope(&curve.place, at) - place * turn) * inverse;
        let miss = place.to_array()[line.axis] - line.at;
        let moved = s - miss / change.to_array()[line.axis];
        // Where the curve runs along the line there is nothing to be gained.
        const FAR: f64 = 1.0 / 64.0;
        if (moved - near).abs() <= FAR {
            s = moved;
        } else {
            return near;
        }
    }
    s.clamp(0.0, 1.0)
}

struct Dip<'a, Q> {
    problem: &'a Problem<'a>,
    curve: &'a Curve<Q>,
    ends: [f64; 2],
    /// The lines that bound the cell there.
    lines: [Option<TexelLine>; 2],
    above: bool,
}

impl<L: Lanes<Quad = Q>, Q: Quad> Task<L> for Dip<'_, Q> {
    type Output = Option<f64>;

    /// Goes to where the slope of g is 0, by the false position between ends where |g| falls and where it rises.
    #[inline(always)]
    fn run(self) -> Option<f64> {
        const MOST_STEPS: usize = 8;
        let patch = self.problem.patch();
        let sign = if self.above { 1.0 } else { -1.0 };
        // A hair inside: beyond the ends are other cells.
        let aligned =
            |s: f64, line: Option<TexelLine>| line.map_or(s, |line| on_line(self.curve, s, line));
        let from = aligned(self.ends[0], self.lines[0]);
        let to = aligned(self.ends[1], self.lines[1]);
        let hair = 1e-9 * (to - from);
        let (mut a, mut b) = (from + hair, to - hair);
        let mut falls = sign * height(&patch, self.curve, a).slope;
        let mut rises = sign * height(&patch, self.curve, b).slope;
        if !(falls < 0.0 && rises > 0.0) {
            return None;
        }
        for _ in 0..MOST_STEPS {
            let s = a + (b - a) * (falls / (falls - rises));
            let at = height(&patch, self.curve, s);
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
    // Newton's error is about the square of its step, in texels.
    const FINE: f64 = 1e-7;
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
    let [t, u, v] = curve.seen(s);
    Found { t, u, v, above }
}
