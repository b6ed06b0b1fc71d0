//! Eight samples of one ray at once, at the instruction set of the machine that runs.
//!
//! Kernels are written once over [`Lanes`] and stamped per [`SimdLevel`]; [`SimdLevel::detect`] is asked once,
//! when the prisms are made, and the chosen functions are kept as pointers.

mod portable;
mod quad;

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod avx2;
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod avx2_quad;

use std::ops::{Add, Div, Mul, Sub};
use std::sync::atomic::AtomicU32;

use crate::surface::{DisplacementMap, Entries, Level, LevelRows, StoredTexels, Wrap};

#[cfg(target_arch = "x86_64")]
pub(crate) use avx2::Avx2;
pub(crate) use portable::Portable;
pub(crate) use quad::{Quad, Real};

/// The instruction set of a kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SimdLevel {
    /// What every machine of the architecture has.
    Baseline,
    /// x86-64 with AVX2 and FMA.
    Avx2,
}

impl SimdLevel {
    /// Whether this machine can run kernels of this level.
    pub fn is_supported(self) -> bool {
        match self {
            Self::Baseline => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 => false,
        }
    }

    /// The best level of this machine. The environment variable `PRISMARCH_SIMD=baseline` asks for the lowest.
    pub fn detect() -> Self {
        let baseline = std::env::var_os("PRISMARCH_SIMD").is_some_and(|v| v == "baseline");
        if !baseline && Self::Avx2.is_supported() {
            Self::Avx2
        } else {
            Self::Baseline
        }
    }

    /// `baseline` or `avx2+fma`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline => "baseline",
            Self::Avx2 => "avx2+fma",
        }
    }
}

/// Number of lanes.
pub(crate) const LANES: usize = 8;

/// A part of a kernel that may stand in a function of its own.
pub(crate) trait Task<L> {
    /// What it gives.
    type Output;
    /// Must be `inline(always)`, to be compiled for the instruction set of who runs it.
    fn run(self) -> Self::Output;
}

/// Eight f32 values: the least that the kernels need.
pub(crate) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// The f64 lanes that go with these.
    type Quad: Quad;

    /// Runs a task in a function of its own, stamped for the instruction set: for what would bloat its callers.
    fn outline<T: Task<Self>>(task: T) -> T::Output;

    fn splat(x: f32) -> Self;
    fn from_array(x: [f32; LANES]) -> Self;
    fn to_array(self) -> [f32; LANES];
    /// The floats whose bits are stored; each is read whole, whoever writes meanwhile.
    fn from_bits(bits: &[AtomicU32; LANES]) -> Self;
    /// self * a + b, rounded once.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// b - self * a, rounded once.
    fn neg_mul_add(self, a: Self, b: Self) -> Self;
    /// `other` where either is NaN.
    fn min(self, other: Self) -> Self;
    /// `other` where either is NaN.
    fn max(self, other: Self) -> Self;
    fn floor(self) -> Self;
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    /// `a` where the sign bit of `self` is set, `b` elsewhere.
    fn select_negative(self, a: Self, b: Self) -> Self;
    /// Lane k of `a` where bit k is set, of `b` elsewhere.
    fn choose(bits: u32, a: Self, b: Self) -> Self;
    /// Lane k becomes lane k + 1; the last stays.
    fn next(self) -> Self;
    /// Lane k becomes lane k + 1; the last is the first of `rest`.
    fn next_of(self, rest: Self) -> Self;
    /// The largest lane.
    fn max_lane(self) -> f32;
    /// Bit k: lane k's sign bit.
    fn sign_mask(self) -> u32;
    /// Smallest and largest stored texel of four blocks of a level in the columns and rows in which i and j are, in blocks. The second
    /// column is the first, the next, or one before. What is outside the level, and NaN, is moved inside first.
    fn block_ranges(grid: &Grid<'_>, level: usize, i: [Self; 2], j: [Self; 2]) -> [Self; 2];
    /// The same of the blocks in which boxes from (x, y) to (x, y), folded at their low end only where not all are inside the map, begin
    /// and end, each on the finest level whose blocks are larger than `size`. Sizes and corners are from 0 to 2^24; others are moved there.
    fn block_ranges_by_size(
        grid: &Grid<'_>,
        is_inside: bool,
        size: Self,
        x: [Self; 2],
        y: [Self; 2],
    ) -> [Self; 2];
    /// The stored texels at the corners (0,0) (1,0) (0,1) (1,1) of the cells (i, j), integers in float lanes.
    /// Cells outside the grid, and NaN, are moved inside first.
    fn cell_corners(grid: &Grid<'_>, i: Self, j: Self) -> [Self; 4];
    /// Smallest and largest of stored pairs: four from each number on; zeros where there are fewer.
    fn pairs(entries: &Entries, first: [usize; 2]) -> [Self; 2];
    /// The stored texels from `index` on, and from `index` + 1 on: the left and the right ends of eight cells in a row. Zeros where
    /// not all nine are stored; from the first to the last texel of a map they are.
    #[cfg_attr(not(test), expect(dead_code, reason = "for the test of blocks"))]
    fn texel_rows(texels: &StoredTexels, index: usize) -> [Self; 2];
}

/// At least the texels that a curve in one piece reaches from its base.
const FAR: f64 = 65536.0;

/// A displacement map as the kernels see it.
#[derive(Clone, Copy)]
pub(crate) struct Grid<'m> {
    texels: &'m StoredTexels,
    stride: usize,
    wrap: Wrap,
    /// Texels across and up.
    size: [f32; 2],
    levels: &'m [Level],
    rows: &'m LevelRows,
}

