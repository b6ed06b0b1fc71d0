//! Which format a picture is in, by its first bytes.

use std::fmt;
use std::path::Path;

/// A picture format that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// PNG.
    Png,
    /// JPEG.
    Jpeg,
    /// TIFF and BigTIFF.
    Tiff,
    /// OpenEXR.
    Exr,
    /// Radiance RGBE.
    Hdr,
    /// WebP.
    WebP,
    /// Windows bitmap.
    Bmp,
    /// Truevision TGA.
    Tga,
    /// PBM, PGM, PPM, PAM: bits, greys or colours in whole numbers, as text or binary.
    Pnm,
    /// PFM: greys or colours in floats.
    Pfm,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::Tiff => "TIFF",
            Self::Exr => "OpenEXR",
            Self::Hdr => "Radiance HDR",
            Self::WebP => "WebP",
            Self::Bmp => "BMP",
            Self::Tga => "TGA",
            Self::Pnm => "PNM",
            Self::Pfm => "PFM",
        })
    }
}

impl Format {
    /// First bytes that [`Self::of`] needs: a TGA's header, which has no signature.
    pub(super) const SIGNATURE: usize = 18;

    /// The format of a picture that starts with these bytes; `path` tells a TGA by its ending.
    pub(super) fn of(start: &[u8], path: &Path) -> Option<Self> {
        const SIGNATURES: [(&[u8], Format); 9] = [
            (b"\x89PNG\r\n\x1a\n", Format::Png),
            (b"\xff\xd8\xff", Format::Jpeg),
            (b"II*\0", Format::Tiff),
            (b"MM\0*", Format::Tiff),
            (b"II+\0", Format::Tiff),
            (b"MM\0+", Format::Tiff),
            (b"\x76\x2f\x31\x01", Format::Exr),
            (b"#?RADIAN", Format::Hdr),
            (b"#?RGBE", Format::Hdr),
        ];
        let signed = SIGNATURES.iter().find(|(sign, _)| start.starts_with(sign));
        if let Some(&(_, format)) = signed {
            return Some(format);
        }
        match start {
            [
                b'R',
                b'I',
                b'F',
                b'F',
                _,
                _,
                _,
                _,
                b'W',
                b'E',
                b'B',
                b'P',
                ..,
            ] => Some(Self::WebP),
            // Two letters are soon met by chance; the length of the header behind them is one of few.
            [b'B', b'M', rest @ ..]
                if matches!(
                    rest.get(12..16)?,
                    [12 | 40 | 52 | 56 | 64 | 108 | 124, 0, 0, 0]
                ) =>
            {
                Some(Self::Bmp)
            }
            [b'P', b'1'..=b'7', c, ..] if c.is_ascii_whitespace() || *c == b'#' => Some(Self::Pnm),
            [b'P', b'F' | b'f', c, ..] if c.is_ascii_whitespace() => Some(Self::Pfm),
            _ if is_tga(start, path) => Some(Self::Tga),
            _ => None,
        }
    }
}

/// Whether the ending says so and the header could be one.
fn is_tga(start: &[u8], path: &Path) -> bool {
    let named = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("tga"));
    named
        && matches!(
            start,
            [
                _,
                0 | 1,
                1 | 2 | 3 | 9 | 10 | 11,
                _,
                _,
                _,
                _,
                _,
                _,
                _,
                _,
                _,
                _,
                _,
                _,
                _,
                8 | 15 | 16 | 24 | 32,
                _
            ]
        )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_known_by_their_first_bytes_but_for_tga() {
        let of = |start: &[u8], name: &str| Format::of(start, Path::new(name));
        assert_eq!(of(b"P5\n3 4\n", "a.png"), Some(Format::Pnm));
        assert_eq!(of(b"P3#why", "a"), Some(Format::Pnm));
        assert_eq!(of(b"Pf 3 4", "a"), Some(Format::Pfm));
        assert_eq!(of(b"PF", "a"), None);
        assert_eq!(of(b"RIFF\x10\0\0\0WEBPVP8L", "a"), Some(Format::WebP));
        assert_eq!(of(b"RIFF\x10\0\0\0WAVE", "a"), None);
        assert_eq!(
            of(b"BM\0\0\0\0\0\0\0\0\0\0\0\0\x28\0\0\0", "a"),
            Some(Format::Bmp)
        );
        assert_eq!(of(b"BM, a text that has eighteen letters", "a"), None);
        let tga = [0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4, 0, 4, 0, 24, 0];
        assert_eq!(of(&tga, "a.TGA"), Some(Format::Tga));
        assert_eq!(of(&tga, "a.png"), None);
        assert_eq!(of(b"Not a picture at all.", "a.tga"), None);
    }
}
