use image::{ImageFormat, Rgb, Rgb32FImage};

use super::*;
use crate::image::test_files::{Folder, each_tenth};
use crate::image::{ExrChannel, write_exr};

/// Rows of two pixels, the top one first.
fn exr(folder: &Folder, pixels: &[[f32; 3]]) -> std::path::PathBuf {
    let path = folder.path("sky.exr");
    let bottom_first: Vec<_> = pixels.chunks(2).rev().flatten().copied().collect();
    let channels = ExrChannel::rgb(None, &bottom_first).to_vec();
    write_exr(&path, 2, pixels.len() / 2, channels, &[]).unwrap();
    path
}

#[test]
fn the_first_row_is_the_top() {
    let folder = Folder::new();
    let pixels = [
        [1.0, 2.0, 3.0],
        [4.0, 5.0, 6.0],
        [7.0, 8.0, 9.0],
        [0.0, 0.0, 1e6],
    ];
    let sky = load_environment(&exr(&folder, &pixels)).unwrap();
    assert_eq!((sky.width, sky.height), (2, 2));
    assert_eq!(sky.pixels, pixels.map(Vec3::from));
}

#[test]
fn bad_radiance_is_refused_with_its_place() {
    let folder = Folder::new();
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let pixels = [
            [1.0; 3],
            [1.0; 3],
            [1.0; 3],
            [1.0, bad, 1.0],
            [1.0; 3],
            [1.0; 3],
        ];
        let error = load_environment(&exr(&folder, &pixels)).unwrap_err();
        assert!(
            matches!(error, ImageError::BadPixel { x: 1, y: 1, .. }),
            "{error}"
        );
    }
}

#[test]
fn ringing_below_zero_is_no_light() {
    let folder = Folder::new();
    let sky = load_environment(&exr(&folder, &[[-5.0, 2.0, 0.0], [1.0; 3]])).unwrap();
    assert_eq!(sky.pixels, [Vec3::new(0.0, 2.0, 0.0), Vec3::ONE]);
}

#[test]
fn radiance_hdr_is_read() {
    let folder = Folder::new();
    let picture = Rgb32FImage::from_pixel(16, 8, Rgb([0.5, 2.0, 0.25]));
    let path = folder.picture(ImageFormat::Hdr, picture);
    let sky = load_environment(&path).unwrap();
    assert_eq!((sky.width, sky.height), (16, 8));
    assert!(
        sky.pixels
            .iter()
            .all(|p| p.abs_diff_eq(Vec3::new(0.5, 2.0, 0.25), 0.01))
    );
    each_tenth(&path, load_environment);
}

#[test]
fn a_picture_without_dynamic_range_is_no_environment() {
    let folder = Folder::new();
    let path = folder.picture(ImageFormat::Png, image::GrayImage::new(2, 1));
    assert!(matches!(
        load_environment(&path),
        Err(ImageError::NotRadiance { .. })
    ));
}
