//! Displacement maps, in the precision of the file.

use std::path::Path;

use super::channel::{self, Channel};
use super::exr_file::ExrFile;
use super::raster::{self, Raster};
use super::samples::{NoData, Number, Sample, Samples, each_type};
use super::source::Source;
use super::{Format, ImageError};
use crate::surface::{DisplacementMap, Texels, Wrap};

/// Reads one channel of a picture as a displacement map.
///
/// 8-bit pictures become [`Texels::U8`], 16-bit ones [`Texels::U16`], all others [`Texels::F32`]: larger unsigned integers
/// as fractions of their largest (those of EXR as they stand), signed integers and floats as they stand. The picture's bottom row is the map's
/// first. With [`Channel::Luminance`] the colour channels must agree: exactly for integers, to half precision (1/1024) for floats,
/// since lossy EXR compression treats each channel for itself.
///
/// A texel has no height if it is not finite or not below 1e18, or has the value that the file declares to mean "no
/// data". It is an error, or it gets the height `nodata`, and the map is one of floats.
pub fn load_heights<'a>(
    picture: impl Into<Source<'a>>,
    channel: &Channel,
    wrap: Wrap,
    nodata: Option<f32>,
) -> Result<DisplacementMap, ImageError> {
    let picture = picture.into();
    let (width, height, texels) = read_texels(picture, channel, nodata)?;
    DisplacementMap::new(width, height, texels, wrap).map_err(|source| ImageError::Map {
        path: picture.path().to_owned(),
        source,
    })
}

/// Width, height and heights, bottom row first.
pub(super) fn read_texels(
    picture: Source,
    channel: &Channel,
    nodata: Option<f32>,
) -> Result<(usize, usize, Texels), ImageError> {
    let input = picture.open()?;
    let path = input.path;
    if input.format == Format::Exr {
        let file = ExrFile::open(input)?;
        let chosen = channel::select(channel, &file.channels, path)?;
        let names = chosen.iter().map(|&i| file.channels[i].clone()).collect();
        let read = file.read(&chosen)?;
        let chosen = Chosen {
            path,
            width: read.width,
            names,
        };
        let heights = chosen.agreed(read.planes)?;
        return Ok((
            read.width,
            read.height,
            chosen.filled(heights, None, nodata)?,
        ));
    }
    let raster = raster::decode(input)?;
    let indices = channel::select_band(channel, &raster.channels, path)?;
    let chosen = Chosen {
        path,
        width: raster.width,
        names: indices
            .iter()
            .map(|&i| raster.channels[i].clone())
            .collect(),
    };
    let declared = raster.nodata.as_ref();
    let texels = each_type!(&raster.samples, s => {
        let plane = chosen.agreed(planes(s, &raster, &indices))?;
        chosen.filled(plane, declared, nodata)?
    });
    Ok((raster.width, raster.height, texels))
}

fn planes<T: Copy>(samples: &[T], raster: &Raster, indices: &[usize]) -> Vec<Vec<T>> {
    indices
        .iter()
        .map(|&i| raster::plane(samples, raster.width, raster.channels.len(), i))
        .collect()
}

/// The channels that were chosen, for messages.
struct Chosen<'a> {
    path: &'a Path,
    width: usize,
    names: Vec<String>,
}

impl Chosen<'_> {
    /// The first plane, if all others agree with it.
    fn agreed<T: Sample>(&self, mut planes: Vec<Vec<T>>) -> Result<Vec<T>, ImageError> {
        let first = planes.swap_remove(0);
        for plane in &planes {
            let differs = first.iter().zip(plane).position(|(&a, &b)| !a.agrees(b));
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

    /// A plane as texels; those without a height get that of `nodata`.
    fn filled<T: Sample>(
        &self,
        plane: Vec<T>,
        declared: Option<&NoData>,
        nodata: Option<f32>,
    ) -> Result<Texels, ImageError> {
        let number = match declared {
            Some(declared) => Some(self.number(declared)?),
            None => None,
        };
        let has_data = |sample: T| !number.is_some_and(|number| sample.is(&number));
        let has_height = |sample: T| has_data(sample) && sample.height().abs() < HEIGHT_LIMIT;
        let Some(first) = plane.iter().position(|&sample| !has_height(sample)) else {
            return Ok(T::texels(plane));
        };
        if let Some(nodata) = nodata {
            let height = |sample: T| match has_height(sample) {
                true => sample.height(),
                false => nodata,
            };
            return Ok(Texels::F32(plane.into_iter().map(height).collect()));
        }
        let (x, y) = (first % self.width, first / self.width);
        let path = self.path.to_owned();
        Err(match declared {
            Some(declared) if !has_data(plane[first]) => ImageError::NoData {
                path,
                x,
                y,
                value: declared.text.clone(),
            },
            _ => ImageError::NoHeight {
                path,
                x,
                y,
                value: plane[first].height(),
            },
        })
    }

    fn number(&self, declared: &NoData) -> Result<Number, ImageError> {
        declared.number.ok_or_else(|| ImageError::BadNoData {
            path: self.path.to_owned(),
            value: declared.text.clone(),
        })
    }
}

/// No surface with a height from here on has bounds that a ray tracer takes: what fills the gaps of a float map with
/// the lowest f32 without declaring it is told apart from heights.
const HEIGHT_LIMIT: f32 = 1e18;

#[cfg(test)]
mod tests;
