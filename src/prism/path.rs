//! A ray's path through one prism in closed form.
//!
//! The ray's part between two parameters is x(s), s in [0, 1], in the prism's affine frame: linear. The scan
//! triangle at its height h(s) has corners v_i + h m_i, linear in s too, so the areas Q_i that x(s) cuts from
//! it are quadratic in s and b_i = Q_i / A, A = sum Q_i: the paper's projection without its plane
//! intersections.
//!
//! That prediction solves P(b) + h sum b_i m_i = x. The surface is defined with N' = sum b_i n_i instead, and
//! the two differ by the spread of the normals times the spread of n_i . Ng. Newton steps on
//! P(b) + w N'(b) = x, with w eliminated by its third component, take the difference away.

use glam::{Vec2, Vec3, Vec4, Vec4Swizzles};

use super::frame::Prism;
use super::simd::{Grid, Lanes};
use crate::ray::Ray;

/// The units of height that the paths through all prisms of a surface share.
#[derive(Clone, Copy, Debug)]
pub struct HeightUnits {
    /// Stored texel values per world unit.
    pub texel_per_world: f32,
    /// The stored texel value that displaces by nothing.
    pub texel_midlevel: f32,
}

/// A ray inside one prism; s in [0, 1] runs over t in [`t0`, `t0 + dt`].
#[derive(Clone, Copy, Debug)]
pub struct Path {
    /// Ray parameter at s = 0.
    pub t0: f32,
    /// Length in ray parameter.
    pub dt: f32,
    /// (b, c, h) at s = 0 and its change over the path.
    start: Vec4,
    change: Vec4,
    /// Coefficients of (Q0, Q1, Q2), of 1, s, s^2; the last lane repeats the first.
    pub areas: [Vec4; 3],
    /// How far the prism's sides may be off in Q: see [`side_margin`].
    pub margin: Vec4,
    /// n_0, n_1 - n_0, n_2 - n_0.
    normal: [Vec4; 3],
    /// Texel coordinates, the same way.
    texel: [Vec2; 3],
    newton_steps: u32,
}

/// Eight samples of a path.
#[derive(Clone, Copy)]
pub struct Samples<L> {
    /// Barycentric coordinate of vertex 1.
    pub u: L,
    /// Barycentric coordinate of vertex 2.
    pub v: L,
    /// Distance along N'(b), in units of |N'|.
    pub w: L,
}

/// Barycentric slack of the prism's sides against rounding: f32 steps of the frame, times a few.
const SIDE_EPSILON: f32 = 1e-4;

impl Path {
    /// The part of `ray` that may be inside the prism; `None` when it misses the slabs around it.
    ///
    /// It is not cut at tfar: samples would move with it, and a hit with what else the ray has met before.
    #[inline(always)]
    pub fn clip(prism: &Prism, v0: Vec3, ray: &Ray) -> Option<Clipped> {
        let origin = prism.vector(ray.origin - v0);
        let direction = prism.vector(ray.direction);
        let normals = [prism.normal(0), prism.normal(1), prism.normal(2)];
        let (low, high) = slabs(prism, &normals);
        let pad = SIDE_EPSILON + 4.0 * f32::EPSILON * origin.abs().max_element();
        let height_pad = 4.0 * f32::EPSILON * (origin.z.abs() + low.z.abs() + high.z.abs());
        let pad = Vec4::new(pad, pad, height_pad, pad);
        // A direction inside a slab's plane must not make 0 * infinity.
        let tiny = Vec4::splat(1e-30).copysign(direction);
        let inverse =
            Vec4::select(direction.abs().cmplt(Vec4::splat(1e-30)), tiny, direction).recip();
        let (a, b) = (
            (low - pad - origin) * inverse,
            (high + pad - origin) * inverse,
        );
        let (t0, t1) = (
            a.min(b).max_element().max(ray.tnear),
            a.max(b).min_element(),
        );
        (t0 < t1 && t0 < ray.tfar).then_some(Clipped {
            origin,
            direction,
            normals,
            t0,
            t1,
        })
    }

