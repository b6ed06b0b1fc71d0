//! Skipping: which spans of a curve may meet the surface at all.
//!
//! A span of the curve is cut into 7 or 15 children at once. Texel coordinates (x, y), barycentrics and the ray's height
//! h = w |N'| are evaluated at their ends; a child's box is that of its two ends, widened by how far the curve may
//! leave the chord between them. One gather from the pyramid level whose block is at least as large as the box gives the
//! surface's range there; a child above or below it is done with.
//!
//! **The bound.** For r = n/A on [0, 1], n and A quadratic: A >= A_min = min(A(0), A(1)) - max(a2, 0)/4;
//! |r'| <= R = max of the Bernstein coefficients of n'A - nA' over A_min^2; r'' A = n'' - a2'' r - 2 r'A', so
//! |r''|/2 <= M = (|n2 - a2 r(0)| + R (|a2| + max|A'|)) / A_min; a chord of length ds is left by at most M ds^2/4.
//! For h = w k with k = |N'(b(s))|, convex in b: |k'| <= K1 = |n1-n0| R_u + |n2-n0| R_v,
//! |k''|/2 <= K2 = |n1-n0| M_u + |n2-n0| M_v + K1^2/(2 k_min), so |h''|/2 <= |w| K2 + |dw| K1.
//! To these come the roundings of the f32 evaluation: at most 8 units of the sum of magnitudes that each value is made of.

use glam::{Vec3, Vec4};

use super::Problem;
use super::cells::{Chord, MOST_CELLS, NUDGE};
use super::children::{Ends, Stack, at, of};
use super::signs::{Side, Signs};
use crate::prism::curve::{Curve, View};
use crate::prism::simd::{Grid, Lanes, Quad, Task};

/// A chord this close to the curve, in texels, may be walked cell by cell.
const CLOSE: f32 = 1.0 / 256.0;

/// Texels beyond which a span has 15 children.
const WIDE: f32 = 10.0;

/// An f32 value is within this many units in the last place of the magnitudes it was computed from.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// One curve in f32, ready to be walked.
pub struct Walker<'a, L: Lanes> {
    problem: &'a Problem<'a>,
    curve: &'a Curve<L::Quad>,
    /// (X, Y, B1, B2): coefficients of 1, s, s^2.
    place: [Vec4; 3],
    /// A's coefficients.
    area: [f32; 3],
    /// Height of w in stored texel units: at s = 0, and its change.
    height: [f32; 2],
    /// The stored value that displaces by nothing.
    midlevel: f32,
    /// |n_i - n_j|^2 of the vertex pairs (0,1), (0,2), (1,2).
    spread: Vec3,
    /// |n_1 - n_0| and |n_2 - n_0|.
    turns: [f32; 2],
    /// At least the largest 1/|N'|.
    stretch: f32,
    /// (t(s) - t(0)) A: coefficients of 1 .. s^3.
    time: [f32; 4],
    /// tnear and tfar minus t(0), widened; and whether they cut anything off.
    interval: [f32; 2],
    cut: bool,
    grid: Grid<'a>,
    /// Texel coordinates of the curve's origin, within one period of the map.
    base: [f32; 2],
}

/// What bounds a span of length 1 in its own parameter.
#[derive(Clone, Copy)]
struct Bounds {
    /// Texels that (x, y) move at most.
    reach: f32,
    /// Half of |(x, y)''| over 2: a chord of length ds is left by this times ds^2.
    bend: f32,
    /// The same of the height, stored texel units.
    height_bend: f32,
    /// Rounding of (x, y), texels.
    rounding: f32,
    /// Rounding of the height, stored texel units.
    height_rounding: f32,
}

/// [`Walker::walk`] in a function of its own: its callers are many, and it is long.
struct Walk<'w, 'a, 's, L: Lanes> {
    walker: &'w Walker<'a, L>,
    signs: &'w mut Signs<'s>,
}

impl<L: Lanes> Task<L> for Walk<'_, '_, '_, L> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.walker.walk_here(self.signs);
    }
}

/// The rest of a walk, which few rays need, in another.
struct Deep<'w, 'a, 's, L: Lanes> {
    walker: &'w Walker<'a, L>,
    signs: &'w mut Signs<'s>,
    children: u32,
    count: usize,
}

impl<L: Lanes> Task<L> for Deep<'_, '_, '_, L> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.walker.descend(self.children, self.count, self.signs);
    }
}

/// A span in its own parameter.
struct Span {
    place: [Vec4; 3],
    area: [f32; 3],
    height: [f32; 2],
}

