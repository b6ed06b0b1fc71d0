//! The min/max pyramid over a displacement map: what a block of the map holds at least and at most.
//!
//! The finest blocks are 8 cells across and 4 up (cell (i, j) is the square between the centres of texels i, i+1 and j, j+1), those
//! of the next level 16x8, and so on: A x B = 8x4, 16x8, 32x16, ... Entry (I, J) is the range of all texels of columns
//! A I ..= A I + A and rows B J ..= B J + B: all that bilinear interpolation reads in the block, edges included. So **any box of
//! texel coordinates of at most A x B is covered by the four entries of the blocks that its corners lie in.**
//!
//! Columns and rows beyond the edge are those of the wrap mode: the first ones for repeat, the last one for clamp, the
//! last ones backwards for mirror. A box that begins at x *after folding* (for mirror, where the lower of its folded ends is; at
//! 0 where it reaches below 0) and goes on for l ends in the block of x + l. Beyond the last block that is the first one
//! for repeat, which the last one reaches up to; else the last.
//!
//! Levels go on until one entry is left; its block is at least as large as the map, so it covers everything.
//! Entries are exact but for coarser ones that reach across an edge where the map goes on out of step with the blocks
//! (repeat: a side that is not a multiple of the block's; mirror): they hold less than one block too much.
//!
//! The pairs take 2/32 of the map's bytes on the finest level and 1/12 in all, at most 1/9 for maps of at least
//! 64x64 texels.

mod around;
mod axis;
mod build;
mod entries;
mod reduce;

use std::sync::Arc;

use axis::Axis;
pub(crate) use entries::Entries;

use super::{Texels, Wrap};

/// The pyramid of one map, finest level first. Edits of the map keep it up to date.
#[derive(Debug)]
pub struct Pyramid {
    levels: Box<[Level]>,
    /// The finest level's sides.
    axes: [Axis; 2],
}

/// One level: the ranges of blocks of one size.
#[derive(Debug)]
pub struct Level {
    shift: [u32; 2],
    width: usize,
    height: usize,
    /// Where the level's entries begin among those of all, and their order there.
    offset: usize,
    order: Order,
    entries: Arc<Entries>,
}

impl Level {
    /// log2 of the block's sides in cells, across and up: 3 and 2 for the finest level.
    pub fn shift(&self) -> [u32; 2] {
        self.shift
    }

    /// The block's sides in cells, across and up: 8 and 4 for the finest level.
    pub fn block(&self) -> [usize; 2] {
        self.shift.map(|shift| 1 << shift)
    }

    /// Blocks across: the map's width by the block's, rounded up.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Blocks up: the map's height by the block's, rounded up.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Smallest and largest texel of columns a i ..= a i + a and rows b j ..= b j + b, for blocks of a x b cells, as stored:
    /// 0..=255, 0..=65535 or heights (see [`DisplacementMap::unit`](super::DisplacementMap::unit)).
    ///
    /// # Panics
    ///
    /// If `i` or `j` is not below the level's width or height.
    #[inline]
    pub fn get(&self, i: usize, j: usize) -> (f32, f32) {
        self.entries.get(self.index(i, j))
    }

    /// The pairs of all levels as stored, level by level: see [`Order`].
    pub(crate) fn entries(&self) -> &Entries {
        &self.entries
    }

    /// Where the pairs of tile (i, j) of 32x32 cells begin in [`Self::entries`]; of the two finest levels.
    #[inline(always)]
    pub(crate) fn tile(&self, i: usize, j: usize) -> usize {
        self.offset + self.order.tile(i, j)
    }

    #[inline]
    fn index(&self, i: usize, j: usize) -> usize {
        assert!(i < self.width && j < self.height, "block outside the map");
        self.offset + self.order.index(i, j)
    }
}

/// The order of a level's pairs.
///
/// Those of the two finest levels are kept by tiles of 32x32 cells, which a block of the exact march reads at once: eight pairs of the second level, row by row, two
/// across; and 32 of the finest, four and four, as the second level's are made of them.
#[derive(Clone, Copy, Debug)]
enum Order {
    /// Tiles across.
    Fours(usize),
    Eights(usize),
    /// Pairs across.
    Rows(usize),
}

impl Order {
    /// Of level `level`, so many pairs across and up; and how many are stored.
    fn new(level: usize, width: usize, height: usize) -> (Self, usize) {
        match level {
            0 => {
                let tiles = width.div_ceil(4);
                (Self::Fours(tiles), 32 * tiles * height.div_ceil(8))
            }
            1 => {
                let tiles = width.div_ceil(2);
                (Self::Eights(tiles), 8 * tiles * height.div_ceil(4))
            }
            _ => (Self::Rows(width), width * height),
        }
    }

