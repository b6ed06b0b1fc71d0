//! OpenEXR: the channels that are wanted, at full resolution; nothing else is decompressed or kept.
//!
//! Maps, colours and environments are pictures of the display window's size: what the data window has outside of it (overscan)
//! is cut off, what it lacks is 0. Halves are widened to floats, which is exact; UINT become the nearest floats.

use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use exr::math::Vec2;
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, ChannelDescription};
use exr::meta::header::Header;

use super::error::check_size;
use super::exr_blocks::{Plane, Planes};
use super::exr_chroma;
use super::exr_picture::{ExrChannel, ExrPicture, ExrSamples};
use super::source::{Bytes, Input, Source};
use super::{Format, ImageError};
use crate::files::guard::guarded;

/// Samples of a display window that are made whatever the data window has: three planes of them and their pixels are 48 MB.
const SMALL: usize = 1 << 21;

/// Samples of the display window per sample of the data window, beyond that.
const SPARSEST: usize = 16;

/// An EXR file whose header was read and found acceptable.
pub(super) struct ExrFile<'a> {
    pub(super) path: &'a Path,
    pub(super) bytes: Box<dyn Bytes + 'a>,
    /// Bytes there are.
    pub(super) length: u64,
    pub(super) meta: MetaData,
    /// Where the tables of chunks start, one per part.
    pub(super) tables: u64,
    /// Names of all channels, `part.channel` where the part has a name.
    pub channels: Vec<String>,
    /// Part and channel within the part, in the order of `channels`.
    places: Vec<(usize, usize)>,
}

/// Channels of one size, each bottom row first.
pub(super) struct Channels {
    /// Pixels across, at least 1.
    pub width: usize,
    /// Pixels up, at least 1.
    pub height: usize,
    /// width * height samples per channel.
    pub planes: Vec<Vec<f32>>,
}

impl<'a> ExrFile<'a> {
    /// Reads and checks the header.
    pub fn open(mut input: Input<'a>) -> Result<Self, ImageError> {
        let path = input.path;
        let failed =
            |error: &dyn ToString| ImageError::decode(path, Format::Exr, error.to_string());
        let meta = guarded(|| {
            let meta = MetaData::read_from_buffered(&mut input.bytes, true)?;
            // The crate refuses all subsampling, which is asked about where a channel is read.
            let mut full = meta.headers.clone();
            for channel in full.iter_mut().flat_map(|header| &mut header.channels.list) {
                channel.sampling = Vec2(1, 1);
            }
            MetaData::validate(&full, false)?;
            Ok(meta)
        });
        let meta: MetaData = meta.map_err(|reason| failed(&reason))?.map_err(
            |error: exr::error::Error| match error {
                exr::error::Error::NotSupported(what) if what.contains("deep") => {
                    unsupported(path, "deep data".to_owned(), FULL)
                }
                other => failed(&other),
            },
        )?;
        let tables = input
            .bytes
            .stream_position()
            .map_err(|error| failed(&error))?;
        let display = meta.headers[0].shared_attributes.display_window.size;
        check_size(path, display.width() as u64, display.height() as u64)?;
        let mut channels = Vec::new();
        let mut places = Vec::new();
        for (part, header) in meta.headers.iter().enumerate() {
            let size = header.layer_size;
            check_size(path, size.width() as u64, size.height() as u64)?;
            check_sampling(path, header)?;
            let prefix = match &header.own_attributes.layer_name {
                Some(name) => format!("{name}."),
                None => String::new(),
            };
            for (index, channel) in header.channels.list.iter().enumerate() {
                channels.push(format!("{prefix}{}", channel.name));
                places.push((part, index));
            }
        }
        Ok(Self {
            path,
            bytes: input.bytes,
            length: input.length,
            meta,
            tables,
            channels,
            places,
        })
    }

    /// The channels with the given indices into `channels`, in the display window.
    pub fn read(mut self, wanted: &[usize]) -> Result<Channels, ImageError> {
        let places: Vec<_> = wanted.iter().map(|&index| self.places[index]).collect();
        let mut planes: Vec<Vec<f32>> = vec![Vec::new(); wanted.len()];
        for part in 0..self.meta.headers.len() {
            let of_part: Vec<usize> = (0..places.len()).filter(|&i| places[i].0 == part).collect();
            if of_part.is_empty() {
                continue;
            }
            let channels: Vec<usize> = of_part.iter().map(|&i| places[i].1).collect();
            let header = self.meta.headers[part].clone();
            if let Some(&odd) = channels
                .iter()
                .find(|&&c| header.channels.list[c].sampling != Vec2(1, 1))
            {
                let name = &header.channels.list[odd].name;
                return Err(unsupported(
                    self.path,
                    format!("the subsampled channel {name}"),
                    FULL,
                ));
            }
            for (i, plane) in of_part
                .into_iter()
                .zip(self.planes(part, &channels)?.planes)
            {
                planes[i] = self.window(&header, plane.into_floats())?;
            }
        }
        Ok(self.sized(planes))
    }

