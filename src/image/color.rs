//! Colour pictures: textures for materials.

use std::fmt;
use std::path::Path;

use glam::{Vec2, Vec3};

use super::channel::{self, Channel};
use super::exr_file::ExrFile;
use super::raster::{self, Raster};
use super::samples::{Sample as _, Samples, each_type};
use super::source::Source;
use super::srgb::{self, srgb_decode};
use super::{Format, ImageError, fingerprint};
use crate::surface::Wrap;

/// What the numbers of an integer picture mean. Float pictures are linear whatever is said.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ColorSpace {
    /// sRGB-encoded.
    #[default]
    Srgb,
    /// Proportional to light.
    Linear,
}

/// A colour picture, bottom row first. Alpha is dropped; a grey picture has its grey in all three channels.
#[derive(Clone)]
pub struct ColorImage {
    /// Pixels across.
    pub width: usize,
    /// Pixels up.
    pub height: usize,
    /// What the pixels are stored as.
    pub pixels: ColorPixels,
}

/// Pixels in the precision they came in.
#[derive(Clone, Debug)]
pub enum ColorPixels {
    /// 8-bit sRGB-encoded RGB.
    Srgb8(Vec<[u8; 3]>),
    /// Linear RGB, finite.
    Linear(Vec<[f32; 3]>),
}

/// Size and fingerprint, not every pixel.
impl fmt::Debug for ColorImage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (kind, bytes): (_, &[u8]) = match &self.pixels {
            ColorPixels::Srgb8(pixels) => ("sRGB", pixels.as_flattened()),
            ColorPixels::Linear(pixels) => ("linear", bytemuck::cast_slice(pixels)),
        };
        let (width, height) = (self.width, self.height);
        write!(
            f,
            "ColorImage({width}x{height} {kind} {})",
            fingerprint(bytes)
        )
    }
}

impl ColorImage {
    /// Linear RGB at texture coordinates `st`: bilinear in linear light, pixel centres at (i + 0.5) / width, v up.
    /// Outside it goes on by the wrap modes across and up. Coordinates that are not finite read as 0.
    pub fn sample(&self, st: Vec2, [across, up]: [Wrap; 2]) -> Vec3 {
        let st = if st.is_finite() { st } else { Vec2::ZERO };
        let ([x0, x1], fx) = cell(st.x, self.width, across);
        let ([y0, y1], fy) = cell(st.y, self.height, up);
        let (low, high) = (y0 * self.width, y1 * self.width);
        let at = [low + x0, low + x1, high + x0, high + x1];
        let corners = match &self.pixels {
            ColorPixels::Srgb8(pixels) => at.map(|i| linear(pixels[i])),
            ColorPixels::Linear(pixels) => at.map(|i| Vec3::from(pixels[i])),
        };
        let [bottom, top] = [0, 2].map(|i| corners[i].lerp(corners[i + 1], fx));
        bottom.lerp(top, fy)
    }

    /// Linear RGB of the pixel in column `x` of row `y` from the bottom; both inside the picture.
    pub fn pixel(&self, x: usize, y: usize) -> Vec3 {
        let index = y * self.width + x;
        match &self.pixels {
            ColorPixels::Srgb8(pixels) => linear(pixels[index]),
            ColorPixels::Linear(pixels) => pixels[index].into(),
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        match &self.pixels {
            ColorPixels::Srgb8(pixels) => size_of_val(&pixels[..]),
            ColorPixels::Linear(pixels) => size_of_val(&pixels[..]),
        }
    }
}

fn linear(codes: [u8; 3]) -> Vec3 {
    codes.map(|code| srgb::DECODE_8[usize::from(code)]).into()
}

/// The two pixels that `s` lies between along a side of `size` pixels, and how far it is from the first.
fn cell(s: f32, size: usize, wrap: Wrap) -> ([usize; 2], f32) {
    let side = size as f64;
    let (x, _) = wrap.fold(f64::from(s) * side - 0.5, side);
    let first = (x as usize).min(size - 1);
    let second = match wrap {
        Wrap::Repeat if first + 1 == size => 0,
        Wrap::Repeat => first + 1,
        Wrap::Clamp | Wrap::Mirror => (first + 1).min(size - 1),
    };
    ([first, second], (x - first as f64) as f32)
}

/// Reads a colour picture. 8-bit sRGB pictures stay 8-bit, everything else becomes linear floats.
pub fn load_color<'a>(
    picture: impl Into<Source<'a>>,
    color_space: ColorSpace,
) -> Result<ColorImage, ImageError> {
    let input = picture.into().open()?;
    let path = input.path;
    if input.format == Format::Exr {
        let file = ExrFile::open(input)?;
        let chosen = channel::select(&Channel::Luminance, &file.channels, path)?;
        let read = file.read_colors(&chosen)?;
        let rgb = [0, 1, 2].map(|c| &read.planes[c.min(read.planes.len() - 1)]);
        let pixels = (0..read.width * read.height).map(|i| rgb.map(|plane| plane[i]));
        return linear_image(path, read.width, read.height, pixels.collect());
    }
    let raster = raster::decode(input)?;
    let (width, height) = (raster.width, raster.height);
    let decode = |h: f32| match color_space {
        ColorSpace::Srgb => srgb_decode(h),
        ColorSpace::Linear => h,
    };
    let pixels = match &raster.samples {
        Samples::U8(s) if color_space == ColorSpace::Srgb => {
            return Ok(ColorImage {
                width,
                height,
                pixels: ColorPixels::Srgb8(rgb(&raster, s, |code| code)),
            });
        }
        Samples::U8(s) => rgb(&raster, s, |code| f32::from(code) / 255.0),
        Samples::U16(s) => {
            // One power per code instead of three per pixel.
            let table: Vec<f32> = (0..=u16::MAX)
                .map(|code| decode(f32::from(code) / 65535.0))
                .collect();
            rgb(&raster, s, |code| table[usize::from(code)])
        }
        fractions if fractions.are_fractions() => {
            each_type!(fractions, s => rgb(&raster, s, |code| decode(code.height())))
        }
        linear => each_type!(linear, s => rgb(&raster, s, |value| value.height())),
    };
    linear_image(path, width, height, pixels)
}

/// Interleaved samples as RGB pixels, bottom row first.
fn rgb<S: Copy, T>(raster: &Raster, samples: &[S], convert: impl Fn(S) -> T) -> Vec<[T; 3]> {
    let channels = raster.channels.len();
    let [r, g, b] = if channels < 3 { [0, 0, 0] } else { [0, 1, 2] };
    samples
        .chunks_exact(raster.width * channels)
        .rev()
        .flat_map(|row| row.chunks_exact(channels))
        .map(|pixel| [pixel[r], pixel[g], pixel[b]].map(&convert))
        .collect()
}

/// Refuses the first component, in rows from the bottom, that is not finite.
fn linear_image(
    path: &Path,
    width: usize,
    height: usize,
    pixels: Vec<[f32; 3]>,
) -> Result<ColorImage, ImageError> {
    let components = pixels.as_flattened();
    if let Some(bad) = components.iter().position(|c| !c.is_finite()) {
        return Err(ImageError::BadPixel {
            path: path.to_owned(),
            x: bad / 3 % width,
            y: height - 1 - bad / 3 / width,
            value: components[bad],
        });
    }
    Ok(ColorImage {
        width,
        height,
        pixels: ColorPixels::Linear(pixels),
    })
}

#[cfg(test)]
mod tests;
