use exr::prelude::{Compression, FlatSamples};
use image::{GrayImage, ImageBuffer, ImageFormat, Rgb};

use super::*;
use crate::image::test_files::{Folder, each_tenth};

const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror];

/// Rows bottom first: 1 2 / 3 4 in red.
fn two_by_two() -> ColorImage {
    let pixels = [1.0, 2.0, 3.0, 4.0].map(|red| [red, 0.0, 0.0]).to_vec();
    ColorImage {
        width: 2,
        height: 2,
        pixels: ColorPixels::Linear(pixels),
    }
}

fn red(image: &ColorImage, s: f32, t: f32, wrap: Wrap) -> f32 {
    image.sample(Vec2::new(s, t), [wrap; 2]).x
}

#[test]
fn samples_at_pixel_centres_are_the_pixels() {
    for wrap in WRAPS {
        let image = two_by_two();
        assert_eq!(red(&image, 0.25, 0.25, wrap), 1.0);
        assert_eq!(red(&image, 0.75, 0.25, wrap), 2.0);
        assert_eq!(red(&image, 0.25, 0.75, wrap), 3.0);
        assert_eq!(red(&image, 0.75, 0.75, wrap), 4.0);
        assert_eq!(red(&image, 0.5, 0.5, wrap), 2.5);
    }
}

#[test]
fn outside_the_wrap_mode_decides() {
    let image = two_by_two();
    let row = |s, wrap| red(&image, s, 0.25, wrap);
    assert_eq!(row(0.0, Wrap::Repeat), 1.5);
    assert_eq!(row(0.0, Wrap::Clamp), 1.0);
    assert_eq!(row(0.0, Wrap::Mirror), 1.0);
    assert_eq!(row(1.25, Wrap::Repeat), 1.0);
    assert_eq!(row(1.25, Wrap::Clamp), 2.0);
    assert_eq!(row(1.25, Wrap::Mirror), 2.0);
    assert_eq!(row(-0.75, Wrap::Repeat), 1.0);
    assert_eq!(row(-0.75, Wrap::Clamp), 1.0);
    assert_eq!(row(-0.75, Wrap::Mirror), 2.0);
}

#[test]
fn each_axis_goes_on_by_its_own_mode() {
    let image = two_by_two();
    let at = |wrap| image.sample(Vec2::new(1.25, 1.25), wrap).x;
    assert_eq!(at([Wrap::Repeat, Wrap::Clamp]), 3.0);
    assert_eq!(at([Wrap::Clamp, Wrap::Repeat]), 2.0);
    assert_eq!(at([Wrap::Repeat, Wrap::Mirror]), 3.0);
}

#[test]
fn any_coordinate_can_be_sampled() {
    for wrap in WRAPS {
        for odd in [
            f32::NAN,
            f32::INFINITY,
            -f32::INFINITY,
            f32::MAX,
            f32::MIN,
            -1e-30,
        ] {
            let value = red(&two_by_two(), odd, odd, wrap);
            assert!((1.0..=4.0).contains(&value), "{odd} {wrap:?}: {value}");
        }
    }
}

#[test]
fn eight_bit_srgb_stays_encoded_and_is_mixed_in_linear_light() {
    let folder = Folder::new();
    let picture = ImageBuffer::<Rgb<u8>, _>::from_raw(2, 1, vec![0, 0, 0, 255, 188, 0]).unwrap();
    let path = folder.picture(ImageFormat::Png, picture);
    let image = load_color(&path, ColorSpace::Srgb).unwrap();
    assert!(matches!(image.pixels, ColorPixels::Srgb8(_)));
    let middle = image.sample(Vec2::new(0.5, 0.5), [Wrap::Clamp; 2]);
    assert!((middle.x - 0.5).abs() < 1e-6);
    assert!((middle.y - 0.5 * srgb_decode(188.0 / 255.0)).abs() < 1e-6);
    let image = load_color(&path, ColorSpace::Linear).unwrap();
    assert_eq!(image.pixel(1, 0), Vec3::new(1.0, 188.0 / 255.0, 0.0));
}

#[test]
fn sixteen_bit_srgb_is_decoded_without_going_through_8_bits() {
    let folder = Folder::new();
    let picture = ImageBuffer::<Rgb<u16>, _>::from_raw(1, 1, vec![32_768, 32_769, 65_535]).unwrap();
    let path = folder.picture(ImageFormat::Png, picture);
    let pixel = load_color(&path, ColorSpace::Srgb).unwrap().pixel(0, 0);
    assert!((pixel.x - srgb_decode(32_768.0 / 65_535.0)).abs() < 1e-7);
    assert!(pixel.y > pixel.x);
    assert_eq!(pixel.z, 1.0);
}

#[test]
fn a_grey_picture_is_grey_and_its_bottom_row_is_the_first() {
    let folder = Folder::new();
    let picture = GrayImage::from_raw(1, 2, vec![10, 20]).unwrap();
    let path = folder.picture(ImageFormat::Png, picture);
    let ColorPixels::Srgb8(pixels) = load_color(&path, ColorSpace::Srgb).unwrap().pixels else {
        panic!("8-bit sRGB becomes something else")
    };
    assert_eq!(pixels, [[20; 3], [10; 3]]);
}

#[test]
fn exr_colours_are_linear_and_finite() {
    let folder = Folder::new();
    let exr = |blue| {
        let plane = |value| FlatSamples::F32(vec![value]);
        let channels = vec![("R", plane(0.5)), ("G", plane(4.0)), ("B", plane(blue))];
        folder.exr((1, 1), Compression::ZIP16, vec![(None, channels)])
    };
    let image = load_color(&exr(0.25), ColorSpace::Srgb).unwrap();
    assert_eq!(image.pixel(0, 0), Vec3::new(0.5, 4.0, 0.25));
    let error = load_color(&exr(f32::INFINITY), ColorSpace::Linear).unwrap_err();
    assert!(matches!(error, ImageError::BadPixel { x: 0, y: 0, .. }));
}

#[test]
fn webp_bmp_and_tga_are_read() {
    let folder = Folder::new();
    let picture = ImageBuffer::<Rgb<u8>, _>::from_raw(2, 1, vec![1, 2, 3, 40, 50, 60]).unwrap();
    for format in [ImageFormat::WebP, ImageFormat::Bmp, ImageFormat::Tga] {
        let written = folder.picture(format, picture.clone());
        let path = folder.path("picture.tga");
        std::fs::rename(written, &path).unwrap();
        let ColorPixels::Srgb8(pixels) = load_color(&path, ColorSpace::Srgb).unwrap().pixels else {
            panic!("8-bit sRGB becomes something else")
        };
        assert_eq!(pixels, [[1, 2, 3], [40, 50, 60]], "{format:?}");
        each_tenth(&path, |path| load_color(path, ColorSpace::Srgb));
    }
}

#[test]
fn a_picture_in_memory_is_read_like_a_file() {
    let folder = Folder::new();
    let path = folder.picture(
        ImageFormat::Png,
        GrayImage::from_raw(1, 1, vec![7]).unwrap(),
    );
    let bytes = std::fs::read(path).unwrap();
    let name = Path::new("image 3");
    let read = |bytes| load_color(Source::Memory { name, bytes }, ColorSpace::Srgb);
    assert_eq!(
        read(&bytes).unwrap().pixel(0, 0),
        Vec3::splat(srgb_decode(7.0 / 255.0))
    );
    let refused = read(&bytes[..40]).unwrap_err().to_string();
    assert!(refused.contains("image 3"), "{refused}");
}
