use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder};

use super::*;

/// A colour picture whose codes are many.
fn baseline() -> Vec<u8> {
    let pixels: Vec<u8> = (0..40 * 24 * 3u32)
        .map(|i| (i.wrapping_mul(0x9e37_79b1) >> 24) as u8)
        .collect();
    let mut bytes = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut bytes, 60);
    encoder
        .write_image(&pixels, 40, 24, ExtendedColorType::Rgb8)
        .unwrap();
    bytes
}

fn segment(marker: u8, contents: &[u8]) -> Vec<u8> {
    let length = (contents.len() as u16 + 2).to_be_bytes();
    [&[0xff, marker], &length[..], contents].concat()
}

/// Bits from a text of 0 and 1, filled up with ones.
fn coded(bits: &str) -> Vec<u8> {
    let bits: Vec<u8> = bits
        .bytes()
        .filter(|b| *b != b' ')
        .map(|b| b - b'0')
        .collect();
    let byte = |chunk: &[u8]| (0..8).fold(0, |byte, i| byte << 1 | chunk.get(i).unwrap_or(&1));
    bits.chunks(8).map(byte).collect()
}

/// Two blocks in grey, coefficient by coefficient: the scans' headers and bits.
fn progressive(scans: &[([u8; 3], &str)]) -> Vec<u8> {
    let mut file = vec![0xff, 0xd8];
    file.extend(segment(0xc2, &[8, 0, 8, 0, 16, 1, 1, 0x11, 0]));
    // DC: 0 is a difference of 0, 10 one of a bit.
    let dc = [&[0x00, 1, 1][..], &[0; 14], &[0, 1]].concat();
    // AC: 0 ends a band, 10 ends two or three, 110 is a coefficient, 1110 one behind a zero, 11110 sixteen zeros.
    let ac = [
        &[0x10, 1, 1, 1, 1, 1][..],
        &[0; 11],
        &[0x00, 0x10, 0x01, 0x11, 0xf0],
    ]
    .concat();
    file.extend(segment(0xc4, &[dc, ac].concat()));
    for ([first, last, approximation], bits) in scans {
        file.extend(segment(0xda, &[1, 1, 0, *first, *last, *approximation]));
        file.extend(coded(bits));
    }
    file.extend([0xff, 0xd9]);
    file
}

/// All of two blocks.
const SCANS: [([u8; 3], &str); 4] = [
    // Differences of 0 and of one bit.
    ([0, 0, 0x01], "0 101"),
    // The first block: coefficients 1 and 3; the second: nothing.
    ([1, 63, 0x01], "110 1 1110 0 0  0"),
    ([0, 0, 0x10], "1 0"),
    // The first block: a new one at 2, bits for 1 and 3, no more; the second: sixteen zeros passed, a new one at 17, no more.
    ([1, 63, 0x10], "110 1 1 0 1  11110 110 0 0"),
];

#[test]
fn whole_pictures_pass() {
    check(&baseline()).unwrap();
    check(&progressive(&SCANS)).unwrap();
    // A run of two empty bands over both blocks, and its refinement without any.
    let empty = [
        ([0, 0, 0x00], "0 0"),
        ([1, 63, 0x01], "10 0"),
        ([1, 63, 0x10], "10 0"),
    ];
    check(&progressive(&empty)).unwrap();
}

#[test]
fn a_picture_cut_anywhere_is_refused_whatever_is_put_behind_it() {
    for whole in [baseline(), progressive(&SCANS)] {
        for length in 0..whole.len() - 2 {
            let cut = [&whole[..length], &[0xff, 0xd9]].concat();
            assert!(check(&cut).is_err(), "{length} of {}", whole.len());
            assert!(check(&whole[..length]).is_err(), "{length}");
        }
        check(&[&whole[..], &[0xff, 0xd8, 1, 2, 3]].concat()).unwrap();
    }
}

#[test]
fn scans_must_give_all_bits_of_all_coefficients() {
    for (missing, scan) in SCANS.iter().enumerate() {
        let mut scans = SCANS.to_vec();
        scans.remove(missing);
        assert!(check(&progressive(&scans)).is_err(), "without {missing}");
        let mut scans = SCANS.to_vec();
        scans.insert(missing, *scan);
        assert!(check(&progressive(&scans)).is_err(), "{missing} twice");
    }
}

#[test]
fn a_coefficient_may_come_at_a_time_but_no_hundreds_of_scans() {
    let mut scans = vec![([0, 0, 0x00], "0 0")];
    scans.extend((1..64).map(|k| ([k, k, 0x00], "10 0")));
    check(&progressive(&scans)).unwrap();
    scans.truncate(1);
    for approximation in [0x01, 0x10] {
        scans.extend((1..64).map(|k| ([k, k, approximation], "10 0")));
    }
    assert!(
        check(&progressive(&scans))
            .unwrap_err()
            .contains("100 scans")
    );
}

#[test]
fn a_few_bytes_make_no_large_picture() {
    let mut file = baseline();
    let frame = file
        .windows(2)
        .position(|pair| pair == [0xff, 0xc0])
        .unwrap();
    file[frame + 5..frame + 9].copy_from_slice(&[0x1f, 0xfe, 0xff, 0xdc]);
    assert!(check(&file).unwrap_err().contains("truncated"));
}

#[test]
fn kinds_that_are_not_decoded_are_named() {
    let mut file = baseline();
    let frame = file
        .windows(2)
        .position(|pair| pair == [0xff, 0xc0])
        .unwrap();
    for (marker, word) in [
        (0xc3, "lossless"),
        (0xc5, "hierarchical"),
        (0xc9, "arithmetic"),
    ] {
        file[frame + 1] = marker;
        assert!(check(&file).unwrap_err().contains(word));
    }
    file[frame + 1] = 0xc1;
    file[frame + 4] = 12;
    assert!(check(&file).unwrap_err().contains("12-bit"));
}

#[test]
fn restart_markers_are_passed_in_their_order() {
    let scan = |bits: [&str; 3], markers: [u8; 2]| {
        let mut file = progressive(&[]);
        file.truncate(file.len() - 2);
        // The frame again, of three blocks in sequence.
        let frame = file
            .windows(2)
            .position(|pair| pair == [0xff, 0xc2])
            .unwrap();
        file[frame + 1] = 0xc0;
        file[frame + 8] = 24;
        file.extend(segment(0xdd, &[0, 1]));
        file.extend(segment(0xda, &[1, 1, 0, 0, 63, 0]));
        for (bits, marker) in bits.iter().zip([markers[0], markers[1], 0xd9]) {
            file.extend(coded(bits));
            file.extend([0xff, marker]);
        }
        check(&file)
    };
    let block = "0 0";
    scan([block; 3], [0xd0, 0xd1]).unwrap();
    assert!(scan([block; 3], [0xd0, 0xd2]).is_err());
    assert!(scan([block, "", block], [0xd0, 0xd1]).is_err());
}
