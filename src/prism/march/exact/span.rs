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
use super::cells::{Chord, MOST_CELLS};
use super::signs::Signs;
use crate::prism::curve::Curve;
use crate::prism::simd::{LANES, Lanes, Quad, Task};

/// A chord this close to the curve, in texels, may be walked cell by cell.
const CLOSE: f32 = 1.0 / 64.0;

/// Texels beyond which a span has 15 children.
const WIDE: f32 = 10.0;

/// Spans waiting; more are never needed: see [`Walker::walk`].
const STACK: usize = 160;

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
    /// (t(s) - t(0)) A: coefficients of 1 .. s^3.
    time: [f32; 4],
    /// tnear and tfar minus t(0), widened; and whether they cut anything off.
    interval: [f32; 2],
    cut: bool,
    /// Texel coordinates of the curve's origin, within one period of the map.
    base: [f32; 2],
    /// Rounding of texel coordinates that comes with the base.
    base_rounding: f32,
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

/// A span in its own parameter.
struct Span {
    place: [Vec4; 3],
    area: [f32; 3],
    height: [f32; 2],
}

impl<'a, L: Lanes> Walker<'a, L> {
    /// `ends` are the ray parameters at both ends of the curve.
    #[inline(always)]
    pub fn new(problem: &'a Problem<'a>, curve: &'a Curve<L::Quad>, ends: [f64; 2]) -> Self {
        let patch = problem.patch;
        let narrow = |c: &[f64; 4]| Vec4::new(c[0] as f32, c[1] as f32, c[2] as f32, c[3] as f32);
        let [d0, d1, d2] = curve.depth;
        let depth = [d0.to_array(), d1.to_array(), d2.to_array()];
        let [p0, p1, p2] = curve.place;
        let unit = f64::from(problem.grid.unit());
        let per_world = unit / patch.scale;
        let n = &patch.normals;
        let [t0, t1] = ends;
        let [w0, dw] = curve.w;
        let [tnear, tfar] = problem.interval;
        let (tnear, tfar) = (f64::from(tnear), f64::from(tfar));
        let cut = problem.ordered && (t0 <= tnear || t1 >= tfar);
        let time = if cut {
            let z = |k: usize| depth[k][1];
            let zn = |k: usize| depth[k][2];
            [
                z(0) + w0 * zn(0),
                z(1) + w0 * zn(1) + dw * zn(0),
                z(2) + w0 * zn(2) + dw * zn(1),
                dw * zn(2),
            ]
        } else {
            [0.0; 4]
        };
        let time = [
            (time[0] * curve.per_depth - t0 * depth[0][0]) as f32,
            (time[1] * curve.per_depth - t0 * depth[1][0]) as f32,
            (time[2] * curve.per_depth - t0 * depth[2][0]) as f32,
            (time[3] * curve.per_depth) as f32,
        ];
        let magnitude = time[0].abs() + time[1].abs() + time[2].abs() + time[3].abs();
        let slack = (magnitude + (t1 - t0).abs() as f32) * (8.0 * ROUNDING);
        let base = problem.grid.base(curve.texel_base);
        Self {
            problem,
            curve,
            place: [
                narrow(&p0.to_array()),
                narrow(&p1.to_array()),
                narrow(&p2.to_array()),
            ],
            area: [
                depth[0][0] as f32,
                depth[1][0] as f32,
                depth[2][0] as f32,
            ],
            height: [(w0 * per_world) as f32, (dw * per_world) as f32],
            midlevel: (unit * patch.midlevel) as f32,
            spread: Vec3::new(
                n[0].distance_squared(n[1]) as f32,
                n[0].distance_squared(n[2]) as f32,
                n[1].distance_squared(n[2]) as f32,
            ),
            time,
            interval: [(tnear - t0) as f32 - slack, (tfar - t0) as f32 + slack],
            cut,
            base,
            base_rounding: ROUNDING * base[0].max(base[1]),
        }
    }

