//! Edits of a map in place, while it is shared.

use std::fmt;
use std::sync::PoisonError;

use super::texels::{StoredTexels, Texel};
use super::{DisplacementMap, MapError, Texels};

/// A rectangle of texels of a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TexelRect {
    /// Its left column, from the map's left.
    pub x: usize,
    /// Its lowest row, from the map's bottom.
    pub y: usize,
    /// Texels across, at least 1.
    pub width: usize,
    /// Texels up, at least 1.
    pub height: usize,
}

/// `64x32 texels at (10, 20)`.
impl fmt::Display for TexelRect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            x,
            y,
            width,
            height,
        } = self;
        write!(f, "{width}x{height} texels at ({x}, {y})")
    }
}

/// What an edit has done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Update {
    /// Smallest and largest height of the whole map before.
    pub range_before: (f32, f32),
    /// The same after.
    pub range_after: (f32, f32),
}

impl DisplacementMap {
    /// Replaces the texels of `rect` by `texels` of the map's own kind, rows from the bottom, and brings the pyramid
    /// and the means up to date, in time proportional to the rectangle. Nothing is changed where an error is returned.
    ///
    /// The map may be in use: an edit while rays are in flight is memory-safe, and a ray sees each texel, and each
    /// entry of the pyramid, either as it was or as it is, so it may miss what is half edited. For a consistent
    /// picture edit between frames. Edits on several threads wait for one another.
    ///
    /// Whoever has taken bounds from the map ([`Self::range`], [`Self::range_over`]) must take them again where
    /// [`Self::overlaps`] says that the edit matters.
    ///
    /// # Errors
    ///
    /// [`MapError::EmptyRect`] and [`MapError::RectOutside`] for the rectangle, [`MapError::WrongKind`],
    /// [`MapError::WrongRectLength`] and [`MapError::NotFinite`] (with the texel's place in the map) for the texels.
    pub fn update(&self, rect: TexelRect, texels: &Texels) -> Result<Update, MapError> {
        self.check(rect)?;
        if texels.kind() != self.kind() {
            return Err(MapError::WrongKind {
                found: texels.kind(),
                expected: self.kind(),
            });
        }
        if rect.width.checked_mul(rect.height) != Some(texels.len()) {
            return Err(MapError::WrongRectLength {
                rect,
                found: texels.len(),
            });
        }
        if let Some((i, value)) = texels.not_finite() {
            return Err(MapError::NotFinite {
                x: rect.x + i % rect.width,
                y: rect.y + i / rect.width,
                value,
            });
        }
        // The lock guards no data of its own that a panic could have spoilt.
        let _alone = self.editing.lock().unwrap_or_else(PoisonError::into_inner);
        let range_before = self.range();
        self.grid.write(texels, rect);
        let columns = (rect.x, rect.x + rect.width - 1);
        let rows = (rect.y, rect.y + rect.height - 1);
        self.pyramid.update(columns, rows, |j, i, out| {
            let start = j * self.stride() + i;
            self.grid.texels.copy(start, out);
        });
        if let Some(means) = self.means.get() {
            means.update(&self.grid, rect);
        }
        Ok(Update {
            range_before,
            range_after: self.range(),
        })
    }

    /// The texels of `rect` as they are now, rows from the bottom: what [`Self::update`] takes to undo an edit.
    ///
    /// # Errors
    ///
    /// [`MapError::EmptyRect`] and [`MapError::RectOutside`].
    pub fn read(&self, rect: TexelRect) -> Result<Texels, MapError> {
        self.check(rect)?;
        Ok(match &self.grid.texels {
            StoredTexels::U8(t) => Texels::U8(self.gather(t, rect)),
            StoredTexels::U16(t) => Texels::U16(self.gather(t, rect)),
            StoredTexels::F32(t) => Texels::F32(self.gather(t, rect)),
        })
    }

    /// Smallest and largest height in `rect`.
    ///
    /// # Errors
    ///
    /// [`MapError::EmptyRect`] and [`MapError::RectOutside`].
    pub fn range_in(&self, rect: TexelRect) -> Result<(f32, f32), MapError> {
        self.check(rect)?;
        let row = |j: usize| {
            let start = j * self.stride() + rect.x;
            self.grid.texels.range(start..start + rect.width)
        };
        let rows = (rect.y..rect.y + rect.height).filter_map(row);
        let (low, high) = rows
            .reduce(|(a, b), (low, high)| (a.min(low), b.max(high)))
            .ok_or(MapError::EmptyRect(rect))?;
        Ok((low / self.unit(), high / self.unit()))
    }

    fn check(&self, rect: TexelRect) -> Result<(), MapError> {
        if rect.width == 0 || rect.height == 0 {
            return Err(MapError::EmptyRect(rect));
        }
        let fits = |start: usize, length: usize, n: usize| start < n && length <= n - start;
        let (width, height) = self.size();
        if fits(rect.x, rect.width, width) && fits(rect.y, rect.height, height) {
            return Ok(());
        }
        Err(MapError::RectOutside {
            rect,
            width,
            height,
        })
    }

    fn gather<T: Texel>(&self, from: &[T::Atomic], rect: TexelRect) -> Vec<T> {
        let row = |j: usize| {
            let start = j * self.stride() + rect.x;
            from[start..start + rect.width].iter().map(T::load)
        };
        (rect.y..rect.y + rect.height).flat_map(row).collect()
    }
}

#[cfg(test)]
mod tests;
