//! What can be proven of the roots in one rectangle of (u, v).

use glam::{DMat2, DVec2, DVec3};
use prismarch::surface::Patch;

use super::Line;
use super::heights::Heights;
use super::interval::Interval;

/// A rectangle of barycentric coordinates (u, v).
#[derive(Clone, Copy, Debug)]
pub struct Rectangle {
    pub middle: DVec2,
    pub radius: DVec2,
}

/// What is known of a rectangle's roots.
pub enum Verdict {
    /// There is none.
    Nothing,
    /// There is one and only one; it may lie a little outside.
    One(DVec2),
    /// All are in this smaller rectangle.
    Less(Rectangle),
    Unknown,
}

/// One patch seen along one ray.
pub struct View<'a> {
    patch: &'a Patch<'a>,
    heights: &'a Heights,
    origin: DVec3,
    direction: DVec3,
    /// dP/du and dP/dv, dN'/du and dN'/dv, dst/du and dst/dv in texels.
    edges: [DVec3; 2],
    bends: [DVec3; 2],
    texels: [DVec2; 2],
    /// Rounding of F.
    slack: f64,
}

impl<'a> View<'a> {
    pub fn new(patch: &'a Patch<'a>, heights: &'a Heights, line: &Line) -> Self {
        let (v, n, st) = (&patch.vertices, &patch.normals, &patch.texels);
        let direction = line.direction.normalize();
        let origin = line.origin;
        // The ray's point nearest to the triangle serves as well, and loses fewer digits.
        let origin = origin + (v[0] - origin).dot(direction) * direction;
        let reach = v[0].abs().max_element().max((v[0] - origin).length());
        Self {
            patch,
            heights,
            origin,
            direction,
            edges: [v[1] - v[0], v[2] - v[0]],
            bends: [n[1] - n[0], n[2] - n[0]],
            texels: [st[1] - st[0], st[2] - st[0]],
            slack: 1e-15 * (reach + heights.range().magnitude()),
        }
    }

    /// Both halves across the side that is longer in space and in the map.
    pub fn halves(&self, rectangle: &Rectangle) -> [Rectangle; 2] {
        let share = |lengths: [f64; 2]| {
            let longest = lengths[0].max(lengths[1]);
            let part = |x: f64| if longest > 0.0 { x / longest } else { 1.0 };
            DVec2::from(lengths.map(part))
        };
        let weight = share(self.edges.map(DVec3::length)) + share(self.texels.map(DVec2::length));
        let long = weight * rectangle.radius;
        let mut radius = rectangle.radius;
        let mut shift = DVec2::ZERO;
        let axis = usize::from(long.y > long.x);
        radius[axis] *= 0.5;
        shift[axis] = radius[axis];
        [-1.0, 1.0].map(|side| Rectangle {
            middle: rectangle.middle + side * shift,
            radius,
        })
    }

    pub fn judge(&self, rectangle: &Rectangle) -> Verdict {
        // A root on the border of two rectangles is inside both when they overlap.
        const OVERLAP: f64 = 1.1;
        let (c, r) = (rectangle.middle, OVERLAP * rectangle.radius);
        let raw_normal = self.patch.normal(c.x, c.y);
        let length = raw_normal.length();
        let turn = r.x * self.bends[0].length() + r.y * self.bends[1].length();
        if turn >= 0.5 * length {
            return self.judge_by_reach(c, r);
        }
        let normal = raw_normal / length;
        let normal_radius = turn / (length - turn);
        let axes = self.axes(normal);
        let reach = |f: fn(DVec2) -> f64| r.x * f(self.texels[0]) + r.y * f(self.texels[1]);
        let texel_radius = DVec2::new(reach(|t| t.x.abs()), reach(|t| t.y.abs()));
        let bounds = self
            .heights
            .bounds(self.patch.texel(c.x, c.y), texel_radius);
        let point = self.patch.point(c.x, c.y);
        let rise = bounds.dx.magnitude() * texel_radius.x + bounds.dy.magnitude() * texel_radius.y;
        let d = bounds
            .d
            .and(Interval::around(point.displacement, rise + self.slack));

        // Bounds of F by what P and D can reach.
        let base = self.patch.base(c.x, c.y) - self.origin;
        for axis in axes {
            let lean = Interval::around(axis.dot(normal), normal_radius);
            let spread = r.x * axis.dot(self.edges[0]).abs() + r.y * axis.dot(self.edges[1]).abs();
            let f = Interval::around(axis.dot(base), spread) + d * lean;
            if f.excludes_zero(self.slack) {
                return Verdict::Nothing;
            }
        }

        // The Jacobian's: dS = dP + dD N + D/|N'| (dN' - N (N . dN')).
        let bend = d * Interval {
            low: 1.0 / (length + turn),
            high: 1.0 / (length - turn),
        };
        let entry = |axis: DVec3, k: usize| {
            let slope = bounds.dx * self.texels[k].x + bounds.dy * self.texels[k].y;
            let lean = Interval::around(axis.dot(normal), normal_radius);
            let across = self.bends[k] - normal * normal.dot(self.bends[k]);
            let across = Interval::around(
                axis.dot(across),
                2.0 * normal_radius * self.bends[k].length(),
            );
            Interval::point(axis.dot(self.edges[k])) + slope * lean + bend * across
        };
        let jacobian = axes.map(|axis| [entry(axis, 0), entry(axis, 1)]);
        let at_middle = DVec2::from(axes.map(|axis| axis.dot(point.position - self.origin)));
        let side = [Interval::around(0.0, r.x), Interval::around(0.0, r.y)];
        for (row, f) in jacobian.iter().zip(at_middle.to_array()) {
            let f = Interval::point(f) + row[0] * side[0] + row[1] * side[1];
            if f.excludes_zero(self.slack) {
                return Verdict::Nothing;
            }
        }
        self.krawczyk(rectangle, r, &jacobian, at_middle, axes)
    }

