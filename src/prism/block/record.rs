//! What is stored of a base triangle, and of a block.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::{DVec2, DVec3};

use crate::prism::simd::LANES;
use crate::surface::Patch;

/// Words by axis of [`Record::vectors`].
pub const WORDS: usize = 6;

/// A base triangle as a function of texel coordinates: 108 bytes.
///
/// Its texels are counted from `corner`, whole texel coordinates [`BEFORE`] the triangle's smallest.
#[repr(C)]
pub struct Record {
    /// By axis: v_0, dP/dx and dP/dy, n_0, dN'/dx and dN'/dy, per texel; then the texel coordinates of vertex 0, from the corner.
    vectors: [f32; 3 * WORDS + 2],
    /// db_1/dx, db_1/dy, db_2/dx, db_2/dy, per texel.
    slopes: [f32; 4],
    /// In units of [`UNIT`].
    corner: [i16; 2],
    /// Where the triangle ends.
    end: [u16; 2],
    /// The smallest and the largest w = D/|N'|, each the upper half of a float's bits: an edit of the map changes them in place.
    offsets: AtomicU32,
}

const _: () = assert!(size_of::<Record>() == 108);

/// Corners are multiples of this number of texels.
const UNIT: i64 = 4;

/// Texels from a corner to where its triangle may begin: blocks may begin as much before the triangle.
pub const BEFORE: i64 = 32;

/// The upper half of a float's bits, of one that is not less.
fn above(x: f32) -> u32 {
    let bits = x.to_bits();
    let half = bits >> 16;
    if x > 0.0 && bits & 0xffff != 0 {
        half + 1
    } else {
        half
    }
}

/// Both of a range in one word.
fn packed([low, high]: [f32; 2]) -> u32 {
    // The sign is the upper half's highest bit.
    (above(-low) ^ 0x8000) << 16 | above(high)
}

fn unpacked(bits: u32) -> [f32; 2] {
    [
        f32::from_bits(bits & 0xffff_0000),
        f32::from_bits(bits << 16),
    ]
}

impl Record {
    /// Of a triangle whose texture coordinates have an area, and whose texels are counted from `corner`.
    pub fn new(patch: &Patch<'_>, corner: [i64; 2], offsets: [f32; 2]) -> Self {
        let [p0, p1, p2] = patch.texels;
        let (a, b) = (p1 - p0, p2 - p0);
        let area = a.perp_dot(b);
        // b_1 = (x - p0) x b / area, b_2 = a x (x - p0) / area.
        let (b1, b2) = (DVec2::new(b.y, -b.x) / area, DVec2::new(-a.y, a.x) / area);
        let corner_at = DVec2::new(corner[0] as f64, corner[1] as f64);
        let first = p0 - corner_at;
        let end = p0.max(p1).max(p2) - corner_at;
        let along = |v: &[DVec3; 3]| {
            let (d1, d2) = (v[1] - v[0], v[2] - v[0]);
            [v[0], b1.x * d1 + b2.x * d2, b1.y * d1 + b2.y * d2]
        };
        let all = [along(&patch.vertices), along(&patch.normals)];
        let mut vectors = [0.0; 3 * WORDS + 2];
        for axis in 0..3 {
            for (k, vector) in all.as_flattened().iter().enumerate() {
                vectors[WORDS * axis + k] = vector[axis] as f32;
            }
        }
        vectors[3 * WORDS] = first.x as f32;
        vectors[3 * WORDS + 1] = first.y as f32;
        Self {
            vectors,
            slopes: [b1.x as f32, b1.y as f32, b2.x as f32, b2.y as f32],
            corner: corner.map(|c| (c / UNIT) as i16),
            end: end.ceil().to_array().map(|x| x as u16),
            offsets: AtomicU32::new(packed(offsets)),
        }
    }

    /// Of a triangle that has no blocks.
    pub fn without_blocks(offsets: [f32; 2]) -> Self {
        Self {
            vectors: [0.0; 3 * WORDS + 2],
            slopes: [0.0; 4],
            corner: [0; 2],
            end: [0; 2],
            offsets: AtomicU32::new(packed(offsets)),
        }
    }

    /// The words of an axis, and two more.
    #[inline(always)]
    pub fn along(&self, axis: usize) -> &[f32; LANES] {
        let start = WORDS * axis.min(2);
        // As long as the pattern: what is sliced is there for each of the three axes.
        match self.vectors[start..].first_chunk() {
            Some(words) => words,
            None => unreachable!("an axis has six words, and there are two more"),
        }
    }

    /// Texel coordinates of vertex 0, from the corner.
    #[inline(always)]
    pub fn first(&self) -> [f32; 2] {
        [self.vectors[3 * WORDS], self.vectors[3 * WORDS + 1]]
    }

    #[inline(always)]
    pub fn slopes(&self) -> &[f32; 4] {
        &self.slopes
    }

    /// The corner of a triangle whose smallest texel coordinates are these.
    pub fn corner_of(low: DVec2) -> [i64; 2] {
        let whole = |x: f64| (x.floor() as i64).div_euclid(UNIT) * UNIT - BEFORE;
        [whole(low.x), whole(low.y)]
    }

    /// Whole texel coordinates, in the patch's.
    #[inline(always)]
    pub fn corner(&self) -> [i64; 2] {
        self.corner.map(|c| i64::from(c) * UNIT)
    }

    /// Where the triangle ends along an axis, in texels from the corner.
    #[inline(always)]
    pub fn end(&self, axis: usize) -> u32 {
        self.end[axis].into()
    }

    /// A range that holds w.
    #[inline(always)]
    pub fn offsets(&self) -> [f32; 2] {
        unpacked(self.offsets.load(Ordering::Relaxed))
    }

    /// Makes room for this range of w; whether there was none.
    pub fn widen(&self, [low, high]: [f32; 2]) -> bool {
        let wider = |bits: u32| {
            let [a, b] = unpacked(bits);
            (low < a || high > b).then(|| packed([a.min(low), b.max(high)]))
        };
        let widened = self
            .offsets
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, wider);
        widened.is_ok()
    }
}

/// A rectangle of texel cells of one base triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// Base triangle.
    pub triangle: u32,
    /// Its first cell, from the triangle's corner.
    pub place: [u16; 2],
}