impl<'m> Grid<'m> {
    #[inline(always)]
    pub fn new(map: &'m DisplacementMap) -> Self {
        let (width, height) = map.size();
        Self {
            texels: map.texels(),
            stride: map.stride(),
            wrap: map.wrap(),
            size: [width as f32, height as f32],
            levels: map.pyramid().levels(),
            rows: map.pyramid().rows(),
        }
    }

    /// The stored value that means height 1.
    #[inline(always)]
    pub fn unit(&self) -> f32 {
        self.texels.kind().unit()
    }

    /// Whole texel coordinates within one period of the map, or where it goes on for ever not much further from it than
    /// a curve reaches from its base.
    #[inline(always)]
    pub fn base(&self, base: [f64; 2]) -> [f32; 2] {
        [self.base_along(base[0], 0), self.base_along(base[1], 1)]
    }

    #[inline(always)]
    fn base_along(&self, base: f64, axis: usize) -> f32 {
        let n = f64::from(self.size[axis]);
        let folded = match self.wrap {
            Wrap::Repeat => base - n * (base / n).floor(),
            Wrap::Mirror => base - 2.0 * n * (base / (2.0 * n)).floor(),
            Wrap::Clamp => base.clamp(-FAR, n + FAR),
        };
        folded as f32
    }

    /// The finest level of the pyramid whose blocks are at least `size` texels in both directions.
    #[inline(always)]
    pub fn level(&self, size: f32) -> usize {
        // Blocks of level l are 8 << l across and 4 << l up: the exponent, 129 for sizes from 4 to 8.
        let exponent = (size.abs().to_bits() >> 23) as usize;
        exponent.saturating_sub(128).min(self.rows.count - 1)
    }

    /// Smallest and largest stored texel around boxes of texel coordinates ([low, high] in x and in y) no larger than a
    /// block of the level.
    #[inline(always)]
    pub fn block_range<L: Lanes>(&self, level: usize, x: [L; 2], y: [L; 2]) -> [L; 2] {
        let level = level % LevelRows::MOST;
        let per_x = L::splat(self.rows.per_block[0][level]);
        let per_y = L::splat(self.rows.per_block[1][level]);
        let is_inside = self.is_inside(x, y);
        let (x, y) = self.folded_boxes(is_inside, x, y);
        let mut i = [x[0] * per_x, x[1] * per_x];
        let mut j = [y[0] * per_y, y[1] * per_y];
        if !is_inside {
            let [last_i, last_j] = [0, 1].map(|axis| self.rows.last[axis][level] as f32);
            i[1] = self.within(i[1].floor(), L::splat(last_i));
            j[1] = self.within(j[1].floor(), L::splat(last_j));
        }
        L::block_ranges(self, level, i, j)
    }

