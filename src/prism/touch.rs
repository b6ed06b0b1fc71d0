//! What can read a rectangle of texels: a few comparisons instead of [`DisplacementMap::overlaps`], and no look at all at most of
//! a large mesh.

use std::ops::Range;

use glam::DVec2;

use crate::surface::{DisplacementMap, TexelBox, TexelRect, Wrap};

/// Where in texel coordinates samples read a rectangle of texels.
pub struct Touch {
    /// Across and up.
    axes: [Along; 2],
}

/// The same along one axis: intervals of texel coordinates, again in every period.
struct Along {
    intervals: [[f64; 2]; 2],
    period: f64,
}

/// Texels from a texel within which samples read it, with slack.
const REACH: f64 = 1.25;

impl Touch {
    pub fn new(map: &DisplacementMap, rect: TexelRect) -> Self {
        let (width, height) = map.size();
        Self {
            axes: [
                Along::new(map.wrap(), rect.x, rect.width, width),
                Along::new(map.wrap(), rect.y, rect.height, height),
            ],
        }
    }

    /// Whether no sample within a box can read the rectangle.
    #[inline]
    pub fn misses(&self, TexelBox { low, high }: &TexelBox) -> bool {
        self.axes[0].misses(low.x, high.x) || self.axes[1].misses(low.y, high.y)
    }
}

impl Along {
    /// Texels `first..first + count` of a side of `n`.
    fn new(wrap: Wrap, first: usize, count: usize, n: usize) -> Self {
        let low = first as f64 - REACH;
        let high = (first + count) as f64 - 1.0 + REACH;
        let side = n as f64;
        match wrap {
            Wrap::Repeat => Self {
                intervals: [[low, high]; 2],
                period: side,
            },
            // Backwards in every second map.
            Wrap::Mirror => {
                let last = 2.0 * side - 1.0;
                Self {
                    intervals: [[low, high], [last - high, last - low]],
                    period: 2.0 * side,
                }
            }
            // Edge texels go on for ever.
            Wrap::Clamp => {
                /// Further than any coordinate, and no infinity, which would make NaNs.
                const EVER: f64 = 1e300;
                let low = if first == 0 { -EVER } else { low };
                let high = if first + count == n { EVER } else { high };
                Self {
                    intervals: [[low, high]; 2],
                    period: f64::MAX,
                }
            }
        }
    }

    /// Whether no period's interval meets `low..=high`: the last one that does not begin beyond `high` ends before `low`.
    #[inline]
    fn misses(&self, low: f64, high: f64) -> bool {
        /// Rounding of coordinates, relative to their size.
        const ROUNDING: f64 = 16.0 * f64::EPSILON;
        let margin = |x: f64| {
            if x.is_finite() {
                ROUNDING * x.abs()
            } else {
                0.0
            }
        };
        let (low, high) = (low - margin(low), high + margin(high));
        self.intervals.iter().all(|&[from, to]| {
            let last = ((high - from) / self.period).floor() * self.period;
            to + last < low
        })
    }
}

/// The box around a triangle of texel coordinates; everywhere where one is no number.
pub fn around([a, b, c]: [DVec2; 3]) -> TexelBox {
    if (a + b + c).is_finite() {
        TexelBox {
            low: a.min(b).min(c),
            high: a.max(b).max(c),
        }
    } else {
        TexelBox::EVERYWHERE
    }
}

/// Holds no texel.
pub const NOWHERE: TexelBox = TexelBox {
    low: DVec2::INFINITY,
    high: DVec2::NEG_INFINITY,
};

/// The box around two.
pub fn union(a: &TexelBox, b: &TexelBox) -> TexelBox {
    TexelBox {
        low: a.low.min(b.low),
        high: a.high.max(b.high),
    }
}

/// Boxes over groups of what reads the map, in the order of its numbers, and over groups of these: neighbours read nearby texels.
pub struct TouchIndex {
    /// What is numbered.
    count: usize,
    groups: Vec<TexelBox>,
    groups_of_groups: Vec<TexelBox>,
}

/// Members of a group.
const GROUP: usize = 64;

impl TouchIndex {
    /// Of `count` things, of which `reads` tells where they read the map.
    pub fn new(count: usize, reads: impl Fn(u32) -> TexelBox) -> Self {
        let groups: Vec<TexelBox> = (0..count.div_ceil(GROUP))
            .map(|group| {
                members(group, count).fold(NOWHERE, |all, index| union(&all, &reads(index as u32)))
            })
            .collect();
        let over = |groups: &[TexelBox]| groups.iter().fold(NOWHERE, |all, one| union(&all, one));
        let groups_of_groups = groups.chunks(GROUP).map(over).collect();
        Self {
            count,
            groups,
            groups_of_groups,
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.groups[..]) + size_of_val(&self.groups_of_groups[..])
    }

