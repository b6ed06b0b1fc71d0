//! Surfaces in Embree: `prismarch_geometry_*`, `prismarch_closest`, `prismarch_surface_closest`.

use std::ffi::c_void;
use std::ptr::NonNull;

use glam::{Affine3A, Mat4, Vec3};

use super::declarations::{
    self as c, RTCDeviceTy, RTCGeometryTy, RTCSceneTy, prismarch_closest_point, prismarch_error,
    prismarch_status,
};
use super::error::{Failure, answer};
use super::handle::{kept, output, used};
use super::surface::Surface;
use crate::embree::HitTest;
use crate::embree::raw::{self, RawGeometry};
use crate::ray::MAX_COORDINATE;
use crate::surface::{ClosestPoint, PointQuery};
use crate::trace::INVALID_ID;

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
            // Embree may call the caller's memory monitor meanwhile.
            let surface = kept::<Surface, _>(surface)?;
            let device = NonNull::new(device).ok_or_else(|| Failure::null("device"))?;
            let (live, options) = (surface.live.clone(), surface.options.clone());
            let made = RawGeometry::with_options(device.cast(), live, options)?;
            if raw::notices_ends() {
                *out = made.into_raw().cast().as_ptr();
                return Ok(());
            }
            let (made, unwatched) = made.into_parts();
            if let Some(unwatched) = unwatched {
                surface.keep(unwatched);
            }
            *out = made.cast().as_ptr();
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
            if raw::set_caller_data(geometry.cast(), data) {
                Ok(())
            } else {
                Err(Failure::geometry())
            }
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_geometry_user_data(geometry: *mut RTCGeometryTy) -> *mut c_void {
    let mut data = std::ptr::null_mut();
    // SAFETY: null is no place for an error's text.
    let _ = unsafe {
        answer(std::ptr::null_mut(), || {
            let geometry = NonNull::new(geometry).ok_or_else(|| Failure::null("geometry"))?;
            data = raw::caller_data(geometry.cast()).ok_or_else(Failure::geometry)?;
            Ok(())
        })
    };
    data
}

#[unsafe(no_mangle)]
pub extern "C" fn prismarch_geometry_keeps_surface() -> bool {
    raw::notices_ends()
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
            let (found, out) = (output(found, "found")?, output(point, "point")?);
            let query = query(position, radius, time, std::ptr::null())?;
            if !raw::is_committed(scene.cast()) {
                return Err(Failure::embree(
                    "the scene is not committed, or was changed since: call rtcCommitScene first",
                ));
            }
            let nearest = raw::closest(scene.cast(), query.point, radius, time);
            *found = nearest.is_some();
            if let Some((nearest, geom_id)) = nearest {
                *out = to_caller(&nearest, geom_id);
            }
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_surface_closest(
    surface: *const c::prismarch_surface,
    primitive: u32,
    position: *const f32,
    radius: f32,
    time: f32,
    to_world: *const f32,
    found: *mut bool,
    point: *mut prismarch_closest_point,
    error: *mut prismarch_error,
) -> prismarch_status {
    // SAFETY: pointers as the header asks.
    unsafe {
        answer(error, || {
            let surface = used::<Surface, _>(surface)?;
            let (found, out) = (output(found, "found")?, output(point, "point")?);
            let query = query(position, radius, time, to_world)?;
            let primitives = surface.live.len();
            if primitive as usize >= primitives {
                return Err(Failure::argument(format!(
                    "primitive {primitive}; the geometry has {primitives}"
                )));
            }
            let nearest = surface.live.closest(primitive, &query);
            *found = nearest.is_some();
            if let Some(nearest) = nearest {
                *out = to_caller(&nearest, INVALID_ID);
            }
            Ok(())
        })
    }
}

/// A query from C.
///
/// # Safety
///
/// `position` is null or three floats, `to_world` null or sixteen.
unsafe fn query(
    position: *const f32,
    radius: f32,
    time: f32,
    to_world: *const f32,
) -> Result<PointQuery, Failure> {
    if position.is_null() {
        return Err(Failure::null("position"));
    }
    // SAFETY: the caller's promise.
    let (point, to_world) = unsafe {
        (
            Vec3::from_array(position.cast::<[f32; 3]>().read_unaligned()),
            match to_world.is_null() {
                true => Mat4::IDENTITY,
                false => Mat4::from_cols_array(&to_world.cast::<[f32; 16]>().read_unaligned()),
            },
        )
    };
    let limit = MAX_COORDINATE;
    let is_within = |numbers: &[f32]| numbers.iter().all(|x| x.abs() <= limit);
    if !is_within(&point.to_array())
        || !is_within(&to_world.to_cols_array())
        || radius.is_nan()
        || radius < 0.0
        || !(0.0..=1.0).contains(&time)
    {
        return Err(Failure::argument(format!(
            "position {point}, radius {radius}, time {time}, transform {to_world}; expected numbers within {limit:e}, at least 0, and 0 to 1"
        )));
    }
    Ok(PointQuery {
        point,
        radius,
        time,
        to_world: Affine3A::from_mat4(to_world),
    })
}

fn to_caller(nearest: &ClosestPoint, geom_id: u32) -> prismarch_closest_point {
    prismarch_closest_point {
        distance: nearest.distance,
        position: nearest.point.to_array(),
        u: nearest.u,
        v: nearest.v,
        prim_id: nearest.prim,
        geom_id,
    }
}
