//! Blocks: the parts of a base triangle whose texel coordinates lie in a rectangle.
//!
//! Such a part is a convex polygon of the triangle, for texel coordinates are linear in b. It does not depend on where the triangle's
//! corners are, so it is the same at all times.

mod bounds;

use std::array;

use glam::DVec2;

use super::Patch;

/// A rectangle of texel coordinates as a triangle has them ([`Patch::texels`]): not folded, its edges belong to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TexelBox {
    pub low: DVec2,
    pub high: DVec2,
}

impl TexelBox {
    /// Holds all of every triangle.
    pub const EVERYWHERE: Self = Self {
        low: DVec2::NEG_INFINITY,
        high: DVec2::INFINITY,
    };

    /// Wider by what texel coordinates of the size of `texels` may be off by rounding, a good deal more than once.
    fn widened(&self, texels: [DVec2; 3]) -> Self {
        /// Of a texel.
        const HAIR: f64 = 1e-6;
        /// Of a coordinate: some 45 units in the last place.
        const RELATIVE: f64 = 1e-14;
        let largest = texels.map(|texel| texel.abs().max_element());
        let hair = HAIR + RELATIVE * largest[0].max(largest[1]).max(largest[2]);
        Self {
            low: self.low - hair,
            high: self.high + hair,
        }
    }
}

/// A corner of a [`Polygon`].
#[derive(Clone, Copy, Default)]
struct Corner {
    /// (u, v).
    place: DVec2,
    texel: DVec2,
}

/// A convex polygon of places of a triangle.
#[derive(Clone)]
pub(super) struct Polygon {
    corners: [Corner; Self::MOST],
    count: usize,
}

impl Polygon {
    /// Corners of a triangle that is cut along four lines: 7, if all is convex. A cut of n corners of which k stay, in no more than
    /// min(k, n - k) runs, has k and two for every run, at most 3n/2; a polygon that rounding has bent goes from 3 to 4, 6, 9 and 13.
    const MOST: usize = 13;

    /// The part of a triangle, of these (u, v) and texel coordinates at its corners, in a rectangle. Of no corners where there is none,
    /// of one or two where they touch.
    pub fn new(places: [DVec2; 3], texels: [DVec2; 3], within: &TexelBox) -> Self {
        let mut polygon = Self {
            corners: [Corner::default(); Self::MOST],
            count: 0,
        };
        for (place, texel) in places.into_iter().zip(texels) {
            polygon.push(Corner { place, texel });
        }
        for axis in 0..2 {
            polygon = polygon.clipped(|texel| texel[axis] - within.low[axis]);
            polygon = polygon.clipped(|texel| within.high[axis] - texel[axis]);
        }
        polygon
    }

    /// The part of all of a base triangle.
    pub fn of(patch: &Patch<'_>, within: &TexelBox) -> Self {
        let whole = [DVec2::ZERO, DVec2::X, DVec2::Y];
        Self::new(whole, patch.texels, within)
    }

    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    fn push(&mut self, corner: Corner) {
        self.corners[self.count] = corner;
        self.count += 1;
    }

    /// What is where `side` of the texel is not negative.
    fn clipped(&self, side: impl Fn(DVec2) -> f64) -> Self {
        let mut kept = Self { count: 0, ..*self };
        for k in 0..self.count {
            let (a, b) = (self.corners[k], self.corners[(k + 1) % self.count]);
            let (here, there) = (side(a.texel), side(b.texel));
            if here >= 0.0 {
                kept.push(a);
            }
            if (here < 0.0) != (there < 0.0) {
                let f = here / (here - there);
                kept.push(Corner {
                    place: a.place.lerp(b.place, f),
                    texel: a.texel.lerp(b.texel, f),
                });
            }
        }
        kept
    }

    /// (u, v) of the corners, in their order around.
    pub fn places(&self) -> impl Iterator<Item = DVec2> {
        let corners = self.corners[..self.count].iter();
        corners.map(|corner| corner.place)
    }

    /// The smallest and the largest texel coordinates; infinity and its opposite where there are no corners.
    pub fn texels(&self) -> [DVec2; 2] {
        let none = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        let corners = self.corners[..self.count].iter();
        corners.fold(none, |[low, high], corner| {
            [low.min(corner.texel), high.max(corner.texel)]
        })
    }

    /// Triangles that make it up, none where it is a line or a point by its corners' number.
    pub fn triangles(&self) -> impl Iterator<Item = [DVec2; 3]> {
        let place = |k: usize| self.corners[k].place;
        (2..self.count).map(move |k| array::from_fn(|i| place([0, k - 1, k][i])))
    }
}

#[cfg(test)]
mod tests;
