//! Which triangles can have texels of a rectangle under them: a few comparisons instead of
//! [`DisplacementMap::overlaps`], for most of a large mesh.

use crate::surface::{DisplacementMap, TexelRect, Wrap};

/// Where in texture space samples read a rectangle of texels.
pub struct Touch {
    /// Across and up.
    axes: [Along; 2],
}

/// The same along one axis: intervals of texture coordinates, again in every period.
struct Along {
    intervals: [[f32; 2]; 2],
    period: f32,
}

/// Texels from a texel within which samples read it, with slack.
const REACH: f64 = 1.25;

/// Rounding of coordinates, relative to their size.
const ROUNDING: f32 = 16.0 * f32::EPSILON;

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

    /// Whether no sample within a box of texture coordinates ([low, high] across and up) can read the rectangle. Never for a
    /// box of NaNs.
    #[inline]
    pub fn misses(&self, [across, up]: [[f32; 2]; 2]) -> bool {
        self.axes[0].misses(across) || self.axes[1].misses(up)
    }
}

impl Along {
    /// Texels `first..first + count` of a side of `n`.
    fn new(wrap: Wrap, first: usize, count: usize, n: usize) -> Self {
        // Centre i is at (i + 0.5) / n.
        let place = |texel: f64| ((texel + 0.5) / n as f64) as f32;
        let low = place(first as f64 - REACH);
        let high = place((first + count) as f64 - 1.0 + REACH);
        /// Further than any coordinate, and no infinity, which would make NaNs.
        const EVER: f32 = 1e30;
        match wrap {
            Wrap::Repeat => Self {
                intervals: [[low, high]; 2],
                period: 1.0,
            },
            // Backwards in every second map.
            Wrap::Mirror => Self {
                intervals: [[low, high], [2.0 - high, 2.0 - low]],
                period: 2.0,
            },
            // Edge texels go on for ever.
            Wrap::Clamp => {
                let low = if first == 0 { -EVER } else { low };
                let high = if first + count == n { EVER } else { high };
                Self {
                    intervals: [[low, high]; 2],
                    period: f32::MAX,
                }
            }
        }
    }

    /// Whether no period's interval meets `low..=high`: the last one that does not begin beyond `high` ends before `low`.
    #[inline]
    fn misses(&self, [low, high]: [f32; 2]) -> bool {
        let margin = ROUNDING * (low.abs() + high.abs() + 1.0);
        let (low, high) = (low - margin, high + margin);
        self.intervals.iter().all(|&[from, to]| {
            let last = ((high - from) / self.period).floor() * self.period;
            to + last < low
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Texels;
    use glam::{DVec2, Vec2};

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
                let overlaps = map.overlaps(corners.map(|st| map.to_texel(st.as_dvec2())), rect);
                let misses = Touch::new(&map, rect).misses(super::super::edits::around(corners));
                assert!(!(overlaps && misses), "{wrap:?} {rect} {corners:?}");
                kept += u32::from(!misses);
                touched += u32::from(overlaps);
            }
            assert!(kept < 2 * touched, "{wrap:?}: {kept} for {touched}");
            let nowhere = [[f32::NAN; 2]; 2];
            let rect = TexelRect {
                x: 3,
                y: 4,
                width: 1,
                height: 1,
            };
            assert!(!Touch::new(&map, rect).misses(nowhere));
            assert!(map.overlaps([DVec2::NAN; 3], rect));
        }
    }
}
