//! How far a run is.

use super::RayCounts;
use super::film::Frame;

/// How far a run is, told whenever a tile is done. What a pixel had before the run counts as work neither done nor to do.
#[derive(Clone, Copy, Debug)]
pub struct Status<'a> {
    /// The picture so far; tiles that are being worked on are as they were before.
    pub frame: &'a Frame,
    /// Samples done with, over all pixels: taken, or not needed because adaptive sampling has ended their pixel.
    pub done: u64,
    /// Samples that the run has to do with; rises no more, and `done` arrives there.
    pub total: u64,
    /// The pass over the picture that this is, from 1.
    pub pass: usize,
    /// Passes in all; 1 unless the film is progressive.
    pub passes: usize,
    /// Rays that this run has traced.
    pub rays: RayCounts,
}
