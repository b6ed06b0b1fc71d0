//! The range of heights in a box of texel coordinates, in a few look-ups.

use std::ops::RangeInclusive;

use glam::DVec2;

use crate::surface::{DisplacementMap, Level, Wrap};

/// Texels of slack around a box, against rounding of whoever samples.
const SLACK: f64 = 0.01;

/// Boxes up to this side are looked up texel by texel.
const SMALL: f64 = 2.0;

impl DisplacementMap {
    /// Smallest and largest height that samples in the box from `low` to `high` (texel coordinates) can have; of a box of more than
    /// [`SMALL`] texels that of blocks around it, which reach less than twice the box's longest side, or a finest block, too far.
    pub(crate) fn range_in_box(&self, low: DVec2, high: DVec2) -> (f32, f32) {
        let (low, high) = (low - SLACK, high + SLACK);
        if (high - low).max_element() <= SMALL {
            self.range_of_texels(low.floor(), high.floor() + 1.0)
        } else {
            self.range_of_blocks(low, high)
        }
    }

    fn range_of_texels(&self, first: DVec2, last: DVec2) -> (f32, f32) {
        let mut range = (f32::INFINITY, f32::NEG_INFINITY);
        // Counted: far out a coordinate is its own successor.
        let count = last - first;
        for j in 0..=count.y as usize {
            for i in 0..=count.x as usize {
                let at = first + DVec2::new(i as f64, j as f64);
                let height = self.sample(at).height as f32;
                range = (range.0.min(height), range.1.max(height));
            }
        }
        range
    }

    /// The blocks that the box meets, on the finest level on which they have half its sides.
    fn range_of_blocks(&self, low: DVec2, high: DVec2) -> (f32, f32) {
        let levels = self.pyramid.levels();
        let half = 0.5 * (high - low);
        let is_held = |level: &&Level| {
            let [across, up] = level.block().map(|side| side as f64);
            half.x <= across && half.y <= up
        };
        let level = levels.iter().find(is_held);
        let level = level.unwrap_or(&levels[levels.len() - 1]);
        let (width, height) = self.size();
        let [across, up] = level.block();
        let blocks = |low: f64, high: f64, n: usize, side: usize| {
            images(self.wrap(), low, high, n as f64).map(|image| {
                image.map(|[a, b]| -> RangeInclusive<usize> {
                    let [a, b] = [a, b].map(|x| (x as usize).min(n - 1) / side);
                    a..=b
                })
            })
        };
        let columns = blocks(low.x, high.x, width, across);
        let rows = blocks(low.y, high.y, height, up);
        let mut range = (f32::INFINITY, f32::NEG_INFINITY);
        for j in rows.into_iter().flatten().flatten() {
            for i in columns.iter().flatten().cloned().flatten() {
                let (low, high) = level.get(i, j);
                range = (range.0.min(low), range.1.max(high));
            }
        }
        (range.0 / self.unit(), range.1 / self.unit())
    }
}

/// The one or two parts of a side of n texels, [0, n], that low..=high folds onto.
fn images(wrap: Wrap, low: f64, high: f64, n: f64) -> [Option<[f64; 2]>; 2] {
    let ((first, before), (last, behind)) = (wrap.fold(low, n), wrap.fold(high, n));
    let length = high - low;
    let all = [0.0, n];
    match wrap {
        Wrap::Clamp => [Some([first, last]), None],
        // A period or more, or no number.
        _ if length >= n || length.is_nan() => [Some(all), None],
        Wrap::Repeat if first + length <= n => [Some([first, first + length]), None],
        Wrap::Repeat => [Some([first, n]), Some([0.0, first + length - n])],
        // Turned over at one of the edges, or at none.
        Wrap::Mirror => {
            let low_edge = before < 0.0 && behind > 0.0;
            let high_edge = before > 0.0 && behind < 0.0;
            let low = if low_edge { 0.0 } else { first.min(last) };
            let high = if high_edge { n } else { first.max(last) };
            [Some([low, high]), None]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Texels;

    #[test]
    fn boxes_hold_all_that_is_sampled_in_them() {
        let mut state = 1u64;
        let mut number = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(99);
            (state >> 33) as f64 / (1u64 << 31) as f64
        };
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            for (width, height) in [(1, 1), (3, 7), (16, 16), (37, 50), (100, 9)] {
                let texels = (0..width * height).map(|_| (number() * 65535.0) as u16);
                let texels = Texels::U16(texels.collect());
                let map = DisplacementMap::new(width, height, texels, wrap).unwrap();
                for _ in 0..400 {
                    let low = 400.0 * DVec2::new(number() - 0.5, number() - 0.5);
                    let size = 10f64.powf(3.0 * number() - 1.0) * DVec2::new(number(), number());
                    let (least, most) = map.range_in_box(low, low + size);
                    for _ in 0..40 {
                        let at = low + size * DVec2::new(number(), number());
                        let found = map.sample(at).height as f32;
                        let held = found >= least - 1e-6 && found <= most + 1e-6;
                        assert!(held, "{wrap:?} {width}x{height} {low} {size} {at}");
                    }
                }
            }
        }
    }

    #[test]
    fn boxes_are_not_much_too_wide() {
        let mut texels = vec![0.0; 256 * 256];
        texels[128 * 256 + 128] = 1.0;
        let map = DisplacementMap::new(256, 256, Texels::F32(texels), Wrap::Repeat).unwrap();
        let around =
            |x: f64, side: f64| map.range_in_box(DVec2::splat(x), DVec2::splat(x + side)).1;
        assert_eq!([around(126.5, 1.9), around(124.0, 1.9)], [1.0, 0.0]);
        assert_eq!([around(100.0, 40.0), around(60.0, 30.0)], [1.0, 0.0]);
    }
}