    /// The path's coefficients; `normals` are the unit vertex normals in world space.
    #[inline(always)]
    pub fn new(prism: &Prism, clipped: &Clipped) -> Self {
        let Clipped {
            origin,
            direction,
            normals: [n0, n1, n2],
            t0,
            t1,
        } = *clipped;
        let dt = t1 - t0;
        let (start, change) = (origin + t0 * direction, dt * direction);
        // Lanes are the vertices: in-plane components of m_i, corners of the triangle, corners minus ray.
        let heights = Vec4::new(n0.z, n1.z, n2.z, n0.z);
        let inverse = heights.recip();
        let mb = Vec4::new(n0.x, n1.x, n2.x, n0.x) * inverse;
        let mc = Vec4::new(n0.y, n1.y, n2.y, n0.y) * inverse;
        let (h0, h1) = (start.z, change.z);
        let ab = Vec4::new(0.0, 1.0, 0.0, 0.0) + h0 * mb - start.x;
        let ac = Vec4::new(0.0, 0.0, 1.0, 0.0) + h0 * mc - start.y;
        let eb = h1 * mb - change.x;
        let ec = h1 * mc - change.y;
        // Q_i = (corner i+1 - x) x (corner i+2 - x).
        let cross = |b: Vec4, c: Vec4, p: Vec4, q: Vec4| b.yzxy() * q.zxyz() - c.yzxy() * p.zxyz();
        let areas = [
            cross(ab, ac, ab, ac),
            cross(ab, ac, eb, ec) + cross(eb, ec, ab, ac),
            cross(eb, ec, eb, ec),
        ];
        let reach = h0.abs().max((h0 + h1).abs());
        let margin = side_margin(heights, mb, mc, reach);
        let worst = margin.max_element();
        let rounding = 4.0 * f32::EPSILON * (ab.abs() + ac.abs()).max_element();
        let [s0, s1, s2] = [prism.texel(0), prism.texel(1), prism.texel(2)];
        Self {
            t0,
            dt,
            start,
            change,
            areas,
            margin: margin + (SIDE_EPSILON + rounding),
            normal: [n0, n1 - n0, n2 - n0],
            texel: [s0, s1 - s0, s2 - s0],
            newton_steps: if worst < 1e-7 {
                0
            } else {
                1 + u32::from(worst > 1e-2)
            },
        }
    }

    /// True where the scan triangle keeps its orientation on the whole path, so that the prediction holds. It
    /// does not where a surface is displaced inward beyond its radius of curvature.
    #[inline(always)]
    pub fn is_regular(&self) -> bool {
        let [a, b, c] = self.areas.map(|q| q.x + q.y + q.z);
        // The quadratic's Bernstein coefficients bound it from below.
        a.min(a + 0.5 * b).min(a + b + c) > 0.05
    }

    /// b and w at eight parameters.
    #[inline(always)]
    pub fn sample<L: Lanes>(&self, s: L) -> Samples<L> {
        let quadratic = |k: Vec3| s.mul_add(s.mul_add(L::splat(k.z), L::splat(k.y)), L::splat(k.x));
        let [q0, q1, q2] = self.areas;
        let area = |i: usize| Vec3::new(q0[i], q1[i], q2[i]);
        let inverse = L::splat(1.0) / quadratic(area(0) + area(1) + area(2));
        let (mut u, mut v) = (quadratic(area(1)) * inverse, quadratic(area(2)) * inverse);
        let linear = |i: usize| s.mul_add(L::splat(self.change[i]), L::splat(self.start[i]));
        let (b, c, h) = (linear(0), linear(1), linear(2));
        for _ in 0..self.newton_steps {
            (u, v) = self.newton(u, v, b, c, h);
        }
        Samples {
            u,
            v,
            w: h / self.normal_component(2, u, v),
        }
    }

    /// One Newton step on (b1 - b) N'_h + h N'_b = 0, (b2 - c) N'_h + h N'_c = 0.
    #[inline(always)]
    fn newton<L: Lanes>(&self, u: L, v: L, b: L, c: L, h: L) -> (L, L) {
        let component = |i: usize| self.normal_component(i, u, v);
        let (nb, nc, nh) = (component(0), component(1), component(2));
        let (eu, ev) = (u - b, v - c);
        let derivative = |e: L, row: usize, column: usize| {
            let d = self.normal[column];
            e.mul_add(L::splat(d.z), h * L::splat(d[row]))
        };
        let (f1, f2) = (eu.mul_add(nh, h * nb), ev.mul_add(nh, h * nc));
        let (j11, j12) = (nh + derivative(eu, 0, 1), derivative(eu, 0, 2));
        let (j21, j22) = (derivative(ev, 1, 1), nh + derivative(ev, 1, 2));
        let inverse = L::splat(1.0) / (j11 * j22 - j12 * j21);
        (
            u - (f1 * j22 - f2 * j12) * inverse,
            v - (j11 * f2 - j21 * f1) * inverse,
        )
    }

