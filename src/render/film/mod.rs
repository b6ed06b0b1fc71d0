//! From samples to pixels, and from pixels to files.
//!
//! ```text
//! sample -> pixel (sums in f64, stopped by adaptive) -> tile -> frame -> channels of an EXR file, and back
//!  filter    slot: which sums there are                          |          file, info
//!                                                                +-> tone -> 8 bits
//! ```
//!
//! A pixel is a function of its own samples, in the order of their numbers. So any tiling gives the same bits, and a frame
//! may be put down and taken up at any sample, through a file too ([`FrameFile`]). [`merge()`] puts parts together.

mod adaptive;
mod column;
mod error;
mod file;
mod filter;
mod frame;
mod info;
mod merge;
mod objects;
mod pixel;
mod sample;
mod shown;
mod slot;
mod tile;
mod tone;

pub use error::FrameError;
pub use file::FrameFile;
pub(super) use filter::PixelFilter;
pub use frame::Frame;
pub use info::{FrameInfo, Part, Source};
pub use merge::merge;
pub use objects::Objects;
pub use sample::{CameraSample, FirstHit};
pub(super) use tile::{TileGrid, TileRenderer};
pub use tone::to_srgb8;
