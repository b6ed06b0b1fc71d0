//! Prisms as Embree's user geometry.

use super::HitTest;
use crate::prism::{PrismHit, Prisms};
use crate::ray::{Aabb, Ray};
use crate::surface::{ClosestPoint, PointQuery};

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

    fn closest(&self, prim: u32, query: &PointQuery) -> Option<ClosestPoint> {
        self.closest(prim, query)
    }
}
