use proptest::prelude::*;

use super::*;
use crate::surface::{DisplacementMap, TexelKind, TexelRect};

pub const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror];
pub const KINDS: [TexelKind; 3] = [TexelKind::U8, TexelKind::U16, TexelKind::F32];

/// `count` texels without a pattern.
pub fn noise(kind: TexelKind, count: usize, seed: u32) -> Texels {
    let hash = |i: u32| {
        let h = (i ^ seed.wrapping_mul(0x9e37_79b1)).wrapping_mul(0x85eb_ca6b);
        (h ^ h >> 13).wrapping_mul(0xc2b2_ae35) >> 8
    };
    let all = 0..count as u32;
    match kind {
        TexelKind::U8 => Texels::U8(all.map(|i| hash(i) as u8).collect()),
        TexelKind::U16 => Texels::U16(all.map(|i| hash(i) as u16).collect()),
        // Zeros of both signs among them.
        TexelKind::F32 => Texels::F32(
            all.map(|i| (hash(i) as u16 as f32 - 30000.0) * f32::from(hash(i) % 5 > 0))
                .collect(),
        ),
    }
}

fn map(kind: TexelKind, width: usize, height: usize, wrap: Wrap) -> DisplacementMap {
    DisplacementMap::new(width, height, noise(kind, width * height, 1), wrap).unwrap()
}

/// Every entry, as stored.
fn bits(pyramid: &Pyramid) -> Vec<Vec<(u32, u32)>> {
    let level = |level: &Level| {
        let all = (0..level.height).flat_map(|j| (0..level.width).map(move |i| (i, j)));
        let bits = |(low, high): (f32, f32)| (low.to_bits(), high.to_bits());
        all.map(|(i, j)| bits(level.get(i, j))).collect()
    };
    pyramid.levels().iter().map(level).collect()
}

/// What an entry must hold by definition, texel by texel.
fn by_definition(map: &DisplacementMap, level: &Level, (i, j): (usize, usize)) -> (f32, f32) {
    let (width, height) = map.size();
    let [across, up] = level.block();
    let mut range = (f32::INFINITY, f32::NEG_INFINITY);
    for y in j * up..=(j + 1) * up {
        for x in i * across..=(i + 1) * across {
            let x = map.wrap().texel(x as i64, width);
            let y = map.wrap().texel(y as i64, height);
            let h = map.texels().get(y * map.stride() + x);
            range = (range.0.min(h), range.1.max(h));
        }
    }
    range
}

proptest! {
    #[test]
    fn entries_hold_what_they_should(
        width in 1usize..70, height in 1usize..70, wrap in 0..3usize, kind in 0..3usize,
    ) {
        let map = map(KINDS[kind], width, height, WRAPS[wrap]);
        for (k, level) in map.pyramid().levels().iter().enumerate() {
            let [across, up] = level.block();
            prop_assert_eq!([across, up], [8 << k, 4 << k]);
            prop_assert_eq!(level.width, width.div_ceil(across));
            prop_assert_eq!(level.height, height.div_ceil(up));
            for j in 0..level.height {
                for i in 0..level.width {
                    let (low, high) = by_definition(&map, level, (i, j));
                    let found = level.get(i, j);
                    prop_assert!(found.0 <= low && found.1 >= high, "{k} {i} {j}");
                    // Wider only where it reaches across an edge that cuts a block.
                    let mirror = WRAPS[wrap] == Wrap::Mirror;
                    let cut = |block: usize, n: usize, side: usize| {
                        (block + 1) * side >= n && (!n.is_multiple_of(side) || mirror)
                    };
                    let exact = k == 0 || WRAPS[wrap] == Wrap::Clamp
                        || !cut(i, width, across) && !cut(j, height, up);
                    prop_assert!(!exact || found == (low, high), "{k} {i} {j}");
                    // Tiles of 32x32 cells: eight pairs by rows, and the four that each is made of.
                    let eighth = |i: usize, j: usize| 2 * (j % 4) + i % 2;
                    let number = match k {
                        0 => 4 * eighth(i / 2, j / 2) + 2 * (j % 2) + i % 2,
                        1 => eighth(i, j),
                        _ => continue,
                    };
                    let tile = level.tile(i * across / 32, j * up / 32);
                    prop_assert_eq!(level.entries().get(tile + number), found);
                }
            }
        }
        let top = &map.pyramid().levels()[map.pyramid().levels().len() - 1];
        prop_assert_eq!((top.width, top.height), (1, 1));
        prop_assert!(top.block()[0] >= width && top.block()[1] >= height);
    }

    #[test]
    fn an_entry_covers_its_block(
        size in prop::array::uniform2(1usize..70), wrap in 0..3usize, level in 0..5usize, at in prop::array::uniform2(0.0..1.0),
    ) {
        let map = map(TexelKind::U16, size[0], size[1], WRAPS[wrap]);
        let levels = map.pyramid().levels();
        let level = &levels[level.min(levels.len() - 1)];
        let p = [at[0] * size[0] as f64, at[1] * size[1] as f64];
        let (a, b) = level.get(p[0] as usize >> level.shift[0], p[1] as usize >> level.shift[1]);
        let height = map.sample(p.into()).height * 65535.0;
        prop_assert!(height >= f64::from(a) - 1e-6 && height <= f64::from(b) + 1e-6);
    }

    #[test]
    fn an_edit_leaves_what_a_new_map_would_have(
        size in prop::array::uniform2(1usize..70), wrap in 0..3usize, kind in 0..3usize,
        from in prop::array::uniform2(0.0..1.0), to in prop::array::uniform2(0.0..1.0),
    ) {
        let (kind, wrap) = (KINDS[kind], WRAPS[wrap]);
        let map = map(kind, size[0], size[1], wrap);
        let start = [0, 1].map(|k| (from[k] * size[k] as f64) as usize);
        let length = [0, 1].map(|k| 1 + (to[k] * (size[k] - start[k] - 1) as f64) as usize);
        let rect = TexelRect { x: start[0], y: start[1], width: length[0], height: length[1] };
        map.update(rect, &noise(kind, length[0] * length[1], 7)).unwrap();
        let all = TexelRect { x: 0, y: 0, width: size[0], height: size[1] };
        let new = DisplacementMap::new(size[0], size[1], map.read(all).unwrap(), wrap).unwrap();
        prop_assert_eq!(bits(map.pyramid()), bits(new.pyramid()));
        for index in 0..(size[0] + 1) * (size[1] + 1) {
            prop_assert_eq!(map.texels().get(index).to_bits(), new.texels().get(index).to_bits());
        }
    }
}

