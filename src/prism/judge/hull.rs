//! Bounds of a part of a curve: a ratio of polynomials is within the ratios of their Bernstein coefficients, where those of A have one
//! sign.

use glam::DVec2;

use crate::prism::curve::Curve;
use crate::prism::simd::Quad;
use crate::surface::Patch;

/// The control points of a part of a curve.
pub struct Hull<Q> {
    /// (X, Y, B1, B2) over A.
    places: [Q; 3],
    /// (1, Z, Zn, 0) times A.
    depths: [Q; 3],
    /// At both ends.
    w: [f64; 2],
    per_depth: f64,
}

impl<Q: Quad> Hull<Q> {
    /// Of the part between two s; `None` where A is not bounded away from 0.
    #[inline(always)]
    pub fn new(curve: &Curve<Q>, [a, b]: [f64; 2]) -> Option<Self> {
        let (at, middle, both) = (
            [Q::splat(a), Q::splat(b)],
            Q::splat(0.5 * (a + b)),
            Q::splat(a * b),
        );
        let depths = bernstein(&curve.depth, at, middle, both);
        let places = bernstein(&curve.place, at, middle, both);
        let areas = [
            depths[0].broadcast::<0>(),
            depths[1].broadcast::<0>(),
            depths[2].broadcast::<0>(),
        ];
        // A is 1 in the middle of the curve.
        let least = areas[0].min(areas[1].min(areas[2])).to_array()[0];
        if least > 0.0 {
            Some(Self {
                places: [
                    places[0] / areas[0],
                    places[1] / areas[1],
                    places[2] / areas[2],
                ],
                depths,
                w: [curve.w(a), curve.w(b)],
                per_depth: curve.per_depth,
            })
        } else {
            None
        }
    }

    /// The least and the most texel coordinates, from the curve's texel base.
    #[inline(always)]
    pub fn texels(&self) -> [DVec2; 2] {
        let [p, q, r] = self.places;
        let ([x0, y0, ..], [x1, y1, ..]) = (p.min(q).min(r).to_array(), p.max(q).max(r).to_array());
        [DVec2::new(x0, y0), DVec2::new(x1, y1)]
    }

    /// The least and the most ray parameter.
    #[inline(always)]
    pub fn times(&self) -> [f64; 2] {
        let [[a0, z0, n0, _], [a1, z1, n1, _], [a2, z2, n2, _]] = [
            self.depths[0].to_array(),
            self.depths[1].to_array(),
            self.depths[2].to_array(),
        ];
        let [w0, w1] = self.w;
        // Of the cubics Z + w Zn, three times in the middle, and A.
        let along = [
            (z0, w0 * n0),
            (z0 + 2.0 * z1, 2.0 * w0 * n1 + w1 * n0),
            (2.0 * z1 + z2, w0 * n2 + 2.0 * w1 * n1),
            (z2, w1 * n2),
        ];
        let areas = [a0, a0 + 2.0 * a1, 2.0 * a1 + a2, a2];
        let (mut low, mut high, mut size) = (f64::INFINITY, f64::NEG_INFINITY, 0.0f64);
        for k in 0..4 {
            let ((z, n), per_area) = (along[k], self.per_depth / areas[k]);
            let t = (z + n) * per_area;
            (low, high) = (low.min(t), high.max(t));
            size = size.max((z.abs() + n.abs()) * per_area.abs());
        }
        // Thousands of roundings.
        let slack = 1e-12 * size;
        [low - slack, high + slack]
    }

    /// Whether the part is so nearly straight, and N' so nearly constant, that g is as good as a parabola along it, if it is within one
    /// cell: of one turning point at most.
    #[inline(always)]
    pub fn is_straight(&self, patch: &Patch<'_>) -> bool {
        /// Of the middle control point from between the two others: texels, and parts of N'.
        const BEND: f64 = 1.0 / 64.0;
        /// From one end to the other: parts of N' and of A.
        const CHANGE: f64 = 0.25;
        let [p, q, r] = self.places;
        let half = Q::splat(0.5);
        let [x, y, u, v] = (q - half * (p + r)).to_array();
        let [_, _, du, dv] = (r - p).to_array();
        let [.., u1, v1] = q.to_array();
        let (n1, n2) = (
            patch.normals[1] - patch.normals[0],
            patch.normals[2] - patch.normals[0],
        );
        let squared = (patch.normals[0] + u1 * n1 + v1 * n2).length_squared();
        let bend = (u * n1 + v * n2).length_squared();
        let turn = (du * n1 + dv * n2).length_squared();
        let [a, b, c] = [
            self.depths[0].to_array()[0],
            self.depths[1].to_array()[0],
            self.depths[2].to_array()[0],
        ];
        x.abs().max(y.abs()) <= BEND
            && bend <= BEND * BEND * squared
            && turn <= CHANGE * CHANGE * squared
            && (c - a).abs() <= CHANGE * b
    }

    /// Whether all of the part is surely above the surface, or all below, for the heights that it has in the part's texels.
    #[inline(always)]
    pub fn is_clear_of(&self, patch: &Patch<'_>, (low, high): (f32, f32)) -> bool {
        let (n1, n2) = (
            patch.normals[1] - patch.normals[0],
            patch.normals[2] - patch.normals[0],
        );
        let [p, q, r] = [
            self.places[0].to_array(),
            self.places[1].to_array(),
            self.places[2].to_array(),
        ];
        let normals = [p, q, r].map(|[_, _, u, v]| patch.normals[0] + u * n1 + v * n2);
        // N' is in the hull of these: not longer than the longest, and along the middle one not shorter than the least is.
        let [a, b, c] = normals.map(|n| n.length_squared());
        let longest = a.max(b).max(c).sqrt();
        let [a, b, c] = normals.map(|n| n.dot(normals[1]));
        let shortest = a.min(c).min(b).max(0.0) / b.sqrt();
        let (least, most) = (self.w[0].min(self.w[1]), self.w[0].max(self.w[1]));
        let bottom = least * if least < 0.0 { longest } else { shortest };
        let top = most * if most < 0.0 { shortest } else { longest };
        let [lowest, highest] = patch.displacements((low, high));
        // Heights of blocks are rounded to single precision.
        let units = f64::from(low.abs().max(high.abs())) + patch.midlevel.abs();
        let slack = 1e-6 * (bottom.abs().max(top.abs()) + patch.scale.abs() * units);
        bottom > highest + slack || top < lowest - slack
    }
}

/// The coefficients of a quadratic between a and b, given (a + b) / 2 and a b.
#[inline(always)]
fn bernstein<Q: Quad>([c0, c1, c2]: &[Q; 3], [a, b]: [Q; 2], middle: Q, both: Q) -> [Q; 3] {
    [
        (*c2 * a + *c1) * a + *c0,
        *c2 * both + (*c1 * middle + *c0),
        (*c2 * b + *c1) * b + *c0,
    ]
}