    /// What may read a rectangle, ascending: all of every group that may.
    pub fn candidates(&self, touch: &Touch) -> impl Iterator<Item = u32> {
        let tops = self.groups_of_groups.iter().enumerate();
        let tops = tops.filter(|(_, top)| !touch.misses(top));
        tops.flat_map(|(top, _)| members(top, self.groups.len()))
            .filter(|&group| !touch.misses(&self.groups[group]))
            .flat_map(|group| members(group, self.count))
            .map(|index| index as u32)
    }
}

/// The members of a group, of `count` in all.
fn members(group: usize, count: usize) -> Range<usize> {
    GROUP * group..(GROUP * (group + 1)).min(count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Texels;
    use glam::Vec2;

    /// What is left out must not overlap, and little else may stay.
    #[test]
    fn triangles_that_are_left_out_do_not_read_the_rectangle() {
        let mut state = 1u32;
        let mut random = || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            let x = state ^ (state >> 16);
            (x.wrapping_mul(0x9e37_79b9) >> 8) as f32 / (1 << 24) as f32
        };
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            let (width, height) = (37, 53);
            let texels = Texels::U8(vec![0; width * height]);
            let map = DisplacementMap::new(width, height, texels, wrap).unwrap();
            let (mut kept, mut touched) = (0, 0);
            for _ in 0..20_000 {
                let x = (random() * width as f32) as usize;
                let y = (random() * height as f32) as usize;
                let rect = TexelRect {
                    x,
                    y,
                    width: 1 + (random().powi(3) * (width - x) as f32) as usize,
                    height: 1 + (random().powi(3) * (height - y) as f32) as usize,
                };
                let reach = if random() < 0.1 { 1000.0 } else { 2.0 };
                let centre = reach * (Vec2::new(random(), random()) - 0.5);
                let corners =
                    [(); 3].map(|()| centre + 0.2 * (Vec2::new(random(), random()) - 0.5));
                let texels = corners.map(|st| map.to_texel(st.as_dvec2()));
                let overlaps = map.overlaps(texels, rect);
                let misses = Touch::new(&map, rect).misses(&around(texels));
                assert!(!(overlaps && misses), "{wrap:?} {rect} {corners:?}");
                kept += u32::from(!misses);
                touched += u32::from(overlaps);
            }
            assert!(kept < 2 * touched, "{wrap:?}: {kept} for {touched}");
            let rect = TexelRect {
                x: 3,
                y: 4,
                width: 1,
                height: 1,
            };
            let touch = Touch::new(&map, rect);
            assert!(!touch.misses(&around([DVec2::NAN; 3])));
            assert!(touch.misses(&NOWHERE));
            assert!(map.overlaps([DVec2::NAN; 3], rect));
        }
    }

    /// Texel by texel: what a box of whole cells reads is found, and what is two texels off is not.
    #[test]
    fn whole_cells_are_found_through_every_wrap() {
        let n = 13;
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for first in 0..n {
                for count in 1..=n - first {
                    let along = Along::new(wrap, first, count, n);
                    let reads = |low: i64, high: i64| {
                        let mut texels = (low..=high).map(|i| wrap.texel(i, n));
                        texels.any(|i| (first..first + count).contains(&i))
                    };
                    for low in -40i64..40 {
                        for cells in [1, 5] {
                            let high = low + cells;
                            let misses = along.misses(low as f64, high as f64);
                            assert!(!(misses && reads(low, high)), "{wrap:?} {low}");
                            assert!(misses || reads(low - 2, high + 2), "{wrap:?} {low}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn an_index_leaves_out_only_what_does_not_touch() {
        let map = DisplacementMap::new(1000, 1000, Texels::U8(vec![0; 1_000_000]), Wrap::Repeat);
        let map = map.unwrap();
        for count in [0, 1, 63, 64, 65, 4096, 10_000] {
            // Rows of a hundred.
            let reads = |index: u32| {
                let low = 10.0 * DVec2::new(f64::from(index % 100), f64::from(index / 100));
                TexelBox {
                    low,
                    high: low + 10.0,
                }
            };
            let index = TouchIndex::new(count, reads);
            for (x, y) in [(0, 0), (505, 3), (990, 990), (333, 777)] {
                let rect = TexelRect {
                    x,
                    y,
                    width: 10,
                    height: 10,
                };
                let touch = Touch::new(&map, rect);
                let found: Vec<u32> = index.candidates(&touch).collect();
                assert!(found.is_sorted() && found.len() <= 9 * GROUP);
                let missed = |&i: &u32| !touch.misses(&reads(i)) && !found.contains(&i);
                assert_eq!((0..count as u32).find(missed), None);
            }
        }
    }
}
