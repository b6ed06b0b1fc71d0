//! Filters: the last word on a candidate hit.

use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use super::faults::Faults;
use super::scene::hit_from_raw;
use super::sys;
use super::user::ray_from_raw;
use crate::ray::Ray;
use crate::trace::Hit;

/// Whether a candidate hit counts. The ray's `tfar` is the candidate's t.
pub type HitFilter = Box<dyn Fn(&Ray, &Hit) -> bool + Send + Sync>;

pub(super) struct FilterData {
    filter: HitFilter,
    faults: Arc<Faults>,
}

impl FilterData {
    pub(super) fn new(filter: HitFilter, faults: &Arc<Faults>) -> Self {
        Self {
            filter,
            faults: faults.clone(),
        }
    }

    /// # Safety
    /// `geometry` is live and `self` is dropped after it is freed.
    pub(super) unsafe fn install(self: &Arc<Self>, geometry: *mut sys::pm_geometry) {
        let user = Arc::as_ptr(self).cast();
        // SAFETY: by this function's contract.
        unsafe { sys::pm_geometry_set_filter(geometry, Some(on_filter), user) }
    }
}

unsafe extern "C" fn on_filter(
    user: *const c_void,
    ray: *const sys::pm_ray,
    candidate: *const sys::pm_scene_hit,
) -> bool {
    // SAFETY: `user` is the FilterData given to `install`; the shim's pointers are valid during the call.
    let (data, ray, candidate) =
        unsafe { (&*user.cast::<FilterData>(), ray_from_raw(ray), &*candidate) };
    catch_unwind(AssertUnwindSafe(|| {
        (data.filter)(ray, &hit_from_raw(candidate))
    }))
    .unwrap_or_else(|payload| {
        data.faults.record_panic(&*payload);
        false
    })
}
