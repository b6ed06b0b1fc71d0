//! Compression: from the bytes of a strip or tile to those of its pixels, never more of them than are wanted.

use std::io::{self, Read as _};

use flate2::read::ZlibDecoder;
use ruzstd::decoding::StreamingDecoder;
use weezl::{BitOrder, LzwStatus, decode};

use super::Fault;

/// How strips and tiles are compressed.
#[derive(Debug, PartialEq)]
pub(super) enum Codec {
    None,
    Lzw,
    Deflate,
    PackBits,
    Zstd,
    /// With the tables that all strips or tiles share.
    Jpeg {
        tables: Vec<u8>,
    },
}

const EXPECTED: &str = "no compression, LZW, Deflate, PackBits, ZSTD or JPEG is expected";

impl Codec {
    /// The codec of this number; tables are asked for where there may be some.
    pub fn of(
        number: u64,
        tables: impl FnOnce() -> Result<Option<Vec<u8>>, Fault>,
    ) -> Result<Self, Fault> {
        let name = match number {
            1 => return Ok(Self::None),
            5 => return Ok(Self::Lzw),
            7 => {
                return Ok(Self::Jpeg {
                    tables: tables()?.unwrap_or_default(),
                });
            }
            8 | 32946 => return Ok(Self::Deflate),
            32773 => return Ok(Self::PackBits),
            34926 | 50000 => return Ok(Self::Zstd),
            2..=4 | 32771 => "CCITT fax",
            6 => "old-style JPEG",
            32766 => "NeXT",
            32809 => "ThunderScan",
            32908 | 32909 => "Pixar",
            33003..=33005 | 34712 => "JPEG 2000",
            34661 => "JBIG",
            34676 | 34677 => "SGI Log",
            34887 => "LERC",
            34892 => "lossy DNG",
            34925 => "LZMA",
            34927 | 50001 => "WebP",
            34933 => "PNG",
            22610 | 34934 => "JPEG XR",
            50002 | 52546 => "JPEG XL",
            other => {
                let found = format!("pixels in compression {other}");
                return Err(Fault::Unsupported(found, EXPECTED));
            }
        };
        let found = format!("pixels in {name} compression");
        Err(Fault::Unsupported(found, EXPECTED))
    }

    /// Whether samples may be told by a predictor.
    pub fn has_predictor(&self) -> bool {
        !matches!(self, Self::None | Self::Jpeg { .. })
    }

    /// The first `wanted` bytes of the pixels, or as many as there are.
    pub fn decompress(&self, data: &[u8], wanted: usize) -> Result<Vec<u8>, String> {
        match self {
            Self::Lzw => lzw(data, wanted),
            Self::Deflate => deflate(data, wanted),
            Self::PackBits => Ok(pack_bits(data, wanted)),
            Self::Zstd => zstd(data, wanted),
            Self::None | Self::Jpeg { .. } => Ok(data[..wanted.min(data.len())].to_vec()),
        }
    }
}

fn lzw(mut data: &[u8], wanted: usize) -> Result<Vec<u8>, String> {
    /// Least and most bytes by which the output grows.
    const STEP: usize = 1 << 16;
    // Codes that begin at the lowest bit, as in GIF, are those of libtiff before TIFF 5.0; the first is a clear code.
    let old = matches!(data, [0, second, ..] if second & 1 == 1);
    let configuration = match old {
        true => decode::Configuration::new(BitOrder::Lsb, 8),
        false => decode::Configuration::with_tiff_size_switch(BitOrder::Msb, 8),
    };
    // The end code may be missing: what follows the last pixel is not looked at.
    let mut decoder = configuration.with_yield_on_full_buffer(true).build();
    let mut pixels = Vec::new();
    while pixels.len() < wanted {
        let start = pixels.len();
        let step = (wanted - start).min(STEP.max(start));
        pixels.try_reserve(step).map_err(|e| e.to_string())?;
        pixels.resize(start + step, 0);
        let made = decoder.decode_bytes(data, &mut pixels[start..]);
        pixels.truncate(start + made.consumed_out);
        data = &data[made.consumed_in..];
        match made.status {
            Ok(LzwStatus::Ok) if made.consumed_in + made.consumed_out > 0 => {}
            Ok(_) => break,
            Err(error) => return Err(error.to_string()),
        }
    }
    Ok(pixels)
}

