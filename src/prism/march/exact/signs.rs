//! The f64 half of the exact march: on which side of S the ray is, and where it changes sides.
//!
//! g(s) = w |N'(b)| - D(b), in units of the map's height, is positive above the surface. Fast paths report points of the
//! curve in order, with what they know of g there; where they do not know, g is evaluated. Two points on different
//! sides have a root between them, and only such a root is a hit: as many per prism as the signs at its ends ask for,
//! give or take pairs.

use crate::prism::curve::{Curve, View, quadratic};
use crate::prism::ray_frame::RayFrame;
use crate::prism::simd::{Lanes, Quad, Task};
use crate::surface::Patch;

use super::{Found, Problem};

/// What has been seen along a prism's curve so far.
pub struct Signs<'a, Q> {
    problem: &'a Problem<'a>,
    frame: &'a RayFrame,
    /// The present curve. That of an arc which f32 set up is made when it is first asked for.
    curve: Option<Curve<Q>>,
    /// w at both ends of such an arc.
    arc: Option<[f64; 2]>,
    /// Whether a crossing lies so near to a side that f64 roots must say on which prism's side.
    is_near_side: bool,
    /// The side of the last point.
    above: Option<bool>,
    /// Where it was, on the present curve.
    last: f64,
    nearest: Option<Found>,
    done: bool,
    /// Spans that may still be looked at.
    patience: u32,
}

/// Spans that one ray may look at in one prism, some millions of texels: reached only where texture coordinates repeat a
/// map thousands of times over a triangle. What is behind is not looked for, so that no ray hangs.
const MOST_SPANS: u32 = 1 << 16;

/// g and its derivative by s.
struct Height {
    g: f64,
    slope: f64,
    /// Texels per unit of s.
    speed: f64,
}

