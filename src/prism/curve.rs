//! A ray's curve through one prism, exactly: parametrised by w, the height in units of N'.
//!
//! For every w the triangle p_i(w) = v_i + w n_i is flat, and the ray meets its plane where the barycentric coordinates
//! are b_i = Q_i / A: Q_i(w) = p_i+1 x p_i+2 seen along the ray, A = sum Q_i. Both are quadratics in w, so texel coordinates,
//! barycentrics and depth along the curve are ratios of polynomials, and P(b) + w N'(b) is on the ray for every w:
//! the curve needs no correction, and holds for any n_i . Ng, folded prisms included. (Ogaki, "Nonlinear Ray Tracing
//! for Displacement and Shell Mapping", SIGGRAPH Asia 2023, walks the same curve.) The surface S is where
//! w |N'(b)| = D(b).
//!
//! The set-up is in f64: a ray that grazes a prism sees it edge-on, and A loses as many digits as the angle is small.
//!
//! **Shared sides.** Q_i is made of the side's two vertices alone, by products that are rounded one by one. From the
//! neighbour, where the side runs the other way, every term changes its sign and no digit, and so do the roots not at
//! all: two neighbours cut the ray at the same w.

use glam::DVec3;

use super::ray_frame::RayFrame;
use super::simd::Quad;
use crate::surface::Patch;

/// One prism seen along one ray; lanes are vertices, or the sides opposite them.
pub struct View<Q> {
    /// Q_i: coefficients of 1, w, w^2.
    pub areas: [Q; 3],
    /// Depth of v_i beyond the ray's origin, and of n_i, along the main axis.
    depth: [Q; 2],
    /// Largest lateral coordinate of a corner: Q is known to about 1e-16 of its square.
    pub width: f64,
    /// Lateral direction of the sides at w = 0: decides for a ray exactly in a side's plane.
    tie: [Q; 2],
}

/// Where a stretch of a curve ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// At the smallest or largest w: no surface beyond.
    Cap,
    /// At the side opposite this vertex.
    Side(u8),
}

/// A stretch of w on which the ray is inside the prism.
#[derive(Clone, Copy, Debug)]
pub struct Stretch {
    /// From and to.
    pub w: [f64; 2],
    /// What is there.
    pub ends: [End; 2],
    /// The sign of A.
    pub counter_clockwise: bool,
}

/// At most this many stretches for each sign of A: six roots and the two caps make seven intervals, every other one inside.
const MOST_STRETCHES: usize = 4;

/// The stretches of both signs.
pub struct Stretches {
    all: [Stretch; 2 * MOST_STRETCHES],
    count: usize,
}

impl Stretches {
    #[inline(always)]
    fn new() -> Self {
        let none = Stretch {
            w: [0.0; 2],
            ends: [End::Cap; 2],
            counter_clockwise: true,
        };
        Self {
            all: [none; 2 * MOST_STRETCHES],
            count: 0,
        }
    }

    #[inline(always)]
    fn push(&mut self, stretch: Stretch) {
        if stretch.w[0] < stretch.w[1] && self.count < self.all.len() {
            self.all[self.count] = stretch;
            self.count += 1;
        }
    }

    /// The stretches, by sign of A, then by w.
    #[inline(always)]
    pub fn as_slice(&self) -> &[Stretch] {
        &self.all[..self.count]
    }
}

impl<Q: Quad> View<Q> {
    /// `reach` is the largest |w|.
    #[inline(always)]
    pub fn new(patch: &Patch<'_>, frame: &RayFrame, reach: f64) -> Self {
        let [x, y, z] = frame.axes;
        let (v, n) = (&patch.vertices, &patch.normals);
        let origin = frame.origin;
        let shear = (Q::splat(frame.shear[0]), Q::splat(frame.shear[1]));
        let depth = along::<Q>(v, z) - Q::splat(origin[2]);
        let slope = along::<Q>(n, z);
        let ax = along::<Q>(v, x) - Q::splat(origin[0]) - depth * shear.0;
        let ay = along::<Q>(v, y) - Q::splat(origin[1]) - depth * shear.1;
        let ex = along::<Q>(n, x) - slope * shear.0;
        let ey = along::<Q>(n, y) - slope * shear.1;
        let (ax1, ay1, ex1, ey1) = (ax.rotate(), ay.rotate(), ex.rotate(), ey.rotate());
        let (ax2, ay2, ex2, ey2) = (ax1.rotate(), ay1.rotate(), ex1.rotate(), ey1.rotate());
        let reach = Q::splat(reach);
        let widest_x = ex.abs().mul_add(reach, ax.abs());
        let widest_y = ey.abs().mul_add(reach, ay.abs());
        Self {
            areas: [
                ax1 * ay2 - ay1 * ax2,
                (ax1 * ey2 - ay1 * ex2) + (ex1 * ay2 - ey1 * ax2),
                ex1 * ey2 - ey1 * ex2,
            ],
            depth: [depth, slope],
            width: widest_x.max(widest_y).max_of_three(),
            tie: [ax2 - ax1, ay2 - ay1],
        }
    }

