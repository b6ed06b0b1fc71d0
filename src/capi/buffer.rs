//! Arrays in the caller's memory.

use std::marker::PhantomData;

use super::declarations::{self as c, prismarch_buffer, prismarch_texels, prismarch_vertices};
use super::error::Failure;
use crate::surface::{TexelKind, Texels};

/// An item of a buffer: any bits are a value.
pub trait Item: Copy {}

impl Item for u32 {}
impl Item for f32 {}

/// An array that goes nowhere beyond the address space: so much can be told without a look at it.
pub struct Array<'a, T, const N: usize> {
    first: *const u8,
    stride: usize,
    count: usize,
    what: &'a str,
    items: PhantomData<[T; N]>,
}

impl<'a, T: Item, const N: usize> Array<'a, T, N> {
    /// `count` items of N numbers each; `None` where there is no array.
    pub fn new(
        buffer: &prismarch_buffer,
        count: usize,
        what: &'a str,
    ) -> Result<Option<Self>, Failure> {
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
        let bytes = last
            .checked_mul(stride)
            .and_then(|bytes| bytes.checked_add(buffer.offset)?.checked_add(tight))
            .filter(|&bytes| bytes <= isize::MAX as usize);
        if bytes
            .and_then(|bytes| buffer.data.addr().checked_add(bytes))
            .is_none()
        {
            return Err(Failure::argument(format!(
                "{count} {what} of {stride} bytes each, {} bytes behind {:p}, go beyond the address space",
                buffer.offset, buffer.data
            )));
        }
        Ok(Some(Self {
            first: buffer.data.cast::<u8>().wrapping_add(buffer.offset),
            stride,
            count,
            what,
            items: PhantomData,
        }))
    }

    /// # Safety
    ///
    /// All items are readable.
    pub unsafe fn read(&self) -> Result<Vec<[T; N]>, Failure> {
        let mut all = reserved(self.count, self.what)?;
        // SAFETY: readable by the caller's promise; no alignment is asked.
        let item = |i: usize| unsafe {
            self.first
                .add(i * self.stride)
                .cast::<[T; N]>()
                .read_unaligned()
        };
        all.extend((0..self.count).map(item));
        Ok(all)
    }
}

/// Room for as many items as a caller speaks of.
fn reserved<T>(count: usize, what: &str) -> Result<Vec<T>, Failure> {
    let mut all = Vec::new();
    all.try_reserve_exact(count).map_err(|_| {
        let bytes = count.saturating_mul(size_of::<T>());
        Failure::memory(format_args!("{count} {what}"), bytes)
    })?;
    Ok(all)
}

/// Positions, and normals where there are some.
pub struct Vertices {
    pub positions: Vec<[f32; 3]>,
    pub normals: Option<Vec<[f32; 3]>>,
}

/// [`Vertices`] that were not read yet.
pub struct VertexArrays {
    positions: Array<'static, f32, 3>,
    normals: Option<Array<'static, f32, 3>>,
}

impl VertexArrays {
    pub fn new(vertices: &prismarch_vertices, count: usize) -> Result<Self, Failure> {
        Ok(Self {
            positions: Array::new(&vertices.positions, count, "positions")?
                .ok_or_else(|| Failure::null("vertices.positions.data"))?,
            normals: Array::new(&vertices.normals, count, "normals")?,
        })
    }

    /// # Safety
    ///
    /// All items are readable.
    pub unsafe fn read(&self) -> Result<Vertices, Failure> {
        // SAFETY: the caller's promise.
        unsafe {
            Ok(Vertices {
                positions: self.positions.read()?,
                normals: self.normals.as_ref().map(|all| all.read()).transpose()?,
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
                let mut all = reserved(bits.len(), "texels")?;
                all.extend(bits.into_iter().map(wide));
                Ok(Texels::F32(all))
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
    // In bytes behind the first texel, of the first and of the last one in memory.
    let reach = |stride: isize, count: usize| {
        let last = i128::from(stride as i64) * (count.max(1) - 1) as i128;
        [last.min(0), last.max(0)]
    };
    let ([left, right], [down, top]) = (reach(across, width), reach(up, height));
    let first = texels.data.addr() as i128;
    let (from, to) = (first + left + down, first + right + top + size as i128);
    if from < 0 || to > usize::MAX as i128 || to - from > isize::MAX as i128 {
        return Err(Failure::argument(format!(
            "texels with strides {across} and {up} go beyond the address space"
        )));
    }
    let mut all = reserved(width * height, "texels")?;
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
