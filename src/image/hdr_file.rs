//! Radiance HDR (RGBE), as G. Ward's "Real Pixels" (Graphics Gems II) and Radiance's color.c have it.
//!
//! Read here because the crates take memory for all pixels that a header claims, and know one orientation of eight.
//! EXPOSURE and COLORCORR lines are ignored, as most programs do: pixels are as stored.

use std::io::{BufRead, Read};

use super::ImageError;
use super::error::check_size;
use super::raster::{Raster, channel_names};
use super::samples::Samples;
use super::source::{Bytes, Input, make_room};

/// Red, green, blue and their common exponent.
type Rgbe = [u8; 4];

/// Longest line of a header that is read.
const MAX_LINE: u64 = 1 << 16;

/// How scan lines lie in the picture: the resolution line, like `-Y 480 +X 640`.
struct Layout {
    /// Pixels along a scan line.
    length: usize,
    /// Scan lines.
    count: usize,
    /// Whether scan lines are columns.
    columns: bool,
    /// Whether scan lines come from the right or the bottom.
    lines_reversed: bool,
    /// Whether pixels come from the right or the bottom.
    pixels_reversed: bool,
}

/// Decodes a Radiance picture into linear floats.
pub(super) fn decode(mut input: Input) -> Result<Raster, ImageError> {
    let layout = read_header(&mut input.bytes).map_err(|reason| input.failed(reason))?;
    let (width, height) = match layout.columns {
        false => (layout.length, layout.count),
        true => (layout.count, layout.length),
    };
    check_size(input.path, width as u64, height as u64)?;
    let mut pixels: Vec<[f32; 3]> = Vec::new();
    let mut line = Vec::new();
    for _ in 0..layout.count {
        line.clear();
        read_line(&mut input.bytes, &mut line, layout.length)
            .map_err(|reason| input.failed(reason))?;
        make_room(&mut pixels, line.len(), width * height, input.path)?;
        pixels.extend(line.iter().map(|&rgbe| radiance(rgbe)));
    }
    Ok(Raster {
        width,
        height,
        channels: channel_names(3),
        samples: Samples::F32(layout.upright(pixels).into_flattened()),
        nodata: None,
    })
}

/// Mantissas are fractions of 256, exponents lie 128 above.
fn radiance([r, g, b, e]: Rgbe) -> [f32; 3] {
    // In f64: the smallest scales are below what f32 holds with all bits.
    let scale = f64::exp2(f64::from(e) - 136.0);
    match e {
        0 => [0.0; 3],
        _ => [r, g, b].map(|m| (f64::from(m) * scale) as f32),
    }
}

fn read_header(bytes: &mut impl BufRead) -> Result<Layout, String> {
    let mut first = true;
    loop {
        let line = text_line(bytes)?;
        if line.is_empty() && !first {
            break;
        }
        first = false;
        if let Some(format) = line.strip_prefix("FORMAT=")
            && format.trim() != "32-bit_rle_rgbe"
        {
            return Err(format!("pixels are {format}; 32-bit_rle_rgbe is expected"));
        }
    }
    let line = text_line(bytes)?;
    Layout::of(&line).ok_or_else(|| format!("{line:?} is no resolution like -Y 480 +X 640"))
}

fn text_line(bytes: &mut impl BufRead) -> Result<String, String> {
    let mut line = Vec::new();
    let read = bytes.take(MAX_LINE).read_until(b'\n', &mut line);
    read.map_err(|error| error.to_string())?;
    if line.pop() != Some(b'\n') {
        return Err("its header does not end".to_owned());
    }
    Ok(String::from_utf8_lossy(&line)
        .trim_end_matches('\r')
        .to_owned())
}

