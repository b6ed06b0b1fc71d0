//! PBM, PGM, PPM (P1 to P6) and PAM (P7), and PFM, their brother of floats.
//!
//! Read here because the crates do not scale by the largest value that the header names, and take memory on its word.

use std::io::{BufRead, ErrorKind, Read};

use super::error::check_size;
use super::raster::{Raster, channel_names};
use super::samples::Samples;
use super::source::{Bytes, Input, make_room};
use super::{Format, ImageError};

/// Longest number in a header or among samples in text.
const MAX_DIGITS: usize = 16;

/// What a header says.
struct Header {
    width: u64,
    height: u64,
    channels: usize,
    /// The largest value of whole numbers; 1 for bits, 0 where floats follow.
    largest: u64,
}

/// Decodes the first picture of the file.
pub(super) fn decode(mut input: Input) -> Result<Raster, ImageError> {
    let bytes = &mut input.bytes;
    let header = read::<2>(bytes).and_then(|[_, kind]| Ok((kind, Header::read(bytes, kind)?)));
    let (kind, header) = header.map_err(|reason| input.failed(reason))?;
    check_size(input.path, header.width, header.height)?;
    let (width, height) = (header.width as usize, header.height as usize);
    let row = width * header.channels;
    let samples = match (input.format, kind) {
        (Format::Pfm, _) => Samples::F32(floats(&mut input, row, height)?),
        (_, b'1' | b'4') => Samples::U8(bits(&mut input, kind == b'1', row, height)?),
        (_, kind) => {
            let text = matches!(kind, b'2' | b'3');
            integers(&mut input, text, row * height, header.largest)?
        }
    };
    Ok(Raster {
        width,
        height,
        channels: channel_names(header.channels),
        samples,
        nodata: None,
    })
}

impl Header {
    fn read(bytes: &mut Box<dyn Bytes + '_>, kind: u8) -> Result<Self, String> {
        if kind == b'7' {
            return Self::of_pam(bytes);
        }
        Ok(Self {
            width: number(bytes)?,
            height: number(bytes)?,
            channels: if matches!(kind, b'3' | b'6' | b'F') {
                3
            } else {
                1
            },
            largest: match kind {
                b'1' | b'4' => 1,
                b'F' | b'f' => 0,
                _ => number(bytes)?,
            },
        })
    }

    /// A header of words and their values.
    fn of_pam(bytes: &mut Box<dyn Bytes + '_>) -> Result<Self, String> {
        let [mut width, mut height, mut depth, mut largest] = [None; 4];
        loop {
            match &word(bytes)?[..] {
                "WIDTH" => width = Some(number(bytes)?),
                "HEIGHT" => height = Some(number(bytes)?),
                "DEPTH" => depth = Some(number(bytes)?),
                "MAXVAL" => largest = Some(number(bytes)?),
                // The number of samples says as much.
                "TUPLTYPE" => skip_line(bytes)?,
                "ENDHDR" => break,
                other => return Err(format!("found {other:?} in its header")),
            }
        }
        let (Some(width), Some(height), Some(depth @ 1..=4), Some(largest)) =
            (width, height, depth, largest)
        else {
            return Err(
                "WIDTH, HEIGHT, DEPTH from 1 to 4 and MAXVAL are expected in its header".into(),
            );
        };
        Ok(Self {
            width,
            height,
            channels: depth as usize,
            largest,
        })
    }
}

/// Black and white, 0 and 255: a 1 in the file is black.
fn bits(input: &mut Input, text: bool, row: usize, height: usize) -> Result<Vec<u8>, ImageError> {
    let mut samples = Vec::new();
    let mut packed = vec![
        0;
        if text {
            0
        } else {
            row.div_ceil(8).min(1 << 16)
        }
    ];
    for _ in 0..height {
        let mut left = row;
        while left > 0 {
            // In parts: a row may claim more than there is.
            let part = left.min(1 << 19);
            make_room(&mut samples, part, row * height, input.path)?;
            if text {
                for _ in 0..part {
                    let bit = text_bit(&mut input.bytes).map_err(|reason| input.failed(reason))?;
                    samples.push(bit);
                }
            } else {
                let packed = &mut packed[..part.div_ceil(8)];
                fill(&mut input.bytes, packed).map_err(|reason| input.failed(reason))?;
                samples.extend((0..part).map(|x| match packed[x / 8] >> (7 - x % 8) & 1 {
                    0 => u8::MAX,
                    _ => 0,
                }));
            }
            left -= part;
        }
    }
    Ok(samples)
}

fn text_bit(bytes: &mut impl Read) -> Result<u8, String> {
    loop {
        match read::<1>(bytes)? {
            [b'0'] => return Ok(u8::MAX),
            [b'1'] => return Ok(0),
            [c] if c.is_ascii_whitespace() => {}
            [c] => return Err(format!("{:?} among bits", char::from(c))),
        }
    }
}