impl<'a, L: Lanes> Walker<'a, L> {
    /// `ends` are the ray parameters at both ends of the curve.
    #[inline(always)]
    pub fn new(
        problem: &'a Problem<'a>,
        curve: &'a Curve<L::Quad>,
        view: &View<L::Quad>,
        [t0, t1]: [f64; 2],
    ) -> Self {
        let displacement = problem.surface.displacement();
        let grid = Grid::new(problem.surface.map());
        let ([p0, p1, p2], [d0, d1, d2]) = (curve.place, curve.depth);
        let unit = grid.unit();
        let per_world = f64::from(unit) / f64::from(displacement.scale);
        let [w0, dw] = curve.w;
        // Of t in single precision, as of hits: rounded, the ends still enclose all between.
        let cut = problem.is_ordered() && !(problem.accepts(t0) && problem.accepts(t1));
        let (area0, area1, area2) = (d0.to_f32(), d1.to_f32(), d2.to_f32());
        let spread = view.spread.to_f32();
        let mut walker = Self {
            problem,
            curve,
            base: grid.base(curve.texel_base),
            grid,
            place: [p0.to_f32(), p1.to_f32(), p2.to_f32()],
            area: [area0.x, area1.x, area2.x],
            height: [(w0 * per_world) as f32, (dw * per_world) as f32],
            midlevel: unit * displacement.midlevel,
            spread: Vec3::new(spread.x, spread.z, spread.y),
            turns: [spread.x.sqrt(), spread.z.sqrt()],
            stretch: 1.000_01
                / (1.0 - spread.truncate().max_element() / 3.0)
                    .max(1e-6)
                    .sqrt(),
            cut,
            time: [0.0; 4],
            interval: [0.0; 2],
        };
        if cut {
            walker.set_times([t0, t1]);
        }
        walker
    }

    /// Makes ready to tell what is outside the ray's interval.
    #[inline(always)]
    fn set_times(&mut self, [t0, t1]: [f64; 2]) {
        let [d0, d1, d2] = self.curve.depth;
        let ([a0, z0, n0, _], [a1, z1, n1, _]) = (d0.to_array(), d1.to_array());
        let ([a2, z2, n2, _], [w, dw]) = (d2.to_array(), self.curve.w);
        // (Z + w Zn) - depth(0) A, w = w(0) + dw s.
        let per_depth = self.curve.per_depth;
        let time = [
            (z0 + w * n0) * per_depth - t0 * a0,
            (z1 + w * n1 + dw * n0) * per_depth - t0 * a1,
            (z2 + w * n2 + dw * n1) * per_depth - t0 * a2,
            dw * n2 * per_depth,
        ];
        self.time = [
            time[0] as f32,
            time[1] as f32,
            time[2] as f32,
            time[3] as f32,
        ];
        let [c0, c1, c2, c3] = self.time;
        let magnitude = c0.abs() + c1.abs() + c2.abs() + c3.abs() + (t1 - t0).abs() as f32;
        let slack = magnitude * (8.0 * ROUNDING);
        let [tnear, tfar] = self.problem.interval;
        self.interval = [
            (f64::from(tnear) - t0) as f32 - slack,
            (f64::from(tfar) - t0) as f32 + slack,
        ];
    }

    /// Reports to `signs` every point of the curve at which the surface may be crossed, in order.
    #[inline(always)]
    pub fn walk(&self, signs: &mut Signs<'_>) {
        L::outline(Walk {
            walker: self,
            signs,
        });
    }

