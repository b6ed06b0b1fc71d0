//! Where a path is inside the prism: between its three sides.
//!
//! A side of the parallel offset prism is a bilinear patch (the paper takes Reshetov's intersection, Ray Tracing
//! Gems ch. 8). In the path's terms the ray meets the side opposite vertex i where Q_i(s) = 0, a quadratic, and
//! is inside where all Q_i >= 0. All real roots count: a ray may leave through a bent side and come back.

use glam::{BVec4A, Vec4};

use super::path::Path;

/// Intervals of s, in order; a ray is inside at most four times (six roots and the two ends).
pub struct Inside {
    intervals: [[f32; 2]; 4],
    count: usize,
}

impl Inside {
    /// The intervals.
    #[inline(always)]
    pub fn intervals(&self) -> &[[f32; 2]] {
        &self.intervals[..self.count]
    }

    #[inline(always)]
    fn one(from: f32, to: f32) -> Self {
        let mut inside = Self {
            intervals: [[0.0; 2]; 4],
            count: 0,
        };
        inside.push(from, to);
        inside
    }

    #[inline(always)]
    fn push(&mut self, from: f32, to: f32) {
        if from < to {
            self.intervals[self.count] = [from, to];
            self.count += 1;
        }
    }
}

/// The parts of a path inside the prism, widened by the path's margin.
#[inline(always)]
pub fn inside(path: &Path) -> Inside {
    let [c0, c1, c2] = [path.areas[0] + path.margin, path.areas[1], path.areas[2]];
    let roots = roots(c0, c1, c2);
    let (zero, one) = (Vec4::ZERO, Vec4::ONE);
    let within = |r: Vec4| r.cmpgt(zero) & r.cmplt(one);
    let (first, second) = (within(roots.first), within(roots.second));
    // Two roots on the path of one upward parabola cut the inside in two: the general case.
    let split = first & second & !c2.cmplt(zero) & roots.real;
    if split.bitmask() & 7 != 0 {
        return general(c0, c1, c2, &roots);
    }
    let downward = c2.cmplt(zero);
    // Downward: inside between the roots. Upward: outside between the roots.
    let from = Vec4::select(
        downward,
        roots.first,
        Vec4::select(second, roots.second, zero),
    );
    let to = Vec4::select(
        downward,
        roots.second,
        Vec4::select(first, roots.first, one),
    );
    let from = Vec4::select(roots.real, from, zero);
    let to = Vec4::select(roots.real, to, one);
    let covers_path = roots.first.cmple(zero) & roots.second.cmpge(one);
    let outside = (roots.real & !downward & covers_path) | (!roots.real & c0.cmplt(zero));
    if outside.bitmask() & 7 != 0 {
        return Inside::one(1.0, 0.0);
    }
    Inside::one(
        from.truncate().max_element().max(0.0),
        to.truncate().min_element().min(1.0),
    )
}

/// Roots of three quadratics in ascending order; where not real, the other lanes mean nothing.
struct Roots {
    first: Vec4,
    second: Vec4,
    real: BVec4A,
}

/// The stable formula: q = -(c1 + sign(c1) sqrt(discriminant)) / 2, roots q/c2 and c0/q. A root at infinity (a
/// linear quadratic) comes out infinite, and compares as such.
#[inline(always)]
fn roots(c0: Vec4, c1: Vec4, c2: Vec4) -> Roots {
    let discriminant = c1 * c1 - 4.0 * c0 * c2;
    let real = discriminant.cmpge(Vec4::ZERO);
    let root = discriminant.max(Vec4::ZERO).sqrt().copysign(c1);
    let q = -0.5 * (c1 + root);
    // A vanishing quadratic coefficient keeps the sign that tells upward from downward.
    let tiny = Vec4::splat(f32::MIN_POSITIVE);
    let c2 = Vec4::select(c2.cmpeq(Vec4::ZERO), tiny, c2);
    let q = Vec4::select(q.cmpeq(Vec4::ZERO), tiny, q);
    let (a, b) = (q / c2, c0 / q);
    Roots {
        first: a.min(b),
        second: a.max(b),
        real,
    }
}

/// Sorts all roots and keeps the stretches whose middle is inside.
#[cold]
fn general(c0: Vec4, c1: Vec4, c2: Vec4, roots: &Roots) -> Inside {
    let mut cuts = [1.0; 8];
    cuts[0] = 0.0;
    let mut count = 1;
    for i in (0..3).filter(|i| roots.real.test(*i)) {
        for root in [roots.first[i], roots.second[i]] {
            if root > 0.0 && root < 1.0 {
                cuts[count] = root;
                count += 1;
            }
        }
    }
    cuts[1..count].sort_unstable_by(f32::total_cmp);
    let mut inside = Inside::one(1.0, 0.0);
    for pair in cuts[..count + 1].windows(2) {
        let middle = 0.5 * (pair[0] + pair[1]);
        let q = c0 + middle * (c1 + middle * c2);
        if q.truncate().cmpge(glam::Vec3::ZERO).all() {
            match inside
                .count
                .checked_sub(1)
                .map(|last| &mut inside.intervals[last])
            {
                Some(last) if last[1] == pair[0] => last[1] = pair[1],
                _ => inside.push(pair[0], pair[1]),
            }
        }
    }
    inside
}
