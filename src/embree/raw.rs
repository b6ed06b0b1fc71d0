//! Prisms in pipelines that have an Embree of their own: geometries on a device that this library did not make.
//!
//! Handles are Embree's own (`RTCDevice`, `RTCGeometry`, `RTCScene`) as the pipeline's bindings have them, cast to `*mut c_void`. The
//! Embree that the pipeline links must be the one that this library was built against.
//!
//! ```no_run
//! # use std::{ffi::c_void, ptr::NonNull, sync::Arc};
//! # use prismarch::embree::{EmbreeError, raw::RawGeometry};
//! # use prismarch::prism::Prisms;
//! # fn attach(device: NonNull<c_void>, scene: NonNull<c_void>, prisms: Arc<Prisms>) -> Result<u32, EmbreeError> {
//! // SAFETY: `device` and `scene` are live handles of the Embree that is linked.
//! let geometry = unsafe { RawGeometry::new(device, prisms)? };
//! let id = unsafe { geometry.attach(scene) };
//! // rtcCommitScene(scene), and hits with geomID == id are hits on the prisms' surface.
//! # Ok(id)
//! # }
//! ```

use std::ffi::c_void;
use std::ptr::NonNull;
use std::sync::Arc;

use glam::Vec3;

use super::faults::Faults;
use super::user::Stored;
use super::{EmbreeError, ErrorCode, HitTest, sys};
use crate::surface::ClosestPoint;

/// A user geometry of a pipeline's device, of which this is one reference.
pub struct RawGeometry {
    handle: NonNull<c_void>,
    faults: Arc<Faults>,
}

// SAFETY: Embree counts references atomically, and may be called from any thread.
unsafe impl Send for RawGeometry {}
// SAFETY: as above.
unsafe impl Sync for RawGeometry {}

impl Drop for RawGeometry {
    fn drop(&mut self) {
        // SAFETY: the reference that `new` took.
        unsafe { sys::pm_foreign_release(self.handle.as_ptr()) }
    }
}

impl RawGeometry {
    /// A geometry whose primitives are those of `test`, which lives until Embree destroys the geometry. It is not yet committed.
    ///
    /// # Errors
    ///
    /// A device of another major version; whatever keeps Embree from making a geometry.
    ///
    /// # Safety
    ///
    /// `device` is a live `RTCDevice` of the Embree library that this process has linked.
    pub unsafe fn new<T: HitTest + 'static>(
        device: NonNull<c_void>,
        test: Arc<T>,
    ) -> Result<Self, EmbreeError> {
        // SAFETY: the caller's promise.
        unsafe { Self::with_faults(device, test, Arc::default()) }
    }

    /// [`Self::new`] with faults that other geometries have, too.
    ///
    /// # Errors
    ///
    /// As there.
    ///
    /// # Safety
    ///
    /// As there.
    pub unsafe fn with_faults<T: HitTest + 'static>(
        device: NonNull<c_void>,
        test: Arc<T>,
        faults: Arc<Faults>,
    ) -> Result<Self, EmbreeError> {
        // SAFETY: the caller's promise.
        let found = unsafe { sys::pm_foreign_major(device.as_ptr()) };
        let expected = version() / 10_000;
        if found != expected {
            return Err(EmbreeError::WrongVersion { found, expected });
        }
        let stored = Stored::new(faults.clone(), test)?;
        let (primitives, time_steps) = (stored.primitives, stored.time_steps);
        let user = Arc::into_raw(stored);
        // SAFETY: the callbacks are those of Stored<T>; `user` is a count of it, which `gone` takes back.
        let made = unsafe {
            sys::pm_foreign_new(
                device.as_ptr(),
                &Stored::<T>::CALLBACKS,
                user.cast_mut().cast(),
                primitives,
                time_steps,
                Some(gone::<T>),
            )
        };
        let Some(handle) = NonNull::new(made) else {
            // SAFETY: no geometry was made: the count is still ours.
            drop(unsafe { Arc::from_raw(user) });
            return Err(EmbreeError::Library {
                code: ErrorCode::Unknown,
                message: "no geometry was made; the device's error function knows why".to_string(),
            });
        };
        Ok(Self { handle, faults })
    }

    /// The `RTCGeometry`, valid while this or another reference lives.
    pub fn as_ptr(&self) -> NonNull<c_void> {
        self.handle
    }

    /// The `RTCGeometry` with its reference: the caller releases it.
    pub fn into_raw(self) -> NonNull<c_void> {
        let handle = self.handle;
        // The reference goes to the caller, the count of the faults does not.
        let this = std::mem::ManuallyDrop::new(self);
        // SAFETY: `this` is never used or dropped again.
        drop(unsafe { std::ptr::read(&raw const this.faults) });
        handle
    }

    /// What went wrong in hit tests.
    pub fn faults(&self) -> &Arc<Faults> {
        &self.faults
    }

    /// Commits the geometry and attaches it; its geomID. The scene keeps it from then on.
    ///
    /// # Safety
    ///
    /// `scene` is a live `RTCScene` of the geometry's device that is not traced or committed at the same time.
    pub unsafe fn attach(&self, scene: NonNull<c_void>) -> u32 {
        // SAFETY: the caller's promise; the geometry is live.
        unsafe { sys::pm_foreign_attach(scene.as_ptr(), self.handle.as_ptr()) }
    }
}

/// Embree has destroyed the geometry.
unsafe extern "C" fn gone<T: HitTest>(user: *mut c_void) {
    // SAFETY: the count that `RawGeometry::new` gave to the geometry.
    drop(unsafe { Arc::from_raw(user.cast_const().cast::<Stored<T>>()) });
}

/// Version of the Embree headers that this was built with: major * 10000 + minor * 100 + patch.
pub fn version() -> u32 {
    // SAFETY: reads a constant.
    unsafe { sys::pm_version_of_headers() }
}

/// A pointer of the caller's own, which filters of the geometry are given as its user data.
///
/// # Safety
///
/// `geometry` is a live `RTCGeometry` that a [`RawGeometry`] has made.
pub unsafe fn set_caller_data(geometry: NonNull<c_void>, data: *mut c_void) {
    // SAFETY: the caller's promise.
    unsafe { sys::pm_foreign_set_caller_data(geometry.as_ptr(), data) }
}

/// What [`set_caller_data`] has set; null before.
///
/// # Safety
///
/// As there.
pub unsafe fn caller_data(geometry: NonNull<c_void>) -> *mut c_void {
    // SAFETY: the caller's promise.
    unsafe { sys::pm_foreign_caller_data(geometry.as_ptr()) }
}

/// The nearest point of the geometries of this library in a scene, no further than `radius`, and its geomID. Instances in the scene are
/// not entered.
///
/// # Safety
///
/// `scene` is a live, committed `RTCScene` that is not changed meanwhile.
pub unsafe fn closest(
    scene: NonNull<c_void>,
    point: Vec3,
    radius: f32,
    time: f32,
) -> Option<(ClosestPoint, u32)> {
    let mut found = std::mem::MaybeUninit::uninit();
    // SAFETY: the caller's promise; three floats, and room for a result.
    let any = unsafe {
        sys::pm_closest_in(
            scene.as_ptr(),
            point.to_array().as_ptr(),
            radius,
            time,
            found.as_mut_ptr(),
        )
    };
    // SAFETY: written where there is one.
    any.then(|| unsafe { found.assume_init() })
        .map(|found: sys::pm_closest| {
            let at = ClosestPoint {
                distance: found.distance,
                point: Vec3::from_array(found.point),
                prim: found.prim,
                u: found.u,
                v: found.v,
            };
            (at, found.geom)
        })
}
