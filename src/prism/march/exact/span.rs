//! Skipping: which spans of an arc may meet the surface at all.
//!
//! A span is cut into 7 or 15 children at once. Texel coordinates (x, y), barycentrics and the ray's height
//! h = w |N'| are evaluated at their ends; a child's box is that of its two ends, widened by how far the curve may
//! leave the chord between them ([`arcs`](super::arcs)). The four blocks that its corners lie in, of the pyramid level whose blocks
//! are at least as large as the box, give the surface's range there; a child above or below it is done with.

mod record;

use super::Problem;
use super::arcs::Arcs;
use super::cells::{Chord, MOST_CELLS, Off};
use super::children::{Ends, Stack, at, length, of};
use super::landing::Guess;
use super::lod;
use super::signs::{Side, Signs};
use crate::prism::simd::{Grid, LANES, Lanes, Quad, Task};

/// A chord this close to the curve, in texels, may be walked cell by cell.
pub const CLOSE: f32 = 1.0 / 64.0;

/// Texels beyond which a span has 15 children.
const WIDE: f32 = 10.0;

/// Parameters closer than this f32 does not tell apart well.
pub const SHORTEST: f32 = 16.0 * f32::EPSILON;

/// One arc, ready to be walked.
#[derive(Clone, Copy)]
pub struct Walker<'a> {
    pub problem: &'a Problem<'a>,
    arcs: &'a Arcs,
    lane: usize,
    /// The arc's point of reference, from its texel base.
    pub origin: [f32; 2],
    /// The stored value that displaces by nothing.
    pub midlevel: f32,
    pub grid: Grid<'a>,
    /// The arc's texel base, within one period of the map.
    pub base: [f32; 2],
    /// The arc's point of reference in ray parameters.
    time_base: f64,
    /// The parameters between which crossings are looked for.
    pub whole: [f32; 2],
    /// tnear and tfar from the arc's point of reference in time, narrowed by all doubt.
    surely: [f32; 2],
    /// Whether the arc's ends are above the surface, where level of detail asks and that is known.
    pub caps: [Option<bool>; 2],
}

/// [`Walker::walk_here`] in a function of its own.
struct Walk<'w, 'a, 's, L: Lanes> {
    walker: &'w Walker<'a>,
    signs: &'w mut Signs<'s, L::Quad>,
}

impl<L: Lanes> Task<L> for Walk<'_, '_, '_, L> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.walker.walk_here::<L>(self.signs);
    }
}

/// The rest of a walk, which few rays need, in another.
struct Deep<'w, 'a, 's, L: Lanes> {
    walker: &'w Walker<'a>,
    signs: &'w mut Signs<'s, L::Quad>,
    children: u32,
    count: usize,
}

impl<L: Lanes> Task<L> for Deep<'_, '_, '_, L> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.walker
            .descend::<L>(self.children, self.count, self.signs);
    }
}

impl<'a> Walker<'a> {
    /// `texel` is the arcs' point of reference, `time` its in ray parameters.
    #[inline(always)]
    pub fn new(
        problem: &'a Problem<'a>,
        arcs: &'a Arcs,
        lane: usize,
        texel: [f64; 2],
        time: f64,
    ) -> Self {
        let grid = Grid::new(problem.surface.map());
        let base = [texel[0].floor(), texel[1].floor()];
        let mut walker = Self {
            problem,
            arcs,
            lane: lane % LANES,
            origin: [(texel[0] - base[0]) as f32, (texel[1] - base[1]) as f32],
            midlevel: grid.unit() * problem.surface.displacement().midlevel,
            base: grid.base(base),
            time_base: time,
            grid,
            whole: [0.0, 1.0],
            surely: [f32::NEG_INFINITY, f32::INFINITY],
            caps: [None; 2],
        };
        if problem.is_ordered() {
            walker.clip();
        }
        if problem.spread > 0.0 {
            walker.caps = lod::caps(&walker);
        }
        walker
    }

    /// Leaves out what is surely before tnear or behind tfar.
    #[inline(always)]
    fn clip(&mut self) {
        let [tnear, tfar] = self.problem.interval;
        let off = self.arcs.time_off[self.lane];
        let (begin, end) = (self.arcs.ends[0][self.lane], self.arcs.ends[1][self.lane]);
        let near = (f64::from(tnear) - self.time_base) as f32;
        let far = (f64::from(tfar) - self.time_base) as f32;
        // Hits are compared in single precision, where what is beyond its range is no hit.
        let rounding =
            |t: f32, from_there: f32| t.abs() * f32::EPSILON + from_there.abs() * f32::EPSILON;
        let last = tfar.min(f32::MAX);
        let surely_far = ((f64::from(last) - self.time_base) as f32).min(f32::MAX);
        self.surely = [
            near + rounding(tnear, near) + off,
            surely_far - rounding(last, surely_far) - off,
        ];
        let near = near - near.abs() * f32::EPSILON - off;
        let far = far + far.abs() * f32::EPSILON + off;
        if begin < near {
            self.whole[0] = self.parameter(near, -1.0).unwrap_or(0.0);
        }
        // Where level of detail ends a search must not depend on what was met before.
        if end > far && self.problem.spread == 0.0 {
            self.whole[1] = self.parameter(far, 1.0).unwrap_or(1.0);
        }
    }

