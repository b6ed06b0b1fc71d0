//! The curves of a ray through eight prisms in f32, one lane each, with what bounds them.
//!
//! An arc is the part of a ray's curve ([`curve`](crate::prism::curve)) that is walked: s in [0, 1] runs over it in the order of t.
//! [`Cut`] makes the arcs of a cluster from what a ray [sees](crate::prism::sight) of it, cut where the ray is surely
//! outside: a hair too long rather than too short, so that points of the arc may lie outside the prism. Where
//! f32 will not do, and where a prism is folded, [`Arcs::of_curve`] takes a curve that was set up in f64.

mod bounds;

use super::Problem;
use crate::prism::cluster::PrismLanes;
use crate::prism::curve::{Curve, View};
use crate::prism::ray_frame::RayLanes;
use crate::prism::sight::Sight;
use crate::prism::simd::{LANES, Lanes, Quad};
use crate::surface::DisplacedSurface;
use bounds::{Lanewise, Uncertain};

/// The smallest A of an arc, as a part of its largest.
const EVEN: f32 = 0.25;

/// And as a multiple of how far areas are off: barycentrics on an arc are above -2/64 then.
const CERTAIN: f32 = 64.0;

/// The largest rounding of an arc, in texels. Larger ones would only mean more looks in f64.
const FINE: f32 = 1.0 / 32.0;

/// One number for each lane.
type Row = [f32; LANES];

/// The coefficients of 1, s, s^2.
type Rows3 = [Row; 3];

/// Eight arcs.
#[repr(C, align(32))]
pub struct Arcs {
    /// Texel coordinates over A, from a point that the walker knows.
    pub x: Rows3,
    pub y: Rows3,
    /// Barycentrics over A.
    pub u: Rows3,
    pub v: Rows3,
    pub area: Rows3,
    /// w at both ends.
    pub w: [Row; 2],
    /// Height of w in stored texel units: at s = 0, and its change.
    pub height: [Row; 2],
    /// |n_i - n_j|^2 of the vertex pairs (0,1), (0,2), (1,2).
    pub spread: [Row; 3],
    /// Ray parameters over A, from a point that the walker knows: coefficients of 1 .. s^3.
    pub time: [Row; 4],
    /// The same at both ends.
    pub ends: [Row; 2],
    /// How far ray parameters are off at most.
    pub time_off: Row,
    /// How far barycentrics over A are.
    pub inside_off: Row,
    /// Texels that (x, y) move at most.
    pub reach: Row,
    /// Half of |(x, y)''| over 2: a chord of length ds is left by this times ds^2.
    pub bend: Row,
    /// The same of the height, stored texel units.
    pub height_bend: Row,
    /// Rounding of (x, y), texels.
    pub rounding: Row,
    /// Rounding of the height, stored texel units.
    pub height_rounding: Row,
}

/// Where arcs go: coefficients of [`Arcs`] in lanes.
pub struct Places<L> {
    x: [L; 3],
    y: [L; 3],
    u: [L; 3],
    v: [L; 3],
    area: [L; 3],
    height: [L; 2],
    spread: [L; 3],
}

impl<L: Lanes> Places<L> {
    /// Texel coordinates and the height in stored texel units, from what these are at the arcs' points of reference.
    #[inline(always)]
    pub fn at(&self, s: L, [x, y, h]: [L; 3]) -> [L; 3] {
        let one = L::splat(1.0);
        let inverse = one / quadratic(self.area, s);
        let u = quadratic(self.u, s) * inverse;
        let v = quadratic(self.v, s) * inverse;
        // |N'|^2 = 1 - sum b_i b_j spread_ij.
        let b0 = one - u - v;
        let [k01, k02, k12] = self.spread;
        let short = (b0 * v).mul_add(k02, u * v * k12);
        let short = (b0 * u).mul_add(k01, short);
        let length = (one - short).max(L::splat(0.0)).sqrt();
        let w = s.mul_add(self.height[1], self.height[0]);
        [
            quadratic(self.x, s).mul_add(inverse, x),
            quadratic(self.y, s).mul_add(inverse, y),
            w.mul_add(length, h),
        ]
    }
}

