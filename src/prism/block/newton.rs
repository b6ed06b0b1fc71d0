//! The hit in a cell that f32 is certain of, in f64 on S itself.
//!
//! Seen along the ray, S(u, v) has two lateral coordinates, and both are 0 at the hit: Newton's method in (u, v) from f32's root of the
//! bilinear patch, which is a hundredth of a texel off or less. The cell's own heights are used throughout, also where a step leaves the cell for a
//! moment. On the way only the two lateral coordinates are looked at ([`Seen`]); where no step is left worth taking, S in
//! space confirms it, and gives depth and normal.

use glam::{DVec2, DVec3, Vec2};

use super::cell::Once;
use crate::prism::judge::Found;
use crate::prism::ray_frame::RayFrame;
use crate::surface::{HeightSample, Patch};

/// A crossing, and dS/du x dS/dv where that is known already.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    pub at: Found,
    pub ng: Option<DVec3>,
}

impl Crossing {
    /// One of which no one asks where it is.
    pub const ANY: Self = Self {
        at: Found {
            t: 0.0,
            u: 0.0,
            v: 0.0,
        },
        ng: None,
    };
}

/// A texel cell in f64.
pub struct Cell {
    /// Its lower left texel, in the patch's texel coordinates.
    pub corner: DVec2,
    /// Heights at (0,0), (1,0), (0,1) and (1,1).
    pub heights: [f64; 4],
}

impl Cell {
    #[inline(always)]
    fn sample(&self, texel: DVec2) -> HeightSample {
        let (f, [h00, h10, h01, h11]) = (texel - self.corner, self.heights);
        let (bottom, top) = (h00 + f.x * (h10 - h00), h01 + f.x * (h11 - h01));
        HeightSample {
            height: bottom + f.y * (top - bottom),
            gradient: DVec2::new(
                (h10 - h00) + f.y * ((h11 - h01) - (h10 - h00)),
                top - bottom,
            ),
        }
    }

    /// Where a place is.
    #[inline(always)]
    pub fn find(&self, texel: DVec2) -> Whose {
        let f = texel - self.corner;
        Whose::by(f.min_element().min(1.0 - f.max_element()))
    }
}

/// Whether barycentric coordinates are in the triangle.
#[inline(always)]
pub fn in_triangle(u: f64, v: f64) -> Whose {
    Whose::by(u.min(v).min(1.0 - u - v))
}

/// Whose a place is: of this cell, of this triangle, or of another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Whose {
    Ours,
    Others,
    Doubtful,
}

impl Whose {
    /// By how far inside it is, texels or barycentrics.
    #[inline(always)]
    fn by(inside: f64) -> Self {
        // Roundings of f64 are a millionth of this.
        const HAIR: f64 = 1e-9;
        if inside > HAIR {
            Self::Ours
        } else if inside < -HAIR {
            Self::Others
        } else {
            Self::Doubtful
        }
    }
}

/// Steps of Newton's method before the last.
const MOST_STEPS: usize = 5;

/// The root of S, with the cell's heights, in a part of it or around it, with its normal; `None` where Newton's method does not end there.
#[inline(always)]
pub fn land(patch: &Patch<'_>, frame: &RayFrame, cell: &Cell, once: &Once) -> Option<Crossing> {
    // Barycentrics, and texels: where the normal is taken.
    const FINE: f64 = 1e-11;
    const FINE_TEXELS: f64 = 1e-10;
    let [p0, p1, p2] = patch.texels;
    let (a, b) = (p1 - p0, p2 - p0);
    let from = cell.corner + Vec2::from(once.at).as_dvec2() - p0;
    let per_area = 1.0 / a.perp_dot(b);
    let mut uv = [from.perp_dot(b) * per_area, a.perp_dot(from) * per_area];
    let fine = FINE.min(FINE_TEXELS / (a.abs() + b.abs()).max_element());

    let seen = Seen::new(patch, frame);
    let mut last = 0.0;
    for _ in 0..MOST_STEPS {
        let [u, v] = seen.step(patch, cell, uv);
        uv = [uv[0] + u, uv[1] + v];
        let step = u.abs().max(v.abs());
        // What is left is to this step's square as this step is to the square of the last.
        let ratio = step / last;
        let left = step * (4.0 * ratio * ratio).min(1.0);
        if left <= fine {
            let crossing = confirmed(patch, frame, cell, uv, fine)?;
            let place = patch.texel(crossing.at.u, crossing.at.v) - cell.corner;
            return once.holds(place).then_some(crossing);
        }
        last = step;
    }
    None
}

