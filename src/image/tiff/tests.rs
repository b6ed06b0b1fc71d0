use std::io::{Cursor, Write};

use half::f16;

use super::*;
use crate::image::samples::{Sample as _, Samples, each_type};
use crate::image::test_files::noise;
use crate::image::test_tiff::{Tiff, TiffSample, bytes};

fn raster(file: &[u8]) -> Result<Raster, ImageError> {
    decode(Path::new("picture.tif"), Cursor::new(file))
}

/// All samples as heights, top row first.
fn heights(picture: &Tiff) -> Vec<f32> {
    let samples = raster(&picture.bytes()).unwrap().samples;
    each_type!(samples, s => s.into_iter().map(|sample| sample.height()).collect())
}

fn refused(picture: &Tiff) -> String {
    match raster(&picture.bytes()) {
        Ok(_) => panic!("it was read"),
        Err(error) => error.to_string(),
    }
}

fn deflated(data: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(data).unwrap();
    encoder.finish().unwrap()
}

fn lzw(data: &[u8]) -> Vec<u8> {
    weezl::encode::Encoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8)
        .encode(data)
        .unwrap()
}

/// Codes from the lowest bit, as before TIFF 5.0.
fn old_lzw(data: &[u8]) -> Vec<u8> {
    weezl::encode::Encoder::new(weezl::BitOrder::Lsb, 8)
        .encode(data)
        .unwrap()
}

fn packed_bits(data: &[u8]) -> Vec<u8> {
    data.chunks(128)
        .flat_map(|run| [&[run.len() as u8 - 1], run].concat())
        .collect()
}

fn zstd(data: &[u8]) -> Vec<u8> {
    ruzstd::encoding::compress_to_vec(data, ruzstd::encoding::CompressionLevel::Fastest)
}

type Compress = fn(&[u8]) -> Vec<u8>;

const CODECS: [(u64, Compress); 8] = [
    (1, <[u8]>::to_vec),
    (5, lzw),
    (5, old_lzw),
    (8, deflated),
    (32946, deflated),
    (32773, packed_bits),
    (50000, zstd),
    (34926, zstd),
];

/// Rows of `width` samples cut into tiles of `side`, what is beyond the picture filled with zeros.
fn tiles<T: Copy + Default>(samples: &[T], width: usize, side: usize) -> Vec<Vec<T>> {
    let height = samples.len() / width;
    let mut tiles = Vec::new();
    for top in (0..height).step_by(side) {
        for left in (0..width).step_by(side) {
            let place = (0..side * side).map(|i| (left + i % side, top + i / side));
            let sample = |(x, y)| match x < width && y < height {
                true => samples[y * width + x],
                false => T::default(),
            };
            tiles.push(place.map(sample).collect());
        }
    }
    tiles
}

#[test]
fn strips_and_tiles_in_every_compression_byte_order_and_size_of_offsets() {
    let (width, height) = (21, 19);
    let samples: Vec<i16> = noise(width * height).map(|n| n as i16).collect();
    let expected: Vec<f32> = samples.iter().map(|&x| f32::from(x)).collect();
    for (code, compress) in CODECS {
        for (big_endian, big) in [(false, false), (true, false), (false, true), (true, true)] {
            let picture = Tiff::grey(width as u64, height as u64, &samples);
            let picture = picture.stored(big_endian, big);
            let strips = samples.chunks(4 * width).map(|s| bytes(s, big_endian));
            let strips = picture.clone().strips(4, strips.collect());
            assert_eq!(heights(&strips.compressed(code, compress)), expected);
            let tiles = tiles(&samples, width, 16);
            let tiles = tiles.iter().map(|t| bytes(t, big_endian)).collect();
            let tiles = picture.tiles(16, 16, tiles);
            assert_eq!(heights(&tiles.compressed(code, compress)), expected);
        }
    }
}