/// What is needed of a surface to make arcs.
pub struct Units {
    /// Texels per texture coordinate.
    texels: [f32; 2],
    /// Stored texel units per unit of w.
    per_world: f32,
    /// The stored value that displaces by nothing.
    midlevel: f32,
}

impl Units {
    #[inline(always)]
    pub fn new(surface: &DisplacedSurface) -> Self {
        let (width, height) = surface.map().size();
        let displacement = surface.displacement();
        let unit = surface.map().unit();
        Self {
            texels: [width as f32, height as f32],
            per_world: unit / displacement.scale,
            midlevel: unit * displacement.midlevel,
        }
    }
}

/// Which arcs of a cluster are to be walked.
#[derive(Clone, Copy)]
pub struct Found {
    /// Lanes with an arc.
    pub arcs: u32,
    /// Lanes for which f32 will not do.
    pub others: u32,
}

/// The arcs of a cluster before they are [bounded](Self::bounded).
pub struct Cut<L> {
    arcs: Lanewise<L>,
    uncertain: Uncertain<L>,
    /// How far A is above what f32 will do for, at its smallest.
    even: L,
    /// Lanes of which the ray is surely outside.
    empty: u32,
}

impl<L: Lanes> Cut<L> {
    /// The arcs of prisms that are [seen](Sight) so.
    #[inline(always)]
    pub fn new(sight: &Sight<L>, prisms: &PrismLanes<L>, units: &Units, ray: &RayLanes<L>) -> Self {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let off = sight.off;
        // Twice the area of the offset triangle: positive from here on.
        let total = sum(sight.areas);
        let least = total[0].min(total[1]).min(total[2]);
        let most = total[0].max(total[1]).max(total[2]);
        let (least, most, flip) = (
            least.select_negative(zero - most, least),
            least.select_negative(zero - least, most),
            least,
        );
        let even = least - off * L::splat(CERTAIN) - most * L::splat(EVEN);

        let sides = [
            flipped(sight.areas[0], flip),
            flipped(sight.areas[1], flip),
            flipped(sight.areas[2], flip),
        ];
        // What sides are off by rounding alone when they are cut: see the bounds.
        let [wide_x, wide_y] = sight.widest;
        let (m0, m1, m2) = (largest(sides[0]), largest(sides[1]), largest(sides[2]));
        let rounding = (wide_x * wide_y).mul_add(
            L::splat(2.25 * f32::EPSILON),
            m0.max(m1).max(m2) * L::splat(12.5 * f32::EPSILON),
        );
        let (from, to) = inside(&sides, [zero, one], off);
        // Once more, from what is left: there the sides are closer to straight, so that less is left of rays that pass by.
        let parts = [
            part(sides[0], from, to),
            part(sides[1], from, to),
            part(sides[2], from, to),
        ];
        let (from, to) = inside(&parts, [from, to], off + rounding);
        let empty = (to - from).sign_mask();

        // In the order of t: see `Curve`.
        let per_depth = ray.per_depth;
        let turned = flip.select_negative(zero - per_depth, per_depth);
        let (a, b) = (
            turned.select_negative(to, from),
            turned.select_negative(from, to),
        );
        let [low, high] = sight.offsets;
        let (w0, w1) = (a.mul_add(high - low, low), b.mul_add(high - low, low));
        let dw = w1 - w0;
        let q = [
            between(sides[0], a, b),
            between(sides[1], a, b),
            between(sides[2], a, b),
        ];
        let area = sum(q);

        let [s0, s1, s2] = prisms.texcoords;
        let (width, height) = (L::splat(units.texels[0]), L::splat(units.texels[1]));
        let (x1, x2) = ((s1[0] - s0[0]) * width, (s2[0] - s0[0]) * width);
        let (y1, y2) = ((s1[1] - s0[1]) * height, (s2[1] - s0[1]) * height);
        let depths = weighted(&q, sight.depths);
        let slopes = weighted(&q, sight.slopes);
        let time = [
            w0.mul_add(slopes[0], depths[0]) * per_depth,
            dw.mul_add(slopes[0], w0.mul_add(slopes[1], depths[1])) * per_depth,
            dw.mul_add(slopes[1], w0.mul_add(slopes[2], depths[2])) * per_depth,
            dw * slopes[2] * per_depth,
        ];
        let [n0, n1, n2] = prisms.normals;
        let per_world = L::splat(units.per_world);
        let arcs = Lanewise {
            x: blend(&q, x1, x2),
            y: blend(&q, y1, y2),
            u: q[1],
            v: q[2],
            area,
            height: [w0 * per_world, dw * per_world],
            spread: [
                squared_distance(n0, n1),
                squared_distance(n0, n2),
                squared_distance(n1, n2),
            ],
            time,
            w: [w0, w1],
        };
        let extent = |p: L, q: L| p.max(q).max(zero) - p.min(q).min(zero);
        let per_depth = per_depth.abs();
        Self {
            arcs,
            uncertain: Uncertain {
                area: (wide_x + wide_y).mul_add(sight.coordinate_off * L::splat(1.2), rounding),
                texels: extent(x1, x2).max(extent(y1, y2)),
                time: (sight.farthest - sight.nearest) * per_depth,
                time_off: sight.depth_off * per_depth * L::splat(2.0),
                height: sight.reach * per_world.abs() * L::splat(2.0 * f32::EPSILON),
            },
            even,
            empty,
        }
    }

