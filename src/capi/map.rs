//! Maps: `prismarch_map_*`.

use std::ffi::{CStr, c_char};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use super::buffer::{kept_as, read_texels};
use super::declarations::{
    self as c, prismarch_error, prismarch_status, prismarch_texels, prismarch_wrap,
};
use super::error::{Failure, answer};
use super::handle::{give, input, kept, output, release, retain, used};
use super::live::{Live, Shut};
use crate::image::{Channel, load_heights};
use crate::ray::MAX_COORDINATE;
use crate::surface::{DisplacementMap, TexelRect, Texels, Wrap};

/// A map, and who has it.
pub struct Map {
    pub map: Arc<DisplacementMap>,
    surfaces: Mutex<Vec<Weak<Live>>>,
    editing: Mutex<()>,
}

impl Map {
    /// A handle for C.
    fn create(map: DisplacementMap) -> Result<*mut c::prismarch_map, Failure> {
        give(Arc::new(Self {
            map: Arc::new(map),
            surfaces: Mutex::default(),
            editing: Mutex::default(),
        }))
    }

    /// A surface that edits concern.
    pub fn add(&self, surface: &Arc<Live>) {
        let mut all = self.surfaces.lock().unwrap_or_else(PoisonError::into_inner);
        all.retain(|live| live.strong_count() > 0);
        all.push(Arc::downgrade(surface));
    }

    fn surfaces(&self) -> Vec<Arc<Live>> {
        let all = self.surfaces.lock().unwrap_or_else(PoisonError::into_inner);
        all.iter().filter_map(Weak::upgrade).collect()
    }
}

/// Whether an edited surface stays within what Embree takes.
fn check_reach(surface: &Shut, texels: &Texels) -> Result<(), Failure> {
    let highest = match texels {
        Texels::U8(_) | Texels::U16(_) => 1.0,
        Texels::F32(heights) => heights.iter().fold(0.0, |most: f32, h| most.max(h.abs())),
    };
    let displacement = surface.now().surface().displacement();
    let most = displacement.scale.abs() * (highest + displacement.midlevel.abs());
    // Most surfaces are nowhere near: their boxes are not gone through.
    if most <= 1e-6 * MAX_COORDINATE {
        return Ok(());
    }
    let reach = surface.now().reach() + most;
    if reach <= MAX_COORDINATE {
        return Ok(());
    }
    Err(Failure::too_far(reach))
}

fn wrap_of(wrap: prismarch_wrap) -> Result<Wrap, Failure> {
    match wrap {
        c::prismarch_wrap_PRISMARCH_WRAP_REPEAT => Ok(Wrap::Repeat),
        c::prismarch_wrap_PRISMARCH_WRAP_CLAMP => Ok(Wrap::Clamp),
        c::prismarch_wrap_PRISMARCH_WRAP_MIRROR => Ok(Wrap::Mirror),
        other => Err(Failure::argument(format!(
            "wrap is {other}; expected a prismarch_wrap"
        ))),
    }
}

/// # Safety
///
/// Null, or a C string.
unsafe fn text<'a>(text: *const c_char, what: &str) -> Result<&'a str, Failure> {
    if text.is_null() {
        return Err(Failure::null(what));
    }
    // SAFETY: the caller's promise.
    unsafe { CStr::from_ptr(text) }
        .to_str()
        .map_err(|error| Failure::argument(format!("{what} is not UTF-8: {error}")))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_map_create(
    width: u32,
    height: u32,
    texels: *const prismarch_texels,
    wrap: prismarch_wrap,
    map: *mut *mut c::prismarch_map,
    error: *mut prismarch_error,
) -> prismarch_status {
    // SAFETY: pointers as the header asks.
    unsafe {
        answer(error, || {
            let out = output(map, "map")?;
            let texels = input(texels, "texels")?;
            let wrap = wrap_of(wrap)?;
            let (width, height) = (width as usize, height as usize);
            DisplacementMap::check_size(width, height)?;
            let texels = read_texels(&texels, width, height)?;
            *out = Map::create(DisplacementMap::new(width, height, texels, wrap)?)?;
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_map_load(
    path: *const c_char,
    channel: *const c_char,
    wrap: prismarch_wrap,
    map: *mut *mut c::prismarch_map,
    error: *mut prismarch_error,
) -> prismarch_status {
    // SAFETY: pointers as the header asks.
    unsafe {
        answer(error, || {
            let out = output(map, "map")?;
            let path = text(path, "path")?;
            let channel: Channel = if channel.is_null() {
                Channel::default()
            } else {
                let Ok(channel) = text(channel, "channel")?.parse();
                channel
            };
            *out = Map::create(load_heights(
                Path::new(path),
                &channel,
                wrap_of(wrap)?,
                None,
            )?)?;
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_map_size(
    map: *const c::prismarch_map,
    width: *mut u32,
    height: *mut u32,
    error: *mut prismarch_error,
) -> prismarch_status {
    // SAFETY: pointers as the header asks.
    unsafe {
        answer(error, || {
            let (w, h) = used::<Map, _>(map)?.map.size();
            let (width, height) = (output(width, "width")?, output(height, "height")?);
            (*width, *height) = (w as u32, h as u32);
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_map_update(
    map: *mut c::prismarch_map,
    x: u32,
    y: u32,
    width: u32,
    height: u32,
    texels: *const prismarch_texels,
    commit_needed: *mut bool,
    error: *mut prismarch_error,
) -> prismarch_status {
    // SAFETY: pointers as the header asks.
    unsafe {
        answer(error, || {
            let map = kept::<Map, _>(map)?;
            let texels = input(texels, "texels")?;
            let rect = TexelRect {
                x: x as usize,
                y: y as usize,
                width: width as usize,
                height: height as usize,
            };
            // Before anything is read: the rectangle says how much.
            map.map.range_in(rect)?;
            if kept_as(texels.format) != map.map.kind() {
                return Err(Failure::argument(format!(
                    "texels->format is {}; expected that of the map, {}",
                    texels.format,
                    map.map.kind()
                )));
            }
            let texels = read_texels(&texels, rect.width, rect.height)?;
            // One edit of a map at a time: another waits here, before it shuts surfaces.
            let _one = map.editing.lock().unwrap_or_else(PoisonError::into_inner);
            let surfaces = map.surfaces();
            let shut = surfaces.iter().map(|live| live.watch()?.shut());
            let shut = shut.collect::<Result<Vec<_>, _>>()?;
            shut.iter()
                .try_for_each(|surface| check_reach(surface, &texels))?;
            map.map.update(rect, &texels)?;
            let mut grown = false;
            for surface in shut {
                grown |= surface.now().map_edited(rect);
            }
            if !commit_needed.is_null() {
                commit_needed.write(grown);
            }
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_map_retain(map: *mut c::prismarch_map) -> prismarch_status {
    retain::<Map, _>(map)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_map_release(map: *mut c::prismarch_map) -> prismarch_status {
    release::<Map, _>(map)
}
