//! The displacement map: heights on a texel grid, sampled bilinearly.
//!
//! Texel i's centre is at (i + 0.5) / width. v points up: row 0 is the bottom row of the picture.
//! Integer maps read as h = texel / max in [0, 1]; float maps as stored. Nothing goes through 8 bits.

use glam::{Mat2, Vec2};
use thiserror::Error;

/// Why a map was refused. The loader that met it adds the file's name.
#[derive(Debug, Error, PartialEq)]
pub enum MapError {
    /// Zero width or height.
    #[error("the map is {width}x{height} texels; at least 1x1 is needed")]
    Empty {
        /// Texels across.
        width: usize,
        /// Texels up.
        height: usize,
    },
    /// More texels across or up than a gather's 32-bit index can reach.
    #[error("the map is {width}x{height} texels; at most {max}x{max} is supported")]
    TooLarge {
        /// Texels across.
        width: usize,
        /// Texels up.
        height: usize,
        /// Largest side.
        max: usize,
    },
    /// The number of texels is not width * height.
    #[error("the map is {width}x{height} texels, but {found} were given")]
    WrongLength {
        /// Texels across.
        width: usize,
        /// Texels up.
        height: usize,
        /// Texels given.
        found: usize,
    },
    /// A NaN or infinite height.
    #[error(
        "texel ({x}, {y}) of the map (from the bottom left) is {value}; heights must be finite"
    )]
    NotFinite {
        /// Column from the left.
        x: usize,
        /// Row from the bottom.
        y: usize,
        /// What was found.
        value: f32,
    },
}

/// What happens outside [0, 1] in texture space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Wrap {
    /// The map repeats.
    #[default]
    Repeat,
    /// The border texel goes on.
    Clamp,
    /// The map repeats, every second one mirrored.
    Mirror,
}

/// Heights in the precision they came in, bottom row first, `width` per row.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// h = texel / 255.
    U8(Vec<u8>),
    /// h = texel / 65535.
    U16(Vec<u16>),
    /// h as stored (half-float maps are widened).
    F32(Vec<f32>),
}

/// Applied to texture coordinates before the map is sampled: st' = rotate(rotation) * (scale * st) + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvTransform {
    /// Repeats of the map across and up.
    pub scale: Vec2,
    /// Radians, counter-clockwise in texture space.
    pub rotation: f32,
    /// Added last, in map widths and heights.
    pub offset: Vec2,
}

impl Default for UvTransform {
    fn default() -> Self {
        Self {
            scale: Vec2::ONE,
            rotation: 0.0,
            offset: Vec2::ZERO,
        }
    }
}

impl UvTransform {
    /// The transformed texture coordinates.
    pub fn apply(&self, st: Vec2) -> Vec2 {
        Mat2::from_angle(self.rotation) * (self.scale * st) + self.offset
    }
}

/// A displacement map, ready to be sampled.
#[derive(Clone, Debug)]
pub struct DisplacementMap {
    width: usize,
    height: usize,
    wrap: Wrap,
    texels: Texels,
}

impl DisplacementMap {
    /// A map of `width` x `height` texels, bottom row first.
    pub fn new(width: usize, height: usize, texels: Texels, wrap: Wrap) -> Result<Self, MapError> {
        let _ = (width, height, texels, wrap);
        todo!()
    }

    /// Texels across and up.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// The wrap mode.
    pub fn wrap(&self) -> Wrap {
        self.wrap
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        match &self.texels {
            Texels::U8(t) => t.len(),
            Texels::U16(t) => 2 * t.len(),
            Texels::F32(t) => 4 * t.len(),
        }
    }

    /// Height at texture coordinates `st`, bilinear.
    pub fn height(&self, st: Vec2) -> f32 {
        let _ = st;
        todo!()
    }
}
