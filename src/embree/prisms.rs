//! Prisms as Embree's user geometry.

use super::HitTest;
use crate::prism::{MovingPrisms, PrismHit, Prisms};
use crate::ray::{Aabb, Ray, RayPacket};
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

    fn intersect8(
        &self,
        prim: u32,
        rays: &RayPacket,
        valid: u8,
    ) -> [Option<PrismHit>; RayPacket::LANES] {
        self.intersect8(prim, rays, valid)
    }

    fn occluded8(&self, prim: u32, rays: &RayPacket, valid: u8) -> u8 {
        self.occluded8(prim, rays, valid)
    }

    fn closest(&self, prim: u32, query: &PointQuery) -> Option<ClosestPoint> {
        self.closest(prim, query)
    }
}

impl HitTest for MovingPrisms {
    fn len(&self) -> usize {
        self.len()
    }

    fn bounds(&self, prim: u32) -> Aabb {
        self.bounds(prim, 0)
    }

    fn time_steps(&self) -> usize {
        self.time_steps()
    }

    fn bounds_at(&self, prim: u32, step: usize) -> Aabb {
        self.bounds(prim, step)
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