    /// The same where every lane has its own size of box.
    #[inline(always)]
    pub fn block_ranges<L: Lanes>(&self, size: L, x: [L; 2], y: [L; 2]) -> [L; 2] {
        let is_inside = self.is_inside(x, y);
        let (x, y) = self.folded_boxes(is_inside, x, y);
        L::block_ranges_by_size(self, is_inside, size, x, y)
    }

    /// Whether boxes lie between the first and the last texels, where no wrap mode changes anything: so almost all do.
    #[inline(always)]
    fn is_inside<L: Lanes>(&self, x: [L; 2], y: [L; 2]) -> bool {
        let [width, height] = self.size;
        let before = x[0].min(y[0]);
        let behind = (L::splat(width - 1.0) - x[1]).min(L::splat(height - 1.0) - y[1]);
        before.min(behind).sign_mask() == 0
    }

    /// [`folded`](Self::folded) in x and in y, where boxes are not all inside.
    #[inline(always)]
    fn folded_boxes<L: Lanes>(&self, is_inside: bool, x: [L; 2], y: [L; 2]) -> ([L; 2], [L; 2]) {
        if is_inside {
            (x, y)
        } else {
            (self.folded(x, self.size[0]), self.folded(y, self.size[1]))
        }
    }

    /// The smallest folded coordinate of a box, or one in the same block, and where the box ends, which may be beyond the edge.
    #[inline(always)]
    fn folded<L: Lanes>(&self, [low, high]: [L; 2], n: f32) -> [L; 2] {
        let first = self.fold(low, n);
        match self.wrap {
            Wrap::Repeat => [first, first + (high - low)],
            Wrap::Clamp => [first, self.fold(high, n)],
            // Of a box that is folded back on itself the fold is within a block of the border.
            Wrap::Mirror => {
                let first = first.min(self.fold(high, n));
                [first, first + (high - low)]
            }
        }
    }

    /// The block in which a box ends: beyond the last there is the first again, or the last.
    #[inline(always)]
    fn within<L: Lanes>(&self, block: L, last: L) -> L {
        match self.wrap {
            Wrap::Repeat => (last - block).select_negative(L::splat(0.0), block),
            Wrap::Clamp | Wrap::Mirror => block.min(last),
        }
    }

    /// Whether a box of cells lies within the stored map, where nothing is folded.
    #[inline(always)]
    pub fn holds(&self, [i0, j0]: [f32; 2], [i1, j1]: [f32; 2]) -> bool {
        i0.min(i1) >= 1.0
            && j0.min(j1) >= 1.0
            && i0.max(i1) <= self.size[0] - 3.0
            && j0.max(j1) <= self.size[1] - 3.0
    }

    /// The stored texels at the corners (0,0) (1,0) (0,1) (1,1) of the cells (i, j), whole numbers within a few periods of
    /// the map, as the wrap mode continues it.
    #[inline(always)]
    pub fn corners<L: Lanes>(&self, i: L, j: L) -> [L; 4] {
        if self.wrap == Wrap::Repeat {
            let i = periodic(i, L::splat(self.size[0]));
            let j = periodic(j, L::splat(self.size[1]));
            return L::cell_corners(self, i, j);
        }
        let (i, mirrored_x, flat_x) = self.fold_cell(i, self.size[0]);
        let (j, mirrored_y, flat_y) = self.fold_cell(j, self.size[1]);
        let [h00, h10, h01, h11] = L::cell_corners(self, i, j);
        // Before the first texel there is only the first: both corners are its.
        let h10 = flat_x.select_negative(h00, h10);
        let h11 = flat_x.select_negative(h01, h11);
        let h01 = flat_y.select_negative(h00, h01);
        let h11 = flat_y.select_negative(h10, h11);
        let ((h00, h10), (h01, h11)) =
            (swapped(mirrored_x, h00, h10), swapped(mirrored_x, h01, h11));
        let ((h00, h01), (h10, h11)) =
            (swapped(mirrored_y, h00, h01), swapped(mirrored_y, h10, h11));
        [h00, h10, h01, h11]
    }

