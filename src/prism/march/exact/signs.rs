//! The f64 half of the exact march: on which side of S the ray is, and where it changes sides.
//!
//! g(s) = w |N'(b)| - D(b), in units of the map's height, is positive above the surface. Fast paths report points of the
//! curve in order, with what they know of g there; where they do not know, g is evaluated. Two points on different
//! sides have a root between them, and only such a root is a hit: as many per prism as the signs at its ends ask for,
//! give or take pairs.

use crate::prism::curve::{Curve, View};
use crate::prism::ray_frame::RayFrame;
use crate::prism::simd::{Lanes, Quad, Task};

use super::landing::{Guess, land};
use super::roots::{Breaks, crossing, dip, height};
use super::{Found, Problem};

/// What has been seen along a prism's curve so far.
#[derive(Clone, Copy)]
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
const PATIENCE: u32 = 1 << 16;

/// Spans that a stretch in f64 counts for: it takes as long as a few, and no ray that is not among such texture coordinates needs thousands.
const STRETCH: u32 = 8;

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
            patience: PATIENCE,
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

    /// Whether the last point, if there was one, was on this side.
    #[inline(always)]
    pub fn comes_from(&self, above: bool) -> bool {
        self.above.is_none_or(|last| last == above)
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
        self.count(1);
    }

    #[inline(always)]
    fn count(&mut self, work: u32) {
        self.patience = self.patience.saturating_sub(work);
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
        self.count(STRETCH);
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
        self.nearest = Some(Found::ANY);
        self.done = true;
    }

    /// Ends the search at a crossing between two points whose sides are certain; `false` where signs must find it.
    #[inline(always)]
    pub fn land<L: Lanes<Quad = Q>>(&mut self, guess: &Guess) -> bool {
        if !self.problem.is_ordered() || !self.comes_from(guess.above) {
            return false;
        }
        let Some(found) = L::outline(Landing { signs: self, guess }) else {
            return false;
        };
        self.end_with(found);
        true
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

struct Landing<'s, 'a, Q> {
    signs: &'s Signs<'a, Q>,
    guess: &'s Guess,
}

impl<L: Lanes<Quad = Q>, Q: Quad> Task<L> for Landing<'_, '_, Q> {
    type Output = Option<Found>;

    #[inline(always)]
    fn run(self) -> Option<Found> {
        land(&self.signs.problem.patch(), self.signs.frame, self.guess)
    }
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