    #[inline(always)]
    fn tile(self, i: usize, j: usize) -> usize {
        match self {
            Self::Fours(tiles) => 32 * (j * tiles + i),
            Self::Eights(tiles) => 8 * (j * tiles + i),
            Self::Rows(_) => 0,
        }
    }

    #[inline]
    fn index(self, i: usize, j: usize) -> usize {
        match self {
            Self::Fours(_) => {
                let part = 2 * (j / 2 % 4) + i / 2 % 2;
                self.tile(i / 4, j / 8) + 4 * part + 2 * (j % 2) + i % 2
            }
            Self::Eights(_) => self.tile(i / 2, j / 4) + 2 * (j % 4) + i % 2,
            Self::Rows(width) => j * width + i,
        }
    }
}

impl Pyramid {
    /// Over width x height texels, at least 1x1, finite.
    pub(super) fn new(texels: &Texels, width: usize, height: usize, wrap: Wrap) -> Self {
        let axis = |texels: usize, side: usize| Axis {
            texels,
            wrap,
            shift: side.ilog2(),
        };
        let axes = [axis(width, reduce::WIDTH), axis(height, reduce::HEIGHT)];
        let levels = match texels {
            Texels::U8(t) => build::levels(t, axes),
            Texels::U16(t) => build::levels(t, axes),
            Texels::F32(t) => build::levels(t, axes),
        };
        Self {
            levels: levels.into_boxed_slice(),
            axes,
        }
    }

    /// The levels, finest first; the last has one entry.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Smallest and largest texel of the whole map, as stored.
    pub fn range(&self) -> (f32, f32) {
        self.levels[self.levels.len() - 1].get(0, 0)
    }

    /// Bytes held by the entries.
    pub fn bytes(&self) -> usize {
        self.levels[0].entries.bytes()
    }

    /// Brings the entries up to date after texels of columns `x.0..=x.1` and rows `y.0..=y.1` have changed. `row`
    /// copies a run of a row of texels as they are now: row, first column, where to.
    pub(super) fn update(
        &self,
        x: (usize, usize),
        y: (usize, usize),
        row: impl Fn(usize, usize, &mut [f32]),
    ) {
        let mut axes = self.axes;
        let mut changed = [axes[0].holding(x.0, x.1), axes[1].holding(y.0, y.1)];
        for js in changed[1].iter() {
            for is in changed[0].iter() {
                self.update_finest(is.clone(), js.clone(), &row);
            }
        }
        for pair in self.levels.windows(2) {
            let [finer, level] = pair else { continue };
            changed = [0, 1].map(|k| axes[k].made_of(&changed[k]));
            for j in changed[1].iter().flatten() {
                for i in changed[0].iter().flatten() {
                    let bounds = reduce::coarser(axes, (i, j), |i, j| finer.get(i, j));
                    level.entries.set(level.index(i, j), bounds);
                }
            }
            axes = axes.map(Axis::coarser);
        }
    }

    fn update_finest(
        &self,
        is: std::ops::Range<usize>,
        js: std::ops::Range<usize>,
        row: &impl Fn(usize, usize, &mut [f32]),
    ) {
        /// Rows of blocks at a time, so that an edit of a whole map needs no second one in memory.
        const BAND: usize = 64;
        let (level, [x, y]) = (&self.levels[0], self.axes);
        let first = reduce::WIDTH * is.start;
        let length = reduce::columns(is.len());
        let mut texels = Vec::new();
        for start in js.clone().step_by(BAND) {
            let band = start..js.end.min(start + BAND);
            let bottom = reduce::HEIGHT * band.start;
            let rows = reduce::rows(band.len());
            texels.resize(rows * length, 0.0);
            for (j, out) in texels.chunks_exact_mut(length).enumerate() {
                let j = y.wrap.texel((bottom + j) as i64, y.texels);
                // What lies inside the map is one run; the few columns beyond are folded one by one.
                let (inside, beyond) = out.split_at_mut(length.min(x.texels - first));
                row(j, first, inside);
                for (i, out) in (x.texels..).zip(beyond.chunks_exact_mut(1)) {
                    row(j, x.wrap.texel(i as i64, x.texels), out);
                }
            }
            let texels = &texels[..];
            let texel_row = |j: usize| &texels[(j - bottom) * length..][..length];
            let source = |i: usize| i; // never asked: the rows are as long as they must be
            reduce::finest(band, length, texel_row, source, |j, strip| {
                for (i, bounds) in is.clone().zip(strip.entries()) {
                    level.entries.set(level.index(i, j), bounds);
                }
            });
        }
    }
}

#[cfg(test)]
mod tests;
