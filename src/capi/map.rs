//! Maps: `prismarch_map_*`.

use std::ffi::{CStr, c_char};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use super::buffer::{kept_as, read_texels};
use super::declarations::{
    self as c, prismarch_error, prismarch_status, prismarch_texels, prismarch_wrap,
};
use super::error::{Failure, answer};
use super::handle::{Handle, Kind, output};
use super::live::Live;
use crate::image::{Channel, load_heights};
use crate::surface::{DisplacementMap, TexelRect, Wrap};

/// A map, and who has it.
pub struct Map {
    pub map: Arc<DisplacementMap>,
    surfaces: Mutex<Vec<Weak<Live>>>,
}

impl Kind for Map {
    const MAGIC: u64 = u64::from_le_bytes(*b"pm map 1");
    const NAME: &'static str = "map";
}

impl Map {
    fn create(map: DisplacementMap) -> *const Handle<Self> {
        Handle::new(Self {
            map: Arc::new(map),
            surfaces: Mutex::default(),
        })
        .give()
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
            let texels = texels.as_ref().ok_or_else(|| Failure::null("texels"))?;
            let wrap = wrap_of(wrap)?;
            let (width, height) = (width as usize, height as usize);
            DisplacementMap::check_size(width, height)?;
            let texels = read_texels(texels, width, height)?;
            let made = DisplacementMap::new(width, height, texels, wrap)?;
            *out = Map::create(made).cast_mut().cast();
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
            let made = load_heights(Path::new(path), &channel, wrap_of(wrap)?, None)?;
            *out = Map::create(made).cast_mut().cast();
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
            let (w, h) = Handle::<Map>::borrow(map.cast())?.map.size();
            *output(width, "width")? = w as u32;
            *output(height, "height")? = h as u32;
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
            let map = Handle::<Map>::borrow(map.cast())?;
            let texels = texels.as_ref().ok_or_else(|| Failure::null("texels"))?;
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
            let texels = read_texels(texels, rect.width, rect.height)?;
            let surfaces = map.surfaces();
            if surfaces.iter().any(|live| live.is_traced()) {
                return Err(Failure::in_flight());
            }
            map.map.update(rect, &texels)?;
            let mut grown = false;
            for live in surfaces {
                grown |= live.map_edited(rect);
            }
            if let Some(out) = commit_needed.as_mut() {
                *out = grown;
            }
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_map_retain(map: *mut c::prismarch_map) -> prismarch_status {
    // SAFETY: pointers as the header asks.
    unsafe { Handle::<Map>::retain(map.cast()) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_map_release(map: *mut c::prismarch_map) -> prismarch_status {
    // SAFETY: pointers as the header asks.
    unsafe { Handle::<Map>::release(map.cast()) }
}
