//! What geometries trace: prisms that are replaced when vertices move.

use std::cell::UnsafeCell;
use std::sync::Arc;
#[cfg(debug_assertions)]
use std::sync::atomic::{AtomicUsize, Ordering};

use super::base::Base;
use crate::embree::HitTest;
use crate::prism::{MovingPrisms, PrismHit, Prisms};
use crate::ray::{Aabb, Ray};
use crate::surface::{ClosestPoint, DisplacedSurface, PointQuery, TexelRect};

/// The prisms of a surface as it is.
pub enum Traced {
    Standing(Prisms),
    Moving(MovingPrisms),
}

impl Traced {
    /// The prisms, at time 0.
    pub fn prisms(&self) -> &Prisms {
        match self {
            Self::Standing(prisms) => prisms,
            Self::Moving(moving) => moving.at_start(),
        }
    }

    pub fn surface(&self) -> &Arc<DisplacedSurface> {
        self.prisms().surface()
    }

    fn map_edited(&self, rect: TexelRect) -> bool {
        match self {
            Self::Standing(prisms) => prisms.map_edited(rect).any(),
            Self::Moving(moving) => moving.map_edited(rect).any(),
        }
    }
}

/// Shared by a surface and its geometries.
pub struct Live {
    pub base: Base,
    now: UnsafeCell<Traced>,
    /// Calls of Embree's that are in the hit test.
    #[cfg(debug_assertions)]
    in_flight: AtomicUsize,
}

// SAFETY: `now` is written by `replace` alone, whose caller promises that nothing else runs.
unsafe impl Sync for Live {}

/// A call of Embree's.
pub struct Flight<'a>(#[cfg_attr(not(debug_assertions), allow(dead_code))] &'a Live);

impl<'a> Flight<'a> {
    #[inline(always)]
    pub fn new(live: &'a Live) -> Self {
        #[cfg(debug_assertions)]
        live.in_flight.fetch_add(1, Ordering::AcqRel);
        Self(live)
    }
}

#[cfg(debug_assertions)]
impl Drop for Flight<'_> {
    fn drop(&mut self) {
        self.0.in_flight.fetch_sub(1, Ordering::AcqRel);
    }
}

impl Live {
    pub fn new(base: Base, traced: Traced) -> Self {
        Self {
            base,
            now: UnsafeCell::new(traced),
            #[cfg(debug_assertions)]
            in_flight: AtomicUsize::new(0),
        }
    }

    #[inline(always)]
    pub fn now(&self) -> &Traced {
        // SAFETY: not replaced while it is looked at: see `replace`.
        unsafe { &*self.now.get() }
    }

    /// Whether a ray is in flight, as far as this build can tell.
    pub fn is_traced(&self) -> bool {
        #[cfg(debug_assertions)]
        return self.in_flight.load(Ordering::Acquire) != 0;
        #[cfg(not(debug_assertions))]
        false
    }

    /// Other prisms, as many as before.
    ///
    /// # Safety
    ///
    /// Nothing else looks at the surface: no ray, no commit, no other call.
    pub unsafe fn replace(&self, traced: Traced) {
        debug_assert_eq!(traced.prisms().len(), self.now().prisms().len());
        // SAFETY: the caller's promise.
        unsafe { *self.now.get() = traced }
    }

    /// After an edit of the map; whether bounds have grown.
    pub fn map_edited(&self, rect: TexelRect) -> bool {
        self.now().map_edited(rect)
    }

    #[inline(always)]
    fn to_caller(&self, mut hit: PrismHit) -> PrismHit {
        (hit.prim, hit.u, hit.v) = self.base.to_caller(hit.prim, hit.u, hit.v);
        hit
    }
}

impl HitTest for Live {
    fn len(&self) -> usize {
        self.now().prisms().len()
    }

    fn bounds(&self, prim: u32) -> Aabb {
        self.bounds_at(prim, 0)
    }

    fn time_steps(&self) -> usize {
        match self.now() {
            Traced::Standing(_) => 1,
            Traced::Moving(moving) => moving.time_steps(),
        }
    }

    fn bounds_at(&self, prim: u32, step: usize) -> Aabb {
        match self.now() {
            Traced::Standing(prisms) => prisms.bounds(prim),
            Traced::Moving(moving) => moving.bounds(prim, step),
        }
    }

    fn intersect(&self, prim: u32, ray: &Ray) -> Option<PrismHit> {
        let _flight = Flight::new(self);
        let hit = match self.now() {
            Traced::Standing(prisms) => prisms.intersect(prim, ray),
            Traced::Moving(moving) => moving.intersect(prim, ray),
        };
        hit.map(|hit| self.to_caller(hit))
    }

    fn occluded(&self, prim: u32, ray: &Ray) -> bool {
        let _flight = Flight::new(self);
        match self.now() {
            Traced::Standing(prisms) => prisms.occluded(prim, ray),
            Traced::Moving(moving) => moving.occluded(prim, ray),
        }
    }

    fn closest(&self, prim: u32, query: &PointQuery) -> Option<ClosestPoint> {
        let _flight = Flight::new(self);
        let mut found = match self.now() {
            Traced::Standing(prisms) => prisms.closest(prim, query),
            Traced::Moving(moving) => moving.closest(prim, query),
        }?;
        (found.prim, found.u, found.v) = self.base.to_caller(found.prim, found.u, found.v);
        Some(found)
    }
}
