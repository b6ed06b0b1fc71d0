//! Writing pictures. Rows are bottom first, as in memory; files hold them top first, as their formats want.

use std::io::{self, Write};
use std::path::Path;

use exr::math::Vec2;
use exr::meta::attribute::{AttributeValue, IntegerBounds};
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, Layer, LayerAttributes,
    Text, WritableImage,
};

use super::exr_picture::{ExrChannel, ExrPicture, ExrSamples};
use crate::files::output::{self, OutputError, Staged};

/// Writes an 8-bit RGB PNG, `pixels` sRGB-encoded, bottom row first, with `texts` (keyword, text) in it.
pub fn write_png_rgb8(
    path: &Path,
    width: usize,
    height: usize,
    pixels: &[[u8; 3]],
    texts: &[(String, String)],
) -> Result<(), OutputError> {
    stage_png_rgb8(path, width, height, pixels, texts)?.commit()
}

/// As [`write_png_rgb8`], short of the file's name.
pub(crate) fn stage_png_rgb8(
    path: &Path,
    width: usize,
    height: usize,
    pixels: &[[u8; 3]],
    texts: &[(String, String)],
) -> Result<Staged, OutputError> {
    let pixels = top_first(path, width, height, pixels)?;
    stage_png(path, width, height, pixels.as_flattened(), |info| {
        info.set_color(png::ColorType::Rgb);
        info.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        for (keyword, text) in texts {
            info.add_text_chunk(keyword.clone(), text.clone())?;
        }
        Ok(())
    })
}

/// Writes a 16-bit grey PNG, bottom row first. Fast rather than small.
pub fn write_png_gray16(
    path: &Path,
    width: usize,
    height: usize,
    heights: &[u16],
) -> Result<(), OutputError> {
    stage_png_gray16(path, width, height, heights)?.commit()
}

/// As [`write_png_gray16`], short of the file's name.
pub(crate) fn stage_png_gray16(
    path: &Path,
    width: usize,
    height: usize,
    heights: &[u16],
) -> Result<Staged, OutputError> {
    let heights = top_first(path, width, height, heights)?;
    let bytes: Vec<u8> = heights.iter().flat_map(|h| h.to_be_bytes()).collect();
    stage_png(path, width, height, &bytes, |info| {
        info.set_color(png::ColorType::Grayscale);
        info.set_depth(png::BitDepth::Sixteen);
        Ok(())
    })
}

fn stage_png(
    path: &Path,
    width: usize,
    height: usize,
    bytes: &[u8],
    describe: impl FnOnce(
        &mut png::Encoder<&mut io::BufWriter<&std::fs::File>>,
    ) -> Result<(), png::EncodingError>,
) -> Result<Staged, OutputError> {
    // A side beyond 32 bits holds more pixels than memory does; the encoder refuses what is beyond PNG's 31.
    let (width, height) = (width as u32, height as u32);
    output::stage(path, |file| {
        let mut encoder = png::Encoder::new(file, width, height);
        encoder.set_compression(png::Compression::Fast);
        let written = describe(&mut encoder).and_then(|()| {
            let mut writer = encoder.write_header()?;
            writer.write_image_data(bytes)?;
            writer.finish()
        });
        written.map_err(|error| match error {
            png::EncodingError::IoError(source) => source,
            other => io::Error::other(other),
        })
    })
}

/// Writes an EXR file of 32-bit float channels over the whole picture, compressed without loss, with text `attributes`
/// (name, value).
///
/// Samples are written as they are: linear light, NaN and infinity included. An empty list of channels, two of the same name or
/// an unusable attribute is [`OutputError::Failed`].
pub fn write_exr(
    path: &Path,
    width: usize,
    height: usize,
    channels: Vec<ExrChannel>,
    attributes: &[(&str, &str)],
) -> Result<(), OutputError> {
    let attributes = attributes
        .iter()
        .map(|&(name, value)| (name.into(), value.into()));
    let picture = ExrPicture {
        display: (width, height),
        position: (0, 0),
        width,
        height,
        channels,
        attributes: attributes.collect(),
    };
    write_exr_picture(path, picture)
}

/// Writes an EXR file of one layer, as [`write_exr`].
pub fn write_exr_picture(path: &Path, picture: ExrPicture) -> Result<(), OutputError> {
    let (width, height) = (picture.width, picture.height);
    let mut list = Vec::with_capacity(picture.channels.len());
    for channel in picture.channels {
        let samples = match channel.samples {
            ExrSamples::F32(s) => FlatSamples::F32(top_first(path, width, height, &s)?),
            ExrSamples::U32(s) => FlatSamples::U32(top_first(path, width, height, &s)?),
        };
        list.push(AnyChannel::new(text(path, &channel.name)?, samples));
    }
    let mut header = LayerAttributes {
        layer_position: Vec2(picture.position.0, picture.position.1),
        software_name: Some(Text::from(concat!("prismarch ", env!("CARGO_PKG_VERSION")))),
        ..LayerAttributes::default()
    };
    for (name, value) in &picture.attributes {
        let value = AttributeValue::Text(text(path, value)?);
        header.other.insert(text(path, name)?, value);
    }
    let layer = Layer::new(
        (width, height),
        header,
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(list.into()),
    );
    let display = IntegerBounds::from_dimensions(picture.display);
    let file = Image {
        attributes: ImageAttributes::new(display),
        layer_data: layer,
    };
    output::write(path, |out| {
        file.write()
            .to_buffered(&mut *out)
            .map_err(|error| match error {
                exr::error::Error::Io(source) => source,
                other => io::Error::other(other),
            })?;
        out.flush()
    })
}

/// EXR texts are Latin-1 at most.
fn text(path: &Path, value: &str) -> Result<Text, OutputError> {
    Text::new_or_none(value).ok_or_else(|| OutputError::Failed {
        path: path.to_owned(),
        source: io::Error::other(format!("{value:?} cannot be written as EXR text")),
    })
}

/// The pixels as files want them, when there are as many as the size says.
fn top_first<T: Copy>(
    path: &Path,
    width: usize,
    height: usize,
    pixels: &[T],
) -> Result<Vec<T>, OutputError> {
    if width == 0 || height == 0 || width.checked_mul(height) != Some(pixels.len()) {
        return Err(OutputError::WrongSize {
            path: path.to_owned(),
            width,
            height,
            found: pixels.len(),
        });
    }
    let mut flipped = Vec::with_capacity(pixels.len());
    for row in pixels.chunks_exact(width).rev() {
        flipped.extend_from_slice(row);
    }
    Ok(flipped)
}

#[cfg(test)]
mod tests;
