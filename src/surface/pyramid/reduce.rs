//! The reductions: texels to the finest entries, entries to coarser ones. Pure; both a whole pyramid and an edit of
//! it use them.

use super::axis::Axis;
use super::entries::Bounds;

/// Columns and rows of texels that one finest entry holds beyond its own block of [`SIDE`].
pub const BEYOND: usize = SIDE + 1;

/// Cells across the finest blocks.
pub const SIDE: usize = 4;

/// The smallest and largest of every column of some rows.
pub struct Strip<T> {
    low: Vec<T>,
    high: Vec<T>,
}

impl<T: Copy + PartialOrd> Strip<T> {
    fn new() -> Self {
        Self {
            low: Vec::new(),
            high: Vec::new(),
        }
    }

    /// Of four rows of one length.
    fn set_rows(&mut self, [a, b, c, d]: [&[T]; SIDE]) {
        let all = || a.iter().zip(b).zip(c.iter().zip(d));
        self.low.clear();
        self.low
            .extend(all().map(|((&a, &b), (&c, &d))| min(min(a, b), min(c, d))));
        self.high.clear();
        self.high
            .extend(all().map(|((&a, &b), (&c, &d))| max(max(a, b), max(c, d))));
    }

    /// Of two strips and a row more.
    fn set_union(&mut self, a: &Self, b: &Self, row: &[T]) {
        self.low.clear();
        self.low.extend(
            (a.low.iter().zip(&b.low).zip(row)).map(|((&a, &b), &row)| min(min(a, b), row)),
        );
        self.high.clear();
        self.high.extend(
            (a.high.iter().zip(&b.high).zip(row)).map(|((&a, &b), &row)| max(max(a, b), row)),
        );
    }

    /// Adds columns up to `length`, each a copy of column `source(index)`.
    fn extend(&mut self, length: usize, source: impl Fn(usize) -> usize) {
        for i in self.low.len()..length {
            self.low.push(self.low[source(i)]);
            self.high.push(self.high[source(i)]);
        }
    }

    /// Smallest and largest of columns 4i ..= 4i + 8, for each i that has them.
    pub fn entries(&self) -> impl Iterator<Item = (T, T)> {
        let count = self.low.len().saturating_sub(BEYOND) / SIDE;
        let (low, high) = (&self.low[..], &self.high[..]);
        (0..count).map(move |i| {
            let at = SIDE * i;
            let (l, h) = (&low[at..at + SIDE + BEYOND], &high[at..at + SIDE + BEYOND]);
            (
                l.iter().fold(l[0], |a, &b| min(a, b)),
                h.iter().fold(h[0], |a, &b| max(a, b)),
            )
        })
    }
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
    let mut bounds: Option<Bounds<T>> = None;
    for j in y.parts(j).iter() {
        for i in x.parts(i).iter() {
            let (low, high) = entry(i, j);
            bounds = Some(bounds.map_or((low, high), |(a, b)| (min(a, low), max(b, high))));
        }
    }
    // There is always a first part.
    bounds.unwrap_or_else(|| entry(0, 0))
}

#[inline(always)]
fn min<T: PartialOrd>(a: T, b: T) -> T {
    if b < a { b } else { a }
}

#[inline(always)]
fn max<T: PartialOrd>(a: T, b: T) -> T {
    if b > a { b } else { a }
}