    /// Component `i` (b, c, h) of N'(b).
    #[inline(always)]
    fn normal_component<L: Lanes>(&self, i: usize, u: L, v: L) -> L {
        let [n0, d1, d2] = self.normal;
        u.mul_add(L::splat(d1[i]), v.mul_add(L::splat(d2[i]), L::splat(n0[i])))
    }

    /// Texel coordinates of samples.
    #[inline(always)]
    pub fn texel<L: Lanes>(&self, u: L, v: L) -> (L, L) {
        let [t0, d1, d2] = self.texel;
        let along =
            |a: f32, b: f32, c: f32| u.mul_add(L::splat(b), v.mul_add(L::splat(c), L::splat(a)));
        (along(t0.x, d1.x, d2.x), along(t0.y, d1.y, d2.y))
    }

    /// How far samples are above the surface, in stored texel units: w |N'| - D.
    /// `spread` is |n_i - n_j|^2 of the vertex pairs (0,1), (0,2), (1,2): |N'|^2 = 1 - sum b_i b_j spread_ij.
    #[inline(always)]
    pub fn above<L: Lanes>(
        &self,
        samples: Samples<L>,
        field: &HeightUnits,
        grid: &Grid<'_>,
        spread: Vec3,
    ) -> L {
        let Samples { u, v, w } = samples;
        let (x, y) = self.texel(u, v);
        let height = grid.sample(x, y);
        let b0 = L::splat(1.0) - u - v;
        let toward = |k: f32| L::splat(-k);
        let along_edges = (b0 * u).mul_add(
            toward(spread.x),
            (b0 * v).mul_add(toward(spread.y), u * v * toward(spread.z)),
        );
        let length = (L::splat(1.0) + along_edges).sqrt();
        (w * length).mul_add(
            L::splat(field.texel_per_world),
            L::splat(field.texel_midlevel) - height,
        )
    }
}

/// A ray clipped to the slabs around a prism, in its frame.
#[derive(Clone, Copy, Debug)]
pub struct Clipped {
    origin: Vec4,
    direction: Vec4,
    normals: [Vec4; 3],
    t0: f32,
    t1: f32,
}

/// The prism's extent in b, c, h and b + c. S(b) = sum b_i (v_i + w n_i) for one w in the offset range, so it
/// lies in the hull of the six corners; its height is D N'.Ng/|N'|, between D times the lowest n_i.Ng and D.
#[inline(always)]
fn slabs(prism: &Prism, normals: &[Vec4; 3]) -> (Vec4, Vec4) {
    const CORNERS: [Vec4; 3] = [
        Vec4::ZERO,
        Vec4::new(1.0, 0.0, 0.0, 1.0),
        Vec4::new(0.0, 1.0, 0.0, 1.0),
    ];
    let ([w0, w1], [d0, d1]) = (prism.offsets(), prism.range());
    let mut low = Vec4::INFINITY;
    let mut high = Vec4::NEG_INFINITY;
    for (&corner, &normal) in CORNERS.iter().zip(normals) {
        let (p, q) = (corner + w0 * normal, corner + w1 * normal);
        low = low.min(p.min(q));
        high = high.max(p.max(q));
    }
    let lowest = prism.lowest_normal_height();
    (
        low.with_z(d0.min(d0 * lowest)),
        high.with_z(d1.max(d1 * lowest)),
    )
}

/// How far, in Q, the parallel prism's side (a straight line at each height) may be from the surface's own side
/// {v_i + w n_i}, by lanes of the opposite vertex. At height h a point at lambda of edge ij lies at lambda' of
/// the parallel side's line, moved by (lambda - lambda') e; |lambda - lambda'| <= |n_j.Ng - n_i.Ng| / (4 min)
/// and e is off the line's direction by h (m_j - m_i).
#[inline(always)]
fn side_margin(heights: Vec4, mb: Vec4, mc: Vec4, reach: f32) -> Vec4 {
    // Lane k: the edge from vertex k+1 to k+2; e is (-1,1), (0,-1), (1,0) in (b, c).
    const EDGE_B: Vec4 = Vec4::new(-1.0, 0.0, 1.0, -1.0);
    const EDGE_C: Vec4 = Vec4::new(1.0, -1.0, 0.0, 1.0);
    let (first, second) = (heights.yzxy(), heights.zxyz());
    let shift = (second - first).abs() / (4.0 * first.min(second));
    let cross = EDGE_B * (mc.zxyz() - mc.yzxy()) - EDGE_C * (mb.zxyz() - mb.yzxy());
    reach * shift * cross.abs()
}
