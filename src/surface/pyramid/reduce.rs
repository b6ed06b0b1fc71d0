//! The reductions: texels to the finest entries, entries to coarser ones. Pure; both a whole pyramid and an edit of
//! it use them.

use super::axis::{Axis, Parts};
use super::entries::Bounds;

/// Columns and rows of texels that one finest entry holds beyond its own block of [`WIDTH`] and [`HEIGHT`].
const BEYOND: usize = 1;

/// Cells across the finest blocks.
pub const WIDTH: usize = 8;

/// Cells up the finest blocks.
pub const HEIGHT: usize = 4;

/// The smallest and largest of every column of some rows.
pub struct Strip<T> {
    low: Vec<T>,
    high: Vec<T>,
    /// The same of columns 8i .. 8i + 8.
    low_of_block: Vec<T>,
    high_of_block: Vec<T>,
}

// The loops below are of the form that the compiler turns into vector code: slices side by side, no index.
impl<T: Copy + PartialOrd> Strip<T> {
    fn new() -> Self {
        Self {
            low: Vec::new(),
            high: Vec::new(),
            low_of_block: Vec::new(),
            high_of_block: Vec::new(),
        }
    }

    /// Of five rows of one length.
    fn set_rows(&mut self, [a, b, c, d, e]: [&[T]; HEIGHT + BEYOND]) {
        let all = || a.iter().zip(b).zip(c.iter().zip(d)).zip(e);
        let low = all().map(|(((&a, &b), (&c, &d)), &e)| min(min(min(a, b), min(c, d)), e));
        replace(&mut self.low, low);
        let high = all().map(|(((&a, &b), (&c, &d)), &e)| max(max(max(a, b), max(c, d)), e));
        replace(&mut self.high, high);
    }

    /// Adds columns up to `length`, each a copy of column `source(index)`.
    fn extend(&mut self, length: usize, source: impl Fn(usize) -> usize) {
        for i in self.low.len()..length {
            self.low.push(self.low[source(i)]);
            self.high.push(self.high[source(i)]);
        }
    }

    /// Prepares [`Self::entries`] of the columns there are.
    fn join_columns(&mut self) {
        let (low, _) = self.low.as_chunks();
        let (high, _) = self.high.as_chunks();
        replace(
            &mut self.low_of_block,
            low.iter().map(|&c| of_block(c, min)),
        );
        replace(
            &mut self.high_of_block,
            high.iter().map(|&c| of_block(c, max)),
        );
    }

    /// Smallest and largest of columns 8i ..= 8i + 8, for each i that has them.
    pub fn entries(&self) -> impl Iterator<Item = (T, T)> {
        // One block, and the first column of the next.
        let low = (self.low_of_block.iter()).zip(self.low[WIDTH..].chunks(WIDTH));
        let high = (self.high_of_block.iter()).zip(self.high[WIDTH..].chunks(WIDTH));
        low.zip(high).map(|((&low, next_low), (&high, next_high))| {
            (min(low, next_low[0]), max(high, next_high[0]))
        })
    }
}

/// The columns of a block as one, halves first.
#[inline(always)]
fn of_block<T: Copy>(c: [T; WIDTH], one: impl Fn(T, T) -> T) -> T {
    let four: [T; 4] = std::array::from_fn(|i| one(c[i], c[i + 4]));
    one(one(four[0], four[2]), one(four[1], four[3]))
}

fn replace<T>(column: &mut Vec<T>, by: impl Iterator<Item = T>) {
    column.clear();
    column.extend(by);
}

/// Block rows `rows` of the finest level: each as a strip of at least `length` columns over texel rows
/// 4j ..= 4j + 4, unfolded, which `row` gives; missing columns are copies of column `source(index)`.
pub fn finest<'t, T: Copy + PartialOrd + 't>(
    rows: std::ops::Range<usize>,
    length: usize,
    row: impl Fn(usize) -> &'t [T],
    source: impl Fn(usize) -> usize,
    mut done: impl FnMut(usize, &Strip<T>),
) {
    let mut strip = Strip::new();
    for j in rows {
        strip.set_rows(std::array::from_fn(|k| row(HEIGHT * j + k)));
        strip.extend(length, &source);
        strip.join_columns();
        done(j, &strip);
    }
}

/// Columns of texels under `blocks` finest entries side by side.
pub fn columns(blocks: usize) -> usize {
    WIDTH * blocks + BEYOND
}

/// Rows of texels under `blocks` finest entries one above the other.
pub fn rows(blocks: usize) -> usize {
    HEIGHT * blocks + BEYOND
}

/// Entry (i, j) of the level above the one that `entry` reads and `x` and `y` describe.
#[inline(always)]
pub fn coarser<T: Copy + PartialOrd>(
    [x, y]: [Axis; 2],
    (i, j): (usize, usize),
    entry: impl Fn(usize, usize) -> Bounds<T>,
) -> Bounds<T> {
    let rows = y.parts(j);
    union(x.parts(i), |i| union(rows, |j| entry(i, j)))
}

#[inline(always)]
fn union<T: Copy + PartialOrd>(parts: Parts, bounds: impl Fn(usize) -> Bounds<T>) -> Bounds<T> {
    let all = bounds(parts.first());
    parts.others().fold(all, |all, k| joined(all, bounds(k)))
}

#[inline(always)]
fn joined<T: PartialOrd>(a: Bounds<T>, b: Bounds<T>) -> Bounds<T> {
    (min(a.0, b.0), max(a.1, b.1))
}

#[inline(always)]
fn min<T: PartialOrd>(a: T, b: T) -> T {
    if b < a { b } else { a }
}

#[inline(always)]
fn max<T: PartialOrd>(a: T, b: T) -> T {
    if b > a { b } else { a }
}
