//! The hit in a cell that f32 is certain of, in f64 on S itself.
//!
//! Seen along the ray, S(u, v) has two lateral coordinates, and both are 0 at the hit: Newton's method in (u, v) from f32's root of the
//! bilinear patch, which is a hundredth of a texel off or less. The cell's own heights are used throughout, also where a step leaves the cell for a
//! moment.

use glam::{DVec2, DVec3, Vec2};

use super::cell::Once;
use crate::prism::judge::Found;
use crate::prism::march::polish::Root;
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

    /// With its normal, if that is known already.
    #[inline(always)]
    pub fn root(&self) -> Option<Root> {
        let Found { t, u, v } = self.at;
        self.ng.map(|ng| Root { t, u, v, ng })
    }
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

/// Steps of Newton's method at most.
const MOST_STEPS: usize = 6;

/// The root of S, with the cell's heights, in a part of it or around it, with its normal; `None` where Newton's method does not end there.
#[inline(always)]
pub fn land(patch: &Patch<'_>, frame: &RayFrame, cell: &Cell, once: &Once) -> Option<Crossing> {
    // Texels: nothing that single precision sees depends on the guess. As far from the root the normal is taken.
    const FINE: f64 = 1e-9;
    const NEAR: f64 = 1e-5;
    let [p0, p1, p2] = patch.texels;
    let (a, b) = (p1 - p0, p2 - p0);
    let from = cell.corner + Vec2::from(once.at).as_dvec2() - p0;
    let per_area = 1.0 / a.perp_dot(b);
    let texels = (a.abs() + b.abs()).max_element();
    let (mut u, mut v) = (from.perp_dot(b) * per_area, a.perp_dot(from) * per_area);

    let ([x, y, z], [shear_x, shear_y]) = (frame.axes, frame.shear);
    // The guess is off by about a hundredth of a texel.
    let mut last = 1e-2;
    for _ in 0..MOST_STEPS {
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
        (u, v) = (u + step_u, v + step_v);
        let step = step_u.abs().max(step_v.abs()) * texels;
        // What is left is to this step's square as this step is to the square of the last.
        let ratio = step / last;
        let left = step * (4.0 * ratio * ratio).min(1.0);
        if left <= FINE && step <= NEAR {
            let place = patch.texel(u, v) - cell.corner;
            return once.holds(place).then_some(Crossing {
                at: Found {
                    t: (depth + step_u * du[z] + step_v * dv[z]) * frame.per_depth,
                    u,
                    v,
                },
                ng: Some(point.ng),
            });
        }
        last = step;
    }
    None
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
