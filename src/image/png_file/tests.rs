use super::*;
use crate::image::Source;
use crate::image::test_files::{chunk, png};

fn read(bytes: &[u8]) -> Result<Raster, ImageError> {
    let name = Path::new("a.png");
    decode(Source::Memory { name, bytes }.open()?)
}

fn bytes_of(raster: Raster) -> (usize, Vec<u8>) {
    match raster.samples {
        Samples::U8(samples) => (raster.channels.len(), samples),
        _ => panic!("not 8-bit"),
    }
}

fn reason(bytes: &[u8]) -> String {
    let refused = read(bytes).map(|raster| bytes_of(raster).1).unwrap_err();
    refused.to_string()
}

/// With `chunk` before the pixels.
fn with(file: &[u8], chunk: &[u8]) -> Vec<u8> {
    let at = file.windows(4).position(|name| name == b"IDAT").unwrap() - 4;
    [&file[..at], chunk, &file[at..]].concat()
}

#[test]
fn a_palette_must_be_a_list_of_colours() {
    for length in [1, 2, 4, 5, 3 * 257] {
        let refused = reason(&png(1, 1, 8, 3, &vec![9; length], &[0, 0]));
        assert!(refused.contains("a.png"), "{length}: {refused}");
    }
    assert!(reason(&png(1, 1, 8, 3, &[], &[0, 0])).contains("a.png"));
    let refused = reason(&png(2, 1, 8, 3, &[1, 2, 3], &[0, 0, 1]));
    assert!(refused.contains("beyond the palette"), "{refused}");
}

#[test]
fn transparent_colours_of_a_palette_are_alpha() {
    let plain = png(2, 1, 4, 3, &[1, 2, 3, 4, 5, 6], &[0, 0x10]);
    assert_eq!(bytes_of(read(&plain).unwrap()), (3, vec![4, 5, 6, 1, 2, 3]));
    let alpha = with(&plain, &chunk(b"tRNS", &[7]));
    let expected = (4, vec![4, 5, 6, 255, 1, 2, 3, 7]);
    assert_eq!(bytes_of(read(&alpha).unwrap()), expected);
    let more = with(&plain, &chunk(b"tRNS", &[7, 7, 7]));
    assert!(!reason(&more).is_empty());
}

#[test]
fn interlaced_rows_come_to_their_places() {
    // Of seven passes, 2 x 2 pixels have three: (0, 0), (1, 0) and the second row.
    let mut file = png(2, 2, 8, 0, &[], &[0, 1, 0, 2, 0, 3, 4]);
    let header = [0, 0, 0, 2, 0, 0, 0, 2, 8, 0, 0, 0, 1];
    file.splice(8..8 + 25, chunk(b"IHDR", &header));
    assert_eq!(bytes_of(read(&file).unwrap()), (1, vec![1, 2, 3, 4]));
    // The same bytes are too few for three rows.
    let header = [0, 0, 0, 2, 0, 0, 0, 3, 8, 0, 0, 0, 1];
    file.splice(8..8 + 25, chunk(b"IHDR", &header));
    assert!(!reason(&file).is_empty());
}

#[test]
fn damage_is_noticed_wherever_it_is() {
    let file = with(
        &png(3, 1, 8, 0, &[], &[0, 1, 2, 3]),
        &chunk(b"tRNS", &[0, 2]),
    );
    assert_eq!(
        bytes_of(read(&file).unwrap()),
        (2, vec![1, 255, 2, 0, 3, 255])
    );
    for at in 8..file.len() {
        let mut damaged = file.clone();
        damaged[at] ^= 0x55;
        assert!(read(&damaged).is_err(), "byte {at} of {}", file.len());
    }
    for length in 0..file.len() {
        assert!(read(&file[..length]).is_err(), "{length} of {}", file.len());
    }
}
