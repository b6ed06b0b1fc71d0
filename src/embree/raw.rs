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

use std::collections::BTreeMap;
use std::ffi::c_void;
use std::mem::ManuallyDrop;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr::NonNull;
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

use glam::Vec3;

use super::faults::Faults;
use super::user::Stored;
use super::{EmbreeError, ErrorCode, HitTest, sys};
use crate::surface::ClosestPoint;

/// A user geometry of a pipeline's device, of which this is one reference.
pub struct RawGeometry {
    handle: NonNull<c_void>,
    faults: Arc<Faults>,
    /// Never dropped here: nobody knows when Embree lets go of the geometry.
    unwatched: ManuallyDrop<Option<Unwatched>>,
}

/// How a geometry is made.
#[derive(Clone, Debug)]
pub struct RawOptions {
    /// Where faults are kept, also those of other geometries.
    pub faults: Arc<Faults>,
    /// Whether filters may be set for the geometry, which cannot be seen from a hit test. Where none will be, packets are met
    /// without a look at filters and occlusion rays end at any hit; one that is set all the same may not be asked.
    pub has_filter: bool,
}

impl Default for RawOptions {
    fn default() -> Self {
        Self {
            faults: Arc::default(),
            has_filter: true,
        }
    }
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

/// Whether this build can notice that Embree destroys a geometry: with glibc alone. Elsewhere what geometries trace stays until the process ends.
pub fn notices_ends() -> bool {
    // SAFETY: reads a constant.
    unsafe { sys::pm_foreign_can_watch() }
}

/// The geometries that are live, by address, and what belongs to them.
static GEOMETRIES: RwLock<BTreeMap<usize, Record>> = RwLock::new(BTreeMap::new());

#[derive(Clone, Copy, PartialEq)]
struct Record(NonNull<sys::pm_foreign>);

// SAFETY: the C functions on it may be called from any thread.
unsafe impl Send for Record {}
// SAFETY: as above.
unsafe impl Sync for Record {}

fn geometries() -> RwLockReadGuard<'static, BTreeMap<usize, Record>> {
    GEOMETRIES.read().unwrap_or_else(PoisonError::into_inner)
}

fn geometries_mut() -> RwLockWriteGuard<'static, BTreeMap<usize, Record>> {
    GEOMETRIES.write().unwrap_or_else(PoisonError::into_inner)
}

/// What a geometry traces, where nobody notices its end. Dropped when nothing traces or commits the geometry any more.
pub(crate) struct Unwatched {
    address: usize,
    record: Record,
}

impl Drop for Unwatched {
    fn drop(&mut self) {
        let mut live = geometries_mut();
        // Another geometry may have got the address.
        if live.get(&self.address) == Some(&self.record) {
            live.remove(&self.address);
        }
        drop(live);
        // SAFETY: made by `pm_foreign_new`, not watched, freed once; nothing uses it by the promise of whoever drops this.
        unsafe { sys::pm_foreign_free(self.record.0.as_ptr()) }
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
        unsafe { Self::with_options(device, test, RawOptions::default()) }
    }

