//! Surfaces in Embree: `prismarch_geometry_*`, `prismarch_closest`.

use std::ffi::c_void;
use std::ptr::NonNull;

use glam::Vec3;

use super::declarations::{
    self as c, RTCDeviceTy, RTCGeometryTy, RTCSceneTy, prismarch_closest_point, prismarch_error,
    prismarch_status,
};
use super::error::{Failure, answer};
use super::handle::{Handle, output};
use super::surface::Surface;
use crate::embree::raw::{self, RawGeometry};

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_geometry_create(
    device: *mut RTCDeviceTy,
    surface: *mut c::prismarch_surface,
    geometry: *mut *mut RTCGeometryTy,
    error: *mut prismarch_error,
) -> prismarch_status {
    // SAFETY: pointers as the header asks.
    unsafe {
        answer(error, || {
            let out = output(geometry, "geometry")?;
            let surface = Handle::<Surface>::borrow(surface.cast())?;
            let device = NonNull::new(device).ok_or_else(|| Failure::null("device"))?;
            let (live, faults) = (surface.live.clone(), surface.faults.clone());
            let made = RawGeometry::with_faults(device.cast(), live, faults)?;
            *out = made.into_raw().cast().as_ptr();
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_geometry_set_user_data(
    geometry: *mut RTCGeometryTy,
    data: *mut c_void,
    error: *mut prismarch_error,
) -> prismarch_status {
    // SAFETY: pointers as the header asks.
    unsafe {
        answer(error, || {
            let geometry = NonNull::new(geometry).ok_or_else(|| Failure::null("geometry"))?;
            raw::set_caller_data(geometry.cast(), data);
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_geometry_user_data(geometry: *mut RTCGeometryTy) -> *mut c_void {
    let Some(geometry) = NonNull::new(geometry) else {
        return std::ptr::null_mut();
    };
    // SAFETY: a geometry of prismarch's, as the header asks.
    unsafe { raw::caller_data(geometry.cast()) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_closest(
    scene: *mut RTCSceneTy,
    position: *const f32,
    radius: f32,
    time: f32,
    found: *mut bool,
    point: *mut prismarch_closest_point,
    error: *mut prismarch_error,
) -> prismarch_status {
    // SAFETY: pointers as the header asks.
    unsafe {
        answer(error, || {
            let scene = NonNull::new(scene).ok_or_else(|| Failure::null("scene"))?;
            if position.is_null() {
                return Err(Failure::null("position"));
            }
            let (found, out) = (output(found, "found")?, output(point, "point")?);
            let position = Vec3::from_array(position.cast::<[f32; 3]>().read_unaligned());
            if !position.is_finite()
                || radius.is_nan()
                || radius < 0.0
                || !(0.0..=1.0).contains(&time)
            {
                return Err(Failure::argument(format!(
                    "position {position}, radius {radius}, time {time}; expected finite numbers, at least 0, and 0 to 1"
                )));
            }
            let nearest = raw::closest(scene.cast(), position, radius, time);
            *found = nearest.is_some();
            if let Some((nearest, geom_id)) = nearest {
                *out = prismarch_closest_point {
                    distance: nearest.distance,
                    position: nearest.point.to_array(),
                    u: nearest.u,
                    v: nearest.v,
                    prim_id: nearest.prim,
                    geom_id,
                };
            }
            Ok(())
        })
    }
}
