//! Files for the tests of this room.

use std::path::{Path, PathBuf};

use image::{DynamicImage, ImageFormat};
use tempfile::TempDir;

use super::test_tiff::Tiff;

/// A channel's name and samples, top row first.
pub type NamedSamples<'a> = (&'a str, exr::prelude::FlatSamples);

/// A folder that lives as long as the test.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn picture(&self, format: ImageFormat, picture: impl Into<DynamicImage>) -> PathBuf {
        let path = self.path("picture");
        picture.into().save_with_format(&path, format).unwrap();
        path
    }

    pub fn tiff(&self, picture: &Tiff) -> PathBuf {
        let path = self.path("picture.tif");
        std::fs::write(&path, picture.bytes()).unwrap();
        path
    }

    /// Layers of (name, channels).
    pub fn exr(
        &self,
        size: (usize, usize),
        compression: exr::prelude::Compression,
        layers: Vec<(Option<&str>, Vec<NamedSamples>)>,
    ) -> PathBuf {
        use exr::prelude::*;
        let path = self.path("picture.exr");
        let layers = layers.into_iter().map(|(name, channels)| {
            let attributes = LayerAttributes {
                layer_name: name.map(Text::from),
                ..Default::default()
            };
            let encoding = Encoding {
                compression,
                ..Encoding::UNCOMPRESSED
            };
            let channels = channels
                .into_iter()
                .map(|(name, samples)| AnyChannel::new(name, samples));
            Layer::new(
                size,
                attributes,
                encoding,
                AnyChannels::sort(channels.collect()),
            )
        });
        let window = ImageAttributes::new(IntegerBounds::from_dimensions(size));
        let layers: Layers<_> = layers.collect();
        Image::from_layers(window, layers)
            .write()
            .to_file(&path)
            .unwrap();
        path
    }
}

/// Numbers that compress badly, so that every part of a file matters.
pub fn noise(count: usize) -> impl Iterator<Item = u32> {
    let count = u32::try_from(count).unwrap_or(u32::MAX);
    (0..count).map(|i| (i ^ 0x5bd1).wrapping_mul(0x9e37_79b1).rotate_left(i % 31))
}

/// A PNG chunk: length, name, data, checksum.
pub fn chunk(name: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let body = [&name[..], data].concat();
    let crc = crc32fast::hash(&body);
    [
        &(data.len() as u32).to_be_bytes()[..],
        &body,
        &crc.to_be_bytes(),
    ]
    .concat()
}

/// A PNG whose rows, each led by its filter byte 0, are stored without compression.
pub fn png(width: u32, height: u32, depth: u8, color: u8, palette: &[u8], rows: &[u8]) -> Vec<u8> {
    let header = [
        &width.to_be_bytes()[..],
        &height.to_be_bytes(),
        &[depth, color, 0, 0, 0],
    ]
    .concat();
    let adler = rows.iter().fold((1u32, 0u32), |(a, b), &byte| {
        let a = (a + u32::from(byte)) % 65521;
        (a, (b + a) % 65521)
    });
    let length = rows.len() as u16;
    let data = [
        &[0x78, 0x01, 1][..],
        &length.to_le_bytes(),
        &(!length).to_le_bytes(),
        rows,
        &(adler.1 << 16 | adler.0).to_be_bytes(),
    ]
    .concat();
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    file.extend(chunk(b"IHDR", &header));
    if !palette.is_empty() {
        file.extend(chunk(b"PLTE", palette));
    }
    file.extend(chunk(b"IDAT", &data));
    file.extend(chunk(b"IEND", &[]));
    file
}

/// Calls `load` for the file cut at every tenth of its length: every cut must be refused.
pub fn each_tenth<T>(path: &Path, load: impl Fn(&Path) -> Result<T, super::ImageError>) {
    let whole = std::fs::read(path).unwrap();
    assert!(load(path).is_ok(), "the whole {path:?}");
    for tenth in 0..10 {
        std::fs::write(path, &whole[..whole.len() * tenth / 10]).unwrap();
        let error = load(path)
            .err()
            .unwrap_or_else(|| panic!("{tenth}/10 of {path:?} was read"));
        assert!(
            error.to_string().contains(path.to_str().unwrap()),
            "{error}"
        );
    }
    std::fs::write(path, whole).unwrap();
}
