//! A decoded picture of interleaved samples: what PNG, JPEG, TIFF and Radiance HDR have in common.

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read, Seek};
use std::path::Path;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use super::error::check_size;
use super::samples::{NoData, Samples};
use super::tiff;
use super::{Format, ImageError, MAX_PIXELS};

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

/// Decodes the file of a format other than EXR.
pub(super) fn decode(
    path: &Path,
    format: Format,
    file: BufReader<File>,
) -> Result<Raster, ImageError> {
    match format {
        Format::Png => decode_with(path, format, ImageFormat::Png, file),
        Format::Hdr => decode_with(path, format, ImageFormat::Hdr, file),
        Format::Jpeg => decode_jpeg(path, file),
        Format::Tiff => tiff::decode(path, file),
        Format::Exr => Err(ImageError::decode(
            path,
            format,
            "EXR has no interleaved samples",
        )),
    }
}

/// The decoder fills the rest of a truncated JPEG with grey; the end marker says whether all of it is there.
fn decode_jpeg(path: &Path, mut file: BufReader<File>) -> Result<Raster, ImageError> {
    const START_OF_SCAN: [u8; 2] = [0xff, 0xda];
    const END_OF_IMAGE: [u8; 2] = [0xff, 0xd9];
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)
        .map_err(|source| ImageError::Read {
            path: path.to_owned(),
            source,
        })?;
    let last = |marker: [u8; 2]| bytes.windows(2).rposition(|pair| pair == marker);
    // Coded data never holds the end marker, so one behind the last scan's start is the picture's own.
    if last(END_OF_IMAGE) <= last(START_OF_SCAN) {
        return Err(ImageError::decode(
            path,
            Format::Jpeg,
            "the end of the file is missing",
        ));
    }
    decode_with(path, Format::Jpeg, ImageFormat::Jpeg, Cursor::new(bytes))
}

fn decode_with(
    path: &Path,
    format: Format,
    image_format: ImageFormat,
    reader: impl BufRead + Seek,
) -> Result<Raster, ImageError> {
    let failed = |error: image::ImageError| match error {
        image::ImageError::IoError(source)
            if source.kind() != std::io::ErrorKind::UnexpectedEof =>
        {
            ImageError::Read {
                path: path.to_owned(),
                source,
            }
        }
        other => ImageError::decode(path, format, other),
    };
    let mut reader = ImageReader::with_format(reader, image_format);
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(16 * MAX_PIXELS); // four floats per pixel, the most there is
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(failed)?;
    let (width, height) = decoder.dimensions();
    check_size(path, width.into(), height.into())?;
    let picture = DynamicImage::from_decoder(decoder).map_err(failed)?;
    let channels = channel_names(picture.color().channel_count().into());
    let samples = match picture {
        DynamicImage::ImageLuma8(p) => Samples::U8(p.into_raw()),
        DynamicImage::ImageLumaA8(p) => Samples::U8(p.into_raw()),
        DynamicImage::ImageRgb8(p) => Samples::U8(p.into_raw()),
        DynamicImage::ImageRgba8(p) => Samples::U8(p.into_raw()),
        DynamicImage::ImageLuma16(p) => Samples::U16(p.into_raw()),
        DynamicImage::ImageLumaA16(p) => Samples::U16(p.into_raw()),
        DynamicImage::ImageRgb16(p) => Samples::U16(p.into_raw()),
        DynamicImage::ImageRgba16(p) => Samples::U16(p.into_raw()),
        DynamicImage::ImageRgb32F(p) => Samples::F32(p.into_raw()),
        DynamicImage::ImageRgba32F(p) => Samples::F32(p.into_raw()),
        _ => return Err(ImageError::decode(path, format, "unknown kind of pixels")),
    };
    Ok(Raster {
        width: width as usize,
        height: height as usize,
        channels,
        samples,
        nodata: None,
    })
}
