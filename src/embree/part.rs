//! An object's primitives in two scenes: those whose boxes are as they were when the first was built, and those that edits have made grow
//! since.
//!
//! Embree builds a scene anew as a whole, or refits trees that are slow from the start (of user geometry it puts up to eight primitives
//! into a leaf where it is to refit). So what has grown leaves the large scene, which stays as it is, for a small one.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::HitTest;
use crate::prism::{PrismHit, Prisms};
use crate::ray::{Aabb, Ray};
use crate::surface::{ClosestPoint, PointQuery};

/// The primitives of the large scene: all, but those that have left answer no ray.
pub(super) struct Part {
    prisms: Arc<Prisms>,
    /// In the large scene, by primitive.
    boxes: Vec<Aabb>,
    /// Changed only while no ray is on its way.
    has_left: Vec<AtomicBool>,
}

impl Part {
    pub(super) fn new(prisms: &Arc<Prisms>) -> Arc<Self> {
        let boxes: Vec<Aabb> = (0..prisms.len() as u32).map(|p| prisms.bounds(p)).collect();
        Arc::new(Self {
            prisms: prisms.clone(),
            has_left: boxes.iter().map(|_| AtomicBool::new(false)).collect(),
            boxes,
        })
    }

    /// Bytes beside the prisms.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.boxes[..]) + size_of_val(&self.has_left[..])
    }

    /// What has other bounds than when the large scene was built: it leaves it, and what has the same again comes back.
    pub(super) fn grown(&self) -> Grown {
        let mut primitives = Vec::new();
        for ((primitive, known), has_left) in (0u32..).zip(&self.boxes).zip(&self.has_left) {
            let differs = self.prisms.bounds(primitive) != *known;
            has_left.store(differs, Ordering::Relaxed);
            if differs {
                primitives.push(primitive);
            }
        }
        Grown {
            prisms: self.prisms.clone(),
            primitives,
        }
    }

    fn has(&self, primitive: u32) -> bool {
        !self.has_left[primitive as usize].load(Ordering::Relaxed)
    }
}

impl HitTest for Part {
    fn len(&self) -> usize {
        self.boxes.len()
    }

    fn bounds(&self, primitive: u32) -> Aabb {
        self.boxes[primitive as usize]
    }

    fn intersect(&self, primitive: u32, ray: &Ray) -> Option<PrismHit> {
        if self.has(primitive) {
            self.prisms.intersect(primitive, ray)
        } else {
            None
        }
    }

    fn occluded(&self, primitive: u32, ray: &Ray) -> bool {
        self.has(primitive) && self.prisms.occluded(primitive, ray)
    }

    fn closest(&self, primitive: u32, query: &PointQuery) -> Option<ClosestPoint> {
        if self.has(primitive) {
            self.prisms.closest(primitive, query)
        } else {
            None
        }
    }
}

/// The primitives of the small scene.
pub(super) struct Grown {
    prisms: Arc<Prisms>,
    primitives: Vec<u32>,
}

impl HitTest for Grown {
    fn len(&self) -> usize {
        self.primitives.len()
    }

    fn bounds(&self, index: u32) -> Aabb {
        self.prisms.bounds(self.primitives[index as usize])
    }

    fn intersect(&self, index: u32, ray: &Ray) -> Option<PrismHit> {
        self.prisms.intersect(self.primitives[index as usize], ray)
    }

    fn occluded(&self, index: u32, ray: &Ray) -> bool {
        self.prisms.occluded(self.primitives[index as usize], ray)
    }

    fn closest(&self, index: u32, query: &PointQuery) -> Option<ClosestPoint> {
        self.prisms.closest(self.primitives[index as usize], query)
    }
}

/// Stands in the small scene for what cannot be edited, so that ids are those of the large one.
pub(super) struct Nothing;

impl HitTest for Nothing {
    fn len(&self) -> usize {
        0
    }

    fn bounds(&self, _: u32) -> Aabb {
        Aabb::EMPTY
    }

    fn intersect(&self, _: u32, _: &Ray) -> Option<PrismHit> {
        None
    }
}