    /// A parameter near to where the arc is at a ray parameter, but surely before (`side` -1) or behind (1) it.
    #[inline(always)]
    fn parameter(&self, t: f32, side: f32) -> Option<f32> {
        let (begin, end) = (self.arcs.ends[0][self.lane], self.arcs.ends[1][self.lane]);
        let per_time = 1.0 / (end - begin);
        let mut s = (t - begin) * per_time;
        // The false position, twice.
        for _ in 0..2 {
            s = (s + (t - self.time(s)) * per_time).clamp(0.0, 1.0);
        }
        s += side * (4.0 * (t - self.time(s)).abs() * per_time + f32::EPSILON);
        (s > 0.0 && s < 1.0 && (self.time(s) - t) * side >= 0.0).then_some(s)
    }

    /// A quadratic of the arc's at s.
    #[inline(always)]
    fn value(&self, [c0, c1, c2]: &[[f32; LANES]; 3], s: f32) -> f32 {
        let l = self.lane;
        c0[l] + s * (c1[l] + s * c2[l])
    }

    /// The ray parameter at s, from the arc's point of reference.
    #[inline(always)]
    fn time(&self, s: f32) -> f32 {
        let [c0, c1, c2, c3] = &self.arcs.time;
        let l = self.lane;
        (c0[l] + s * (c1[l] + s * (c2[l] + s * c3[l]))) / self.value(&self.arcs.area, s)
    }

    /// The ray parameters between which the arc's point at s is.
    #[inline(always)]
    pub fn times(&self, s: f32) -> [f64; 2] {
        let (t, off) = (self.time(s), self.arcs.time_off[self.lane]);
        [f64::from(t - off), f64::from(t + off)].map(|t| self.time_base + t)
    }

    /// w at both ends of the arc.
    #[inline(always)]
    pub fn offsets(&self) -> [f32; 2] {
        [self.arcs.w[0][self.lane], self.arcs.w[1][self.lane]]
    }

    /// Whether all points between two parameters are surely inside the prism.
    #[inline(always)]
    pub fn is_inside(&self, from: f32, to: f32) -> bool {
        let l = self.lane;
        let [u0, u1, u2] = &self.arcs.u;
        let [v0, v1, v2] = &self.arcs.v;
        let [a0, a1, a2] = &self.arcs.area;
        // A quadratic is below its chord by no more than this.
        let least = |c0: f32, c1: f32, c2: f32| {
            let at = |s: f32| c0 + s * (c1 + s * c2);
            at(from).min(at(to)) - c2.abs() * (to - from) * (to - from)
        };
        let [p0, p1, p2] = [
            a0[l] - u0[l] - v0[l],
            a1[l] - u1[l] - v1[l],
            a2[l] - u2[l] - v2[l],
        ];
        let inside = least(u0[l], u1[l], u2[l])
            .min(least(v0[l], v1[l], v2[l]))
            .min(least(p0, p1, p2));
        let [begin, end] = [from, to].map(|s| self.value(&self.arcs.area, s).abs());
        inside > 3.0 * self.arcs.inside_off[l] * begin.max(end)
    }

    /// The ray parameters at two parameters, where all points between them are surely inside the prism and the ray's interval.
    #[inline(always)]
    pub fn surely_within(&self, from: f32, to: f32) -> Option<[f32; 2]> {
        let times = [self.time(from), self.time(to)];
        (self.is_inside(from, to) && times[0] > self.surely[0] && times[1] < self.surely[1])
            .then_some(times)
    }

    /// Barycentrics of vertices 1 and 2 at s, about.
    #[inline(always)]
    pub fn uv(&self, s: f32) -> [f64; 2] {
        let area = self.value(&self.arcs.area, s);
        [&self.arcs.u, &self.arcs.v].map(|c| f64::from(self.value(c, s) / area))
    }

    /// A crossing at s, between two ray parameters, that comes from above or not.
    #[inline(always)]
    pub fn guess(&self, s: f32, times: [f32; 2], above: bool) -> Guess {
        let off = f64::from(self.arcs.time_off[self.lane]);
        Guess {
            uv: self.uv(s),
            t: [
                self.time_base + f64::from(times[0]) - off,
                self.time_base + f64::from(times[1]) + off,
            ],
            above,
        }
    }

