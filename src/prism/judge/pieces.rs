//! Rays that graze: where A, the area of the offset triangle seen along the ray, nearly vanishes.
//!
//! Where A changes by more than [`EVEN`] over a stretch, the stretch is halved until it does not. Where A is below
//! [`EDGE_ON`] of what rounding leaves of it, the ray is in the plane of an offset triangle to about a billionth: there w is
//! constant to as much, the curve is the straight line in which the ray crosses that flat triangle, and its parameter is t.

use glam::{DVec2, DVec3};

use crate::prism::curve::{Curve, EDGE_ON, View};
use crate::prism::ray_frame::RayFrame;
use crate::prism::simd::Quad;
use crate::surface::Patch;

/// The smallest A of a piece, as a part of its largest.
const EVEN: f64 = 1.0 / 16.0;

/// Pieces at most: a stretch is cut in a few dozen where it is cut at all, and must end where numbers are not.
const MOST_PIECES: usize = 4096;

/// Halvings at most: below 2^-40 of a stretch w is constant.
const DEPTH: usize = 40;

/// Bounds of the quadratic c0 + c1 s + c2 s^2 on [0, 1].
#[inline(always)]
fn bounds([c0, c1, c2]: [f64; 3]) -> [f64; 2] {
    let end = c0 + c1 + c2;
    [
        c0.min(end) - 0.25 * c2.max(0.0),
        c0.max(end) + 0.25 * (-c2).max(0.0),
    ]
}

/// Whether A is nearly constant along a whole curve, and more than what rounding leaves of it.
#[inline(always)]
pub fn is_even<Q: Quad>(curve: &Curve<Q>) -> bool {
    let [least, most] = bounds(curve.area());
    least > EVEN * most && curve.is_wide
}

/// Whether A vanishes over the whole range of w.
#[inline(always)]
pub fn is_edge_on<Q: Quad>(view: &View<Q>, [low, high]: [f64; 2]) -> bool {
    let [c0, c1, c2] = view.area();
    let at = |w: f64| c0 + w * (c1 + w * c2);
    let middle = c0 + 0.5 * (low + high) * c1 + low * high * c2;
    let most = at(low).abs().max(at(high).abs()).max(middle.abs());
    most <= EDGE_ON * view.width * view.width
}

/// Whether A vanishes at w.
pub fn is_flat<Q: Quad>(view: &View<Q>, w: f64) -> bool {
    let [c0, c1, c2] = view.area();
    (c0 + w * (c1 + w * c2)).abs() <= EDGE_ON * view.width * view.width
}

/// A piece of a stretch.
pub enum Piece<Q> {
    /// A is nearly constant.
    Even(Curve<Q>),
    /// w is constant.
    Flat(f64),
}

/// The pieces of a stretch, in order.
pub struct Pieces<'a, Q> {
    curve: &'a Curve<Q>,
    /// Ends of pieces to come, the next one last.
    ahead: [f64; DEPTH + 2],
    count: usize,
    from: f64,
    /// What A must exceed.
    least: f64,
    given: usize,
}

impl<'a, Q: Quad + 'a> Pieces<'a, Q> {
    pub fn new(curve: &'a Curve<Q>, view: &View<Q>) -> Self {
        let mut ahead = [0.0; DEPTH + 2];
        ahead[0] = 1.0;
        // The curve's A is in units of A in its middle.
        let [c0, c1, c2] = view.area();
        let middle = curve.w(0.5);
        let unit = (c0 + middle * (c1 + middle * c2)).abs();
        Self {
            curve,
            ahead,
            count: 1,
            from: 0.0,
            least: EDGE_ON * view.width * view.width / unit,
            given: 0,
        }
    }

    pub fn next(&mut self) -> Option<Piece<Q>> {
        while self.count > 0 {
            let (a, b) = (self.from, self.ahead[self.count - 1]);
            let [c0, c1, c2] = self.curve.area();
            let part = [
                c0 + a * (c1 + a * c2),
                (b - a) * (c1 + 2.0 * a * c2),
                (b - a) * (b - a) * c2,
            ];
            let [least, most] = bounds(part);
            let flat = most <= self.least || b - a < 0.5f64.powi(DEPTH as i32);
            let even = least > EVEN * most;
            if !flat && !even && self.given < MOST_PIECES {
                self.ahead[self.count] = 0.5 * (a + b);
                self.count += 1;
                continue;
            }
            self.from = b;
            self.count -= 1;
            self.given += 1;
            return Some(if flat {
                Piece::Flat(self.curve.w(0.5 * (a + b)))
            } else {
                Piece::Even(self.curve.part(a, b))
            });
        }
        None
    }
}

/// Corners of the offset triangle at w, from the ray's origin.
fn corners(patch: &Patch<'_>, origin: DVec3, w: f64) -> [DVec3; 3] {
    std::array::from_fn(|k| patch.vertices[k] + w * patch.normals[k] - origin)
}

/// Origin and direction of the ray in world axes, the direction with 1 along the main axis.
fn in_world(frame: &RayFrame) -> (DVec3, DVec3) {
    let (mut origin, mut direction) = (DVec3::ZERO, DVec3::ZERO);
    let along = [frame.shear[0], frame.shear[1], 1.0];
    for k in 0..3 {
        origin[frame.axes[k]] = frame.origin[k];
        direction[frame.axes[k]] = along[k];
    }
    (origin, direction)
}

