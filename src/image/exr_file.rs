//! OpenEXR: the channels that are wanted, of one layer, at full resolution; nothing else is decompressed or kept.
//!
//! The picture is the file's data window. Halves are widened to floats, which is exact.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use exr::block::reader::{ChunksReader, Reader};
use exr::block::{self, UncompressedBlock};
use exr::math::Vec2;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header;
use exr::prelude::f16;

use super::error::check_size;
use super::{Format, ImageError};

/// An EXR file whose header was read and found acceptable.
pub(super) struct ExrFile {
    path: PathBuf,
    reader: Reader<BufReader<File>>,
    /// Names of all channels, `layer.channel` where the layer has a name.
    pub channels: Vec<String>,
    /// Layer and channel within the layer, in the order of `channels`.
    places: Vec<(usize, usize)>,
}

/// Channels of one size, each bottom row first.
pub(super) struct Planes {
    /// Pixels across, at least 1.
    pub width: usize,
    /// Pixels up, at least 1.
    pub height: usize,
    /// width * height samples per channel.
    pub planes: Vec<Vec<f32>>,
}

impl ExrFile {
    /// Reads and checks the header.
    pub fn open(path: &Path, file: BufReader<File>) -> Result<Self, ImageError> {
        let reader = block::read(file, false)
            .map_err(|error| ImageError::decode(path, Format::Exr, error))?;
        let mut channels = Vec::new();
        let mut places = Vec::new();
        for (layer, header) in reader.headers().iter().enumerate() {
            check_size(
                path,
                header.layer_size.width() as u64,
                header.layer_size.height() as u64,
            )?;
            let prefix = match &header.own_attributes.layer_name {
                Some(name) => format!("{name}."),
                None => String::new(),
            };
            for (index, channel) in header.channels.list.iter().enumerate() {
                channels.push(format!("{prefix}{}", channel.name));
                places.push((layer, index));
            }
        }
        Ok(Self {
            path: path.to_owned(),
            reader,
            channels,
            places,
        })
    }

    /// The channels with the given indices into `channels`.
    pub fn read(self, wanted: &[usize]) -> Result<Planes, ImageError> {
        let places: Vec<(usize, usize)> = wanted.iter().map(|&index| self.places[index]).collect();
        let layer = places[0].0;
        let header = self.reader.headers()[layer].clone();
        for (&(its_layer, channel), &index) in places.iter().zip(wanted) {
            self.check_channel(&header, channel, &self.channels[index])?;
            if its_layer != layer {
                return Err(self.unsupported("colour channels in different layers".to_owned()));
            }
        }
        let (width, height) = (header.layer_size.width(), header.layer_size.height());
        let mut canvas = Canvas {
            width,
            height,
            channels: places.iter().map(|&(_, channel)| channel).collect(),
            planes: vec![vec![0.0; width * height]; wanted.len()],
            filled: 0,
        };
        let failed = |error| ImageError::decode(&self.path, Format::Exr, error);
        self.reader
            .filter_chunks(false, |_, _, block| {
                block.layer == layer && block.level == Vec2(0, 0)
            })
            .map_err(failed)?
            // In this thread: a decoder that panics in a worker of its own takes the whole program down.
            .decompress_sequential(false, |_, block| canvas.put(&header, &block))
            .map_err(failed)?;
        if canvas.filled != width * height * wanted.len() {
            return Err(ImageError::decode(
                &self.path,
                Format::Exr,
                "blocks of pixels are missing",
            ));
        }
        Ok(Planes {
            width,
            height,
            planes: canvas.planes,
        })
    }

    fn check_channel(&self, header: &Header, channel: usize, name: &str) -> Result<(), ImageError> {
        if header.deep {
            return Err(self.unsupported(format!("deep data in channel {name}")));
        }
        // Subsampling anywhere in the layer shifts every line behind it in a block.
        if let Some(odd) = header
            .channels
            .list
            .iter()
            .find(|c| c.sampling != Vec2(1, 1))
        {
            return Err(self.unsupported(format!("the subsampled channel {}", odd.name)));
        }
        match header.channels.list[channel].sample_type {
            SampleType::U32 => Err(self.unsupported(format!("32-bit integers in channel {name}"))),
            SampleType::F16 | SampleType::F32 => Ok(()),
        }
    }

    fn unsupported(&self, found: String) -> ImageError {
        ImageError::UnsupportedSamples {
            path: self.path.clone(),
            found,
            expected: "half or float channels at full resolution are expected",
        }
    }
}

/// Where decompressed blocks come together.
struct Canvas {
    width: usize,
    height: usize,
    /// Index within the layer of each plane's channel.
    channels: Vec<usize>,
    planes: Vec<Vec<f32>>,
    /// Samples put so far.
    filled: usize,
}

impl Canvas {
    fn put(&mut self, header: &Header, block: &UncompressedBlock) -> exr::error::UnitResult {
        for line in block.lines(&header.channels) {
            let Some(plane) = self
                .channels
                .iter()
                .position(|&c| c == line.location.channel)
            else {
                continue;
            };
            let Vec2(x, y) = line.location.position;
            let count = line.location.sample_count;
            if x + count > self.width || y >= self.height {
                return Err(exr::error::Error::Invalid(
                    "block outside of the picture".into(),
                ));
            }
            let start = (self.height - 1 - y) * self.width + x;
            let row = &mut self.planes[plane][start..start + count];
            match header.channels.list[line.location.channel].sample_type {
                SampleType::F16 => widen(row, line.value, |b| f16::from_ne_bytes(b).to_f32()),
                SampleType::F32 => widen(row, line.value, f32::from_ne_bytes),
                SampleType::U32 => widen(row, line.value, |b| u32::from_ne_bytes(b) as f32),
            }
            self.filled += count;
        }
        Ok(())
    }
}

fn widen<const N: usize>(row: &mut [f32], bytes: &[u8], sample: impl Fn([u8; N]) -> f32) {
    let (samples, _) = bytes.as_chunks::<N>();
    for (out, &bytes) in row.iter_mut().zip(samples) {
        *out = sample(bytes);
    }
}
