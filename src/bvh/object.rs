//! One object's tree, and the search for its closest primitive.

use std::ops::ControlFlow;

use super::BvhError;
use super::tree::Tree;
use super::triangle::ShearedRay;
use crate::prism::{PrismHit, Prisms};
use crate::ray::{Aabb, Ray};
use crate::surface::BaseMesh;
use crate::trace::{Shape, WorldError};

/// Rounding of a triangle test is within this many ulps of the box.
const TRIANGLE_PAD_ULPS: f32 = 4.0;

/// Numbered things a ray can hit.
trait Primitives {
    /// What is computed once per ray.
    type Prepared;

    fn prepare(&self, ray: &Ray) -> Self::Prepared;

    /// The first hit with t in the open interval of `ray`. `prepared` may be from the same ray with
    /// another interval.
    fn intersect(&self, prim: u32, prepared: &Self::Prepared, ray: &Ray) -> Option<PrismHit>;

    fn occluded(&self, prim: u32, prepared: &Self::Prepared, ray: &Ray) -> bool;
}

impl Primitives for Prisms {
    type Prepared = ();

    fn prepare(&self, _: &Ray) {}

    #[inline]
    fn intersect(&self, prim: u32, (): &(), ray: &Ray) -> Option<PrismHit> {
        Prisms::intersect(self, prim, ray)
    }

    #[inline]
    fn occluded(&self, prim: u32, (): &(), ray: &Ray) -> bool {
        Prisms::occluded(self, prim, ray)
    }
}

impl Primitives for BaseMesh {
    type Prepared = ShearedRay;

    fn prepare(&self, ray: &Ray) -> ShearedRay {
        ShearedRay::new(ray)
    }

    #[inline]
    fn intersect(&self, prim: u32, sheared: &ShearedRay, ray: &Ray) -> Option<PrismHit> {
        sheared.intersect(prim, self.corners(prim), ray)
    }

    #[inline]
    fn occluded(&self, prim: u32, sheared: &ShearedRay, ray: &Ray) -> bool {
        self.intersect(prim, sheared, ray).is_some()
    }
}

/// The closest hit so far over all objects.
///
/// Of hits at the same t, the one with the lower (top-level id, primitive) is closer, so that the
/// answer does not depend on the shape of a tree.
#[derive(Clone, Copy)]
pub(super) struct Closest {
    pub(super) hit: PrismHit,
    pub(super) top: u32,
}

impl Closest {
    fn beats(&self, other: &Self) -> bool {
        let ids = |c: &Self| (c.top, c.hit.prim);
        self.hit.t < other.hit.t || (self.hit.t == other.hit.t && ids(self) < ids(other))
    }

    /// The end of the open interval in which a hit may still be closer: just beyond t, for ties.
    pub(super) fn tfar(&self) -> f32 {
        self.hit.t.next_up()
    }
}

/// A shape under its tree.
pub(super) struct ObjectTree {
    shape: Shape,
    tree: Tree,
}

impl ObjectTree {
    /// Builds the tree; `object` is for messages.
    pub(super) fn build(shape: &Shape, object: usize) -> Result<Self, BvhError> {
        // A prism costs far more than a box; a triangle does not.
        let leaf_size = match shape {
            Shape::Displaced(_) => 1,
            Shape::Triangles(_) => 3,
        };
        Ok(Self {
            shape: shape.clone(),
            tree: Tree::build(&boxes(shape, object)?, leaf_size)?,
        })
    }

    /// Takes another state of the same shape; `boxes` are those of its primitives.
    pub(super) fn refit(&mut self, shape: &Shape, boxes: &[Aabb]) {
        self.shape = shape.clone();
        self.tree.refit(boxes);
    }

    /// Whether `shape` has the same kind and number of primitives.
    pub(super) fn fits(&self, shape: &Shape) -> bool {
        std::mem::discriminant(&self.shape) == std::mem::discriminant(shape)
            && len(&self.shape) == len(shape)
    }

    /// The box over the object, in its own space.
    pub(super) fn bounds(&self) -> Aabb {
        self.tree.bounds()
    }

    /// Bytes of the tree.
    pub(super) fn bytes(&self) -> usize {
        self.tree.bytes()
    }

    /// Improves `best` by the closest hit of `ray`, which is in the object's space.
    pub(super) fn intersect(&self, ray: &Ray, top: u32, best: &mut Option<Closest>) {
        match &self.shape {
            Shape::Displaced(prisms) => closest(&self.tree, &**prisms, ray, top, best),
            Shape::Triangles(mesh) => closest(&self.tree, &**mesh, ray, top, best),
        }
    }

    /// Whether `ray`, which is in the object's space, hits anything.
    pub(super) fn occluded(&self, ray: &Ray) -> bool {
        match &self.shape {
            Shape::Displaced(prisms) => any(&self.tree, &**prisms, ray),
            Shape::Triangles(mesh) => any(&self.tree, &**mesh, ray),
        }
    }
}

fn closest<P: Primitives>(
    tree: &Tree,
    primitives: &P,
    ray: &Ray,
    top: u32,
    best: &mut Option<Closest>,
) {
    let prepared = primitives.prepare(ray);
    let mut ray = *ray;
    if let Some(best) = best {
        ray.tfar = best.tfar();
    }
    let start = ray;
    tree.traverse(&start, |prim| {
        if let Some(hit) = primitives.intersect(prim, &prepared, &ray) {
            let found = Closest { hit, top };
            if best.is_none_or(|best| found.beats(&best)) {
                ray.tfar = found.tfar();
                *best = Some(found);
            }
        }
        ControlFlow::Continue(ray.tfar)
    });
}

fn any<P: Primitives>(tree: &Tree, primitives: &P, ray: &Ray) -> bool {
    let prepared = primitives.prepare(ray);
    tree.traverse(ray, |prim| {
        if primitives.occluded(prim, &prepared, ray) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(ray.tfar)
        }
    })
}

fn len(shape: &Shape) -> usize {
    match shape {
        Shape::Displaced(prisms) => prisms.len(),
        Shape::Triangles(mesh) => mesh.triangles().len(),
    }
}

/// The boxes of a shape's primitives, if all are [traceable](Aabb::is_traceable).
pub(super) fn boxes(shape: &Shape, object: usize) -> Result<Vec<Aabb>, BvhError> {
    (0..len(shape) as u32)
        .map(|prim| {
            let bounds = match shape {
                Shape::Displaced(prisms) => prisms.bounds(prim),
                Shape::Triangles(mesh) => mesh
                    .corners(prim)
                    .into_iter()
                    .fold(Aabb::EMPTY, Aabb::including)
                    .padded(TRIANGLE_PAD_ULPS),
            };
            if bounds.is_traceable() {
                Ok(bounds)
            } else {
                Err(WorldError::Bounds {
                    object,
                    prim,
                    bounds,
                }
                .into())
            }
        })
        .collect()
}
