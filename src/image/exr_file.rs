//! OpenEXR: the channels that are wanted, of one layer, at full resolution; nothing else is decompressed or kept.
//!
//! The picture is the file's data window. Halves are widened to floats, which is exact.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use exr::block::reader::{ChunksReader, Reader};
use exr::block::{self, UncompressedBlock};
use exr::math::Vec2;
use exr::meta::attribute::{AttributeValue, ChannelDescription, SampleType};
use exr::meta::header::Header;
use exr::prelude::f16;

use super::error::check_size;
use super::exr_picture::{ExrChannel, ExrPicture, ExrSamples};
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
        self.check_layout(&header)?;
        for (&(its_layer, channel), &index) in places.iter().zip(wanted) {
            if header.channels.list[channel].sample_type == SampleType::U32 {
                let name = &self.channels[index];
                return Err(self.unsupported(format!("32-bit integers in channel {name}")));
            }
            if its_layer != layer {
                return Err(self.unsupported("colour channels in different layers".to_owned()));
            }
        }
        let channels = places.iter().map(|&(_, channel)| channel).collect();
        let planes = self.planes(layer, &header, channels)?;
        let floats = |plane| match plane {
            ExrSamples::F32(samples) => samples,
            ExrSamples::U32(samples) => samples.into_iter().map(|x| x as f32).collect(),
        };
        Ok(Planes {
            width: header.layer_size.width(),
            height: header.layer_size.height(),
            planes: planes.into_iter().map(floats).collect(),
        })
    }

    /// What the first layer is, without its channels.
    pub fn describe(&self) -> ExrPicture {
        let header = &self.reader.headers()[0];
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

    /// All channels of the first layer, and its texts.
    pub fn read_all(self) -> Result<ExrPicture, ImageError> {
        let mut picture = self.describe();
        let header = self.reader.headers()[0].clone();
        self.check_layout(&header)?;
        let channels = &header.channels.list;
        self.check_length(picture.width * picture.height * channels.len())?;
        let planes = self.planes(0, &header, (0..channels.len()).collect())?;
        let channel = |(channel, samples): (&ChannelDescription, _)| ExrChannel {
            name: channel.name.to_string(),
            samples,
        };
        picture.channels = channels.iter().zip(planes).map(channel).collect();
        Ok(picture)
    }

    /// These channels of a layer, in this order.
    fn planes(
        self,
        layer: usize,
        header: &Header,
        channels: Vec<usize>,
    ) -> Result<Vec<ExrSamples>, ImageError> {
        let (width, height) = (header.layer_size.width(), header.layer_size.height());
        let wanted = channels.len();
        let plane = |&channel: &usize| match header.channels.list[channel].sample_type {
            SampleType::U32 => ExrSamples::U32(vec![0; width * height]),
            SampleType::F16 | SampleType::F32 => ExrSamples::F32(vec![0.0; width * height]),
        };
        let mut canvas = Canvas {
            width,
            height,
            planes: channels.iter().map(plane).collect(),
            channels,
            filled: 0,
        };
        let failed = |error| ImageError::decode(&self.path, Format::Exr, error);
        self.reader
            .filter_chunks(false, |_, _, block| {
                block.layer == layer && block.level == Vec2(0, 0)
            })
            .map_err(failed)?
            // In this thread: a decoder that panics in a worker of its own takes the whole program down.
            .decompress_sequential(false, |_, block| canvas.put(header, &block))
            .map_err(failed)?;
        if canvas.filled != width * height * wanted {
            return Err(ImageError::decode(
                &self.path,
                Format::Exr,
                "blocks of pixels are missing",
            ));
        }
        Ok(canvas.planes)
    }

    /// Refuses a file far too short for so many samples before memory is taken for them.
    fn check_length(&self, samples: usize) -> Result<(), ImageError> {
        /// Far more than any codec of EXR packs, of one colour too.
        const MOST_SAMPLES_PER_BYTE: u64 = 1 << 16;
        let bytes = std::fs::metadata(&self.path).map_or(u64::MAX, |file| file.len());
        if samples as u64 / MOST_SAMPLES_PER_BYTE > bytes {
            let reason = format!("{bytes} bytes cannot hold {samples} samples");
            return Err(ImageError::decode(&self.path, Format::Exr, reason));
        }
        Ok(())
    }

    fn check_layout(&self, header: &Header) -> Result<(), ImageError> {
        if header.deep {
            return Err(self.unsupported("deep data".to_owned()));
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
        Ok(())
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
    planes: Vec<ExrSamples>,
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
            let run = start..start + count;
            let half = header.channels.list[line.location.channel].sample_type == SampleType::F16;
            match &mut self.planes[plane] {
                ExrSamples::F32(s) if half => {
                    decode(&mut s[run], line.value, |b| f16::from_ne_bytes(b).to_f32());
                }
                ExrSamples::F32(s) => decode(&mut s[run], line.value, f32::from_ne_bytes),
                ExrSamples::U32(s) => decode(&mut s[run], line.value, u32::from_ne_bytes),
            }
            self.filled += count;
        }
        Ok(())
    }
}

fn decode<const N: usize, T>(row: &mut [T], bytes: &[u8], sample: impl Fn([u8; N]) -> T) {
    let (samples, _) = bytes.as_chunks::<N>();
    for (out, &bytes) in row.iter_mut().zip(samples) {
        *out = sample(bytes);
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

fn open(path: &Path) -> Result<ExrFile, ImageError> {
    match super::format::open(path)? {
        (Format::Exr, file) => ExrFile::open(path, file),
        (other, _) => Err(ImageError::decode(
            path,
            Format::Exr,
            format!("it is a {other} picture"),
        )),
    }
}
