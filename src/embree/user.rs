//! User geometry: primitives whose boxes and hits are computed in Rust.
//!
//! Each call of Embree's passes one C function of the shim and one Rust function of [`HitTest`], stamped
//! out per type; its pointer is stored when the geometry is made.

use std::ffi::c_void;
use std::mem::offset_of;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use glam::{Affine3A, Vec3};

use super::faults::Faults;
use super::geometry::Kind;
use super::{Device, EmbreeError, Geometry, sys};
use crate::prism::PrismHit;
use crate::ray::{Aabb, Ray, RayPacket, lanes_of};
use crate::surface::{ClosestPoint, PointQuery};
use crate::trace::{INVALID_ID, MAX_INSTANCE_LEVELS};

/// The hit test of a set of primitives, called from many threads at once.
///
/// A panic inside reads as a miss, and [`Device::check`] reports it.
pub trait HitTest: Send + Sync {
    /// Number of primitives, below 2^32 - 1.
    fn len(&self) -> usize;

    /// Whether there is none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A box that holds every hit on `prim`; it is padded against rounding by the caller. Of what moves the box at the first time step.
    fn bounds(&self, prim: u32) -> Aabb;

    /// Time steps, evenly spaced over the times [0, 1]; 1 for what stands still, at most 129.
    fn time_steps(&self) -> usize {
        1
    }

    /// [`bounds`](Self::bounds) at a time step. Between two steps hits must be in the linear interpolation of both boxes.
    fn bounds_at(&self, prim: u32, step: usize) -> Aabb {
        let _ = step;
        self.bounds(prim)
    }

    /// The first hit with t in (tnear, tfar), along the unnormalised direction.
    fn intersect(&self, prim: u32, ray: &Ray) -> Option<PrismHit>;

    /// Whether there is any.
    fn occluded(&self, prim: u32, ray: &Ray) -> bool {
        self.intersect(prim, ray).is_some()
    }

    /// The nearest point of what `prim` holds, no further than the query's radius and within the [`bounds`](Self::bounds) as the query places them;
    /// none where that is not known.
    fn closest(&self, prim: u32, query: &PointQuery) -> Option<ClosestPoint> {
        let _ = (prim, query);
        None
    }

    /// A filter is about to be asked about a hit, by this thread: the ray is still on its way. What is returned goes to
    /// [`end_filter`](Self::end_filter), which is called after it.
    fn begin_filter(&self) -> u32 {
        0
    }

    /// The filter has answered.
    fn end_filter(&self, begun: u32) {
        let _ = begun;
    }

    /// [`intersect`](Self::intersect) for the lanes whose bits are set in `valid`, at least one. The other lanes may
    /// hold anything, and what is returned for them is not looked at.
    ///
    /// Where the rays of a packet have parted, Embree asks about one lane at a time.
    ///
    /// Lanes that are valid hold valid rays, but for instances whose transform makes them something else.
    fn intersect8(
        &self,
        prim: u32,
        rays: &RayPacket,
        valid: u8,
    ) -> [Option<PrismHit>; RayPacket::LANES] {
        let mut hits = [None; RayPacket::LANES];
        for lane in lanes_of(valid) {
            hits[lane] = self.intersect(prim, &rays.ray(lane));
        }
        hits
    }

    /// [`occluded`](Self::occluded) for the lanes whose bits are set in `valid`: bit i of the result tells of lane i.
    fn occluded8(&self, prim: u32, rays: &RayPacket, valid: u8) -> u8 {
        lanes_of(valid)
            .filter(|&lane| self.occluded(prim, &rays.ray(lane)))
            .fold(0, |bits, lane| bits | 1 << lane)
    }
}

/// A user geometry over a [`HitTest`].
pub struct UserGeometry(Geometry);

impl From<UserGeometry> for Geometry {
    fn from(user: UserGeometry) -> Self {
        user.0
    }
}

