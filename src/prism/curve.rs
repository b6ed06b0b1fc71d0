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

use glam::DVec2;

use super::ray_frame::RayFrame;
use super::simd::Quad;
use crate::surface::Patch;

/// Corners and normals of one prism along three axes; lanes are the corners.
pub struct Corners<Q> {
    pub vertices: [Q; 3],
    pub normals: [Q; 3],
}

impl<Q: Quad> Corners<Q> {
    /// Those over a patch, in the order of `axes`.
    #[inline(always)]
    pub fn new(patch: &Patch<'_>, [x, y, z]: [usize; 3]) -> Self {
        let ([v0, v1, v2], [n0, n1, n2]) = (patch.vertices, patch.normals);
        Self {
            vertices: [
                across([v0[x], v1[x], v2[x]]),
                across([v0[y], v1[y], v2[y]]),
                across([v0[z], v1[z], v2[z]]),
            ],
            normals: [
                across([n0[x], n1[x], n2[x]]),
                across([n0[y], n1[y], n2[y]]),
                across([n0[z], n1[z], n2[z]]),
            ],
        }
    }
}

/// Three lanes, and the first once more.
#[inline(always)]
fn across<Q: Quad>([a, b, c]: [f64; 3]) -> Q {
    Q::from_array([a, b, c, a])
}

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

/// What [`View::cut`] finds.
pub enum Cut {
    /// The ray is not inside.
    None,
    /// The ray is inside once.
    One(Stretch),
    /// Ask [`View::stretches`].
    Many,
}

/// The three sides' quadratics; bits by side.
struct Sides<Q> {
    coefficients: [Q; 3],
    /// The smaller root, and the larger.
    first: Q,
    second: Q,
    /// Where the parabola opens downward.
    downward: u32,
    /// Where there is no root.
    unreal: u32,
    /// Whether one is constant.
    is_odd: bool,
}

