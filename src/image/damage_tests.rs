//! Damaged pictures of every format are read or refused: no decoder panics through, none takes memory without end.

use std::path::Path;

use exr::prelude::{Compression, FlatSamples};
use image::{ExtendedColorType, GrayImage, ImageFormat, RgbImage};
use tiff::encoder::colortype;

use super::test_files::{Folder, png};
use super::{Channel, ColorSpace, Source, load_color, load_heights};
use crate::surface::Wrap;

/// Changes per file.
const CHANGES: u32 = 1500;

/// A sequence of numbers without a pattern (splitmix64).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ z >> 31) as usize
    }
}

/// Reads the whole file, which must be sound, and damaged copies of it.
fn damage(name: &str, whole: &[u8]) {
    let name = Path::new(name);
    let read = |bytes: &[u8]| {
        let picture = Source::Memory { name, bytes };
        let heights = load_heights(picture, &Channel::R, Wrap::Repeat).map(|_| ());
        let color = load_color(picture, ColorSpace::Srgb).map(|_| ());
        heights.and(color)
    };
    read(whole).unwrap();
    let mut noise = Noise(whole.len() as u64);
    for _ in 0..CHANGES {
        let mut bytes = whole.to_vec();
        for _ in 0..1 + noise.next() % 3 {
            let at = match noise.next() % 3 {
                // Headers are dense with meaning, what follows is not.
                0 => noise.next() % bytes.len().min(64),
                _ => noise.next() % bytes.len(),
            };
            match noise.next() % 5 {
                0 => bytes[at] ^= 1 << (noise.next() % 8),
                1 => bytes[at] = [0, 0x7f, 0x80, 0xff][noise.next() % 4],
                2 => bytes[at..].iter_mut().take(4).for_each(|byte| *byte = 0xff),
                3 => bytes.truncate(at.max(1)),
                _ => {
                    let from = noise.next() % bytes.len();
                    let count = (noise.next() % 16).min(bytes.len() - at.max(from));
                    bytes.copy_within(from..from + count, at);
                }
            }
        }
        if let Err(error) = read(&bytes) {
            let message = error.to_string();
            assert!(message.contains(name.to_str().unwrap()), "{message}");
        }
    }
}

fn encoded(format: ImageFormat, color: ExtendedColorType) -> Vec<u8> {
    let mut noise = Noise(7);
    let gray = GrayImage::from_fn(19, 11, |x, y| {
        image::Luma([(noise.next() % 9) as u8 + (x * y) as u8])
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    match color {
        ExtendedColorType::L8 => gray.write_to(&mut bytes, format).unwrap(),
        _ => {
            let rgb = RgbImage::from_fn(19, 11, |x, y| {
                let value = gray.get_pixel(x, y).0[0];
                image::Rgb([value, value / 2, 255 - value])
            });
            rgb.write_to(&mut bytes, format).unwrap();
        }
    }
    bytes.into_inner()
}

#[test]
fn damaged_pictures_of_whole_numbers_are_read_or_refused() {
    for (name, format) in [
        ("a.png", ImageFormat::Png),
        ("a.jpg", ImageFormat::Jpeg),
        ("a.bmp", ImageFormat::Bmp),
        ("a.tga", ImageFormat::Tga),
        ("a.webp", ImageFormat::WebP),
        ("a.ppm", ImageFormat::Pnm),
    ] {
        for color in [ExtendedColorType::L8, ExtendedColorType::Rgb8] {
            damage(name, &encoded(format, color));
        }
    }
    damage(
        "a.png",
        &png(3, 2, 2, 3, &[1, 2, 3, 4, 5, 6], &[0, 0x10, 0, 0x44]),
    );
}

#[test]
fn damaged_pictures_of_floats_are_read_or_refused() {
    let mut noise = Noise(3);
    let pixels: Vec<u8> = (0..12 * 4).map(|_| noise.next() as u8 % 130).collect();
    let run = [
        2, 2, 0, 8, 136, 5, 8, 1, 2, 3, 4, 5, 6, 7, 8, 136, 0, 136, 130,
    ];
    let hdr = [&b"#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 8\n"[..], &run].concat();
    damage("a.hdr", &hdr);
    damage("a.pfm", &[&b"Pf\n4 3\n-1\n"[..], &pixels].concat());
    let folder = Folder::new();
    let tiff = folder.tiff::<colortype::Gray32Float>(4, 3, &[0.5; 12]);
    damage("a.tif", &std::fs::read(tiff).unwrap());
}

#[test]
fn damaged_exr_files_of_every_compression_are_read_or_refused() {
    let folder = Folder::new();
    let mut noise = Noise(5);
    let floats: Vec<f32> = (0..24 * 40).map(|_| (noise.next() % 64) as f32).collect();
    let halves = floats
        .iter()
        .map(|&x| exr::prelude::f16::from_f32(x))
        .collect();
    for (name, compression) in [
        ("none.exr", Compression::Uncompressed),
        ("rle.exr", Compression::RLE),
        ("zips.exr", Compression::ZIP1),
        ("zip.exr", Compression::ZIP16),
        ("piz.exr", Compression::PIZ),
        ("pxr24.exr", Compression::PXR24),
        ("b44.exr", Compression::B44),
        ("b44a.exr", Compression::B44A),
        ("dwaa.exr", Compression::DWAA(None)),
        ("dwab.exr", Compression::DWAB(None)),
    ] {
        let halves: Vec<exr::prelude::f16> = Vec::clone(&halves);
        let channels = vec![
            ("R", FlatSamples::F16(halves.clone())),
            ("G", FlatSamples::F16(halves)),
            ("B", FlatSamples::F32(floats.clone())),
            ("A", FlatSamples::F32(floats.clone())),
        ];
        let path = folder.exr((24, 40), compression, vec![(None, channels)]);
        damage(name, &std::fs::read(path).unwrap());
    }
}
