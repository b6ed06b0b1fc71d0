//! From strips and tiles to the samples of the picture.

use std::io::{BufRead, Seek};

use half::f16;

use super::Fault;
use super::codec::Codec;
use super::directory::{Order, Source};
use super::jpeg;
use super::layout::{Kind, Layout, Photometric};
use crate::image::samples::{Number, Samples};

/// All samples, interleaved. Integers of odd sizes fill the range of the next larger type, indices excepted.
pub(super) fn read<R: BufRead + Seek>(
    source: &mut Source<R>,
    layout: &Layout,
) -> Result<Samples, Fault> {
    let order = source.order;
    macro_rules! whole {
        ($variant:ident, $type:ty) => {
            Samples::$variant(match order {
                Order::Little => {
                    gather(source, layout, |row, i| <$type>::from_le_bytes(at(row, i)))?
                }
                Order::Big => gather(source, layout, |row, i| <$type>::from_be_bytes(at(row, i)))?,
            })
        };
    }
    let bits = layout.bits;
    Ok(match (layout.kind, bits) {
        (Kind::Unsigned, _) => {
            let mut samples = match bits {
                8 => whole!(U8, u8),
                16 => whole!(U16, u16),
                32 => whole!(U32, u32),
                64 => whole!(U64, u64),
                _ => packed(source, layout)?,
            };
            if layout.photometric == Photometric::WhiteIsZero {
                invert(&mut samples);
            }
            samples
        }
        (Kind::Signed, 8) => whole!(I8, i8),
        (Kind::Signed, 16) => whole!(I16, i16),
        (Kind::Signed, 32) => whole!(I32, i32),
        (Kind::Signed, 64) => whole!(I64, i64),
        (Kind::Signed, _) => {
            let read = |row: &[u8], i| signed(bits_at(row, i, bits, order), bits);
            Samples::I32(gather(source, layout, read)?)
        }
        (Kind::Float, 16) => whole!(F16, f16),
        (Kind::Float, 24) => {
            let read = |row: &[u8], i| float24(bits_at(row, i, 24, order));
            Samples::F32(gather(source, layout, read)?)
        }
        (Kind::Float, 32) => whole!(F32, f32),
        (Kind::Float, _) => whole!(F64, f64),
    })
}

/// What a number of the file is among the samples of [`read`].
pub(super) fn as_read(layout: &Layout, number: Number) -> Number {
    if layout.kind != Kind::Unsigned {
        return number;
    }
    let largest = (1i128 << layout.bits) - 1;
    let most = (1i128 << container(layout.bits)) - 1;
    let code = |code: i128| {
        let code = match most == largest {
            true => code,
            false => (code * most + largest / 2) / largest,
        };
        match layout.photometric {
            Photometric::WhiteIsZero => most - code,
            _ => code,
        }
    };
    Number {
        integer: number
            .integer
            .filter(|integer| (0..=largest).contains(integer))
            .map(code),
        ..number
    }
}

/// Bits of the type that holds unsigned integers of so many bits.
fn container(bits: usize) -> u32 {
    match bits {
        ..=8 => 8,
        9..=16 => 16,
        17..=32 => 32,
        _ => 64,
    }
}

/// Unsigned integers of an odd size.
fn packed<R: BufRead + Seek>(source: &mut Source<R>, layout: &Layout) -> Result<Samples, Fault> {
    let (bits, order) = (layout.bits, source.order);
    let largest = (1u64 << bits) - 1;
    let scaled = |row: &[u8], i, most: u64| {
        let code = bits_at(row, i, bits, order);
        match layout.photometric {
            Photometric::Palette(_) => code,
            _ => (code * most + largest / 2) / largest,
        }
    };
    Ok(match container(bits) {
        8 => Samples::U8(gather(source, layout, |row, i| {
            scaled(row, i, u8::MAX.into()) as u8
        })?),
        16 => Samples::U16(gather(source, layout, |row, i| {
            scaled(row, i, u16::MAX.into()) as u16
        })?),
        _ => Samples::U32(gather(source, layout, |row, i| {
            scaled(row, i, u32::MAX.into()) as u32
        })?),
    })
}

fn invert(samples: &mut Samples) {
    match samples {
        Samples::U8(samples) => samples.iter_mut().for_each(|x| *x = !*x),
        Samples::U16(samples) => samples.iter_mut().for_each(|x| *x = !*x),
        Samples::U32(samples) => samples.iter_mut().for_each(|x| *x = !*x),
        Samples::U64(samples) => samples.iter_mut().for_each(|x| *x = !*x),
        // Only unsigned integers have a white to be counted from.
        _ => {}
    }
}

/// Sample `i` of a row of samples of `N` bytes.
fn at<const N: usize>(row: &[u8], i: usize) -> [u8; N] {
    row.as_chunks().0[i]
}

/// Sample `i` of a row of samples of up to 32 bits. Whole bytes are in the file's order; all else is a stream of bits,
/// the highest first.
fn bits_at(row: &[u8], i: usize, bits: usize, order: Order) -> u64 {
    if bits == 24 && order == Order::Little {
        let [a, b, c] = at(row, i);
        return u32::from_le_bytes([a, b, c, 0]).into();
    }
    let (start, end) = (i * bits, (i + 1) * bits);
    let bytes = &row[start / 8..end.div_ceil(8)];
    let joined = bytes
        .iter()
        .fold(0, |joined, &byte| joined << 8 | u64::from(byte));
    let behind = end.next_multiple_of(8) - end;
    joined >> behind & ((1 << bits) - 1)
}

/// A number of `bits` bits in two's complement.
fn signed(code: u64, bits: usize) -> i32 {
    let shift = 32 - bits;
    (code as i32) << shift >> shift
}

