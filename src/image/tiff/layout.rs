//! What a page's tags say: size, kind of samples, and how its strips or tiles lie in the file.

use std::io::{BufRead, Seek};
use std::path::Path;

use super::channels;
use super::codec::Codec;
use super::directory::{Directory, Source};
use super::orientation::Orientation;
use super::predictor::Predictor;
use super::{Fault, palette};
use crate::image::MAX_PIXELS;
use crate::image::error::check_size;

/// What the bits of a sample are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Unsigned,
    Signed,
    Float,
}

/// What samples mean.
#[derive(Debug, PartialEq)]
pub(super) enum Photometric {
    /// Grey, 0 is white.
    WhiteIsZero,
    /// Grey or any other bands.
    BlackIsZero,
    Rgb,
    /// JPEG only: its decoder makes RGB of it.
    YCbCr,
    /// Indices into these colours.
    Palette(palette::Colors),
}

/// A page that can be read. Strips are tiles as wide as the picture: both are called chunks.
pub(super) struct Layout {
    pub width: usize,
    pub height: usize,
    pub kind: Kind,
    /// Of a sample.
    pub bits: usize,
    /// All channels, also where each has chunks of its own.
    pub channels: Vec<String>,
    pub photometric: Photometric,
    /// Each channel has chunks of its own.
    pub planar: bool,
    pub chunk_width: usize,
    pub chunk_height: usize,
    /// Strips or tiles, for messages.
    pub chunk_name: &'static str,
    /// Of chunks: row by row from the top, channel after channel if planar.
    pub offsets: Vec<u64>,
    /// Bytes of chunks; `None` where the file leaves it to be found out.
    pub counts: Vec<Option<u64>>,
    pub codec: Codec,
    pub predictor: Predictor,
    /// The first bit of a byte is its lowest.
    pub reversed_bits: bool,
    /// How rows lie in the picture; width and height are those of rows.
    pub orientation: Orientation,
    /// What the file declares to mean "no data" (GDAL).
    pub nodata: Option<String>,
}

mod tag {
    pub const WIDTH: u16 = 256;
    pub const HEIGHT: u16 = 257;
    pub const BITS_PER_SAMPLE: u16 = 258;
    pub const COMPRESSION: u16 = 259;
    pub const PHOTOMETRIC: u16 = 262;
    pub const FILL_ORDER: u16 = 266;
    pub const STRIP_OFFSETS: u16 = 273;
    pub const ORIENTATION: u16 = 274;
    pub const SAMPLES_PER_PIXEL: u16 = 277;
    pub const ROWS_PER_STRIP: u16 = 278;
    pub const STRIP_BYTE_COUNTS: u16 = 279;
    pub const PLANAR_CONFIGURATION: u16 = 284;
    pub const PREDICTOR: u16 = 317;
    pub const COLOR_MAP: u16 = 320;
    pub const TILE_WIDTH: u16 = 322;
    pub const TILE_HEIGHT: u16 = 323;
    pub const TILE_OFFSETS: u16 = 324;
    pub const TILE_BYTE_COUNTS: u16 = 325;
    pub const EXTRA_SAMPLES: u16 = 338;
    pub const SAMPLE_FORMAT: u16 = 339;
    pub const JPEG_TABLES: u16 = 347;
    pub const GDAL_NODATA: u16 = 42113;
}

/// A page's tags, read as they are asked for.
struct Tags<'a, R> {
    page: &'a Directory,
    source: &'a mut Source<R>,
}

impl<R: BufRead + Seek> Tags<'_, R> {
    fn numbers(&mut self, tag: u16, most: u64) -> Result<Option<Vec<u64>>, Fault> {
        self.page.numbers(self.source, tag, most)
    }

    fn number(&mut self, tag: u16) -> Result<Option<u64>, Fault> {
        self.page.number(self.source, tag)
    }

    fn bytes(&mut self, tag: u16, most: u64) -> Result<Option<Vec<u8>>, Fault> {
        self.page.bytes(self.source, tag, most)
    }

    fn required(&mut self, tag: u16, name: &str) -> Result<u64, Fault> {
        self.number(tag)?
            .ok_or_else(|| Fault::broken(format!("it has no {name} (tag {tag})")))
    }

    /// The number that a tag has for all of so many samples, or once.
    fn common(&mut self, tag: u16, samples: u64, default: u64) -> Result<u64, Fault> {
        let numbers = self.numbers(tag, samples)?.unwrap_or_default();
        let first = numbers.first().copied().unwrap_or(default);
        match numbers.iter().find(|&&number| number != first) {
            None => Ok(first),
            Some(_) => {
                let all: Vec<String> = numbers.iter().take(8).map(u64::to_string).collect();
                let what = match tag {
                    tag::SAMPLE_FORMAT => "of different formats",
                    _ => "of different sizes, in bits",
                };
                let found = format!("samples {what}: {}", all.join(", "));
                Err(Fault::Unsupported(found, SAMPLES))
            }
        }
    }
}

