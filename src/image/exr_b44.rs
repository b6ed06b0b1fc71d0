//! B44 blocks with subsampled channels, which the `exr` crate takes for four times as many samples: decoded channel by channel.

use exr::math::Vec2;
use exr::meta::attribute::{ChannelList, IntegerBounds, SampleType};
use exr::meta::header::Header;
use exr::prelude::SmallVec;

/// The planes of a block's channels, one after another; `sizes` are samples across and down of each.
pub(super) fn planes(
    header: &Header,
    sizes: &[(usize, usize)],
    coded: &[u8],
) -> Result<Vec<Vec<u8>>, String> {
    let mut rest = coded;
    let mut planes = Vec::new();
    for (channel, &(width, height)) in header.channels.list.iter().zip(sizes) {
        let half = channel.sample_type == SampleType::F16;
        let length = match half {
            true => packed_length(rest, width.div_ceil(4) * height.div_ceil(4)),
            false => Some(4 * width * height),
        };
        let split = length.and_then(|length| rest.split_at_checked(length));
        let (part, behind) = split.ok_or("a B44 block ends before its last channel")?;
        rest = behind;
        if !half || part.is_empty() {
            planes.push(part.to_vec());
            continue;
        }
        let mut part = part.to_vec();
        // As many bytes as the samples take would be read as samples.
        if part.len() == 2 * width * height {
            part.push(0);
        }
        let mut alone = header.clone();
        let mut channel = channel.clone();
        channel.sampling = Vec2(1, 1);
        alone.channels = ChannelList::new(SmallVec::from_iter([channel]));
        let place = IntegerBounds::new((0, 0), (width, height));
        let plane = header
            .compression
            .decompress_image_section_from_le(&alone, part, place, false);
        planes.push(plane.map_err(|error| error.to_string())?);
    }
    Ok(planes)
}

/// Bytes of so many squares of 4 x 4 samples: three where all are equal, which the third byte says, else fourteen.
fn packed_length(coded: &[u8], squares: usize) -> Option<usize> {
    let mut length = 0;
    for _ in 0..squares {
        length += match *coded.get(length + 2)? {
            52.. => 3,
            _ => 14,
        };
    }
    Some(length)
}

#[cfg(test)]
mod tests {
    use exr::meta::attribute::ChannelDescription;
    use exr::prelude::*;

    use super::*;

    fn header(channels: Vec<ChannelDescription>) -> Header {
        let encoding = Encoding {
            compression: Compression::B44A,
            ..Encoding::UNCOMPRESSED
        };
        let channels = SmallVec::from_iter(channels);
        Header::new("b44".into(), (14, 8), channels).with_encoding(
            encoding.compression,
            exr::meta::BlockDescription::ScanLines,
            encoding.line_order,
        )
    }

    fn half(name: &'static str) -> ChannelDescription {
        ChannelDescription::named(name, SampleType::F16)
    }

    #[test]
    fn planes_of_several_sizes_are_decoded_one_by_one() {
        // Powers of two, which four bits of differences keep; and one value all over.
        let varied: Vec<u8> = (0..14 * 8)
            .flat_map(|i| f16::from_f32(1.0 + (i % 2) as f32).to_ne_bytes())
            .collect();
        let flat: Vec<u8> = (0..7 * 2)
            .flat_map(|_| f16::from_f32(0.25).to_ne_bytes())
            .collect();
        let code = |samples: &[u8], size: (usize, usize)| {
            let header = header(vec![half("Y")]);
            let place = IntegerBounds::new((0, 0), size);
            let compression = header.compression;
            compression
                .compress_image_section_to_le(&header, samples.to_vec(), place)
                .unwrap()
        };
        let coded = [code(&flat, (7, 2)), code(&varied, (14, 8))].concat();
        let both = header(vec![half("X"), half("Y")]);
        let sizes = [(7, 2), (14, 8)];
        let planes = |coded: &[u8]| planes(&both, &sizes, coded);
        assert_eq!(planes(&coded).unwrap(), [flat, varied]);
        for length in 0..coded.len() {
            assert!(planes(&coded[..length]).is_err(), "{length}");
        }
    }
}