    /// K = c - Y F(c) + (1 - Y J)(X - c): holds all roots of X; inside X there is exactly one.
    fn krawczyk(
        &self,
        rectangle: &Rectangle,
        r: DVec2,
        jacobian: &[[Interval; 2]; 2],
        at_middle: DVec2,
        axes: [DVec3; 2],
    ) -> Verdict {
        let middles = jacobian.map(|row| row.map(Interval::middle));
        let middle = DMat2::from_cols_array_2d(&middles).transpose();
        let inverse = middle.inverse();
        if !inverse.is_finite() {
            return Verdict::Unknown;
        }
        let step = -(inverse * at_middle);
        let mut inside = true;
        let mut rest = [Interval::NONE; 2];
        for i in 0..2 {
            let y = inverse.row(i);
            let mut k = Interval::point(step[i]);
            for j in 0..2 {
                let product = jacobian[0][j] * y.x + jacobian[1][j] * y.y;
                let unit = if i == j { 1.0 } else { 0.0 };
                k = k + (Interval::point(unit) - product) * Interval::around(0.0, r[j]);
            }
            inside &= k.magnitude() < r[i];
            rest[i] = k.and(Interval::around(0.0, r[i]));
            if rest[i].low > rest[i].high + 1e-15 {
                return Verdict::Nothing;
            }
        }
        let c = rectangle.middle;
        if inside {
            return Verdict::One(self.root(c + step, inverse, axes));
        }
        let radius = DVec2::from(rest.map(|k| 0.5 * (k.high - k.low).max(0.0)));
        if (radius / r).min_element() < 0.4 && radius.max_element() > 0.0 {
            let middle = c + DVec2::from(rest.map(Interval::middle));
            // Never flat, lest it stop overlapping what is around it.
            let radius = radius.max(1e-6 * r);
            return Verdict::Less(Rectangle { middle, radius });
        }
        Verdict::Unknown
    }

    /// Simplified Newton iteration: within a rectangle that is proven it contracts.
    fn root(&self, mut b: DVec2, inverse: DMat2, axes: [DVec3; 2]) -> DVec2 {
        // On a line between cells it may swing from one to the other and contract slowly.
        for _ in 0..1000 {
            let miss = self.patch.point(b.x, b.y).position - self.origin;
            let step = inverse * DVec2::from(axes.map(|axis| axis.dot(miss)));
            b -= step;
            if step.abs().max_element() < 1e-14 {
                break;
            }
        }
        b
    }

    /// Where normals turn so far that their direction is anybody's guess: S is within |D| of the triangle.
    fn judge_by_reach(&self, c: DVec2, r: DVec2) -> Verdict {
        let base = self.patch.base(c.x, c.y) - self.origin;
        let spread = r.x * self.edges[0].length() + r.y * self.edges[1].length();
        let away = base.cross(self.direction).length();
        if away > spread + self.heights.range().magnitude() {
            Verdict::Nothing
        } else {
            Verdict::Unknown
        }
    }

    /// Two unit vectors across the ray; D moves S along the first only.
    fn axes(&self, normal: DVec3) -> [DVec3; 2] {
        let second = self.direction.cross(normal);
        let second = if second.length() > 1e-6 {
            second.normalize()
        } else {
            self.direction.any_orthonormal_vector()
        };
        [second.cross(self.direction), second]
    }
}
