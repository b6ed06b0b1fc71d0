//! One cell against the ray: certainly missed, certainly hit once, or not to be told in f32.
//!
//! Seen along the ray, the cell's piece of S is a map of the unit square to the plane, and the ray is the origin. It differs by no more than `off`
//! from the bilinear patch of the cell's four displaced corners:
//!
//! - The patch is in the hull of its corners, S in the hull widened by `off`. The hull is the union of the four triangles of corners; where
//!   the origin is outside of all of them by more than `off`, the cell is missed.
//! - Where the origin is on the inner side of all four sides of the outline, farther than `off`, the outline of S goes around it once, as
//!   that of the patch does: they can be moved into each other without passing it. So S has a root in the cell. Where the Jacobian of S has one sign in
//!   all of the cell, every root counts the same, and there is exactly one.
//! - Where the Jacobian has one sign in a square, S meets no point twice there: the difference of a bilinear patch at two points is its derivative
//!   half way, applied to the step; that of S is a matrix as near to it as derivatives are, and not singular.

use glam::{DVec2, Vec2, Vec4};

use super::leaf::Leaf;
use super::middle::Heights;
use super::view::View;

/// What f32 tells of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    Missed,
    /// Hit exactly once: about where, from the cell's lower left corner, and whether that is certainly within the ray's interval and the triangle.
    Hit {
        at: Once,
        is_inside: bool,
    },
    /// S has one root at most in the part and around it, about there: Newton's method tells.
    Once(Once),
    /// To be looked at in quarters: the Jacobian changes its sign.
    Folded(Seen),
    Unknown,
}

/// A part of a cell with room around it, in which S has one root at most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Once {
    /// About where the root is, from the cell's lower left corner.
    pub at: [f32; 2],
    /// The part's own lower left corner, and its side.
    pub corner: [f32; 2],
    pub side: f32,
}

impl Once {
    /// What is around a part, as a part of its side.
    pub const ROOM: f32 = 0.25;

    /// Whether a place in the cell is in the part or around it.
    #[inline(always)]
    pub fn holds(&self, place: DVec2) -> bool {
        let part = (place - Vec2::from(self.corner).as_dvec2()) / f64::from(self.side);
        let room = f64::from(Self::ROOM);
        part.min_element() >= -room && part.max_element() <= 1.0 + room
    }
}

/// A cell, or a part of one, as the ray sees it: corners in the order of the outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    pub x: Vec4,
    pub y: Vec4,
    /// How far S is from the bilinear patch of the corners at most, and how far its derivatives, for the whole cell.
    pub off: f32,
    pub bend: f32,
}

/// Corners of a cell in the order of its outline: (0,0) (1,0) (1,1) (0,1).
const S: Vec4 = Vec4::new(0.0, 1.0, 1.0, 0.0);
const T: Vec4 = Vec4::new(0.0, 0.0, 1.0, 1.0);

/// Cell (i, j) of a leaf, whose texels are `stored`, in the order of the outline.
#[inline(always)]
pub fn judged(
    view: &View<'_>,
    heights: &Heights,
    leaf: &Leaf,
    (i, j): (u32, u32),
    stored: [f32; 4],
) -> Verdict {
    // From the leaf's middle, and from the block's.
    let (s, t) = (S + (i as f32 - 4.0), T + (j as f32 - 2.0));
    let k = leaf.k(s, t);
    let (s, t) = (s + leaf.s, t + leaf.t);

    let d = Vec4::from_array(stored) * heights.scale + heights.offset;
    let w = d * k;
    let along = |axis: &super::middle::Axis| {
        let p = axis.p.c + s * axis.p.s + t * axis.p.t;
        let n = axis.n.c + s * axis.n.s + t * axis.n.t;
        p + w * n
    };
    let rise = d.max_element() - d.min_element();
    let beta = leaf.beta(rise, heights.most);
    let seen = Seen {
        x: along(&view.x),
        y: along(&view.y),
        off: leaf.off + 0.5 * view.shear * beta,
        bend: 4.0 * view.shear * beta + 2.0 * leaf.off,
    };
    let roots = seen.roots();
    if roots == Roots::None {
        return Verdict::Missed;
    }

    let b1 = view.middle.b[0].c + s * view.middle.b[0].s + t * view.middle.b[0].t;
    let b2 = view.middle.b[1].c + s * view.middle.b[1].s + t * view.middle.b[1].t;
    let b0 = 1.0 - b1 - b2;
    let most = Vec4::new(b0.max_element(), b1.max_element(), b2.max_element(), 0.0);
    // Digits of f32 barycentrics over a few thousand texels.
    const SLACK: f32 = 1e-3;
    if most.min_element() < -SLACK {
        return Verdict::Missed;
    }

    let z = along(&view.z);
    let depth_off = leaf.depth_off + 0.5 * view.per_length * beta;
    let (near, far) = (z.min_element() - depth_off, z.max_element() + depth_off);
    if near > view.interval[1] || far < view.interval[0] {
        return Verdict::Missed;
    }

    match roots {
        Roots::None => Verdict::Missed,
        Roots::One => {
            let least = b0.min(b1).min(b2).min_element();
            Verdict::Hit {
                at: seen.once([0.0; 2], 1.0),
                is_inside: least > SLACK && near > view.inner[0] && far < view.inner[1],
            }
        }
        Roots::OneAtMost => Verdict::Once(seen.once([0.0; 2], 1.0)),
        Roots::Unknown => Verdict::Folded(seen),
    }
}