const SAMPLES: &str =
    "integers of 1 to 32 or of 64 bits, or floats of 16, 24, 32 or 64, are expected";
const COLORS: &str = "grey, RGB, a palette or bands of heights are expected";

/// Most bytes of the tables that JPEG strips or tiles share: far more than four of each kind take.
const JPEG_TABLES: u64 = 1 << 16;

impl Layout {
    pub fn read<R: BufRead + Seek>(
        path: &Path,
        page: &Directory,
        source: &mut Source<R>,
    ) -> Result<Self, Fault> {
        let mut tags = Tags { page, source };
        let width = tags.required(tag::WIDTH, "width")?;
        let height = tags.required(tag::HEIGHT, "height")?;
        check_size(path, width, height)?;
        let samples = tags.number(tag::SAMPLES_PER_PIXEL)?.unwrap_or(1);
        if samples == 0 || samples.saturating_mul(width * height) > 4 * MAX_PIXELS {
            let found = format!("{samples} samples in each of {width}x{height} pixels");
            return Err(Fault::Unsupported(found, "fewer are expected"));
        }
        let codec = tags.number(tag::COMPRESSION)?.unwrap_or(1);
        let codec = Codec::of(codec, || tags.bytes(tag::JPEG_TABLES, JPEG_TABLES))?;
        let (kind, bits) = kind(&mut tags, samples)?;
        if matches!(codec, Codec::Jpeg { .. }) && (kind, bits) != (Kind::Unsigned, 8) {
            let found = format!("{bits}-bit samples in JPEG compression");
            return Err(Fault::Unsupported(
                found,
                "8-bit unsigned ones are expected",
            ));
        }
        let photometric = photometric(&mut tags, samples, &codec, (kind, bits))?;
        let extra = tags
            .numbers(tag::EXTRA_SAMPLES, samples)?
            .unwrap_or_default();
        let predictor = tags.number(tag::PREDICTOR)?.unwrap_or(1);
        let mut layout = Self {
            width: width as usize,
            height: height as usize,
            kind,
            bits,
            channels: channels::names(&photometric, &extra, samples as usize)?,
            photometric,
            planar: planar(&mut tags)? && samples > 1,
            predictor: Predictor::of(predictor, &codec, kind, bits)?,
            codec,
            reversed_bits: tags.number(tag::FILL_ORDER)? == Some(2),
            orientation: Orientation::of(tags.number(tag::ORIENTATION)?.unwrap_or(1)),
            nodata: nodata(&mut tags)?,
            chunk_width: 0,
            chunk_height: 0,
            chunk_name: "",
            offsets: Vec::new(),
            counts: Vec::new(),
        };
        layout.find_chunks(&mut tags)?;
        Ok(layout)
    }

    /// Bytes of a row of a chunk.
    pub fn row_bytes(&self) -> usize {
        (self.chunk_width * self.chunk_samples() * self.bits).div_ceil(8)
    }

    /// Samples of a pixel that lie together in a chunk.
    pub fn chunk_samples(&self) -> usize {
        match self.planar {
            true => 1,
            false => self.channels.len(),
        }
    }

    /// Chunks beside one another.
    pub fn across(&self) -> usize {
        self.width.div_ceil(self.chunk_width)
    }

    /// Chunks below one another.
    pub fn down(&self) -> usize {
        self.height.div_ceil(self.chunk_height)
    }

    /// Channels with chunks of their own.
    pub fn planes(&self) -> usize {
        match self.planar {
            true => self.channels.len(),
            false => 1,
        }
    }

    /// A chunk for messages.
    pub fn name(&self, chunk: usize) -> String {
        format!("{} {chunk}", self.chunk_name)
    }

    fn find_chunks<R: BufRead + Seek>(&mut self, tags: &mut Tags<R>) -> Result<(), Fault> {
        /// Bytes of a chunk, decoded: those of the largest picture.
        const MOST: u64 = 4 * MAX_PIXELS * 8;
        let tiled = tags.number(tag::TILE_WIDTH)?.is_some();
        let (offsets, counts) = if tiled {
            self.chunk_name = "tile";
            self.chunk_width = size(tags.required(tag::TILE_WIDTH, "tile width")?)?;
            self.chunk_height = size(tags.required(tag::TILE_HEIGHT, "tile height")?)?;
            // Some old writers use the tags of strips.
            match tags.number(tag::TILE_OFFSETS)? {
                Some(_) => (tag::TILE_OFFSETS, tag::TILE_BYTE_COUNTS),
                None => (tag::STRIP_OFFSETS, tag::STRIP_BYTE_COUNTS),
            }
        } else {
            let height = self.height as u64;
            let rows = tags.number(tag::ROWS_PER_STRIP)?.unwrap_or(height);
            self.chunk_name = "strip";
            self.chunk_width = self.width;
            self.chunk_height = size(rows.min(height))?;
            (tag::STRIP_OFFSETS, tag::STRIP_BYTE_COUNTS)
        };
        let bits = self.chunk_width as u128 * (self.chunk_samples() * self.bits) as u128;
        let bytes = bits.div_ceil(8) * self.chunk_height as u128;
        if bytes > u128::from(MOST) {
            return Err(Fault::broken(format!(
                "a {} of {}x{} pixels",
                self.chunk_name, self.chunk_width, self.chunk_height
            )));
        }
        let chunks = self.across() as u64 * self.down() as u64 * self.planes() as u64;
        self.offsets = tags
            .numbers(offsets, chunks)?
            .filter(|found| found.len() as u64 == chunks)
            .ok_or_else(|| {
                let name = self.chunk_name;
                Fault::broken(format!(
                    "offsets of {chunks} {name}s are not there (tag {offsets})"
                ))
            })?;
        let counts = tags.numbers(counts, chunks)?.unwrap_or_default();
        let counts = counts
            .into_iter()
            .map(|count| Some(count).filter(|&count| count > 0));
        self.counts = counts.collect();
        self.counts.resize(self.offsets.len(), None);
        Ok(())
    }
}

