//! What geometries trace: prisms that are replaced when vertices move.
//!
//! Whoever looks at a surface [enters](Live::enter) it: hit tests, bounds, interpolation. An update watches from its beginning who enters, and
//! takes effect while nobody is in, or not at all; those who come at that moment wait for it. So an update never changes what a ray
//! looks at, and one beside which a ray was in a hit test is refused.

use std::cell::UnsafeCell;
use std::mem::ManuallyDrop;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicUsize, Ordering, fence};

use super::base::Base;
use super::error::Failure;
use super::pins::{self, Pin, Word};
use crate::embree::HitTest;
use crate::prism::{MovingPrisms, PrismHit, Prisms};
use crate::ray::{Aabb, MAX_COORDINATE, Ray, RayPacket, lanes_of};
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

    /// After an edit of the map; whether bounds have grown.
    pub fn map_edited(&self, rect: TexelRect) -> bool {
        match self {
            Self::Standing(prisms) => prisms.map_edited(rect).any(),
            Self::Moving(moving) => moving.map_edited(rect).any(),
        }
    }

    fn time_steps(&self) -> usize {
        match self {
            Self::Standing(_) => 1,
            Self::Moving(moving) => moving.time_steps(),
        }
    }

    fn bounds(&self, prim: u32, step: usize) -> Aabb {
        match self {
            Self::Standing(prisms) => prisms.bounds(prim),
            Self::Moving(moving) => moving.bounds(prim, step),
        }
    }

    /// How far it reaches from the origin, along any axis, as Embree is told; infinite where that cannot be said.
    pub fn reach(&self) -> f32 {
        let prims = 0..self.prisms().len() as u32;
        let boxes =
            prims.flat_map(|prim| (0..self.time_steps()).map(move |step| self.bounds(prim, step)));
        let reach = |bounds: Aabb| match bounds.is_traceable() {
            true => bounds.reach(),
            false => f32::INFINITY,
        };
        boxes.map(reach).fold(0.0, f32::max)
    }
}

/// Anyone may enter.
const OPEN: u8 = 0;
/// Anyone may enter, and an update is told.
const WATCHED: u8 = 1;
/// An update takes effect: wait.
const SHUT: u8 = 2;

/// Shared by a surface and its geometries.
pub struct Live {
    pub base: Base,
    /// Written by [`Shut::replace`] alone.
    now: UnsafeCell<Traced>,
    gate: AtomicU8,
    /// Whether anyone has entered while it was watched.
    was_entered: AtomicBool,
    /// Those within who could not pin it.
    unpinned: AtomicUsize,
}

// SAFETY: `now` is written while nobody is within, and read within.
unsafe impl Sync for Live {}

/// A look at a surface.
pub struct Within<'a> {
    live: &'a Live,
    pin: Option<Pin>,
}

impl Within<'_> {
    #[inline(always)]
    pub fn now(&self) -> &Traced {
        // SAFETY: nobody writes it while somebody is within.
        unsafe { &*self.live.now.get() }
    }
}

impl Drop for Within<'_> {
    #[inline(always)]
    fn drop(&mut self) {
        if self.pin.is_none() {
            self.live.unpinned.fetch_sub(1, Ordering::Release);
        }
    }
}

impl Live {
    pub fn new(base: Base, traced: Traced) -> Self {
        Self {
            base,
            now: UnsafeCell::new(traced),
            gate: AtomicU8::new(OPEN),
            was_entered: AtomicBool::new(false),
            unpinned: AtomicUsize::new(0),
        }
    }

    fn key(&self) -> usize {
        std::ptr::from_ref(self).addr()
    }

    #[inline(always)]
    pub fn enter(&self) -> Within<'_> {
        let pin = Pin::new(Word::Surface, self.key());
        if pin.is_some() && self.gate.load(Ordering::Acquire) == OPEN {
            return Within { live: self, pin };
        }
        drop(pin);
        self.enter_through_gate()
    }

    #[cold]
    fn enter_through_gate(&self) -> Within<'_> {
        loop {
            let pin = Pin::new(Word::Surface, self.key());
            if pin.is_none() {
                self.unpinned.fetch_add(1, Ordering::SeqCst);
                fence(Ordering::SeqCst);
            }
            let within = Within { live: self, pin };
            match self.gate.load(Ordering::Acquire) {
                OPEN => return within,
                WATCHED => {
                    // Seen by whoever sees the end of the pin.
                    self.was_entered.store(true, Ordering::Relaxed);
                    return within;
                }
                _ => drop(within),
            }
            std::thread::yield_now();
        }
    }

    fn is_entered(&self) -> bool {
        pins::is_pinned(Word::Surface, self.key()) || self.unpinned.load(Ordering::Acquire) != 0
    }

    /// Begins an update, unless somebody is within, or another update.
    pub fn watch(&self) -> Result<Watched<'_>, Failure> {
        let gate = &self.gate;
        // Shut for a moment: who sees it watched comes after what is written here.
        if gate
            .compare_exchange(OPEN, SHUT, Ordering::SeqCst, Ordering::Relaxed)
            .is_err()
        {
            return Err(Failure::in_flight());
        }
        // Opens the gate again where it fails.
        let watched = Watched(self);
        if self.is_entered() {
            return Err(Failure::in_flight());
        }
        self.was_entered.store(false, Ordering::Relaxed);
        gate.store(WATCHED, Ordering::Release);
        Ok(watched)
    }

    #[inline(always)]
    fn to_caller(&self, mut hit: PrismHit) -> PrismHit {
        (hit.prim, hit.u, hit.v) = self.base.to_caller(hit.prim, hit.u, hit.v);
        hit
    }
}