#[test]
fn planes_are_brought_together() {
    let (width, height) = (5, 3);
    let plane = |channel: u8| (0..15).map(|i| 10 * channel + i).collect::<Vec<u8>>();
    let expected: Vec<f32> = (0..15)
        .flat_map(|i| [1, 2, 3].map(|channel| plane(channel)[i].height()))
        .collect();
    let rgb = Tiff::rgb::<u8>(width, height, &[]).with(284, 3, [2]);
    let strips = [1, 2, 3].map(|channel| plane(channel).chunks(10).map(<[u8]>::to_vec).collect());
    let strips = rgb
        .clone()
        .strips(2, strips.into_iter().flat_map(|s: Vec<_>| s).collect());
    assert_eq!(heights(&strips), expected);
    let tiles = [1, 2, 3]
        .map(|channel| tiles(&plane(channel), 5, 4))
        .concat();
    let tiles = rgb.tiles(4, 4, tiles);
    for (code, compress) in CODECS {
        assert_eq!(heights(&tiles.clone().compressed(code, compress)), expected);
    }
}

fn every_type<T: TiffSample + Copy>(samples: &[T], expected: &[f32]) {
    let width = samples.len() as u64;
    assert_eq!(heights(&Tiff::grey(width, 1, samples)), expected);
    let turned = Tiff::packed(width, 1, 8 * size_of::<T>() as u64, bytes(samples, true));
    let turned = turned.stored(true, false).with(339, 3, [T::FORMAT]);
    assert_eq!(heights(&turned), expected);
}

#[test]
fn samples_of_every_type_are_read() {
    every_type(&[0u8, 51, 255], &[0.0, 0.2, 1.0]);
    every_type(&[0u16, 13107, 65535], &[0.0, 0.2, 1.0]);
    every_type(&[0u32, 1 << 30, u32::MAX], &[0.0, 0.25, 1.0]);
    every_type(&[0u64, 1 << 62, u64::MAX], &[0.0, 0.25, 1.0]);
    every_type(&[i8::MIN, 0, 7], &[-128.0, 0.0, 7.0]);
    every_type(&[i16::MIN, 0, 8848], &[-32768.0, 0.0, 8848.0]);
    every_type(&[i32::MIN, -1, 8848], &[-2147483648.0, -1.0, 8848.0]);
    every_type(&[-1i64 << 40, 8848], &[-1.0995116e12, 8848.0]);
    every_type(&[f16::from_f32(-0.5), f16::MAX], &[-0.5, 65504.0]);
    every_type(&[-0.1f32, 8848.86], &[-0.1, 8848.86]);
    every_type(&[-0.1f64, 8848.86], &[-0.1, 8848.86]);
}

#[test]
fn small_samples_fill_the_range_and_rows_begin_at_bytes() {
    let bits = Tiff::packed(3, 2, 1, vec![0b1010_0000, 0b0100_0000]);
    assert_eq!(heights(&bits), [1.0, 0.0, 1.0, 0.0, 1.0, 0.0]);
    let white_is_zero = bits.clone().with(262, 3, [0]);
    assert_eq!(heights(&white_is_zero), [0.0, 1.0, 0.0, 1.0, 0.0, 1.0]);
    let reversed = Tiff::packed(3, 2, 1, vec![0b0000_0101, 0b0000_0010]).with(266, 3, [2]);
    assert_eq!(heights(&reversed), heights(&bits));
    let pairs = Tiff::packed(4, 1, 2, vec![0b00_01_10_11]);
    assert_eq!(heights(&pairs), [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0]);
    let twelve = Tiff::packed(3, 1, 12, vec![0x00, 0x0f, 0xff, 0x80, 0x00]);
    assert_eq!(heights(&twelve), [0.0, 1.0, 32776.0 / 65535.0]);
    let three_bytes = Tiff::packed(2, 1, 24, vec![0xff, 0xff, 0xff, 0, 0, 0]);
    assert_eq!(heights(&three_bytes), [1.0, 0.0]);
    let signed = Tiff::packed(2, 1, 4, vec![0x87]).with(339, 3, [2]);
    assert_eq!(heights(&signed), [-8.0, 7.0]);
    let floats = Tiff::packed(1, 1, 24, vec![0x00, 0x80, 0xc0]).with(339, 3, [3]);
    assert_eq!(heights(&floats), [-3.0]);
}

