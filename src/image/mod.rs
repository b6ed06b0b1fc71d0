//! Reading and writing pictures. Heights keep their precision; files appear by rename when complete.

use glam::Vec3;

/// A colour picture, bottom row first, linear RGB.
#[derive(Clone, Debug)]
pub struct ColorImage {
    /// Pixels across.
    pub width: usize,
    /// Pixels up.
    pub height: usize,
    /// What the pixels are stored as.
    pub pixels: ColorPixels,
}

/// Pixels in the precision they came in.
#[derive(Clone, Debug)]
pub enum ColorPixels {
    /// 8-bit sRGB-encoded RGB.
    Srgb8(Vec<[u8; 3]>),
    /// Linear RGB.
    Linear(Vec<[f32; 3]>),
}

/// An equirectangular HDR picture: top row first, the top row is +Y, the middle column looks along -Z.
#[derive(Clone, Debug)]
pub struct EnvironmentImage {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Linear RGB radiance, finite, non-negative.
    pub pixels: Vec<Vec3>,
}
