//! The blocks of an EXR part: rows of tiles or runs of scan lines, each looked up in the part's table of chunks.
//!
//! Every block must come as the table says, once; sizes are checked against the bytes there are before the `exr` crate
//! believes them; planes grow as blocks are decoded.

use exr::compression::Compression;
use exr::math::Vec2;
use exr::meta::BlockDescription;
use exr::meta::attribute::{ChannelDescription, IntegerBounds, SampleType};
use exr::meta::header::Header;
use exr::prelude::f16;

use super::exr_b44;
use super::exr_dwa;
use super::exr_file::ExrFile;
use super::exr_picture::ExrSamples;
use super::source::make_room;
use super::{Format, ImageError};
use crate::files::guard::guarded;

/// A channel over the data window, top row first.
pub(super) struct Plane {
    /// Samples across.
    pub width: usize,
    /// Pixels per sample across and down.
    pub sampling: (usize, usize),
    pub samples: ExrSamples,
}

/// Channels of a part.
pub(super) struct Planes {
    pub planes: Vec<Plane>,
}

/// A block of pixels: where it lies in the data window, and its size.
#[derive(Clone, Copy)]
struct Block {
    x: usize,
    y: usize,
    width: usize,
    height: usize,
}

/// Blocks of a part at full resolution.
struct Grid {
    /// Pixels of a whole block, across and down.
    size: (usize, usize),
    /// Blocks across and down.
    count: (usize, usize),
    tiled: bool,
}

impl Planes {
    /// The channels with these indices of a part.
    pub fn read(file: &mut ExrFile, part: usize, wanted: &[usize]) -> Result<Self, ImageError> {
        let mut header = file.meta.headers[part].clone();
        let (width, height) = (header.layer_size.width(), header.layer_size.height());
        let grid = Grid::of(&header);
        let table = table(file, part)?;
        let plane = |&channel: &usize| {
            let description = &header.channels.list[channel];
            let Vec2(across, down) = description.sampling;
            Plane {
                width: width / across,
                sampling: (across, down),
                samples: match description.sample_type {
                    SampleType::U32 => ExrSamples::U32(Vec::new()),
                    SampleType::F16 | SampleType::F32 => ExrSamples::F32(Vec::new()),
                },
            }
        };
        let mut planes: Vec<Plane> = wanted.iter().map(plane).collect();
        for row in 0..grid.count.1 {
            let mut blocks = Vec::with_capacity(grid.count.0.min(1 << 10));
            for column in 0..grid.count.0 {
                let block = grid.block(&header, column, row);
                let start = table[row * grid.count.0 + column];
                let coded = chunk(file, part, &header, &grid, (column, row), start)?;
                let decoded = decompress(&mut header, block, coded)
                    .map_err(|reason| ImageError::decode(file.path, Format::Exr, reason))?;
                blocks.push((block, decoded));
            }
            append(file, &header, wanted, &mut planes, &blocks, height)?;
        }
        Ok(Self { planes })
    }
}

impl Plane {
    /// Integers become the nearest floats.
    pub fn into_floats(self) -> Vec<f32> {
        match self.samples {
            ExrSamples::F32(samples) => samples,
            ExrSamples::U32(samples) => samples.into_iter().map(|x| x as f32).collect(),
        }
    }
}

impl Grid {
    fn of(header: &Header) -> Self {
        let (width, height) = (header.layer_size.width(), header.layer_size.height());
        let (size, tiled) = match header.blocks {
            BlockDescription::ScanLines => {
                ((width, header.compression.scan_lines_per_block()), false)
            }
            BlockDescription::Tiles(tiles) => {
                let Vec2(across, down) = tiles.tile_size;
                ((across.max(1), down.max(1)), true)
            }
        };
        Self {
            size,
            count: (width.div_ceil(size.0), height.div_ceil(size.1)),
            tiled,
        }
    }

    fn block(&self, header: &Header, column: usize, row: usize) -> Block {
        let (x, y) = (column * self.size.0, row * self.size.1);
        Block {
            x,
            y,
            width: self.size.0.min(header.layer_size.width() - x),
            height: self.size.1.min(header.layer_size.height() - y),
        }
    }
}

