//! What a frame is still to get, and in which order.

use std::ops::Range;

use super::film::{Frame, TileGrid};
use crate::scene::Window;

/// Most pixels along a tile's side.
const TILE: u32 = 32;
/// Most samples of a tile: the last tiles keep all threads busy.
const TILE_SAMPLES: u32 = TILE * TILE * 16;

/// The samples that a frame lacks: pass by pass over the picture, each tile by tile. No pass begins before the one before has ended.
#[derive(Clone, Debug)]
pub struct Plan {
    window: Window,
    tile: Option<u32>,
    passes: Vec<Range<u32>>,
    /// Passes that have ended.
    ended: usize,
    /// The tiles of the pass in work, by their index, that have not got all of it.
    pub left: Vec<usize>,
    /// Samples done with: taken, or not needed because adaptive sampling has ended their pixel.
    pub done: u64,
    /// Samples that there were to do with.
    pub total: u64,
}

impl Plan {
    /// What `frame` lacks. In tiles of `tile` x `tile` pixels, or of what keeps all threads busy.
    pub fn new(frame: &Frame, progressive: bool, tile: Option<u32>) -> Self {
        let mut plan = Self {
            window: frame.window(),
            tile,
            passes: passes(frame.samples(), progressive),
            ended: 0,
            left: Vec::new(),
            done: 0,
            total: frame.lacks(frame.samples()),
        };
        plan.begin();
        plan
    }

    /// The numbers of the samples of the pass in work; `None` when all have ended.
    pub fn pass(&self) -> Option<Range<u32>> {
        self.passes.get(self.ended).cloned()
    }

    /// The tiles of the pass in work.
    pub fn grid(&self) -> TileGrid {
        let samples = self.pass().map_or(0, |pass| pass.len() as u32);
        TileGrid::new(self.window, self.tile.unwrap_or_else(|| tile_side(samples)))
    }

    /// Ends the pass in work: no tile is left.
    pub fn end_pass(&mut self) {
        self.ended += 1;
        self.begin();
    }

    fn begin(&mut self) {
        self.left.clear();
        if !self.is_done() {
            self.left.extend(0..self.grid().len());
        }
    }

    /// Whether all passes have ended.
    pub fn is_done(&self) -> bool {
        self.ended == self.passes.len()
    }

    /// The number of the pass in work, from 1.
    pub fn number(&self) -> usize {
        self.ended + 1
    }

    /// Passes in all.
    pub fn passes(&self) -> usize {
        self.passes.len()
    }
}

/// The runs of samples that are taken one after the other: all at once, or each as long as all before.
fn passes(samples: &Range<u32>, progressive: bool) -> Vec<Range<u32>> {
    let mut passes = Vec::new();
    let mut start = samples.start;
    while start < samples.end {
        let done = start - samples.start;
        let end = if progressive {
            start.saturating_add(done.max(1))
        } else {
            samples.end
        };
        passes.push(start..end.min(samples.end));
        start = end;
    }
    passes
}

/// Pixels along the side of tiles that take so many samples per pixel.
fn tile_side(spp: u32) -> u32 {
    (TILE_SAMPLES / spp.max(1)).isqrt().clamp(1, TILE)
}
