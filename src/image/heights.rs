//! Displacement maps, in the precision of the file.

use std::path::Path;

use super::channel::{self, Channel};
use super::exr_file::ExrFile;
use super::raster::{self, Raster, Samples};
use super::{Format, ImageError, format};
use crate::surface::{DisplacementMap, Texels, Wrap};

/// Reads one channel of a PNG, JPEG, TIFF, EXR or Radiance HDR picture as a displacement map.
///
/// 8-bit pictures become [`Texels::U8`], 16-bit ones [`Texels::U16`], halves and floats [`Texels::F32`]. The picture's bottom
/// row is the map's first. With [`Channel::Luminance`] the colour channels must agree: exactly for integers, to
/// half precision (1/1024) for floats, since lossy EXR compression treats each channel for itself.
pub fn load_heights(
    path: &Path,
    channel: &Channel,
    wrap: Wrap,
) -> Result<DisplacementMap, ImageError> {
    let (width, height, texels) = read_texels(path, channel)?;
    DisplacementMap::new(width, height, texels, wrap).map_err(|source| ImageError::Map {
        path: path.to_owned(),
        source,
    })
}

/// Width, height and heights, bottom row first.
pub(super) fn read_texels(
    path: &Path,
    channel: &Channel,
) -> Result<(usize, usize, Texels), ImageError> {
    let (format, file) = format::open(path)?;
    if format == Format::Exr {
        let file = ExrFile::open(path, file)?;
        let chosen = channel::select(channel, &file.channels, path)?;
        let names = chosen.iter().map(|&i| file.channels[i].clone()).collect();
        let read = file.read(&chosen)?;
        let chosen = Chosen {
            path,
            width: read.width,
            names,
        };
        let heights = chosen.agreed(read.planes, floats_agree)?;
        return Ok((read.width, read.height, Texels::F32(heights)));
    }
    let raster = raster::decode(path, format, file)?;
    let indices = channel::select(channel, &raster.channels, path)?;
    let chosen = Chosen {
        path,
        width: raster.width,
        names: indices
            .iter()
            .map(|&i| raster.channels[i].clone())
            .collect(),
    };
    let texels = match &raster.samples {
        Samples::U8(s) => Texels::U8(chosen.agreed(planes(s, &raster, &indices), |a, b| a == b)?),
        Samples::U16(s) => Texels::U16(chosen.agreed(planes(s, &raster, &indices), |a, b| a == b)?),
        Samples::F32(s) => Texels::F32(chosen.agreed(planes(s, &raster, &indices), floats_agree)?),
    };
    Ok((raster.width, raster.height, texels))
}

fn planes<T: Copy>(samples: &[T], raster: &Raster, indices: &[usize]) -> Vec<Vec<T>> {
    indices
        .iter()
        .map(|&i| raster::plane(samples, raster.width, raster.channels.len(), i))
        .collect()
}

/// Two values that are not numbers agree here: the map's own check names the texel.
fn floats_agree(a: f32, b: f32) -> bool {
    a == b || (a - b).abs() <= a.abs().max(b.abs()) / 1024.0 || !(a.is_finite() && b.is_finite())
}

/// The channels that were chosen, for messages.
struct Chosen<'a> {
    path: &'a Path,
    width: usize,
    names: Vec<String>,
}

impl Chosen<'_> {
    /// The first plane, if all others agree with it.
    fn agreed<T: Copy>(
        &self,
        mut planes: Vec<Vec<T>>,
        agree: impl Fn(T, T) -> bool,
    ) -> Result<Vec<T>, ImageError> {
        let first = planes.swap_remove(0);
        for plane in &planes {
            let differs = first.iter().zip(plane).position(|(&a, &b)| !agree(a, b));
            if let Some(texel) = differs {
                return Err(ImageError::ChannelsDisagree {
                    path: self.path.to_owned(),
                    channels: channel::list(&self.names),
                    x: texel % self.width,
                    y: texel / self.width,
                });
            }
        }
        Ok(first)
    }
}

#[cfg(test)]
mod tests;