    /// Q_i at w.
    #[inline(always)]
    fn at(&self, w: f64) -> Q {
        quadratic(&self.areas, Q::splat(w))
    }

    /// Coefficients of A.
    pub fn area(&self) -> [f64; 3] {
        let [c0, c1, c2] = self.areas;
        let (c0, c1, c2) = (c0.to_array(), c1.to_array(), c2.to_array());
        let sum = |c: [f64; 4]| c[0] + c[1] + c[2];
        [sum(c0), sum(c1), sum(c2)]
    }

    /// Where the ray is inside, for w in `range`.
    #[inline(always)]
    pub fn stretches(&self, [low, high]: [f64; 2]) -> Stretches {
        let [c0, c1, c2] = self.areas;
        // Bernstein coefficients over the range enclose each Q_i.
        let (first, last) = (self.at(low), self.at(high));
        let middle = c2.mul_add(
            Q::splat(low * high),
            c1.mul_add(Q::splat(0.5 * (low + high)), c0),
        );
        let least = first.min(last).min(middle);
        let most = first.max(last).max(middle);
        let above = (Q::splat(0.0) - least).sign_mask() & 7;
        let below = most.sign_mask() & 7;
        let mut found = Stretches::new();
        let whole = |counter_clockwise| Stretch {
            w: [low, high],
            ends: [End::Cap; 2],
            counter_clockwise,
        };
        if above == 7 {
            found.push(whole(true));
        } else if below == 7 {
            found.push(whole(false));
        } else {
            if below == 0 {
                self.cut([low, high], true, &mut found);
            }
            if above == 0 {
                self.cut([low, high], false, &mut found);
            }
        }
        found
    }

    /// The general case for one sign of A.
    #[inline(always)]
    fn cut(&self, [low, high]: [f64; 2], counter_clockwise: bool, found: &mut Stretches) {
        let zero = Q::splat(0.0);
        // Adding 0 makes -0 and 0 one.
        let sign = Q::splat(if counter_clockwise { 1.0 } else { -1.0 });
        let [c0, c1, c2] = self.areas;
        let (c0, c1, c2) = (sign * c0 + zero, sign * c1 + zero, sign * c2 + zero);
        let discriminant = c1 * c1 - Q::splat(4.0) * c0 * c2;
        // q = -(c1 + sign(c1) sqrt(discriminant)) / 2, roots q / c2 and c0 / q; a linear Q has one root at infinity.
        let q = Q::splat(-0.5) * (c1 + discriminant.max(zero).sqrt().copysign(c1));
        let (r, s) = (q / c2, c0 / q);
        let (first, second) = (r.min(s).to_array(), r.max(s).to_array());
        let (c0, c1, c2) = (c0.to_array(), c1.to_array(), c2.to_array());
        let discriminant = discriminant.to_array();
        let mut stretch = Stretch {
            w: [low, high],
            ends: [End::Cap; 2],
            counter_clockwise,
        };
        for k in 0..3 {
            let side = End::Side(k as u8);
            let [from, to] = stretch.w;
            if c1[k] == 0.0 && c2[k] == 0.0 {
                if c0[k] < 0.0 || (c0[k] == 0.0 && self.is_left_out(k) == counter_clockwise) {
                    return;
                }
                continue;
            }
            let (r, s) = (first[k], second[k]);
            if discriminant[k] < 0.0 {
                if c2[k] < 0.0 {
                    return;
                }
            } else if c2[k] < 0.0 {
                // Inside between the roots.
                if r > from {
                    (stretch.w[0], stretch.ends[0]) = (r, side);
                }
                if s < to {
                    (stretch.w[1], stretch.ends[1]) = (s, side);
                }
            } else if r > from && s < to {
                return self.cut_in_two([low, high], counter_clockwise, &first, &second, found);
            } else if r <= from && s > from {
                (stretch.w[0], stretch.ends[0]) = (s, side);
            } else if s >= to && r < to {
                (stretch.w[1], stretch.ends[1]) = (r, side);
            }
            if stretch.w[0] >= stretch.w[1] {
                return;
            }
        }
        found.push(stretch);
    }

