//! The leader of a DWA block: eleven counts, which the decoder takes memory by (OpenEXR's internal_dwa.c).

use exr::math::Vec2;
use exr::meta::attribute::ChannelDescription;

/// Most bytes that deflate makes of one.
const DEFLATE: u64 = 1032;

/// Most bytes that Huffman coding with runs makes of one: 255 words of nine bits.
const HUFFMAN: u64 = 510;

/// Refuses counts that the block's pixels do not ask for, or that its bytes cannot hold.
pub(super) fn check(
    channels: &[ChannelDescription],
    (width, height): (usize, usize),
    coded: &[u8],
) -> Result<(), String> {
    let (words, _) = coded.as_chunks();
    let counts = words
        .first_chunk()
        .ok_or("a DWA block ends inside of its header")?;
    let [
        _version,
        unknown,
        unknown_coded,
        ac_coded,
        dc_coded,
        rle_coded,
        rle_tokens,
        rle,
        ac,
        dc,
        ac_coding,
    ] = counts.map(u64::from_le_bytes);
    // Of all channels: bytes of the samples, and 8 x 8 blocks.
    let (mut bytes, mut blocks) = (0, 0);
    for channel in channels {
        let Vec2(across, down) = channel.sampling;
        let (w, h) = (width.div_ceil(across) as u64, height.div_ceil(down) as u64);
        bytes += w * h * channel.sample_type.bytes_per_sample() as u64;
        blocks += w.div_ceil(8) * h.div_ceil(8);
    }
    let holds = |coded: u64, ratio: u64, size: u64| size <= coded.saturating_mul(ratio);
    let ac_ratio = if ac_coding == 0 { HUFFMAN } else { DEFLATE };
    let sections = [unknown_coded, ac_coded, dc_coded, rle_coded];
    let sound = sections.iter().fold(0, |sum: u64, &s| sum.saturating_add(s)) <= coded.len() as u64
        && unknown <= bytes
        && rle <= bytes
        && rle_tokens <= 2 * bytes
        && ac <= 64 * blocks
        && dc <= blocks
        && holds(unknown_coded, DEFLATE, unknown)
        && holds(rle_coded, DEFLATE, rle_tokens)
        && holds(rle_tokens, 64, rle)
        && holds(ac_coded, ac_ratio, 2 * ac)
        && holds(dc_coded, DEFLATE, 2 * dc)
        // What is not stored otherwise has a DC coefficient per 64 samples of at most four bytes.
        && bytes <= unknown + rle + 256 * dc;
    match sound {
        true => Ok(()),
        false => Err(format!(
            "the sizes in the header of a DWA block do not fit its {} bytes",
            coded.len()
        )),
    }
}

#[cfg(test)]
mod tests {
    use exr::meta::attribute::SampleType;

    use super::*;

    /// A block of 8 x 8 halves: one DC coefficient, no others.
    fn leader(change: impl Fn(&mut [u64; 11])) -> Result<(), String> {
        let mut counts = [2, 0, 0, 0, 20, 0, 0, 0, 0, 1, 0];
        change(&mut counts);
        let mut coded: Vec<u8> = counts
            .iter()
            .flat_map(|count| count.to_le_bytes())
            .collect();
        coded.extend([0; 20]);
        let channel = ChannelDescription::named("Y", SampleType::F16);
        check(&[channel], (8, 8), &coded)
    }

    #[test]
    fn counts_beyond_the_pixels_or_the_bytes_are_refused() {
        assert_eq!(leader(|_| {}), Ok(()));
        for place in 1..10 {
            for count in [1 << 14, 1 << 60, u64::MAX] {
                let refused = leader(|counts| counts[place] = count);
                assert!(refused.is_err(), "count {place} of {count}");
            }
        }
        assert!(leader(|counts| counts[9] = 0).is_err());
        assert!(check(&[], (8, 8), &[0; 87]).is_err());
    }
}
