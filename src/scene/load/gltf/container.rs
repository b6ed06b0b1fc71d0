//! The two containers of glTF 2.0: plain JSON, and GLB (section 4.4).

use super::{LoadMeshErrorKind, malformed};

/// The JSON text and, in GLB, the first binary chunk.
#[derive(Debug)]
pub(super) struct Container<'a> {
    pub json: &'a [u8],
    pub binary: Option<&'a [u8]>,
}

const MAGIC: &[u8] = b"glTF";
const HEADER: usize = 12;
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Takes a file apart; which container it is goes by its first bytes, not by its name.
pub(super) fn open(bytes: &[u8]) -> Result<Container<'_>, LoadMeshErrorKind> {
    if !bytes.starts_with(MAGIC) {
        return Ok(Container {
            json: text(bytes),
            binary: None,
        });
    }
    let inside = checked_header(bytes)?;
    let (first, mut rest) = chunk(inside)?;
    let Chunk { kind, data: json } = first;
    if kind != b"JSON" {
        let problem = format!(
            "its first chunk is {:?}, not JSON",
            kind.escape_ascii().to_string()
        );
        return Err(malformed("GLB file", problem));
    }
    let mut binary = None;
    // Less than a chunk's header is padding.
    while rest.len() >= 8 && binary.is_none() {
        let (Chunk { kind, data }, after) = chunk(rest)?;
        // Chunks of other kinds are to be ignored.
        binary = (kind == b"BIN\0").then_some(data);
        rest = after;
    }
    Ok(Container {
        json: text(json),
        binary,
    })
}

/// What follows the header, up to the length that it gives; bytes after that are no part of the file.
fn checked_header(bytes: &[u8]) -> Result<&[u8], LoadMeshErrorKind> {
    let word = |at: usize| {
        let word = bytes.get(at..at + 4)?.first_chunk()?;
        Some(u32::from_le_bytes(*word))
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(malformed("GLB header", "the file ends inside it"));
    };
    if version != 2 {
        return Err(LoadMeshErrorKind::Unsupported {
            what: format!("version {version} of GLB; only version 2"),
        });
    }
    let found = bytes.len();
    let inside = usize::try_from(length)
        .ok()
        .and_then(|n| bytes.get(HEADER..n));
    inside.ok_or_else(|| {
        let problem =
            format!("it promises {length} bytes, but the file has {found}; is it cut off?");
        malformed("GLB header", problem)
    })
}

struct Chunk<'a> {
    kind: &'a [u8; 4],
    data: &'a [u8],
}

/// The first chunk, and what follows it.
fn chunk(bytes: &[u8]) -> Result<(Chunk<'_>, &[u8]), LoadMeshErrorKind> {
    let parts = || {
        let (length, rest) = bytes.split_first_chunk::<4>()?;
        let (kind, rest) = rest.split_first_chunk::<4>()?;
        let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
        let (data, rest) = rest.split_at_checked(length)?;
        Some((Chunk { kind, data }, rest))
    };
    parts().ok_or_else(|| {
        malformed(
            "GLB chunk",
            "it does not end inside the file; is it cut off?",
        )
    })
}

/// JSON without a byte order mark, or the zeros that some exporters pad a chunk with.
fn text(bytes: &[u8]) -> &[u8] {
    let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    let padding = bytes.iter().rev().take_while(|&&b| b == 0).count();
    &bytes[..bytes.len() - padding]
}