    #[inline(always)]
    pub fn bounded(&self, units: &Units) -> Arcs {
        self.arcs.bounded(units, &self.uncertain)
    }

    /// What is to be walked of the lanes `met` of `arcs`, which are this.
    #[inline(always)]
    pub fn found(&self, arcs: &Arcs, met: u32, ray: &RayLanes<L>) -> Found {
        let (begins, ends) = (L::from_array(arcs.ends[0]), L::from_array(arcs.ends[1]));
        let time_off = L::from_array(arcs.time_off);
        let too_early = (ends + time_off - ray.interval[0]).sign_mask();
        let too_late = (ray.interval[1] - (begins - time_off)).sign_mask();
        // What is no number is not good enough either, nor what was divided by an A below 0.
        let rounding = L::from_array(arcs.rounding).min(L::splat(f32::MAX));
        let coarse = (L::splat(FINE) - rounding).sign_mask() | rounding.sign_mask();
        let uneven = self.even.max(L::splat(-1.0)).sign_mask();
        // Where A is surely of one sign, so is what is outside, however coarse the rest.
        let others = met & (uneven | coarse & !self.empty);
        Found {
            arcs: met & !others & !self.empty & !too_early & !too_late,
            others,
        }
    }
}

impl Arcs {
    /// All arcs, each in its lane.
    #[inline(always)]
    pub fn places<L: Lanes>(&self) -> Places<L> {
        self.places_in::<L, true>(0)
    }

    /// One arc in all lanes.
    #[inline(always)]
    pub fn places_of<L: Lanes>(&self, lane: usize) -> Places<L> {
        self.places_in::<L, false>(lane)
    }

    #[inline(always)]
    fn places_in<L: Lanes, const ALL: bool>(&self, lane: usize) -> Places<L> {
        Places {
            x: three::<L, ALL>(&self.x, lane),
            y: three::<L, ALL>(&self.y, lane),
            u: three::<L, ALL>(&self.u, lane),
            v: three::<L, ALL>(&self.v, lane),
            area: three::<L, ALL>(&self.area, lane),
            height: [
                one::<L, ALL>(&self.height[0], lane),
                one::<L, ALL>(&self.height[1], lane),
            ],
            spread: three::<L, ALL>(&self.spread, lane),
        }
    }