impl<Q: Quad> View<Q> {
    /// `reach` is the largest |w|; the corners are along the frame's axes.
    #[inline(always)]
    pub fn new(corners: &Corners<Q>, frame: &RayFrame, reach: f64) -> Self {
        let ([vx, vy, vz], [nx, ny, nz]) = (corners.vertices, corners.normals);
        let origin = frame.origin;
        let shear = (Q::splat(frame.shear[0]), Q::splat(frame.shear[1]));
        let depth = vz - Q::splat(origin[2]);
        let ax = vx - Q::splat(origin[0]) - depth * shear.0;
        let ay = vy - Q::splat(origin[1]) - depth * shear.1;
        let ex = nx - nz * shear.0;
        let ey = ny - nz * shear.1;
        let (ax1, ay1, ex1, ey1) = (ax.rotate(), ay.rotate(), ex.rotate(), ey.rotate());
        let (ax2, ay2, ex2, ey2) = (ax1.rotate(), ay1.rotate(), ex1.rotate(), ey1.rotate());
        let reach = Q::splat(reach);
        let widest_x = ex.abs() * reach + ax.abs();
        let widest_y = ey.abs() * reach + ay.abs();
        Self {
            areas: [
                ax1 * ay2 - ay1 * ax2,
                (ax1 * ey2 - ay1 * ex2) + (ex1 * ay2 - ey1 * ax2),
                ex1 * ey2 - ey1 * ex2,
            ],
            depth: [depth, nz],
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
    #[inline(always)]
    pub fn area(&self) -> [f64; 3] {
        let [c0, c1, c2] = self.areas;
        [
            c0.sum_of_three().to_array()[0],
            c1.sum_of_three().to_array()[0],
            c2.sum_of_three().to_array()[0],
        ]
    }

    /// Where the ray is inside, for w in `range`: the one stretch of almost every ray.
    #[inline(always)]
    pub fn cut(&self, [low, high]: [f64; 2]) -> Cut {
        let [c0, c1, c2] = self.areas;
        // Bernstein coefficients over the range enclose each Q_i.
        let (first, last) = (self.at(low), self.at(high));
        let middle = c2 * Q::splat(low * high) + (c1 * Q::splat(0.5 * (low + high)) + c0);
        let least = first.min(last).min(middle);
        let most = first.max(last).max(middle);
        let above = (Q::splat(0.0) - least).sign_mask() & 7;
        let below = most.sign_mask() & 7;
        if above == 7 || below == 7 {
            return Cut::One(Stretch {
                w: [low, high],
                ends: [End::Cap; 2],
                counter_clockwise: above == 7,
            });
        }
        let found = if below == 0 {
            self.cut_by_sides([low, high], true)
        } else {
            Cut::None
        };
        match found {
            Cut::None if above == 0 => self.cut_by_sides([low, high], false),
            // The triangle may turn over within the range.
            Cut::One(_) if above == 0 => Cut::Many,
            found => found,
        }
    }

    /// The stretch for one sign of A.
    #[inline(always)]
    fn cut_by_sides(&self, [low, high]: [f64; 2], counter_clockwise: bool) -> Cut {
        let (from, to) = (Q::splat(low), Q::splat(high));
        let sides = self.roots(counter_clockwise);
        let Sides {
            downward,
            unreal,
            first,
            second,
            ..
        } = sides;
        if sides.is_odd {
            return Cut::Many;
        }
        let within = |r: Q| !((r - from).sign_mask() | (to - r).sign_mask());
        let (a, b) = (within(first), within(second));
        // Two roots of an upward parabola within the range cut the inside in two.
        if a & b & !downward & !unreal & 7 != 0 {
            return Cut::Many;
        }
        // Downward: inside between the roots. Upward: outside between them.
        let covered = (first - from).sign_mask() & (to - second).sign_mask();
        let nothing = unreal & downward | !unreal & !downward & covered;
        if nothing & 7 != 0 {
            return Cut::None;
        }
        let (first, second) = (first.to_array(), second.to_array());
        let mut stretch = Stretch {
            w: [low, high],
            ends: [End::Cap; 2],
            counter_clockwise,
        };
        for k in 0..3 {
            let bit = 1 << k;
            if unreal & bit != 0 {
                continue;
            }
            let is_downward = downward & bit != 0;
            let begin = if is_downward { first[k] } else { second[k] };
            let end = if is_downward { second[k] } else { first[k] };
            let begins = is_downward || b & bit != 0;
            let ends = is_downward || a & bit != 0;
            if begins && begin > stretch.w[0] {
                (stretch.w[0], stretch.ends[0]) = (begin, End::Side(k as u8));
            }
            if ends && end < stretch.w[1] {
                (stretch.w[1], stretch.ends[1]) = (end, End::Side(k as u8));
            }
        }
        if stretch.w[0] < stretch.w[1] {
            Cut::One(stretch)
        } else {
            Cut::None
        }
    }

    /// Roots of the three quadratics, with the sign that makes the inside positive.
    #[inline(always)]
    fn roots(&self, counter_clockwise: bool) -> Sides<Q> {
        let zero = Q::splat(0.0);
        let sign = Q::splat(if counter_clockwise { 1.0 } else { -1.0 });
        // Adding 0 makes -0 and 0 one.
        let [c0, c1, c2] = self.areas;
        let (c0, c1, c2) = (sign * c0 + zero, sign * c1 + zero, sign * c2 + zero);
        let discriminant = c1 * c1 - Q::splat(4.0) * c0 * c2;
        // q = -(c1 + sign(c1) sqrt(discriminant)) / 2, roots q / c2 and c0 / q; a linear Q has one root at infinity.
        let q = Q::splat(-0.5) * (c1 + discriminant.max(zero).sqrt().copysign(c1));
        let (r, s) = (q / c2, c0 / q);
        let constant = (c1.abs() + c2.abs() - Q::splat(f64::MIN_POSITIVE)).sign_mask();
        Sides {
            coefficients: [c0, c1, c2],
            first: r.min(s),
            second: r.max(s),
            downward: c2.sign_mask(),
            unreal: discriminant.sign_mask(),
            is_odd: constant & 7 != 0,
        }
    }

    /// All stretches of both signs: for the few rays that leave through a bent side and come back, see the triangle turn
    /// over, or lie in the plane of a side.
    ///
    /// Long: called in outlined tasks only.
    #[inline(always)]
    pub fn stretches(&self, range: [f64; 2]) -> Stretches {
        let mut found = Stretches::new();
        for counter_clockwise in [true, false] {
            self.sort_cuts(range, counter_clockwise, &mut found);
        }
        found
    }

    /// Sorts all roots and keeps the stretches whose middle is inside.
    #[inline(always)]
    fn sort_cuts(&self, [low, high]: [f64; 2], counter_clockwise: bool, found: &mut Stretches) {
        let sides = self.roots(counter_clockwise);
        let [c0, c1, c2] = sides.coefficients.map(Q::to_array);
        let (first, second) = (sides.first.to_array(), sides.second.to_array());
        let mut cuts = [(high, End::Cap); 8];
        cuts[0] = (low, End::Cap);
        let mut count = 1;
        let mut constant = 0;
        for k in 0..3 {
            if c1[k] == 0.0 && c2[k] == 0.0 {
                if c0[k] < 0.0 || (c0[k] == 0.0 && self.is_left_out(k) == counter_clockwise) {
                    return;
                }
                constant |= 1 << k;
                continue;
            }
            if c1[k] * c1[k] - 4.0 * c0[k] * c2[k] < 0.0 {
                continue;
            }
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
            let s = 0.5 * (from + to);
            let inside =
                (0..3).all(|k| constant >> k & 1 != 0 || c0[k] + s * (c1[k] + s * c2[k]) >= 0.0);
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

    /// A ray in the plane of a side belongs to one of the two prisms there: to the one on whose inside it would be if it
    /// were moved a hair along the first lateral axis, and a hair of that along the second.
    #[cold]
    fn is_left_out(&self, side: usize) -> bool {
        let [x, y] = self.tie.map(|t| t.to_array()[side]);
        if y != 0.0 { y > 0.0 } else { x < 0.0 }
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
    /// Whether A is well above what rounding leaves of it.
    pub is_wide: bool,
}

/// A below this part of the prism's width squared is a grazing ray's; rounding is a ten-millionth of that.
pub const EDGE_ON: f64 = 1e-9;

impl<Q: Quad> Curve<Q> {
    /// The curve over a stretch; in folded prisms, where t is not monotone in w, any direction will do.
    #[inline(always)]
    pub fn new(view: &View<Q>, texels: &[DVec2; 3], stretch: &Stretch, frame: &RayFrame) -> Self {
        // dt/dw has the sign of (N' . m) / (d . m), m the area normal of the triangle at w: d . m has the sign of A d_main,
        // and N' . m is positive in prisms that are not folded.
        let [from, to] = if stretch.counter_clockwise == (frame.per_depth > 0.0) {
            stretch.w
        } else {
            [stretch.w[1], stretch.w[0]]
        };
        Self::between(view, texels, [from, to], frame.per_depth)
    }

    /// The curve over [from, to] of w, which is in the order of t.
    #[inline(always)]
    pub fn between(
        view: &View<Q>,
        texels: &[DVec2; 3],
        [from, to]: [f64; 2],
        per_depth: f64,
    ) -> Self {
        let span = to - from;
        let (start, change) = (Q::splat(from), Q::splat(span));
        let areas = stretched(&view.areas, start, change);

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
        let area = middle.broadcast::<0>();
        let unit = Q::splat(1.0) / area;
        Self {
            is_wide: area.to_array()[0].abs() > EDGE_ON * view.width * view.width,
            place: [
                weighted(q0, &places) * unit,
                weighted(q1, &places) * unit,
                weighted(q2, &places) * unit,
            ],
            depth: [depth[0] * unit, depth[1] * unit, depth[2] * unit],
            w: [from, span],
            texel_base: base.to_array(),
            per_depth,
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

    /// Ray parameter and barycentric coordinates of vertices 1 and 2 at s.
    #[inline(always)]
    pub fn seen(&self, s: f64) -> [f64; 3] {
        let (place, depth) = self.at(s);
        let ([_, _, u, v], [_, z, zn, _]) = (place.to_array(), depth.to_array());
        [(z + self.w(s) * zn) * self.per_depth, u, v]
    }

    /// w at s.
    #[inline(always)]
    pub fn w(&self, s: f64) -> f64 {
        s * self.w[1] + self.w[0]
    }

    /// Ray parameters at both ends.
    #[inline(always)]
    pub fn ends(&self) -> [f64; 2] {
        let [d0, d1, d2] = self.depth;
        let [a0, z0, n0, _] = d0.to_array();
        let [a1, z1, n1, _] = (d0 + d1 + d2).to_array();
        let [w, change] = self.w;
        [
            (z0 + w * n0) / a0 * self.per_depth,
            (z1 + (w + change) * n1) / a1 * self.per_depth,
        ]
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

/// c0 + c1 s + c2 s^2.
#[inline(always)]
pub fn quadratic<Q: Quad>(c: &[Q; 3], s: Q) -> Q {
    (c[2] * s + c[1]) * s + c[0]
}

/// The quadratic of r that c is of s = start + change r.
#[inline(always)]
fn stretched<Q: Quad>(c: &[Q; 3], start: Q, change: Q) -> [Q; 3] {
    [
        quadratic(c, start),
        change * ((c[2] + c[2]) * start + c[1]),
        change * change * c[2],
    ]
}

/// The sum of three vectors weighted by the lanes of c.
#[inline(always)]
fn weighted<Q: Quad>(c: Q, vectors: &[Q; 3]) -> Q {
    let rest = c.broadcast::<2>() * vectors[2];
    c.broadcast::<0>() * vectors[0] + (c.broadcast::<1>() * vectors[1] + rest)
}
