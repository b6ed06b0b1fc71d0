//! The range of heights under one triangle: every texel that a bilinear sample inside it can read.
//!
//! Samples within one texel of texel (i, j), in both directions, read it. So the texels are the integer points in the
//! sum of the triangle and a square of half side 1 (and some slack): a convex region, here one copy of it for each
//! repeat of the map that the triangle meets. Blocks of the pyramid that lie inside are taken whole, blocks outside are
//! dropped, others cut up, down to texels; and what cannot widen the range any more is not looked into at all.

mod region;

use std::ops::RangeInclusive;

use glam::DVec2;

use super::{DisplacementMap, Level, TexelRect, Wrap};
use region::{Meets, Region, extent};

/// Texels of slack around the triangle, against rounding of whoever samples.
const SLACK: f64 = 0.05;

impl DisplacementMap {
    /// Smallest and largest height that samples in a triangle of texel coordinates can have, to the texel; the whole
    /// map's where the triangle covers about as much. The time is that of the triangle's outline, not of its area.
    pub fn range_over(&self, corners: [DVec2; 3]) -> (f32, f32) {
        if self.is_covered_by(corners) {
            return self.range();
        }
        let mut found = Found::new(self);
        for region in self.regions(corners) {
            found.take(&region);
        }
        if self.wrap() == Wrap::Clamp {
            found.take_edges(corners);
        }
        let unit = self.unit();
        match found.range {
            Some((low, high)) => (low / unit, high / unit),
            None => self.range(),
        }
    }

    /// Whether samples in a triangle of texel coordinates can read a texel of `rect`: whether an edit there can change
    /// [`Self::range_over`] of it or anything seen inside it.
    pub fn overlaps(&self, corners: [DVec2; 3], rect: TexelRect) -> bool {
        if self.is_covered_by(corners) {
            return true;
        }
        let (width, height) = self.size();
        let (mut low, mut high) = ([rect.x as f64, rect.y as f64], [0.0; 2]);
        high[0] = (rect.x + rect.width) as f64 - 1.0;
        high[1] = (rect.y + rect.height) as f64 - 1.0;
        if self.wrap() == Wrap::Clamp {
            // Edge texels go on for ever.
            for (k, last) in [(0, width - 1), (1, height - 1)] {
                if low[k] == 0.0 {
                    low[k] = f64::NEG_INFINITY;
                }
                if high[k] >= last as f64 {
                    high[k] = f64::INFINITY;
                }
            }
            let region = Region::new(corners);
            let (low, high) = (DVec2::from(low), DVec2::from(high));
            // Of the infinite part only what the triangle reaches.
            let (low, high) = (low.max(region.low), high.min(region.high));
            return low.cmple(high).all() && region.meets(low, high) != Meets::Outside;
        }
        self.regions(corners)
            .any(|region| region.meets(low.into(), high.into()) != Meets::Outside)
    }

    /// A triangle whose bounds have the map's area or more, or are no numbers.
    fn is_covered_by(&self, corners: [DVec2; 3]) -> bool {
        let (low, high) = bounds(corners);
        let (width, height) = self.size();
        let covers = (high - low + 2.0).element_product() > (width * height) as f64;
        covers || corners.iter().any(|p| !p.is_finite())
    }

    /// The triangle's region as it lies over each repeat of the map that it meets, in stored texels.
    fn regions(&self, corners: [DVec2; 3]) -> impl Iterator<Item = Region> {
        let (width, height) = self.size();
        let (low, high) = bounds(corners);
        let reach = DVec2::splat(1.0 + SLACK);
        let (low, high) = ((low - reach).floor(), (high + reach).ceil());
        let xs = repeats(self.wrap(), low.x, high.x, width);
        let ys = repeats(self.wrap(), low.y, high.y, height);
        ys.flat_map(move |y| {
            xs.clone().map(move |x| {
                Region::new(corners.map(|p| {
                    DVec2::new(
                        unfolded_from(self.wrap(), p.x, x, width),
                        unfolded_from(self.wrap(), p.y, y, height),
                    )
                }))
            })
        })
    }
}