impl Layout {
    fn of(line: &str) -> Option<Self> {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let [major, count, minor, length] = words[..] else {
            return None;
        };
        let axis = |word: &str| {
            Some((
                word.strip_prefix(['-', '+'])?.to_owned(),
                word.starts_with('-'),
            ))
        };
        let ((major, major_minus), (minor, minor_minus)) = (axis(major)?, axis(minor)?);
        // X grows to the right and Y up, from the bottom left.
        let columns = match (&major[..], &minor[..]) {
            ("Y", "X") => false,
            ("X", "Y") => true,
            _ => return None,
        };
        Some(Self {
            length: length.parse().ok()?,
            count: count.parse().ok()?,
            columns,
            lines_reversed: major_minus == columns,
            pixels_reversed: minor_minus != columns,
        })
    }

    /// The pixels in rows from the top, each from the left.
    fn upright(&self, pixels: Vec<[f32; 3]>) -> Vec<[f32; 3]> {
        if !self.columns && !self.lines_reversed && !self.pixels_reversed {
            return pixels;
        }
        let (width, height) = match self.columns {
            false => (self.length, self.count),
            true => (self.count, self.length),
        };
        let turned =
            |at: usize, size: usize, reversed: bool| if reversed { size - 1 - at } else { at };
        let place = |x: usize, y: usize| {
            let (line, pixel) = if self.columns { (x, y) } else { (y, x) };
            turned(line, self.count, self.lines_reversed) * self.length
                + turned(pixel, self.length, self.pixels_reversed)
        };
        let pixels = &pixels;
        (0..height)
            .flat_map(|y| (0..width).map(move |x| pixels[place(x, y)]))
            .collect()
    }
}

/// Appends a scan line of `length` pixels, in any of the three codings.
fn read_line(bytes: &mut dyn Bytes, line: &mut Vec<Rgbe>, length: usize) -> Result<(), String> {
    if !(8..=0x7fff).contains(&length) {
        return read_old_line(bytes, line, length, None);
    }
    let start: Rgbe = read(bytes)?;
    let [2, 2, high @ 0..=127, low] = start else {
        return read_old_line(bytes, line, length, Some(start));
    };
    let found = usize::from(high) << 8 | usize::from(low);
    if found != length {
        return Err(format!("a scan line has {found} pixels; expected {length}"));
    }
    line.resize(length, [0; 4]);
    for component in 0..4 {
        let mut x = 0;
        while x < length {
            let [code] = read(bytes)?;
            let (run, value) = match code {
                129.. => (usize::from(code - 128), Some(read::<1>(bytes)?[0])),
                0 => return Err("a run of no pixels".to_owned()),
                _ => (usize::from(code), None),
            };
            let pixels = line
                .get_mut(x..x + run)
                .ok_or("a run beyond its scan line")?;
            for pixel in pixels {
                pixel[component] = match value {
                    Some(value) => value,
                    None => read::<1>(bytes)?[0],
                };
            }
            x += run;
        }
    }
    Ok(())
}

/// Flat pixels, and runs of the pixel before: (1, 1, 1, n), whose n are digits to the base 256, lowest first.
fn read_old_line(
    bytes: &mut dyn Bytes,
    line: &mut Vec<Rgbe>,
    length: usize,
    first: Option<Rgbe>,
) -> Result<(), String> {
    let mut next = first;
    let mut shift = 0;
    while line.len() < length {
        let pixel = match next.take() {
            Some(pixel) => pixel,
            None => read(bytes)?,
        };
        let [1, 1, 1, digit] = pixel else {
            line.push(pixel);
            shift = 0;
            continue;
        };
        let run = usize::from(digit).checked_shl(shift).unwrap_or(usize::MAX);
        let &repeated = line.last().ok_or("a run of no pixel")?;
        if shift > 24 || run > length - line.len() {
            return Err("a run beyond its scan line".to_owned());
        }
        line.resize(line.len() + run, repeated);
        shift += 8;
    }
    Ok(())
}

fn read<const N: usize>(bytes: &mut (impl Read + ?Sized)) -> Result<[u8; N], String> {
    let mut array = [0; N];
    bytes
        .read_exact(&mut array)
        .map_err(|_| "the file ends before its last pixel".to_owned())?;
    Ok(array)
}

#[cfg(test)]
mod tests;