/// The roots of S in a cell or a part of one.
#[derive(Clone, Copy, PartialEq)]
enum Roots {
    None,
    One,
    /// Also around it, by [`Once::ROOM`].
    OneAtMost,
    Unknown,
}

impl Seen {
    #[inline(always)]
    fn roots(&self) -> Roots {
        let Self { x, y, off, bend } = *self;
        // Twice the areas that the sides span with the origin, and what they may be off by.
        let (x1, y1) = (turned(x), turned(y));
        let (ex, ey) = (x1 - x, y1 - y);
        let (left, right) = (x * y1, y * x1);
        let sides = left - right;
        let doubt = off * (ex.abs() + ey.abs()) + ROUNDED * (left.abs() + right.abs());
        let positive = (doubt - sides).is_negative_bitmask();
        let negative = (doubt + sides).is_negative_bitmask();
        let goes_around = positive == ALL || negative == ALL;
        if !goes_around && is_outside(positive, negative, &Diagonals::new(x, y, off)) {
            return Roots::None;
        }

        // The Jacobian of the patch is affine: one sign at its corners is one everywhere.
        let (bx, by) = (turned_back(ex), turned_back(ey));
        let (left, right) = (bx * ey, by * ex);
        let jacobian = left - right;
        let lengths = ex.abs() + ey.abs() + bx.abs() + by.abs();
        let doubt = bend * (lengths + bend) + ROUNDED * (left.abs() + right.abs());
        if goes_around {
            let jacobian = if positive == ALL { jacobian } else { -jacobian };
            if (doubt - jacobian).is_negative_bitmask() == ALL {
                return Roots::One;
            }
        }
        // Where the square is larger by a quarter on each side: S's derivatives differ by less than eight times as much there.
        let sum = turned(jacobian) + turned_back(jacobian);
        let around = (1.0 + 2.0 * Once::ROOM) * jacobian - Once::ROOM * sum;
        let doubt = Vec4::splat(8.0 * doubt.max_element());
        let has_one_sign = (doubt - around).is_negative_bitmask() == ALL
            || (doubt + around).is_negative_bitmask() == ALL;
        if has_one_sign {
            Roots::OneAtMost
        } else {
            Roots::Unknown
        }
    }

    fn once(&self, corner: [f32; 2], side: f32) -> Once {
        let [p, q] = self.root();
        Once {
            at: [corner[0] + side * p, corner[1] + side * q],
            corner,
            side,
        }
    }

    /// What f32 tells of a cell by its quarters, each of which is a bilinear patch of its own.
    pub fn in_quarters(&self) -> Verdict {
        let mut found = Verdict::Missed;
        for quarter in 0..4 {
            let corner = [S[quarter] * 0.5, T[quarter] * 0.5];
            let part = Self {
                x: quarter_of(self.x, quarter),
                y: quarter_of(self.y, quarter),
                ..*self
            };
            match (part.roots(), found) {
                (Roots::None, _) => {}
                (Roots::One | Roots::OneAtMost, Verdict::Missed) => {
                    found = Verdict::Once(part.once(corner, 0.5));
                }
                _ => return Verdict::Unknown,
            }
        }
        found
    }

    /// The root of the bilinear patch nearest to the middle, about.
    #[inline(always)]
    fn root(&self) -> [f32; 2] {
        root(self.x.to_array(), self.y.to_array())
    }
}