#[test]
fn predictors_are_undone_row_by_row() {
    // 3 1 2 and 1 1 1 as differences.
    let whole = Tiff::packed(3, 2, 16, vec![3, 0, 0xfe, 0xff, 1, 0, 1, 0, 0, 0, 0, 0]);
    let whole = whole.with(339, 3, [2]).with(317, 3, [2]);
    for (code, compress) in &CODECS[1..] {
        let picture = whole.clone().compressed(*code, compress);
        assert_eq!(heights(&picture), [3.0, 1.0, 2.0, 1.0, 1.0, 1.0]);
    }
    // The tag belongs to the compression.
    assert_eq!(heights(&whole)[..3], [3.0, -2.0, 1.0]);
    let floats = vec![0x3f, 0x01, 0x40, 0x80, 0, 0, 0, 0];
    let floats = Tiff::packed(2, 1, 32, floats).with(339, 3, [3]);
    let floats = floats.with(317, 3, [3]).compressed(8, deflated);
    assert_eq!(heights(&floats), [1.0, 2.0]);
    let bits = Tiff::packed(8, 1, 1, vec![0]).with(317, 3, [2]);
    let error = refused(&bits.compressed(8, deflated));
    assert!(error.contains("predictor 2 on 1-bit"), "{error}");
}

/// A JPEG picture, 16x8 pixels of one colour.
fn jpeg(color: image::ExtendedColorType, pixel: &[u8]) -> Vec<u8> {
    let mut file = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut file, 100)
        .encode(&pixel.repeat(16 * 8), 16, 8, color)
        .unwrap();
    file
}

/// Its quantisation and Huffman tables as a picture without pixels, and the picture without them.
fn without_tables(jpeg: &[u8]) -> (Vec<u8>, Vec<u8>) {
    let (mut tables, mut picture) = (jpeg[..2].to_vec(), jpeg[..2].to_vec());
    let mut rest = &jpeg[2..];
    while rest[1] != 0xda {
        let length = 2 + usize::from(u16::from_be_bytes([rest[2], rest[3]]));
        match rest[1] {
            0xdb | 0xc4 => tables.extend(&rest[..length]),
            _ => picture.extend(&rest[..length]),
        }
        rest = &rest[length..];
    }
    picture.extend(rest);
    tables.extend([0xff, 0xd9]);
    (tables, picture)
}

#[test]
fn jpeg_in_strips_and_tiles_with_tables_in_common() {
    let near = |picture: &Tiff, pixel: &[u8]| {
        let heights = heights(picture);
        assert_eq!(heights.len() % pixel.len(), 0);
        let expected = pixel.iter().map(|code| code.height()).cycle();
        let worst = heights.iter().zip(expected).map(|(a, b)| (a - b).abs());
        assert!(worst.fold(0.0, f32::max) < 3.0 / 255.0);
    };
    let (tables, strip) = without_tables(&jpeg(image::ExtendedColorType::L8, &[100]));
    let tables = tables.into_iter().map(u64::from);
    let strips = Tiff::packed(16, 13, 8, Vec::new()).with(259, 3, [7]);
    let strips = strips
        .strips(8, vec![strip.clone(); 2])
        .with(347, 7, tables);
    near(&strips, &[100]);
    let short = strip[..strip.len() - 2].to_vec();
    let error = refused(&strips.clone().strips(8, vec![strip, short]));
    assert!(
        error.contains("strip 1") && error.contains("end"),
        "{error}"
    );
    let error = refused(&strips.with(256, 4, [20_000]));
    assert!(error.contains("20000x8"), "{error}");
    // YCbCr in the file, and RGB for whoever reads it.
    let tile = jpeg(image::ExtendedColorType::Rgb8, &[200, 100, 50]);
    let colors = Tiff::rgb::<u8>(21, 7, &[])
        .with(262, 3, [6])
        .with(259, 3, [7]);
    near(&colors.tiles(16, 8, vec![tile; 2]), &[200, 100, 50]);
}

