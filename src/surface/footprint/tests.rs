use std::collections::HashSet;

use super::*;
use crate::surface::Texels;
use proptest::prelude::*;

proptest! {
    #[test]
    fn no_sample_inside_is_outside_the_range(
        corners in prop::array::uniform6(-20.0f64..20.0), b in prop::array::uniform2(0.0f64..1.0), mode in 0..3,
    ) {
        let wrap = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror][mode as usize];
        let heights = (0..30 * 41).map(|i: u32| (i.wrapping_mul(2_654_435_761) >> 9) as u16).collect();
        let map = DisplacementMap::new(30, 41, Texels::U16(heights), wrap).unwrap();
        let at = |i: usize| DVec2::new(corners[2 * i], corners[2 * i + 1]);
        let (u, v) = if b[0] + b[1] > 1.0 { (1.0 - b[0], 1.0 - b[1]) } else { (b[0], b[1]) };
        let p = at(0) + u * (at(1) - at(0)) + v * (at(2) - at(0));
        let (low, high) = map.range_over([at(0), at(1), at(2)]);
        let height = map.sample(p).height as f32;
        prop_assert!(height >= low - 1e-6 && height <= high + 1e-6, "{height} outside {low} .. {high}");
    }
}

#[test]
fn the_range_is_tight() {
    let mut heights = vec![0; 100 * 100];
    heights[50 * 100 + 50] = 65535;
    let map = DisplacementMap::new(100, 100, Texels::U16(heights), Wrap::Repeat).unwrap();
    let triangle = |x: f64, y: f64| {
        [
            DVec2::new(x, y),
            DVec2::new(x + 9.0, y),
            DVec2::new(x, y + 9.0),
        ]
    };
    assert_eq!(map.range_over(triangle(45.0, 45.0)), (0.0, 1.0));
    assert_eq!(map.range_over(triangle(445.0, -55.0)), (0.0, 1.0));
    assert_eq!(map.range_over(triangle(52.0, 45.0)), (0.0, 0.0));
    assert_eq!(map.range_over(triangle(41.0, 51.5)), (0.0, 0.0));
}

/// Every texel that [`extent`] says some sample reads, row by row.
fn texels_read(map: &DisplacementMap, corners: [DVec2; 3]) -> HashSet<(usize, usize)> {
    let (width, height) = map.size();
    let (low, high) = bounds(corners);
    let mut texels = HashSet::new();
    for j in (low.y - SLACK).floor() as i64..=(high.y + SLACK).floor() as i64 + 1 {
        let y = j as f64;
        let Some([from, to]) = extent(corners, y - 1.0 - SLACK, y + 1.0 + SLACK) else {
            continue;
        };
        for i in (from - SLACK).floor() as i64..=(to + SLACK).floor() as i64 + 1 {
            texels.insert((map.wrap().texel(i, width), map.wrap().texel(j, height)));
        }
    }
    texels
}

fn noise_map(width: usize, height: usize, wrap: Wrap) -> DisplacementMap {
    let hash = |i: u32| (i.wrapping_mul(2_654_435_761) >> 9) as u16;
    let heights = (0..(width * height) as u32).map(hash).collect();
    DisplacementMap::new(width, height, Texels::U16(heights), wrap).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn the_range_is_that_of_the_texels_read(
        corners in prop::array::uniform6(-1.0f64..1.0), size in prop::array::uniform2(1usize..70),
        scale in prop::sample::select(vec![5.0, 30.0, 70.0]), offset in -70.0..70.0, wrap in 0..3usize,
    ) {
        let wrap = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror][wrap];
        let map = noise_map(size[0], size[1], wrap);
        let corners = [0, 1, 2].map(|i| offset + scale * DVec2::new(corners[2 * i], corners[2 * i + 1]));
        let texels = texels_read(&map, corners);
        let expected = if map.is_covered_by(corners) {
            map.range()
        } else {
            let heights = texels.iter().map(|&(i, j)| map.texels().get(j * map.stride() + i) / 65535.0);
            heights.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), h| (a.min(h), b.max(h)))
        };
        prop_assert_eq!(map.range_over(corners), expected);
        // The same texels matter to edits.
        let (x, y) = (size[0] / 3, size[1] / 2);
        let rect = TexelRect { x, y, width: size[0].div_ceil(5).min(size[0] - x), height: 1 };
        let read = (x..x + rect.width).any(|i| texels.contains(&(i, y)));
        if read {
            prop_assert!(map.overlaps(corners, rect));
        } else if rect.width == 1 && !map.is_covered_by(corners) {
            prop_assert!(!map.overlaps(corners, rect));
        }
    }
}

#[test]
fn degenerate_triangles_have_a_range_too() {
    let map = noise_map(50, 50, Wrap::Mirror);
    let p = DVec2::new(12.3, 45.6);
    for corners in [
        [p; 3],
        [p, p, p + 3.0],
        [p, p + 2.0, p + 7.0],
        [p + 5.0, p, p - DVec2::Y],
    ] {
        let texels = texels_read(&map, corners);
        let heights = texels.iter().map(|&(i, j)| map.texels().get(j * 51 + i));
        let (low, high) = heights.fold((f32::MAX, f32::MIN), |(a, b), h| (a.min(h), b.max(h)));
        assert_eq!(map.range_over(corners), (low / 65535.0, high / 65535.0));
    }
    for odd in [DVec2::NAN, DVec2::INFINITY, DVec2::splat(1e300)] {
        assert_eq!(map.range_over([p, odd, p + 1.0]), map.range());
        let (x, y, width, height) = (0, 0, 1, 1);
        let rect = TexelRect {
            x,
            y,
            width,
            height,
        };
        assert!(map.overlaps([p, odd, p + 1.0], rect));
    }
}