    /// The arc that is all of a curve, in every lane. Texel coordinates are from the curve's base, ray parameters from `start`.
    #[inline(always)]
    pub fn of_curve<L: Lanes>(
        problem: &Problem<'_>,
        curve: &Curve<L::Quad>,
        view: &View<L::Quad>,
        start: f64,
    ) -> Self {
        let units = Units::new(problem.surface);
        let ([p0, p1, p2], [d0, d1, d2]) = (curve.place, curve.depth);
        let (p, d) = (
            [p0.to_f32(), p1.to_f32(), p2.to_f32()],
            [d0.to_f32(), d1.to_f32(), d2.to_f32()],
        );
        let spread = view.spread.to_f32();
        let ([a0, z0, n0, _], [a1, z1, n1, _]) = (d0.to_array(), d1.to_array());
        let ([a2, z2, n2, _], [w, dw]) = (d2.to_array(), curve.w);
        // (Z + w Zn) - depth(0) A, w = w(0) + dw s.
        let per_depth = curve.per_depth;
        let time = [
            (z0 + w * n0) * per_depth - start * a0,
            (z1 + w * n1 + dw * n0) * per_depth - start * a1,
            (z2 + w * n2 + dw * n1) * per_depth - start * a2,
            dw * n2 * per_depth,
        ];
        let splat3 = |c: [f32; 3]| [L::splat(c[0]), L::splat(c[1]), L::splat(c[2])];
        let per_world = f64::from(units.per_world);
        let zero = L::splat(0.0);
        let arcs = Lanewise {
            x: splat3([p[0].x, p[1].x, p[2].x]),
            y: splat3([p[0].y, p[1].y, p[2].y]),
            u: splat3([p[0].z, p[1].z, p[2].z]),
            v: splat3([p[0].w, p[1].w, p[2].w]),
            area: splat3([d[0].x, d[1].x, d[2].x]),
            height: [
                L::splat((w * per_world) as f32),
                L::splat((dw * per_world) as f32),
            ],
            spread: splat3([spread.x, spread.z, spread.y]),
            time: [
                L::splat(time[0] as f32),
                L::splat(time[1] as f32),
                L::splat(time[2] as f32),
                L::splat(time[3] as f32),
            ],
            w: [L::splat(w as f32), L::splat((w + dw) as f32)],
        };
        arcs.bounded(
            &units,
            &Uncertain {
                area: zero,
                texels: zero,
                time: zero,
                time_off: zero,
                height: zero,
            },
        )
    }
}

/// A row as it is, or one number of it in all lanes.
#[inline(always)]
fn one<L: Lanes, const ALL: bool>(row: &Row, lane: usize) -> L {
    if ALL {
        L::from_array(*row)
    } else {
        L::splat(row[lane])
    }
}

#[inline(always)]
fn three<L: Lanes, const ALL: bool>([a, b, c]: &Rows3, lane: usize) -> [L; 3] {
    [
        one::<L, ALL>(a, lane),
        one::<L, ALL>(b, lane),
        one::<L, ALL>(c, lane),
    ]
}

/// c0 + c1 s + c2 s^2.
#[inline(always)]
fn quadratic<L: Lanes>([c0, c1, c2]: [L; 3], s: L) -> L {
    s.mul_add(s.mul_add(c2, c1), c0)
}

/// With the other sign where the sign bit of `flip` is set.
#[inline(always)]
fn flipped<L: Lanes>([q0, q1, q2]: [L; 3], flip: L) -> [L; 3] {
    let zero = L::splat(0.0);
    [
        flip.select_negative(zero - q0, q0),
        flip.select_negative(zero - q1, q1),
        flip.select_negative(zero - q2, q2),
    ]
}