#[test]
fn a_palette_gives_colours() {
    let reds = [0, 0x1234, 0xffff, 0];
    let map = [reds, [7, 8, 9, 10], [0; 4]].concat();
    let picture = Tiff::packed(2, 1, 2, vec![0b0110_0000]).with(262, 3, [3]);
    let picture = picture.with(320, 3, map);
    let raster = raster(&picture.bytes()).unwrap();
    assert_eq!(raster.channels, ["R", "G", "B"]);
    let Samples::U16(samples) = raster.samples else {
        panic!("not the 16 bits of its colours")
    };
    assert_eq!(samples, [0x1234, 8, 0, 0xffff, 9, 0]);
    // 8 bits in the low byte, the high one, both.
    for factor in [1, 256, 257] {
        let map = [[0, 20, 255, 0], [1, 2, 3, 4], [0; 4]].concat();
        let map = map.into_iter().map(|entry: u64| entry * factor);
        let picture = picture.clone().with(320, 3, map);
        assert_eq!(
            heights(&picture),
            [20u8, 2, 0, 255, 3, 0].map(|code| code.height())
        );
    }
    let short = picture.with(320, 3, [1, 2, 3]);
    assert!(refused(&short).contains("palette of 3 numbers"));
}

#[test]
fn rows_lie_where_the_orientation_says() {
    let picture = Tiff::rgb(2, 1, &[1u8, 2, 3, 4, 5, 6]);
    let code = |code: u8| code.height();
    let turned = raster(&picture.clone().with(274, 3, [6]).bytes()).unwrap();
    assert_eq!((turned.width, turned.height), (1, 2));
    assert_eq!(
        heights(&picture.with(274, 3, [2])),
        [4, 5, 6, 1, 2, 3].map(code)
    );
}

#[test]
fn what_is_left_out_has_the_meaning_that_everyone_gives_it() {
    let picture = Tiff::grey(2, 2, &[1u8, 2, 3, 4]);
    let expected = [1u8, 2, 3, 4].map(|code| code.height());
    // RowsPerStrip for all rows, sizes that are 0, one size for all channels.
    let all_rows = picture.clone().with(278, 4, [u32::MAX.into()]);
    assert_eq!(heights(&all_rows), expected);
    assert_eq!(heights(&picture.clone().with(279, 4, [0])), expected);
    let compressed = picture.compressed(8, deflated).with(279, 4, [0]);
    assert_eq!(heights(&compressed), expected);
    let once = Tiff::rgb(1, 1, &[1u8, 2, 3]).with(258, 3, [8]);
    assert_eq!(heights(&once), expected[..3]);
}

#[test]
fn an_overview_that_comes_first_is_not_the_picture() {
    let first = Tiff::grey(1, 1, &[9u8]).with(254, 4, [1]).bytes();
    let second = Tiff::grey(2, 1, &[1u8, 2]);
    let plain = second.bytes();
    // The second file behind the first, all its offsets moved.
    let by = first.len() as u64;
    let second = second.with(273, 4, [8 + by]).bytes();
    let mut both = [first.clone(), second[..].to_vec()].concat();
    let directory = |file: &[u8]| u32::from_le_bytes(file[4..8].try_into().unwrap()) as usize;
    let next = first.len() - 4;
    assert!(directory(&first) < next);
    let place = (directory(&second) as u64 + by) as u32;
    both[next..next + 4].copy_from_slice(&place.to_le_bytes());
    let read = raster(&both).unwrap();
    assert_eq!((read.width, read.height), (2, 1));
    // Alone, it is what there is; and a chain that bites its tail ends.
    assert_eq!(raster(&first).unwrap().width, 1);
    let mut loop_of_one = first.clone();
    let own = directory(&first) as u32;
    loop_of_one[next..].copy_from_slice(&own.to_le_bytes());
    assert_eq!(raster(&loop_of_one).unwrap().width, 1);
    assert_eq!(raster(&plain).unwrap().width, 2);
}

