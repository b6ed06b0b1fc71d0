//! Where a block's cells are in the map: their entries in its min/max table, and their texels.

use glam::DVec2;

use super::cull::Parts;
use super::leaf::Rows;
use super::middle::Middle;
use super::{Block, LEAF, Record, SIDE};
use crate::prism::judge::Cells;
use crate::prism::simd::{LANES, Lanes};
use crate::surface::{DisplacementMap, StoredTexels, TexelBox, Wrap};

/// Where a block's cells are in the map.
pub struct Place<'m> {
    map: &'m DisplacementMap,
    block: Block,
    /// The first cell, in the patch's texel coordinates.
    pub first: [i64; 2],
    /// The same among stored texels, where the block is stored as it lies.
    stored: Option<[usize; 2]>,
    /// Cells across and up.
    count: [u32; 2],
}

impl<'m> Place<'m> {
    #[inline(always)]
    pub fn new(map: &'m DisplacementMap, record: &Record, block: Block) -> Self {
        let corner = record.corner();
        let first = [0, 1].map(|k: usize| corner[k] + i64::from(block.place[k]));
        let (width, height) = map.size();
        let along = |k: usize, n: usize| {
            let n = n as i64;
            let inside = first[k] >= 0 && first[k] < n;
            let stored = if inside {
                first[k]
            } else {
                first[k].rem_euclid(n)
            };
            let is_stored = inside || map.wrap() == Wrap::Repeat;
            (stored, (n - stored).min(SIDE.into()) as u32, is_stored)
        };
        let ((x, across, x_stored), (y, up, y_stored)) = (along(0, width), along(1, height));
        Self {
            map,
            block,
            first,
            stored: (x_stored && y_stored).then_some([x as usize, y as usize]),
            count: [across, up],
        }
    }

    /// Cells across and up.
    pub fn count(&self) -> [u32; 2] {
        self.count
    }

    pub fn all(&self) -> Cells {
        let along = |k: usize| [self.first[k], self.first[k] + i64::from(self.count[k]) - 1];
        Cells {
            x: along(0),
            y: along(1),
        }
    }

    /// The middle of a rectangle of cells (from the block's first one), in texels from the middle of the block's part of the triangle.
    #[inline(always)]
    pub fn middle_of(&self, middle: &Middle, cell: [u32; 2], size: [u32; 2]) -> [f32; 2] {
        let [x, y] = [0, 1].map(|k: usize| {
            (u32::from(self.block.place[k]) + cell[k] + size[k] / 2) as f32 - middle.place[k]
        });
        [x, y]
    }

    /// Parts of the block, each of two by two leaves.
    #[inline(always)]
    pub fn parts<L: Lanes>(&self, middle: &Middle) -> Parts<L> {
        let [s, t] = self.middle_of(middle, [0; 2], PART);
        Parts {
            s: L::splat(s) + L::from_array([0.0, 16.0, 0.0, 16.0, 0.0, 16.0, 0.0, 16.0]),
            t: L::splat(t) + L::from_array([0.0, 0.0, 8.0, 8.0, 16.0, 16.0, 24.0, 24.0]),
            half: [8.0, 4.0],
            range: self.ranges(1, PART, [0, 4], || PARTS),
        }
    }

    /// The leaves of two parts.
    #[inline(always)]
    pub fn leaves<L: Lanes>(&self, [a, b]: [u32; 2], middle: &Middle) -> Parts<L> {
        let [s, t] = self.middle_of(middle, [0; 2], LEAF);
        let (across, up) = (PART[0] as f32, PART[1] as f32);
        let [sa, sb] = [a, b].map(|part| (part & 1) as f32 * across);
        let [ta, tb] = [a, b].map(|part| (part >> 1) as f32 * up);
        // Whole numbers: exact.
        let second = L::from_array([0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]);
        Parts {
            s: second.mul_add(L::splat(sb - sa), L::splat(s + sa))
                + L::from_array([0.0, 8.0, 0.0, 8.0, 0.0, 8.0, 0.0, 8.0]),
            t: second.mul_add(L::splat(tb - ta), L::splat(t + ta))
                + L::from_array([0.0, 0.0, 4.0, 4.0, 0.0, 0.0, 4.0, 4.0]),
            half: super::leaf::HALF,
            range: self.ranges(0, LEAF, [4 * a as usize, 4 * b as usize], || {
                leaves_of([a, b])
            }),
        }
    }

    /// The parts that hold any of the block's cells.
    #[inline(always)]
    pub fn there(&self, places: &[[u32; 2]; LANES], size: [u32; 2]) -> u32 {
        if self.count == [SIDE; 2] {
            return 0xff;
        }
        let mut bits = 0;
        for (lane, place) in places.iter().enumerate() {
            let is_there = place[0] * size[0] < self.count[0] && place[1] * size[1] < self.count[1];
            bits |= u32::from(is_there) << lane;
        }
        bits
    }

    /// The smallest and largest texels of parts of the size of a level's entries: four from one number among these on, and four from another.
    #[inline(always)]
    fn ranges<L: Lanes>(
        &self,
        level: usize,
        size: [u32; 2],
        [a, b]: [usize; 2],
        places: impl Fn() -> [[u32; 2]; LANES],
    ) -> [L; 2] {
        L::step();
        let levels = self.map.pyramid().levels();
        if let (Some([x, y]), Some(level)) = (self.stored, levels.get(level)) {
            let tile = level.tile(x / SIDE as usize, y / SIDE as usize);
            return L::pairs(level.entries(), [tile + a, tile + b]);
        }
        self.continued_ranges(size, &places())
    }