    /// A cell along a side of n texels: the stored cell, and, as sign bits, whether it runs backwards and whether it lies
    /// before the first texel.
    #[inline(always)]
    fn fold_cell<L: Lanes>(&self, i: L, n: f32) -> (L, L, L) {
        let (zero, one, size) = (L::splat(0.0), L::splat(1.0), L::splat(n));
        match self.wrap {
            Wrap::Repeat => (periodic(i, size), zero, zero),
            Wrap::Clamp => (i.max(zero).min(size - one), zero, i),
            Wrap::Mirror => {
                let i = periodic(i, size + size);
                // Cells n .. 2n-1 run backwards; the last one lies between the first texel and itself.
                let backward = size - one - i;
                let cell = backward.select_negative(size + size - one - one - i, i);
                (cell.max(zero), backward, cell)
            }
        }
    }

    /// Stored height (see [`DisplacementMap::unit`]) at texel coordinates, bilinear.
    #[inline(always)]
    pub fn sample<L: Lanes>(&self, x: L, y: L) -> L {
        let (x, y) = (self.fold(x, self.size[0]), self.fold(y, self.size[1]));
        // The last cell's right corners are stored too: see `DisplacementMap`.
        let i = x.floor().min(L::splat(self.size[0] - 1.0));
        let j = y.floor().min(L::splat(self.size[1] - 1.0));
        let (fx, fy) = (x - i, y - j);
        let [h00, h10, h01, h11] = L::cell_corners(self, i, j);
        let bottom = fx.mul_add(h10 - h00, h00);
        let top = fx.mul_add(h11 - h01, h01);
        fy.mul_add(top - bottom, bottom)
    }

    /// [`Wrap::fold`] in lanes.
    #[inline(always)]
    fn fold<L: Lanes>(&self, x: L, n: f32) -> L {
        let (zero, last) = (L::splat(0.0), L::splat(n - 1.0));
        match self.wrap {
            Wrap::Repeat => {
                let periods = (x * L::splat(1.0 / n)).floor();
                periods.mul_add(L::splat(-n), x).max(zero).min(L::splat(n))
            }
            Wrap::Clamp => x.max(zero).min(last),
            Wrap::Mirror => {
                let half = L::splat(0.5);
                let from_edge = x + half;
                let periods = from_edge.mul_add(L::splat(0.5 / n), half).floor();
                let signed = periods.mul_add(L::splat(-2.0 * n), from_edge);
                (signed.max(zero - signed) - half).max(zero).min(last)
            }
        }
    }
}

/// Nine in a row.
#[inline(always)]
fn nine<T>(stored: &[T], index: usize) -> Option<&[T; LANES + 1]> {
    stored.get(index..)?.first_chunk()
}

/// `(b, a)` where the sign bit is set, `(a, b)` elsewhere.
#[inline(always)]
fn swapped<L: Lanes>(sign: L, a: L, b: L) -> (L, L) {
    (sign.select_negative(b, a), sign.select_negative(a, b))
}

/// i modulo n, for whole numbers below 2^24: all is exact but the quotient, which may be one off.
#[inline(always)]
fn periodic<L: Lanes>(i: L, n: L) -> L {
    let i = i - n * (i / n).floor();
    let i = i.select_negative(i + n, i);
    (i - n).select_negative(i, i - n)
}