/// One bit of sign, 7 of exponent (bias 63), 16 of mantissa (Adobe Photoshop TIFF technical note 3).
fn float24(code: u64) -> f32 {
    let sign = if code >> 23 == 1 { -1.0 } else { 1.0 };
    let exponent = (code >> 16 & 0x7f) as i32;
    let mantissa = (code & 0xffff) as f32 / 65536.0;
    sign * match exponent {
        0 => mantissa * 2f32.powi(-62),
        0x7f if mantissa == 0.0 => f32::INFINITY,
        0x7f => f32::NAN,
        _ => (1.0 + mantissa) * 2f32.powi(exponent - 63),
    }
}

/// All samples by `read`, which gets a row of a chunk and the number of a sample in it.
fn gather<T: Copy + Default, R: BufRead + Seek>(
    source: &mut Source<R>,
    layout: &Layout,
    read: impl Fn(&[u8], usize) -> T,
) -> Result<Vec<T>, Fault> {
    let (width, samples) = (layout.width, layout.channels.len());
    let (across, down) = (layout.across(), layout.down());
    let mut out = Vec::new();
    for band in 0..down {
        let rows = layout
            .chunk_height
            .min(layout.height - band * layout.chunk_height);
        // All of them, before there is room for what they hold.
        let mut chunks = Vec::new();
        for plane in 0..layout.planes() {
            for column in 0..across {
                let index = (plane * down + band) * across + column;
                chunks.push(chunk(source, layout, index, rows)?);
            }
        }
        let start = out.len();
        let added = rows * width * samples;
        out.try_reserve(added)
            .map_err(|_| Fault::broken("no memory for its pixels"))?;
        out.resize(start + added, T::default());
        for (index, chunk) in chunks.iter().enumerate() {
            let (plane, column) = (index / across, index % across);
            let left = column * layout.chunk_width;
            let columns = layout.chunk_width.min(width - left);
            let step = if layout.planar { samples } else { 1 };
            for (row, line) in chunk.chunks_exact(layout.row_bytes()).enumerate() {
                let first = start + (row * width + left) * samples + plane;
                for i in 0..columns * layout.chunk_samples() {
                    out[first + i * step] = read(line, i);
                }
            }
        }
    }
    Ok(out)
}

/// The first `rows` rows of a strip or tile, predictor undone.
fn chunk<R: BufRead + Seek>(
    source: &mut Source<R>,
    layout: &Layout,
    index: usize,
    rows: usize,
) -> Result<Vec<u8>, Fault> {
    let name = layout.name(index);
    let wanted = layout.row_bytes() * rows;
    let offset = layout.offsets[index];
    if offset == 0 {
        return Err(Fault::broken(format!(
            "{name} is left out: sparse files are not read"
        )));
    }
    let count = match (&layout.codec, layout.counts[index]) {
        (Codec::None, Some(count)) => count.min(wanted as u64),
        (Codec::None, None) => wanted as u64,
        (_, Some(count)) => count,
        // One compressed strip of unknown size ends where it says so.
        (_, None) if layout.offsets.len() == 1 => source.rest(offset),
        (_, None) => return Err(Fault::broken(format!("{name} has no size"))),
    };
    let mut data = source.bytes(offset, count, &name)?;
    let failed = |reason: String| Fault::broken(format!("{name}: {reason}"));
    let mut pixels = match &layout.codec {
        Codec::Jpeg { tables } => {
            let expected = jpeg::Expected {
                width: layout.chunk_width,
                rows,
                samples: layout.chunk_samples(),
                to_rgb: layout.photometric == Photometric::YCbCr && !layout.planar,
            };
            jpeg::decode(tables, &data, &expected).map_err(failed)?
        }
        codec => {
            if layout.reversed_bits {
                data.iter_mut().for_each(|byte| *byte = byte.reverse_bits());
            }
            match codec {
                Codec::None => data,
                codec => codec.decompress(&data, wanted).map_err(failed)?,
            }
        }
    };
    if pixels.len() < wanted {
        return Err(Fault::broken(format!(
            "{name} ends after {} of {wanted} bytes of pixels",
            pixels.len()
        )));
    }
    for row in pixels.chunks_exact_mut(layout.row_bytes()) {
        layout
            .predictor
            .undo(row, layout.bits, layout.chunk_samples(), source.order);
    }
    Ok(pixels)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_of_any_size_are_found_among_bits() {
        let row = [0b1010_0101, 0b1100_0011, 0b0000_1111, 0, 0xff];
        assert_eq!(bits_at(&row, 2, 1, Order::Little), 1);
        assert_eq!(bits_at(&row, 1, 3, Order::Big), 0b001);
        assert_eq!(bits_at(&row, 1, 12, Order::Little), 0b0011_0000_1111);
        assert_eq!(bits_at(&row, 0, 31, Order::Big), 0x52e1_8780);
        assert_eq!(
            bits_at(&[1, 2, 3, 4, 5, 6], 1, 24, Order::Little),
            0x06_0504
        );
        assert_eq!(bits_at(&[1, 2, 3, 4, 5, 6], 1, 24, Order::Big), 0x04_0506);
        assert_eq!(signed(0b1000, 4), -8);
        assert_eq!(signed(0b0111, 4), 7);
    }

    #[test]
    fn floats_of_24_bits_are_widened() {
        assert_eq!(float24(0x3f_0000), 1.0);
        assert_eq!(float24(0xc0_8000), -3.0);
        assert_eq!(float24(1), 2f32.powi(-78));
        assert_eq!(float24(0x7f_0000), f32::INFINITY);
        assert!(float24(0x7f_0001).is_nan());
    }
}