    /// A ray in the plane of a side belongs to one of the two prisms there: to the one on whose inside it would be if it
    /// were moved a hair along the first lateral axis, and a hair of that along the second.
    #[cold]
    fn is_left_out(&self, side: usize) -> bool {
        let [x, y] = self.tie.map(|t| t.to_array()[side]);
        if y != 0.0 { y > 0.0 } else { x < 0.0 }
    }

    /// As `cut`, where the ray leaves through a bent side and comes back: sorts all roots and keeps the
    /// stretches whose middle is inside.
    #[cold]
    fn cut_in_two(
        &self,
        [low, high]: [f64; 2],
        counter_clockwise: bool,
        first: &[f64; 4],
        second: &[f64; 4],
        found: &mut Stretches,
    ) {
        let mut cuts = [(high, End::Cap); 8];
        cuts[0] = (low, End::Cap);
        let mut count = 1;
        for k in 0..3 {
            for root in [first[k], second[k]] {
                if root > low && root < high {
                    cuts[count] = (root, End::Side(k as u8));
                    count += 1;
                }
            }
        }
        cuts[1..count].sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let mut stretch: Option<Stretch> = None;
        for pair in cuts[..count + 1].windows(2) {
            let [(from, start), (to, end)] = [pair[0], pair[1]];
            let outside = self.at(0.5 * (from + to)).sign_mask() & 7;
            let inside = outside == if counter_clockwise { 0 } else { 7 };
            if !inside {
                if let Some(done) = stretch.take() {
                    found.push(done);
                }
                continue;
            }
            let open = stretch.get_or_insert(Stretch {
                w: [from, to],
                ends: [start, end],
                counter_clockwise,
            });
            (open.w[1], open.ends[1]) = (to, end);
        }
        if let Some(done) = stretch {
            found.push(done);
        }
    }
}

/// A stretch of a ray's curve: s in [0, 1] runs over it in the order of t (in folded prisms, of w).
///
/// Texel coordinates are relative to [`Curve::texel_base`].
#[derive(Clone, Copy)]
pub struct Curve<Q> {
    /// (X, Y, B1, B2): coefficients of 1, s, s^2; texel coordinates and barycentrics are these over A.
    pub place: [Q; 3],
    /// (A, Z, Zn, 0) the same way: depth is (Z + w Zn) / A.
    pub depth: [Q; 3],
    /// w at s = 0, and its change.
    pub w: [f64; 2],
    /// Whole texels that were subtracted from the texel coordinates.
    pub texel_base: [f64; 2],
    /// Ray parameter per depth.
    pub per_depth: f64,
}

impl<Q: Quad> Curve<Q> {
    /// The curve over a stretch; in folded prisms, where t is not monotone in w, any direction will do.
    #[inline(always)]
    pub fn new(view: &View<Q>, patch: &Patch<'_>, stretch: &Stretch, frame: &RayFrame) -> Self {
        // dt/dw has the sign of (N' . m) / (d . m), m the area normal of the triangle at w: d . m has the sign of A d_main,
        // and N' . m is positive in prisms that are not folded.
        let [from, to] = if stretch.counter_clockwise == (frame.per_depth > 0.0) {
            stretch.w
        } else {
            [stretch.w[1], stretch.w[0]]
        };
        let span = to - from;
        let (start, change) = (Q::splat(from), Q::splat(span));
        let areas = stretched(&view.areas, start, change);

        let texels = &patch.texels;
        let base = texels[0].floor();
        let local = [texels[0] - base, texels[1] - base, texels[2] - base];
        let places = [
            Q::from_array([local[0].x, local[0].y, 0.0, 0.0]),
            Q::from_array([local[1].x, local[1].y, 1.0, 0.0]),
            Q::from_array([local[2].x, local[2].y, 0.0, 1.0]),
        ];
        let (z, zn) = (view.depth[0].to_array(), view.depth[1].to_array());
        let depths = [
            Q::from_array([1.0, z[0], zn[0], 0.0]),
            Q::from_array([1.0, z[1], zn[1], 0.0]),
            Q::from_array([1.0, z[2], zn[2], 0.0]),
        ];
        let [q0, q1, q2] = areas;
        let depth = [
            weighted(q0, &depths),
            weighted(q1, &depths),
            weighted(q2, &depths),
        ];
        // A is 1 in the middle: the units of area go.
        let middle = quadratic(&depth, Q::splat(0.5));
        let unit = Q::splat(1.0) / middle.broadcast::<0>();
        Self {
            place: [
                weighted(q0, &places) * unit,
                weighted(q1, &places) * unit,
                weighted(q2, &places) * unit,
            ],
            depth: [depth[0] * unit, depth[1] * unit, depth[2] * unit],
            w: [from, span],
            texel_base: base.to_array(),
            per_depth: frame.per_depth,
        }
    }