/// Large enough for several threads and for several bands of an edit.
#[test]
fn an_edit_of_a_whole_large_map_leaves_what_a_new_one_has() {
    let (width, height) = (1030, 1111);
    for kind in KINDS {
        let map = map(kind, width, height, Wrap::Repeat);
        let (x, y) = (0, 0);
        let rect = TexelRect {
            x,
            y,
            width,
            height,
        };
        let texels = noise(kind, width * height, 3);
        map.update(rect, &texels).unwrap();
        let new = DisplacementMap::new(width, height, texels, Wrap::Repeat).unwrap();
        assert_eq!(bits(map.pyramid()), bits(new.pyramid()));
    }
}

#[test]
fn the_pyramid_takes_at_most_a_fifth_of_the_texels() {
    for kind in KINDS {
        for (width, height) in [
            (64, 64),
            (65, 65),
            (64, 65),
            (97, 66),
            (129, 129),
            (64, 3000),
            (1000, 69),
        ] {
            let map = map(kind, width, height, Wrap::Repeat);
            let (bytes, texels) = (map.pyramid().bytes(), width * height * kind.bytes());
            // Tiles of 32x32 texels are whole: of small maps a good deal is beyond the edge.
            assert!(5 * bytes <= texels, "{kind} {width}x{height}: {bytes}");
            assert_eq!(map.bytes(), map.texels().bytes() + bytes);
        }
    }
}

#[test]
fn pairs_are_stored_as_kernels_expect_them() {
    use std::sync::atomic::Ordering::Relaxed;
    let entries = |texels| {
        let map = DisplacementMap::new(2, 1, texels, Wrap::Repeat).unwrap();
        match map.pyramid().levels()[0].entries() {
            Entries::U8(e) => e.iter().map(|e| e.load(Relaxed).into()).collect(),
            Entries::U16(e) | Entries::F32(e) => {
                e.iter().map(|e| e.load(Relaxed)).collect::<Vec<u32>>()
            }
        }
    };
    // One pair, and 31 of its tile that are beyond the map; two more behind.
    let stored = |mut pairs: Vec<u32>, words: usize| {
        pairs.resize((32 + 2) * words, 0);
        pairs
    };
    let u8s = entries(Texels::U8(vec![0x12, 0xfe]));
    assert_eq!(u8s, stored(vec![0xfe12], 1));
    let u16s = entries(Texels::U16(vec![0x1234, 0xfedc]));
    assert_eq!(u16s, stored(vec![0xfedc_1234], 1));
    let bits = [-2.5f32, 0.75].map(f32::to_bits);
    let floats = entries(Texels::F32(vec![0.75, -2.5]));
    assert_eq!(floats, stored(bits.to_vec(), 2));
}
