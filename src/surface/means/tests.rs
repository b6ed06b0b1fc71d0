use super::*;
use crate::surface::Wrap;

const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror];

/// A number from 0 to 65535 that looks random.
fn noise(i: usize) -> u16 {
    ((i as u32).wrapping_mul(2_654_435_761) >> 13) as u16
}

fn maps(width: usize, height: usize, wrap: Wrap) -> [DisplacementMap; 3] {
    let all = || (0..width * height).map(noise);
    [
        Texels::U8(all().map(|h| h as u8).collect()),
        Texels::U16(all().collect()),
        Texels::F32(all().map(|h| f32::from(h) / 7.0 - 99.0).collect()),
    ]
    .map(|texels| DisplacementMap::new(width, height, texels, wrap).unwrap())
}

fn stored(map: &DisplacementMap) -> Vec<Vec<f32>> {
    let all = |level: &HeightGrid| {
        (0..level.stride() * (level.height + 1))
            .map(|i| level.texels.get(i))
            .collect()
    };
    map.means.get().unwrap().levels.iter().map(all).collect()
}

#[test]
fn every_level_has_the_mean_of_the_map() {
    for (width, height) in [(64, 64), (37, 20), (1, 9), (5, 1), (1, 1)] {
        for map in maps(width, height, Wrap::Repeat) {
            map.build_means();
            let mean = |level: &HeightGrid| {
                let rows = (0..level.height)
                    .flat_map(|j| (0..level.width).map(move |i| j * level.stride() + i));
                let sum: f64 = rows.map(|i| f64::from(level.texels.get(i))).sum();
                sum / (level.width * level.height) as f64 / f64::from(level.texels.kind().unit())
            };
            let expected = mean(&map.grid);
            for level in &map.means.get().unwrap().levels {
                // 16-bit means are rounded level by level.
                let slack = 1e-4 * expected.abs().max(1.0);
                assert!((mean(level) - expected).abs() < slack, "{width}x{height}");
            }
        }
    }
}

#[test]
fn an_edit_leaves_what_a_new_map_has() {
    for wrap in WRAPS {
        for map in maps(37, 20, wrap) {
            map.build_means();
            for (x, y, width, height) in
                [(0, 0, 1, 1), (36, 19, 1, 1), (5, 3, 20, 9), (0, 0, 37, 20)]
            {
                let rect = TexelRect {
                    x,
                    y,
                    width,
                    height,
                };
                let new = |i: usize| noise(i * 31 + 7 * x + 1);
                let all = || (0..width * height).map(new);
                let texels = match map.kind() {
                    TexelKind::U8 => Texels::U8(all().map(|h| h as u8).collect()),
                    TexelKind::U16 => Texels::U16(all().collect()),
                    TexelKind::F32 => Texels::F32(all().map(f32::from).collect()),
                };
                map.update(rect, &texels).unwrap();
                let whole = TexelRect {
                    x: 0,
                    y: 0,
                    width: 37,
                    height: 20,
                };
                let again = DisplacementMap::new(37, 20, map.read(whole).unwrap(), wrap).unwrap();
                again.build_means();
                assert_eq!(stored(&map), stored(&again), "{wrap:?} {rect}");
            }
        }
    }
}

#[test]
fn means_are_there_once_asked_for_and_cost_a_third() {
    for map in maps(256, 256, Wrap::Repeat) {
        let texels = map.texels().bytes();
        assert_eq!(map.mean_bytes(), 0);
        assert!(map.averaged(DVec2::ZERO, 8.0).is_none());
        map.build_means();
        let most = if map.kind() == TexelKind::U8 {
            0.7
        } else {
            0.35
        };
        assert!((map.mean_bytes() as f64) < most * texels as f64);
        assert!(map.averaged(DVec2::ZERO, 8.0).is_some());
        assert!(map.averaged(DVec2::ZERO, 1.0).is_none());
        assert!(map.averaged(DVec2::ZERO, f64::NAN).is_none());
    }
}

#[test]
fn a_ramp_keeps_its_slope_and_noise_loses_it() {
    let ramp = (0..128 * 128).map(|i| (i % 128) as f32).collect();
    let map = DisplacementMap::new(128, 128, Texels::F32(ramp), Wrap::Clamp).unwrap();
    map.build_means();
    for width in [2.5, 4.0, 11.0] {
        let found = map.averaged(DVec2::new(64.0, 50.0), width).unwrap();
        assert!((found.gradient - DVec2::X).length() < 1e-5, "{found:?}");
        assert!((found.height - 64.0).abs() < 1e-3, "{found:?}");
    }
    let [_, noise, _] = maps(128, 128, Wrap::Repeat);
    noise.build_means();
    let steepest = |width: f64| {
        let at = |k: i32| {
            noise
                .averaged(DVec2::splat(f64::from(k)), width)
                .unwrap()
                .gradient
                .length()
        };
        (0..128).map(at).fold(0.0, f64::max)
    };
    assert!(steepest(32.0) < 0.05 * steepest(2.01));
}
