//! A decoded picture of interleaved samples: what all formats but OpenEXR have in common.

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use super::error::check_size;
use super::samples::{NoData, Samples};
use super::source::Input;
use super::{Format, ImageError, MAX_PIXELS, hdr_file, jpeg_scan, png_file, pnm_file, tiff};
use crate::files::guard::guarded;

/// A decoded picture.
pub(super) struct Raster {
    /// Pixels across, at least 1.
    pub width: usize,
    /// Pixels down, at least 1.
    pub height: usize,
    /// Names of the interleaved channels: Y, YA, RGB or RGBA; bands of TIFF beyond by their number, from 1.
    pub channels: Vec<String>,
    /// width * height * channels samples.
    pub samples: Samples,
    /// The value that the file declares to mean "no data".
    pub nodata: Option<NoData>,
}

/// Channel names of a pixel with so many samples.
pub(super) fn channel_names(samples_per_pixel: usize) -> Vec<String> {
    let names: &[&str] = match samples_per_pixel {
        1 => &["Y"],
        2 => &["Y", "A"],
        3 => &["R", "G", "B"],
        _ => &["R", "G", "B", "A"],
    };
    names.iter().map(|&name| name.to_owned()).collect()
}

/// One channel of interleaved rows, bottom row first.
pub(super) fn plane<T: Copy>(
    samples: &[T],
    width: usize,
    channels: usize,
    channel: usize,
) -> Vec<T> {
    let mut plane = Vec::with_capacity(samples.len() / channels);
    for row in samples.chunks_exact(width * channels).rev() {
        plane.extend(row[channel..].iter().step_by(channels));
    }
    plane
}

/// Decodes a picture of a format other than EXR.
pub(super) fn decode(input: Input) -> Result<Raster, ImageError> {
    let (path, format) = (input.path, input.format);
    // The crates mean never to panic; that is too much to rely on for every damaged file.
    guarded(|| decode_unguarded(input))
        .unwrap_or_else(|reason| Err(ImageError::decode(path, format, reason)))
}

fn decode_unguarded(mut input: Input) -> Result<Raster, ImageError> {
    match input.format {
        Format::Png => png_file::decode(input),
        Format::Jpeg => {
            let bytes = input.read_all()?;
            // The decoder fills the rest of a truncated picture with grey.
            jpeg_scan::check(&bytes).map_err(|reason| input.failed(reason))?;
            decode_with(&input, ImageFormat::Jpeg, bytes, u64::MAX)
        }
        Format::Tiff => tiff::decode(input.path, input.bytes),
        Format::Hdr => hdr_file::decode(input),
        Format::Pnm | Format::Pfm => pnm_file::decode(input),
        Format::WebP => {
            let bytes = input.read_all()?;
            let most = webp_pixels(&bytes).map_err(|reason| input.failed(reason))?;
            decode_with(&input, ImageFormat::WebP, bytes, most)
        }
        // Two bytes are a run of 255 pixels, in TGA of 128.
        Format::Bmp | Format::Tga => {
            let format = match input.format {
                Format::Bmp => ImageFormat::Bmp,
                _ => ImageFormat::Tga,
            };
            let bytes = input.read_all()?;
            let most = 128 * bytes.len() as u64;
            decode_with(&input, format, bytes, most)
        }
        Format::Exr => Err(input.failed("EXR has no interleaved samples")),
    }
}

/// Most pixels that these bytes of a WebP file can hold, if all of its chunks are there.
fn webp_pixels(bytes: &[u8]) -> Result<u64, String> {
    let riff = bytes.get(4..8).and_then(|size| size.first_chunk());
    let claimed = riff.map_or(u64::MAX, |&size| u64::from(u32::from_le_bytes(size)) + 8);
    // Without the byte that makes chunks even.
    if claimed > bytes.len() as u64 + 1 {
        let there = bytes.len();
        return Err(format!(
            "it has {there} bytes of {claimed}; it is truncated"
        ));
    }
    let lossless = bytes.windows(4).any(|name| name == b"VP8L");
    // A lossy block of 16 x 16 takes at least two bits for its modes; one colour without loss takes none at all.
    Ok(match lossless {
        true => u64::MAX,
        false => 1024 * bytes.len() as u64,
    })
}

/// Decodes through the `image` crate, unless the header claims more than `most_pixels`.
fn decode_with(
    input: &Input,
    image_format: ImageFormat,
    bytes: Vec<u8>,
    most_pixels: u64,
) -> Result<Raster, ImageError> {
    let length = bytes.len();
    let mut reader = ImageReader::with_format(Cursor::new(bytes), image_format);
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(16 * MAX_PIXELS); // four floats per pixel, the most there is
    reader.limits(limits);
    let failed = |error: image::ImageError| input.failed(error);
    let decoder = reader.into_decoder().map_err(failed)?;
    let (width, height) = decoder.dimensions();
    check_size(input.path, width.into(), height.into())?;
    if u64::from(width) * u64::from(height) > most_pixels {
        return Err(input.failed(format!(
            "{length} bytes cannot hold {width}x{height} pixels"
        )));
    }
    let picture = DynamicImage::from_decoder(decoder).map_err(failed)?;
    let channels = channel_names(picture.color().channel_count().into());
    let samples = match picture {
        DynamicImage::ImageLuma8(p) => Samples::U8(p.into_raw()),
        DynamicImage::ImageLumaA8(p) => Samples::U8(p.into_raw()),
        DynamicImage::ImageRgb8(p) => Samples::U8(p.into_raw()),
        DynamicImage::ImageRgba8(p) => Samples::U8(p.into_raw()),
        _ => return Err(input.failed("unknown kind of pixels")),
    };
    Ok(Raster {
        width: width as usize,
        height: height as usize,
        channels,
        samples,
        nodata: None,
    })
}
