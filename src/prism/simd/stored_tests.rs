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
        let count = entries.count() as u32;
        let levels = map.pyramid().levels().iter();
        let all: usize = levels.map(|level| level.width() * level.height()).sum();
        assert_eq!(count as usize, all);
        for first in 0..count + 3 {
            let mut index: [u32; LANES] = std::array::from_fn(|l| first + 7 * l as u32);
            index[3] = count - 1;
            index[4] = count;
            index[5] = i32::MAX as u32 + first;
            index[6] = u32::MAX;
            let [low, high] = L::entries(entries, index).map(bits);
            for (l, index) in index.into_iter().enumerate() {
                let (a, b) = entries.get(index.min(count - 1) as usize);
                assert_eq!((low[l], high[l]), (a.to_bits(), b.to_bits()), "{index}");
            }
        }
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