/// The repeats of a side of `n` texels that coordinates `low..=high` meet.
fn repeats(wrap: Wrap, low: f64, high: f64, n: usize) -> RangeInclusive<i64> {
    match wrap {
        Wrap::Clamp => 0..=0,
        Wrap::Repeat | Wrap::Mirror => {
            (low / n as f64).floor() as i64..=(high / n as f64).floor() as i64
        }
    }
}

/// Coordinate `x` in the frame of the stored map that repeat `k` is a copy of.
fn unfolded_from(wrap: Wrap, x: f64, k: i64, n: usize) -> f64 {
    let x = x - k as f64 * n as f64;
    if wrap == Wrap::Mirror && k.rem_euclid(2) == 1 {
        n as f64 - 1.0 - x
    } else {
        x
    }
}

fn bounds(corners: [DVec2; 3]) -> (DVec2, DVec2) {
    let first = (corners[0], corners[0]);
    corners
        .iter()
        .fold(first, |(a, b), &p| (a.min(p), b.max(p)))
}

/// The search for a range.
struct Found<'m> {
    map: &'m DisplacementMap,
    /// As stored.
    range: Option<(f32, f32)>,
    /// Blocks to look into, and those of the next level.
    blocks: Vec<(usize, usize)>,
    next: Vec<(usize, usize)>,
}

impl<'m> Found<'m> {
    fn new(map: &'m DisplacementMap) -> Self {
        Self {
            map,
            range: None,
            blocks: Vec::new(),
            next: Vec::new(),
        }
    }

    fn include(&mut self, (low, high): (f32, f32)) {
        let (a, b) = self.range.unwrap_or((low, high));
        self.range = Some((a.min(low), b.max(high)));
    }

    fn has(&self, (low, high): (f32, f32)) -> bool {
        self.range.is_some_and(|(a, b)| a <= low && high <= b)
    }

    /// Includes texels `i` of row `j`.
    fn include_run(&mut self, i: RangeInclusive<usize>, j: usize) {
        let row = j * self.map.stride();
        if let Some(range) = self.map.texels().range(row + i.start()..row + i.end() + 1) {
            self.include(range);
        }
    }