    /// Red, green and blue in the display window: `wanted`, unless they are a luminance that has chroma beside it.
    pub fn read_colors(mut self, wanted: &[usize]) -> Result<Channels, ImageError> {
        let [luminance] = wanted[..] else {
            return self.read(wanted);
        };
        let (part, y) = self.places[luminance];
        let header = self.meta.headers[part].clone();
        let Some(channels) = exr_chroma::channels(&header, y) else {
            return self.read(wanted);
        };
        let read = self.planes(part, &channels)?;
        let colors = exr_chroma::colors(&header, read)
            .ok_or_else(|| unsupported(self.path, "subsampled luminance".to_owned(), FULL))?;
        let windowed = colors.into_iter().map(|plane| self.window(&header, plane));
        let planes = windowed.collect::<Result<_, _>>()?;
        Ok(self.sized(planes))
    }

    fn sized(&self, planes: Vec<Vec<f32>>) -> Channels {
        let display = self.meta.headers[0].shared_attributes.display_window.size;
        Channels {
            width: display.width(),
            height: display.height(),
            planes,
        }
    }

    /// A plane of the data window, top row first, as one of the display window, bottom row first.
    fn window(&self, header: &Header, mut data: Vec<f32>) -> Result<Vec<f32>, ImageError> {
        // That of the first part is all parts'.
        let display = self.meta.headers[0].shared_attributes.display_window;
        let (width, height) = (display.size.width(), display.size.height());
        let (across, down) = (header.layer_size.width(), header.layer_size.height());
        let Vec2(left, top) = header.own_attributes.layer_position;
        if display.position == Vec2(left, top) && (width, height) == (across, down) {
            flip(&mut data, width);
            return Ok(data);
        }
        if width * height > SMALL.max(SPARSEST * data.len()) {
            let found = format!(
                "a data window of {across}x{down} pixels in a display window of {width}x{height}"
            );
            let expected = "one that the pixels nearly fill is expected";
            return Err(unsupported(self.path, found, expected));
        }
        // Where the data start in the display window, perhaps outside of it.
        let x = i64::from(left) - i64::from(display.position.x());
        let y = i64::from(top) - i64::from(display.position.y());
        let kept = |from: i64, size: usize, whole: usize| {
            let start = from.clamp(0, whole as i64);
            let end = (from + size as i64).clamp(start, whole as i64);
            (
                start as usize,
                (end - start) as usize,
                (start - from) as usize,
            )
        };
        let (x, columns, skipped) = kept(x, across, width);
        let (y, rows, above) = kept(y, down, height);
        let mut whole = Vec::new();
        whole
            .try_reserve_exact(width * height)
            .map_err(|_| ImageError::read(self.path, std::io::ErrorKind::OutOfMemory.into()))?;
        whole.resize(width * height, 0.0);
        if columns > 0 {
            for row in 0..rows {
                let from = &data[(above + row) * across + skipped..][..columns];
                whole[(height - 1 - y - row) * width + x..][..columns].copy_from_slice(from);
            }
        }
        Ok(whole)
    }

    /// What the first part is, without its channels.
    pub fn describe(&self) -> ExrPicture {
        let header = &self.meta.headers[0];
        let attributes = header.own_attributes.other.iter();
        let attributes = attributes.filter_map(|(name, value)| match value {
            AttributeValue::Text(value) => Some((name.to_string(), value.to_string())),
            _ => None,
        });
        let Vec2(x, y) = header.own_attributes.layer_position;
        let display = header.shared_attributes.display_window;
        ExrPicture {
            display: (display.size.width(), display.size.height()),
            position: (x, y),
            width: header.layer_size.width(),
            height: header.layer_size.height(),
            channels: Vec::new(),
            attributes: attributes.collect(),
        }
    }

