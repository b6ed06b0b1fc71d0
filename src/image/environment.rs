//! Light from all around: equirectangular HDR pictures.

use std::fmt;
use std::path::Path;

use glam::Vec3;

use super::color::{ColorPixels, ColorSpace, load_color};
use super::source::Source;
use super::{Format, ImageError, fingerprint};

/// An equirectangular HDR picture: top row first, the top row is +Y, the middle column looks along -Z.
#[derive(Clone)]
pub struct EnvironmentImage {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Linear RGB radiance, finite, non-negative.
    pub pixels: Vec<Vec3>,
}

/// Size and fingerprint, not every pixel.
impl fmt::Debug for EnvironmentImage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (width, height) = (self.width, self.height);
        let pixels = fingerprint(bytemuck::cast_slice(&self.pixels));
        write!(f, "EnvironmentImage({width}x{height} {pixels})")
    }
}

/// Reads an OpenEXR or Radiance HDR picture.
///
/// A NaN or infinite pixel is an error: one of them would poison every sum over the sphere. Negative radiance is read
/// as 0: lossy compression (EXR's DWA above all) leaves it as ringing beside bright lights, in pictures that are
/// otherwise sound, and no light is what such a pixel stands for.
pub fn load_environment(path: &Path) -> Result<EnvironmentImage, ImageError> {
    let format = Source::File(path).open()?.format;
    if !matches!(format, Format::Exr | Format::Hdr) {
        return Err(ImageError::NotRadiance {
            path: path.to_owned(),
            format,
        });
    }
    let image = load_color(path, ColorSpace::Linear)?;
    let (width, height) = (image.width, image.height);
    let ColorPixels::Linear(pixels) = image.pixels else {
        // Only 8-bit sRGB pictures stay encoded.
        return Err(ImageError::NotRadiance {
            path: path.to_owned(),
            format,
        });
    };
    let pixels = pixels
        .chunks_exact(width)
        .rev()
        .flatten()
        .map(|&pixel| Vec3::from(pixel).max(Vec3::ZERO))
        .collect();
    Ok(EnvironmentImage {
        width,
        height,
        pixels,
    })
}

#[cfg(test)]
mod tests;
