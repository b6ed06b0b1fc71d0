//! A large polygon in pieces, parted by diagonals.
//!
//! From a corner, straight up or down to the edge that is met there, and from that point along the edge to one of its ends: what reaches
//! into this triangle reaches in by corners, and the one of them nearest in angle to the vertical is seen from the first corner (D. Eberly,
//! Triangulation by Ear Clipping, section 3, does so for holes). Of some corners the diagonal is taken that parts the polygon most evenly.

use glam::DVec2;

/// From so many corners a diagonal is looked for.
const CANDIDATES: usize = 64;

/// Corners that may be looked at for each corner of the polygon: even parts need some hundred.
const LOOKS: usize = 1 << 14;

/// The corners' numbers of pieces with at most so many corners; the polygon is counter-clockwise. None if no diagonals were found:
/// its edges cross.
pub(super) fn pieces(corners: &[DVec2], most: usize) -> Option<Vec<Vec<u32>>> {
    let mut looks = corners.len().saturating_mul(LOOKS);
    let mut finished = Vec::new();
    let mut pending = vec![(0..corners.len() as u32).collect::<Vec<_>>()];
    while let Some(numbers) = pending.pop() {
        if numbers.len() <= most {
            finished.push(numbers);
            continue;
        }
        let ring = Ring::new(numbers.iter().map(|&i| corners[i as usize]).collect());
        let (i, j) = ring.diagonal(&mut looks)?;
        let mut behind = numbers[j..].to_vec();
        behind.extend_from_slice(&numbers[..=i]);
        pending.push(behind);
        pending.push(numbers[i..=j].to_vec());
    }
    Some(finished)
}

/// A piece on the way.
struct Ring {
    points: Vec<DVec2>,
}

impl Ring {
    /// Turned so that the vertical goes the short way.
    fn new(mut points: Vec<DVec2>) -> Self {
        let min = points.iter().copied().reduce(DVec2::min);
        let max = points.iter().copied().reduce(DVec2::max);
        let size = min.zip(max).map_or(DVec2::ZERO, |(min, max)| max - min);
        if size.x < size.y {
            for p in &mut points {
                *p = p.perp();
            }
        }
        Self { points }
    }

    /// The ends of a diagonal, the smaller first.
    fn diagonal(&self, looks: &mut usize) -> Option<(usize, usize)> {
        let n = self.points.len();
        let evenness = |(i, j): (usize, usize)| (j - i).min(n - (j - i));
        let mut best = None;
        for candidate in 0..CANDIDATES {
            // Scattered (multiplicative hashing), so as to be in step with no pattern of the corners.
            let scattered = (candidate as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
            let i = scattered as usize % n;
            for up in [1.0, -1.0] {
                let found = self.seen_from(i, up, looks)?.into_iter().flatten();
                let diagonals = found.map(|j| (i.min(j), i.max(j)));
                best = best
                    .into_iter()
                    .chain(diagonals)
                    .max_by_key(|&d| evenness(d));
            }
            // The longer it takes, the less even may the parts be.
            if best.is_some_and(|d| evenness(d) * (candidate + 8) >= n) {
                break;
            }
        }
        best.filter(|&d| evenness(d) >= 2)
    }

    /// Corners that are seen from corner `i` near the vertical, on either side of it; none if no looks are left.
    fn seen_from(&self, i: usize, up: f64, looks: &mut usize) -> Option<[Option<usize>; 2]> {
        let n = self.points.len();
        let from = self.points[i];
        if !self.opens_towards(i, from + DVec2::new(0.0, up)) {
            return Some([None; 2]);
        }
        *looks = looks.checked_sub(3 * n)?;
        let Some((edge, y)) = self.first_met(i, up) else {
            return Some([None; 2]);
        };
        let met = DVec2::new(from.x, y);
        Some([edge, edge + 1].map(|end| self.nearest_to_vertical(i, met, end % n)))
    }

    /// Whether the way from corner `i` towards a point begins inside.
    fn opens_towards(&self, i: usize, to: DVec2) -> bool {
        let n = self.points.len();
        let corner = self.points[i];
        let [before, after, way] =
            [self.points[(i + n - 1) % n], self.points[(i + 1) % n], to].map(|p| p - corner);
        let left_of_after = after.perp_dot(way) > 0.0;
        let right_of_before = way.perp_dot(before) > 0.0;
        match after.perp_dot(before) > 0.0 {
            true => left_of_after && right_of_before,
            false => left_of_after || right_of_before,
        }
    }

    /// The edge that is first met from corner `i` straight up (1) or down (-1), by its first corner, and where.
    fn first_met(&self, i: usize, up: f64) -> Option<(usize, f64)> {
        let n = self.points.len();
        let from = self.points[i];
        let mut first: Option<(usize, f64)> = None;
        for (k, &a) in self.points.iter().enumerate() {
            let b = self.points[if k + 1 == n { 0 } else { k + 1 }];
            if (a.x <= from.x) == (b.x <= from.x) || k == i || (k + 1) % n == i {
                continue;
            }
            let y = a.y + (b.y - a.y) * ((from.x - a.x) / (b.x - a.x));
            let above = (y - from.y) * up;
            if above > 0.0 && first.is_none_or(|(_, y)| above < (y - from.y) * up) {
                first = Some((k, y));
            }
        }
        first
    }

    /// In the triangle of corner `i`, the point met and the corner `end`: the corner nearest in angle to the vertical.
    fn nearest_to_vertical(&self, i: usize, met: DVec2, end: usize) -> Option<usize> {
        let n = self.points.len();
        let from = self.points[i];
        let (vertical, side) = (met - from, self.points[end] - from);
        let turn = vertical.perp_dot(side).signum();
        let along = self.points[end] - met;
        let is_neighbour = |k: usize| (i + 1) % n == k || (k + 1) % n == i;
        let mut nearest = end;
        for (k, &p) in self.points.iter().enumerate() {
            let way = p - from;
            let beside = vertical.perp_dot(way) * turn < 0.0;
            let beyond = along.perp_dot(p - met) * turn < 0.0;
            if beside || beyond || way == DVec2::ZERO {
                continue;
            }
            let best = self.points[nearest] - from;
            let nearer = way.perp_dot(best) * turn;
            let shorter = way.length_squared() < best.length_squared();
            // Of corners in one place the one whose inside is here.
            if (nearer > 0.0 || nearer == 0.0 && shorter)
                && (is_neighbour(k) || self.opens_towards(k, from))
            {
                nearest = k;
            }
        }
        let seen = !is_neighbour(nearest)
            && self.points[nearest] != from
            && self.opens_towards(i, self.points[nearest])
            && self.opens_towards(nearest, from);
        seen.then_some(nearest)
    }
}