    /// Reports to `signs` every point of the curve at which the surface may be crossed, in order.
    ///
    /// A waiting span is at most a 15th of the one it came from, so a stack of [`STACK`] holds ten levels of 15; deeper ones,
    /// and f32 cannot tell many more apart, are halved instead.
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
        let mut stack = [[0.0f32; 2]; STACK];
        stack[0] = [0.0, 1.0];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let [from, to] = stack[count];
            let span = self.span(from, to);
            let bounds = span.bounds(self);
            let (alive, ends) = if bounds.reach > WIDE {
                self.children::<2>(&span, &bounds, [from, to])
            } else {
                self.children::<1>(&span, &bounds, [from, to])
            };
            if alive == 0 {
                continue;
            }
            self.visit(&ends, alive, &bounds, [from, to], &mut stack, &mut count, signs);
            if signs.is_done() {
                return;
            }
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

    /// Cuts a span into 8 `R` - 1 children: which of them may meet the surface, and where they end.
    #[inline(always)]
    fn children<const R: usize>(
        &self,
        span: &Span,
        bounds: &Bounds,
        [from, to]: [f32; 2],
    ) -> (u32, Ends) {
        let children = 8 * R - 1;
        let ds = 1.0 / children as f32;
        let off = bounds.bend * ds * ds + bounds.rounding;
        let height_off = bounds.height_bend * ds * ds + bounds.height_rounding;
        let level = self.problem.grid.level(bounds.reach * ds + 2.0 * off);

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
            let [low, high] = self.problem.grid.block_range(
                level,
                [L::splat(self.base[0]) + x[r].min(x1) - off, L::splat(self.base[0]) + x[r].max(x1) + off],
                [L::splat(self.base[1]) + y[r].min(y1) - off, L::splat(self.base[1]) + y[r].max(y1) + off],
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

    /// Goes through the children that are left: walks their cells, in order, and puts what is too long or too bent on the
    /// stack.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    fn visit(
        &self,
        ends: &Ends,
        mut alive: u32,
        bounds: &Bounds,
        [from, to]: [f32; 2],
        stack: &mut [[f32; 2]; STACK],
        count: &mut usize,
        signs: &mut Signs<'_>,
    ) {
        let children = ends.children;
        let ds = 1.0 / children as f32;
        let off = bounds.bend * ds * ds;
        // As many children as one chord stays close over.
        let longest = if off * (LANES * LANES) as f32 <= CLOSE {
            LANES
        } else {
            (CLOSE / off).sqrt() as usize
        };
        let at = |k: usize| {
            if k == children { to } else { from + (to - from) * (k as f32 * ds) }
        };
        while alive != 0 {
            let first = alive.trailing_zeros() as usize;
            let mut last = first + 1;
            if self.is_shortest(from, to) {
                // f32 cannot tell its parts from one another: f64 looks at its ends.
                let (a, b) = (f64::from(from), f64::from(to));
                signs.point::<L>(self.curve, a, None, a, false);
                signs.point::<L>(self.curve, b, None, b, false);
                return;
            }
            if longest == 0 || ends.cells(first, last) > MOST_CELLS {
                return self.postpone(alive, &at, stack, count);
            }
            while alive >> last & 1 != 0
                && last - first < longest
                && ends.cells(first, last + 1) <= MOST_CELLS
            {
                last += 1;
            }
            let length = (last - first) as f32 * ds;
            let off = bounds.bend * length * length + bounds.rounding;
            let slope = ends.range[first..last].iter().fold(0.0f32, |a, &b| a.max(b));
            let chord = Chord {
                from: ends.point(first),
                to: ends.point(last),
                s: [at(first), at(last)],
                // (x, y) off by `off` and a cell taken for its neighbour within `NUDGE` change the surface by at most this.
                off: bounds.height_bend * length * length
                    + bounds.height_rounding
                    + 2.0 * (off + super::cells::NUDGE) * slope,
                cut: self.cut,
            };
            chord.walk::<L>(self.problem.grid, self.base, self.curve, signs);
            if signs.is_done() {
                return;
            }
            alive &= !0 << last;
        }
    }

    #[inline(always)]
    fn is_shortest(&self, from: f32, to: f32) -> bool {
        to - from < 16.0 * f32::EPSILON
    }

    /// Leaves the rest to later rounds.
    #[inline(always)]
    fn postpone(
        &self,
        mut alive: u32,
        at: &impl Fn(usize) -> f32,
        stack: &mut [[f32; 2]; STACK],
        count: &mut usize,
    ) {
        if *count + 2 * LANES > STACK {
            // Never lost: one long span instead of many.
            let first = alive.trailing_zeros() as usize;
            let last = 32 - alive.leading_zeros() as usize;
            let (a, b) = (at(first), at(last));
            let middle = 0.5 * (a + b);
            if middle > a && middle < b && *count + 2 <= STACK {
                stack[*count] = [middle, b];
                stack[*count + 1] = [a, middle];
                *count += 2;
            }
            return;
        }
        while alive != 0 {
            let last = 31 - alive.leading_zeros() as usize;
            alive &= !(1 << last);
            stack[*count] = [at(last), at(last + 1)];
            *count += 1;
        }
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

        let (s01, s02) = (walker.spread.x.sqrt(), walker.spread.y.sqrt());
        let shortest = (1.0 - walker.spread.max_element() / 3.0).max(1e-6).sqrt();
        let turn = s01 * slope.z + s02 * slope.w;
        let turn_bend = s01 * bend.z + s02 * bend.w + turn * turn / (2.0 * shortest);
        let [h0, h1] = self.height;
        let highest = h0.abs().max((h0 + h1).abs());
        let height_bend = highest * turn_bend + h1.abs() * turn;
        let height_rounding = highest * (s01 * rounding.z + s02 * rounding.w) / shortest
            + ROUNDING * (highest / shortest + walker.midlevel.abs());
        Bounds {
            reach: slope.x.max(slope.y),
            bend: 0.25 * bend.x.max(bend.y),
            height_bend: 0.25 * height_bend,
            rounding: rounding.x.max(rounding.y) + walker.base_rounding,
            height_rounding,
        }
    }
}

/// The ends of up to 15 children.
struct Ends {
    children: usize,
    x: [f32; 16],
    y: [f32; 16],
    h: [f32; 16],
    /// Largest minus smallest stored texel around each child.
    range: [f32; 16],
}

impl Ends {
    #[inline(always)]
    fn new<L: Lanes, const R: usize>(children: usize, x: &[L; R], y: &[L; R], h: &[L; R], range: &[L; R]) -> Self {
        let mut ends = Self {
            children,
            x: [0.0; 16],
            y: [0.0; 16],
            h: [0.0; 16],
            range: [0.0; 16],
        };
        for r in 0..R {
            let to = 8 * r..8 * r + 8;
            ends.x[to.clone()].copy_from_slice(&x[r].to_array());
            ends.y[to.clone()].copy_from_slice(&y[r].to_array());
            ends.h[to.clone()].copy_from_slice(&h[r].to_array());
            ends.range[to].copy_from_slice(&range[r].to_array());
        }
        ends
    }

    #[inline(always)]
    fn point(&self, k: usize) -> [f32; 3] {
        [self.x[k], self.y[k], self.h[k]]
    }

    /// Texel cells that the chord from end `a` to end `b` crosses.
    #[inline(always)]
    fn cells(&self, a: usize, b: usize) -> i32 {
        let lines = |c: &[f32; 16]| (c[b].floor() as i32 - c[a].floor() as i32).abs();
        lines(&self.x).saturating_add(lines(&self.y)).saturating_add(1)
    }
}
