//! Conversions to and from the types of the crate embree4-sys.

use std::ptr::NonNull;
use std::sync::Arc;

use embree4_sys::{RTC_INVALID_GEOMETRY_ID, RTCDevice, RTCGeometry, RTCRay, RTCRayHit, RTCScene};
use glam::Vec3;

use super::raw::RawGeometry;
use super::{EmbreeError, ErrorCode, HitTest};
use crate::prism::PrismHit;
use crate::ray::Ray;

impl From<&Ray> for RTCRay {
    fn from(ray: &Ray) -> Self {
        let ([org_x, org_y, org_z], [dir_x, dir_y, dir_z]) =
            (ray.origin.to_array(), ray.direction.to_array());
        Self {
            org_x,
            org_y,
            org_z,
            tnear: ray.tnear,
            dir_x,
            dir_y,
            dir_z,
            time: ray.time,
            tfar: ray.tfar,
            mask: ray.mask,
            id: ray.key,
            flags: 0,
        }
    }
}

impl From<&RTCRay> for Ray {
    fn from(ray: &RTCRay) -> Self {
        Self {
            origin: Vec3::new(ray.org_x, ray.org_y, ray.org_z),
            direction: Vec3::new(ray.dir_x, ray.dir_y, ray.dir_z),
            tnear: ray.tnear,
            tfar: ray.tfar,
            time: ray.time,
            mask: ray.mask,
            key: ray.id,
        }
    }
}

impl PrismHit {
    /// What `rtcIntersect1` has found; `None` where that is nothing. `ng` is as Embree gives it: in object space, of any length.
    pub fn from_rtc(found: &RTCRayHit) -> Option<Self> {
        let hit = &found.hit;
        (hit.geomID != RTC_INVALID_GEOMETRY_ID).then(|| Self {
            t: found.ray.tfar,
            prim: hit.primID,
            u: hit.u,
            v: hit.v,
            ng: Vec3::new(hit.Ng_x, hit.Ng_y, hit.Ng_z),
        })
    }
}

impl RawGeometry {
    /// [`Self::new`] with embree4-sys's handle.
    ///
    /// # Errors
    ///
    /// As there, and a null device.
    ///
    /// # Safety
    ///
    /// As there, but for null.
    pub unsafe fn on_device<T: HitTest + 'static>(
        device: RTCDevice,
        test: Arc<T>,
    ) -> Result<Self, EmbreeError> {
        // SAFETY: the caller's promise.
        unsafe { Self::new(not_null(device.cast(), "device")?, test) }
    }

    /// [`Self::attach`] with embree4-sys's handle.
    ///
    /// # Errors
    ///
    /// A null scene.
    ///
    /// # Safety
    ///
    /// As there, but for null.
    pub unsafe fn attach_to(&self, scene: RTCScene) -> Result<u32, EmbreeError> {
        // SAFETY: the caller's promise.
        Ok(unsafe { self.attach(not_null(scene.cast(), "scene")?) })
    }

    /// The geometry as embree4-sys names it, valid as [`Self::as_ptr`] is.
    pub fn as_rtc(&self) -> RTCGeometry {
        self.as_ptr().as_ptr().cast()
    }
}

fn not_null<T>(pointer: *mut T, what: &str) -> Result<NonNull<T>, EmbreeError> {
    NonNull::new(pointer).ok_or_else(|| EmbreeError::Library {
        code: ErrorCode::InvalidArgument,
        message: format!("the {what} is null"),
    })
}
