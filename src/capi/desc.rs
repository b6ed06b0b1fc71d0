//! Descriptions of surfaces, of this version's size, and of those of older and newer ones.
//!
//! A version adds fields at the end, and there are no gaps that a later one might use: so a size says which fields there are. What a caller's
//! description lacks takes its default; what this version does not know must be zero.

use std::mem::{MaybeUninit, offset_of};

use super::declarations::{prismarch_march_PRISMARCH_MARCH_EXACT, prismarch_surface_desc};
use super::error::Failure;

const SIZE: usize = size_of::<prismarch_surface_desc>();
/// In version 0.1.0: all fields before `has_filter`.
pub const FIRST_SIZE: usize = offset_of!(prismarch_surface_desc, has_filter);
/// No version will have a larger one.
const LARGEST_SIZE: usize = 4096;

fn check_size(size: usize) -> Result<(), Failure> {
    if (FIRST_SIZE..=LARGEST_SIZE).contains(&size) {
        return Ok(());
    }
    Err(Failure::argument(format!(
        "desc->struct_size is {size}; expected {FIRST_SIZE} to {LARGEST_SIZE}, {SIZE} in this version: call prismarch_surface_desc_init first"
    )))
}

fn defaults() -> prismarch_surface_desc {
    // SAFETY: pointers, numbers and a bool, all of which may be zero.
    let zero: prismarch_surface_desc = unsafe { MaybeUninit::zeroed().assume_init() };
    prismarch_surface_desc {
        struct_size: SIZE,
        scale: 1.0,
        march: prismarch_march_PRISMARCH_MARCH_EXACT,
        step: 1.0,
        time_step_count: 1,
        has_filter: true,
        ..zero
    }
}

/// Fills a caller's description.
///
/// # Safety
///
/// `desc` is null or valid for a write of `size` bytes.
pub unsafe fn init(desc: *mut prismarch_surface_desc, size: usize) -> Result<(), Failure> {
    if desc.is_null() {
        return Err(Failure::null("desc"));
    }
    check_size(size)?;
    let defaults = prismarch_surface_desc {
        struct_size: size,
        ..defaults()
    };
    // SAFETY: the caller's promise; the defaults have SIZE bytes, padding among them.
    unsafe {
        desc.cast::<u8>().write_bytes(0, size);
        std::ptr::from_ref(&defaults)
            .cast::<MaybeUninit<u8>>()
            .copy_to_nonoverlapping(desc.cast(), size.min(SIZE));
    }
    Ok(())
}

/// A caller's description as this version has it.
///
/// # Safety
///
/// `desc` is null or valid for a read of as many bytes as its first field says.
pub unsafe fn read(desc: *const prismarch_surface_desc) -> Result<prismarch_surface_desc, Failure> {
    if desc.is_null() {
        return Err(Failure::null("desc"));
    }
    // SAFETY: the caller's promise: the size is there, and then as much as it says; no alignment is asked.
    unsafe {
        let size = desc.cast::<usize>().read_unaligned();
        check_size(size)?;
        let bytes = desc.cast::<u8>();
        if (SIZE..size).any(|i| bytes.add(i).read() != 0) {
            return Err(Failure::argument(format!(
                "desc has fields that this version of prismarch does not know: what is behind its {SIZE} bytes must be zero"
            )));
        }
        let mut known = MaybeUninit::new(defaults());
        let filled = known.as_mut_ptr().cast::<MaybeUninit<u8>>();
        filled.copy_from_nonoverlapping(bytes.cast(), size.min(SIZE));
        // A C caller's bool may be any byte, ours may not.
        let has_filter = filled.cast::<u8>().add(FIRST_SIZE);
        has_filter.write(u8::from(has_filter.read() != 0));
        let known = known.assume_init();
        if known.reserved != [0; 7] {
            return Err(Failure::argument(
                "desc->reserved must be zero: call prismarch_surface_desc_init first",
            ));
        }
        Ok(known)
    }
}