/// The hit, if S in space is there too.
#[inline(always)]
fn confirmed(
    patch: &Patch<'_>,
    frame: &RayFrame,
    cell: &Cell,
    [u, v]: [f64; 2],
    fine: f64,
) -> Option<Crossing> {
    // What the last step may find missing: Newton's error is about the square of its step, so that nothing that
    // single precision sees depends on the guess.
    const BEYOND: f64 = 100.0;
    let ([x, y, z], [shear_x, shear_y]) = (frame.axes, frame.shear);
    let point = patch.point_of(cell.sample(patch.texel(u, v)), u, v);
    let (du, dv) = (point.du, point.dv);
    let depth = point.position[z] - frame.origin[2];
    let miss_x = frame.origin[0] + depth * shear_x - point.position[x];
    let miss_y = frame.origin[1] + depth * shear_y - point.position[y];
    let [step_u, step_v] = newton(
        [miss_x, miss_y],
        [du[x] - shear_x * du[z], du[y] - shear_y * du[z]],
        [dv[x] - shear_x * dv[z], dv[y] - shear_y * dv[z]],
    );
    let (u, v) = (u + step_u, v + step_v);
    let is_there = step_u.abs().max(step_v.abs()) <= BEYOND * fine;
    is_there.then_some(Crossing {
        at: Found {
            t: (depth + step_u * du[z] + step_v * dv[z]) * frame.per_depth,
            u,
            v,
        },
        ng: Some(point.ng),
    })
}

/// A triangle seen along a ray: where S(u, v) is beside it.
///
/// Lateral coordinates of P + D N'/|N'| are linear in those of the corners' vertices and normals, with k = D/|N'| alone to be found for
/// every (u, v); |N'|^2 is a quadratic.
struct Seen {
    /// At vertex 0, and what u and v add: lateral coordinates of the vertices and of their normals.
    vertices: [DVec2; 3],
    normals: [DVec2; 3],
    /// The products of n_0, n_1 - n_0 and n_2 - n_0: 00, 01, 02, 11, 12, 22.
    products: [f64; 6],
}

impl Seen {
    #[inline(always)]
    fn new(patch: &Patch<'_>, frame: &RayFrame) -> Self {
        let ([v0, v1, v2], [n0, n1, n2]) = (patch.vertices, patch.normals);
        let (m1, m2) = (n1 - n0, n2 - n0);
        let [x, y, z] = frame.axes;
        let [shear_x, shear_y] = frame.shear;
        let [ox, oy, oz] = frame.origin;
        let lateral = |p: DVec3| DVec2::new(p[x] - p[z] * shear_x, p[y] - p[z] * shear_y);
        let depth = v0[z] - oz;
        Self {
            vertices: [
                DVec2::new(v0[x] - ox - depth * shear_x, v0[y] - oy - depth * shear_y),
                lateral(v1 - v0),
                lateral(v2 - v0),
            ],
            normals: [lateral(n0), lateral(m1), lateral(m2)],
            products: [
                n0.dot(n0),
                n0.dot(m1),
                n0.dot(m2),
                m1.dot(m1),
                m1.dot(m2),
                m2.dot(m2),
            ],
        }
    }

    /// Newton's step to where S is on the ray.
    #[inline(always)]
    fn step(&self, patch: &Patch<'_>, cell: &Cell, [u, v]: [f64; 2]) -> [f64; 2] {
        let sample = cell.sample(patch.texel(u, v));
        let [c00, c01, c02, c11, c12, c22] = self.products;
        // N' . dN'/du, N' . dN'/dv, |N'|^2.
        let (turn_u, turn_v) = (c01 + u * c11 + v * c12, c02 + u * c12 + v * c22);
        let squared = (c00 + u * c01 + v * c02) + u * turn_u + v * turn_v;
        let per_squared = 1.0 / squared;
        let per_height = patch.scale * per_squared.sqrt();
        let k = (sample.height - patch.midlevel) * per_height;
        let turned = k * per_squared;
        let [p0, p1, p2] = patch.texels;
        let k_u = sample.gradient.dot(p1 - p0) * per_height - turned * turn_u;
        let k_v = sample.gradient.dot(p2 - p0) * per_height - turned * turn_v;
        let ([a, au, av], [n, nu, nv]) = (self.vertices, self.normals);
        let normal = n + u * nu + v * nv;
        let miss = -(a + u * au + v * av + k * normal);
        let du = au + k * nu + k_u * normal;
        let dv = av + k * nv + k_v * normal;
        newton(miss.to_array(), du.to_array(), dv.to_array())
    }
}

/// The step (u, v) whose parts along `du` and `dv` make `miss`.
#[inline(always)]
fn newton(miss: [f64; 2], du: [f64; 2], dv: [f64; 2]) -> [f64; 2] {
    let inverse = 1.0 / (du[0] * dv[1] - dv[0] * du[1]);
    [
        (miss[0] * dv[1] - miss[1] * dv[0]) * inverse,
        (miss[1] * du[0] - miss[0] * du[1]) * inverse,
    ]
}
