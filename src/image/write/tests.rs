use super::*;
use crate::files::OutputError;
use crate::image::test_files::Folder;
use crate::image::{Channel, ColorPixels, ColorSpace, load_color, load_heights};
use crate::surface::Wrap;

#[test]
fn an_rgb_png_comes_back() {
    let folder = Folder::new();
    let path = folder.path("rgb.png");
    let pixels = [[1, 2, 3], [4, 5, 6]];
    write_png_rgb8(&path, 1, 2, &pixels, &[]).unwrap();
    let read = load_color(&path, ColorSpace::Srgb).unwrap();
    assert!(matches!(read.pixels, ColorPixels::Srgb8(p) if p == pixels));
}

#[test]
fn an_exr_comes_back_with_layers_and_attributes() {
    let folder = Folder::new();
    let path = folder.path("film.exr");
    let beauty = [[0.1, 1e-20, 3e30], [0.4, -5.0, 0.6]];
    let albedo = [[0.25; 3], [0.75; 3]];
    let mut channels = ExrChannel::rgb(None, &beauty).to_vec();
    channels.extend(ExrChannel::rgb(Some("albedo"), &albedo));
    let attributes = [("scene", "asteroid.toml"), ("seed", "7")];
    write_exr(&path, 2, 1, channels, &attributes).unwrap();
    let read = load_color(&path, ColorSpace::Linear).unwrap();
    assert!(matches!(read.pixels, ColorPixels::Linear(p) if p == beauty));
    let layer = Channel::Named("albedo.G".to_owned());
    let map = load_heights(&path, &layer, Wrap::Clamp, None).unwrap();
    assert_eq!(map.range(), (0.25, 0.75));
    let meta = exr::meta::MetaData::read_from_file(&path, false).unwrap();
    let other = &meta.headers[0].own_attributes.other;
    for (name, value) in attributes {
        assert_eq!(
            other[&Text::from(name)],
            AttributeValue::Text(Text::from(value))
        );
    }
}

#[test]
fn a_size_that_does_not_fit_the_pixels_is_refused() {
    let folder = Folder::new();
    let path = folder.path("bad.png");
    for (width, height) in [(0, 0), (2, 2), (usize::MAX, 2)] {
        let result = write_png_gray16(&path, width, height, &[1, 2, 3]);
        assert!(
            matches!(result, Err(OutputError::WrongSize { .. })),
            "{result:?}"
        );
    }
    assert!(!path.exists());
}

#[test]
fn an_exr_that_cannot_be_is_an_error_and_no_file() {
    let folder = Folder::new();
    let path = folder.path("bad.exr");
    let twice = [
        ExrChannel::rgb(None, &[[1.0; 3]]),
        ExrChannel::rgb(None, &[[1.0; 3]]),
    ]
    .concat();
    assert!(write_exr(&path, 1, 1, twice, &[]).is_err());
    assert!(write_exr(&path, 1, 1, Vec::new(), &[]).is_err());
    assert!(!path.exists());
}