/// Where the chunks of a part start: those of the full resolution stand first, row by row, whatever their order in the file.
fn table(file: &mut ExrFile, part: usize) -> Result<Vec<u64>, ImageError> {
    let before: usize = file.meta.headers[..part]
        .iter()
        .map(|h| h.chunk_count)
        .sum();
    let start = file.tables + 8 * before as u64;
    let bytes = file.bytes_at(start, 8 * file.meta.headers[part].chunk_count)?;
    let (entries, _) = bytes.as_chunks();
    Ok(entries
        .iter()
        .map(|&entry| u64::from_le_bytes(entry))
        .collect())
}

/// The coded bytes of the chunk at `start`, which must be of the block at this place of the grid.
fn chunk(
    file: &mut ExrFile,
    part: usize,
    header: &Header,
    grid: &Grid,
    (column, row): (usize, usize),
    start: u64,
) -> Result<Vec<u8>, ImageError> {
    let y = i64::from(header.own_attributes.layer_position.y()) + (row * grid.size.1) as i64;
    let mut expected = Vec::new();
    if file.meta.requirements.is_multilayer() {
        expected.push(part as i64);
    }
    match grid.tiled {
        true => expected.extend([column as i64, row as i64, 0, 0]),
        false => expected.push(y),
    }
    let leader = file.bytes_at(start, 4 * (expected.len() + 1))?;
    let (words, _) = leader.as_chunks();
    let mut words = words
        .iter()
        .map(|&word| i64::from(i32::from_le_bytes(word)));
    let place: Vec<i64> = words.by_ref().take(expected.len()).collect();
    let damaged = |reason: String| ImageError::decode(file.path, Format::Exr, reason);
    if place != expected {
        let reason = format!(
            "its table of blocks is damaged: {place:?} stands where {expected:?} is expected"
        );
        return Err(damaged(reason));
    }
    let size = words.next().unwrap_or(0);
    let size = usize::try_from(size).map_err(|_| damaged("a block of a negative size".into()))?;
    file.bytes_at(start + leader.len() as u64, size)
}

/// Samples of a channel in a block's row `y`, counted in the data window.
fn samples_across(sampling: Vec2<usize>, block: Block, y: usize) -> usize {
    match y % sampling.y() {
        0 => block.width / sampling.x(),
        _ => 0,
    }
}

/// The bytes of a block, row by row, channel by channel within a row.
fn decompress(header: &mut Header, block: Block, coded: Vec<u8>) -> Result<Vec<u8>, String> {
    let rows = block.y..block.y + block.height;
    let row_bytes = |y: usize| -> usize {
        let channels = header.channels.list.iter();
        let bytes = |c: &ChannelDescription| {
            samples_across(c.sampling, block, y) * c.sample_type.bytes_per_sample()
        };
        channels.map(bytes).sum()
    };
    let size: usize = rows.map(row_bytes).sum();
    if coded.len() == size {
        // Stored as it is, since it did not get smaller.
        return Ok(coded);
    }
    plausible(header, block, &coded, size)?;
    let full = |c: &ChannelDescription| c.sampling == Vec2(1, 1);
    let b44 = matches!(header.compression, Compression::B44 | Compression::B44A);
    if b44 && !header.channels.list.iter().all(full) {
        return guarded(|| interleaved(header, block, &coded))?;
    }
    // The crate takes all channels for full ones; what it multiplies by is set so that the product is right.
    header.channels.bytes_per_pixel = size / (block.width * block.height);
    if header.channels.bytes_per_pixel * block.width * block.height != size {
        return Err("the sampling of its channels is not supported".into());
    }
    let place = IntegerBounds {
        position: Vec2(block.x as i32, block.y as i32),
        size: Vec2(block.width, block.height),
    };
    let compression = header.compression;
    // In this thread: a decoder that panics in a worker of its own takes the whole program down.
    let decoded =
        guarded(|| compression.decompress_image_section_from_le(header, coded, place, false))?;
    let decoded = decoded.map_err(|error| error.to_string())?;
    match decoded.len() == size {
        true => Ok(decoded),
        false => Err("a block has another size than its pixels take".into()),
    }
}

