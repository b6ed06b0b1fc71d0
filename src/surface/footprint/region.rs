//! The sum of a triangle and a square, against boxes.

use glam::DVec2;

use super::SLACK;

/// The points at most 1 + [`SLACK`] from a triangle in both directions.
///
/// Its outline has the directions of the triangle's sides and of the axes, so by the separating axis theorem a point is in
/// it where it is between two bounds along the normals of these. That holds for a triangle of no area too.
pub struct Region {
    /// Its bounds.
    pub low: DVec2,
    pub high: DVec2,
    sides: [Side; 3],
}

/// The points between two parallel lines.
#[derive(Clone, Copy)]
struct Side {
    /// Not unit.
    normal: DVec2,
    /// 1 / normal.x.
    per_x: f64,
    /// Bounds of normal . p.
    least: f64,
    most: f64,
}

/// How a box lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meets {
    /// Wholly inside.
    Inside,
    /// Wholly outside.
    Outside,
    /// Neither, or outside but near a corner of the region.
    Partly,
}

impl Region {
    pub fn new(corners: [DVec2; 3]) -> Self {
        let (low, high) = super::bounds(corners);
        let reach = 1.0 + SLACK;
        let side = |k: usize| {
            let normal = (corners[(k + 1) % 3] - corners[k]).perp();
            let along = corners.map(|p| normal.dot(p));
            let reach = reach * normal.abs().element_sum();
            let least = along[0].min(along[1]).min(along[2]);
            let most = along[0].max(along[1]).max(along[2]);
            Side {
                normal,
                per_x: normal.x.recip(),
                least: least - reach,
                most: most + reach,
            }
        };
        Self {
            low: low - reach,
            high: high + reach,
            sides: [side(0), side(1), side(2)],
        }
    }

    /// How the finite box `low..=high` lies; for a point the answer is exact and never `Partly`.
    pub fn meets(&self, low: DVec2, high: DVec2) -> Meets {
        if !(low.cmple(self.high).all() && high.cmpge(self.low).all()) {
            return Meets::Outside;
        }
        let mut inside = low.cmpge(self.low).all() && high.cmple(self.high).all();
        let (centre, half) = (0.5 * (low + high), 0.5 * (high - low));
        for &Side {
            normal,
            least,
            most,
            ..
        } in &self.sides
        {
            let (at, reach) = (normal.dot(centre), normal.abs().dot(half));
            if at + reach < least || at - reach > most {
                return Meets::Outside;
            }
            inside &= at - reach >= least && at + reach <= most;
        }
        if inside { Meets::Inside } else { Meets::Partly }
    }

    /// First and last x of the region at height y; the first is greater where there is none.
    pub fn row(&self, y: f64) -> [f64; 2] {
        const NONE: [f64; 2] = [1.0, 0.0];
        if y < self.low.y || y > self.high.y {
            return NONE;
        }
        let (mut first, mut last) = (self.low.x, self.high.x);
        for side in &self.sides {
            let at = side.normal.y * y;
            let (least, most) = (side.least - at, side.most - at);
            if side.normal.x != 0.0 {
                let (a, b) = (least * side.per_x, most * side.per_x);
                (first, last) = (first.max(a.min(b)), last.min(a.max(b)));
            } else if least > 0.0 || most < 0.0 {
                return NONE;
            }
        }
        [first, last]
    }
}

/// The triangle's extent in x between two heights y, which may be infinite.
pub fn extent(corners: [DVec2; 3], low: f64, high: f64) -> Option<[f64; 2]> {
    let mut extent: Option<[f64; 2]> = None;
    let mut include = |x: f64| extent = Some(extent.map_or([x, x], |[a, b]| [a.min(x), b.max(x)]));
    for (p, q) in [
        (corners[0], corners[1]),
        (corners[1], corners[2]),
        (corners[2], corners[0]),
    ] {
        if p.y >= low && p.y <= high {
            include(p.x);
        }
        for y in [low, high] {
            let part = (y - p.y) / (q.y - p.y);
            if (0.0..=1.0).contains(&part) {
                include(p.x + part * (q.x - p.x));
            }
        }
    }
    extent
}