/// Whole numbers, as fractions of the largest value that the header names: of 255 where that divides it, else of 65535.
fn integers(
    input: &mut Input,
    text: bool,
    total: usize,
    largest: u64,
) -> Result<Samples, ImageError> {
    let failed = |reason: String| ImageError::decode(input.path, Format::Pnm, reason);
    let largest = u16::try_from(largest).ok().filter(|&largest| largest > 0);
    let largest = largest.ok_or_else(|| failed("its largest value is not in 1 .. 65535".into()))?;
    let mut raw: Vec<u16> = Vec::new();
    let mut buffer = vec![0; (2 * total).min(1 << 16)];
    let mut left = total;
    while left > 0 {
        let part = left.min(buffer.len() / 2);
        make_room(&mut raw, part, total, input.path)?;
        if text {
            for _ in 0..part {
                let value = number(&mut input.bytes).map_err(failed)?;
                let beyond = |_| failed(format!("a sample is {value}"));
                raw.push(u16::try_from(value).map_err(beyond)?);
            }
        } else if largest < 256 {
            fill(&mut input.bytes, &mut buffer[..part]).map_err(failed)?;
            raw.extend(buffer[..part].iter().map(|&byte| u16::from(byte)));
        } else {
            fill(&mut input.bytes, &mut buffer[..2 * part]).map_err(failed)?;
            let (pairs, _) = buffer[..2 * part].as_chunks();
            raw.extend(pairs.iter().map(|&pair| u16::from_be_bytes(pair)));
        }
        left -= part;
    }
    if let Some(&beyond) = raw.iter().find(|&&value| value > largest) {
        return Err(failed(format!(
            "a sample is {beyond}; at most {largest} is expected"
        )));
    }
    let fraction = |value: u16, whole: u32| {
        (u32::from(value) * whole + u32::from(largest) / 2) / u32::from(largest)
    };
    Ok(match 255 % largest {
        0 => Samples::U8(raw.into_iter().map(|v| fraction(v, 255) as u8).collect()),
        _ => Samples::U16(
            raw.into_iter()
                .map(|v| fraction(v, 65_535) as u16)
                .collect(),
        ),
    })
}

/// Floats as stored, whose rows come from the bottom. The size of the header's scale is a unit that no one agrees on.
fn floats(input: &mut Input, row: usize, height: usize) -> Result<Vec<f32>, ImageError> {
    let failed = |reason: String| ImageError::decode(input.path, Format::Pfm, reason);
    let scale = word(&mut input.bytes).map_err(failed)?;
    let scale: f32 = scale
        .parse()
        .map_err(|_| failed(format!("its scale is {scale:?}")))?;
    let of_bytes = match scale {
        _ if scale < 0.0 => f32::from_le_bytes,
        _ if scale > 0.0 => f32::from_be_bytes,
        _ => return Err(failed(format!("its scale is {scale}"))),
    };
    let mut samples = Vec::new();
    let mut buffer = vec![0; (4 * row).min(1 << 16)];
    let mut left = row * height;
    while left > 0 {
        let part = left.min(buffer.len() / 4);
        make_room(&mut samples, part, row * height, input.path)?;
        fill(&mut input.bytes, &mut buffer[..4 * part]).map_err(failed)?;
        let (quads, _) = buffer[..4 * part].as_chunks();
        samples.extend(quads.iter().map(|&quad| of_bytes(quad)));
        left -= part;
    }
    for y in 0..height / 2 {
        let (below, above) = samples.split_at_mut((height - 1 - y) * row);
        below[y * row..][..row].swap_with_slice(&mut above[..row]);
    }
    Ok(samples)
}

/// A whole number of the header or of text samples.
fn number(bytes: &mut Box<dyn Bytes + '_>) -> Result<u64, String> {
    let word = word(bytes)?;
    word.parse()
        .map_err(|_| format!("found {word:?}; expected a whole number"))
}

/// The next word, and the one white space behind it. Comments run from # to the end of their line.
fn word(bytes: &mut Box<dyn Bytes + '_>) -> Result<String, String> {
    let mut word = String::new();
    loop {
        let byte = match read::<1>(bytes) {
            Ok([byte]) => byte,
            // Text samples need nothing behind the last.
            Err(_) if !word.is_empty() => return Ok(word),
            Err(reason) => return Err(reason),
        };
        match byte {
            b'#' => {
                skip_line(bytes)?;
                if !word.is_empty() {
                    return Ok(word);
                }
            }
            _ if !byte.is_ascii_whitespace() && word.len() < MAX_DIGITS => word.push(byte.into()),
            _ if byte.is_ascii_whitespace() && word.is_empty() => {}
            _ if byte.is_ascii_whitespace() => return Ok(word),
            _ => return Err(format!("found {word:?}; expected a number")),
        }
    }
}

fn skip_line(bytes: &mut Box<dyn Bytes + '_>) -> Result<(), String> {
    bytes
        .skip_until(b'\n')
        .map(drop)
        .map_err(|error| error.to_string())
}

fn read<const N: usize>(bytes: &mut impl Read) -> Result<[u8; N], String> {
    let mut array = [0; N];
    fill(bytes, &mut array)?;
    Ok(array)
}

fn fill(bytes: &mut impl Read, buffer: &mut [u8]) -> Result<(), String> {
    bytes
        .read_exact(buffer)
        .map_err(|error| match error.kind() {
            ErrorKind::UnexpectedEof => "the file ends before its last pixel".to_owned(),
            _ => error.to_string(),
        })
}

#[cfg(test)]
mod tests;
