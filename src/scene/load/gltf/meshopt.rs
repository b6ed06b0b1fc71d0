//! Unpacks the streams of EXT_meshopt_compression and KHR_meshopt_compression, from their specification.
//!
//! Vertex data is split into bytes, each a difference to the vertex before (`vertex`), perhaps of values that a filter stored
//! in fewer bits (`filter`); triangles and other indices are in `index`. Every byte is asked for: a stream that ends too early, or
//! too late, is refused, and output grows as it is decoded.

mod filter;
mod index;
mod vertex;

use super::document::{Meshopt, MeshoptFilter, MeshoptMode};

/// The bytes of `stream.count` elements of `stream.byte_stride` bytes that `packed` holds.
///
/// # Errors
///
/// A sentence for the user, if the description is none that the extension allows or the stream does not follow it.
pub(super) fn decode(stream: &Meshopt, packed: &[u8]) -> Result<Vec<u8>, String> {
    let Meshopt {
        count,
        byte_stride: stride,
        filter,
        ..
    } = *stream;
    if stream.mode == MeshoptMode::Attributes {
        let mut bytes = vertex::decode(packed, count, stride)?;
        filter::apply(filter, &mut bytes, stride)?;
        return Ok(bytes);
    }
    if filter != MeshoptFilter::None {
        return Err(format!("the filter {filter:?} on indices; expected none"));
    }
    let indices = match stream.mode {
        MeshoptMode::Triangles => index::triangles(packed, count)?,
        _ => index::sequence(packed, count)?,
    };
    match stride {
        2 => Ok(indices
            .iter()
            .flat_map(|&i| (i as u16).to_le_bytes())
            .collect()),
        4 => Ok(indices.iter().flat_map(|i| i.to_le_bytes()).collect()),
        _ => Err(format!("indices of {stride} bytes; expected 2 or 4")),
    }
}

/// What is said of a stream whose bytes end too early.
const CUT_OFF: &str = "it ends too early; is it damaged?";

/// What is said of a stream with bytes to spare.
const TOO_LONG: &str = "it goes on after its last element; is it damaged?";

/// Takes `count` bytes off the front.
fn take<'a>(data: &mut &'a [u8], count: usize) -> Result<&'a [u8], String> {
    let (taken, rest) = data.split_at_checked(count).ok_or(CUT_OFF)?;
    *data = rest;
    Ok(taken)
}

/// Takes one byte off the front.
fn take_byte(data: &mut &[u8]) -> Result<u8, String> {
    Ok(take(data, 1)?[0])
}

/// Undoes the zigzag code, which interleaves negative numbers and others.
fn unzigzag(code: u32) -> u32 {
    (code >> 1) ^ (code & 1).wrapping_neg()
}

#[cfg(test)]
pub(super) mod tests;