/// A B44 block of subsampled channels, row by row.
fn interleaved(header: &Header, block: Block, coded: &[u8]) -> Result<Vec<u8>, String> {
    let channels = &header.channels.list;
    let rows = || block.y..block.y + block.height;
    let size = |c: &ChannelDescription| {
        let down = rows().filter(|y| y.is_multiple_of(c.sampling.y())).count();
        (block.width / c.sampling.x(), down)
    };
    let sizes: Vec<(usize, usize)> = channels.iter().map(size).collect();
    let planes = exr_b44::planes(header, &sizes, coded)?;
    let mut starts = vec![0; planes.len()];
    let mut bytes = Vec::new();
    for y in rows() {
        for ((channel, plane), start) in channels.iter().zip(&planes).zip(&mut starts) {
            let count = samples_across(channel.sampling, block, y);
            let end = *start + count * channel.sample_type.bytes_per_sample();
            bytes.extend_from_slice(&plane[*start..end]);
            *start = end;
        }
    }
    Ok(bytes)
}

/// Refuses a block that claims more than its bytes can hold, before memory is taken for it.
fn plausible(header: &Header, block: Block, coded: &[u8], size: usize) -> Result<(), String> {
    // Bytes per byte at most: deflate makes 258 of two bits, a run of RLE 128 of two bytes, one of PIZ 510 of nine bits;
    // B44 packs 32 bytes into three, PXR24 deflates three bytes of four.
    let most = match header.compression {
        Compression::Uncompressed => 1,
        Compression::RLE => 64,
        Compression::ZIP1 | Compression::ZIP16 => 1032,
        Compression::PIZ => 512,
        Compression::PXR24 => 1376,
        Compression::B44 | Compression::B44A => 11,
        Compression::DWAA(_) | Compression::DWAB(_) => {
            return exr_dwa::check(&header.channels.list, (block.width, block.height), coded);
        }
        other => return Err(format!("{other} is not supported")),
    };
    let length = coded.len();
    if size > length.saturating_mul(most) {
        return Err(format!("a block of {length} bytes cannot hold {size}"));
    }
    Ok(())
}

/// Appends a row of blocks to the planes.
fn append(
    file: &ExrFile,
    header: &Header,
    wanted: &[usize],
    planes: &mut [Plane],
    blocks: &[(Block, Vec<u8>)],
    height: usize,
) -> Result<(), ImageError> {
    let [(first, _), ..] = blocks else {
        return Ok(());
    };
    let channels = &header.channels.list;
    // Where the next row of each block starts.
    let mut starts = vec![0; blocks.len()];
    for y in first.y..first.y + first.height {
        for ((block, bytes), start) in blocks.iter().zip(&mut starts) {
            for (index, channel) in channels.iter().enumerate() {
                let count = samples_across(channel.sampling, *block, y);
                let end = *start + count * channel.sample_type.bytes_per_sample();
                let row = &bytes[*start..end];
                *start = end;
                for (plane, _) in planes.iter_mut().zip(wanted).filter(|&(_, &c)| c == index) {
                    let total = plane.width * (height / plane.sampling.1);
                    match &mut plane.samples {
                        ExrSamples::F32(samples) => {
                            make_room(samples, count, total, file.path)?;
                            match channel.sample_type {
                                SampleType::F16 => samples.extend(halves(row)),
                                _ => samples.extend(words(row).map(f32::from_ne_bytes)),
                            }
                        }
                        ExrSamples::U32(samples) => {
                            make_room(samples, count, total, file.path)?;
                            samples.extend(words(row).map(u32::from_ne_bytes));
                        }
                    }
                }
            }
        }
    }
    Ok(())
}

fn halves(bytes: &[u8]) -> impl Iterator<Item = f32> {
    let (pairs, _) = bytes.as_chunks();
    pairs.iter().map(|&pair| f16::from_ne_bytes(pair).to_f32())
}

fn words(bytes: &[u8]) -> impl Iterator<Item = [u8; 4]> {
    let (words, _) = bytes.as_chunks();
    words.iter().copied()
}