    /// All channels of the first part over its data window, and its texts.
    pub fn read_all(mut self) -> Result<ExrPicture, ImageError> {
        let mut picture = self.describe();
        let header = self.meta.headers[0].clone();
        let channels = &header.channels.list;
        if let Some(odd) = channels.iter().find(|c| c.sampling != Vec2(1, 1)) {
            return Err(unsupported(
                self.path,
                format!("the subsampled channel {}", odd.name),
                FULL,
            ));
        }
        let all: Vec<usize> = (0..channels.len()).collect();
        let planes = self.planes(0, &all)?.planes;
        let width = picture.width;
        let channel = |(channel, plane): (&ChannelDescription, Plane)| ExrChannel {
            name: channel.name.to_string(),
            samples: match plane.samples {
                ExrSamples::F32(mut samples) => {
                    flip(&mut samples, width);
                    ExrSamples::F32(samples)
                }
                ExrSamples::U32(mut samples) => {
                    flip(&mut samples, width);
                    ExrSamples::U32(samples)
                }
            },
        };
        picture.channels = channels.iter().zip(planes).map(channel).collect();
        Ok(picture)
    }

    fn planes(&mut self, part: usize, channels: &[usize]) -> Result<Planes, ImageError> {
        Planes::read(self, part, channels)
    }

    /// Bytes of the file from here on; fewer are an error.
    pub(super) fn bytes_at(&mut self, start: u64, count: usize) -> Result<Vec<u8>, ImageError> {
        let truncated = || ImageError::decode(self.path, Format::Exr, "it is truncated");
        if start
            .checked_add(count as u64)
            .is_none_or(|end| end > self.length)
        {
            return Err(truncated());
        }
        let mut bytes = Vec::new();
        bytes
            .try_reserve_exact(count)
            .map_err(|_| ImageError::read(self.path, std::io::ErrorKind::OutOfMemory.into()))?;
        self.bytes
            .seek(SeekFrom::Start(start))
            .and_then(|_| (&mut self.bytes).take(count as u64).read_to_end(&mut bytes))
            .map_err(|error| ImageError::read(self.path, error))?;
        match bytes.len() == count {
            true => Ok(bytes),
            false => Err(truncated()),
        }
    }
}

/// Refuses samplings that do not divide the data window, as OpenEXR demands, and those of tiles.
fn check_sampling(path: &Path, header: &Header) -> Result<(), ImageError> {
    let Vec2(left, top) = header.own_attributes.layer_position;
    let Vec2(width, height) = header.layer_size;
    for channel in &header.channels.list {
        let Vec2(across, down) = channel.sampling;
        let divides = |sampling: usize, start: i32, size: usize| {
            sampling > 0 && i64::from(start) % sampling as i64 == 0 && size.is_multiple_of(sampling)
        };
        let sound = divides(across, left, width) && divides(down, top, height);
        if !sound || (header.blocks.has_tiles() && channel.sampling != Vec2(1, 1)) {
            let name = &channel.name;
            let found = format!("the channel {name} sampled at every {across} x {down} pixels");
            return Err(unsupported(path, found, FULL));
        }
    }
    Ok(())
}

/// Turns rows from the top into rows from the bottom.
fn flip<T>(samples: &mut [T], width: usize) {
    let height = samples.len() / width;
    for y in 0..height / 2 {
        let (above, below) = samples.split_at_mut((height - 1 - y) * width);
        above[y * width..][..width].swap_with_slice(&mut below[..width]);
    }
}

const FULL: &str = "flat channels at full resolution are expected";

fn unsupported(path: &Path, found: String, expected: &'static str) -> ImageError {
    ImageError::UnsupportedSamples {
        path: path.to_owned(),
        found,
        expected,
    }
}

/// Reads all channels of the first layer of the EXR file at `path`, and its text attributes.
pub fn read_exr(path: &Path) -> Result<ExrPicture, ImageError> {
    open(path)?.read_all()
}

/// As [`read_exr`], without the channels: a few bytes of the file.
pub fn read_exr_header(path: &Path) -> Result<ExrPicture, ImageError> {
    Ok(open(path)?.describe())
}

fn open(path: &Path) -> Result<ExrFile<'_>, ImageError> {
    let input = Source::File(path).open()?;
    match input.format {
        Format::Exr => ExrFile::open(input),
        other => Err(ImageError::decode(
            path,
            Format::Exr,
            format!("it is a {other} picture"),
        )),
    }
}

#[cfg(test)]
mod tests;