/// The corners of a quarter: that at a corner of the outline, which is its own corner of the same number.
#[inline(always)]
fn quarter_of(v: Vec4, quarter: usize) -> Vec4 {
    let middle = 0.25 * (v.x + v.y + v.z + v.w);
    let (next, last) = (0.5 * (v + turned(v)), 0.5 * (v + turned_back(v)));
    let mut part = [middle; 4];
    part[quarter] = v[quarter];
    part[(quarter + 1) % 4] = next[quarter];
    part[(quarter + 3) % 4] = last[quarter];
    Vec4::from_array(part)
}

/// What rounding leaves of a difference of products, as a part of them.
const ROUNDED: f32 = 4.0 * f32::EPSILON;

/// Bits of all four corners.
const ALL: u32 = 0b1111;

/// The next corner's.
#[inline(always)]
fn turned(v: Vec4) -> Vec4 {
    Vec4::new(v.y, v.z, v.w, v.x)
}

/// The last corner's.
#[inline(always)]
fn turned_back(v: Vec4) -> Vec4 {
    Vec4::new(v.w, v.x, v.y, v.z)
}

/// On which side of the diagonals the origin certainly is: bit 0 for that from corner 0 to 2, bit 1 for that from 1 to 3.
struct Diagonals {
    positive: u32,
    negative: u32,
}

impl Diagonals {
    #[inline(always)]
    fn new(x: Vec4, y: Vec4, off: f32) -> Self {
        let side = |a: usize, b: usize| {
            let (left, right) = (x[a] * y[b], y[a] * x[b]);
            let lengths = (x[b] - x[a]).abs() + (y[b] - y[a]).abs();
            let doubt = off * lengths + ROUNDED * (left.abs() + right.abs());
            let side = left - right;
            (u32::from(side > doubt), u32::from(side < -doubt))
        };
        let ((p0, n0), (p1, n1)) = (side(0, 2), side(1, 3));
        Self {
            positive: p0 | p1 << 1,
            negative: n0 | n1 << 1,
        }
    }
}

/// Whether the origin is outside of all four triangles of corners: of each, before one side and behind another.
#[inline(always)]
fn is_outside(positive: u32, negative: u32, diagonals: &Diagonals) -> bool {
    // 0 1 2: sides 0, 1, and the first diagonal backwards; 0 2 3: the first diagonal, sides 2, 3; and so on.
    let (p, n) = (positive, negative);
    let (dp, dn) = (diagonals.positive, diagonals.negative);
    let parted = |sides: u32, diagonal: u32, forward: bool| {
        let bit = dp >> diagonal & 1;
        let back = dn >> diagonal & 1;
        let (more, less) = if forward { (bit, back) } else { (back, bit) };
        (p & sides) | more != 0 && (n & sides) | less != 0
    };
    parted(0b0011, 0, false)
        && parted(0b1100, 0, true)
        && parted(0b1001, 1, true)
        && parted(0b0110, 1, false)
}

/// The root of the bilinear patch of corners that go around the origin, about.
#[inline(always)]
fn root([ax, bx, dx, cx]: [f32; 4], [ay, by, dy, cy]: [f32; 4]) -> [f32; 2] {
    // a + p e + q f + p q g = 0, by cross products with f + p g.
    let (ex, ey, fx, fy) = (bx - ax, by - ay, cx - ax, cy - ay);
    let (gx, gy) = (dx - cx - ex, dy - cy - ey);
    let q0 = ax * fy - ay * fx;
    let q1 = ax * gy - ay * gx + ex * fy - ey * fx;
    let q2 = ex * gy - ey * gx;
    let discriminant = (q1 * q1 - 4.0 * q0 * q2).max(0.0);
    let q = -0.5 * (q1 + discriminant.sqrt().copysign(q1));
    let outside = |p: f32| (p - 0.5).abs();
    let (near, far) = (q0 / q, q / q2);
    // NaN is no place.
    let p = if outside(far) < outside(near) {
        far
    } else {
        near
    };
    let (hx, hy) = (fx + p * gx, fy + p * gy);
    let (kx, ky) = (ax + p * ex, ay + p * ey);
    let q = if hx.abs() > hy.abs() {
        -kx / hx
    } else {
        -ky / hy
    };
    // Not far beyond, where Newton's method may begin anyhow.
    [p.clamp(-0.5, 1.5), q.clamp(-0.5, 1.5)]
}
