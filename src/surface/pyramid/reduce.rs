//! The reductions: texels to the finest entries, entries to coarser ones. Pure; both a whole pyramid and an edit of
//! it use them.

use super::axis::{Axis, Parts};
use super::entries::{Bounds, Pack};

/// Columns and rows of texels that one finest entry holds beyond its own block of [`SIDE`].
pub const BEYOND: usize = SIDE + 1;

/// Cells across the finest blocks.
pub const SIDE: usize = 4;

/// The smallest and largest of every column of some rows.
pub struct Strip<T> {
    low: Vec<T>,
    high: Vec<T>,
    /// The same of columns 4i .. 4i + 4.
    low_of_four: Vec<T>,
    high_of_four: Vec<T>,
}

// The loops below are of the form that the compiler turns into vector code: slices side by side, no index.
impl<T: Copy + PartialOrd> Strip<T> {
    fn new() -> Self {
        Self {
            low: Vec::new(),
            high: Vec::new(),
            low_of_four: Vec::new(),
            high_of_four: Vec::new(),
        }
    }

    /// Of four rows of one length.
    fn set_rows(&mut self, [a, b, c, d]: [&[T]; SIDE]) {
        let all = || a.iter().zip(b).zip(c.iter().zip(d));
        let low = all().map(|((&a, &b), (&c, &d))| min(min(a, b), min(c, d)));
        replace(&mut self.low, low);
        let high = all().map(|((&a, &b), (&c, &d))| max(max(a, b), max(c, d)));
        replace(&mut self.high, high);
    }

    /// Of two strips and a row more.
    fn set_union(&mut self, a: &Self, b: &Self, row: &[T]) {
        let low = a.low.iter().zip(&b.low).zip(row);
        let high = a.high.iter().zip(&b.high).zip(row);
        replace(
            &mut self.low,
            low.map(|((&a, &b), &row)| min(min(a, b), row)),
        );
        replace(
            &mut self.high,
            high.map(|((&a, &b), &row)| max(max(a, b), row)),
        );
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
        let low = self.low.chunks_exact(SIDE);
        let high = self.high.chunks_exact(SIDE);
        replace(
            &mut self.low_of_four,
            low.map(|c| min(min(c[0], c[1]), min(c[2], c[3]))),
        );
        replace(
            &mut self.high_of_four,
            high.map(|c| max(max(c[0], c[1]), max(c[2], c[3]))),
        );
    }

    /// Smallest and largest of columns 4i ..= 4i + 8, for each i that has them.
    pub fn entries(&self) -> impl Iterator<Item = (T, T)> {
        // One block, the next, and the first column of the one after it.
        let low = self.low_of_four.iter().zip(&self.low_of_four[1..]);
        let high = self.high_of_four.iter().zip(&self.high_of_four[1..]);
        let beyond = self.low[2 * SIDE..].chunks(SIDE);
        let beyond = beyond.zip(self.high[2 * SIDE..].chunks(SIDE));
        low.zip(high).zip(beyond).map(
            |(((&low, &next_low), (&high, &next_high)), (last_low, last_high))| {
                (
                    min(min(low, next_low), last_low[0]),
                    max(max(high, next_high), last_high[0]),
                )
            },
        )
    }
}

fn replace<T>(column: &mut Vec<T>, by: impl Iterator<Item = T>) {
    column.clear();
    column.extend(by);
}

/// Block rows `rows` of the finest level: each as a strip of at least `length` columns over texel rows
/// 4j ..= 4j + 8, unfolded, which `row` gives; missing columns are copies of column `source(index)`.
pub fn finest<'t, T: Copy + PartialOrd + 't>(
    rows: std::ops::Range<usize>,
    length: usize,
    row: impl Fn(usize) -> &'t [T],
    source: impl Fn(usize) -> usize,
    mut done: impl FnMut(usize, &Strip<T>),
) {
    let four = |j: usize| [0, 1, 2, 3].map(|k| row(SIDE * j + k));
    let (mut own, mut next, mut all) = (Strip::new(), Strip::new(), Strip::new());
    next.set_rows(four(rows.start));
    for j in rows {
        std::mem::swap(&mut own, &mut next);
        next.set_rows(four(j + 1));
        all.set_union(&own, &next, row(SIDE * (j + 2)));
        all.extend(length, &source);
        all.join_columns();
        done(j, &all);
    }
}

/// Columns of texels under `blocks` finest entries side by side.
pub fn columns(blocks: usize) -> usize {
    SIDE * blocks + BEYOND
}

/// Entry (i, j) of the level above the one that `entry` reads and `x` and `y` describe.
pub fn coarser<T: Copy + PartialOrd>(
    [x, y]: [Axis; 2],
    (i, j): (usize, usize),
    entry: impl Fn(usize, usize) -> Bounds<T>,
) -> Bounds<T> {
    let rows = y.parts(j);
    union(x.parts(i), |i| union(rows, |j| entry(i, j)))
}

/// All entries of row j as [`coarser`] makes them, with fewer reads: where entry i is 2i and 2i + 2, the second is the
/// first of entry i + 1.
pub fn coarser_row<T: Pack>(
    [x, y]: [Axis; 2],
    j: usize,
    entry: impl Fn(usize, usize) -> Bounds<T>,
    row: &mut [T::Packed],
) {
    let rows = y.parts(j);
    let column = |i: usize| union(rows, |j| entry(i, j));
    let mut left = column(0);
    let regular = (x.blocks() - 1) / 2;
    for (i, out) in row[..regular].iter_mut().enumerate() {
        let right = column(2 * i + 2);
        *out = T::pack(joined(left, right));
        left = right;
    }
    for (i, out) in row.iter_mut().enumerate().skip(regular) {
        *out = T::pack(union(x.parts(i), column));
    }
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
