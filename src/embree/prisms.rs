//! Prisms as Embree's user geometry.

use super::HitTest;
use crate::prism::{PrismHit, Prisms};
use crate::ray::{Aabb, Ray};

impl HitTest for Prisms {
    fn len(&self) -> usize {
        self.len()
    }

    fn bounds(&self, prim: u32) -> Aabb {
        self.bounds(prim)
    }

    fn intersect(&self, prim: u32, ray: &Ray) -> Option<PrismHit> {
        self.intersect(prim, ray)
    }

    fn occluded(&self, prim: u32, ray: &Ray) -> bool {
        self.occluded(prim, ray)
    }
}
