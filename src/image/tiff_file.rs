//! TIFF through the `tiff` crate itself: `image` refuses grey floats, which is what displacement maps are.

use std::io::{BufRead, Seek};
use std::path::Path;

use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, Limits};

use super::error::check_size;
use super::raster::{Raster, Samples, channel_names};
use super::{Format, ImageError, MAX_PIXELS};

const EXPECTED: &str =
    "grey or RGB, with or without alpha, in 8- or 16-bit unsigned or float samples is expected";

/// Decodes the first picture of a TIFF file.
pub(super) fn decode(path: &Path, file: impl BufRead + Seek) -> Result<Raster, ImageError> {
    let failed = |error: tiff::TiffError| ImageError::decode(path, Format::Tiff, error);
    let unsupported = |found: String| ImageError::UnsupportedSamples {
        path: path.to_owned(),
        found,
        expected: EXPECTED,
    };
    let mut limits = Limits::default();
    limits.decoding_buffer_size = 16 * MAX_PIXELS as usize;
    limits.intermediate_buffer_size = limits.decoding_buffer_size;
    let mut decoder = Decoder::new(file).map_err(failed)?.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(failed)?;
    check_size(path, width.into(), height.into())?;
    let (width, height) = (width as usize, height as usize);
    let color = decoder.colortype().map_err(failed)?;
    let channels = match color {
        ColorType::Gray(_) => 1,
        ColorType::GrayA(_) | ColorType::Multiband { num_samples: 2, .. } => 2,
        ColorType::RGB(_) => 3,
        ColorType::RGBA(_) => 4,
        other => return Err(unsupported(format!("{other:?} pixels"))),
    };
    let bits = color.bit_depth();
    let mut decoded = DecodingResult::U8(Vec::new());
    let planes = decoder
        .read_image_to_buffer(&mut decoded)
        .map_err(failed)?
        .planes;
    let samples = match decoded {
        DecodingResult::U8(s) if matches!(bits, 1 | 2 | 4) && planes == 1 => {
            Samples::U8(unpack(&s, width * channels, bits.into()))
        }
        DecodingResult::U8(s) if bits == 8 => Samples::U8(interleave(s, planes)),
        DecodingResult::U16(s) if bits == 16 => Samples::U16(interleave(s, planes)),
        DecodingResult::F16(s) => {
            Samples::F32(interleave(s.iter().map(|h| h.to_f32()).collect(), planes))
        }
        DecodingResult::F32(s) => Samples::F32(interleave(s, planes)),
        DecodingResult::F64(s) => {
            Samples::F32(interleave(s.iter().map(|&d| d as f32).collect(), planes))
        }
        _ => return Err(unsupported(format!("{bits}-bit integer {color:?} samples"))),
    };
    let raster = Raster {
        width,
        height,
        channels: channel_names(channels),
        samples,
    };
    match raster.is_complete() {
        true => Ok(raster),
        // Samples that the colour type does not speak of, or planes that were left out.
        false => Err(unsupported(format!("{color:?} pixels with extra samples"))),
    }
}

/// Planes one after another become pixels.
fn interleave<T: Copy>(samples: Vec<T>, planes: usize) -> Vec<T> {
    if planes <= 1 {
        return samples;
    }
    let pixels = samples.len() / planes;
    (0..pixels)
        .flat_map(|pixel| (0..planes).map(move |plane| plane * pixels + pixel))
        .map(|index| samples[index])
        .collect()
}

/// Rows of 1-, 2- or 4-bit samples, each row padded to a byte, scaled to 0..=255.
fn unpack(packed: &[u8], samples_per_row: usize, bits: usize) -> Vec<u8> {
    let per_byte = 8 / bits;
    let max = (1u8 << bits) - 1;
    packed
        .chunks(samples_per_row.div_ceil(per_byte))
        .flat_map(|row| {
            (0..samples_per_row.min(row.len() * per_byte)).map(move |index| {
                let shift = 8 - bits * (index % per_byte + 1);
                (row[index / per_byte] >> shift & max) * (255 / max)
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_samples_fill_the_byte_range() {
        assert_eq!(
            unpack(&[0b1010_0000, 0b0100_0000], 3, 1),
            [255, 0, 255, 0, 255, 0]
        );
        assert_eq!(unpack(&[0b00_01_10_11], 4, 2), [0, 85, 170, 255]);
        assert_eq!(unpack(&[0x0f], 2, 4), [0, 255]);
    }

    #[test]
    fn planes_become_pixels() {
        assert_eq!(interleave(vec![1, 2, 3, 4, 5, 6], 3), [1, 3, 5, 2, 4, 6]);
        assert_eq!(interleave(vec![1, 2, 3], 1), [1, 2, 3]);
    }
}
