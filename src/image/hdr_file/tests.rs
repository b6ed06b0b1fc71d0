use std::path::Path;

use super::*;
use crate::image::Source;

fn read(header: &str, pixels: &[u8]) -> Result<(usize, usize, Vec<f32>), ImageError> {
    let bytes = [header.as_bytes(), pixels].concat();
    let name = Path::new("a.hdr");
    let raster = decode(
        Source::Memory {
            name,
            bytes: &bytes,
        }
        .open()?,
    )?;
    let Samples::F32(samples) = raster.samples else {
        panic!("not float")
    };
    Ok((raster.width, raster.height, samples))
}

fn header(resolution: &str) -> String {
    format!("#?RADIANCE\n# why\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n{resolution}\n")
}

/// The red of each pixel, in rows from the top.
fn reds(resolution: &str, pixels: &[u8]) -> Vec<f32> {
    let (_, _, samples) = read(&header(resolution), pixels).unwrap();
    samples.chunks_exact(3).map(|pixel| pixel[0]).collect()
}

/// Flat pixels of these reds: 136 is the exponent that leaves mantissas as they are.
fn flat(reds: &[u8]) -> Vec<u8> {
    reds.iter().flat_map(|&red| [red, 0, 0, 136]).collect()
}

#[test]
fn mantissas_and_exponents_make_radiance() {
    let (width, height, samples) =
        read(&header("-Y 1 +X 2"), &[128, 64, 0, 129, 9, 9, 9, 0]).unwrap();
    assert_eq!((width, height), (2, 1));
    assert_eq!(samples, [1.0, 0.5, 0.0, 0.0, 0.0, 0.0]);
    let (_, _, samples) = read(&header("-Y 1 +X 1"), &[255, 0, 0, 255]).unwrap();
    assert_eq!(samples[0], 255.0 * 2f32.powi(119));
}

#[test]
fn all_eight_orientations_are_set_upright() {
    // Rows from the top: 1 2 3 / 4 5 6.
    let upright = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    for (resolution, stored) in [
        ("-Y 2 +X 3", [1, 2, 3, 4, 5, 6]),
        ("-Y 2 -X 3", [3, 2, 1, 6, 5, 4]),
        ("+Y 2 +X 3", [4, 5, 6, 1, 2, 3]),
        ("+Y 2 -X 3", [6, 5, 4, 3, 2, 1]),
        ("+X 3 -Y 2", [1, 4, 2, 5, 3, 6]),
        ("+X 3 +Y 2", [4, 1, 5, 2, 6, 3]),
        ("-X 3 -Y 2", [3, 6, 2, 5, 1, 4]),
        ("-X 3 +Y 2", [6, 3, 5, 2, 4, 1]),
    ] {
        assert_eq!(reds(resolution, &flat(&stored)), upright, "{resolution}");
    }
}

#[test]
fn runs_of_both_codings_are_unpacked() {
    let old = [flat(&[7]), vec![1, 1, 1, 2], flat(&[8])].concat();
    assert_eq!(reds("-Y 1 +X 4", &old), [7.0, 7.0, 7.0, 8.0]);
    // 256 more by a second digit.
    let old = [flat(&[7]), vec![1, 1, 1, 3, 1, 1, 1, 1]].concat();
    assert_eq!(reds("-Y 1 +X 260", &old), [7.0; 260]);
    let new = [
        2,
        2,
        0,
        8,
        128 + 6,
        5,
        2,
        1,
        2,
        128 + 8,
        0,
        128 + 8,
        0,
        128 + 8,
        136,
    ];
    let expected = [5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 1.0, 2.0];
    assert_eq!(reds("-Y 1 +X 8", &new), expected);
    for length in 0..new.len() {
        assert!(read(&header("-Y 1 +X 8"), &new[..length]).is_err());
    }
}

#[test]
fn runs_that_do_not_fit_are_refused() {
    for pixels in [
        &[1, 1, 1, 3][..],
        &[9, 9, 9, 9, 1, 1, 1, 8],
        &[
            9, 9, 9, 9, 1, 1, 1, 0, 1, 1, 1, 0, 1, 1, 1, 0, 1, 1, 1, 0, 1, 1, 1, 1,
        ],
        &[2, 2, 0, 9, 128 + 9, 0],
        &[2, 2, 0, 8, 128 + 9, 0],
        &[2, 2, 0, 8, 0, 0],
    ] {
        let file = [pixels, &[0; 64]].concat();
        assert!(read(&header("-Y 1 +X 8"), &file).is_err(), "{pixels:?}");
    }
}

#[test]
fn headers_are_checked() {
    for (header, word) in [
        ("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n", "xyze"),
        ("#?RADIANCE\n\n-Y 1 +Z 1\n", "resolution"),
        ("#?RADIANCE\n\n-Y 1 +Y 1\n", "resolution"),
        ("#?RADIANCE\n\n-Y 0 +X 1\n", "0"),
        ("#?RADIANCE\n\n-Y 99999999 +X 99999999\n", "99999999"),
        ("#?RADIANCE\nFORMAT", "header"),
    ] {
        let refused = read(header, &[0; 64]).unwrap_err().to_string();
        assert!(
            refused.contains(word) && refused.contains("a.hdr"),
            "{refused}"
        );
    }
}