    /// (X, Y, B1, B2) over A, and (1, Z, Zn, 0) over A, at s.
    #[inline(always)]
    pub fn at(&self, s: f64) -> (Q, Q) {
        let s = Q::splat(s);
        let (place, depth) = (quadratic(&self.place, s), quadratic(&self.depth, s));
        let area = depth.broadcast::<0>();
        (place / area, depth / area)
    }

    /// w at s.
    #[inline(always)]
    pub fn w(&self, s: f64) -> f64 {
        s.mul_add(self.w[1], self.w[0])
    }

    /// Ray parameter at s.
    #[inline(always)]
    pub fn t(&self, s: f64) -> f64 {
        let [_, z, zn, _] = self.at(s).1.to_array();
        (z + self.w(s) * zn) * self.per_depth
    }

    /// A's coefficients.
    #[inline(always)]
    pub fn area(&self) -> [f64; 3] {
        let [c0, c1, c2] = self.depth;
        [c0.to_array()[0], c1.to_array()[0], c2.to_array()[0]]
    }

    /// The part from s = a to s = b as a curve of its own, with a texel base of its own.
    pub fn part(&self, a: f64, b: f64) -> Self {
        let [x, y, ..] = self.at(a).0.to_array().map(f64::floor);
        let moved = Q::from_array([x, y, 0.0, 0.0]);
        let (start, change) = (Q::splat(a), Q::splat(b - a));
        let place = stretched(&self.place, start, change);
        let depth = stretched(&self.depth, start, change);
        let place = [
            place[0] - moved * depth[0].broadcast::<0>(),
            place[1] - moved * depth[1].broadcast::<0>(),
            place[2] - moved * depth[2].broadcast::<0>(),
        ];
        let middle = quadratic(&depth, Q::splat(0.5));
        let unit = Q::splat(1.0) / middle.broadcast::<0>();
        Self {
            place: [place[0] * unit, place[1] * unit, place[2] * unit],
            depth: [depth[0] * unit, depth[1] * unit, depth[2] * unit],
            w: [self.w(a), self.w[1] * (b - a)],
            texel_base: [self.texel_base[0] + x, self.texel_base[1] + y],
            ..*self
        }
    }
}

/// One coordinate of three vectors; lane 3 repeats lane 0.
#[inline(always)]
fn along<Q: Quad>(vectors: &[DVec3; 3], axis: usize) -> Q {
    let [a, b, c] = vectors;
    Q::from_array([a[axis], b[axis], c[axis], a[axis]])
}

/// c0 + c1 s + c2 s^2.
#[inline(always)]
pub fn quadratic<Q: Quad>(c: &[Q; 3], s: Q) -> Q {
    c[2].mul_add(s, c[1]).mul_add(s, c[0])
}

/// The quadratic of r that c is of s = start + change r.
#[inline(always)]
fn stretched<Q: Quad>(c: &[Q; 3], start: Q, change: Q) -> [Q; 3] {
    [
        quadratic(c, start),
        change * (c[2] + c[2]).mul_add(start, c[1]),
        change * change * c[2],
    ]
}

/// The sum of three vectors weighted by the lanes of c.
#[inline(always)]
fn weighted<Q: Quad>(c: Q, vectors: &[Q; 3]) -> Q {
    let rest = c.broadcast::<2>() * vectors[2];
    c.broadcast::<0>()
        .mul_add(vectors[0], c.broadcast::<1>().mul_add(vectors[1], rest))
}