    /// [`walk_here`](Self::walk_here) in a function of its own: it is long, and most callers are rare.
    #[inline(always)]
    pub fn walk<L: Lanes>(&self, signs: &mut Signs<'_, L::Quad>) {
        L::outline(Walk {
            walker: self,
            signs,
        });
    }

    /// Reports to `signs` every point of the arc at which the surface may be crossed, in order.
    #[inline(always)]
    pub fn walk_here<L: Lanes>(&self, signs: &mut Signs<'_, L::Quad>) {
        signs.begin();
        signs.count_span();
        if self.problem.spread > 0.0 && lod::through(self, signs) {
            return;
        }
        let (alive, ends) = self.children::<L>(self.whole);
        if alive == 0 || self.settles(&ends, alive, self.whole, signs) {
            return;
        }
        let rest = self.visit::<L>(&ends, alive, self.whole, signs);
        if rest != 0 && !signs.is_done() {
            L::outline(Deep {
                walker: self,
                signs,
                children: rest,
                count: ends.children,
            });
        }
    }

    /// Cuts a span into 7 children, or 15 if it is long: which of them may meet the surface, and where they end.
    #[inline(always)]
    fn children<L: Lanes>(&self, [from, to]: [f32; 2]) -> (u32, Ends) {
        if self.arcs.reach[self.lane] * (to - from) > WIDE {
            self.cut_into::<L, 2>([from, to])
        } else {
            self.cut_into::<L, 1>([from, to])
        }
    }

    /// Goes down below the children of the whole arc that could not be walked at once.
    ///
    /// A waiting span is at most a seventh of the one it came from, and all that wait come from different levels or the same
    /// span, so a stack of [`Stack::MOST`] holds ten levels; deeper ones, and f32 cannot tell many more apart, are halved instead.
    #[inline(always)]
    fn descend<L: Lanes>(&self, children: u32, count: usize, signs: &mut Signs<'_, L::Quad>) {
        let mut stack = Stack::new();
        stack.postpone(children, count, self.whole);
        while let Some(span) = stack.pop() {
            signs.count_span();
            if signs.is_done() {
                return;
            }
            let (alive, ends) = self.children::<L>(span);
            if alive == 0 {
                continue;
            }
            if self.settles(&ends, alive, span, signs) {
                return;
            }
            let rest = self.visit::<L>(&ends, alive, span, signs);
            if signs.is_done() {
                return;
            }
            stack.postpone(rest, ends.children, span);
        }
    }

    /// Whether the search ends here: because any crossing will do and there is one, or by level of detail.
    #[inline(always)]
    fn settles<Q: Quad>(
        &self,
        ends: &Ends,
        alive: u32,
        span: [f32; 2],
        signs: &mut Signs<'_, Q>,
    ) -> bool {
        if signs.any_will_do() && self.surely_crosses(ends, span) {
            signs.found_any();
            return true;
        }
        self.problem.spread > 0.0 && lod::settle(self, ends, alive, span, signs)
    }

    /// Whether the ray surely changes sides among the children of a span: some are wholly above the surface and some wholly below it, and
    /// all between two such is surely inside the prism and the ray's interval.
    #[inline(always)]
    fn surely_crosses(&self, ends: &Ends, span: [f32; 2]) -> bool {
        let all = (1 << ends.children) - 1;
        let (above, below) = (ends.above & all, ends.below & all);
        if above == 0 || below == 0 {
            return false;
        }
        let (first_above, first_below) = (above.trailing_zeros(), below.trailing_zeros());
        let (before, first) = match first_above < first_below {
            true => (above, first_below),
            false => (below, first_above),
        };
        let last_before = u32::BITS - (before & ((1 << first) - 1)).leading_zeros();
        let [from, to] = [last_before, first].map(|child| at(span, child as usize, ends.children));
        from < to && self.surely_within(from, to).is_some()
    }

    /// How far the boxes of a span's children go beyond their ends, and the level of the pyramid whose blocks hold them.
    #[inline(always)]
    fn boxes(&self, children: usize, span: [f32; 2]) -> (f32, usize) {
        let l = self.lane;
        let ds = length(span, children);
        let [x, y] = self.base;
        let off = self.arcs.bend[l] * ds * ds
            + self.arcs.rounding[l]
            + 4.0 * f32::EPSILON * x.abs().max(y.abs());
        // Ends are computed as far off as that at most, beside what is put around them.
        (off, self.grid.level(self.arcs.reach[l] * ds + 4.0 * off))
    }