    #[inline(always)]
    fn walk_here(&self, signs: &mut Signs<'_>) {
        signs.begin();
        signs.count_span();
        let whole = [0.0, 1.0];
        let (alive, ends, bounds) = self.children(whole);
        if alive == 0 {
            return;
        }
        let rest = self.visit(&ends, alive, &bounds, whole, signs);
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
    fn children(&self, [from, to]: [f32; 2]) -> (u32, Ends, Bounds) {
        let span = self.span(from, to);
        let bounds = span.bounds(self);
        let (alive, ends) = if bounds.reach > WIDE {
            self.cut_into::<2>(&span, &bounds, [from, to])
        } else {
            self.cut_into::<1>(&span, &bounds, [from, to])
        };
        (alive, ends, bounds)
    }

    /// Goes down below the children of the whole curve that could not be walked at once.
    ///
    /// A waiting span is at most a seventh of the one it came from, and all that wait come from different levels or the same
    /// span, so a stack of [`Stack::MOST`] holds ten levels; deeper ones, and f32 cannot tell many more apart, are halved instead.
    #[inline(always)]
    fn descend(&self, children: u32, count: usize, signs: &mut Signs<'_>) {
        let mut stack = Stack::new();
        stack.postpone(children, count, [0.0, 1.0]);
        while let Some(span) = stack.pop() {
            signs.count_span();
            if signs.is_done() {
                return;
            }
            let (alive, ends, bounds) = self.children(span);
            if alive == 0 {
                continue;
            }
            let rest = self.visit(&ends, alive, &bounds, span, signs);
            if signs.is_done() {
                return;
            }
            stack.postpone(rest, ends.children, span);
        }
    }

    /// The span from s = `from` to `to` in a parameter of its own.
    #[inline(always)]
    fn span(&self, from: f32, to: f32) -> Span {
        let d = to - from;
        let [n0, n1, n2] = self.place;
        let [a0, a1, a2] = self.area;
        Span {
            place: [
                n0 + from * (n1 + from * n2),
                d * (n1 + 2.0 * from * n2),
                d * d * n2,
            ],
            area: [
                a0 + from * (a1 + from * a2),
                d * (a1 + 2.0 * from * a2),
                d * d * a2,
            ],
            height: [self.height[0] + from * self.height[1], d * self.height[1]],
        }
    }

    #[inline(always)]
    fn cut_into<const R: usize>(
        &self,
        span: &Span,
        bounds: &Bounds,
        [from, to]: [f32; 2],
    ) -> (u32, Ends) {
        let children = 8 * R - 1;
        let ds = 1.0 / children as f32;
        let off = bounds.bend * ds * ds + bounds.rounding;
        let height_off = bounds.height_bend * ds * ds + bounds.height_rounding;
        let level = self.grid.level(bounds.reach * ds + 2.0 * off);

        let zero = L::splat(0.0);
        let (mut x, mut y, mut h, mut t) = ([zero; R], [zero; R], [zero; R], [zero; R]);
        for r in 0..R {
            let first = 8.0 * r as f32;
            let numbers = L::from_array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
            let s = (numbers + L::splat(first)) * L::splat(ds);
            (x[r], y[r], h[r]) = self.evaluate(span, s);
            if self.cut {
                t[r] = self.time(L::splat(from) + s * L::splat(to - from));
            }
        }
        let mut alive = 0;
        let mut range = [zero; R];
        for r in 0..R {
            let (x1, y1, h1) = (next(&x, r), next(&y, r), next(&h, r));
            let (off, height_off) = (L::splat(off), L::splat(height_off));
            let [low, high] = self.grid.block_range(
                level,
                [
                    L::splat(self.base[0]) + x[r].min(x1) - off,
                    L::splat(self.base[0]) + x[r].max(x1) + off,
                ],
                [
                    L::splat(self.base[1]) + y[r].min(y1) - off,
                    L::splat(self.base[1]) + y[r].max(y1) + off,
                ],
            );
            range[r] = high - low;
            let above = (high - (h[r].min(h1) - height_off)).sign_mask();
            let below = ((h[r].max(h1) + height_off) - low).sign_mask();
            let mut out = above | below;
            if self.cut {
                let t1 = next(&t, r);
                out |= (t1 - L::splat(self.interval[0])).sign_mask();
                out |= (L::splat(self.interval[1]) - t[r]).sign_mask();
            }
            alive |= (!out & 0xff) << (8 * r);
        }
        alive &= (1 << children) - 1;
        // Never: all that goes in is finite.
        if !(off + height_off).is_finite() {
            alive = 0;
        }
        (alive, Ends::new(children, &x, &y, &h, &range))
    }

    /// Goes through the children that are left and walks their cells, in order, up to the first that is too long or too bent;
    /// that one and those behind are returned.
    #[inline(always)]
    fn visit(
        &self,
        ends: &Ends,
        mut alive: u32,
        bounds: &Bounds,
        span: [f32; 2],
        signs: &mut Signs<'_>,
    ) -> u32 {
        let ds = 1.0 / ends.children as f32;
        let off = bounds.bend * ds * ds;
        // f32 cannot tell the parts of such a span from one another: f64 looks at its ends.
        if span[1] - span[0] < 16.0 * f32::EPSILON {
            let (a, b) = (f64::from(span[0]), f64::from(span[1]));
            for s in [a, b] {
                let point = signs.look::<L>(self.curve, s, Side::Unknown);
                signs.point::<L>(self.curve, point, s);
            }
            return 0;
        }
        while alive != 0 {
            let first = alive.trailing_zeros() as usize;
            let mut last = first + 1;
            if off > CLOSE || ends.cells(first, last) > MOST_CELLS {
                return alive;
            }
            // As many children as one chord stays close over, and crosses few cells.
            let mut length = ds;
            while alive >> last & 1 != 0 {
                let longer = length + ds;
                if bounds.bend * longer * longer > CLOSE || ends.cells(first, last + 1) > MOST_CELLS
                {
                    break;
                }
                length = longer;
                last += 1;
            }
            let off = bounds.bend * length * length + bounds.rounding;
            let mut slope = 0.0f32;
            for k in first..last {
                slope = slope.max(of(&ends.range, k));
            }
            let chord = Chord {
                from: ends.point(first),
                to: ends.point(last),
                cells: [ends.cell(first), ends.cell(last)],
                s: [
                    at(span, first, ends.children),
                    at(span, last, ends.children),
                ],
                // (x, y) off by `off` and a cell taken for its neighbour within `NUDGE` change the surface by at most this.
                off: bounds.height_bend * length * length
                    + bounds.height_rounding
                    + 2.0 * (off + NUDGE) * slope,
                cut: self.cut,
            };
            chord.walk::<L>(&self.grid, self.base, self.curve, signs);
            if signs.is_done() {
                return 0;
            }
            alive &= !0 << last;
        }
        0
    }

    /// (x, y) and the height at eight parameters of a span.
    #[inline(always)]
    fn evaluate(&self, span: &Span, s: L) -> (L, L, L) {
        let inverse = L::splat(1.0) / quadratic(span.area, s);
        let x = quadratic(lane(&span.place, 0), s) * inverse;
        let y = quadratic(lane(&span.place, 1), s) * inverse;
        let u = quadratic(lane(&span.place, 2), s) * inverse;
        let v = quadratic(lane(&span.place, 3), s) * inverse;
        let length = self.normal_length(u, v);
        let w = s.mul_add(L::splat(span.height[1]), L::splat(span.height[0]));
        (x, y, w.mul_add(length, L::splat(self.midlevel)))
    }

    /// |N'|: |N'|^2 = 1 - sum b_i b_j spread_ij.
    #[inline(always)]
    fn normal_length(&self, u: L, v: L) -> L {
        let one = L::splat(1.0);
        let b0 = one - u - v;
        let [k0, k1, k2] = self.spread.to_array();
        let short = (b0 * v).mul_add(L::splat(k1), u * v * L::splat(k2));
        let short = (b0 * u).mul_add(L::splat(k0), short);
        (one - short).max(L::splat(0.0)).sqrt()
    }

    /// t - t(0) at eight parameters of the curve.
    #[inline(always)]
    fn time(&self, s: L) -> L {
        let [c0, c1, c2, c3] = self.time;
        let [a0, a1, a2] = self.area;
        let rest = quadratic([c1, c2, c3], s);
        s.mul_add(rest, L::splat(c0)) / quadratic([a0, a1, a2], s)
    }
}

/// c0 + c1 s + c2 s^2.
#[inline(always)]
fn quadratic<L: Lanes>([c0, c1, c2]: [f32; 3], s: L) -> L {
    s.mul_add(s.mul_add(L::splat(c2), L::splat(c1)), L::splat(c0))
}

/// Coefficients of one lane.
#[inline(always)]
fn lane(c: &[Vec4; 3], k: usize) -> [f32; 3] {
    [c[0][k], c[1][k], c[2][k]]
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

impl Span {
    /// See the module's documentation.
    #[inline(always)]
    fn bounds<L: Lanes>(&self, walker: &Walker<'_, L>) -> Bounds {
        let [n0, n1, n2] = self.place;
        let [a0, a1, a2] = self.area;
        let end = a0 + a1 + a2;
        let least = a0.min(end) - 0.25 * a2.max(0.0);
        let inverse = 1.0 / least;
        let steepest = a1.abs().max((a1 + 2.0 * a2).abs());
        let (d1, d2) = (n1 * a0 - n0 * a1, n2 * a0 - n0 * a2);
        let middle = d1 + d2;
        let last = middle + d2 + (n2 * a1 - n1 * a2);
        let slope = d1.abs().max(middle.abs()).max(last.abs()) * (inverse * inverse);
        let start = n0 * (1.0 / a0);
        let bend = ((n2 - a2 * start).abs() + slope * (a2.abs() + steepest)) * inverse;

        let magnitude = n0.abs() + n1.abs() + n2.abs();
        let largest = start.abs() + slope;
        let area = a0.abs() + a1.abs() + a2.abs();
        let rounding = (magnitude + largest * area) * (inverse * ROUNDING);

        let ([s01, s02], stretch) = (walker.turns, walker.stretch);
        let turn = s01 * slope.z + s02 * slope.w;
        let turn_bend = s01 * bend.z + s02 * bend.w + turn * turn * (0.5 * stretch);
        let [h0, h1] = self.height;
        let highest = h0.abs().max((h0 + h1).abs());
        let height_bend = highest * turn_bend + h1.abs() * turn;
        let highest = highest * stretch;
        let height_rounding = highest * (s01 * rounding.z + s02 * rounding.w)
            + ROUNDING * (highest + walker.midlevel.abs());
        Bounds {
            reach: slope.x.max(slope.y),
            bend: 0.25 * bend.x.max(bend.y),
            height_bend: 0.25 * height_bend,
            rounding: rounding.x.max(rounding.y)
                + ROUNDING * walker.base[0].abs().max(walker.base[1].abs()),
            height_rounding,
        }
    }
}