/// A ray in the plane of the offset triangle at w: the line in which it crosses that flat triangle.
pub struct Line {
    pub w: f64,
    /// Depths at which it enters and leaves, in the order of t.
    pub ends: [f64; 2],
    /// The sides it passes there.
    pub sides: [u8; 2],
    /// b_k at depth z is start_k + z change_k.
    pub start: [f64; 3],
    pub change: [f64; 3],
    /// Ray parameter per depth.
    pub per_depth: f64,
}

impl Line {
    /// `None` where the ray misses the triangle.
    pub fn new(patch: &Patch<'_>, frame: &RayFrame, w: f64) -> Option<Self> {
        let (origin, direction) = in_world(frame);
        let p = corners(patch, origin, w);
        let normal = (p[1] - p[0]).cross(p[2] - p[0]);
        // Seen along the axis that the triangle faces most.
        let main = normal.abs().max_position();
        let seen = |v: DVec3| DVec2::new(v[(main + 1) % 3], v[(main + 2) % 3]);
        let (q, d) = (p.map(seen), seen(direction));
        let area = (q[1] - q[0]).perp_dot(q[2] - q[0]);
        let (mut start, mut change) = ([0.0; 3], [0.0; 3]);
        let mut near = (f64::NEG_INFINITY, 0);
        let mut far = (f64::INFINITY, 0);
        for k in 0..3 {
            let (i, j) = (q[(k + 1) % 3], q[(k + 2) % 3]);
            start[k] = i.perp_dot(j) / area;
            change[k] = (j - i).perp_dot(d) / area;
            let root = -start[k] / change[k];
            if change[k] > 0.0 {
                near = if root > near.0 { (root, k as u8) } else { near };
            } else if change[k] < 0.0 {
                far = if root < far.0 { (root, k as u8) } else { far };
            } else if start[k] < 0.0 || !start[k].is_finite() {
                return None;
            }
        }
        if !(near.0 < far.0 && near.0.is_finite() && far.0.is_finite()) {
            return None;
        }
        let [from, to] = if frame.per_depth > 0.0 {
            [near, far]
        } else {
            [far, near]
        };
        Some(Self {
            w,
            ends: [from.0, to.0],
            sides: [from.1, to.1],
            start,
            change,
            per_depth: frame.per_depth,
        })
    }

    /// As a curve, straight, with A = 1.
    fn curve<Q: Quad>(&self, patch: &Patch<'_>) -> Curve<Q> {
        let base = patch.texels[0].floor();
        let place = |z: f64| {
            let b = |k: usize| self.start[k] + z * self.change[k];
            let texel = patch.texel(b(1), b(2)) - base;
            [texel.x, texel.y, b(1), b(2)]
        };
        let [from, to] = self.ends;
        let (start, end) = (place(from), place(to));
        let zero = Q::splat(0.0);
        Curve {
            place: [
                Q::from_array(start),
                Q::from_array(std::array::from_fn(|k| end[k] - start[k])),
                zero,
            ],
            depth: [
                Q::from_array([1.0, from, 0.0, 0.0]),
                Q::from_array([0.0, to - from, 0.0, 0.0]),
                zero,
            ],
            w: [self.w, 0.0],
            is_wide: true,
            texel_base: base.to_array(),
            per_depth: self.per_depth,
        }
    }
}

/// The curve of a ray that lies in the plane of the offset triangle at w, in the order of t.
pub fn flat<Q: Quad>(patch: &Patch<'_>, frame: &RayFrame, w: f64) -> Option<Curve<Q>> {
    Line::new(patch, frame, w).map(|line| line.curve(patch))
}

/// Heights w within the range whose plane holds the ray's origin, and so all of a ray that is edge-on: roots of
/// the cubic (v_0 + w n_0 - o) . m(w), m the triangle's area normal at w.
pub fn planes_that_hold(
    patch: &Patch<'_>,
    frame: &RayFrame,
    [low, high]: [f64; 2],
) -> ([f64; 3], usize) {
    let (origin, _) = in_world(frame);
    let volume = |w: f64| {
        let [p, q, r] = corners(patch, origin, w);
        p.dot((q - p).cross(r - p))
    };
    // Sign changes on a grid finer than three roots of a cubic can hide in, then bisection.
    const STEPS: usize = 64;
    let (mut roots, mut count) = ([0.0; 3], 0);
    let at = |k: usize| low + (high - low) * k as f64 / STEPS as f64;
    let mut before = volume(low);
    for k in 1..=STEPS {
        let now = volume(at(k));
        if (before < 0.0) != (now < 0.0) && count < roots.len() {
            let (mut a, mut b) = (at(k - 1), at(k));
            for _ in 0..60 {
                let middle = 0.5 * (a + b);
                if (volume(middle) < 0.0) == (before < 0.0) {
                    a = middle;
                } else {
                    b = middle;
                }
            }
            roots[count] = 0.5 * (a + b);
            count += 1;
        }
        before = now;
    }
    (roots, count)
}
