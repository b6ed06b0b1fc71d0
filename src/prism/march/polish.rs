//! From a bracketed crossing to a hit on S, in f64: S(b) = o + t d.
//!
//! Newton's method in (u, v, t), kept within reach of the bracket; where it leaves (kinks between texel cells,
//! grazing rays), bisection of the height above S along the ray by the exact inverse. Both prisms at a shared
//! edge end on the same point, since S is the same from both.

use glam::DVec3;

use crate::prism::PrismHit;
use crate::ray::Ray;
use crate::surface::{Patch, solve};

/// A point where the ray meets S.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Root {
    /// Ray parameter.
    pub t: f64,
    /// Barycentric coordinate of vertex 1.
    pub u: f64,
    /// Barycentric coordinate of vertex 2.
    pub v: f64,
    /// dS/du x dS/dv.
    pub ng: DVec3,
}

impl Root {
    /// As a backend reports it.
    #[inline]
    pub fn to_hit(self, prim: u32) -> PrismHit {
        let ng = self
            .ng
            .as_vec3()
            .try_normalize()
            .unwrap_or_else(|| self.ng.normalize_or_zero().as_vec3());
        let (u, v) = (self.u.clamp(0.0, 1.0) as f32, self.v.clamp(0.0, 1.0) as f32);
        PrismHit {
            prim,
            t: self.t as f32,
            u,
            v: v.min(1.0 - u),
            ng,
        }
    }

    /// Whether the root is on its base triangle and the ray sees it. Neighbours overlap by a hair rather than
    /// part by one. Where opposed normals cancel, or the surface shrinks to a line, there is no normal, and no surface.
    pub fn is_hit(&self, ray: &Ray) -> bool {
        const OVERLAP: f64 = 1e-6;
        let t = self.t as f32;
        t > ray.tnear
            && t < ray.tfar
            && self.u >= -OVERLAP
            && self.v >= -OVERLAP
            && self.u + self.v <= 1.0 + OVERLAP
            && self.ng.try_normalize().is_some()
    }
}

/// A crossing that was seen between two ray parameters, and a guess at it.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// The two ray parameters, ascending.
    pub t: [f64; 2],
    /// Guess at (u, v, t).
    pub guess: DVec3,
}

/// The root at a crossing, or `None` where S in full precision does not cross.
pub fn polish(patch: &Patch<'_>, ray: &Ray, crossing: &Crossing) -> Option<Root> {
    newton(patch, ray, crossing).or_else(|| bisect(patch, ray, crossing))
}

fn newton(patch: &Patch<'_>, ray: &Ray, crossing: &Crossing) -> Option<Root> {
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let [low, high] = crossing.t;
    let mut at = crossing.guess;
    for _ in 0..8 {
        let point = patch.point(at.x, at.y);
        let miss = origin + at.z * direction - point.position;
        let step = solve([point.du, point.dv, -direction], miss)?;
        at += step;
        if step.x.abs().max(step.y.abs()) < 1e-6
            && step.z.abs() <= 1e-6 * (high - low).max(1e-6 * at.z.abs())
        {
            let within = at.z >= low - (high - low) && at.z <= high + (high - low);
            return within.then_some(Root {
                t: at.z,
                u: at.x,
                v: at.y,
                ng: point.ng,
            });
        }
    }
    None
}

/// Bisects w |N'| - D along the ray.
fn bisect(patch: &Patch<'_>, ray: &Ray, crossing: &Crossing) -> Option<Root> {
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let above = |t: f64| {
        let p = patch.project(origin + t * direction, crossing.guess.x, crossing.guess.y)?;
        Some((
            p.z * patch.normal(p.x, p.y).length() - patch.displacement(p.x, p.y),
            p,
        ))
    };
    let [mut low, mut high] = crossing.t;
    let (at_low, _) = above(low)?;
    let (at_high, _) = above(high)?;
    if (at_low < 0.0) == (at_high < 0.0) {
        return None;
    }
    for _ in 0..64 {
        let middle = 0.5 * (low + high);
        let (at_middle, _) = above(middle)?;
        if (at_middle < 0.0) == (at_low < 0.0) {
            low = middle
        } else {
            high = middle
        }
    }
    let t = 0.5 * (low + high);
    let (_, p) = above(t)?;
    let point = patch.point(p.x, p.y);
    Some(Root {
        t,
        u: p.x,
        v: p.y,
        ng: point.ng,
    })
}
