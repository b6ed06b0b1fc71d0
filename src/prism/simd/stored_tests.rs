//! What lanes read as it is stored: pairs of the pyramid, and texels in a row.

use super::*;
use crate::surface::{DisplacementMap, Texels, Wrap};

/// Of every kind, of several levels, and of sides that no block divides.
fn maps() -> [DisplacementMap; 3] {
    let (width, height) = (37, 21);
    let hash = |i: usize| i.wrapping_mul(2_654_435_761) >> 7;
    let all = 0..width * height;
    let float = |i: usize| f32::from(hash(i) as u16) / 7.0 - 3000.0;
    [
        Texels::U8(all.clone().map(|i| hash(i) as u8).collect()),
        Texels::U16(all.clone().map(|i| hash(i) as u16).collect()),
        Texels::F32(all.map(float).collect()),
    ]
    .map(|texels| DisplacementMap::new(width, height, texels, Wrap::Repeat).unwrap())
}

fn bits<L: Lanes>(lanes: L) -> [u32; LANES] {
    lanes.to_array().map(f32::to_bits)
}

fn reads_pairs<L: Lanes>() {
    for map in maps() {
        let entries = map.pyramid().levels()[0].entries();
        let count = entries.count();
        for first in 0..=count - 4 {
            let index = [first, count - 4 - first];
            let [low, high] = L::pairs(entries, index).map(bits);
            for lane in 0..LANES {
                let (a, b) = entries.get(index[lane / 4] + lane % 4);
                assert_eq!(
                    (low[lane], high[lane]),
                    (a.to_bits(), b.to_bits()),
                    "{index:?}"
                );
            }
        }
        // Well beyond what is kept after the last.
        let none = L::pairs(entries, [count + 16, 2 * count + 16]);
        assert_eq!(none.map(bits), [[0; LANES]; 2]);
    }
}

fn reads_rows<L: Lanes>() {
    for map in maps() {
        let (width, height) = map.size();
        let texels = map.texels();
        // From every texel on, the last one too.
        let count = (width + 1) * (height + 1);
        let stored = texels.bytes() / map.kind().bytes();
        assert!(count - 1 + 9 <= stored);
        for index in 0..=stored - 9 {
            let rows = L::texel_rows(texels, index).map(bits);
            for (from, row) in rows.iter().enumerate() {
                let found = |l: usize| texels.get(index + from + l).to_bits();
                assert_eq!(*row, std::array::from_fn(found), "{index}");
            }
        }
        for index in [stored - 8, stored, stored + 1, usize::MAX - 4, usize::MAX] {
            let rows = L::texel_rows(texels, index).map(bits);
            assert_eq!(rows, [[0; LANES]; 2], "{index}");
        }
    }
}

#[test]
fn baseline_reads_what_is_stored() {
    reads_pairs::<Portable>();
    reads_rows::<Portable>();
}

#[cfg(target_arch = "x86_64")]
#[test]
fn avx2_reads_what_is_stored() {
    if SimdLevel::Avx2.is_supported() {
        reads_pairs::<Avx2>();
        reads_rows::<Avx2>();
    }
}
