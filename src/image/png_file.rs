//! PNG through the `png` crate, row by row, so that memory is taken as pixels come.

use std::path::Path;

use png::{BitDepth, ColorType, DecodeOptions, Decoder, InterlaceInfo, Reader, Transformations};

use super::error::check_size;
use super::raster::{Raster, channel_names};
use super::samples::{Samples, each_type};
use super::source::{Bytes, Input, make_room};
use super::{Format, ImageError};

/// Longest row that is read, in bytes: the decoder holds a few of them.
const MAX_ROW: usize = 64 << 20;

/// Rows of decoded bytes, as long as the file has given them.
struct Rows {
    /// Each row starts at a byte.
    bytes: Vec<u8>,
    /// Bytes per row.
    stride: usize,
    color: ColorType,
    depth: BitDepth,
}

/// Decodes a PNG, of an animated one the default picture. Palettes become colours; gamma and profiles are ignored.
pub(super) fn decode(input: Input) -> Result<Raster, ImageError> {
    let path = input.path;
    let failed = |error: png::DecodingError| match error {
        png::DecodingError::IoError(source)
            if source.kind() != std::io::ErrorKind::UnexpectedEof =>
        {
            ImageError::read(path, source)
        }
        other => ImageError::decode(path, Format::Png, other),
    };
    let damaged = |reason: &str| ImageError::decode(path, Format::Png, reason);
    let mut options = DecodeOptions::default();
    // What is wrong is wrong: a damaged tRNS would be another picture.
    options.set_skip_ancillary_crc_failures(false);
    options.set_ignore_adler32(false);
    options.set_ignore_text_chunk(true);
    options.set_ignore_iccp_chunk(true);
    let mut decoder = Decoder::new_with_options(input.bytes, options);
    let header = decoder.read_header_info().map_err(failed)?;
    let (width, height) = header.size();
    check_size(path, width.into(), height.into())?;
    let indexed = header.color_type == ColorType::Indexed;
    decoder.set_transformations(match indexed {
        // Expanded here, since the decoder takes an index beyond the palette for black.
        true => Transformations::IDENTITY,
        false => Transformations::EXPAND,
    });
    let mut reader = decoder.read_info().map_err(failed)?;
    let (width, height) = (width as usize, height as usize);
    let rows = read_rows(path, &mut reader, width, height)?;
    // What stands behind the pixels must be whole, too.
    reader.finish().map_err(failed)?;
    let info = reader.info();
    let (channels, samples) = if indexed {
        let palette = info.palette.as_deref().unwrap_or_default();
        if palette.is_empty() || palette.len() % 3 != 0 || palette.len() > 3 * 256 {
            return Err(damaged("its palette is no list of up to 256 colours"));
        }
        let alpha = info.trns.as_deref();
        if alpha.is_some_and(|alpha| alpha.len() > palette.len() / 3) {
            return Err(damaged(
                "more of its colours are transparent than there are",
            ));
        }
        let pixels = rows.colors(width, palette.as_chunks().0, alpha);
        let beyond = || damaged("a pixel has a colour beyond the palette");
        (
            3 + usize::from(alpha.is_some()),
            Samples::U8(pixels.ok_or_else(beyond)?),
        )
    } else {
        let samples = match rows.depth {
            BitDepth::Sixteen => {
                let (pairs, _) = rows.bytes.as_chunks::<2>();
                Samples::U16(pairs.iter().map(|&b| u16::from_be_bytes(b)).collect())
            }
            _ => Samples::U8(rows.bytes),
        };
        (rows.color.samples(), samples)
    };
    if each_type!(&samples, s => s.len()) != width * height * channels {
        return Err(damaged("rows of pixels are missing"));
    }
    Ok(Raster {
        width,
        height,
        channels: channel_names(channels),
        samples,
        nodata: None,
    })
}

/// All rows, interlaced ones put where they belong.
fn read_rows<'a>(
    path: &Path,
    reader: &mut Reader<Box<dyn Bytes + 'a>>,
    width: usize,
    height: usize,
) -> Result<Rows, ImageError> {
    let failed = |error| ImageError::decode(path, Format::Png, error);
    let (color, depth) = reader.output_color_type();
    let stride = reader.output_line_size(width as u32);
    let stride = stride.filter(|&bytes| bytes <= MAX_ROW).ok_or_else(|| {
        let reason = format!("its rows are longer than {MAX_ROW} bytes");
        ImageError::decode(path, Format::Png, reason)
    })?;
    let mut bytes = Vec::new();
    // Of interlaced pictures: each row of a pass, and where its bytes start.
    let mut passes = Vec::new();
    while let Some(row) = reader.next_interlaced_row().map_err(failed)? {
        if let InterlaceInfo::Adam7(place) = row.interlace() {
            passes.push((*place, bytes.len()));
        }
        let total = stride.saturating_mul(height);
        make_room(&mut bytes, row.data().len(), total, path)?;
        bytes.extend_from_slice(row.data());
    }
    if !passes.is_empty() {
        let mut whole = Vec::new();
        make_room(&mut whole, stride * height, stride * height, path)?;
        whole.resize(stride * height, 0);
        let bits = color.samples() as u8 * depth as u8;
        let ends = passes.iter().skip(1).map(|&(_, start)| start);
        for (&(place, start), end) in passes.iter().zip(ends.chain([bytes.len()])) {
            png::expand_interlaced_row(&mut whole, stride, &bytes[start..end], &place, bits);
        }
        bytes = whole;
    }
    Ok(Rows {
        bytes,
        stride,
        color,
        depth,
    })
}

impl Rows {
    /// The colours that the indices name, with their alpha if there is one; `None` where one names none.
    fn colors(&self, width: usize, palette: &[[u8; 3]], alpha: Option<&[u8]>) -> Option<Vec<u8>> {
        let bits = self.depth as usize;
        let mut pixels = Vec::new();
        for row in self.bytes.chunks_exact(self.stride) {
            for x in 0..width {
                let at = x * bits;
                let index = row[at / 8] >> (8 - bits - at % 8) & (0xff >> (8 - bits)) as u8;
                pixels.extend(palette.get(usize::from(index))?);
                if let Some(alpha) = alpha {
                    pixels.push(alpha.get(usize::from(index)).copied().unwrap_or(u8::MAX));
                }
            }
        }
        Some(pixels)
    }
}

#[cfg(test)]
mod tests;