    #[inline(always)]
    fn cut_into<L: Lanes, const R: usize>(&self, span: [f32; 2]) -> (u32, Ends) {
        let l = self.lane;
        let children = 8 * R - 1;
        let ds = length(span, children);
        let height_off = self.arcs.height_bend[l] * ds * ds + self.arcs.height_rounding[l];
        let [base_x, base_y] = self.base;
        let (box_off, level) = self.boxes(children, span);

        let zero = L::splat(0.0);
        let (mut x, mut y, mut h) = ([zero; R], [zero; R], [zero; R]);
        let places = self.arcs.places_of::<L>(l);
        let reference = [
            L::splat(self.origin[0]),
            L::splat(self.origin[1]),
            L::splat(self.midlevel),
        ];
        for r in 0..R {
            let first = 8.0 * r as f32;
            let numbers = L::from_array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
            let s = (numbers + L::splat(first)).mul_add(L::splat(ds), L::splat(span[0]));
            [x[r], y[r], h[r]] = places.at(s, reference);
        }
        let (mut all_above, mut all_below) = (0, 0);
        let mut range = [zero; R];
        let (box_off_lanes, height_off_lanes) = (L::splat(box_off), L::splat(height_off));
        for r in 0..R {
            let (x1, y1, h1) = (next(&x, r), next(&y, r), next(&h, r));
            let [low, high] = self.grid.block_range(
                level,
                [
                    L::splat(base_x) + x[r].min(x1) - box_off_lanes,
                    L::splat(base_x) + x[r].max(x1) + box_off_lanes,
                ],
                [
                    L::splat(base_y) + y[r].min(y1) - box_off_lanes,
                    L::splat(base_y) + y[r].max(y1) + box_off_lanes,
                ],
            );
            range[r] = high - low;
            let above = (high - (h[r].min(h1) - height_off_lanes)).sign_mask();
            let below = ((h[r].max(h1) + height_off_lanes) - low).sign_mask();
            all_above |= above << (8 * r);
            all_below |= below << (8 * r);
        }
        let mut alive = !(all_above | all_below) & ((1 << children) - 1);
        // Never: all that goes in is finite.
        if !(box_off + height_off).is_finite() {
            alive = 0;
        }
        let ends = Ends::new(children, &x, &y, &h, &range, [all_above, all_below]);
        (alive, ends)
    }

    /// Goes through the children that are left and walks their cells, in order, up to the first that is too long or too bent;
    /// that one and those behind are returned.
    #[inline(always)]
    fn visit<L: Lanes>(
        &self,
        ends: &Ends,
        mut alive: u32,
        span: [f32; 2],
        signs: &mut Signs<'_, L::Quad>,
    ) -> u32 {
        let l = self.lane;
        let ds = length(span, ends.children);
        let (bend, height_bend) = (self.arcs.bend[l], self.arcs.height_bend[l]);
        // f32 cannot tell the parts of such a span from one another: f64 looks at its ends.
        if span[1] - span[0] < SHORTEST {
            let (a, b) = (f64::from(span[0]), f64::from(span[1]));
            for s in [a, b] {
                let point = signs.look::<L>(s, Side::Unknown);
                signs.point::<L>(point, s);
            }
            return 0;
        }
        while alive != 0 {
            let first = alive.trailing_zeros() as usize;
            let mut last = first + 1;
            if bend * ds * ds > CLOSE || ends.cells(first, last) > MOST_CELLS {
                return alive;
            }
            // As many children as one chord stays close over, and crosses few cells.
            let mut length = ds;
            let mut range = of(&ends.range, first);
            while alive >> last & 1 != 0 {
                let longer = length + ds;
                if bend * longer * longer > CLOSE || ends.cells(first, last + 1) > MOST_CELLS {
                    break;
                }
                range = range.max(of(&ends.range, last));
                length = longer;
                last += 1;
            }
            let chord = Chord {
                from: ends.point(first),
                to: ends.point(last),
                cells: [ends.cell(first), ends.cell(last)],
                s: [
                    at(span, first, ends.children),
                    at(span, last, ends.children),
                ],
                off: Off {
                    place: bend * length * length + self.arcs.rounding[l],
                    height: height_bend * length * length + self.arcs.height_rounding[l],
                    range,
                },
            };
            chord.walk::<L>(&self.grid, self.base, self, signs);
            if signs.is_done() {
                return 0;
            }
            alive &= !0 << last;
        }
        0
    }
}

/// Register r of a row, moved by one lane.
#[inline(always)]
fn next<L: Lanes, const R: usize>(row: &[L; R], r: usize) -> L {
    if r + 1 < R {
        row[r].next_of(row[r + 1])
    } else {
        row[r].next()
    }
}
