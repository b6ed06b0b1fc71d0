//! The route for bent prisms: some n_i . Ng small or negative, or displacement beyond the radius of curvature.
//!
//! There the parallel offset prism does not exist or folds over itself. The other parametrisation always holds:
//! for each w the triangle v_i + w n_i is flat, the ray meets its plane at most once, and the areas
//! Q_i(w) = d . (p_i+1 x p_i+2), p_i = v_i + w n_i - o, are quadratic in w (Ogaki, "Nonlinear Ray Tracing for
//! Displacement and Shell Mapping", SIGGRAPH Asia 2023, walks the same curve). Every hit has one w, so marching
//! w through the displacement's range misses none; t is not monotone in w, so the nearest is kept. f64, adaptive
//! steps: correct first.

use glam::DVec3;

use super::Step;
use super::polish::{Crossing, Root, polish};
use crate::ray::Ray;
use crate::surface::Patch;

/// Pieces a stretch of w is cut into before adaptive halving, and how often a piece is halved at most.
const PIECES: usize = 16;
const MOST_HALVINGS: u32 = 12;

/// The nearest hit over one base triangle, for w within `offsets`.
pub fn intersect(patch: &Patch<'_>, ray: &Ray, offsets: [f32; 2], step: Step) -> Option<Root> {
    let curve = Curve::new(patch, ray, step);
    let [low, high] = offsets.map(f64::from);
    let mut nearest = None;
    for [from, to] in curve.inside(low, high) {
        let mut before = curve.sample(from);
        for piece in 1..=PIECES {
            let sample = curve.sample(from + (to - from) * piece as f64 / PIECES as f64);
            curve.search(before, sample, MOST_HALVINGS, &mut nearest);
            before = sample;
        }
    }
    nearest
}

/// A ray's curve through the family of offset triangles.
struct Curve<'a> {
    patch: &'a Patch<'a>,
    ray: &'a Ray,
    step: Step,
    origin: DVec3,
    direction: DVec3,
}

/// A point of the curve.
#[derive(Clone, Copy)]
struct Sample {
    w: f64,
    u: f64,
    v: f64,
    t: f64,
    above: f64,
}

impl<'a> Curve<'a> {
    fn new(patch: &'a Patch<'a>, ray: &'a Ray, step: Step) -> Self {
        Self {
            patch,
            ray,
            step,
            origin: ray.origin.as_dvec3(),
            direction: ray.direction.as_dvec3(),
        }
    }

    /// (Q0, Q1, Q2) at w.
    fn areas(&self, w: f64) -> DVec3 {
        let [p0, p1, p2] = self.corners(w);
        let d = self.direction;
        DVec3::new(
            d.dot(p1.cross(p2)),
            d.dot(p2.cross(p0)),
            d.dot(p0.cross(p1)),
        )
    }

    fn corners(&self, w: f64) -> [DVec3; 3] {
        std::array::from_fn(|i| self.patch.vertices[i] + w * self.patch.normals[i] - self.origin)
    }

    fn sample(&self, w: f64) -> Sample {
        let areas = self.areas(w);
        let b = areas / areas.element_sum();
        let [p0, p1, p2] = self.corners(w);
        let t =
            (b.x * p0 + b.y * p1 + b.z * p2).dot(self.direction) / self.direction.length_squared();
        let (u, v) = (b.y, b.z);
        let above = w * self.patch.normal(u, v).length() - self.patch.displacement(u, v);
        Sample { w, u, v, t, above }
    }

    /// Stretches of w on which the areas have one sign, a hair wider.
    fn inside(&self, low: f64, high: f64) -> Vec<[f64; 2]> {
        let (a, b, c) = (
            self.areas(low),
            self.areas(0.5 * (low + high)),
            self.areas(high),
        );
        let (c0, c2) = (a, 2.0 * (a + c) - 4.0 * b);
        let c1 = c - a - c2;
        let mut cuts = vec![0.0, 1.0];
        for i in 0..3 {
            cuts.extend(
                roots(c0[i], c1[i], c2[i])
                    .into_iter()
                    .flatten()
                    .filter(|s| *s > 0.0 && *s < 1.0),
            );
        }
        cuts.sort_by(f64::total_cmp);
        let w = |s: f64| low + s * (high - low);
        cuts.windows(2)
            .filter(|pair| {
                let q = self.areas(w(0.5 * (pair[0] + pair[1])));
                pair[1] > pair[0] && (q.cmpge(DVec3::ZERO).all() || q.cmple(DVec3::ZERO).all())
            })
            .map(|pair| {
                let hair = 1e-9 * (pair[1] - pair[0]);
                [w(pair[0] - hair), w(pair[1] + hair)]
            })
            .collect()
    }

    /// Halves until a piece is no longer than a step, then looks for a sign change.
    fn search(&self, a: Sample, b: Sample, halvings: u32, nearest: &mut Option<Root>) {
        let beyond = |s: &Sample| s.t <= f64::from(self.ray.tnear);
        if (beyond(&a) && beyond(&b)) || nearest.is_some_and(|n: Root| a.t > n.t && b.t > n.t) {
            return;
        }
        if halvings > 0 && self.is_long(&a, &b) {
            let middle = self.sample(0.5 * (a.w + b.w));
            self.search(a, middle, halvings - 1, nearest);
            self.search(middle, b, halvings - 1, nearest);
        } else if (a.above < 0.0) != (b.above < 0.0)
            && let Some(root) = self.root(a, b)
            && root.is_hit(self.ray)
            && nearest.is_none_or(|n| root.t < n.t)
        {
            *nearest = Some(root);
        }
    }

    fn is_long(&self, a: &Sample, b: &Sample) -> bool {
        match self.step {
            Step::Texels(step) => {
                let legs = self.patch.texel(a.u, a.v) - self.patch.texel(b.u, b.v);
                legs.length() > f64::from(step)
            }
            Step::World(step) => (a.t - b.t).abs() * self.direction.length() > f64::from(step),
        }
    }

    fn root(&self, mut a: Sample, mut b: Sample) -> Option<Root> {
        for _ in 0..40 {
            let middle = self.sample(0.5 * (a.w + b.w));
            if (middle.above < 0.0) == (a.above < 0.0) {
                a = middle
            } else {
                b = middle
            }
        }
        let crossing = Crossing {
            t: [a.t.min(b.t), a.t.max(b.t)],
            guess: DVec3::new(b.u, b.v, b.t),
        };
        polish(self.patch, self.ray, &crossing).or_else(|| {
            let point = self.patch.point(b.u, b.v);
            Some(Root {
                t: b.t,
                u: b.u,
                v: b.v,
                ng: point.ng,
            })
        })
    }
}

/// Real roots of c0 + c1 s + c2 s^2.
fn roots(c0: f64, c1: f64, c2: f64) -> Option<[f64; 2]> {
    let discriminant = c1 * c1 - 4.0 * c0 * c2;
    let q = -0.5 * (c1 + discriminant.max(0.0).sqrt().copysign(c1));
    (discriminant >= 0.0).then(|| [q / c2, c0 / q])
}
