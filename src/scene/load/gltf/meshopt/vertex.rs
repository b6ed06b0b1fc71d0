//! Mode ATTRIBUTES, versions 0 and 1 of the vertex codec.

use super::{CUT_OFF, TOO_LONG, take, take_byte, unzigzag};

/// Elements whose bytes are stored by one of a few widths.
const GROUP: usize = 16;
/// Most elements and most bytes of a block.
const BLOCK: usize = 256;
const BLOCK_BYTES: usize = 8192;

/// Elements of `stride` bytes.
pub(super) fn decode(packed: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, String> {
    if stride == 0 || stride > 256 || !stride.is_multiple_of(4) {
        return Err(format!(
            "elements of {stride} bytes; expected a multiple of 4 up to 256"
        ));
    }
    let version = match packed.first() {
        Some(0xa0) => Version::Zero,
        Some(0xa1) => Version::One,
        _ => return Err("it does not begin as vertex data does".into()),
    };
    let (tail, padded) = match version {
        Version::Zero => (stride, stride.max(32)),
        Version::One => (stride + stride / 4, (stride + stride / 4).max(24)),
    };
    let body = packed
        .len()
        .checked_sub(padded)
        .filter(|&n| n > 0)
        .ok_or(CUT_OFF)?;
    let mut data = &packed[1..body];
    // What the first element is a difference to, and how those of each four bytes are stored.
    let (first, channels) = packed[packed.len() - tail..].split_at(stride);
    let mut last = first.to_vec();
    let mut out = Vec::new();
    let most = (BLOCK_BYTES / stride / GROUP * GROUP).min(BLOCK);
    let mut left = count;
    while left > 0 {
        let elements = left.min(most);
        let deltas = block(&mut data, elements, stride, version)?;
        let start = out.len();
        out.resize(start + elements * stride, 0);
        add_up(&deltas, channels, &mut last, &mut out[start..])?;
        left -= elements;
    }
    if !data.is_empty() {
        return Err(TOO_LONG.into());
    }
    Ok(out)
}

#[derive(Clone, Copy, PartialEq)]
enum Version {
    Zero,
    One,
}

/// The coded differences of a block, byte by byte of the element, `GROUP`s of elements each.
fn block(
    data: &mut &[u8],
    elements: usize,
    stride: usize,
    version: Version,
) -> Result<Vec<u8>, String> {
    let controls = match version {
        Version::Zero => &[],
        Version::One => take(data, stride / 4)?,
    };
    let padded = elements.next_multiple_of(GROUP);
    let mut deltas = vec![0; padded * stride];
    for (byte, out) in deltas.chunks_exact_mut(padded).enumerate() {
        let control = controls.get(byte / 4).map(|c| c >> (2 * (byte % 4)) & 3);
        let widths = match control {
            None => [0, 2, 4, 8],
            Some(0) => [0, 1, 2, 4],
            Some(1) => [1, 2, 4, 8],
            Some(2) => continue,
            Some(_) => {
                out[..elements].copy_from_slice(take(data, elements)?);
                continue;
            }
        };
        let groups = padded / GROUP;
        let header = take(data, groups.div_ceil(4))?;
        for (group, out) in out.chunks_exact_mut(GROUP).enumerate() {
            let width = widths[usize::from(header[group / 4] >> (2 * (group % 4)) & 3)];
            read_group(data, width, out)?;
        }
    }
    Ok(deltas)
}

/// `GROUP` numbers of `width` bits; those with all bits set follow as bytes.
fn read_group(data: &mut &[u8], width: usize, out: &mut [u8]) -> Result<(), String> {
    if width == 0 {
        return Ok(());
    }
    let bits = take(data, GROUP * width / 8)?;
    if width == 8 {
        out.copy_from_slice(bits);
        return Ok(());
    }
    let (per_byte, escape) = (8 / width, (1 << width) - 1);
    for (i, out) in out.iter_mut().enumerate() {
        let place = i % per_byte;
        // Single bits stand lowest first, wider numbers highest first.
        let shift = if width == 1 {
            place
        } else {
            8 - width * (place + 1)
        };
        let number = bits[i / per_byte] >> shift & escape;
        *out = if number == escape {
            take_byte(data)?
        } else {
            number
        };
    }
    Ok(())
}

/// Adds the differences up to elements, four bytes at a time.
fn add_up(deltas: &[u8], channels: &[u8], last: &mut [u8], out: &mut [u8]) -> Result<(), String> {
    let stride = last.len();
    let padded = deltas.len() / stride;
    for (word, last) in last.as_chunks_mut::<4>().0.iter_mut().enumerate() {
        // Version 0 has bytes only.
        let channel = channels.get(word).copied().unwrap_or(0);
        for (i, element) in out.chunks_exact_mut(stride).enumerate() {
            let delta = [0, 1, 2, 3].map(|byte| deltas[(4 * word + byte) * padded + i]);
            *last = match channel & 3 {
                0 => [0, 1, 2, 3].map(|b| last[b].wrapping_add(unzigzag(delta[b].into()) as u8)),
                1 => {
                    let half = |b: usize| {
                        let delta = u16::from_le_bytes([delta[b], delta[b + 1]]);
                        let before = u16::from_le_bytes([last[b], last[b + 1]]);
                        before
                            .wrapping_add(unzigzag(delta.into()) as u16)
                            .to_le_bytes()
                    };
                    let ([a, b], [c, d]) = (half(0), half(2));
                    [a, b, c, d]
                }
                2 => {
                    let turned = u32::from_le_bytes(delta).rotate_right(u32::from(channel >> 4));
                    (u32::from_le_bytes(*last) ^ turned).to_le_bytes()
                }
                _ => return Err("it codes differences in an unknown way; is it damaged?".into()),
            };
            element[4 * word..4 * word + 4].copy_from_slice(last);
        }
    }
    Ok(())
}