    /// [`Self::new`] with options.
    ///
    /// # Errors
    ///
    /// As there.
    ///
    /// # Safety
    ///
    /// As there.
    pub unsafe fn with_options<T: HitTest + 'static>(
        device: NonNull<c_void>,
        test: Arc<T>,
        options: RawOptions,
    ) -> Result<Self, EmbreeError> {
        // SAFETY: the caller's promise.
        let found = unsafe { sys::pm_foreign_major(device.as_ptr()) };
        let expected = version() / 10_000;
        if found != expected {
            return Err(EmbreeError::WrongVersion { found, expected });
        }
        let RawOptions { faults, has_filter } = options;
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
                has_filter,
                Some(ending),
                Some(gone::<T>),
            )
        };
        let Some(record) = NonNull::new(made) else {
            // SAFETY: no geometry was made: the count is still ours.
            drop(unsafe { Arc::from_raw(user) });
            return Err(EmbreeError::Library {
                code: ErrorCode::Unknown,
                message: "no geometry was made; the device's error function knows why".to_string(),
            });
        };
        // SAFETY: a live record, whose geometry nobody else has yet.
        let (handle, is_watched) = unsafe {
            (
                NonNull::new_unchecked(sys::pm_foreign_geometry(made)),
                sys::pm_foreign_is_watched(made),
            )
        };
        let (address, record) = (handle.addr().get(), Record(record));
        geometries_mut().insert(address, record);
        let unwatched = (!is_watched).then(|| Unwatched { address, record });
        Ok(Self {
            handle,
            faults,
            unwatched: ManuallyDrop::new(unwatched),
        })
    }

    /// The `RTCGeometry`, valid while this or another reference lives.
    pub fn as_ptr(&self) -> NonNull<c_void> {
        self.handle
    }

    /// The `RTCGeometry` with its reference: the caller releases it.
    pub fn into_raw(self) -> NonNull<c_void> {
        let (handle, unwatched) = self.into_parts();
        std::mem::forget(unwatched);
        handle
    }

    /// [`Self::into_raw`], and what must be kept as long as Embree may call the geometry, where its end is not noticed.
    pub(crate) fn into_parts(self) -> (NonNull<c_void>, Option<Unwatched>) {
        // The reference goes to the caller, the count of the faults does not.
        let mut this = ManuallyDrop::new(self);
        // SAFETY: `this` is never used or dropped again.
        let unwatched = unsafe {
            std::ptr::drop_in_place(&raw mut this.faults);
            ManuallyDrop::take(&mut this.unwatched)
        };
        (this.handle, unwatched)
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

/// Embree is about to destroy the geometry: from now on the address says nothing.
unsafe extern "C" fn ending(geometry: *const c_void) {
    geometries_mut().remove(&geometry.addr());
}

/// Embree has destroyed the geometry.
unsafe extern "C" fn gone<T: HitTest>(user: *mut c_void) {
    // SAFETY: the count that `RawGeometry::new` gave to the geometry.
    let stored = unsafe { Arc::from_raw(user.cast_const().cast::<Stored<T>>()) };
    // No panic may cross the frames of Embree's that are below.
    if let Err(payload) = catch_unwind(AssertUnwindSafe(|| drop(stored))) {
        std::mem::forget(payload);
    }
}

/// Version of the Embree headers that this was built with: major * 10000 + minor * 100 + patch.
pub fn version() -> u32 {
    // SAFETY: reads a constant.
    unsafe { sys::pm_version_of_headers() }
}

/// A pointer of the caller's own, which filters of the geometry are given as its user data. False where the address is not that of a live
/// geometry that a [`RawGeometry`] has made; it is looked up, and nothing is read through it. (Where [ends are not noticed](notices_ends) the
/// address of a destroyed geometry is taken for a live one.)
#[allow(clippy::not_unsafe_ptr_arg_deref)] // `data` is kept, and never read through
pub fn set_caller_data(geometry: NonNull<c_void>, data: *mut c_void) -> bool {
    let live = geometries();
    let record = live.get(&geometry.addr().get());
    if let Some(record) = record {
        // SAFETY: records are freed after they have left the table, which is locked.
        unsafe { sys::pm_foreign_set_caller_data(record.0.as_ptr(), data) }
    }
    record.is_some()
}

/// What [`set_caller_data`] has set, null before; `None` where that would be false.
pub fn caller_data(geometry: NonNull<c_void>) -> Option<*mut c_void> {
    let live = geometries();
    let record = live.get(&geometry.addr().get())?;
    // SAFETY: as in `set_caller_data`.
    Some(unsafe { sys::pm_foreign_caller_data(record.0.as_ptr()) })
}

/// Whether a scene is committed, and nothing was attached, detached or set since. Where it is not, the device's error function is told, too.
///
/// # Safety
///
/// `scene` is a live `RTCScene` that is not changed meanwhile.
pub unsafe fn is_committed(scene: NonNull<c_void>) -> bool {
    // SAFETY: the caller's promise.
    unsafe { sys::pm_foreign_is_committed(scene.as_ptr()) }
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
