//! Arrays in the caller's memory.

use super::declarations::{self as c, prismarch_buffer, prismarch_texels, prismarch_vertices};
use super::error::Failure;
use crate::surface::{TexelKind, Texels};

/// An item of a buffer: any bits are a value.
pub trait Item: Copy {}

impl Item for u32 {}
impl Item for f32 {}

/// Reads `count` items of N numbers each; `None` where there is no array.
///
/// # Safety
///
/// Where `data` is not null, all items are readable.
pub unsafe fn read<T: Item, const N: usize>(
    buffer: &prismarch_buffer,
    count: usize,
    what: &str,
) -> Result<Option<Vec<[T; N]>>, Failure> {
    if buffer.data.is_null() {
        return Ok(None);
    }
    let tight = size_of::<[T; N]>();
    let stride = if buffer.stride == 0 {
        tight
    } else {
        buffer.stride
    };
    if stride < tight {
        return Err(Failure::argument(format!(
            "the stride of the {what} is {stride} bytes; expected 0 or at least {tight}"
        )));
    }
    let last = count.saturating_sub(1);
    let fits = last
        .checked_mul(stride)
        .and_then(|bytes| bytes.checked_add(buffer.offset)?.checked_add(tight));
    if fits.is_none_or(|bytes| bytes > isize::MAX as usize) {
        return Err(Failure::argument(format!(
            "{count} {what} of {stride} bytes each go beyond the address space"
        )));
    }
    // SAFETY: readable by the caller's promise; no alignment is asked.
    let item = |i: usize| unsafe {
        buffer
            .data
            .cast::<u8>()
            .add(buffer.offset + i * stride)
            .cast::<[T; N]>()
            .read_unaligned()
    };
    Ok(Some((0..count).map(item).collect()))
}

/// Positions, and normals where there are some.
pub struct Vertices {
    pub positions: Vec<[f32; 3]>,
    pub normals: Option<Vec<[f32; 3]>>,
}

impl Vertices {
    /// # Safety
    ///
    /// As for [`read`].
    pub unsafe fn read(vertices: &prismarch_vertices, count: usize) -> Result<Self, Failure> {
        // SAFETY: the caller's promise.
        unsafe {
            Ok(Self {
                positions: read(&vertices.positions, count, "positions")?
                    .ok_or_else(|| Failure::null("vertices.positions.data"))?,
                normals: read(&vertices.normals, count, "normals")?,
            })
        }
    }
}

/// Texels of a rectangle, row 0 first.
///
/// # Safety
///
/// Where `data` is not null, all texels are readable.
pub unsafe fn read_texels(
    texels: &prismarch_texels,
    width: usize,
    height: usize,
) -> Result<Texels, Failure> {
    if texels.data.is_null() {
        return Err(Failure::null("texels->data"));
    }
    // SAFETY: the caller's promise.
    unsafe {
        match texels.format {
            c::prismarch_texel_PRISMARCH_TEXEL_U8 => gather(texels, width, height).map(Texels::U8),
            c::prismarch_texel_PRISMARCH_TEXEL_U16 => {
                gather(texels, width, height).map(Texels::U16)
            }
            c::prismarch_texel_PRISMARCH_TEXEL_F16 => {
                let bits = gather::<u16>(texels, width, height)?;
                let wide = |bits| half::f16::from_bits(bits).to_f32();
                Ok(Texels::F32(bits.into_iter().map(wide).collect()))
            }
            c::prismarch_texel_PRISMARCH_TEXEL_F32 => {
                gather(texels, width, height).map(Texels::F32)
            }
            other => Err(Failure::argument(format!(
                "texels->format is {other}; expected a prismarch_texel"
            ))),
        }
    }
}

/// What texels of a format are kept as.
pub fn kept_as(format: c::prismarch_texel) -> TexelKind {
    match format {
        c::prismarch_texel_PRISMARCH_TEXEL_U8 => TexelKind::U8,
        c::prismarch_texel_PRISMARCH_TEXEL_U16 => TexelKind::U16,
        _ => TexelKind::F32,
    }
}

/// # Safety
///
/// As for [`read_texels`], with a T that any bits are a value of.
unsafe fn gather<T: Copy>(
    texels: &prismarch_texels,
    width: usize,
    height: usize,
) -> Result<Vec<T>, Failure> {
    let size = size_of::<T>() as isize;
    let or = |stride: isize, tight: isize| if stride == 0 { tight } else { stride };
    let across = or(texels.texel_stride, size);
    let up = or(texels.row_stride, across.saturating_mul(width as isize));
    let reach =
        |stride: isize, count: usize| stride.unsigned_abs().checked_mul(count.saturating_sub(1));
    let fits = reach(across, width)
        .zip(reach(up, height))
        .and_then(|(a, b)| a.checked_add(b))
        .is_some_and(|bytes| bytes < isize::MAX as usize / 2);
    if !fits {
        return Err(Failure::argument(format!(
            "texels with strides {across} and {up} go beyond the address space"
        )));
    }
    let mut all = Vec::with_capacity(width * height);
    for j in 0..height as isize {
        for i in 0..width as isize {
            // SAFETY: readable by the caller's promise; no alignment is asked.
            all.push(unsafe {
                texels
                    .data
                    .cast::<u8>()
                    .offset(j * up + i * across)
                    .cast::<T>()
                    .read_unaligned()
            });
        }
    }
    Ok(all)
}
