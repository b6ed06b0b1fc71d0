//! Writing pictures. Rows are bottom first, as in memory; files hold them top first, as their formats want.

use std::io::{self, Write};
use std::path::Path;

use exr::meta::attribute::AttributeValue;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, Text,
    WritableImage,
};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

use super::atomic::{self, OutputError};

/// Writes an 8-bit RGB PNG, `pixels` sRGB-encoded, bottom row first.
pub fn write_png_rgb8(
    path: &Path,
    width: usize,
    height: usize,
    pixels: &[[u8; 3]],
) -> Result<(), OutputError> {
    let pixels = top_first(path, width, height, pixels)?;
    write_png(
        path,
        width,
        height,
        pixels.as_flattened(),
        ExtendedColorType::Rgb8,
    )
}

/// Writes a 16-bit grey PNG, bottom row first. Fast rather than small.
pub fn write_png_gray16(
    path: &Path,
    width: usize,
    height: usize,
    heights: &[u16],
) -> Result<(), OutputError> {
    let heights = top_first(path, width, height, heights)?;
    let bytes = bytemuck::cast_slice(&heights);
    write_png(path, width, height, bytes, ExtendedColorType::L16)
}

fn write_png(
    path: &Path,
    width: usize,
    height: usize,
    bytes: &[u8],
    color: ExtendedColorType,
) -> Result<(), OutputError> {
    // A side beyond 32 bits holds more pixels than memory does; the encoder refuses what is beyond PNG's 31.
    let (width, height) = (width as u32, height as u32);
    atomic::write(path, |file| {
        PngEncoder::new_with_quality(file, CompressionType::Fast, FilterType::Adaptive)
            .write_image(bytes, width, height, color)
            .map_err(|error| match error {
                image::ImageError::IoError(source) => source,
                other => io::Error::other(other),
            })
    })
}

/// One channel of an EXR file.
#[derive(Clone, Debug)]
pub struct ExrChannel {
    /// `R`, `G`, `B`, `A`, or `layer.channel`, as OpenEXR names the channels of layers.
    pub name: String,
    /// Samples, bottom row first.
    pub samples: Vec<f32>,
}

impl ExrChannel {
    /// The channels of an RGB picture; with a layer's name, those of that layer.
    pub fn rgb(layer: Option<&str>, pixels: &[[f32; 3]]) -> [Self; 3] {
        [("R", 0), ("G", 1), ("B", 2)].map(|(channel, index)| Self {
            name: match layer {
                Some(layer) => format!("{layer}.{channel}"),
                None => channel.to_owned(),
            },
            samples: pixels.iter().map(|pixel| pixel[index]).collect(),
        })
    }
}

/// Writes an EXR file of 32-bit float channels, compressed without loss, with text `attributes` (name, value).
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
    let mut list = Vec::with_capacity(channels.len());
    for channel in channels {
        let samples = top_first(path, width, height, &channel.samples)?;
        let name = text(path, &channel.name)?;
        list.push(AnyChannel::new(name, FlatSamples::F32(samples)));
    }
    let mut header = LayerAttributes::default();
    for (name, value) in attributes {
        header
            .other
            .insert(text(path, name)?, AttributeValue::Text(text(path, value)?));
    }
    let layer = Layer::new(
        (width, height),
        header,
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(list.into()),
    );
    let picture = Image::from_layer(layer);
    atomic::write(path, |file| {
        picture
            .write()
            .to_buffered(&mut *file)
            .map_err(|error| match error {
                exr::error::Error::Io(source) => source,
                other => io::Error::other(other),
            })?;
        file.flush()
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