fn deflate(data: &[u8], wanted: usize) -> Result<Vec<u8>, String> {
    let mut decoder = ZlibDecoder::new(data);
    let pixels = up_to(&mut decoder, wanted)?;
    if pixels.len() == wanted {
        // Where the stream ends here its checksum is compared; where the checksum is missing, so be it.
        match decoder.read(&mut [0]) {
            Err(error) if error.kind() != io::ErrorKind::UnexpectedEof => {
                return Err(error.to_string());
            }
            _ => {}
        }
    }
    Ok(pixels)
}

fn zstd(data: &[u8], wanted: usize) -> Result<Vec<u8>, String> {
    let mut decoder = StreamingDecoder::new(data).map_err(|e| e.to_string())?;
    let pixels = up_to(&mut decoder, wanted)?;
    let frame = &decoder.decoder;
    match (
        frame.get_checksum_from_data(),
        frame.get_calculated_checksum(),
    ) {
        // Of all that was read, so that it says nothing of a frame that goes on.
        (Some(told), Some(found))
            if frame.is_finished() && frame.can_collect() == 0 && told != found =>
        {
            Err("the checksum of its ZSTD frame is another".to_owned())
        }
        _ => Ok(pixels),
    }
}

/// What a decoder makes, grown as it comes.
fn up_to(decoder: &mut impl io::Read, wanted: usize) -> Result<Vec<u8>, String> {
    let mut pixels = Vec::new();
    match decoder.take(wanted as u64).read_to_end(&mut pixels) {
        // Too few bytes are noticed by who wanted them.
        Err(error) if error.kind() != io::ErrorKind::UnexpectedEof => Err(error.to_string()),
        _ => Ok(pixels),
    }
}

/// TIFF 6.0, section 9: a count n, then n + 1 bytes as they are, or one byte that stands for 1 - n, if n is negative.
fn pack_bits(mut data: &[u8], wanted: usize) -> Vec<u8> {
    let mut pixels = Vec::new();
    while let [count, rest @ ..] = data
        && pixels.len() < wanted
    {
        let count = i8::from_ne_bytes([*count]);
        let room = wanted - pixels.len();
        data = match (count, rest) {
            (-128, _) => rest,
            (0.., _) => {
                let (run, rest) = rest.split_at(rest.len().min(count as usize + 1));
                pixels.extend_from_slice(&run[..run.len().min(room)]);
                rest
            }
            (_, [byte, rest @ ..]) => {
                let run = usize::from(count.unsigned_abs()) + 1;
                pixels.resize(pixels.len() + run.min(room), *byte);
                rest
            }
            (_, []) => rest,
        };
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_bits_are_runs_and_copies() {
        // The example of Apple's technical note 1023.
        let packed = [
            0xfe, 0xaa, 0x02, 0x80, 0x00, 0x2a, 0xfd, 0xaa, 0x03, 0x80, 0x00, 0x2a, 0x22, 0xf7,
            0xaa,
        ];
        let mut unpacked = vec![0xaa, 0xaa, 0xaa, 0x80, 0x00, 0x2a, 0xaa, 0xaa, 0xaa, 0xaa];
        unpacked.extend([0x80, 0x00, 0x2a, 0x22]);
        unpacked.extend([0xaa; 10]);
        assert_eq!(pack_bits(&packed, 1000), unpacked);
        for wanted in 0..unpacked.len() {
            assert_eq!(pack_bits(&packed, wanted), unpacked[..wanted]);
        }
        assert_eq!(pack_bits(&[0x80, 0x05, 1, 2], 10), [1, 2]);
        assert!(pack_bits(&[0xfe], 10).is_empty());
    }
}
