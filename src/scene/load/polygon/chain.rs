//! Whether a closed chain of edges meets itself, by a tree of boxes over its edges in their order.

use glam::DVec2;

/// Axis-aligned, closed.
#[derive(Clone, Copy)]
struct Rect {
    min: DVec2,
    max: DVec2,
}

impl Rect {
    fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    fn meets(self, other: Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }
}

/// The edges of a polygon.
pub(super) struct Chain<'a> {
    points: &'a [DVec2],
    /// Boxes of the single edges, of pairs of them, of pairs of these, up to one of all.
    levels: Vec<Vec<Rect>>,
}

impl<'a> Chain<'a> {
    /// Of at least three corners.
    pub(super) fn new(points: &'a [DVec2]) -> Self {
        let after = points.iter().cycle().skip(1);
        let edges = points.iter().zip(after).map(|(&p, &q)| Rect {
            min: p.min(q),
            max: p.max(q),
        });
        let mut levels = vec![edges.collect::<Vec<_>>()];
        while let Some(last) = levels.last().filter(|boxes| boxes.len() > 1) {
            let pairs = last.chunks(2);
            let united = pairs.map(|pair| pair[1..].iter().copied().fold(pair[0], Rect::union));
            let united = united.collect();
            levels.push(united);
        }
        Self { points, levels }
    }

    /// Whether no two edges meet but neighbours in their corner. False, too, where it takes more than `steps`, from which what it takes is taken.
    pub(super) fn is_simple(&self, steps: &mut u64) -> bool {
        let mut pending = vec![(self.levels.len() - 1, 0, 0)];
        while let Some((level, i, j)) = pending.pop() {
            let Some(left) = steps.checked_sub(1) else {
                return false;
            };
            *steps = left;
            let boxes = &self.levels[level];
            if i != j && !boxes[i].meets(boxes[j]) {
                continue;
            }
            if level == 0 {
                if i != j && self.edges_meet(i, j) {
                    return false;
                }
                continue;
            }
            let below = self.levels[level - 1].len();
            for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let (a, b) = (2 * i + a, 2 * j + b);
                // Each pair once.
                if a < below && b < below && (i != j || a <= b) {
                    pending.push((level - 1, a, b));
                }
            }
        }
        true
    }

    /// Whether two edges whose boxes meet do so, other than neighbours in their corner.
    fn edges_meet(&self, i: usize, j: usize) -> bool {
        let n = self.points.len();
        let corner = |i: usize| self.points[i % n];
        let ([p, q], [r, s]) = ([i, i + 1].map(corner), [j, j + 1].map(corner));
        let side = |a: DVec2, b: DVec2, c: DVec2| (b - a).perp_dot(c - a);
        if (i + 1) % n == j || (j + 1) % n == i {
            // Neighbours: only one that goes back over the other.
            return side(p, q, if q == r { s } else { r }) == 0.0 && (q - p).dot(s - r) < 0.0;
        }
        side(p, q, r) * side(p, q, s) <= 0.0 && side(r, s, p) * side(r, s, q) <= 0.0
    }
}
