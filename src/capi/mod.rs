//! The C library: what `ffi/prismarch.h` declares.
//!
//! `error` turns results and panics into statuses, `handle` looks handles up, `pins` tells who uses what at this moment, `desc` and `buffer` read the
//! caller's descriptions and arrays, `base` makes meshes of them, `live` is what rays and updates meet in; `map`, `surface` and `geometry` have
//! the functions.

#![allow(unsafe_code)] // pointers from C; each block says what the caller has promised
#![allow(clippy::missing_safety_doc)] // the header says what pointers must be

mod base;
mod buffer;
mod declarations;
mod desc;
mod error;
mod geometry;
mod handle;
mod live;
mod map;
mod pins;
mod surface;
#[cfg(test)]
mod tests;

/// Version of the library: major * 10000 + minor * 100 + patch.
#[unsafe(no_mangle)]
pub extern "C" fn prismarch_version() -> u32 {
    let part = |text: &str| text.parse::<u32>().unwrap_or(0);
    part(env!("CARGO_PKG_VERSION_MAJOR")) * 10_000
        + part(env!("CARGO_PKG_VERSION_MINOR")) * 100
        + part(env!("CARGO_PKG_VERSION_PATCH"))
}

/// Version of the Embree headers that it was built against, in the same form.
#[unsafe(no_mangle)]
pub extern "C" fn prismarch_embree_version() -> u32 {
    crate::embree::raw::version()
}
