use exr::prelude::{Compression, FlatSamples, f16};
use image::{
    ExtendedColorType, GrayImage, ImageBuffer, ImageEncoder, ImageFormat, Luma, Rgb, Rgba,
};

use super::*;
use crate::image::test_files::{Folder, each_tenth, noise, png};
use crate::image::test_tiff::Tiff;
use crate::image::{ExrChannel, write_exr, write_png_gray16};

fn texels(path: &Path, channel: &str) -> Result<(usize, usize, Texels), ImageError> {
    let Ok(channel) = channel.parse();
    read_texels(path.into(), &channel, None)
}

fn load(path: &Path) -> Result<DisplacementMap, ImageError> {
    load_heights(path, &Channel::Luminance, Wrap::Repeat, None)
}

#[test]
fn a_16_bit_png_keeps_all_its_values() {
    let folder = Folder::new();
    let path = folder.path("all.png");
    let all: Vec<u16> = (0..=u16::MAX).collect();
    write_png_gray16(&path, 256, 256, &all).unwrap();
    assert_eq!(
        texels(&path, "luminance").unwrap(),
        (256, 256, Texels::U16(all))
    );
}

#[test]
fn the_first_texel_is_the_picture_s_bottom_left() {
    let folder = Folder::new();
    let picture = GrayImage::from_raw(2, 3, vec![1, 2, 3, 4, 5, 6]).unwrap();
    let path = folder.picture(ImageFormat::Png, picture);
    let expected = Texels::U8(vec![5, 6, 3, 4, 1, 2]);
    assert_eq!(texels(&path, "luminance").unwrap(), (2, 3, expected));
    let samples = FlatSamples::F32(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    let path = folder.exr(
        (2, 3),
        Compression::ZIP16,
        vec![(None, vec![("Y", samples)])],
    );
    let expected = Texels::F32(vec![5.0, 6.0, 3.0, 4.0, 1.0, 2.0]);
    assert_eq!(texels(&path, "luminance").unwrap(), (2, 3, expected));
}

#[test]
fn a_channel_can_be_chosen() {
    let folder = Folder::new();
    let picture = ImageBuffer::<Rgba<u16>, _>::from_raw(1, 1, vec![1, 2, 3, 40_000]).unwrap();
    let path = folder.picture(ImageFormat::Png, picture);
    for (channel, value) in [("r", 1), ("g", 2), ("b", 3), ("a", 40_000), ("R", 1)] {
        assert_eq!(texels(&path, channel).unwrap().2, Texels::U16(vec![value]));
    }
}

#[test]
fn colours_that_agree_are_read_and_others_are_refused_with_advice() {
    let folder = Folder::new();
    let mut picture = ImageBuffer::<Rgb<u8>, _>::from_pixel(3, 2, Rgb([7, 7, 7]));
    let path = folder.picture(ImageFormat::Png, picture.clone());
    assert_eq!(
        texels(&path, "luminance").unwrap().2,
        Texels::U8(vec![7; 6])
    );
    picture.put_pixel(2, 0, Rgb([7, 8, 7]));
    let path = folder.picture(ImageFormat::Png, picture);
    let error = texels(&path, "luminance").unwrap_err().to_string();
    assert!(
        error.contains("R, G, B") && error.contains("(2, 1)"),
        "{error}"
    );
    assert!(error.contains("choose"), "{error}");
}

#[test]
fn grey_with_alpha_reads_its_grey() {
    let folder = Folder::new();
    let picture = ImageBuffer::<image::LumaA<u8>, _>::from_raw(2, 1, vec![9, 255, 8, 0]).unwrap();
    let path = folder.picture(ImageFormat::Png, picture);
    assert_eq!(
        texels(&path, "luminance").unwrap().2,
        Texels::U8(vec![9, 8])
    );
    assert_eq!(texels(&path, "a").unwrap().2, Texels::U8(vec![255, 0]));
}

#[test]
fn palettes_and_greys_below_a_byte_are_widened() {
    let folder = Folder::new();
    let path = folder.path("small.png");
    std::fs::write(&path, png(3, 1, 2, 0, &[], &[0, 0b00_01_11_00])).unwrap();
    assert_eq!(
        texels(&path, "luminance").unwrap(),
        (3, 1, Texels::U8(vec![0, 85, 255]))
    );
    let palette = [10, 10, 10, 200, 200, 200];
    std::fs::write(&path, png(3, 1, 1, 3, &palette, &[0, 0b010_00000])).unwrap();
    assert_eq!(
        texels(&path, "luminance").unwrap(),
        (3, 1, Texels::U8(vec![10, 200, 10]))
    );
}

#[test]
fn a_jpeg_is_read_as_8_bit() {
    let folder = Folder::new();
    let path = folder.picture(ImageFormat::Jpeg, GrayImage::from_pixel(16, 8, Luma([100])));
    let (width, height, Texels::U8(heights)) = texels(&path, "luminance").unwrap() else {
        panic!("not 8-bit")
    };
    assert_eq!((width, height), (16, 8));
    assert!(heights.iter().all(|&h| h.abs_diff(100) <= 1), "{heights:?}");
}

#[test]
fn tiff_heights_are_fractions_of_unsigned_samples_and_all_others_as_they_stand() {
    let folder = Folder::new();
    let heights = |picture: &Tiff| texels(&folder.tiff(picture), "luminance").unwrap().2;
    assert_eq!(
        heights(&Tiff::grey(2, 2, &[1u8, 2, 3, 4])),
        Texels::U8(vec![3, 4, 1, 2])
    );
    assert_eq!(
        heights(&Tiff::grey(1, 2, &[1, u16::MAX])),
        Texels::U16(vec![u16::MAX, 1])
    );
    assert_eq!(
        heights(&Tiff::grey(3, 1, &[0, 1 << 31, u32::MAX])),
        Texels::F32(vec![0.0, 0.5, 1.0])
    );
    assert_eq!(
        heights(&Tiff::grey(2, 1, &[-5i16, 1500])),
        Texels::F32(vec![-5.0, 1500.0])
    );
    assert_eq!(
        heights(&Tiff::grey(1, 2, &[-0.1f32, 1e-7])),
        Texels::F32(vec![1e-7, -0.1])
    );
}

#[test]
fn bands_of_tiff_are_chosen_by_name_or_number() {
    let folder = Folder::new();
    let path = folder.tiff(&Tiff::rgb(1, 1, &[5u16, 600, 70]));
    for channel in ["g", "2"] {
        assert_eq!(texels(&path, channel).unwrap().2, Texels::U16(vec![600]));
    }
    assert!(matches!(
        texels(&path, "luminance"),
        Err(ImageError::ChannelsDisagree { .. })
    ));
    let bands: Vec<f32> = (1..=6).map(|band| band as f32).collect();
    let path = folder.tiff(&Tiff::grey(1, 1, &bands).with(277, 3, [6]));
    for (channel, band) in [("r", 1.0), ("1", 1.0), ("3", 3.0), ("6", 6.0)] {
        assert_eq!(texels(&path, channel).unwrap().2, Texels::F32(vec![band]));
    }
    let missing = texels(&path, "7").unwrap_err().to_string();
    assert!(missing.contains("R, G, B, 4, 5, 6"), "{missing}");
}

#[test]
fn a_texel_without_data_is_named_or_gets_a_height() {
    let folder = Folder::new();
    let no_data = |picture: Tiff, nodata| {
        let path = folder.tiff(&picture);
        read_texels((&path).into(), &Channel::Luminance, nodata).map(|(_, _, texels)| texels)
    };
    let metres = Tiff::grey(2, 2, &[7i16, -9999, 8, 9]).with_text(42113, "-9999");
    let error = no_data(metres.clone(), None).unwrap_err();
    assert!(matches!(error, ImageError::NoData { x: 1, y: 1, .. }));
    let error = error.to_string();
    for word in ["texel (1, 1)", "picture.tif", "-9999", "nodata"] {
        assert!(error.contains(word), "{error}");
    }
    assert_eq!(
        no_data(metres, Some(-1.5)).unwrap(),
        Texels::F32(vec![8.0, 9.0, 7.0, -1.5])
    );
    let lowest = Tiff::grey(2, 1, &[f32::MIN, 0.5]).with_text(42113, "-3.4028234663852886e+38");
    assert!(matches!(
        no_data(lowest.clone(), None),
        Err(ImageError::NoData { x: 0, y: 0, .. })
    ));
    assert_eq!(
        no_data(lowest, Some(0.0)).unwrap(),
        Texels::F32(vec![0.0, 0.5])
    );
    // Fractions get fractions.
    let codes = Tiff::grey(3, 1, &[0u8, 255, 51]).with_text(42113, "255");
    assert_eq!(
        no_data(codes, Some(0.25)).unwrap(),
        Texels::F32(vec![0.0, 0.25, 0.2])
    );
    // White is 0 in the file, and no data is what the file says, too.
    let white_is_zero = Tiff::grey(2, 1, &[0u8, 55]).with(262, 3, [0]);
    assert!(matches!(
        no_data(white_is_zero.with_text(42113, "55"), None),
        Err(ImageError::NoData { x: 1, y: 0, .. })
    ));
    let nibbles = Tiff::packed(2, 1, 4, vec![0x3f]).with_text(42113, "3");
    assert!(matches!(
        no_data(nibbles, None),
        Err(ImageError::NoData { x: 0, y: 0, .. })
    ));
}

#[test]
fn what_no_texel_has_is_no_matter() {
    let folder = Folder::new();
    for declared in ["-9999", "256", "0.5", "nan", ""] {
        let picture = Tiff::grey(2, 1, &[0u8, 255]).with_text(42113, declared);
        for nodata in [None, Some(7.0)] {
            let read = read_texels((&folder.tiff(&picture)).into(), &Channel::Luminance, nodata);
            assert_eq!(read.unwrap().2, Texels::U8(vec![0, 255]), "{declared}");
        }
    }
    let picture = Tiff::grey(2, 1, &[0u8, 255]).with_text(42113, "none");
    let error = load(&folder.tiff(&picture)).unwrap_err();
    assert!(matches!(error, ImageError::BadNoData { .. }), "{error}");
}

#[test]
fn what_is_no_height_is_told_from_heights_without_a_declaration() {
    let folder = Folder::new();
    for odd in [f32::NAN, f32::NEG_INFINITY, f32::MIN, 1e20] {
        let path = folder.tiff(&Tiff::grey(1, 2, &[odd, 3.0]));
        let error = load(&path).unwrap_err();
        assert!(
            matches!(error, ImageError::NoHeight { x: 0, y: 1, .. }),
            "{error}"
        );
        let filled = read_texels((&path).into(), &Channel::Luminance, Some(-2.0));
        assert_eq!(filled.unwrap().2, Texels::F32(vec![3.0, -2.0]));
    }
}

const LOSSLESS: [Compression; 5] = [
    Compression::Uncompressed,
    Compression::RLE,
    Compression::ZIP1,
    Compression::ZIP16,
    Compression::PIZ,
];

const LOSSY: [Compression; 3] = [Compression::PXR24, Compression::B44, Compression::B44A];

#[test]
fn exr_halves_and_floats_are_exact_in_every_lossless_compression() {
    let folder = Folder::new();
    let halves: Vec<f16> = (0..=u16::MAX)
        .map(f16::from_bits)
        .map(|h| if h.is_finite() { h } else { f16::ZERO })
        .collect();
    let floats: Vec<f32> = noise(65_536)
        .map(|bits| f32::from_bits(bits & 0xbfff_ffff))
        .collect();
    let bottom_first = |row_major: &[f32]| -> Vec<f32> {
        row_major.chunks(512).rev().flatten().copied().collect()
    };
    let widened: Vec<f32> = halves.iter().map(|h| h.to_f32()).collect();
    for compression in LOSSLESS {
        let path = folder.exr(
            (512, 128),
            compression,
            vec![(
                None,
                vec![
                    ("half", FlatSamples::F16(halves.clone())),
                    ("full", FlatSamples::F32(floats.clone())),
                ],
            )],
        );
        let half = texels(&path, "half").unwrap().2;
        assert_eq!(half, Texels::F32(bottom_first(&widened)), "{compression}");
        let full = texels(&path, "full").unwrap().2;
        assert_eq!(full, Texels::F32(bottom_first(&floats)), "{compression}");
    }
}

#[test]
fn exr_channels_of_layers_are_found_by_their_full_name() {
    let folder = Folder::new();
    let plane = |value| FlatSamples::F32(vec![value; 4]);
    let path = folder.exr(
        (2, 2),
        Compression::ZIP16,
        vec![
            (
                Some("base"),
                vec![("Z", plane(1.0)), ("height", plane(2.0))],
            ),
            (Some("detail"), vec![("Z", plane(3.0))]),
        ],
    );
    let first = |channel| match texels(&path, channel) {
        Ok((_, _, Texels::F32(t))) => Ok(t[0]),
        Ok(_) => panic!("EXR is float"),
        Err(error) => Err(error.to_string()),
    };
    assert_eq!(first("detail.Z"), Ok(3.0));
    assert_eq!(first("height"), Ok(2.0));
    assert!(first("Z").unwrap_err().contains("base.Z, detail.Z"));
    assert!(
        first("luminance")
            .unwrap_err()
            .contains("base.Z, base.height, detail.Z")
    );
}

#[test]
fn exr_integers_are_heights_as_they_stand() {
    let folder = Folder::new();
    let plane = FlatSamples::U32(vec![0, 1, 70_000, u32::MAX]);
    let path = folder.exr((2, 2), Compression::ZIP16, vec![(None, vec![("Y", plane)])]);
    let expected = Texels::F32(vec![70_000.0, 4_294_967_296.0, 0.0, 1.0]);
    assert_eq!(texels(&path, "luminance").unwrap(), (2, 2, expected));
}

#[test]
fn a_height_that_is_not_finite_is_refused_with_its_place() {
    let folder = Folder::new();
    let path = folder.path("bad.exr");
    let samples = vec![0.0, 0.0, 0.0, f32::NAN, 0.0, 0.0];
    let channel = ExrChannel::floats("Y", samples);
    write_exr(&path, 2, 3, vec![channel], &[]).unwrap();
    let error = load(&path).unwrap_err();
    assert!(matches!(error, ImageError::NoHeight { .. }));
    let error = error.to_string();
    assert!(
        error.contains("(1, 1)") && error.contains("bad.exr"),
        "{error}"
    );
}

#[test]
fn truncated_files_are_refused() {
    let folder = Folder::new();
    let size = 48;
    let pixels = (size * size) as usize;
    let gray: Vec<u8> = noise(pixels).map(|n| n as u8).collect();
    let floats: Vec<f32> = noise(pixels).map(|n| n as f32).collect();
    let picture = GrayImage::from_raw(size, size, gray.clone()).unwrap();
    each_tenth(&folder.picture(ImageFormat::Png, picture.clone()), load);
    each_tenth(&folder.picture(ImageFormat::Jpeg, picture), load);
    each_tenth(&folder.tiff(&Tiff::grey(48, 48, &gray)), load);
    each_tenth(&folder.tiff(&Tiff::grey(48, 48, &floats)), load);
    for compression in LOSSLESS.into_iter().chain(LOSSY) {
        let channels = vec![("Y", FlatSamples::F32(floats.clone()))];
        each_tenth(
            &folder.exr((48, 48), compression, vec![(None, channels)]),
            load,
        );
    }
}

#[test]
fn a_header_that_claims_too_much_is_refused_at_once() {
    let folder = Folder::new();
    let path = folder.path("huge");
    let refused = |path: &Path| {
        let result = load(path);
        assert!(
            matches!(result, Err(ImageError::TooManyPixels { .. })),
            "{result:?}"
        );
    };
    std::fs::write(&path, png(100_000, 100_000, 16, 0, &[], &[0])).unwrap();
    refused(&path);

    let side = [100_000];
    let tiff = Tiff::grey(2, 2, &[1u8, 2, 3, 4]);
    let tiff = tiff.with(256, 4, side).with(257, 4, side);
    refused(&folder.tiff(&tiff));

    let channels = vec![("Y", FlatSamples::F32(vec![0.0; 4]))];
    let exr = folder.exr((2, 2), Compression::ZIP16, vec![(None, channels)]);
    let mut bytes = std::fs::read(&exr).unwrap();
    for window in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
        let at = bytes
            .windows(window.len())
            .position(|w| w == window)
            .unwrap()
            + window.len()
            + 4;
        bytes[at + 8..at + 12].copy_from_slice(&99_999i32.to_le_bytes());
        bytes[at + 12..at + 16].copy_from_slice(&99_999i32.to_le_bytes());
    }
    // The header is believed only when its number of blocks of 16 lines fits.
    let count = b"chunkCount\0int\0";
    let at = bytes.windows(count.len()).position(|w| w == count).unwrap() + count.len() + 4;
    bytes[at..at + 4].copy_from_slice(&6_250i32.to_le_bytes());
    std::fs::write(&path, bytes).unwrap();
    refused(&path);
}

#[test]
fn files_that_are_no_pictures_are_named() {
    let folder = Folder::new();
    let path = folder.path("nothing.png");
    assert!(matches!(load(&path), Err(ImageError::Read { .. })));
    std::fs::write(&path, b"").unwrap();
    assert!(matches!(load(&path), Err(ImageError::EmptyFile { .. })));
    std::fs::write(&path, b"Not a picture at all.").unwrap();
    assert!(matches!(load(&path), Err(ImageError::UnknownFormat { .. })));
    std::fs::write(&path, png(0, 0, 8, 0, &[], &[])).unwrap();
    assert!(load(&path).unwrap_err().to_string().contains("nothing.png"));
    assert!(load(path.parent().unwrap()).is_err());
}

#[test]
fn the_name_of_the_file_does_not_decide_its_format() {
    let folder = Folder::new();
    let path = folder.path("really_a_png.jpg");
    let mut bytes = Vec::new();
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(&[3, 4], 2, 1, ExtendedColorType::L8)
        .unwrap();
    std::fs::write(&path, bytes).unwrap();
    assert_eq!(
        texels(&path, "luminance").unwrap().2,
        Texels::U8(vec![3, 4])
    );
}