impl UserGeometry {
    /// A geometry whose primitives are those of `test`, which lives as long as Embree may call it.
    pub fn new<T: HitTest + 'static>(device: &Device, test: Arc<T>) -> Result<Self, EmbreeError> {
        let stored = Stored::new(device.faults().clone(), test)?;
        // SAFETY: the callbacks are those of Stored<T>, and the pointer leads to the Stored<T> that is kept.
        let geometry = unsafe {
            Geometry::from_raw(device, Kind::User, stored.clone(), || {
                sys::pm_geometry_new_user(
                    device.raw(),
                    &Stored::<T>::CALLBACKS,
                    Arc::as_ptr(&stored).cast(),
                    stored.primitives,
                    stored.time_steps,
                )
            })
        };
        geometry.map(Self)
    }
}

impl Geometry {
    /// Another test for a user geometry; needs a commit.
    pub(super) fn replace_test<T: HitTest + 'static>(
        &mut self,
        test: Arc<T>,
    ) -> Result<(), EmbreeError> {
        debug_assert_eq!(self.kind, Kind::User);
        let stored = Stored::new(self.device.faults().clone(), test)?;
        // SAFETY: as in `UserGeometry::new`; the scene is not traced now, so that nothing runs in the old test.
        let outcome = self.device.guarded(|| unsafe {
            sys::pm_geometry_set_test(
                self.raw(),
                &Stored::<T>::CALLBACKS,
                Arc::as_ptr(&stored).cast(),
                stored.primitives,
                stored.time_steps,
            );
        });
        // Also on an error: the shim holds the new pointers already.
        self.keep = stored;
        outcome
    }
}

/// What the geometry's user pointer leads to.
pub(super) struct Stored<T> {
    test: Arc<T>,
    faults: Arc<Faults>,
    pub(super) primitives: u32,
    pub(super) time_steps: u32,
}

/// Ulps of the largest coordinate by which boxes grow: Embree's box test rounds a handful of times, and its
/// robust mode does not reach user geometry.
const PADDING_ULPS: f32 = 8.0;

/// Embree drops boxes that reach further, and some builds of it end the process at rays that do.
pub(crate) const LARGEST_COORDINATE: f32 = 1.844e18;

/// How far a box of a hit test reaches from the origin, along any axis, as Embree gets it; infinite for one that is NaN or inverted.
pub(crate) fn reach(bounds: Aabb) -> f32 {
    let padded = bounds.padded(PADDING_ULPS);
    let reach = padded.min.abs().max(padded.max.abs()).max_element();
    if padded.is_valid() && reach.is_finite() {
        reach
    } else {
        f32::INFINITY
    }
}

