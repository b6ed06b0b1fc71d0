//! One side of the map cut into blocks: which entries make up which, and which an edit touches.

use std::ops::Range;

use super::super::Wrap;

/// One side of the map at one level of the pyramid.
#[derive(Clone, Copy, Debug)]
pub struct Axis {
    /// Texels of the side, n.
    pub texels: usize,
    pub wrap: Wrap,
    /// log2 of the block's side B.
    pub shift: u32,
}

impl Axis {
    /// Number of blocks: the least that hold all n cells.
    pub fn blocks(self) -> usize {
        self.texels.div_ceil(self.side())
    }

    /// The same side with blocks of twice the size.
    pub fn coarser(self) -> Self {
        Self {
            shift: self.shift + 1,
            ..self
        }
    }

    fn side(self) -> usize {
        1 << self.shift
    }

    /// The entries of this level whose union covers entry `i` of the next: unfolded [2Bi, 2Bi + 2B] is
    /// [2Bi, 2Bi + B], which is entry 2i, and [2Bi + B, 2Bi + 2B], which is entry 2i + 1 where there is one. Only
    /// the last `i` may have none; what is beyond the edge is then the folded map. A repeat is cut at the same places only
    /// if n is a multiple of B, a mirrored map never (texel n - 1 comes twice); else two entries are needed, which reach
    /// less than B too far.
    pub fn parts(self, i: usize) -> Parts {
        let (b, n) = (self.side(), self.texels);
        let start = b * (2 * i + 1);
        if start < n {
            return Parts::new(2 * i, [2 * i + 1; 2]);
        }
        if self.blocks() == 1 {
            return Parts::new(0, [0; 2]); // covers the whole side
        }
        let beyond = match self.wrap {
            // Only the last texel, which entry 2i has.
            Wrap::Clamp => [2 * i; 2],
            // From start - n < B on.
            Wrap::Repeat => [0, usize::from(start > n)],
            // [low, high] backwards; 2Bi < n and B < n make `high` not negative.
            Wrap::Mirror => {
                let (low, high) = ((2 * n - 1).saturating_sub(start + b), 2 * n - 1 - start);
                let first = low / b;
                let enough = first * b + b >= high;
                [first, if enough { first } else { first + 1 }]
            }
        };
        Parts::new(2 * i, beyond)
    }

    /// The entries, [Bi, Bi + B] unfolded, that hold a texel of `first..=last`.
    pub fn holding(self, first: usize, last: usize) -> Ranges {
        let (b, n, blocks) = (self.side(), self.texels, self.blocks());
        let reach = b * blocks; // the last texel of the last entry
        let mut found = Vec::new();
        let mut image = |first: usize, last: usize| {
            let from = first.saturating_sub(b).div_ceil(b);
            found.push(from..blocks.min(last / b + 1));
        };
        match self.wrap {
            Wrap::Clamp => image(first, if last == n - 1 { reach } else { last }),
            Wrap::Repeat => {
                for shift in (0..=reach - first).step_by(n) {
                    image(first + shift, last + shift);
                }
            }
            Wrap::Mirror => {
                for shift in (0..=reach).step_by(2 * n) {
                    image(first + shift, last + shift);
                    image(2 * n - 1 - last + shift, 2 * n - 1 - first + shift);
                }
            }
        }
        Ranges::new(found)
    }

    /// The entries of the next level with a part among `changed` of this one.
    pub fn made_of(self, changed: &Ranges) -> Ranges {
        let blocks = self.coarser().blocks();
        let regular = |r: &Range<usize>| r.start / 2..blocks.min(r.end.div_ceil(2));
        let mut found: Vec<_> = changed.0.iter().map(regular).collect();
        let last = self.parts(blocks - 1);
        if last.iter().any(|part| changed.contains(part)) {
            found.push(blocks - 1..blocks);
        }
        Ranges::new(found)
    }
}

/// One to three indices of entries.
#[derive(Clone, Copy, Debug)]
pub struct Parts {
    all: [usize; 3],
    count: usize,
}

impl Parts {
    fn new(first: usize, [second, third]: [usize; 2]) -> Self {
        let count = match (second == first, third == second) {
            (true, true) => 1,
            (false, true) => 2,
            (_, false) => 3,
        };
        Self {
            all: [first, second, third],
            count,
        }
    }

    pub fn first(self) -> usize {
        self.all[0]
    }

    pub fn others(self) -> impl Iterator<Item = usize> {
        (1..self.count).map(move |k| self.all[k])
    }

    pub fn iter(&self) -> impl Iterator<Item = usize> {
        self.all[..self.count].iter().copied()
    }
}

/// Indices as sorted ranges that do not overlap.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranges(Vec<Range<usize>>);

impl Ranges {
    fn new(mut ranges: Vec<Range<usize>>) -> Self {
        ranges.retain(|r| !r.is_empty());
        ranges.sort_unstable_by_key(|r| r.start);
        ranges.dedup_by(|next, last| {
            let joined = next.start <= last.end;
            if joined {
                last.end = last.end.max(next.end);
            }
            joined
        });
        Self(ranges)
    }

    pub fn iter(&self) -> impl Iterator<Item = Range<usize>> {
        self.0.iter().cloned()
    }

    fn contains(&self, i: usize) -> bool {
        self.0.iter().any(|r| r.contains(&i))
    }
}