    /// Includes the stored texels in `region`, from coarse blocks to fine ones: on each level first what is taken whole,
    /// so that less of the rest is worth a look.
    fn take(&mut self, region: &Region) {
        /// Texels across and up for which blocks are not worth their while.
        const SMALL: f64 = 24.0;
        let (width, height) = self.map.size();
        let last = DVec2::new(width as f64 - 1.0, height as f64 - 1.0);
        let low = region.low.ceil().max(DVec2::ZERO);
        let high = region.high.floor().min(last);
        if !low.cmple(high).all() {
            return; // beside the map
        }
        if (high - low).max_element() < SMALL {
            let (is, js) = ([low.x, high.x], low.y as usize..=high.y as usize);
            return self.take_texels(region, is, js);
        }
        let levels = self.map.pyramid().levels();
        let mut top = self.start(low, high);
        loop {
            let level = &levels[top];
            let mut blocks = std::mem::take(&mut self.blocks);
            blocks.retain(|&block| self.is_undecided(region, level, block));
            blocks.retain(|&(i, j)| !self.has(level.get(i, j)));
            if top == 0 {
                blocks
                    .drain(..)
                    .for_each(|b| self.take_block(region, level, b));
                self.blocks = blocks;
                return;
            }
            top -= 1;
            let finer = &levels[top];
            self.next.clear();
            for (i, j) in blocks.drain(..) {
                for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)].map(|d| (2 * i + d.0, 2 * j + d.1)) {
                    if i < finer.width() && j < finer.height() {
                        self.next.push((i, j));
                    }
                }
            }
            self.blocks = std::mem::replace(&mut self.next, blocks);
        }
    }

    /// Lists the blocks that texels `low..=high` are in on the finest level where they are few; returns the level.
    fn start(&mut self, low: DVec2, high: DVec2) -> usize {
        let levels = self.map.pyramid().levels();
        let sides = (high - low).to_array().map(|side| side as usize);
        let fits = |level: &Level| {
            let [across, up] = level.shift();
            sides[0] >> across <= 1 && sides[1] >> up <= 1
        };
        let top = levels.iter().position(fits).unwrap_or(levels.len() - 1);
        let [across, up] = levels[top].shift();
        let (left, right) = (low.x as usize >> across, high.x as usize >> across);
        self.blocks.clear();
        for j in low.y as usize >> up..=high.y as usize >> up {
            self.blocks.extend((left..=right).map(|i| (i, j)));
        }
        top
    }

    /// Takes the block's entry if its texels are all in the region; otherwise tells whether some can be.
    fn is_undecided(&mut self, region: &Region, level: &Level, (i, j): (usize, usize)) -> bool {
        let (width, height) = self.map.size();
        let reach = DVec2::from(level.block().map(|side| side as f64));
        let low = DVec2::new(i as f64, j as f64) * reach;
        match region.meets(low, low + reach - 1.0) {
            Meets::Outside => return false,
            Meets::Partly => return true,
            Meets::Inside => {}
        }
        // Across the map's edge only the finest entries are exact.
        let high = low + reach;
        let exact = level.shift() == self.map.pyramid().levels()[0].shift()
            || (high.x < width as f64 && high.y < height as f64);
        if exact && region.meets(low, high) == Meets::Inside {
            self.include(level.get(i, j));
            return false;
        }
        true
    }

    /// A finest block texel by texel, unless that is no use any more.
    fn take_block(&mut self, region: &Region, level: &Level, (i, j): (usize, usize)) {
        if self.has(level.get(i, j)) {
            return;
        }
        let (width, height) = self.map.size();
        let [across, up] = level.block();
        let columns = [i * across, width.min((i + 1) * across) - 1].map(|i| i as f64);
        let rows = j * up..=height.min((j + 1) * up) - 1;
        self.take_texels(region, columns, rows);
    }

    /// The texels of a rectangle inside the map, given by first and last column and by rows, that are in the region.
    fn take_texels(
        &mut self,
        region: &Region,
        [first, last]: [f64; 2],
        rows: RangeInclusive<usize>,
    ) {
        for j in rows {
            let [from, to] = region.row(j as f64);
            let (from, to) = (from.ceil().max(first), to.floor().min(last));
            if from <= to {
                self.include_run(from as usize..=to as usize, j);
            }
        }
    }

    /// What a triangle that leaves a clamped map reads beyond its edges: edge texels.
    fn take_edges(&mut self, corners: [DVec2; 3]) {
        let (width, height) = self.map.size();
        let (last_column, last_row) = ((width - 1) as f64, (height - 1) as f64);
        let (low, high) = bounds(corners);
        let reach = 1.0 + SLACK;
        let columns = |[from, to]: [f64; 2]| {
            let (first, last) = ((from - SLACK).floor(), (to + SLACK).floor() + 1.0);
            [first, last].map(|x| x.clamp(0.0, last_column) as usize)
        };
        // Rows below the first one read it, rows above the last one that.
        for (from, to, j) in [
            (f64::NEG_INFINITY, -1.0 + reach, 0),
            (last_row + 1.0 - reach, f64::INFINITY, height - 1),
        ] {
            if let Some([first, last]) = extent(corners, from, to).map(columns) {
                self.include_run(first..=last, j);
            }
        }
        if low.x - reach >= 0.0 && high.x + reach <= last_column {
            return;
        }
        let rows = [low.y - reach, high.y + reach].map(|y| y.clamp(0.0, last_row));
        for j in rows[0] as usize..=rows[1] as usize {
            let Some([from, to]) = extent(corners, j as f64 - reach, j as f64 + reach) else {
                continue;
            };
            if (from - SLACK).floor() < 0.0 {
                self.include_run(0..=0, j);
            }
            if (to + SLACK).floor() + 1.0 > last_column {
                self.include_run(width - 1..=width - 1, j);
            }
        }
    }
}

#[cfg(test)]
mod tests;