/// An update that is being made.
pub struct Watched<'a>(&'a Live);

impl Drop for Watched<'_> {
    fn drop(&mut self) {
        self.0.gate.store(OPEN, Ordering::Release);
    }
}

impl<'a> Watched<'a> {
    /// Keeps all others out, unless somebody has entered since the update began.
    pub fn shut(self) -> Result<Shut<'a>, Failure> {
        let live = self.0;
        live.gate.store(SHUT, Ordering::SeqCst);
        if live.is_entered() || live.was_entered.load(Ordering::Relaxed) {
            return Err(Failure::in_flight());
        }
        Ok(Shut(self))
    }
}

/// An update that takes effect.
pub struct Shut<'a>(Watched<'a>);

impl Shut<'_> {
    pub fn now(&self) -> &Traced {
        // SAFETY: written by `replace` alone, which takes this by value.
        unsafe { &*self.0.0.now.get() }
    }

    /// Other prisms, as many as before; the old ones.
    pub fn replace(self, traced: Traced) -> Traced {
        debug_assert_eq!(traced.prisms().len(), self.now().prisms().len());
        // SAFETY: nobody is within, and whoever comes waits until this is dropped.
        unsafe { std::mem::replace(&mut *self.0.0.now.get(), traced) }
    }
}

/// Whether Embree takes numbers so large. A caller's own rays are whatever the caller says.
#[inline(always)]
fn is_traceable(ray: &Ray) -> bool {
    // Without the sign, the bits of floats are in the floats' order; infinity and NaN come last.
    let magnitude = |x: f32| x.to_bits() & 0x7fff_ffff;
    let origin = ray.origin.to_array().map(magnitude);
    let direction = ray.direction.to_array().map(magnitude);
    let largest = |[x, y, z]: [u32; 3]| x.max(y).max(z);
    largest(origin).max(largest(direction)) <= MAX_COORDINATE.to_bits()
}

/// The lanes that packets may have.
fn traceable_lanes(rays: &RayPacket, valid: u8) -> u8 {
    let is_traceable = |ray: &Ray| is_traceable(ray) && ray.is_valid();
    lanes_of(valid)
        .filter(|&lane| is_traceable(&rays.ray(lane)))
        .fold(0, |bits, lane| bits | 1 << lane)
}

/// How a filter's ray is within; 0 where nothing was begun.
const PINNED: u32 = 1;
const COUNTED: u32 = 2;

impl HitTest for Live {
    fn len(&self) -> usize {
        self.enter().now().prisms().len()
    }

    fn bounds(&self, prim: u32) -> Aabb {
        self.bounds_at(prim, 0)
    }

    fn time_steps(&self) -> usize {
        self.enter().now().time_steps()
    }

    fn bounds_at(&self, prim: u32, step: usize) -> Aabb {
        self.enter().now().bounds(prim, step)
    }

    fn intersect(&self, prim: u32, ray: &Ray) -> Option<PrismHit> {
        if !is_traceable(ray) {
            return None;
        }
        let within = self.enter();
        let hit = match within.now() {
            Traced::Standing(prisms) => prisms.intersect(prim, ray),
            Traced::Moving(moving) => moving.intersect(prim, ray),
        };
        hit.map(|hit| self.to_caller(hit))
    }

    fn occluded(&self, prim: u32, ray: &Ray) -> bool {
        if !is_traceable(ray) {
            return false;
        }
        let within = self.enter();
        match within.now() {
            Traced::Standing(prisms) => prisms.occluded(prim, ray),
            Traced::Moving(moving) => moving.occluded(prim, ray),
        }
    }

    fn intersect8(
        &self,
        prim: u32,
        rays: &RayPacket,
        valid: u8,
    ) -> [Option<PrismHit>; RayPacket::LANES] {
        let valid = traceable_lanes(rays, valid);
        let within = self.enter();
        let mut hits = match within.now() {
            _ if valid == 0 => return [None; RayPacket::LANES],
            Traced::Standing(prisms) => prisms.intersect8(prim, rays, valid),
            Traced::Moving(moving) => HitTest::intersect8(moving, prim, rays, valid),
        };
        for hit in hits.iter_mut().flatten() {
            *hit = self.to_caller(*hit);
        }
        hits
    }

    fn occluded8(&self, prim: u32, rays: &RayPacket, valid: u8) -> u8 {
        let valid = traceable_lanes(rays, valid);
        let within = self.enter();
        match within.now() {
            _ if valid == 0 => 0,
            Traced::Standing(prisms) => prisms.occluded8(prim, rays, valid),
            Traced::Moving(moving) => HitTest::occluded8(moving, prim, rays, valid),
        }
    }

    /// A ray that waits for its filter is in flight.
    fn begin_filter(&self) -> u32 {
        let within = ManuallyDrop::new(self.enter());
        if within.pin.is_some() {
            PINNED
        } else {
            COUNTED
        }
    }

    fn end_filter(&self, begun: u32) {
        let pin = match begun {
            PINNED => Pin::again(Word::Surface, self.key()),
            COUNTED => None,
            _ => return,
        };
        drop(Within { live: self, pin });
    }

    fn closest(&self, prim: u32, query: &PointQuery) -> Option<ClosestPoint> {
        let within = self.enter();
        let mut found = match within.now() {
            Traced::Standing(prisms) => prisms.closest(prim, query),
            Traced::Moving(moving) => moving.closest(prim, query),
        }?;
        (found.prim, found.u, found.v) = self.base.to_caller(found.prim, found.u, found.v);
        Some(found)
    }
}