impl<T: HitTest + 'static> Stored<T> {
    pub(super) const CALLBACKS: sys::pm_hit_test = sys::pm_hit_test {
        bounds: Some(Self::on_bounds),
        intersect: Some(Self::on_intersect),
        occluded: Some(Self::on_occluded),
        intersect8: Some(Self::on_intersect8),
        occluded8: Some(Self::on_occluded8),
        closest: Some(Self::on_closest),
        begin_filter: Some(Self::on_begin_filter),
        end_filter: Some(Self::on_end_filter),
    };

    pub(super) fn new(faults: Arc<Faults>, test: Arc<T>) -> Result<Arc<Self>, EmbreeError> {
        let primitives = super::geometry::count("primitives", test.len())?;
        let time_steps = super::geometry::time_steps(test.time_steps())?;
        Ok(Arc::new(Self {
            test,
            faults,
            primitives,
            time_steps,
        }))
    }

    /// No panic may cross the C frames below: it is kept for [`Device::check`], and the ray sees a miss.
    fn caught<R>(&self, miss: R, call: impl FnOnce() -> R) -> R {
        catch_unwind(AssertUnwindSafe(call)).unwrap_or_else(|payload| {
            self.faults.record_panic(&*payload);
            miss
        })
    }

    fn checked_bounds(&self, prim: u32, step: u32) -> Aabb {
        let found = self.test.bounds_at(prim, step as usize);
        if reach(found) <= LARGEST_COORDINATE {
            return found.padded(PADDING_ULPS);
        }
        self.faults.record(EmbreeError::InvalidBounds {
            prim,
            min: found.min,
            max: found.max,
        });
        Aabb::EMPTY
    }

    unsafe extern "C" fn on_bounds(user: *const c_void, prim: u32, step: u32, out: *mut f32) {
        // SAFETY: `user` is the Stored<T> given with CALLBACKS; `out` has room for six floats.
        let (stored, out) = unsafe { (&*user.cast::<Self>(), &mut *out.cast::<[f32; 6]>()) };
        let bounds = stored.caught(Aabb::EMPTY, || stored.checked_bounds(prim, step));
        out[..3].copy_from_slice(&bounds.min.to_array());
        out[3..].copy_from_slice(&bounds.max.to_array());
    }

    unsafe extern "C" fn on_intersect(
        user: *const c_void,
        prim: u32,
        ray: *const sys::pm_ray,
        hit: *mut sys::pm_hit,
    ) -> bool {
        // SAFETY: `user` is the Stored<T> given with CALLBACKS; `ray` is valid during the call.
        let (stored, ray) = unsafe { (&*user.cast::<Self>(), ray_from_raw(ray)) };
        let found = stored.caught(None, || stored.test.intersect(prim, ray));
        let Some(found) = found else { return false };
        // SAFETY: the shim's pointer is valid for a write.
        unsafe { hit.write(hit_to_raw(&found)) };
        true
    }

    unsafe extern "C" fn on_occluded(
        user: *const c_void,
        prim: u32,
        ray: *const sys::pm_ray,
    ) -> bool {
        // SAFETY: as in `on_intersect`.
        let (stored, ray) = unsafe { (&*user.cast::<Self>(), ray_from_raw(ray)) };
        stored.caught(false, || stored.test.occluded(prim, ray))
    }

    /// A panic loses all lanes.
    unsafe extern "C" fn on_intersect8(
        user: *const c_void,
        prim: u32,
        rays: *const sys::pm_ray8,
        valid: u32,
        hits: *mut sys::pm_hit,
    ) -> u32 {
        // SAFETY: `user` is the Stored<T> given with CALLBACKS; `rays` is valid during the call.
        let (stored, rays) = unsafe { (&*user.cast::<Self>(), packet_from_raw(rays)) };
        let valid = valid as u8; // as many bits as lanes
        let found = stored.caught([None; RayPacket::LANES], || {
            stored.test.intersect8(prim, rays, valid)
        });
        let mut bits = 0;
        for lane in lanes_of(valid) {
            if let Some(hit) = &found[lane] {
                bits |= 1 << lane;
                // SAFETY: the shim's pointer is valid for a write of eight.
                unsafe { hits.add(lane).write(hit_to_raw(hit)) };
            }
        }
        bits
    }

    unsafe extern "C" fn on_occluded8(
        user: *const c_void,
        prim: u32,
        rays: *const sys::pm_ray8,
        valid: u32,
    ) -> u32 {
        // SAFETY: as in `on_intersect8`.
        let (stored, rays) = unsafe { (&*user.cast::<Self>(), packet_from_raw(rays)) };
        let valid = valid as u8; // as many bits as lanes
        stored
            .caught(0, || stored.test.occluded8(prim, rays, valid))
            .into()
    }

    unsafe extern "C" fn on_begin_filter(user: *const c_void) -> u32 {
        // SAFETY: as in `on_intersect`.
        let stored = unsafe { &*user.cast::<Self>() };
        stored.caught(0, || stored.test.begin_filter())
    }

    unsafe extern "C" fn on_end_filter(user: *const c_void, begun: u32) {
        // SAFETY: as in `on_intersect`.
        let stored = unsafe { &*user.cast::<Self>() };
        stored.caught((), || stored.test.end_filter(begun));
    }

    unsafe extern "C" fn on_closest(
        user: *const c_void,
        prim: u32,
        query: *const sys::pm_point_query,
        out: *mut sys::pm_closest,
    ) -> bool {
        // SAFETY: as in `on_intersect`.
        let (stored, query) = unsafe { (&*user.cast::<Self>(), &*query) };
        let query = PointQuery {
            point: Vec3::from_array(query.point),
            radius: query.radius,
            time: query.time,
            to_world: Affine3A::from_cols_array(&query.to_world),
        };
        let Some(found) = stored.caught(None, || stored.test.closest(prim, &query)) else {
            return false;
        };
        let found = sys::pm_closest {
            distance: found.distance,
            point: found.point.to_array(),
            u: found.u,
            v: found.v,
            prim: found.prim,
            geom: INVALID_ID,
            inst: [INVALID_ID; MAX_INSTANCE_LEVELS],
        };
        // SAFETY: the shim's pointer is valid for a write.
        unsafe { out.write(found) };
        true
    }
}