#[cfg(test)]
mod stored_tests;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Texels;
    use glam::DVec2;

    fn maps() -> Vec<DisplacementMap> {
        let height = |i: usize| (i * 2654435761) >> 7;
        let (w, h) = (7, 5);
        let mut maps = Vec::new();
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            for texels in [
                Texels::U8((0..w * h).map(|i| height(i) as u8).collect()),
                Texels::U16((0..w * h).map(|i| height(i) as u16).collect()),
                Texels::F32(
                    (0..w * h)
                        .map(|i| height(i) as u16 as f32 / 7.0 - 3.0)
                        .collect(),
                ),
            ] {
                maps.push(DisplacementMap::new(w, h, texels, wrap).unwrap());
            }
        }
        maps
    }

    /// Of several levels, and of sides that no block divides.
    fn larger_maps() -> impl Iterator<Item = DisplacementMap> {
        let sizes = [(37, 64), (64, 50), (9, 33)];
        let all = sizes.map(|(w, h)| {
            [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror].map(|wrap| {
                let texel = |i: usize| ((i * 2654435761) >> 7) as u16;
                let texels = Texels::U16((0..w * h).map(texel).collect());
                DisplacementMap::new(w, h, texels, wrap).unwrap()
            })
        });
        all.into_iter().flatten()
    }

    fn samples_like_the_map<L: Lanes>() {
        for map in maps() {
            let grid = Grid::new(&map);
            for k in 0..200 {
                let x: [f32; LANES] =
                    std::array::from_fn(|l| (k * 8 + l as i32 - 800) as f32 * 0.0371);
                let y: [f32; LANES] =
                    std::array::from_fn(|l| (k * 3 + l as i32 * 5 - 300) as f32 * 0.0673);
                let got = grid.sample(L::from_array(x), L::from_array(y)).to_array();
                for l in 0..LANES {
                    let want = map.sample(DVec2::new(x[l].into(), y[l].into())).height as f32;
                    let unit = map.unit();
                    assert!(
                        (got[l] / unit - want).abs() < 1e-4 * want.abs().max(1.0),
                        "{:?} {}",
                        map.wrap(),
                        x[l]
                    );
                }
            }
        }
    }

    fn finds_every_lanes_level<L: Lanes>() {
        for map in maps() {
            let grid = Grid::new(&map);
            for k in 0..60 {
                let lane = |l: usize, by: f32| (k * 8 + l as i32 - 240) as f32 * by;
                let x: [f32; LANES] = std::array::from_fn(|l| lane(l, 0.113));
                let y: [f32; LANES] = std::array::from_fn(|l| lane(7 - l, 0.071));
                let size: [f32; LANES] = std::array::from_fn(|l| 0.37 * 1.9f32.powi(l as i32));
                let right = std::array::from_fn(|l| x[l] + size[l]);
                let top = std::array::from_fn(|l| y[l] + size[l]);
                let [x, y] = [[x, right], [y, top]].map(|box_| box_.map(L::from_array));
                let found = grid.block_ranges(L::from_array(size), x, y);
                let found = found.map(L::to_array);
                for l in 0..LANES {
                    let level = grid.level(size[l]);
                    let one = grid.block_range(level, x, y).map(L::to_array);
                    assert_eq!(
                        [found[0][l], found[1][l]],
                        [one[0][l], one[1][l]],
                        "{level}"
                    );
                }
            }
        }
    }

    fn four_blocks_hold_a_box<L: Lanes>() {
        let mut state = 1u64;
        let mut number = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(99);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        for map in maps().into_iter().chain(larger_maps()) {
            let grid = Grid::new(&map);
            for _ in 0..300 {
                let size = 40.0 * number() * number();
                let mut along = |n: f32| {
                    let low: [f32; LANES] = std::array::from_fn(|_| 3.0 * n * (number() - 0.5));
                    let high = low.map(|low| low + size * number());
                    [low, high]
                };
                let (x, y) = (along(grid.size[0]), along(grid.size[1]));
                let lanes = [x, y].map(|box_| box_.map(L::from_array));
                let level = grid.level(size + 0.01);
                let found = grid.block_range(level, lanes[0], lanes[1]);
                let [low, high] = found.map(|h| h.to_array().map(|h| h / grid.unit()));
                for l in 0..LANES {
                    for _ in 0..20 {
                        let at = |[low, high]: &[[f32; LANES]; 2], part: f32| {
                            f64::from(low[l]) + f64::from(high[l] - low[l]) * f64::from(part)
                        };
                        let place = DVec2::new(at(&x, number()), at(&y, number()));
                        let height = map.sample(place).height as f32;
                        let off = 1e-4 * height.abs().max(1.0);
                        assert!(
                            height >= low[l] - off && height <= high[l] + off,
                            "{:?} level {level} {place} {height} {} {}",
                            map.wrap(),
                            low[l],
                            high[l]
                        );
                    }
                }
            }
        }
    }

    fn survives_any_coordinate<L: Lanes>() {
        for map in maps() {
            let grid = Grid::new(&map);
            let odd = [
                f32::NAN,
                f32::INFINITY,
                f32::NEG_INFINITY,
                1e30,
                -1e30,
                f32::MIN_POSITIVE,
                7.0,
                -0.0,
            ];
            for shift in 0..LANES {
                let y = std::array::from_fn(|l| odd[(l + shift) % LANES]);
                let (x, y) = (L::from_array(odd), L::from_array(y));
                grid.sample(x, y);
                grid.block_ranges(x, [x, x], [y, y]);
                grid.block_ranges(y, [x, x], [y, y]);
            }
        }
    }

    fn moves_lanes<L: Lanes>() {
        let x = L::from_array([1.0, -2.0, 3.0, 9.0, -5.0, 6.0, 7.0, 8.0]);
        assert_eq!(
            x.next().to_array(),
            [-2.0, 3.0, 9.0, -5.0, 6.0, 7.0, 8.0, 8.0]
        );
        assert_eq!(x.max_lane(), 9.0);
        assert_eq!(x.next().next().next().next().max_lane(), 8.0);
        assert_eq!(x.sign_mask(), 0b0001_0010);
        assert_eq!(
            x.next_of(L::splat(0.5)).to_array(),
            [-2.0, 3.0, 9.0, -5.0, 6.0, 7.0, 8.0, 0.5]
        );
        let two = L::splat(2.0);
        let doubled = x.to_array().map(|x| 1.0 - 2.0 * x);
        assert_eq!(x.neg_mul_add(two, L::splat(1.0)).to_array(), doubled);
        assert_eq!(x.abs().to_array(), x.to_array().map(f32::abs));
        let chosen = x.select_negative(L::splat(0.0), x);
        assert_eq!(chosen.to_array(), x.to_array().map(|x| x.max(0.0)));
        let chosen = L::choose(0b0100_1001, two, x).to_array();
        assert_eq!(chosen, [2.0, -2.0, 3.0, 2.0, -5.0, 6.0, 2.0, 8.0]);
        let bits = x.to_array().map(|x| AtomicU32::new(x.to_bits()));
        assert_eq!(L::from_bits(&bits).to_array(), x.to_array());
    }

    /// The bits of all that lanes do with any numbers but NaN.
    fn results<L: Lanes>() -> Vec<[u32; LANES]> {
        let odd = [
            0.0,
            -0.0,
            1.0,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::MIN_POSITIVE,
            -1e-45,
            3e38,
        ];
        let mut state = 9u64;
        let mut number = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(5);
            let bits = (state >> 32) as u32;
            match bits % 4 {
                0 => odd[(bits >> 8) as usize % odd.len()],
                1 => (bits >> 20) as f32 - 2048.0,
                _ => f32::from_bits(bits & !(1 << 30) | (bits & 1) << 25),
            }
        };
        let mut all = Vec::new();
        for _ in 0..2000 {
            let [a, b, c]: [L; 3] =
                std::array::from_fn(|_| L::from_array(std::array::from_fn(|_| number())));
            let choice = a.sign_mask();
            let rows = [
                a + b,
                a - b,
                a * b,
                a / b,
                a.mul_add(b, c),
                a.neg_mul_add(b, c),
                a.min(b),
                a.max(b),
                a.floor(),
                a.abs().sqrt(),
                a.select_negative(b, c),
                L::choose(choice, b, c),
                a.next(),
                a.next_of(b),
                L::splat(a.max_lane()),
            ];
            let bits = |x: f32| if x.is_nan() { u32::MAX } else { x.to_bits() };
            all.extend(rows.map(|row| row.to_array().map(bits)));
        }
        all
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn levels_agree_to_the_bit() {
        if SimdLevel::Avx2.is_supported() {
            let (baseline, avx2) = (results::<Portable>(), results::<Avx2>());
            for (k, (a, b)) in baseline.iter().zip(&avx2).enumerate() {
                assert_eq!(a, b, "operation {}", k % 15);
            }
        }
    }

    #[test]
    fn baseline_samples_the_map() {
        moves_lanes::<Portable>();
        samples_like_the_map::<Portable>();
        finds_every_lanes_level::<Portable>();
        four_blocks_hold_a_box::<Portable>();
        survives_any_coordinate::<Portable>();
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn avx2_samples_the_map() {
        if SimdLevel::Avx2.is_supported() {
            moves_lanes::<Avx2>();
            samples_like_the_map::<Avx2>();
            finds_every_lanes_level::<Avx2>();
            four_blocks_hold_a_box::<Avx2>();
            survives_any_coordinate::<Avx2>();
        }
    }
}