    /// The same wherever the block lies.
    #[cold]
    fn continued_ranges<L: Lanes>(&self, size: [u32; 2], places: &[[u32; 2]; LANES]) -> [L; 2] {
        let mut ranges = [[0.0; LANES]; 2];
        for (lane, place) in places.iter().enumerate() {
            let at = |k: usize| (self.first[k] + i64::from(place[k] * size[k])) as f64;
            let low = DVec2::new(at(0), at(1));
            let high = low + DVec2::new(size[0].into(), size[1].into());
            let (low, high) = self.map.range_in_box(low, high);
            let unit = self.map.unit();
            (ranges[0][lane], ranges[1][lane]) = (low * unit, high * unit);
        }
        [L::from_array(ranges[0]), L::from_array(ranges[1])]
    }
}

impl Block {
    /// Where it is, in the patch's texel coordinates.
    pub fn texels(self, map: &DisplacementMap, record: &Record) -> TexelBox {
        let Cells { x, y } = Place::new(map, record, self).all();
        TexelBox {
            low: DVec2::new(x[0] as f64, y[0] as f64),
            high: DVec2::new(x[1] as f64 + 1.0, y[1] as f64 + 1.0),
        }
    }
}

/// Cells across and up of an entry of the map's second level.
pub const PART: [u32; 2] = [2 * LEAF[0], 2 * LEAF[1]];

/// The parts of a block of this size: two across, four up.
pub const PARTS: [[u32; 2]; LANES] = [
    [0, 0],
    [1, 0],
    [0, 1],
    [1, 1],
    [0, 2],
    [1, 2],
    [0, 3],
    [1, 3],
];

/// The places of the leaves of two parts, among the block's leaves.
#[inline(always)]
pub fn leaves_of(parts: [u32; 2]) -> [[u32; 2]; LANES] {
    std::array::from_fn(|lane| leaf_of(parts[lane / 4], lane as u32 % 4))
}

/// The place of leaf `leaf` of a part.
#[inline(always)]
pub fn leaf_of(part: u32, leaf: u32) -> [u32; 2] {
    [2 * (part & 1) + (leaf & 1), 2 * (part >> 1) + (leaf >> 1)]
}

/// The texels of a leaf that is stored as it lies.
pub struct Stored<'m> {
    texels: &'m StoredTexels,
    index: usize,
    stride: usize,
}

impl Rows for Stored<'_> {
    #[inline(always)]
    fn row<L: Lanes>(&self, row: usize) -> [L; 2] {
        L::texel_rows(self.texels, self.index + row * self.stride)
    }

    #[inline(always)]
    fn corners(&self, (i, j): (u32, u32)) -> [f32; 4] {
        let index = self.index + j as usize * self.stride + i as usize;
        self.texels.cell(index, self.stride)
    }
}

/// The texels of a leaf as the wrap mode continues them.
pub struct Continued([[f32; 9]; 5]);

impl Rows for Continued {
    #[inline(always)]
    fn row<L: Lanes>(&self, row: usize) -> [L; 2] {
        let [a, b, c, d, e, f, g, h, i] = self.0[row];
        [
            L::from_array([a, b, c, d, e, f, g, h]),
            L::from_array([b, c, d, e, f, g, h, i]),
        ]
    }

    #[inline(always)]
    fn corners(&self, (i, j): (u32, u32)) -> [f32; 4] {
        let (i, rows) = (i as usize, [&self.0[j as usize], &self.0[j as usize + 1]]);
        [rows[0][i], rows[0][i + 1], rows[1][i], rows[1][i + 1]]
    }
}

impl<'m> Place<'m> {
    /// The leaf whose first cell is (i, j), where the block is stored as it lies.
    #[inline(always)]
    pub fn stored(&self, i: u32, j: u32) -> Option<Stored<'m>> {
        let [x, y] = self.stored?;
        let stride = self.map.stride();
        Some(Stored {
            texels: self.map.texels(),
            index: (y + j as usize) * stride + x + i as usize,
            stride,
        })
    }

    /// The leaf whose first cell is (i, j), wherever the block lies.
    #[cold]
    pub fn continued(&self, i: u32, j: u32) -> Continued {
        let (map, wrap) = (self.map, self.map.wrap());
        let (width, height) = map.size();
        Continued(std::array::from_fn(|row| {
            let y = wrap.texel(self.first[1] + i64::from(j) + row as i64, height);
            std::array::from_fn(|column| {
                let x = wrap.texel(self.first[0] + i64::from(i) + column as i64, width);
                map.texels().get(y * map.stride() + x)
            })
        }))
    }
}

impl Place<'_> {
    /// The cells of the leaf at cell (i, j) that are the block's.
    #[inline(always)]
    pub fn mask(&self, i: u32, j: u32) -> u32 {
        if self.count == [SIDE; 2] {
            return u32::MAX;
        }
        let across = (self.count[0] - i).min(LEAF[0]);
        let up = (self.count[1] - j).min(LEAF[1]);
        let row = (1u32 << across) - 1;
        let mut mask = 0;
        for k in 0..up {
            mask |= row << (8 * k);
        }
        mask
    }

    /// The cells of the leaf at cell (i, j).
    pub fn part(&self, i: u32, j: u32) -> Cells {
        self.rectangle([i, j], LEAF)
    }

    /// The block's cells in a rectangle of it.
    pub fn rectangle(&self, from: [u32; 2], size: [u32; 2]) -> Cells {
        let along = |k: usize| {
            let to = (from[k] + size[k]).min(self.count[k]);
            [
                self.first[k] + i64::from(from[k]),
                self.first[k] + i64::from(to) - 1,
            ]
        };
        Cells {
            x: along(0),
            y: along(1),
        }
    }
}