// A packet is a `pm_ray8`: what the shim reads and hands on is the packet itself.
const _: () = assert!(
    RayPacket::LANES == sys::PM_LANES as usize
        && size_of::<RayPacket>() == size_of::<sys::pm_ray8>()
        && align_of::<RayPacket>() == align_of::<sys::pm_ray8>()
        && offset_of!(RayPacket, origin) == offset_of!(sys::pm_ray8, org)
        && offset_of!(RayPacket, tnear) == offset_of!(sys::pm_ray8, tnear)
        && offset_of!(RayPacket, direction) == offset_of!(sys::pm_ray8, dir)
        && offset_of!(RayPacket, tfar) == offset_of!(sys::pm_ray8, tfar)
        && offset_of!(RayPacket, mask) == offset_of!(sys::pm_ray8, mask)
        && offset_of!(RayPacket, key) == offset_of!(sys::pm_ray8, id)
);

/// # Safety
/// `rays` is valid for reads as long as the reference is used.
unsafe fn packet_from_raw<'r>(rays: *const sys::pm_ray8) -> &'r RayPacket {
    // SAFETY: the same layout, and any bits are numbers.
    unsafe { &*rays.cast::<RayPacket>() }
}

pub(super) fn packet_to_raw(rays: &RayPacket) -> *const sys::pm_ray8 {
    std::ptr::from_ref(rays).cast()
}

fn hit_to_raw(hit: &PrismHit) -> sys::pm_hit {
    sys::pm_hit {
        t: hit.t,
        u: hit.u,
        v: hit.v,
        ng: hit.ng.to_array(),
        prim: hit.prim,
    }
}

// A ray is a `pm_ray` but for its flags, which are padding here: it is read where the shim has it.
const _: () = assert!(
    size_of::<Ray>() == size_of::<sys::pm_ray>()
        && align_of::<Ray>() == align_of::<sys::pm_ray>()
        && offset_of!(Ray, origin) == offset_of!(sys::pm_ray, org)
        && offset_of!(Ray, tnear) == offset_of!(sys::pm_ray, tnear)
        && offset_of!(Ray, direction) == offset_of!(sys::pm_ray, dir)
        && offset_of!(Ray, time) == offset_of!(sys::pm_ray, time)
        && offset_of!(Ray, tfar) == offset_of!(sys::pm_ray, tfar)
        && offset_of!(Ray, mask) == offset_of!(sys::pm_ray, mask)
        && offset_of!(Ray, key) == offset_of!(sys::pm_ray, id)
);

/// # Safety
/// `ray` is valid for reads as long as the reference is used.
pub(super) unsafe fn ray_from_raw<'r>(ray: *const sys::pm_ray) -> &'r Ray {
    // SAFETY: the same layout, and any bits are numbers.
    unsafe { &*ray.cast::<Ray>() }
}