/// The part of [from, to] on which no side is surely below -`off`, a hair too long; these are the sides' Bernstein coefficients over
/// all of it.
#[inline(always)]
fn inside<L: Lanes>(sides: &[[L; 3]; 3], [from, to]: [L; 2], off: L) -> (L, L) {
    let zero = L::splat(0.0);
    let (b0, e0) = outside(sides[0], off);
    let (b1, e1) = outside(sides[1], off);
    let (b2, e2) = outside(sides[2], off);
    // What is no number says nothing.
    let begin = b0.max(b1.max(b2.max(zero)));
    let end = e0.max(e1.max(e2.max(zero)));
    let hair = L::splat(4.0 * f32::EPSILON);
    let length = to - from;
    (
        (begin.mul_add(length, from) - hair).max(from),
        (end.neg_mul_add(length, to) + hair).min(to),
    )
}

/// How far from its beginning, and from its end, a quadratic in Bernstein form is surely below -`off`:
/// q0 + s ((1 - s) 2 (q1 - q0) + s (q2 - q0)) is up to s = -q0 over the larger of the two.
#[inline(always)]
fn outside<L: Lanes>([q0, q1, q2]: [L; 3], off: L) -> (L, L) {
    let zero = L::splat(0.0);
    let (from_begin, from_end, across) = (q1 - q0, q1 - q2, q2 - q0);
    (
        (zero - (q0 + off)).max(zero) / (from_begin + from_begin).max(across),
        (zero - (q2 + off)).max(zero) / (from_end + from_end).max(zero - across),
    )
}

/// The largest magnitude.
#[inline(always)]
fn largest<L: Lanes>([q0, q1, q2]: [L; 3]) -> L {
    q0.abs().max(q1.abs()).max(q2.abs())
}

/// The sum of the three sides, coefficient by coefficient.
#[inline(always)]
fn sum<L: Lanes>([p, q, r]: [[L; 3]; 3]) -> [L; 3] {
    [p[0] + q[0] + r[0], p[1] + q[1] + r[1], p[2] + q[2] + r[2]]
}

/// A quadratic in Bernstein form over [a, b] of it: coefficients of 1, s, s^2.
#[inline(always)]
fn between<L: Lanes>([q0, q1, q2]: [L; 3], a: L, b: L) -> [L; 3] {
    let [first, middle, last] = part([q0, q1, q2], a, b);
    let (rise, more) = (middle - first, last - middle);
    [first, rise + rise, more - rise]
}

/// The same in Bernstein form.
#[inline(always)]
fn part<L: Lanes>([q0, q1, q2]: [L; 3], a: L, b: L) -> [L; 3] {
    let (d0, d1) = (q1 - q0, q2 - q1);
    let (left, right) = (a.mul_add(d0, q0), a.mul_add(d1, q1));
    let first = a.mul_add(right - left, left);
    let middle = b.mul_add(right - left, left);
    let (left, right) = (b.mul_add(d0, q0), b.mul_add(d1, q1));
    [first, middle, b.mul_add(right - left, left)]
}

/// sum of the sides' quadratics times one number each.
#[inline(always)]
fn weighted<L: Lanes>([p, q, r]: &[[L; 3]; 3], [a, b, c]: [L; 3]) -> [L; 3] {
    [
        p[0].mul_add(a, q[0].mul_add(b, r[0] * c)),
        p[1].mul_add(a, q[1].mul_add(b, r[1] * c)),
        p[2].mul_add(a, q[2].mul_add(b, r[2] * c)),
    ]
}

/// The same with nothing for the first side.
#[inline(always)]
fn blend<L: Lanes>([_, q, r]: &[[L; 3]; 3], b: L, c: L) -> [L; 3] {
    [
        q[0].mul_add(b, r[0] * c),
        q[1].mul_add(b, r[1] * c),
        q[2].mul_add(b, r[2] * c),
    ]
}

#[inline(always)]
fn squared_distance<L: Lanes>([px, py, pz]: [L; 3], [qx, qy, qz]: [L; 3]) -> L {
    let (x, y, z) = (qx - px, qy - py, qz - pz);
    x.mul_add(x, y.mul_add(y, z * z))
}

#[cfg(test)]
mod tests;
