//! The displacement map: heights on a texel grid, sampled bilinearly.
//!
//! Texel i's centre is at (i + 0.5) / width. v points up: row 0 is the bottom row of the picture.
//! Integer maps read as h = texel / max in [0, 1]; float maps as stored. Nothing goes through 8 bits.
//!
//! Inside the program positions are *texel coordinates*: x = s * width - 0.5, so that texel centres are the
//! integers and cell (i, j) is the square between the centres of texels i, i+1 and j, j+1.

use std::sync::{Mutex, OnceLock};

use glam::{DVec2, Vec2};
use thiserror::Error;

use super::grid::{HeightGrid, HeightSample};
use super::means::Means;
use super::texels::StoredTexels;
use super::{Pyramid, TexelKind, TexelRect, Texels, Wrap};

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
    /// More texels across or up than [`DisplacementMap::MAX_SIDE`].
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
    /// A rectangle of texels without any.
    #[error("the rectangle is {0}; at least 1x1 texels are needed")]
    EmptyRect(TexelRect),
    /// A rectangle that is not wholly inside the map.
    #[error("the rectangle {rect} is not inside the map of {width}x{height} texels")]
    RectOutside {
        /// What was asked for.
        rect: TexelRect,
        /// Texels across the map.
        width: usize,
        /// Texels up the map.
        height: usize,
    },
    /// The number of texels of an edit is not that of its rectangle.
    #[error("the rectangle is {rect}, but {found} texels were given")]
    WrongRectLength {
        /// What is to be edited.
        rect: TexelRect,
        /// Texels given.
        found: usize,
    },
    /// Texels of another precision than the map's.
    #[error("the texels are {found}, but the map's are {expected}")]
    WrongKind {
        /// The precision of what was given.
        found: TexelKind,
        /// The precision of the map.
        expected: TexelKind,
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

/// A displacement map, ready to be sampled, and the min/max pyramid over it.
///
/// It is shared between surfaces and read from many threads; [`DisplacementMap::update`] edits it in place.
#[derive(Debug)]
pub struct DisplacementMap {
    pub(super) grid: HeightGrid,
    pub(super) pyramid: Pyramid,
    /// Made when they are first asked for.
    pub(super) means: OnceLock<Means>,
    /// Held while editing: an entry of the pyramid depends on texels of several edits.
    pub(super) editing: Mutex<()>,
}

impl DisplacementMap {
    /// Largest width and height: texel indices fit 32 bits and an f32 texel coordinate still resolves 1/256.
    pub const MAX_SIDE: usize = 32768;

    /// Whether a map may be this large.
    pub(crate) fn check_size(width: usize, height: usize) -> Result<(), MapError> {
        if width == 0 || height == 0 {
            return Err(MapError::Empty { width, height });
        }
        if width.max(height) > Self::MAX_SIDE {
            return Err(MapError::TooLarge {
                width,
                height,
                max: Self::MAX_SIDE,
            });
        }
        Ok(())
    }

    /// Whether texels may be those of a map.
    pub(crate) fn check_texels(
        width: usize,
        height: usize,
        texels: &Texels,
    ) -> Result<(), MapError> {
        Self::check_size(width, height)?;
        if texels.len() != width * height {
            return Err(MapError::WrongLength {
                width,
                height,
                found: texels.len(),
            });
        }
        if let Some((i, value)) = texels.not_finite() {
            return Err(MapError::NotFinite {
                x: i % width,
                y: i / width,
                value,
            });
        }
        Ok(())
    }

    /// A map of `width` x `height` texels, bottom row first.
    pub fn new(width: usize, height: usize, texels: Texels, wrap: Wrap) -> Result<Self, MapError> {
        Self::check_texels(width, height, &texels)?;
        Ok(Self {
            pyramid: Pyramid::new(&texels, width, height, wrap),
            grid: HeightGrid::new(width, height, texels, [wrap; 2]),
            means: OnceLock::new(),
            editing: Mutex::new(()),
        })
    }

    /// Texels across and up.
    pub fn size(&self) -> (usize, usize) {
        (self.grid.width, self.grid.height)
    }

    /// The wrap mode.
    pub fn wrap(&self) -> Wrap {
        // Both are the same.
        self.grid.wrap[0]
    }

    /// Smallest and largest height.
    pub fn range(&self) -> (f32, f32) {
        let (low, high) = self.pyramid.range();
        (low / self.unit(), high / self.unit())
    }

    /// The precision of the texels.
    pub fn kind(&self) -> TexelKind {
        self.grid.texels.kind()
    }

    /// The stored value that means height 1: 255, 65535, or 1 for floats.
    pub fn unit(&self) -> f32 {
        self.kind().unit()
    }

    /// The smallest and largest texels of blocks of the map.
    pub fn pyramid(&self) -> &Pyramid {
        &self.pyramid
    }

    /// The texels as stored, in rows of [`Self::stride`].
    pub(crate) fn texels(&self) -> &StoredTexels {
        &self.grid.texels
    }

    /// Stored texels per row.
    pub(crate) fn stride(&self) -> usize {
        self.grid.stride()
    }

    /// Bytes held: texels, pyramid, and means if there are any.
    pub fn bytes(&self) -> usize {
        self.grid.texels.bytes() + self.pyramid.bytes() + self.mean_bytes()
    }

    /// Height at texture coordinates `st`, bilinear.
    pub fn height(&self, st: Vec2) -> f32 {
        self.sample(self.to_texel(st.as_dvec2())).height as f32
    }

    /// Texture coordinates in [0, 1] to texel coordinates.
    pub fn to_texel(&self, st: DVec2) -> DVec2 {
        self.grid.to_texel(st)
    }

    /// Height and in-cell gradient at texel coordinates.
    #[inline(always)]
    pub fn sample(&self, p: DVec2) -> HeightSample {
        self.grid.sample(p)
    }

    /// Height and gradient around `p` without jumps at cell borders: central differences over `width` texels, more than 0, along each
    /// axis, and the mean height of the four points that they are taken from. Per texel, like [`HeightSample::gradient`].
    pub fn smooth(&self, p: DVec2, width: f64) -> HeightSample {
        self.grid.smooth(p, width)
    }
}

#[cfg(test)]
mod tests;