/// A side of a chunk.
fn size(number: u64) -> Result<usize, Fault> {
    match u32::try_from(number) {
        Ok(size @ 1..) => Ok(size as usize),
        _ => Err(Fault::broken(format!(
            "a strip or tile {number} pixels wide or high"
        ))),
    }
}

fn kind<R: BufRead + Seek>(tags: &mut Tags<R>, samples: u64) -> Result<(Kind, usize), Fault> {
    let bits = tags.common(tag::BITS_PER_SAMPLE, samples, 1)?;
    let format = tags.common(tag::SAMPLE_FORMAT, samples, 1)?;
    let (kind, name) = match format {
        // 4 is "undefined": the bits are what there is.
        1 | 4 => (Kind::Unsigned, "unsigned integers"),
        2 => (Kind::Signed, "signed integers"),
        3 => (Kind::Float, "floats"),
        5 | 6 => return Err(Fault::Unsupported("complex numbers".into(), SAMPLES)),
        other => {
            return Err(Fault::Unsupported(
                format!("samples of format {other}"),
                SAMPLES,
            ));
        }
    };
    match (kind, bits) {
        (Kind::Float, 16 | 24 | 32 | 64) | (Kind::Unsigned | Kind::Signed, 1..=32 | 64) => {
            Ok((kind, bits as usize))
        }
        _ => Err(Fault::Unsupported(format!("{bits}-bit {name}"), SAMPLES)),
    }
}

fn photometric<R: BufRead + Seek>(
    tags: &mut Tags<R>,
    samples: u64,
    codec: &Codec,
    (kind, bits): (Kind, usize),
) -> Result<Photometric, Fault> {
    let unsupported = |found: String| Err(Fault::Unsupported(found, COLORS));
    let found = match tags.number(tag::PHOTOMETRIC)? {
        Some(found) => found,
        // The tag is required; those who forget it write grey or RGB.
        None if samples < 3 => 1,
        None => 2,
    };
    let name = match found {
        0 => return Ok(Photometric::WhiteIsZero),
        // 34892 is DNG's name for bands that are proportional to light.
        1 | 4 | 34892 => return Ok(Photometric::BlackIsZero),
        2 => return Ok(Photometric::Rgb),
        3 if samples == 1 && kind == Kind::Unsigned && bits <= 16 => {
            let colors = tags.numbers(tag::COLOR_MAP, 3 << bits)?.unwrap_or_default();
            return Ok(Photometric::Palette(palette::Colors::new(colors, bits)?));
        }
        3 => {
            return unsupported(format!(
                "a palette with {samples} {bits}-bit samples per pixel"
            ));
        }
        6 if matches!(codec, Codec::Jpeg { .. }) => return Ok(Photometric::YCbCr),
        5 => "CMYK colours",
        6 => "YCbCr colours without JPEG compression",
        8..=10 => "CIE L*a*b* colours",
        32803 => "a camera's raw mosaic",
        32844 | 32845 => "LogLuv colours",
        other => return unsupported(format!("colours of kind {other}")),
    };
    unsupported(name.to_owned())
}

fn planar<R: BufRead + Seek>(tags: &mut Tags<R>) -> Result<bool, Fault> {
    match tags.number(tag::PLANAR_CONFIGURATION)?.unwrap_or(1) {
        1 => Ok(false),
        2 => Ok(true),
        other => Err(Fault::broken(format!("planar configuration {other}"))),
    }
}

/// GDAL's no-data value: text, ended by a zero.
fn nodata<R: BufRead + Seek>(tags: &mut Tags<R>) -> Result<Option<String>, Fault> {
    /// Enough for any number.
    const MOST: u64 = 512;
    let Some(bytes) = tags.bytes(tag::GDAL_NODATA, MOST)? else {
        return Ok(None);
    };
    let text = bytes.split(|&byte| byte == 0).next().unwrap_or_default();
    let text = String::from_utf8_lossy(text).trim().to_owned();
    Ok(Some(text).filter(|text| !text.is_empty()))
}
