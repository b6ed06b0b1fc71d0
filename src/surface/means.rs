//! The means of a map: levels of half the size each, for what sees more than a texel at once.
//!
//! Level k holds the means of 2^k x 2^k texels (Williams, "Pyramidal Parametrics", SIGGRAPH 1983). A side of odd length n is halved
//! to m = (n - 1)/2 texels that are n/m of the finer ones wide each, with weights as by area, so that every level has the mean of the
//! whole map; a side of one texel stays. Wrap modes act on each level as on the map.
//!
//! Only level of detail needs them: they are made when prisms first ask, and kept up to date by edits from then on. They hold 16-bit
//! means for 8- and 16-bit maps and floats for float maps: a third of the map's bytes, two thirds of an 8-bit map's. The
//! min/max pyramid is another thing.

use std::sync::PoisonError;

use glam::DVec2;

use super::grid::{HeightGrid, HeightSample};
use super::{DisplacementMap, TexelKind, TexelRect, Texels};

/// Level 1 first; the last is one texel. None for a map of one texel.
#[derive(Debug)]
pub(super) struct Means {
    levels: Box<[HeightGrid]>,
}

impl Means {
    pub fn new(map: &HeightGrid) -> Self {
        let whole = TexelRect {
            x: 0,
            y: 0,
            width: map.width,
            height: map.height,
        };
        let (mut width, mut height) = (map.width, map.height);
        let mut levels = Vec::new();
        while (width, height) != (1, 1) {
            (width, height) = (halved(width), halved(height));
            let zeros = match map.texels.kind() {
                TexelKind::U8 | TexelKind::U16 => Texels::U16(vec![0; width * height]),
                TexelKind::F32 => Texels::F32(vec![0.0; width * height]),
            };
            levels.push(HeightGrid::new(width, height, zeros, map.wrap));
        }
        let means = Self {
            levels: levels.into_boxed_slice(),
        };
        means.update(map, whole);
        means
    }

    /// After texels of `map` in `rect` have changed.
    pub fn update(&self, map: &HeightGrid, mut rect: TexelRect) {
        let mut finer = map;
        for level in &self.levels {
            rect = average(finer, level, rect);
            finer = level;
        }
    }

    pub fn bytes(&self) -> usize {
        self.levels.iter().map(|level| level.texels.bytes()).sum()
    }
}

fn halved(n: usize) -> usize {
    (n / 2).max(1)
}

/// Texels of the finer level, of `n` on a side, that make texel `i`: the first, and the weights of up to three.
fn taps(i: usize, n: usize) -> (usize, [f32; 3]) {
    let (m, per) = (n / 2, 1.0 / n as f32);
    if n == 1 {
        (0, [1.0, 0.0, 0.0])
    } else if n.is_multiple_of(2) {
        (2 * i, [0.5, 0.5, 0.0])
    } else {
        let weights = [m - i, m, i + 1];
        (2 * i, weights.map(|w| w as f32 * per))
    }
}

/// Along a side of `n`, the texels of the next level that are made of some of `start .. start + length`: first and number.
fn made_of(start: usize, length: usize, n: usize) -> (usize, usize) {
    let first = start.saturating_sub(2).div_ceil(2).min(halved(n) - 1);
    let last = ((start + length - 1) / 2).min(halved(n) - 1);
    (first, last - first + 1)
}

/// Makes what is above `rect` of the finer level anew, and says where that is.
fn average(finer: &HeightGrid, level: &HeightGrid, rect: TexelRect) -> TexelRect {
    let (x, width) = made_of(rect.x, rect.width, finer.width);
    let (y, height) = made_of(rect.y, rect.height, finer.height);
    let to_unit = level.texels.kind().unit() / finer.texels.kind().unit();
    let start = taps(x, finer.width).0;
    let mut row = vec![0.0; finer.width.min(start + 2 * width + 1) - start];
    let mut sums = vec![0.0; row.len()];
    for y in y..y + height {
        let (first, weights) = taps(y, finer.height);
        sums.fill(0.0);
        for (j, weight) in (first..finer.height).zip(weights) {
            finer.texels.copy(j * finer.stride() + start, &mut row);
            for (sum, h) in sums.iter_mut().zip(&row) {
                *sum += weight * h;
            }
        }
        let means = (x..x + width).map(|i| {
            let (first, weights) = taps(i, finer.width);
            let run = sums[first - start..].iter().zip(weights);
            to_unit * run.map(|(h, weight)| weight * h).sum::<f32>()
        });
        let means = match level.texels.kind() {
            TexelKind::F32 => Texels::F32(means.collect()),
            _ => Texels::U16(means.map(|h| (h + 0.5) as u16).collect()),
        };
        let line = TexelRect {
            x,
            y,
            width,
            height: 1,
        };
        level.write(&means, line);
    }
    TexelRect {
        x,
        y,
        width,
        height,
    }
}

impl DisplacementMap {
    /// Makes the means, if there are none yet: [`Self::averaged`] needs them. They take a third of the map's bytes (two thirds for
    /// 8-bit maps) beside the pyramid's twelfth, and edits keep them up to date.
    pub fn build_means(&self) {
        // No edit meanwhile, or it would be lost.
        let _alone = self.editing.lock().unwrap_or_else(PoisonError::into_inner);
        self.means.get_or_init(|| Means::new(&self.grid));
    }

    /// Bytes of the means; 0 as long as no one has asked for them.
    pub fn mean_bytes(&self) -> usize {
        self.means.get().map_or(0, Means::bytes)
    }

    /// Height and gradient around texel coordinates `p`, averaged over about `width` texels; `None` where that is no more
    /// than the one that smooth normals are taken over, or where there are no means.
    ///
    /// A central difference over two texels of a level is the mean slope between them, so levels are chosen by half the
    /// width, and two of them blended.
    pub fn averaged(&self, p: DVec2, width: f64) -> Option<HeightSample> {
        let levels = &self.means.get()?.levels;
        if width.is_nan() || width <= 1.0 || levels.is_empty() {
            return None;
        }
        if width <= 2.0 {
            return Some(self.grid.smooth(p, width));
        }
        let level = (0.5 * width).log2().min(levels.len() as f64);
        let finer = level.floor();
        let sample = |k: usize| match k.checked_sub(1) {
            None => self.grid.smooth(p, 2.0),
            Some(k) => self.smooth_on(&levels[k], p),
        };
        let (a, part) = (sample(finer as usize), level - finer);
        if part == 0.0 {
            return Some(a);
        }
        let b = sample(finer as usize + 1);
        Some(HeightSample {
            height: a.height + part * (b.height - a.height),
            gradient: a.gradient + part * (b.gradient - a.gradient),
        })
    }

    /// [`HeightGrid::smooth`] of a level, in texels of the map.
    fn smooth_on(&self, level: &HeightGrid, p: DVec2) -> HeightSample {
        let per = DVec2::new(
            level.width as f64 / self.grid.width as f64,
            level.height as f64 / self.grid.height as f64,
        );
        let sample = level.smooth((p + 0.5) * per - 0.5, 2.0);
        HeightSample {
            gradient: sample.gradient * per,
            ..sample
        }
    }
}

#[cfg(test)]
mod tests;