impl<'a, Q: Quad> Signs<'a, Q> {
    #[inline(always)]
    pub fn new(problem: &'a Problem<'a>, frame: &'a RayFrame) -> Self {
        Self {
            problem,
            frame,
            curve: None,
            arc: None,
            is_near_side: false,
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

    /// What follows is about this curve.
    #[inline(always)]
    pub fn set_curve(&mut self, curve: Curve<Q>) {
        self.curve = Some(curve);
    }

    /// What follows is about the curve between two w, which may go on outside the prism: crossings there are none of this prism.
    #[inline(always)]
    pub fn set_arc(&mut self, w: [f64; 2]) {
        self.arc = Some(w);
    }

    /// A new curve begins where the last one ended.
    #[inline(always)]
    pub fn begin(&mut self) {
        self.last = 0.0;
    }

    /// Whether all must be looked at again, in f64 from the beginning.
    #[inline(always)]
    pub fn is_near_side(&self) -> bool {
        self.is_near_side
    }

    /// The present curve. Called in outlined tasks only: it is long.
    #[inline(always)]
    pub fn curve(&mut self) -> Curve<Q> {
        if let Some(curve) = self.curve {
            return curve;
        }
        let Problem { cluster, lane, .. } = *self.problem;
        let corners = cluster.corners::<Q>(lane, self.frame.axes);
        let [from, to] = self.arc.unwrap_or_default();
        let view = View::new(&corners, self.frame, from.abs().max(to.abs()));
        let texels = cluster.texels(lane, self.problem.surface.map());
        let curve = Curve::between(&view, &texels, [from, to], self.frame.per_depth);
        self.curve = Some(curve);
        curve
    }

    /// A point, and whether it is above S.
    #[inline(always)]
    pub fn look<L: Lanes<Quad = Q>>(&mut self, s: f64, side: Side) -> (f64, bool) {
        match side {
            Side::Above => (s, true),
            Side::Below => (s, false),
            Side::Unknown => L::outline(Look { signs: self, s }),
        }
    }

    /// All points of the curve between two about one texel apart: nothing is crossed between the last point and `from`.
    /// `guess` is where a crossing would be.
    #[inline(always)]
    pub fn look_closely<L: Lanes<Quad = Q>>(&mut self, ends: [f64; 2], guess: f64) {
        L::outline(Closely {
            signs: self,
            ends,
            guess,
        });
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
    pub fn point<L: Lanes<Quad = Q>>(&mut self, (s, above): (f64, bool), guess: f64) {
        // At a corner of the grid two lanes begin at once, and the shorter one may come second.
        if self.done || (s <= self.last && self.above.is_some()) {
            return;
        }
        let before = self.above.replace(above);
        let last = std::mem::replace(&mut self.last, s);
        if before.is_none_or(|before| before == above) {
            return;
        }
        L::outline(Crossing {
            bracket: [last, s],
            guess,
            above: !above,
            signs: self,
        });
    }

    /// A crossing: is it this prism's, and wanted?
    #[inline(always)]
    fn take(&mut self, found: Found) {
        if self.arc.is_some() {
            // Roundings of f64 are a millionth of this.
            const NEAR: f64 = 1e-9;
            let least = found.u.min(found.v).min(1.0 - found.u - found.v);
            if least < -NEAR {
                return;
            }
            if least < NEAR {
                self.is_near_side = true;
                self.done = true;
                return;
            }
        }
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
    /// To be looked at.
    Unknown,
}

impl Side {
    /// By the sign of f.
    #[inline(always)]
    pub fn of(f: f32) -> Self {
        if f > 0.0 { Self::Above } else { Self::Below }
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

struct Look<'s, 'a, Q> {
    signs: &'s mut Signs<'a, Q>,
    s: f64,
}

impl<L: Lanes<Quad = Q>, Q: Quad> Task<L> for Look<'_, '_, Q> {
    type Output = (f64, bool);

    #[inline(always)]
    fn run(self) -> (f64, bool) {
        let curve = self.signs.curve();
        let g = height(&self.signs.problem.patch(), &curve, self.s).g;
        (self.s, g > 0.0)
    }
}

struct Closely<'s, 'a, Q> {
    signs: &'s mut Signs<'a, Q>,
    ends: [f64; 2],
    guess: f64,
}

impl<L: Lanes<Quad = Q>, Q: Quad> Task<L> for Closely<'_, '_, Q> {
    type Output = ();

    /// Goes from one texel line to the next: between two the curve is in one cell, where g has one turning point at most.
    #[inline(always)]
    fn run(self) {
        let Self {
            signs,
            ends: [mut from, to],
            guess,
        } = self;
        let curve = &signs.curve();
        let patch = signs.problem.patch();
        let breaks = Breaks::new(curve, [from, to]);
        for k in 0..breaks.count {
            let s = breaks.all[k];
            let above = height(&patch, curve, s).g > 0.0;
            if signs.above == Some(above)
                && let Some(dip) = dip(&patch, curve, [from, s], above)
            {
                signs.point::<L>((dip, !above), dip);
            }
            signs.point::<L>((s, above), guess);
            if signs.done {
                return;
            }
            from = s;
        }
    }
}

/// Lines x or y = k that are met between two points about one texel apart.
const MOST_LINES: usize = 2;

/// Where a curve crosses texel lines, in order, and its end: the surface has its crests on texel lines.
struct Breaks {
    /// A curve crosses a line twice at most.
    all: [f64; 4 * MOST_LINES + 1],
    count: usize,
}

impl Breaks {
    #[inline(always)]
    fn new<Q: Quad>(curve: &Curve<Q>, [from, to]: [f64; 2]) -> Self {
        /// Texels by which a curve may leave the box of two points: a bit more than its distance from their chord.
        const BEYOND: f64 = 1.0 / 64.0;
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
fn dip<Q: Quad>(
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

struct Crossing<'s, 'a, Q> {
    signs: &'s mut Signs<'a, Q>,
    bracket: [f64; 2],
    guess: f64,
    above: bool,
}

impl<L: Lanes<Quad = Q>, Q: Quad> Task<L> for Crossing<'_, '_, Q> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let curve = &self.signs.curve();
        let patch = self.signs.problem.patch();
        let found = crossing(&patch, curve, self.bracket, self.guess, self.above);
        self.signs.take(found);
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
    Found { t, u, v, above }
}