#[test]
fn what_is_not_read_is_refused_by_name() {
    let grey = Tiff::grey(1, 1, &[1u8]);
    for (picture, words) in [
        (grey.clone().with(259, 3, [34887]), "LERC"),
        (grey.clone().with(259, 3, [4]), "CCITT"),
        (grey.clone().with(259, 3, [50001]), "WebP"),
        (grey.clone().with(259, 3, [12345]), "compression 12345"),
        (grey.clone().with(262, 3, [5]), "CMYK"),
        (grey.clone().with(262, 3, [6]), "YCbCr"),
        (grey.clone().with(339, 3, [5]), "complex"),
        (grey.clone().with(258, 3, [40]), "40-bit"),
        (
            grey.clone().with(259, 3, [7]).with(258, 3, [1]),
            "1-bit samples in JPEG",
        ),
        (grey.clone().with(339, 3, [3]), "8-bit floats"),
        (
            Tiff::rgb(1, 1, &[1u8, 2, 3]).with(258, 3, [5, 6, 5]),
            "5, 6, 5",
        ),
    ] {
        let error = refused(&picture);
        assert!(
            error.contains("picture.tif") && error.contains(words),
            "{error}"
        );
    }
}

#[test]
fn too_few_bytes_are_an_error_that_says_where() {
    let zeros = vec![0; 1000];
    for (code, compress) in CODECS {
        let picture = Tiff::packed(100, 11, 8, Vec::new());
        let short = picture.strips(10, vec![zeros.clone(), zeros[..99].to_vec()]);
        let error = refused(&short.compressed(code, compress));
        assert!(error.contains("strip 1 ends after 99 of 100"), "{error}");
    }
    let mut damaged = deflated(&zeros);
    *damaged.last_mut().unwrap() ^= 1;
    let error = refused(&Tiff::packed(100, 10, 8, damaged).with(259, 3, [8]));
    assert!(error.contains("strip 0"), "{error}");
}

#[test]
fn claims_beyond_the_file_are_refused_at_once() {
    let grey = Tiff::grey(1, 1, &[1u8]);
    let large = grey.clone().with(256, 4, [23_000]).with(257, 4, [23_000]);
    let huge_count = large.clone().with(279, 4, [u32::MAX.into()]);
    for (code, _) in CODECS {
        refused(&large.clone().with(259, 3, [code]));
        refused(&huge_count.clone().with(259, 3, [code]));
    }
    refused(&large.clone().with(322, 4, [23_000]).with(323, 4, [23_000]));
    refused(&large.with(322, 4, [1]).with(323, 4, [1]).with(324, 4, [8]));
    refused(&grey.clone().with(277, 3, [65_535]).with(256, 4, [65_535]));
    refused(&grey.clone().with(273, 4, [u32::MAX.into()]));
    let long_offsets = grey.stored(false, true);
    refused(&long_offsets.clone().with(273, 16, [u64::MAX]));
    refused(
        &long_offsets
            .with(279, 16, [u64::MAX])
            .with(273, 16, [u64::MAX - 1]),
    );
    // A directory, or values, with a count that no file has.
    let mut file = Tiff::grey(1, 1, &[1u8]).bytes();
    let directory = u32::from_le_bytes(file[4..8].try_into().unwrap()) as usize;
    for entry in 0..9 {
        let count = directory + 2 + 12 * entry + 4;
        let kept = file[count..count + 4].to_vec();
        file[count..count + 4].copy_from_slice(&[0xff; 4]);
        let _: Result<_, ImageError> = raster(&file);
        file[count..count + 4].copy_from_slice(&kept);
    }
    file[directory..directory + 2].copy_from_slice(&[0xff; 2]);
    assert!(raster(&file).is_err());
}
