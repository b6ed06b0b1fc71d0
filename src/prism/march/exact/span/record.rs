//! A walk that keeps what it does, for figures and for whoever wants to know: the walk's own functions, called in its order.

use super::super::children::Stack;
use super::super::signs::Signs;
use super::{Ends, Walker, at};
use crate::prism::simd::Lanes;
use crate::prism::{Fate, SpanChild};

impl Walker<'_> {
    /// [`Self::walk`], and what became of the children of every span, in order.
    pub fn record<L: Lanes>(&self, signs: &mut Signs<'_, L::Quad>) -> Vec<SpanChild> {
        let curve = signs.curve();
        let t = |s: f32| curve.seen(s.into())[0];
        let mut all = Vec::new();
        let (mut stack, mut depths) = (Stack::new(), Vec::new());
        let mut ahead = Some((self.whole, 0));
        signs.begin();
        while let Some((span, depth)) = ahead.take() {
            let (alive, ends) = self.children::<L>(span);
            let rest = if alive == 0 {
                0
            } else {
                self.visit::<L>(&ends, alive, span, signs)
            };
            all.extend((0..ends.children).map(|k| {
                let is = |bits: u32| bits >> k & 1 != 0;
                SpanChild {
                    depth,
                    t: [k, k + 1].map(|k| t(at(span, k, ends.children))),
                    heights: self.heights_around::<L>(&ends, span, k),
                    fate: match (is(alive), is(rest)) {
                        (false, _) => Fate::Skipped,
                        (true, true) => Fate::Cut,
                        (true, false) => Fate::Walked,
                    },
                }
            }));
            if signs.is_done() {
                break;
            }
            stack.postpone(rest, ends.children, span);
            depths.extend((0..rest.count_ones()).map(|_| depth + 1));
            ahead = stack.pop().zip(depths.pop());
        }
        // What was alive behind the hit was left as it was.
        if let Some(hit) = signs.nearest() {
            for child in &mut all {
                if child.fate != Fate::Skipped && child.t[0] > hit.t {
                    child.fate = Fate::Behind;
                }
            }
        }
        all
    }

    /// The range of the map that child k was held against.
    fn heights_around<L: Lanes>(&self, ends: &Ends, span: [f32; 2], k: usize) -> [f64; 2] {
        let (off, level) = self.boxes(ends.children, span);
        let (a, b) = (ends.point(k), ends.point(k + 1));
        let box_along = |axis: usize| {
            let base = self.base[axis];
            [
                L::splat(base + a[axis].min(b[axis]) - off),
                L::splat(base + a[axis].max(b[axis]) + off),
            ]
        };
        let range = self.grid.block_range(level, box_along(0), box_along(1));
        range.map(|h| f64::from(h.to_array()[0] / self.grid.unit()))
    }
}
