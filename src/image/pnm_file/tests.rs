use std::path::Path;

use super::*;
use crate::image::Source;

fn read(bytes: &[u8]) -> Result<Raster, ImageError> {
    let name = Path::new("a.pnm");
    decode(Source::Memory { name, bytes }.open()?)
}

fn bytes_of(file: &[u8]) -> Vec<u8> {
    match read(file).unwrap().samples {
        Samples::U8(samples) => samples,
        _ => panic!("not 8-bit"),
    }
}

fn words_of(file: &[u8]) -> Vec<u16> {
    match read(file).unwrap().samples {
        Samples::U16(samples) => samples,
        _ => panic!("not 16-bit"),
    }
}

fn floats_of(file: &[u8]) -> Vec<f32> {
    match read(file).unwrap().samples {
        Samples::F32(samples) => samples,
        _ => panic!("not float"),
    }
}

#[test]
fn bits_greys_and_colours_are_read_from_text_and_binary() {
    let black = [255, 0, 0, 255, 0, 255];
    assert_eq!(bytes_of(b"P1\n# a comment\n3 2\n011\n0 10"), black);
    assert_eq!(bytes_of(b"P4 3 2\n\x60\x40"), black);
    assert_eq!(bytes_of(b"P2 2 1 255\n7 255"), [7, 255]);
    assert_eq!(bytes_of(b"P5 2 1 255\n\x07\xff"), [7, 255]);
    let raster = read(b"P3 1 1 255 1 2 3").unwrap();
    assert_eq!(raster.channels, ["R", "G", "B"]);
    assert_eq!(bytes_of(b"P6 1 1#\n255\n\x01\x02\x03"), [1, 2, 3]);
}

#[test]
fn sixteen_bits_stay_and_other_ranges_are_fractions_of_theirs() {
    assert_eq!(
        words_of(b"P5 2 1 65535\n\x12\x34\xff\xff"),
        [0x1234, 0xffff]
    );
    assert_eq!(words_of(b"P2 3 1 1023 0 512 1023"), [0, 32_800, 65_535]);
    assert_eq!(words_of(b"P2 2 1 100 50 100"), [32_768, 65_535]);
    assert_eq!(bytes_of(b"P2 3 1 15 0 7 15"), [0, 119, 255]);
}

#[test]
fn floats_are_kept_in_both_byte_orders_and_their_rows_come_from_the_bottom() {
    let rows = [1.5f32, -2.0, 1e-30, 4e9, 5.0, 6.0];
    let little: Vec<u8> = rows.iter().flat_map(|x| x.to_le_bytes()).collect();
    let big: Vec<u8> = rows.iter().flat_map(|x| x.to_be_bytes()).collect();
    let top_first = [5.0, 6.0, 1e-30, 4e9, 1.5, -2.0];
    for (header, pixels) in [("Pf\n2 3\n-1.0\n", little), ("Pf\n2 3\n2.5\n", big)] {
        let file = [header.as_bytes(), &pixels].concat();
        assert_eq!(floats_of(&file), top_first);
        for length in 0..file.len() {
            assert!(read(&file[..length]).is_err(), "{length}");
        }
    }
    let color = [&b"PF 1 1 -1\n"[..], &[0; 12]].concat();
    assert_eq!(floats_of(&color), [0.0; 3]);
}

#[test]
fn what_is_no_picture_is_refused() {
    for file in [
        &b"P5 2 1 255\n\x07"[..],
        b"P5 2 1 0\n\0\0",
        b"P5 2 1 65536\n\0\0\0\0",
        b"P5 0 1 255\n",
        b"P5 2\n",
        b"P5 -2 1 255\n\0\0",
        b"P5 99999999999999999999 1 255\n\0",
        b"P5 99999999 99999999 255\n\0",
        b"P2 2 1 9 1 10",
        b"P2 1 1 65535 65536",
        b"P2 2 1 9 1 x",
        b"P1 2 1 0 2",
        b"P1 2 1 0",
        b"Pf 1 1 0\n\0\0\0\0",
        b"Pf 1 1 nan\n\0\0\0\0",
    ] {
        let refused = read(file).map(|_| ()).unwrap_err().to_string();
        assert!(refused.contains("a.pnm"), "{refused}");
    }
}

#[test]
fn pam_names_what_it_says() {
    let header = |depth: u32| {
        format!("P7\nWIDTH 2\n# why\nHEIGHT 1\nDEPTH {depth}\nMAXVAL 255\nTUPLTYPE ANY\nENDHDR\n")
    };
    for (depth, channels) in [(1, "Y"), (2, "Y A"), (3, "R G B"), (4, "R G B A")] {
        let samples: Vec<u8> = (1..=2 * depth as u8).collect();
        let file = [header(depth).as_bytes(), &samples].concat();
        assert_eq!(read(&file).unwrap().channels.join(" "), channels);
        assert_eq!(bytes_of(&file), samples);
    }
    for broken in [header(5), header(0), header(1).replace("WIDTH 2\n", "")] {
        assert!(read(&[broken.as_bytes(), &[0; 64]].concat()).is_err());
    }
}
