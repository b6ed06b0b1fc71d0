//! The children of a span that is cut up: where they end, and which of them wait for a later round.

use crate::prism::simd::{LANES, Lanes};

/// See [`Stack`].
const MOST: usize = 160;

/// Spans waiting, the next one last.
pub struct Stack {
    spans: [[f32; 2]; MOST],
    count: usize,
}

impl Stack {
    /// Spans that can wait.
    const MOST: usize = MOST;

    #[inline(always)]
    pub fn new() -> Self {
        Self {
            spans: [[0.0; 2]; MOST],
            count: 0,
        }
    }

    #[inline(always)]
    pub fn pop(&mut self) -> Option<[f32; 2]> {
        self.count = self.count.checked_sub(1)?;
        Some(self.spans[self.count])
    }

    /// Takes in the named children of a span that was cut into `count`.
    #[inline(always)]
    pub fn postpone(&mut self, mut children: u32, count: usize, span: [f32; 2]) {
        if self.count + 2 * LANES > Self::MOST && children != 0 {
            // Never lost: two long spans instead of many short ones.
            let first = children.trailing_zeros() as usize;
            let last = 32 - children.leading_zeros() as usize;
            let (a, b) = (at(span, first, count), at(span, last, count));
            let middle = 0.5 * (a + b);
            self.push([middle, b]);
            self.push([a, middle]);
            return;
        }
        while children != 0 {
            let last = 31 - children.leading_zeros() as usize;
            children &= !(1 << last);
            self.push([at(span, last, count), at(span, last + 1, count)]);
        }
    }

    #[inline(always)]
    fn push(&mut self, span: [f32; 2]) {
        if self.count < Self::MOST {
            self.spans[self.count] = span;
            self.count += 1;
        }
    }
}

/// Where child k of a span that was cut into `count` begins.
#[inline(always)]
pub fn at(span: [f32; 2], k: usize, count: usize) -> f32 {
    if k == count {
        span[1]
    } else {
        span[0] + length(span, count) * k as f32
    }
}

/// How long each child of a span that was cut into `count`, 7 or 15, is.
#[inline(always)]
pub fn length([from, to]: [f32; 2], count: usize) -> f32 {
    (to - from) * if count < LANES { 1.0 / 7.0 } else { 1.0 / 15.0 }
}

/// One number for each end of up to 15 children.
pub type Row = [[f32; LANES]; 2];

/// The ends of up to 15 children.
pub struct Ends {
    pub children: usize,
    x: Row,
    y: Row,
    h: Row,
    /// Texel cells of (x, y).
    i: Row,
    j: Row,
    /// Largest minus smallest stored texel around each child.
    pub range: Row,
    /// Bit k: child k is wholly above the surface.
    pub above: u32,
    /// Bit k: child k is wholly below it.
    pub below: u32,
}

impl Ends {
    #[inline(always)]
    pub fn new<L: Lanes, const R: usize>(
        children: usize,
        x: &[L; R],
        y: &[L; R],
        h: &[L; R],
        range: &[L; R],
        [above, below]: [u32; 2],
    ) -> Self {
        // Of one register the second copy is never looked at.
        let last = R - 1;
        Self {
            children,
            x: [x[0].to_array(), x[last].to_array()],
            y: [y[0].to_array(), y[last].to_array()],
            h: [h[0].to_array(), h[last].to_array()],
            i: [x[0].floor().to_array(), x[last].floor().to_array()],
            j: [y[0].floor().to_array(), y[last].floor().to_array()],
            range: [range[0].to_array(), range[last].to_array()],
            above,
            below,
        }
    }

    #[inline(always)]
    pub fn point(&self, k: usize) -> [f32; 3] {
        [of(&self.x, k), of(&self.y, k), of(&self.h, k)]
    }

    #[inline(always)]
    pub fn cell(&self, k: usize) -> [f32; 2] {
        [of(&self.i, k), of(&self.j, k)]
    }

    /// Texel cells that the chord from end `a` to end `b` crosses.
    #[inline(always)]
    pub fn cells(&self, a: usize, b: usize) -> f32 {
        let ([i0, j0], [i1, j1]) = (self.cell(a), self.cell(b));
        (i1 - i0).abs() + (j1 - j0).abs() + 1.0
    }
}

#[inline(always)]
pub fn of(row: &Row, k: usize) -> f32 {
    row.as_flattened()[k & 15]
}
